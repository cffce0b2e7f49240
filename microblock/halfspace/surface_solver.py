"""Contact on square cells of the half-space.

1. Squares about the lowest places (`microblock.halfspace.square_search`) grow while cells press near their
   rim, or a gap outside is negative, and shrink to the contact.
2. Grids of 32, 64, ... cells a side are solved until the estimate, with the load on spots of few cells, is
   below rtol and no place between the cells would touch.
"""

from dataclasses import replace
from functools import cached_property, partial
from itertools import chain
from typing import Any

import numpy as np
from scipy.fft import next_fast_len

from .. import cost
from ..contact_solvers.active_set import ContactState
from ..contact_solvers.cell_solver import CellSolver
from ..contact_solvers.corner_forces import closed_corners, least_norm_where_closed
from ..contact_solvers.fft_compliance import CellFlexibility, CellResponse, Flexibility, Grid
from ..errors import NOT_YET, NotConverged, require
from ..halfplane.kernels import at_rest, is_classical
from ..model.deformable import second_solid
from ..model.height_map import HeightMap
from ..model.history import History
from ..model.intervals import distance_to_edges
from ..model.material import joint_modulus
from ..model.progress import counting
from ..model.refinement import FEWEST, GeometricSeries
from ..model.solver import ACCURACIES
from ..model.types import Array
from . import square_search
from .candidate_squares import CONTACT_ROWS, CandidateSquares
from .friction_solver import SurfaceFrictionSolver
from .half_space import HalfSpace
from .images import PeriodicGreen
from .kernels import surface_kernels
from .penetration import penetration
from .second_half_space import SecondBodyCells
from .square_search import TRIES
from .squares import CoupledSquares, SecondBodySquares, Squares
from .surface_solution import SPOT, ContactLeavesWindow, SurfaceCells, load_fraction_on_spots
from .symbol import surface_symbol

MOST_OF_GRID = 0.8  # cells along an axis that a contact takes, above which a part of a grid gains too little
SPARSE = 0.05  # of a period that may touch, above which squares are not tried: one grid has fewer cells


# depths fall by a factor of 4 from grid to grid, where edges allow it
STEADY = GeometricSeries(2.0, 1.6, 3.0, luck=2.5)
# stiffnesses follow the cells at edges, whose steps are those of chance
UNSTEADY = GeometricSeries(1.0, 1.0, 1.0, luck=1.4, alike=0.5)
# {accuracy: (error times cells along an axis to a power, the power)} of circular contacts
CELLS = {"pressure": (2.5, 1.0), "depth": (0.8, 2.0), "load": (1.5, 2.0), "stiffness": (0.5, 1.0)}


