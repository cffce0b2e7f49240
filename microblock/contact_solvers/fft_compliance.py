"""FFT compliance from corner forces to gaps on a uniform grid, of a half-plane or of a half-space.

With the normal displacement u, rotations phi times ell/2, corners at s and tilts t over ell/2 of the blocks,

    p = sum f_c,   m = sum (t - s_c) f_c,      gap_c = u + (t - s_c).phi

is the flexibility H of (a) in `microblock.contact_solvers.active_set`. Four corners of a block have
three degrees of freedom: without a second body H has a null space.

In Fourier space (u, phi) = D R D^H (p, m) with D = diag(1, -i, ...) and R real and symmetric. With the
direction e of a wave R is [[U, V e], [V e, W_par + (W - W_par) e e]], where W_par turns about axes along e.
Without images R is that of cells in a period of twice the length.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import next_fast_len
from scipy.ndimage import label, map_coordinates

from ..model.quadrature import form_grid
from ..model.types import Array, Flags, Integers
from .convolution import FourierOperator, circulant_spectrum, rounded
from .projected_gradients import MatrixFree
from .rounding import EPS_PIVOT

Operator = Callable[[Array], Array]

# forces on four corners that have neither a resultant nor a moment
TWIST_MODE = np.array((1.0, -1.0, -1.0, 1.0))


@dataclass(frozen=True)
class Grid:
    """Equal cells, as many along each of d axes: number, width and middle."""

    count: int
    width: float
    middle: tuple[float, ...] = (0.0, 0.0)

    def part(self, first: Integers, count: int) -> "Grid":
        """Returns so many cells along each axis from the first ones on, array (d,)."""
        middle = [axis[i] + (count - 1) / 2 * self.width for axis, i in zip(self.axes, first)]
        return replace(self, count=count, middle=tuple(map(float, middle)))

    @cached_property
    def axes(self) -> tuple[Array, ...]:
        """Centres along each axis, arrays (count,)."""
        x = self.width * np.asarray(np.arange(self.count) - (self.count - 1) / 2, float)
        return tuple(middle + x for middle in self.middle)

    @property
    def places(self) -> tuple[Array, ...]:
        """Coordinates of all centres, arrays (count, ...)."""
        return tuple(np.meshgrid(*self.axes, indexing="ij"))

    @property
    def side(self) -> float:
        """Of all cells together (length)."""
        return self.count * self.width

    @property
    def area(self) -> float:
        """Of a cell (length or length^2)."""
        return float(self.width ** len(self.middle))

    @property
    def grids(self) -> tuple["Grid", ...]:
        return (self,)

    def nearest_images(self, grid: "Grid", *x: Array | float) -> Array:
        """Returns places, which have no images, array (d, ...)."""
        return np.array(x)

    def with_count(self, count: int) -> "Grid":
        """Returns the same square of so many cells a side."""
        return replace(self, count=count, width=self.side / count)

    def distance_outside(self, *x: Array | float) -> Array:
        """Returns how far places are outside (length, the largest along an axis)."""
        offsets = [np.abs(along - middle) for along, middle in zip(x, self.middle)]
        return np.asarray(np.max(offsets, axis=0) - self.side / 2)

    def cell_coordinates(self, *x: Array | float) -> Array:
        """Returns places in cells from the first one on, array (d, ...)."""
        offsets = [along - axis[0] for along, axis in zip(x, self.axes)]
        return np.array(np.broadcast_arrays(*offsets)) / self.width

    def nearest(self, *x: Array | float) -> Integers:
        """Returns the numbers of the nearest cells, array (d, ...)."""
        return np.clip(np.rint(self.cell_coordinates(*x)).astype(int), 0, self.count - 1)

    def interpolated(self, values: Array, periodic: bool, *x: Array | float) -> Array:
        """Returns values on cells, array (n, ...), between their centres; 0 outside."""
        n = self.count
        places = [np.asarray(coordinate) for coordinate in x]
        if len(places) == 2 and form_grid(*places):
            x1, x2 = places
            along_first = self._along(self.axes[0], x1[:, 0], values, periodic)
            return self._along(self.axes[1], x2[0], along_first.T, periodic).T
        coordinates = self.cell_coordinates(*x)
        between = map_coordinates(values, coordinates, order=1, mode="grid-wrap" if periodic else "nearest")
        inside = periodic | np.all(np.abs(coordinates - (n - 1) / 2) <= n / 2, axis=0)
        return np.where(inside, between, 0.0)

    def _along(self, axis: Array, x: Array, values: Array, periodic: bool) -> Array:
        """Returns values on cells along an axis, array (n, m), at places x, array (k,): array (k, m)."""
        n = self.count
        place = (x - axis[0]) / self.width
        inside = periodic | (np.abs(place - (n - 1) / 2) <= n / 2)
        place = place % n if periodic else np.clip(place, 0, n - 1)
        before = place.astype(int)
        share = (place - before)[:, None]
        return inside[:, None] * ((1 - share) * values[before] + share * values[(before + 1) % n])


@dataclass(frozen=True, eq=False)
class CellResponse:
    """The response (u, phi) of a surface to loads (p, m) on count cells along each axis.

    Attributes
    ----------
    symbol : function of wavenumbers k, array (n,), that returns U, V, W and W_par, or U, V, W
    averages : function that returns averages of the response over cells 0, 1, ... cells away, arrays
        (count, ...), the upper triangle of R, or of one corner its first row
    count, width : number of cells along an axis, and their width
    dimensions : number of axes
    one_corner : whether loads are forces alone
    clamped : whether psi = 0 on the whole surface
    mean_rotation : float or None, W on a period for k -> 0; None without images
    """

    symbol: Callable[[Array], ArrayLike]
    averages: Callable[[], ArrayLike]
    count: int
    width: float
    dimensions: int
    one_corner: bool
    clamped: bool
    mean_rotation: float | None

    @property
    def near(self) -> int:
        """Cells of the period of the preconditioner."""
        return self.count if self.mean_rotation is not None else next_fast_len(self.count, real=True)

    @property
    def length(self) -> tuple[int, ...]:
        """Cells along each axis of the transforms."""
        length = self.near if self.mean_rotation is not None else 2 * self.near
        return (length,) * self.dimensions

    @property
    def rotations(self) -> range:
        """Rows of phi and m in R."""
        return range(1, 1 + self.dimensions)

    def spectrum(self) -> list[list[Array]]:
        """Returns R on the waves of a period of `length` cells; of one corner its first row and column, where
        psi = 0 with moments in the place of rotations.
        """
        return self._window_spectrum() if self.mean_rotation is None else self._periodic_spectrum()

    def _periodic_spectrum(self) -> list[list[Array]]:
        """Returns R from the symbol, without a mean displacement."""
        R = self.smooth_spectrum(self.length[0])
        R[0, 0][(0,) * self.dimensions] = 0
        return [list(row) for row in (exchanged(R, self.rotations) if self.clamped else R)]

    def _window_spectrum(self) -> list[list[Array]]:
        """Returns R from averages over cells, which have no images in a period of twice the length."""
        size = 1 + self.dimensions
        averages = iter(cast(Array, self.averages()))
        R = [[np.empty(0)] * size for _ in range(size)]
        for i in range(1 if self.one_corner else size):
            for j in range(i, size):
                odd = [(i == axis) != (j == axis) for axis in self.rotations]
                R[i][j] = R[j][i] = circulant_spectrum(next(averages), self.length[0], *odd)
        return R

    def smooth_spectrum(self, length: int) -> Array:
        """Returns R of the symbol on a period, positive definite: array (1 + d, 1 + d, ...)."""
        d = self.dimensions
        ways, k = wavenumbers(length, self.width, d)
        values = np.reshape(self.symbol(k.ravel()), (-1, *k.shape)) / self.width**d
        U, V = values[:2]
        W, W_par = values[2], values[-1]
        mean = (0,) * d
        V[mean] = 0
        rotations = values[2:].T[mean]
        rotations[:] = rotations.mean() if self.mean_rotation is None else self.mean_rotation / self.width**d
        # of the shortest wave cells see no odd part
        sees_odd = np.pi / self.width * (1 - 0.5 / length)
        odd = np.array([np.where(np.abs(way) < sees_odd, way / k, 0.0) for way in ways])
        difference = W - W_par
        R = np.empty((1 + d, 1 + d, *k.shape))
        R[0, 0] = U
        R[0, 1:] = R[1:, 0] = V * odd
        R[1:, 1:] = difference * odd[:, None] * odd
        for axis in range(d):
            R[1 + axis, 1 + axis] = W_par + difference * (ways[axis] / k) ** 2
        return R

    def short_wave(self) -> tuple[float, float]:
        """Returns k U and k W of the shortest wave of the cells."""
        k = np.pi / self.width
        displacement, _, rotation = k * np.ravel(self.symbol(np.array([k])))[:3]
        return float(displacement), float(rotation)


class SecondSurface(Protocol):
    """What a second body adds to the gaps of corners on cells."""

    @property
    def smooth(self) -> Array:
        """Positive response of the second body on the waves of the preconditioner, array (length, ...)."""

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps of corner forces, arrays (corners, ...)."""

    def added(self, R: Array, displaced: float) -> Array:
        """Returns R of both bodies from that of the first, whose short waves displace by `displaced`."""


