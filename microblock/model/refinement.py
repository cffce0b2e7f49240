"""Levels of refinement."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from tqdm.auto import tqdm

Level = TypeVar("Level")
Result = TypeVar("Result")


def levels(
    solve: Callable[[Level, Result | None], Result],
    sizes: Sequence[Level],
    change: Callable[[Result, Result], float],
    progress: bool = False,
) -> Iterator[tuple[Level, Result, Any, list[float]]]:
    """Yields (level, result, result before, changes so far) of levels `sizes`, coarse to fine, which a bar
    counts if `progress`: `solve` returns the result on one, from the result before or None, and `change` the
    relative change from one result to the next.
    """
    before, changes = None, list[float]()
    for level in tqdm(sizes, unit=" levels", disable=not progress):
        result = solve(level, before)
        if before is not None:
            changes.append(change(before, result))
        yield level, result, before, changes
        before = result
