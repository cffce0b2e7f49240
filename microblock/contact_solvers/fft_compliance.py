"""Corner forces to corner gaps on equal cells of a half-plane or of a half-space, matrix-free.

With the normal displacement u, rotations phi times ell/2, corners at s and tilts t over ell/2 of the blocks,

    p = sum f_c,   m = sum (t - s_c) f_c,      gap_c = u + (t - s_c).phi

is the flexibility H of (a) in `microblock.contact_solvers.active_set`. Four corners of a block have
three degrees of freedom: without a second body H has a null space.

In Fourier space (u, phi) = D R D^H (p, m) with D = diag(1, -i, ...) and R real and symmetric. With the
direction e of a wave R is [[U, V e], [V e, W_par + (W - W_par) e e]], where W_par turns about axes along e.
Without images R is that of cells in a period of twice the length.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.fft import next_fast_len
from scipy.ndimage import map_coordinates

from .convolution import FourierOperator, circulant_spectrum
from .rounding import EPS_PIVOT

TWIST_MODE = np.array(
    (1.0, -1.0, -1.0, 1.0)
)  # forces on four corners that have neither a resultant nor a moment


@dataclass(frozen=True)
class Grid:
    """Equal cells, as many along each axis: number, width and middle."""

    count: int
    width: float
    middle: tuple[float, ...] = (0.0, 0.0)

    @cached_property
    def axes(self):
        """Centres along each axis, arrays (count,)."""
        x = self.width * (np.arange(self.count) - (self.count - 1) / 2)
        return tuple(middle + x for middle in self.middle)

    @property
    def places(self):
        """Coordinates of all centres, arrays (count, ...)."""
        return np.meshgrid(*self.axes, indexing="ij")

    @property
    def side(self):
        """Of all cells together (length)."""
        return self.count * self.width

    @property
    def area(self):
        """Of a cell (length or length^2)."""
        return float(self.width ** len(self.middle))

    @property
    def grids(self):
        return (self,)

    def near(self, grid, *x):
        """Returns places, which have no images, array (d, ...)."""
        return np.array(x)

    def of(self, count):
        """Returns the same square of so many cells a side."""
        return replace(self, count=count, width=self.side / count)

    def beyond(self, *x):
        """Returns how far places are outside (length, the largest along an axis)."""
        apart = [np.abs(along - middle) for along, middle in zip(x, self.middle)]
        return np.asarray(np.max(apart, axis=0) - self.side / 2)

    def steps(self, *x):
        """Returns places in cells from the first one on, array (d, ...)."""
        apart = [one - own[0] for one, own in zip(x, self.axes)]
        return np.array(np.broadcast_arrays(*apart)) / self.width

    def nearest(self, *x):
        """Returns the numbers of the nearest cells, array (d, ...) of int."""
        return np.clip(np.rint(self.steps(*x)).astype(int), 0, self.count - 1)

    def interpolated(self, values, periodic, *x):
        """Returns values on cells, array (n, ...), between their centres; 0 outside."""
        places, n = self.steps(*x), self.count
        found = map_coordinates(values, places, order=1, mode="grid-wrap" if periodic else "nearest")
        return np.where(periodic | np.all(np.abs(places - (n - 1) / 2) <= n / 2, axis=0), found, 0.0)


class Flexibility:
    """H on cells as a product, and a preconditioner for it.

    Parameters
    ----------
    offsets : array (corners, d), signs s; 0 of one corner. d is 1 on a half-plane, 2 on a half-space
    tilt : array (d, ...), t at the cells; (0, ...) for one corner
    clamped : whether psi = 0 on the whole surface
    width : float, of a cell
    rest : float or None, W on a period for k -> 0; None without images
    symbol : function of wavenumbers k, array (n,), that returns U, V, W and W_par, or U, V, W
    cells : function that returns averages of the response over cells 0, 1, ... cells away, arrays
        (count, ...), the upper triangle of R, or where psi = 0 its first column
    counter : second body or None, added to the gaps by ``@`` and known to `back`

    Attributes
    ----------
    response : function of arrays (1 + d, ...), from (p, m) to (u, phi); of one corner from p to u
    back : function that returns an approximate inverse of `response`
    aside : function, of one corner from p to phi, or to the m of psi = 0; else None
    short : array (1 + d,), or (2 + d,) with a counter
        Of four corners, displacement, twist of the second body, and rotations under short waves.
    """

    def __init__(self, offsets, tilt, clamped, width, rest, symbol, cells, counter):
        self.offsets, self.tilt, self.clamped, self.counter = offsets, tilt, clamped, counter
        count, d, one, periodic = tilt.shape[-1], tilt.ndim - 1, len(offsets) == 1, rest is not None
        near = count if periodic else next_fast_len(count, real=True)
        length = near if periodic else 2 * near
        turns = range(1, 1 + d)
        if periodic:
            whole = smooth(symbol, length, width, d, rest)
            whole[0, 0][(0,) * d] = 0
            whole = exchanged(whole, turns) if clamped else whole
        else:
            parts, odd = iter(cells()), [[row == axis for axis in turns] for row in range(1 + d)]
            whole = [[None] * (1 + d) for _ in odd]
            for i in range(1 if clamped else 1 + d):
                for j in range(i, 1 + d):
                    whole[i][j] = whole[j][i] = circulant_spectrum(
                        next(parts), length, *np.not_equal(odd[i], odd[j])
                    )
        self.aside = (
            FourierOperator((length,) * d, [row[:1] for row in whole[1:]], even=(0, 1)) if one else None
        )
        self.response = FourierOperator((length,) * d, [whole[0][:1]] if one else whole)
        shortest = np.array([np.pi / width])  # wave of the cells, shorter or longer than the blocks
        displaced, _, rotated = np.ravel(shortest * symbol(shortest)[:3])
        self.short = np.array((1.0, *[rotated / displaced] * d))
        if self.settling_displaces:
            self.short = counter.with_short(self.short, displaced)

        @cache
        def back():
            R = smooth(symbol, near, width, d, rest)
            if one:
                own = (exchanged(R, turns) if clamped else R)[0, 0]
                return FourierOperator(
                    (near,) * d, [[1 / (own if counter is None else own + counter.smooth)]]
                )
            R = R if counter is None else counter.added(R, displaced)
            return FourierOperator((near,) * d, exchanged(R, range(len(R))), (len(R) - d,) * 2)

        self.back = back

    def __matmul__(self, forces):
        """Gaps from forces, arrays (corners, ...)."""
        found = np.tensordot(self._rows, surface := self.surface(forces), 1)
        found += (self.tilt * surface[1:]).sum(axis=0)
        return found if self.counter is None else found + self.counter @ forces

    @cached_property
    def _rows(self):
        """(1, -s) of the corners, array (corners, 1 + d); of one corner (1,)."""
        ones = np.ones((len(self.offsets), 1))
        return ones if len(ones) == 1 else np.hstack((ones, -self.offsets))

    def surface(self, forces):
        """(u, phi), or u of one corner, array (1 + d or 1, ...)."""
        return self.response(self.resultants(forces))

    def resultants(self, forces):
        """(p, m), or p of one corner, array (1 + d or 1, ...)."""
        found = np.tensordot(self._rows.T, forces, 1)
        found[1:] += self.tilt * found[0]
        return found

    def turned(self, forces, surface):
        """phi and m, arrays (d, ...), from forces and their `surface`."""
        if self.aside is None:
            return surface[1:], self.resultants(forces)[1:]
        beside = self.aside(forces)
        both = np.zeros_like(beside), beside
        return both if self.clamped else both[::-1]

    def on_face(self, there):
        """From gaps to forces of least norm on some corners, boolean (corners, ...); of
        fewer than four on all.

        C^-1 acts between B = D E^T (E D E^T)^+ and its transpose, E = (1, -s) of these corners, or with a
        second body (1, a b, -a, -b) for s = (a, b).
        """
        inverse = self.back()
        if len(self.offsets) == 1:
            return inverse
        back = np.linalg.inv(self._rows) if len(there) < len(TWIST_MODE) else self._backs_of(there)

        def precondition(gaps):
            surface = np.einsum("sc...,c...->s...", back, gaps)
            surface[0] -= (self.tilt * surface[-len(self.tilt) :]).sum(axis=0)
            found = inverse(surface)
            found[-len(self.tilt) :] -= self.tilt * found[0]
            return np.einsum("sc...,s...->c...", back, found)

        return precondition

    def _backs_of(self, there):
        return np.take(self._backs, np.tensordot(2 ** np.arange(len(there)), there, 1), axis=2)

    @cached_property
    def _backs(self):
        """B of each set of corners: array (3 or 4, corners, 16)."""
        sets = np.arange(16)[:, None] >> np.arange(4) & 1
        return np.stack([self._back(there) for there in sets], axis=2)

    def _back(self, there):
        rows = self._rows if self.counter is None else np.insert(self._rows, 1, TWIST_MODE, axis=1)
        D, E = np.diag(self.short), rows * there[:, None]
        return D @ E.T @ np.linalg.pinv(E @ D @ E.T)

    @property
    def settling_displaces(self):
        """Whether `settled` displaces a second body."""
        return self.counter is not None and len(self.offsets) == len(TWIST_MODE)

    def settled(self, forces, g0, slope):
        """Forces with the same resultants and the least work on the initial gaps: "--" or "++" of a block is
        open where g0-- - g0-+ - g0+- + g0++ > 0, forces have the least norm where that is 0. On a second body
        the forces 1, -1, -1, 1 take a step down the slope.
        """
        if len(forces) != len(TWIST_MODE):
            return forces
        with np.errstate(invalid="ignore"):
            work = np.tensordot(TWIST_MODE, g0, 1)
        known = np.isfinite(work)
        if self.settling_displaces:
            return twisted(forces, -np.tensordot(TWIST_MODE, slope, 1) / (16 * self.counter.twisted), known)
        size = EPS_PIVOT * np.abs(g0[:, known]).max(initial=0.0)
        down = np.where(np.abs(work) > size, -np.copysign(np.inf, work), of_least_norm(forces))
        return twisted(forces, down, known)


def of_least_norm(forces):
    """The share of NONE that leaves forces of the least norm."""
    return -np.tensordot(TWIST_MODE, forces, 1) / len(TWIST_MODE)


def twisted(forces, share, where):
    """Forces, array (4, ...), plus a share of NONE at some blocks, cut where a force becomes 0."""
    share = np.clip(share, -np.minimum(forces[0], forces[3]), np.minimum(forces[1], forces[2]))
    return np.maximum(forces + np.multiply.outer(TWIST_MODE, np.where(where, share, 0.0)), 0.0)


def wavenumbers(length, width, d):
    """Returns wavenumbers along each axis of a period, and k, array (length, ..., length//2 + 1); at k = 0
    half of the smallest stands for the mean.
    """
    step = 2 * np.pi / (length * width)
    along = [np.fft.fftfreq(length, 1 / length) * step] * (d - 1) + [np.arange(length // 2 + 1) * step]
    ways = np.meshgrid(*along, indexing="ij", sparse=True)
    k = np.sqrt(sum(way**2 for way in ways))
    k[(0,) * d] = step / 2
    return ways, k


def smooth(symbol, length, width, d, rest):
    """R of the symbol on a period, positive definite: array (1 + d, 1 + d, ...)."""
    ways, k = wavenumbers(length, width, d)
    U, V, *W = values = np.reshape(symbol(k.ravel()), (-1, *k.shape)) / width**d
    mean = ..., *(0,) * d
    values[1][mean], values[2:][mean] = 0, values[2:][mean].mean() if rest is None else rest / width**d
    below = np.pi / width * (1 - 0.5 / length)  # of the shortest wave cells see no odd part
    odd = np.array([np.where(np.abs(way) < below, way / k, 0.0) for way in ways])
    apart, R = W[0] - W[-1], np.empty((1 + d, 1 + d, *k.shape))
    R[0, 0], R[0, 1:], R[1:, 0] = U, V * odd, V * odd
    R[1:, 1:] = apart * odd[:, None] * odd
    for axis in range(d):
        R[1 + axis, 1 + axis] = W[-1] + apart * (ways[axis] / k) ** 2
    return R


def exchanged(R, which):
    """The matrices R, array (m, m, ...), with the numbered loads in place of what they displace, by pivots:
    of all numbers the inverse.
    """
    R = np.array(R)
    for j in which:
        pivot, column = R[j, j].copy(), R[:, j].copy()
        row = R[j] / pivot
        R -= column[:, None] * row
        R[j], R[:, j] = -row, column / pivot
        R[j, j] = 1 / pivot
    return R
