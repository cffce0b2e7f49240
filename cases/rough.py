"""
Rough surfaces and rough blocks
===============================
Rough contact rests on many small zones, most of them on one corner of the blocks; unevenly rotated blocks
lose the contact of both corners first.

:Geometry:  half-plane :math:`x_2 < 0` with blocks rotated by a self-affine :math:`\\psi_0(x_1)`; (a) under
            a self-affine profile of one period, (b) under a cylinder
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    uniform cells, products by Fourier transforms (``Cells``): no matrix is stored
:Reference: four times as many cells; aligned blocks by panels fitted to the edges
:Units:     (a) lengths over the period, pressures over :math:`E^*` times the root mean square slope h'; (b)
            lengths over :math:`a_\\mathrm{Hz}`, :math:`\\psi_0` over :math:`a_\\mathrm{Hz}/R`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb


def rotation(size, period, waves, seed):
    """psi0(x): a self-affine function of the root mean square `size`."""
    profile = mb.Rough(period, 1.0, waves=waves, seed=seed)
    scale = size / np.std(profile.height(np.linspace(0, period, 16 * waves[1])))
    return lambda x: scale * profile.height(x)


# %%
# A rough profile on rough blocks. With E* = 1/slope the unit of pressure is 1.


def profile(load=0.3, ell=0.001, psi0_deg=0.5, slope=0.05, waves=(4, 512), seed=1, nodes=32768):
    """The state at a mean pressure."""
    solid = mb.Cosserat(E=0.91 / slope, nu=0.3, ell=ell, beta=1)
    law = mb.Microblock(rotation(math.radians(psi0_deg), 1.0, waves, seed + 1))
    obstacle = mb.Rough(1.0, slope, waves=waves, seed=seed)
    return mb.Contact(mb.HalfPlane(solid, period=1.0), obstacle, law, mb.Cells(nodes=nodes)).solve(load=load)


# %%
# A cylinder on rough blocks. With E* = 2 R and P = pi/2 both scales of Hertz are 1.


def cylinder(psi0=0.1, seed=1, alpha=0.1, R=20.0, nodes=2048):
    """The state of one psi0(x), whose root mean square is `psi0` a_Hz/R; with waves of alpha/2 at least."""
    solid = mb.Cosserat(E=2 * R * 0.91, nu=0.3, ell=alpha, beta=1)
    law = mb.Microblock(rotation(psi0 / R, 4.0, (4, int(8 / alpha)), seed))
    cells = mb.Cells(nodes=nodes, window=(-2, 2))
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R), law, cells).solve(load=math.pi / 2)


def solve(psi0=(0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0), seeds=6, load=0.3, nodes=16384):
    """A state under the rough profile; lengths in contact under the cylinder, arrays (psi0, seeds).

    Parameters
    ----------
    psi0 : root mean squares of psi0 under the cylinder, over a_Hz/R
    seeds : number of functions psi0(x) at each
    load : mean pressure on the profile, over E* h'
    nodes : cells of the profile
    """
    if seeds < 1:
        raise mb.BadArgument("seeds", seeds, "must be at least 1")
    states = [[cylinder(size, seed) for seed in range(seeds)] for size in psi0]
    lengths = {
        words: np.array([[np.sum(np.diff(state.zones[zone])) for state in row] for row in states])
        for words, zone in (("one corner or both", "contact"), ("both corners", "full"))
    }
    return {"profile": profile(load, nodes=nodes), "psi0": psi0, "lengths": lengths}


def figure(result):
    """(a) The micromoment where the pressure is largest: at the rim of the grey, one corner carries all."""
    drawing, (top, bottom) = plt.subplots(2, 1, figsize=(3.54, 4.4), layout="constrained")
    state = result["profile"]
    middle = np.argmax(state.pressure)
    half = len(state.x) // 32
    part = slice(max(middle - half, 0), middle + half)
    p = state.pressure[part]
    top.fill_between(state.x[part], -p, p, color="0.7", label=r"$\pm p/(E^* h')$")
    style = {"linewidth": 0.8, "label": r"$2M/(E^* h'\,\ell)$"}
    top.plot(state.x[part], 2 * state.micromoment[part] / state.solid.ell, "C1", **style)
    top.set(xlabel="$x_1$ over the period", ylabel="pressure, micromoment", title="(a) rough profile")
    for words, lengths in result["lengths"].items():
        style = {"marker": ".", "capsize": 2, "label": words}
        bottom.errorbar(result["psi0"], lengths.mean(axis=1), lengths.std(axis=1), **style)
    bottom.set(
        xscale="log",
        xlabel=r"root mean square of $\psi_0 R/a_\mathrm{Hz}$",
        title="(b) cylinder; bars: seeds",
        ylabel=r"length in contact over $a_\mathrm{Hz}$",
        ylim=(0, None),
    )
    for axis in (top, bottom):
        axis.legend(loc="best")
    return drawing


if __name__ == "__main__":
    result = solve()
    print(result["profile"])
    figure(result)
    plt.show()
