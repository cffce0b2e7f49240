"""Zones and norms of a state."""

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .types import Array, CornerZones, Flags, Function, Integers, Interval, Zones


def distance(weights: Array, pressure: Array, moment: Array, total: Array, *shear: Array) -> float:
    """Returns max(|dp|, |dM|/ell, |dq|/f)/|p| in L2, the norm of all error estimates, from arrays (n,):
    weights (lengths), dp, dM/ell, p and dq/f (stresses); 0 without p.
    """
    size = weights @ total**2
    if not size:
        return 0.0
    return float(np.sqrt(max(weights @ change**2 for change in (pressure, moment, *shear)) / size))


def joined(intervals: Iterable[Interval], slack: float = 0.0) -> list[Interval]:
    """Returns the union of intervals [(left, right), ...], joined where they are apart by no more than
    `slack`.
    """
    union: list[Interval] = []
    for left, right in sorted(intervals):
        if union and left <= union[-1][1] + slack:
            union[-1] = (union[-1][0], max(union[-1][1], right))
        else:
            union.append((left, right))
    return union


def without(intervals: Iterable[Interval], left: float, right: float) -> list[Interval]:
    """Returns what is left of intervals without the places between left and right."""
    return common(intervals, [(-np.inf, left), (right, np.inf)])


def contains(intervals: ArrayLike, x: Array) -> Flags:
    """Returns whether each x, array (n,), lies in an interval, ends included."""
    left, right = np.reshape(intervals, (-1, 2, 1)).swapaxes(0, 1)
    return np.any((left <= x) & (x <= right), axis=0)


def common(first: Iterable[Interval], second: Sequence[Interval] | Array) -> list[Interval]:
    """Returns the intersection of intervals [(left, right), ...], in order."""
    (a, b), (c, d) = (np.reshape(intervals, (-1, 2)).T for intervals in (list(first), second))
    left = np.maximum.outer(a, c)
    right = np.minimum.outer(b, d)
    return sorted(zip(left[left < right].tolist(), right[left < right].tolist()))


def over_the_end(intervals: Iterable[Interval], period: float | None) -> list[Interval]:
    """Returns intervals as floats, those at both ends of a period as one that goes on beyond it."""
    pairs = [(float(left), float(right)) for left, right in intervals]
    if period is None or len(pairs) < 2 or pairs[-1][1] - pairs[0][0] < period * (1 - 1e-9):
        return pairs
    (_, right), *inner, (left, _) = pairs
    return [*inner, (left, right + period)]


def in_interruption(nodes: Array, interrupted: Flags | None, x: Array) -> Flags:
    """Returns which places x lie between two nodes (ascending) where the surface is `interrupted`, boolean
    array (n - 1,) or None.
    """
    if interrupted is None:
        return np.zeros(np.shape(x), bool)
    before = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(interrupted) - 1)
    return interrupted[before] & (x > nodes[before]) & (x < nodes[before + 1])


def contact_zones(zones: CornerZones, corners: Sequence[str]) -> Zones:
    """Returns {"A", "B", "full", "contact": intervals} from the zones of each corner by its number; without
    corners "contact" alone is not empty.
    """
    by_corner = [over_the_end(zones[number], None) for number in range(len(corners))]
    if len(corners) == 1:
        return {"A": [], "B": [], "full": [], "contact": by_corner[0]}
    named = dict(zip(corners, by_corner))
    return {**named, "full": reduce(common, by_corner), "contact": joined(chain(*by_corner))}


def zone_changes(before: Sequence[Interval], after: Sequence[Interval]) -> list[tuple[str, float]]:
    """Returns what happened to intervals between neighbouring states: [(kind, x), ...], as of `Event`."""

    def touching(interval: Interval, others: Sequence[Interval]) -> list[Interval]:
        return [(left, right) for left, right in others if left <= interval[1] and interval[0] <= right]

    changes = [("born", sum(new) / 2) for new in after if not touching(new, before)]
    changes += [("vanished", sum(old) / 2) for old in before if not touching(old, after)]
    for kind, many, few in (("merged", before, after), ("split", after, before)):
        for interval in few:
            pieces = touching(interval, many)
            changes += [(kind, (left[1] + right[0]) / 2) for left, right in zip(pieces, pieces[1:])]
    return changes


def least_beside(function: Function, x: Array, i: Any, tolerance: float) -> tuple[float, float]:
    """Returns the smallest value of a function beside sample i, and its place."""
    from scipy.optimize import minimize_scalar  # here: half a second that most states do without

    minimum = minimize_scalar(
        lambda place: function(np.array([place]))[0],
        bounds=(x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]),
        method="bounded",
        options={"xatol": tolerance},
    )
    value, place = min((minimum.fun, minimum.x), (function(x[i : i + 1])[0], x[i]))
    return float(value), float(place)


