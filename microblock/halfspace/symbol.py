"""The surface response of the half-space x3 < 0 in Fourier space.

In the plane of wave vector and normal the fields are those of the half-plane, with U, V, W of
`microblock.halfplane.kernels`. A moment along the wave vector, k along x1, displaces by u2 = w(x1, x3). Three
modes solve the field equations,

    w = exp(k x3),      psi = curl(w e2)/2
    psi = grad exp(s1 x3),                      s1^2 = k^2 + 4 eta/(ell^2 (alpha' + beta' + gamma'))
    w = beta exp(s x3), psi = curl(exp(s x3) e2),   s^2 = k^2 + 1/L^2,  1/L^2 = 2 beta/(ell^2 gamma')

(each with ``exp(i k x1)``), and ``sigma_23 = m_33 = 0`` at the surface leaves, with ``g = gamma' + beta'``,
``tau = 2 beta/ell^2`` and ``T = g k^2 + tau``,

    psi1/M1 = (1 + eta) tau s/(mu ell^2 [(1 + eta) T^2 - g^2 k^2 s (eta k + s1)]).

With ``phi = ell psi/2`` and ``m = 2 M/ell`` this is W_par = (ell^2/4) psi1/M1.
"""

from __future__ import annotations

import numpy as np

from ..errors import BadArgument
from ..halfplane import kernels
from ..model.material import Cosserat
from ..model.types import AnyArray as Array


def symbol(solid: Cosserat, k: Array) -> tuple[Array, Array, Array, Array]:
    """Returns U, V, W and W_par at wavenumbers k, arrays like k (lengths per stress); raises BadArgument
    unless k > 0.
    """
    k = np.asarray(k, float)
    U, V, W = kernels.symbol(solid, k.ravel()).reshape(3, *k.shape)
    return U, V, W, along(solid, k)


def along(solid: Cosserat, k: Array, shear: Array | None = None, spread: Array | None = None) -> Array:
    """Returns W_par at wavenumbers k (1/length), also complex, without cancellation; `shear` and `spread`,
    arrays like k, are s and s1.
    """
    eta, ell = solid.eta, solid.ell
    g, tau = solid.curvature + solid.beta_prime, 2 * solid.beta / ell**2
    rate, rate1 = 2 * solid.beta / (ell**2 * solid.curvature), spread_rate(solid)
    s = np.sqrt(k**2 + rate) if shear is None else shear
    s1 = np.sqrt(k**2 + rate1) if spread is None else spread
    d, d1 = rate / (s + k), rate1 / (s1 + k)  # s - k, s1 - k
    lost = k * d1 + (1 + eta) * k * d + d * d1  # s (eta k + s1) - (1 + eta) k^2
    whole = (1 + eta) * (2 * g * tau * k**2 + tau**2) - g**2 * k**2 * lost
    return (1 + eta) * tau * s / (4 * solid.mu * whole)


def spread_rate(solid: Cosserat) -> float:
    """Returns s1^2 - k^2 (1/length^2)."""
    return 4 * solid.eta / (solid.ell**2 * (solid.alpha_prime + solid.beta_prime + solid.curvature))


def require_stable(solid: Cosserat) -> None:
    """Raises BadArgument for elliptic moduli, (13), that let the surface turn without a moment."""
    k = np.geomspace(1e-6, 1e6, 1201) / solid.ell
    if not np.all(along(solid, k) > 0):
        raise BadArgument(
            "beta_prime",
            solid.beta_prime,
            f"makes a half-space unstable with alpha' = {solid.alpha_prime:g} and gamma' = "
            f"{solid.curvature:g}: short waves of its surface turn by themselves",
        )
