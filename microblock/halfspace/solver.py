"""Contact on square cells of the half-space.

1. A window about the lowest places of the picture (`microblock.halfspace.picture`) grows while cells press
   near its rim, or a gap outside is negative, and shrinks to the contact.
2. Grids of 32, 64, ... cells a side are solved until the estimate, with the load on spots of few cells, is
   below rtol and no place between the cells would touch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.ndimage import find_objects, label, map_coordinates, minimum_filter

from ..corners.cell_solver import EQUAL, CellSolution, CellSolver
from ..corners.on_cells import Flexibility, Grid
from ..corners.projected_gradients import GridForces
from ..corners.surface_law import closed_corners, on_surface
from ..errors import NOT_YET, BadArgument, NotConverged
from ..halfplane.kernels import at_rest, is_classical
from ..model.deformable import body_of
from ..model.material import Cosserat, joint_modulus
from ..model.obstacles import heights, repeated
from ..model.state import State, in_space
from ..model.types import AnyArray as Array
from ..model.types import ContactLike
from .counter import Counter
from .counter import response as second_response
from .half_space import HalfSpace
from .kernels import kernels, response
from .picture import FINE, Picture
from .squares import NODES, Counters, Coupled, Squares, close_ones_joined, nodes, of_nodes, on_rows
from .symbol import symbol

TRIES = 60  # windows
FEW = 48  # cells along an axis of a window that is looked for
FREE = 1.16 + 6 / FEW  # a twelfth and three cells on either side of a contact
SPARSE = 0.01  # of a period that may touch, above which one grid has fewer cells than several squares
MOST = 64  # squares, whose pairs would fill the memory
SPOT = 64  # cells of a contact, with fewer of which two grids may agree by themselves
NO_WINDOW = f"no window holds the contact after {TRIES} tries; give Cells(window=(left, right))"


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(CellSolution):
    """A solution on square cells, with pressures of least norm.

    Attributes
    ----------
    closed : array (n, n) of int
        Number of closed corners.
    seen_width : float or None
        As of `microblock.State`.
    """

    closed: Any = None
    seen_width: float | None = None

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner, by number, at places, array (k, 2) or (k, 3)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns values on cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self.interpolated(values, *places.T[:2])

    def counter_displacement(self, places: Array) -> Array:
        """Returns the displacement along x3 of a second body at places, array (k,)."""
        return self.between(self.opposite, places)


class SurfaceSolver(CellSolver):
    """States of a HalfSpace; its `options` are `Cells`, with nodes along each axis."""

    most_corners = None
    counter_bodies = (HalfSpace,)
    in_space = "cells"
    dimensions, coarsest, most, few, loose, solution = 2, 32, 1024, 16, 1e-3, SurfaceCells

    def __init__(self, contact: ContactLike, options: Any) -> None:
        super().__init__(contact, options)
        if is_classical(self.solid):
            raise BadArgument(
                "beta", self.solid.beta, "must hold the rotation of blocks: a second body alone may have 0"
            )
        self.surface_law = on_surface(self.law)
        self.offsets, self.tilt = self.surface_law.offsets, self.surface_law.tilt
        if options.nodes is not None and options.nodes > 2 * self.most:
            raise BadArgument("nodes", options.nodes, f"counts along each axis: at most {2 * self.most}")
        own = getattr(self.obstacle, "period", None)
        if own is not None and self.period is None:
            raise BadArgument("period", None, f"must be a multiple of that of the obstacle, {own}")
        self.require_repeating(lambda x1, x2: heights(self.obstacle, x1, x2))

    @property
    def besides(self) -> str:
        return "fix Cells(nodes=...)"

    def solve(
        self,
        load: float | None,
        approach: float | None,
        rtol: float | None,
        initial: Any = None,
        progress: bool = False,
    ) -> Any:
        """Returns the SurfaceCells, as `Solver.solve`."""
        goal, fixed = self.goal(rtol), self.whole or self.given_window()
        picture = self._picture(load, approach, fixed)
        places, searched = picture.deepest, fixed is None or self._is_sparse(picture)
        for _ in range(TRIES):
            window = self._window(picture, load, approach, places) if searched else fixed
            width = picture.look_about(window) if window is not fixed else 8**0.5 * fixed.side / FINE
            missed = partial(self.missed, picture)
            state, outside = self.within(window, load, approach, goal, missed, initial, progress)
            if not len(outside):
                return replace(state, seen_width=width)
            places = np.vstack((places, outside))
        raise NotConverged(NO_WINDOW)

    def state(self, solution: Any) -> State:
        """Returns the State on cells, square after square and row after row."""
        grids, second = squares_of(solution.grid), body_of(self.obstacle) is not None
        points = np.concatenate([np.stack((*grid.places, 0 * grid.places[0]), axis=-1) for grid in grids])
        cells: dict[str, Any] = {"squares": grids, "opposite": solution.opposite.ravel() if second else None}
        if len(grids) == 1:
            (x1, x2), width = grids[0].axes, float(grids[0].width)
            cells |= {"shape": grids[0].places[0].shape, "x1": x1, "x2": x2, "width": width}
        areas = np.repeat([grid.area for grid in grids], grids[0].count ** 2)
        return in_space(solution, points.reshape(-1, 3), areas, **cells)

    def missed(self, picture: Picture, state: SurfaceCells) -> tuple[Array, tuple[str, ...], bool]:
        """Returns places that a window must hold, what a fixed one leaves out, and whether a place between
        cells would touch.
        """
        cut = any(_reach(state, 1))
        outside, hidden = self._touching(state, picture)
        if self.options.window is None and (cut or len(outside)):
            return np.vstack((*_spots(state), outside)), (), False
        return np.empty((0, 2)), _warnings(cut, outside, hidden), len(hidden) > 0

    def estimate(self, changes: list[float], before: SurfaceCells, state: SurfaceCells) -> float:
        """Returns the error of a grid from successive changes, the load on spots, and the residual as short
        waves feel it.
        """
        return _of_changes(changes) + _share_of_spots(before, SPOT) + state.residual * state.grid.count

    def hopeless(self, changes: list[float], before: SurfaceCells, goal: float, finer: int) -> bool:
        """Returns whether grids so many times finer miss the goal."""
        return _of_changes(changes) > goal * finer**2 or _share_of_spots(before, SPOT / 2 / finer**2) > goal

    def turned(self, own: Array) -> Array:
        """Returns rotations about x1 and x2 of phi, array (2, ...)."""
        return np.array((own[1], -own[0]))

    def gaps(self, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps at places, array (corners, ...)."""
        obstacle = self.obstacle if self.period is None else repeated(self.obstacle, self.period)
        return self.surface_law.initial_gaps(obstacle, self.solid.ell, x1, x2)

    def flexibility(self, grid: Grid | Squares) -> Flexibility:
        """Returns the Flexibility of a grid, or of several."""
        if isinstance(grid, Grid):
            return self._alone(grid, self.period is not None)
        law, kept = self.surface_law, dict[float, Flexibility]()  # squares of one width share tables
        for one in grid.grids:
            kept[one.width] = kept.get(one.width) or self._alone(one, False)
        owns, counter = [kept[one.width] for one in grid.grids], None
        if self.second is not None:
            counters, places = [own.counter for own in owns], self.solid.ell / 2 * law.offsets
            counter = Counters(counters, grid, places, self._second_response)
        return Coupled(grid, owns, law.tilt(*grid.places), self._response, counter)

    def _alone(self, grid: Grid, periodic: bool) -> Flexibility:
        law, second = self.surface_law, self.second
        cells = grid.width, periodic
        counter = second and Counter(second, self.solid.ell, law.offsets, grid.width, grid.count, periodic)
        return flexibility(self.solid, law.offsets, law.tilt(*grid.places), *cells, law.clamped, counter)

    @cached_property
    def second(self) -> Any:
        """Solid of a second body, or None."""
        second = body_of(self.obstacle)
        return None if second is None else second.solid

    @cached_property
    def _response(self) -> Any:
        return response(self.solid, self.surface_law.clamped, self.period)

    @cached_property
    def _second_response(self) -> Any:
        return second_response(self.second, self.period)

    def completed(self, state: SurfaceCells, H: Flexibility, found: GridForces) -> SurfaceCells:
        """Returns a state with pressures of least norm, closed corners and a second body."""
        if not found.load > 0:
            raise BadArgument("approach", found.approach, NOT_YET)
        forces = found.forces
        other = np.zeros(forces.shape[1:]) if H.counter is None else H.counter.above(forces)
        least = min(2 * found.kkt, self.loose / state.grid.count)  # beyond that touching is a matter of force
        closed = found.gaps <= least * np.ptp(state.displacement + other)
        if H.counter is None:
            forces = self.surface_law.of_least_norm(forces, closed)
        touching = closed_corners(forces, closed)
        return replace(state, pressures=forces / state.grid.area, opposite=other, closed=touching)

    # the window

    def _picture(self, load: float | None, approach: float | None, window: Grid | None) -> Picture:
        second, short = body_of(self.obstacle), np.array([1e4 / self.solid.ell])
        softer = 1 + self.solid.E_star * float(short[0] * np.max(symbol(self.solid, short)[2:]))
        plain = (load or 0.0) / (2 * joint_modulus(self.solid, second and second.solid))
        needed = (plain, softer * plain) if approach is None else approach
        return Picture(self.gaps, self.solid.ell, needed, self.obstacle, window, self.period is not None)

    def _is_sparse(self, picture: Picture) -> bool:
        """Returns whether so little of a period can touch that several squares of cells are tried."""
        if self.period is None or self.options.nodes is not None:
            return False
        inside = self.second is None or self.solid.ell < self.period / 4  # corners stay in a period
        return inside and len(picture.low(picture.bound)) < SPARSE * FINE**2

    def _window(self, picture: Picture, load: float | None, approach: float | None, places: Array) -> Any:
        """Returns the squares about the contact and about places, array (k, 2), as a Grid if one is enough."""
        reach = 3 * picture.radius
        parts, width = [(box, reach) for box in _clusters(places, 1.5 * reach)], None
        window = self._about(parts, 1.5, width, MOST)
        for number in range(TRIES):
            if window is self.whole:
                return window
            state, before = self.solved(window, load, approach, self.loose / FEW), window
            outside = self._touching(state, picture)[0]
            places = np.vstack((places, outside))
            parts, grows = self._parts(state, places, outside, reach)
            most = MOST if 2 * number < TRIES else 1  # squares that join and part without end are one
            window = self._about(parts, FREE, squares_of(before)[0].width, most)
            if grows or len(outside) or window is self.whole:
                continue
            one, other = (np.sort([grid.side for grid in squares_of(each)]) for each in (window, before))
            if len(one) == len(other) and np.all(one >= 0.3 * FREE * other):
                return window
        raise NotConverged(NO_WINDOW)

    def _parts(self, state: SurfaceCells, places: Array, outside: Array, reach: float) -> Any:
        """Returns rectangles that squares must hold, each with the least side, and whether one grows."""
        parts, grows = [(box, reach) for box in _clusters(outside, 1.5 * reach)], False
        for grid, reaches, spots in zip(squares_of(state.grid), _reach(state, 2), _spots_of(state)):
            near = np.transpose(_near(state.grid, grid, *places.T))
            held = near[grid.beyond(*near.T) <= 0]
            for low, high in spots:
                held = held[np.any((held < low) | (held > high), axis=1)]
            if reaches and not len(outside):
                parts.append((_around(np.vstack((*spots, held))), 1.5 * grid.side))
                grows = True
            else:
                parts += [(spot, 0.0) for spot in spots]
                parts += [(box, grid.side / 8) for box in _clusters(held, grid.side / 8)]
        return parts, grows

    @cached_property
    def whole(self) -> Grid | None:
        """The period as a Grid, or None."""
        return self.given_window() if self.period else None

    def _about(self, parts: Any, times: float, width: float | None, most: int) -> Any:
        """Returns squares about rectangles, so many times as wide and no narrower than their least sides; one
        instead of more than `most`, or where three times as many cells are as small as theirs.
        """
        shifts = np.zeros((1, 2))
        if self.second is not None:
            shifts = self.solid.ell / 2 * (self.offsets[:, None] - self.offsets).reshape(-1, 2)
        parts, all_parts = close_ones_joined(parts, times, self.period, shifts), parts
        sides = np.array([side for _, side in parts])
        box = _around(np.vstack([box for box, _ in all_parts]))
        single = max(times * np.ptp(box, axis=0).max(), max(side for _, side in all_parts))
        if len(parts) > most or (len(parts) > 1 and len(parts) * np.min(sides) ** 2 > single**2 / 3):
            if self.period:
                return self.whole
            parts, sides = [(box, single)], np.array([single])
        if self.period and sides.max() > self.period / 2:
            return self.whole
        if len(parts) > 1:  # few widths, which share tables
            sides = sides.max() / 2.0 ** (np.floor(3 * np.log2(sides.max() / sides)) / 3)
            width = None
        grids = []
        for (box, _), side in zip(parts, sides.tolist()):
            step = side / FEW if width is None else width / 2
            middle = np.rint(box.mean(axis=0) / step) * step  # symmetric where the obstacle is
            grids.append(Grid(FEW, side / FEW, tuple(middle.tolist())))
        grids.sort(key=lambda grid: -grid.width)  # the least curvatures are those of the widest cells
        return grids[0] if len(grids) == 1 and not self.period else Squares(tuple(grids), self.period)

    def _touching(self, state: SurfaceCells, picture: Picture) -> tuple[Array, Array]:
        """Returns places with the most negative gaps, beside the window and between cells: arrays (k, 2)."""
        low, grid, least = picture.low(state.approach), state.grid, picture.lowest[2]
        if self.period:
            low[:, :2] -= self.period * np.rint(low[:, :2] / self.period)
        out = grid.beyond(*low[:, :2].T) > 0
        outside, inside = low[out, :2], low[~out]
        cells, (H, g0) = tuple(grid.nearest(*inside[:, :2].T)), self.prepared(grid)
        f, mode = g0.min(axis=0), "wrap" if _is_whole(state) else "nearest"
        near = minimum_filter(f, (*[1] * (f.ndim - 2), 3, 3), mode=mode)[cells]
        tip = inside[:, 2] < near - (state.approach - least) / 20
        added = (H @ (state.pressures * grid.area))[(slice(None), *(one[tip] for one in cells))]
        inside = inside[tip, :2]

        def negative(places: Array, added: Array) -> Array:
            gaps = (self.gaps(*places.T) - state.approach + added).min(axis=0)
            deepest = np.argsort(gaps)[:256]
            return np.asarray(places[deepest[gaps[deepest] < -EQUAL * (state.approach - least)]])

        return negative(outside, self.beyond(state, outside)), negative(inside, added)

    def beyond(self, state: SurfaceCells, places: Array) -> Array:
        """Returns what a state adds to gaps at places outside of its squares, array (corners, k): beside a
        square on one twice as wide, where that of others is smooth, farther away by the loads at nodes.
        """
        found, forces = np.zeros((len(state.pressures), len(places))), state.pressures * state.grid.area
        loads, grids = self.prepared(state.grid)[0].resultants(forces), squares_of(state.grid)
        forces, loads = (one.reshape(len(one), -1, *one.shape[-2:]).swapaxes(0, 1) for one in (forces, loads))
        sources, rest = [*zip(grids, forces, loads)], np.ones(len(places), bool)
        for grid, own, _ in sources:
            near, wide = _near(state.grid, grid, *places.T), Grid(2 * FEW, grid.side / FEW, grid.middle)
            beside = rest & (wide.beyond(*near) < -wide.width / 2)
            if not beside.any():
                continue
            added, rest = self._alone(wide, False) @ _shared(wide, grid, own), rest & ~beside
            for other in sources if self.period else [one for one in sources if one[0] is not grid]:
                free = np.inf if other[0] is grid else other[0].beyond(*_near(state.grid, other[0], *np.array(grid.middle)))
                pieces = max(np.ceil(wide.side / (2 * max(free - grid.side, wide.width))), 1)
                if pieces * NODES < FEW:
                    B = nodes(wide.count, int(pieces))[1]
                    values = self._afar(*other, of_nodes(wide, int(pieces)), other[0] is grid)
                    added += B @ values.reshape(len(added), B.shape[1], -1) @ B.T
                else:
                    found[:, beside] += self._afar(*other, near[:, beside], False)
            where = wide.steps(*near[:, beside])
            found[:, beside] += [map_coordinates(one, where, order=1) for one in added]
        for one in sources if rest.any() else ():
            found[:, rest] += self._afar(*one, places[rest].T, False)
        return found

    def _afar(self, grid: Grid, forces: Array, loads: Array, places: Array, itself: bool) -> Array:
        """Returns what forces and (p, m) at the nodes of a grid add to gaps, of `itself` only their images."""
        B, law, (x, y) = nodes(grid.count, 1)[1], self.surface_law, places[:, :, None] - of_nodes(grid, 1)[:, None]

        def displaced(K: Array, values: Array) -> Array:
            return np.einsum("rckn,cn->rk", K, (B.T @ values @ B).reshape(len(values), -1))

        surface = displaced(on_rows(self._response(x, y, itself), len(loads)), loads)
        ones = np.ones((len(forces), 1))
        found = (ones if len(forces) == 1 else np.hstack((ones, -law.offsets))) @ surface
        found += (law.tilt(*places) * surface[1:]).sum(axis=0)
        if self.second is not None:
            corners = self.solid.ell / 2 * law.offsets
            apart = corners[:, None] - corners
            K = np.array([[self._second_response(x + a, y + b, itself)[0] for a, b in row] for row in apart])
            found += displaced(K, forces)
        return np.asarray(found)


