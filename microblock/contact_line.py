"""Contact of a half-plane on its contact line alone: the zones' edges, and the state on the panels fitted to them.

On trial zones the gaps of the corners in contact are closed at all Gauss points (collocation). At a free edge the
pressure must vanish; with ``p = K0/sqrt(r) + K1 sqrt(r)`` at a trial edge the solution has ``dK0_i/de_j =
-delta_ij K1_i/2``, so that moving each edge outwards by ``2 K0/K1`` is Newton's method without a Jacobian.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import legvander

from .errors import NotConverged
from .halfplane import coalescence_exponent
from .panels import Line, Panels, gap_matrix, half_line, lagrange, make_panels, response, zone_edges

EDGE_STEPS = 40      # of Newton's method for the edges
LONGEST_MOVE = 0.4   # of an edge in one step, over the distance to its neighbour
OUTER_STEP = 1e-7    # of an edge that is not asked for: its square is left
INNER_EDGES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)      # -log10 of inner edges over ell, extrapolated to coalescence
MISSED = 4.0         # norm of 1/sqrt(r) on both sides of an edge, cut off far from it and at the panels' first points
MERGED = 1e-4        # of the tolerance, times the width: edges this near that want to be nearer cross
LOOKOUTS = 12        # points on either side of an edge at which gaps are looked at, clustered towards it
VIOLATION = 1e-3     # of the gaps' and the pressure's size, beyond which a topology is refused


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
    fixed : edges that the obstacle's ends fix
    iterations, edge_error : steps of Newton's method, and what the edges miss of the pressure, relative in L2
    """

    line: Line
    load: float
    zones: dict
    panels: Panels
    q: np.ndarray
    approach: float
    fixed: tuple
    iterations: int
    edge_error: float

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
        return np.where(self.panels.root & ~np.isin(self.panels.e, self.fixed), values, 0.0)

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
        found = np.zeros_like(x)
        for number in np.flatnonzero(self.panels.corner == corner):
            e, h, root = (getattr(self.panels, name)[number] for name in ("e", "h", "root"))
            along = (x - e)/h
            here = (along >= 0) & (along <= 1) & (x != e)
            v = np.sqrt(along[here]) if root else along[here]
            q = lagrange(self.panels.points[0], v) @ self.q[number*self.panels.order:(number + 1)*self.panels.order]
            found[here] = (q - self._anchored[number])/self.panels.slope(number, v)
        return found

    @cached_property
    def x(self):
        """All Gauss points of the whole line, ascending, those of both corners once."""
        x = self.panels.nodes[2]
        return _distinct(np.concatenate((x, -x)) if self.line.mirror else x)

    @cached_property
    def weights(self):
        """Weights at `x`: their sum with the pressure is the load."""
        panel, v, x, gauss = self.panels.nodes
        weights = gauss*self.panels.slope(panel, v)
        if self.line.mirror:
            x, weights = np.concatenate((x, -x)), np.tile(weights, 2)
        found = np.zeros_like(self.x)
        found[_places(self.x, x)] = weights
        return found

    @cached_property
    def pressures(self):
        """Pressure of each corner at `x`, array (corners, n); brought to the load, which the trimmed edges miss by little."""
        panel, v, x, _ = self.panels.nodes
        p = (self.q - self._at_own_edges[panel])/self.panels.slope(panel, v)
        found = np.zeros((len(self.line.law.corners), len(self.x)))
        found[self.panels.corner[panel], _places(self.x, x)] = p
        if self.line.mirror:
            found = found + found[::-1, ::-1]
        return found*(self.load/(self.weights @ found.sum(axis=0)))

    @cached_property
    def micromoment(self):
        """M of (29) at `x`; where psi is prescribed, the reaction to it."""
        if self.line.law.clamps_rotation:
            return response(self.line, self.panels, self.x, 0*self.x, self.line.clamping_kernel) @ self.q
        levers = [self.line.lever(np.full(len(self.x), corner), self.x) for corner in range(len(self.pressures))]
        return self.line.solid.ell/2*np.sum(levers*self.pressures, axis=0)

    @cached_property
    def psi(self):
        """Microrotation at `x`."""
        return self.rotation(self.x)

    def rotation(self, x):
        """Microrotation of the surface at x, array (n,)."""
        if self.line.law.clamps_rotation:
            return np.zeros_like(x)
        sunk, turned = (response(self.line, self.panels, x, np.full_like(x, lever), self.line.kernel) @ self.q
                        for lever in (0.0, 1.0))
        return 2/self.line.solid.ell*(turned - sunk)

    def gaps(self, corner, x):
        """Gaps of a corner at x, array (n,)."""
        numbers = np.full(len(x), corner)
        return (self.line.initial_gap(numbers, x) - self.approach
                + gap_matrix(self.line, self.panels, x, numbers) @ self.q)

    @cached_property
    def energy(self):
        """Elastic energy, up to the arbitrary level: half the work of the corner forces."""
        numbers = np.arange(len(self.pressures))
        sunk = [self.approach - self.line.initial_gap(np.full(len(self.x), number), self.x) for number in numbers]
        work = np.where(self.pressures != 0, self.pressures*np.where(np.isfinite(sunk), sunk, 0.0), 0.0)
        return float(np.sum(work @ self.weights)/2)


def solve_zones(line, panels, loads):
    """q and approach with the gaps closed on given zones, at each of the loads: arrays (loads, m) and (loads,)."""
    panel, _, x, weights = panels.nodes
    count, sides = len(x), 2 if line.mirror else 1
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = gap_matrix(line, panels, x, panels.corner[panel])
    system[:count, count] = -1.0
    system[count, :count] = sides*weights
    right = np.empty((count + 1, len(loads)))
    right[:count] = -line.initial_gap(panels.corner[panel], x)[:, None]
    right[count] = loads
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} "
                           f"at load {loads[0]:g}") from failure
    return solution[:-1].T, solution[-1]


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


