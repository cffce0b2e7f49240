"""Contact on uniform cells, matrix-free: large rough problems, and periodic ones."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from tqdm.auto import tqdm

from ..corners import projected_gradients
from ..errors import BadArgument, NotConverged, out_of_reach
from ..model import picture
from ..model.deformable import body_of, shape_of
from ..model.law import level_surface, require_pure_force
from ..model.obstacles import heights
from ..model.problem import Problem
from ..model.quadrature import gauss_rule
from ..model.solver import Solver
from ..model.state import Solution, corner_gaps
from ..model.zones import contact_zones, distance_to_ends, runs
from .cells import CellGrid
from .counter import require_same_period
from .friction_solver import FrictionSolver
from .kernels import HalfPlane

FIRST, MOST = 128, 2**21  # cells of the coarsest and finest grid that rtol may ask for
# at which halving a given number of cells ends, after two halvings at the earliest
COARSEST = 1024
FITS = 1e-6  # of their range, heights at both ends of a period may differ; so may periods


@dataclass(frozen=True, eq=False, repr=False)
class CellSolution(Solution):
    """A solution on uniform cells.

    Attributes
    ----------
    x, weights : arrays (n,), centres and lengths of the cells
    pressures : array (corners, n)
    micromoment, psi, displacement : arrays (n,), M of (29) or the reaction to psi = 0, psi, -u2
    load, approach : force per thickness (and period), approach over the mean of the surface
    energy : up to a constant
    residual : `GridForces.kkt` of `microblock.corners.projected_gradients`
    iterations : products with the flexibility
    change : the error estimate, or None
    notes : sentences on why cells were taken
    raised : array (corners, n), displacement of a second body, or None
    """

    solver: Solver
    x: np.ndarray
    weights: np.ndarray
    pressures: np.ndarray
    micromoment: np.ndarray
    psi: np.ndarray
    displacement: np.ndarray
    load: float
    approach: float
    energy: float
    residual: float
    iterations: int
    change: float | None = None
    notes: tuple = ()
    raised: np.ndarray | None = None

    method = "cells"

    @property
    def error_estimate(self):
        return self.change

    @property
    def unknowns(self):
        return self.pressures.size

    @property
    def period(self):
        return self.solver.body.period

    @property
    def all_zones(self):
        """{corner number: array (k, 2), intervals of cells with pressure}."""
        half = self.weights[0] / 2
        return {
            number: np.array(
                [(self.x[first] - half, self.x[last] + half) for first, last in runs(own > 0)]
            ).reshape(-1, 2)
            for number, own in enumerate(self.pressures)
        }

    @property
    def problem(self):
        return self.solver.problem

    @property
    def zones_by_name(self):
        return contact_zones(self.all_zones, self.solver.law.corners)

    def pressure(self, corner, x):
        """Pressure of a corner at x, array (n,): a polygon through the centres."""
        x, own = _folded(x, self.period), self.pressures[corner]
        along, last = (x - self.x[0]) / self.weights[0], len(own) - 1
        cell = np.floor(along + 0.5)
        inside, beside = (cell >= 0) & (cell <= last), cell + np.sign(along - cell)
        beside = np.clip(beside, 0, last) if self.period is None else beside % len(own)
        here, there = own[np.clip(cell, 0, last).astype(int)], own[beside.astype(int)]
        slope = np.where((here > 0) & (there > 0), there - here, 0.0)
        return np.where(inside, here + np.abs(along - cell) * slope, 0.0)

    def pressure_and_moment(self, x):
        """Total pressure and micromoment over ell at x, array (2, n)."""
        own = np.array([self.pressure(corner, x) for corner in range(len(self.pressures))])
        if len(own) > 1:
            return np.array((own.sum(axis=0), (self.problem.levers(x) * own).sum(axis=0) / 2))
        reaction = _polygon(_folded(x, self.period), self.x, self.micromoment, self.period)
        return np.array((own[0], reaction / self.problem.ell))

    def moment_at(self, x):
        return self.problem.ell * self.pressure_and_moment(x)[1]

    def gap(self, corner, x):
        """Gap of a corner at x, array (n,); BadArgument beyond the cells."""
        period, half = self.period, self.weights[0] / 2
        if period is None and not np.all((x >= self.x[0] - half) & (x <= self.x[-1] + half)):
            raise BadArgument(
                "x", x, f"must lie within the cells, from {self.x[0] - half} to {self.x[-1] + half}"
            )
        place = _folded(x, period)
        raised, psi = (_polygon(place, self.x, own, period) for own in (self.displacement, self.psi))
        where = self.problem, self.approach, *level_surface(x)
        return corner_gaps(*where, raised, psi, self.counter_displacement)[corner]

    def counter_displacement(self, x):
        if self.raised is None:
            return np.zeros_like(x)
        places = np.concatenate([self.x - shift for shift in self.problem.shifts])
        places = _folded(places, self.period)
        order = np.argsort(places)
        return _polygon(_folded(x, self.period), places[order], self.raised.ravel()[order], self.period)


class CellSolver(Solver):
    """States of a half-plane on uniform cells; its `options` are `Cells`."""

    usual_rtol = 1e-2
    counter_bodies = (HalfPlane,)

    def __init__(self, contact, options):
        super().__init__(contact, options)
        require_same_period(self.body, self.obstacle)
        require_pure_force(self.law, self.solid.ell)
        if self.body.period is not None and options.window is not None:
            raise BadArgument(
                "window", options.window, "belongs to a half-plane without images; here it is the period"
            )
        if self.body.period is not None:
            self._require_repeating()
        if options.window is None and self.body.period is None:
            self.require_lowest()

    def _require_repeating(self):
        period = self.body.period
        own = getattr(self.obstacle, "period", None)
        if own is not None and abs(period / own - round(period / own)) > FITS:
            raise BadArgument("period", period, f"must be a multiple of that of the obstacle, {own}")
        x = period * np.concatenate(([-0.5, 0.5], np.linspace(-0.5, 0.5, 257)))
        above = heights(self.obstacle, x)
        known = above[np.isfinite(above)]
        if np.isfinite(above[:2]).all() and abs(above[1] - above[0]) > FITS * np.ptp(known):
            raise BadArgument(
                "obstacle",
                self.obstacle,
                "must repeat with the period: its height is "
                f"{above[0]:.4g} at x = {x[0]:g} and {above[1]:.4g} at x = {x[1]:g}",
            )
        psi0 = self.law.initial_rotation(x[:2])
        if abs(psi0[1] - psi0[0]) > FITS * np.ptp(self.law.initial_rotation(x)):
            raise BadArgument(
                "psi0", getattr(self.law, "psi0", None), f"must repeat with the period, {period:g}"
            )

    @property
    def has_level(self):
        return self.body.period is not None

    @cached_property
    def problem(self):
        obstacle, counter = shape_of(self.obstacle), body_of(self.obstacle)
        obstacle = obstacle if self.body.period is None else _repeated(obstacle, self.body.period)
        return Problem(self.solid, self.law, obstacle, counter=None if counter is None else counter.solid)

    def history(self, pairs, coupled, rtol, progress=False):
        if self.body.period is not None:
            return super().history(pairs, coupled, rtol, progress)
        if self.options.nodes is not None or self.options.window is not None:
            raise BadArgument(
                "method",
                self.options,
                "must be Cells() without nodes and window: along a history cells get smaller at all edges",
            )
        return FrictionSolver(self, pairs, coupled).history(rtol, progress)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        solver = self._with_window(load)
        nodes = self.options.nodes
        if nodes is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the nodes: not together with Cells(nodes=...)")
        if nodes is not None:
            start = initial if isinstance(initial, CellSolution) else None
            *_, last = solver._solutions(
                load, approach, halvings(nodes), self.options.residual, progress, start
            )
            return last
        rtol = self.usual_rtol if rtol is None else rtol
        doublings = FIRST * 2 ** np.arange(int(np.log2(MOST / FIRST)) + 1)
        state = solver.upto(load, rtol, doublings, approach=approach, progress=progress)
        if state.error_estimate <= rtol:
            return state
        panels = "" if solver.has_level else "take Panels() under a smooth obstacle"  # none on a period
        why = f" on {len(state.x)} cells"
        raise out_of_reach(rtol, state.error_estimate, why, panels, load=load, approach=approach)

    def _with_window(self, load):
        if self.body.period is not None or self.options.window is not None:
            return self
        if load is None:
            raise BadArgument(
                "window",
                None,
                "must be (left, right), where the obstacle may touch, if the approach is given",
            )
        found = picture.picture(self.problem, load)
        return CellSolver(self.contact, replace(self.options, window=around(found, self.solid.ell)))

    def upto(self, load, rtol, sizes, least=4 * FIRST, approach=None, progress=False):
        """The state on the first grid with so many cells that is within rtol, or on the finest."""
        for state in self._solutions(load, approach, sizes, self.options.residual, progress):
            if state.error_estimate is not None and state.error_estimate <= rtol and len(state.x) >= least:
                break
        return state

    def _solutions(self, load, approach, sizes, residual, progress, start=None):
        state, changes = None, []
        total = None if sizes[-1] == MOST else int(sum(sizes))
        with tqdm(total=total, unit=" cells", unit_scale=True, disable=not progress) as bar:
            for size in map(int, sizes):
                # of coarser grids far below what the next one changes
                enough = residual if size == sizes[-1] else max(residual, 0.01 / size)
                try:
                    finer = self._solve(size, load, approach, state or start, enough)
                except BadArgument:  # an approach above the mean height that so few cells see
                    if size == sizes[-1] or size > COARSEST:
                        raise
                    continue
                if state is not None:
                    changes.append(difference(finer, state, self._end_weights))
                state = finer
                bar.update(size)
                # next to ends errors fall by the root of the cells
                fastest = 1.4 if len(getattr(self.obstacle, "ends", ())) else 1.75
                yield replace(state, change=_estimate(changes, state.residual, fastest))

    def _end_weights(self, x):
        return distance_to_ends(x, getattr(self.obstacle, "ends", ()), self.law.shifts(self.body.solid.ell))

    def _cells(self, nodes):
        if self.body.period is not None:
            return CellGrid(self.body, -self.body.period / 2, self.body.period / 2, nodes)
        return CellGrid(self.body, *self.options.window, nodes)

    @cached_property
    def _grids(self):
        return {}

    def prepare(self, nodes):
        if nodes not in self._grids:
            cells = self._cells(nodes)
            self._grids[nodes] = (
                cells,
                cells.flexibility(self.law, self.problem.counter),
                self.problem.initial_gaps(cells.x),
            )
        return self._grids[nodes]

    def _solve(self, nodes, load, approach, start, residual):
        cells, flexibility, gaps = self.prepare(nodes)
        if not np.isfinite(gaps).any():
            raise BadArgument("obstacle", self.contact.obstacle, "has a finite height over no cell")
        forces = None
        if start is not None and len(start.pressures) == len(gaps):
            own = [_polygon(cells.x, start.x, p, self.body.period) for p in start.pressures]
            forces = np.array(own) * cells.width
        found = projected_gradients.solve(
            flexibility, gaps, load=load, approach=approach, start=forces, rtol=residual
        )
        self._check_window(cells, found.forces)
        return self._state(cells, flexibility, gaps, found)

    def _check_window(self, cells, forces):
        if self.body.period is not None or not np.any(forces[:, [0, -1]] > 0):
            return
        outside = self.problem.initial_gaps(np.array((cells.x[0] - cells.width, cells.x[-1] + cells.width)))
        if np.any((forces[:, [0, -1]] > 0) & np.isfinite(outside)):
            raise NotConverged(f"the contact reaches the end of the window {self.options.window}; widen it")

    def _state(self, cells, flexibility, gaps, found):
        half, pressures = self.body.solid.ell / 2, found.forces / cells.width
        surface = flexibility.surface(found.forces)
        phi, m = flexibility.turned(found.forces, surface)
        depth = np.where(found.forces > 0, found.approach - gaps, 0)
        energy = float(np.sum(depth * found.forces) / 2)
        return CellSolution(
            self,
            cells.x,
            np.full(cells.count, cells.width),
            pressures,
            half * np.ravel(m) / cells.width,
            np.ravel(phi) / half,
            surface[0],
            found.load,
            found.approach,
            energy,
            found.kkt,
            found.products,
            raised=None if flexibility.counter is None else flexibility.counter @ found.forces,
        )


def difference(finer, coarser, ends):
    """max(|dp|, |dM|/ell)/|p| in L2 between two states, weighted by `ends`."""
    points, _ = gauss_rule(2)  # exact for squares of polygons that break at centres and ends of cells
    size, change = 0.0, 0.0
    for offset in np.concatenate((points - 1, points)):
        x = finer.x + finer.weights[0] / 2 * offset
        fine = finer.pressure_and_moment(x)
        size += ends(x) @ fine[0] ** 2
        change = change + (fine - coarser.pressure_and_moment(x)) ** 2 @ ends(x)
    return float(np.sqrt(change.max() / size)) if size else 0.0


def _estimate(changes, residual, fastest):
    """Error from the residual and the changes from grid to grid, a geometric series; None without."""
    if not changes:
        return None
    own = changes[-4:]  # one change that is much less than the one before is luck
    ratio = (own[0] / max(own[-1], np.finfo(float).tiny)) ** (1 / max(len(own) - 1, 1))
    ratio = float(np.clip(ratio, 1.4, fastest))
    last = max(change / ratio**back for back, change in enumerate(own[:-3:-1]))
    return last / (ratio - 1) + 10 * residual


def around(found, ell):
    """(left, right) around all low stretches of a Picture."""
    left, right = found.stretches[0][0] - ell, found.stretches[-1][1] + ell
    margin = (right - left) / 20
    return left - margin, right + margin


def halvings(nodes):
    sizes = [nodes]
    while sizes[-1] > 2 * COARSEST or len(sizes) < 3:
        sizes.append((sizes[-1] + 1) // 2)
    return sizes[::-1]


def _polygon(x, nodes, values, period):
    if period is None:
        return np.interp(x, nodes, values)
    return np.interp(
        x,
        np.concatenate((nodes[-1:] - period, nodes, nodes[:1] + period)),
        np.concatenate((values[-1:], values, values[:1])),
    )


def _folded(x, period):
    return x if period is None else (x + period / 2) % period - period / 2


def _repeated(obstacle, period):
    height = getattr(obstacle, "height", obstacle)
    if not callable(height):
        return obstacle  # refused by name in `obstacles.gap`
    return lambda x: height(_folded(np.asarray(x, float), period))
