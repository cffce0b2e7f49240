"""Cylinder with friction under a normal load, then shear loads: stick, slip, and what is dissipated.

E* and R of both bodies together set the scales of the load P (normal = 1): lengths are over a_Hz, pressures
over p_Hz, M over p_Hz ell, psi as psi R/a_Hz, slip over a_Hz^2/R, energies over P a_Hz^2/R, shear over f P.
"""

import math
from typing import Literal

import numpy as np

import microblock as mb
from cases import friction as script
from cases.hertz import LAWS
from microblock.errors import BadArgument

from . import MATERIAL, POSITIVE, require_ranges

RANGES = {
    **dict.fromkeys(("alpha", "friction", "normal"), POSITIVE),
    "beta": MATERIAL["beta"],
    "shear": (-1.0, 1.0),
}


def solve(
    alpha=(0.25,),
    friction=0.3,
    normal=1.0,
    shear=(0.25, 0.5, 0.75, 1.0, 0.0),
    coupled: Literal["yes", "no"] = "yes",
    contact: Literal["microblock", "unilateral", "microclamped"] = "microblock",
    nu=0.3,
    beta=1.0,
    second=("rigid",),
    rtol=1e-2,
):
    """Returns the contact modulus of both bodies, and the history at each size of the blocks.

    Parameters
    ----------
    alpha : sizes of a block over a_Hz
    friction : coefficient of friction
    normal : normal load, a multiple of P
    shear : shear loads over f P at this normal load, -1 to 1, in the order in which they are followed
    coupled : whether shear acts on the gaps
    contact : contact law
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    second : the cylinder: rigid, same as the half-plane, or E2 NU2 BETA2 ALPHA2
    rtol : relative L2 error of pressure, micromoment over ell and shear traction over the friction
    """
    require_ranges(locals(), RANGES)
    histories = []
    for size in alpha:
        obstacle = mb.Cylinder(R=1.0)
        cylinder = second_solid(second, nu, beta, size)
        E_star = 1.0
        if cylinder:
            E_star = 1 / (1 + 1 / cylinder.E_star)
            obstacle = mb.Deformable(mb.HalfPlane(cylinder), obstacle)
        body = mb.HalfPlane(mb.Cosserat(1 - nu**2, nu, size, beta=beta))
        problem = mb.Contact(body, obstacle, LAWS[contact](friction=friction))
        P = normal * math.pi / 4 * E_star
        pairs = [(P, fraction * friction * P) for fraction in (0.0, *shear)]
        histories.append(problem.history(pairs, coupled=coupled == "yes", rtol=rtol))
    return {"E_star": E_star, "normal": normal, "histories": histories}


def second_solid(second, nu, beta, ell):
    """Returns the solid of the cylinder, None of a rigid one; `second` are words of the command."""
    if second == ("rigid",):
        return None
    words = (1.0, nu, beta, ell) if second == ("same",) else second
    try:
        E2, nu2, beta2, ell2 = map(float, words)
        return mb.Cosserat(E2 * (1 - nu**2), nu2, ell2, beta=beta2)
    except ValueError as failure:  # also a BadArgument of the solid
        raise BadArgument(
            "second",
            " ".join(second),
            "must be rigid, same, or E2 (over the first body's modulus), NU2, BETA2 and ALPHA2 (ell2 over "
            f"a_Hz): {failure}",
        ) from failure


def row(state, E_star):
    """Returns what the JSON object has of a state."""
    P = math.pi / 4 * E_star
    p_Hz = E_star / 2
    data = state.to_dict()
    energies = {name: data[name] / P for name in ("dissipation", "energy", "work")}
    scales = {"pressure": p_Hz, "shear": p_Hz, "micromoment": p_Hz * state.solid.ell}
    columns = ("x", "weight", "pressure", "shear", "micromoment", "psi", "slip")
    return {
        "alpha": state.solid.ell,
        "normal": state.load / P,
        "shear": state.shear / (state.law.friction * state.load),
        **{name: data["zones"][name] for name in ("stick", "slip")},
        "zones": {name: data["zones"][name] for name in ("A", "B", "full", "contact")},
        "half_width": state.half_width,
        **energies,
        "balance": abs(energies["work"] - energies["energy"] - energies["dissipation"]),
        "error_estimate": state.error_estimate,
        "unknowns": state.unknowns,
        "profile": {name: np.array(data["profile"][name]) / scales.get(name, 1) for name in columns},
    }


def event_row(event, history, E_star, normal):
    """Returns what the JSON object has of an event."""
    P = math.pi / 4 * E_star
    return {
        "alpha": history.problem.solid.ell,
        **{name: getattr(event, name) for name in ("pair", "kind", "zone", "x")},
        "normal": event.load / P,
        "shear": event.shear / (history.problem.law.friction * normal * P),
        "error": event.load_error and event.load_error / P,
    }


def to_dict(result):
    """Returns the JSON object: at each size of the blocks the state without shear, the others, the events."""
    E_star = result["E_star"]
    histories = result["histories"]
    return {
        "model": "halfplane",
        "pressed": [row(history.states[0], E_star) for history in histories],
        "states": [row(state, E_star) for history in histories for state in history.states[1:]],
        "events": [
            event_row(event, history, E_star, result["normal"])
            for history in histories
            for event in history.events
        ],
    }


def figure(result):
    """Shear traction and stick zones of the first size of the blocks."""
    return script.traction_figure(result["histories"][0].states)
