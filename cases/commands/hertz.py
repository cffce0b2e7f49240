"""Cylinder, wedge or punch on a half-plane with microblocks: pressure, zones and events over the load.

Equations (10)-(18) in the solid, corner gaps (20)-(22), contact conditions (26). Lengths are over a_Hz,
pressures over p_Hz, M over p_Hz ell, psi as psi R/a_Hz, the approach as d R/a_Hz^2 and the energy over
p_Hz a_Hz^3/R, all of them of the cylinder at the load P, (50). Under a punch the pressure has no L2 norm:
--rtol is then that of the Gauss points of the panels, whose weights vanish at the edges. The paper's
discretisation is --model fe --mesh uniform --h 0.02 --order 1 --method al --domain 18.
"""

import functools
import inspect
import math
from types import SimpleNamespace
from typing import Literal

import matplotlib.pyplot as plt
import numpy as np

import microblock as mb
from cases.hertz import LAWS
from microblock.errors import BadArgument, at_most, require_positive, require_tolerance
from microblock.model.refinement import refine
from microblock.model.zones import half_widths, largest

RTOL = 1e-3
ALPHA = 0.25
PAPER_H = 0.02  # near-zone element over a_Hz, section 4.2
EQUAL_SQUARES = 2.0  # half-width and depth of their region, over that of the contact
HALVINGS = 0.4, 0.2, 0.1, 0.05, 0.025  # of h over a_Hz, where rtol chooses it
UNIFORM_ORDER = 2  # there
FITTED_ORDER = 4  # of a fitted mesh of which h alone is given: the lowest that rtol takes
ANGLES = "wedge_deg", "tilt_deg", "psi0_deg"
PSI0_IN = {"gap": "gaps and levers", "lever": "levers"}
SAMPLES = 4  # between two nodes, for largest values


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


def resolved(**given):
    """Returns the options with their defaults filled in, the solid, and the scales a_Hz and p_Hz.

    Raises BadArgument for options that are out of range or do not go together.
    """
    defaults = {name: entry.default for name, entry in inspect.signature(solve).parameters.items()}
    options = SimpleNamespace(**defaults | given)
    _check(**vars(options))
    scaled = mb.Cosserat(options.E, options.nu, 1.0, beta=options.beta)
    options.a_Hz, options.p_Hz = mb.hertz_scales(scaled, options.R, options.P)
    options.alpha = options.ell / options.a_Hz if options.ell else options.alpha or ALPHA
    options.ell, ell = None, options.ell or options.alpha * options.a_Hz
    options.solid = mb.Cosserat(options.E, options.nu, ell, beta=options.beta)
    options.model = options.model or "halfplane"
    if options.order is None and options.h is None:
        options.rtol = options.rtol or RTOL
    if options.model == "fe":
        options.mesh, options.method = options.mesh or "fitted", options.method or "condensed"
        options.domain = options.domain or "inf"
        if options.rtol is None and options.mesh == "uniform":
            options.h, options.order = options.h or PAPER_H, options.order or 1
        elif options.rtol is None:
            options.order = options.order or FITTED_ORDER
    return options


def _check(model, mesh, method, contact, loads, **given):
    """Raises BadArgument for options that are out of range or do not go together."""
    given |= {"mesh": mesh, "method": method}
    said = {name: value for name, value in given.items() if value is not None}
    numbers = "alpha", "ell", "beta", "wedge_deg", "punch_half_width", "rho", "h"
    require_positive(**{name: said[name] for name in numbers if name in said})
    for load in loads:
        require_positive(loads=load)
    require_tolerance(said.get("rtol", RTOL))
    fe, uniform = model == "fe", mesh == "uniform"
    lowest, highest = (1 if uniform else 2, 20) if fe else (4, 30)
    rules = [
        ("ell", "alpha" not in said, "does not go together with --alpha"),
        *((name, abs(said[name]) <= 45, "must lie between -45 and 45") for name in ANGLES),
        ("psi0_deg", contact == "microblock" or not said["psi0_deg"], "belongs to --contact microblock"),
        *((name, fe, "belongs to --model fe") for name in ("domain", "mesh", "h", "method", "rho")),
        ("domain", _size(said.get("domain", "inf")) > 0, "must be a positive number (over a_Hz), or inf"),
        ("method", uniform or method == "condensed", "goes with --mesh uniform: a fitted mesh is condensed"),
        ("rho", method in ("al", "penalty"), "belongs to --method al or penalty"),
        ("order", lowest <= (said.get("order") or 0) <= highest, f"must lie between {lowest} and {highest}"),
        ("rtol", not {"order", "h"} & set(said), "does not go together with --order or --h: it chooses them"),
    ]
    for name, allowed, words in rules:
        if name in said and not allowed:
            raise BadArgument(name, said[name], words)


