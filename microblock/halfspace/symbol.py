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

A shear q along the wave vector belongs to the plane problem: u1 = U q, u = -i Y q and phi = -V q with
``Y = U - 1/(2 mu k)``. A shear across it, q2, excites the same three modes, ``sigma_23 = q2``. With

    h = 1 - g k/(G (s1 + k)),     n = 1 - g k/(gamma' (s + k)),
    N = (4 eta/ell^2 + g k^2) n + g k s (1 + eta) h + eta g k^2 n

it displaces by U_across q2 and rotates by -V_across q2,

    U_across = [N - eta g k^2 (n + h)]/(mu k N),     V_across = eta n/(mu ell N).
"""

from typing import NamedTuple

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


def shear_across_wave(solid: Cosserat, k: Array) -> tuple[Array, Array]:
    """Returns U_across and V_across at wavenumbers k (1/length), arrays like k (length per stress)."""
    g = solid.curvature + solid.beta_prime
    G = g + solid.alpha_prime
    eta = solid.eta
    s = np.sqrt(k**2 + 2 * solid.beta / (solid.ell**2 * solid.curvature))
    s1 = np.sqrt(k**2 + 4 * eta / (solid.ell**2 * G))
    h = 1 - g * k / (G * (s1 + k))
    n = 1 - g * k / (solid.curvature * (s + k))
    bend = g * k**2
    N = (4 * eta / solid.ell**2 + (1 + eta) * bend) * n + g * k * s * (1 + eta) * h
    displaced = (1 - eta * bend * (n + h) / N) / (solid.mu * k)
    return np.asarray(displaced), np.asarray(eta * n / (solid.mu * solid.ell * N))


class ShearSymbol(NamedTuple):
    """What a shear on the face of blocks does, at wavenumbers k, arrays like k, with e along the wave.

    Attributes
    ----------
    lift : Z: the face moves by ``i Z e p`` under a pressure, and down by ``-i Z e.q`` under a shear (length
        per stress)
    along, across : parts of the displacement of the face by q along and across the wave (length per stress)
    turn_along, turn_across : the same of phi under q, and of the face under m (length per stress); where psi
        = 0 of m under q
    """

    lift: Array
    along: Array
    across: Array
    turn_along: Array
    turn_across: Array


def shear_of_points(solid: Cosserat, k: Array) -> ShearSymbol:
    """Returns the symbol of shear on the surface itself."""
    U, V, _, _ = surface_symbol(solid, k)
    U_across, V_across = shear_across_wave(solid, k)
    return ShearSymbol(U - 1 / (2 * solid.mu * k), U, U_across, -V, -V_across)


def shear_of_clamped(solid: Cosserat, k: Array) -> ShearSymbol:
    """Returns the symbol of shear where psi = 0 on the whole surface."""
    U, V, W, W_par = surface_symbol(solid, k)
    U_across, V_across = shear_across_wave(solid, k)
    held = V**2 / W
    across = U_across - V_across**2 / W_par
    return ShearSymbol(U - 1 / (2 * solid.mu * k) - held, U - held, across, V / W, V_across / W_par)


def shear_of_blocks(solid: Cosserat, k: Array) -> ShearSymbol:
    """Returns the symbol of shear on the outer faces of blocks, which move by u - phi, and whose q has the
    moment m = -q.
    """
    U, V, W, W_par = surface_symbol(solid, k)
    U_across, V_across = shear_across_wave(solid, k)
    lift = U - 1 / (2 * solid.mu * k) + V
    return ShearSymbol(lift, U + 2 * V + W, U_across + 2 * V_across + W_par, -V - W, -V_across - W_par)


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
