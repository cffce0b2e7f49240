"""A second code for the contact line to ten digits: graded Legendre panels in x, edges by Newton's method.

Pressure       Legendre polynomials of x on panels that double in length away from every edge of either
               corner; the panel at an edge, a fifth of ell long, takes f/v, v^2 = r/h, and the panel at a
               jump of the slope polynomials of r and the same times log r.
Equations      closed gaps at Gauss points of each panel, and the load.
Quadrature     Gauss, and tanh-sinh from both ends for a target within a quarter of a panel.
Edges          Newton's method with differences, on the coefficients of 1/sqrt(r).
Error          distance of the last two orders. A state that meets (26) everywhere is the only one.

The zones of the state in question are the first guess. Where a gap is negative outside them there is another
zone next time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from . import NoAnswer
from .kernels import table

PLAIN, ROOT, LOG = range(3)  # kinds of panels
EXTRA = 12  # Gauss points beyond the degree, for targets not nearer than NEAR
NEAR = 0.25  # of a panel, in its parameter
HAIR = 1e-12  # of a panel, by which rounding may miss it
INNERMOST = 0.2  # panel at an edge, over ell or the way to the next edge
ORDERS = 8, 12, 14  # the last order judges
CLUSTER = 2  # closed gaps at Gauss points to this power next to a jump of the slope, to tell log r from 1
LONGEST_STEP = 0.3  # of an edge over the way to the next edge
DIFFERENCE = 1e-3  # step of the differences, over the same
STEPS = 30  # of Newton's method
ROUNDING = 1e-7  # of a way: steps below it that no longer shrink are rounding
TOLERANCE = 1e-13  # of a way
VIOLATION = 1e-7  # of (26), largest of a reference
EDGES = 24  # at most: there are as many systems for the Jacobian
REPAIRS = 3  # of zones
SAMPLES = 4000  # abscissae of a window at which gaps are looked at


def tanh_sinh(step=0.05, reach=3.4):
    """Points on [0, 1], their distances from 1, and weights; good to rounding with logarithms at either
    end.
    """
    t = np.arange(-reach, reach + step / 2, step)
    grow = np.exp(np.pi * np.sinh(t))
    return grow / (1 + grow), 1 / (1 + grow), step * np.pi * np.cosh(t) * grow / (1 + grow) ** 2


class Problem:
    """A `Contact` and its load in plain numbers: gaps and levers of the corners, kernels.

    features : [(x, width)] of the obstacle; the width is 0 where its slope jumps
    window : ends of the surface that may touch
    """

    def __init__(self, contact, load, features=(), window=()):
        solid = contact.solid
        obstacle = contact.obstacle
        self.load = load
        self.ell = solid.ell
        self.E_star = solid.E_star
        self.c = (1 - solid.nu) / solid.mu
        self.material = (solid.nu, solid.beta, solid.curvature)
        self.height = getattr(obstacle, "height", obstacle)
        self.clamped = contact.law.clamps_rotation
        self.levers, self.shifts, self.lifts = corners(contact.law, solid.ell / 2)
        features = [*((x, 0.0) for x in getattr(obstacle, "kinks", None) or ()), *features]
        self.places = {x - shift: width for x, width in features for shift in self.shifts}
        ends = getattr(obstacle, "ends", None) or ()
        self.ends = np.array([end - shift for end in ends for shift in self.shifts])
        around = np.array([0, *np.geomspace(0.01, 3, 12)])
        near = [x + max(width, 1e-3 * self.ell) * sign * around for x, width in features for sign in (1, -1)]
        self.samples = np.concatenate([np.linspace(*window, SAMPLES) if window else [], *near])

    def kernels(self, target):
        """Gap of a corner under a unit force of each of them, functions of x over ell."""
        if self.clamped:
            return [table(self.material, {"clamped": self.c})]
        t = self.levers[target]
        factors = ({"U": self.c, "W": self.c * t * s, "V": self.c * (t - s)} for s in self.levers)
        return [table(self.material, factor) for factor in factors]

    def gap(self, corner, x):
        """Initial gap of a corner."""
        return self.height(x + self.shifts[corner]) + self.lifts[corner]


def corners(law, half):
    """Levers, distances from the contact point (20), and lifts of the corners."""
    if len(law.corners) == 1:
        return (0.0,), (0.0,), (0.0,)
    lift = half * law.psi0 if law.psi0_in == "gaps and levers" else 0.0
    return (1 + law.psi0, law.psi0 - 1), (-half, half), (lift, -lift)


@dataclass(frozen=True)
class Panels:
    """Panels x = e + h v, 0 <= v <= 1, h signed, or x = e + h v^2 for ROOT, of all corners."""

    corner: np.ndarray
    e: np.ndarray
    h: np.ndarray
    kind: np.ndarray
    order: int

    @classmethod
    def on(cls, problem, zones, order):
        """Panels that shrink towards all edges of the zones {corner: [(left, right), ...]} and features."""
        edges = all_edges(zones)
        every = np.unique([*edges, *problem.places])
        rows = []
        for corner, left, right in [(corner, *pair) for corner, pairs in zones.items() for pair in pairs]:
            breaks = every[(every >= left) & (every <= right)]
            for a, b in zip(breaks, breaks[1:]):
                for end, length in ((a, (b - a) / 2), (b, (a - b) / 2)):
                    kind = LOG
                    if end in edges:
                        kind = ROOT
                    elif problem.places[end]:
                        kind = PLAIN
                    size = INNERMOST * min(problem.ell, way(every, end), abs(length))
                    size = min(size, problem.places.get(end) or np.inf)
                    rows += [(corner, *panel) for panel in graded(end, length, size, kind)]
        if not rows:
            raise NoAnswer("no zone is wider than nothing")
        return cls(*map(np.array, zip(*rows)), order)

    def place(self, number, v):
        """Parts of a panel at v."""
        return v * v if self.kind[number] == ROOT else v

    def basis(self, number, v):
        """Basis functions of the density at v (m,): array (m, order)."""
        if self.kind[number] != LOG:
            return legvander(2 * v - 1, self.order - 1)
        plain = legvander(2 * v - 1, self.order - self.order // 3 - 1)
        return np.hstack((plain, np.log(np.maximum(v, 1e-300))[:, None] * plain[:, : self.order // 3]))

    def density(self, number, v):
        """Pressure times dx/dv of each basis function at v (..., m): array (..., m, order)."""
        values = self.basis(number, np.ravel(v)).reshape(*np.shape(v), self.order)
        return values * abs(self.h[number]) * (2 if self.kind[number] == ROOT else 1)

    def forces(self):
        """Force of each basis function, (all,)."""
        t, _, weights = tanh_sinh()
        return np.concatenate([weights @ self.density(n, t) for n in range(len(self.e))])

    def integrals(self, x, kernels, ell):
        """Integrals at x (n,) of the kernel of each source corner times each basis function: (n, all)."""
        return np.hstack([self._column(n, x, kernels[corner], ell) for n, corner in enumerate(self.corner)])

    def _column(self, number, x, kernel, ell):
        """Integrals at x (n,) of a kernel times the basis functions of a panel: (n, order)."""
        along = (x - self.e[number]) / self.h[number]
        reach = 1.0 if self.kind[number] == ROOT else NEAR
        near = (along > -reach) & (along < 1 + reach)
        gauss, weights = leggauss(self.order + EXTRA)
        v = (gauss + 1) / 2
        weights = weights / 2
        if self.kind[number] == LOG:
            v, _, weights = tanh_sinh()
        source = self.e[number] + self.h[number] * self.place(number, v)
        column = np.empty((len(x), self.order))
        column[~near] = (kernel((x[~near, None] - source) / ell) * weights) @ self.density(number, v)
        column[near] = self._near(number, x[near], kernel, ell)
        return column

    def _near(self, number, x, kernel, ell):
        """The same at x within the panel or next to it, by tanh-sinh on either side of x."""
        e, h = (values[number] for values in (self.e, self.h))
        t, rest, weights = tanh_sinh()
        along = (x - e) / h
        inside = np.clip(along, 0, 1)
        beyond = np.where(inside == along, 0.0, x - (e + h * inside))[:, None]
        cut = inside[:, None]  # parameter nearest to the target
        if self.kind[number] == ROOT:
            cut = np.sqrt(cut)
        v = np.concatenate((cut * rest, cut + (1 - cut) * t), axis=1)
        back = np.concatenate((cut * t, -(1 - cut) * t), axis=1)  # cut - v
        if self.kind[number] == ROOT:
            back = back * (cut + v)
        values = kernel((beyond + h * back) / ell) * np.concatenate(
            (cut * weights, (1 - cut) * weights), axis=1
        )
        return np.einsum("pq,pqj->pj", values, self.density(number, v))


def graded(end, length, size, kind):
    """Yields (start, signed length, kind) of panels from an end on, the first one of a size, doubling."""
    done = 0.0
    sign = np.sign(length)
    length = abs(length)
    while done < length:
        until = 2 * done or size
        if until > 0.8 * length:
            until = length
        yield end + sign * done, sign * (until - done), PLAIN if done else kind
        done = until


@dataclass(frozen=True)
class Reference:
    """A solved state: zones of the corners, panels and coefficients (panels, order)."""

    problem: Problem
    zones: dict
    panels: Panels
    f: np.ndarray
    approach: float

    def pressure(self, corner, x):
        """Pressure of a corner at x (n,)."""
        p = np.zeros(len(x))
        for number in np.flatnonzero(self.panels.corner == corner):
            along = (x - self.panels.e[number]) / self.panels.h[number]
            root = self.panels.kind[number] == ROOT
            # where two panels meet, rounding would leave a point to neither of them
            inside = (along > (0 if root else -HAIR)) & (along <= 1 + HAIR)
            v = np.sqrt(along[inside]) if root else along[inside]
            p[inside] = self.panels.basis(number, v) @ self.f[number] / (v if root else 1.0)
        return p

    def fields(self, x):
        """Pressure and M over ell at x (n,): (29), or the reaction to psi = 0."""
        problem = self.problem
        pressures = [self.pressure(corner, x) for corner in range(len(problem.levers))]
        moment = np.dot(problem.levers, pressures) / 2
        if problem.clamped:
            kernel = table(problem.material, {"reaction": -0.5})
            moment = self.panels.integrals(x, [kernel], problem.ell) @ self.f.ravel() / problem.ell
        return sum(pressures), moment

    def violation(self):
        """Conditions (26): tensile pressure over the largest pressure, and overlap over the load's scale;
        zones of overlap {corner: intervals}.
        """
        edges = all_edges(self.zones)
        steps = np.ptp(edges) * np.geomspace(1e-6, 1, 60)
        around = [*(edges[:, None] + steps).ravel(), *(edges[:, None] - steps).ravel()]
        x = np.unique([*around, *self.problem.samples])
        worst = 0.0
        overlapping = {}
        for corner, pairs in self.zones.items():
            p = self.pressure(
                corner, np.concatenate([[], *(np.linspace(*pair, 203)[1:-1] for pair in pairs)])
            )
            free, overlap = self.overlap(corner, x)
            worst = max(worst, -p.min(initial=0.0) / p.max(initial=1e-300), overlap.max(initial=0.0))
            bad = np.pad(overlap > VIOLATION, 1).astype(int)
            ends = np.flatnonzero(np.diff(bad)).reshape(-1, 2)
            overlapping[corner] = [(free[max(a - 1, 0)], free[min(b, len(free) - 1)]) for a, b in ends]
        return worst, overlapping

    def overlap(self, corner, x):
        """Places of x outside the zones of a corner where the surface comes near, and the overlap there."""
        problem = self.problem
        free = x[np.all([x == x, *((x < left) | (x > right) for left, right in self.zones[corner])], axis=0)]
        with np.errstate(over="ignore"):
            gap = problem.gap(corner, free) - self.approach
        low = gap < 9 * problem.load / problem.E_star
        displacement = self.panels.integrals(free[low], problem.kernels(corner), problem.ell) @ self.f.ravel()
        return free[low], -(gap[low] + displacement) * problem.E_star / problem.load


def all_edges(zones):
    """Edges of all corners, ascending."""
    return np.unique(edges_of(zones))


def edges_of(zones):
    """Edges in the order of corners and intervals."""
    return [edge for pairs in zones.values() for pair in pairs for edge in pair]


def way(edges, edge):
    """Distance of an edge from the next one of either corner."""
    return np.abs(edges[edges != edge] - edge).min()


def solve(problem, zones, order):
    """The `Reference` that closes the gaps on given zones."""
    panels = Panels.on(problem, zones, order)
    v = (leggauss(order)[0] + 1) / 2
    powers = np.where(panels.kind == LOG, CLUSTER, np.where(panels.kind == ROOT, 2, 1))[:, None]
    x = (panels.e[:, None] + panels.h[:, None] * v**powers).ravel()
    system = np.zeros((x.size + 1, x.size + 1))
    right = np.full(x.size + 1, problem.load)
    for corner in zones:
        rows = np.flatnonzero(np.repeat(panels.corner == corner, order))
        system[rows, :-1] = panels.integrals(x[rows], problem.kernels(corner), problem.ell)
        right[rows] = -problem.gap(corner, x[rows])
    system[:-1, -1] = -1.0
    system[-1, :-1] = panels.forces()
    solution = np.linalg.solve(system, right)
    return Reference(problem, zones, panels, solution[:-1].reshape(-1, order), float(solution[-1]))


def singular_parts(state):
    """Coefficients of 1/sqrt(r) at the edges of the zones, each at its own corner."""
    panels = state.panels
    at_zero = legvander(-np.ones(1), panels.order - 1)[0]
    parts = []
    for corner, pairs in state.zones.items():
        for edge, sign in [(edge, sign) for pair in pairs for edge, sign in zip(pair, (1, -1))]:
            if edge in state.problem.ends:  # a punch has it there
                parts.append(0.0)
                continue
            beside = (panels.corner == corner) & (panels.kind == ROOT) & (panels.e == edge)
            (number,) = np.flatnonzero(beside & (np.sign(panels.h) == sign))
            parts.append(at_zero @ state.f[number] * np.sqrt(abs(panels.h[number])))
    return np.array(parts)


def moved(zones, steps):
    """The zones with edges moved by steps, in the order of corners and intervals."""
    step = iter(steps)
    return {c: [(a + next(step), b + next(step)) for a, b in pairs] for c, pairs in zones.items()}


def derivatives(problem, zones, ways, order):
    """Jacobian of the singular parts over the edges, by differences."""
    edges = edges_of(zones)
    steps = np.diag(DIFFERENCE * np.minimum(ways, problem.ell))
    parts = singular_parts(solve(problem, zones, order))
    jacobian = np.eye(len(edges))
    for n in np.flatnonzero(~np.isin(edges, problem.ends)):
        shifted = singular_parts(solve(problem, moved(zones, steps[n]), order))
        jacobian[:, n] = (shifted - parts) / steps[n, n]
    return jacobian


def fitted(problem, zones, orders):
    """A `Reference` of each order on zones whose edges carry no 1/sqrt(r); NoAnswer if Newton fails."""
    states = []
    jacobian = None
    for order in orders:
        last = np.inf
        for iteration in range(STEPS):
            state = solve(problem, zones, order)
            ways = np.array([way(all_edges(zones), edge) for edge in edges_of(zones)])
            if jacobian is None or (iteration % 4 == 3 and order == orders[0]):
                jacobian = derivatives(problem, zones, ways, orders[0])
            step = np.linalg.solve(jacobian, -singular_parts(state))
            size = np.abs(step / ways).max()
            if size < TOLERANCE or (size < ROUNDING and size > last / 3):
                break
            zones = moved(zones, step * min(1.0, LONGEST_STEP / size))
            last = size
        else:
            raise NoAnswer(f"edges still move by {size:.1e} of their ways")
        states.append(state)
    return states


def reference(contact, load, state, orders=ORDERS, **obstacle):
    """(Reference, its error) of a contact problem, from the zones of a state.

    obstacle : features and window, see `Problem`

    Raises
    ------
    NoAnswer
        If (26) are not met.
    """
    problem = Problem(contact, load, **obstacle)
    zones = zones_of(state)
    for _ in range(REPAIRS):
        if not 0 < len(edges_of(zones)) <= EDGES:
            raise NoAnswer(f"no reference: no zones, or more than {EDGES} edges")
        zones = {
            corner: [tuple(_snapped(problem.ends, e) for e in pair) for pair in pairs]
            for corner, pairs in zones.items()
        }
        try:
            *_, coarse, fine = fitted(problem, zones, orders)
        except (ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError) as failure:
            raise NoAnswer(f"no reference: {failure}") from failure
        violation, overlapping = fine.violation()
        if violation < VIOLATION:
            places = [*all_edges(coarse.zones), *all_edges(fine.zones), *problem.places]
            return fine, distance(coarse.fields, fine.fields, places, problem.ends)
        zones = {corner: sorted([*pairs, *overlapping[corner]]) for corner, pairs in fine.zones.items()}
    raise NoAnswer(f"no reference: (26) violated by {violation:.1e}")


def _snapped(ends, edge):
    """An edge, or the end of the obstacle that it stands for; cells are wider than what is between."""
    closest = np.diff(np.unique(ends)).min(initial=np.inf)
    near = [end for end in ends if abs(end - edge) < min(0.01 * np.ptp(ends), 0.1 * closest)]
    return near[0] if near else edge


def zones_of(state):
    """Zones {corner: intervals} of a state; common edges of the corners are moved from each other."""
    if len(state.law.corners) == 1:
        return {0: [tuple(pair) for pair in state.zones["contact"]]}
    first, second = ([tuple(pair) for pair in state.zones[name]] for name in state.law.corners)
    edges = [edge for pair in first for edge in pair]
    hair = 1e-3 * state.solid.ell

    def distance_from_first(edge):
        shared = np.min(np.abs(np.subtract(edges, edge)), initial=np.inf) < 1e-6 * hair
        return hair if shared else 0.0

    return {0: first, 1: [(a + distance_from_first(a), b - distance_from_first(b)) for a, b in second]}


def distance(first, second, places, ends=()):
    """max(|dp|, |dM|/ell)/|p| in L2 between two functions x -> (p, M/ell): tanh-sinh between each two
    neighbours of `places`; next to `ends` of the obstacle the distance from them is the weight.
    """
    places = np.unique(places)
    least = 4e-15 * np.ptp(places)  # nearer to a place rounding decides on which side a point is
    places = places[np.concatenate(([True], np.diff(places) > 3 * least))]
    t, rest, weights = tanh_sinh()
    left = places[:-1, None]
    right = places[1:, None]
    x = np.where(t < 0.5, left + (right - left) * t, right - (right - left) * rest)
    x = np.clip(x, left + least, right - least).ravel()
    weights = ((right - left) * weights).ravel()
    for end in ends:
        weights = weights * np.minimum(1, 2 * np.abs(x - end) / np.ptp(places))
    true = np.array(second(x))
    wrong = first(x) - true
    return float(np.sqrt((wrong**2 @ weights).max() / (weights @ true[0] ** 2)))
