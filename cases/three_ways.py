"""What cases on the contact line share: a scene solved on panels, judged by fitted elements, by cells and by a closed form."""

import time

import numpy as np

from microblock.errors import BadArgument, MicroblockError, require_finite, require_tolerance
from microblock.fitted import FittedContact
from microblock.grid_contact import GridContact
from microblock.halfplane import HalfPlane
from microblock.law import Microblock, Unilateral, corner_shifts
from microblock.material import Cosserat
from microblock.observables import distance, distance_to_ends, half_widths
from microblock.panels import zone_edges
from microblock.scene import Contact
from microblock.study import column, grouped

CLASSICAL = 1e-10        # coupling of the classical limit: results differ from it by as much
LAWS = {"classical": Unilateral, "unilateral": Unilateral, "microblock": Microblock}
WINDOW = 1.1             # of cells over the contact


def check(parameters):
    """Raise BadArgument for a beta, rtol, rtol_fe or nodes of a case's parameters out of range, and for inadmissible moduli."""
    require_finite(beta=parameters.beta)
    if not 0 < parameters.beta < 2:
        raise BadArgument("beta", parameters.beta, "must satisfy 0 < beta < 2")
    require_tolerance(parameters.rtol)
    if not 1e-4 <= parameters.rtol_fe < 1:
        raise BadArgument("rtol_fe", parameters.rtol_fe, "must lie between 1e-4 and 1")
    if not 256 <= parameters.nodes <= 2**20:
        raise BadArgument("nodes", parameters.nodes, f"must lie between 256 and {2**20}")
    solid_of(parameters, "microblock")


def solid_of(parameters, law):
    """The solid with E* = 1, classical for the law of that name."""
    beta = CLASSICAL if law == "classical" else parameters.beta
    return Cosserat(E=1 - parameters.nu**2, nu=parameters.nu, ell=parameters.alpha, beta=beta)


def on_panels(solid, obstacle, law, load, rtol):
    """(LineState, seconds)."""
    start = time.perf_counter()
    state = Contact(HalfPlane(solid), obstacle, LAWS[law]()).at(load, rtol)
    return state, time.perf_counter() - start


def on_cells(state, nodes):
    """GridState of the scene of a LineState, on a window around its contact."""
    edges = zone_edges(state.all_zones)
    middle, half = (edges[-1] + edges[0])/2, WINDOW*(edges[-1] - edges[0])/2
    scene = GridContact(HalfPlane(state.line.solid), state.line.obstacle, state.line.law, window=(middle - half, middle + half))
    return scene.at(state.load, nodes=nodes)


def judged(state, nodes, rtol, exact=None):
    """Relative L2 distances of a LineState to the other ways, at the centres of the cells; None where a way does not answer.

    Next to the ends of the obstacle the distance from them is the weight. `exact`: pressure(x) of the one corner, if known.
    """
    cells = on_cells(state, nodes)
    found = {"difference_cells": difference(state, cells.x, cells.pressures), "estimate_cells": cells.error_estimate,
             "error": None if exact is None else difference(state, cells.x, exact(cells.x)[None])}
    try:
        elements = FittedContact(state.line.solid, state.line.obstacle, state.line.law).at(state.load, rtol)
    except MicroblockError as failure:
        return {**found, "difference_fe": None, "estimate_fe": None, "failure_fe": " ".join(str(failure).split())}
    corners = range(len(state.line.law.corners))
    there = np.array([elements.pressure(corner, cells.x) for corner in corners])
    return {**found, "difference_fe": difference(state, cells.x, there), "estimate_fe": elements.estimate.total,
            "failure_fe": None}


def difference(state, x, pressures):
    """max(|dp|, |dM|/ell)/|p| between a LineState and other pressures, array (corners, n), at equally spaced x."""
    line = state.line
    weights = distance_to_ends(x, getattr(line.obstacle, "ends", ()), corner_shifts(line.law, line.solid.ell))
    own = np.array([state.pressure(corner, x) for corner in range(len(line.law.corners))])
    levers = np.array([line.lever(np.full(len(x), corner), x) for corner in range(len(own))])
    return distance(weights, np.sum(own - pressures, axis=0), np.sum(levers*(own - pressures), axis=0)/2, own.sum(axis=0))


def zones_of(state):
    """{"A", "B", "full", "contact": intervals} of a LineState, and (half_width, inner_half_width)."""
    zones = {name: [list(map(float, one)) for one in intervals] for name, intervals in state.named_zones.items()}
    return zones, half_widths(zones["contact"])


def centre(state):
    """Where the resultant of the corner forces acts: mean of the corners' places, each corner weighted with its force."""
    shifts = corner_shifts(state.line.law, state.line.solid.ell)
    return float(sum(state.weights @ (own*(state.x - shift)) for own, shift in zip(state.pressures, shifts))/state.load)


def profile_of(state, unit):
    """Rows along the contact line: number of the interval of contact, x, pressure of all corners, micromoment over ell, psi.

    unit : float, a pressure over which pressure and micromoment over ell are given
    """
    zone = np.searchsorted([right for _, right in state.named_zones["contact"]], state.x)
    columns = zone, state.x, state.pressures.sum(axis=0)/unit, state.micromoment/state.line.solid.ell/unit, state.psi
    return [dict(zip(("zone", "x", "pressure", "micromoment", "psi"), map(float, node))) for node in zip(*columns)]


def draw_zones(axis, nodes, name, **style):
    """A column of records over x, each interval of contact a line of its own."""
    for number, own in enumerate(grouped(nodes, "zone").values()):
        axis.plot(column(own, "x"), column(own, name), **{**style, "label": style.get("label") if number == 0 else None})


def table(rows, columns, width=12):
    """Print records as a table."""
    print("  ".join(f"{name[:width]:>{width}}" for name in columns))
    for row in rows:
        cells = ("-" if row[name] is None else f"{row[name]:.5g}" if isinstance(row[name], float) else str(row[name])
                 for name in columns)
        print("  ".join(f"{cell:>{width}}" for cell in cells))