class SurfaceSolver(CellSolver):
    """States of a HalfSpace; its `options` are `Cells`, with nodes along each axis."""

    most_corners = None
    counter_bodies = (HalfSpace,)
    in_space = "cells"
    dimensions = 2
    coarsest = 32
    most = 1024
    few = 16
    loose = 1e-3
    solution = SurfaceCells
    followed = 128  # cells along an axis of a path
    # errors of two grids are in part independent, as edges move by whole cells
    series = GeometricSeries(1.4, 1.0, 1.9, luck=2.5, alike=0.5)
    accuracies = ACCURACIES
    spot = SPOT
    besides = "fix Cells(nodes=...)"
    rate = "cells in space"
    usual_history_rtol = 5e-2

    def set_up(self) -> None:
        super().set_up()
        require(
            not is_classical(self.solid),
            "beta",
            self.solid.beta,
            "must hold the rotation of blocks: a second body alone may have 0",
        )
        self.offsets = self.blocks.offsets
        self.tilt = self.blocks.tilt
        nodes = self.options.nodes
        require(
            nodes is None or nodes <= 2 * self.most,
            "nodes",
            nodes,
            f"counts along each axis: at most {2 * self.most}",
        )
        period = self.obstacle.period
        require(
            period is None or self.period is not None,
            "period",
            None,
            f"must be a multiple of that of the obstacle, {period}",
        )
        self.require_repeating()

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> SurfaceCells:
        """Returns the SurfaceCells, as `Solver.solve`."""
        goal = self.goal(rtol)
        fixed = self.given_window()
        candidates = self.candidates(load, approach, fixed)
        places = candidates.lowest_places
        for _ in range(TRIES):
            window = fixed
            if fixed is None or self._is_sparse(candidates):
                window = square_search.find_squares(self, candidates, load, approach, places)
                candidates.sample_squares(window)
            missed = partial(self.missed, candidates)
            try:
                state = self.within(window, load, approach, goal, missed, initial)
            except ContactLeavesWindow as leaves:
                places = np.vstack((places, leaves.places))
                continue
            return replace(state, seen_width=candidates.seen_width)
        raise NotConverged(square_search.NO_WINDOW)

    def history_goal(self, rtol: float | None) -> float | None:
        """Returns rtol or the usual one; None where nodes are given, beside which an rtol is refused."""
        return None if self.goal(rtol) is None else super().history_goal(rtol)

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        """Returns the History through loads (P, Q1, Q2), array (k, 3)."""
        words = "deforms: histories in space take a second body under laws without blocks alone"
        require(self.second is None or len(self.offsets) == 1, "obstacle", self.obstacle, words)
        return SurfaceFrictionSolver(self, pairs, coupled).history(rtol)

    def predicted(self, load: float | None, approach: float | None, rtol: float | None) -> cost.Cost:
        """Returns the Cost of cells whose edges leave rtol, as many under each valley that touches."""
        fixed = self.given_window()
        candidates = self.candidates(load, approach, fixed)
        lowest = candidates.lowest[2]
        valleys, ratio = candidates.count_and_aspect(lowest + (candidates.bound - lowest) / 8, fixed)
        squares = 1
        finer = max(ratio / 1.75, 1.0)
        if self._is_sparse(candidates) if fixed else valleys > 1:
            squares = valleys
            finer = 1.0
        goal = self.goal(rtol)
        if goal is None:
            return cost.predict(self.rate, len(self.offsets) * squares * self.options.nodes**2)
        most = float(self.most**2)
        # an estimate has three grids
        size, power = CELLS[self.accuracy]
        cells = (size / goal) ** (1 / power)
        count = max(2.0 ** np.ceil(np.log2(cells * finer)), 4 * self.coarsest)
        needed = squares * count**2
        predicted = cost.predict(self.rate, len(self.offsets) * min(needed, most))
        return predicted._replace(misses=bool(needed > most))

    def window_of(self, load: float) -> Grid:
        """Returns a Grid that holds the contact up to a load, on a period the whole of it."""
        fixed = self.given_window()
        if fixed is not None:
            return fixed
        with counting("window"):  # of a path, whose results are events
            return square_search.enclosing(self.solve(load, None, None).grid)

    def missed(self, candidates: CandidateSquares, state: SurfaceCells) -> tuple[tuple[str, ...], bool]:
        """Returns what a fixed window leaves out, and whether a place between cells would touch; raises
        ContactLeavesWindow for a window that may be wider.
        """
        cut = any(square_search.presses_at_rim(state, 1))
        outside, hidden = penetration(state, candidates)
        if self.options.window is None and (cut or len(outside)):
            raise ContactLeavesWindow(np.vstack((*chain(*square_search.contact_boxes(state)), outside)))
        return _warnings(cut, outside, hidden, 2 * state.grid.count), len(hidden) > 0

    def weights(self, grid: Grid | Squares) -> Array:
        """Returns weights of squares in the norm: the square of `distance_to_edges`, since steps of cells
        along an edge leave the pressure beside it unknown on every grid.
        """
        faces = np.isfinite(self.prepared(grid)[1])
        if faces.all():
            return np.ones(1)
        squares = faces.reshape(len(faces), -1, grid.count, grid.count).swapaxes(0, 1)
        return np.reshape([distance_to_edges(corners) ** 2 for corners in squares], faces.shape[1:])

    def estimating(self, accuracy: str) -> Any:
        solver: Any = super().estimating(accuracy)
        if accuracy != "pressure":
            solver.series = UNSTEADY if accuracy == "stiffness" else STEADY
            solver.spot = FEWEST
        return solver

    def change(self, coarse: Any, fine: Any) -> float:
        """Returns the relative change between two grids of what estimates are of."""
        if self.accuracy == "pressure":
            return super().change(coarse, fine)
        if self.accuracy == "stiffness":
            return abs(1 - coarse.stiffness / fine.stiffness)
        deeper = fine.approach - coarse.approach
        if fine.load != coarse.load:  # at one approach: the depth that the load is worth
            deeper = (coarse.load - fine.load) / fine.stiffness
        return self._by_depth(fine, abs(deeper))

    def _by_depth(self, state: Any, distance: float) -> float:
        """Returns the relative error of depth or load of a distance between curves of load over depth."""
        if self.accuracy == "depth":
            return distance / (state.approach - float(self.prepared(state.grid)[1].min()))
        return distance * state.stiffness / state.load if distance else 0.0

    def estimate(self, changes: list[float], before: SurfaceCells, state: SurfaceCells) -> float:
        """Returns the error of a grid from successive changes, the load on spots, and the residual, of the
        pressure as short waves feel it.
        """
        of_residual = state.residual * state.grid.count
        if self.accuracy in ("depth", "load"):
            of_residual = self._by_depth(state, state.residual * float(np.ptp(state.displacement)))
        return (
            float(self.series.error(changes[-2:])) + load_fraction_on_spots(before, self.spot) + of_residual
        )

    def cannot_reach(
        self, changes: list[float], before: SurfaceCells, goal: float, finer: float, least: float
    ) -> bool:
        """Returns whether grids so many times finer miss the goal, by spots on any grid."""
        slow = finer <= 2 and float(self.series.error(changes[-2:])) > goal * finer**2
        return slow or load_fraction_on_spots(before, self.spot / 2 / finer**2) > goal

    def turned(self, phi: Array) -> Array:
        """Returns rotations about x1 and x2 of phi, array (2, ...)."""
        return np.array((phi[1], -phi[0]))

    def gaps(self, x1: Array, x2: Array) -> Array:
        """Returns the initial gaps at places, array (corners, ...)."""
        return self.blocks.initial_gaps_over_surface(self.shape, x1, x2)

    def minimum(self, H: Flexibility, g0: Array, **options: Any) -> ContactState:
        return super().minimum(H, g0, steps=H.rounded, **options)

    def about(self, start: SurfaceCells, grid: Any) -> tuple[Any, Any]:
        alone = isinstance(grid, Grid) and isinstance(start.grid, Grid)
        if not alone or self.period is not None or self.second is not None:
            return grid, ...
        pressed = [np.flatnonzero((start.closed > 0).any(axis=axis)) for axis in (1, 0)]
        margin = 2 * start.grid.width
        first = grid.nearest(*(axis[cells[0]] - margin for axis, cells in zip(start.grid.axes, pressed)))
        last = grid.nearest(*(axis[cells[-1]] + margin for axis, cells in zip(start.grid.axes, pressed)))
        count = next_fast_len(int(np.max(last - first)) + 1, real=True)
        if count > MOST_OF_GRID * grid.count:
            return grid, ...
        first = np.clip((first + last - count) // 2, 0, grid.count - count)
        return grid.part(first, count), (slice(None), *(slice(i, i + count) for i in first))

    def flexibility(self, grid: Grid | Squares) -> CellFlexibility | CoupledSquares:
        """Returns the Flexibility of a grid, or of several."""
        if isinstance(grid, Grid):
            return self.alone(grid, self.period is not None)
        by_width: dict[float, CellFlexibility] = {}  # squares of one width share tables
        for square in grid.grids:
            if square.width not in by_width:
                by_width[square.width] = self.alone(square, False)
        single = [by_width[square.width] for square in grid.grids]
        second = None
        if self.second is not None:
            offsets = self.solid.ell / 2 * self.offsets
            cells: list[Any] = [square.second for square in single]
            second = SecondBodySquares(cells, grid, offsets, self.second_response)
        return CoupledSquares(grid, single, self.tilt(*grid.places), self.response, second)

    def alone(self, grid: Grid, periodic: bool) -> CellFlexibility:
        """Returns the Flexibility of one square."""
        solid = self.solid
        count = grid.count
        one_corner = len(self.offsets) == 1
        clamped = self.law.clamps_rotation

        mean_rotation = at_rest(solid) if periodic else None
        response = CellResponse(
            partial(surface_symbol, solid),
            partial(self.averages, count, grid.width),
            count,
            grid.width,
            2,
            one_corner,
            clamped,
            mean_rotation,
        )
        second = None
        if self.second is not None:
            second = SecondBodyCells(self.second, solid.ell, self.offsets, grid.width, count, periodic)
        return CellFlexibility(self.offsets, self.tilt(*grid.places), response, second)

    def averages(self, count: int, width: float) -> Array:
        """Returns averages of the response over cells of a width, as of `CellResponse`; the last are kept."""
        kept = self._averages.get(width)
        if kept is None or kept.shape[-1] < count:
            clamped = self.law.clamps_rotation
            most = 2 if len(self.offsets) == 1 else 4
            kept = surface_kernels(self.solid).cells(count, width, clamped, most)
            if clamped:
                kept[1:] *= width**2
            self._averages.clear()
            self._averages[width] = kept
        return kept[:, :count, :count]

    @cached_property
    def _averages(self) -> dict[float, Array]:
        return {}

    @cached_property
    def second(self) -> Any:
        """Solid of a second body, or None."""
        return second_solid(self.obstacle)

    @cached_property
    def response(self) -> PeriodicGreen:
        return PeriodicGreen(self.solid, self.law.clamps_rotation, self.period)

    @cached_property
    def second_response(self) -> PeriodicGreen:
        return PeriodicGreen(self.second, False, self.period)

    def completed(self, state: SurfaceCells, H: Any, solved: ContactState) -> SurfaceCells:
        """Returns a state with pressures of least norm, closed corners and a second body."""
        require(solved.load > 0, "approach", solved.approach, NOT_YET)
        forces = solved.forces
        opposite = np.zeros(forces.shape[1:]) if H.second is None else H.second.above(forces)
        least = min(
            2 * solved.kkt, self.loose / state.grid.count
        )  # beyond that touching is a matter of force
        closed = solved.gaps <= least * np.ptp(state.displacement + opposite)
        if H.second is None:
            forces = least_norm_where_closed(forces, closed)
        touching = closed_corners(forces, closed)
        return replace(state, pressures=forces / state.grid.area, opposite=opposite, closed=touching)

    # the window

    def candidates(self, load: float | None, approach: float | None, window: Grid | None) -> CandidateSquares:
        short = np.array([1e4 / self.solid.ell])
        softer = 1 + self.solid.E_star * float(short[0] * np.max(surface_symbol(self.solid, short)[2:]))
        plain = (load or 0.0) / (2 * joint_modulus(self.solid, self.second))
        punch_loads = (plain, softer * plain)
        periodic = self.period is not None
        window = window or self._square_of_map()
        return CandidateSquares(
            self.gaps, self.solid.ell, punch_loads, approach, self.obstacle, window, periodic
        )

    def _square_of_map(self) -> Grid | None:
        """Returns the square beside which no block is under a height map, or None."""
        if not isinstance(self.shape, HeightMap):
            return None
        return Grid(1, max(self.shape.lengths) + 2 * self.solid.ell, (0.0, 0.0))

    def _is_sparse(self, candidates: CandidateSquares) -> bool:
        """Returns whether so little of a period can touch that several squares of cells are tried."""
        if self.period is None or self.options.nodes is not None:
            return False
        inside = self.second is None or self.solid.ell < self.period / 4  # corners stay in a period
        return inside and len(candidates.samples_below(candidates.bound)) < SPARSE * CONTACT_ROWS**2


def _warnings(cut: bool, outside: Array, hidden: Array, more: int) -> tuple[str, ...]:
    """Returns what a fixed window or cells leave out, at places, arrays (k, 2), and how many `more` cells
    along an axis may see the latter.
    """
    warnings = []
    if cut:
        warnings.append("the window cuts the contact: cells at its rim press")
    for places, where, remedy in (
        (outside, "outside of the window", ""),
        (hidden, "between cells", f": try Cells(nodes={more})"),
    ):
        if len(places):
            x1, x2 = places[0]
            warnings.append(f"the obstacle would touch {where} as well, as at ({x1:.4g}, {x2:.4g}){remedy}")
    return tuple(warnings)
