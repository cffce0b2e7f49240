"""The Cosserat solid in three dimensions: relative deformation, energy density, stress and couple stress, (1)
and (10)-(17), as expressions of NGSolve.

Fields u = (u1, u2, 0) and psi = (0, 0, psi) of x1 and x2 alone have the energy of plane strain that
`microblock.Cosserat.energy` gives; alpha' and beta' drop out of it.
"""

import ngsolve as ng


def relative_deformation(u, psi):
    """The relative deformation (1), ``u_i,j + epsilon_ijk psi_k``, of vector functions."""
    return ng.Grad(u) + ng.CF((0, psi[2], -psi[1], -psi[2], 0, psi[0], psi[1], -psi[0], 0), dims=(3, 3))


def energy(solid, gamma, kappa):
    """The energy density (10)-(12) from the relative deformation and the curvature ``psi_i,j``, 3x3."""
    work = ng.InnerProduct(stress(solid, gamma), gamma) + ng.InnerProduct(couple_stress(solid, kappa), kappa)
    return work / 2


def stress(solid, gamma):
    """The force stress (16), 3x3."""
    return (
        solid.lam * ng.Trace(gamma) * ng.Id(3)
        + 2 * solid.mu * ng.Sym(gamma)
        + 2 * solid.mu_c * ng.Skew(gamma)
    )


def couple_stress(solid, kappa):
    """The couple stress (17), 3x3."""
    a, b, c = solid.alpha_prime, solid.beta_prime, solid.curvature
    return (
        solid.ell**2
        * solid.mu
        * (a * ng.Trace(kappa) * ng.Id(3) + (c + b) * ng.Sym(kappa) + (c - b) * ng.Skew(kappa))
    )


def virtual_work(solid, fields, varied):
    """The density of the virtual work of the stresses, (14), for pairs (u, psi) and (delta u, delta psi)."""
    gamma, variation = relative_deformation(*fields), relative_deformation(*varied)
    work = ng.InnerProduct(stress(solid, gamma), variation)
    return work + ng.InnerProduct(couple_stress(solid, ng.Grad(fields[1])), ng.Grad(varied[1]))
