"""Contact on square cells of the half-space.

1. A window about the lowest places of the picture (`microblock.halfspace.picture`) grows while cells press
   near its rim, or a gap outside is negative, and shrinks to the contact.
2. Grids of 32, 64, ... cells a side are solved until the estimate, with the load on spots of few cells, is
   below rtol and no place between the cells would touch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.ndimage import label, minimum_filter

from ..corners import projected_gradients
from ..corners.on_cells import Flexibility, Grid
from ..corners.surface_law import SurfaceLaw, closed_corners, on_surface
from ..errors import NOT_YET, BadArgument, NotConverged, out_of_reach
from ..halfplane.counter import require_same_period
from ..halfplane.kernels import is_classical
from ..model.deformable import body_of
from ..model.material import joint_modulus
from ..model.refinement import levels
from ..model.solver import Solver
from ..model.state import State, in_space
from ..model.surfaces import heights, repeated
from ..model.types import AnyArray as Array
from ..model.types import ContactLike, LawLike
from .cells import flexibility
from .counter import FEW, Counter, as_points
from .half_space import HalfSpace
from .kernels import kernels
from .picture import EQUAL, FINE, Picture
from .state import SurfaceCells
from .symbol import symbol

MOST = 1024  # cells a side of the finest grid that rtol may ask for
COARSE_RESIDUAL = 1e-3  # of the coarser grids, over their cells a side
TRIES = 60  # windows
SPOT = 64  # cells of a contact, with fewer of which two grids may agree by themselves
NO_WINDOW = f"no window holds the contact after {TRIES} tries; give Cells(window=(left, right))"


class SurfaceSolver(Solver):
    """States of a HalfSpace; its `options` are `Cells`, with nodes along each axis."""

    usual_rtol = 1e-2
    most_corners = None
    counter_bodies = (HalfSpace,)
    in_space = "cells"

    def __init__(self, contact: ContactLike, options: Any) -> None:
        super().__init__(contact, options)
        if is_classical(self.solid):
            raise BadArgument(
                "beta", self.solid.beta, "must hold the rotation of blocks: a second body alone may have 0"
            )
        require_same_period(self.body, self.obstacle)
        self.surface_law = on_surface(self.law)
        self.period: float | None = self.body.period  # type: ignore[attr-defined]
        if self.period is not None and options.window is not None:
            raise BadArgument("window", options.window, "belongs to a half-space without images")
        if options.nodes is not None and options.nodes > 2 * MOST:
            raise BadArgument("nodes", options.nodes, f"counts along each axis: at most {2 * MOST}")
        _require_repeating(self.period, self.obstacle, self.law, self.surface_law)

    def solve(
        self,
        load: float | None,
        approach: float | None,
        rtol: float | None,
        initial: Any = None,
        progress: bool = False,
    ) -> Any:
        """Returns the SurfaceCells, as `Solver.solve`."""
        nodes = self.options.nodes
        if nodes is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the nodes: not together with Cells(nodes=...)")
        similar = isinstance(initial, SurfaceCells) and len(initial.pressures) == len(self.surface_law.names)
        near, goal = initial if similar else None, self.usual_rtol if rtol is None else rtol
        fixed = self._given_window()
        picture = self._picture(load, approach, fixed)
        box, window = _around(picture.deepest), fixed
        for _ in range(TRIES):
            if window is None:
                window = self._window(picture, load, approach, box)
                picture.look_about(window)
            state, outside = self._refined(picture, window, load, approach, goal, near, progress)
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

    def _refined(
        self,
        picture: Picture,
        window: Grid,
        load: float | None,
        approach: float | None,
        goal: float,
        near: SurfaceCells | None,
        progress: bool,
    ) -> tuple[SurfaceCells, Array]:
        """Returns the state of a window on the first grid with an estimate below the goal, and places that a
        wider window must hold, array (k, 2).
        """
        most, last = self.options.nodes or MOST, self.options.residual
        reached: tuple[float, Any, tuple[str, ...]] = np.inf, None, ()
        sizes = [most // part for part in (32, 16, 8, 4, 2, 1) if most % part == 0 and 2 * most >= 32 * part]

        def solved(count: int, before: Any) -> Any:
            grid, residual = Grid(count, window.side / count, window.middle), COARSE_RESIDUAL / count
            return self._solved(grid, load, approach, last if count == most else residual, before or near)

        for count, state, before, changes in levels(solved, sizes, _change, progress):
            if before is not None:
                loose = max(state.residual * count - COARSE_RESIDUAL, 0.0)  # as short waves feel it
                estimate = _estimate(changes) + _share_of_spots(before, SPOT) + loose
                state = replace(state, error_estimate=estimate)
            if count < most and (self.options.nodes or len(changes) < 2):
                continue
            cut = self.period is None and _reaches(state, 1)
            outside, hidden = self._touching(state, picture)
            if self._given_window() is None and (cut or len(outside)):
                return state, np.vstack((_pressing(state), outside))
            notes, estimate = _warnings(cut, outside, hidden), state.error_estimate
            seen = np.inf if len(hidden) else estimate
            if self.options.nodes or seen <= goal:
                if state.residual > last:
                    state = self._solved(state.grid, load, approach, last, state)
                return replace(state, error_estimate=estimate, notes=notes), np.empty((0, 2))
            if seen <= reached[0]:
                reached = seen, state, notes
            finer = np.log2(MOST / count)
            if (
                _estimate(changes) > goal * 4**finer or _share_of_spots(before, SPOT / 2 / 4**finer) > goal
            ):  # out of reach of MOST
                break
        least, state, notes = reached
        why = "; ".join((f" on {state.grid.count} x {state.grid.count} cells", *notes))
        apart = ", or solve contacts that lie apart each in a Cells(window=(left, right))"
        ways = "fix Cells(nodes=...)" + apart * (self.period is None)
        raise out_of_reach(goal, least, why, ways, load=state.load)

    @cached_property
    def _kept(self) -> dict[Any, Flexibility]:
        return {}

    def _flexibility(self, grid: Grid) -> Flexibility:
        law, cells = self.surface_law, (grid.width, grid.count, self.period is not None)
        tilt = law.tilt(*grid.places)
        if cells not in self._kept:
            self._kept.clear()  # the last one alone: they are large
            second = body_of(self.obstacle)
            counter = second and Counter.on(second.solid, self.solid.ell, law.offsets, *cells)
            self._kept[cells] = flexibility(
                self.solid, law.offsets, tilt, grid.width, cells[-1], law.clamped, counter
            )
        return replace(self._kept[cells], tilt=tilt)

    def _solved(
        self,
        grid: Grid,
        load: float | None,
        approach: float | None,
        residual: float,
        start: SurfaceCells | None,
    ) -> SurfaceCells:
        g0 = self.gaps(*grid.places)
        H, area = self._flexibility(grid), grid.width**2
        first = None
        if start is not None:
            i, j = start.grid.nearest(*grid.places)
            first = area * start.pressures[:, i, j]
        found = projected_gradients.solve(H, g0, load=load, approach=approach, start=first, rtol=residual)
        if not found.load > 0:
            raise BadArgument("approach", approach, NOT_YET)
        surface, forces, other = H.surface(found.forces), found.forces, np.zeros(g0.shape[1:])
        if H.counter is not None:
            other = H.counter.above(forces)
        least = min(2 * found.kkt, COARSE_RESIDUAL / grid.count)  # beyond that touching is a matter of force
        closed = found.gaps <= least * np.ptp(surface[0] + other)
        if H.counter is None:
            forces = self.surface_law.of_least_norm(forces, closed)
        pressures = forces / area
        half, (phi, m) = self.solid.ell / 2, H.turned(forces, surface)
        psi, moment = np.array((phi[1], -phi[0])) / half, np.array((m[1], -m[0])) / area * half
        return SurfaceCells(
            self,
            found.load if load is None else load,
            found.approach,
            grid,
            pressures,
            psi,
            surface[0],
            other,
            moment,
            closed_corners(forces, closed),
            found.kkt,
            found.products,
        )

    # the window

    def _given_window(self) -> Grid | None:
        """Returns the period, the window of the options, or None."""
        left, right = self.options.window or (0.0, 0.0)
        side = self.period or right - left
        return Grid(1, side, ((left + right) / 2,) * 2) if side else None

    def _picture(self, load: float | None, approach: float | None, window: Grid | None) -> Picture:
        second, short = body_of(self.obstacle), np.array([1e4 / self.solid.ell])
        softer = 1 + self.solid.E_star * float(short[0] * np.max(symbol(self.solid, short)[2:]))
        plain = (load or 0.0) / (2 * joint_modulus(self.solid, second and second.solid))
        needed = (plain, softer * plain) if approach is None else approach
        return Picture(self.gaps, self.solid.ell, needed, self.obstacle, window, self.period is not None)

    def gaps(self, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps at places, array (corners, ...)."""
        obstacle = self.obstacle if self.period is None else repeated(self.obstacle, self.period)
        return self.surface_law.initial_gaps(obstacle, self.solid.ell, x1, x2)

    def _window(self, picture: Picture, load: float | None, approach: float | None, box: Array) -> Grid:
        """Returns the square about the contact and a box, array (2, 2)."""
        side = max(3 * picture.radius, 1.5 * np.ptp(box, axis=0).max())
        width = side / FEW
        middle = np.rint(box.mean(axis=0) / width) * width  # symmetric where the obstacle is
        for _ in range(TRIES):
            grid = Grid(FEW, side / FEW, tuple(middle))
            state = self._solved(grid, load, approach, COARSE_RESIDUAL / FEW, None)
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
        """Returns places with a negative gap, outside of the window, and between cells: arrays (k, 2)."""
        low, grid = picture.low(state.approach), state.grid
        if self.period:
            low[:, :2] -= self.period * np.rint(low[:, :2] / self.period)
        away = np.abs(low[:, :2] - grid.middle)
        out = away.max(axis=1) > grid.side / 2
        inside, outside = low[~out], low[out]
        r = np.maximum(np.hypot(*away[out].T), grid.width)
        gaps = outside[:, 2] + state.load / (np.pi * self.solid.E_star * r)  # over a point load
        outside = outside[np.argsort(gaps)[:256]]
        least = picture.lowest[2]
        outside = outside[self._overlap(state, least, outside, *self._surface_at(state, *outside[:, :2].T))]
        i, j = grid.nearest(*inside[:, :2].T)
        cells = self.gaps(*grid.places).min(axis=0)
        near = minimum_filter(cells, 3, mode="nearest" if self.period is None else "wrap")[i, j]
        tip = inside[:, 2] < near - (state.approach - least) / 20
        inside, (psi1, psi2) = inside[tip], state.psi[:, i[tip], j[tip]]
        u = (state.displacement + state.opposite)[i[tip], j[tip]]
        phi = self.solid.ell / 2 * (len(self.surface_law.offsets) > 1) * np.array((-psi2, psi1))
        inside = inside[self._overlap(state, least, inside, u, phi)]
        return outside[:, :2], inside[:, :2]

    def _overlap(self, state: SurfaceCells, least: float, places: Array, u: Array, phi: Array) -> Array:
        """Returns whether gaps under u and phi are negative, boolean (k,)."""
        law, (x1, x2) = self.surface_law, places[:, :2].T
        gaps = self.gaps(x1, x2) - state.approach + u - np.tensordot(law.offsets, phi, 1)
        gaps += (law.tilt(x1, x2) * phi[: len(law.psi0)]).sum(axis=0)
        return np.asarray(gaps.min(axis=0) < -EQUAL * (state.approach - least))

    def _surface_at(self, state: SurfaceCells, x1: Array, x2: Array) -> tuple[Array, Array]:
        """Returns u of both bodies, array (n,) or (corners, n), and phi, array (2, n), at places outside."""
        solid, law, (grid, area) = self.solid, self.surface_law, (state.grid, state.grid.width**2)
        scale, (M1, M2) = area * (1 - solid.nu) / solid.mu / solid.ell, 2 / solid.ell * state.micromoment
        y1, y2, *loads = as_points(*grid.axes, scale * state.total, -scale * M2, scale * M1)
        away = (x1[:, None] - y1) / solid.ell, (x2[:, None] - y2) / solid.ell
        own, v1, v2, *w = kernels(solid).components(*away, law.clamped)
        u, phi = own @ loads[0], np.zeros((2, len(x1)))
        if law.psi0:
            u = u - v1 @ loads[1] - v2 @ loads[2]
            rows = (v1, w[0], w[1]), (v2, w[1], w[2])
            phi = np.array([sum(part @ load for part, load in zip(row, loads)) for row in rows])
        if (counter := self._flexibility(grid).counter) is not None:
            u = u + counter.at(state.pressures * area, grid.axes, x1, x2)
        return u, phi


