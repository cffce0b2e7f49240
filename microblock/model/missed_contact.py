"""Contact that was missed: open corners that overlap the obstacle between the unknowns of a method.

Methods along a line look for it here, at sampled places of the obstacle (`Problem.sample_points`). An overlap
of depth d on a width w is worth ``E* d/sqrt(w)`` in L2 of the pressure.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .intervals import borders, runs
from .types import Array, Flags

PLACES = 20_000  # of a surface at least, at which it is looked at without candidates


@dataclass(frozen=True)
class Violation:
    """An interval in which a corner overlaps the obstacle (depth > 0, a length, the most at `place`), or is
    in tension (depth 0); `worth` is its part of the error.
    """

    corner: int
    left: float
    right: float
    depth: float
    worth: float
    place: float = np.nan


def overlaps(corner: int, x: Array, gaps: Array, unit: float, least: float = 0.0) -> Iterator[Violation]:
    """Yields the Violations of an open corner.

    Parameters
    ----------
    x, gaps : arrays (n,)
        Contact points, ascending, and the gaps there, nan where nothing is known.
    unit : float
        E*, or over the norm of the pressure: what a depth is worth over the root of its width.
    least : float
        Depth (length) that is rounding.
    """
    edges = borders(x)
    for first, last in runs(gaps < -least):
        left = float(edges[first])
        right = float(edges[last + 1])
        deepest = first + int(np.argmin(gaps[first : last + 1]))
        depth = -float(gaps[deepest])
        if right > left:
            worth = unit * depth / np.sqrt(right - left)
            yield Violation(corner, left, right, depth, float(worth), float(x[deepest]))


def log_tension(r: float, pressure: float, K: float, longest: float = np.inf) -> tuple[float, float]:
    """Returns the distance r0 up to which ``p = K log(r0/r)``, K < 0, is in tension, at most `longest`, from
    the pressure at a distance r; and what the tension on one side is worth in L2, sqrt(2 r0) |K|.
    """
    r0 = min(longest, float(r * np.exp(pressure / K)))
    return r0, float(np.sqrt(2 * r0) * abs(K))


def open_with_neighbours(closed: Flags) -> Flags:
    """Returns which cells, array (n,), are open as their neighbours are."""
    near = np.convolve(closed, np.ones(3), mode="same")
    return near < 0.5


def total_worth(violations: list[Violation]) -> float:
    """Returns what Violations are worth together."""
    return float(np.linalg.norm([violation.worth for violation in violations]))
