"""Zones and norms of a state."""

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .types import Array, CornerZones, Flags, Function, Interval, Zones


def distance(weights: Array, pressure: Array, moment: Array, total: Array, *shear: Array) -> float:
    """Returns max(|dp|, |dM|/ell, |dq|/f)/|p| in L2, the norm of all error estimates, from arrays (n,):
    weights (lengths), dp, dM/ell, p and dq/f (stresses); 0 without p.
    """
    size, changes = weights @ total**2, (pressure, moment, *shear)
    return float(np.sqrt(max(weights @ change**2 for change in changes) / size)) if size else 0.0


def joined(intervals: Iterable[Interval], slack: float = 0.0) -> list[Interval]:
    """Returns the union of intervals [(left, right), ...], joined where they are apart by no more than
    `slack`.
    """
    found: list[Interval] = []
    for left, right in sorted(intervals):
        if found and left <= found[-1][1] + slack:
            found[-1] = (found[-1][0], max(found[-1][1], right))
        else:
            found.append((left, right))
    return found


def without(intervals: Iterable[Interval], left: float, right: float) -> list[Interval]:
    """Returns what is left of intervals without the places between left and right."""
    return common(intervals, [(-np.inf, left), (right, np.inf)])


def contains(intervals: ArrayLike, x: Array) -> Flags:
    """Returns whether each x, array (n,), lies in an interval, ends included."""
    left, right = np.reshape(intervals, (-1, 2, 1)).swapaxes(0, 1)
    return np.any((left <= x) & (x <= right), axis=0)


def common(first: Iterable[Interval], second: Sequence[Interval] | Array) -> list[Interval]:
    (a, b), (c, d) = (np.reshape(intervals, (-1, 2)).T for intervals in (list(first), second))
    left, right = np.maximum.outer(a, c), np.minimum.outer(b, d)
    return sorted(zip(left[left < right].tolist(), right[left < right].tolist()))


def over_the_end(intervals: Iterable[Interval], period: float | None) -> list[Interval]:
    """Returns intervals as floats, those at both ends of a period as one that goes on beyond it."""
    own = [(float(left), float(right)) for left, right in intervals]
    if period is None or len(own) < 2 or own[-1][1] - own[0][0] < period * (1 - 1e-9):
        return own
    (_, right), *others, (left, _) = own
    return [*others, (left, right + period)]


def interrupted(nodes: Array, apart: Flags | None, x: Array) -> Flags:
    """Returns which places x lie between two nodes (ascending) that `apart`, (n - 1,), says to have a gap of
    the surface between them.
    """
    if apart is None:
        return np.zeros(np.shape(x), bool)
    before = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(apart) - 1)
    return apart[before] & (x > nodes[before]) & (x < nodes[before + 1])


def contact_zones(zones: CornerZones, corners: Sequence[str]) -> Zones:
    """Returns {"A", "B", "full", "contact": intervals} from the zones of each corner by its number; without
    corners "contact" alone is not empty.
    """
    own = [over_the_end(zones[number], None) for number in range(len(corners))]
    if len(corners) == 1:
        return {"A": [], "B": [], "full": [], "contact": own[0]}
    return {**dict(zip(corners, own)), "full": reduce(common, own), "contact": joined(chain(*own))}


def zone_changes(before: Sequence[Interval], after: Sequence[Interval]) -> list[tuple[str, float]]:
    """Returns what happened to intervals between neighbouring states: [(kind, x), ...], as of `Event`."""

    def touching(interval: Interval, others: Sequence[Interval]) -> list[Interval]:
        return [other for other in others if other[0] <= interval[1] and interval[0] <= other[1]]

    changes = [("born", sum(new) / 2) for new in after if not touching(new, before)]
    changes += [("vanished", sum(old) / 2) for old in before if not touching(old, after)]
    for kind, many, few in (("merged", before, after), ("split", after, before)):
        for interval in few:
            parts = touching(interval, many)
            changes += [(kind, (left[1] + right[0]) / 2) for left, right in zip(parts, parts[1:])]
    return changes


