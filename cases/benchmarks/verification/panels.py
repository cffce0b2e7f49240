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
        solid, law = contact.solid, contact.law
        self.load, self.ell, self.E_star = load, solid.ell, solid.E_star
        self.c, self.material = (1 - solid.nu) / solid.mu, (solid.nu, solid.beta, solid.curvature)
        self.height = getattr(contact.obstacle, "height", contact.obstacle)
        self.clamped, self.names = law.clamps_rotation, law.corners
        two, half = len(law.corners) == 2, solid.ell / 2
        psi0 = law.psi0 if two else 0.0
        lift = half * psi0 if two and law.psi0_in == "gaps and levers" else 0.0
        self.levers = (1 + psi0, psi0 - 1) if two else (0.0,)
        self.shifts = (-half, half) if two else (0.0,)  # of a corner from the contact point, (20)
        self.lifts = (lift, -lift) if two else (0.0,)
        features = [*((x, 0.0) for x in getattr(contact.obstacle, "kinks", None) or ()), *features]
        self.places = {x - shift: width for x, width in features for shift in self.shifts}
        ends = getattr(contact.obstacle, "ends", None) or ()
        self.ends = np.array([end - shift for end in ends for shift in self.shifts])
        around = np.array([0, *np.geomspace(0.01, 3, 12)])
        near = [x + max(width, 1e-3 * self.ell) * sign * around for x, width in features for sign in (1, -1)]
        self.looked = np.concatenate([np.linspace(*window, SAMPLES) if window else [], *near])

    def kernel(self, target, source):
        """Gap of a corner under a unit force of another one, a function of x over ell."""
        if self.clamped:
            return table(self.material, {"clamped": self.c})
        t, s = self.levers[target], self.levers[source]
        return table(self.material, {"U": self.c, "W": self.c * t * s, "V": self.c * (t - s)})

    def gap(self, corner, x):
        """Initial gap of a corner."""
        return self.height(x + self.shifts[corner]) + self.lifts[corner]


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
        rows, edges = [], all_edges(zones)
        every = np.unique([*edges, *problem.places])
        for corner, pairs in zones.items():
            for left, right in pairs:
                breaks = every[(every >= left) & (every <= right)]
                for a, b in zip(breaks, breaks[1:]):
                    for end, sign in ((a, 1), (b, -1)):
                        kind = ROOT if end in edges else PLAIN if problem.places[end] else LOG
                        size = INNERMOST * min(problem.ell, way(every, end), (b - a) / 2)
                        done, size = 0.0, min(size, problem.places.get(end) or np.inf)
                        while done < (b - a) / 2:
                            until = 2 * done or size
                            until = (b - a) / 2 if until > 0.4 * (b - a) else until
                            rows.append(
                                (corner, end + sign * done, sign * (until - done), PLAIN if done else kind)
                            )
                            done = until
        if not rows:
            raise NoAnswer("no zone is wider than nothing")
        return cls(*map(np.array, zip(*rows)), order)

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

    def integrals(self, x, kernels, ell):
        """Integrals at x (n,) of the kernel of each source corner times each basis function: (n, all)."""
        gauss, weights = leggauss(self.order + EXTRA)
        share, rest, sinh_weights = tanh_sinh()
        columns = []
        for number, (corner, e, h, kind) in enumerate(zip(self.corner, self.e, self.h, self.kind)):
            along, kernel, root = (x - e) / h, kernels[corner], kind == ROOT
            near = (along > -1) & (along < 2) if root else (along > -NEAR) & (along < 1 + NEAR)
            v, v_weights = (share, sinh_weights) if kind == LOG else ((gauss + 1) / 2, weights / 2)
            source, block = e + h * (v * v if root else v), np.empty((len(x), self.order))
            block[~near] = (kernel((x[~near, None] - source) / ell) * v_weights) @ self.density(number, v)
            inside = np.clip(along[near], 0, 1)
            beyond = np.where(inside == along[near], 0.0, x[near] - (e + h * inside))[:, None]
            cut = (np.sqrt(inside) if root else inside)[:, None]  # parameter nearest to the target
            v = np.concatenate((cut * rest, cut + (1 - cut) * share), axis=1)
            back = np.concatenate((cut * share, -(1 - cut) * share), axis=1)  # cut - v
            both = np.concatenate((cut * sinh_weights, (1 - cut) * sinh_weights), axis=1)
            values = kernel((beyond + h * (back * (cut + v) if root else back)) / ell) * both
            block[near] = np.einsum("pq,pqj->pj", values, self.density(number, v))
            columns.append(block)
        return np.hstack(columns)


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
        p, panels = np.zeros(len(x)), self.panels
        for number in np.flatnonzero(panels.corner == corner):
            along = (x - panels.e[number]) / panels.h[number]
            root = panels.kind[number] == ROOT
            # where two panels meet, rounding would leave a point to neither of them
            here = (along > (0 if root else -HAIR)) & (along <= 1 + HAIR)
            v = np.sqrt(along[here]) if root else along[here]
            p[here] = panels.basis(number, v) @ self.f[number] / (v if root else 1.0)
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
        problem, edges, worst, more = self.problem, all_edges(self.zones), 0.0, {}
        steps = np.ptp(edges) * np.geomspace(1e-6, 1, 60)
        x = np.unique([*(edges[:, None] + steps).ravel(), *(edges[:, None] - steps).ravel(), *problem.looked])
        for corner, pairs in self.zones.items():
            p = self.pressure(
                corner, np.concatenate([[], *(np.linspace(*pair, 203)[1:-1] for pair in pairs)])
            )
            kernels = [problem.kernel(corner, source) for source in range(len(problem.levers))]
            free = x[np.all([x == x, *((x < left) | (x > right) for left, right in pairs)], axis=0)]
            with np.errstate(over="ignore"):
                gap = problem.gap(corner, free) - self.approach
            low = gap < 9 * problem.load / problem.E_star  # elsewhere the surface does not come near
            free, gap = (
                free[low],
                gap[low] + self.panels.integrals(free[low], kernels, problem.ell) @ self.f.ravel(),
            )
            overlap = -gap * problem.E_star / problem.load
            worst = max(worst, -p.min(initial=0.0) / p.max(initial=1e-300), overlap.max(initial=0.0))
            bad = np.pad(overlap > VIOLATION, 1).astype(int)
            ends = np.flatnonzero(np.diff(bad)).reshape(-1, 2)
            more[corner] = [(free[max(a - 1, 0)], free[min(b, len(free) - 1)]) for a, b in ends]
        return worst, more


