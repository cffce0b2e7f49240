"""
Size effects under a cylinder
=============================
Larger blocks make the contact wider and softer under the law of microblocks, narrower and harder without it.

:Geometry:  the cylinder on the half-plane of `hertz`, at the load P
:Equations: (10)-(18) in the solid; corner gaps (20)-(22) and conditions (26), or a unilateral surface
:Method:    panels on the contact line
:Reference: Hertz for small blocks; :math:`\\alpha_\\mathrm{mid} = 0.8343132323`, at which the middle opens
:Units:     hardness :math:`P/(2a)` over :math:`P/(2a_\\mathrm{Hz})`; lengths over :math:`a_\\mathrm{Hz}`
"""

import math

import matplotlib.pyplot as plt
import numpy as np

from cases.hertz import P, a_Hz, problem

# %%
# The problems are those of `hertz` under two laws.
# Hardness from the states: over the width between the outermost edges, and over the length in contact

LAWS = "microblock", "unilateral"


def solve(alphas=(0.01, 0.03, 0.1, 0.25, 0.5, 0.7, 0.8, 0.83, 0.84, 0.9, 1.0, 1.25), beta=1.0, rtol=1e-4):
    """Returns hardness and half-width for each law and alpha, and alpha_mid.

    Parameters
    ----------
    alphas : ratios of the side of a block to a_Hz
    beta : coupling number, 0 < beta < 2
    rtol : relative error of pressure and micromoment
    """
    # zones of contact scale with the load, so the load at which they meet gives alpha_mid
    meeting = problem(0.5, beta=beta).path(load=P, rtol=rtol).events[-1]
    result = {"alpha_mid": 0.5 * math.sqrt(P / meeting.load), "alphas": np.array(alphas)}
    for law in LAWS:
        states = [problem(alpha, contact=law, beta=beta).solve(load=P, rtol=rtol) for alpha in alphas]
        result[law] = {
            "half_width": np.array([state.half_width / a_Hz for state in states]),
            "apparent": np.array([a_Hz / state.half_width for state in states]),
            "real": np.array([2 * a_Hz / state.contact_area for state in states]),
        }
    return result


# %%
# Hardness over the ratio of the contact to a block


def figure(result):
    """Returns apparent and real hardness over 1/alpha; they are one until the middle opens."""
    drawing, axis = plt.subplots(figsize=(4.0, 3.0), layout="constrained")
    over = 1 / result["alphas"]
    axis.semilogx(over, result["microblock"]["apparent"], "o-", label="microblock, apparent")
    axis.semilogx(over, result["microblock"]["real"], "s--", label="microblock, real")
    axis.semilogx(over, result["unilateral"]["apparent"], "^-", label="unilateral")
    axis.axvline(1 / result["alpha_mid"], color="0.6", linestyle=":", label=r"$\alpha_\mathrm{mid}$")
    axis.set(xlabel=r"$1/\alpha = a_\mathrm{Hz}/\ell$", ylabel=r"$H/H_\mathrm{Hz}$")
    drawing.legend(loc="outside upper center", ncols=2)
    return drawing


if __name__ == "__main__":
    result = solve()
    print(f"alpha_mid = {result['alpha_mid']:.8f}")
    for law in LAWS:
        print(f"{law}: half-widths", np.round(result[law]["half_width"], 5).tolist())
    figure(result)
    plt.show()
