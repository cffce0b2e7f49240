"""
Cylinder with friction
======================
The first shear makes one side of a contact of microblocks stick; from then on the stick zone shrinks as the
shear grows. A cycle of shear dissipates less under microblocks than under blocks on one corner.

Pressing draws the surface inwards. Under microblocks most of it slips, dragged outwards on both sides.
A push to the right continues this slip at the right. At the left it would have to reverse the slip, and all
of this side sticks until the shear traction has changed from its lower to its upper bound. Blocks on two
corners also rotate with the cylinder before they slip: least is dissipated where a block is some 0.3 of the
half-width.

:Geometry:  half-plane :math:`x_2 < 0`, rigid cylinder of radius R
:Equations: (10)-(18), (20)-(22), (26); on each block a shear force of at most f times its normal force
:Method:    cells graded towards all edges, loads followed from event to event
:Reference: Cattaneo and Mindlin: two equal bodies with small blocks dissipate :math:`f^2/2` in a cycle
:Units:     :math:`R = E^* = a_\\mathrm{Hz} = 1`: lengths over :math:`a_\\mathrm{Hz}`, shear loads over
            :math:`f P`, energies over :math:`P a_\\mathrm{Hz}^2/R`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases.hertz import LAWS

P = math.pi / 4  # the load with a_Hz = 1


def history(shears, alpha=0.25, contact="microblock", friction=0.3, nu=0.3, beta=1.0, rtol=0.1):
    """The cylinder is pressed with P, then sheared with these multiples of f P, one after the other."""
    solid = mb.Cosserat(E=1 - nu**2, nu=nu, ell=alpha, beta=beta)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=1.0), LAWS[contact](friction=friction))
    return problem.history([(P, shear * friction * P) for shear in (0.0, *shears)], rtol=rtol)


def dissipation(alpha, contact, friction=0.3, nu=0.3, beta=1.0, rtol=0.1):
    """Energy over P a_Hz^2/R that a cycle dissipates, from full slip to full slip the other way and back."""
    states = history((1.0, -1.0, 1.0), alpha, contact, friction, nu, beta, rtol).states
    return (states[-1].dissipation - states[1].dissipation) / P


def solve(
    alpha=0.25,
    shear=(0.05, 0.25, 0.5, 0.75, 1.0, 0.0),
    alphas=(0.1, 0.2, 0.3, 0.8),
    friction=0.3,
    nu=0.3,
    beta=1.0,
):
    """Returns the history of shear loads, and what a cycle dissipates over the size of the blocks.

    Parameters
    ----------
    alpha : size of a block over a_Hz
    shear : shear loads over f P, in the order in which they are followed
    alphas : sizes of a block over a_Hz for the dissipation
    friction : coefficient of friction f
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    """
    cycles = {law: [dissipation(size, law, friction, nu, beta) for size in alphas] for law in LAWS}
    pushed = history(shear, alpha, friction=friction, nu=nu, beta=beta)
    return {"history": pushed, "alphas": alphas, "dissipation": cycles}


def traction_figure(states):
    """Shear traction over its bound (a), and stick zones (b), one shear load after the other."""
    drawing, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(3.54, 4.0), layout="constrained")
    colours = plt.get_cmap("viridis")(np.linspace(0, 0.6, len(states)))  # lighter ones fade on a white page
    for row, (state, colour) in enumerate(zip(states, colours)):
        bound = state.law.friction * state.pressure
        touching = bound > 0
        top.plot(
            state.x[touching], (state.shear_traction / np.where(touching, bound, 1))[touching], color=colour
        )
        for zones, width in (("contact", 0.8), ("stick", 5)):
            for ends in state.zones[zones]:
                bottom.plot(ends, (row, row), color=colour, linewidth=width, solid_capstyle="butt")
    bottom.set_yticks(
        range(len(states)), [f"{state.shear / (state.law.friction * state.load):.2g}" for state in states]
    )
    top.set(ylabel=r"$q/(f p)$", title="shear traction, colours as below")
    bottom.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$Q/(f P)$", title="thick: stick, thin: slip")
    return drawing


def dissipation_figure(alphas, cycles, friction):
    """Dissipation of a cycle over the size of the blocks, under each law."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.8), layout="constrained")
    axis.axhline(friction**2 / 2, linestyle=":", color="gray", label="Cattaneo, Mindlin")
    for contact, values in cycles.items():
        axis.semilogx(alphas, values, "o-", label=contact)
    axis.set(
        xticks=alphas,
        xticklabels=alphas,
        ylim=(0, None),
        xlabel=r"$\alpha = \ell/a_\mathrm{Hz}$",
        ylabel=r"dissipation$/(P a_\mathrm{Hz}^2/R)$",
    )
    axis.minorticks_off()
    drawing.legend(loc="outside upper center", ncols=2)
    return drawing


def figure(result):
    """The history, and the dissipation of cycles."""
    states, friction = result["history"].states, result["history"].problem.law.friction
    cycles = dissipation_figure(result["alphas"], result["dissipation"], friction)
    return {"friction": traction_figure(states), "friction_dissipation": cycles}


if __name__ == "__main__":
    result = solve()
    print("stick", [np.round(state.zones["stick"], 3).tolist() for state in result["history"].states])
    print("dissipation of a cycle", np.round(list(result["dissipation"].values()), 4).tolist())
    figure(result)
    plt.show()
