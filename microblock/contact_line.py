"""Contact of a half-plane on its contact line alone: the zones' edges, and the state on the panels fitted to them.

On trial zones the gaps of the corners in contact are closed at all Gauss points (collocation). At a free edge the
pressure must vanish; with ``p = K0/sqrt(r) + K1 sqrt(r)`` at a trial edge the solution has ``dK0_i/de_j =
-delta_ij K1_i/2``, so that moving each edge outwards by ``2 K0/K1`` is Newton's method without a Jacobian.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.polynomial.legendre import legvander

from .errors import NotConverged
from .halfplane import coalescence_exponent
from .panels import SLIVER, Line, Panels, half_line, lagrange, log_response, make_panels, response, zone_edges

TABLE_ERROR = 5e-15  # of the kernels as a rule, 2e-14 at most: see `halfplane.Kernels`
EDGE_STEPS = 40      # of Newton's method for the edges
PATIENCE = 6         # of them that do not halve the error of the edges: they crawl towards another topology
LONGEST_MOVE = 0.4   # of an edge in one step, over the distance to its neighbour
PAST = 3.0           # of that distance, where the neighbour is an end of the obstacle for the other corner and draws the edge
OUTER_STEP = 1e-7    # of an edge that is not asked for: its square is left
INNER_EDGES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)      # -log10 of inner edges over ell, extrapolated to coalescence
MISSED = 4.0         # norm of 1/sqrt(r) on both sides of an edge, cut off far from it and at the panels' first points
MERGED = 1e-4        # of the tolerance, times the width: edges this near that want to be nearer cross
LOOKOUTS = 12        # points on either side of an edge at which gaps are looked at, clustered towards it
JOINT = 1e-12        # of a panel: rounding may leave that between two
NEXT_TO = 1e-10      # least v at which the pressure is looked at: at an edge or a kink it is 0/0 or infinite


@dataclass(frozen=True)
class Estimate:
    """Parts of the relative L2 error of pressure and micromoment; `total` is their sum.

    Attributes
    ----------
    discretisation : float, distance to the next coarser order of panels; None where the order was prescribed
    edges : float, what pressures that do not vanish at the edges are worth
    kernel : float, what errors of the kernel's table do to the pressure at worst
    """

    discretisation: float | None
    edges: float
    kernel: float

    @property
    def total(self):
        return None if self.discretisation is None else self.discretisation + self.edges + self.kernel


@dataclass(frozen=True)
class LineState:
    """A state on fitted panels.

    Attributes
    ----------
    line : Line
    load : float, resultant force per thickness
    zones : {corner number: ((left, right), ...)} of the corners that are computed
    panels, q : the unknowns, see `microblock.panels`
    approach : float, up to the arbitrary level of a half-plane
    iterations : int, steps of Newton's method
    estimate : Estimate
    """

    line: Line
    load: float
    zones: dict
    panels: Panels
    q: np.ndarray
    approach: float
    iterations: int
    estimate: Estimate

    @property
    def error_estimate(self):
        """Relative L2 error of pressure and micromoment, None where the order of the panels was prescribed."""
        return self.estimate.total

    @cached_property
    def all_zones(self):
        """{corner number: intervals} of all corners, also those known by symmetry."""
        if not self.line.mirror or half_line(self.line):
            return self.zones
        return {0: self.zones[0], 1: tuple((-right, -left) for left, right in reversed(self.zones[0]))}

    @cached_property
    def _anchored(self):
        """q at the anchor of each panel with a square root, but for edges that the obstacle's ends fix: 0 in the limit."""
        basis = lagrange(self.panels.points[0], np.zeros(1))[0]
        values = self.q.reshape(-1, self.panels.order) @ basis
        infinite = [end for ends in self.line.ends.values() for end in ends]
        return np.where(self.panels.root & ~np.isin(self.panels.e, infinite), values, 0.0)

    @cached_property
    def _at_own_edges(self):
        """The same at the corner's own edges only; at the other's, taking it off would change the load."""
        own = [{edge for interval in self.zones[corner] for edge in interval} for corner in self.panels.corner]
        return np.where([e in edges for e, edges in zip(self.panels.e, own)], self._anchored, 0.0)

    def pressure(self, corner, x):
        """Pressure of a corner at x, array (n,)."""
        x = np.asarray(x, float)
        if half_line(self.line):
            x = np.abs(x)
        elif self.line.mirror and corner == 1:
            return self.pressure(0, -x)
        found, own = np.zeros_like(x), np.flatnonzero(self.panels.corner == corner)
        known = ~np.any([(left <= x) & (x <= right) for left, right in self.zones[corner]], axis=0) if len(own) else x == x
        for slack, number in product((0.0, JOINT), own):
            e, h = self.panels.e[number], self.panels.h[number]
            along = (x - e)/h
            here = (along >= -slack) & (along <= 1 + slack) & ~known
            if here.any():
                v = np.maximum(self.panels.parameter(number, e + h*np.abs(along[here])), NEXT_TO)
                q = lagrange(self.panels.points[0], v) @ self.q[number*self.panels.order:(number + 1)*self.panels.order]
                found[here] = (q - self._anchored[number])/self.panels.slope(number, v) + self.panels.logarithm(number, v)
                known |= here
        return found

    @cached_property
    def x(self):
        """All Gauss points of the whole line, ascending, those of both corners once."""
        x = self.panels.nodes[2]
        return _distinct(np.concatenate((x, -x)) if self.line.mirror else x)

    @cached_property
    def weights(self):
        """Weights at `x`: their sum with the pressure is the load."""
        x, weights = self.panels.nodes[2], self.panels.rule
        if self.line.mirror:
            x, weights = np.concatenate((x, -x)), np.tile(weights, 2)
        found = np.zeros_like(self.x)
        found[_places(self.x, x)] = weights
        return found

    @cached_property
    def pressures(self):
        """Pressure of each corner at `x`, array (corners, n); brought to the load, which the trimmed edges miss by little."""
        panel, v, x, _ = self.panels.nodes
        p = (self.q - self._at_own_edges[panel])/self.panels.slope(panel, v) + self.panels.logarithm(panel, v)
        found = np.zeros((len(self.line.law.corners), len(self.x)))
        found[self.panels.corner[panel], _places(self.x, x)] = p
        if self.line.mirror:
            found = found + found[::-1, ::-1]
        return found*(self.load/(self.weights @ found.sum(axis=0)))

    @cached_property
    def micromoment(self):
        """M of (29) at `x`; where psi is prescribed, the reaction to it."""
        if self.line.law.clamps_rotation:
            return self.reaction(self.x)
        levers = [self.line.lever(np.full(len(self.x), corner), self.x) for corner in range(len(self.pressures))]
        return self.line.solid.ell/2*np.sum(levers*self.pressures, axis=0)

    def reaction(self, x):
        """M that holds psi = 0 where it is prescribed on the whole surface, at x, array (n,)."""
        return self._response(x, np.zeros_like(x), self.line.clamping_kernel)

    @cached_property
    def psi(self):
        """Microrotation at `x`."""
        return self.rotation(self.x)

    def rotation(self, x):
        """Microrotation of the surface at x, array (n,)."""
        if self.line.law.clamps_rotation:
            return np.zeros_like(x)
        sunk, turned = (self._response(x, np.full_like(x, lever), self.line.kernel) for lever in (0.0, 1.0))
        return 2/self.line.solid.ell*(turned - sunk)

    def _response(self, x, lever, kernel):
        return response(self.line, self.panels, x, lever, kernel) @ self.q + log_response(self.line, self.panels, x, lever, kernel)

    def gaps(self, corner, x):
        """Gaps of a corner at x, array (n,)."""
        numbers = np.full(len(x), corner)
        return (self.line.initial_gap(numbers, x) - self.approach
                + self._response(x, self.line.lever(numbers, x), self.line.kernel))

    @cached_property
    def energy(self):
        """Elastic energy, up to the arbitrary level: half the work of the corner forces."""
        numbers = np.arange(len(self.pressures))
        sunk = [self.approach - self.line.initial_gap(np.full(len(self.x), number), self.x) for number in numbers]
        work = np.where(self.pressures != 0, self.pressures*np.where(np.isfinite(sunk), sunk, 0.0), 0.0)
        return float(np.sum(work @ self.weights)/2)