def flexibility(
    solid: Cosserat,
    offsets: Array,
    tilt: Array,
    width: float,
    periodic: bool,
    clamped: bool,
    counter: Counter | None = None,
) -> Flexibility:
    """Returns the Flexibility of corners on as many cells as there are tilts."""

    def cells() -> Array:
        found = kernels(solid).cells(tilt.shape[-1], width / solid.ell, clamped)
        found *= (1 - solid.nu) / solid.mu / solid.ell
        if clamped:
            found[1:] *= width**2 / solid.ell * solid.mu / (1 - solid.nu)
        return found

    rest = at_rest(solid) if periodic else None

    return Flexibility(offsets, tilt, clamped, width, rest, partial(symbol, solid), cells, counter)


def _shared(wide: Grid, grid: Grid, forces: Array) -> Array:
    """Returns forces on a grid in shares at the four cells of a wider one next to each."""
    steps, loads = wide.steps(*grid.places), np.zeros((len(forces), wide.count, wide.count))
    first = np.floor(steps).astype(int)
    for way in np.ndindex(2, 2):
        share = np.prod([np.abs(1 - one - part) for one, part in zip(way, steps - first)], axis=0)
        index: Any = slice(None), first[0] + way[0], first[1] + way[1]
        np.add.at(loads, index, share * forces)
    return loads


