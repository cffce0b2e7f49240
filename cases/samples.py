"""
A measured profile
==================
The polygon through samples has a spike of pressure at each sample; a smooth curve through them has none.

:Geometry:  half-plane :math:`x_2 < 0`; a profile given by samples, pressed down by the force P per
            thickness
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    uniform cells on a window, products by Fourier transforms (``Cells``)
:Reference: the formula behind the samples
:Units:     those of the samples
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline

import microblock as mb

# %%
# Here the samples are made up: a roller of the radius 10 with ripples. Yours may come from `np.loadtxt`.

x = np.linspace(-0.6, 0.6, 61)
z = x**2 / 20 + 2e-4 * np.cos(40 * x)


def solve(load=1.0, ell=0.02, nodes=8192):
    """The states of the polygon and of the spline through the samples.

    Parameters
    ----------
    load : force per thickness
    ell : side of a block
    nodes : cells of the window
    """
    body = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1))
    obstacles = {"polygon": mb.Obstacle.from_samples(x, z), "spline": mb.Obstacle(CubicSpline(x, z))}
    cells = mb.Cells(nodes=nodes, window=(-0.55, 0.55))
    return {
        words: mb.Contact(body, obstacle, mb.Microblock(), cells).solve(load=load)
        for words, obstacle in obstacles.items()
    }


def figure(states):
    """The pressures of both."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.6), layout="constrained")
    for words, state in states.items():
        axis.plot(state.x, state.pressure, linewidth=0.8, label=words)
    axis.set(xlabel="$x_1$ (length)", ylabel="$p$ (stress)", xlim=(-0.5, 0.5))
    drawing.legend(loc="outside upper center", ncols=2)
    return drawing


if __name__ == "__main__":
    states = solve()
    print(*states.values(), sep="\n")
    figure(states)
    plt.show()
