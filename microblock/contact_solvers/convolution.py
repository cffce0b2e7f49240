"""Convolutions of real fields on equal cells with kernels that are known in Fourier space."""

from dataclasses import dataclass

import numpy as np
from scipy.fft import fft, ifft, irfft, rfft, rfftn

from ..threads import workers


@dataclass(frozen=True)
class FourierOperator:
    """Real transforms of the whole period, `length` cells along each axis: D R D^H of the fields, D = 1 or
    -i. `spectrum` are rows of R, real arrays (..., length//2 + 1), of which the first `even` rows and columns
    belong to u and p.
    """

    length: tuple
    spectrum: list
    even: tuple = (1, 1)

    def __call__(self, values):
        shape, threads = values.shape[1:], {"workers": workers(values[0].size), "overwrite_x": True}
        waves = rfft(values, self.length[-1], **threads)  # then along others: rows beyond the cells are 0
        for axis, length in enumerate(self.length[:-1], start=1):
            waves = fft(waves, length, axis=axis, **threads)
        waves[self.even[1] :] *= 1j
        found = np.empty((len(self.spectrum), *waves.shape[1:]), complex)
        for own, row in zip(found, self.spectrum):
            np.multiply(row[0], waves[0], out=own)
            for part, other in zip(row[1:], waves[1:]):
                own += part * other
        found[self.even[0] :] *= -1j
        for axis, count in enumerate(shape[:-1], start=1):
            found = ifft(found, axis=axis, **threads)[(slice(None),) * axis + (slice(count),)]
        return np.asarray(irfft(found, self.length[-1], **threads)[..., : shape[-1]])


def circulant_spectrum(part, length, *odd):
    """Returns the transform of responses at distances of (i, ...) cells, even or odd along each axis."""
    count, column = len(part), np.zeros((length,) * part.ndim)
    column[(slice(count),) * part.ndim] = part
    for axis, sign in enumerate(odd):
        along = np.moveaxis(column, axis, 0)
        along[:-count:-1] = (-1) ** sign * along[1:count]
    waves = rfftn(column, overwrite_x=True)
    return -waves.imag if sum(odd) % 2 else waves.real.copy()