def _require_repeating(period: float | None, obstacle: Any, law: LawLike, over_surface: SurfaceLaw) -> None:
    """Raises BadArgument unless obstacle and psi0 fit the period."""
    own = getattr(obstacle, "period", None)
    if own is not None and (period is None or abs(period / own - round(period / own)) > EQUAL):
        raise BadArgument("period", period, f"must be a multiple of that of the obstacle, {own}")
    if period is None:
        return
    if not _repeats(partial(heights, obstacle), period):
        raise BadArgument("obstacle", obstacle, f"must repeat with the period, {period:g}")
    if not _repeats(over_surface.tilt, period):
        raise BadArgument("psi0", getattr(law, "psi0", None), f"must repeat with the period, {period:g}")


def _repeats(values: Callable[[Array, Array], Array], period: float) -> bool:
    """Returns whether values, arrays (..., places), agree on opposite edges of a period."""
    along = period * np.linspace(-0.5, 0.5, 65)
    edge = np.full_like(along, period / 2)
    inside = values(*(x.ravel() for x in np.meshgrid(along, along)))
    finite = inside[np.isfinite(inside)]
    most = EQUAL * np.ptp(finite) if finite.size else 0.0
    pairs = (values(edge, along), values(-edge, along)), (values(along, edge), values(along, -edge))
    return all(np.allclose(one, other, rtol=0, atol=most) for one, other in pairs)


def _change(coarse: SurfaceCells, fine: SurfaceCells) -> float:
    """Returns max(|dp|, |dM|/ell)/|p| in L2 between two grids, at the finer cells."""
    places = fine.grid.places
    pressure, first, second = (
        np.linalg.norm(coarse.interpolated(one, *places) - other)
        for one, other in zip((coarse.total, *coarse.micromoment), (fine.total, *fine.micromoment))
    )
    return float(max(pressure, np.hypot(first, second) / fine.solver.solid.ell) / np.linalg.norm(fine.total))


def _share_of_spots(state: SurfaceCells, least: float) -> float:
    """Returns the load's share on spots of fewer cells."""
    # on a period spots go on beyond its rim
    n, repeats = state.grid.count, 1 if state.solver.period is None else 2
    labels = label(np.tile(state.total > 0, (repeats, repeats)), np.ones((3, 3)))[0]
    sizes = np.bincount(labels.ravel())[labels].reshape(repeats, n, repeats, n).max(axis=(0, 2))
    return float(state.total[(sizes < least) & (state.total > 0)].sum() / state.total.sum())


def _estimate(changes: list[float]) -> float:
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
