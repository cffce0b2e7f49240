"""Size effects under a cylinder: width, pressure and hardness over alpha, and alpha_mid at which the middle opens.

The problems are those of `hertz` at the load P, under the law of microblocks and the unilateral one. Hardness is
over P/(2 a_Hz). The nominal hardness needs an approach: --model fe returns it on the paper's domain of 18 a_Hz.
"""

import math
from typing import Literal

import matplotlib.pyplot as plt

import microblock as mb
from microblock.corners import active_set

from . import hertz

ALPHAS = 0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.35, 0.5, 0.65, 0.75, 0.8, 0.83, 0.84, 0.86, 0.9, 1.0, 1.125, 1.25
LAWS = "microblock", "unilateral"
ENTRIES = "half_width", "inner_half_width", "pressure_max", "hardness_apparent", "hardness_real"
ORDERS = 6, 8, 10, 12, 14  # of panels, for alpha_mid over the size of their Gauss spacing
MESHES = (7, 4), (9, 5)  # (order, levels) of fitted meshes for alpha_mid
SQUARES = 0.2, 0.1, 0.05, 0.025  # sides of the squares over a_Hz at which bilinear elements give alpha_mid
NEAR = 0.86  # ell over a_Hz there: an alpha near to what they give
REACH = 2.0  # half-width and depth of the squares, over a_Hz
FINEST = 0.01  # this alpha and twice this give the nominal hardness for alpha -> 0
DOMAIN = "18"  # of the paper, over a_Hz


def solve(
    alphas=ALPHAS,
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
    options = {law: [hertz.resolved(alpha=alpha, contact=law, **common) for alpha in alphas] for law in LAWS}
    laws = {law: [_row(one) for one in options[law]] for law in LAWS}
    if fe:
        limit, limit_error = classical_hardness(common)
        for row, one in zip(sum(laws.values(), []), sum(options.values(), [])):
            nominal, error = nominal_hardness(one)
            row["hardness_nominal"] = nominal / limit
            row["hardness_nominal_error"] = (error + limit_error) / limit
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


def _row(options):
    """The row of one law and alpha, its nominal hardness still empty."""
    ((state, estimate),) = hertz.solutions(options)
    record = hertz.observe(options, state, estimate)
    nominal = {"hardness_nominal": None, "hardness_nominal_error": None}
    entries = {name: record[name] for name in (*ENTRIES, "error_estimate", "profile")}
    return {"alpha": options.alpha, **entries, **nominal}


def nominal_hardness(options):
    """P/(2 a_nom) on the paper's domain, a_nom = sqrt(d (2 R - d)) from the approach d, and its error.

    The error is the distance from ten times the rtol.
    """
    options.domain, state, values = DOMAIN, None, []
    for rtol in (10 * options.rtol, options.rtol):
        state = hertz.problem(options).solve(load=options.P, rtol=rtol, initial=state)
        values.append(options.P / (2 * math.sqrt(state.approach * (2 * options.R - state.approach))))
    return values[1], abs(values[1] - values[0])


def classical_hardness(common):
    """The nominal hardness for alpha -> 0, linear in alpha, and its error."""
    (fine, fine_error), (coarse, coarse_error) = (
        nominal_hardness(hertz.resolved(alpha=alpha, contact="unilateral", **common))
        for alpha in (FINEST, 2 * FINEST)
    )
    return 2 * fine - coarse, 2 * fine_error + coarse_error


def _solid(nu, beta, ell=1.0):
    """A solid with E* = 2, for which a_Hz^2 = 2 P R/pi."""
    return mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=ell, beta=beta)


def by_panels(nu, beta):
    """((alpha_mid, its error), [(Gauss spacing over a_Hz of a panel of length ell, alpha_mid)])."""
    problem = mb.Contact(mb.HalfPlane(_solid(nu, beta)), mb.Cylinder(1.0), mb.Microblock())
    loads = {order: problem.solver.coalescence(order) for order in ORDERS}
    alphas = {order: 1 / math.sqrt(2 * load / math.pi) for order, (load, _) in loads.items()}
    finest, (load, error) = alphas[ORDERS[-1]], loads[ORDERS[-1]]
    return (finest, finest * error / load / 2), [(finest / order, alphas[order]) for order in ORDERS]


def by_elements(nu, beta):
    """((alpha_mid in the limit of elements and domain, its error), [(h over a_Hz, alpha_mid)]).

    The error is that of the extrapolation and of the order together. h is that of bilinear elements on a uniform
    mesh, of which the node on the axis closes at that load.
    """
    from microblock.halfplane.coalescence import coalescence

    problem = mb.Contact(mb.Block(_solid(nu, beta)), mb.Cylinder(1.0), mb.Microblock())
    (coarse, _), (load, error) = (coalescence(problem.solver, *mesh) for mesh in MESHES)
    alpha = 1 / math.sqrt(2 * load / math.pi)
    return (alpha, alpha * (error + abs(load - coarse)) / load / 2), bilinear(nu, beta)


def bilinear(nu, beta, squares=SQUARES):
    """[(h over a_Hz, alpha_mid)] of bilinear elements on a uniform mesh; a_Hz is that of the load."""
    body, of_h = mb.Block(_solid(nu, beta, NEAR), float(DOMAIN)), []
    for h in squares:
        problem = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock(), mb.Uniform(h=h, reach=REACH))
        a_Hz = math.sqrt(2 * axis_closes(problem.solver) / math.pi)
        of_h.append((h / a_Hz, NEAR / a_Hz))
    return of_h


def axis_closes(solver):
    """Load at which the node on the axis closes for good, of a condensed `Uniform` solver of half of the body."""
    if not solver.symmetric:
        raise mb.BadArgument("problem", solver.contact, "must be symmetric")
    _, flexibility, gaps, share = solver.prepare()
    last = solver.solid.E_star * solver.reach**2 / 4  # classical contact would fill the squares under less
    events = active_set.path(flexibility, gaps, [last], c=share).events
    loads = [event.load for event in events if event.corner == 0 and event.kind == "closes"]
    if not loads:
        raise mb.NotConverged(f"the axis is open up to the load {2 * last:g}", reached=2 * last)
    return 2 * loads[-1]


def figure(result):
    """Returns apparent and real hardness over 1/alpha."""
    drawing, axis = plt.subplots(figsize=(4.0, 3.0), layout="constrained")
    for law, kind, style in zip((*LAWS, "microblock"), ("apparent", "apparent", "real"), ("o-", "^-", "s--")):
        rows = result["laws"][law]
        over, hardness = [1 / row["alpha"] for row in rows], [row[f"hardness_{kind}"] for row in rows]
        axis.semilogx(over, hardness, style, label=f"{law}, {kind}")
    axis.axvline(1 / result["alpha_mid"], color="0.6", linestyle=":", label=r"$\alpha_\mathrm{mid}$")
    axis.set(xlabel=r"$1/\alpha$", ylabel=r"$H/H_\mathrm{Hz}$")
    drawing.legend(loc="outside upper center", ncols=2)
    return drawing