def solve_zones(line, panels, loads):
    """q and approach with the gaps closed on given zones, at each of the loads, and the noise of the first q.

    Returns
    -------
    (arrays (loads, m), array (loads,), array (m,)); the noise is q under gaps off by TABLE_ERROR of the sum of their terms,
    up and down from node to node.
    """
    panel, _, x, weights = panels.nodes
    count, sides, corner = len(x), 2 if line.mirror else 1, panels.corner[panel]
    lever = line.lever(corner, x)
    system, right = np.zeros((count + 1, count + 1)), np.zeros((count + 1, len(loads) + 1))
    system[:count, :count] = response(line, panels, x, lever, line.kernel)
    system[:count, count] = -1.0
    system[count, :count] = sides*weights
    right[:count, :-1] = -(line.initial_gap(corner, x) + log_response(line, panels, x, lever, line.kernel))[:, None]
    right[count, :-1] = loads - sides*panels.log_size @ np.abs(panels.h)
    terms = np.abs(system[:count, :count]).max(axis=1)/weights.max()*loads[0]
    right[:count, -1] = TABLE_ERROR*terms*(-1.0)**np.arange(count)
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} "
                           f"at load {loads[0]:g}") from failure
    return solution[:-1, :-1].T, solution[-1, :-1], solution[:-1, -1]