class TwistingBody(SecondSurface, Protocol):
    """A second body under four corners of a block, which forces 1, -1, -1, 1 twist.

    Attributes
    ----------
    twisted : float, most twist of a block (length per force)
    """

    twisted: float

    def with_short(self, short: Array, displaced: float) -> Array:
        """Returns what short waves displace, twist and turn, over the first body's displacement."""


class Flexibility(MatrixFree):
    """H on cells as a product, and a preconditioner for it. Arrays of cells are (..., n), (..., n, n), or of
    several squares (..., squares, n, n).

    Attributes
    ----------
    offsets : array (corners, d), signs s; 0 of one corner. d is 1 on a half-plane, 2 on a half-space
    tilt : array (d, ...), t at the cells; (0, ...) for one corner
    clamped : whether psi = 0 on the whole surface
    second : second body, whose gaps are added, or None
    twist : of four corners on a second body its `twisted`, else None
    """

    offsets: Array
    tilt: Array
    clamped: bool
    second: "Product | None"
    twist: "float | Array | None"

    def response(self, loads: Array) -> Array:
        """Returns (u, phi) under (p, m), arrays (1 + d, ...), of one corner u under p."""
        raise NotImplementedError

    def beside(self, forces: Array) -> Array:
        """Returns, of one corner, phi under p, or the m of psi = 0: array (d, ...)."""
        raise NotImplementedError

    def inverse(self) -> Operator:
        """Returns an approximate inverse of the response, a function."""
        raise NotImplementedError

    def lifts_of(self, face: Flags) -> Array:
        """Returns B of `on_face` for the closed ones of four corners: array (3 or 4, corners, ...)."""
        raise NotImplementedError

    @property
    def rounded(self) -> "Flexibility":
        """H with products and preconditioners to single precision, or H itself."""
        return self

    @property
    def one_corner(self) -> bool:
        return len(self.offsets) == 1

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps from forces, arrays (corners, ...)."""
        gaps = self.surface(forces)
        if not self.one_corner:
            tilted = (self.tilt * gaps[1:]).sum(axis=0)
            gaps = np.tensordot(self.rows, gaps, 1)
            gaps += tilted
        return gaps if self.second is None else gaps + self.second @ forces

    @cached_property
    def rows(self) -> Array:
        """(1, -s) of the corners, array (corners, 1 + d); of one corner (1,)."""
        ones = np.ones((len(self.offsets), 1))
        return ones if self.one_corner else np.hstack((ones, -self.offsets))

    def surface(self, forces: Array) -> Array:
        """Returns (u, phi), or u of one corner, array (1 + d or 1, ...)."""
        return self.response(self.resultants(forces))

    def resultants(self, forces: Array) -> Array:
        """Returns (p, m), or p of one corner, array (1 + d or 1, ...)."""
        if self.one_corner:
            return forces
        loads = np.tensordot(self.rows.T, forces, 1)
        loads[1:] += self.tilt * loads[0]
        return loads

    def rotations_and_moments(self, forces: Array, surface: Array) -> tuple[Array, Array]:
        """Returns phi and m, arrays (d, ...), from forces and their `surface`."""
        if not self.one_corner:
            return surface[1:], self.resultants(forces)[1:]
        beside = self.beside(forces)
        zeros = np.zeros_like(beside)
        return (zeros, beside) if self.clamped else (beside, zeros)

    def on_face(self, face: Flags) -> Operator:
        """From gaps to forces of least norm on some corners, boolean (corners, ...); of
        fewer than four on all.

        C^-1 acts between B = D E^T (E D E^T)^+ and its transpose, E = (1, -s) of these corners, or with a
        second body (1, a b, -a, -b) for s = (a, b).
        """
        inverse = self.inverse()
        if self.one_corner:
            return inverse
        lifts = np.linalg.inv(self.rows) if len(face) < len(TWIST_MODE) else self.lifts_of(face)
        d = len(self.tilt)

        def precondition(gaps: Array) -> Array:
            surface = np.einsum("sc...,c...->s...", lifts, gaps)
            surface[0] -= (self.tilt * surface[-d:]).sum(axis=0)
            loads = inverse(surface)
            loads[-d:] -= self.tilt * loads[0]
            return np.asarray(np.einsum("sc...,s...->c...", lifts, loads))

        return precondition

    @property
    def settling_displaces(self) -> bool:
        """Whether `settled` displaces a second body."""
        return self.twist is not None

    def settled(self, forces: Array, g0: Array, slope: Array) -> Array:
        """Returns forces of `with_least_work`; on a second body the forces 1, -1, -1, 1 take a step down the
        slope.
        """
        if self.twist is None or len(forces) != len(TWIST_MODE):
            return with_least_work(forces, g0)
        all_touch = np.asarray(np.isfinite(g0).all(axis=0))
        return twisted(forces, -np.tensordot(TWIST_MODE, slope, 1) / (16 * self.twist), all_touch)


class Product(Protocol):
    """What has a product with corner forces."""

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps of corner forces, arrays (corners, ...)."""


