"""The finite element side of `hertz`: which contact problem its options ask for, and its states."""

import math

import microblock as mb
from microblock.errors import at_most
from microblock.model.refinement import refine

DEFAULTS = {"domain": "inf", "method": "condensed", "mesh": "fitted"}
PAPER_H = 0.02  # near-zone element over a_Hz, section 4.2
EQUAL_SQUARES = 2.0  # half-width and depth of their region over a_Hz
HALVINGS = (0.4, 0.2, 0.1, 0.05, 0.025)  # of h, where rtol chooses it
UNIFORM_ORDER = 2  # there
FITTED_ORDER = 4  # of a fitted mesh of which h alone is given: the lowest of rtol
ORDERS = 1, 20


def check(parameters):
    """BadArgument for options of the finite elements that are out of range, or do not go together."""
    size(parameters)
    mesh, method = parameters.mesh or DEFAULTS["mesh"], parameters.method or DEFAULTS["method"]
    if parameters.order is not None and not ORDERS[0] + (mesh == "fitted") <= parameters.order <= ORDERS[1]:
        raise mb.BadArgument(
            "order", parameters.order, f"must lie between {ORDERS[0] + (mesh == 'fitted')} and {ORDERS[1]}"
        )
    if method != "condensed" and mesh != "uniform":
        raise mb.BadArgument("method", method, "goes with --mesh uniform: a fitted mesh is condensed")


def size(parameters):
    """Size of the domain (length), inf for a half-plane."""
    try:
        value = float(parameters.domain or DEFAULTS["domain"])
    except ValueError as failure:
        raise mb.BadArgument("domain", parameters.domain, "must be a number (over a_Hz) or inf") from failure
    if not value > 0:
        raise mb.BadArgument("domain", parameters.domain, "must be positive (over a_Hz), or inf")
    return value * parameters.a_Hz


def resolved(parameters):
    """The options with their defaults filled in."""
    found = {name: getattr(parameters, name) or value for name, value in DEFAULTS.items()}
    found["domain"] = str(found["domain"])
    if found["mesh"] == "uniform" and (parameters.h is not None or parameters.order is not None):
        found["h"], found["order"] = parameters.h or PAPER_H, parameters.order or 1
    return found


def warnings(parameters):
    """Where equal squares are too coarse for the layer at the surface."""
    if parameters.mesh != "uniform" or parameters.h is None:
        return []
    from microblock.fem.meshes import longest_element

    longest = longest_element(parameters.solid, parameters.order) / parameters.a_Hz
    if parameters.h <= longest:
        return []
    return [
        f"elements of order {parameters.order} longer than {at_most(longest)} a_Hz do not resolve the layer "
        "at the surface: take a smaller h, a higher order, or --mesh fitted"
    ]


def solve(parameters):
    """State and error estimate (None where h or order are fixed) at each load, as the loads are given."""
    loads = [load * parameters.P for load in parameters.loads]
    if parameters.mesh == "uniform":
        return _uniform(parameters, loads)
    problem = fitted(parameters)
    states = [problem.solve(load=load, rtol=parameters.rtol) for load in loads]
    return [(state, state.error_estimate) for state in states]


def fitted(parameters):
    """The contact problem on fitted meshes."""
    # a square of finite size has an approach, which falling orders would spoil
    method = {"even": math.isfinite(size(parameters))}
    if parameters.mesh != "uniform" and (parameters.order is not None or parameters.h is not None):
        method |= {
            "order": parameters.order or FITTED_ORDER,
            "spacing": parameters.h and parameters.h * parameters.a_Hz,
        }
    return _problem(parameters, mb.Fitted(**method))


def _problem(parameters, method):
    return mb.Contact(mb.Block(parameters.solid, size(parameters)), parameters.shape, parameters.law, method)


def _uniform(parameters, loads):
    a = parameters.a_Hz
    reach = EQUAL_SQUARES * max(a, math.sqrt(max(parameters.loads)) * a)
    if parameters.obstacle == "punch":
        reach = max(reach, EQUAL_SQUARES * parameters.punch_half_width * a + parameters.solid.ell)
    if not size(parameters) > reach:
        raise mb.BadArgument(
            "domain", parameters.domain, f"must be larger than the region of equal squares, {reach / a:g}"
        )
    newton = None if parameters.method == "condensed" else mb.Newton(parameters.method, parameters.rho)

    def states(h, order):
        """Solutions from load to load on one mesh."""
        return _problem(parameters, mb.Uniform(h * a, order, reach, newton)).solver.states(loads)

    if parameters.h is not None:
        return [(mb.State(one), None) for one in states(parameters.h, parameters.order)]
    from microblock.fem.surface_solution import difference

    found, estimate = refine(
        lambda h: states(h, UNIFORM_ORDER),
        HALVINGS,
        lambda coarse, fine: max(map(difference, coarse, fine)),
        parameters.rtol,
    )
    return [(mb.State(one), estimate) for one in found]
