"""Cells for a history of frictional contact, small at singular places."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..model.problem import Problem
from ..model.types import Array, Interval

SIZE_SAMPLES = 400  # to either side of a feature and between, at which sizes of cells are looked at
NEAREST_SAMPLE = 1e-9  # of the half-width, next to a feature


@dataclass(frozen=True)
class Feature:
    """A place, known to `band`, with cells of the length `smallest`; on all `scales` what is there varies."""

    place: float
    band: float
    smallest: float
    scales: bool = False


def cells(
    problem: Problem, fineness: float, features: Sequence[Feature], reach: Interval | None = None
) -> Array:
    """Returns left and right edges of cells on all that could touch, array (n, 2), of the length fineness
    sqrt(r a) at the distance r from a feature, a the half-width of a classical contact, and 2 fineness r^.8
    a^.2 where all scales count (polygons of sqrt(r) and log(r)); beyond `reach`, an interval, they grow.
    """
    rows = []
    for left, right in problem.stretches:
        breaks = [left, *(place for place in singular_points(problem) if left < place < right), right]
        x, size = _sampled_sizes(problem, fineness, breaks, features, reach)
        count = np.concatenate(([0.0], np.cumsum(np.diff(x) / np.sqrt(size[1:] * size[:-1]))))
        for pair in pairwise(breaks):
            begin, end = np.interp(pair, x, count)
            edges = np.interp(np.linspace(begin, end, max(int(np.ceil(end - begin)), 1) + 1), count, x)
            edges[[0, -1]] = pair
            rows.append(np.column_stack((edges[:-1], edges[1:])))
    stacked = np.concatenate(rows)
    return stacked[stacked[:, 1] > stacked[:, 0]]


def _sampled_sizes(
    problem: Problem,
    fineness: float,
    breaks: Sequence[float],
    features: Sequence[Feature],
    reach: Interval | None,
) -> tuple[Array, Array]:
    """Returns places on a stretch, ascending, and lengths of cells there, arrays (n,)."""
    a = problem.candidates.half_width
    left = breaks[0]
    right = breaks[-1]
    within = [feature for feature in features if left < feature.place < right]
    grid = np.linspace(left, right, SIZE_SAMPLES)
    distances = np.geomspace(NEAREST_SAMPLE * a, right - left, SIZE_SAMPLES)
    beside = [feature.place + sign * distances for feature in within for sign in (-1, 1)]
    x = np.unique(np.clip(np.concatenate((grid, breaks, *beside)), left, right))
    # two cells on a piece on which heights are polynomials, half as long as the distance from it
    pieces = np.array([problem.scale(place, place, 0.5) for place in grid]) / 2
    longest = np.interp(x, grid, np.maximum(pieces, 2e-4 * a))
    return x, np.minimum(_size(x, a, fineness, within, reach), longest)


def _size(x: Array, a: float, fineness: float, features: Sequence[Feature], reach: Interval | None) -> Array:
    """Returns lengths of cells at x, array (n,), as features ask for."""
    size = np.full(len(x), fineness * a if reach is None else np.inf)
    for feature in features:
        r = np.maximum(np.abs(x - feature.place) - feature.band, 0.0)
        longest = fineness * a * np.sqrt(r / a)
        if feature.scales:
            longest = np.minimum(longest, 2 * fineness * a * (r / a) ** 0.8)
        size = np.minimum(size, np.hypot(longest, feature.smallest))
    if reach is not None:
        size = np.maximum(size, 0.4 * np.maximum(reach[0] - x, x - reach[1]))
    return size


def singular_points(problem: Problem) -> list[float]:
    """Returns contact points of corners under slope discontinuities or edges of the obstacle."""
    ends = np.ravel(list(problem.ends.values())).tolist()
    return sorted({*problem.kinks, *filter(np.isfinite, ends)})


def first_features(problem: Problem, fineness: float) -> list[Feature]:
    """Returns features at `singular_points` and at the first touch of each corner."""
    smallest = fineness**2 * problem.candidates.half_width / 4
    lowest = problem.candidates.lowest
    first = [Feature(lowest + shift, 0.0, smallest, True) for shift in problem.shifts]
    return first + [Feature(x, 0.0, fineness**2 * smallest, True) for x in singular_points(problem)]
