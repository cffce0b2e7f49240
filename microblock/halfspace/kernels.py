"""The response of the half-space to a unit force and a unit moment on its surface.

With r the distance, e its direction from the load, and phi and m as in `microblock.halfspace.symbol`,

    u = u(r) p - v(r) e.m,     phi = v(r) e p + [w0(r) + w2(r) (2 e e - 1)] m,

are the Hankel transforms of U, V, (W + W_par)/2 and (W - W_par)/2 with J0, J1, J0 and -J2. Where psi = 0
everywhere, u from p is that of U - V^2/W, and m = -V/W e p with J1. On k = i t integrals over t > 0 of the
imaginary parts (of V and V/W: the real part) with K0, K1 and K2 are left, tabulated in log r, over c/ell with
c = (1 - nu)/mu (that of V/W over 1/ell^2).
"""

from __future__ import annotations

from functools import lru_cache, partial
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq
from scipy.special import kv

from ..errors import BadArgument
from ..halfplane.kernels import RATES, at_rest, symbol_of_roots
from ..model.material import Cosserat
from ..model.quadrature import gauss_rule, in_blocks
from ..model.types import AnyArray as Array
from .images import Response
from .symbol import along, require_stable, spread_rate, symbol

NEAREST, FARTHEST = 1e-7, 1e6  # r/ell between which the kernels are tabulated
PIECE = 0.4  # its width in log t


class Kernels:
    """u, v, w0 and w2, and u and m where psi = 0, with ell = 1; BadArgument if beta is too small, or
    the layer too thin for the quadrature, or the surface is unstable.
    """

    def __init__(self, solid: Cosserat) -> None:
        if not RATES[0] <= 1 / solid.layer_length <= RATES[1]:
            raise BadArgument("beta", solid.beta, "must hold the rotation of a half-space: take a larger one")
        require_stable(solid)
        r = np.geomspace(NEAREST, FARTHEST, 417)  # 32 a decade, between which a spline is good to 1e-11
        self._spline = make_interp_spline(np.log(r), (_integrals(solid, r) * r).T, k=7)

    def __call__(self, r: Array) -> Array:
        """Returns the kernels at r/ell, array (6, ...)."""
        r = np.asarray(r, float)
        values: Array = np.moveaxis(self._spline(np.log(np.clip(r, NEAREST, FARTHEST))), -1, 0) / r
        return values

    def cells(self, count: int, width: float, clamped: bool = False) -> Array:
        """Returns responses averaged over square cells (i, j) = 0, 1, ... cells away.

        Cells are `width` times ell wide. The array (6, count, count) has `components` over c/ell; where
        psi = 0, (3, count, count), m1 and m2 over 1/ell^2.
        """
        found = np.empty((3 if clamped else 6, count, count))
        for (near, far), order in zip(pairwise((0, 3, 12, 48, count)), (24, 8, 4, 2)):
            i, j = np.indices((count, count))
            keep = (np.maximum(i, j) >= near) & (np.maximum(i, j) < far)
            i, j = i[keep], j[keep]
            points, gauss = gauss_rule(order)
            x, y = np.meshgrid((points - 0.5) * width, (points - 0.5) * width, indexing="ij")
            for block in in_blocks(len(i), order**2):
                values = self.components(
                    i[block, None, None] * width + x, j[block, None, None] * width + y, clamped
                )
                found[:, i[block], j[block]] = np.einsum("cnab,a,b->cn", values, gauss, gauss)
        u, w, held = self._own(width)
        found[:, 0, 0] = (held, 0, 0) if clamped else (u, 0, 0, w, 0, w)
        return found

    def components(self, x: Array, y: Array, clamped: bool = False) -> Array:
        """Returns u, v1, v2 and the components 11, 12, 22 of the tensor at (x, y)/ell, array (6, ...); where
        psi = 0 everywhere u, m1 and m2 from p, array (3, ...).
        """
        return along_axes(self(np.hypot(x, y)), x, y, clamped)

    def _own(self, width: float) -> Array:
        """Returns averages of u, w0 and u where psi = 0 over the loaded cell."""
        rays, turns = radii, lengths = gauss_rule(32)
        angle = rays * np.pi / 4
        reach = width / 2 / np.cos(angle)
        r = reach[:, None] * radii**2  # a logarithm of r, in r u, is flattened
        whole = (self(r) * r * (2 * reach[:, None] * radii * lengths)).sum(axis=-1)
        averages: Array = 2 * np.pi * (whole[[0, 2, 4]] @ turns) / width**2
        return averages


def along_axes(values: Array, x: Array, y: Array, clamped: bool) -> Array:
    """Returns `Kernels.components` of the kernels at (x, y), array (6, ...), or of the symbol at (k1, k2)."""
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


