"""Rigid sphere pressed on a half-space with microblocks: nano-indentation.

Scales are those of Hertz's contact of the sphere, with R = 1 and P = 1: lengths are over a_Hz, pressures over
p_Hz, M over p_Hz ell, psi as psi R/a_Hz and the approach as d R/a_Hz^2.
"""

import math
from typing import Literal

import numpy as np

import microblock as mb
from cases import sphere as script
from cases.sphere import a_Hz
from microblock.errors import BadArgument

from . import MATERIAL, OPEN, POSITIVE, require_ranges

p_Hz = 3 / (2 * math.pi * a_Hz**2)
RANGES = {
    "rtol": (0.0, 1.0, OPEN),
    "alpha": POSITIVE,
    "beta": MATERIAL["beta"],
    "cells": (32, 2048),
    "period": (2.0, math.inf, OPEN),
}


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
    require_ranges(locals(), RANGES)
    if cells and rtol is not None:
        raise BadArgument("rtol", rtol, "does not go together with --cells: it chooses them")
    rtol = rtol or (None if cells else 1e-2)
    pressed = script.problem(
        alpha,
        contact,
        nu,
        beta,
        method=mb.Cells(nodes=cells),
        period=period and period * a_Hz,
        alpha_prime=alpha_prime,
        beta_prime=beta_prime,
    )
    return {"rtol": rtol, "states": [pressed.solve(load=load, rtol=rtol) for load in loads]}


def row(state):
    """Returns what the JSON object has of a state."""
    M = p_Hz * state.problem.solid.ell
    cell = state.squares[0].width / a_Hz
    scales = {"x1": a_Hz, "pressure": p_Hz, "m1": M, "m2": M, "psi1": a_Hz, "psi2": a_Hz}
    axis, diagonal = (
        {name: values / scales[name] for name, values in state.along(cut).items()}
        for cut in ("x1", "diagonal")
    )
    return {
        "load": state.load,
        "pressure_centre": state.pressure_at(np.zeros((1, 2)))[0] / p_Hz,
        "pressure_max": state.pressure.max() / p_Hz,
        "radius": math.sqrt(state.contact_area / math.pi) / a_Hz,
        "radius_x": np.count_nonzero(axis["pressure"] > 0) * cell / 2,
        "radius_diagonal": math.sqrt(2) * np.count_nonzero(diagonal["pressure"] > 0) * cell / 2,
        "approach": state.approach / a_Hz**2,
        "closed": [np.count_nonzero(state.closed == n) * cell**2 / math.pi for n in range(1, 5)],
        **{name: getattr(state, name) for name in ("iterations", "residual", "error_estimate", "unknowns")},
        "profile": {"axis": axis, "diagonal": diagonal},
    }


def to_dict(result):
    """Returns the JSON object."""
    return {"parameters": {"rtol": result["rtol"]}, "states": list(map(row, result["states"]))}


def figure(result):
    """Pressure and micromoment at the last load."""
    return result["states"][-1].plot()