class CellFlexibility(Flexibility):
    """The flexibility of corners on the cells of one grid.

    Parameters
    ----------
    offsets, tilt : arrays, as of `Flexibility`
    cells : CellResponse
    second : SecondSurface or None
    """

    second: SecondSurface | None

    def __init__(
        self, offsets: Array, tilt: Array, cells: CellResponse, second: SecondSurface | None
    ) -> None:
        self.offsets = offsets
        self.tilt = tilt
        self.clamped = cells.clamped
        self.cells = cells
        self.second = second
        self.twist = None
        self._displaced, rotated = cells.short_wave()
        # displacement, twist of the second body, and rotations under short waves
        self._short = np.array((1.0, *[rotated / self._displaced] * cells.dimensions))
        if second is not None and len(offsets) == len(TWIST_MODE):
            second = cast(TwistingBody, second)
            self.twist = second.twisted
            self._short = second.with_short(self._short, self._displaced)
        R = cells.spectrum()
        if second is None and cells.dimensions == 2:  # on a line displacements have no zero
            self.unit = float(sum(np.mean(R[i][i]) for i in range(1 if self.one_corner else len(R))))
        if self.one_corner:
            self._response: Any = FourierOperator(cells.length, [R[0][:1]])
            self._beside = FourierOperator(cells.length, [row[:1] for row in R[1:]], even=(0, 1))
        else:
            self._response = FourierOperator(cells.length, R)

    @cached_property
    def rounded(self) -> "CellFlexibility":
        H = copy(self)
        H._response = rounded(self._response)
        H._inverse = rounded(self._inverse)
        return H

    def response(self, loads: Array) -> Array:
        return self._response(loads)

    def beside(self, forces: Array) -> Array:
        return self._beside(forces)

    def inverse(self) -> Operator:
        return self._inverse

    @cached_property
    def _inverse(self) -> Any:
        R = self.cells.smooth_spectrum(self.cells.near)
        d = self.cells.dimensions
        period = (self.cells.near,) * d
        if self.one_corner:
            if self.clamped:
                R = exchanged(R, self.cells.rotations)
            both = R[0, 0] if self.second is None else R[0, 0] + self.second.smooth
            return FourierOperator(period, [[1 / both]])
        if self.second is not None:
            R = self.second.added(R, self._displaced)
        return FourierOperator(period, list(exchanged(R, range(len(R)))), (len(R) - d,) * 2)

    def lifts_of(self, face: Flags) -> Array:
        return np.take(self._lifts, np.tensordot(2 ** np.arange(len(face)), face, 1), axis=2)

    @cached_property
    def _lifts(self) -> Array:
        """B of each set of corners: array (3 or 4, corners, 16)."""
        faces = np.arange(16)[:, None] >> np.arange(4) & 1
        return np.stack([self._lift(face) for face in faces], axis=2)

    def _lift(self, face: Integers) -> Array:
        rows = self.rows if self.second is None else np.insert(self.rows, 1, TWIST_MODE, axis=1)
        D = np.diag(self._short)
        E = rows * face[:, None]
        return np.asarray(D @ E.T @ np.linalg.pinv(E @ D @ E.T))


