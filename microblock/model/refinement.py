"""Levels of refinement: each is solved from the one before, and compared with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from tqdm.auto import tqdm

from ..errors import out_of_reach, require_tolerance

Level = TypeVar("Level")
Result = TypeVar("Result")


def levels(
    solve: Callable[[Level, Result | None], Result],
    sizes: Sequence[Level],
    change: Callable[[Result, Result], float],
    progress: bool = False,
) -> Iterator[tuple[Level, Result, Any, list[float]]]:
    """Yields (level, result, result before, changes so far) of finer and finer levels.

    Parameters
    ----------
    solve : callable
        Returns the result on a level, from that on the level before, None on the first.
    sizes : sequence
        Levels, coarse to fine.
    change : callable
        Returns the relative change from one result to the next.
    progress : bool
        Whether a bar counts the levels.
    """
    before, changes = None, list[float]()
    for level in tqdm(sizes, unit=" levels", disable=not progress):
        result = solve(level, before)
        if before is not None:
            changes.append(change(before, result))
        yield level, result, before, changes
        before = result


def refine(
    solve: Callable[[Level], Result],
    sizes: Sequence[Level],
    distance: Callable[[Result, Result], float],
    rtol: float,
    load: float | None = None,
) -> tuple[Result, float]:
    """Solves on finer and finer levels until two neighbours agree to rtol; returns the finer result, and
    their relative `distance` as its error, which it bounds as long as a level at least halves the error.

    Raises NotConverged if the levels end before; `rtol_reached` is the smallest estimate, rounded up, and
    `load` stands in the message.
    """
    require_tolerance(rtol)
    changes = list[float]()
    for _, result, _, changes in levels(lambda level, _: solve(level), sizes, distance):
        if changes and changes[-1] <= rtol:
            return result, changes[-1]
    best = min(changes, default=float("inf"))
    raise out_of_reach(rtol, best, load=load, besides="fix the discretisation instead")
