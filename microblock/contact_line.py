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
from .panels import Line, Panels, gap_matrix, half_line, lagrange, make_panels, response, zone_edges

EDGE_STEPS = 40      # of Newton's method for the edges
LONGEST_MOVE = 0.4   # of an edge in one step, over the distance to its neighbour
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
    iterations, edge_error : steps of Newton's method, and the last move of an edge over the width of the contact
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
    def edge_values(self):
        """q that is left at the corner's own free edges, panel by panel: taken off before q is divided by dx/dv."""
        basis = lagrange(self.panels.points[0], np.zeros(1))[0]
        values = self.q.reshape(-1, self.panels.order) @ basis
        own = [{edge for interval in self.zones[corner] for edge in interval} - set(self.fixed) for corner in self.panels.corner]
        free = np.array([e in edges for e, edges in zip(self.panels.e, own)])
        return np.where(self.panels.root & free, values, 0.0)

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
            found[here] = (q - self.edge_values[number])/self.panels.slope(number, v)
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
        """Pressure of each corner at `x`, array (corners, n)."""
        panel, v, x, _ = self.panels.nodes
        p = (self.q - self.edge_values[panel])/self.panels.slope(panel, v)
        found = np.zeros((len(self.line.law.corners), len(self.x)))
        found[self.panels.corner[panel], _places(self.x, x)] = p
        if self.line.mirror:
            found = found + found[::-1, ::-1]
        return found

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


def solve_zones(line, panels, load):
    """q and approach with the gaps closed on given zones: arrays (m,) and a float."""
    panel, _, x, weights = panels.nodes
    count, sides = len(x), 2 if line.mirror else 1
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = gap_matrix(line, panels, x, panels.corner[panel])
    system[:count, count] = -1.0
    system[count, :count] = sides*weights
    right = np.append(-line.initial_gap(panels.corner[panel], x), load)
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as failure:
        raise NotConverged(f"singular system on zones from {panels.e.min():g} to {panels.e.max():g} at load {load:g}") from failure
    return solution[:-1], float(solution[-1])


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
    tolerance : of the edges, relative to the width of the contact
    kinks, fixed : abscissae at which the obstacle has a kink, and where its end fixes an edge

    Raises
    ------
    NotConverged
        If an edge runs away or K1 turns negative: the topology is another one.
    """
    for iteration in range(EDGE_STEPS):
        panels = make_panels(line, zones, kinks, order)
        q, approach = solve_zones(line, panels, load)
        moved, step = _moved(line, zones, edge_coefficients(panels, q), fixed)
        if step <= tolerance:
            return LineState(line, load, zones, panels, q, approach, tuple(fixed), iteration + 1, step)
        zones = moved
    raise NotConverged(f"edges of the zones still moving by {step:.1e} of the contact width at load {load:g}",
                       iterations=EDGE_STEPS)


def _moved(line, zones, coefficients, fixed):
    """Zones with each free edge moved by 2 K0/K1, and the largest move over the width of the contact."""
    edges = zone_edges(zones)
    edges = sorted({*edges, *(-edge for edge in edges)}) if line.mirror else edges
    width, largest, moved = edges[-1] - edges[0], 0.0, {}
    for corner, intervals in zones.items():
        moved[corner] = tuple(tuple(sorted(_moved_edge(corner, interval, side, coefficients, edges, fixed, line)
                                           for side in (1, -1))) for interval in intervals)
        for old, new in zip(intervals, moved[corner]):
            largest = max(largest, abs(old[0] - new[0])/width, abs(old[1] - new[1])/width)
    return moved, largest


def _moved_edge(corner, interval, side, coefficients, edges, fixed, line):
    """One edge after the step: left (side 1) or right (side -1) of its interval."""
    edge = interval[0] if side == 1 else interval[1]
    if edge in fixed:
        return edge
    if half_line(line) and side == 1:
        return -_moved_edge(corner, interval, -1, coefficients, edges, fixed, line)
    K0, K1 = coefficients[corner, float(edge), side]
    if not K1 > 0:
        raise NotConverged(f"the pressure is negative at the edge x = {edge:g}: another topology of the zones")
    others = [abs(edge - other) for other in edges if other != edge]
    reach = LONGEST_MOVE*min(others)
    return edge - side*float(np.clip(2*K0/K1, -reach, reach))


def check(state):
    """Raise NotConverged if a corner is pressed in, or pulled, anywhere: then the topology is another one."""
    largest = state.pressures.max()
    if state.pressures.min() < -VIOLATION*largest:
        raise NotConverged(f"negative pressure within the zones at load {state.load:g}")
    edges = np.array(zone_edges(state.all_zones))
    width = edges[-1] - edges[0]
    steps = width*0.5*(np.arange(1, LOOKOUTS + 1)/LOOKOUTS)**3
    x = np.unique(np.concatenate([edge + sign*steps for edge in edges for sign in (1, -1)]))
    size = np.ptp(state.line.initial_gap(np.zeros(len(edges), int), edges)[np.isfinite(edges)]) or width
    for corner in state.line.corners:
        outside = np.all([(x < left) | (x > right) for left, right in state.zones[corner]], axis=0)
        places = x[outside]
        if half_line(state.line):
            places = places[places >= 0]
        gaps = state.gaps(corner, places)
        if len(gaps) and np.min(gaps) < -VIOLATION*size:
            place = places[np.argmin(gaps)]
            raise NotConverged(f"corner {state.line.law.corners[corner]} would be pressed in at x = {place:g}")


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
