"""
Sphere on microblocks
=====================
Larger blocks make the contact of a sphere stiffer under every law: the sphere moves less. Under microblocks,
and only there, the area of contact grows with them, so that the hardness falls.

Blocks on one corner press on a smaller circle. Blocks on four corners that are far larger than the contact
leave four contacts, each with a quarter of the load.

:Geometry:  half-space :math:`x_3 < 0`, rigid sphere; blocks are cubes that touch with four corners
:Equations: (10)-(17) in the half-space, gaps of four corners, conditions (26) on each of them
:Method:    square cells of the surface, products by FFT
:Reference: Hertz for small blocks; closed forms of large blocks (short lines at the right)
:Units:     :math:`R = P = E^* = 1`; lengths over :math:`a_\\mathrm{Hz}`, pressures over
            :math:`p_\\mathrm{Hz}`, approach over :math:`a_\\mathrm{Hz}^2/R`
"""

import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap

import microblock as mb
from cases.hertz import LAWS

# %%
# Scales of Hertz's contact of a sphere, and the contact problem.

a_Hz = (3 / 4) ** (1 / 3)


def problem(alpha, contact, nu=0.3, beta=1.0, method=None, period=None, **curvatures):
    """The contact problem: `alpha` is the size of a block over a_Hz, `contact` the name of a law."""
    solid = mb.Cosserat(E=1 - nu**2, nu=nu, ell=alpha * a_Hz, beta=beta, **curvatures)
    return mb.Contact(mb.HalfSpace(solid, period), mb.Sphere(R=1.0), LAWS[contact](), method)


def solve(alpha=0.25, alphas=(0.1, 0.3, 1.0, 4.0), nu=0.3, beta=1.0, cells=96):
    """Returns the state at the load 1, and those of other sizes of blocks under each law.

    Parameters
    ----------
    alpha : size of a block over a_Hz
    alphas : sizes for the size effect
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    cells : cells a side
    """
    method = mb.Cells(nodes=cells)
    states = {
        contact: [problem(size, contact, nu, beta, method).solve(load=1.0) for size in alphas]
        for contact in LAWS
    }
    return {"state": problem(alpha, "microblock", nu, beta, method).solve(load=1.0), "sizes": states}


# %%
# Short waves meet the compliance 2/(k E*) over 1 + (1 - nu) beta; a block on one corner rotates, too, which
# adds 1/(2 gamma' mu k). With Hertz, a^3 ~ P/E* and d ~ a^2.
def large_blocks(solid, contact):
    """Approach and hardness, both over Hertz's, for blocks far larger than the contact."""
    softer, contacts = 1 / (1 + (1 - solid.nu) * solid.beta), 1
    if contact == "microblock":
        softer, contacts = softer + 1 / (2 * solid.curvature * (1 - solid.nu)), 4
    radius = (softer / contacts) ** (1 / 3)
    return radius**2, 1 / (contacts * radius**2)


def draw_corners(axis, state, unit=a_Hz):
    """Corners that touch, from above; lengths over a unit."""
    edge = (state.x1[-1] + state.width / 2) / unit
    colours = plt.get_cmap("viridis_r")(np.linspace(0.35, 1, 4))  # seen on white, and turned round on black
    look = {"cmap": ListedColormap(colours), "vmin": 0.5, "vmax": 4.5, "origin": "lower"}
    touching = np.ma.masked_equal(state.closed.reshape(state.shape).T, 0)
    shown = axis.imshow(touching, extent=(-edge, edge, -edge, edge), **look)
    axis.figure.colorbar(shown, ax=axis, ticks=range(1, 5), label="corners that touch")
    axis.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$x_2/a_\mathrm{Hz}$")


def figure(result):
    """Corners that touch; approach and hardness over the size of the blocks."""
    drawing, (above, *below) = plt.subplots(3, 1, figsize=(3.54, 6.4), layout="constrained")
    draw_corners(above, result["state"])
    for number, (contact, states) in enumerate(result["sizes"].items()):
        alphas = np.array([state.problem.solid.ell for state in states]) / a_Hz
        curves = (
            [state.approach / a_Hz**2 for state in states],
            [math.pi * a_Hz**2 * state.load / state.contact_area for state in states],
        )
        for axis, curve, limit in zip(below, curves, large_blocks(states[0].problem.solid, contact)):
            axis.semilogx(alphas, curve, "o-", color=f"C{number}", label=contact)
            axis.plot([1.3 * alphas[-1], 2 * alphas[-1]], [limit, limit], color=f"C{number}")
    for axis, curve in zip(below, ("approach", "hardness")):
        axis.axhline(1, linestyle=":", color="gray")
        axis.minorticks_off()
        axis.set(
            xlabel=r"$\alpha = \ell/a_\mathrm{Hz}$",
            ylabel=f"{curve} over Hertz's",
            xticks=alphas,
            xticklabels=np.round(alphas, 3),
        )
    below[0].set_title("less approach: stiffer under every law", loc="left")
    below[1].set_title("microblock less hard, one corner harder", loc="left")
    drawing.legend(*below[1].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawing


if __name__ == "__main__":
    result = solve()
    print(f"approach {result['state'].approach / a_Hz**2:.4f} of Hertz's")
    figure(result)
    plt.show()
