"""A reference of another kind for states on the contact line: graded Legendre panels in x, edges by Newton's method.

It shares nothing with microblock/contact_line.py, panels.py and halfplane.py but the symbol's formula (checked against
the field equations in tests/test_accuracy.py); kernels come from `cases.reference_kernels`.

Pressure       Legendre polynomials of x on panels that shrink geometrically towards every edge of either corner and every
               kink; only the last panel at an edge, a fifth of ell long, takes ``f/v``, ``v^2 = r/h``, and the
               last at a kink polynomials of r and the same times log r.
Equations      closed gaps at Gauss points of each panel, and the load.
Quadrature     Gauss, and tanh-sinh from both ends wherever the target is within a quarter of a panel.
Edges          Newton's method with a Jacobian of finite differences, on the coefficients of 1/sqrt(r).
Error          between two rungs; conditions (26) are looked at afterwards: they make the state the only one.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from cases import reference_kernels
from microblock.errors import NotConverged

PLAIN, ROOT, LOG = 0, 1, 2
EXTRA = 12                  # Gauss points beyond the degree, for targets not nearer than NEAR
NEAR = 0.25                 # of a panel, in its parameter
DE_STEP, DE_REACH = 0.05, 3.4
INNERMOST = 0.2             # last panel at a break, over ell or half the way to the next
CLUSTER = 2                 # closed gaps at Gauss points to this power next to kinks: they have to tell log r from 1
GROWTH = 2.0                # end of a panel over its beginning, as seen from the break
LONGEST_STEP = 0.3          # of an edge over the way to the next
DIFFERENCE = 1e-3           # step of the finite differences, over the same
NEWTON_STEPS = 30
ROUNDING = 1e-8             # of a way: steps below it that no longer shrink are rounding
ROWS = 256                  # targets at a time


@lru_cache(maxsize=16)
def gauss(order):
    """Gauss points and weights on [0, 1]."""
    points, weights = leggauss(order)
    return (points + 1)/2, weights/2


@lru_cache(maxsize=1)
def tanh_sinh():
    """Points on [0, 1], their distances from 1, and weights; good to rounding with logarithms at either end."""
    t = np.arange(-DE_REACH, DE_REACH + DE_STEP/2, DE_STEP)
    grow = np.exp(np.pi*np.sinh(t))
    return grow/(1 + grow), 1/(1 + grow), DE_STEP*np.pi*np.cosh(t)*grow/(1 + grow)**2


class Problem:
    """One scene in plain numbers: gaps, levers and tables of the kernels for each pair of corners.

    Parameters
    ----------
    scene : microblock.scene.Contact with psi0 a number
    load : force per thickness
    """

    def __init__(self, scene, load):
        self.solid, self.law, self.load = scene.body.solid, scene.law, load
        self.ell, self.c = self.solid.ell, (1 - self.solid.nu)/self.solid.mu
        self.height = getattr(scene.obstacle, "height", scene.obstacle)
        self.clamped = self.law.clamps_rotation
        half, count = self.ell/2, len(self.law.corners)
        psi0 = self.law.psi0 if count == 2 else 0.0
        self.levers = (1 + psi0, psi0 - 1) if count == 2 else (0.0,)
        self.shifts = (-half, half) if count == 2 else (0.0,)      # of a corner from the contact point, (20)
        lift = half*psi0 if count == 2 and self.law.reading == "gap" else 0.0
        self.lifts = (lift, -lift) if count == 2 else (0.0,)
        self.kinks = sorted({kink - shift for kink in getattr(scene.obstacle, "kinks", ()) for shift in self.shifts})
        self.mirror = count == 2 and psi0 == 0 and hasattr(scene.obstacle, "height")      # cylinders and wedges
        self.tables = {(t, s): self._table(self.levers[t], self.levers[s]) for t in range(count) for s in range(count)}
        self.reaction = reference_kernels.table(self.solid, {}, {"reaction": -0.5})

    def _table(self, target, source):
        if self.clamped:
            return reference_kernels.table(self.solid, {"clamped": self.c}, {})
        return reference_kernels.table(self.solid, {"U": self.c, "W": self.c*target*source}, {"V": self.c*(target - source)})

    @property
    def corners(self):
        """Corners whose pressure is unknown: of two mirrored ones, the first."""
        return (0,) if self.mirror else tuple(range(len(self.levers)))

    def gap(self, corner, x):
        """Initial gap of a corner."""
        return self.height(x + self.shifts[corner]) + self.lifts[corner]


@dataclass(frozen=True)
class Mesh:
    """Panels ``x = e + h v`` (``e + h v^2`` for ROOT), 0 <= v <= 1, h signed, of all corners."""

    corner: np.ndarray
    e: np.ndarray
    h: np.ndarray
    kind: np.ndarray
    order: int

    def mirrored(self):
        return Mesh(1 - self.corner, -self.e, -self.h, self.kind, self.order)

    def x(self, panel, v):
        return self.e[panel] + self.h[panel]*np.where(self.kind[panel] == ROOT, v*v, v)

    @property
    def density(self):
        """p dx = f density dv with f expanded in the basis: p = f, but f/v for ROOT."""
        return np.abs(self.h)*np.where(self.kind == ROOT, 2.0, 1.0)

    def basis(self, kind, v):
        """Basis functions of f at v > 0: array v.shape + (order,)."""
        if kind != LOG:
            return legvander(2*v - 1, self.order - 1)
        logs = self.order//3
        plain = legvander(2*v - 1, self.order - logs - 1)
        return np.concatenate((plain, np.log(v)[..., None]*plain[..., :logs]), axis=-1)


def graded(left, right, kinds, ell):
    """Panels (e, h, kind) between two breaks, shrinking towards both; kinds ROOT or LOG."""
    half, found = (right - left)/2, []
    for end, sign, kind in ((left, 1, kinds[0]), (right, -1, kinds[1])):
        done, size = 0.0, INNERMOST*min(ell, half)
        while done < half:
            until = size if done == 0 else done*GROWTH
            until = half if until > 0.8*half else until
            found.append((end + sign*done, sign*(until - done), kind if done == 0 else PLAIN))
            done = until
    return found


def mesh(problem, zones, order):
    """Panels on the zones {corner: [(left, right), ...]}, broken at the edges of both corners and at kinks."""
    edges = {edge for pairs in zones.values() for pair in pairs for edge in pair}
    edges |= {-edge for edge in edges} if problem.mirror else set()
    rows = []
    for corner, pairs in zones.items():
        for left, right in pairs:
            breaks = sorted({x for x in {*edges, *problem.kinks} if left <= x <= right})
            for a, b in zip(breaks, breaks[1:]):
                kinds = tuple(ROOT if x in edges else LOG for x in (a, b))
                rows += [(corner, *row) for row in graded(a, b, kinds, problem.ell)]
    corner, e, h, kind = (np.array(entry) for entry in zip(*rows))
    return Mesh(corner, e, h, kind, order)


def matrix(problem, panels, x, corner):
    """Gaps of one corner at x (n,) from all coefficients: array (n, panels*order)."""
    blocks = [_rows(problem, panels, part, lambda s: problem.tables[corner, s])
              for part in np.array_split(x, 1 + len(x)//ROWS)]
    return np.concatenate(blocks)


def _rows(problem, panels, x, table):
    found = _one_side(problem, panels, x, table)
    return found + _one_side(problem, panels.mirrored(), x, table) if problem.mirror else found


def _one_side(problem, panels, x, table):
    v, weights = gauss(panels.order + EXTRA)
    number = np.arange(len(panels.e))
    source = panels.x(number[:, None], v)
    expansion = panels.basis(PLAIN, v)*weights[:, None]
    found = np.empty((len(x), len(number), panels.order))
    for corner in np.unique(panels.corner):
        own = panels.corner == corner
        kernel = table(corner)((x[:, None, None] - source[own])/problem.ell)
        found[:, own] = (kernel @ expansion)*panels.density[own][:, None]
    along = (x[:, None] - panels.e)/panels.h
    root = panels.kind == ROOT
    near = np.where(root, (along > -1) & (along < 2), (along > -NEAR) & (along < 1 + NEAR)) | (panels.kind == LOG)
    for kind in (PLAIN, ROOT, LOG):
        for corner in np.unique(panels.corner):
            row, panel = np.nonzero(near & (panels.kind == kind) & (panels.corner == corner))
            for part in np.array_split(np.arange(len(row)), 1 + len(row)//2000):
                found[row[part], panel[part]] = _near(problem, panels, x[row[part]], panel[part], kind, table(corner))
    return found.reshape(len(x), -1)


def _near(problem, panels, x, panel, kind, table):
    """Integrals over near panels, cut at the parameter v0 nearest to the target: array (pairs, order)."""
    share, rest, weights = tanh_sinh()
    e, h = panels.e[panel], panels.h[panel]
    along = np.clip((x - e)/h, 0, 1)
    outside = np.where((x - e)/h == along, 0.0, x - (e + h*along))[:, None]      # exactly 0 inside
    v0 = (np.sqrt(along) if kind == ROOT else along)[:, None]
    v = np.concatenate((v0*rest, v0 + (1 - v0)*share), axis=1)
    back = np.concatenate((v0*share, -(1 - v0)*share), axis=1)      # v0 - v
    weights = np.concatenate((v0*weights, (1 - v0)*weights), axis=1)
    distance = outside + h[:, None]*(back*(v0 + v) if kind == ROOT else back)
    kernel = table(distance/problem.ell)*weights
    v = np.maximum(v, 1e-300)      # log of it, where v0 = 0 leaves nothing to integrate
    return np.einsum("pq,pqj->pj", kernel, panels.basis(kind, v))*panels.density[panel][:, None]


@dataclass(frozen=True)
class Reference:
    """A solved state: zones of the computed corners, panels and coefficients (panels, order)."""

    problem: Problem
    zones: dict
    panels: Mesh
    f: np.ndarray
    approach: float

    def pressure(self, corner, x):
        """Pressure of a corner at x (n,)."""
        if self.problem.mirror and corner == 1:
            return self.pressure(0, -x)
        found = np.zeros(len(x))
        for number in np.flatnonzero(self.panels.corner == corner):
            e, h, kind = (getattr(self.panels, name)[number] for name in ("e", "h", "kind"))
            here = np.flatnonzero(((x - e)/h > 0) & ((x - e)/h <= 1))
            along = (x[here] - e)/h
            v = np.sqrt(along) if kind == ROOT else along
            found[here] = self.panels.basis(kind, v) @ self.f[number]/(v if kind == ROOT else 1.0)
        return found

    def micromoment(self, x):
        """M over ell at x (n,): (29), or the reaction to psi = 0."""
        if self.problem.clamped:
            return _rows(self.problem, self.panels, x, lambda _: self.problem.reaction) @ self.f.ravel()/self.problem.ell
        return sum(lever*self.pressure(corner, x) for corner, lever in enumerate(self.problem.levers))/2

    def gap(self, corner, x):
        """Gap of a corner at x (n,)."""
        return self.problem.gap(corner, x) - self.approach + matrix(self.problem, self.panels, x, corner) @ self.f.ravel()

    @property
    def all_zones(self):
        """Zones of both corners."""
        if not self.problem.mirror:
            return self.zones
        return {0: self.zones[0], 1: [(-right, -left) for left, right in reversed(self.zones[0])]}


def solve(problem, zones, order):
    """The pressures that close the gaps on given zones."""
    panels = mesh(problem, zones, order)
    v, _ = gauss(order)
    x = panels.x(np.arange(len(panels.e))[:, None], np.where((panels.kind == LOG)[:, None], v**CLUSTER, v))
    size = x.size
    system, right = np.zeros((size + 1, size + 1)), np.zeros(size + 1)
    for corner in np.unique(panels.corner):
        rows = np.flatnonzero(np.repeat(panels.corner == corner, order))
        system[rows, :size] = matrix(problem, panels, x.ravel()[rows], corner)
        right[rows] = -problem.gap(corner, x.ravel()[rows])
    system[:size, size] = -1.0
    integrals = np.array([_basis_integrals(panels, kind) for kind in panels.kind])*panels.density[:, None]
    system[size, :size] = (2 if problem.mirror else 1)*integrals.ravel()
    right[size] = problem.load
    solution = np.linalg.solve(system, right)
    return Reference(problem, zones, panels, solution[:size].reshape(-1, order), solution[size])


def _basis_integrals(panels, kind):
    if kind == LOG:
        share, _, weights = tanh_sinh()
        return weights @ panels.basis(LOG, share)
    v, weights = gauss(panels.order)
    return weights @ panels.basis(kind, v)


def edges_of(zones):
    """All edges as one array, in the order of the corners and intervals."""
    return np.array([edge for corner in sorted(zones) for pair in zones[corner] for edge in pair])


def with_edges(zones, edges):
    """The same zones with other edges."""
    flat = iter(edges)
    return {corner: [(float(next(flat)), float(next(flat))) for _ in zones[corner]] for corner in sorted(zones)}


def singular_parts(state):
    """Coefficients of 1/sqrt(r) at the edges of `edges_of`, each at its own corner."""
    at_zero = state.panels.basis(ROOT, np.zeros(1))[0]
    found = []
    for corner in sorted(state.zones):
        for pair in state.zones[corner]:
            for edge, sign in zip(pair, (1, -1)):
                panels = state.panels
                number, = np.flatnonzero((panels.corner == corner) & (panels.e == edge) & (panels.kind == ROOT)
                                         & (np.sign(panels.h) == sign))
                found.append(at_zero @ state.f[number]*np.sqrt(abs(panels.h[number])))
    return np.array(found)


def _ways(problem, zones):
    """Distance of each edge from the next of either corner."""
    edges = edges_of(zones)
    every = np.unique(np.concatenate((edges, -edges)) if problem.mirror else edges)
    return np.array([np.abs(every[every != edge] - edge).min() for edge in edges])


def _jacobian(problem, zones, order, here):
    edges, ways = edges_of(zones), _ways(problem, zones)
    columns = []
    for number, way in enumerate(ways):
        step = DIFFERENCE*min(way, problem.ell)
        moved = edges + step*(np.arange(len(edges)) == number)
        columns.append((singular_parts(solve(problem, with_edges(zones, moved), order)) - here)/step)
    return np.array(columns).T


def fit(problem, zones, orders, tolerance=1e-13):
    """States on zones whose edges carry no 1/sqrt(r), one for each of `orders`; the Jacobian is that of the first.

    Raises
    ------
    NotConverged
        If Newton's method does not end.
    """
    found, jacobian = [], None
    for order in orders:
        last = np.inf
        for iteration in range(NEWTON_STEPS):
            state = solve(problem, zones, order)
            parts = singular_parts(state)
            if jacobian is None or (iteration % 4 == 3 and order == orders[0]):
                jacobian = _jacobian(problem, zones, orders[0], parts)
            step, ways = np.linalg.solve(jacobian, -parts), _ways(problem, zones)
            size = np.abs(step/ways).max()
            # at rounding steps no longer shrink
            if size < tolerance or (size < ROUNDING and size > last/3):
                break
            zones = with_edges(zones, edges_of(zones) + step*min(1.0, LONGEST_STEP/size))
            last = size
        else:
            raise NotConverged(f"reference: edges still moving by {size:.1e} of their ways", iterations=NEWTON_STEPS)
        found.append(state)
    return found


def breaks(states):
    """All abscissae at which the pressure of a reference, its kinks included, may be singular."""
    found = {sign*x for state in states for pairs in state.all_zones.values() for pair in pairs for x in pair for sign in (1, -1)}
    return sorted(found | {sign*x for x in states[0].problem.kinks for sign in (1, -1)})


def distance(first, second, places):
    """max(|dp|, |dM|/ell)/|p| in L2 of two states between the `places`: tanh-sinh between each two neighbours.

    A state is anything with pressures and micromoments over ell, `first(x)` and `second(x)` giving (p, M/ell).
    """
    places = np.array(places)
    least = 4e-15*np.ptp(places)      # nearer to a place rounding decides on which side a point is
    places = places[np.concatenate(([True], np.diff(places) > 3*least))]
    share, rest, weights = tanh_sinh()
    left, right = places[:-1, None], places[1:, None]
    x = np.where(share < 0.5, left + (right - left)*share, right - (right - left)*rest)
    x = np.clip(x, left + least, right - least).ravel()
    weights = ((right - left)*weights).ravel()
    (p, moment), (other, turning) = first(x), second(x)
    errors = weights @ (p - other)**2, weights @ (moment - turning)**2
    return float(np.sqrt(max(errors)/(weights @ other**2)))


def fields(state):
    """x -> (p, M/ell) of a reference."""
    return lambda x: (sum(state.pressure(corner, x) for corner in range(len(state.problem.levers))), state.micromoment(x))


def violation(state):
    """Largest pull over the largest pressure, and overlap over the approach's scale: conditions (26)."""
    found = [0.0]
    for corner in state.problem.corners:
        edges = np.array(sorted(edge for pair in state.zones[corner] for edge in pair))
        every = edges_of(state.all_zones)
        width = np.ptp(every)
        if len(edges):
            inside = np.concatenate([np.linspace(*pair, 203)[1:-1] for pair in state.zones[corner]])
            p = state.pressure(corner, inside)
            found.append(-p.min()/p.max())
        steps = width*np.geomspace(1e-6, 1, 60)
        x = np.unique(np.concatenate([edge + sign*steps for edge in every for sign in (1, -1)]))
        outside = np.all([(x < left) | (x > right) for left, right in state.zones[corner]], axis=0) if len(edges) else x == x
        scale = np.ptp(state.problem.height(np.array([0.0, width/2])))
        found.append(-state.gap(corner, x[outside]).min(initial=0.0)/scale)
    return max(found)