def _share(panels, part, whole):
    """Relative L2 size over x of one q beside another."""
    panel, v, _, weights = panels.nodes
    weights = weights/panels.slope(panel, v)
    return float(np.sqrt(weights @ part**2/(weights @ whole**2)))


def edge_coefficients(panels, q):
    """{(corner, edge, side): (K0, K1)} of ``p = K0/sqrt(r) + K1 sqrt(r)`` at the anchors of all root panels.

    side is +1 where the panel lies right of its anchor.
    """
    # Legendre series by the Gauss rule itself; value and half the second derivative at v = 0
    points, weights = panels.points
    k = np.arange(panels.order)
    series = (2*k + 1)[:, None]*legvander(2*points - 1, panels.order - 1).T*weights
    basis = np.array(((-1.0)**k, (-1.0)**k*(k - 1)*k*(k + 1)*(k + 2)/4)) @ series
    found = {}
    for number in np.flatnonzero(panels.root):
        constant, quadratic = basis @ q[number*panels.order:(number + 1)*panels.order]
        h = abs(panels.h[number])
        key = int(panels.corner[number]), float(panels.e[number]), 1 if panels.h[number] > 0 else -1
        found[key] = constant/(2*np.sqrt(h)), quadratic/(2*h**1.5)
    return found


def fit(line, load, zones, *, order, tolerance):
    """Move the free edges of trial zones until p vanishes there, for one topology.

    An edge where the obstacle ends stays while it is pressed.

    Parameters
    ----------
    line : Line
    load : float, resultant force per thickness
    zones : {corner number: ((left, right), ...)}
    order : Gauss points on a panel
    tolerance : of the edges' share in the relative L2 error of the pressure

    Raises
    ------
    NotConverged
        If an edge runs away, K1 turns negative or no progress is made: the topology is another one.
    """
    best, idle = np.inf, 0
    zones = {corner: tuple(tuple(np.clip(interval, *line.ends.get(corner, (-np.inf, np.inf))).tolist()) for interval in intervals)
             for corner, intervals in zones.items()}
    for iteration in range(EDGE_STEPS):
        panels = make_panels(line, zones, order)
        (q,), (approach,), noise = solve_zones(line, panels, (load,))
        moved, error = _moved(line, load, zones, edge_coefficients(panels, q), tolerance)
        if error <= tolerance:
            return LineState(line, load, zones, panels, q, float(approach), iteration + 1,
                             Estimate(None, error, _share(panels, noise, q)))
        idle = 0 if error < best/2 else idle + 1
        if idle == PATIENCE:
            break
        zones, best = moved, min(error, best)
    raise NotConverged(f"edges of the zones still off by {error:.1e} of the pressure at load {load:g}",
                       iterations=iteration + 1)