def with_least_work(forces: Array, g0: Array) -> Array:
    """Returns forces with the same resultants and the least work on the initial gaps, arrays (corners, ...):
    "--" or "++" of a block is open where g0-- - g0-+ - g0+- + g0++ > 0, forces have the least norm where that
    is 0.
    """
    if len(forces) != len(TWIST_MODE):
        return forces
    with np.errstate(invalid="ignore"):
        work = np.tensordot(TWIST_MODE, g0, 1)
    all_touch = np.isfinite(work)
    rounding = EPS_PIVOT * np.abs(g0[:, all_touch]).max(initial=0.0)
    amplitude = np.where(np.abs(work) > rounding, -np.copysign(np.inf, work), of_least_norm(forces))
    return twisted(forces, amplitude, all_touch)


def of_least_norm(forces: Array) -> Array:
    """Returns the multiple of TWIST_MODE that leaves forces, array (4, ...), of the least norm."""
    return np.asarray(-np.tensordot(TWIST_MODE, forces, 1) / len(TWIST_MODE))


def twisted(forces: Array, amplitude: Array, where: Flags) -> Array:
    """Returns forces, array (4, ...), plus a multiple of TWIST_MODE at some blocks, cut where a force becomes
    0.
    """
    amplitude = np.clip(amplitude, -np.minimum(forces[0], forces[3]), np.minimum(forces[1], forces[2]))
    return np.maximum(forces + np.multiply.outer(TWIST_MODE, np.where(where, amplitude, 0.0)), 0.0)