def _size(domain):
    """Size of the domain over a_Hz, nan where it is no number."""
    try:
        return float(domain)
    except ValueError:
        return math.nan


def problem(options, method=None):
    """Returns the contact problem: on panels, or on finite elements by this method (fitted without it)."""
    slope = math.tan(math.radians(options.wedge_deg if options.obstacle == "wedge" else options.tilt_deg))
    if options.obstacle == "cylinder":
        obstacle = mb.Cylinder(options.R)
    elif options.obstacle == "wedge":
        obstacle = mb.Wedge(slope)
    else:
        obstacle = mb.Punch(options.punch_half_width * options.a_Hz, slope)
    rotated = math.radians(options.psi0_deg), PSI0_IN[options.psi0_reading]
    law = LAWS[options.contact](*(rotated if options.contact == "microblock" else ()))
    if options.model == "halfplane":
        panels = mb.Panels(order=options.order, fallback=False)
        return mb.Contact(mb.HalfPlane(options.solid), obstacle, law, panels)
    size, fixed = _size(options.domain) * options.a_Hz, {}
    if options.mesh == "fitted" and options.order is not None:
        fixed = {"order": options.order, "spacing": options.h and options.h * options.a_Hz}
    # a square of finite size has an approach, which falling orders would spoil
    method = method or mb.Fitted(even=math.isfinite(size), **fixed)
    return mb.Contact(mb.Block(options.solid, size), obstacle, law, method)


def solutions(options):
    """Returns [(State, error estimate)] at the loads, as they are given; no estimate on a fixed mesh."""
    if options.mesh == "uniform" and options.rtol is None:
        return [(state, None) for state in _uniform(options, options.h, options.order)]
    if options.mesh == "uniform":
        coarse_to_fine = functools.partial(_uniform, options, order=UNIFORM_ORDER)
        states, estimate = refine(coarse_to_fine, HALVINGS, _distance, options.rtol)
        return [(state, estimate) for state in states]
    contact, states = problem(options), []
    for load in options.loads:
        before = states[-1] if states and options.model == "halfplane" else None
        states.append(contact.solve(load * options.P, rtol=options.rtol, initial=before))
    return [(state, state.error_estimate) for state in states]


def _uniform(options, h, order):
    """States from load to load on one mesh of squares of side h a_Hz."""
    reach = EQUAL_SQUARES * math.sqrt(max(1.0, *options.loads))
    if options.obstacle == "punch":
        reach = max(reach, EQUAL_SQUARES * options.punch_half_width + options.alpha)
    if not _size(options.domain) > reach:
        words = f"must be larger than the region of equal squares, {reach:g}"
        raise BadArgument("domain", options.domain, words)
    newton = None if options.method == "condensed" else mb.Newton(options.method, options.rho)
    squares = mb.Uniform(h * options.a_Hz, order, reach * options.a_Hz, newton)
    solver = problem(options, squares).solver
    return [mb.State(one) for one in solver.states([load * options.P for load in options.loads])]


def _distance(coarse, fine):
    """The largest relative distance of states on two meshes."""
    from microblock.fem.surface_solution import difference  # here: panels do without ngsolve

    return max(difference(one.solution, other.solution) for one, other in zip(coarse, fine))


