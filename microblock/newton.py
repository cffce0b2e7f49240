"""The paper's way: semismooth Newton on u, psi, the corner multipliers and the approach at once.

The unknowns are stationary for the augmented Lagrangian (37), or for the penalty functional (31)
without multipliers; residual and tangent are the functional's first and second variation. The
approach d of the obstacle is an unknown like the others, prescribed under approach control and
conjugate to the load under load control. An iteration is a step of the primal-dual active set
method; it has converged when the set of closed corners stays the same *and* the residual is small.
"""

from dataclasses import dataclass

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix

from . import law
from .body import Fields, Loads
from .errors import BadArgument, NotConverged, require_finite

METHODS = ("al", "penalty")
CONTROLS = ("approach", "load")
MAX_ITERATIONS = 60
RESIDUAL = 1e-11       # relative, at which an iterate counts as converged
ROUNDED = 1e-15        # relative, below which a refinement has nothing to gain
PENALTY = 1e4          # penalty stiffness over that of the body: penetrations of some 1e-4 of the compression
ROUNDING = 1e-14       # some rounding errors of double precision
RETURNS = 3            # visits of one active set that rounding excuses where a corner is just about to close
UNSOLVED = 0.1         # of a right-hand side that a direct solve leaves if the matrix is singular to rounding
SMALLEST_STEP = 1e-4   # of the whole way to a target, before load stepping gives up


@dataclass(frozen=True)
class State:
    """One converged contact state.

    Attributes
    ----------
    level : float
        The control parameter: approach or load.
    approach, load : float
        Approach d of the obstacle along -e2 (length) and its resultant force (per thickness; per
        area for a 1D body).
    fields : Fields
    psi : array (n,), microrotation at the contact nodes
    gaps, multipliers, closed : {corner: array (n,)}
        Gaps (22), lambda <= 0 (stress) and whether the corner counts as closed.
    traction, micromoment : arrays (n,), t_n and M of (29)
    iterations : int
    kkt : float
        Largest relative residual of equilibrium, closed gaps, open multipliers and load.
    vector : NGSolve vector of all unknowns, to start from
    """

    level: float
    approach: float
    load: float
    fields: Fields
    psi: np.ndarray
    gaps: dict
    multipliers: dict
    closed: dict
    traction: np.ndarray
    micromoment: np.ndarray
    iterations: int
    kkt: float
    vector: object


@dataclass(frozen=True)
class Event:
    """A corner at one node closes or opens at this level of the control parameter."""

    level: float
    corner: str
    node: int
    kind: str


