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
from functools import partial

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases.hertz import P, a_Hz, problem
from cases.layers import problems
from microblock.contact_solvers import active_set
from microblock.halfplane.kernels import coalescence_exponent

# %%
# The problems are those of `hertz` under two laws.
# Hardness from the states: over the width between the outermost edges, and over the length in contact

LAWS = "microblock", "unilateral"
ORDERS = 6, 8, 10, 12, 14  # of panels, for alpha_mid over the size of their Gauss spacing
NEAR = 0.86  # ell over a_Hz there: an alpha near to what they give
DOMAIN = 18.0  # of the paper, over a_Hz


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
# The size at which the middle of the contact opens, by states next to the load at which zones meet


def by_panels(nu, beta):
    """((alpha_mid, its error), [(Gauss spacing over a_Hz of a panel of length ell, alpha_mid)])."""
    problem, _ = problems(1.0, nu, beta)
    load, error = event_of(problem)
    loads = {order: meeting(problem.with_(method=mb.Panels(order=order)), load)[0] for order in ORDERS}
    alphas = {order: 1 / math.sqrt(2 * met / math.pi) for order, met in loads.items()}
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return (alpha, alpha * error / load / 2), [(alpha / order, alphas[order]) for order in ORDERS]


def by_elements(nu, beta, orders=(8, 10), squares=(0.2, 0.1, 0.05, 0.025)):
    """((alpha_mid in the limit of elements and domain, its error), [(h over a_Hz, alpha_mid)]).

    The error is that of the interpolation and of the order of the elements. States lie farther from the load
    than those of panels: zones of elements are known to 1e-4 of their distance, which the way to 0 makes 15
    times as large. h is that of bilinear elements on a uniform mesh, of which the node on the axis closes at
    that load.
    """
    near, _ = event_of(problems(1.0, nu, beta)[0])
    (coarse, _), (load, error) = (
        meeting(problems(1.0, nu, beta, mb.Block, mb.Fitted(order=order))[0], near, step=1e-2)
        for order in orders
    )
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return (alpha, alpha * (error + abs(load - coarse)) / load / 2), bilinear(nu, beta, squares)


def event_of(problem):
    """Load at which the zones of a half-plane merge, and its error."""
    (event,) = (event for event in problem.path(load=50.0).events if event.kind == "merged")
    return event.load, event.load_error


def meeting(problem, near, step=3e-3):
    """Load near another at which zones meet on the axis, and its error, from states of a fixed order at four
    loads below it, each less by the fraction `step` of it: the load is smooth in b^(2 s) with an inner edge
    at the distance b.
    """
    loads = near * (1 - step * np.arange(1, 5))
    edges = np.array([problem.solve(load=load).zones["A"][0][0] for load in loads])
    passed = edges ** (2 * coalescence_exponent(problem.body.solid))
    cubic, parabola = (np.polyfit(passed[:count], loads[:count], count - 1)[-1] for count in (4, 3))
    return float(cubic), float(abs(cubic - parabola))


def bilinear(nu, beta, squares):
    """[(h over a_Hz, alpha_mid)] of bilinear elements on uniform meshes; a_Hz is that of the load."""
    square = partial(mb.Block, size=DOMAIN)
    meshes = {h: mb.Uniform(h=h, reach=2.0) for h in squares}
    loads = {h: axis_closes(problems(NEAR, nu, beta, square, mesh)[0].solver) for h, mesh in meshes.items()}
    a_Hz = {h: math.sqrt(2 * load / math.pi) for h, load in loads.items()}
    return [(h / a, NEAR / a) for h, a in a_Hz.items()]


def axis_closes(solver):
    """Load at which the node on the axis closes for good, of a condensed `Uniform` solver of half a body."""
    flexibility, gaps, weights = solver.prepare()
    last = solver.solid.E_star * solver.reach**2 / 4  # classical contact would fill the squares under less
    events = active_set.path(flexibility, gaps, last, c=weights)
    loads = [event.load for event in events if event.corner == 0 and event.kind == "closes"]
    if not loads:
        raise mb.NotConverged(f"the axis is open up to the load {2 * last:g}", reached=2 * last)
    return 2 * loads[-1]


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
