"""The contact functional in one, two and three dimensions.

Vectors have three components and tensors 3 x 3; what a dimension lacks is 0. NGSolve derives the virtual work
(39) and its tangent. Points of the rule are the contact nodes (section 3.4).
"""

import numpy as np
from ngsolve import CF, Cross, Id, IfPos, InnerProduct, Trace


def relative_deformation(gradient, psi):
    """(1): ``gamma_ij = u_i,j + epsilon_ijk psi_k``."""
    return gradient + CF((0, psi[2], -psi[1], -psi[2], 0, psi[0], psi[1], -psi[0], 0), dims=(3, 3))


def stress(solid, gamma):
    """(16), the derivative of (11): lambda tr gamma I + 2 mu gamma^sym + 2 mu_c gamma^skw."""
    more, less = solid.mu + solid.mu_c, solid.mu - solid.mu_c  # of gamma and its transpose: half the work
    return solid.lam * Trace(gamma) * Id(3) + more * gamma + less * gamma.trans


def couple_stress(solid, kappa):
    """(17), the derivative of (12): ell^2 mu (alpha' tr kappa I + (gamma' + beta') kappa^sym
    + (gamma' - beta') kappa^skw).
    """
    a, b, c = solid.alpha_prime, solid.beta_prime, solid.curvature
    return solid.ell**2 * solid.mu * (a * Trace(kappa) * Id(3) + c * kappa + b * kappa.trans)


def virtual_work(solid, strains, varied):
    """(14): the work of stress and couple stress of strains (gamma, kappa) on others, densities."""
    (gamma, kappa), (d_gamma, d_kappa) = strains, varied
    return InnerProduct(stress(solid, gamma), d_gamma), InnerProduct(couple_stress(solid, kappa), d_kappa)


def energy(solid, strains):
    """(10)-(12): the density W of the elastic energy."""
    return sum(virtual_work(solid, strains, strains)) / 2


def gap(g0, normal, arm, u, psi, approach):
    """(20)-(22): a corner at `arm` from the centre of its block moves by u + psi x arm, the obstacle by
    `approach`, a vector.
    """
    return g0 + InnerProduct(normal, approach - (u + Cross(psi, arm)))


def lagrangian(g, lam, rho):
    """(38); with lam = 0 it is the penalty rho/2 <g>_-^2 of (31)."""
    return IfPos(lam + rho * g, -(lam**2) / (2 * rho), (lam + rho / 2 * g) * g)


def contact(nodes, g0, arms, u, psi, multipliers, approach, rho):
    """The contact term of (37), or of (31) where multipliers are 0: the sum of L over the corners, whose g0,
    arrays (n,), are inf where nothing can touch, and whose arms are arrays (n, dim).
    """
    total, normal = 0, nodes.field(nodes.normals)
    for height, arm, lam in zip(g0, arms, multipliers, strict=True):
        near = np.isfinite(height)
        g = gap(nodes.field(np.where(near, height, 0.0)), normal, nodes.field(arm), u, psi, approach)
        term, never = lagrangian(g, lam, rho), -(lam**2) / (2 * rho)
        total += term if near.all() else IfPos(nodes.field(near - 0.5), term, never)
    return nodes.integral(total.Compile())
