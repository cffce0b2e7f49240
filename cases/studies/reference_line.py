"""A reference of another kind for states on the contact line: graded Legendre panels in x, edges by Newton's
method.

It shares nothing with microblock/halfplane/contact_line.py, panels.py and kernels.py but the symbol's
formula (checked against the field equations in tests/cases/test_accuracy.py); kernels come from
`cases.studies.reference_kernels`.

Pressure       Legendre polynomials of x on panels that shrink geometrically towards every edge of either
               corner and every kink; only the last panel at an edge, a fifth of ell long, takes ``f/v``,
               ``v^2 = r/h``, and the last at a kink polynomials of r and the same times log r.
Equations      closed gaps at Gauss points of each panel, and the load.
Quadrature     Gauss, and tanh-sinh from both ends wherever the target is within a quarter of a panel.
Edges          Newton's method with a Jacobian of finite differences, on the coefficients of 1/sqrt(r).
Error          between two refinement levels; conditions (26) are looked at afterwards: they make the state
               the only one.
"""

from dataclasses import dataclass

import numpy as np

from microblock.errors import NotConverged

from .reference_panels import LOG, ROOT, Mesh, Problem, gauss, matrix, mesh, rows, tanh_sinh

# closed gaps at Gauss points to this power next to kinks: they have to tell log r from 1
CLUSTER = 2
LONGEST_STEP = 0.3  # of an edge over the way to the next
DIFFERENCE = 1e-3  # step of the finite differences, over the same
NEWTON_STEPS = 30
ROUNDING = 1e-7  # of a way: steps below it that no longer shrink are rounding
TOLERANCE = 1e-13  # of a way


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
            here = np.flatnonzero(((x - e) / h > 0) & ((x - e) / h <= 1))
            along = (x[here] - e) / h
            v = np.sqrt(along) if kind == ROOT else along
            found[here] = self.panels.basis(kind, v) @ self.f[number] / (v if kind == ROOT else 1.0)
        return found

    def micromoment(self, x):
        """M over ell at x (n,): (29), or the reaction to psi = 0."""
        if self.problem.clamped:
            return (
                rows(self.problem, self.panels, x, lambda _: self.problem.reaction)
                @ self.f.ravel()
                / self.problem.ell
            )
        return sum(lever * self.pressure(corner, x) for corner, lever in enumerate(self.problem.levers)) / 2

    def gap(self, corner, x):
        """Gap of a corner at x (n,)."""
        displacement = matrix(self.problem, self.panels, x, corner) @ self.f.ravel()
        return self.problem.gap(corner, x) - self.approach + displacement

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
        own = np.flatnonzero(np.repeat(panels.corner == corner, order))
        system[own, :size] = matrix(problem, panels, x.ravel()[own], corner)
        right[own] = -problem.gap(corner, x.ravel()[own])
    system[:size, size] = -1.0
    integrals = np.array([_basis_integrals(panels, kind) for kind in panels.kind]) * panels.density[:, None]
    system[size, :size] = (2 if problem.mirror else 1) * integrals.ravel()
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
    return {
        corner: [(float(next(flat)), float(next(flat))) for _ in zones[corner]] for corner in sorted(zones)
    }


def singular_parts(state):
    """Coefficients of 1/sqrt(r) at the edges of `edges_of`, each at its own corner."""
    at_zero = state.panels.basis(ROOT, np.zeros(1))[0]
    found = []
    for corner in sorted(state.zones):
        for pair in state.zones[corner]:
            for edge, sign in zip(pair, (1, -1)):
                panels = state.panels
                own = (panels.corner == corner) & (panels.kind == ROOT)
                (number,) = np.flatnonzero(own & (panels.e == edge) & (np.sign(panels.h) == sign))
                found.append(at_zero @ state.f[number] * np.sqrt(abs(panels.h[number])))
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
        step = DIFFERENCE * min(way, problem.ell)
        moved = edges + step * (np.arange(len(edges)) == number)
        columns.append((singular_parts(solve(problem, with_edges(zones, moved), order)) - here) / step)
    return np.array(columns).T


def fit(problem, zones, orders):
    """States on zones whose edges carry no 1/sqrt(r), one for each of `orders`; the Jacobian is that of the
    first.

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
            size = np.abs(step / ways).max()
            # at rounding steps no longer shrink
            if size < TOLERANCE or (size < ROUNDING and size > last / 3):
                break
            zones = with_edges(zones, edges_of(zones) + step * min(1.0, LONGEST_STEP / size))
            last = size
        else:
            raise NotConverged(
                f"reference: edges still moving by {size:.1e} of their ways", iterations=NEWTON_STEPS
            )
        found.append(state)
    return found


def breaks(states):
    """All abscissae at which the pressure of a reference, its kinks included, may be singular."""
    found = {
        sign * x
        for state in states
        for pairs in state.all_zones.values()
        for pair in pairs
        for x in pair
        for sign in (1, -1)
    }
    return sorted(found | {sign * x for x in states[0].problem.kinks for sign in (1, -1)})


def distance(first, second, places):
    """max(|dp|, |dM|/ell)/|p| in L2 of two states between the `places`: tanh-sinh between each two
    neighbours.

    A state is anything with pressures and micromoments over ell, `first(x)` and `second(x)` giving (p,
    M/ell).
    """
    places = np.array(places)
    least = 4e-15 * np.ptp(places)  # nearer to a place rounding decides on which side a point is
    places = places[np.concatenate(([True], np.diff(places) > 3 * least))]
    share, rest, weights = tanh_sinh()
    left, right = places[:-1, None], places[1:, None]
    x = np.where(share < 0.5, left + (right - left) * share, right - (right - left) * rest)
    x = np.clip(x, left + least, right - least).ravel()
    weights = ((right - left) * weights).ravel()
    (p, moment), (other, turning) = first(x), second(x)
    errors = weights @ (p - other) ** 2, weights @ (moment - turning) ** 2
    return float(np.sqrt(max(errors) / (weights @ other**2)))


def fields(state):
    """x -> (p, M/ell) of a reference."""
    return lambda x: (
        sum(state.pressure(corner, x) for corner in range(len(state.problem.levers))),
        state.micromoment(x),
    )


def violation(state):
    """Conditions (26): tensile pressure over the largest pressure, overlap over the approach's scale."""
    found = [0.0]
    for corner in state.problem.corners:
        edges = np.array(sorted(edge for pair in state.zones[corner] for edge in pair))
        every = edges_of(state.all_zones)
        width = np.ptp(every)
        if len(edges):
            inside = np.concatenate([np.linspace(*pair, 203)[1:-1] for pair in state.zones[corner]])
            p = state.pressure(corner, inside)
            found.append(-p.min() / p.max())
        steps = width * np.geomspace(1e-6, 1, 60)
        x = np.unique(np.concatenate([edge + sign * steps for edge in every for sign in (1, -1)]))
        outside = (
            np.all([(x < left) | (x > right) for left, right in state.zones[corner]], axis=0)
            if len(edges)
            else x == x
        )
        scale = np.ptp(state.problem.height(np.array([0.0, width / 2])))
        found.append(-state.gap(corner, x[outside]).min(initial=0.0) / scale)
    return max(found)
