"""Several squares of cells on a half-space, each of its own width, that displace each other.

Loads of a square go to Chebyshev nodes, and displacements at nodes to its cells, by the interpolating
polynomials. Of two squares close to each other the larger one is cut into pieces with nodes of their own, no
wider than twice the gap.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..contact_solvers.fft_compliance import CellFlexibility, Flexibility, Grid, Operator
from ..model.quadrature import lagrange
from ..model.types import Array, Flags, Integers
from .images import PeriodicGreen
from .second_half_space import SecondBodyCells

SEARCH_CELLS = 48  # along an axis of a square that is looked for
NODES_A_SIDE = 6  # for 4e-4 of what squares half a side apart displace by

Response = Callable[[Array, Array, bool], Array]  # of distances (x, y), and whether these are within a square


@dataclass(frozen=True)
class Squares:
    """Squares of as many cells each, on a period or not. Arrays are (squares, n, n)."""

    grids: tuple[Grid, ...]
    period: float | None = None

    @property
    def count(self) -> int:
        return self.grids[0].count

    @cached_property
    def places(self) -> tuple[Array, ...]:
        """Coordinates of all centres, two arrays."""
        return tuple(np.stack([grid.places for grid in self.grids], axis=1))

    @property
    def middle(self) -> tuple[tuple[float, ...], ...]:
        return tuple(grid.middle for grid in self.grids)

    @property
    def side(self) -> Array:
        """Sides (lengths), array (squares,)."""
        return np.array([grid.side for grid in self.grids])

    @property
    def area(self) -> Array:
        """Of a cell (length^2), array (squares, 1, 1)."""
        return np.array([grid.area for grid in self.grids])[:, None, None]

    def with_count(self, count: int) -> "Squares":
        """Returns the same squares of so many cells a side."""
        return Squares(tuple(grid.with_count(count) for grid in self.grids), self.period)

    def nearest_images(self, grid: Grid, *x: Array | float) -> Array:
        """Returns the images of places next to the middle of a square, array (2, ...)."""
        places = np.array(x)
        if self.period is None:
            return places
        middle = np.reshape(grid.middle, (2, *[1] * np.ndim(x[0])))
        return np.asarray(places - self.period * np.rint((places - middle) / self.period))

    def nearest(self, *x: Array | float) -> Integers:
        """Returns the square and the cell next to places, array (3, ...)."""
        images = [self.nearest_images(grid, *x) for grid in self.grids]
        distances = [grid.distance_outside(*places) for grid, places in zip(self.grids, images)]
        square = np.argmin(distances, axis=0)
        cells = np.array([grid.nearest(*places) for grid, places in zip(self.grids, images)])
        return np.array((square, *np.take_along_axis(cells, square[None, None], axis=0)[0]))

    def distance_outside(self, *x: Array | float) -> Array:
        """Returns how far places are outside (length, the largest along an axis)."""
        distances = [grid.distance_outside(*self.nearest_images(grid, *x)) for grid in self.grids]
        return np.asarray(np.min(distances, axis=0))

    def interpolated(self, values: Array, periodic: bool, *x: Array | float) -> Array:
        """Returns values on cells between their centres; 0 outside."""
        return np.sum(
            [
                grid.interpolated(on_grid, False, *self.nearest_images(grid, *x))
                for grid, on_grid in zip(self.grids, values)
            ],
            axis=0,
        )


@lru_cache
def chebyshev_nodes(count: int, pieces: int) -> tuple[Array, Array]:
    """Returns places of nodes along a side, over it from its middle, and their weights on so many cells,
    array (count, m); the cells themselves where these are no more.
    """
    x = (np.arange(count) + 0.5) / count
    if pieces * NODES_A_SIDE >= count:
        return x - 0.5, np.eye(count)
    nodes = (1 - np.cos(np.pi * (np.arange(NODES_A_SIDE) + 0.5) / NODES_A_SIDE)) / 2
    piece = np.floor(x * pieces)
    weights = np.zeros((count, pieces, NODES_A_SIDE))
    weights[np.arange(count), piece.astype(int)] = lagrange(nodes, x * pieces - piece)
    places = (np.arange(pieces)[:, None] + nodes) / pieces - 0.5
    return places.ravel(), weights.reshape(count, -1)


def node_places(grid: Grid, pieces: int) -> Array:
    """Returns the places of nodes on a grid, array (2, m)."""
    along = grid.side * chebyshev_nodes(grid.count, pieces)[0]
    x1, x2 = np.meshgrid(*(middle + along for middle in grid.middle), indexing="ij")
    return np.array((x1.ravel(), x2.ravel()))


class _Pair(NamedTuple):
    """Numbers of two squares, pieces of the large one's sides, and the response between their nodes."""

    small: int
    large: int
    pieces: int
    response: Array