class Newton:
    """Monolithic contact problem of a body, a law and an obstacle.

    Parameters
    ----------
    body : Body
    facets : ContactFacets of that body
    loads : Loads besides the contact
    method : "al" or "penalty"
    rho : float
        Regularisation (stress per length). Without it (lambda + 2 mu) over the body's height, and
        10^4 times that for the penalty method.
    control : "approach" or "load"
    """

    def __init__(self, body, facets, *, loads=Loads(), method="al", rho=None, control="approach"):
        if method not in METHODS:
            raise BadArgument("method", method, f"must be one of {', '.join(METHODS)}")
        if control not in CONTROLS:
            raise BadArgument("control", control, f"must be one of {', '.join(CONTROLS)}")
        self.body, self.facets, self.method, self.control = body, facets, method, control
        self.rho = default_rho(body, method) if rho is None else rho
        require_finite(rho=self.rho)
        if not self.rho > 0:
            raise BadArgument("rho", rho, "must be positive (stress per length)")
        self._build(loads)

    def _build(self, loads):
        corners = len(self.facets.corners) if self.method == "al" else 0
        self.space = self.body.space
        for _ in range(corners):
            self.space = self.space*self.facets.multipliers
        self.space = self.space*ng.NumberSpace(self.body.mesh, definedon=self.facets.region)
        self._ranges = [self.space.Range(i) for i in range(len(self.space.components))]
        self._approach = self._ranges[-1].start
        self._load = ng.Parameter(0.0)
        u1, u2, psi, *multipliers, approach = self.space.TrialFunction()
        potential = self.body.potential(u1, u2, psi, loads)
        if self.method == "al":
            contact = self.facets.augmented_lagrangian(self.rho, u1, u2, psi, multipliers, approach)
        else:
            contact = self.facets.penalty(self.rho, u1, u2, psi, approach)
        if self.control == "load":
            contact -= self.facets.integral(self._load/self.facets.weights.sum()*approach)
        self._bulk = ng.BilinearForm(self.space)
        self._bulk += ng.Variation(potential)
        self.form = ng.BilinearForm(self.space)
        self.form += ng.Variation(potential)
        self.form += ng.Variation(contact)
        self.free = ng.BitArray(self.space.FreeDofs())
        self.free[self._approach] = self.control == "load"
        self._magnitudes = None
        self._free_fields = np.array([self.free[i] for i in range(self._ranges[2].stop)])

    @property
    def unknowns(self):
        """Number of free unknowns, multipliers and approach included."""
        return sum(self.free)

    def solve(self, level, start=None):
        """The contact state at this approach or load.

        Parameters
        ----------
        level : float
            Approach (length), or load (force per thickness), by `control`.
        start : State, optional
            The first guess.

        Raises
        ------
        NotConverged
            If the active set cycles, the residual stalls or the matrix is singular.
        """
        require_finite(level=level)
        unknowns = ng.GridFunction(self.space)
        if start is not None:
            unknowns.vec.data = start.vector
        self._prescribe(unknowns, level, start)
        seen, current, inverse, best = {}, None, None, None
        residual, step = unknowns.vec.CreateVector(), unknowns.vec.CreateVector()
        for iteration in range(MAX_ITERATIONS + 1):
            closed = self._closed(unknowns)
            kkt = self._kkt(unknowns, closed, level, residual)
            if best and kkt > best.kkt/2:
                return best
            # measured on the active set of this very iterate; then refined while that helps
            if kkt <= max(RESIDUAL, self._attainable(unknowns)):
                best = self._state(unknowns, closed, level, iteration, kkt)
                if kkt <= ROUNDED:
                    return best
            active = b"".join(mask.tobytes() for mask in closed.values())
            if active != current:
                visits = seen.setdefault(active, [])
                if len(visits) == RETURNS:
                    raise self._failure(level, iteration, kkt, "the active set cycles with period "
                                        f"{iteration - visits[-1]}; take a smaller step, or another rho")
                visits.append(iteration)
                self.form.AssembleLinearization(unknowns.vec)
                current, inverse = active, self._factorise(level)
            step.data = inverse*residual
            if not self._solves(step, residual):
                raise self._failure(level, iteration, kkt, "the matrix is singular; is the body supported, "
                                    "and is something in contact?")
            unknowns.vec.data -= step
        raise self._failure(level, MAX_ITERATIONS, kkt, "take a smaller step, or another rho")

    def _prescribe(self, unknowns, level, start):
        if self.control == "approach":
            unknowns.vec[self._approach] = level
            return
        self._load.Set(level)
        if start is None or not any(mask.any() for mask in start.closed.values()):
            # with no contact the rigid approach is free: begin where the nearest corner has just closed
            gaps = np.concatenate([gap[self.facets.can_touch[corner]]
                                   for corner, gap in self.facets.initial_gaps.items()])
            unknowns.vec[self._approach] = gaps.min() + 1e-9*max(np.ptp(gaps), self.body.solid.ell)

    def _factorise(self, level):
        values, columns, starts = self.form.mat.CSR()
        shape = (self.space.ndof, self.space.ndof)
        matrix = csr_matrix((np.abs(values), np.array(columns), np.array(starts)), shape=shape)
        self._magnitudes = matrix[:len(self._free_fields)]
        try:
            return self.form.mat.Inverse(self.free, "umfpack")
        except Exception as failure:
            raise NotConverged(f"no factorisation at {self.control} {level:g}: {failure}; "
                               "is the body supported, and is something in contact?") from failure

    def _solves(self, step, residual):
        """Whether a step of the direct solver satisfies its equations: UMFPACK does not report every singular matrix."""
        left, right = (self.form.mat*step - residual).Evaluate(), residual.Copy()
        for vector in (left, right):
            ng.Projector(self.free, True).Project(vector)
        return left.Norm() <= UNSOLVED*right.Norm()

    def _failure(self, level, iteration, kkt, advice):
        return NotConverged(f"Newton stopped at {self.control} {level:g} after {iteration} iterations, "
                            f"relative residual {kkt:.1e}: {advice}", iterations=iteration)

    def _gaps(self, unknowns):
        return self.facets.nodal_gaps(*unknowns.components[:3], unknowns.vec[self._approach])

    def _multipliers(self, unknowns, gaps, closed):
        if self.method == "penalty":
            return {corner: self.rho*np.where(closed[corner], gap, 0.0) for corner, gap in gaps.items()}
        return {corner: self.facets.at_nodes("multiplier", component)
                for corner, component in zip(self.facets.corners, unknowns.components[3:-1])}

    def _closed(self, unknowns):
        """The active set: corners with augmented multiplier lambda + rho g <= 0 (penalty: g <= 0)."""
        gaps = self._gaps(unknowns)
        nowhere = {corner: np.zeros(len(gap), bool) for corner, gap in gaps.items()}
        multipliers = self._multipliers(unknowns, gaps, nowhere)
        return {corner: self.facets.can_touch[corner] & (multipliers[corner] + self.rho*gaps[corner] <= 0)
                for corner in gaps}

    def _kkt(self, unknowns, closed, level, residual):
        """Largest relative residual; leaves the residual vector in `residual`."""
        self.form.Apply(unknowns.vec, residual)
        unbalanced = residual.FV().NumPy()[:len(self._free_fields)][self._free_fields]
        parts = [_ratio(unbalanced, self._force(unknowns))]
        gaps = self._gaps(unknowns)
        multipliers = self._multipliers(unknowns, gaps, closed)
        if self.method == "al":
            length = self._length(unknowns)
            stress = max(np.abs(multiplier).max() for multiplier in multipliers.values())
            parts += [_ratio(gaps[corner][closed[corner]], length) for corner in gaps]
            parts += [_ratio(multipliers[corner][~closed[corner]], stress) for corner in gaps]
        if self.control == "load":
            parts.append(_ratio(np.array([self._resultant(multipliers) - level]), abs(level)))
        return max(parts)

    def _attainable(self, unknowns):
        """Relative residual that rounding leaves: that of the sum of all |K_ij x_j| beside the force they leave."""
        if self._magnitudes is None:
            return 0.0
        terms = self._magnitudes @ np.abs(unknowns.vec.FV().NumPy())
        return ROUNDING*terms.max()/max(self._force(unknowns), 1e-300)

    def _force(self, unknowns):
        """Largest internal nodal force, reactions included: the scale of equilibrium."""
        internal = unknowns.vec.CreateVector()
        self._bulk.Apply(unknowns.vec, internal)
        return np.abs(internal.FV().NumPy()[:len(self._free_fields)]).max()

    def _length(self, unknowns):
        """Largest length in the gaps: the scale of the corner gaps."""
        u2, psi = (np.abs(self.facets.at_nodes(name, unknowns.components[i])).max()
                   for i, name in ((1, "u2"), (2, "psi")))
        return max(abs(unknowns.vec[self._approach]), u2, self.body.solid.ell*psi)

    def _resultant(self, multipliers):
        return float(-self.facets.weights*self.facets.normals[:, 1] @ law.traction(multipliers))

    def _state(self, unknowns, closed, level, iterations, kkt):
        kept = ng.GridFunction(self.space)
        kept.vec.data = unknowns.vec
        facets, gaps = self.facets, self._gaps(kept)
        multipliers = self._multipliers(kept, gaps, closed)
        return State(level=level, approach=float(kept.vec[self._approach]), load=self._resultant(multipliers),
                     fields=Fields(self.body, kept.components),
                     psi=facets.at_nodes("psi", kept.components[2]),
                     gaps=gaps, multipliers=multipliers, closed=closed,
                     traction=law.traction(multipliers),
                     micromoment=law.micromoment(multipliers, facets.levers, self.body.solid.ell),
                     iterations=iterations, kkt=kkt, vector=kept.vec)


