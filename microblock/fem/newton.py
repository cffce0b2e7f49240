"""Monolithic contact: semismooth Newton on u, psi and the approach at once.

The augmented Lagrangian (37), or the penalty functional (31), is stationary. In the plane corner multipliers
are unknowns; in space, where they are not unique, they are given, and become (40) in each step, whose
closed corners are those before it: with others the system would not be that of its multipliers.
"""

from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import NotConverged, require, require_choice, require_finite, require_kind, require_positive
from ..model.material import Cosserat
from ..model.progress import counted
from ..model.scales import classical_rise, classical_rise_in_space
from ..model.solver import SOLVED
from ..model.types import Array, Flags
from ..threads import bounded
from . import supports
from .body_fields import BodyFields
from .body_spaces import COMPONENTS
from .facet_rules import ROUNDED
from .facets import ContactFacets
from .mesh_solution import OnMesh
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
    residual, multiplier_change : floats
        Relative residual of the system that a step solves, and change of given multipliers by (40).
    variation
        The first variation.
    """

    approach: float
    load: float
    fields: BodyFields
    surface: Array
    forces: Array
    closed: Flags
    iterations: int
    unknowns: int
    residual: float
    multiplier_change: float
    variation: Any

    @property
    def kkt(self) -> float:
        """Largest relative residual."""
        return max(self.residual, self.multiplier_change)


@dataclass(frozen=True)
class ContactGuess:
    """A contact that is known without its fields, as of a coarser mesh.

    Attributes
    ----------
    approach : float (length)
    pressures : array (corners, n)
        Of corners at the nodes (stress), at least 0.
    """

    approach: float
    pressures: Array


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

    def __init__(
        self,
        facets: ContactFacets,
        *,
        method: str = "al",
        rho: float | None = None,
        control: str = "approach",
    ) -> None:
        require_choice(("al", "penalty"), method=method)
        require_choice(("approach", "load"), control=control)
        require_kind(ContactFacets, "ContactFacets", facets=facets)
        self.facets = facets
        self.body = facets.body
        self.method = method
        self.control = control
        self._up = facets.normals[:, -1]
        # the unknown approach counts from first touch: a distance before it would take digits from small
        # displacements
        self._first = float((facets.g0 / self._up)[np.isfinite(facets.g0)].min())
        self._g0 = facets.g0 - self._first * self._up
        self._multipliers_given = method == "al" and self.body.in_space
        if rho is not None:
            require_positive(rho=rho)
        self.rho: float | Array = default_rho(facets, method) if rho is None else rho
        self._build()
        self._free_unknowns()

    def _build(self) -> None:
        """Builds the functional: elastic energy (8) and contact term (37), or that of (31)."""
        body = self.body
        facets = self.facets
        self._given = [ng.GridFunction(facets.multipliers) for _ in facets.g0]
        spaces = [*body.spaces]
        if self.method == "al" and not body.in_space:
            spaces += [facets.multipliers] * len(facets.g0)
        space = ng.ProductSpace(*spaces, ng.NumberSpace(body.mesh, definedon=facets.region))
        self._systems: Direct | ConjugateGradients
        if body.in_space:
            self._systems = body.once("systems", lambda: ConjugateGradients(body, space, facets))
        else:
            self._systems = Direct(body, space)
        self.space = self._systems.space
        self._load = ng.Parameter(0.0)
        *unknown, approach = self.space.TrialFunction()
        fields = unknown[: len(body.names)]
        multipliers = unknown[len(body.names) :]
        # over rho: NGSolve takes mixed derivatives from sums of second ones, in which 1 is lost beside rho
        self._unit = self.rho if multipliers else 1.0
        stresses = [self._unit * multiplier for multiplier in multipliers or self._given]
        rho = facets.field(self.rho) if isinstance(self.rho, np.ndarray) else self.rho
        contact = facets.contact(self._g0, fields, stresses, approach, rho)
        contact -= facets.integral(self._load / facets.weights.sum() * approach)  # 0 at an approach
        self._contact = ng.BilinearForm(self.space)
        self._contact += ng.Variation(contact)

    def _free_unknowns(self) -> None:
        """Chooses the unknowns of a system, those on which forces act, and the lengths of moments."""
        body = self.body
        self.free = ng.BitArray(self.space.FreeDofs())
        self.free[self.space.ndof - 1] = self.control == "load"
        if "u1" not in body.fixed and np.abs(self.facets.normals[:, 0]).max() <= ROUNDED:
            # nothing holds a translation along x1: one unknown does, and a residual says if it has to
            u1 = body.unknowns_of("u1")
            self.free[int(np.flatnonzero(np.array(self.free)[u1])[0])] = False
        self._balanced: Flags = np.array(self.free)
        self._balanced[body.space.ndof : -1] = False
        self._arms = np.ones(self.space.ndof)  # moments over them count as forces
        for name in body.names:
            if name.startswith("psi"):
                self._arms[body.unknowns_of(name)] = body.solid.ell

    @bounded
    def solve(
        self, level: float, start: NodalState | OnMesh | ContactGuess | None = None, residual: float = 0.0
    ) -> NodalState:
        """Returns the contact state at this approach or load.

        Parameters
        ----------
        level : float
            Approach (length), or load (force per thickness), by `control`.
        start : NodalState, OnMesh or ContactGuess of the same body, optional
        residual : float
            Relative, at which the iteration ends if it is larger than that of the linear systems.

        Raises
        ------
        NotConverged
            If the active set cycles, the residual stalls or the matrix is singular.
        BadArgument
            If the load is not positive.
        """
        require_finite(level=level, residual=residual)
        if start is not None:
            require_kind((NodalState, OnMesh, ContactGuess), "a NodalState", start=start)
        pressed = self.control == "approach" or level > 0
        require(pressed, "load", level, "must be positive: contact cannot pull")
        unknowns = self._first_guess(level, start)
        has_forces = isinstance(start, NodalState | OnMesh)
        goal = max(residual, self._systems.rtol)
        state = self._state(unknowns, 0, start.pressures > 0 if isinstance(start, ContactGuess) else None)
        best = state
        visits: Counter[bytes] = Counter()
        factorised = None  # active set of the last matrix
        previous: NodalState | None = None
        reason = "the residual stalls"
        for iteration in range(61):
            counted()
            if iteration:
                state = self._state(unknowns, iteration)
                best = min(best, state, key=lambda known: known.kkt)
            falls = (
                previous is None
                or state.residual < previous.residual / 2
                or state.multiplier_change < previous.multiplier_change
            )
            stalls = state.closed.tobytes() == factorised and not falls
            if state.kkt <= goal or stalls:
                break
            active = state.closed.tobytes()
            if active != factorised:
                visits[active] += 1
                if visits[active] > 3:  # rounding excuses some where a corner is just about to close
                    reason = "the active set cycles"
                    break
                factorised = active
                self._linearise(unknowns, state.closed)
                self._systems.add(self._contact.mat, self.free, partial(self._springs, state.closed))
            previous = state
            # those of a first guess may be any
            if self._multipliers_given and (iteration or has_forces):
                for given, stress in zip(self._given, -state.forces / self.facets.weights):
                    given.vec.data = self.facets.field(stress).vec
                state = self._state(unknowns, iteration, state.closed)
            unknowns.vec.data -= self._systems.solve(state.variation, goal / previous.kkt)
        if not best.kkt <= SOLVED:
            raise NotConverged(
                f"Newton stopped at {self.control} {level:g} after {best.iterations} iterations, relative "
                f"residual {best.kkt:.1e}, as {reason}: take {self._systems.advice}",
                iterations=best.iterations,
            )
        return best

    def _first_guess(self, level: float, start: NodalState | OnMesh | ContactGuess | None) -> Any:
        """Returns unknowns with the prescribed values, those of a start, and an approach with contact."""
        unknowns = ng.GridFunction(self.space)
        supports.prescribe(self.body, unknowns.components)
        values = unknowns.vec.FV().NumPy()
        approach = -np.inf
        stresses = np.zeros(self._g0.shape)
        if start is None and self.control == "approach" and not self.body.in_space:
            # a classical contact closes where a rigid one overlaps at a half (in space) to a fifth of it
            stresses += 3 / 4 * self.rho * max(level - self._first, 0.0) * self._up
        if start is not None:
            approach = start.approach - self._first
        if isinstance(start, ContactGuess):
            stresses = -start.pressures
        elif start is not None:  # supports keep the values of this body
            free = self._balanced[: self.body.space.ndof]
            values[: len(free)][free] = start.fields.values[free]
            stresses = -start.forces / self.facets.weights
        if self.method == "al":
            for multiplier, stress in zip(self._multipliers(unknowns), stresses):
                multiplier[:] = self.facets.field(stress / self._unit).vec.FV().NumPy()
        if self.control == "approach":
            self._load.Set(0.0)
            values[-1] = level - self._first
        else:
            self._load.Set(level)
            values[-1] = max(approach, self._closing(unknowns, level if start is None else 0.0))
        return unknowns

    def _linearise(self, unknowns: Any, closed: Flags) -> None:
        """Assembles the tangent of the contact term with these corners closed, (corners, n): of given
        multipliers its sign of (40) alone counts.
        """
        if not self._multipliers_given:
            self._contact.AssembleLinearization(unknowns.vec)
            return
        stresses = [multiplier.vec.Copy() for multiplier in self._given]
        gaps = self._g0 - self._corners(unknowns)[1] - unknowns.vec[-1] * self._up
        beyond = 2 * np.abs((self.rho * gaps)[np.isfinite(gaps)]).max()
        for multiplier, flags in zip(self._given, closed):
            multiplier.vec.data = self.facets.field(np.where(flags, -beyond, beyond)).vec
        self._contact.AssembleLinearization(unknowns.vec)
        for multiplier, stress in zip(self._given, stresses):
            multiplier.vec.data = stress

    def _multipliers(self, vectors: Any) -> list[Array]:
        """Returns coefficients of the corners' multipliers, over `_unit`, arrays (unknowns,)."""
        multipliers = vectors.components[len(self.body.names) : -1] or self._given
        return [multiplier.vec.FV().NumPy() for multiplier in multipliers]

    def _closing(self, unknowns: Any, load: float) -> float:
        """Returns the approach at which about as much of the surface overlaps the obstacle as a classical
        contact under a load would close, at least the nearest corner; for the load 0 the nearest one alone.
        """
        stresses, moved = self._corners(unknowns)
        distances = (stresses / self.rho + self._g0 - moved) / self._up
        reached = np.isfinite(distances)
        areas = np.broadcast_to(self.facets.weights / len(distances), distances.shape)[reached]
        order = np.argsort(distances[reached])
        ascending = distances[reached][order]
        rises = ascending - ascending[0]
        E_star = self.body.solid.E_star
        if self.body.in_space:
            radii = np.sqrt(np.cumsum(areas[order]) / np.pi)
            enough = classical_rise_in_space(load, E_star, radii)
        else:
            enough = np.full(len(rises), classical_rise(load, E_star))
        last = np.argmax(rises >= enough) if rises[-1] >= enough[-1] else -1
        return ascending[last] + 1e-9 * max(rises[-1], self.body.solid.ell)

    def _corners(self, unknowns: Any) -> tuple[Array, Array]:
        """Returns multipliers and displacements along the normal, arrays (corners, n)."""
        multipliers = self._multipliers(unknowns)
        stresses = [self._unit * self.facets.multiplier(multiplier) for multiplier in multipliers]
        fields = unknowns.vec.FV().NumPy()[: self.body.space.ndof]
        return np.array(stresses), self.facets.displacements(fields)

    def _springs(self, closed: Flags) -> Array:
        """Returns what closed corners in space add to the stiffness of each field at the nodes, array
        (fields, n): force per length and area, of rotations moment per angle and area.
        """
        levers = np.cross(self.facets.arms, self.facets.normals)
        normals = np.broadcast_to(self.facets.normals, levers.shape)
        motions = np.concatenate((normals, levers), axis=-1)
        springs = self.rho * np.einsum("cn,cnf->fn", closed, motions**2)
        return springs[[COMPONENTS[name] for name in self.body.names]]

    def _first_variation(self, unknowns: Any, forces: Array) -> tuple[Any, float]:
        """Returns the first variation, a vector, and its part on free unknowns over inner forces."""
        internal = (self._systems.stiffness * unknowns.vec).Evaluate()
        variation = ng.GridFunction(self.space).vec
        if self.body.in_space:
            values = variation.FV().NumPy()
            values[: self.body.space.ndof] = self.facets.exerted(forces)
            values[-1] = self._up @ forces.sum(axis=0) - self._load.Get()
        else:
            self._contact.Apply(unknowns.vec, variation)
        variation.data += internal
        unbalanced = np.linalg.norm((variation.FV().NumPy() / self._arms)[self._balanced])
        acting = np.linalg.norm((internal.FV().NumPy() / self._arms)[: self.body.space.ndof])
        return variation, _ratio(unbalanced, max(acting, unbalanced))

    def _state(self, unknowns: Any, iterations: int, closed: Flags | None = None) -> NodalState:
        """Returns the NodalState of these unknowns, with corners closed by (40) or as given."""
        facets = self.facets
        count = self.body.space.ndof
        copy = ng.GridFunction(self.space)
        copy.vec.data = unknowns.vec
        values = copy.vec.FV().NumPy()
        multipliers, moved = self._corners(copy)
        gaps = self._g0 - moved - values[-1] * self._up  # (22)
        stresses = multipliers + self.rho * gaps
        if closed is None:
            closed = stresses <= 0  # (40)
        stresses = np.where(closed, stresses, 0.0)
        forces = -stresses * facets.weights
        variation, unbalanced = self._first_variation(copy, forces)
        violation = 0.0
        multiplier_change = 0.0
        if self._multipliers_given:
            multiplier_change = _ratio(stresses - multipliers, np.abs(stresses).max())
        elif self.method == "al":
            largest = max(np.abs(moved).max(), abs(values[-1]))  # the scale of the gaps
            pulling = _ratio(multipliers[~closed], np.abs(stresses).max())
            violation = max(_ratio(gaps[closed], largest), pulling)
        load = self._load.Get()
        if self.control == "approach":
            load = float(self._up @ forces.sum(axis=0))
        return NodalState(
            approach=self._first + float(values[-1]),
            load=load,
            fields=BodyFields(self.body, copy.components, variation.FV().NumPy()[:count].copy()),
            surface=(facets.onto @ values[:count]).reshape(-1, len(facets.points)),
            forces=forces,
            closed=closed,
            iterations=iterations,
            unknowns=self.free.NumSet(),
            residual=max(unbalanced, violation),
            multiplier_change=multiplier_change,
            variation=variation,
        )


def default_rho(facets: ContactFacets, method: str) -> float | Array:
    """Returns the `usual_rho` of the body's height; in space of 10 times the length of a facet for the
    penalty, and of 1/24 of that at each node, array (n,), for multipliers, whose error a step leaves where
    facets are shorter.
    """
    body = facets.body
    if body.in_space:
        areas = facets.weights if method == "al" else facets.weights.mean()
        length = np.sqrt(areas * len(facets.points) / len(facets.facets)) / body.order
        return usual_rho(body.solid, method, length * (1 / 24 if method == "al" else 10))
    return usual_rho(body.solid, method, np.ptp([vertex.point[-1] for vertex in body.mesh.vertices]))


def usual_rho(solid: Cosserat, method: str, length: Any) -> Any:
    """Returns lambda + 2 mu over a length; for the penalty 10^4 times (stress per length)."""
    return (1 if method == "al" else 1e4) * (solid.lam + 2 * solid.mu) / length


def _ratio(values: Any, scale: Any) -> float:
    """Returns the largest |value|/scale; 0 for none or zeros, inf without a scale."""
    return float(np.abs(values).max(initial=0.0)) / (float(scale) or np.finfo(float).tiny)
