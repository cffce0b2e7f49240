"""The bar of a computation that lasts, and what is left of an interrupted one: no other module knows the
screen. Solvers call `counted` and `kept`; `counting` decides what is shown, the outermost one for all inside.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from tqdm import tqdm

from ..errors import Interrupted, require_kind

_bars: ContextVar[tuple[Any, ...]] = ContextVar("bars", default=())  # from the outermost on


@contextmanager
def counting(
    words: str,
    progress: bool | None = None,
    total: int | None = None,
    given: Callable[[Any], Any] = lambda best: best,
) -> Iterator[None]:
    """Context of a computation of so many steps, if that is known. A KeyboardInterrupt leaves it as
    Interrupted, with what `given` makes of the best result.

    Parameters
    ----------
    progress : bool or None
        Whether there is a bar; None: after a second, in a terminal or a notebook, without TQDM_DISABLE in the
        environment.

    Raises
    ------
    BadArgument
        If `progress` is something else.
    """
    require_kind((bool, np.bool_, type(None)), "True, False or None", progress=progress)
    unasked = progress is None and not os.environ.get("TQDM_DISABLE")
    # None: unless tqdm finds a terminal
    quiet = not progress if not unasked else False if "ipykernel" in sys.modules else None
    shown = {"delay": int(not progress), "disable": bool(_bars.get()) or quiet, "miniters": 0}
    with tqdm(desc=words, total=total, unit=" steps", **shown) as bar:
        bar.best, bar.facts, token = None, {}, _bars.set((*_bars.get(), bar))
        try:
            yield
        except KeyboardInterrupt as stop:
            reached = getattr(_bars.get()[0], "postfix", None) or "at the beginning"
            best = None if bar.best is None else given(bar.best)
            raise Interrupted(f"{words}: interrupted, {reached}", best) from stop
        finally:
            _bars.reset(token)


def counted(steps: int = 1, **facts: Any) -> None:
    """Counts steps of the computation, and shows facts in the place of those of the same name."""
    if bars := _bars.get():
        if facts:
            bars[0].facts |= facts
            bars[0].set_postfix(bars[0].facts, refresh=False)
        bars[0].update(steps if len(bars) == 1 else 0)


def kept(best: Any, **facts: Any) -> None:
    """Keeps the best result so far for an interruption, and shows facts."""
    if bars := _bars.get():
        bars[-1].best = best
    counted(0, **facts)