class FarField:
    """What squares displace each other by, and on a period their images.

    Parameters
    ----------
    squares : Squares
    response : function
        Of distances (x, y) and whether these are within a square, and then of images alone: symmetric array
        (rows, rows, ...).
    shifts : array (k, 2)
        Distances that are added between loads and what they displace (length).
    """

    def __init__(self, squares: Squares, response: Response, shifts: Array) -> None:
        self.squares = squares
        self.pairs: list[_Pair] = []
        grids = squares.grids
        for i, j in zip(*np.triu_indices(len(grids), 0 if squares.period else 1)):
            small, large = (i, j) if grids[i].side <= grids[j].side else (j, i)
            pieces = 1
            if i != j:
                distance = min(separation(squares, grids[i], grids[j], shift) for shift in shifts)
                pieces = 2 ** max(int(np.ceil(np.log2(grids[large].side / (2 * distance)))), 0)
            from_large = node_places(grids[small], 1)[:, :, None] - node_places(grids[large], pieces)[:, None]
            K = response(from_large[0], from_large[1], bool(i == j))
            rows, _, *shape = K.shape
            K = K.transpose(0, 2, 1, 3).reshape(rows * shape[0], rows * shape[1])
            self.pairs.append(_Pair(int(small), int(large), pieces, K))

    def __call__(self, loads: Array) -> Array:
        """Returns what loads displace, arrays (rows, squares, n, n):

        1. loads go to the nodes of squares in 1, 2, 4, ... pieces a side,
        2. nodes of pairs of squares displace each other,
        3. displacements go from the nodes to the cells.
        """
        piece_counts = {1, *(pair.pieces for pair in self.pairs)}
        weights = {pieces: chebyshev_nodes(self.squares.count, pieces)[1] for pieces in piece_counts}
        at_nodes = {pieces: B.T @ loads @ B for pieces, B in weights.items()}  # 1
        displaced = {pieces: np.zeros_like(nodal) for pieces, nodal in at_nodes.items()}
        for small, large, pieces, K in self.pairs:  # 2
            on_large = at_nodes[pieces][:, large]
            on_small = at_nodes[1][:, small]
            displaced[1][:, small] += (K @ on_large.ravel()).reshape(on_small.shape)
            if small != large:
                displaced[pieces][:, large] += (on_small.ravel() @ K).reshape(on_large.shape)
        return np.asarray(sum(B @ displaced[pieces] @ B.T for pieces, B in weights.items()))  # 3


def separation(squares: Squares, first: Grid, second: Grid, shift: Array) -> float:
    """Returns the distance between two squares, of which one is shifted (the largest along an axis)."""
    middle = squares.nearest_images(first, *(np.array(second.middle) + shift))
    return float(first.distance_outside(*middle) - second.side / 2)


