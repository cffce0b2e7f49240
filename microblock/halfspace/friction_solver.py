"""Histories of frictional contact on square cells of one window (docs/theory/friction.md).

1. A window holds the contact under the largest normal force, with a margin; it is widened where the contact
   comes to its rim.
2. On grids of 16, 32, 64, ... cells a side the history is followed in increments that halve from grid to
   grid: so many that the radius of a contact grows by about half a cell, and an eighth of the cells at a
   constant normal force.
3. The changes between three grids leave the error of the last one, that of the increments among them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from .. import cost
from ..contact_solvers.fft_compliance import Grid
from ..contact_solvers.friction_increments import RESIDUAL, FrictionIncrements, Increment, legs, noted_state
from ..errors import NotConverged, out_of_reach
from ..model.history import History
from ..model.intervals import distance
from ..model.refinement import GeometricSeries, RefinementLevel, levels, refine
from ..model.types import Array
from . import square_search
from .friction_solution import SlidingCells
from .shear_cells import ShearCells, ShearedFaces
from .surface_solution import SPOT, ContactLeavesWindow, load_fraction_on_spots
from .symbol import ShearSymbol, shear_of_blocks, shear_of_clamped, shear_of_points

FEWEST_CELLS = 16  # a side
MOST_CELLS = 256
# errors of increments are alike on two grids, in contrast to those of the edges of contacts alone
SERIES = GeometricSeries(2.0, 1.4, 1.9, luck=2.5)
LARGEST_GAIN = 2.5  # by more than this no grid was seen to divide an error: by 1.8 to 2.2
WIDER = 1.4  # times a window that the contact fills
WINDOWS = 6
MOST_SECONDS = 1800.0  # of one core, on one grid
LONG = 1e-30  # wavenumber over 1/ell of a mean


@dataclass(frozen=True)
class SurfaceFrictionSolver:
    """Histories of one Contact through loads (P, Q1, Q2), array (k, 3); `solver` is that without history."""

    solver: Any
    loads: Array
    coupled: bool

    def history(self, rtol: float | None) -> History:
        """Returns the History to rtol; NotConverged if it is out of reach."""
        window = self._first_window()
        for _ in range(WINDOWS):
            try:
                return self._in_window(window, rtol)
            except ContactLeavesWindow:
                window = replace(window, width=WIDER * window.width)
        raise NotConverged(square_search.NO_WINDOW)

    @property
    def _largest(self) -> float:
        return float(self.loads[:, 0].max())

    def _first_window(self) -> Grid:
        """Returns the window or the period, or a square about the contact without friction."""
        fixed = self.solver.given_window()
        if fixed is not None:
            return fixed
        candidates = self.solver.candidates(self._largest, None, None)
        squares = square_search.find_squares(
            self.solver, candidates, self._largest, None, candidates.lowest_places
        )
        return square_search.enclosing(squares)

    def _in_window(self, window: Grid, rtol: float | None) -> History:
        goal = self.solver.history_goal(rtol)

        def refusal(best: Any, last: Any, failure: NotConverged | None) -> NotConverged:
            return failure or out_of_reach(goal, best.error, besides=self.solver.besides)

        return refine(self._levels(window, goal), goal, refusal).result

    def _levels(self, window: Grid, goal: Any) -> Iterator[RefinementLevel[History]]:
        """Yields the RefinementLevels with an error estimate."""
        nodes = self.solver.options.nodes
        if nodes:
            self._require_short(nodes)
        sizes = self.solver.sizes(window) if nodes else _doublings(FEWEST_CELLS, MOST_CELLS)
        candidates = self.solver.candidates(self._largest, None, self.solver.given_window())
        candidates.sample_squares(window)
        solve = partial(self._on_grid, window)
        for count, finer, coarser, changes in levels(solve, sizes, self._change):
            if len(changes) < 2 or (nodes and count < nodes):
                continue
            errors = self._estimates(changes, coarser, finer)
            missed = [self.solver.missed(candidates, solution) for solution in finer]
            states = [
                noted_state(replace(solution, error_estimate=error, notes=notes), before.increment)
                for before, solution, error, (notes, _) in zip(coarser, finer, errors, missed)
            ]
            error = np.inf if any(unseen for _, unseen in missed) else max(errors)
            yield RefinementLevel(
                History(self.solver.contact, states, []),
                error,
                self._seconds(2 * count),
                cannot_reach=max(errors) > (goal or np.inf) * LARGEST_GAIN ** np.log2(MOST_CELLS / count),
                suffices=nodes is not None,
            )

    def _seconds(self, count: int) -> float:
        """Returns seconds that the history is expected to take on so many cells a side."""
        steps = sum(map(len, legs(self.loads, count)))
        forces = len(self.solver.offsets) * count**2
        alternations = 3 if self.coupled else 1
        return cost.predict("cells in space", alternations * forces, steps).seconds

    def _require_short(self, count: int) -> None:
        """Raises NotConverged where the history on so many cells a side would take half an hour."""
        seconds = self._seconds(count)
        if seconds > MOST_SECONDS:
            raise NotConverged(
                f"a history on {count} x {count} cells would take some {seconds / 60:.2g} minutes: take "
                "fewer loads or cells, or a larger rtol"
            )

    def _on_grid(self, window: Grid, count: int, before: Any) -> list[SlidingCells]:
        """Returns the solutions at the given loads on so many cells a side."""
        self._require_short(count)
        grid = window.with_count(count)
        cells = self._shear_cells(grid)
        alone = cells if cells.second is None else replace(cells, second=None)
        followed = self._friction_increments(cells)
        ends = followed.follow(self.loads, count)
        return [self._solution(followed, alone, increment) for increment in ends]

    def _friction_increments(self, cells: ShearCells) -> FrictionIncrements:
        solver = self.solver
        H, g0 = solver.prepared(cells.grid)
        faces = ShearedFaces(H, cells)
        residual = max(RESIDUAL, solver.options.residual)
        return FrictionIncrements(H, g0, faces, float(solver.law.friction), self.coupled, residual)

    def _shear_cells(self, grid: Grid) -> ShearCells:
        """Returns the ShearCells of the body, or of both bodies."""
        solver = self.solver
        second = solver.second
        return ShearCells(
            symbol=partial(self._symbol, solver.solid),
            length=solver.solid.ell,
            grid=grid,
            mean=None if solver.period is None else self._under_mean_shear(),
            clamped=solver.law.clamps_rotation,
            second=second and partial(shear_of_points, second),
            second_length=second.ell if second else 1.0,
        )

    def _under_mean_shear(self) -> tuple[float, float]:
        """Returns displacement and rotation of the face under a mean shear on a period (length per stress);
        the mean of the surface itself is at rest, and blocks turn as by a long wave across.
        """
        solid = self.solver.solid
        turned = float(self._symbol(solid, np.array([LONG / solid.ell])).turn_across[0])
        of_points = solid.ell / (4 * solid.mu)
        moved = of_points - turned if len(self.solver.offsets) > 1 else 0.0
        return moved, turned

    def _symbol(self, solid: Any, k: Array) -> ShearSymbol:
        """Returns the ShearSymbol of the law's contact points."""
        if self.solver.law.clamps_rotation:
            return shear_of_clamped(solid, k)
        return shear_of_points(solid, k) if len(self.solver.offsets) == 1 else shear_of_blocks(solid, k)

    def _solution(
        self, followed: FrictionIncrements, alone: ShearCells, increment: Increment
    ) -> SlidingCells:
        """Returns the solution at an increment; `alone` are the cells without a second body."""
        solver = self.solver
        grid = alone.grid
        H = followed.H
        half = solver.solid.ell / 2
        surface = H.surface(increment.forces)
        phi, m = H.rotations_and_moments(increment.forces, surface)
        lifted = alone.lifted(increment.tangential)
        if solver.law.clamps_rotation:
            m = m + lifted[1:]
        else:
            phi = phi + lifted[1:]
        if len(solver.offsets) > 1:
            m = m - increment.tangential
        opposite = np.zeros(grid.places[0].shape)
        if solver.second is not None:
            both = followed.faces.raised(increment.tangential)[0]
            opposite = H.second.above(increment.forces) + both - lifted[0]
        return SlidingCells(
            solver,
            grid,
            increment.load,
            increment.approach,
            increment.forces / grid.area,
            solver.turned(m) * half / grid.area,
            solver.turned(phi) / half,
            surface[0] + lifted[0],
            increment.residual,
            increment.iterations,
            opposite=opposite,
            closed=np.count_nonzero(increment.forces, axis=0),
            increment=increment,
        )

    def _change(self, coarse: Sequence[SlidingCells], fine: Sequence[SlidingCells]) -> Any:
        """Returns the relative changes of the solutions from one grid to a finer one, array (k,): of
        pressure, M/ell and q/f.
        """
        return np.array([self._change_of(*pair) for pair in zip(coarse, fine)])

    def _change_of(self, coarse: SlidingCells, fine: SlidingCells) -> float:
        q = fine.shear_traction
        dq = [coarse.interpolated(values, *fine.grid.places) for values in coarse.shear_traction] - q
        sheared = np.hypot(*dq) / self.solver.law.friction
        weights = np.broadcast_to(self.solver.weights(fine.grid), sheared.shape).ravel()
        zeros = np.zeros(weights.shape)
        in_shear = distance(weights, sheared.ravel(), zeros, fine.total.ravel())
        return max(in_shear, self.solver.change(coarse, fine))

    def _estimates(
        self, changes: list[Any], coarser: Sequence[SlidingCells], finer: Sequence[SlidingCells]
    ) -> list[float]:
        """Returns the errors of the solutions on the finer grid: from the changes, the load on contacts of
        few cells, and the residual as short waves feel it.
        """
        errors = SERIES.error(changes[-2:])
        lost = [load_fraction_on_spots(solution, SPOT) for solution in coarser]
        rough = [solution.residual * solution.grid.count for solution in finer]
        return (errors + lost + rough).tolist()


def _doublings(first: int, last: int) -> list[int]:
    """Returns first, twice it, ... up to the last."""
    return [first * 2**n for n in range(int(np.log2(last // first)) + 1)]
