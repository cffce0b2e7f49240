"""Normal displacement of the second body of a contact line from pressures under the corners, also by FFT on
equal cells (docs/theory/two_bodies.md).
"""

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ..contact_solvers.fft_compliance import wavenumbers
from .averages import averaged
from .kernels import normal_symbol, on_the_line


def counter_kernel(problem, distance, target, source):
    """Displacement of the second body under a unit force (length/force)."""
    return on_the_line(problem.counter, distance, (0,))[0]


def counter_flexibility(problem, x, widths):
    """Gaps of all corners from pressures of cells by way of the second body: array (corners n, corners n)."""
    places = np.concatenate([x - shift for shift in problem.shifts])
    widths = np.tile(np.broadcast_to(widths, x.shape), len(problem.shifts))
    return averaged(problem.counter, places[:, None] - places, widths, widths[:, None], (0,))[0]


class CounterCells:
    """Gaps of all corners from their forces on equal cells, by way of the second body: that of corner a gets
    U2 exp(-i k (s_a - s_b)) from the force of corner b.

    Attributes
    ----------
    length : cells of the period
    spectra : array (corners, corners, length//2 + 1), of gap a from force b
    smooth, phase : arrays, U2 and k times half the way between the corners, of the preconditioner
    """

    def __init__(self, solid, shifts, width, count, periodic):
        self.length, near = count, count
        if not periodic:
            self.length, near = (next_fast_len(parts * count, real=True) for parts in (2, 1))
        (way,), k = wavenumbers(near, width, 1)
        ways = np.array([[one - other for other in shifts] for one in shifts])
        self.smooth, self.phase = normal_symbol(solid, k) / width, way * np.ptp(shifts) / 2
        if periodic:
            self.spectra = np.where(way == 0, 0.0, self.smooth) * np.exp(-1j * way * ways[..., None])
            if count % 2 == 0:
                self.spectra[..., -1] = self.spectra[..., -1].real
        else:
            cells = np.fft.fftfreq(self.length, 1 / self.length)
            apart = np.where(np.abs(cells) < count, cells, 0.0) * width
            (kernels,) = averaged(solid, apart - ways[..., None], width, width, (0,))
            self.spectra = rfft(np.where(np.abs(cells) < count, kernels, 0.0))

    def __matmul__(self, forces):
        waves = np.einsum("abk,bk->ak", self.spectra, rfft(forces, self.length))
        return irfft(waves, self.length)[:, : forces.shape[1]]

    def added(self, R, displaced):
        """R of a body with corners, plus this one's."""
        corners = np.array((np.cos(self.phase), np.sin(self.phase)))
        return R + self.smooth * corners[:, None] * corners
