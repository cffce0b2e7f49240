"""The finite element side of `hertz`: which scene its options ask for, its states and its events."""

import math
from itertools import groupby

import numpy as np

from microblock import active_set
from microblock.adapt import climb
from microblock.body_state import zones_of
from microblock.errors import BadArgument
from microblock.fitted import LADDER, FittedContact
from microblock.halfplane import coalescence_exponent
from microblock.meshes import longest_element
from microblock.observables import zone_changes
from microblock.surface_state import difference
from microblock.uniform import UniformContact

DEFAULTS = {"domain": "inf", "method": "condensed", "mesh": "fitted"}
PAPER_H = 0.02                          # near-zone element over a_Hz, section 4.2
EQUAL_SQUARES = 2.0                     # half-width and depth of their region over a_Hz
HALVINGS = (0.4, 0.2, 0.1, 0.05, 0.025)      # of h, where rtol chooses it
UNIFORM_ORDER = 2                       # there
ORDERS = 1, 20
EVENT_MESH = 4, (16, 32)                # order and elements over the reach of the two meshes that see the events


def check(parameters):
    """BadArgument for options of the finite elements that are out of range, or do not go together."""
    size(parameters)
    mesh, method = parameters.mesh or DEFAULTS["mesh"], parameters.method or DEFAULTS["method"]
    for name in ("h", "rho"):
        value = getattr(parameters, name)
        if value is not None and not value > 0:
            raise BadArgument(name, value, "must be positive")
    if parameters.order is not None and not ORDERS[0] + (mesh == "fitted") <= parameters.order <= ORDERS[1]:
        raise BadArgument("order", parameters.order, f"must lie between {ORDERS[0] + (mesh == 'fitted')} and {ORDERS[1]}")
    if parameters.h is not None and parameters.rtol is not None:
        raise BadArgument("rtol", parameters.rtol, "chooses the elements: not together with --h")
    if method != "condensed" and mesh != "uniform":
        raise BadArgument("method", method, "goes with --mesh uniform: a fitted mesh is condensed")
    if parameters.rho is not None and method == "condensed":
        raise BadArgument("rho", parameters.rho, "belongs to --method al and penalty")


def size(parameters):
    """Size of the domain (length), inf for a half-plane."""
    try:
        value = float(parameters.domain or DEFAULTS["domain"])
    except ValueError as failure:
        raise BadArgument("domain", parameters.domain, "must be a number (over a_Hz) or inf") from failure
    if not value > 0:
        raise BadArgument("domain", parameters.domain, "must be positive (over a_Hz), or inf")
    return value*parameters.a_Hz


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
    longest = longest_element(parameters.solid, parameters.order)/parameters.a_Hz
    if parameters.h <= longest:
        return []
    return [f"elements of order {parameters.order} longer than {longest:.2g} a_Hz do not resolve the layer at the surface: take "
            "a smaller h, a higher order, or --mesh fitted"]


def solve(parameters):
    """SurfaceState and error estimate (None where h or order are fixed) at each load, as the loads are given."""
    loads = [load*parameters.P for load in parameters.loads]
    if parameters.mesh == "uniform":
        return _uniform(parameters, loads)
    scene = fitted(parameters)
    if parameters.order is None and parameters.h is None:
        states = [scene.at(load, parameters.rtol) for load in loads]
        return [(state, state.estimate.total) for state in states]
    spacing = parameters.h and parameters.h*parameters.a_Hz
    return [(scene.of_order(load, parameters.order or LADDER[0][0], spacing), None) for load in loads]


def fitted(parameters):
    """The scene on fitted meshes."""
    # a square of finite size has an approach, which falling orders would spoil
    domain = size(parameters)
    return FittedContact(parameters.solid, parameters.shape, parameters.law, domain, even=math.isfinite(domain))


def _uniform(parameters, loads):
    a = parameters.a_Hz
    reach = EQUAL_SQUARES*max(a, math.sqrt(max(parameters.loads))*a)
    if parameters.obstacle == "punch":
        reach = max(reach, EQUAL_SQUARES*parameters.punch_half_width*a + parameters.solid.ell)
    if not size(parameters) > reach:
        raise BadArgument("domain", parameters.domain, f"must be larger than the region of equal squares, {reach/a:g}")

    def states(h, order):
        scene = UniformContact(parameters.solid, parameters.shape, parameters.law, size(parameters), h*a, order, reach,
                               parameters.method, parameters.rho)
        return scene.states(loads)

    if parameters.h is not None:
        return [(state, None) for state in states(parameters.h, parameters.order)]
    found, estimate = climb(lambda h: states(h, UNIFORM_ORDER), HALVINGS,
                            lambda coarse, fine: max(map(difference, coarse, fine)), parameters.rtol)
    return [(state, estimate) for state in found]


def events(parameters, last):
    """Births, mergers, splits and ends of zones from first touch to the last load, as the load path of one mesh has them.

    Node by node, without steps to choose, on two meshes of equal elements. Where zones meet on the axis the load misses its
    limit by h^(2 s) (docs/theory.md): it is extrapolated with that, and the correction is the error; for all other events,
    which converge faster, it bounds it. Events that one mesh alone sees are left out.
    """
    scene, a = fitted(parameters), parameters.a_Hz
    order, counts = EVENT_MESH
    coarse, fine = (_events(scene, last*parameters.P, order, count) for count in counts)
    slowest = 2**(2*coalescence_exponent(parameters.solid)) - 1
    found = []
    for (kind, zone, number), (load, x) in fine.items():
        if (kind, zone, number) in coarse:
            correction = (load - coarse[kind, zone, number][0])/slowest
            load += correction if scene.symmetric and x == 0 and load > 0 else 0.0
            found.append({"load": load/parameters.P, "load_error": abs(correction)/parameters.P, "kind": kind, "zone": zone,
                          "x": x/a})
    return sorted(found, key=lambda event: event["load"])


def _events(scene, last, order, count):
    """{(kind, zone, how many of that kind before): (load, x)} on one mesh."""
    body = scene.evenly(last, order, count)
    flexibility, gaps, share = body.compliance.corner_system(scene.law, scene.obstacle)
    history = active_set.path(flexibility, gaps, [scene.share(last)], c=share).events
    closed, before, found = np.zeros((len(scene.law.corners), len(body.weights)), bool), None, {}
    for load, changes in groupby(history, key=lambda event: event.load):
        for change in changes:
            closed.ravel()[change.corner] = change.kind == "closes"
        after = _named(scene, body.points[:, 0], closed)
        for zone, intervals in after.items():
            for kind, x in zone_changes(before[zone] if before else [], intervals):
                number = sum(key[:2] == (kind, zone) for key in found)
                found[kind, zone, number] = (float(load*(2 if scene.symmetric else 1)), float(x))
        before = after
    return found


def _named(scene, x, closed):
    """{"A", "B", "full", "contact": intervals} of the whole line; a node stands for half the way to its neighbours."""
    if scene.symmetric:
        closed = closed.copy()
        closed[:, 0] = closed[:, 0].any()      # one multiplier on the axis
        closed = np.column_stack((closed[::-1, :0:-1], closed))
        x = np.concatenate((-x[:0:-1], x))
    return zones_of(x, closed, scene.law)
