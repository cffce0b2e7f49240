"""Strip between rigid planes with rotated blocks: layers at its surface, and full contact (section 4.1).

Geometry   thickness 2 H; by symmetry the half 0 <= x2 <= H, u1 = u2 = 0 at x2 = 0. The plane at x2 = H starts
           in touch with one corner of each block and moves by delta.
Equations  (10)-(18) in the strip, the corner gaps (42), (43) at the surface.
Model      line: the depth alone, 1D elements; column: one column of 2D elements, periodic sideways.
Reference  the closed form (46)-(49), which the computation does without.
Units      lengths over H, stresses over mu.
"""

import math
from itertools import product
from typing import Literal

import numpy as np

import microblock as mb
from microblock.errors import at_most, out_of_reach
from microblock.fem import meshes

from .. import strip
from . import MATERIAL, OPEN, refine, require_ranges

RANGES = MATERIAL | {
    "ell_over_H": (1e-6, 1e6),
    "psi0_deg": (-45, 45),
    "delta_over_H": (-1, 1),
    "curvature": (1e-6, 1e6),
    "rho": (1e-12, 1e16),
    "order": (1, 20),
    "elements": (1, 4000),
    "rtol": (0.0, 1.0, OPEN),
}


def solve(
    ell_over_H=0.5,
    psi0_deg=1.0,
    nu=0.3,
    beta=1.0,
    delta_over_H=0.02,
    curvature=2.0,
    model: Literal["line", "column"] = "line",
    method: Literal["al", "penalty"] = "al",
    rho: float | None = None,
    order: int | None = None,
    elements: int | None = None,
    rtol: float | None = None,
):
    """The strip to the accuracy, or on the discretisation, that is asked for.

    Parameters
    ----------
    ell_over_H : length scale of the material over H
    psi0_deg : initial rotation of the blocks in degrees, counterclockwise
    nu : Poisson's ratio, -1 < nu < 1/2
    beta : coupling number 2 eta/(1 + eta), 0 < beta < 2
    delta_over_H : approach of each plane over H, counted from first touch
    curvature : coefficient gamma' of the curvature energy
    model : depth alone, or one periodic column of 2D elements
    method : augmented Lagrangian or penalty
    rho : regularisation over mu/H; without it the stiffness of the strip (al), or what rtol asks for
        (penalty)
    order : polynomial order of u and psi, 1 to 20 (1 if only --elements is given)
    elements : elements per half-thickness (20 if only --order is given)
    rtol : relative L2 error; chooses order and elements, not together with them (1e-09 if nothing is given)
    """
    options = dict(locals())
    failures = []
    require_ranges(options, RANGES)
    if rtol is not None and (order or elements):
        raise mb.BadArgument("rtol", rtol, "chooses order and elements: leave out --order and --elements")
    if order or elements:
        return results(options | {"order": order or 1, "elements": elements or 20})
    # where nothing is asked for: the first that rounding allows
    for tolerance in (1e-9, 1e-6, 1e-3) if rtol is None else (rtol,):
        try:
            return results(options | {"rtol": tolerance}, rtol is not None, *failures)
        except mb.NotConverged as failure:
            failures.append(failure)
    raise failures[-1]


def results(options, demanded=False, *failures):
    """(State, JSON object) on the discretisation of the options, or refined to their rtol."""
    rtol = options["rtol"]
    rho = options["rho"]
    estimate = None
    if rtol is None:
        state, delta_fc = solved(options)
    else:
        (state, delta_fc), estimate = refine(solved, refinements(options), distance, rtol)
        if options["method"] == "penalty" and rho is not None:  # its error falls like 1/rho
            stiffer = solved(options | resolution(state) | {"rho": 10 * rho})
            estimate += 10 / 9 * distance((state, delta_fc), stiffer)
    if demanded and estimate > rtol:
        raise out_of_reach(
            rtol, estimate, besides=f"take another penalty than rho = {rho:g}, or the augmented Lagrangian"
        )
    return state, {
        "parameters": options | resolution(state),
        **observed(state, delta_fc, options["delta_over_H"]),
        "error_estimate": estimate,
        **strip.errors(state),
        "warnings": warnings(options, state.solid)
        + [f"computed to rtol = {rtol:g}: {failure}" for failure in failures[:1]],
    }


def resolution(state):
    """What fixes the discretisation of a state."""
    solver = state.solution.solver
    return {"order": solver.body.order, "elements": solver.body.mesh.ne, "rho": solver.newton("approach").rho}


