"""
Which length is it? Moduli from half-widths
===========================================
Half-widths under a large cylinder, measured to 0.5 %, leave the side of a block uncertain by a third. A
second, smaller cylinder on the same solid determines it to 3 %.

:Geometry:  half-plane :math:`x_2 < 0`; cylinders of the radii R = 4 and 100, pressed down by five
            loads each
:Equations: (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26)
:Method:    half-widths of panels with a scatter drawn about them, ``identify`` with the large
            cylinder alone and with both; intervals by profile likelihood
:Reference: the moduli of the readings, E = 100 and :math:`\\ell` = 0.085
:Units:     as they come: any stress and any length
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb

TRUE = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
RADII = 100.0, 4.0


def solve(scatter=0.005, ell=0.15, E=80.0, seed=3, loads=5):
    """Identifications with the large cylinder and with both.

    Parameters
    ----------
    scatter : standard deviation of the readings over their size
    ell, E : first guesses
    seed : of the scatter
    loads : number of loads of each cylinder
    """
    rng = np.random.default_rng(seed)
    guess = mb.Cosserat(E=E, nu=TRUE.nu, beta=TRUE.beta, ell=ell)
    forces = np.geomspace(0.1, 2.0, loads)
    problems = []
    tables = []
    sigmas = []
    for R in RADII:
        problem = mb.Contact(mb.HalfPlane(TRUE), mb.Cylinder(R=R), mb.Microblock())
        widths = np.array([state.half_width for state in problem.states(forces, rtol=1e-6)])
        problems.append(problem.with_(solid=guess))
        sigmas.append(scatter * widths)
        tables.append({"load": forces, "half_width": widths * (1 + scatter * rng.standard_normal(loads))})
    return {
        "large cylinder": mb.identify(problems[0], tables[0], ("E", "ell"), sigma=sigmas[0]),
        "both": mb.identify(problems, tables, ("E", "ell"), sigma=sigmas),
    }


def figure(results):
    """The root of the excess of the misfit over E (a) and over the side of a block (b)."""
    drawing, axes = plt.subplots(2, 1, figsize=(3.54, 4.6), layout="constrained")
    for axis, name, label, true in zip(axes, ("E", "ell"), ("$E$", r"$\ell$"), (TRUE.E, TRUE.ell)):
        for look, (title, result) in zip(("s--", "o-"), results.items()):
            values, excess = result.profiles[name]
            axis.plot(values, np.sqrt(excess), look, label=title)
        axis.axhline(math.sqrt(result.threshold), color="0.4", linestyle=":", label="95 %")
        axis.axvline(true, color="0.4", label="true")
        axis.set(xlabel=label, ylabel="root of the excess", ylim=(0, 5))
    axes[0].set_xlim(97, 106)
    axes[1].set_xlim(0.05, 0.15)
    axes[0].legend(ncols=2)
    return drawing


if __name__ == "__main__":
    results = solve()
    print(results)
    figure(results)
    plt.show()
