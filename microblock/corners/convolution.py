"""Convolutions of one or two real fields on equal cells with kernels that are known in Fourier space.

Two fields p, m answer with u = U p + i V m, phi = -i V p + W m, U and W even in the wavenumber, V odd, all
real. For long periods `Halves` uses z = p + i m and w = u + i phi,

    w = A z + D conj(z at the opposite wavenumber),     A = (U + W)/2 + V,   D = (U - W)/2.

The odd wavenumbers of a doubled period are those of exp(-i pi t/length) times the field. Rows x columns
values are transformed along columns, multiplied by exp(-2 pi i row column/length), and transformed along rows
(D. H. Bailey, J. Supercomput. 4 (1990) 23).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import fft, ifft, irfft, next_fast_len, rfft, rfftn

from ..model.types import AnyArray as Array
from ..threads import workers

LONG = 2**16  # cells of a doubled period from which `Halves` is faster; of another 4 times as many


def free_period(count: int, d: int) -> int:
    """Returns a good period along d axes for so many cells without images."""
    long = d == 1 and 2 * count >= LONG
    return 2 * next_fast_len(count) if long else next_fast_len(2 * count, real=True)


def convolution(
    rows: Sequence[Sequence[Array]], length: tuple[int, ...], doubled: bool, even: int = 1
) -> Callable[[Array], Array]:
    """Returns the product with `Waves` of as many even rows as columns: a function of fields (m, n, ...), on
    at most half of a doubled period.
    """
    parts, number = 2 if doubled else 1, length[-1]
    few = len(length) > 1 or len(rows) < 2 or number < (LONG if doubled else 4 * LONG)
    if few or number % parts:
        return Waves(length, rows, (even, even))
    return Halves.of((*rows[0], rows[1][1]), number, parts)


@dataclass(frozen=True)
class Waves:
    """Real transforms of the whole period, `length` cells along each axis: D R D^H of the fields, D = 1 or
    -i. `spectrum` are rows of R, real arrays (..., length//2 + 1), of which the first `even` rows and columns
    belong to u and p.
    """

    length: tuple[int, ...]
    spectrum: Sequence[Sequence[Array]]
    even: tuple[int, int] = (1, 1)

    def __call__(self, values: Array) -> Array:
        shape, threads = values.shape[1:], {"workers": workers(values[0].size), "overwrite_x": True}
        waves = rfft(values, self.length[-1], **threads)  # then along others: rows beyond the cells are 0
        for axis, length in enumerate(self.length[:-1], start=1):
            waves = fft(waves, length, axis=axis, **threads)
        found = waves
        if len(waves) > 1 or len(self.spectrum) > 1:
            found = np.empty((len(self.spectrum), *waves.shape[1:]), complex)
        step = max(1, 2**14 // waves[0, 0].size)  # waves that stay in the processor's cache
        for first in range(0, len(waves[0]), step):
            slab = slice(first, first + step)
            wave = waves[:, slab]
            wave[self.even[1] :] *= 1j
            for own, row in zip(found[:, slab], self.spectrum):
                np.multiply(row[0][slab], wave[0], out=own)
                for part, other in zip(row[1:], wave[1:]):
                    own += part[slab] * other
            found[self.even[0] :, slab] *= -1j
        for axis, count in enumerate(shape[:-1], start=1):
            found = ifft(found, axis=axis, **threads)[(slice(None),) * axis + (slice(count),)]
        answer: Array = irfft(found, self.length[-1], **threads)[..., : shape[-1]]
        return answer


def embedded(part: Array, length: int, *odd: bool) -> Array:
    """Returns the transform of responses at distances of (i, ...) cells, even or odd along each axis."""
    count, column = len(part), np.zeros((length,) * part.ndim)
    column[(slice(count),) * part.ndim] = part
    for axis, sign in enumerate(odd):
        along = np.moveaxis(column, axis, 0)
        along[:-count:-1] = (-1) ** sign * along[1:count]
    waves = rfftn(column, overwrite_x=True)
    return -waves.imag if sum(odd) % 2 else waves.real.copy()


@dataclass(frozen=True)
class Halves:
    """Complex transforms of the even wavenumbers and, on a doubled period, of the odd ones."""

    halves: tuple[Half, ...]

    @classmethod
    def of(cls, spectrum: Sequence[Array], length: int, parts: int) -> Halves:
        U, V, W = spectrum
        made = []
        for first in range(parts):
            number = np.arange(first, length, parts)
            place, sign = np.minimum(number, length - number), np.where(2 * number > length, -1.0, 1.0)
            normal, rotation = U[place] / length, W[place] / length
            A = (normal + rotation) / 2 + sign / length * V[place]
            both = (one.reshape(-1, _rows(len(A))).T for one in (A, (normal - rotation) / 2))
            made.append(Half(first, *map(np.ascontiguousarray, both)))
        return cls(tuple(made))

    def __call__(self, values: Array) -> Array:
        (rows, columns), count = self.halves[0].A.shape, values.shape[1]
        # columns at a distance of a power of two evict each other from the cache
        z, flat = np.empty((rows, columns + 8), complex)[:, :columns], np.zeros(rows * columns, complex)
        flat.real[:count], flat.imag[:count] = values
        z[...] = flat.reshape(rows, columns)
        *before, last = self.halves
        found = [half(z.copy()) for half in before]
        w = last(z)  # conjugate
        for one in found:
            w += one
        w = w.reshape(-1)[:count]
        return np.array((w.real, -w.imag))


@dataclass(frozen=True)
class Half:
    """The wavenumbers k + shift/2 of a period, at (k % rows, k // rows) of A and D, which are over their
    number.
    """

    shift: int
    A: Array
    D: Array

    def __call__(self, z: Array) -> Array:
        """Conj(w) from z, arrays (rows, columns), which is overwritten."""
        # four short transforms wait for each other: threads take a share of more values than elsewhere
        (rows, columns), threads = z.shape, workers(z.size // 8)
        turn = _turn(rows, columns, self.shift)
        start = np.exp(-1j * np.pi * self.shift * np.arange(rows) / rows)[:, None]
        if self.shift:
            z *= start
        z = fft(z, axis=0, overwrite_x=True, workers=threads)
        self._along_rows(z, turn, threads)
        z = fft(z, axis=0, overwrite_x=True, workers=threads)
        if self.shift:
            z *= start
        return z

    def _along_rows(self, z: Array, turn: Array, threads: int) -> None:
        if not self.shift:
            own = fft(z[0])
            z[0] = fft(self.A[0] * own.conj() + self.D[0] * np.roll(own[::-1], 1))
        A, D, turn, rest = (one[1 - self.shift :] for one in (self.A, self.D, turn, z))
        count, options = len(rest), {"overwrite_x": True, "workers": threads}
        # rows that stay in the cache, or enough to be shared by threads
        step = max(1, (2**14 if threads == 1 else 2**17) // z.shape[1])
        for first in range(0, (count + 1) // 2, step):
            last = min(first + step, (count + 1) // 2)
            pair = slice(first, last), slice(count - last, count - first)
            waves = [fft(rest[rows] * turn[rows], **options) for rows in pair]
            found = [
                fft(A[rows] * own.conj() + D[rows] * other[::-1, ::-1], **options)
                for rows, own, other in zip(pair, waves, waves[::-1])
            ]
            for rows, own in zip(pair, found):  # a row in the middle is in both, and the same
                np.multiply(own, turn[rows], out=rest[rows])


def _rows(length: int) -> int:
    most = min(256, int(np.sqrt(length)))  # columns are read in long pieces
    return next(rows for rows in range(most, 0, -1) if length % rows == 0)


@lru_cache(maxsize=2)
def _turn(rows: int, columns: int, shift: int) -> Array:
    angle = np.outer(np.arange(rows) + shift / 2, np.arange(columns))
    return np.exp(-2j * np.pi / (rows * columns) * angle)
