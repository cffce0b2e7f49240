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
The inverse symbol of the half-plane that repeats after the cells is the preconditioner.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import next_fast_len, rfft

from ..errors import BadArgument
from .convolution import convolution, free_period, toeplitz_of
from .counter_cells import CounterCells
from .kernels import ODD, HalfPlane, symbol

FEW = 256  # corners whose flexibility is also kept as a matrix: some factorisations are faster up to there


@dataclass(frozen=True)
class Flexibility:
    """H on cells as a product, and a preconditioner for it.

    Attributes
    ----------
    levers : array (corners, n)
    response, back : functions of arrays (2, n), or (1, n) for one corner
        From (p, m) to (u, phi), and, when called, a function that goes approximately back; from p to u alone
        where only the normal displacement counts (one corner). See `microblock.halfplane.convolution`
    aside : function of arrays (1, n), or None
        For one corner what p does besides: phi, or m where psi = 0 is prescribed
    counter : CounterCells or None, what a second body adds to the gaps; `back` knows of it
    """

    levers: np.ndarray
    response: Callable
    back: Callable
    aside: Callable | None
    counter: CounterCells | None = None

    @cached_property
    def inverse(self):
        """What `back` makes, when it is first needed."""
        return self.back()

    @cached_property
    def matrix(self):
        """H of the corners, all of the first one before those of the second, for at most FEW; else None."""
        corners, n = self.levers.shape
        if corners * n > FEW:
            return None
        kernels = [toeplitz_of(one, self.response.length, n) for one in self.response.spectrum]
        if corners == 1:
            matrix = kernels[0]
        else:
            (u, v, w), levers = kernels, self.levers
            matrix = np.block([[u + v * b + a[:, None] * (w * b - v) for b in levers] for a in levers])
        return matrix if self.counter is None else matrix + self.counter.matrix(n)

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
            return self.response(forces)[0], None
        return self.response(np.array((forces.sum(axis=0), (self.levers * forces).sum(axis=0))))

    def precondition(self, gaps):
        """Forces that leave about these gaps: E^-T C^-1 E^-1 for H = E C E^T, E = (1, lever) at each cell."""
        if len(self.levers) == 1:
            return self.inverse(gaps)
        (a, b), (gap_a, gap_b) = self.levers, gaps
        phi = (gap_a - gap_b) / (a - b)
        p, m = self.inverse(np.array((gap_a - a * phi, phi)))
        return np.array((m - b * p, a * p - m)) / (a - b)


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
        levers, clamping = np.array(list(law.levers(self.x).values())), law.clamps_rotation
        length = self.count if self.periodic else free_period(self.count)
        back = self.count if self.periodic else next_fast_len(self.count, real=True)
        other = None
        if counter is not None:
            shifts = law.shifts(self.body.solid.ell)
            other = CounterCells.on(counter, shifts, self.width, self.count, (length, back), self.periodic)
        spectrum = self._spectrum(length, len(levers), clamping)
        response = convolution(spectrum[: 3 if len(levers) == 2 else 1], length, not self.periodic)
        aside = None
        if len(levers) == 1:
            own = spectrum[1] if clamping else -spectrum[1]
            aside = convolution((own,), length, not self.periodic)

        def back_to_forces():
            smooth = self._symbol(back)
            if len(levers) == 2:
                inverse = _inverse(*(smooth if other is None else other.added(*smooth)))
            else:
                added = 0.0 if other is None else other.smooth
                inverse = (1 / ((_clamped(*smooth) if clamping else smooth)[0] + added),)
            return convolution(inverse, back, False)

        return Flexibility(levers, response, back_to_forces, aside, other)

    def _spectrum(self, length, corners, clamping):
        """What the forces of so many corners do: (U, iV, W), or of one corner (u, m) from p where psi = 0 is
        prescribed, else at least (U, iV).
        """
        if not self.periodic:
            return self._embedded(length, {2: (0, 1, 2), 1: (3, 4) if clamping else (0, 1)}[corners])
        U, iV, W = self._symbol(length)
        U[0] = 0
        if corners == 2 and not np.isfinite(W[0]):
            raise BadArgument("beta", self.body.solid.beta, "must be positive: nothing holds the rotation")
        return _clamped(U, iV, W) if clamping else (U, iV, W)

    def _symbol(self, length):
        """U, iV, W at the wavenumbers of a period of `length` cells, positive definite at every one."""
        k = 2 * np.pi * np.arange(length // 2 + 1) / (length * self.width)
        k[0] = k[1] / 2  # stands for the mean
        U, V, W = symbol(self.body.solid, k)
        V[0] = 0
        if self.periodic:  # an even moment rotates all blocks alike, however long the layer is
            W[0] = _turning_at_rest(self.body.solid)
        if length % 2 == 0:
            V[-1] = 0  # odd: not seen at the shortest wave
        return U / self.width, 1j * V / self.width, W / self.width

    def _embedded(self, length, which):
        """Spectra of kernels without images, numbered as in `kernels.Kernels`, in a circulant of the length:
        U, iV, W, and where psi = 0 u and m from p.
        """
        c, ell = (1 - self.body.solid.nu) / self.body.solid.mu, self.body.solid.ell
        kernels = self.body.cells(self.count, self.width, which)
        found = []
        for number, kernel in zip(which, kernels):
            column, odd = np.zeros(length), number in ODD
            column[: self.count] = kernel
            column[: -self.count : -1] = -kernel[1:] if odd else kernel[1:]
            wave = rfft(column, overwrite_x=True)
            # kernel 4 is -m, over 1/ell instead of c, from a unit force
            scale = self.width / (c * ell) if number == 4 else 1.0
            found.append(-1j * scale * wave.imag if odd else wave.real.copy())
        return tuple(found)


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
