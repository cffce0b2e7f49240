"""Edges of the zones on the contact line by Newton's method (docs/theory/halfplane.md).

On trial zones the gaps are closed. With ``p = K0/sqrt(r) + K1 sqrt(r)`` at a trial edge the solution has
``dK0_i/de_j = -delta_ij K1_i/2``.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import legvander

from ..errors import NotConverged
from ..model.intervals import common, zone_edges
from ..model.problem import half_line
from ..model.progress import counted
from ..model.quadrature import gauss_rule
from ..threads import with_outer_threads
from .kernels import gap_kernel
from .panel_solution import Estimate, PanelSolution
from .panels import make_panels, response
from .second_half_plane import counter_kernel
from .transmitted_singularities import decay, log_sizes_of

RESOLVED = 1e-10  # of the width of all zones: an edge this far from a tip is told from it


def tolerated(order):
    """Error of the pressure that panels of an order leave where obstacles are rough."""
    return 10 ** (-(order + 6) / 4)


def solve_zones(problem, panels, load):
    """q and approach with closed gaps at a load, and the share of rounded gaps in q in L2."""
    panel, v, x, weights = panels.nodes
    count, sides, corner = len(x), 2 if problem.mirror else 1, panels.corner[panel]
    lever = problem.lever(corner, x)
    system, right = np.zeros((count + 1, count + 1)), np.zeros((count + 1, 2))
    system[:count, :count], raised = response(problem, panels, x, lever, gap_kernel)
    if problem.counter is not None:
        places = x - np.array(problem.shifts)[corner]
        by_counter = response(problem, panels, places, 0 * x, counter_kernel, problem.shifts)
        system[:count, :count] += by_counter[0]
        raised = raised + by_counter[1]
    system[:count, count] = -1.0
    system[count, :count] = sides * weights
    right[:count, 0] = -(problem.initial_gap(corner, x) + raised)
    right[count, 0] = load - sides * panels.log_size @ np.abs(panels.h)
    terms = np.abs(system[:count, :count]).max(axis=1) / weights.max() * load
    right[:count, 1] = 5e-15 * terms * (-1.0) ** np.arange(count)
    try:
        with with_outer_threads(count):
            solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(
            f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} at load {load:g}"
        ) from failure
    (q, noise), squares = solution[:-1].T, weights / panels.slope(panel, v)
    return q, float(solution[-1, 0]), float(np.sqrt(squares @ noise**2 / (squares @ q**2)))


def _coefficients(problem, panels, q, corner, edge, side):
    """K0 and K1 of edges, `side` 1 where the zone lies to the right, and K1 of the best two terms over the
    panel there: arrays (n,).
    """
    way = np.where(half_line(problem) & (edge < 0), -1, 1)  # of mirror images
    anchors = np.sign(panels.h) * panels.root, panels.corner, panels.e
    alike = [own == each[:, None] for own, each in zip(anchors, (side * way, corner, edge * way))]
    number = np.nonzero(np.logical_and.reduce(alike))[1]  # one panel an edge
    h = np.abs(panels.h[number])
    values = q.reshape(-1, panels.order)[number] @ _edge_terms(panels.order)
    return values.T / (2 * np.sqrt(h) * np.array((h**0, h, h)))


@lru_cache
def _edge_terms(order):
    # Legendre series by the Gauss rule itself; value and half the second derivative at v = 0
    (points, weights), k = gauss_rule(order), np.arange(order)
    series = (-1.0) ** k * (2 * k + 1) * legvander(2 * points - 1, order - 1) * weights[:, None]
    terms = np.column_stack((np.ones_like(points), points**2))
    best = np.linalg.solve(terms.T * weights @ terms, terms.T * weights)[1]
    return np.column_stack((series.sum(axis=1), series @ ((k - 1) * k * (k + 1) * (k + 2) / 4), best))


def fit(problem, load, zones, order, tolerance):
    """The PanelSolution with the free edges moved from trial zones {corner: ((left, right), ...)} until their
    share in the relative L2 error is a tolerance; the best one, if it reaches the root of what the order
    leaves. Raises NotConverged if no zone is left, edges do not settle, or zones open without end.
    """
    best, idle, iterations, before = None, 0, 0, None
    zones = {corner: common(own, problem.pieces_of(corner)) for corner, own in zones.items()}
    zones = _sorted_out(
        problem,
        load,
        [(corner, edge, edge, False) for corner, own in zones.items() for edge in np.ravel(own)],
    )
    while idle < 6:
        counted()
        iterations += 1
        panels = make_panels(problem, zones, order)
        q, approach, noise = solve_zones(problem, panels, load)
        # 4 is the norm of 1/sqrt(r) on both sides of an edge, cut off far from it and at the first points
        unit = load / (4 * np.sqrt(np.ptp(zone_edges(problem.all_zones(zones)))))
        further, missed, before = _moved(problem, load, zones, panels, q, before, tolerance * unit)
        estimate = Estimate(None, float(missed / unit), noise)
        state = PanelSolution(
            problem, load, zones, panels, q, approach, iterations, estimate, further=further
        )
        least = best.estimate.edges if best else np.inf
        idle = 0 if estimate.edges < least / 2 else idle + 1
        # next to the load at which edges meet, one more step tells how they lie
        settled = estimate.edges <= tolerance and _arranged(problem, zones) == _arranged(problem, further)
        best, zones = state if settled or not least <= estimate.edges else best, further
        if settled:
            break
    if not best.estimate.edges <= max(tolerance, np.sqrt(tolerated(order))):
        raise NotConverged(
            f"edges of the zones still off by {best.estimate.edges:.1e} of the pressure at load {load:g}",
            iterations=iterations,
        )
    _require_finite_chain(problem, best.zones)
    return best


def _arranged(problem, zones):
    edges = [(edge, corner) for corner, own in problem.all_zones(zones).items() for edge in np.ravel(own)]
    return [corner for _, corner in sorted(edges)]


def _moved(problem, load, zones, panels, q, before, tolerance):
    """Zones with free edges moved by 2 K0/K1 or a secant, the largest |K0|, and the corners, places and K0 of
    all edges.
    """
    corner, edge = np.array([(number, x) for number, own in zones.items() for x in np.ravel(own)]).T
    side = 1 - 2 * (np.arange(len(edge)) % 2)
    K0, K1, mean = _coefficients(problem, panels, q, corner, edge, side)
    free = (K0 < 0) | [x not in problem.ends.get(number, ()) for number, x in zip(corner, edge)]
    alike = before and np.array_equal(before[0], corner)
    place, last = before[1:] if alike else (edge, np.full_like(edge, np.inf))
    secant = np.divide(2 * (last - K0) * side, place - edge, out=np.zeros_like(edge), where=place != edge)
    slow = (K1 <= 0) | (np.abs(K0) > np.abs(last) / 2)
    K1 = np.where(slow, np.where(secant > 0, secant, mean), K1)
    # half way to the next edge: outwards there may be none
    apart = np.where(corner[1:] == corner[:-1], edge[1:] - edge[:-1], np.inf)
    after, behind = np.concatenate((apart, [np.inf])), np.concatenate(([np.inf], apart))
    width, hole = np.where(side > 0, (after, behind), (behind, after))
    room = np.where((K0 < 0) | np.isinf(hole), width, hole)
    step = np.where(np.abs(K0) > tolerance, np.copysign(room / 2, K0), 0.0)
    np.divide(2 * K0, K1, out=step, where=K1 > 0)
    step = np.maximum(step, -8 * hole)  # a zone that has just opened knows nothing of what lies farther
    forces = q.reshape(-1, panels.order) @ panels.points[1] + panels.log_size * np.abs(panels.h)
    middle, left, right = panels.e + panels.h / 2, edge[::2, None], edge[1::2, None]
    inside = (panels.corner == corner[::2, None]) & (left < middle) & (middle < right)
    pressed = np.repeat(inside @ forces > 0, 2) & (side > 0)
    targets, held = _stopped_at_tips(problem, zones, corner, edge, K0, edge - side * step * free)
    rows = np.transpose((corner, edge, targets, pressed))
    free &= ~held
    return _sorted_out(problem, load, rows), np.abs(K0[free]).max(initial=0.0), (corner, edge, K0)


def _stopped_at_tips(problem, zones, corner, edge, K0, targets):
    """Where edges go that would pass a tip of the obstacle, and which of them stay on it, arrays (n,).

    A zone that ends at a tip with ``p = K0/sqrt(r)`` goes on by ``d = (K0/(2 K))^2``, K of the logarithm
    there: ``K log((sqrt(r) + sqrt(d))/(sqrt(r) - sqrt(d)))`` is ``2 K sqrt(d/r)`` far from both. If panels do
    not tell d from 0 the tip is an edge as that of a punch.
    """
    targets, held = targets.copy(), np.zeros(len(edge), bool)
    least = RESOLVED * np.ptp(zone_edges(problem.all_zones(zones)))
    for i in np.flatnonzero((K0 > 0) & (targets != edge)):
        way, number = np.sign(targets[i] - edge[i]), int(corner[i])
        tips = problem.tips[number]
        tips = tips[(way * (tips - edge[i]) >= 0) & (way * (targets[i] - tips) > 0)]
        if not len(tips):
            continue
        beyond = (K0[i] / (2 * log_sizes_of(problem, zones, tips, number))) ** 2
        stops = tips + way * np.where(beyond >= least, beyond, 0.0)
        stop = stops[np.argmin(way * stops)]
        if way * (targets[i] - stop) > 0:
            targets[i], held[i] = stop, stop == edge[i]
    return targets, held


def _sorted_out(problem, load, rows):
    edges = np.array(rows, float)
    for corner in problem.corners:
        own, pieces = edges[:, 0] == corner, np.clip(problem.pieces_of(corner), *problem.reach)
        piece = np.searchsorted(pieces[1:, 0], edges[own, 1], side="right")  # that an edge moves in
        edges[own, 2] = np.clip(edges[own, 2], *pieces[piece].T)
    edges = _annihilated(edges)
    if problem.mirror and not half_line(problem):
        edges = np.concatenate((edges, (edges * (-1, -1, -1, 1) + (1, 0, 0, 0))[::-1]))
    order = np.argsort(edges[:, 1], kind="stable")
    for i, j in zip(order, order[1:]):
        (one, start, end, _), (other, stop, reached, _) = edges[i], edges[j]
        if one != other and start < stop and end > reached:
            edges[[i, j], 2] = (end + reached + (stop - start) / 2 * np.array((1, -1))) / 2
    edges = _annihilated(edges)
    if not len(edges):
        raise NotConverged(f"no zone is left at load {load:g}")
    places = {corner: edges[edges[:, 0] == corner, 2].reshape(-1, 2) for corner in problem.corners}
    return problem.computed({corner: tuple(map(tuple, own.tolist())) for corner, own in places.items()})


def _annihilated(edges):
    """Edges without neighbours of one corner that have met; a pressed zone is halved."""
    while True:
        ways = np.where(edges[1:, 0] == edges[:-1, 0], edges[1:, 2] - edges[:-1, 2], np.inf)
        if not len(ways) or ways.min() > 0:
            return edges
        i = int(np.argmin(ways))
        (_, left, one, pressed), (_, right, other, _) = edges[i : i + 2]
        if pressed:
            half = (right - left) / 4
            middle = np.clip((one + other) / 2, left + half, right - half)
            edges[i : i + 2, 2:] = (middle - half, 0), (middle + half, 0)
        else:
            edges = np.delete(edges, (i, i + 1), axis=0)


def _require_finite_chain(problem, zones):
    """NotConverged where a corner touches an edge of the second body."""
    touched = [
        edge
        for corner, intervals in zones.items()
        for edge in np.ravel(intervals)
        if edge in problem.ends.get(corner, ())
    ]
    if touched and decay(problem):
        raise NotConverged(
            f"at the edge of the second body at x = {touched[0]:g} zones open again and again, a block's "
            "side apart, which panels do not follow: take Cells()"
        )
