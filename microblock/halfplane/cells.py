"""The half-plane on n equal cells, matrix-free: corner forces to corner gaps by FFT, O(n log n) a product.

With the normal displacement u = -u2, phi = ell psi/2, and p, m the sums and differences of the forces on a
cell,

    p = sum f_alpha,   m = sum lever_alpha f_alpha,   u = U p + i V m,   phi = -i V p + W m,   gap_alpha = u +
    lever_alpha phi

is the flexibility H of (a) in `microblock.corners.active_set`: U, V, W are convolutions, the levers act cell
by cell.

Without images U, V, W are those of cells of constant pressure, as in `HalfPlane.compliance`, embedded in a
circulant of twice the length or more, which a product with padded forces does not see. On a period they are
the symbol of `microblock.halfplane.kernels` itself at k = 2 pi m/period; the mean level of the surface is 0.
The inverse symbol of the same (on the doubled length: of the periodic) half-plane is the preconditioner.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from .counter_cells import CounterCells
from .kernels import ODD, HalfPlane, symbol


@dataclass(frozen=True)
class Flexibility:
    """H on cells as a product, and a preconditioner for it.

    Attributes
    ----------
    levers : array (corners, n)
    length : int, of the transforms
    spectrum, inverse : tuples (U, iV, W) of arrays (length//2 + 1,), of H (length per force on a cell) and of
        an approximate inverse; U alone where only the normal displacement counts (one corner)
    aside : array (length//2 + 1,), for one corner what p does besides: phi, or m where psi = 0 is prescribed
    counter : CounterCells or None, what a second body adds to the gaps; `inverse` knows of it
    """

    levers: np.ndarray
    length: int
    spectrum: tuple
    inverse: tuple
    aside: np.ndarray
    counter: CounterCells | None = None

    @property
    def shape(self):
        """(corners, n) of forces and gaps."""
        return self.levers.shape

    def __matmul__(self, forces):
        """Gaps from forces, arrays (corners, n)."""
        u, phi = self.surface(forces)
        gaps = u[None] if phi is None else u + self.levers * phi
        return gaps if self.counter is None else gaps + self.counter @ forces

    def surface(self, forces):
        """Sinking u and phi = ell psi/2 from forces; phi is None for one corner, whose law does not see
        it.
        """
        if len(self.levers) == 1:
            return self._transformed(self.spectrum, forces[0]), None
        return self._transformed(
            self.spectrum, np.array((forces.sum(axis=0), (self.levers * forces).sum(axis=0)))
        )

    def besides(self, forces):
        """phi, or where psi = 0 is prescribed m, from the forces of one corner; array (n,)."""
        return self._transformed((self.aside,), forces[0])

    def precondition(self, gaps):
        """Forces that leave about these gaps: E^-T C^-1 E^-1 for H = E C E^T, E = (1, lever) at each cell."""
        if len(self.levers) == 1:
            return self._transformed(self.inverse, gaps[0])[None]
        (a, b), (gap_a, gap_b) = self.levers, gaps
        phi = (gap_a - gap_b) / (a - b)
        p, m = self._transformed(self.inverse, np.array((gap_a - a * phi, phi)))
        return np.array((m - b * p, a * p - m)) / (a - b)

    def _transformed(self, spectrum, values):
        waves = rfft(values, self.length)
        if len(spectrum) == 1:
            waves *= spectrum[0]
        else:
            U, iV, W = spectrum
            crossed = iV * waves
            waves[0] *= U
            waves[1] *= W
            waves[0] += crossed[1]
            waves[1] -= crossed[0]
        return irfft(waves, self.length, overwrite_x=True)[..., : values.shape[-1]]


@dataclass(frozen=True)
class CellGrid:
    """n equal cells on [left, right] of the surface of a half-plane, or on one of its periods.

    Parameters
    ----------
    body : HalfPlane
    left, right : float; a period apart for the latter
    count : int
    """

    body: HalfPlane
    left: float
    right: float
    count: int

    @property
    def width(self):
        """Of a cell."""
        return (self.right - self.left) / self.count

    @cached_property
    def x(self):
        """Centres of the cells, array (count,)."""
        return self.left + self.width * (np.arange(self.count) + 0.5)

    @property
    def periodic(self):
        return self.body.period is not None

    def flexibility(self, law, counter=None):
        """The `Flexibility` of a law's corners, with a second body of the solid `counter`."""
        levers = np.array(list(law.levers(self.x).values()))
        length = self.count if self.periodic else next_fast_len(2 * self.count, real=True)
        smooth = self._symbol(length)
        U, iV, W = smooth
        other = None
        if counter is not None:
            shifts = law.shifts(self.body.solid.ell)
            other = CounterCells.on(counter, shifts, self.width, self.count, length, self.periodic)
        clamping = law.clamps_rotation
        if self.periodic:
            mean = np.arange(len(U)) == 0
            spectrum = (
                np.where(mean, 0, U),
                iV,
                np.where(mean, _turning_at_rest(self.body.solid) / self.width, W),
            )
            if clamping:
                spectrum = _clamped(*spectrum)
        else:
            which = {2: (0, 1, 2), 1: (3, 4) if clamping else (0, 1)}[len(levers)]
            spectrum = self._embedded(length, which)
        if len(levers) == 2:
            both = smooth if other is None else other.added(*smooth)
            return Flexibility(levers, length, tuple(spectrum), _inverse(*both), None, other)
        besides = 0.0 if other is None else other.smooth
        normal = _clamped(*smooth)[0] if clamping else U
        aside = spectrum[1] if clamping else -spectrum[1]
        return Flexibility(levers, length, (spectrum[0],), (1 / (normal + besides),), aside, other)

    def _symbol(self, length):
        """U, iV, W at the wavenumbers of a period of `length` cells, positive definite at every one."""
        k = 2 * np.pi * np.arange(length // 2 + 1) / (length * self.width)
        k[0] = k[1] / 2  # stands for the mean
        U, V, W = symbol(self.body.solid, k)
        V[0] = 0
        if length % 2 == 0:
            V[-1] = 0  # odd: not seen at the shortest wave
        return U / self.width, 1j * V / self.width, W / self.width

    def _embedded(self, length, which):
        """Spectra of kernels without images, numbered as in `kernels.Kernels`, in a circulant of the length:
        U, iV, W, and where psi = 0 u and m from p.
        """
        c, ell = (1 - self.body.solid.nu) / self.body.solid.mu, self.body.solid.ell
        kernels = self.body.cells(self.count, self.width, which)
        column = np.zeros((len(which), length))
        column[:, : self.count] = kernels
        column[:, : -self.count : -1] = kernels[:, 1:]
        odd = [number in ODD for number in which]
        column[odd, : -self.count : -1] *= -1
        # kernel 4 is -m, over 1/ell instead of c, from a unit force
        scales = [self.width / (c * ell) if number == 4 else 1.0 for number in which]
        waves = rfft(column)
        return [
            -1j * scale * wave.imag if turned else wave.real
            for wave, turned, scale in zip(waves, odd, scales)
        ]


def _clamped(U, iV, W):
    """u and m from p where psi = 0: m = i V p/W takes the rotation away."""
    return U - iV.imag**2 / W, iV / W


def _turning_at_rest(solid):
    """W at k = 0."""
    return (1 - solid.nu) / solid.mu * solid.layer_length / (4 * solid.curvature * (1 - solid.nu))


def _inverse(U, iV, W):
    """(u, phi) to (p, m): the inverse of [[U, iV], [-iV, W]]."""
    determinant = U * W - iV.imag**2
    return W / determinant, -iV / determinant, U / determinant
