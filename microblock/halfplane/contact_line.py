"""Contact of a half-plane on its contact line alone: the edges of the zones, by Newton's method.

On trial zones the gaps of the corners in contact are closed at all Gauss points (collocation). At a free edge
the pressure must vanish; with ``p = K0/sqrt(r) + K1 sqrt(r)`` at a trial edge the solution has ``dK0_i/de_j =
-delta_ij K1_i/2``, so that moving each edge outwards by ``2 K0/K1`` is Newton's method without a Jacobian.
"""

import numpy as np
from numpy.polynomial.legendre import legvander

from ..errors import NotConverged
from ..model.problem import half_line
from ..model.progress import counted
from ..threads import released
from .carried import decay, meeting_exponent
from .coalescence import extrapolated
from .counter import counter_log_response, counter_response
from .kernels import gap_kernel
from .panel_solution import Estimate, PanelSolution
from .panels import SLIVER, log_response, make_panels, response

TABLE_ERROR = 5e-15  # of the kernels as a rule, 2e-14 at most: see `kernels.Kernels`
EDGE_STEPS = 40  # of Newton's method for the edges
PATIENCE = 6  # of them that do not halve the error of the edges: they crawl towards another topology
LONGEST_MOVE = 0.4  # of an edge in one step, over the distance to its neighbour
# of that distance, where the neighbour is an end of the obstacle for the other corner and draws the edge
PAST = 3.0
OUTER_STEP = 1e-7  # of an edge that is not asked for: its square is left
# -log10 of inner edges over ell, extrapolated to coalescence
INNER_EDGES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)
# norm of 1/sqrt(r) on both sides of an edge, cut off far from it and at the panels' first points
MISSED = 4.0
# of the width, and of the way between two edges that a step leaves: they creep together
CREEPING, NEARER = 1e-2, 0.9
SHORT_OF = 0.7  # of the way to a kink, that an edge moves in one step
AT_KINK = 1e-3  # of the way to the next edge: nearer to a kink than that an edge gets past it
UNTOLD = 1e-9  # of the width: two edges nearer than that which are drawn past each other have met
# of the pressure: edges that are better but not as good as asked for may be at their rounding; the estimate
# has it
ROUNDED = 1e-7
MERGED = 1e-4  # of the tolerance, times the width: edges this near that want to be nearer cross


class EdgesMeet(NotConverged):
    """Two edges of different corners run into each other: a gap between their zones is an overlap, or the
    other way round.

    Attributes
    ----------
    zones : as they were then, {corner: ((left, right), ...)}
    edges : (left, right), these two
    state : PanelSolution or None; one whose pressures are good enough, though not what it shows of these
        edges
    """

    def __init__(self, message, zones, edges, iterations, state):
        super().__init__(message, iterations=iterations)
        self.zones, self.edges, self.state = zones, edges, state


def solve_zones(problem, panels, loads):
    """q and approach with the gaps closed on given zones, at each of the loads, and the noise of the first q.

    Returns
    -------
    (arrays (loads, m), array (loads,), array (m,)); the noise is q under gaps off by TABLE_ERROR of the sum
    of their terms, up and down from node to node.
    """
    panel, _, x, weights = panels.nodes
    count, sides, corner = len(x), 2 if problem.mirror else 1, panels.corner[panel]
    lever = problem.lever(corner, x)
    system, right = np.zeros((count + 1, count + 1)), np.zeros((count + 1, len(loads) + 1))
    system[:count, :count] = response(problem, panels, x, lever, gap_kernel)
    raised = log_response(problem, panels, x, lever, gap_kernel)
    if problem.counter is not None:
        pressed = x - np.array(problem.shifts)[corner]
        system[:count, :count] += counter_response(problem, panels, pressed)
        raised = raised + counter_log_response(problem, panels, pressed)
    system[:count, count] = -1.0
    system[count, :count] = sides * weights
    right[:count, :-1] = -(problem.initial_gap(corner, x) + raised)[:, None]
    right[count, :-1] = loads - sides * panels.log_size @ np.abs(panels.h)
    terms = np.abs(system[:count, :count]).max(axis=1) / weights.max() * loads[0]
    right[:count, -1] = TABLE_ERROR * terms * (-1.0) ** np.arange(count)
    try:
        with released(count):
            solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(
            f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} at load {loads[0]:g}"
        ) from failure
    return solution[:-1, :-1].T, solution[-1, :-1], solution[:-1, -1]


