"""The half-space on n x n equal cells, matrix-free: corner forces to corner gaps by FFT.

With u the normal displacement into the body, phi and m as in `microblock.halfspace.symbol`, (a, b) the signs
of a corner and t the tilt of the blocks (`microblock.halfspace.surface_law`), p and m the sums of the forces
on a cell and of their levers,

    p = sum f_c,   q = -sum (a, b) f_c,   m = q + t p,      gap_c = u + t.phi - (a, b).phi

is the flexibility H of (a) in `microblock.corners.active_set`; t may differ from cell to cell. Four corners
act in three degrees of freedom: H has a null space, forces up and down in turn. A second body
(`microblock.halfspace.counter`) adds to the gaps, and leaves none.

In Fourier space (u, phi) = C (p, m) with C = D R D^H, D = diag(1, -i, -i) and R real and symmetric. Of R six
arrays are kept, and of its inverse, which is the preconditioner; where there are no images, R is that of the
cells' responses in a doubled period.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.fft import fft, ifft, irfft, next_fast_len, rfft, rfft2

from ..model.material import Cosserat
from ..model.types import AnyArray as Array
from ..threads import workers
from .kernels import kernels
from .surface_law import NONE
from .symbol import at_rest, symbol

if TYPE_CHECKING:
    from .counter import Counter

SAME = 1e-12  # of the initial gaps: less than that is rounding of them
SLAB = 32  # rows of wavenumbers that are multiplied at once
Six: TypeAlias = Sequence[Array]  # u, v1, v2 and the components 11, 12, 22 of the tensor


@dataclass(frozen=True)
class Waves:
    """Responses in Fourier space to fields on cells.

    Attributes
    ----------
    length : (int, int)
        Cells of the transforms.
    spectrum : rows of arrays (length, length//2 + 1)
        R, or a part of it.
    even : (int, int)
        Number of its first rows, and columns, that belong to p and u: the others turn by -i and i.
    """

    length: tuple[int, int]
    spectrum: Sequence[Sequence[Array]]
    even: tuple[int, int] = (1, 1)

    def __call__(self, values: Array) -> Array:
        """Returns the responses to fields on cells, arrays (k, n1, n2)."""
        n1, n2 = values.shape[-2:]
        threads = {"workers": workers(values[0].size), "overwrite_x": True}
        waves = rfft(values, self.length[1], **threads)  # then along x1: rows beyond the cells are 0
        waves = fft(waves, self.length[0], axis=-2, **threads)
        found = np.empty((len(self.spectrum), *waves.shape[1:]), complex)
        for first in range(0, len(waves[0]), SLAB):  # which stays in the processor's cache
            slab = slice(first, first + SLAB)
            wave = waves[:, slab]
            wave[self.even[1] :] *= 1j
            for own, row in zip(found[:, slab], self.spectrum):
                np.multiply(row[0][slab], wave[0], out=own)
                for part, other in zip(row[1:], wave[1:]):
                    own += part[slab] * other
            found[self.even[0] :, slab] *= -1j
        found = ifft(found, axis=-2, **threads)[:, :n1]
        answer: Array = irfft(found, self.length[1], **threads)[..., :n2]
        return answer


@dataclass(frozen=True)
class Flexibility:
    """H on cells as a product, and a preconditioner for it.

    Attributes
    ----------
    offsets : array (corners, 2)
        Signs (a, b); 0 for one corner.
    response, inverse : Waves
        Of (u, phi1, phi2), or of u alone for one corner.
    aside : Waves or None
        Of one corner: from p to phi, or to the m that holds psi = 0.
    tilt : array (2, n1, n2)
        t; without components (0, n1, n2) for one corner.
    short : array (3,), or (4,) with a counter
        Displacement, rotations and, second, what the second body twists, under short waves.
    counter : Counter or None
        What a second body adds; `inverse` knows of it.
    """

    offsets: Array
    response: Waves
    inverse: Waves
    aside: Waves | None
    tilt: Array
    short: Array
    counter: Counter | None = None

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps from forces, arrays (corners, n1, n2)."""
        found = self.gaps(self.surface(forces))
        return found if self.counter is None else found + self.counter @ forces

    def surface(self, forces: Array) -> Array:
        """Returns (u, phi1, phi2), or u alone, from forces: array (3 or 1, n1, n2)."""
        return self.response(self.resultants(forces))

    def resultants(self, forces: Array) -> Array:
        """Returns (p, m1, m2), or p alone, from forces: array (3 or 1, n1, n2)."""
        found: Array = np.tensordot(self._rows.T, forces, 1)
        found[1:] += self.tilt * found[0]
        return found

    def beside(self, forces: Array) -> Array:
        """Returns for one corner what p does besides, array (2, n1, n2): phi, or m where psi = 0."""
        assert self.aside is not None
        return self.aside(forces)

    def gaps(self, surface: Array) -> Array:
        """Returns what u and phi add to the gap of each corner."""
        found: Array = np.tensordot(self._rows, surface, 1)
        return found + (self.tilt * surface[1:]).sum(axis=0)

    def precondition(self, gaps: Array) -> Array:
        """Returns forces of least norm that leave about these gaps."""
        return self.on_face(np.ones(gaps.shape, bool))(gaps)

    def on_face(self, there: Array) -> Callable[[Array], Array]:
        """Returns the preconditioner of the corners that are there, boolean (corners, n1, n2), alone.

        Of E = (1, -a, -b) with the rows of the corners that a block has there, C^-1 acts between
        B = D E^T (E D E^T)^+ and its transpose: with all of them it is the inverse, with some of them it is
        so for short waves, where C is like D. With a second body E = (1, a b, -a, -b).
        """
        if len(self.offsets) == 1:
            return self.inverse
        kinds = np.tensordot(2 ** np.arange(len(there)), there, 1)
        back = np.take(self._backs, kinds, axis=2)  # (3 or 4, corners, n1, n2), the cells side by side

        def precondition(gaps: Array) -> Array:
            surface = np.einsum("scij,cij->sij", back, gaps)
            surface[0] -= (self.tilt * surface[-2:]).sum(axis=0)
            found = self.inverse(surface)
            found[-2:] -= self.tilt * found[0]
            return np.einsum("scij,sij->cij", back, found)

        return precondition

    @cached_property
    def _backs(self) -> Array:
        """B of each set of corners, by the sum of their powers of two: array (3 or 4, corners, 16)."""
        sets = np.arange(16)[:, None] >> np.arange(4) & 1
        return np.stack([self._back(there) for there in sets], axis=2)

    def _back(self, there: Array) -> Array:
        rows = self._rows if self.counter is None else np.insert(self._rows, 1, NONE, axis=1)
        D, E = np.diag(self.short), rows * there[:, None]
        return D @ E.T @ np.linalg.pinv(E @ D @ E.T)

    @property
    def settling_displaces(self) -> bool:
        """Whether what `settled` changes is felt, by a second body."""
        return self.counter is not None and len(self.offsets) > 1

    def settled(self, forces: Array, g0: Array, slope: Array | None = None) -> Array:
        """Returns forces with the same resultants and the least work on the initial gaps.

        The forces 1, -1, -1, 1 of a block do nothing but that work. It is g0-- - g0-+ - g0+- + g0++ for each,
        which no displacement changes: where it is positive, "--" or "++" is open; where it is 0 all four may
        be closed, and the forces of least norm are taken. On a second body they do something, and g0 is the
        slope then: they take a step down it, which lowers the energy whatever other blocks do.
        """
        if len(forces) != len(NONE):
            return forces
        with np.errstate(invalid="ignore"):
            work = np.tensordot(NONE, g0, 1)
        known = np.isfinite(work)
        size = SAME * np.abs(g0[:, known]).max(initial=0.0)
        least = -np.minimum(forces[0], forces[3]), np.minimum(forces[1], forces[2])
        if self.counter is not None and slope is not None:
            share = np.clip(-np.tensordot(NONE, slope, 1) / (16 * self.counter.twisted), *least)
            return np.maximum(forces + np.where(known, share, 0.0) * NONE[:, None, None], 0.0)
        share = np.clip(-np.tensordot(NONE, forces, 1) / len(NONE), *least)
        share = np.where(work > size, least[0], np.where(work < -size, least[1], share))
        return np.maximum(forces + np.where(known, share, 0.0) * NONE[:, None, None], 0.0)

    @property
    def _rows(self) -> Array:
        """(1, -a, -b) of each corner, array (corners, 3); of one corner (1,)."""
        ones = np.ones((len(self.offsets), 1))
        return ones if len(ones) == 1 else np.hstack((ones, -self.offsets))


def flexibility(
    solid: Cosserat,
    offsets: Array,
    tilt: Array,
    width: float,
    periodic: bool,
    clamped: bool,
    counter: Counter | None = None,
) -> Flexibility:
    """Returns the Flexibility of corners on cells of this width (length), as many as there are tilts."""
    count = tilt.shape[-1]
    length, near = (count if periodic else next_fast_len(parts * count, real=True) for parts in (2, 1))
    size, back = (length, length), (near, near)
    if periodic:
        whole = _smooth(solid, length, width)
        for part, rest in zip(whole, (0.0, 0.0, 0.0, at_rest(solid), 0.0, at_rest(solid))):
            part[0, 0] = rest / width**2
        whole = _held(whole) if clamped else whole
    else:
        whole = _embedded(solid, count, length, width, clamped)
    shortest = np.array([np.pi / width])  # wave of the cells, shorter or longer than the blocks
    displaced, _, rotated, _ = np.ravel(shortest * symbol(solid, shortest))
    short = np.array((1.0, rotated / displaced, rotated / displaced))
    if len(offsets) == 1:
        smooth = _smooth(solid, near, width)
        smooth = _held(smooth) if clamped else smooth
        own = smooth[0] if counter is None else smooth[0] + counter.smooth(near, width)
        aside = Waves(size, [[one] for one in whole[1:3]], even=(0, 1))
        response, inverse = Waves(size, [whole[:1]]), Waves(back, [[1 / own]])
        return Flexibility(offsets, response, inverse, aside, tilt, short, counter)
    response, rows = Waves(size, _symmetric(whole)), _symmetric(_smooth(solid, near, width, True))
    if counter is None:
        return Flexibility(offsets, response, Waves(back, rows), None, tilt, short)
    inverse = Waves(back, counter.with_inverse(rows, near, width, displaced), even=(2, 2))
    short = counter.with_short(short, displaced, near, width)
    return Flexibility(offsets, response, inverse, None, tilt, short, counter)


def _symmetric(six: Six) -> list[list[Array]]:
    """Returns the rows of R."""
    u, v1, v2, w11, w12, w22 = six
    return [[u, v1, v2], [v1, w11, w12], [v2, w12, w22]]


def wavenumbers(length: int, width: float) -> tuple[Array, Array, Array]:
    """Returns k1, array (length, 1), k2, array (1, length//2 + 1), and k of a period of so many cells; at k =
    0 half of the smallest, which stands for the mean.
    """
    step = 2 * np.pi / (length * width)
    k1 = (np.fft.fftfreq(length) * length * step)[:, None]
    k2 = (np.arange(length // 2 + 1) * step)[None, :]
    k = np.hypot(k1, k2)
    k[0, 0] = step / 2
    return k1, k2, k


def _smooth(solid: Cosserat, length: int, width: float, inverse: bool = False) -> list[Array]:
    """Returns R of the symbol, or its inverse, at the wavenumbers of a period, positive definite at each."""
    k1, k2, k = wavenumbers(length, width)
    U, V, W, other = np.array(symbol(solid, k)) / width**2
    V[0, 0], W[0, 0] = 0, (W[0, 0] + other[0, 0]) / 2
    other[0, 0] = W[0, 0]
    if inverse:
        U, V, W, other = np.array((W, -V, U, (U * W - V**2) / other)) / (U * W - V**2)
    c, s = k1 / k, k2 / k
    odd1, odd2 = c * np.ones_like(k), s * np.ones_like(k)
    if length % 2 == 0:  # of the shortest wave cells see no odd part
        odd1[length // 2] = 0
        odd2[:, -1] = 0
    apart = W - other
    return [U, V * odd1, V * odd2, other + apart * c**2, apart * odd1 * odd2, other + apart * s**2]


def _embedded(solid: Cosserat, count: int, length: int, width: float, clamped: bool) -> list[Array]:
    """Returns R of the cells' responses without images in a period of the length; the three of `_held` where
    psi = 0.
    """
    table = kernels(solid.nu, solid.beta, solid.curvature, solid.alpha_prime, solid.beta_prime)
    found = []
    for number, quarter in enumerate(table.cells(count, width / solid.ell, clamped)):
        moment = clamped and number > 0
        quarter *= (width / solid.ell) ** 2 if moment else (1 - solid.nu) / solid.mu / solid.ell
        odd1, odd2 = number in (1, 4), number in (2, 4)  # along x1: v1 and the component 12; along x2
        found.append(embedded(quarter, length, odd1, odd2))
    return found


def embedded(quarter: Array, length: int, odd1: bool = False, odd2: bool = False) -> Array:
    """Returns the transform of responses at distances of (i, j) cells, array (count, count), even or odd
    along either axis, in a period of the length: its real part, or less its imaginary one where that is all.
    """
    count = len(quarter)
    column = np.zeros((length, length))
    column[:count, :count] = quarter
    column[:-count:-1, :count] = (-1) ** odd1 * quarter[1:]
    column[:, :-count:-1] = (-1) ** odd2 * column[:, 1:count]
    waves = rfft2(column)
    found: Array = -waves.imag if odd1 != odd2 else waves.real.copy()
    return found


def _held(six: Six) -> list[Array]:
    """Returns u, m1 and m2 from p where psi = 0, m taking the rotation away."""
    u, v1, v2, w11, w12, w22 = six
    determinant = w11 * w22 - w12**2
    m1, m2 = (w12 * v2 - w22 * v1) / determinant, (w12 * v1 - w11 * v2) / determinant
    return [u + v1 * m1 + v2 * m2, m1, m2]