def _moved(line, load, zones, coefficients, tolerance):
    """Zones with each free edge moved by 2 K0/K1, and what the edges miss of the pressure's L2 norm at most.

    That is K0/sqrt(r), not K0/K1: next to coalescence an edge cannot be told from the next, and need not be.
    """
    edges = zone_edges(zones)
    edges = sorted({*edges, *(-edge for edge in edges)}) if line.mirror else edges
    width = edges[-1] - edges[0]
    moved, errors, least = {}, [0.0], MERGED*tolerance*width
    all_ends = [end for pair in line.ends.values() for end in pair]
    for corner, intervals in zones.items():
        new = []
        for left, right in intervals:
            limits = line.ends.get(corner, (-np.inf, np.inf))
            right_step = _step(coefficients[corner, float(right), -1], right in limits)
            left_step = right_step if half_line(line) else _step(coefficients[corner, float(left), 1], left in limits)
            pair = []
            for edge, sign, (outwards, missing) in ((left, -1, left_step), (right, 1, right_step)):
                step = sign*outwards
                way = min(abs(edge - other) for other in edges if other != edge)
                missed = float(MISSED*missing*np.sqrt(width)/load)
                if way < least and missed > tolerance:
                    raise NotConverged(f"two edges run into each other at x = {edge:g}: another topology of the zones")
                errors.append(missed)
                # drawn to where the obstacle ends for the other corner, an edge has to get past it
                past = np.isinf(step) and any(abs(edge + np.sign(step)*way - end) < SLIVER*width for end in all_ends)
                longest = PAST*way if past else LONGEST_MOVE*way
                pair.append(float(np.clip(edge + np.clip(step, -longest, longest), *limits)))
            new.append(tuple(pair))
        moved[corner] = tuple(new)
    return moved, max(errors)


def _step(coefficients, ending):
    """Outward step of an edge, and |K0|; infinite where K1 has no say. Where the obstacle ends, one that is pressed stays."""
    K0, K1 = coefficients
    if ending and K0 >= 0:
        return 0.0, 0.0
    return (2*K0/K1, abs(K0)) if K1 > 0 else (np.copysign(np.inf, K0), np.inf)


def load_at_inner_edge(line, inner, outer, order):
    """Load at which two symmetric zones of partial contact are `inner` from the axis: (load, outer edge).

    The inner edge of corner A is prescribed (> 0 leaves a gap, < 0 an overlap) and the load is free: both
    coefficients K0 are affine in it. `outer` is a first guess.
    """
    unit = line.solid.E_star*float(np.ptp(line.initial_gap(np.zeros(2, int), np.array([0.0, outer]))))
    for _ in range(EDGE_STEPS):
        panels = make_panels(line, {0: ((inner, outer),)}, order)
        first, second = (edge_coefficients(panels, q) for q in solve_zones(line, panels, (unit, 2*unit))[0])
        at = (0, float(inner), 1)
        share = first[at][0]/(first[at][0] - second[at][0])
        at = (0, float(outer), -1)
        K0, K1 = (first[at][i]*(1 - share) + second[at][i]*share for i in (0, 1))
        step = 2*K0/K1
        if abs(step) < OUTER_STEP*outer:
            return unit*(1 + share), outer
        outer += float(np.clip(step, -LONGEST_MOVE*outer, LONGEST_MOVE*outer))
    raise NotConverged(f"the outer edge still moves by {step:.1e} at the inner edge {inner:g}", iterations=EDGE_STEPS)