def _share(panels, part, whole):
    """Relative L2 size over x of one q beside another."""
    panel, v, _, weights = panels.nodes
    weights = weights / panels.slope(panel, v)
    return float(np.sqrt(weights @ part**2 / (weights @ whole**2)))


def edge_coefficients(panels, q):
    """{(corner, edge, side): (K0, K1)} of ``p = K0/sqrt(r) + K1 sqrt(r)`` at the anchors of all root panels.

    side is +1 where the panel lies right of its anchor.
    """
    # Legendre series by the Gauss rule itself; value and half the second derivative at v = 0
    points, weights = panels.points
    k = np.arange(panels.order)
    series = (2 * k + 1)[:, None] * legvander(2 * points - 1, panels.order - 1).T * weights
    return _read(
        panels, q, np.array(((-1.0) ** k, (-1.0) ** k * (k - 1) * k * (k + 1) * (k + 2) / 4)) @ series
    )


def _mean_coefficients(panels, q):
    """The same by the best two terms over each panel: K0 is less good, K1 safe where the panel is too smooth
    for the pressure.
    """
    points, weights = panels.points
    terms = np.column_stack((np.ones_like(points), points**2))
    return _read(panels, q, np.linalg.solve(terms.T * weights @ terms, terms.T * weights))


def _read(panels, q, basis):
    """The coefficients from functionals of q on a panel: its value at v = 0, and what stands before v^2."""
    found = {}
    for number in np.flatnonzero(panels.root):
        constant, quadratic = basis @ q[number * panels.order : (number + 1) * panels.order]
        h = abs(panels.h[number])
        key = int(panels.corner[number]), float(panels.e[number]), 1 if panels.h[number] > 0 else -1
        found[key] = constant / (2 * np.sqrt(h)), quadratic / (2 * h**1.5)
    return found


def fit(problem, load, zones, *, order, tolerance, steps=EDGE_STEPS):
    """Move the free edges of trial zones until p vanishes there, for one topology.

    An edge where the obstacle ends stays while it is pressed.

    Parameters
    ----------
    problem : Problem
    load : float, resultant force per thickness
    zones : {corner number: ((left, right), ...)}
    order : Gauss points on a panel
    tolerance : of the edges' share in the relative L2 error of the pressure
    steps : of Newton's method, at most

    Raises
    ------
    NotConverged
        If an edge runs away, K1 turns negative or no progress is made: the topology is another one.
    """
    best, idle, zones, earlier, good, closest = np.inf, 0, _within_ends(problem, zones), None, None, None
    for iteration in range(steps):
        counted()
        if any(np.any(np.diff(np.ravel(intervals)) <= 0) for intervals in zones.values()):
            raise NotConverged(
                f"edges of the zones cross at load {load:g}: another topology of the zones",
                iterations=iteration,
            )
        panels = make_panels(problem, zones, order)
        (q,), (approach,), noise = solve_zones(problem, panels, (load,))
        found = edge_coefficients(panels, q)
        if idle or (earlier and any(found[key][1] <= 0 for key in _edges(zones) if key in found)):
            found = _safer(zones, found, _mean_coefficients(panels, q), earlier)
        moved, error, meeting, crossing = _moved(problem, load, zones, found, tolerance)
        if error <= max(tolerance, ROUNDED):
            estimate = Estimate(None, error, _share(panels, noise, q))
            state = PanelSolution(
                problem, load, zones, panels, q, float(approach), iteration + 1, estimate, further=moved
            )
            if error <= tolerance:
                good = good or state
                if not crossing:
                    return state
            elif closest is None or error < closest.estimate.edges:
                closest = state
        idle, earlier = 0 if error < best / 2 else idle + 1, (zones, found)
        meeting = meeting or (_drawing_near(zones, moved) if idle == PATIENCE else None)
        if meeting:
            raise EdgesMeet(
                f"two edges run into each other at x = {meeting[0]:g} at load {load:g}: another topology "
                "of the "
                "zones",
                zones,
                meeting,
                iteration + 1,
                good,
            )
        if idle == PATIENCE:
            break
        zones, best = moved, min(error, best)
    if good or closest:
        return good or closest
    off = f"off by {error:.1e} of the pressure" if np.isfinite(error) else "where pressures do not fall"
    raise NotConverged(f"edges of the zones still {off} at load {load:g}", iterations=iteration + 1)


