"""Convolutions of real fields on equal cells with kernels that are known in Fourier space."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.fft import fft, ifft, irfft, rfft, rfftn

from ..model.types import AnyArray, Array
from ..threads import workers

Spectrum = Sequence[Sequence[AnyArray]]  # rows of a matrix


@dataclass(frozen=True)
class FourierOperator:
    """Real transforms of the whole period, `length` cells along each axis: D R D^H of the fields, D = 1 or
    -i. `spectrum` are rows of R, real arrays (..., length//2 + 1), of which the first `even` rows and columns
    belong to u and p.
    """

    length: tuple[int, ...]
    spectrum: Spectrum
    even: tuple[int, int] = (1, 1)

    def __call__(self, values: Array) -> Array:
        """Returns the fields, array (rows, n, ...), of loads, array (columns, n, ...)."""
        shape = values.shape[1:]
        at_once = workers(values[0].size)
        threads: dict[str, Any] = {"workers": at_once, "overwrite_x": True}
        # then along others: rows beyond the cells are 0
        waves = rfft(values, self.length[-1], workers=at_once)
        for axis, length in enumerate(self.length[:-1], start=1):
            waves = fft(waves, length, axis=axis, **threads)
        even_rows, even_columns = self.even
        waves[even_columns:] *= 1j
        fields = np.empty((len(self.spectrum), *waves.shape[1:]), waves.dtype)
        for field, row in zip(fields, self.spectrum):
            np.multiply(row[0], waves[0], out=field)
            for entry, wave in zip(row[1:], waves[1:]):
                field += entry * wave
        fields[even_rows:] *= -1j
        for axis, count in enumerate(shape[:-1], start=1):
            fields = ifft(fields, axis=axis, **threads)[(slice(None),) * axis + (slice(count),)]
        return np.asarray(irfft(fields, self.length[-1], **threads)[..., : shape[-1]])


@dataclass(frozen=True)
class RoundedOperator:
    """A FourierOperator in single precision, whatever the units: its spectrum over `scale` is at most 1."""

    normalized: FourierOperator
    scale: float

    def __call__(self, values: Array) -> Array:
        largest = float(max(values.max(), -values.min())) or 1.0
        fields = self.normalized((values / largest).astype(np.float32))
        return np.multiply(fields, largest * self.scale, dtype=float)


def rounded(operator: FourierOperator) -> RoundedOperator:
    """Returns an operator in single precision."""
    scale = float(max(np.abs(entry).max() for row in operator.spectrum for entry in row))
    spectrum = [[(entry / scale).astype(np.float32) for entry in row] for row in operator.spectrum]
    return RoundedOperator(replace(operator, spectrum=spectrum), scale)


def circulant_spectrum(responses: Array, length: int, *odd: bool) -> Array:
    """Returns the transform, array (length, ..., length//2 + 1), of responses at distances of (i, ...) cells,
    array (n, ...), odd or even along each axis.
    """
    count = len(responses)
    column = np.zeros((length,) * responses.ndim)
    column[(slice(count),) * responses.ndim] = responses
    for axis, is_odd in enumerate(odd):
        along = np.moveaxis(column, axis, 0)
        along[:-count:-1] = (-1) ** is_odd * along[1:count]
    waves = rfftn(column, overwrite_x=True)
    return np.asarray(-waves.imag if sum(odd) % 2 else waves.real.copy())