def coalescence(line, outer, order=14):
    """Load at which two symmetric zones of partial contact touch: (load, its error).

    With the inner edge at the distance b the load misses it by b^(2 s) and b^(4 s), where p ~ x^s at coalescence
    (`halfplane.coalescence_exponent`): two Richardson steps on shrinking b, from the side of a gap and from that of an
    overlap. The error is the larger of the last correction and the distance of the two sides.
    """
    exponent = coalescence_exponent(line.solid)
    limits, corrections = [], []
    for side in (1, -1):
        column = []
        for digits in INNER_EDGES:
            load, outer = load_at_inner_edge(line, side*line.solid.ell*10.0**-digits, outer, order)
            column.append(load)
        for power in (2, 4):
            ratio = 10.0**(-power*exponent*(INNER_EDGES[1] - INNER_EDGES[0]))
            column = [(fine - ratio*coarse)/(1 - ratio) for coarse, fine in zip(column, column[1:])]
        limits.append(column[-1])
        corrections.append(abs(column[-1] - column[-2]))
    return sum(limits)/2, max(*corrections, abs(limits[0] - limits[1]))


def violation(state):
    """Largest violation of (26): pull over the largest pressure, and overlap over the size of the gaps."""
    return float(max(0.0, *(wrong.max(initial=0.0) for _, wrong in violations(state).values())))


def violations(state):
    """{corner: (x ascending, violation of (26) there)} of the corners that are computed, see `violation`."""
    line, found = state.line, {}
    edges = np.array(zone_edges(state.all_zones))
    width, top = edges[-1] - edges[0], state.pressures.max()
    steps = width*0.5*(np.arange(1, LOOKOUTS + 1)/LOOKOUTS)**3
    around = np.unique(np.concatenate([edge + sign*steps for edge in edges for sign in (1, -1)]))
    heights = line.initial_gap(np.zeros(len(around), int), around)
    size = np.ptp(heights[np.isfinite(heights)]) or width
    for corner in line.corners:
        own = np.zeros(len(around), bool)
        inside = np.zeros(len(state.x), bool)
        for left, right in state.zones[corner]:
            own |= (around >= left) & (around <= right)
            inside |= (state.x >= left) & (state.x <= right)
        if half_line(line):
            own |= around < 0
        places, nodes = around[~own], state.x[inside]
        x = np.concatenate((places, nodes))
        wrong = np.concatenate((-state.gaps(corner, places)/size, -state.pressures[corner, inside]/top))
        order = np.argsort(x)
        found[corner] = x[order], wrong[order]
    return found


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 over the contact, between two states of one scene."""
    x, weights, ell = fine.x, fine.weights, fine.line.solid.ell
    p = np.array([coarse.pressure(corner, x) for corner in range(len(fine.pressures))])
    if fine.line.law.clamps_rotation:
        moment = (coarse.reaction(x) - fine.micromoment)/ell
    else:
        levers = [fine.line.lever(np.full(len(x), corner), x) for corner in range(len(p))]
        moment = (ell/2*np.sum(levers*p, axis=0) - fine.micromoment)/ell
    total = fine.pressures.sum(axis=0)
    errors = (weights @ (p.sum(axis=0) - total)**2, weights @ moment**2)
    return float(np.sqrt(max(errors)/(weights @ total**2)))


def _distinct(x):
    x = np.sort(x)
    return x[np.concatenate(([True], np.diff(x) > 1e-13*(x[-1] - x[0])))]


def _places(sorted_x, x):
    """Indices of x in sorted_x, up to rounding."""
    right = np.clip(np.searchsorted(sorted_x, x), 1, len(sorted_x) - 1)
    return np.where(np.abs(sorted_x[right - 1] - x) < np.abs(sorted_x[right] - x), right - 1, right)