def lowest(function: Function, x: Array) -> tuple[float, float | None]:
    """Returns (smallest value, its place) of a function of arrays, refined between samples x (ascending), inf
    passed over; the place is None where others are equally low.
    """
    values = function(x)
    finite = np.isfinite(values)
    x = x[finite]
    values = values[finite]
    i = int(np.argmin(values))
    noise = 500 * np.finfo(float).eps * np.abs(values).max()
    left = x[max(i - 1, 0)]
    right = x[min(i + 1, len(x) - 1)]
    low = x[values <= values[i] + noise]
    if len(low) > 2 or low[0] < left or low[-1] > right:
        return float(values[i]), None
    # a parabola shows its lowest place no better than to 1e-9
    value, place = least_beside(function, x, i, 1e-9 * (right - left))
    if value < values[i] - noise:
        return value, place
    return float(values[i]), float(x[i]) if len(low) == 1 else None


def borders(x: Array, first: float | None = None, last: float | None = None) -> Array:
    """Returns the borders of nodes at x (ascending), half the way to their neighbours and, unless `first` and
    `last` are given, at the outermost nodes: array (n + 1,).
    """
    middles = (x[1:] + x[:-1]) / 2
    left = x[:1] if first is None else [first]
    right = x[-1:] if last is None else [last]
    return np.concatenate((left, middles, right))


def distance_to_root(step: float, pressure: float, inner: float) -> float:
    """Returns how far beyond a point with a pressure its square vanishes, continued linearly from a point one
    step farther inside; inf where it does not fall.
    """
    fall = inner**2 - pressure**2
    return float(step * pressure**2 / fall) if fall > 0 else np.inf


def local_minima(values: Array) -> Integers:
    """Returns the numbers of inner values, array (n,), below the one before and no higher than the next."""
    return np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Returns first and last index of each run of True in an array (n,)."""
    steps = np.diff(np.concatenate(([False], flags, [False])).astype(int))
    return list(zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1))


def distance_to_ends(x: Array, ends: Sequence[float], shifts: Sequence[float]) -> Array:
    """Returns a weight at x, array (n,), that makes the L2 norm of the pressure finite: near the edges of the
    obstacle, shifted by `shifts`, the distance over half of its width, else 1; without an end on one side as
    far as x goes.
    """
    finite = [end for end in ends if np.isfinite(end)]
    if not finite:
        return np.ones_like(x)
    width = np.ptp(finite if len(finite) == len(ends) else [*finite, x.min(), x.max()])
    distances = (2 * np.abs(x - end - shift) / width for end in finite for shift in shifts)
    return np.min([np.ones_like(x), *distances], axis=0)


def distance_to_edges(faces: Flags) -> Array:
    """Returns the distance of square cells to the nearest edge of the faces over the corners, divided by the
    largest distance within a face, at most 1; of faces, array (corners, n, n), True where the obstacle is.
    """
    from scipy.ndimage import distance_transform_edt  # here: most states do without

    distances = [np.ones(faces.shape[1:])]
    half_width = 1.0
    for face in faces:
        if not face.all() and face.any():
            inside, outside = (distance_transform_edt(cells) for cells in (face, ~face))
            half_width = max(half_width, inside.max())
            distances.append(inside + outside - 0.5)  # an edge lies between the centres of two cells
    return np.minimum(np.min(distances[1:] or distances, axis=0) / half_width, 1.0)


def moved_on(zones: CornerZones, earlier: CornerZones, fraction: float) -> CornerZones | None:
    """Returns zones moved on by a fraction of the way from those of an earlier state; None if they are not
    alike, or that is too far.
    """
    alike = all(len(earlier.get(corner, ())) == len(pairs) for corner, pairs in zones.items())
    if not alike or not abs(fraction) <= 2:
        return None
    moved: dict[int, tuple[Interval, ...]] = {}
    for corner, pairs in zones.items():
        edges = np.ravel(pairs)
        edges = edges + fraction * (edges - np.ravel(earlier[corner]))
        if not np.all(np.diff(edges) > 0):
            return None
        moved[corner] = tuple((left, right) for left, right in edges.reshape(-1, 2).tolist())
    return moved


def zone_edges(zones: Mapping[int, Iterable[Interval]]) -> list[float]:
    """Returns the left and right ends of zones {corner: intervals}, ascending, each once."""
    return sorted({edge for intervals in zones.values() for interval in intervals for edge in interval})


def along_surface(x: ArrayLike, points: Array, values: Array, period: float | None = None) -> Array:
    """Returns values at x, linear between those at points of a surface, ascending, arrays (n,). Where it ends
    on the right in a vertical side, its value there is that of the first, highest point.
    """
    if period is None:
        first = int(np.searchsorted(points, points[-1])) + 1
        points = points[:first]
        values = values[:first]
    return np.asarray(np.interp(np.asarray(x, float), points, values, period=period))