def least_beside(function: Function, x: Array, i: Any, tolerance: float) -> tuple[float, float]:
    """Returns the smallest value of a function beside sample i, and its place."""
    from scipy.optimize import minimize_scalar  # here: half a second that most states do without

    found = minimize_scalar(
        lambda place: function(np.array([place]))[0],
        bounds=(x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]),
        method="bounded",
        options={"xatol": tolerance},
    )
    value, place = min((found.fun, found.x), (function(x[i : i + 1])[0], x[i]))
    return float(value), float(place)


def lowest(function: Function, x: Array) -> tuple[float, float | None]:
    """Returns (smallest value, its place) of a function of arrays, refined between samples x (ascending), inf
    passed over; the place is None where others are equally low.
    """
    values = function(x)
    x, values = x[np.isfinite(values)], values[np.isfinite(values)]
    i, noise = int(np.argmin(values)), 500 * np.finfo(float).eps * np.abs(values).max()
    left, right = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
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
    ends = x[:1] if first is None else [first], x[-1:] if last is None else [last]
    return np.concatenate((ends[0], (x[1:] + x[:-1]) / 2, ends[1]))


def distance_to_root(step: float, pressure: float, inner: float) -> float:
    """Returns how far beyond a point with a pressure its square vanishes, continued linearly from a point one
    step farther inside; inf where it does not fall.
    """
    fall = inner**2 - pressure**2
    return float(step * pressure**2 / fall) if fall > 0 else np.inf


def runs(flags: Flags) -> list[tuple[int, int]]:
    """Returns first and last index of each run of True in an array (n,)."""
    steps = np.diff(np.concatenate(([False], flags, [False])).astype(int))
    return list(zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1))


def distance_to_ends(x: Array, ends: Sequence[float], shifts: Sequence[float]) -> Array:
    """Returns a weight at x, array (n,), that makes the L2 norm of the pressure finite: near the edges of the
    obstacle, shifted by `shifts`, the distance over half of its width, else 1; without an end on one side as
    far as x goes.
    """
    own = [end for end in ends if np.isfinite(end)]
    width = np.ptp([*own, x.min(), x.max()] if len(own) < len(ends) else own) if own else 0.0
    distances = (2 * np.abs(x - end - shift) / width for end in own for shift in shifts)
    return np.min([np.ones_like(x), *distances], axis=0)


def distance_to_edges(faces: Flags) -> Array:
    """Returns the distance of square cells to the nearest edge of the faces over the corners, divided by the
    largest distance within a face, at most 1; of faces, array (corners, n, n), True where the obstacle is.
    """
    from scipy.ndimage import distance_transform_edt  # here: most states do without

    distances, half_width = [np.ones(faces.shape[1:])], 1.0
    for face in faces:
        if not face.all() and face.any():
            inside, outside = (distance_transform_edt(cells) for cells in (face, ~face))
            half_width = max(half_width, inside.max())
            distances.append(inside + outside - 0.5)  # an edge lies between the centres of two cells
    return np.minimum(np.min(distances[1:] or distances, axis=0) / half_width, 1.0)


def moved_on(own: CornerZones, earlier: CornerZones, share: float) -> CornerZones | None:
    """Returns zones moved on by a share of the way from those of an earlier state; None if they are not
    alike, or that is too far.
    """
    alike = all(len(earlier.get(corner, ())) == len(zones) for corner, zones in own.items())
    if not alike or not abs(share) <= 2:
        return None
    edges = {corner: np.reshape(zones, (-1, 2)) for corner, zones in own.items()}
    moved = {i: now + share * (now - np.reshape(earlier[i], (-1, 2))) for i, now in edges.items()}
    apart = all(np.all(np.diff(zones.ravel()) > 0) for zones in moved.values())
    pairs = {i: tuple((left, right) for left, right in zones.tolist()) for i, zones in moved.items()}
    return pairs if apart else None


def zone_edges(zones: Mapping[int, Iterable[Interval]]) -> list[float]:
    return sorted({edge for intervals in zones.values() for interval in intervals for edge in interval})
