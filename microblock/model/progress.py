"""The bar of a computation that lasts."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from tqdm.auto import tqdm

_bar: ContextVar[Any] = ContextVar("bar", default=None)


@contextmanager
def counting(words: str, progress: bool) -> Iterator[None]:
    with tqdm(desc=words, unit=" steps", disable=not progress) as bar:
        token = _bar.set(bar)
        try:
            yield
        finally:
            _bar.reset(token)


def counted() -> None:
    if (bar := _bar.get()) is not None:
        bar.update()
