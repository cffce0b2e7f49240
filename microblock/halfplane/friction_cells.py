"""Cells for a history of frictional contact, small at singular places."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

SAMPLED = 400  # places to either side of a feature and between, at which sizes are looked at
NEAREST = 1e-9  # of the half-width, next to a feature


@dataclass(frozen=True)
class Feature:
    """A place, known to `band`, with cells of the length `smallest`; on all `scales` what is there varies."""

    place: float
    band: float
    smallest: float
    scales: bool = False


def cells(problem, fineness, features, reach=None):
    """Returns left and right edges of cells on all that could touch, array (n, 2), of the length fineness
    sqrt(r a) at the distance r from a feature, a the half-width of a classical contact, and 2 fineness r^.8
    a^.2 where all scales count (polygons of sqrt(r) and log(r)); beyond `reach`, an interval, they grow.
    """
    a, found = problem.candidates.half_width, []
    for left, right in problem.stretches:
        breaks = [left, *(place for place in fixed(problem) if left < place < right), right]
        own = [each for each in features if left < each.place < right]
        grid, steps = np.linspace(left, right, SAMPLED), np.geomspace(NEAREST * a, right - left, SAMPLED)
        places = [each.place + sign * steps for each in own for sign in (-1, 1)]
        x = np.unique(np.clip(np.concatenate((grid, breaks, *places)), left, right))
        # two cells on a piece of the obstacle's picture, half as long as the way from it
        pieces = np.array([problem.scale(place, place, 0.5) for place in grid]) / 2
        size = np.minimum(_size(x, a, fineness, own, reach), np.interp(x, grid, np.maximum(pieces, 2e-4 * a)))
        count = np.concatenate(([0.0], np.cumsum(np.diff(x) / np.sqrt(size[1:] * size[:-1]))))
        for pair in pairwise(breaks):
            begin, end = np.interp(pair, x, count)
            edges = np.interp(np.linspace(begin, end, max(int(np.ceil(end - begin)), 1) + 1), count, x)
            edges[[0, -1]] = pair
            found.append(np.column_stack((edges[:-1], edges[1:])))
    made = np.concatenate(found)
    return made[made[:, 1] > made[:, 0]]


def _size(x, a, fineness, features, reach):
    size = np.full(len(x), fineness * a if reach is None else np.inf)
    for each in features:
        away = np.maximum(np.abs(x - each.place) - each.band, 0.0)
        longest = fineness * a * np.sqrt(away / a)
        if each.scales:
            longest = np.minimum(longest, 2 * fineness * a * (away / a) ** 0.8)
        size = np.minimum(size, np.hypot(longest, each.smallest))
    return size if reach is None else np.maximum(size, 0.4 * np.maximum(reach[0] - x, x - reach[1]))


def fixed(problem):
    """Returns contact points of corners under slope discontinuities or edges."""
    ends = filter(np.isfinite, np.ravel(list(problem.ends.values())).tolist())
    return sorted({*problem.kinks, *ends})


def touching(problem, fineness):
    """Returns features at `fixed` places and at the first touch of each corner."""
    smallest, lowest = fineness**2 * problem.candidates.half_width / 4, problem.candidates.lowest
    first = [Feature(lowest + shift, 0.0, smallest, True) for shift in problem.shifts]
    return first + [Feature(each, 0.0, fineness**2 * smallest, True) for each in fixed(problem)]