def default_rho(body, method):
    """Regularisation that suits a body: its stiffness lambda + 2 mu over its height, more for the penalty."""
    heights = [vertex.point[-1] for vertex in body.mesh.vertices]
    stiffness = (body.solid.lam + 2*body.solid.mu)/(max(heights) - min(heights))
    return stiffness if method == "al" else PENALTY*stiffness


def next_event(first, second):
    """The first corner to change its contact state beyond two states of one path, or None.

    Between events everything is affine in the level for a linear body, so two states with the same
    active set, `second` at the higher level, give the event exactly.
    """
    changed = [corner for corner in first.closed if np.any(first.closed[corner] != second.closed[corner])]
    if changed or not second.level > first.level:
        raise BadArgument("second", second.level, f"must lie above {first.level:g} with the same active set")
    events = []
    for corner, closed in second.closed.items():
        for nodes, before, now, kind in ((~closed, first.gaps[corner], second.gaps[corner], "closes"),
                                         (closed, -first.multipliers[corner], -second.multipliers[corner], "opens")):
            for node in np.flatnonzero(nodes & np.isfinite(now) & (now < before)):
                ahead = (second.level - first.level)*now[node]/(before[node] - now[node])
                events.append(Event(float(second.level + ahead), corner, int(node), kind))
    return min(events, key=lambda event: event.level, default=None)


def load_path(newton, levels, *, start=None):
    """States at the `levels` of the control parameter, one after the other (a generator).

    A step at which Newton fails is halved; a target is approached as closely as SMALLEST_STEP of
    its distance before NotConverged is raised, with `reached` the last level that converged.
    """
    reached = 0.0
    for target in levels:
        step = whole = target - reached
        while True:
            trial = target if abs(step) >= abs(target - reached) else reached + step
            try:
                start, reached = newton.solve(trial, start), trial
            except NotConverged as failure:
                step /= 2
                if abs(step) < SMALLEST_STEP*abs(whole) or whole == 0:
                    raise NotConverged(f"load stepping stopped at {newton.control} {reached:g} on the way to "
                                       f"{target:g}: {failure}", reached=reached,
                                       iterations=failure.iterations) from failure
                continue
            if reached == target:
                break
        yield start


def _ratio(values, scale):
    """Largest |value|/scale; 0 for no value or zeros, inf for a value with no scale."""
    largest = np.abs(values).max(initial=0.0)
    if largest == 0:
        return 0.0
    return float(largest/scale) if scale > 0 else np.inf
