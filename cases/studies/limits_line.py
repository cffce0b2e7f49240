"""Maps of the contact line: what is asked for an accuracy, and the load path.

Verified by the reference of `cases.studies.judged_line` (`judge`: "panels"); where that finds none, by
uniform cells ("grid") or a line through two references ("neighbours"). Each knows its own error: a
state has to keep the sum of that and of its own promise.
"""

from functools import lru_cache

import numpy as np

import microblock as mb
from microblock.errors import NotConverged
from microblock.model.zones import zone_edges

from ..common.three_ways import seen
from . import judged_line
from . import reference_line as judge
from .judged_line import LOAD, RADIUS, Draw
from .limits_maps import Axis, Map, Outcome

NU, BETA = 0.3, 1.0  # unless an axis says otherwise
ALPHA_MID = 0.8343132323  # of these
ORDERS = 8, 12  # of the reference: 1e-7 or better, enough for rtol from FINE on
FINE = 1e-6
CELLS = 4096  # of the grid that verifies where no reference is found
WINDOW = 1.5  # of it, over the contact
TOUCHING = 0.01  # of alpha: nearer to coalescence no reference is found


def outcome(problem, load, rtol):
    """A state of the half-plane asked for an accuracy, verified."""
    return verified(problem, load, problem.solve(load=load, rtol=rtol), rtol)


def verified(problem, load, state, rtol):
    """The Outcome of a state."""
    measured = {"iterations": state.iterations, "estimate": state.error_estimate}
    try:
        true, own = judged_line.reference(problem, load, ORDERS if rtol >= FINE else judged_line.ORDERS)
    except NotConverged:
        error, own = beside_grid(problem, load, state)
        return Outcome(error, rtol + own, judge="grid", **measured)
    return Outcome(judged_line.error(state, true), rtol + own, judge="panels", **measured)


def beside_grid(problem, load, state):
    """(relative L2 distance of the pressure from that on uniform cells, their own error)."""
    edges = zone_edges(state.zones)
    middle, half = (edges[-1] + edges[0]) / 2, WINDOW * (edges[-1] - edges[0]) / 2
    grid = problem.with_(method=mb.Cells(nodes=CELLS, window=(middle - half, middle + half))).solve(load=load)
    off = state.pressure_at(grid.x) - grid.pressure
    return float(np.linalg.norm(off) / np.linalg.norm(grid.pressure)), grid.error_estimate


def materials(contact, beta, nu, alpha, rtol):
    """A cylinder on a solid near the ends of its moduli."""
    return outcome(Draw(contact, contact, alpha, nu, beta).problem(), LOAD, rtol)


def rotated(psi0, alpha, sign, reading, rtol):
    """A cylinder on blocks rotated by psi0."""
    return outcome(_rotated(alpha, sign * psi0 * RADIUS, reading), LOAD, rtol)


def _rotated(alpha, psi0=0.0, reading="gap"):
    return Draw("psi0", "microblock", alpha, NU, BETA, psi0, reading).problem()


def wedges(slope, width, turn, contact, rtol):
    """A wedge; `width` is the half-width of a classical contact over ell, psi0 = turn slope."""
    law = mb.Microblock(turn * slope) if contact == "microblock" else mb.Unilateral()
    solid = mb.Cosserat(E=LOAD / (slope * width) * (1 - NU**2), nu=NU, ell=1.0, beta=BETA)
    return outcome(mb.Contact(mb.HalfPlane(solid), mb.Wedge(slope), law), LOAD, rtol)


def coalescing(side, distance, rtol):
    """Two zones of partial contact that hardly touch, or hardly do not: alpha/ALPHA_MID = 1 +- distance."""
    place = distance if side == "apart" else -distance
    problem = _rotated(ALPHA_MID * (1 + place))
    state = problem.solve(load=LOAD, rtol=rtol)
    if distance > TOUCHING:
        return verified(problem, LOAD, state, rtol)
    return beside_neighbours(state, place, rtol)


@lru_cache(maxsize=4)
def _neighbour(place):
    """Reference at alpha = ALPHA_MID (1 + place)."""
    return judged_line.reference(_rotated(ALPHA_MID * (1 + place)))[0]


