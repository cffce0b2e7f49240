"""Maps of the contact line: what is asked for an accuracy, and the load path.

Judged by the reference of `cases.accuracy` (`judge`: "panels"); where that finds none, by uniform cells ("grid"), fitted
finite elements ("elements") or a line through two references ("neighbours"). Each knows its own error: a state has to keep the
sum of that and of its own promise.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.optimize import minimize_scalar

import microblock as mb
from cases import accuracy
from cases import reference_line as judge
from cases.accuracy import LOAD, RADIUS, Draw
from cases.limits_maps import Axis, Map, Outcome
from microblock.errors import NotConverged
from microblock.law import corner_shifts
from microblock.observables import distance, distance_to_ends
from microblock.panels import zone_edges

NU, BETA = 0.3, 1.0           # unless an axis says otherwise
ALPHA_MID = 0.8343132323      # of these
RUNGS = 8, 12                 # of the reference: 1e-7 or better, enough for rtol from FINE on
FINE = 1e-6
CELLS = 4096                  # of the grid that judges where no reference is found
WINDOW = 1.5                  # of it, over the contact
ELEMENTS = 3e-3               # rtol of the finite elements that judge
FACET = 16                    # Gauss points on a facet of theirs, of which no rung has a higher order than 12
TOUCHING = 0.01               # of alpha: nearer to coalescence no reference is found
PATH = 1e-4                   # rtol of states on paths
OTHER_TURN = 1.0              # psi0 R/a_Hz by which the blocks of the wrong neighbour are turned
REACH = 0.5                   # of ell, around an event, where a corner is looked for that touches there
AHEAD = 1.01                  # load over that of an event, for the slope of the gap


def outcome(scene, load, state, rtol):
    """A state of the half-plane asked for an accuracy, judged."""
    measured = {"iterations": state.iterations, "estimate": state.error_estimate}
    try:
        true, own = accuracy.reference(scene, load, RUNGS if rtol >= FINE else accuracy.ORDERS)
    except NotConverged:
        error, own = beside_grid(scene, load, state)
        return Outcome(error, rtol + own, judge="grid", **measured)
    return Outcome(accuracy.error(state, true), rtol + own, judge="panels", **measured)


def beside_grid(scene, load, state):
    """(relative L2 distance of the pressure from that on uniform cells, their own error)."""
    edges = zone_edges(state.all_zones)
    middle, half = (max(edges) + min(edges))/2, WINDOW*(max(edges) - min(edges))/2
    grid = mb.GridContact(scene.body, scene.obstacle, scene.law, (middle - half, middle + half)).at(load, nodes=CELLS)
    p = grid.pressures.sum(axis=0)
    own = sum(state.pressure(corner, grid.x) for corner in range(len(grid.pressures)))
    return float(np.linalg.norm(own - p)/np.linalg.norm(p)), grid.error_estimate


def materials(contact, beta, nu, alpha, rtol):
    """A cylinder on a solid near the ends of its moduli."""
    scene = Draw(contact, contact, alpha, nu, beta).scene()
    return outcome(scene, LOAD, scene.at(LOAD, rtol=rtol), rtol)


def turned(psi0, alpha, sign, reading, rtol):
    """A cylinder on blocks turned by psi0."""
    scene = _turned(alpha, sign*psi0*RADIUS, reading)
    return outcome(scene, LOAD, scene.at(LOAD, rtol=rtol), rtol)


def _turned(alpha, psi0=0.0, reading="gap"):
    return Draw("psi0", "microblock", alpha, NU, BETA, psi0, reading).scene()


def wedges(slope, width, turn, contact, rtol):
    """A wedge; `width` is the half-width of a classical contact over ell, psi0 = turn slope."""
    law = mb.Microblock(turn*slope) if contact == "microblock" else mb.Unilateral()
    solid = mb.Cosserat(E=LOAD/(slope*width)*(1 - NU**2), nu=NU, ell=1.0, beta=BETA)
    scene = mb.Contact(mb.HalfPlane(solid), mb.Wedge(slope), law)
    return outcome(scene, LOAD, scene.at(LOAD, rtol=rtol), rtol)


def punches(tilt, psi0, alpha, sign, rtol):
    """A punch of half-width 1 and E* = 2 under the load 1, on turned blocks; judged in the weighted norm of punches.

    The norm is integrated on the facets of the elements: in the points of the panels their polynomials' error, which changes
    sign from node to node, comes out up to twice as large.
    """
    solid = mb.Cosserat(E=2*(1 - NU**2), nu=NU, ell=alpha, beta=BETA)
    obstacle, law = mb.Punch(1.0, tilt), mb.Microblock(sign*psi0)
    state = mb.Contact(mb.HalfPlane(solid), obstacle, law).at(1.0, rtol=rtol)
    other = mb.FittedContact(solid, obstacle, law).at(1.0, rtol=ELEMENTS)
    error = beside_elements(state, other)
    return Outcome(error, rtol + other.error_estimate, state.iterations, state.error_estimate, judge="elements")


def beside_elements(state, other):
    """Relative L2 distance of pressure and micromoment from elements on the whole line, weighted next to ends of the obstacle."""
    points, weights = leggauss(FACET)
    left, right = np.array([facet[:2] for facet in other.body.interpolation]).T
    x = ((left + right)/2 + points[:, None]*(right - left)/2).ravel(order="F")
    shifts = corner_shifts(state.line.law, state.line.solid.ell)
    weights = np.outer((right - left)/2, weights).ravel()*distance_to_ends(x, state.line.obstacle.ends, shifts)
    p = np.array([state.pressure(corner, x) for corner in (0, 1)])
    wrong = p - [other.pressure(corner, x) for corner in (0, 1)]
    return distance(weights, wrong[0] + wrong[1], (wrong[0] - wrong[1])/2, p.sum(axis=0))


def coalescing(side, distance, rtol):
    """Two zones of partial contact that hardly touch, or hardly do not: alpha/ALPHA_MID = 1 +- distance."""
    place = distance if side == "apart" else -distance
    scene = _turned(ALPHA_MID*(1 + place))
    state = scene.at(LOAD, rtol=rtol)
    return outcome(scene, LOAD, state, rtol) if distance > TOUCHING else beside_neighbours(state, place, rtol)


@lru_cache(maxsize=4)
def _neighbour(place):
    """Reference at alpha = ALPHA_MID (1 + place)."""
    return accuracy.reference(_turned(ALPHA_MID*(1 + place)))[0]


def beside_neighbours(state, place, rtol):
    """Judged by the straight line through references on both sides, as functions of x over their outer edge.

    Twice as far ones tell its own error.
    """
    def outer(end):
        return max(_neighbour(end).zones[0])[1]

    def between(reach):
        ends, share = (-reach, reach), (1 + place/reach)/2
        edge = (1 - share)*outer(-reach) + share*outer(reach)

        def line(x):
            here, there = (judge.fields(_neighbour(end))(x*(outer(end)/edge)) for end in ends)
            return tuple((1 - share)*one + share*other for one, other in zip(here, there))
        return line

    def own(x):
        a, b = (state.pressure(corner, x) for corner in (0, 1))
        return a + b, (a - b)/2

    places, known = judge.breaks([_neighbour(side*TOUCHING) for side in (-2, -1, 1, 2)]), between(TOUCHING)
    itself = judge.distance(between(2*TOUCHING), known, places)
    return Outcome(judge.distance(own, known, places), rtol + itself, state.iterations, state.error_estimate, judge="neighbours")


def paths(share, psi0, alpha, sign, start):
    """A state at a share of the last load: alone, from the path, or from a state that is no neighbour."""
    scene, load = _turned(alpha, sign*psi0*RADIUS), share*LOAD
    if start == "path":
        return outcome(scene, load, scene.load(LOAD, rtol=PATH).at(load), PATH)
    near = {"alone": lambda: None, "far load": lambda: scene.at(LOAD),
            "other scene": lambda: _turned(alpha, -sign*(psi0*RADIUS + OTHER_TURN)).at(LOAD)}[start]()
    return outcome(scene, load, scene.at(load, rtol=PATH, near=near), PATH)


def _late_touch(path):
    """The event at which the second corner touches, or None."""
    return next((event for event in path.events if event.zone in "AB" and event.kind == "born" and event.load > 0), None)


def _turned_path(psi0, alpha, sign):
    """The path of turned blocks to a load at which the second corner touches as a rule."""
    return _turned(alpha, sign*psi0*RADIUS).load(LOAD + 50*RADIUS*alpha*psi0)


def touches(psi0, alpha, sign):
    """The load at which the second corner touches; judged by its gap on the reference's zones of the first alone."""
    path = _turned_path(psi0, alpha, sign)
    event = _late_touch(path)
    if event is None:
        return Outcome(None, None, len(path.events))
    late, error = "AB".index(event.zone), event.load_error/event.load
    if error > 0.5:      # somewhere before the scan begins
        return Outcome(None, None, len(path.events), error)
    here, ahead = (_least_gap(path, event.x, load, late) for load in (event.load, AHEAD*event.load))
    return Outcome(abs(here/(here - ahead)*(AHEAD - 1)), error + FINE, len(path.events), error, judge="panels")


