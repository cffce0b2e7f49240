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
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.fft import fht
from scipy.interpolate import make_interp_spline

from ..model.material import Cosserat
from ..model.quadrature import gauss_rule, in_blocks
from ..model.types import Array
from .symbol import ShearSymbol, surface_symbol

SCALES = np.logspace(-20, 20, 1281)  # 32 a decade, between which a spline is good to 1e-11
BESSEL_ORDERS = np.array((0, 1, 0, 2, 0, 1))
SHEAR_ORDERS = np.array((1, 0, 2, 0, 2))


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
        self._spline = make_interp_spline(np.log(SCALES * length), transforms.T, k=7)

    def __call__(self, r: Array) -> Array:
        """Returns the functions at r > 0, array (m, ...)."""
        return np.asarray(np.moveaxis(self._spline(np.log(r)), -1, 0) / r)

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

    def cells(self, count: int, width: float, clamped: bool = False) -> Array:
        """Returns responses averaged over square cells (i, j) = 0, 1, ... cells away.

        The array (6, count, count) has `along_axes`, with psi = 0 (3, count, count).
        """
        transposed = [0, 2, 1] if clamped else [0, 2, 1, 5, 4, 3]
        averages = cell_averages(
            count, width, transposed, lambda x, y: along_axes(self(np.hypot(x, y)), x, y, clamped)
        )
        u, _, w, _, u_clamped, _ = self.over_loaded_cell(width)
        averages[:, 0, 0] = (u_clamped, 0, 0) if clamped else (u, 0, 0, w, 0, w)
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
        averages = cell_averages(
            count, width, [1, 0, 4, 3, 2, 7, 6, 5], lambda x, y: shear_along_axes(self(np.hypot(x, y)), x, y)
        )
        _, moved, _, turned, _ = self.over_loaded_cell(width)
        averages[:, 0, 0] = (0, 0, moved, 0, moved, turned, 0, turned)
        return averages


def cell_averages(
    count: int, width: float, transposed: list[int], components: Callable[[Array, Array], Array]
) -> Array:
    """Returns averages of components, array (c, ...), at distances (x, y) over square cells (i, j) = 0, 1,
    ... cells away, array (c, count, count), but of the loaded cell; `transposed` are the components with x
    and y exchanged.
    """
    averages = np.empty((len(transposed), count, count))
    rows, columns = np.tril_indices(count)
    for (nearest, end), order in zip(pairwise((0, 3, 12, 48, count)), (24, 8, 4, 2)):
        in_ring = (rows >= nearest) & (rows < end)
        i = rows[in_ring]
        j = columns[in_ring]
        points, weights = gauss_rule(order)
        x, y = np.meshgrid((points - 0.5) * width, (points - 0.5) * width, indexing="ij")
        for block in in_blocks(len(i), order**2):
            x_block = i[block, None, None] * width + x
            y_block = j[block, None, None] * width + y
            block_averages = np.einsum("cnab,a,b->cn", components(x_block, y_block), weights, weights)
            averages[:, i[block], j[block]] = block_averages
            averages[:, j[block], i[block]] = block_averages[transposed]
    return averages


def along_axes(values: Array, x: Array, y: Array, clamped: bool) -> Array:
    """Returns u, v1, v2 and the components 11, 12, 22 of the tensor at (x, y), array (6, ...), or of the
    spectra at (k1, k2); where psi = 0 everywhere u, m1 and m2 from p, array (3, ...).
    """
    u, v, w0, w2, u_clamped, m = values
    c, s = direction(x, y)
    if clamped:
        return np.array((u_clamped, m * c, m * s))
    return np.array((u, v * c, v * s, *tensor(w0, w2, c, s)))


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
