"""Penetration that a solution on squares of cells leaves out, beside its squares and between its cells.

The gap at a place is g0 - d + u + lever psi. Samples of the obstacle below the approach
(`microblock.halfspace.candidate_squares`) are the only places where it can be negative. What the forces add
to the gap there is taken

1. inside of the squares from the nearest cell,
2. less than half of a side beside a square from its compliance by FFT, on a square twice as wide,
3. farther away from the loads at its Chebyshev nodes (`microblock.halfspace.squares`),
4. on a period from the images of all squares, by their nodes, too.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates, minimum_filter

from ..contact_solvers.fft_compliance import Grid
from ..model.periodic import EQUAL
from ..model.types import Array, Flags
from .candidate_squares import CandidateSquares
from .squares import SEARCH_CELLS, Squares, chebyshev_nodes, corner_response, node_places, response_matrix

MOST_PLACES = 256  # whose gaps are evaluated, the lowest first


def penetration_outside(state: Any, candidates: CandidateSquares) -> Array:
    """Returns places beside the squares of a SurfaceCells where the gap is negative, most first: array
    (k, 2) (lengths).
    """
    low, is_outside = _samples_below_approach(state, candidates)
    return _outside(state, candidates, low[is_outside])


def penetration(state: Any, candidates: CandidateSquares) -> tuple[Array, Array]:
    """Returns `penetration_outside`, and the same of places between the cells: arrays (k, 2) (lengths)."""
    low, is_outside = _samples_below_approach(state, candidates)
    outside = _outside(state, candidates, low[is_outside])
    return outside, _between_cells(state, candidates, low[~is_outside])


def _outside(state: Any, candidates: CandidateSquares, low: Array) -> Array:
    """Returns as `penetration_outside`, of samples beside the squares, array (m, 3)."""
    places = low[:, :2]
    # on one square that may grow all count: which of them are deepest decides what it grows to
    if not isinstance(state.grid, Grid) or state.solver.options.window is not None:
        places = _lowest_of_cells(Squares(state.grid.grids, state.solver.period), low)
    return _negative_gaps(state, candidates, places, gaps_beside(state, places))


def _between_cells(state: Any, candidates: CandidateSquares, low: Array) -> Array:
    """Returns as `penetration_outside`, of samples in the squares, array (m, 3)."""
    cells = state.grid.nearest(*low[:, :2].T)
    flexibility, initial_gaps = state.solver.prepared(state.grid)
    f = initial_gaps.min(axis=0)
    neighbours = minimum_filter(f, (1, 3, 3)[-f.ndim :], mode="wrap" if state.is_whole else "nearest")
    # a twentieth of the indentation below all cells about it
    is_summit = low[:, 2] < neighbours[tuple(cells)] - (state.approach - candidates.lowest[2]) / 20
    if not is_summit.any():
        return low[:0, :2]
    forces = state.pressures * state.grid.area
    added = (flexibility @ forces)[(slice(None), *cells[:, is_summit])]  # 1
    return _negative_gaps(state, candidates, low[is_summit, :2], added)


def gaps_beside(state: Any, places: Array) -> Array:
    """Returns what the forces of a SurfaceCells add to gaps at places, array (k, 2), outside of its squares:
    array (corners, k) (lengths).
    """
    squares = state.grid
    forces = state.pressures * squares.area
    resultants = state.solver.prepared(squares)[0].resultants(forces)
    gaps = np.zeros((len(forces), len(places)))
    for grid, *on_square in zip(squares.grids, _by_square(forces), _by_square(resultants)):
        loaded = LoadedSquare(state.solver, grid, *on_square)
        images = squares.nearest_images(grid, *places.T)
        is_close = loaded.doubled.distance_outside(*images) < -loaded.doubled.width / 2
        if is_close.any():
            gaps[:, is_close] += loaded.gaps_close_by(images[:, is_close])  # 2
        if not is_close.all():
            gaps[:, ~is_close] += loaded.gaps_far_away(images[:, ~is_close], images_alone=False)  # 3
        if state.solver.period and is_close.any():
            gaps[:, is_close] += loaded.gaps_far_away(images[:, is_close], images_alone=True)  # 4
    return gaps


@dataclass(frozen=True)
class LoadedSquare:
    """A square of cells with its loads, and the gaps that these open outside of it.

    Attributes
    ----------
    solver : SurfaceSolver
    grid : Grid
    forces : array (corners, n, n)
        Of the corners on cells (force).
    resultants : array (1 or 3, n, n)
        Forces p, and moments m unless psi = 0.
    """

    solver: Any
    grid: Grid
    forces: Array
    resultants: Array

    @property
    def doubled(self) -> Grid:
        """A square twice as wide about the same middle, with the cells of the search."""
        return Grid(2 * SEARCH_CELLS, self.grid.side / SEARCH_CELLS, self.grid.middle)

    def gaps_close_by(self, places: Array) -> Array:
        """Returns gaps at places in the doubled square, array (2, k), by FFT: array (corners, k)."""
        doubled = self.doubled
        applied = np.zeros((len(self.forces), doubled.count, doubled.count))
        np.add.at(applied, (slice(None), *doubled.nearest(*self.grid.places)), self.forces)
        added = self.solver.alone(doubled, False) @ applied
        in_cells = doubled.cell_coordinates(*places)
        return np.array([map_coordinates(of_corner, in_cells, order=1) for of_corner in added])

    def gaps_far_away(self, places: Array, images_alone: bool) -> Array:
        """Returns gaps at places, array (2, k), by the loads at the nodes, or by those of their images alone:
        array (corners, k) (lengths).
        """
        solver = self.solver
        x, y = places[:, :, None] - node_places(self.grid, 1)[:, None]
        response = response_matrix(solver.response(x, y, images_alone), len(self.resultants))
        u, *phi = self._displaced(response, self.resultants)
        levers = solver.tilt(*places) - solver.offsets[:, : len(phi), None]
        gaps = u + np.sum(levers * np.array(phi).reshape(levers.shape[1:]), axis=1)
        if solver.second is not None:
            corners = solver.solid.ell / 2 * solver.offsets
            response = corner_response(solver.second_response, corners, x, y, images_alone)
            gaps += self._displaced(response, self.forces)
        return gaps

    def _displaced(self, response: Array, loads: Array) -> Array:
        """Returns what loads on cells, array (columns, n, n), displace by a response (rows, columns, k, m) of
        k places to the m nodes: array (rows, k).
        """
        weights = chebyshev_nodes(self.grid.count, 1)[1]
        at_nodes = (weights.T @ loads @ weights).reshape(len(loads), -1)
        return np.asarray(np.einsum("rckn,cn->rk", response, at_nodes))


def _samples_below_approach(state: Any, candidates: CandidateSquares) -> tuple[Array, Flags]:
    """Returns x1, x2 and f of samples below the approach, within a period: array (m, 3) (lengths), and which
    of them lie beside the squares.
    """
    low = candidates.samples_below(state.approach)
    period = state.solver.period
    if period:
        low[:, :2] -= period * np.rint(low[:, :2] / period)
    return low, state.grid.distance_outside(*low[:, :2].T) > 0


def _negative_gaps(state: Any, candidates: CandidateSquares, places: Array, added: Array) -> Array:
    """Returns of places, array (k, 2), those with negative gaps, most first; `added`, array (corners, k), is
    what the forces add to the gaps there.
    """
    gaps = (state.solver.gaps(*places.T) - state.approach + added).min(axis=0)
    deepest = np.argsort(gaps)[:MOST_PLACES]
    return places[deepest[gaps[deepest] < -EQUAL * (state.approach - candidates.lowest[2])]]


def _lowest_of_cells(squares: Squares, low: Array) -> Array:
    """Returns the lowest sample, of an array (m, 3), in each cell of squares twice as wide: array (k, 2)."""
    low = low[np.argsort(low[:, 2])]
    widths = (squares.side / SEARCH_CELLS)[squares.nearest(*low[:, :2].T)[0], None]
    cells = np.floor(low[:, :2] / widths) @ (1, 1j)  # complex numbers are sorted as pairs, and faster
    return low[np.unique(cells, return_index=True)[1], :2]


def _by_square(values: Array) -> Array:
    """Returns values on cells of squares, array (rows, ..., n, n), as array (squares, rows, n, n)."""
    return values.reshape(len(values), -1, *values.shape[-2:]).swapaxes(0, 1)
