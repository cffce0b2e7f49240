"""
Compressed strip
================
Two rigid planes compress a strip whose blocks are rotated; they rotate back within a layer below the surface.

:Geometry:  strip of thickness :math:`2H` with :math:`u_1 = u_2 = 0` in the middle; blocks are
            rotated by :math:`\\psi_0`, so that each plane first touches one of their corners; then it
            approaches by :math:`\\delta`
:Equations: (10)-(18) in the solid, which depend on :math:`x_2` alone, and the corner gaps (42), (43)
:Method:    finite elements over the half-thickness, augmented Lagrangian (37)
:Reference: closed form (46)-(49)
:Units:     lengths over H, stresses over :math:`\\mu`
"""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from microblock.fem import meshes

# %%
# The upper half of the strip; at the approach 0 the plane touches the corner that sticks out


def problem(
    ell_over_H=0.5,
    psi0_deg=1.0,
    nu=0.3,
    beta=1.0,
    curvature=2.0,
    order=6,
    elements=4,
    column=False,
    method=None,
):
    """The contact problem on 1D elements over the depth, or on a periodic column of 2D elements."""
    solid = mb.Cosserat(E=2 * (1 + nu), nu=nu, ell=ell_over_H, beta=beta, curvature=curvature)
    mesh = meshes.column(1.0, elements) if column else meshes.line(1.0, elements)
    body = mb.Body(mesh, solid, order, fixed={"u1": "middle", "u2": "middle"}, periodic=column)
    psi0 = math.radians(psi0_deg)
    return mb.Contact(body, mb.Plane(ell_over_H / 2 * abs(psi0)), mb.Microblock(psi0), method or mb.Newton())


def solve(ell_over_H=0.5, psi0_deg=1.0, nu=0.3, beta=1.0, deltas=(0.005, 0.01, 0.03), order=6, elements=4):
    """States at the approaches.

    Parameters
    ----------
    ell_over_H : length scale of the material, and side of a block, over H
    psi0_deg : initial rotation of the blocks in degrees, counterclockwise
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    deltas : approaches of each plane over H, counted from first touch
    order : polynomial order of the elements
    elements : elements per half-thickness
    """
    contact = problem(ell_over_H, psi0_deg, nu, beta, order=order, elements=elements)
    return [contact.solve(approach=delta) for delta in deltas]


# %%
# What a state shows


def fields_over_height(state, x2):
    """psi (n,), u1/H (n,) and u2/H (n,) at the heights x2 (n,) above the middle."""
    mesh = state.fields.body.mesh
    x1 = [] if mesh.dim == 1 else [np.full(np.shape(x2), state.weights.sum() / 2)]
    points = mesh(*x1, np.asarray(x2) - 1)
    return [field(points).ravel() for field in (state.fields.psi, state.fields.u1, state.fields.u2)]


def lengths(state):
    """Layer lengths L_psi and L_u over H: field over derivative at the surface, (48), with the derivatives
    of the fluxes ``M = gamma' ell^2 mu psi'`` and ``0 = sigma_12 = (mu + mu_c) u1' + 2 mu_c psi``.
    """
    solid, ((psi,), (u1,), _) = state.solid, fields_over_height(state, [1.0])
    slope = -2 * solid.mu_c * psi / (solid.mu + solid.mu_c)
    return psi * solid.curvature * solid.ell**2 * solid.mu / state.micromoment[0], u1 / slope


def full_contact(contact):
    """The approach delta_fc at which the second corner closes: gaps are affine in the approach before."""
    law = contact.law
    if law.psi0 == 0:
        return 0.0
    # blocks that rotate as if they were free close both corners at this approach, so delta_fc lies above
    rigid = contact.body.solid.ell / 2 * abs(law.psi0) * (1 - abs(law.psi0))
    first, second = (
        max(contact.solve(approach=approach).gap_at(corner, 0.0) for corner in law.corners)
        for approach in (rigid / 4, rigid / 2)
    )
    if not first > second > 0:
        raise mb.NotConverged("the second corner does not close: rounding at this rho; take a smaller one")
    return rigid / 2 + rigid / 4 * second / (first - second)


def closed_form(state):
    """The closed form (46)-(49) at the approach of a state."""
    from cases.closed_forms import Strip  # for comparison alone: the computation does without it

    solid = state.solid
    return Strip(solid.ell, state.law.psi0, solid.nu, solid.beta, state.approach, solid.curvature)


# %%
# Relative errors in L2 over the thickness

ROUNDING = 1e-13  # of the natural scale of a field: some hundred rounding errors


def rule(state):
    """Gauss points and weights over the half-thickness, exact for what the errors need."""
    elements = state.fields.body.mesh.ne
    points, weights = np.polynomial.legendre.leggauss(state.fields.body.order + 8)
    x2 = (np.arange(elements)[:, None] + (points + 1) / 2) / elements
    return x2.ravel(), np.tile(weights / (2 * elements), elements)


def relative_error(values, reference, weights, scale):
    """Returns the relative L2 error of values against a reference in a quadrature rule; see `relative`."""
    norms = (
        float(np.sqrt(weights @ np.sum(np.atleast_2d(field) ** 2, axis=0)))
        for field in (np.subtract(values, reference), reference)
    )
    return relative(*norms, scale)


def relative(error, size, scale):
    """Returns an error over the size of the reference; where that is rounding of `scale`, 0 if the error is
    too, else inf.
    """
    if size > ROUNDING * scale:
        return error / size
    return 0.0 if error <= ROUNDING * scale else math.inf


def errors(state):
    """Relative L2 errors over the thickness against the closed form: of psi, of u, and of psi as printed."""
    x2, weights = rule(state)
    psi, *u = fields_over_height(state, x2)
    exact = closed_form(state)
    printed = replace(exact, curvature=2.0)
    scale = abs(state.approach)
    return {
        "error_psi": relative_error(psi, exact.psi(x2), weights, scale),
        "error_u": relative_error(u, [exact.u1(x2), exact.u2(x2)], weights, scale),
        "error_psi_paper": relative_error(psi, printed.psi(x2), weights, scale),
    }


# %%
# Symbols are computed, lines are the closed form


def figure(states):
    """Microrotation and displacement over the height above the middle."""
    drawing, axes = plt.subplots(2, 1, sharex=True, layout="constrained", figsize=(3.54, 3.8))
    x2, fine = np.linspace(0, 1, 16), np.linspace(0, 1, 201)
    for number, state in enumerate(states):
        exact = closed_form(state)
        style = {"color": f"C{number}"}
        for axis, name, values in zip(axes, ("psi", "u1"), fields_over_height(state, x2)):
            axis.plot(fine, getattr(exact, name)(fine), **style)
            axis.plot(x2, values, "os^Dv"[number % 5], label=f"{state.approach:.3g}", **style)
    axes[0].set(ylabel=r"$\psi$ (rad)")
    axes[1].set(xlabel="$x_2/H$", ylabel="$u_1/H$")
    labels = axes[0].get_legend_handles_labels()
    drawing.legend(*labels, loc="outside upper center", ncols=5, title=r"$\delta/H$")
    return drawing


if __name__ == "__main__":
    states = solve()
    print("microrotation of the surface", [round(float(state.psi[0]), 6) for state in states])
    print("layer lengths {:.6f} and {:.6f}".format(*lengths(states[0])))
    print(f"full contact from delta = {full_contact(problem()):.6f}")
    figure(states)
    plt.show()