def _drawing_near(zones, moved):
    """The two neighbouring edges that lose most of the way between them in a step; None if none lose much."""
    before, after = (np.concatenate([np.ravel(own) for own in each.values()]) for each in (zones, moved))
    order = np.argsort(before)
    before, after = before[order], after[order]
    way, left = np.diff(before), np.diff(after)
    near = np.where(
        (way > 0) & (way < CREEPING * (before[-1] - before[0])), left / np.where(way > 0, way, 1.0), 1.0
    )
    i = int(np.argmin(near))
    return (float(before[i]), float(before[i + 1])) if near[i] < NEARER else None


def _safer(zones, coefficients, means, earlier):
    """Coefficients with K1 from how K0 has changed on the way of each edge, or from the mean over its panel.

    Next to an edge an obstacle may be less smooth than the panel's polynomial takes it for: K0 is good there,
    K1 is not.
    """
    found, (zones_before, before) = dict(coefficients), earlier
    for key, key_before in zip(_edges(zones), _edges(zones_before)):
        if key in found:
            K0, way = found[key][0], key[2] * (key_before[1] - key[1])
            secant = 2 * (before[key_before][0] - K0) / way if key_before in before and way else 0.0
            found[key] = K0, secant if secant > 0 else means[key][1]
    return found


def _edges(zones):
    """[(corner, edge, side)] of the zones' own edges, as coefficients are named."""
    return [
        (corner, float(edge), side)
        for corner, intervals in zones.items()
        for interval in intervals
        for edge, side in zip(interval, (1, -1))
    ]


def _require_finite_chain(problem, zones):
    """NotConverged where a corner touches an edge of the second body: what it carries of the pressure without
    bound there opens a zone a block's side away, whose edges open the next, and so on.
    """
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


def _within_ends(problem, zones):
    """Zones as far as the obstacle goes; what lies beyond is none."""
    found = {}
    for corner, intervals in zones.items():
        cut = [
            tuple(np.clip(interval, *problem.ends.get(corner, (-np.inf, np.inf))).tolist())
            for interval in intervals
        ]
        found[corner] = tuple((left, right) for left, right in cut if left < right)
    if not any(found.values()):
        raise NotConverged("no zone lies under the obstacle")
    _require_finite_chain(problem, found)
    return found


def _moved(problem, load, zones, coefficients, tolerance):
    """Zones with each free edge moved by 2 K0/K1, what the edges miss of the pressure's L2 norm at most, two
    that meet, if any do, and whether the next step would take two neighbours past each other.

    That is K0/sqrt(r), not K0/K1: next to coalescence an edge cannot be distinguished from the next, and need
    not be.
    """
    steps, missing = _steps(problem, zones, coefficients)
    edges = sorted(steps)
    width = edges[-1] - edges[0]
    missed = {edge: float(MISSED * part * np.sqrt(width) / load) for edge, part in missing.items()}
    kinks = np.array([*problem.kinks, *(-kink for kink in problem.kinks if problem.mirror)])
    least, ends, meeting = (
        MERGED * tolerance * width,
        [end for pair in problem.ends.values() for end in pair],
        [],
    )

    def new(corner, edge):
        nearest, *others = sorted(
            (other for other in edges if other != edge), key=lambda other: abs(other - edge)
        )
        way, step = abs(nearest - edge), steps[edge]
        if way < least and missed[edge] > tolerance:
            meeting.append(tuple(sorted((edge, nearest))))
        # two neighbours may drift together further than they may come near to each other
        drift = (step + steps[nearest]) / 2 if others and np.isfinite((step, steps[nearest])).all() else 0.0
        if drift:
            room = LONGEST_MOVE * min(abs(other - each) for other in others for each in (edge, nearest))
            drift = np.clip(drift, -room, room)
        # drawn to where the obstacle ends for the other corner, an edge has to get past it
        past = np.isinf(step) and any(abs(edge + np.sign(step) * way - end) < SLIVER * width for end in ends)
        longest = PAST * way if past else LONGEST_MOVE * way
        move = _not_past(kinks, edge, drift + np.clip(step - drift, -longest, longest), way)
        return float(np.clip(edge + move, *problem.ends.get(corner, (-np.inf, np.inf))))

    moved = {
        corner: tuple((new(corner, left), new(corner, right)) for left, right in intervals)
        for corner, intervals in zones.items()
    }
    ways, away = np.diff(edges), np.array([steps[edge] for edge in edges])
    with np.errstate(invalid="ignore"):  # inf - inf
        crossing = away[:-1] - away[1:] > ways
    near = np.flatnonzero(crossing & (ways < UNTOLD * width))
    meeting += [(edges[near[0]], edges[near[0] + 1])] if len(near) else []
    return moved, max(missed.values(), default=0.0), meeting[0] if meeting else None, bool(crossing.any())


