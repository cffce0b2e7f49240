"""
A neo-Hookean pad
=================
The contact term takes any energy: finite elasticity of the bulk under the unilateral law.

:Geometry:  a pad of 4 by 1 bonded to a rigid base, pressed by a cylinder of radius 2; gaps are those of the
            undeformed surface, so that its slopes must stay small
:Equations: :math:`W = \\frac{\\mu}{2} (I_1 - 2 - 2 \\ln J) + \\frac{\\lambda}{2} (\\ln J)^2` in
            plane strain, with (37)-(40) and one corner
:Method:    quadratic triangles, a multiplier at the nodes, Newton steps of the load
:Reference: linear elasticity with the same moduli, which both approach at small loads
:Units:     lengths over the thickness, stresses over :math:`\\mu`
"""

import matplotlib.pyplot as plt
import netgen.occ as occ
import numpy as np
from ngsolve import (
    BilinearForm,
    Det,
    Grad,
    GridFunction,
    Id,
    InnerProduct,
    Mesh,
    Parameter,
    Sym,
    Trace,
    Variation,
    VectorH1,
    dx,
    log,
)

import microblock as mb
from microblock.fem import semismooth
from microblock.fem.contact_surface import ContactSurface

LAMBDA = 8.0  # over mu: nu = 0.44


def neo_hooke(u):
    """Energy density of a compressible neo-Hookean solid."""
    F = Grad(u) + Id(2)
    J = Det(F)
    return (InnerProduct(F, F) - 2 - 2 * log(J)) / 2 + LAMBDA / 2 * log(J) ** 2


def hooke(u):
    """That of linear elasticity."""
    strain = Sym(Grad(u))
    return LAMBDA / 2 * Trace(strain) ** 2 + InnerProduct(strain, strain)


def solve(size=0.15, approaches=(0.01, 0.05, 0.1, 0.2)):
    """Loads of both solids at the approaches, and the points and last pressures."""
    face = occ.MoveTo(-2, -1).Rectangle(4, 1).Face()
    face.edges.Min(occ.Y).name, face.edges.Max(occ.Y).name = "base", "contact"
    face.edges.Max(occ.Y).maxh = size / 3
    mesh = Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=size))
    contact = ContactSurface(mesh, "contact", order=2)
    corners = contact.corners(mb.Unilateral(), mb.Cylinder(R=2.0))
    space = VectorH1(mesh, order=2, dirichlet="base") * contact.multipliers
    u, lam = space.TrialFunction()
    result = {"x": contact.points[:, 0]}
    for name, energy in {"neo-Hookean": neo_hooke, "linear": hooke}.items():
        approach, form, state = Parameter(0.0), BilinearForm(space), GridFunction(space)
        form += Variation(energy(u) * dx)
        form += Variation(corners.lagrangian(u, None, [lam], rho=10.0, approach=approach))
        pressures = []
        for value in np.atleast_1d(approaches):
            approach.Set(float(value))
            semismooth.solve(form, state)
            pressures.append(corners.pressures(state.components[1:])[0])
        result[name] = np.array(pressures)
    result["loads"] = {name: result[name] @ contact.weights for name in ("neo-Hookean", "linear")}
    return result | {"approaches": np.atleast_1d(approaches)}


def figure(result):
    """Load over approach, and the last pressures."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(5.2, 2.4), layout="constrained")
    for name, style in {"neo-Hookean": "C0o-", "linear": "C1s--"}.items():
        left.plot(result["approaches"], result["loads"][name], style, label=name)
        right.plot(result["x"], result[name][-1], style[:2].rstrip("os") + style[3:], label=name)
    left.set(xlabel=r"$\delta/h$", ylabel=r"$P/(\mu h)$")
    right.set(xlim=(-1.2, 1.2), xlabel="$x_1/h$", ylabel=r"$p/\mu$")
    left.legend()
    return {"rubber": drawing}


if __name__ == "__main__":
    figure(solve())
    plt.show()
