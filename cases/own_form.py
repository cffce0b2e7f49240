"""
The contact term in a form of your own
======================================
Write the energy, add the term, step the load: a graded Cosserat layer under a cylinder.

:Geometry:  a layer of thickness 3 on a rigid base, softer at depth, and a cylinder of radius 10
:Equations: (10)-(12) with moduli that fall with depth, (20)-(22), (37)-(40)
:Method:    quadratic H1 elements, a multiplier for each corner at the nodes of the contact boundary
:Reference: the same layer with even moduli, which carries more; `microblock.Body` has the same digits there
:Units:     stresses over the shear modulus at the surface
"""

import matplotlib.pyplot as plt
import ngsolve as ng
from ngsolve import Grad, InnerProduct, Sym, Trace

import microblock as mb
from microblock.fem import meshes, semismooth
from microblock.fem.contact_surface import ContactSurface


def solve(ell=0.25, beta=1.0, depth=0.5, softer=4.0, size=0.1, approaches=(0.02, 0.05, 0.1)):
    """Points x1, and at each approach the pressures of the corners A and B."""
    mesh = meshes.uniform(meshes.Ground(far=3.0, reach=(-1.0, 1.0), half=False), size)
    contact = ContactSurface(mesh, "contact", order=2)
    corners = contact.corners(mb.Microblock(), mb.Cylinder(R=10.0), ell)
    space = ng.VectorH1(mesh, order=2, dirichlet="bottom") * ng.H1(mesh, order=2)
    space = space * contact.multipliers * contact.multipliers
    u, psi, *lam = space.TrialFunction()

    modulus = (1 + (softer - 1) * ng.exp(ng.y / depth)) / softer
    strain = Sym(Grad(u))
    spin = (Grad(u)[0, 1] - Grad(u)[1, 0]) / 2 + psi
    energy = 0.75 * Trace(strain) ** 2 + InnerProduct(strain, strain) + 2 * beta / (2 - beta) * spin**2
    energy += ell**2 * InnerProduct(ng.grad(psi), ng.grad(psi))
    approach = ng.Parameter(0.0)
    form = ng.BilinearForm(space)
    form += ng.Variation(modulus * energy * ng.dx)
    form += ng.Variation(corners.lagrangian(u, psi, lam, rho=1.0, approach=approach))

    state = ng.GridFunction(space)
    pressures = {}
    for value in approaches:
        approach.Set(value)
        semismooth.solve(form, state)
        pressures[value] = corners.pressures(state.components[2:])
    return contact.points[:, 0], pressures


def figure(result):
    """Pressures of both corners at each approach."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.4), layout="constrained")
    for number, (value, (a, b)) in enumerate(result[1].items()):
        axis.plot(result[0], a, f"C{number}", label=rf"$\delta = {value:g}$")
        axis.plot(result[0], b, f"C{number}--")
    axis.set(xlim=(-1, 1.7), xlabel="$x_1$", ylabel=r"$p_A/\mu$, dashed $p_B/\mu$")
    axis.legend()
    return {"own_form": drawing}


if __name__ == "__main__":
    figure(solve())
    plt.show()
