"""
Two bodies that deform
======================
A second body that deforms carries the kinks of the pressure from corner to corner: weaker ones appear a
block's side away.

:Geometry:  half-plane :math:`x_2 < 0` with blocks of the side :math:`\\ell` at its surface; a second
            half-plane above it, whose undeformed surface is a cylinder :math:`x_1^2/(2R)`; they are pressed
            together by P per thickness
:Equations: (10)-(18) in both, corner gaps (20)-(22), contact conditions (26); a corner presses the second
            body half a block beside the contact point
:Method:    panels on the contact line, no mesh
:Reference: Hertz for small blocks, with :math:`1/E^* = 1/E_1^* + 1/E_2^*`; a rigid second body
:Units:     those of Hertz with both moduli: lengths over :math:`a_\\mathrm{Hz}`, pressures over
            :math:`p_\\mathrm{Hz}`
"""

import math
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

# %%
# With E* = 2 R of both bodies together and P = pi/2 both scales of Hertz are 1.

R, LOAD = 10.0, math.pi / 2


def solve(
    second: Literal["same", "classical"] = "same", alpha=0.25, nu=0.3, beta=1.0, psi0_deg=0.0, rtol=1e-4
):
    """States under the second body and under a rigid one.

    Parameters
    ----------
    second : the solid of the second body, as stiff as the first one
    alpha : side of a block over a_Hz
    nu : Poisson's ratio
    beta : coupling of rotations, between 0 and 2
    psi0_deg : initial rotation of the blocks in degrees
    rtol : relative error of each state
    """
    law, E = mb.Microblock(psi0=math.radians(psi0_deg)), 2 * R * (1 - nu**2)
    soft, solid = (mb.Cosserat(E=ratio * E, nu=nu, ell=alpha, beta=beta) for ratio in (2, 1))
    of_cylinder = soft if second == "same" else mb.Cosserat(E=2 * E, nu=nu, ell=alpha, beta=0)
    cylinder = mb.Deformable(mb.HalfPlane(of_cylinder), mb.Cylinder(R))
    pairs = {"deforms": (soft, cylinder), "rigid": (solid, mb.Cylinder(R))}
    return {
        words: mb.Contact(mb.HalfPlane(solid), obstacle, law).solve(load=LOAD, rtol=rtol)
        for words, (solid, obstacle) in pairs.items()
    }


def figure(states):
    """Pressure and micromoment under both."""
    drawing, (top, bottom) = plt.subplots(2, 1, sharex=True, figsize=(3.54, 4.0), layout="constrained")
    x = np.linspace(-1.2, 1.2, 1201)
    for words, state in states.items():
        top.plot(x, state.pressure_at(x), label=words)
        bottom.plot(state.x, state.micromoment / state.solid.ell)
    top.set_ylabel(r"$p/p_\mathrm{Hz}$")
    bottom.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\,\ell)$")
    drawing.legend(loc="outside upper center", ncols=2, title="second body")
    return drawing


if __name__ == "__main__":
    states = solve()
    for words, state in states.items():
        print(
            f"{words}: half-width {state.half_width:.4f}, full contact up to {state.zones['full'][0][1]:.4f}"
        )
    figure(states)
    plt.show()
