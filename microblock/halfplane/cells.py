"""The half-plane on n equal cells, matrix-free: corner forces to corner gaps by FFT.

The `Flexibility` of `microblock.corners.on_cells` has u = U p + i V m, phi = -i V p + W m, with U, V, W of
cells in a circulant of twice the length, or with the symbol on a period. The inverse symbol preconditions.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.fft import next_fast_len

from ..corners.convolution import Waves, convolution, embedded, free_period
from ..corners.on_cells import Flexibility
from ..corners.rounding import PATHS
from ..errors import BadArgument
from .counter_cells import CounterCells
from .kernels import ODD, HalfPlane, symbol


@dataclass(frozen=True)
class CellGrid:
    """n equal cells on [left, right] of the surface, or on one of its periods."""

    body: HalfPlane
    left: float
    right: float
    count: int

    @property
    def width(self):
        return (self.right - self.left) / self.count

    @cached_property
    def x(self):
        return self.left + self.width * (np.arange(self.count) + 0.5)

    @property
    def periodic(self):
        return self.body.period is not None

    def flexibility(self, law, counter=None):
        """The `Flexibility` of a law's corners, with a second body of the solid `counter`."""
        offsets = np.array([[-2 * shift] for shift in law.shifts(1.0)])
        one, clamping = len(offsets) == 1, law.clamps_rotation
        tilt = np.empty((0, self.count)) if one else _tilt(law, offsets, self.x)[None]
        length = self.count if self.periodic else free_period(self.count)
        near = self.count if self.periodic else next_fast_len(self.count, real=True)
        other = None
        if counter is not None:
            shifts = law.shifts(self.body.solid.ell)
            other = CounterCells.on(counter, shifts, self.width, self.count, (length, near), self.periodic)
        spectrum = self._spectrum(length, one, clamping)
        response = convolution(spectrum[: 1 if one else 3], length, not self.periodic)
        aside = Waves((length,), [[spectrum[1]]], even=(0, 1)) if one else None

        @cache
        def back():
            smooth = self._symbol(near)
            if not one:
                inverse = _inverse(*(smooth if other is None else other.added(*smooth)))
            else:
                added = 0.0 if other is None else other.smooth
                inverse = (1 / ((_held(*smooth) if clamping else smooth)[0] + added),)
            return convolution(inverse, near, False)

        return Flexibility(offsets, tilt, response, back, aside, clamping, other)

    def _spectrum(self, length, one, clamping):
        """(U, V, W) of two corners; of one (u, m) where psi = 0, else at least (U, V)."""
        if not self.periodic:
            return self._embedded(length, ((3, 4) if clamping else (0, 1)) if one else (0, 1, 2))
        U, V, W = self._symbol(length)
        U[0] = 0
        return _held(U, V, W) if clamping else (U, V, W)

    def _symbol(self, length):
        """U, V, W on a period of `length` cells, positive definite."""
        k = 2 * np.pi * np.arange(length // 2 + 1) / (length * self.width)
        k[0] = k[1] / 2  # stands for the mean
        U, V, W = symbol(self.body.solid, k)
        V[0] = 0
        if self.periodic:  # an even moment rotates all blocks alike, however long the layer is
            W[0] = _turning_at_rest(self.body.solid)
        if length % 2 == 0:
            V[-1] = 0  # odd: not seen at the shortest wave
        return U / self.width, V / self.width, W / self.width

    def _embedded(self, length, which):
        c, ell = (1 - self.body.solid.nu) / self.body.solid.mu, self.body.solid.ell
        kernels = self.body.cells(self.count, self.width, which)
        # kernel 4 is -m, over 1/ell instead of c, from a unit force
        scales = [-self.width / (c * ell) if number == 4 else 1.0 for number in which]
        pairs = zip(which, kernels, scales)
        return tuple(embedded(scale * kernel, length, number in ODD) for number, kernel, scale in pairs)


def _held(U, V, W):
    return U - V**2 / W, -V / W


def _turning_at_rest(solid):
    return (1 - solid.nu) / solid.mu * solid.layer_length / (4 * solid.curvature * (1 - solid.nu))


def _inverse(U, V, W):
    determinant = U * W - V**2
    return W / determinant, -V / determinant, U / determinant


def _tilt(law, offsets, x):
    """t at x, array (n,)."""
    tilts = np.array(list(law.levers(x).values())) + offsets
    if np.ptp(tilts, axis=0).max() > PATHS:
        words = "must have levers that differ as 2 shifts / ell do on Cells(): Panels() take others"
        raise BadArgument("law", law, words)
    return tilts[0]