def all_edges(zones):
    """Edges of all corners, ascending."""
    return np.unique([edge for pairs in zones.values() for pair in pairs for edge in pair])


def way(edges, edge):
    """Distance of an edge from the next one of either corner."""
    return np.abs(edges[edges != edge] - edge).min()


def solve(problem, zones, order):
    """The `Reference` that closes the gaps on given zones."""
    panels = Panels.on(problem, zones, order)
    kind, v = panels.kind[:, None], (leggauss(order)[0] + 1) / 2
    v = np.where(kind == LOG, v**CLUSTER, np.where(kind == ROOT, v * v, v))
    x = panels.e[:, None] + panels.h[:, None] * v
    system, right = np.zeros((x.size + 1, x.size + 1)), np.full(x.size + 1, problem.load)
    for corner in zones:
        own = np.flatnonzero(np.repeat(panels.corner == corner, order))
        kernels = [problem.kernel(corner, source) for source in range(len(problem.levers))]
        system[own, :-1] = panels.integrals(x.ravel()[own], kernels, problem.ell)
        right[own] = -problem.gap(corner, x.ravel()[own])
    system[:-1, -1] = -1.0
    share, _, weights = tanh_sinh()
    system[-1, :-1] = np.concatenate([weights @ panels.density(n, share) for n in range(len(panels.e))])
    solution = np.linalg.solve(system, right)
    return Reference(problem, zones, panels, solution[:-1].reshape(-1, order), float(solution[-1]))


def singular_parts(state):
    """Coefficients of 1/sqrt(r) at the edges of the zones, each at its own corner."""
    panels, parts = state.panels, []
    at_zero = legvander(-np.ones(1), panels.order - 1)[0]
    for corner, pairs in state.zones.items():
        for edge, sign in [(edge, sign) for pair in pairs for edge, sign in zip(pair, (1, -1))]:
            if edge in state.problem.ends:  # a punch has it there
                parts.append(0.0)
                continue
            here = (panels.corner == corner) & (panels.kind == ROOT) & (panels.e == edge)
            (number,) = np.flatnonzero(here & (np.sign(panels.h) == sign))
            parts.append(at_zero @ state.f[number] * np.sqrt(abs(panels.h[number])))
    return np.array(parts)


def moved(zones, steps):
    """The zones with edges moved by steps, in the order of corners and intervals."""
    rest = iter(steps)
    return {c: [(a + next(rest), b + next(rest)) for a, b in pairs] for c, pairs in zones.items()}


