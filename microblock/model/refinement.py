"""Levels of refinement."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from .progress import counted

Level = TypeVar("Level")
Result = TypeVar("Result")


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
