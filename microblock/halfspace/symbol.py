"""The surface response of the half-space x3 < 0 in Fourier space.

In the plane of wave vector and normal the fields are those of the half-plane, with U, V, W of
`microblock.halfplane.kernels`. A moment along the wave vector, k along x1, displaces by u2 = w(x1, x3). Three
modes solve the field equations,

    w = exp(k x3),      psi = curl(w e2)/2
    psi = grad exp(s1 x3),                      s1^2 = k^2 + 4 eta/(ell^2 (alpha' + beta' + gamma'))
    w = beta exp(s x3), psi = curl(exp(s x3) e2),   s^2 = k^2 + 1/L^2,  1/L^2 = 2 beta/(ell^2 gamma')

(each with ``exp(i k x1)``), and ``sigma_23 = m_33 = 0`` at the surface leaves, with ``g = gamma' + beta'``,
``G = alpha' + beta' + gamma'`` and ``tau = 2 beta/ell^2``,

    psi1/M1 = s/(mu ell^2 {2 g k^2 + tau - g^2 k^2 [s/(G (s1 + k)) + k/(gamma' (s + k))]}).

With ``phi = ell psi/2`` and ``m = 2 M/ell`` this is W_par = (ell^2/4) psi1/M1.
"""

import numpy as np

from ..errors import require
from ..halfplane import kernels
from ..model.material import Cosserat
from ..model.types import Array


def surface_symbol(solid: Cosserat, k: Array) -> tuple[Array, Array, Array, Array]:
    """Returns U, V, W and W_par at wavenumbers k, arrays like k (lengths per stress); raises BadArgument
    unless k > 0.
    """
    k = np.asarray(k, float)
    U, V, W = kernels.plane_symbol(solid, k.ravel()).reshape(3, *k.shape)
    return U, V, W, rotation_along_wave(solid, k)


def rotation_along_wave(solid: Cosserat, k: Array) -> Array:
    """Returns W_par at wavenumbers k (1/length)."""
    g = solid.curvature + solid.beta_prime
    G = g + solid.alpha_prime
    tau = 2 * solid.beta / solid.ell**2
    s = np.sqrt(k**2 + tau / solid.curvature)
    s1 = np.sqrt(k**2 + 4 * solid.eta / (solid.ell**2 * G))
    bracket = s / (G * (s1 + k)) + k / (solid.curvature * (s + k))
    return np.asarray(s / (4 * solid.mu * (2 * g * k**2 + tau - (g * k) ** 2 * bracket)))


def require_stable(solid: Cosserat) -> None:
    """Raises BadArgument for elliptic moduli, (13), that let the surface turn without a moment."""
    k = np.geomspace(1e-6, 1e6, 1201) / solid.ell
    require(
        np.all(rotation_along_wave(solid, k) > 0),
        "beta_prime",
        solid.beta_prime,
        f"makes a half-space unstable with alpha' = {solid.alpha_prime:g} and gamma' = "
        f"{solid.curvature:g}: short waves of its surface turn by themselves",
    )