def fit(line, load, zones, *, order, tolerance, kinks=(), fixed=()):
    """Move the free edges of trial zones until p vanishes there, for one topology.

    Parameters
    ----------
    line : Line
    load : float, resultant force per thickness
    zones : {corner number: ((left, right), ...)}
    order : Gauss points on a panel
    tolerance : of the edges' share in the relative L2 error of the pressure
    kinks, fixed : abscissae at which the obstacle has a kink, and where its end fixes an edge

    Raises
    ------
    NotConverged
        If an edge runs away or K1 turns negative: the topology is another one.
    """
    for iteration in range(EDGE_STEPS):
        panels = make_panels(line, zones, kinks, order)
        (q,), (approach,) = solve_zones(line, panels, (load,))
        moved, error = _moved(line, load, zones, edge_coefficients(panels, q), fixed, tolerance)
        if error <= tolerance:
            return LineState(line, load, zones, panels, q, float(approach), tuple(fixed), iteration + 1, error)
        zones = moved
    raise NotConverged(f"edges of the zones still off by {error:.1e} of the pressure at load {load:g}",
                       iterations=EDGE_STEPS)


def _moved(line, load, zones, coefficients, fixed, tolerance):
    """Zones with each free edge moved by 2 K0/K1, and what the edges miss of the pressure's L2 norm at most.

    That is K0/sqrt(r), not K0/K1: next to coalescence an edge cannot be told from the next, and need not be.
    """
    edges = zone_edges(zones)
    edges = sorted({*edges, *(-edge for edge in edges)}) if line.mirror else edges
    width = edges[-1] - edges[0]
    moved, errors, least = {}, [0.0], MERGED*tolerance*width
    for corner, intervals in zones.items():
        new = []
        for left, right in intervals:
            right_step = _step(corner, right, -1, coefficients, fixed)
            left_step = right_step if half_line(line) else _step(corner, left, 1, coefficients, fixed)
            pair = []
            for edge, sign, (outwards, missing) in ((left, -1, left_step), (right, 1, right_step)):
                step = sign*outwards
                way = min(abs(edge - other) for other in edges if other != edge)
                missed = MISSED*missing*np.sqrt(width)/load
                if way < least and missed > tolerance:
                    raise NotConverged(f"two edges run into each other at x = {edge:g}: another topology of the zones")
                errors.append(missed)
                pair.append(edge + float(np.clip(step, -LONGEST_MOVE*way, LONGEST_MOVE*way)))
            new.append(tuple(pair))
        moved[corner] = tuple(new)
    return moved, max(errors)


def _step(corner, edge, side, coefficients, fixed):
    """Outward step of one edge, left (side 1) or right (side -1) of its interval, and |K0|; infinite where K1 has no say."""
    if edge in fixed:
        return 0.0, 0.0
    K0, K1 = coefficients[corner, float(edge), side]
    return (2*K0/K1, abs(K0)) if K1 > 0 else (np.copysign(np.inf, K0), np.inf)


def load_at_inner_edge(line, inner, outer, order):
    """Load at which two symmetric zones of partial contact are `inner` from the axis: (load, outer edge).

    The inner edge of corner A is prescribed (> 0 leaves a gap, < 0 an overlap) and the load is free: both
    coefficients K0 are affine in it. `outer` is a first guess.
    """
    for _ in range(EDGE_STEPS):
        panels = make_panels(line, {0: ((inner, outer),)}, (), order)
        first, second = (edge_coefficients(panels, q) for q in solve_zones(line, panels, (1.0, 2.0))[0])
        at = (0, float(inner), 1)
        load = 1 + first[at][0]/(first[at][0] - second[at][0])
        at = (0, float(outer), -1)
        K0, K1 = (first[at][i]*(2 - load) + second[at][i]*(load - 1) for i in (0, 1))
        step = 2*K0/K1
        if abs(step) < OUTER_STEP*outer:
            return load, outer
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


def check(state):
    """Raise NotConverged if a corner is pressed in, or pulled, anywhere: then the topology is another one."""
    if violation(state) > VIOLATION:
        raise NotConverged(f"corners would be pressed in, or pulled, on these zones at load {state.load:g}")


def violation(state):
    """Largest violation of (26): pull over the largest pressure, and overlap over the size of the gaps."""
    found = [-state.pressures.min()/state.pressures.max()]
    edges = np.array(zone_edges(state.all_zones))
    width = edges[-1] - edges[0]
    steps = width*0.5*(np.arange(1, LOOKOUTS + 1)/LOOKOUTS)**3
    x = np.unique(np.concatenate([edge + sign*steps for edge in edges for sign in (1, -1)]))
    heights = state.line.initial_gap(np.zeros(len(x), int), x)
    size = np.ptp(heights[np.isfinite(heights)]) or width
    for corner in state.line.corners:
        outside = np.ones(len(x), bool)
        for left, right in state.zones[corner]:
            outside &= (x < left) | (x > right)
        places = x[outside & (x >= 0)] if half_line(state.line) else x[outside]
        if len(places):
            found.append(-float(state.gaps(corner, places).min())/size)
    return float(max(0.0, *found))


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 over the contact, between two states of one scene."""
    x, weights, ell = fine.x, fine.weights, fine.line.solid.ell
    p = np.array([coarse.pressure(corner, x) for corner in range(len(fine.pressures))])
    if fine.line.law.clamps_rotation:
        moment = np.zeros_like(x)
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
