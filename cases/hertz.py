"""
Cylinder on microblocks
=======================
Two strips carry a small load; above the load of coalescence the middle is in full contact.

:Geometry:  half-plane :math:`x_2 < 0` whose surface consists of blocks of side :math:`\\ell`; obstacle
            :math:`x_1^2/(2R)`, force :math:`P` per thickness
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    panels on the contact line, fitted to the zones of each corner; no mesh
:Reference: Hertz for small blocks; the two strips meet at :math:`(\\alpha/0.8343132323)^2` times the load
            that belongs to :math:`a_\\mathrm{Hz}`
:Units:     lengths over :math:`a_\\mathrm{Hz}`, pressures over :math:`p_\\mathrm{Hz}`, (50), loads over P
"""

import math
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

# %%
# Scales of Hertz' contact (50) at the load P. The size of blocks is not among them, so any will do.

E, nu, beta, R, P = 100.0, 0.3, 1.0, 10.0, 1.0
a_Hz, p_Hz = mb.hertz_scales(mb.Cosserat(E=E, nu=nu, ell=1.0, beta=beta), R, P)
LAWS = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}

# %%
# The contact problem, and its states at some loads: each starts from the state before


def problem(alpha=0.25, psi0_deg=0.0, contact="microblock", beta=beta):
    """Returns the contact problem of a cylinder on blocks of side alpha a_Hz."""
    solid = mb.Cosserat(E=E, nu=nu, ell=alpha * a_Hz, beta=beta)
    law = mb.Microblock(psi0=math.radians(psi0_deg)) if contact == "microblock" else LAWS[contact]()
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R), law)


def solve(
    alpha=0.25,
    psi0_deg=0.0,
    loads=(0.02, 0.1, 0.5, 1.0),
    contact: Literal["microblock", "unilateral", "microclamped"] = "microblock",
    rtol=1e-4,
):
    """Returns the states at the loads.

    Parameters
    ----------
    alpha : side of a block over a_Hz
    psi0_deg : initial rotation of the blocks in degrees, counterclockwise
    loads : forces per thickness, over P
    contact : law of contact
    rtol : relative error of pressure and micromoment
    """
    return problem(alpha, psi0_deg, contact).states([load * P for load in loads], rtol=rtol)


# %%
# Pressure and micromoment at each load, and Hertz' pressure, the limit of small blocks


def figure(states, P=P, a_Hz=a_Hz, p_Hz=p_Hz):
    """Returns pressure and micromoment over x1, in the scales of the load P."""
    drawing, (top, bottom) = plt.subplots(2, 1, figsize=(4.0, 3.6), sharex=True, layout="constrained")
    x = 1.2 * max(state.half_width for state in states) * np.linspace(-1, 1, 1200)
    for state in states:
        top.plot(x / a_Hz, state.pressure_at(x) / p_Hz, label=f"$P = {state.load / P:g}$")
        bottom.plot(state.x / a_Hz, state.micromoment / (p_Hz * state.solid.ell))
    if isinstance(states[-1].obstacle, mb.Cylinder):
        hertz = np.sqrt(np.maximum(states[-1].load / P - (x / a_Hz) ** 2, 0))
        top.plot(x / a_Hz, hertz, "k:", label=f"Hertz, $P = {states[-1].load / P:g}$")
    top.set_ylabel(r"$p/p_\mathrm{Hz}$")
    bottom.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\,\ell)$")
    drawing.legend(loc="outside upper center", ncols=3)
    return drawing


if __name__ == "__main__":
    states = solve()
    for state in states:
        print(f"P = {state.load:5.2f}  half-width {state.half_width / a_Hz:.5f} a_Hz")
    meeting = problem().path(load=P).events[-1]
    print(f"the strips meet at P = {meeting.load:.6f}; reference {(0.25 / 0.8343132323) ** 2:.6f}")
    figure(states)
    plt.show()
