"""Rigid sphere pressed on a half-space with microblocks: nano-indentation.

Scales are those of Hertz's contact of the sphere, with R = 1 and P = 1: lengths are over a_Hz, pressures over
p_Hz, M over p_Hz ell, psi as psi R/a_Hz and the approach as d R/a_Hz^2.
"""

import math
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases import sphere as script
from cases.sphere import a_Hz
from microblock.errors import BadArgument, require_positive, require_whole
from microblock.model.plain_data import plain_data

p_Hz = 3 / (2 * math.pi * a_Hz**2)


def solve(
    alpha=0.25,
    loads=(1.0,),
    nu=0.3,
    beta=1.0,
    contact: Literal["microblock", "unilateral", "microclamped"] = "microblock",
    alpha_prime=0.0,
    beta_prime=0.0,
    cells: int | None = None,
    rtol: float | None = None,
    period: float | None = None,
):
    """Returns the rtol as resolved, and the state at each load.

    Parameters
    ----------
    alpha : size of a block over Hertz's radius at the load 1
    loads : loads, multiples of P
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    contact : contact law
    alpha_prime : alpha' of (12)
    beta_prime : beta' of (12)
    cells : cells a side; fixes what --rtol would choose
    rtol : relative L2 error of pressure and of micromoment over ell, of means over cells (0.01)
    period : period along x1 and x2 over a_Hz, more than 2; without it there is one sphere
    """
    if period is not None and period <= 2:
        raise BadArgument("period", period, "must be larger than 2")
    require_positive(alpha=alpha, beta=beta)
    if cells is not None:
        require_whole(32, 2048, cells=cells)
        if rtol is not None:
            raise BadArgument("rtol", rtol, "does not go together with --cells: it chooses them")
    elif rtol is None:
        rtol = 1e-2
    width = None if period is None else period * a_Hz
    moduli = {"alpha_prime": alpha_prime, "beta_prime": beta_prime}
    pressed = script.problem(alpha, contact, nu, beta, mb.Cells(nodes=cells), width, **moduli)
    return {"rtol": rtol, "states": [pressed.solve(load=load, rtol=rtol) for load in loads]}


def row(state):
    """Returns what the JSON object has of a state."""
    axis, diagonal = (profile(state, direction) for direction in ("x1", "diagonal"))
    cell = state.width / a_Hz
    return {
        "load": state.load,
        "pressure_centre": np.interp(0.0, axis["x1"], axis["pressure"]),
        "pressure_max": state.pressure.max() / p_Hz,
        "radius": state.radius / a_Hz,
        "radius_x": np.count_nonzero(axis["pressure"] > 0) * cell / 2,
        "radius_diagonal": math.sqrt(2) * np.count_nonzero(diagonal["pressure"] > 0) * cell / 2,
        "approach": state.approach / a_Hz**2,
        "closed": [np.count_nonzero(state.closed == n) * cell**2 / math.pi for n in range(1, 5)],
        **{name: getattr(state, name) for name in ("iterations", "residual", "error_estimate", "unknowns")},
        "profile": {"axis": axis, "diagonal": diagonal},
    }


def profile(state, direction):
    """Returns the state along a line through the middle of the cells, over the scales."""
    M = p_Hz * state.problem.solid.ell
    scales = {"x1": a_Hz, "pressure": p_Hz, "m1": M, "m2": M, "psi1": a_Hz, "psi2": a_Hz}
    return {name: values / scales[name] for name, values in state.along(direction).items()}


def to_dict(result):
    """Returns the JSON object."""
    states = [row(state) for state in result["states"]]
    return plain_data({"parameters": {"rtol": result["rtol"]}, "states": states})


def figure(result):
    """Corners that touch at the last load (a); pressure and micromoment through the middle (b)."""
    drawing, (above, below) = plt.subplots(2, 1, figsize=(3.54, 5.0), layout="constrained")
    state = result["states"][-1]
    script.draw_corners(above, state)
    axis, diagonal = (profile(state, direction) for direction in ("x1", "diagonal"))
    below.plot(axis["x1"], axis["pressure"], label="$p$ along $x_1$")
    below.plot(math.sqrt(2) * diagonal["x1"], diagonal["pressure"], "--", label="$p$, diagonal")
    below.plot(axis["x1"], axis["m2"], "-.", label=r"$M_2/\ell$ along $x_1$")
    below.set(xlabel=r"$r/a_\mathrm{Hz}$", ylabel=r"stress$/p_\mathrm{Hz}$", xlim=above.get_xlim())
    drawing.legend(*below.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawing
