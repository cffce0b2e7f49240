"""Contact on uniform cells, matrix-free: large rough problems, and periodic ones."""

import math
from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from ..corners.cell_solver import CellSolution, CellSolver
from ..corners.on_cells import Flexibility, Grid
from ..corners.rounding import PATHS
from ..errors import BadArgument, NotConverged, require
from ..model import picture
from ..model.deformable import body_of, shape_of
from ..model.law import level_surface, require_pure_force
from ..model.obstacles import heights, repeated
from ..model.problem import Problem
from ..model.zones import contact_zones, distance_to_ends, runs
from .counter import CounterCells
from .forecast import cells_cost
from .friction_solver import FrictionSolver
from .kernels import HalfPlane, at_rest, symbol


class LineCells(CellSolution):
    """A solution on uniform cells of a half-plane; `opposite` is the second body's under the corners."""

    @property
    def problem(self):
        return self.solver.problem

    @property
    def x(self):
        return self.grid.axes[0]

    @property
    def weights(self):
        return np.full(self.grid.count, self.grid.width)

    @property
    def zones_by_name(self):
        half = self.grid.width / 2
        zones = [[(self.x[i] - half, self.x[j] + half) for i, j in runs(own > 0)] for own in self.pressures]
        return contact_zones(dict(enumerate(zones)), self.solver.law.corners)

    def pressure(self, corner, x):
        """Pressure of a corner at x, array (n,): a polygon through the centres."""
        own, n, along = self.pressures[corner], self.grid.count, self.grid.steps(x)[0]
        cell = np.floor(along + 0.5)
        numbers = np.array((cell, cell + np.sign(along - cell)), int)
        inside = (numbers >= 0) & (numbers < n) | (self.period is not None)
        here, there = np.where(inside, own[numbers % n], 0.0)
        return here + np.abs(along - cell) * np.where((here > 0) & (there > 0), there - here, 0.0)

    def moment_at(self, x):
        if len(self.pressures) == 1:
            return self.interpolated(self.micromoment, x)
        own = np.array([self.pressure(corner, x) for corner in range(len(self.pressures))])
        return self.problem.ell / 2 * (self.problem.levers(x) * own).sum(axis=0)

    def gap(self, corner, x):
        """Gap of a corner at x, array (n,); BadArgument beyond the cells."""
        left, right = self.x[[0, -1]] + self.grid.width / 2 * np.array((-1, 1))
        if self.period is None and not np.all((x >= left) & (x <= right)):
            raise BadArgument("x", x, f"must lie within the cells, from {left} to {right}")
        raised, psi = (self.interpolated(own, x) for own in (self.displacement, self.psi))
        return self.corner_gaps(*level_surface(x), raised, psi)[corner]

    def counter_displacement(self, x):
        if self.opposite is None:
            return np.zeros_like(x)
        places = np.concatenate([self.x - shift for shift in self.problem.shifts])
        order = np.argsort(places)
        return np.interp(x, places[order], self.opposite.ravel()[order], period=self.period)