def fitted(problem, zones, orders):
    """A `Reference` of each order on zones whose edges carry no 1/sqrt(r); NoAnswer if Newton fails."""
    states, jacobian = [], None
    for order in orders:
        last = np.inf
        for iteration in range(STEPS):
            state = solve(problem, zones, order)
            parts, edges = singular_parts(state), [e for pairs in zones.values() for p in pairs for e in p]
            ways = np.array([way(all_edges(zones), edge) for edge in edges])
            if jacobian is None or (iteration % 4 == 3 and order == orders[0]):
                free = ~np.isin(edges, problem.ends)
                steps = np.diag(DIFFERENCE * np.minimum(ways, problem.ell))
                here = singular_parts(solve(problem, zones, orders[0]))
                jacobian = np.eye(len(edges))
                for n in np.flatnonzero(free):
                    near = singular_parts(solve(problem, moved(zones, steps[n]), orders[0]))
                    jacobian[:, n] = (near - here) / steps[n, n]
            step = np.linalg.solve(jacobian, -parts)
            size = np.abs(step / ways).max()
            if size < TOLERANCE or (size < ROUNDING and size > last / 3):
                break
            zones, last = moved(zones, step * min(1.0, LONGEST_STEP / size)), size
        else:
            raise NoAnswer(f"edges still move by {size:.1e} of their ways")
        states.append(state)
    return states


def reference(contact, load, state, orders=ORDERS, **known):
    """(Reference, its error) of a contact problem, from the zones of a state.

    known : features and window of the obstacle, see `Problem`

    Raises
    ------
    NoAnswer
        If (26) are not met.
    """
    problem, zones = Problem(contact, load, **known), zones_of(state)
    for _ in range(REPAIRS):
        if not 0 < 2 * sum(map(len, zones.values())) <= EDGES:
            raise NoAnswer(f"no reference: no zones, or more than {EDGES} edges")
        zones = {
            c: [tuple(_snapped(problem.ends, e) for e in pair) for pair in pairs]
            for c, pairs in zones.items()
        }
        try:
            *_, coarse, fine = fitted(problem, zones, orders)
        except (ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError) as failure:
            raise NoAnswer(f"no reference: {failure}") from failure
        violation, more = fine.violation()
        if violation < VIOLATION:
            places = [*all_edges(coarse.zones), *all_edges(fine.zones), *problem.places]
            return fine, distance(coarse.fields, fine.fields, places, problem.ends)
        zones = {corner: sorted([*pairs, *more[corner]]) for corner, pairs in fine.zones.items()}
    raise NoAnswer(f"no reference: (26) violated by {violation:.1e}")


def _snapped(ends, edge):
    """An edge, or the end of the obstacle that it stands for; cells are wider than what is between."""
    apart = np.diff(np.unique(ends)).min(initial=np.inf)
    near = [end for end in ends if abs(end - edge) < min(0.01 * np.ptp(ends), 0.1 * apart)]
    return near[0] if near else edge


def zones_of(state):
    """Zones {corner: intervals} of a state; edges that the corners share are set apart."""
    names = state.law.corners if len(state.law.corners) == 2 else ("contact",)
    zones = {corner: [tuple(pair) for pair in state.zones[name]] for corner, name in enumerate(names)}
    edges, hair = [e for pair in zones[0] for e in pair], 1e-3 * state.solid.ell
    for number, (a, b) in enumerate(zones.get(1, ())):
        apart = [hair * (np.min(np.abs(np.subtract(edges, e)), initial=np.inf) < 1e-6 * hair) for e in (a, b)]
        zones[1][number] = a + apart[0], b - apart[1]
    return zones


def distance(first, second, places, ends=()):
    """max(|dp|, |dM|/ell)/|p| in L2 between two functions x -> (p, M/ell): tanh-sinh between each two
    neighbours of `places`; next to `ends` of the obstacle the distance from them is the weight.
    """
    places = np.unique(places)
    least = 4e-15 * np.ptp(places)  # nearer to a place rounding decides on which side a point is
    places = places[np.concatenate(([True], np.diff(places) > 3 * least))]
    share, rest, weights = tanh_sinh()
    left, right = places[:-1, None], places[1:, None]
    x = np.where(share < 0.5, left + (right - left) * share, right - (right - left) * rest)
    x, weights = np.clip(x, left + least, right - least).ravel(), ((right - left) * weights).ravel()
    for end in ends:
        weights = weights * np.minimum(1, 2 * np.abs(x - end) / np.ptp(places))
    (p, moment), (other, turning) = first(x), second(x)
    wrong = max(weights @ (p - other) ** 2, weights @ (moment - turning) ** 2)
    return float(np.sqrt(wrong / (weights @ other**2)))
