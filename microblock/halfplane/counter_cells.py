"""A second body on equal cells: its displacement under the corners, by FFT (docs/theory/two_bodies.md).

The gap of corner a gets U2 exp(-i k (s_a - s_b)) from the force of corner b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, rfft

from .averages import normal_averages
from .kernels import normal_symbol


@dataclass(frozen=True)
class CounterCells:
    """Gaps of all corners from their forces on cells, by way of the second body.

    Attributes
    ----------
    length, back : cells of the period of products and of a preconditioner
    spectra : array (corners, corners, length//2 + 1), of gap a from force b
    smooth, phase : arrays (back//2 + 1,), U2 and k times the way between the corners
    """

    length: int
    back: int
    spectra: np.ndarray
    smooth: np.ndarray
    phase: np.ndarray

    @classmethod
    def on(cls, solid, shifts, width, count, lengths, periodic):
        """Of a solid, on cells of a width; `lengths` are `length` and `back`."""
        length, back = lengths
        k = 2 * np.pi * np.arange(back // 2 + 1) / (back * width)
        ways = np.array([[one - other for other in shifts] for one in shifts])
        smooth = normal_symbol(solid, np.concatenate((k[1:2] / 2, k[1:]))) / width
        if periodic:
            spectra = np.where(k == 0, 0.0, smooth) * np.exp(-1j * k * ways[..., None])
            if length % 2 == 0:
                spectra[..., -1] = spectra[..., -1].real
        else:
            cells = np.fft.fftfreq(length, 1 / length)
            apart = np.where(np.abs(cells) < count, cells, 0.0) * width
            kernels = normal_averages(solid, apart - ways[..., None], width, width)
            spectra = rfft(np.where(np.abs(cells) < count, kernels, 0.0))
        return cls(length, back, spectra, smooth, k * np.ptp(shifts))

    def __matmul__(self, forces):
        waves = np.einsum("abk,bk->ak", self.spectra, rfft(forces, self.length))
        return irfft(waves, self.length)[:, : forces.shape[1]]

    def added(self, U, V, W):
        """The symbol of a body with corners, plus this one's."""
        cosine, sine = np.cos(self.phase), np.sin(self.phase)
        sine[-1:] *= self.back % 2  # odd: not seen at the shortest wave
        half = self.smooth / 2
        return U + half * (1 + cosine), V + half * sine, W + half * (1 - cosine)
