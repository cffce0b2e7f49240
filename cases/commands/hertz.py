"""Cylinder, wedge or punch on a half-plane with microblocks: pressure, zones and events over the load.

Equations (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26). Lengths are over a_Hz,
pressures over p_Hz, M over p_Hz ell, psi as psi R/a_Hz, the approach as d R/a_Hz^2 and the energy over
p_Hz a_Hz^3/R, all of them of the cylinder at the load P, (50). Under a punch the pressure has no L2 norm:
--rtol is then that of the Gauss points of the panels, whose weights vanish at the edges. The paper's
discretisation is --model fe --mesh uniform --h 0.02 --order 1 --method al --domain 18.
"""

import inspect
import math
from functools import partial
from types import SimpleNamespace
from typing import Literal

import numpy as np

import microblock as mb
from microblock.errors import BadArgument, at_most
from microblock.model.intervals import least_beside

from . import MATERIAL, OPEN, POSITIVE, refine, require_ranges

EQUAL_SQUARES = 2.0  # half-width and depth of their region, over that of the contact
RANGES = {
    **dict.fromkeys(("alpha", "ell", "loads", "punch_half_width", "rho", "h"), POSITIVE),
    **dict.fromkeys(("tilt_deg", "psi0_deg"), (-45.0, 45.0)),
    "beta": MATERIAL["beta"],
    "wedge_deg": (1e-12, 45.0),
    "rtol": (0.0, 1.0, OPEN),
}


def solve(
    alpha: float | None = None,
    ell: float | None = None,
    E=100.0,
    nu=0.3,
    beta=1.0,
    R=10.0,
    P=1.0,
    loads=(1.0,),
    obstacle: Literal["cylinder", "wedge", "punch"] = "cylinder",
    wedge_deg=1.0,
    punch_half_width=1.0,
    tilt_deg=0.0,
    psi0_deg=0.0,
    psi0_reading: Literal["gap", "lever"] = "gap",
    contact: Literal["microblock", "unilateral", "microclamped"] = "microblock",
    model: Literal["fe", "halfplane"] | None = None,
    domain: str | None = None,
    method: Literal["condensed", "al", "penalty"] | None = None,
    rho: float | None = None,
    mesh: Literal["fitted", "uniform"] | None = None,
    h: float | None = None,
    order: int | None = None,
    rtol: float | None = None,
):
    """Returns the options as resolved, [(State, error estimate)] at the loads, and the load path.

    Parameters
    ----------
    alpha : ell over a_Hz (0.25 if neither it nor --ell is given)
    ell : length scale of the material, in the length unit of R
    E : Young's modulus
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    R : radius of the cylinder; with E, nu and P it sets the units for every obstacle
    P : force per thickness
    loads : loads at which states are returned, as multiples of P
    obstacle : shape of the rigid obstacle
    wedge_deg : slope of the wedge's flanks in degrees
    punch_half_width : half-width of the punch over a_Hz
    tilt_deg : tilt of the punch in degrees, counterclockwise
    psi0_deg : initial rotation of the blocks in degrees, counterclockwise; of microblocks
    psi0_reading : psi0 in gaps and levers, or in the levers only
    contact : law of contact
    model : without it the smallest that can answer is taken, halfplane
    domain : fe: size of the square over a_Hz, or inf for a half-plane (inf if not given)
    method : of fe, condensed if not given; the others go with --mesh uniform
    rho : regularisation of al and penalty (stress over length); without it one that suits the contact
    mesh : of fe, to the zones or near the contact; fitted if not given
    h : fe: near-zone element over a_Hz; with --order alone 0.02 on a uniform mesh
    order : Gauss points on a panel, 4 to 30, or order of the finite elements; fixes what --rtol would choose
    rtol : relative L2 error of pressure and of micromoment over ell, both over the pressure (0.001)
    """
    options = resolved(**locals())
    path = problem(options).path(max(options.loads) * options.P)
    return {"options": options, "states": solutions(options), "path": path}


def resolved(**words):
    """Returns the options with their defaults filled in, the solid, and the scales a_Hz and p_Hz.

    Raises BadArgument for options that are out of range or do not go together.
    """
    defaults = {name: entry.default for name, entry in inspect.signature(solve).parameters.items()}
    options = SimpleNamespace(**defaults | words)
    _check(**vars(options))
    classical = mb.Elastic(options.E, options.nu)
    options.a_Hz, options.p_Hz = mb.hertz_scales(classical, options.R, options.P)
    options.alpha = options.ell / options.a_Hz if options.ell else options.alpha or 0.25
    ell = options.ell or options.alpha * options.a_Hz
    options.ell = None
    options.solid = mb.Cosserat(options.E, options.nu, ell, beta=options.beta)
    options.model = options.model or "halfplane"
    if options.order is None and options.h is None:
        options.rtol = options.rtol or 1e-3
    if options.model == "fe":
        options.mesh = options.mesh or "fitted"
        options.method = options.method or "condensed"
        options.domain = options.domain or "inf"
        if options.rtol is None and options.mesh == "uniform":
            options.h = options.h or 0.02  # section 4.2
            options.order = options.order or 1
        elif options.rtol is None:
            options.order = options.order or 4  # of --h alone: the lowest that rtol takes
    return options


