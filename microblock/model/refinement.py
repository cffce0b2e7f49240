"""Levels of refinement, and where they end."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from ..errors import NotConverged
from .progress import counted

SECONDS = 3.0  # of one core, that a further level may be expected to take if no rtol was asked for

Level = TypeVar("Level")
Result = TypeVar("Result")


class Usual(float):
    """The usual rtol of a method, aimed at where none was asked for: the best that about a second gives is
    returned if it is not reached.
    """


def is_last(rtol: float, cannot_reach: bool, seconds: float) -> bool:
    """Returns whether no further level is tried: as none would reach an rtol that was asked for, or, where
    none was asked for, as the next one is expected to take so many seconds.
    """
    return seconds > SECONDS if isinstance(rtol, Usual) else cannot_reach


def best_or_raise(rtol: float, best: Result | None, failure: NotConverged) -> Result:
    """Returns the best result that missed an rtol; raises the failure if the rtol was asked for, or if there
    is no result.
    """
    if best is None or not isinstance(rtol, Usual):
        raise failure
    return best


def levels(
    solve: Callable[[Level, Result | None], Result],
    sizes: Iterable[Level],
    change: Callable[[Result, Result], float],
) -> Iterator[tuple[Level, Result, Any, list[float]]]:
    """Yields (level, result, result before, changes so far) of levels `sizes`, coarse to fine, which a bar
    counts: `solve` returns the result on one, from the result before or None, and `change` the
    relative change from one result to the next.
    """
    before, changes = None, list[float]()
    for number, level in enumerate(sizes, 1):
        counted(level=number)
        result = solve(level, before)
        if before is not None:
            changes.append(change(before, result))
        yield level, result, before, changes
        before = result