def _least_gap(path, x, load, late):
    """Least gap of the late corner around x while only the other one carries the load."""
    zones = {1 - late: list(path.at(0.9*load).all_zones[1 - late]), late: []}
    fine = judge.fit(judge.Problem(path.scene, load), zones, RUNGS)[-1]
    reach = REACH*path.scene.body.solid.ell
    return minimize_scalar(lambda place: fine.gap(late, np.array([place]))[0], bounds=(x - reach, x + reach), method="bounded",
                           options={"xatol": 1e-6*reach}).fun


def touching(distance, psi0, alpha, sign, side, rtol):
    """A state next to the load at which the second corner touches."""
    path = _turned_path(psi0, alpha, sign)
    event = _late_touch(path)
    load = (1 + side*distance)*(path.last if event is None else event.load)
    return outcome(path.scene, load, path.scene.at(load, rtol=rtol), rtol)


ALPHA = Axis("alpha", r"$\alpha = \ell/a_\mathrm{Hz}$", 0.01, 2.0)
RTOL = Axis("rtol", "rtol", 1e-2, 1e-6)
PSI0 = Axis("psi0", r"$|\psi_0|$", 1e-6, np.radians(20), degenerate="both")
SIGN, SIDE = (Axis(name, name, choices=(1, -1)) for name in ("sign", "side"))
NU_TO_HALF = Axis("nu", r"$1/2 - \nu$", 0.5, 1e-4, "gap", "high", 0.5)
CONTACTS = "microblock", "unilateral"
MAPS = (
    Map("line_beta_small", "Does the contact line hold what it promises as the coupling vanishes?", materials,
        (Axis("beta", r"$\beta$", 1.0, 1e-4, degenerate="high"), NU_TO_HALF, ALPHA, RTOL), ("contact", CONTACTS), 0.5),
    Map("line_beta_large", "Does the contact line hold what it promises towards couple stresses?", materials,
        (Axis("beta", r"$2 - \beta$", 1.0, 1e-3, "gap", "high", 2.0), NU_TO_HALF, ALPHA, RTOL), ("contact", CONTACTS), 0.5),
    Map("line_turned", "Do blocks turned by next to nothing, or by 20 degrees, keep the promise?", turned,
        (PSI0, ALPHA, RTOL, SIGN, Axis("reading", "", choices=("gap", "lever"))), share=0.5),
    Map("line_wedge", "Does the promise hold under wedges, blunt and steep, wide and narrow against a block?", wedges,
        (Axis("slope", "slope of the flanks", 1e-4, 1.0, degenerate="low"),
         Axis("width", r"half-width$/\ell$", 0.05, 50.0, degenerate="both"), Axis("turn", "", 1e-3, 1.0), RTOL,
         Axis("contact", "", choices=CONTACTS)), share=0.3),
    Map("line_punch", "Does the promise hold under punches, flat or tilted, where zones end at corners of the obstacle?", punches,
        (Axis("tilt", "tilt", 1e-6, 1.0, degenerate="both"), Axis("psi0", r"$|\psi_0|$", 1e-6, 0.3, degenerate="low"), ALPHA,
         Axis("rtol", "rtol", 1e-2, 1e-4), SIGN), share=0.2),
    Map("line_coalescence", "Does the promise hold where two zones of partial contact touch?", coalescing,
        (Axis("distance", r"$|\alpha/\alpha_\mathrm{mid} - 1|$", 1e-1, 1e-12, degenerate="high"),
         Axis("rtol", "rtol", 1e-2, 1e-9)),
        ("side", ("apart", "joined")), 0.5),
    Map("line_touching", "Does the promise hold where the second corner begins to touch?", touching,
        (Axis("distance", r"$|P/P_\mathrm{touch} - 1|$", 1e-1, 1e-9, degenerate="high"), Axis("psi0", r"$|\psi_0|$", 1e-4, 0.3),
         Axis("alpha", "", 0.1, 2.0), RTOL, SIGN, SIDE), share=0.2),
    Map("path_loads", "Are states right at loads over twelve decades, from the path and from the wrong neighbour?", paths,
        (Axis("share", "load over the last", 1e-12, 1.0, degenerate="low"), Axis("psi0", r"$|\psi_0|$", 1e-6, 0.3), ALPHA, SIGN,
         Axis("start", "", choices=("alone", "path", "far load", "other scene"))), share=0.4),
    Map("path_touch", "Is the load right at which the second corner touches?", touches,
        (PSI0, ALPHA, SIGN), share=0.2, error="relative error of the event's load"),
)
