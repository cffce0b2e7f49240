"""The bar of a computation that lasts: the loops of all methods move it, and `Contact` shows it."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from tqdm.auto import tqdm

_bar: ContextVar[Any] = ContextVar("bar", default=None)


@contextmanager
def counting(words: str, progress: bool) -> Iterator[None]:
    """Context whose steps a bar counts, if there is to be progress."""
    with tqdm(desc=words, unit=" steps", disable=not progress) as bar:
        token = _bar.set(bar)
        try:
            yield
        finally:
            _bar.reset(token)


def counted() -> None:
    """Counts a step of an iteration on the bar, where there is one."""
    if (bar := _bar.get()) is not None:
        bar.update()
