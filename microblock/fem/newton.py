"""Monolithic contact: semismooth Newton on u, psi and the approach at once.

The augmented Lagrangian (37), or the penalty functional (31), is stationary. In the plane corner multipliers
are unknowns; in space, where they are not unique, they are given, and become (40) when equilibrium holds
better than the gaps do.
"""

from collections import Counter
from dataclasses import dataclass

import ngsolve as ng
import numpy as np

from ..errors import NotConverged, require, require_choice, require_finite, require_kind, require_positive
from ..model.progress import counted
from ..model.solver import SOLVED
from ..threads import bounded
from . import supports
from .body_fields import BodyFields
from .facet_rules import ROUNDED
from .facets import ContactFacets
from .mesh_solution import MeshSolution
from .newton_systems import ConjugateGradients, Direct


@dataclass(frozen=True, repr=False)
class NodalState:
    """An iterate, of which the one that `MonolithicNewton.solve` returns is a contact state.

    Attributes
    ----------
    approach, load : float
        Of the obstacle (length), and resultant force (per thickness; per area for a 1D body).
    fields : BodyFields
    surface : array (2, n), u.n and psi at the nodes; in space (3, n), (u, phi1, phi2)
    forces : array (corners, n)
        Forces (40) along -n.
    closed : boolean array (corners, n)
    iterations, unknowns : int
    residual, open : floats
        Relative residuals of the system that a step solves, and of gaps whose multipliers are given.
    variation
        The first variation.
    """

    approach: float
    load: float
    fields: BodyFields
    surface: np.ndarray
    forces: np.ndarray
    closed: np.ndarray
    iterations: int
    unknowns: int
    residual: float
    open: float
    variation: ng.BaseVector

    @property
    def kkt(self):
        """Largest relative residual."""
        return max(self.residual, self.open)