def _not_past(kinks, edge, move, way):
    """A move of an edge, cut short before a kink, beyond which K0 and K1 are others; next to one it gets
    past.
    """
    ahead = (kinks - edge) * np.sign(move)
    if not np.any((ahead > 0) & (SHORT_OF * ahead < abs(move))):
        return move
    first = ahead[ahead > 0].min()
    return np.sign(move) * (min(abs(move), 2 * first) if first < AT_KINK * way else SHORT_OF * first)


def _steps(problem, zones, coefficients):
    """{edge: step along x} and {edge: |K0|} of all edges, also those known by symmetry."""
    steps, missing = {}, {}
    for corner, intervals in zones.items():
        limits = problem.ends.get(corner, ())
        for left, right in intervals:
            for edge, side in ((left, 1), (right, -1)):
                if half_line(problem) and edge == left:
                    continue
                outwards, part = _step(coefficients[corner, float(edge), side], edge in limits)
                steps[edge], missing[edge] = -side * outwards, part
                if problem.mirror:
                    steps[-edge], missing[-edge] = side * outwards, part
    return steps, missing


def _step(coefficients, ending):
    """Outward step of an edge, and |K0|; infinite where K1 has no say. Where the obstacle ends, one that is
    pressed stays.
    """
    K0, K1 = coefficients
    if ending and K0 >= 0:
        return 0.0, 0.0
    return (2 * K0 / K1, abs(K0)) if K1 > 0 else (np.copysign(np.inf, K0), np.inf)


def load_at_inner_edge(problem, inner, outer, order):
    """Load at which two symmetric zones of partial contact are `inner` from the axis: (load, outer edge).

    The inner edge of corner A is prescribed (> 0 leaves a gap, < 0 an overlap) and the load is free: both
    coefficients K0 are affine in it. `outer` is a first guess.
    """
    unit = problem.E_star * float(np.ptp(problem.initial_gap(np.zeros(2, int), np.array([0.0, outer]))))
    for _ in range(EDGE_STEPS):
        panels = make_panels(problem, {0: ((inner, outer),)}, order)
        first, second = (
            edge_coefficients(panels, q) for q in solve_zones(problem, panels, (unit, 2 * unit))[0]
        )
        at = (0, float(inner), 1)
        share = first[at][0] / (first[at][0] - second[at][0])
        at = (0, float(outer), -1)
        K0, K1 = (first[at][i] * (1 - share) + second[at][i] * share for i in (0, 1))
        step = 2 * K0 / K1
        if abs(step) < OUTER_STEP * outer:
            return unit * (1 + share), outer
        outer += float(np.clip(step, -LONGEST_MOVE * outer, LONGEST_MOVE * outer))
    raise NotConverged(
        f"the outer edge still moves by {step:.1e} at the inner edge {inner:g}", iterations=EDGE_STEPS
    )


def coalescence(problem, outer, order=14):
    """Load at which two symmetric zones of partial contact touch: (load, its error).

    With the inner edge at the distance b the load misses it by b^(2 s) and b^(4 s), where p ~ x^s at
    coalescence (`kernels.coalescence_exponent`), so that the limit is extrapolated
    (`coalescence.extrapolated`).
    """
    return extrapolated(
        lambda inner, outer: load_at_inner_edge(problem, inner, outer, order),
        problem.solid,
        INNER_EDGES,
        outer,
        lambda outer: meeting_exponent(problem, {0: ((0.0, outer),), 1: ((-outer, 0.0),)}, 0.0),
    )