def _is_whole(state: SurfaceCells) -> bool:
    """Returns whether the cells are those of a whole period."""
    return state.solver.period is not None and isinstance(state.grid, Grid)


def squares_of(grid: Grid | Squares) -> tuple[Grid, ...]:
    return (grid,) if isinstance(grid, Grid) else grid.grids


def _near(window: Grid | Squares, grid: Grid, *x: Array) -> Array:
    """Returns the images of places next to a grid of a window."""
    return np.array(x) if isinstance(window, Grid) else window.near(grid, *x)


def _share_of_spots(state: SurfaceCells, least: float) -> float:
    """Returns the load's share on spots of fewer cells."""
    # on a period spots go on beyond its rim
    n, repeats = state.grid.count, 1 + _is_whole(state)
    pressed, forces = state.total.reshape(-1, n, n) > 0, (state.total * state.grid.area).reshape(-1, n, n)
    cross = np.array((np.zeros((3, 3)), np.ones((3, 3)), np.zeros((3, 3))))
    labels = label(np.tile(pressed, (1, repeats, repeats)), cross)[0]
    sizes = np.bincount(labels.ravel())[labels].reshape(-1, repeats, n, repeats, n).max(axis=(1, 3))
    return float(forces[(sizes < least) & pressed].sum() / forces.sum())