def refinements(options):
    """Options with orders 2 to 16 on a mesh of the layer's scale, then on its halvings.

    The rho of the penalty, whose error falls like 1/rho, rises along unless it is given.
    """
    solid = problem(options | {"order": 1, "elements": 1}).body.solid
    coarsest = max(1, math.ceil(1 / (8 * solid.layer_length)))  # order 16 resolves exp(-8) over an element
    most = RANGES["elements"][1]
    if coarsest > most:
        raise mb.NotConverged(
            f"the layer of thickness {solid.layer_length:.1e} H is too thin for a uniform mesh of "
            f"{most} elements; take a larger ell_over_H"
        )
    for halvings, order in product(range(4), range(2, 17, 2)):
        step = options | {"elements": coarsest * 2**halvings, "order": order}
        if options["method"] == "penalty" and options["rho"] is None:
            step["rho"] = (solid.lam + 2 * solid.mu) * 10.0 ** (order // 2 + 1)
        yield step


def problem(options):
    """The contact problem of the options, with order and elements."""
    names = "ell_over_H", "psi0_deg", "nu", "beta", "curvature", "order", "elements"
    return strip.problem(
        *(options[name] for name in names),
        column=options["model"] == "column",
        method=mb.Newton(options["method"], options["rho"]),
    )


def solved(options):
    """(State, delta_fc) on one discretisation."""
    contact = problem(options)
    delta_fc = strip.full_contact(contact)
    # not `Contact.solve`, which refuses planes that do not touch
    solution = contact.solver.solve(None, options["delta_over_H"], None)
    return solution.state(), delta_fc


def distance(coarse, fine):
    """Estimated relative error of (State, delta_fc): of psi and u in L2, of delta_fc and forces by their
    difference, and what rounding leaves.
    """
    state, delta_fc = fine
    scale = abs(state.approach)
    x2, weights = strip.rule(state)
    (psi, *u), (fine_psi, *fine_u) = (strip.fields_over_height(pair[0], x2) for pair in (coarse, fine))
    pressure = abs(state.pressure[0])
    forces = (
        ("pressure", pressure, pressure),
        ("micromoment", abs(state.micromoment[0]), state.solid.ell * pressure),
    )
    lag = state.solid.ell * abs(state.law.psi0)  # corner gaps are differences of lengths as large as delta
    return max(
        strip.relative_error(psi, fine_psi, weights, scale),
        strip.relative_error(u, fine_u, weights, scale),
        *(
            strip.relative(abs(getattr(coarse[0], name)[0] - getattr(state, name)[0]), size, natural)
            for name, size, natural in forces
        ),
        abs(coarse[1] - delta_fc) / (delta_fc or 1.0),
        state.residual,
        np.finfo(float).eps * scale / lag if lag else 0.0,
    )


def observed(state, delta_fc, delta):
    """Surface values with the signs of the paper, layer lengths, and fields over the height."""
    surface = dict(
        zip(("psi_surface", "u1_surface", "u2_surface"), np.ravel(strip.fields_over_height(state, [1.0])))
    )
    traction = -float(state.pressure[0])
    micromoment = float(state.micromoment[0])
    name = "partial"
    if delta <= 0:
        name = "separation"
    elif delta >= delta_fc * (1 - max(1e-11, state.residual)):  # up to rounding of a solve
        name = "full"
    rounding = max(10 * state.residual, strip.ROUNDING)
    lengths = (None, None)
    if delta > 0 and abs(micromoment) > rounding * state.solid.ell * abs(traction):
        lengths = strip.lengths(state)
    x2 = np.linspace(0, 1, max(state.fields.body.mesh.ne, 20) + 1)
    return {
        "state": name,
        **surface,
        "traction": traction,
        "micromoment": micromoment,
        "delta_fc": delta_fc,
        "L_psi": lengths[0],
        "L_u": lengths[1],
        "unknowns": state.unknowns,
        "iterations": state.iterations,
        "kkt": state.residual,
        "profile": dict(zip(("x2", "psi", "u1", "u2"), (x2, *strip.fields_over_height(state, x2)))),
    }


def warnings(options, solid):
    """Where the small-strain model leaves its range of validity, or the elements asked for miss the layer."""
    delta = options["delta_over_H"]
    elements = options["elements"] or math.inf
    longest = meshes.longest_element(solid, options["order"] or 1)
    cases = (
        # there sin and tan leave the small-angle form (41) by over 1 %
        (
            abs(options["psi0_deg"]) > 10,
            f"psi0 = {options['psi0_deg']:g} degrees: beyond the small-angle form (41)",
        ),
        (delta <= 0, f"delta = {delta:g} H: the planes do not press, all fields are zero (separation)"),
        (delta > 0.1, f"delta = {delta:g} H: beyond small strain"),
        (
            options["ell_over_H"] > 1,
            f"ell = {options['ell_over_H']:g} H: the blocks are larger than the half-thickness",
        ),
        (
            1 / elements > longest,
            f"elements of order {options['order']} longer than {at_most(longest)} H do not resolve the "
            "layer: take more, or a higher order, or ask for an --rtol",
        ),
    )
    return [words for holds, words in cases if holds]


def to_dict(result):
    """The JSON object."""
    return result[1]


def figure(result):
    """psi and u1 over the height: symbols computed, lines the closed form."""
    return strip.figure(result[:1])