def _check(model, mesh, method, contact, **options):
    """Raises BadArgument for options that are out of range or do not go together."""
    require_ranges(options, RANGES)
    options |= {"mesh": mesh, "method": method}
    chosen = {name: value for name, value in options.items() if value is not None}
    fe = model == "fe"
    uniform = mesh == "uniform"
    lowest, highest = (1 if uniform else 2, 20) if fe else (4, 30)
    rules = [
        ("ell", "alpha" not in chosen, "does not go together with --alpha"),
        ("psi0_deg", contact == "microblock" or not chosen["psi0_deg"], "belongs to --contact microblock"),
        *((name, fe, "belongs to --model fe") for name in ("domain", "mesh", "h", "method", "rho")),
        ("domain", _size(chosen.get("domain", "inf")) > 0, "must be a positive number (over a_Hz), or inf"),
        ("method", uniform or method == "condensed", "goes with --mesh uniform: a fitted mesh is condensed"),
        ("rho", method in ("al", "penalty"), "belongs to --method al or penalty"),
        (
            "order",
            lowest <= (chosen.get("order") or 0) <= highest,
            f"must lie between {lowest} and {highest}",
        ),
        (
            "rtol",
            not {"order", "h"} & set(chosen),
            "does not go together with --order or --h: it chooses them",
        ),
    ]
    for name, allowed, words in rules:
        if name in chosen and not allowed:
            raise BadArgument(name, chosen[name], words)


def _size(domain):
    """Size of the domain over a_Hz, nan where it is no number."""
    try:
        return float(domain)
    except ValueError:
        return math.nan


def problem(options, method=None):
    """Returns the contact problem: on panels, or on finite elements by this method (fitted without it)."""
    obstacles = {
        "cylinder": mb.Cylinder(options.R),
        "wedge": mb.Wedge(math.tan(math.radians(options.wedge_deg))),
        "punch": mb.Punch(options.punch_half_width * options.a_Hz, math.tan(math.radians(options.tilt_deg))),
    }
    reading = {"gap": "gaps and levers", "lever": "levers"}[options.psi0_reading]
    laws = {
        "microblock": partial(mb.Microblock, math.radians(options.psi0_deg), reading),
        "unilateral": mb.Unilateral,
        "microclamped": mb.Microclamped,
    }
    law = laws[options.contact]()
    if options.model == "halfplane":
        body = mb.HalfPlane(options.solid)
        method = mb.Panels(order=options.order)
    else:
        body = mb.Block(options.solid, _size(options.domain) * options.a_Hz)
        # a square of finite size has an approach, which falling orders would spoil
        fitted = {"even": math.isfinite(body.size)}
        if options.mesh == "fitted":
            fitted |= {"order": options.order, "spacing": options.h and options.h * options.a_Hz}
        method = method or mb.Fitted(**fitted)
    return mb.Contact(body, obstacles[options.obstacle], law, method)


def solutions(options):
    """Returns [(State, error estimate)] at the loads, as they are given; no estimate on a fixed mesh."""
    if options.mesh == "uniform" and options.rtol is None:
        return [(state, None) for state in _uniform(options, options.h, options.order)]
    if options.mesh == "uniform":
        states, estimate = refine(
            lambda h: _uniform(options, h, 2), (0.4, 0.2, 0.1, 0.05, 0.025), _distance, options.rtol
        )
        return [(state, estimate) for state in states]
    contact = problem(options)
    loads = [load * options.P for load in options.loads]
    if options.model == "fe":  # sooner done, and edges better, without a state to start from
        states = [contact.solve(load, rtol=options.rtol) for load in loads]
    else:
        states = contact.states(loads, rtol=options.rtol)
    return [(state, state.error_estimate) for state in states]


def _uniform(options, h, order):
    """States from load to load on one mesh of squares of side h a_Hz."""
    reach = EQUAL_SQUARES * math.sqrt(max(1.0, *options.loads))
    if options.obstacle == "punch":
        reach = max(reach, EQUAL_SQUARES * options.punch_half_width + options.alpha)
    if not _size(options.domain) > reach:
        raise BadArgument("domain", options.domain, f"must be larger than {reach:g}, that of equal squares")
    newton = None if options.method == "condensed" else mb.Newton(options.method, options.rho)
    squares = mb.Uniform(h * options.a_Hz, order, reach * options.a_Hz, newton)
    return problem(options, squares).states([load * options.P for load in options.loads])


def _distance(coarse, fine):
    """The largest relative distance of states on two meshes."""
    from microblock.fem.mesh_solution import difference  # here: panels do without ngsolve

    return max(difference(first.solution, second.solution) for first, second in zip(coarse, fine))


