"""What loads on a half-space displace far away, also with their images on a period.

With the filter chi(k), 1 of long waves and 0 of short ones, the sum over images is that of the nearest ones,
less their long waves, and of these as a Fourier series: both converge.
"""

import numpy as np

from ..halfplane.kernels import at_rest
from ..model.quadrature import in_blocks
from .kernels import Radial, along_axes, kernels, spectra

LONG = 20.0  # over the period, wavenumber up to which waves are summed
NEAREST = 1e-6  # of the period, distance within which long waves do not change


class PeriodicGreen:
    """Components of the response of a solid at distances, see `kernels.along_axes`.

    Parameters
    ----------
    clamped : bool
        Whether psi = 0 everywhere.
    period : float or None
    """

    def __init__(self, solid, clamped, period):
        self.alone, self.clamped, self.period = kernels(solid), clamped, period
        if period is None:
            return

        def long(k):
            return spectra(solid, k) * np.exp(-((k * period / LONG) ** 8))

        self._long = Radial(long, period)
        ways = 2 * np.pi / period * (np.indices((11, 11)).reshape(2, -1) - 5)
        self.ways = ways[:, : ways.shape[1] // 2]  # the others are their opposites
        self.spectrum = (2 + 0j) * along_axes(long(np.hypot(*self.ways)), self.ways[0], self.ways[1], clamped)
        self.spectrum[1:3] *= -1j  # odd
        mean = (0, 0, 0) if clamped else (0, 0, 0, 1, 0, 1)
        self.mean = np.array(mean)[:, None] * at_rest(solid)  # its integral over a period

    def __call__(self, x, y, itself):
        """Returns components at distances, array (parts, ...), on a period with images; of a square and
        `itself` only these.
        """
        if self.period is None:
            return along_axes(self.alone(np.hypot(x, y)), x, y, self.clamped)
        shape, away = np.shape(x), np.array((np.ravel(x), np.ravel(y)))
        if not itself:
            away -= self.period * np.rint(away / self.period)
        found = np.zeros((len(self.mean), away.shape[1])) + self.mean
        for block in in_blocks(away.shape[1], self.ways.shape[1]):
            phases, spectrum = self.ways.T @ away[:, block], self.spectrum
            found[:, block] += spectrum.real @ np.cos(phases) - spectrum.imag @ np.sin(phases)
        found /= self.period**2
        for image in np.ndindex(3, 3):
            x, y = away - self.period * (np.array(image)[:, None] - 1)
            r = np.hypot(x, y)
            values = -self._long(np.maximum(r, NEAREST * self.period))
            if not itself or image != (1, 1):
                values += self.alone(r)
            found += along_axes(values, x, y, self.clamped)
        return found.reshape(len(found), *shape)
