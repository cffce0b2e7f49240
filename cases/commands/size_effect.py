"""Size effects under a cylinder: width, pressure and hardness over alpha, and alpha_mid.

The problems are those of `hertz` at the load P, under the law of microblocks and under the unilateral law.
Hardness is over P/(2 a_Hz). From alpha_mid on the middle of the contact is open. The nominal hardness needs
an approach: --model fe returns it on the paper's domain of 18 a_Hz.
"""

from typing import Literal

import numpy as np

from .. import size_effect
from . import hertz


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
    laws = {law: [_row(resolved, limit) for resolved in options[law]] for law in size_effect.LAWS}
    (alpha_mid, error), of_h = (size_effect.by_elements if fe else size_effect.by_panels)(nu, beta)
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
    options.domain = f"{size_effect.DOMAIN:g}"
    square = hertz.problem(options)
    coarse = square.solve(load=options.P, rtol=min(10 * options.rtol, 0.5))
    # a mesh for ten times the rtol may reach the rtol, too
    fine = square.solve(load=options.P, rtol=min(options.rtol, coarse.error_estimate / 10), initial=coarse)
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


def figure(result):
    """Returns apparent and real hardness over 1/alpha."""
    hardness = {
        law: {kind: [row[f"hardness_{kind}"] for row in rows] for kind in ("apparent", "real")}
        for law, rows in result["laws"].items()
    }
    alphas = np.array([row["alpha"] for row in result["laws"]["unilateral"]])
    return size_effect.figure({"alphas": alphas, "alpha_mid": result["alpha_mid"], **hardness})
