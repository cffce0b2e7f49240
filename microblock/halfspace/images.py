"""What loads on a half-space displace far away, also with their images on a period.

With the filter chi(k), 1 of long waves and 0 of short ones, the sum over images is that of the nearest ones,
less their long waves, and of these as a Fourier series: both converge.
"""

from functools import partial

import numpy as np

from ..halfplane.kernels import at_rest
from ..model.material import Cosserat
from ..model.quadrature import in_blocks
from ..model.types import Array
from .kernels import BESSEL_ORDERS, CLAMPED, Radial, along_axes, spectra, surface_kernels

LONGEST_SUMMED = 20.0  # over the period, wavenumber up to which waves are summed
LONG_WAVE_LIMIT = 1e-6  # of the period, distance within which long waves do not change


class PeriodicGreen:
    """Components of the response of a solid at distances, see `kernels.along_axes`.

    Parameters
    ----------
    solid : Cosserat
    clamped : bool
        Whether psi = 0 everywhere.
    period : float or None
    """

    def __init__(self, solid: Cosserat, clamped: bool, period: float | None) -> None:
        rows = CLAMPED if clamped else slice(4)
        self.without_images = partial(surface_kernels(solid), rows=rows)
        self.period = period
        if period is None:
            return

        def long_waves(k: Array) -> Array:
            return np.asarray(spectra(solid, k)[rows] * np.exp(-((k * period / LONGEST_SUMMED) ** 8)))

        self._long_waves = Radial(long_waves, period, BESSEL_ORDERS[rows])
        waves = 2 * np.pi / period * (np.indices((11, 11)).reshape(2, -1) - 5)
        self.waves = waves[:, : waves.shape[1] // 2]  # the others are their opposites
        spectrum = long_waves(np.hypot(*self.waves))
        self.spectrum = (2 + 0j) * along_axes(spectrum, self.waves[0], self.waves[1])
        self.spectrum[1:3] *= -1j  # odd
        mean = (0, 0, 0) if clamped else (0, 0, 0, 1, 0, 1)
        self.mean = np.array(mean)[:, None] * at_rest(solid)  # its integral over a period

    def __call__(self, x: Array, y: Array, images_alone: bool) -> Array:
        """Returns components at distances, array (components, ...), on a period with images, or with these
        alone, at distances within a square.
        """
        if self.period is None:
            return along_axes(self.without_images(np.hypot(x, y)), x, y)
        distances = np.array((np.ravel(x), np.ravel(y)))
        if not images_alone:
            distances -= self.period * np.rint(distances / self.period)
        components = np.zeros((len(self.mean), distances.shape[1])) + self.mean
        for block in in_blocks(distances.shape[1], self.waves.shape[1]):
            phases = self.waves.T @ distances[:, block]
            components[:, block] += self.spectrum.real @ np.cos(phases) - self.spectrum.imag @ np.sin(phases)
        components /= self.period**2
        for image in np.ndindex(3, 3):
            shifted = distances - self.period * (np.array(image)[:, None] - 1)
            r = np.hypot(*shifted)
            values = -self._long_waves(np.maximum(r, LONG_WAVE_LIMIT * self.period))
            if not images_alone or image != (1, 1):
                values += self.without_images(r)
            components += along_axes(values, shifted[0], shifted[1])
        return components.reshape(len(components), *np.shape(x))
