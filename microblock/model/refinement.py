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
    """Solves on finer and finer refinement levels until two neighbours agree to rtol.

    The finer of the two is returned; their distance bounds its error as long as each level at least
    halves the error of the one before.

    Parameters
    ----------
    solve : callable
        Returns the result on a level.
    levels : iterable
        Refinement levels, coarse to fine.
    distance : callable
        Returns the relative difference of (coarse result, fine result).
    rtol : float
        Tolerance, between 0 and 1.
    load : float, optional
        Load at which that is, for the message.

    Returns
    -------
    result
        The finer of the two results.
    estimate : float
        Estimate of its relative error.

    Raises
    ------
    NotConverged
        If the levels end before rtol is reached; `rtol_reached` is the smallest estimate, rounded up.
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
