"""The half-space on n x n equal cells, matrix-free: corner forces to corner gaps by FFT.

With u the normal displacement into the body and phi as in `microblock.halfspace.symbol`, p and m the sums of
the forces on a cell and of their levers,

    p = sum f_c,   m = sum lever_c f_c,   gap_c = u + lever_c.phi

is the flexibility H of (a) in `microblock.corners.active_set`. The levers of the four corners are constant,
(-+1, -+1) but for psi0, and act in three degrees of freedom: H has a null space, forces up and down in turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from ..model.material import Cosserat
from ..model.types import AnyArray as Array
from .kernels import kernels
from .symbol import at_rest, symbol


@dataclass(frozen=True)
class Waves:
    """The surface response in Fourier space, of forces on cells; or an approximate inverse of it.

    Attributes
    ----------
    length : (int, int)
        Cells of the transforms.
    spectrum : array (3, 3, length, length//2 + 1)
        From (p, m1, m2) to (u, phi1, phi2), complex.
    """

    length: tuple[int, int]
    spectrum: Array

    def __call__(self, values: Array) -> Array:
        """Returns the responses to fields on cells, arrays (k, n1, n2) with k the rows that are there."""
        waves = rfft2(values, self.length, workers=1)
        found = [sum(row[j] * waves[j] for j in range(len(row))) for row in self.spectrum]
        n1, n2 = values.shape[-2:]
        return irfft2(np.array(found), self.length, workers=1)[..., :n1, :n2]


@dataclass(frozen=True)
class Flexibility:
    """H on cells as a product, and a preconditioner for it.

    Attributes
    ----------
    levers : array (corners, 2)
    response, inverse : Waves
        Of (u, phi1, phi2), or of u alone for one corner.
    aside : Waves or None
        Of one corner: from p to phi, or to the m that holds psi = 0.
    """

    levers: Array
    response: Waves
    inverse: Waves
    aside: Waves | None = None

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps from forces, arrays (corners, n1, n2)."""
        return self.gaps(self.surface(forces))

    def surface(self, forces: Array) -> Array:
        """Returns (u, phi1, phi2), or u alone, from forces: array (3 or 1, n1, n2)."""
        return self.response(np.tensordot(self._rows.T, forces, 1))

    def beside(self, forces: Array) -> Array:
        """Returns for one corner what p does besides, array (2, n1, n2): phi, or m where psi = 0."""
        assert self.aside is not None
        return self.aside(forces)

    def gaps(self, surface: Array) -> Array:
        """Returns what u and phi add to the gap of each corner."""
        return np.tensordot(self._rows, surface, 1)

    def precondition(self, gaps: Array) -> Array:
        """Returns forces of least norm that leave about these gaps."""
        back = np.linalg.pinv(self._rows)
        return np.tensordot(back.T, self.inverse(np.tensordot(back, gaps, 1)), 1)

    @property
    def _rows(self) -> Array:
        """(1, lever) of each corner, array (corners, 3); of one corner (1,)."""
        ones = np.ones((len(self.levers), 1))
        return ones if len(self.levers) == 1 else np.hstack((ones, self.levers))


def flexibility(
    solid: Cosserat, levers: Array, count: int, width: float, periodic: bool, clamped: bool
) -> Flexibility:
    """Returns the Flexibility of corners with these levers on count x count cells of this width (length)."""
    length = count if periodic else next_fast_len(2 * count, real=True)
    smooth = _spectrum(solid, length, width)
    if periodic:
        whole = smooth.copy()
        whole[:, :, 0, 0] = np.diag((0.0, at_rest(solid), at_rest(solid))) / width**2
    else:
        whole = _embedded(solid, count, length, width)
    size = (length, length)
    if len(levers) == 1:
        (alone, aside), (smooth, _) = (_one_corner(matrix, clamped) for matrix in (whole, smooth))
        return Flexibility(levers, Waves(size, alone), Waves(size, 1 / smooth), Waves(size, aside))
    inverse = np.moveaxis(np.linalg.inv(np.moveaxis(smooth, (0, 1), (-2, -1))), (-2, -1), (0, 1))
    return Flexibility(levers, Waves(size, whole), Waves(size, inverse))


def _spectrum(solid: Cosserat, length: int, width: float) -> Array:
    """Returns the symbol at the wavenumbers of a period, positive definite at each: array (3, 3, ...).

    At k = 0 it is what half of the smallest wavenumber has, which stands for the mean.
    """
    step = 2 * np.pi / (length * width)
    k1 = (np.fft.fftfreq(length) * length * step)[:, None]
    k2 = (np.arange(length // 2 + 1) * step)[None, :]
    k = np.hypot(k1, k2)
    k[0, 0] = step / 2
    U, V, W, other = symbol(solid, k)
    c, s = k1 / k, k2 / k
    odd1, odd2 = (c * np.ones_like(k), s * np.ones_like(k))
    if length % 2 == 0:  # of the shortest wave cells see no odd part
        odd1[length // 2] = 0
        odd2[:, -1] = 0
    matrix = np.zeros((3, 3, *k.shape), complex)
    matrix[0, 0] = U
    matrix[0, 1], matrix[0, 2] = 1j * V * odd1, 1j * V * odd2
    matrix[1, 0], matrix[2, 0] = -1j * V * odd1, -1j * V * odd2
    matrix[1, 1] = other + (W - other) * c**2
    matrix[2, 2] = other + (W - other) * s**2
    matrix[1, 2] = matrix[2, 1] = (W - other) * odd1 * odd2
    matrix[1, 1, 0, 0] = matrix[2, 2, 0, 0] = (W[0, 0] + other[0, 0]) / 2
    return matrix / width**2


def _embedded(solid: Cosserat, count: int, length: int, width: float) -> Array:
    """Returns the transforms of the cells' responses without images in a period of the length."""
    table = kernels(solid.nu, solid.beta, solid.curvature, solid.alpha_prime, solid.beta_prime)
    values = table.cells(count, width / solid.ell) * (1 - solid.nu) / solid.mu / solid.ell
    columns = np.zeros((6, length, length))
    columns[:, :count, :count] = values
    for mirrored, odd in ((1, (1, 4)), (2, (2, 4))):  # along x1: v1 and the component 12 are odd
        sign = np.ones((6, 1, 1))
        sign[list(odd)] = -1
        if mirrored == 1:
            columns[:, :-count:-1, :count] = sign * columns[:, 1:count, :count]
        else:
            columns[:, :, :-count:-1] = sign * columns[:, :, 1:count]
    u, v1, v2, w11, w12, w22 = rfft2(columns)
    return np.array(((u, -v1, -v2), (v1, w11, w12), (v2, w12, w22)))


def _one_corner(matrix: Array, clamped: bool) -> tuple[Array, Array]:
    """Returns u from p, and what p does besides: phi, or the m that takes the rotation away."""
    if not clamped:
        return matrix[:1, :1], matrix[1:, :1]
    turned, pressed = (np.moveaxis(part, (0, 1), (-2, -1)) for part in (matrix[1:, 1:], matrix[1:, :1]))
    moments = -np.linalg.solve(turned, pressed)
    across = np.moveaxis(matrix[:1, 1:], (0, 1), (-2, -1))
    return matrix[:1, :1] + np.moveaxis(across @ moments, (-2, -1), (0, 1)), np.moveaxis(
        moments, (-2, -1), (0, 1)
    )
