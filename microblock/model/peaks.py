"""Where a state has its largest pressure or stress, and how large it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import BadArgument, require, require_choice
from .intervals import along_surface
from .types import Array, Flags

BELOW = ("von_mises", "max_shear", "tension")
QUANTITIES = ("pressure", *BELOW)
STARTS = 3  # of the first points, apart from each other, from which the search goes on
RIVAL = 0.8  # of the largest value, above which another may be the peak
ACROSS = {2: 33, 3: 7}  # first places along an axis of the surface, in the plane and in space
SUMMITS = 12  # places of the largest pressures, which they have besides
DEPTHS = np.append(0.0, np.geomspace(1e-3, 1.0, 14))  # first depths over the extent of the contact
ROUGHLY = 3e-3  # of the extent, to which the places of rivals are sought
CLOSE = 1e-5  # of the extent, to which a place is sought
# of the extent: from the first to the second a logarithm rises as from the second to the third, a cusp by 0.3
# of it; closer the error of an edge shows
DECADES = 1e-4, 1e-5, 1e-6
LIKE_LOGARITHM = 0.7
UNBOUNDED = 5e-3  # of the largest pressure, a rise that counts
# halves of a cell: cells round off a tip, whose stress has no bound, and are highest 3 of them below
RESOLVING = 5.0
NO_BOUND = "has no bound there: the obstacle has an edge or a tip"


class Peak(NamedTuple):
    """The largest value of a quantity, its place, x1 and x2, in space x3, and whether it is resolved: not
    where finer cells may have more, within two and a half cells of the surface, and as a pressure that is
    convex a cell or two to both sides, as at a tip.
    """

    value: float
    place: tuple[float, ...]
    resolved: bool = True


def peak(state: Any, quantity: str) -> Peak:
    """Returns the Peak of one of QUANTITIES; raises BadArgument for other names, and where the quantity has
    no bound.
    """
    require_choice(QUANTITIES, quantity=quantity)
    require(not _presses_at_edge(state), "quantity", quantity, NO_BOUND)
    if quantity != "pressure":
        return _below(state, quantity)
    if not state.flat:  # linear between its points
        best = int(np.argmax(state.pressure))
        place = state.points[best]
        return Peak(float(state.pressure[best]), tuple(place.tolist()), _resolves(state, place))
    value, place = _of_pressure(state)
    beside = place[0] + float(np.ptp(state.zones["contact"])) * np.multiply.outer(DECADES, (-1, 1))
    pressures = state.pressure_at(beside.ravel()).reshape(-1, 2).max(axis=1)
    require(not _grows(pressures, value), "quantity", quantity, NO_BOUND)
    return Peak(value, tuple(place.tolist()), _resolves(state, place))


def _resolves(state: Any, place: Array) -> bool:
    """Returns whether cells, if it has any, resolve the largest pressure of a state at its place, array
    (dim,): they round off a tip, to both sides of which pressures are convex.
    """
    if state.method != "cells":
        return True
    dim = len(place)
    best = int(np.argmax(state.pressure))
    width = float(state.weights[best]) ** (1 / (dim - 1))
    ways = np.eye(dim)[:-1]
    beside = place + width * np.multiply.outer(np.arange(-3, 4), ways)
    places = beside.reshape(-1, dim)
    pressures = state.pressure_at(places[:, 0] if state.flat else places).reshape(len(beside), -1)
    convex = np.diff(pressures, 2, axis=0) > UNBOUNDED * state.pressure[best]
    # one and two cells to either side
    return not bool((convex[:2].any(axis=0) & convex[-2:].any(axis=0)).any())


def _of_pressure(state: Any) -> tuple[float, Array]:
    """Returns the largest pressure between the points of a state of the plane, and its place, array (2,)."""
    x = state.x
    best = int(np.argmax(state.pressure))
    width = float(np.diff(x[np.clip((best - 1, best + 1), 0, len(x) - 1)])[0])

    def less(at: Array) -> float:
        return -float(state.pressure_at(float(at[0])))

    found = _least(less, x[best : best + 1], np.array([width / 2]), 1e-3 * DECADES[-1] * float(np.ptp(x)))
    return -float(found.fun), np.array((found.x[0], along_surface(found.x[0], x, state.points[:, 1])))


def _grows(values: Array, scale: float) -> bool:
    """Returns whether values at DECADES, array (3,), grow without a bound, beside a scale."""
    first, second = np.diff(values)
    return bool(first > UNBOUNDED * scale and second > LIKE_LOGARITHM * first)


def _presses_at_edge(state: Any) -> bool:
    """Returns whether the contact reaches an edge of the obstacle, where stresses have no bound."""
    ways = np.vstack((np.eye(state.points.shape[1])[:-1], -np.eye(state.points.shape[1])[:-1]))
    for number, (corner, pressure) in enumerate(state.pressures.items()):
        pressed = pressure > 0
        places = state.points[pressed]
        near = 1.5 * np.sqrt(state.weights[pressed])[:, None]
        if state.flat:
            edges = np.ravel(state.zones["contact" if len(state.pressures) == 1 else corner])
            places = np.column_stack((edges, along_surface(edges, state.x, state.points[:, 1])))
            near = np.array(1e-6 * np.ptp(edges) if state.method == "panels" else 1.5 * state.weights.max())
        beside = (places + near * ways[:, None]).reshape(-1, places.shape[1])
        if np.isinf(state.problem.blocks.under(state.obstacle, beside).initial_gaps[number]).any():
            return True
    return False


def _below(state: Any, quantity: str) -> Peak:
    """Returns the Peak of one of BELOW, from the largest values on verticals through a grid of places and
    through the largest pressures.
    """
    fields = state.fields
    closed = state.points[state.closed > 0]
    extent = float(np.ptp(closed[:, :-1], axis=0).max())
    # of a weight, an area in space, the length
    extent = max(extent, float(state.weights.min()) ** (1 / (closed.shape[1] - 1)))
    places = _verticals(state, closed, extent)
    surface = places[:, -1].copy()
    closest = max(DECADES[-1] * extent, fields.resolved)
    spacing = np.ptp(closed[:, :-1], axis=0).max() / ACROSS[places.shape[1]]

    def values(x: Array) -> Array:
        """Returns the quantity at points, array (n, dim), -inf outside of a body."""
        try:
            below = fields(*x.T)
        except BadArgument:
            if len(x) > 1:
                return np.concatenate([values(point[None]) for point in x])
            return np.array([-np.inf])
        return np.asarray(below.principal[0] if quantity == "tension" else getattr(below, quantity))

    def less(top: float, point: Array) -> float:
        inside = closest <= top - point[-1] <= extent
        return -float(values(point[None])[0]) if inside else np.inf

    depths = np.maximum(DEPTHS * extent, closest)
    first = np.repeat(places[:, None], len(depths), axis=1)
    first[..., -1] -= depths
    found = values(first.reshape(-1, first.shape[-1])).reshape(first.shape[:-1])
    results = []
    highest = found.max(axis=1)
    rivals = highest >= min(highest.max(), RIVAL * highest.max())
    for number in _apart(places, highest, rivals, 1.5 * spacing, STARTS):
        depth = int(found[number].argmax())
        steps = np.full(places.shape[1], spacing)
        steps[-1] = -max(depths[depth] / 2, 10 * closest)
        top = surface[number]
        results.append((_least(partial(less, top), first[number, depth], steps, ROUGHLY * extent), top))
    best, top = min(results, key=lambda result: float(result[0].fun))
    last = 10 * ROUGHLY * extent * np.ones(places.shape[1])
    before = np.inf
    while best.fun < before - 1e-6 * abs(best.fun):  # a simplex may shrink on its way
        before = best.fun
        best = _least(partial(less, top), best.x, -last, CLOSE * extent)
    if top - best.x[-1] < 10 * closest and not fields.resolved:
        rising = np.repeat(best.x[None], len(DECADES), axis=0)
        rising[:, -1] = top - np.array(DECADES) * extent
        require(not _grows(values(rising), state.pressure.max()), "quantity", quantity, NO_BOUND)
    resolved = not fields.resolved or top - best.x[-1] > RESOLVING * closest
    return Peak(-float(best.fun), tuple(best.x.tolist()), bool(resolved))


def _apart(places: Array, values: Array, eligible: Flags, distance: float, most: int) -> list[int]:
    """Returns numbers of eligible places, array (k, dim), the largest value, array (k,), first, each at a
    distance from those before, at most so many.
    """
    chosen: list[int] = []
    order = np.argsort(-values, kind="stable")
    left = order[eligible[order]]
    while len(left) and len(chosen) < most:
        chosen.append(int(left[0]))
        beside = (places[left] - places[left[0]])[:, :2]
        left = left[np.hypot(*beside.T) > distance]
    return chosen


def _verticals(state: Any, closed: Array, extent: float) -> Array:
    """Returns places of the surface below which a search begins, array (k, dim): a grid over the points in
    contact, `closed`, those with the largest pressures, and in the plane edges of zones.
    """
    dim = closed.shape[1]
    ends = [
        (low - extent / 4, high + extent / 4) for low, high in zip(closed.min(axis=0), closed.max(axis=0))
    ]
    axes = [np.linspace(*pair, ACROSS[dim]) for pair in ends[:-1]]
    grid = np.stack([part.ravel() for part in np.meshgrid(*axes)], axis=1)
    nearest = [int(((state.points[:, :-1] - place) ** 2).sum(axis=1).argmin()) for place in grid]
    grid = np.column_stack((grid, state.points[nearest, -1]))
    pressed = state.pressure > 0
    summits = list(state.points[_apart(state.points, state.pressure, pressed, extent / ACROSS[dim], SUMMITS)])
    if state.flat:
        edges = np.unique(np.concatenate([np.ravel(zones) for zones in state.zones.values()]))
        summits += [np.array((edge, along_surface(edge, state.x, state.points[:, 1]))) for edge in edges]
        summits.append(_of_pressure(state)[1])
    return np.vstack((grid, *summits))


def _least(function: Callable[[Array], float], start: Array, sizes: Array, close: float) -> Any:
    """Returns the minimum of a function next to a start, by the simplex of Nelder and Mead of these sizes,
    arrays (d,), whose last place is sought to `close`.
    """
    from scipy.optimize import minimize  # here: half a second that most states do without

    simplex = np.vstack((start, start + np.diag(sizes)))
    options = {"initial_simplex": simplex, "xatol": close, "fatol": np.inf, "maxfev": 400}
    return minimize(function, start, method="Nelder-Mead", options=options)