def response(solid: Cosserat, clamped: bool, period: float | None) -> Response:
    """Returns the Response with the components of `Kernels.components`; of moments of psi = 0 over 1."""
    ell, scale = solid.ell, np.full(6, (1 - solid.nu) / solid.mu / solid.ell)
    scale[5] = 1 / ell**2
    mean = np.array((0, 0, 0) if clamped else (0, 0, 0, 1, 0, 1)) * at_rest(solid)
    table, odd = kernels(solid), np.isin(np.arange(len(mean)), (1, 2))

    def alone(r: Array) -> Array:
        return np.asarray((table(r / ell).T * scale).T)

    return Response(
        alone,
        partial(spectra, solid),
        (0, 1, 0, 2, 0, 1),
        partial(along_axes, clamped=clamped),
        odd,
        mean,
        period,
    )


_made = lru_cache(maxsize=16)(Kernels)


def kernels(solid: Cosserat) -> Kernels:
    """Returns the tables of a solid of any E and ell, made once."""
    couples = {name: getattr(solid, name) for name in ("eta", "curvature", "alpha_prime", "beta_prime")}
    return _made(Cosserat(2 * (1 + solid.nu), solid.nu, 1.0, **couples))


def _integrals(solid: Cosserat, r: Array) -> Array:
    """Returns the kernels at r by Gauss quadrature over t, array (6, n)."""
    t, dt = _points(solid)
    k = 1j * t
    rate = 1 / solid.layer_length**2
    s, s1 = (np.sqrt(each - t**2 + 0j) for each in (rate, spread_rate(solid)))
    U, V, W = symbol_of_roots(solid, k, s, rate / (s + k))
    other = along(solid, k, s, s1)
    c = (1 - solid.nu) / solid.mu
    held, reaction = U - V**2 / W, -c * V / W
    parts = -U.imag, V.real, -(W + other).imag / 2, -(W - other).imag / 2, -held.imag, reaction.real
    weights = np.array(parts) * t * dt / (np.pi**2 * c)
    found = np.empty((len(weights), len(r)))
    for block in np.array_split(np.arange(len(r)), 1 + len(r) // 64):
        tr = np.outer(t, r[block])
        zero, one = kv(0, tr), kv(1, tr)
        two = zero + 2 * one / tr
        for number, bessel in enumerate((zero, one, zero, two, zero, one)):
            found[number, block] = weights[number] @ bessel
    return found


def _pole(solid: Cosserat) -> float | None:
    """Returns the t beyond both branch points where the denominator of W_par vanishes, or None; integrals are
    principal values there.
    """
    g, tau, eta = solid.curvature + solid.beta_prime, 2 * solid.beta / solid.ell**2, solid.eta
    rates = 1 / solid.layer_length**2, spread_rate(solid)

    def denominator(t: float) -> float:
        shear, spread = (np.sqrt(max(t * t - rate, 0.0)) for rate in rates)
        return float((1 + eta) * (tau - g * t * t) ** 2 - (g * t) ** 2 * shear * (eta * t + spread))

    low = float(np.sqrt(max(rates)))
    high = 2 * low
    while denominator(high) > 0:  # it ends below zero in a stable solid
        high *= 2
    return float(brentq(denominator, low, high, xtol=np.finfo(float).tiny)) if denominator(low) > 0 else None


def _points(solid: Cosserat) -> tuple[Array, Array]:
    """Returns Gauss points and weights in t > 0, graded towards branch points and root."""
    rates = np.sqrt([1 / solid.layer_length**2, spread_rate(solid)])
    low, high = 1e-3 / FARTHEST, 40 / NEAREST
    logs = [np.linspace(np.log(low), np.log(high), int(np.log(high / low) / PIECE) + 1)]
    halvings = PIECE * 0.5 ** np.arange(40)
    b = max(0.25, 2 * solid.beta * (1 - solid.nu))  # see `microblock.halfplane.kernels`
    root = -0.5j * np.log((b - 1 + np.sqrt(1 - 4 * b + 0j)) / (b + 2))
    for place in (*np.log(rates), np.log(rates[0] * abs(np.sin(root.real)) + low)):
        logs.append(np.concatenate((place - halvings, [place], place + halvings)))
    edges = np.unique(np.concatenate(logs))
    edges = edges[np.concatenate(([True], np.diff(edges) > 1e-12))]
    if (pole := _pole(solid)) is not None:  # two pieces, each other's mirror, give the principal value
        place = np.log(pole)
        reach = min(PIECE / 2**8, (place - np.log(rates).max()) / 4)
        away = halvings[halvings > reach]
        edges = edges[np.abs(edges - place) > 1.5 * reach]
        edges = np.unique(
            np.concatenate((edges, place - away, place + np.array((-reach, 0, reach)), place + away))
        )
    points, gauss = gauss_rule(16)
    widths = np.diff(edges)
    t = np.exp((edges[:-1, None] + widths[:, None] * points).ravel())
    first, first_weights = low * points, low * gauss  # from 0 to where the pieces begin
    return (
        np.concatenate((first, t)),
        np.concatenate((first_weights, (widths[:, None] * gauss).ravel() * t)),
    )
