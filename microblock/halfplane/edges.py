"""Newton's method for the edges of the zones on the contact line (docs/theory/halfplane.md).

On trial zones the gaps are closed. At the distance r from a trial edge the pressure is
``p = K0/sqrt(r) + K1 sqrt(r)``; at the edges of the answer that are free K0 = 0. Moving edge j outwards
changes K0 at edge i by ``-delta_ij K1_i/2``, so that Newton's step outwards is 2 K0/K1. A step is

1. panels on the trial zones, the pressures that close the gaps there under the load, and the approach;
2. K0 and K1 at all edges;
3. the free edges: those that the obstacle does not fix, or that are in tension;
4. steps of the free edges: 2 K0/K1 outwards, bounded where K1 is no guide;
5. stops at apexes of the obstacle, where the pressure is logarithmic and the rule does not hold;
6. the next trial zones, on which edges have moved (`moved_edges`).

Steps are repeated until the largest K0 of a free edge is worth a tolerance in L2 of the pressure and the
edges of both corners lie in the order of the step before, or six steps have not halved it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import legvander

from ..errors import NotConverged
from ..model.intervals import common, zone_edges
from ..model.problem import Problem, half_line
from ..model.progress import counted
from ..model.quadrature import gauss_rule
from ..model.types import Array, CornerZones, Flags, Integers
from ..threads import with_outer_threads
from .kernels import gap_kernel
from .moved_edges import Edge, moved_zones, order_of_edges
from .panel_solution import PanelErrors, PanelSolution
from .panels import PanelGrid, make_panels, response
from .second_body_kernel import second_body_kernel
from .transmitted_singularities import decay, log_sizes_of

APEX_WIDTH = 1e-10  # of the width of all zones: an edge this near to an apex lies on it


def tolerated(order: int) -> float:
    """Returns the error of the pressure that panels of an order leave where obstacles are rough."""
    return float(10 ** (-(order + 6) / 4))


def system_of_gaps(problem: Problem, panels: PanelGrid) -> tuple[Array, Array]:
    """Returns the gaps at the nodes from q, array (m, m), and without it, array (m,) (length): the initial
    ones and those from the known logarithms.
    """
    panel, _, x, _ = panels.nodes
    corner = panels.corner[panel]
    matrix, gaps = response(problem, panels, x, problem.lever(corner, x), gap_kernel)
    if problem.counter is not None:
        below = x - np.array(problem.shifts)[corner]
        by_second, by_second_alone = response(
            problem, panels, below, 0 * x, second_body_kernel, problem.shifts
        )
        matrix = matrix + by_second
        gaps = gaps + by_second_alone
    return matrix, problem.initial_gap(corner, x) + gaps


def solve_zones(problem: Problem, panels: PanelGrid, load: float) -> tuple[Array, float, float]:
    """Returns q, array (m,), and the approach (length) with closed gaps at a load, and the part of rounded
    gaps in q in L2.
    """
    panel, v, _, weights = panels.nodes
    count = len(weights)
    sides = 2 if problem.mirror else 1
    matrix, gaps = system_of_gaps(problem, panels)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = matrix
    system[:count, count] = -1.0
    system[count, :count] = sides * weights
    right = np.zeros((count + 1, 2))
    right[:count, 0] = -gaps
    right[count, 0] = load - sides * panels.log_size @ np.abs(panels.h)
    terms = np.abs(matrix).max(axis=1) / weights.max() * load
    right[:count, 1] = 5e-15 * terms * (-1.0) ** np.arange(count)
    try:
        with with_outer_threads(count):
            solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(
            f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} at load {load:g}"
        ) from failure
    q, rounding = solution[:-1].T
    squares = weights / panels.slope(panel, v)
    return q, float(solution[-1, 0]), float(np.sqrt(squares @ rounding**2 / (squares @ q**2)))


@dataclass(frozen=True, eq=False)
class EdgePressures:
    """Edges of the computed zones, left and right in turn, and ``p = K0/sqrt(r) + K1 sqrt(r)`` there.

    Attributes
    ----------
    corner, x : arrays (n,), numbers of the corners and abscissae
    side : array (n,), 1 where the zone lies to the right, -1 where it lies to the left
    K0, K1 : arrays (n,), pressure times and over the root of a length
    K1_panel : array (n,), K1 of the best two terms over the panel beside the edge
    """

    corner: Integers
    x: Array
    side: Integers
    K0: Array
    K1: Array
    K1_panel: Array


def edge_pressures(problem: Problem, zones: CornerZones, panels: PanelGrid, q: Array) -> EdgePressures:
    """Returns the edges of zones and the pressures beside them, from q, array (m,)."""
    corner, x = np.array([(corner, x) for corner, own in zones.items() for x in np.ravel(own)]).T
    side = 1 - 2 * (np.arange(len(x)) % 2)
    image = np.where(half_line(problem) & (x < 0), -1, 1)  # panels lie on x >= 0 there
    anchored = (
        (panels.e == (x * image)[:, None])
        & (panels.corner == corner[:, None])
        & (np.sign(panels.h) * panels.root == (side * image)[:, None])
    )
    number = np.nonzero(anchored)[1]  # one panel an edge
    h = np.abs(panels.h[number])
    values = q.reshape(-1, panels.order)[number] @ _edge_terms(panels.order)
    K0, K1, K1_panel = values.T / (2 * np.sqrt(h) * np.array((h**0, h, h)))
    return EdgePressures(corner.astype(int), x, side, K0, K1, K1_panel)


@lru_cache
def _edge_terms(order: int) -> Array:
    """Value and half the second derivative at v = 0, and the v^2 of the best two terms: array (order, 3)."""
    # Legendre series by the Gauss rule itself
    points, weights = gauss_rule(order)
    k = np.arange(order)
    series = (-1.0) ** k * (2 * k + 1) * legvander(2 * points - 1, order - 1) * weights[:, None]
    terms = np.column_stack((np.ones_like(points), points**2))
    best = np.linalg.solve(terms.T * weights @ terms, terms.T * weights)[1]
    return np.column_stack((series.sum(axis=1), series @ ((k - 1) * k * (k + 1) * (k + 2) / 4), best))


def newton_zone_edges(
    problem: Problem, load: float, zones: CornerZones, order: int, tolerance: float
) -> PanelSolution:
    """Returns the PanelSolution with the free edges moved from trial zones until their part in the relative
    L2 error is a tolerance; the best one, if it reaches the root of what the order leaves.

    Raises NotConverged if no zone is left, edges do not settle, or zones open without end.
    """
    cut = {corner: common(intervals, problem.pieces_of(corner)) for corner, intervals in zones.items()}
    edges = [Edge(corner, edge, edge) for corner, cuts in cut.items() for edge in np.ravel(cuts).tolist()]
    zones = moved_zones(problem, load, edges)
    best: PanelSolution | None = None
    before: EdgePressures | None = None
    idle = 0
    iterations = 0
    while idle < 6:
        counted()
        iterations += 1
        state, before = _newton_step(problem, load, zones, order, tolerance, before)
        least = best.estimate.edges if best else np.inf
        idle = 0 if state.estimate.edges < least / 2 else idle + 1
        # next to the load at which edges meet, one more step tells how they lie
        alike = order_of_edges(problem, zones) == order_of_edges(problem, state.next_zones)
        settled = state.estimate.edges <= tolerance and alike
        if settled or not least <= state.estimate.edges:
            best = state.changed(iterations=iterations)
        if settled:
            break
        zones = state.next_zones
    assert best is not None
    if not best.estimate.edges <= max(tolerance, np.sqrt(tolerated(order))):
        raise NotConverged(
            f"edges of the zones still off by {best.estimate.edges:.1e} of the pressure at load {load:g}",
            iterations=iterations,
        )
    _require_finite_chain(problem, best.zones)
    return best


def zones_of_neighbour(state: PanelSolution, problem: Problem) -> CornerZones:
    """Returns the zones of a Problem next to that of a state, to first order in what differs.

    One step of Newton's method from the zones of the state has this order, as its Jacobian -K1/2 is exact; on
    the same panels what they leave is the same. Where places of the obstacle move with ell, edges settle.
    """
    if problem.kinks or any(map(problem.ends_of, problem.corners)):
        tolerance = max(state.estimate.edges, tolerated(state.panels.order) ** 2)
        return newton_zone_edges(problem, state.load, state.zones, state.panels.order, tolerance).next_zones
    order = state.panels.order
    step, _ = _newton_step(problem, state.load, state.zones, order, 0.0, None, state.panels)
    return step.next_zones


def _newton_step(
    problem: Problem,
    load: float,
    zones: CornerZones,
    order: int,
    tolerance: float,
    before: EdgePressures | None,
    panels: PanelGrid | None = None,
) -> tuple[PanelSolution, EdgePressures]:
    """Returns the PanelSolution on zones, with `next_zones` a step on, and the pressures at its edges; on
    given panels instead of those of the order.
    """
    panels = panels or make_panels(problem, zones, order)  # 1
    q, approach, rounding = solve_zones(problem, panels, load)
    edges = edge_pressures(problem, zones, panels, q)  # 2
    free = _free_edges(problem, edges)  # 3
    # 4 is the norm of 1/sqrt(r) on both sides of an edge, cut off far from it and at the first points
    unit = load / (4 * np.sqrt(np.ptp(zone_edges(problem.all_zones(zones)))))
    steps = free * _outward_steps(edges, before, tolerance * unit)  # 4
    targets, stopped = _stopped_at_apexes(problem, zones, edges, edges.x - edges.side * steps)  # 5
    columns = edges.corner, edges.x, targets, _pressed(edges, panels, q)
    moved = map(Edge, *(column.tolist() for column in columns))
    next_zones = moved_zones(problem, load, moved)  # 6
    largest = float(np.abs(edges.K0[free & ~stopped]).max(initial=0.0))
    errors = PanelErrors(None, float(largest / unit), rounding)
    return PanelSolution(problem, load, zones, panels, q, approach, 0, errors, next_zones=next_zones), edges


def _free_edges(problem: Problem, edges: EdgePressures) -> Flags:
    """Returns which edges are not those of the obstacle, or in tension there, array (n,)."""
    ends = [problem.ends.get(number, ()) for number in edges.corner.tolist()]
    return (edges.K0 < 0) | [x not in fixed for x, fixed in zip(edges.x, ends)]


def _outward_steps(edges: EdgePressures, before: EdgePressures | None, tolerance: float) -> Array:
    """Returns steps outwards, array (n,) (lengths): 2 K0/K1, or where K1 is negative and |K0| above a
    tolerance half the room there is.
    """
    K1 = _safe_K1(edges, before)
    distance = np.where(edges.corner[1:] == edges.corner[:-1], np.diff(edges.x), np.inf)
    to_right = np.append(distance, np.inf)
    to_left = np.insert(distance, 0, np.inf)
    zone = np.where(edges.side > 0, to_right, to_left)
    hole = np.where(edges.side > 0, to_left, to_right)
    # outwards there may be no other edge
    room = np.where((edges.K0 < 0) | np.isinf(hole), zone, hole)
    steps = np.where(np.abs(edges.K0) > tolerance, np.copysign(room / 2, edges.K0), 0.0)
    np.divide(2 * edges.K0, K1, out=steps, where=K1 > 0)
    # a zone that has just opened knows nothing of what lies farther
    return np.maximum(steps, -8 * hole)


def _safe_K1(edges: EdgePressures, before: EdgePressures | None) -> Array:
    """Returns K1, array (n,), where it is negative or steps are slow that of the secant or the panel."""
    if before is None or not np.array_equal(before.corner, edges.corner):
        return np.where(edges.K1 <= 0, edges.K1_panel, edges.K1)
    way = before.x - edges.x
    secant = np.divide(2 * (before.K0 - edges.K0) * edges.side, way, out=np.zeros_like(way), where=way != 0)
    slow = (edges.K1 <= 0) | (np.abs(edges.K0) > np.abs(before.K0) / 2)
    return np.where(slow, np.where(secant > 0, secant, edges.K1_panel), edges.K1)


def _pressed(edges: EdgePressures, panels: PanelGrid, q: Array) -> Flags:
    """Returns which edges are left ones of zones that carry a load, array (n,)."""
    forces = q.reshape(-1, panels.order) @ panels.points[1] + panels.log_size * np.abs(panels.h)
    middle = panels.e + panels.h / 2
    inside = (edges.x[::2, None] < middle) & (middle < edges.x[1::2, None])
    inside &= panels.corner == edges.corner[::2, None]
    return np.repeat(inside @ forces > 0, 2) & (edges.side > 0)


def _stopped_at_apexes(
    problem: Problem, zones: CornerZones, edges: EdgePressures, targets: Array
) -> tuple[Array, Flags]:
    """Returns targets, array (n,) (lengths), of edges that would pass an apex of the obstacle, and which
    edges stay on one.

    A zone that ends at an apex with ``p = K0/sqrt(r)`` goes on by ``d = (K0/(2 K))^2``, K of the logarithm
    there: ``K log((sqrt(r) + sqrt(d))/(sqrt(r) - sqrt(d)))`` is ``2 K sqrt(d/r)`` far from both. If panels do
    not tell d from 0 the apex is an edge as that of a punch.
    """
    targets = targets.copy()
    stopped = np.zeros(len(targets), bool)
    least = APEX_WIDTH * np.ptp(zone_edges(problem.all_zones(zones)))
    for i in np.flatnonzero((edges.K0 > 0) & (targets != edges.x)):
        way = np.sign(targets[i] - edges.x[i])
        corner = int(edges.corner[i])
        apexes = problem.apexes[corner]
        apexes = apexes[(way * (apexes - edges.x[i]) >= 0) & (way * (targets[i] - apexes) > 0)]
        if len(apexes):
            past = (edges.K0[i] / (2 * log_sizes_of(problem, zones, apexes, corner))) ** 2
            stops = apexes + way * np.where(past >= least, past, 0.0)
            stop = stops[np.argmin(way * stops)]
            if way * (targets[i] - stop) > 0:
                targets[i] = stop
                stopped[i] = stop == edges.x[i]
    return targets, stopped


def _require_finite_chain(problem: Problem, zones: CornerZones) -> None:
    """Raises NotConverged where a corner touches an edge of the second body."""
    if not decay(problem):
        return
    for corner, intervals in zones.items():
        for edge in np.intersect1d(intervals, problem.ends.get(corner, ())):
            raise NotConverged(
                f"at the edge of the second body at x = {edge:g} zones open again and again, a block's "
                "side apart, which panels do not follow: take Cells()"
            )
