"""The response of the half-space to a unit force and a unit moment on its surface.

With r the distance, e its direction from the load, and phi and m as in `microblock.halfspace.symbol`,

    u = u(r) p - v(r) e.m,     phi = v(r) e p + [w0(r) + w2(r) (2 e e - 1)] m,

are the Hankel transforms of U, V, (W + W_par)/2 and (W - W_par)/2 with J0, J1, J0 and -J2. Where psi = 0
everywhere, u from p is that of U - V^2/W, and m = -V/W e p with J1. All are fast transforms in log k
(Hamilton, MNRAS 312 (2000) 257), tabulated in log r.
"""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.fft import fht
from scipy.interpolate import make_interp_spline

from ..model.material import Cosserat
from ..model.quadrature import gauss_rule, in_blocks
from ..model.types import AnyArray as Array
from .symbol import symbol

SCALES = np.logspace(-20, 20, 1281)  # 32 a decade, between which a spline is good to 1e-11
ORDERS = np.array((0, 1, 0, 2, 0, 1))  # of the Bessel functions


class Radial:
    """What functions of wavenumbers k, array (6, n), like those of `spectra`, are transforms of: functions of
    distances. Their products with k have limits for small and large k; of the transition some is at
    1/length.
    """

    def __init__(self, functions: Callable[[Array], Array], length: float) -> None:
        own = functions(SCALES / length) * SCALES / (2 * np.pi * length)
        short, rest = own[:, -1:], own[:, :1] - own[:, -1:]
        smooth = own - short - rest * np.exp(-SCALES)  # what is taken off has transforms in closed form
        root, step = np.hypot(SCALES, 1), np.log(SCALES[1] / SCALES[0])
        values = short + rest * SCALES / root * (SCALES / (root + 1)) ** ORDERS[:, None]
        values += [fht(row, step, order) for row, order in zip(smooth, ORDERS)]
        values[3] *= -1
        self._spline = make_interp_spline(np.log(SCALES * length), values.T, k=7)

    def __call__(self, r: Array) -> Array:
        """Returns the functions at r > 0, array (6, ...)."""
        return np.moveaxis(self._spline(np.log(r)), -1, 0) / r


class Kernels(Radial):
    """u, v, w0 and w2, and u and m where psi = 0 (length per force, m 1/length^2)."""

    def __init__(self, solid: Cosserat) -> None:
        super().__init__(lambda k: spectra(solid, k), solid.ell)

    def cells(self, count: int, width: float, clamped: bool = False) -> Array:
        """Returns responses averaged over square cells (i, j) = 0, 1, ... cells away.

        The array (6, count, count) has `along_axes`, with psi = 0 (3, count, count).
        """
        found = np.empty((3 if clamped else 6, count, count))
        for (near, far), order in zip(pairwise((0, 3, 12, 48, count)), (24, 8, 4, 2)):
            i, j = np.indices((count, count))
            keep = (np.maximum(i, j) >= near) & (np.maximum(i, j) < far)
            i, j = i[keep], j[keep]
            points, gauss = gauss_rule(order)
            x, y = np.meshgrid((points - 0.5) * width, (points - 0.5) * width, indexing="ij")
            for block in in_blocks(len(i), order**2):
                places = i[block, None, None] * width + x, j[block, None, None] * width + y
                values = along_axes(self(np.hypot(*places)), *places, clamped)
                found[:, i[block], j[block]] = np.einsum("cnab,a,b->cn", values, gauss, gauss)
        u, w, held = self._own(width)
        found[:, 0, 0] = (held, 0, 0) if clamped else (u, 0, 0, w, 0, w)
        return found

    def _own(self, width: float) -> Array:
        """Returns averages of u, w0 and u where psi = 0 over the loaded cell."""
        rays, turns = radii, lengths = gauss_rule(32)
        angle = rays * np.pi / 4
        reach = width / 2 / np.cos(angle)
        r = reach[:, None] * radii**2  # a logarithm of r, in r u, is flattened
        whole = (self(r) * r * (2 * reach[:, None] * radii * lengths)).sum(axis=-1)
        return 2 * np.pi * (whole[[0, 2, 4]] @ turns) / width**2


def along_axes(values: Array, x: Array, y: Array, clamped: bool) -> Array:
    """Returns u, v1, v2 and the components 11, 12, 22 of the tensor at (x, y), array (6, ...), or of the
    spectra at (k1, k2); where psi = 0 everywhere u, m1 and m2 from p, array (3, ...).
    """
    u, v, w0, w2, held, m = values
    r = np.maximum(np.hypot(x, y), np.finfo(float).tiny)
    c, s = x / r, y / r
    if clamped:
        return np.array((held, m * c, m * s))
    return np.array((u, v * c, v * s, w0 + w2 * (2 * c * c - 1), 2 * w2 * c * s, w0 + w2 * (2 * s * s - 1)))


def spectra(solid: Cosserat, k: Array) -> Array:
    """Returns what the kernels are transforms of at wavenumbers k, array (6, ...)."""
    U, V, W, other = symbol(solid, k)
    return np.array((U, V, (W + other) / 2, (W - other) / 2, U - V**2 / W, -V / W))


kernels = lru_cache(maxsize=16)(Kernels)
