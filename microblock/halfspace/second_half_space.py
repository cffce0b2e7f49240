"""A second half-space, pressed and displaced where corners of blocks stand.

Corner (a, b) of the block at x presses the second body at x + (ell/2)(a, b), where its displacement u2 adds
to the gap. Cells of the second surface share its force by the weights S of the polynomial through five of
them along each axis, which keep force and moment, and

    gaps = S^T U2 S forces

is positive. U2 is on a period the symbol, else the displacement at the centre of a cell under pressure on
another.

Forces 1, -1, -1, 1 on a small block hardly displace the second body. These gaps get 0.003 of what short waves
displace besides.
"""

from functools import cached_property

import numpy as np
from scipy.fft import next_fast_len
from scipy.sparse import csr_array

from ..contact_solvers.convolution import FourierOperator, circulant_spectrum
from ..contact_solvers.fft_compliance import TWIST_MODE, wavenumbers
from ..errors import require
from ..halfplane.kernels import normal_symbol, short_waves
from ..model.material import Cosserat
from ..model.types import Array, Integers
from .kernels import surface_kernels

SHARING_CELLS = np.arange(-2, 3)  # about the nearest one that share a force: an odd number sees all waves
LEAST_TWIST = 1e-3  # of what short waves displace the first body by, for the twist in the preconditioner
FARTHEST_CORNER = 2.0  # windows, beyond which blocks are too large for the cells of the second body


class SecondBodyCells:
    """What a second body adds to the gaps of corners on count x count cells.

    Parameters
    ----------
    solid : Cosserat
        Second body, also classical.
    ell : float
        Side of the first body's blocks (length).
    offsets : array (corners, 2)
        (a, b) of the corners.
    width : float
        Of a cell (length).
    count : int
    periodic : bool

    Attributes
    ----------
    force_weights : dict of sparse arrays (m, n)
        By a or b: weights on m cells of forces on n cells along an axis, `margin` fewer on either side.
    response : FourierOperator
        Of u2 to forces on m x m cells.
    near : int
        Cells of the period of the preconditioner.
    least_twist, twisted : float
        Least and most twist of a block (length per force).

    Raises
    ------
    BadArgument
        If corners stand FARTHEST_CORNER windows outside.
    """

    def __init__(
        self, solid: Cosserat, ell: float, offsets: Array, width: float, count: int, periodic: bool
    ) -> None:
        self.solid = solid
        self.ell = ell
        self.offsets = offsets
        self.width = width
        corner_distance = ell / 2 / width * np.abs(offsets).max()  # in cells
        require(
            periodic or corner_distance <= FARTHEST_CORNER / 2 * count,
            "ell",
            ell,
            f"is above {FARTHEST_CORNER:g} times the window of {count * width:g}, beside which corners press "
            "the second body: give a wider one, Cells(window=(left, right))",
        )
        self.margin = 0 if periodic or not corner_distance else int(np.ceil(corner_distance)) + 2
        signs = np.unique(offsets).tolist()
        self.force_weights = {
            sign: _force_weights(sign * corner_distance, count, self.margin) for sign in signs
        }
        if periodic:
            spectrum = _smooth_response(solid, count, width)
            spectrum[0, 0] = 0
        else:
            quarter = surface_kernels(solid).cells(count + 2 * self.margin, width, most=1)[0]
            length = next_fast_len(2 * len(quarter), real=True)
            spectrum = circulant_spectrum(quarter, length, False, False)
        length = len(spectrum)
        self.response = FourierOperator((length, length), [[spectrum]])
        self.least_twist = float(3e-3 * short_waves(solid)[0] / width)
        _, twist = _corners_under_waves(ell, length, width)
        self.twisted = self.least_twist + float(np.max(spectrum * twist**2))
        self.near = count if periodic else next_fast_len(count, real=True)

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps from forces, arrays (corners, n, n)."""
        u2 = self.displacement(forces)
        gaps = np.array(
            [self.force_weights[a].T @ u2 @ self.force_weights[b] for a, b in self.offsets.tolist()]
        )
        if len(gaps) == len(TWIST_MODE):
            gaps += np.multiply.outer(TWIST_MODE, self.least_twist * np.tensordot(TWIST_MODE, forces, 1))
        return gaps

    def pressed(self, forces: Array) -> Array:
        """Returns the forces on cells of the second surface, array (m, m)."""
        return np.sum(
            [
                self.force_weights[a] @ of_corner @ self.force_weights[b].T
                for (a, b), of_corner in zip(self.offsets.tolist(), forces)
            ],
            axis=0,
        )

    def displacement(self, forces: Array) -> Array:
        """Returns u2 on cells of the second surface, array (m, m)."""
        return self.response(self.pressed(forces)[None])[0]

    def above(self, forces: Array) -> Array:
        """Returns u2 at the contact points, array (n, n)."""
        u2 = self.displacement(forces)
        inside = slice(self.margin, len(u2) - self.margin)
        return u2[inside, inside]

    @cached_property
    def smooth(self) -> Array:
        """U2 at the wavenumbers of the preconditioner, all positive."""
        return _smooth_response(self.solid, self.near, self.width)

    @cached_property
    def _corners(self) -> Array:
        """What waves of u2 raise, twist and turn four corners by, array (4, ...)."""
        (u, *phi), twist = _corners_under_waves(self.ell, self.near, self.width)
        return np.array((u, twist, *phi))

    def added(self, R: Array, displaced: float) -> Array:
        """Returns R of both bodies from that of the first, array (4, 4, ...), for u, w, phi1 and phi2 in
        gap = u + a b w - a phi1 - b phi2.
        """
        R_of_bodies = np.insert(np.insert(R, 1, 0.0, axis=0), 1, 0.0, axis=1)
        R_of_bodies[1, 1] = max(self.least_twist, LEAST_TWIST * displaced / self.width)
        R_of_bodies += self.smooth * self._corners[:, None] * self._corners
        return R_of_bodies

    def with_short(self, short: Array, displaced: float) -> Array:
        """Returns what short waves displace, twist and turn, over the first body's displacement."""
        squares = (self._corners**2).mean(axis=(1, 2)) * short_waves(self.solid)[0] / displaced
        return np.insert(short, 1, 0.0) + np.maximum(squares, (0, LEAST_TWIST, 0, 0))


