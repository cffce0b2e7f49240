"""Contact on uniform cells, matrix-free: large rough problems, and periodic ones."""

from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from .. import cost
from ..contact_solvers.cell_solver import CellSolution, CellSolver
from ..contact_solvers.fft_compliance import CellFlexibility, CellResponse, Grid
from ..contact_solvers.rounding import EPS_PIVOT
from ..errors import SMALLEST, BadArgument, NotConverged
from ..model import contact_candidates
from ..model.contact_candidates import ContactCandidates
from ..model.contact_like import ContactLike
from ..model.deformable import second_solid, shape_of
from ..model.history import History
from ..model.intervals import distance, distance_to_ends, runs
from ..model.law import require_pure_force
from ..model.missed_contact import PLACES, Violation, open_with_neighbours, overlaps, total_worth
from ..model.obstacles import Samples
from ..model.periodic import EQUAL
from ..model.problem import Problem, measured_jumps
from ..model.refinement import GeometricSeries, Usual
from ..model.scales import classical_rise
from ..model.solution import LineSolution, Solution
from ..model.types import Array, CornerZones, Flags
from .forecast import cells_cost, period_cost
from .friction_solver import FrictionSolver
from .kernels import HalfPlane, at_rest, gap_kernel, plane_symbol
from .kinks import corrections, logarithms
from .sampling_uncertainty import EXHAUSTED, sampling_uncertainty, with_sampling_note
from .second_half_plane import SecondHalfPlane
from .subsurface import HalfPlaneBelow, below_cells
from .transmitted_singularities import Chains, sizes_on
from .window import COARSEST, Window, window_about

NARROW = 6.0  # cells across a groove, of whose pressure a tenth is off, as the contact ends within it


