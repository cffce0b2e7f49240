"""The response of the half-space to a unit force and a unit moment on its surface.

With r the distance, e its direction from the load, and phi and m as in `microblock.halfspace.symbol`,

    u = u(r) p - v(r) e.m,     phi = v(r) e p + [w0(r) + w2(r) (2 e e - 1)] m,

are the Hankel transforms of U, V, (W + W_par)/2 and (W - W_par)/2 with J0, J1, J0 and -J2. Where psi = 0
everywhere, u from p is that of U - V^2/W, and m = -V/W e p with J1. Shear q on the surface, of a
`ShearSymbol`, displaces it by ``z(r) e.q``, moves its face by a tensor like that of m, and rotates by another
one; p moves the face by ``-z(r) e p``. All are fast transforms in log k (Hamilton, MNRAS 312 (2000) 257),
tabulated in log r.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np
from scipy.fft import fht
from scipy.interpolate import PPoly, make_interp_spline
from scipy.ndimage import correlate1d
from scipy.special import factorial

from ..model.material import Cosserat
from ..model.quadrature import gauss_rule, lagrange
from ..model.types import Array
from .symbol import ShearSymbol, surface_symbol

SCALES = np.logspace(-20, 20, 1281)  # 32 a decade, between which a spline is good to 1e-11
BESSEL_ORDERS = np.array((0, 1, 0, 2, 0, 1))
CLAMPED = slice(4, 6)  # u and m where psi = 0
SHEAR_ORDERS = np.array((1, 0, 2, 0, 2))
SMOOTH = 24  # cells from the loaded one, beyond which averages are those of polynomials through cells
NEIGHBOURS = 4  # of these on either side, for 1e-12


class Radial:
    """Hankel transforms of functions of wavenumbers k, array (m, n), with Bessel functions of these orders,
    array (m,), and -J2 for 2: functions of distances. Their products with k have limits for small and large
    k; of the transition some is at 1/length.
    """

    def __init__(
        self, functions: Callable[[Array], Array], length: float, orders: Array = BESSEL_ORDERS
    ) -> None:
        values = functions(SCALES / length) * SCALES / (2 * np.pi * length)
        short = values[:, -1:]
        long = values[:, :1] - short
        smooth = values - short - long * np.exp(-SCALES)  # what is taken off has transforms in closed form
        root = np.hypot(SCALES, 1)
        step = np.log(SCALES[1] / SCALES[0])
        transforms = short + long * SCALES / root * (SCALES / (root + 1)) ** orders[:, None]
        for order in np.unique(orders):
            transforms[orders == order] += fht(smooth[orders == order], step, order)
        transforms[orders == 2] *= -1
        spline = make_interp_spline(np.log(SCALES * length), transforms.T, k=7)
        # powers about knots take half the time of B-splines
        self._knots = spline.t[spline.k : -spline.k]
        powers = np.arange(spline.k, -1, -1)
        derivatives = np.array([spline(self._knots[:-1], nu) for nu in powers])
        self._powers = derivatives / factorial(powers)[:, None, None]

    def __call__(self, r: Array, rows: slice = slice(None)) -> Array:
        """Returns the functions at r > 0, or some of them, array (m, ...)."""
        pieces = PPoly.construct_fast(np.ascontiguousarray(self._powers[..., rows]), self._knots)
        return np.asarray(np.moveaxis(pieces(np.log(r)), -1, 0) / r)

    def over_loaded_cell(self, width: float) -> Array:
        """Returns averages of the functions over the loaded cell, array (m,), in polar coordinates of an
        eighth of it.
        """
        points, weights = gauss_rule(32)
        length = width / 2 / np.cos(points * np.pi / 4)
        r = length[:, None] * points**2  # a logarithm of r, in r u, is flattened
        along_rays = (self(r) * r * (2 * length[:, None] * points * weights)).sum(axis=-1)
        return np.asarray(2 * np.pi * (along_rays @ weights) / width**2)


class SurfaceKernels(Radial):
    """u, v, w0 and w2, and u and m where psi = 0 (length per force, m 1/length^2)."""

    def __init__(self, solid: Cosserat) -> None:
        super().__init__(lambda k: spectra(solid, k), solid.ell)

    def cells(self, count: int, width: float, clamped: bool = False, most: int = 4) -> Array:
        """Returns responses averaged over square cells (i, j) = 0, 1, ... cells away.

        The array (6, count, count) has `along_axes` of u, v, w0 and w2, or (3 or 1, count, count) of the
        first two or one, with psi = 0 of u and m.
        """
        rows = CLAMPED if clamped else slice(most)
        averages = cell_averages(count, width, [0, 2, 1, 5, 4, 3], partial(self, rows=rows), along_axes)
        u, _, w, _, u_clamped, _ = self.over_loaded_cell(width)
        averages[:, 0, 0] = (u_clamped if clamped else u, 0, 0, w, 0, w)[: len(averages)]
        return averages


class ShearKernels(Radial):
    """z, then half the sum and half the difference of parts along and across of the face's displacement, and
    of its rotation: transforms of a function of wavenumbers that returns their ShearSymbol.
    """

    def __init__(self, symbol: Callable[[Array], ShearSymbol], length: float) -> None:
        super().__init__(lambda k: shear_spectra(symbol(k)), length, SHEAR_ORDERS)

    def cells(self, count: int, width: float) -> Array:
        """Returns responses averaged over square cells (i, j) = 0, 1, ... cells away: array (8, count, count)
        of z1, z2, and the components 11, 12, 22 of the displacement and of the rotation.
        """
        averages = cell_averages(count, width, [1, 0, 4, 3, 2, 7, 6, 5], self, shear_along_axes)
        _, moved, _, turned, _ = self.over_loaded_cell(width)
        averages[:, 0, 0] = (0, 0, moved, 0, moved, turned, 0, turned)
        return averages


def cell_averages(
    count: int,
    width: float,
    transposed: list[int],
    radial: Callable[[Array], Array],
    components: Callable[[Array, Array, Array], Array],
) -> Array:
    """Returns averages over square cells (i, j) = 0, 1, ... cells away, array (c, count, count), but of the
    loaded cell, of the components that radial functions have at distances (x, y), array (c, ...);
    `transposed` are the components with x and y exchanged.
    """
    averages = _smooth_averages(count, width, radial, components)
    rows, columns = np.tril_indices(min(count, SMOOTH))
    for (nearest, end), order in zip(pairwise((0, 3, 12, SMOOTH)), (24, 8, 4)):
        in_ring = (rows >= nearest) & (rows < end)
        i = rows[in_ring]
        j = columns[in_ring]
        points, weights = gauss_rule(order)
        x = i[:, None, None] * width + ((points - 0.5) * width)[:, None]
        y = j[:, None, None] * width + (points - 0.5) * width
        x, y = np.broadcast_arrays(x, y)
        ring_averages = np.einsum("cnab,a,b->cn", components(radial(np.hypot(x, y)), x, y), weights, weights)
        averages[:, i, j] = ring_averages
        averages[:, j, i] = ring_averages[transposed[: len(averages)]]
    return averages


def _smooth_averages(
    count: int,
    width: float,
    radial: Callable[[Array], Array],
    components: Callable[[Array, Array, Array], Array],
) -> Array:
    """Returns averages of `cell_averages` as those of polynomials through the values at the middles of cells
    and their neighbours, which holds far from the loaded cell alone.
    """
    rows, columns = np.tril_indices(count + NEIGHBOURS)
    r = width * np.hypot(rows, columns)
    r[0] = width
    along_rows = radial(r)
    values = np.empty((len(along_rows), count + NEIGHBOURS, count + NEIGHBOURS))
    values[:, rows, columns] = along_rows
    values[:, columns, rows] = along_rows
    values = np.pad(values, ((0, 0), (NEIGHBOURS, 0), (NEIGHBOURS, 0)), mode="reflect")
    cells = np.arange(-NEIGHBOURS, count + NEIGHBOURS, dtype=float)
    points, weights = gauss_rule(NEIGHBOURS + 1)
    of_cells = weights @ lagrange(cells[: 2 * NEIGHBOURS + 1], points - 0.5)
    fields = components(values, *np.meshgrid(width * cells, width * cells, indexing="ij"))
    averages = correlate1d(correlate1d(fields, of_cells, 1), of_cells, 2)
    return np.asarray(averages[:, NEIGHBOURS:-NEIGHBOURS, NEIGHBOURS:-NEIGHBOURS])


def along_axes(values: Array, x: Array, y: Array) -> Array:
    """Returns u, v1, v2 and the components 11, 12, 22 of the tensor at (x, y), array (6, ...), from u, v, w0
    and w2, or from those of the spectra at (k1, k2); the first ones from fewer values, array (3 or 1, ...).
    """
    c, s = direction(x, y)
    components = [values[0]]
    if len(values) > 1:
        components += [values[1] * c, values[1] * s]
    if len(values) > 2:
        components += tensor(values[2], values[3], c, s)
    return np.array(components)


def shear_along_axes(values: Array, x: Array, y: Array) -> Array:
    """Returns z1, z2, and the components 11, 12, 22 of both tensors at (x, y), array (8, ...), or of the
    spectra at (k1, k2).
    """
    z, moved, moved_2, turned, turned_2 = values
    c, s = direction(x, y)
    return np.array((z * c, z * s, *tensor(moved, moved_2, c, s), *tensor(turned, turned_2, c, s)))


def direction(x: Array, y: Array) -> tuple[Array, Array]:
    """Returns the unit vector e along (x, y)."""
    r = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
    return x / r, y / r


def tensor(w0: Array, w2: Array, c: Array, s: Array) -> tuple[Array, Array, Array]:
    """Returns the components 11, 12, 22 of ``w0 + w2 (2 e e - 1)`` with e = (c, s)."""
    return w0 + w2 * (2 * c * c - 1), 2 * w2 * c * s, w0 + w2 * (2 * s * s - 1)


def spectra(solid: Cosserat, k: Array) -> Array:
    """Returns what the kernels are transforms of at wavenumbers k, array (6, ...)."""
    U, V, W, W_par = surface_symbol(solid, k)
    return np.array((U, V, (W + W_par) / 2, (W - W_par) / 2, U - V**2 / W, -V / W))


def shear_spectra(symbol: ShearSymbol) -> Array:
    """Returns what `ShearKernels` are transforms of, array (5, ...)."""
    lift, along, across, turn_along, turn_across = symbol
    moved = (along + across) / 2, (along - across) / 2
    turned = (turn_along + turn_across) / 2, (turn_along - turn_across) / 2
    return np.array((lift, *moved, *turned))


surface_kernels = lru_cache(maxsize=16)(SurfaceKernels)
