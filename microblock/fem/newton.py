"""Monolithic contact: semismooth Newton on u, psi, the corner multipliers and the approach at once.

The augmented Lagrangian (37), or without multipliers the penalty functional (31), is stationary; its first
and second variation are residual and tangent. A step is one of the primal-dual active set method; it has
converged when the set of closed corners stays and the residual is small.
"""

from collections import Counter
from dataclasses import dataclass

import ngsolve as ng
import numpy as np

from .. import cost
from ..errors import BadArgument, NotConverged, require_choice, require_finite, require_kind, require_positive
from ..model import law
from ..model.progress import counted
from ..threads import bounded
from .body import FIELDS, Body, Fields, Loads
from .bulk import as_csr
from .facets import FLAT, ContactFacets
from .mesh_solution import MeshSolution

MAX_ITERATIONS = 60
RESIDUAL = 1e-11  # relative, at which an iterate counts as converged
WORST = 1e-6  # relative, that may be accepted where rounding keeps from RESIDUAL (high rho)
ROUNDING = 1e-14  # some rounding errors of double precision
PENALTY = 1e4  # penalty stiffness over that of the body: penetrations of some 1e-4 of the compression


@dataclass(frozen=True, repr=False)
class NodalState:
    """One converged contact state.

    Attributes
    ----------
    level : float, approach or load
    approach, load : float
        Approach along -e2 (length) and resultant force (per thickness; per area for a 1D body).
    fields : Fields
    psi, traction, micromoment : arrays (n,), t_n and M of (29); where psi is prescribed the law's part of the
        reaction
    gaps, multipliers, closed : {corner: array (n,)}
        Gaps (22), multipliers (40) (stress), and whether the corner is closed. By Gauss's rule multipliers
        may be tensile.
    iterations : int
    kkt : float, largest relative residual
    forces : array (corners, n), along -n, of the corners that carry them

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.facets import ContactFacets
    >>> from microblock.fem.newton import MonolithicNewton
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> state = MonolithicNewton(body, ContactFacets(body, mb.Unilateral(), mb.Plane())).solve(0.01)
    >>> state.approach, bool((state.traction < 0).all())
    (0.01, True)
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
    forces: np.ndarray


class MonolithicNewton:
    """Monolithic contact problem of a body, a law and an obstacle.

    Parameters
    ----------
    body : Body
    facets : ContactFacets of that body
    loads : Loads besides the contact
    method : "al" or "penalty"
    rho : float
        Regularisation (stress per length); (lambda + 2 mu) over the body's height, for the penalty 10^4 times
        that.
    control : "approach" or "load"

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.facets import ContactFacets
    >>> from microblock.fem.newton import MonolithicNewton
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> facets = ContactFacets(body, mb.Microblock(psi0=0.02), mb.Plane(level=0.002))
    >>> MonolithicNewton(body, facets).solve(0.01).kkt < 1e-9
    True
    """

    def __init__(self, body, facets, *, loads=Loads(), method="al", rho=None, control="approach"):
        require_choice(("al", "penalty"), method=method)
        require_choice(("approach", "load"), control=control)
        require_kind(Body, "a Body", body=body)
        require_kind(ContactFacets, "ContactFacets of the body", facets=facets)
        require_kind(Loads, "Loads", loads=loads)
        if method != "al" and not facets.nodal:
            raise BadArgument("rule", "gauss", "belongs to the method al")
        self.body, self.method, self.control = body, method, control
        # the unknown approach counts from first touch: a distance before it would take digits from small
        # displacements
        self._first = facets.first_touch
        self.facets = facets.lowered(self._first)
        self.rho = default_rho(body, method) if rho is None else rho
        require_positive(rho=self.rho)
        self._build(loads)

    def _build(self, loads):
        """The functional: potential energy (8) and contact term (37), or that of (31)."""
        body, facets = self.body, self.facets
        corners = len(facets.corners) if self.method == "al" else 0
        self.space = body.space
        for _ in range(corners):
            self.space = self.space * facets.multipliers
        self.space = self.space * ng.NumberSpace(body.mesh, definedon=facets.region)
        ranges = [self.space.Range(i) for i in range(len(self.space.components))]
        fields = len(body.names)
        self._multipliers = [slice(one.start, one.stop) for one in ranges[fields:-1]]
        self._approach = ranges[-1].start
        self._load = ng.Parameter(0.0)
        *unknown, approach = self.space.TrialFunction()
        contact = facets.contact(unknown[:fields], unknown[fields:], approach, self.rho)
        if self.control == "load":
            contact -= facets.integral(self._load / facets.weights.sum() * approach)
        self._contact = ng.BilinearForm(self.space)
        self._contact += ng.Variation(contact)
        self._bulk = Tangent(body, self.space, facets, body.acting(loads))
        self._inverse = self._magnitudes = None
        self.free = ng.BitArray(self.space.FreeDofs())
        self.free[self._approach] = self.control == "load"
        self._free_fields = np.array([self.free[i] for i in range(body.space.ndof)])
        if "u1" not in body.fixed and np.abs(facets.normals[:, 0]).max() <= FLAT:
            # nothing holds a translation along x1: one unknown does, and a residual says if it has to
            self.free[int(np.flatnonzero(self._free_fields[body.unknowns_of("u1")])[0])] = False

    @property
    def unknowns(self):
        """Number of free unknowns, multipliers and approach included."""
        return sum(self.free)

    @bounded
    def solve(self, level, start=None):
        """The contact state at this approach or load.

        Parameters
        ----------
        level : float
            Approach (length), or load (force per thickness), by `control`.
        start : NodalState or MeshSolution, optional
            A state of the same body, as first guess.

        Raises
        ------
        NotConverged
            If the active set cycles, the residual stalls or the matrix is singular.
        BadArgument
            If the load is not positive.
        """
        require_finite(level=level)
        if start is not None:
            require_kind((NodalState, MeshSolution), "a NodalState", start=start)
        if self.control == "load" and level <= 0:
            raise BadArgument("load", level, "must be positive: contact cannot pull")
        unknowns, visits, active, best = self._first_guess(level, start), Counter(), None, None
        advice = "a rho whose rounding leaves more digits, or less stretched elements"
        for iteration in range(MAX_ITERATIONS + 1):
            counted()
            now = self._look(unknowns, level)
            if self.control == "load" and not any(now.active):
                self._touch(unknowns)  # else the approach would be free
                now = self._look(unknowns, level)
            if best and now.kkt >= best.kkt / 2:
                return best
            if now.kkt <= self._tolerance(unknowns, now.force):  # then refined while that helps
                best = self._state(unknowns, now, level, iteration)
            if now.active != active:
                visits[now.active] += 1
                if visits[now.active] > 3:  # rounding excuses some where a corner is just about to close
                    advice = "as the active set cycles, another rho"
                    break
                active = now.active
                self._factorise(unknowns, level)
            step = (self._inverse * now.residual).Evaluate()
            if not self._solves(step, now.residual):
                best, advice = None, "as the matrix is singular, look whether the body is supported"
                break
            unknowns.vec.data -= step
        if best:
            return best
        raise NotConverged(
            f"Newton stopped at {self.control} {level:g} after {iteration} iterations, relative residual "
            f"{now.kkt:.1e}: take a smaller step, or {advice}",
            iterations=iteration,
        )

    def _first_guess(self, level, start):
        unknowns = ng.GridFunction(self.space)
        self.body.prescribe(unknowns.components)
        if start is not None:  # supports keep the values of this body
            free, stresses = np.array(self.free), -start.forces / self.facets.weights
            lams = [self.facets.field(own).vec.FV().NumPy() for own, _ in zip(stresses, self._multipliers)]
            values = np.concatenate((start.fields.values, *lams, [start.approach - self._first]))
            unknowns.vec.FV().NumPy()[free] = values[free]
        if self.control == "approach":
            unknowns.vec[self._approach] = level - self._first
            return unknowns
        self._load.Set(level)
        if start is None or not start.forces.any():
            self._touch(unknowns)
        return unknowns

    def _touch(self, unknowns):
        """Lower the obstacle until the nearest corner has just closed."""
        unknowns.vec[self._approach] = 0.0
        ahead = self._augmented(unknowns)[0] / (self.rho * self.facets.normals[:, 1])
        ahead = np.concatenate([self.facets.at_rule(values) for values in ahead])
        ahead = ahead[np.isfinite(ahead)]
        unknowns.vec[self._approach] = ahead.min() + 1e-9 * max(np.ptp(ahead), self.body.solid.ell)

    def _look(self, unknowns, level):
        """Gaps, effective multipliers, active set and residual of an iterate."""
        facets, count = self.facets, len(self._free_fields)
        augmented, own, gaps = self._augmented(unknowns)
        closed = augmented <= 0  # (40)
        forces = np.where(closed, augmented, 0.0) if facets.nodal else own
        internal, residual = self._bulk.internal(unknowns.vec), unknowns.vec.CreateVector()
        self._contact.Apply(unknowns.vec, residual)
        values = residual.FV().NumPy()
        values[:] += internal
        force = np.abs(internal[:count]).max()
        parts = [_ratio(values[:count][self._free_fields], force)]
        if self.method == "al":
            # the largest length in the gaps: the scale of the corner gaps
            u2, psi = self._raised(unknowns)
            lengths = unknowns.vec[self._approach], *u2, *(self.body.solid.ell * psi)
            length = np.abs(lengths).max()
            if facets.nodal:
                parts += [_ratio(gaps[closed], length), _ratio(own - forces, np.abs(forces).max())]
            else:  # (40) holds in the mean over each multiplier's function
                parts += [_ratio(values[part] / facets.extents, length) for part in self._multipliers]
        if self.control == "load":
            parts.append(_ratio(np.array([self._resultant(forces) - level]), abs(level)))
        active = b"".join((facets.at_rule(value) <= 0).tobytes() for value in augmented)
        return _Iterate(gaps, forces, closed, active, residual, force, max(parts))

    def _augmented(self, unknowns):
        """lambda + rho g at the nodes (inf out of reach), lambda, and g: arrays (corners, n)."""
        facets, values = self.facets, unknowns.vec.FV().NumPy()
        gaps = facets.gaps(values[: len(self._free_fields)], values[self._approach])
        own = np.zeros_like(gaps)
        for corner, part in enumerate(self._multipliers):
            own[corner] = facets.multiplier(values[part])
        return own + self.rho * np.where(np.isfinite(facets.g0), gaps, np.inf), own, gaps

    def _raised(self, unknowns):
        """u2 and psi at the nodes, arrays (n,)."""
        return [self.facets.traces[FIELDS[i]] @ unknowns.components[i].vec.FV().NumPy() for i in (1, 2)]

    def _tolerance(self, unknowns, force):
        """RESIDUAL, or what the rounding of the sum of all |K_ij x_j| leaves beside the forces."""
        if self._magnitudes is None:
            return RESIDUAL
        terms = self._magnitudes @ np.abs(unknowns.vec.FV().NumPy())
        return max(RESIDUAL, min(WORST, ROUNDING * terms.max() / max(force, 1e-300)))

    def _factorise(self, unknowns, level):
        self._contact.AssembleLinearization(unknowns.vec)
        matrix = self._bulk.add(self._contact.mat)
        cost.require_room(
            cost.of_factors(self.space.ndof, matrix.nze),
            f"factors of {self.unknowns} unknowns",
            "take longer elements or a lower order, or condense the body to its contact nodes: Condensed()",
        )
        try:
            if self._inverse is None:
                self._inverse = matrix.Inverse(self.free, "umfpack")
            else:
                self._inverse.Update()  # in the order that was found first
        except Exception as failure:
            self._inverse = None
            raise NotConverged(
                f"no factorisation at {self.control} {level:g}: {failure}; "
                "is the body supported, and is something in contact?"
            ) from failure
        self._magnitudes = abs(as_csr(matrix))[: len(self._free_fields)]

    def _solves(self, step, residual):
        """Whether a direct step leaves less than a tenth of its right-hand side: UMFPACK passes singular
        matrices.
        """
        left, right = (self._bulk.matrix * step - residual).Evaluate(), residual.Copy()
        for vector in (left, right):
            ng.Projector(self.free, True).Project(vector)
        return left.Norm() <= 0.1 * right.Norm()

    def _resultant(self, forces):
        return float(-self.facets.weights * self.facets.normals[:, 1] @ forces.sum(axis=0))

    def _state(self, unknowns, now, level, iterations):
        kept = ng.GridFunction(self.space)
        kept.vec.data = unknowns.vec
        # forces of twin corners, which one multiplier carries, are shared evenly
        facets, forces = self.facets, np.where(self.facets.twins, now.forces.mean(axis=0), now.forces)
        # what supports exert balances the corner that carries, not the shares
        carried = now.forces if facets.psi_held else forces
        gaps, closed, multipliers, carried = (
            dict(zip(facets.corners, values)) for values in (now.gaps, now.closed, forces, carried)
        )
        return NodalState(
            level=level,
            approach=self._first + float(kept.vec[self._approach]),
            load=self._resultant(forces),
            fields=Fields(
                self.body, kept.components, now.residual.FV().NumPy()[: self.body.space.ndof].copy()
            ),
            psi=self._raised(kept)[1],
            gaps=gaps,
            multipliers=multipliers,
            closed=closed,
            traction=forces.sum(axis=0),
            micromoment=law.micromoment(carried, facets.levers, self.body.solid.ell),
            iterations=iterations,
            kkt=now.kkt,
            forces=-now.forces * facets.weights,
        )


@dataclass(frozen=True)
class _Iterate:
    gaps: np.ndarray  # (corners, n), and so are forces and closed
    forces: np.ndarray
    closed: np.ndarray
    active: bytes
    residual: object
    force: float  # the largest internal nodal one, reactions included: the scale of equilibrium
    kkt: float


class Tangent:
    """K of the bulk, assembled once, and what a contact term adds to it.

    Parameters
    ----------
    body : Body
    space : product of the body's space and others, the last one of the approach
    nodes : ContactNodes
    forces : array (unknowns of the body,), of dead loads
    """

    def __init__(self, body, space, nodes, forces):
        self.matrix = body.bulk(space, nodes).mat
        self._forces, self._values = forces, self.matrix.AsVector().FV().NumPy()
        self._places, self._own = np.zeros(0, int), np.zeros(0)

    def internal(self, vector):
        """K x - f, array, of the vector x."""
        added = self._values[self._places]
        self._values[self._places] = self._own
        found = (self.matrix * vector).Evaluate().FV().NumPy().copy()
        self._values[self._places] = added
        found[: len(self._forces)] -= self._forces
        return found

    def add(self, other):
        """The matrix K + `other`, whose entries have the same places in K at each call."""
        if not len(self._places):
            self._places = _places(self.matrix, other)
            self._own = self._values[self._places]
        self._values[self._places] = self._own + other.AsVector().FV().NumPy()
        return self.matrix


def _places(matrix, other):
    """Numbers of the values of a matrix that belong to those of another one."""
    (_, columns, starts), (_, wanted, ends) = matrix.CSR(), other.CSR()
    columns, wanted = np.asarray(columns), np.asarray(wanted)
    starts, ends = np.array(starts, int), np.array(ends, int)
    rows = np.flatnonzero(np.diff(ends))
    parts = [(slice(starts[row], starts[row + 1]), slice(ends[row], ends[row + 1])) for row in rows]
    return np.concatenate([one.start + np.searchsorted(columns[one], wanted[own]) for one, own in parts])


def default_rho(body, method):
    """lambda + 2 mu over the body's height, more for the penalty."""
    heights = [vertex.point[-1] for vertex in body.mesh.vertices]
    stiffness = (body.solid.lam + 2 * body.solid.mu) / (max(heights) - min(heights))
    return stiffness if method == "al" else PENALTY * stiffness


def _ratio(values, scale):
    """Largest |value|/scale; 0 for no value or zeros, inf for a value with no scale."""
    largest = np.abs(values).max(initial=0.0)
    if largest == 0:
        return 0.0
    return float(largest / scale) if scale > 0 else np.inf