class LineCells(CellSolution, LineSolution):
    """A solution on uniform cells of a half-plane; `opposite` is the second body's under the corners."""

    solver: Any
    grid: Window

    @property
    def problem(self) -> Problem:
        return self.solver.problem

    @property
    def x(self) -> Array:
        return self.grid.axes[0]

    @property
    def weights(self) -> Array:
        return np.full(self.grid.count, self.grid.width)

    @property
    def all_zones(self) -> CornerZones:
        half = self.grid.width / 2
        edges = np.append(self.x - half, self.x[-1] + half)  # one number where zones of two corners meet
        pressed = enumerate(self.pressures > 0)
        return {corner: [(edges[i], edges[j + 1]) for i, j in runs(flags)] for corner, flags in pressed}

    @property
    def touching(self) -> dict[str, Flags]:
        """{zone: which cells are pressed}."""
        pressed: Flags = self.pressures > 0
        zones: dict[str, Any] = {}
        if len(pressed) > 1:
            zones = {**dict(zip(self.solver.law.corners, pressed)), "full": pressed.all(axis=0)}
        return {**zones, "contact": pressed.any(axis=0)}

    def pressure(self, corner: int, x: Array) -> Array:
        """Returns the pressure of a corner at x, array (n,): a polygon through the centres, and logarithms at
        slope discontinuities.
        """
        count = self.grid.count
        along = self.grid.cell_coordinates(x)[0]
        cell = np.floor(along + 0.5)
        numbers = np.array((cell, cell + np.sign(along - cell)), int)  # of the cell and its nearer neighbour
        inside = (numbers >= 0) & (numbers < count) | (self.period is not None)
        pressed, pressed_beside = inside & (self.pressures[corner, numbers % count] > 0)
        smooth, beside = (self.pressures[corner] - self._logarithms[corner])[numbers % count]
        pressure = smooth + np.abs(along - cell) * np.where(pressed_beside, beside - smooth, 0.0)
        pressure += logarithms(self.kinks[0], self.kinks[1][corner], numbers[0], along)
        return np.where(pressed, np.maximum(pressure, 0.0), 0.0)

    @cached_property
    def kinks(self) -> tuple[Array, Array]:
        """Slope discontinuities under pressed cells, in cells, array (k,), and K of ``p ~ K log(1/|x|)`` of
        each corner there, array (corners, k).
        """
        x, jumps = self.solver.kinks
        cells, pressures = self._beside
        closed = np.all(pressures > 0, axis=1)
        pressed = closed.any(axis=0)
        places = np.tile(x[pressed, None], len(jumps))
        flags = closed[:, pressed].T
        K = sizes_on(self.problem, Chains(places, np.arange(len(jumps)), flags, jumps[:, pressed].T))
        return cells[pressed], K.T

    @cached_property
    def _beside(self) -> tuple[Array, Array]:
        """Slope discontinuities in cells, array (k,), and pressures of the cells there and to either side,
        array (corners, 3, k).
        """
        cells = self.grid.cell_coordinates(self.solver.kinks[0])[0]
        numbers = np.rint(cells).astype(int) + np.arange(-1, 2)[:, None]
        return cells, self.pressures[:, np.clip(numbers, 0, self.grid.count - 1)]

    @property
    def in_doubt(self) -> float:
        """Share in the L2 norm of pressures within a cell of a peak and of an edge: two grids may agree there
        and be wrong together.
        """
        pressures = self._beside[1]
        edges = (self.solver.kinks[1] > 0) & np.any(pressures == 0, axis=1)
        return float(np.sqrt((pressures**2).sum(axis=1)[edges].sum()) / (np.linalg.norm(self.total) or 1))

    @property
    def of_narrow_features(self) -> float:
        """Share in the L2 norm of pressures below grooves and ridges that are narrower than NARROW cells:
        logarithms K and -K at a distance d have the norm pi |K| sqrt(d).
        """
        cells, sizes = self.kinks
        apart = np.diff(cells)
        opposite = sizes[:, 1:] * sizes[:, :-1] < 0
        smaller = np.minimum(np.abs(sizes[:, 1:]), np.abs(sizes[:, :-1]))
        squares = np.where(opposite & (apart < NARROW), smaller**2 * apart, 0.0)
        return float(np.pi * np.sqrt(squares.sum()) / (np.linalg.norm(self.total) or 1))

    @cached_property
    def _logarithms(self) -> Array:
        """Means of the logarithms over the cells, array (corners, n)."""
        cells, sizes = self.kinks
        return np.array([logarithms(cells, K, np.arange(self.grid.count)) for K in sizes])

    @cached_property
    def fields(self) -> HalfPlaneBelow:
        edges = self.x - self.grid.width / 2, self.x + self.grid.width / 2
        none = np.zeros(self.grid.count)
        return below_cells(self.problem, edges, self.pressures, self.micromoment, none, self.period)

    def reaction(self, x: Array) -> Array:
        return self.interpolated(self.micromoment, x)

    def covers(self, x: Array) -> Flags:
        """Returns whether x lies on a cell, arrays (n,)."""
        left, right = self.x[[0, -1]] + self.grid.width / 2 * np.array((-1, 1))
        return (self.period is not None) | (x >= left) & (x <= right)

    def gap(self, corner: int, x: Array) -> Array:
        """Returns the gap of a corner at x, arrays (n,), beside the cells that of all their forces."""
        inside = self.covers(x)
        if np.all(inside) or self.opposite is not None:
            return super().gap(corner, x)
        gaps = np.empty_like(x)
        gaps[inside] = super().gap(corner, x[inside])
        gaps[~inside] = self._gap_beside(corner, x[~inside])
        return gaps

    def _gap_beside(self, corner: int, x: Array) -> Array:
        """Returns the gap of a corner at x beside the cells, arrays (n,)."""
        problem = self.problem
        gaps = problem.initial_gaps(x)[corner] - self.approach
        target = problem.levers(x)[corner, :, None]
        for pressures, source in zip(self.pressures, problem.levers(self.x)):
            pressed = np.flatnonzero(pressures)
            for cells in np.array_split(pressed, 1 + len(pressed) * len(x) // 10**6):
                response = gap_kernel(problem, x[:, None] - self.x[cells], target, source[cells])
                gaps += response @ pressures[cells] * self.grid.width
        return gaps


class LineSolver(CellSolver):
    """States of a half-plane on uniform cells."""

    counter_bodies = (HalfPlane,)
    dimensions = 1
    coarsest = COARSEST
    most = 2**21
    few = 1024
    loose = 1e-4
    solution = LineCells
    followed = 4096  # cells of a path
    cheap = 2**13  # cells, which take .1 to .5 s
    rate = "cells"
    usual_history_rtol = 5e-2
    takes_bulk_stress = True

    def __init__(self, contact: ContactLike, options: Any) -> None:
        super().__init__(contact, options)
        require_pure_force(self.law, self.solid.ell)
        self.offsets = self.blocks.offsets
        self.require_repeating()
        if self.given_window() is None:
            self.require_lowest()

    @property
    def has_approach(self) -> bool:  # type: ignore[override]
        return self.period is not None

    @property
    def besides(self) -> str:
        return "" if self.has_approach else "take Panels() under a smooth obstacle"  # none on a period

    @cached_property
    def problem(self) -> Problem:
        counter = second_solid(self.obstacle)
        return Problem(self.solid, self.law, self.shape, counter=counter, blocks=self.blocks)

    @cached_property
    def sampling_uncertainty(self) -> dict[float, float]:
        """{load: change of the pressure}, see `sampling_uncertainty`."""
        return {}

    def gaps(self, x: Array) -> Array:
        """Returns the initial gaps at x, array (corners, n)."""
        return self.problem.initial_gaps(x)

    def gaps_on(self, grid: Grid) -> Array:
        """Returns the initial gaps of the cells of a Grid, array (corners, n)."""
        x, jumps = self.kinks
        gaps = self.gaps(*grid.places)
        return gaps + [
            grid.width * corrections(grid.cell_coordinates(x)[0], jump, grid.count) for jump in jumps
        ]

    @cached_property
    def kinks(self) -> tuple[Array, Array]:
        """Contact points at which the slope of a gap jumps, array (k,), and jumps, array (corners, k): named
        ones of 0 are as measured.
        """
        kinks = sorted(self.problem.kinks.items())
        places = np.array([x for x, _ in kinks])
        jumps = np.zeros((len(self.law.corners), len(kinks)))
        for corner, shift in enumerate(self.problem.shifts):
            jumps[corner] = [by_corner.get(corner, 0.0) for _, by_corner in kinks]
            unknown = np.array([by_corner.get(corner) == 0.0 for _, by_corner in kinks], bool)
            if unknown.any():
                jumps[corner, unknown] = measured_jumps(self.shape, places[unknown] - shift, self.solid.ell)
        return places, jumps

    def change(self, coarse: LineCells, fine: LineCells) -> float:
        """Returns the relative L2 change of pressure and M/ell from one solution to a finer one."""
        if not len(self.kinks[0]):
            return super().change(coarse, fine)
        x = fine.x
        corners = range(len(fine.pressures))
        total, fine_total = (
            np.sum([state.pressure(corner, x) for corner in corners], axis=0) for state in (coarse, fine)
        )
        moment = (coarse.moment_at(x) - fine.moment_at(x)) / self.solid.ell
        weights = fine.weights * self.weights(fine.grid)
        return distance(weights, total - fine_total, moment, fine_total)

    def tilt(self, x: Array) -> Array:
        """Returns t at x, array (1, n), or of one corner (0, n)."""
        if len(self.offsets) == 1:
            return np.empty((0, len(x)))
        tilts = self.blocks.levers(x) + self.offsets
        if np.ptp(tilts, axis=0).max() > EPS_PIVOT:
            words = "must have levers that differ as 2 shifts / ell do on Cells(): Panels() take others"
            raise BadArgument("law", self.law, words)
        return tilts[:1]

    def flexibility(self, grid: Grid) -> CellFlexibility:
        """Returns the CellFlexibility of the law's corners on a Grid, with the second body."""
        solid = self.solid
        count = grid.count
        width = grid.width
        periodic = self.period is not None
        clamped = self.law.clamps_rotation
        second = None
        if self.problem.counter is not None:
            second = SecondHalfPlane(self.problem.counter, self.problem.shifts, width, count, periodic)

        def cells() -> Array:
            body: Any = self.body
            averages = body.cells(count, width, (3, 4) if clamped else (0, 1, 2))
            if clamped:  # kernel 4 is -m, over 1/ell instead of c, from a unit force
                averages[1] *= -width / solid.ell * solid.mu / (1 - solid.nu)
            return averages

        mean_rotation = at_rest(solid) if periodic else None
        one_corner = len(self.offsets) == 1
        symbol = partial(plane_symbol, solid)
        response = CellResponse(symbol, cells, count, width, 1, one_corner, clamped, mean_rotation)
        return CellFlexibility(self.offsets, self.tilt(*grid.axes), response, second)

    def turned(self, rotations: Array) -> Array:
        return rotations[0]

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        if self.period is not None:
            return super().history(pairs, coupled, rtol)
        if self.options.nodes is not None or self.options.window is not None:
            raise BadArgument(
                "method",
                self.options,
                "must be Cells() without nodes and window: along a history cells get smaller at all edges",
            )
        return FrictionSolver(self, pairs, coupled).history(rtol)

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Solution | None = None
    ) -> LineCells:
        window = self.window_of(load)
        goal = self.goal(rtol)
        state = self.within(window, load, approach, goal, self.missed, initial)
        if self.options.nodes:
            return state
        noted = with_sampling_note(self, state, goal)
        # beyond it finer cells follow the straight lines between samples alone
        return noted.changed(data_exhausted=noted is not state)

    def window_of(self, load: float | None) -> Window:
        """Returns the given Window, or that of all that may touch, with first cells that see its features."""
        return self.given_window() or window_about(self.candidates(load), self.solid.ell, self.ends)

    def given_window(self) -> Window | None:
        grid = super().given_window()
        return grid and Window(grid.count, grid.width, grid.middle)

    def first_cells(self, window: Window) -> int:
        return window.coarsest

    def predicted(self, load: float | None, approach: float | None, rtol: Any) -> cost.Cost:
        if self.options.nodes is not None:
            return cost.predict("cells", len(self.offsets) * self.options.nodes)
        if self.period is not None:
            return self._periodic_cost(load, approach, rtol)
        # that of panels, where they are the usual method, is made only once
        source = self if load is None else self.contact.solver
        candidates = getattr(source, "candidates", self.candidates)(load)
        sampled = isinstance(shape_of(self.obstacle), Samples)  # of which `enough` ends the cells
        most = 4 * self.cheap if sampled else np.inf
        # every second sample is left out once
        fewest = 4 * window_about(candidates, self.solid.ell).coarsest
        expected = cells_cost(candidates, rtol, fewest, most, 1 + sampled)
        if isinstance(rtol, Usual) and expected.unknowns > self.most:
            return cost.predict("cells", len(self.offsets) * self.most)._replace(misses=True)
        if expected.unknowns > 8 * self.most:  # predictions may be off by so much
            raise NotConverged(f"some {expected.unknowns:.0g} cells would be needed for rtol = {rtol:g}")
        return expected

    def _periodic_cost(self, load: float | None, approach: Any, goal: float) -> cost.Cost:
        """Returns the Cost of a period."""
        grid = Grid(1024, self.period / 1024, (0.0,))
        gaps = self.gaps(*grid.places).min(axis=0)
        rise = approach - gaps.min() if load is None else classical_rise(load, self.problem.E_star)
        return period_cost(gaps / max(rise, SMALLEST), len(self.offsets), goal, self.coarsest)

    def candidates(self, load: float | None) -> ContactCandidates:
        """Returns the ContactCandidates of the obstacle for a load."""
        if load is None:
            words = "must be (left, right), where the obstacle may touch, if the approach is given"
            raise BadArgument("window", None, words)
        return contact_candidates.find_candidates(self.problem, load)

    def enough(self, goal: float, state: LineCells) -> float:
        """Returns the error that suffices: on many cells the sampling uncertainty, any if that is
        EXHAUSTED.
        """
        if state.grid.count < self.cheap:
            return goal
        uncertainty = sampling_uncertainty(self, state)
        if uncertainty > EXHAUSTED:
            return np.inf
        return max(goal, uncertainty) if state.grid.count > self.cheap else goal

    @cached_property
    def ends(self) -> tuple[float, ...]:
        """Where the obstacle ends, on a period in the window where it is given."""
        return self.obstacle.ends if self.period is None else self.shape.edges

    def weights(self, grid: Window) -> Array:
        """Returns the weights of errors on the cells of a Grid, array (n,), small next to ends and steps."""
        x = grid.axes[0]
        if self.period is not None:
            x = self.shape.original(x, self.shape.windows[0])
        ends = (*(self.ends or (-np.inf, np.inf)), *grid.jumps)
        return distance_to_ends(x, ends, self.blocks.shifts)

    def estimate(self, changes: list[float], before: LineCells, state: LineCells) -> float:
        """Returns the error from the residual and the changes from grid to grid, a geometric series."""
        # next to ends and steps errors fall by the root of the cells
        series = GeometricSeries(1.4, 1.4, 1.4 if self.ends or state.grid.jumps else 1.75)
        return (
            float(series.error(changes[-4:]))
            + 10 * state.residual
            + state.in_doubt / 2
            + state.of_narrow_features / 4
        )

    def cannot_reach(
        self, changes: list[float], before: LineCells, goal: float, finer: float, least: float
    ) -> bool:
        """Returns whether grids so many times finer miss the goal. A grid that meets an edge by luck is up
        to four times better than halving the error on each grid would make it.
        """
        return finer <= 8 and least > 4 * finer * goal

    def missed(self, state: LineCells) -> tuple[tuple[str, ...], bool]:
        """Returns notes, and whether contact missed between cells is worth more than the estimate; raises
        NotConverged if the contact goes on beyond the window.
        """
        pressed = state.pressures[:, [0, -1]] > 0
        grid = state.grid
        ends = grid.middle[0] + grid.side / 2 * np.array((-1, 1))
        outside = ends + grid.width / 2 * np.array((-1, 1))
        if self.period is None and np.any(pressed) and np.any(pressed & np.isfinite(self.gaps(outside))):
            raise NotConverged(f"the contact reaches the end of the window {tuple(ends.tolist())}; widen it")
        missed = self._between_cells(state) if state.total.any() else []  # an approach may press nothing
        worth = total_worth(missed)
        if worth <= (state.error_estimate or 0.0):
            return state.notes, False
        deepest = max(missed, key=lambda overlap: overlap.worth)
        words = (
            f"between cells the obstacle reaches {deepest.depth:.2g} into the surface at x = "
            f"{deepest.place:.4g}: take more nodes"
        )
        return (*state.notes, words), True

    def _between_cells(self, state: LineCells) -> list[Violation]:
        """Returns the Violations of corners that are open on cells and their neighbours."""
        unit = self.problem.E_star / float(np.sqrt(state.weights @ state.total**2))
        least = EQUAL * np.ptp(state.displacement)
        violations: list[Violation] = []
        for corner, pressures in enumerate(state.pressures):
            x = self._sampling_points(state.grid, corner)
            cells = np.clip(np.rint(state.grid.cell_coordinates(x)[0]).astype(int), 0, state.grid.count - 1)
            gaps = np.where(open_with_neighbours(pressures > 0)[cells], state.gap(corner, x), np.nan)
            violations += overlaps(corner, x, gaps, unit, least)
        return violations

    def _sampling_points(self, grid: Window, corner: int) -> Array:
        """Returns contact points on a grid to look at, array (n,), ascending: samples of the candidates, or
        where a window is given many, and slope discontinuities.
        """
        left, right = grid.axes[0][[0, -1]]
        if grid.sample_points is None:
            x = np.linspace(left, right, PLACES if grid.count < PLACES else 0)
        else:
            x = grid.sample_points + self.problem.shifts[corner]
        x = np.union1d(x, self.kinks[0])
        return x[(x >= left) & (x <= right)]

    def completed(self, state: LineCells, H: CellFlexibility, solved: Any) -> LineCells:
        """Returns a state with the displacement of the second body under the corners, if any."""
        return state if H.second is None else replace(state, opposite=H.second @ solved.forces)