def observe(options, state, estimate):
    """Returns the record of one state, in the units of the contract."""
    a = options.a_Hz
    p = options.p_Hz
    data = state.to_dict()
    units = {"x": a, "weight": a, "micromoment": p * options.solid.ell, "psi": a / options.R}
    zones = {name: (np.array(values) / a).tolist() for name, values in data["zones"].items()}
    outer = state.half_width / a
    inner = max(np.diff(np.ravel(zones["contact"]))[1::2].tolist(), default=0.0) / 2
    load = state.load / options.P
    return {
        "load": load,
        **extremes(options, state),
        "zones": zones,
        "half_width": outer,
        "inner_half_width": inner,
        "hardness_apparent": load / outer,
        "hardness_real": load / (outer - inner),
        "energy": state.energy / (p * a**3 / options.R),
        "approach": None if state.approach is None else state.approach * options.R / a**2,
        "kkt": state.residual,
        **{name: data[name] for name in ("unknowns", "error_parts", "iterations")},
        "error_estimate": estimate,
        "profile": {
            name: values and np.array(values) / units.get(name, p) for name, values in data["profile"].items()
        },
    }


def extremes(options, state):
    """Pressure at x = 0, the largest pressure, where it is, and the largest micromoment; None where they are
    infinite.
    """
    one_corner = len(state.pressures) == 1
    at_apex = options.obstacle == "wedge" and _covers_apex(state)
    record = {"pressure_centre": None, "pressure_max": None, "pressure_max_at": [], "micromoment_max": None}
    if not (at_apex and one_corner):
        record["pressure_centre"] = float(state.pressure_at(0.0)) / options.p_Hz
    moment = np.abs(state.micromoment).max() if one_corner else None
    if options.obstacle != "punch" and not at_apex:
        nodes = np.arange(len(state.x))
        x = np.interp(np.linspace(0, nodes[-1], 4 * nodes[-1] + 1), nodes, state.x)
        top, places = largest(state.pressure_at, x)
        record["pressure_max"] = top / options.p_Hz
        record["pressure_max_at"] = [place / options.a_Hz for place in places]
        if not one_corner:
            moment = largest(lambda x: abs(state.micromoment_at(x)), x)[0]
    if moment is not None:
        record["micromoment_max"] = float(moment) / (options.p_Hz * options.solid.ell)
    return record


def _covers_apex(state):
    """Whether a corner is closed at the slope discontinuity of the wedge, where its pressure is infinite."""
    corners = state.law.corners if len(state.law.corners) == 2 else ("contact",)
    return any(
        left < place < right
        for corner, place in zip(corners, state.problem.blocks.shifts)
        for left, right in state.zones[corner]
    )


def to_dict(result):
    """Returns the object of the contract."""
    options = result["options"]
    states = [observe(options, *solution) for solution in result["states"]]
    warnings = [words for state, _ in result["states"] for words in state.warnings]
    return {
        "parameters": {name: getattr(options, name) for name in inspect.signature(solve).parameters},
        "model": options.model,
        "unknowns": max(state["unknowns"] for state in states),
        "states": states,
        "events": [
            {
                "load": event.load / options.P,
                "load_error": event.load_error / options.P,
                "kind": event.kind,
                "zone": event.zone,
                "x": event.x / options.a_Hz,
            }
            for event in result["path"].events
        ],
        "warnings": list(dict.fromkeys([*warnings, *unresolved(options)])),
    }


def unresolved(options):
    """A warning of equal squares that are longer than the layer at the surface allows."""
    if options.mesh != "uniform" or options.order is None:
        return []
    from microblock.fem.meshes import longest_element

    longest = longest_element(options.solid, options.order) / options.a_Hz
    if options.h <= longest:
        return []
    return [
        f"elements of order {options.order} longer than {at_most(longest)} a_Hz do not resolve the "
        "layer at the surface: take a smaller h, a higher order, or --mesh fitted"
    ]


def figure(result):
    """Returns pressure and micromoment over x1 at each load."""
    from cases import hertz as script  # here: JSON does without matplotlib

    options = result["options"]
    states = [state for state, _ in result["states"]]
    return script.figure(states, options.P, options.a_Hz, options.p_Hz)


def largest(function, x):
    """Returns (largest value, [x, ...]) of a function of arrays, refined between samples x (ascending)."""
    values = function(x)
    span = x[-1] - x[0]
    padded = np.concatenate(([-np.inf], values, [-np.inf]))
    tops = (values >= padded[:-2]) & (values >= padded[2:]) & (values >= values.max() * (1 - 1e-3))
    peaks = [least_beside(lambda place: -function(place), x, i, 1e-7 * span) for i in np.flatnonzero(tops)]
    top = -min(value for value, _ in peaks)
    places = sorted(place for value, place in peaks if -value >= top * (1 - 1e-9))
    return top, [place for i, place in enumerate(places) if i == 0 or place - places[i - 1] > 1e-6 * span]
