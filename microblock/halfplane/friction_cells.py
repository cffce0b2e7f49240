"""Cells for a history of frictional contact, small at singular places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..model.problem import Problem
from ..model.types import Array

SAMPLED = 400  # places to either side of a feature and between, at which sizes are looked at
NEAREST = 1e-9  # of the half-width, next to a feature


@dataclass(frozen=True)
class Feature:
    """A place, known to `band`, with cells of the length `smallest`, or `growth` times the distance."""

    place: float
    band: float
    smallest: float
    growth: float = np.inf


def cells(
    problem: Problem, fineness: float, features: Sequence[Feature], reach: tuple[float, float] | None
) -> Array:
    """Returns left and right edges of cells on all that could touch, array (n, 2), of the length fineness
    sqrt(r a) at the distance r from a feature, a the half-width of a classical contact.
    """
    assert problem.picture is not None
    a = problem.picture.half_width
    found = [np.empty((0, 2))]
    for left, right in problem.stretches:
        inner = [place for place in fixed(problem) if left < place < right]
        own = [each for each in features if left < each.place < right]
        grid, steps = np.linspace(left, right, SAMPLED), np.geomspace(NEAREST * a, right - left, SAMPLED)
        places = [each.place + sign * steps for each in own for sign in (-1, 1)]
        x = np.unique(np.clip(np.concatenate((grid, inner, *places)), left, right))
        # two cells on a piece of the obstacle's picture, half as long as the way from it
        pieces = np.array([problem.scale(place, place, 0.5) for place in grid]) / 2
        size = np.minimum(_size(x, a, fineness, own, reach), np.interp(x, grid, np.maximum(pieces, 2e-4 * a)))
        count = np.concatenate(([0.0], np.cumsum(np.diff(x) / np.sqrt(size[1:] * size[:-1]))))
        ends = [left, *inner, right]
        for pair in pairwise(ends):
            begin, end = np.interp(pair, x, count)
            edges = np.interp(np.linspace(begin, end, max(int(np.ceil(end - begin)), 1) + 1), count, x)
            edges[[0, -1]] = pair
            found.append(np.column_stack((edges[:-1], edges[1:])))
    made = np.concatenate(found)
    return made[made[:, 1] > made[:, 0]]


def _size(
    x: Array, a: float, fineness: float, features: list[Feature], reach: tuple[float, float] | None
) -> Array:
    size = np.full(len(x), fineness * a if reach is None else np.inf)
    for each in features:
        away = np.maximum(np.abs(x - each.place) - each.band, 0.0)
        longest = np.minimum(fineness * np.sqrt(away * a), each.growth * np.maximum(away, NEAREST * a))
        size = np.minimum(size, np.hypot(longest, each.smallest))
    if reach is not None:
        size = np.maximum(size, 0.4 * np.maximum(np.maximum(reach[0] - x, x - reach[1]), 0.0))
    return size


def fixed(problem: Problem) -> list[float]:
    """Returns contact points of corners under slope discontinuities or edges."""
    ends = [place for pair in problem.ends.values() for place in pair]
    return sorted({*problem.kinks, *ends})


def touching(problem: Problem, fineness: float) -> list[Feature]:
    """Returns features at `fixed` places and at the first touch of each corner."""
    assert problem.picture is not None
    a = problem.picture.half_width
    first = [Feature(problem.picture.lowest + shift, 0.0, fineness**2 * a / 4) for shift in problem.shifts]
    return first + [Feature(each, 0.0, fineness**2 * a / 100, 3 * fineness) for each in fixed(problem)]
