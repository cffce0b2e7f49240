"""A function known by its values alone, as polynomials on pieces.

Pieces on which a polynomial of degree NODES - 1 does not follow are halved (as chebfun does: Battles and
Trefethen, SIAM J. Sci. Comput. 25 (2004) 1743); with a singular point inside none is short enough. What is
narrower than the samples of the first intervals, and changes nothing at them, is not seen.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.chebyshev import chebpts2, chebval, chebvander

from ..errors import MicroblockError
from .types import Array, Flags, Function

NODES = 14
LOST = 1e-5  # of all intervals: singular points nearer to each other are one
HALF = 0.5137  # not 1/2: a singular point at a round number shall fall into one of the halves

_points = chebpts2(NODES)
_places = np.concatenate((_points, (_points[1:] + _points[:-1]) / 2))  # samples of a piece, in [-1, 1]
# of the polynomial through those at _points
_coefficients = np.linalg.inv(chebvander(_points, NODES - 1))
_between = chebvander(_places[NODES:], NODES - 1) @ _coefficients  # its values at the other samples


class TooRough(MicroblockError):
    """A function is noise, or needs too many pieces."""


@dataclass(frozen=True)
class Proxy:
    """Pieces of a function.

    Attributes
    ----------
    edges : array (n + 1,)
        Edges of the pieces, ascending.
    singular, jumps, powers : arrays (k,)
        Places, ascending, at which a derivative jumps or has no bound, or the function jumps or ends; jump of
        the slope; and power p of ``abs(x - place)**p``. Both are nan where the function jumps or ends.
    samples, values : arrays (m,)
        Places, ascending, of evaluations, and values, inf where there is none.
    """

    edges: Array
    singular: Array
    jumps: Array
    powers: Array
    samples: Array
    values: Array

    @property
    def lengths(self) -> Array:
        """Lengths of the pieces, array (n,); inf within two and a half lengths of a singular point."""
        lengths = np.diff(self.edges)
        middle, least = (self.edges[1:] + self.edges[:-1]) / 2, LOST * (self.edges[-1] - self.edges[0])
        near = np.abs(middle[:, None] - self.singular).min(axis=1, initial=np.inf)
        return np.where(near <= np.maximum(2.5 * lengths, least), np.inf, lengths)


def proxy(function: Function, edges: Array, floor: float = 0.0, known: Iterable[float] = ()) -> Proxy:
    """Returns the Proxy of a function of arrays on intervals between `edges` that are short enough for what
    shall be seen; `floor` is an error per length that does not matter, `known` are singular places inside.
    Raises TooRough if there are too many pieces or singular points.
    """
    x = np.unique(_spread(edges[:-1], edges[1:]))
    h = _values(function, x)
    given = [*known, *_ends(function, x, np.isfinite(h))]
    # features that the first intervals show are wider: a shorter piece has a singular point
    whole, narrow, budget = edges[-1] - edges[0], np.median(np.diff(edges)) / 64, 8000
    cuts = np.unique((edges[0], *given, edges[-1]))
    left, right = cuts[:-1], cuts[1:]
    done: list[tuple[Array, Array]] = []
    places = [(0.0, place) for place in given]  # (length of the piece that has it, place)
    while len(left):
        short = right - left < narrow
        rough = _rough(function, left, right, x, h, np.where(short, 0.0, floor)) > 1
        short &= rough
        budget -= len(left)
        if budget < 0 or np.count_nonzero(short) > 200:
            raise TooRough(f"it changes ever more quickly, next to x = {left[0]:.4g}")
        places += _pinned(function, left[short], right[short], 1e-10 * whole)
        done.append((left[~rough | short], right[~rough | short]))
        left, right = left[rough & ~short], right[rough & ~short]
        middle = left + HALF * (right - left)
        left, right = np.sort((*left, *middle)), np.sort((*middle, *right))
    singular: list[float] = []
    for length, place in sorted(places):  # those that are known best come first
        if all(abs(place - other) > max(LOST * whole, 2 * length) for other in singular):
            singular.append(float(place))
    singular.sort()
    left, right = (np.sort(np.concatenate(each)) for each in zip(*done))
    samples = np.unique(_spread(left, right))
    beside = [
        _at_singular(function, place, [other for other in singular if other != place], whole, place in given)
        for place in singular
    ]
    at, jumps, powers = np.reshape(beside, (-1, 3)).T
    return Proxy(np.append(left, right[-1]), at, jumps, powers, samples, _values(function, samples))


def _spread(left: Array, right: Array) -> Array:
    return (left[:, None] * (1 - _places) + right[:, None] * (1 + _places)) / 2


def _values(function: Function, x: Array) -> Array:
    values = np.asarray(function(x), float)
    return np.where(np.isfinite(values), values, np.inf)


def _ends(function: Function, x: Array, there: Flags) -> list[float]:
    ends = []
    for i in np.flatnonzero(there[1:] != there[:-1]):
        inside, outside = (x[i], x[i + 1]) if there[i] else (x[i + 1], x[i])
        while inside != (middle := (inside + outside) / 2) != outside:
            known = np.isfinite(function(np.array([middle]))[0])
            inside, outside = (middle, outside) if known else (inside, middle)
        ends.append(float(inside))
    return ends


def _rough(
    function: Function, left: Array, right: Array, x: Array, h: Array, floor: Array | float = 0.0
) -> Array:
    """Returns the error of a polynomial on each piece, also at the samples x with the values h, over what
    rounding and 1e-8 of the change allow.
    """
    values = _values(function, _spread(left, right).ravel()).reshape(-1, len(_places))
    there = np.isfinite(values)
    values[~there] = 0.0
    series = values[:, :NODES] @ _coefficients.T
    error = np.abs(values[:, :NODES] @ _between.T - values[:, NODES:]).max(axis=1)
    error[~there.all(axis=1)] = np.inf
    change, length, eps = np.ptp(values, axis=1), right - left, np.finfo(float).eps
    place = np.maximum(np.abs(left), np.abs(right)) / length
    allowed = (1e-8 + 4 * eps * place) * change + 40 * eps * np.abs(values).max(axis=1) + floor * length
    piece = np.maximum(np.searchsorted(left, x, side="right") - 1, 0)
    inside = (error <= allowed)[piece] & (left[piece] <= x) & (x <= right[piece]) & np.isfinite(h)
    piece = piece[inside]
    along = (2 * x[inside] - left[piece] - right[piece]) / length[piece]
    np.maximum.at(error, piece, np.abs(chebval(along, series.T[:, piece], tensor=False) - h[inside]))
    error[there.mean(axis=1) < 0.6] = 0.0  # nothing there but at an end of the piece, perhaps
    return cast(Array, error / np.maximum(allowed, 1e-300))


def _pinned(function: Function, left: Array, right: Array, least: float) -> list[tuple[float, float]]:
    """Returns (length of the last piece, place) of singular points, by halving."""
    nothing, settled = np.empty(0), np.zeros(len(left), bool)
    while True:
        middle = left + HALF * (right - left)
        halves = np.concatenate((left, middle)), np.concatenate((middle, right))
        lower, upper = _rough(function, *halves, nothing, nothing).reshape(2, -1)
        # where no half is rough the middle is singular, or rounding hides the rest
        settled |= (np.maximum(lower, upper) <= 1) | (right - left < least)
        if settled.all():
            return list(zip(right - left, middle))
        left, right = (
            np.where(~settled & (lower < upper), middle, left),
            np.where(~settled & (lower >= upper), middle, right),
        )


def _at_singular(
    function: Function, place: float, others: Iterable[float], whole: float, exact: bool
) -> tuple[float, float, float]:
    """Returns (place, jump of the slope, power of ``abs(x - place)**power``) of a singular point, from
    differences beside it: the jump is 0 if it shrinks with their step; jump and power are nan if it grows.
    """
    width = min([whole / 8, *(abs(other - place) / 4 for other in others)])

    def differences(step: float) -> tuple[float, float]:
        """Jump and mean of the slopes on either side."""
        farther, far, near, nearer = _values(function, place + step * np.array((-2.0, -1.0, 1.0, 2.0)))
        return (nearer - near - far + farther) / step, (near - far) / step

    with np.errstate(invalid="ignore", divide="ignore"):  # inf - inf
        (first, rise), (second, steep) = map(differences, width * np.array((1e-2, 1e-4)))
        power = 1 + np.log(abs(first / second)) / np.log(100)
    if not np.isfinite(first + second) or abs(steep) > 50 * (abs(rise) + abs(second)):
        return place, np.nan, np.nan
    if abs(second) <= 0.9 * abs(first):  # it shrinks with the step
        return place, 0.0, power
    meeting, jump = _meeting(function, place, 1e-3 * width)
    near = abs(meeting - place) < 1e-4 * width
    return meeting if near and not exact else place, jump if near else second, 1.0


def _meeting(function: Function, place: float, width: float) -> tuple[float, float]:
    """Returns where polynomials through 6 points of either side meet, and the jump of their slopes."""
    x = 0.05 + 0.95 * (1 + np.cos(np.pi * (np.arange(6) + 0.5) / 6)) / 2
    right, left = (
        np.polynomial.polynomial.polyfit(side * x, function(place + side * x * width), 5) for side in (1, -1)
    )
    apart, root = Polynomial(right - left), 0.0
    slope = apart.deriv()
    for _ in range(3):
        root -= apart(root) / slope(root)
    return float(place + root * width), float(slope(root) / width)