def observe(options, state, estimate):
    """Returns the record of one state, in the units of the contract."""
    a, p, data = options.a_Hz, options.p_Hz, state.to_dict()
    profile = {name: values and np.array(values) for name, values in data["profile"].items()}
    units = {"x": a, "weight": a, "micromoment": p * options.solid.ell, "psi": a / options.R}
    zones = {name: (np.array(pairs) / a).tolist() for name, pairs in data["zones"].items()}
    outer, inner = half_widths(zones["contact"])
    load, corners, wedge = state.load / options.P, len(state.pressures), options.obstacle == "wedge"
    sharp = options.obstacle == "punch" or (wedge and _covers_apex(state))
    x = _between(state.x)
    top, where = (None, []) if sharp else largest(state.pressure_at, x)
    moment = np.abs(state.micromoment).max() if corners == 1 else None
    if corners == 2 and not sharp:

        def micromoment(x):
            levers = state.law.levers(x).items()
            return abs(sum(lever * state.pressure_at(x, corner) for corner, lever in levers))

        moment = state.solid.ell / 2 * largest(micromoment, x)[0]
    return {
        "load": load,
        "pressure_centre": None if wedge and sharp and corners == 1 else float(state.pressure_at(0.0)) / p,
        "pressure_max": top and top / p,
        "pressure_max_at": [place / a for place in where],
        "zones": zones,
        "half_width": outer,
        "inner_half_width": inner,
        "hardness_apparent": load / outer,
        "hardness_real": load / (outer - inner),
        "micromoment_max": None if moment is None else float(moment) / units["micromoment"],
        "energy": state.energy / (p * a**3 / options.R),
        "approach": None if state.approach is None else state.approach * options.R / a**2,
        "kkt": state.residual,
        **{name: data[name] for name in ("unknowns", "error_parts", "iterations")},
        "error_estimate": estimate,
        "profile": {
            name: None if values is None else (values / units.get(name, p)).tolist()
            for name, values in profile.items()
        },
    }


def _between(x):
    """Nodes, and points between each two of them."""
    return np.interp(np.arange(SAMPLES * (len(x) - 1) + 1) / SAMPLES, np.arange(len(x)), x)


def _covers_apex(state):
    """Whether a corner is closed at the slope discontinuity of the wedge, where its pressure is infinite."""
    corners = state.law.corners if len(state.law.corners) == 2 else ("contact",)
    return any(
        left < place < right
        for corner, place in zip(corners, state.law.shifts(state.solid.ell))
        for left, right in state.zones[corner]
    )


def to_dict(result):
    """Returns the object of the contract."""
    options = result["options"]
    states = [observe(options, *solution) for solution in result["states"]]
    warnings = [words for state, _ in result["states"] for words in state.warnings]
    if options.mesh == "uniform" and options.order is not None:
        from microblock.fem.meshes import longest_element

        longest = longest_element(options.solid, options.order) / options.a_Hz
        if options.h > longest:
            warnings.append(
                f"elements of order {options.order} longer than {at_most(longest)} a_Hz do not resolve the "
                "layer at the surface: take a smaller h, a higher order, or --mesh fitted"
            )
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
        "warnings": list(dict.fromkeys(warnings)),
    }


def figure(result):
    """Returns pressure and micromoment over x1 at each load."""
    options = result["options"]
    drawing, axes = plt.subplots(2, 1, figsize=(4.0, 3.6), sharex=True, layout="constrained")
    for state, _ in result["states"]:
        x, moment = _between(state.x), state.micromoment / options.solid.ell
        label = rf"$\bar P = {state.load / options.P:g}$"
        axes[0].plot(x / options.a_Hz, state.pressure_at(x) / options.p_Hz, label=label)
        axes[1].plot(state.x / options.a_Hz, moment / options.p_Hz)
    axes[0].set_ylabel(r"$p/p_\mathrm{Hz}$")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\,\ell)$")
    drawing.legend(loc="outside upper center", ncols=4)
    return drawing