def _of_changes(changes: list[float]) -> float:
    """Returns the error of the last grid from successive changes.

    Alike errors that fall by a ratio r leave r - 1 times the finer one as change, independent ones of the
    edge's steps sqrt(1 + r^2) times.
    """
    *_, before, last = 1.4 * changes[-1], *changes  # as errors fall as a rule
    ratio = before / last if last > 0 else 1.4
    return max(last, before / 2.5) / min(max(ratio - 0.5, 0.5), 1.4)


def _warnings(cut: bool, outside: Array, hidden: Array) -> tuple[str, ...]:
    """Returns what a fixed window or fixed nodes leave out."""
    parts = (outside, "outside of the window"), (hidden, "between cells")
    at = [(*places[0], where) for places, where in parts if len(places)]
    words = (f"the obstacle would touch {where} as well, as at ({x1:.4g}, {x2:.4g})" for x1, x2, where in at)
    return *["the window cuts the contact: cells at its rim press"] * cut, *words


def _spots_of(state: SurfaceCells) -> list[list[Array]]:
    """Returns the rectangles of connected cells that press, arrays (2, 2), of each square."""
    grids = squares_of(state.grid)
    found = []
    for grid, closed in zip(grids, state.closed.reshape(len(grids), grids[0].count, -1)):
        spots = find_objects(label(closed > 0, np.ones((3, 3)))[0])
        first = np.array([x[0] for x in grid.axes]) - grid.width / 2
        found.append([first + grid.width * np.array([[s.start for s in spot], [s.stop for s in spot]]) for spot in spots])
    return found


def _spots(state: SurfaceCells) -> list[Array]:
    return [spot for spots in _spots_of(state) for spot in spots]


def _around(places: Array) -> Array:
    """Returns the least and the largest x1 and x2 of places, array (2, 2)."""
    return np.array((places.min(axis=0), places.max(axis=0)))


def _clusters(places: Array, reach: float) -> list[Array]:
    """Returns rectangles about places, arrays (2, 2), that are no closer to each other."""
    found = []
    while len(places):
        box, inside = _around(places[:1]), np.zeros(len(places), bool)
        while True:
            more = np.all((places >= box[0] - reach) & (places <= box[1] + reach), axis=1)
            if more.sum() == inside.sum():
                break
            box, inside = _around(places[more]), more
        found.append(box)
        places = places[~inside]
    return found


def _reach(state: SurfaceCells, rim: int) -> list[bool]:
    """Returns of each square whether cells at its rim press, never on the whole of a period."""
    n = state.grid.count
    closed = state.closed.reshape(-1, n, n) > 0
    inner = closed[:, rim:-rim, rim:-rim].sum(axis=(1, 2)) < closed.sum(axis=(1, 2))
    return list((inner & (not _is_whole(state))).tolist())
