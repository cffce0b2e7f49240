"""Normal displacement of the second body of a contact line from forces on equal cells, by FFT
(docs/theory/two_bodies.md).
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ..contact_solvers.fft_compliance import wavenumbers
from ..model.material import Cosserat
from ..model.types import Array
from .averages import averaged
from .kernels import normal_symbol


class SecondHalfPlane:
    """Gaps of all corners from their forces on equal cells, by way of the second body: that of corner a gets
    U2 exp(-i k (s_a - s_b)) from the force of corner b.

    Attributes
    ----------
    length : cells of the period
    spectra : array (corners, corners, length//2 + 1), of gap a from force b
    smooth, phase : arrays, U2 and k times half the way between the corners, of the preconditioner
    """

    def __init__(
        self, solid: Cosserat, shifts: Sequence[float], width: float, count: int, periodic: bool
    ) -> None:
        self.length = count if periodic else next_fast_len(2 * count, real=True)
        (k_signed,), k = wavenumbers(count if periodic else next_fast_len(count, real=True), width, 1)
        self.smooth = normal_symbol(solid, k) / width
        self.phase = k_signed * np.ptp(shifts) / 2
        ways = np.subtract.outer(shifts, shifts)[..., None]
        if periodic:
            self.spectra = np.where(k_signed == 0, 0.0, self.smooth) * np.exp(-1j * k_signed * ways)
            if count % 2 == 0:
                self.spectra[..., -1] = self.spectra[..., -1].real
        else:
            cells = np.fft.fftfreq(self.length, 1 / self.length)
            inside = np.abs(cells) < count
            (kernels,) = averaged(solid, np.where(inside, cells, 0.0) * width - ways, width, width, (0,))
            self.spectra = rfft(np.where(inside, kernels, 0.0))

    def __matmul__(self, forces: Array) -> Array:
        """Returns the gaps from forces, arrays (corners, n)."""
        waves = np.einsum("abk,bk->ak", self.spectra, rfft(forces, self.length))
        return np.asarray(irfft(waves, self.length)[:, : forces.shape[1]], float)

    def added(self, R: Array, displaced: float) -> Array:
        """Returns R of a body with corners, plus this one's."""
        corners = np.array((np.cos(self.phase), np.sin(self.phase)))
        return R + self.smooth * corners[:, None] * corners