def _smooth_response(solid: Cosserat, length: int, width: float) -> Array:
    """Returns U2 on the waves of a period, array (length, length//2 + 1), all positive."""
    k = wavenumbers(length, width, 2)[1]
    return np.asarray(normal_symbol(solid, k.ravel()).reshape(k.shape) / width**2)


def _interpolation_weights(shift: float) -> tuple[Integers, Array]:
    """Returns the cells that share a force `shift` cells further, and their weights."""
    first = int(np.rint(shift))
    distances = shift - first - SHARING_CELLS
    weights = [
        np.prod(np.delete(distances, i) / np.delete(cell - SHARING_CELLS, i))
        for i, cell in enumerate(SHARING_CELLS)
    ]
    return first + SHARING_CELLS, np.array(weights)


def _corners_under_waves(ell: float, length: int, width: float) -> tuple[tuple[Array, Array, Array], Array]:
    """Returns (u, phi1, phi2) and twist of four corners under waves of u2."""
    cells, weights = _interpolation_weights(ell / 2 / width)
    k1, k2 = wavenumbers(length, width, 2)[0]
    along_1 = np.exp(1j * width * k1[..., None] * cells) @ weights
    along_2 = np.exp(1j * width * k2[..., None] * cells) @ weights
    u = along_1.real * along_2.real
    rotations = along_1.imag * along_2.real, along_1.real * along_2.imag
    return (u, *rotations), -along_1.imag * along_2.imag


def _force_weights(shift: float, count: int, margin: int) -> csr_array:
    """Returns weights of forces `shift` cells further, sparse (m, n)."""
    cells, weights = _interpolation_weights(shift)
    m = count + 2 * margin
    columns = np.arange(count)
    rows = (columns[:, None] + margin + cells) % m  # on a period they go on where they began
    entries = np.tile(weights, count), (rows.ravel(), np.repeat(columns, len(cells)))
    matrix = csr_array(entries, shape=(m, count))
    matrix.eliminate_zeros()
    return matrix
