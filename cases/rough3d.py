"""
Rough surface in three dimensions
=================================
More of a rough surface touches where its blocks have half the size of its shortest waves; less touches where
blocks have one corner.

At small pressures a classical half-space touches in proportion to the mean pressure :math:`p_0`, with
:math:`\\kappa` from :math:`\\sqrt{8/\\pi}` (Persson) to :math:`\\sqrt{2\\pi}` (Bush, Gibson and Thomas).
These theories know nothing of blocks. The bearing area, of all that overlaps at the same mean separation of
the surfaces, is twice the real one at small pressures and falls below it at large ones.

:Geometry:  half-space :math:`x_3 < 0`, one period of a rigid self-affine surface; blocks are cubes
:Equations: (10)-(17) in the half-space, gaps of four corners, conditions (26) on each of them
:Method:    square cells, products by FFT
:Reference: the classical half-space (one corner, coupling near 0) on the same cells
:Units:     lengths over the period, pressures over :math:`E^*` times the root mean square slope
            :math:`h'`
"""

import math

import matplotlib.pyplot as plt
import numpy as np
from scipy import special

import microblock as mb
from cases.sphere import draw_corners

SLOPE, SHORTEST = 0.1, 16  # root mean square slope; shortest waves, in waves to the period
LAWS = {"microblock": mb.Microblock, "classical": mb.Unilateral, "unilateral": mb.Unilateral}


def solve(alpha=0.5, loads=(0.03, 0.1, 0.3), nu=0.3, beta=1.0, seed=1, cells=128):
    """Returns {name: states at the loads}.

    Parameters
    ----------
    alpha : size of a block over the shortest wave
    loads : mean pressures over E* times the slope
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    seed : seed of the phases of the surface
    cells : cells a side
    """
    surface = mb.RoughSurface(period=1.0, slope=SLOPE, hurst=0.8, waves=(2, SHORTEST), seed=seed)
    states = {}
    for name, law in LAWS.items():
        solid = mb.Cosserat(
            E=(1 - nu**2) / SLOPE, nu=nu, ell=alpha / SHORTEST, beta=1e-9 if name == "classical" else beta
        )
        problem = mb.Contact(mb.HalfSpace(solid, period=1.0), surface, law(), mb.Cells(nodes=cells))
        states[name] = [problem.solve(load=load) for load in loads]
    return states


# %%
# Cells count too much at the rims of contacts: on average (pi - 1 + ln 2)/24 of a cell for each of their
# sides there (Yastrebov, Anciaux and Molinari, 2017).
def fraction(state):
    """Fraction of the surface that touches with a corner."""
    touches = state.closed.reshape(state.shape) > 0
    sides = sum(np.mean(touches != np.roll(touches, 1, axis)) for axis in (0, 1))
    return float(touches.mean() - (math.pi - 1 + math.log(2)) / 24 * sides)


def overlap(state):
    """Fraction of the surface that the undeformed obstacle overlaps at the mean separation of a state."""
    heights = state.problem.obstacle.height(state.x1, state.x2)
    return float(np.mean(heights < state.approach))


def figure(states):
    """Corners that touch at the last load (a); the fraction that touches over the pressure (b)."""
    drawing, (above, below) = plt.subplots(2, 1, figsize=(3.54, 5.2), layout="constrained")
    draw_corners(above, states["microblock"][-1], 1.0)
    above.set(xlabel=r"$x_1$ over the period", ylabel=r"$x_2$ over the period")
    for look, (name, solved) in zip(("o-", ".--", "s-"), states.items()):
        loads = [state.load for state in solved]
        below.semilogx(loads, [fraction(state) / state.load for state in solved], look, label=name)
    bearing = [overlap(state) / state.load for state in states["classical"]]
    below.semilogx(loads, bearing, ":", color="0.4", label="bearing area")
    pressures = np.geomspace(loads[0], loads[-1], 50)
    persson = special.erf(math.sqrt(2) * pressures) / pressures
    below.semilogx(pressures, persson, color="0.4", label="Persson's theory")
    below.set(
        xlabel=r"mean pressure $p_0/(E^* h')$",
        ylabel=r"$\kappa = (A/A_0)\,E^* h'/p_0$",
        xticks=loads,
        xticklabels=np.round(loads, 3),
    )
    below.minorticks_off()
    drawing.legend(loc="outside lower center", ncols=2)
    return drawing


if __name__ == "__main__":
    states = solve()
    print(
        "fractions that touch",
        {name: [round(fraction(state), 4) for state in solved] for name, solved in states.items()},
    )
    figure(states)
    plt.show()
