"""Several squares of cells on a half-space, each of its own width, that displace each other.

Loads of a square go to Chebyshev nodes, and displacements at nodes to its cells, by the interpolating
polynomials. Of two squares close to each other the larger one is cut into pieces with nodes of their own, no
wider than twice the gap.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np

from ..contact_solvers.fft_compliance import Flexibility
from ..model.quadrature import lagrange

NODES = 6  # along a side, for 4e-4 of what squares half a side apart displace by


@dataclass(frozen=True)
class Squares:
    """Squares of as many cells each, on a period or not. Arrays are (squares, n, n)."""

    grids: tuple
    period: float | None = None

    @property
    def count(self):
        return self.grids[0].count

    @cached_property
    def places(self):
        """Coordinates of all centres, two arrays."""
        return tuple(np.stack([grid.places for grid in self.grids], axis=1))

    @property
    def middle(self):
        return tuple(grid.middle for grid in self.grids)

    @property
    def side(self):
        """Sides (lengths), array (squares,)."""
        return np.array([grid.side for grid in self.grids])

    @property
    def area(self):
        """Of a cell (length^2), array (squares, 1, 1)."""
        return np.array([grid.area for grid in self.grids])[:, None, None]

    def of(self, count):
        """Returns the same squares of so many cells a side."""
        return Squares(tuple(grid.of(count) for grid in self.grids), self.period)

    def near(self, grid, *x):
        """Returns the images of places next to the middle of a square, array (2, ...)."""
        middle = np.reshape(grid.middle, (2, *[1] * np.ndim(x[0])))
        images = np.rint((x - middle) / (self.period or np.inf))
        return x - images * (self.period or 0.0)

    def nearest(self, *x):
        """Returns the square and the cell next to places, array (3, ...) of int."""
        places = [self.near(grid, *x) for grid in self.grids]
        beyond = [grid.beyond(*one) for grid, one in zip(self.grids, places)]
        number = np.argmin(beyond, axis=0)
        cells = np.array([grid.nearest(*one) for grid, one in zip(self.grids, places)])
        return np.array((number, *np.take_along_axis(cells, number[None, None], axis=0)[0]))

    def beyond(self, *x):
        """Returns how far places are outside (length, the largest along an axis)."""
        return np.min([grid.beyond(*self.near(grid, *x)) for grid in self.grids], axis=0)

    def interpolated(self, values, periodic, *x):
        """Returns values on cells between their centres; 0 outside."""
        pairs = zip(self.grids, values)
        return np.sum([grid.interpolated(one, False, *self.near(grid, *x)) for grid, one in pairs], axis=0)


@lru_cache
def nodes(count, pieces):
    """Returns places of nodes along a side, over it from its middle, and their shares in so many cells, array
    (count, m); the cells themselves where these are no more.
    """
    x = (np.arange(count) + 0.5) / count
    if pieces * NODES >= count:
        return x - 0.5, np.eye(count)
    own = (1 - np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)) / 2
    piece, shares = np.floor(x * pieces), np.zeros((count, pieces, NODES))
    shares[np.arange(count), piece.astype(int)] = lagrange(own, x * pieces - piece)
    return ((np.arange(pieces)[:, None] + own) / pieces - 0.5).ravel(), shares.reshape(count, -1)


def of_nodes(grid, pieces):
    """Returns the nodes of a square, array (2, m)."""
    along = grid.side * nodes(grid.count, pieces)[0]
    x1, x2 = np.meshgrid(*(middle + along for middle in grid.middle), indexing="ij")
    return np.array((x1.ravel(), x2.ravel()))


class FarField:
    """What squares displace each other by, and on a period their images.

    Parameters
    ----------
    squares : Squares
    response : function
        Of distances (x, y) and whether these are within a square, and then of images alone: symmetric array
        (rows, rows, ...).
    apart : array (k, 2)
        Distances that are added between loads and what they displace (length).
    """

    def __init__(self, squares, response, apart):
        self.squares, self.pairs, grids = squares, [], squares.grids
        for i, j in zip(*np.triu_indices(len(grids), 0 if squares.period else 1)):
            small, large = (i, j) if grids[i].side <= grids[j].side else (j, i)
            pieces = 1
            if i != j:
                free = min(gap(squares, grids[i], grids[j], shift) for shift in apart)
                pieces = 2 ** max(int(np.ceil(np.log2(grids[large].side / (2 * free)))), 0)
            here, there = of_nodes(grids[small], 1), of_nodes(grids[large], pieces)
            K = response(*(here[:, :, None] - there[:, None, :]), i == j)
            rows, _, *shape = K.shape
            K = K.transpose(0, 2, 1, 3).reshape(rows * shape[0], rows * shape[1])
            self.pairs.append((small, large, pieces, K))

    def __call__(self, loads):
        """Returns what loads displace, arrays (rows, squares, n, n)."""
        n, levels = self.squares.count, {1, *(pieces for *_, pieces, _ in self.pairs)}
        shares = {pieces: nodes(n, pieces)[1] for pieces in levels}
        moments = {pieces: B.T @ loads @ B for pieces, B in shares.items()}
        found = {pieces: np.zeros_like(one) for pieces, one in moments.items()}
        for small, large, pieces, K in self.pairs:
            there, here = moments[pieces][:, large], moments[1][:, small]
            found[1][:, small] += (K @ there.ravel()).reshape(here.shape)
            if small != large:
                found[pieces][:, large] += (here.ravel() @ K).reshape(there.shape)
        return sum(B @ found[pieces] @ B.T for pieces, B in shares.items())


def gap(squares, one, other, shift):
    """Returns the distance between two squares, of which one is shifted (the largest along an axis)."""
    place = squares.near(one, *(np.array(other.middle) + shift))
    return float(one.beyond(*place) - other.side / 2)


class Coupled(Flexibility):
    """The flexibility of corners on several squares: of each its own, and what they displace each other by.

    Parameters
    ----------
    squares : Squares
    owns : sequence of Flexibility
        Of the squares.
    tilt : array (2 or 0, squares, n, n)
    response : Response
    counter : Counters or None
    """

    def __init__(self, squares, owns, tilt, response, counter):
        self.owns, self.tilt, self.counter = owns, tilt, counter
        self.offsets, self.clamped = owns[0].offsets, owns[0].clamped

        def far(rows):
            return FarField(squares, lambda *away: on_rows(response(*away), rows), np.zeros((1, 2)))

        others = far(1 if len(self.offsets) == 1 else 3)

        def respond(loads):
            return each([own.response for own in owns], loads) + others(loads)

        def aside(forces):
            loads = np.concatenate((forces, np.zeros((2, *forces.shape[1:]))))
            beside = far(3)(loads)[1:] * (squares.area if self.clamped else 1.0)
            return each([own.aside for own in owns], forces) + beside

        self.response = respond
        self.aside = aside if len(self.offsets) == 1 else None
        self.back = lambda: lambda values: each([own.back() for own in owns], values)

    def _backs_of(self, there):
        return np.stack([own._backs_of(there[:, i]) for i, own in enumerate(self.owns)], axis=2)


def on_rows(parts, rows):
    """Returns the components of a response as the matrix from p to u, or from (p, m) to (u, phi); where psi =
    0, whose m are in the place of phi, without m.
    """
    u, v1, v2, *w = parts
    w11, w12, w22 = w or [0 * u] * 3
    return u[None, None] if rows == 1 else np.array(((u, -v1, -v2), (v1, w11, w12), (v2, w12, w22)))


def of_corners(response, corners, x, y, itself):
    """Returns a response from forces on corners to their gaps at distances, array (corners, corners, ...)."""
    # of four corners nine
    apart, rows = np.unique((corners[:, None] - corners).reshape(-1, 2), axis=0, return_inverse=True)
    return np.array([response(x + a, y + b, itself)[0] for a, b in apart])[rows.reshape(len(corners), -1)]


class Counters:
    """What a second body adds to the gaps of corners on several squares.

    Parameters
    ----------
    owns : sequence of Counter
        Of the squares.
    squares : Squares
    offsets : array (corners, 2)
        Places of the corners from the contact point (length).
    response : function
        See `Far`: u2 under a force.
    """

    def __init__(self, owns, squares, offsets, response):
        self.owns, self.squares, self.offsets, self.response = owns, squares, offsets, response
        self.twisted = np.array([own.twisted for own in owns])[:, None, None]
        self._far = self._between(offsets)

    def _between(self, offsets):
        apart = (offsets[:, None] - offsets).reshape(-1, 2)
        return FarField(self.squares, partial(of_corners, self.response, offsets), apart)

    def __matmul__(self, forces):
        return each([own.__matmul__ for own in self.owns], forces) + self._far(forces)

    def above(self, forces):
        """Returns u2 at the contact points, array (squares, n, n)."""
        middle = np.vstack((self.offsets, np.zeros((1, 2))))  # as a corner without a force
        beside = self._between(middle)(np.concatenate((forces, np.zeros((1, *forces.shape[1:])))))
        owns = [own.above(one) for own, one in zip(self.owns, forces.swapaxes(0, 1))]
        return np.array(owns) + beside[-1]


def each(functions, values):
    """Returns what functions make of the values of their squares, arrays (..., squares, n, n)."""
    return np.stack([one(own) for one, own in zip(functions, values.swapaxes(0, 1))], axis=1)
