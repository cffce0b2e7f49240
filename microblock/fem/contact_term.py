"""The contact functional in one, two and three dimensions.

Vectors have three components and tensors 3 x 3; what a dimension lacks is 0. NGSolve derives the virtual work
(39) and its tangent. Points of the rule are the contact nodes (section 3.4).
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from ngsolve import CF, Cross, Id, IfPos, InnerProduct, Trace

from ..model.material import Cosserat, Moduli
from ..model.types import Array, Flags


def relative_deformation(gradient: Any, psi: Any) -> Any:
    """(1): ``gamma_ij = u_i,j + epsilon_ijk psi_k``."""
    return gradient + CF((0, psi[2], -psi[1], -psi[2], 0, psi[0], psi[1], -psi[0], 0), dims=(3, 3))


def stress(solid: Cosserat | Moduli, gamma: Any) -> Any:
    """(16), the derivative of (11): lambda tr gamma I + 2 mu gamma^sym + 2 mu_c gamma^skw."""
    direct = solid.mu + solid.mu_c
    transposed = solid.mu - solid.mu_c
    return solid.lam * Trace(gamma) * Id(3) + direct * gamma + transposed * gamma.trans


def couple_stress(solid: Cosserat | Moduli, kappa: Any) -> Any:
    """(17), the derivative of (12): ell^2 mu (alpha' tr kappa I + (gamma' + beta') kappa^sym
    + (gamma' - beta') kappa^skw).
    """
    trace = solid.alpha_prime * Trace(kappa) * Id(3)
    return solid.ell**2 * solid.mu * (trace + solid.curvature * kappa + solid.beta_prime * kappa.trans)


def virtual_work(
    solid: Cosserat | Moduli, strains: tuple[Any, Any], varied: tuple[Any, Any]
) -> tuple[Any, Any]:
    """(14): the work of stress and couple stress of strains (gamma, kappa) on others, densities."""
    gamma, kappa = strains
    d_gamma, d_kappa = varied
    return InnerProduct(stress(solid, gamma), d_gamma), InnerProduct(couple_stress(solid, kappa), d_kappa)


def energy(solid: Cosserat | Moduli, strains: tuple[Any, Any]) -> Any:
    """(10)-(12): the density W of the elastic energy."""
    return sum(virtual_work(solid, strains, strains)) / 2


def gap(g0: Any, normal: Any, arm: Any, u: Any, psi: Any, approach: Any) -> Any:
    """(20)-(22): a corner at `arm` from the centre of its block moves by u + psi x arm, the obstacle by
    `approach`, a vector.
    """
    return g0 + InnerProduct(normal, approach - (u + Cross(psi, arm)))


def lagrangian(g: Any, lam: Any, rho: float) -> Any:
    """(38); with lam = 0 it is the penalty rho/2 <g>_-^2 of (31)."""
    return IfPos(lam + rho * g, -(lam**2) / (2 * rho), (lam + rho / 2 * g) * g)


def gaps(nodes: Any, g0: Array, arms: Array, u: Any, psi: Any, approach: Any) -> Iterator[tuple[Any, Flags]]:
    """Yields the gap (22) of each corner and where it can touch, boolean array (n,), from g0, arrays (n,),
    which are inf elsewhere, and arms, arrays (n, dim).
    """
    normal = nodes.field(nodes.normals)
    for height, arm in zip(g0, arms, strict=True):
        can_touch = np.isfinite(height)
        initial = nodes.field(np.where(can_touch, height, 0.0))
        yield gap(initial, normal, nodes.field(arm), u, psi, approach), can_touch


def density(nodes: Any, corners: Iterable[tuple[Any, Flags]], multipliers: Sequence[Any], rho: float) -> Any:
    """The sum of (38) over corners, (gap, where it can touch), compiled."""
    total: Any = 0
    for (g, can_touch), lam in zip(corners, multipliers, strict=True):
        term = lagrangian(g, lam, rho)
        if not can_touch.all():
            term = IfPos(nodes.field(can_touch - 0.5), term, -(lam**2) / (2 * rho))
        total += term
    return total.Compile()


def work(nodes: Any, g: Any, dg: Any, lam: Any, dlam: Any, rho: float, can_touch: Flags) -> Any:
    """The density of (39) with (40) of a corner: ``lambda_eff dg + C dlambda``."""
    trial = lam + rho * g
    closed = trial * dg + g * dlam
    open_ = -lam / rho * dlam
    if not can_touch.all():
        closed = IfPos(nodes.field(can_touch - 0.5), closed, open_)
    return IfPos(trial, open_, closed)


def contact(
    nodes: Any,
    g0: Array,
    arms: Array,
    u: Any,
    psi: Any,
    multipliers: Sequence[Any],
    approach: Any,
    rho: float,
) -> Any:
    """The contact term of (37), or of (31) where multipliers are 0: the sum of L over the corners, whose g0,
    arrays (n,), are inf where nothing can touch, and whose arms are arrays (n, dim).
    """
    return nodes.integral(density(nodes, gaps(nodes, g0, arms, u, psi, approach), multipliers, rho))
