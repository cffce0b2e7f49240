"""Size effects under a cylinder: width, pressure and hardness over alpha, and alpha_mid.

The problems are those of `hertz` at the load P, under the law of microblocks and under the unilateral law.
Hardness is over P/(2 a_Hz). From alpha_mid on the middle of the contact is open. The nominal hardness needs
an approach: --model fe returns it on the paper's domain of 18 a_Hz.
"""

import math
from functools import partial
from typing import Literal

import numpy as np

import microblock as mb
from microblock.contact_solvers import active_set
from microblock.halfplane.kernels import coalescence_exponent

from .. import size_effect
from ..layers import problems
from . import hertz

ORDERS = 6, 8, 10, 12, 14  # of panels, for alpha_mid over the size of their Gauss spacing
NEAR = 0.86  # ell over a_Hz there: an alpha near to what they give
DOMAIN = "18"  # of the paper, over a_Hz


def solve(
    alphas=(
        *(0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.35, 0.5, 0.65, 0.75, 0.8),
        *(0.83, 0.84, 0.86, 0.9, 1.0, 1.125, 1.25),
    ),
    nu=0.3,
    beta=1.0,
    model: Literal["fe", "halfplane"] | None = None,
    rtol: float | None = None,
):
    """Returns a row for each law and alpha, alpha_mid and its error, and alpha_mid over the size of elements.

    Parameters
    ----------
    alphas : ratios ell/a_Hz
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    model : without it the smallest that can answer is taken, halfplane
    rtol : relative L2 error of pressure and micromoment (1e-6 by halfplane, 1e-4 by fe)
    """
    fe = model == "fe"
    rtol = (1e-4 if fe else 1e-6) if rtol is None else rtol
    common = {"nu": nu, "beta": beta, "model": model, "rtol": rtol}
    options = {
        law: [hertz.resolved(alpha=alpha, contact=law, **common) for alpha in alphas]
        for law in size_effect.LAWS
    }
    limit = classical_hardness(common) if fe else None
    laws = {law: [_row(one, limit) for one in options[law]] for law in size_effect.LAWS}
    (alpha_mid, error), of_h = (by_elements if fe else by_panels)(nu, beta)
    return {
        "parameters": {"model": model or "halfplane", "rtol": rtol},
        "laws": laws,
        "alpha_mid": alpha_mid,
        "alpha_mid_error": error,
        "alpha_mid_of_h": of_h,
        "warnings": []
        if fe
        else ["hardness_nominal needs an approach, which a half-plane does not have: it is null"],
    }


def _row(options, limit):
    """The row of one law and alpha; its nominal hardness is over that of small blocks, (value, error)."""
    record = hertz.observe(options, *hertz.solutions(options)[0])
    nominal, error = nominal_hardness(options) if limit else (None, None)
    return {
        "alpha": options.alpha,
        **{name: record[name] for name in ("half_width", "inner_half_width", "pressure_max")},
        **{name: record[name] for name in ("hardness_apparent", "hardness_real")},
        **{name: record[name] for name in ("error_estimate", "profile")},
        "hardness_nominal": limit and nominal / limit[0],
        "hardness_nominal_error": limit and (error + limit[1]) / limit[0],
    }


def nominal_hardness(options):
    """P/(2 a_nom) on the paper's domain, a_nom = sqrt(d (2 R - d)) from the approach d, and its error.

    The error is the distance from a state of ten times the rtol, on another mesh.
    """
    options.domain, rtol = DOMAIN, options.rtol
    square = hertz.problem(options)
    coarse = square.solve(load=options.P, rtol=min(10 * rtol, 0.5))
    # a mesh for ten times the rtol may reach the rtol, too
    fine = square.solve(load=options.P, rtol=min(rtol, coarse.error_estimate / 10), initial=coarse)
    d = np.array((coarse.approach, fine.approach))
    before, value = (options.P / (2 * np.sqrt(d * (2 * options.R - d)))).tolist()
    return value, abs(value - before)


