"""
Rollers and their ends
======================
A straight roller presses its ends into the ground: the load per length rises there without bound. Lundberg's
logarithmic profile takes that away at the load for which it was made. Blocks across an end touch with their
inner corners alone: the peak becomes two, half a block outside the end and half a block inside.

:Geometry:  half-space :math:`x_3 < 0`, rigid roller of radius R and length L along :math:`x_2`, lowered by
            :math:`z(x_2)` towards its ends
:Equations: (10)-(17) in the half-space; Lundberg's profile
            :math:`z = -\\frac{P}{\\pi E^* L} \\log(1 - (2 x_2/L)^2)`
:Method:    square cells of the surface, products by FFT
:Reference: Hertz's line contact of the load P/L: half-width b and largest pressure
            :math:`p_0 = 2P/(\\pi b L)`
:Units:     :math:`b = E^* = 1`, R by the load; pressures over :math:`p_0`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

# %%
# A roller is a height with ends; b^2 = 4 P R/(pi E* L) gives the load of the unit half-width.

R = 100.0


def roller(length, crown=0.0):
    """Returns the height (x1, x2) of a roller; `crown` is the factor P/(pi E* L) of its profile."""

    def height(x1, x2):
        along = np.abs(2 * x2 / length)
        inside = along < 1
        lowered = -crown * np.log1p(-(np.where(inside, along, 0.0) ** 2))
        return np.where(inside, x1**2 / (2 * R) + lowered, np.inf)

    return height


def solve(length=12.0, alpha=0.5, cells=192):
    """Returns {label: state} of rollers with both profiles, and of a straight one on microblocks.

    Parameters
    ----------
    length : length of the roller over b
    alpha : size of a block over b
    cells : cells a side
    """
    load = math.pi * length / (4 * R)
    smooth = mb.HalfSpace(mb.Elastic(E=1 - 0.3**2, nu=0.3))
    blocks = mb.HalfSpace(mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=alpha, beta=1.0))
    method = mb.Cells(nodes=cells, window=(-0.6 * length, 0.6 * length))
    crowned = roller(length, load / (math.pi * length))
    problems = {
        "straight": mb.Contact(smooth, roller(length), mb.Unilateral(), method),
        "Lundberg": mb.Contact(smooth, crowned, mb.Unilateral(), method),
        "straight, microblocks": mb.Contact(blocks, roller(length), mb.Microblock(), method),
    }
    return {label: problem.solve(load=load) for label, problem in problems.items()}


def line_load(state):
    """Returns places along the roller and the load per length there over the mean P/L, arrays (n,)."""
    weights = state.weights.reshape(state.shape) * state.pressure.reshape(state.shape)
    x2 = np.unique(state.x2)
    forces = weights.sum(axis=0) / state.width
    loaded = np.flatnonzero(forces)
    length = state.width * len(loaded)
    return x2, forces * length / state.load


def figure(result):
    """The load per length along rollers."""
    drawing, axis = plt.subplots(figsize=(3.54, 2.8), layout="constrained")
    for label, state in result.items():
        x2, load = line_load(state)
        axis.plot(x2[load > 0], load[load > 0], label=label)
    axis.axhline(1, linestyle=":", color="gray")
    axis.set(xlabel="$x_2/b$", ylabel="load per length over $P/L$", ylim=(0, None))
    axis.set_title("a logarithmic profile takes the peaks away", loc="left")
    drawing.legend(loc="outside lower center", ncols=2)
    return drawing


if __name__ == "__main__":
    result = solve()
    for label, state in result.items():
        print(f"{label}: line load at most {line_load(state)[1].max():.3f} of the mean")
    figure(result)
    plt.show()