class CoupledSquares(Flexibility):
    """The flexibility of corners on several squares: of each its own, and what they displace each other by.

    Parameters
    ----------
    squares : Squares
    single : sequence of CellFlexibility
        Of the squares.
    tilt : array (2 or 0, squares, n, n)
    green : PeriodicGreen
    second : SecondBodySquares or None
    """

    def __init__(
        self,
        squares: Squares,
        single: Sequence[CellFlexibility],
        tilt: Array,
        green: PeriodicGreen,
        second: "SecondBodySquares | None",
    ) -> None:
        self.squares = squares
        self.single = single
        self.tilt = tilt
        self.green = green
        self.second = second
        self.offsets = single[0].offsets
        self.clamped = single[0].clamped
        self.twist = None if single[0].twist is None or second is None else second.twisted
        self._far_response = self._far(1 if self.one_corner else 3)

    def _far(self, rows: int) -> FarField:
        def response(x: Array, y: Array, images_alone: bool) -> Array:
            return response_matrix(self.green(x, y, images_alone), rows)

        return FarField(self.squares, response, np.zeros((1, 2)))

    def response(self, loads: Array) -> Array:
        return by_square([square.response for square in self.single], loads) + self._far_response(loads)

    def beside(self, forces: Array) -> Array:
        loads = np.concatenate((forces, np.zeros((2, *forces.shape[1:]))))
        far = self._far(3)(loads)[1:]
        if self.clamped:
            far *= self.squares.area
        return by_square([square.beside for square in self.single], forces) + far

    def inverse(self) -> Operator:
        return partial(by_square, [square.inverse() for square in self.single])

    def lifts_of(self, face: Flags) -> Array:
        return np.stack([square.lifts_of(face[:, i]) for i, square in enumerate(self.single)], axis=2)


def response_matrix(components: Array, rows: int) -> Array:
    """Returns the components of a response as the matrix from p to u, or from (p, m) to (u, phi); where psi =
    0, whose m are in the place of phi, without m.
    """
    u, v1, v2, *w = components
    w11, w12, w22 = w or [0 * u] * 3
    return u[None, None] if rows == 1 else np.array(((u, -v1, -v2), (v1, w11, w12), (v2, w12, w22)))


def corner_response(green: PeriodicGreen, corners: Array, x: Array, y: Array, images_alone: bool) -> Array:
    """Returns the response of gaps to forces on corners, with offsets (corners, 2), at distances (x, y):
    array (corners, corners, ...).
    """
    # of four corners nine
    shifts, rows = np.unique((corners[:, None] - corners).reshape(-1, 2), axis=0, return_inverse=True)
    responses = np.array([green(x + a, y + b, images_alone)[0] for a, b in shifts])
    return responses[rows.reshape(len(corners), -1)]


class SecondBodySquares:
    """What a second body adds to the gaps of corners on several squares.

    Parameters
    ----------
    single : sequence of SecondBodyCells
        Of the squares.
    squares : Squares
    offsets : array (corners, 2)
        Places of the corners from the contact point (length).
    green : PeriodicGreen
        Of the second body.
    """

    def __init__(
        self, single: Sequence[SecondBodyCells], squares: Squares, offsets: Array, green: PeriodicGreen
    ) -> None:
        self.single = single
        self.squares = squares
        self.offsets = offsets
        self.green = green
        self.twisted = np.array([square.twisted for square in single])[:, None, None]
        self._far = self._far_field(offsets)

    def _far_field(self, offsets: Array) -> FarField:
        shifts = (offsets[:, None] - offsets).reshape(-1, 2)
        return FarField(self.squares, partial(corner_response, self.green, offsets), shifts)

    def __matmul__(self, forces: Array) -> Array:
        return by_square([square.__matmul__ for square in self.single], forces) + self._far(forces)

    def above(self, forces: Array) -> Array:
        """Returns u2 at the contact points, array (squares, n, n)."""
        middle = np.vstack((self.offsets, np.zeros((1, 2))))  # as a corner without a force
        far = self._far_field(middle)(np.concatenate((forces, np.zeros((1, *forces.shape[1:])))))
        near = [square.above(on_square) for square, on_square in zip(self.single, forces.swapaxes(0, 1))]
        return np.array(near) + far[-1]


def by_square(functions: Sequence[Operator], values: Array) -> Array:
    """Returns what functions make of the values of their squares, arrays (..., squares, n, n)."""
    results = [function(on_square) for function, on_square in zip(functions, values.swapaxes(0, 1))]
    return np.stack(results, axis=1)
