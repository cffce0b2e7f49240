"""A function known by its values alone: pieces on which a polynomial follows it, and its singular points.

Pieces on which a polynomial through CHEBYSHEV_NODES does not follow are halved (as chebfun does: Battles and
Trefethen, SIAM J. Sci. Comput. 25 (2004) 1743); with a singular point inside none is short enough. What is
narrower than the samples of the first intervals, and changes nothing at them, is not seen.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebpts2, chebval, chebvander

from ..errors import require
from .types import Array, Flags, Function

CHEBYSHEV_NODES = 14
LOST = 1e-5  # of all intervals: singular points nearer to each other are one
HALF = 0.5137  # not 1/2: a singular point at a round number shall fall into one of the halves

_points = chebpts2(CHEBYSHEV_NODES)
_places = np.concatenate((_points, (_points[1:] + _points[:-1]) / 2))  # samples of a piece, in [-1, 1]
# of the polynomial through those at _points
_coefficients = np.linalg.inv(chebvander(_points, CHEBYSHEV_NODES - 1))
_between = (
    chebvander(_places[CHEBYSHEV_NODES:], CHEBYSHEV_NODES - 1) @ _coefficients
)  # its values at the other samples


class Proxy(NamedTuple):
    """Pieces of a function.

    Attributes
    ----------
    edges, lengths : arrays (n + 1,)
        Edges of the pieces, ascending, and the length of the piece behind each; inf within two and a half
        lengths of a singular point, and of the last.
    singular, jumps : arrays (k,)
        Places, ascending, at which a derivative jumps or has no bound, or the function jumps or ends; and
        jump of the slope, nan where the function jumps or ends.
    samples, values : arrays (m,)
        Places, ascending, of evaluations, and values, inf where there is none.
    """

    edges: Array
    lengths: Array
    singular: Array
    jumps: Array
    samples: Array
    values: Array


EMPTY_PROXY = Proxy(np.zeros(1), np.array([np.inf]), *[np.empty(0)] * 4)  # of no function


def proxy(
    function: Function,
    edges: Array,
    floor: float = 0.0,
    known: Iterable[float] = (),
    name: str = "obstacle",
    given: object = None,
) -> Proxy:
    """Returns the Proxy of a function of arrays on intervals between `edges` that are short enough for what
    shall be seen; `floor` is an error per length that does not matter, `known` are singular places inside.
    Raises BadArgument of an argument if there are too many pieces or singular points.
    """
    x = np.unique(_sample_places(edges[:-1], edges[1:]))
    h = _values(function, x)
    ends = [*known, *places_of_ends(function, x, np.isfinite(h))]
    width = edges[-1] - edges[0]
    edges, places = _bisected(function, edges, ends, x, h, floor, name, given)
    singular: list[float] = []
    for length, place in sorted(places):  # those that are known best come first
        if all(abs(place - better) > max(LOST * width, 2 * length) for better in singular):
            singular.append(float(place))
    singular.sort()
    samples = np.unique(_sample_places(edges[:-1], edges[1:]))
    jumps = [_jump(function, place, singular, width) for place in singular]
    lengths = np.diff(edges, append=np.inf)
    near = np.abs((edges + lengths / 2)[:, None] - singular).min(axis=1, initial=np.inf)
    lengths[near <= np.maximum(2.5 * lengths, LOST * width)] = np.inf
    return Proxy(edges, lengths, np.array(singular), np.array(jumps), samples, _values(function, samples))


def _bisected(
    function: Function,
    edges: Array,
    ends: Sequence[float],
    x: Array,
    h: Array,
    floor: float,
    name: str,
    given: object,
) -> tuple[Array, list[tuple[float, float]]]:
    """Returns (edges of intervals, halved until each is smooth or short; (length of the last interval, place)
    of singular points). `ends` are places that are known to be singular, h values at samples x.
    """
    # features that the first intervals show are wider: a shorter piece has a singular point
    narrow = np.median(np.diff(edges)) / 64
    rounding = np.finfo(float).eps * (edges[-1] - edges[0])
    budget = 8000
    cuts = np.unique((edges[0], *ends, edges[-1]))
    left = cuts[:-1]
    right = cuts[1:]
    done = [edges[-1:]]
    places = [(0.0, place) for place in ends]
    while len(left):
        short = right - left < narrow
        rough = _rough(function, left, right, x, h, np.where(short, 0.0, floor)) > 1
        short &= rough
        budget -= len(left)
        most = np.median(left[rough]) if rough.any() else left[0]  # others may be single places
        words = (
            f"must be smooth but for some places: it changes ever more quickly, next to x = {most:.4g}; "
            "Cells(nodes=..., window=...) take it as their centres see it"
        )
        require(budget >= 0 and np.count_nonzero(short) <= 200, name, given, words)
        places += _pinned(function, left[short], right[short], rounding)
        done.append(left[~rough | short])
        halved = rough & ~short
        middle = left[halved] + HALF * (right[halved] - left[halved])
        left = np.sort((*left[halved], *middle))
        right = np.sort((*middle, *right[halved]))
    return np.sort(np.concatenate(done)), places


def _sample_places(left: Array, right: Array) -> Array:
    return (left[:, None] * (1 - _places) + right[:, None] * (1 + _places)) / 2


def _values(function: Function, x: Array) -> Array:
    values = np.asarray(function(x), float)
    return np.where(np.isfinite(values), values, np.inf)


def places_of_ends(function: Function, x: Array, finite: Flags) -> list[float]:
    """Returns the last places, to rounding, at which a function is finite beside samples x at which it is
    not; `finite` says at which of them it is, array (n,).
    """
    i = np.flatnonzero(finite[1:] != finite[:-1])
    inside, outside = np.where(finite[i], (x[i], x[i + 1]), (x[i + 1], x[i]))
    while np.any((inside != (middle := (inside + outside) / 2)) & (middle != outside)):
        is_inside = np.isfinite(function(middle))
        inside, outside = np.where(is_inside, (middle, outside), (inside, middle))
    return inside.tolist()


def _rough(
    function: Function, left: Array, right: Array, x: Array, h: Array, floor: Array | float = 0.0
) -> Array:
    """Returns the error of a polynomial on each piece, also at the samples x with the values h, over what
    rounding and 1e-8 of the change allow.
    """
    values = _values(function, _sample_places(left, right).ravel()).reshape(-1, len(_places))
    finite = np.isfinite(values)
    values[~finite] = 0.0
    series = values[:, :CHEBYSHEV_NODES] @ _coefficients.T
    error = np.abs(values[:, :CHEBYSHEV_NODES] @ _between.T - values[:, CHEBYSHEV_NODES:]).max(axis=1)
    error[~finite.all(axis=1)] = np.inf
    change = np.ptp(values, axis=1)
    farthest = np.maximum(np.abs(left), np.abs(right))
    length = np.maximum(right - left, np.spacing(farthest))
    eps = np.finfo(float).eps
    place = farthest / length
    allowed = (1e-8 + 4 * eps * place) * change + 40 * eps * np.abs(values).max(axis=1) + floor * length
    piece = np.maximum(np.searchsorted(left, x, side="right") - 1, 0)
    inside = (error <= allowed)[piece] & (left[piece] <= x) & (x <= right[piece]) & np.isfinite(h)
    piece = piece[inside]
    along = (2 * x[inside] - left[piece] - right[piece]) / length[piece]
    np.maximum.at(error, piece, np.abs(chebval(along, series.T[:, piece], tensor=False) - h[inside]))
    error[finite.mean(axis=1) < 0.6] = 0.0  # nothing there but at an end of the piece, perhaps
    return error / np.maximum(allowed, 1e-300)


def _pinned(function: Function, left: Array, right: Array, least: float) -> list[tuple[float, float]]:
    """Returns (length of the last piece, place) of singular points, by halving."""
    empty = np.empty(0)
    settled = np.zeros(len(left), bool)
    while True:
        middle = left + HALF * (right - left)
        starts = np.concatenate((left, middle))
        stops = np.concatenate((middle, right))
        lower, upper = _rough(function, starts, stops, empty, empty).reshape(2, -1)
        # where no half is rough the middle is singular, or rounding hides the rest
        settled |= (np.maximum(lower, upper) <= 1) | (right - left < least)
        settled |= (middle <= left) | (middle >= right)  # no number lies between
        if settled.all():
            return list(zip(right - left, middle))
        left = np.where(~settled & (lower < upper), middle, left)
        right = np.where(~settled & (lower >= upper), middle, right)


def _jump(function: Function, place: float, singular: Iterable[float], width: float) -> float:
    """Returns the jump of the slope at one of the singular points, from differences beside it: 0 if it
    shrinks with their step, nan if it grows.
    """
    longest = min([width / 8, *(abs(point - place) / 4 for point in singular if point != place)])
    steps = np.array((1e-2, 1e-3, 1e-4)) * longest
    values = _values(function, (place + np.outer((-2.0, -1.0, 1.0, 2.0), steps)).ravel())
    farther, far, near, nearer = values.reshape(4, -1)
    with np.errstate(invalid="ignore"):  # inf - inf
        first, between, second = (nearer - near - far + farther) / steps
        rise, _, steep = (near - far) / steps
    if not np.isfinite(first + second) or abs(steep) > 50 * (abs(rise) + abs(second)):
        return np.nan
    # less what the curvature adds, which is as the step; powers of the distance leave jumps that differ
    earlier = between + (between - first) / 9
    jump = second + (second - between) / 9
    shrinks = abs(second) <= 0.9 * abs(first) and abs(jump - earlier) > 0.05 * abs(jump)
    # where the curvature jumps the place is known to a fraction of the steps
    doubt = 1e-3 * abs(first) + 8 * np.finfo(float).eps * np.abs(values).max() / steps[-1]
    return 0.0 if shrinks or abs(jump) <= doubt else jump