def beside_neighbours(state, place, rtol):
    """Verified by the straight line through references on both sides, functions of x over their outer edge.

    Twice as far ones tell its own error.
    """

    def outer(end):
        return max(_neighbour(end).zones[0])[1]

    def between(reach):
        ends, share = (-reach, reach), (1 + place / reach) / 2
        edge = (1 - share) * outer(-reach) + share * outer(reach)

        def line(x):
            here, there = (judge.fields(_neighbour(end))(x * (outer(end) / edge)) for end in ends)
            return tuple((1 - share) * one + share * other for one, other in zip(here, there))

        return line

    places, known = judge.breaks([_neighbour(side * TOUCHING) for side in (-2, -1, 1, 2)]), between(TOUCHING)
    itself = judge.distance(between(2 * TOUCHING), known, places)
    return Outcome(
        judge.distance(seen(state), known, places),
        rtol + itself,
        state.iterations,
        state.error_estimate,
        judge="neighbours",
    )


def _late_touch(path):
    """The event at which the second corner touches, or None."""
    return next(
        (event for event in path.events if event.zone in "AB" and event.kind == "born" and event.load > 0),
        None,
    )


def _rotated_path(psi0, alpha, sign):
    """The path of rotated blocks to a load at which the second corner touches as a rule."""
    return _rotated(alpha, sign * psi0 * RADIUS).path(load=LOAD + 50 * RADIUS * alpha * psi0)


def touching(distance, psi0, alpha, sign, side, rtol):
    """A state next to the load at which the second corner touches."""
    path = _rotated_path(psi0, alpha, sign)
    event = _late_touch(path)
    load = (1 + side * distance) * (path.last if event is None else event.load)
    return outcome(path.problem, load, rtol)


ALPHA = Axis("alpha", "alpha", 0.01, 2.0)
RTOL = Axis("rtol", "rtol", 1e-2, 1e-6)
PSI0 = Axis("psi0", "|psi0|", 1e-6, np.radians(20), degenerate="both")
SIGN, SIDE = (Axis(name, name, choices=(1, -1)) for name in ("sign", "side"))
NU_TO_HALF = Axis("nu", "1/2 - nu", 0.5, 1e-4, "gap", "high", 0.5)
CONTACTS = "microblock", "unilateral"
MAPS = (
    Map(
        "line_beta_small",
        "Does the contact line hold what it promises as the coupling vanishes?",
        materials,
        (Axis("beta", "beta", 1.0, 1e-4, degenerate="high"), NU_TO_HALF, ALPHA, RTOL),
        ("contact", CONTACTS),
        0.5,
    ),
    Map(
        "line_beta_large",
        "Does the contact line hold what it promises towards couple stresses?",
        materials,
        (Axis("beta", "2 - beta", 1.0, 1e-3, "gap", "high", 2.0), NU_TO_HALF, ALPHA, RTOL),
        ("contact", CONTACTS),
        0.5,
    ),
    Map(
        "line_turned",
        "Do blocks rotated by next to nothing, or by 20 degrees, keep the promise?",
        rotated,
        (PSI0, ALPHA, RTOL, SIGN, Axis("reading", "", choices=("gap", "lever"))),
        share=0.5,
    ),
    Map(
        "line_wedge",
        "Does the promise hold under wedges, blunt and steep, wide and narrow against a block?",
        wedges,
        (
            Axis("slope", "slope of the flanks", 1e-4, 1.0, degenerate="low"),
            Axis("width", "half-width/ell", 0.05, 50.0, degenerate="both"),
            Axis("turn", "", 1e-3, 1.0),
            RTOL,
            Axis("contact", "", choices=CONTACTS),
        ),
        share=0.3,
    ),
    Map(
        "line_coalescence",
        "Does the promise hold where two zones of partial contact touch?",
        coalescing,
        (
            Axis("distance", "|alpha/alpha_mid - 1|", 1e-1, 1e-12, degenerate="high"),
            Axis("rtol", "rtol", 1e-2, 1e-9),
        ),
        ("side", ("apart", "joined")),
        0.5,
    ),
    Map(
        "line_touching",
        "Does the promise hold where the second corner begins to touch?",
        touching,
        (
            Axis("distance", "|P/P_touch - 1|", 1e-1, 1e-9, degenerate="high"),
            Axis("psi0", "|psi0|", 1e-4, 0.3),
            Axis("alpha", "", 0.1, 2.0),
            RTOL,
            SIGN,
            SIDE,
        ),
        share=0.2,
    ),
)