def wavenumbers(length: int, width: float, d: int) -> tuple[tuple[Array, ...], Array]:
    """Returns wavenumbers along each of d axes of a period, and k, array (length, ..., length//2 + 1); at
    k = 0 half of the smallest stands for the mean.
    """
    step = 2 * np.pi / (length * width)
    along = [np.fft.fftfreq(length, 1 / length) * step] * (d - 1) + [np.arange(length // 2 + 1) * step]
    ways = tuple(np.meshgrid(*along, indexing="ij", sparse=True))
    k = np.sqrt(sum(way**2 for way in ways))
    k[(0,) * d] = step / 2
    return ways, k


def exchanged(R: Array, numbers: range) -> Array:
    """Returns the matrices R, array (m, m, ...), with the numbered loads in place of what they displace, by
    pivots: of all numbers the inverse.
    """
    R = np.array(R)
    for j in numbers:
        pivot = R[j, j].copy()
        column = R[:, j].copy()
        row = R[j] / pivot
        R -= column[:, None] * row
        R[j] = -row
        R[:, j] = column / pivot
        R[j, j] = 1 / pivot
    return R


def spots(flags: Flags, periodic: bool) -> Integers:
    """Returns labels of connected cells, from 1, in the shape of the flags; on a period across its ends."""
    labels = label(flags, np.ones((3,) * flags.ndim))[0]
    for axis in range(flags.ndim if periodic else 0):
        first, last = (np.moveaxis(labels, axis, 0)[end] for end in (slice(1), slice(-1, None)))  # views
        for place in zip(*np.nonzero((first > 0) & (last > 0))):
            if first[place] != last[place]:
                labels[labels == last[place]] = first[place]
    return labels