class LineSolver(CellSolver):
    """States of a half-plane on uniform cells."""

    counter_bodies = (HalfPlane,)
    dimensions, coarsest, most, few, loose, solution = 1, 128, 2**21, 1024, 0.01, LineCells

    def __init__(self, contact, options):
        super().__init__(contact, options)
        require_pure_force(self.law, self.solid.ell)
        self.offsets = np.array([[-2 * shift] for shift in self.law.shifts(1.0)])
        self.require_repeating(lambda x: heights(self.obstacle, x))
        if self.given_window() is None:
            self.require_lowest()

    @property
    def has_level(self):
        return self.period is not None

    @property
    def besides(self):
        return "" if self.has_level else "take Panels() under a smooth obstacle"  # none on a period

    @cached_property
    def problem(self):
        obstacle, counter = shape_of(self.obstacle), body_of(self.obstacle)
        obstacle = obstacle if self.period is None else repeated(obstacle, self.period)
        return Problem(self.solid, self.law, obstacle, counter=None if counter is None else counter.solid)

    def gaps(self, x):
        return self.problem.initial_gaps(x)

    def tilt(self, x):
        return tilt(self.law, self.offsets, x)

    def flexibility(self, grid):
        return flexibility(self.body, self.law, grid, self.problem.counter)

    def turned(self, own):
        return own[0]

    def history(self, pairs, coupled, rtol):
        if self.period is not None:
            return super().history(pairs, coupled, rtol)
        if self.options.nodes is not None or self.options.window is not None:
            raise BadArgument(
                "method",
                self.options,
                "must be Cells() without nodes and window: along a history cells get smaller at all edges",
            )
        return FrictionSolver(self, pairs, coupled).history(rtol)

    def solve(self, load, approach, rtol, initial=None):
        window, goal = self.given_window(), self.goal(rtol)
        if window is None:
            found = self.picture(load)
            window = around(found, self.solid.ell)
            self.coarsest = self._coarsest(found)
        return self.within(window, load, approach, goal, self.missed, initial)[0]

    def predicted(self, load, approach, rtol):
        if self.period is not None or self.options.nodes is not None:
            return None
        # that of the usual method, which is made only once
        known = (self if load is None else self.contact.solver).picture(load)
        steps = f"must not jump, as its height does at x = {known.steps[0]:g}" if known.steps else ""
        require(not steps, "obstacle", self.obstacle, steps)
        expected = cells_cost(known, self.goal(rtol), 4 * self._coarsest(known))
        if expected.unknowns > 8 * self.most:  # predictions may be off by so much
            raise NotConverged(f"some {expected.unknowns:.0g} cells would be needed for rtol = {rtol:g}")
        return expected

    def picture(self, load):
        """The Picture of the obstacle for a load."""
        if load is None:
            words = "must be (left, right), where the obstacle may touch, if the approach is given"
            raise BadArgument("window", None, words)
        return picture.picture(self.problem, load)

    def _coarsest(self, found):
        """Number of the first cells: a feature shows on some of 12 on the shortest piece of a Picture."""
        side = around(found, self.solid.ell).side
        least = 12 * side / min(found.lengths.min(initial=np.inf), side)
        return LineSolver.coarsest * 2 ** max(0, math.ceil(math.log2(least / LineSolver.coarsest)) - 2)

    def weights(self, x):
        return distance_to_ends(x, getattr(self.obstacle, "ends", ()), self.law.shifts(self.solid.ell))

    def estimate(self, changes, before, state):
        """Error from the residual and the changes from grid to grid, a geometric series."""
        # next to ends errors fall by the root of the cells
        fastest = 1.4 if len(getattr(self.obstacle, "ends", ())) else 1.75
        own = changes[-4:]  # one change that is much less than the one before is luck
        ratio = (own[0] / max(own[-1], np.finfo(float).tiny)) ** (1 / max(len(own) - 1, 1))
        ratio = float(np.clip(ratio, 1.4, fastest))
        last = max(change / ratio**back for back, change in enumerate(own[:-3:-1]))
        return last / (ratio - 1) + 10 * state.residual

    def missed(self, state):
        """Nothing; raises NotConverged if the contact goes on beyond the window."""
        pressed, grid = state.pressures[:, [0, -1]] > 0, state.grid
        ends = grid.middle[0] + grid.side / 2 * np.array((-1, 1))
        outside = ends + grid.width / 2 * np.array((-1, 1))
        if self.period is None and np.any(pressed) and np.any(pressed & np.isfinite(self.gaps(outside))):
            raise NotConverged(f"the contact reaches the end of the window {tuple(ends.tolist())}; widen it")
        return (), state.notes, False

    def completed(self, state, H, found):
        return state if H.counter is None else replace(state, opposite=H.counter @ found.forces)


def around(found, ell):
    """The window around all low stretches of a Picture, a Grid of one cell."""
    left, right = found.stretches[0][0] - ell, found.stretches[-1][1] + ell
    return Grid(1, 1.1 * (right - left), ((left + right) / 2,))


def flexibility(body, law, grid, counter=None):
    """The `Flexibility` of a law's corners on a Grid, with a second body of the solid `counter`."""
    solid, count, width, shifts = body.solid, grid.count, grid.width, law.shifts(body.solid.ell)
    offsets, periodic = np.array([[-2 * shift] for shift in law.shifts(1.0)]), body.period is not None
    other = counter and CounterCells(counter, shifts, width, count, periodic)

    def cells():
        found = body.cells(count, width, (3, 4) if law.clamps_rotation else (0, 1, 2))
        if law.clamps_rotation:  # kernel 4 is -m, over 1/ell instead of c, from a unit force
            found[1] *= -width / solid.ell * solid.mu / (1 - solid.nu)
        return found

    rest, waves = at_rest(solid) if periodic else None, partial(symbol, solid)
    tilts, clamped = tilt(law, offsets, *grid.axes), law.clamps_rotation
    return Flexibility(offsets, tilts, clamped, width, rest, waves, cells, other)


def tilt(law, offsets, x):
    """t at x, array (1, n), or of one corner (0, n)."""
    if len(offsets) == 1:
        return np.empty((0, len(x)))
    tilts = np.array(list(law.levers(x).values())) + offsets
    if np.ptp(tilts, axis=0).max() > PATHS:
        words = "must have levers that differ as 2 shifts / ell do on Cells(): Panels() take others"
        raise BadArgument("law", law, words)
    return tilts[:1]
