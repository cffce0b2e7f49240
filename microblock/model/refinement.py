"""Ask for an accuracy, not for a mesh: discretisations are refined until the accuracy is reached."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from ..errors import out_of_reach, require_tolerance

Level = TypeVar("Level")
Result = TypeVar("Result")


def refine(
    solve: Callable[[Level], Result],
    levels: Iterable[Level],
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
    coarse: Result | None = None
    best = float("inf")
    for level in levels:
        fine = solve(level)
        if coarse is not None:
            estimate = distance(coarse, fine)
            if estimate <= rtol:
                return fine, estimate
            best = min(best, estimate)
        coarse = fine
    raise out_of_reach(rtol, best, load=load, besides="fix the discretisation instead")
