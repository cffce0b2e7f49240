"""A function known by its values alone, as polynomials on pieces: where it is smooth and where it ends.

Intervals on which a polynomial of degree NODES - 1 does not follow are halved, neighbours that one polynomial
serves are joined (the idea of chebfun: Battles and Trefethen, SIAM J. Sci. Comput. 25 (2004) 1743). A
polynomial follows a smooth function on intervals that are short enough, but one with a singular point on none
that has it inside. What is narrower than the samples of the first intervals, and changes nothing at them, is
not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.polynomial.chebyshev import chebpts2, chebval, chebvander

from ..errors import MicroblockError
from .types import Array, Flags, Function, Integers

NODES = 14
FOLLOWED = 1e-8  # of the change over an interval: error of a polynomial that follows
ROUNDING = 1e-14  # of the largest value
SHORTEST = 1e-10  # of all intervals together: one that is halved no more
# of the first intervals: features that they show are wider; where both halves of a shorter interval are
# smooth, rounding hides the rest of a singular point
NARROW = 1 / 64
LOST = 1e-5  # of all intervals: singular points nearer to each other are one
CROWD = (
    12  # unsmooth intervals nearer to each other are what rounding makes of one: of |exp(x) - 1| next to 0
)
MOST = 200  # unsmooth intervals shorter than NARROW at a time: more of them are noise
BUDGET = 8000  # pieces
HALF = 0.5137  # not 1/2: a singular point at a round number shall fall into one of the halves
GRADED = 2.5  # lengths of a piece within which a singular point is what made it short
SIDE = 6  # points beside a jump of the slope, through which either side's polynomial goes
KINK = 0.9  # a jump of the slope that shrinks by more on a hundredth of the way is none
STEP = 50  # ... and one that grows by as much is a step of the function

_points = chebpts2(NODES)
_places = np.concatenate((_points, (_points[1:] + _points[:-1]) / 2))  # samples of an interval, in [-1, 1]
# of the polynomial through those at _points
_coefficients = np.linalg.inv(chebvander(_points, NODES - 1))
_between = chebvander(_places[NODES:], NODES - 1) @ _coefficients  # its values at the other samples


class TooRough(MicroblockError):
    """A function is noise, or needs more pieces than the budget has."""


@dataclass(frozen=True)
class Proxy:
    """Pieces of a function.

    Attributes
    ----------
    edges : array (n + 1,)
        Edges of the pieces, ascending.
    singular : array (k,)
        Places, ascending, at which a derivative jumps or has no bound, or the function itself jumps or ends.
    jumps : array (k,)
        By how much the slope jumps at each; 0 where it does not, nan where the function itself jumps or ends.
    powers : array (k,)
        Approximate power of ``abs(x - place)**power`` there; 1 where the slope jumps, nan where the function
        does.
    samples, values : arrays (m,)
        Places, ascending, at which the function was evaluated, and its values there, inf where there is none.
    """

    edges: Array
    singular: Array
    jumps: Array
    powers: Array
    samples: Array
    values: Array

    @property
    def lengths(self) -> Array:
        """Lengths of the pieces, array (n,); inf where a piece is short only because a singular point is
        beside it.
        """
        lengths = np.diff(self.edges)
        if not len(self.singular):
            return lengths
        middle = (self.edges[1:] + self.edges[:-1]) / 2
        near = np.abs(middle[:, None] - self.singular).min(axis=1)
        least = LOST * (self.edges[-1] - self.edges[0])
        return np.where(near <= np.maximum(GRADED * lengths, least), np.inf, lengths)


def proxy(function: Function, edges: Array, floor: float = 0.0, known: Iterable[float] = ()) -> Proxy:
    """Returns the Proxy of a function on the intervals between `edges`.

    Parameters
    ----------
    function : callable
        Function of an array (n,); inf where there is nothing.
    edges : array (n + 1,)
        Edges, ascending, of intervals that are short enough for the features that shall be seen.
    floor : float
        Error per length that does not matter.
    known : sequence of float
        Places that are known to be singular; they are among the edges.

    Returns
    -------
    Proxy

    Raises
    ------
    TooRough
        If there are more than BUDGET pieces, or more than MOST singular points.
    """
    known = tuple(known)
    edges, ends = _with_ends(function, np.asarray(edges, float))
    edges = _but_singular(function, edges, {*known, *ends}, floor)
    whole, narrow = edges[-1] - edges[0], float(NARROW * np.median(np.diff(edges)))
    done: list[tuple[Array, Array, Array]] = []
    candidates = [(float(place), 0.0) for place in (*known, *ends)]  # (place, length of its interval)
    left, right, halves = edges[:-1], edges[1:], False
    while len(left):
        values = _values(function, left, right)
        length = right - left
        smooth = _followed(left, right, values, np.where(length < narrow, 0.0, floor))
        shortest = ~smooth & (length <= SHORTEST * whole)
        candidates += zip((left + right)[shortest] / 2, length[shortest])
        if halves:
            number = len(left) // 2
            lost = smooth.reshape(2, -1).all(axis=0) & ((length[:number] + length[number:]) < narrow)
            candidates += zip(right[:number][lost], (length[:number] + length[number:])[lost])
        crowds = _crowds(left, right, ~smooth & (length < LOST * whole), LOST * whole)
        for crowd in crowds:
            candidates.append((float(left[crowd].min() + right[crowd].max()) / 2, float(length[crowd].min())))
            smooth[crowd] = True
        smooth |= shortest
        done.append((left[smooth], right[smooth], values[smooth]))
        left, right = left[~smooth], right[~smooth]
        pieces = sum(len(each[0]) for each in done) + len(left)
        if pieces > BUDGET or np.count_nonzero(right - left < narrow) > MOST:
            raise TooRough(
                f"it changes ever more quickly, next to x = {left[0]:.4g}" if len(left) else "too many pieces"
            )
        middle = left + HALF * (right - left)
        left, right, halves = np.concatenate((left, middle)), np.concatenate((middle, right)), True
    left, right, values = (np.concatenate(each) for each in zip(*done))
    order = np.argsort(left)
    singular = np.array(_apart(sorted(candidates), LOST * whole))
    left, right, values = _joined(
        function, left[order], right[order], values[order], singular, LOST * whole, floor
    )
    samples, first = np.unique(_spread(left, right), return_index=True)
    beside = [_at_singular(function, place, singular[singular != place], whole) for place in singular]
    if beside:
        singular, jumps, powers = (np.array(each) for each in zip(*beside))
    else:
        jumps = powers = singular
    return Proxy(np.append(left, right[-1]), singular, jumps, powers, samples, values.ravel()[first])


def _spread(left: Array, right: Array) -> Array:
    """Returns the samples of intervals: array (n, samples)."""
    return (left + right)[:, None] / 2 + (right - left)[:, None] / 2 * _places


def _values(function: Function, left: Array, right: Array) -> Array:
    """Returns values of the function at the samples of intervals: array (n, samples), inf where there is
    none.
    """
    values = np.asarray(function(_spread(left, right).ravel()), float).reshape(len(left), len(_places))
    return np.where(np.isfinite(values), values, np.inf)


def _with_ends(function: Function, edges: Array) -> tuple[Array, list[float]]:
    """Returns edges and also those places inside an interval at which the function begins or ends: (edges,
    places).
    """
    x = np.sort(_spread(edges[:-1], edges[1:]).ravel())
    there = np.isfinite(np.asarray(function(x), float))
    found = []
    for i in np.flatnonzero(there[1:] != there[:-1]):
        inside, outside = (x[i], x[i + 1]) if there[i] else (x[i + 1], x[i])
        while inside != (middle := (inside + outside) / 2) != outside:
            there_too = np.isfinite(function(np.array([middle]))[0])
            inside, outside = (middle, outside) if there_too else (inside, middle)
        found.append(float(inside))
    return np.union1d(edges, found), found


def _but_singular(function: Function, edges: Array, named: Collection[float], floor: float) -> Array:
    """Returns the edges without those that are singular points and not named.

    Both sides of a singular point may be smooth, and nothing shrinks towards it: inside an interval it is
    seen. It is where no polynomial follows on an interval about the edge that is shorter than both beside it.
    """
    inner, length = edges[1:-1], np.diff(edges)
    reach = np.minimum(length[1:], length[:-1]) / 2
    left, right = inner - HALF * reach, inner + (1 - HALF) * reach
    smooth = _followed(left, right, _values(function, left, right), floor)
    smooth |= np.isin(inner, list(named))
    return np.concatenate((edges[:1], inner[smooth], edges[-1:]))


def _crowds(left: Array, right: Array, chosen: Flags, least: float) -> list[Integers]:
    """Returns the groups of more than CROWD chosen intervals that are no farther apart than `least`."""
    numbers = np.flatnonzero(chosen)
    if len(numbers) <= CROWD:
        return []
    numbers = numbers[np.argsort(left[numbers])]
    apart = np.flatnonzero(left[numbers[1:]] - right[numbers[:-1]] > least) + 1
    return [group for group in np.split(numbers, apart) if len(group) > CROWD]


def _followed(left: Array, right: Array, values: Array, floor: Array | float) -> Flags:
    """Returns whether a polynomial follows on each interval, as far as rounding lets that be seen."""
    there = np.isfinite(values)
    known = np.where(there, values, 0.0)
    error = np.abs(known[:, :NODES] @ _between.T - known[:, NODES:]).max(axis=1, initial=0.0)
    few = there.sum(axis=1) < 0.6 * len(_places)  # nothing there but at an end of the interval, perhaps
    all_but_one = ~there.all(axis=1) & (there.sum(axis=1) >= len(_places) - 1)
    return cast(Flags, (error <= _allowed(left, right, known, floor)) | few | all_but_one)


def _allowed(left: Array, right: Array, known: Array, floor: Array | float) -> Array:
    """Returns errors that a polynomial may have on intervals with these values."""
    change, length = np.ptp(known, axis=1), right - left
    place = np.maximum(np.abs(left), np.abs(right))
    rounding = ROUNDING * np.abs(known).max(axis=1) + 4 * np.finfo(float).eps * place * change / np.maximum(
        length, 1e-300
    )
    return cast(Array, FOLLOWED * change + rounding + floor * length)


def _joined(
    function: Function, left: Array, right: Array, values: Array, singular: Array, near: float, floor: float
) -> tuple[Array, Array, Array]:
    """Returns intervals, neighbours that one polynomial serves joined two at a time; none across a singular
    point.
    """
    start, idle = 0, 0
    while idle < 2 and len(left) > 1:
        one = np.arange(start, len(left) - 1, 2)
        before, behind = left[one] + near, right[one + 1] - near
        alike = np.searchsorted(singular, before) == np.searchsorted(singular, behind)
        one = one[alike]
        both = _values(function, left[one], right[one + 1])
        serves = _followed(left[one], right[one + 1], both, floor)
        parts = [(left[i], right[i], values[i]) for i in (one, one + 1)]
        serves &= _meets(both, left[one], right[one + 1], parts, floor)
        merged = one[serves]
        left[merged + 1], values[merged + 1] = left[merged], both[serves]
        left, right, values = (np.delete(each, merged, axis=0) for each in (left, right, values))
        idle, start = (0 if len(merged) else idle + 1), 1 - start
    return left, right, values


def _meets(
    both: Array, a: Array, b: Array, parts: Sequence[tuple[Array, Array, Array]], floor: float
) -> Flags:
    """Returns whether the polynomials of pairs of neighbours meet the samples on each of them."""
    meets = np.ones(len(a), bool)
    known = np.where(np.isfinite(both), both, 0.0)
    series = known[:, :NODES] @ _coefficients.T
    for left, right, own in parts:
        along = (2 * _spread(left, right) - (a + b)[:, None]) / (b - a)[:, None]
        there = np.isfinite(own).all(axis=1) == np.isfinite(both).all(axis=1)
        served = chebval(along, series.T[:, :, None], tensor=False)
        error = np.abs(served - np.where(np.isfinite(own), own, 0.0)).max(axis=1, initial=0)
        meets &= there & (error <= _allowed(a, b, known, floor))
    return meets


def _apart(found: Iterable[tuple[float, float]], least: float) -> list[float]:
    """Returns of each cluster of (place, interval) the place that is known best."""
    clusters: list[list[tuple[float, float]]] = []
    for entry in found:
        if clusters and entry[0] - clusters[-1][-1][0] <= max(least, 2 * entry[1], 2 * clusters[-1][-1][1]):
            clusters[-1].append(entry)
        else:
            clusters.append([entry])
    return [float(min(cluster, key=lambda entry: entry[1])[0]) for cluster in clusters]


def _at_singular(function: Function, place: float, others: Array, whole: float) -> tuple[float, float, float]:
    """Returns (place, jump of the slope, power) of a singular point, whose place is known roughly, from
    values beside it.

    The jump is 0 if it shrinks with the step of the differences, nan if it grows: then the function itself
    jumps. Where the slope jumps the place is where the polynomials of either side meet: a logarithm d beside
    its place is off by sqrt(d) in L2. The power is that of ``abs(x - place)**power`` from second differences;
    nan where the function jumps.
    """
    width = min([whole / 8, *(np.abs(others - place) / 4)])

    def seen(step: float) -> tuple[float, float]:
        x = place + step * np.array((-2.0, -1.0, 1.0, 2.0))
        farther, far, near, nearer = np.asarray(function(x), float)
        return (nearer - near - far + farther) / step, (near - far) / step

    with np.errstate(invalid="ignore", divide="ignore"):  # inf - inf
        (first, rise), (second, steep), (half, _) = map(seen, width * np.array((1e-2, 1e-4, 5e-5)))
        power = 1 + np.log(abs(first / second)) / np.log(100)
    if not np.isfinite(first + second + half) or abs(steep) > STEP * abs(rise) + STEP * abs(second):
        return place, np.nan, np.nan
    if abs(second) <= KINK * abs(first):
        return place, 0.0, power
    found = _meeting(function, place, 1e-3 * width)
    if abs(found[0] - place) < 1e-4 * width:
        return found[0], found[1], 1.0
    return place, float(2 * half - second), 1.0


def _meeting(function: Function, place: float, width: float) -> tuple[float, float]:
    """Returns (where the polynomials of either side meet, difference of their slopes) next to a place."""
    t = np.cos(np.pi * (np.arange(SIDE) + 0.5) / SIDE)
    x = (0.05 + 0.95 * (1 + t) / 2) * width
    right, left = (
        np.polynomial.polynomial.polyfit(
            side * x / width, np.asarray(function(place + side * x), float), SIDE - 1
        )
        for side in (1, -1)
    )
    apart = np.polynomial.Polynomial(right - left)
    root, slope = 0.0, apart.deriv()
    for _ in range(3):
        root -= apart(root) / slope(root)
    return float(place + root * width), float(slope(root) / width)