def classical_hardness(common):
    """The nominal hardness for alpha -> 0, linear in alpha, and its error."""
    (fine, fine_error), (coarse, coarse_error) = (
        nominal_hardness(hertz.resolved(alpha=alpha, contact="unilateral", **common))
        for alpha in (0.01, 0.02)
    )
    return 2 * fine - coarse, 2 * fine_error + coarse_error


def by_panels(nu, beta):
    """((alpha_mid, its error), [(Gauss spacing over a_Hz of a panel of length ell, alpha_mid)])."""
    problem, _ = problems(1.0, nu, beta)
    load, error = event_of(problem)
    loads = {order: meeting(problem.with_(method=mb.Panels(order=order)), load)[0] for order in ORDERS}
    alphas = {order: 1 / math.sqrt(2 * met / math.pi) for order, met in loads.items()}
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return (alpha, alpha * error / load / 2), [(alpha / order, alphas[order]) for order in ORDERS]


def by_elements(nu, beta):
    """((alpha_mid in the limit of elements and domain, its error), [(h over a_Hz, alpha_mid)]).

    The error is that of the interpolation and of the order of the elements. States lie farther from the load
    than those of panels: zones of elements are known to 1e-4 of their distance, which the way to 0 makes 15
    times as large. h is that of bilinear elements on a uniform mesh, of which the node on the axis closes at
    that load.
    """
    near, _ = event_of(problems(1.0, nu, beta)[0])
    orders = (mb.Fitted(order=order) for order in (8, 10))
    (coarse, _), (load, error) = (
        meeting(problems(1.0, nu, beta, mb.Block, order)[0], near, step=1e-2) for order in orders
    )
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return (alpha, alpha * (error + abs(load - coarse)) / load / 2), bilinear(nu, beta)


def event_of(problem):
    """Load at which the zones of a half-plane merge, and its error."""
    (event,) = (event for event in problem.path(load=50.0).events if event.kind == "merged")
    return event.load, event.load_error


def meeting(problem, near, step=3e-3):
    """Load near another at which zones meet on the axis, and its error, from states of a fixed order at four
    loads below it, a share `step` apart: the load is smooth in b^(2 s) with an inner edge at the distance b.
    """
    loads = near * (1 - step * np.arange(1, 5))
    edges = np.array([problem.solve(load=load).zones["A"][0][0] for load in loads])
    passed = edges ** (2 * coalescence_exponent(problem.body.solid))
    load, other = (np.polyfit(passed[:count], loads[:count], count - 1)[-1] for count in (4, 3))
    return float(load), float(abs(load - other))


def bilinear(nu, beta, squares=(0.2, 0.1, 0.05, 0.025)):
    """[(h over a_Hz, alpha_mid)] of bilinear elements on uniform meshes; a_Hz is that of the load."""
    square = partial(mb.Block, size=float(DOMAIN))
    meshes = {h: mb.Uniform(h=h, reach=2.0) for h in squares}
    loads = {h: axis_closes(problems(NEAR, nu, beta, square, mesh)[0].solver) for h, mesh in meshes.items()}
    a_Hz = {h: math.sqrt(2 * load / math.pi) for h, load in loads.items()}
    return [(h / a, NEAR / a) for h, a in a_Hz.items()]


def axis_closes(solver):
    """Load at which the node on the axis closes for good, of a condensed `Uniform` solver of half a body."""
    flexibility, gaps, share = solver.prepare()
    last = solver.solid.E_star * solver.reach**2 / 4  # classical contact would fill the squares under less
    events = active_set.path(flexibility, gaps, last, c=share)
    loads = [event.load for event in events if event.corner == 0 and event.kind == "closes"]
    if not loads:
        raise mb.NotConverged(f"the axis is open up to the load {2 * last:g}", reached=2 * last)
    return 2 * loads[-1]


def figure(result):
    """Returns apparent and real hardness over 1/alpha."""
    hardness = {
        law: {kind: [row[f"hardness_{kind}"] for row in rows] for kind in ("apparent", "real")}
        for law, rows in result["laws"].items()
    }
    alphas = np.array([row["alpha"] for row in result["laws"]["unilateral"]])
    return size_effect.figure({"alphas": alphas, "alpha_mid": result["alpha_mid"], **hardness})
