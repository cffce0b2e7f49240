"""Contact on square cells of the half-space.

1. A window about the lowest places of the picture (`microblock.halfspace.picture`) grows while cells press
   near its rim, or a gap outside is negative, and shrinks to the contact.
2. Grids of 32, 64, ... cells a side are solved until the estimate, with the load on spots of few cells, is
   below rtol and no place between the cells would touch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.ndimage import label, map_coordinates, minimum_filter

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
from .half_space import HalfSpace
from .kernels import kernels
from .picture import FINE, Picture
from .symbol import symbol

TRIES = 60  # windows
FEW = 48  # cells along an axis of a window that is looked for
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
        apart = ", or solve contacts that lie apart each in a Cells(window=(left, right))"
        return "fix Cells(nodes=...)" + apart * (self.period is None)

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> Any:
        """Returns the SurfaceCells, as `Solver.solve`."""
        goal, fixed = self.goal(rtol), self.given_window()
        picture = self._picture(load, approach, fixed)
        box, window = _around(picture.deepest), fixed
        for _ in range(TRIES):
            if window is None:
                window = self._window(picture, load, approach, box)
                picture.look_about(window)
            missed = partial(self.missed, picture)
            state, outside = self.within(window, load, approach, goal, missed, initial)
            if not len(outside):
                # in a disc of so many rows there is a sample
                return replace(state, seen_width=8**0.5 * window.side / FINE)
            box, window = _around(np.vstack((box, outside))), None
        raise NotConverged(NO_WINDOW)

    def state(self, solution: Any) -> State:
        """Returns the State on cells, row after row."""
        shape = solution.displacement.shape
        (x1, x2), width = solution.grid.axes, float(solution.grid.width)
        points = np.stack(np.meshgrid(x1, x2, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
        opposite = None if body_of(self.obstacle) is None else solution.opposite.ravel()
        cells = {"shape": shape, "x1": x1, "x2": x2, "width": width, "opposite": opposite}
        return in_space(solution, points, np.full(len(points), width**2), **cells)

    def missed(self, picture: Picture, state: SurfaceCells) -> tuple[Array, tuple[str, ...], bool]:
        """Returns places that a window must hold, what a fixed one leaves out, and whether a place between
        cells would touch.
        """
        cut = self.period is None and _reaches(state, 1)
        outside, hidden = self._touching(state, picture)
        if self.given_window() is None and (cut or len(outside)):
            return np.vstack((_pressing(state), outside)), (), False
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

    def flexibility(self, grid: Grid) -> Flexibility:
        """Returns the Flexibility of a grid."""
        law, cells, second = self.surface_law, (grid.width, self.period is not None), body_of(self.obstacle)
        counter = second and Counter(
            second.solid, self.solid.ell, law.offsets, grid.width, grid.count, cells[1]
        )
        return flexibility(self.solid, law.offsets, law.tilt(*grid.places), *cells, law.clamped, counter)

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

    def _window(self, picture: Picture, load: float | None, approach: float | None, box: Array) -> Grid:
        """Returns the square about the contact and a box, array (2, 2)."""
        side = max(3 * picture.radius, 1.5 * np.ptp(box, axis=0).max())
        width = side / FEW
        middle = np.rint(box.mean(axis=0) / width) * width  # symmetric where the obstacle is
        for _ in range(TRIES):
            grid = Grid(FEW, side / FEW, tuple(middle))
            state = self.solved(grid, load, approach, self.loose / FEW)
            outside = self._touching(state, picture)[0]
            box = _around(np.vstack((box, outside)))
            held = _around(np.vstack((box, _pressing(state))))
            size = np.ptp(held, axis=0).max()
            middle, before = np.rint(2 * held.mean(axis=0) / grid.width) * grid.width / 2, side
            side = size * (1.16 + 6 / FEW)  # a twelfth and three cells free on either side
            if _reaches(state, 2) and not len(outside):
                side = 1.5 * before
            elif not len(outside) and size >= 0.3 * before:
                return Grid(FEW, side / FEW, tuple(middle))
        raise NotConverged(NO_WINDOW)

    def _touching(self, state: SurfaceCells, picture: Picture) -> tuple[Array, Array]:
        """Returns places with the most negative gaps, beside the window and between cells: arrays (k, 2)."""
        low, grid, least = picture.low(state.approach), state.grid, picture.lowest[2]
        if self.period:
            low[:, :2] -= self.period * np.rint(low[:, :2] / self.period)
        out = np.abs(low[:, :2] - grid.middle).max(axis=1) > grid.side / 2
        outside, inside = low[out, :2], low[~out]
        (i, j), (H, g0) = grid.nearest(*inside[:, :2].T), self.prepared(grid)
        near = minimum_filter(g0.min(axis=0), 3, mode="nearest" if self.period is None else "wrap")[i, j]
        tip = inside[:, 2] < near - (state.approach - least) / 20
        inside, added = inside[tip, :2], (H @ (state.pressures * grid.area))[:, i[tip], j[tip]]

        def negative(places: Array, added: Array) -> Array:
            gaps = (self.gaps(*places.T) - state.approach + added).min(axis=0)
            deepest = np.argsort(gaps)[:256]
            return np.asarray(places[deepest[gaps[deepest] < -EQUAL * (state.approach - least)]])

        return negative(outside, self.beyond(state, outside)), negative(inside, added)

    def beyond(self, state: SurfaceCells, places: Array) -> Array:
        """Returns what a state adds to gaps at places outside of its window, array (corners, k), by its
        forces on larger squares, in shares at the four next to each.
        """
        found, rest = np.zeros((len(state.pressures), len(places))), np.ones(len(places), bool)
        away, forces = np.abs(places - state.grid.middle).max(axis=1), state.pressures * state.grid.area
        while rest.any():
            grid = Grid(2 * FEW, 2 * away[rest].min() / FEW, state.grid.middle)
            steps, loads = grid.steps(*state.grid.places), np.zeros((len(forces), grid.count, grid.count))
            first = np.floor(steps).astype(int)
            for way in np.ndindex(2, 2):
                share = np.prod([np.abs(1 - one - part) for one, part in zip(way, steps - first)], axis=0)
                index: Any = slice(None), first[0] + way[0], first[1] + way[1]
                np.add.at(loads, index, share * forces)
            own = rest & (away < (grid.side - grid.width) / 2)
            where = grid.steps(*places[own].T)
            found[:, own] = [map_coordinates(one, where, order=1) for one in self.flexibility(grid) @ loads]
            rest &= ~own
        return found


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


def _share_of_spots(state: SurfaceCells, least: float) -> float:
    """Returns the load's share on spots of fewer cells."""
    # on a period spots go on beyond its rim
    n, repeats = state.grid.count, 1 if state.solver.period is None else 2
    labels = label(np.tile(state.total > 0, (repeats, repeats)), np.ones((3, 3)))[0]
    sizes = np.bincount(labels.ravel())[labels].reshape(repeats, n, repeats, n).max(axis=(0, 2))
    return float(state.total[(sizes < least) & (state.total > 0)].sum() / state.total.sum())


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


def _pressing(state: SurfaceCells) -> Array:
    """Returns the rectangle of cells that press, array (2, 2)."""
    centres = np.column_stack([x[state.closed > 0] for x in state.grid.places])
    return _around(centres) + state.grid.width / 2 * np.array([[-1], [1]])


def _around(places: Array) -> Array:
    """Returns the least and the largest x1 and x2 of places, array (2, 2)."""
    return np.array((places.min(axis=0), places.max(axis=0)))


def _reaches(state: SurfaceCells, rim: int) -> bool:
    return bool(np.count_nonzero(state.closed[rim:-rim, rim:-rim]) < np.count_nonzero(state.closed))