class MonolithicNewton:
    """Monolithic contact problem of a body, a law and an obstacle.

    Parameters
    ----------
    facets : ContactFacets
    method : "al" or "penalty"
    rho : float
        Regularisation (stress per length); see `default_rho`.
    control : "approach" or "load"

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.facets import ContactFacets
    >>> from microblock.fem.newton import MonolithicNewton
    >>> body = mb.Body(meshes.line(depth=1.0, elements=2), mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1),
    ...                order=4, fixed="middle")
    >>> facets = ContactFacets(body, mb.Microblock(psi0=0.02), mb.Plane(level=0.002))
    >>> state = MonolithicNewton(facets).solve(0.01)
    >>> state.approach, state.kkt < 1e-9
    (0.01, True)
    """

    def __init__(self, facets, *, method="al", rho=None, control="approach"):
        require_choice(("al", "penalty"), method=method)
        require_choice(("approach", "load"), control=control)
        require_kind(ContactFacets, "ContactFacets", facets=facets)
        self.facets, self.body, self.method, self.control = facets, facets.body, method, control
        self._up = facets.normals[:, -1]
        # the unknown approach counts from first touch: a distance before it would take digits from small
        # displacements
        self._first = float((facets.g0 / self._up)[np.isfinite(facets.g0)].min())
        self._g0 = facets.g0 - self._first * self._up
        self.rho = default_rho(facets, method) if rho is None else rho
        require_positive(rho=self.rho)
        self._build()

    def _build(self):
        """The functional: elastic energy (8) and contact term (37), or that of (31)."""
        body, facets = self.body, self.facets
        self._given = [ng.GridFunction(facets.multipliers) for _ in facets.g0]
        others = [facets.multipliers] * len(facets.g0) if self.method == "al" and not body.in_space else []
        approaches = ng.NumberSpace(body.mesh, definedon=facets.region)
        space = ng.ProductSpace(*body.spaces, *others, approaches)
        if body.in_space:
            self._systems = body.once("systems", lambda: ConjugateGradients(body, space))
        else:
            self._systems = Direct(body, space)
        self.space, self._load, fields = self._systems.space, ng.Parameter(0.0), len(body.names)
        *unknown, approach = self.space.TrialFunction()
        # over rho: NGSolve takes mixed derivatives from sums of second ones, in which 1 is lost beside rho
        self._unit = self.rho if unknown[fields:] else 1.0
        multipliers = [self._unit * part for part in unknown[fields:] or self._given]
        contact = facets.contact(self._g0, unknown[:fields], multipliers, approach, self.rho)
        contact -= facets.integral(self._load / facets.weights.sum() * approach)  # 0 at an approach
        self._contact = ng.BilinearForm(self.space)
        self._contact += ng.Variation(contact)
        self.free = ng.BitArray(self.space.FreeDofs())
        self.free[self.space.ndof - 1] = self.control == "load"
        if "u1" not in body.fixed and np.abs(facets.normals[:, 0]).max() <= ROUNDED:
            # nothing holds a translation along x1: one unknown does, and a residual says if it has to
            u1 = body.unknowns_of("u1")
            self.free[int(np.flatnonzero(np.array(self.free)[u1])[0])] = False
        self._balanced = np.array(self.free)  # unknowns on which forces act
        self._balanced[body.space.ndof : -1] = False
        self._arms = np.ones(self.space.ndof)  # of moments, which count as forces
        for name in body.names:
            if name.startswith("psi"):
                self._arms[body.unknowns_of(name)] = body.solid.ell

    @bounded
    def solve(self, level, start=None):
        """The contact state at this approach or load.

        Parameters
        ----------
        level : float
            Approach (length), or load (force per thickness), by `control`.
        start : NodalState or MeshSolution of the same body, optional

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
        pressed = self.control == "approach" or level > 0
        require(pressed, "load", level, "must be positive: contact cannot pull")
        unknowns, visits, solved = self._first_guess(level, start), Counter(), None
        best, before, stopped = None, np.inf, "the residual stalls"
        for iteration in range(61):
            counted()
            now = self._look(unknowns, iteration)
            best = now if best is None or now.kkt < best.kkt else best
            active = now.closed.tobytes()
            stalls = active == solved and not now.residual < before / 2
            if now.kkt <= self._systems.rtol or stalls:
                break
            if now.residual <= min(now.open, 1e-3):  # equilibrium is the better one
                for given, forces in zip(self._given, now.forces):
                    given.vec.data = self.facets.field(-forces / self.facets.weights).vec
                visits.clear()
                now = self._look(unknowns, iteration)
                active = now.closed.tobytes()
            if active != solved:
                visits[active] += 1
                if visits[active] > 3:  # rounding excuses some where a corner is just about to close
                    stopped = "the active set cycles"
                    break
                solved = active
                self._contact.AssembleLinearization(unknowns.vec)
                self._systems.add(self._contact.mat, self.free)
            before = now.residual
            unknowns.vec.data -= self._systems.solve(now.variation)
        if not best.kkt <= SOLVED:
            raise NotConverged(
                f"Newton stopped at {self.control} {level:g} after {best.iterations} iterations, relative "
                f"residual {best.kkt:.1e}, as {stopped}: take {self._systems.advice}",
                iterations=best.iterations,
            )
        return best

    def _first_guess(self, level, start):
        unknowns = ng.GridFunction(self.space)
        supports.prescribe(self.body, unknowns.components)
        values, approach = unknowns.vec.FV().NumPy(), -np.inf
        stresses = np.zeros(self._g0.shape)
        if start is not None:  # supports keep the values of this body
            free, stresses = self._balanced[: self.body.space.ndof], -start.forces / self.facets.weights
            values[: len(free)][free] = start.fields.values[free]
            approach = start.approach - self._first
        if self.method == "al":
            for part, own in zip(self._multipliers(unknowns), stresses):
                part[:] = self.facets.field(own / self._unit).vec.FV().NumPy()
        given = self.control == "approach"
        self._load.Set(0.0 if given else level)
        values[-1] = level - self._first if given else max(approach, self._touching(unknowns))
        return unknowns

    def _multipliers(self, vectors):
        """Coefficients of the corners' multipliers, over `_unit`, arrays."""
        parts = vectors.components[len(self.body.names) : -1] or self._given
        return [part.vec.FV().NumPy() for part in parts]

    def _touching(self, unknowns):
        """The approach at which the nearest corner closes."""
        stresses, moved = self._corners(unknowns)
        ahead = (stresses / self.rho + self._g0 - moved) / self._up
        ahead = ahead[np.isfinite(ahead)]
        return ahead.min() + 1e-9 * max(np.ptp(ahead), self.body.solid.ell)

    def _corners(self, unknowns):
        """Multipliers and displacements along the normal, arrays (corners, n)."""
        stresses = [self._unit * self.facets.multiplier(part) for part in self._multipliers(unknowns)]
        fields = unknowns.vec.FV().NumPy()[: self.body.space.ndof]
        return np.array(stresses), self.facets.displacements(fields)

    def _look(self, unknowns, iterations):
        """The NodalState of these unknowns."""
        facets, count, kept = self.facets, self.body.space.ndof, ng.GridFunction(self.space)
        kept.vec.data = unknowns.vec
        values, (own, moved) = kept.vec.FV().NumPy(), self._corners(kept)
        gaps = self._g0 - moved - values[-1] * self._up  # (22)
        wanted = own + self.rho * gaps
        closed = wanted <= 0  # (40)
        stresses = np.where(closed, wanted, 0.0)
        internal, vector = (self._systems.stiffness * kept.vec).Evaluate(), ng.GridFunction(self.space)
        self._contact.Apply(kept.vec, vector.vec)
        vector.vec.data += internal
        exerted, internal = (part.FV().NumPy() for part in (vector.vec, internal))
        unbalanced = np.linalg.norm((exerted / self._arms)[self._balanced])
        acting = np.linalg.norm((internal / self._arms)[:count])
        balance, left = _ratio(unbalanced, max(acting, unbalanced)), 0.0
        if self.method == "al":
            length = max(np.abs(moved).max(), abs(values[-1]))  # the scale of the gaps
            left = max(_ratio(gaps[closed], length), _ratio(own[~closed], np.abs(stresses).max()))
        in_space, forces = self.body.in_space, -stresses * facets.weights
        return NodalState(
            approach=self._first + float(values[-1]),
            load=self._load.Get() if self.control == "load" else float(self._up @ forces.sum(axis=0)),
            fields=BodyFields(self.body, kept.components, exerted[:count].copy()),
            surface=(facets.onto @ values[:count]).reshape(-1, len(facets.points)),
            forces=forces,
            closed=closed,
            iterations=iterations,
            unknowns=sum(self.free),
            residual=balance if in_space else max(balance, left),
            open=left if in_space else 0.0,
            variation=vector.vec,
        )


def default_rho(facets, method):
    """The `usual_rho` of the body's height, in space of 1/8 or 10 times the length of a facet."""
    body = facets.body
    if body.in_space:
        length = np.sqrt(facets.weights.sum() / len(facets.facets)) / body.order
        return usual_rho(body.solid, method, length * (1 / 8 if method == "al" else 10))
    return usual_rho(body.solid, method, np.ptp([vertex.point[-1] for vertex in body.mesh.vertices]))


def usual_rho(solid, method, length):
    """lambda + 2 mu over a length; for the penalty 10^4 times."""
    return (1 if method == "al" else 1e4) * (solid.lam + 2 * solid.mu) / length


def _ratio(values, scale):
    """Largest |value|/scale; 0 for none or zeros, inf without a scale."""
    return float(np.abs(values).max(initial=0.0)) / (float(scale) or np.finfo(float).tiny)
