"""Contact on square cells of the half-space.

1. A window about the lowest places (`microblock.halfspace.candidate_squares`) grows while cells press near
   its rim, or a gap outside is negative, and shrinks to the contact.
2. Grids of 32, 64, ... cells a side are solved until the estimate, with the load on spots of few cells, is
   below rtol and no place between the cells would touch.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain

import numpy as np

from .. import cost
from ..contact_solvers.cell_solver import CellSolution, CellSolver, spots
from ..contact_solvers.corner_forces import closed_corners, least_norm_where_closed
from ..contact_solvers.fft_compliance import CellFlexibility, CellResponse, Grid
from ..errors import NOT_YET, NotConverged, require
from ..halfplane.kernels import at_rest, is_classical
from ..model.deformable import second_solid
from ..model.intervals import distance_to_edges
from ..model.material import joint_modulus
from ..model.progress import counting
from ..model.refinement import FEWEST, GeometricSeries
from ..model.solution import SpaceSolution
from . import square_search
from .candidate_squares import CONTACT_ROWS, CandidateSquares
from .half_space import HalfSpace
from .images import PeriodicGreen
from .kernels import surface_kernels
from .second_half_space import SecondBodyCells
from .square_search import TRIES
from .squares import CoupledSquares, SecondBodySquares
from .symbol import surface_symbol

SPARSE = 0.05  # of a period that may touch, above which squares are not tried: one grid has fewer cells
SPOT = FEWEST**2  # cells of a contact


class ContactLeavesWindow(Exception):
    """A wider window must hold more places, array (k, 2)."""

    def __init__(self, places):
        super().__init__()
        self.places = places


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceCells(CellSolution, SpaceSolution):
    """A solution on square cells, with pressures of least norm.

    Attributes
    ----------
    closed : array (n, n) of int
        Number of closed corners.
    seen_width : float or None
        As of `microblock.State`.
    """

    closed: object = None
    seen_width: float | None = None

    def state(self):
        """Returns the State on cells, square after square and row after row."""
        grids = self.grid.grids
        points = np.concatenate([np.stack((*grid.places, 0 * grid.places[0]), axis=-1) for grid in grids])
        areas = np.repeat([grid.area for grid in grids], grids[0].count ** 2)
        cells = {"squares": grids, "seen_width": self.seen_width}
        if len(grids) == 1:
            x1, x2 = grids[0].axes
            cells |= {"shape": grids[0].places[0].shape, "x1": x1, "x2": x2, "width": float(grids[0].width)}
        return self.state_at(points.reshape(-1, 3), areas, **cells)

    @property
    def touching(self):
        """{zone: which cells are closed}."""
        full = {"full": self.closed == len(self.pressures)} if len(self.pressures) > 1 else {}
        return full | {"contact": self.closed > 0}

    @property
    def is_whole(self):
        """Whether the cells are those of a whole period."""
        return self.period is not None and isinstance(self.grid, Grid)

    def pressure(self, corner, places):
        """Returns the pressure of a corner, by number, at places, array (k, 2) or (k, 3)."""
        return self.interpolated(self.pressures[corner], *places.T[:2])

    def between(self, values, places):
        """Returns micromoments on cells, array (n, n), at places, array (k, 2) or (k, 3)."""
        return self._known(values, places, vanishes=not self.solver.law.clamps_rotation)

    def counter_displacement(self, places):
        """Returns the displacement along x3 of a second body at places, array (k,)."""
        return self._known(self.opposite, places, vanishes=not self.opposite.any())

    def _known(self, values, places, vanishes):
        """Returns values on cells at places; raises BadArgument beside the cells unless they vanish there."""
        inside = vanishes or self.is_whole or np.all(self.grid.distance_outside(*places.T[:2]) <= 0)
        require(inside, "points", places, "must lie in the squares, beside which this is not known")
        return self.interpolated(values, *places.T[:2])


class SurfaceSolver(CellSolver):
    """States of a HalfSpace; its `options` are `Cells`, with nodes along each axis."""

    most_corners = None
    counter_bodies = (HalfSpace,)
    in_space = "cells"
    dimensions, coarsest, most, few, loose, solution = 2, 32, 1024, 16, 1e-3, SurfaceCells
    followed = 128  # cells along an axis of a path
    # errors of two grids are in part independent, as edges move by whole cells
    series = GeometricSeries(1.4, 1.0, 1.9, luck=2.5, alike=0.5)
    besides, rate = "fix Cells(nodes=...)", "cells in space"

    def set_up(self):
        super().set_up()
        require(
            not is_classical(self.solid),
            "beta",
            self.solid.beta,
            "must hold the rotation of blocks: a second body alone may have 0",
        )
        self.offsets, self.tilt = self.blocks.offsets, self.blocks.tilt
        nodes = self.options.nodes
        require(
            nodes is None or nodes <= 2 * self.most,
            "nodes",
            nodes,
            f"counts along each axis: at most {2 * self.most}",
        )
        own = getattr(self.obstacle, "period", None)
        require(
            own is None or self.period is not None,
            "period",
            None,
            f"must be a multiple of that of the obstacle, {own}",
        )
        self.require_repeating()

    def solve(self, load, approach, rtol, initial=None):
        """Returns the SurfaceCells, as `Solver.solve`."""
        goal, fixed = self.goal(rtol), self.given_window()
        picture = self._picture(load, approach, fixed)
        places = picture.deepest
        for _ in range(TRIES):
            window = fixed
            if fixed is None or self._is_sparse(picture):
                window = square_search.find_squares(self, picture, load, approach, places)
                picture.look_about(window)
            missed = partial(self.missed, picture)
            try:
                state = self.within(window, load, approach, goal, missed, initial)
            except ContactLeavesWindow as leaves:
                places = np.vstack((places, leaves.places))
                continue
            return replace(state, seen_width=picture.seen)
        raise NotConverged(square_search.NO_WINDOW)

    def predicted(self, load, approach, rtol):
        """Returns the Cost of cells whose edges leave rtol, as many under each valley that touches."""
        fixed, nodes, most = self.given_window(), self.options.nodes, float(self.most**2)
        picture = self._picture(load, approach, fixed)
        valleys, ratio = picture.spread(picture.lowest[2] + (picture.bound - picture.lowest[2]) / 8, fixed)
        several = self._is_sparse(picture) if fixed else valleys > 1
        squares, finer = (valleys, 1.0) if several else (1, max(ratio / 1.75, 1.0))
        goal = self.goal(rtol)
        if goal is None:
            return cost.predict(self.rate, len(self.offsets) * squares * nodes**2)
        # an estimate has three grids
        count = max(2.0 ** np.ceil(np.log2(2.5 / goal * finer)), 4 * self.coarsest)
        needed = squares * count**2
        found = cost.predict(self.rate, len(self.offsets) * min(needed, most))
        return found._replace(misses=bool(needed > most))

    def window_of(self, load):
        """Returns a Grid that holds the contact up to a load, on a period the whole of it."""
        fixed = self.given_window()
        if fixed is not None:
            return fixed
        with counting("window"):  # of a path, whose results are events
            grids = self.solve(load, None, None).grid.grids
        reaches = [np.array(grid.middle) + side * grid.side / 2 for grid in grids for side in (-1, 1)]
        low, high = np.min(reaches, axis=0), np.max(reaches, axis=0)
        return Grid(1, float(np.max(high - low)), tuple(((low + high) / 2).tolist()))

    def missed(self, picture, state):
        """Returns what a fixed window leaves out, and whether a place between cells would touch; raises
        ContactLeavesWindow for a window that may be wider.
        """
        cut = any(square_search.reaches_rim(state, 1))
        outside, hidden = square_search.violations(state, picture)
        if self.options.window is None and (cut or len(outside)):
            raise ContactLeavesWindow(np.vstack((*chain(*square_search.rectangles_of(state)), outside)))
        return _warnings(cut, outside, hidden), len(hidden) > 0

    def weights(self, grid):
        """Returns weights of squares in the norm: the square of `distance_to_edges`, since steps of cells
        along an edge leave the pressure beside it unknown on every grid.
        """
        faces = np.isfinite(self.prepared(grid)[1])
        if faces.all():
            return np.ones(1)
        squares = faces.reshape(len(faces), -1, grid.count, grid.count).swapaxes(0, 1)
        return np.reshape([distance_to_edges(corners) ** 2 for corners in squares], faces.shape[1:])

    def estimate(self, changes, before, state):
        """Returns the error of a grid from successive changes, the load on spots, and the residual as short
        waves feel it.
        """
        return (
            float(self.series.error(changes[-2:]))
            + _share_of_spots(before, SPOT)
            + state.residual * state.grid.count
        )

    def cannot_reach(self, changes, before, goal, finer, least):
        """Returns whether grids so many times finer miss the goal, by spots on any grid."""
        slow = finer <= 2 and float(self.series.error(changes[-2:])) > goal * finer**2
        return slow or _share_of_spots(before, SPOT / 2 / finer**2) > goal

    def turned(self, own):
        """Returns rotations about x1 and x2 of phi, array (2, ...)."""
        return np.array((own[1], -own[0]))

    def gaps(self, x1, x2):
        """Returns the initial gaps at places, array (corners, ...)."""
        return self.blocks.on_level(self.shape, x1, x2).initial_gaps

    def flexibility(self, grid):
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
            second = SecondBodySquares(
                [square.second for square in single], grid, offsets, self.second_response
            )
        return CoupledSquares(grid, single, self.tilt(*grid.places), self.response, second)

    def alone(self, grid, periodic):
        """Returns the Flexibility of one square."""
        solid = self.solid
        count = grid.count
        clamped = self.law.clamps_rotation

        def averages():
            values = surface_kernels(solid).cells(count, grid.width, clamped)
            if clamped:
                values[1:] *= grid.width**2
            return values

        mean_rotation = at_rest(solid) if periodic else None
        response = CellResponse(
            partial(surface_symbol, solid), averages, count, grid.width, 2, clamped, mean_rotation
        )
        second = None
        if self.second is not None:
            second = SecondBodyCells(self.second, solid.ell, self.offsets, grid.width, count, periodic)
        return CellFlexibility(self.offsets, self.tilt(*grid.places), response, second)

    @cached_property
    def second(self):
        """Solid of a second body, or None."""
        return second_solid(self.obstacle)

    @cached_property
    def response(self):
        return PeriodicGreen(self.solid, self.law.clamps_rotation, self.period)

    @cached_property
    def second_response(self):
        return PeriodicGreen(self.second, False, self.period)

    def completed(self, state, H, found):
        """Returns a state with pressures of least norm, closed corners and a second body."""
        require(found.load > 0, "approach", found.approach, NOT_YET)
        forces = found.forces
        other = np.zeros(forces.shape[1:]) if H.second is None else H.second.above(forces)
        least = min(2 * found.kkt, self.loose / state.grid.count)  # beyond that touching is a matter of force
        closed = found.gaps <= least * np.ptp(state.displacement + other)
        if H.second is None:
            forces = least_norm_where_closed(forces, closed)
        touching = closed_corners(forces, closed)
        return replace(state, pressures=forces / state.grid.area, opposite=other, closed=touching)

    # the window

    def _picture(self, load, approach, window):
        short = np.array([1e4 / self.solid.ell])
        softer = 1 + self.solid.E_star * float(short[0] * np.max(surface_symbol(self.solid, short)[2:]))
        plain = (load or 0.0) / (2 * joint_modulus(self.solid, self.second))
        needed = (plain, softer * plain) if approach is None else approach
        return CandidateSquares(
            self.gaps, self.solid.ell, needed, self.obstacle, window, self.period is not None
        )

    def _is_sparse(self, picture):
        """Returns whether so little of a period can touch that several squares of cells are tried."""
        if self.period is None or self.options.nodes is not None:
            return False
        inside = self.second is None or self.solid.ell < self.period / 4  # corners stay in a period
        return inside and len(picture.low(picture.bound)) < SPARSE * CONTACT_ROWS**2


def _share_of_spots(state, least):
    """Returns the load's share on spots of fewer cells."""
    load = 0.0
    for forces in state.total.reshape(-1, *[state.grid.count] * 2) * np.reshape(state.grid.area, (-1, 1, 1)):
        labels = spots(forces > 0, state.is_whole)
        load += forces[(np.bincount(labels.ravel())[labels] < least) & (labels > 0)].sum()
    return float(load / state.load)


def _warnings(cut, outside, hidden):
    """Returns what a fixed window or fixed nodes leave out."""
    parts = (outside, "outside of the window"), (hidden, "between cells")
    at = [(*places[0], where) for places, where in parts if len(places)]
    words = (f"the obstacle would touch {where} as well, as at ({x1:.4g}, {x2:.4g})" for x1, x2, where in at)
    return *["the window cuts the contact: cells at its rim press"] * cut, *words
