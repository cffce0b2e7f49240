"""A solution on the surface of a condensed body along x1, of a symmetric problem computed on one half."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import BadArgument
from ..model.problem import level_surface
from ..model.solver import Solver
from ..model.state import ErrorParts, LineSolution, corner_gaps
from ..model.zones import distance, distance_to_ends, joined, moved_on
from .facets import ContactNodes
from .mesh_fields import BelowOnMesh


@dataclass(frozen=True)
class Estimate(ErrorParts):
    """Parts of the relative L2 error of pressure and micromoment; `total` is their sum.

    Attributes
    ----------
    discretisation : float, distance to the next coarser level; None where the mesh was prescribed
    edges : float, what the next step of the edges would change
    truncation : float, of a half-plane that is cut off
    obstacle : float, what the nodes miss of the obstacle (`between`)
    """

    discretisation: float | None
    edges: float
    truncation: float
    obstacle: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceSolution(BelowOnMesh, LineSolution):
    """A solution on the contact nodes of a body whose contact boundary runs along x1.

    Attributes
    ----------
    solver : FittedSolver or UniformSolver
    body : ContactNodes or Condensed; of a symmetric problem the half x1 > 0, the computed part
    load, approach : float, resultant force per thickness (of the whole body) and approach
    forces : array (corners, nodes), of the computed part
    zones : {corner number: ((left, right), ...)} of the computed part
    iterations, unknowns : int
    residual : float
    estimate : Estimate, or None where the mesh does not follow the edges
    computed_psi : array (nodes,), of the computed part
    found_fields : Fields of the computed part where the method has them
    predicted : bool, whether the zones are those expected of a next state (`moved_on`)
    """

    solver: Solver
    body: ContactNodes
    load: float
    approach: float
    forces: np.ndarray
    zones: dict
    iterations: int
    residual: float
    unknowns: int
    computed_psi: np.ndarray
    estimate: Estimate | None = None
    found_fields: object = None
    method: str = "fitted"
    predicted: bool = False

    def moved_on(self, earlier, share):
        """With the zones moved on, if they are alike in both states and none is inverted."""
        moved = moved_on(self.zones, earlier.zones, share)
        return replace(self, zones=moved, predicted=True) if moved else self

    @property
    def problem(self):
        return self.solver.problem

    def remarks(self):
        return (
            self.overlap()
            + self.locking(self.body)
            + self.few_nodes("take a smaller h, or Fitted() with rtol=")
        )

    @cached_property
    def displacement(self):
        """-u.n at `x`."""
        return self._unfold(-self._raised, -self._raised)

    @property
    def _raised(self):
        """u.n at the nodes of the computed part."""
        if self.found_fields is not None:
            return self.body.values("u2", self.found_fields)
        return self.body.compliance.matrix[: len(self._x)] @ self._loads

    @property
    def _loads(self):
        """Nodal normal forces and moments of the computed part, array (2 n,)."""
        return self.body.compliance.loads(self.problem.law, self.forces)

    @property
    def _x(self):
        return self.body.points[:, 0]

    @cached_property
    def _computed(self):
        """Pressures of the computed part, array (corners, n); on the axis corners share one."""
        found = self.forces / self.body.weights
        return np.where(self._x == 0, found.mean(axis=0), found) if self.problem.mirror else found

    @cached_property
    def all_zones(self):
        """{corner number: ((left, right), ...)} on the whole line: 0 is A (left), 1 is B (right)."""
        if not self.problem.mirror:
            return self.zones
        found = {}
        for corner, own in self.zones.items():
            other = self.zones[len(self.zones) - 1 - corner]
            found[corner] = tuple(joined([*((-right, -left) for left, right in other), *own]))
        return found

    @cached_property
    def x(self):
        """Contact nodes of the whole line, ascending."""
        return self._unfold(self._x, -self._x)

    @cached_property
    def weights(self):
        """Weights at `x`: their sum with the pressure is the load."""
        weights = self._unfold(self.body.weights, self.body.weights)
        if self.problem.mirror:
            weights[len(self._x) - 1] *= 2
        return weights

    @cached_property
    def pressures(self):
        """Pressure of each corner at `x`, array (corners, n)."""
        return self._unfold(self._computed, self._computed[::-1])

    def _reaction_at_nodes(self):
        return self._unfold(self._clamping, -self._clamping)

    @cached_property
    def psi(self):
        """Microrotation at `x`."""
        return self._unfold(self.computed_psi, -self.computed_psi)

    @property
    def mirrored(self):
        return self.problem.mirror

    @cached_property
    def fields(self):
        """Fields of the computed part by one back-substitution, with values at points of the whole body."""
        found = self.found_fields if self.found_fields is not None else self.body.fields(self._loads)
        return found.unfolded() if self.mirrored else found

    @cached_property
    def _clamping(self):
        moment = self.body.moments_of("psi", self.fields.forces) / self.body.weights
        if self.problem.mirror:
            moment[0] = 0.0  # there the axis takes the reaction of its own
        else:
            moment[0] = moment[1]  # at its ends the boundary's neighbours add theirs
        moment[-1] = moment[-2]
        return moment

    def pressure(self, corner, x):
        """Pressure of a corner at x, array (n,): on each facet the polynomial through its nodes."""
        return self._between(self._computed[corner], self._computed[::-1][corner], x)

    def gap(self, corner, x):
        """Gap of a corner at x, array (n,); BadArgument beyond the contact boundary."""
        if not np.all((x >= self.x[0]) & (x <= self.x[-1])):
            raise BadArgument("x", x, f"must lie on the contact boundary, from {self.x[0]} to {self.x[-1]}")
        raised, psi = (
            self._between(one, sign * one, x) for one, sign in ((self._raised, 1), (self.computed_psi, -1))
        )
        return corner_gaps(self.problem, self.approach, *level_surface(x), -raised, psi)[corner]

    def clamping(self, x):
        """The reaction to psi = 0 at x, array (n,)."""
        return self._between(self._clamping, -self._clamping, x)

    def _between(self, values, mirrored, x):
        """Values at x from those at the nodes of the computed part, on the other half from the mirrored."""
        if not self.problem.mirror:
            return self.body.interpolate(values, x)
        return np.where(x < 0, self.body.interpolate(mirrored, -x), self.body.interpolate(values, x))

    def _unfold(self, values, mirrored):
        """Values at `x` from those of the computed part, arrays (..., n), on the other half mirrored."""
        parts = (mirrored[..., :0:-1], values) if self.problem.mirror else (values,)
        return np.concatenate(parts, axis=-1)


def surface_solution(solver, body, load, found, zones, iterations, estimate=None, method="fitted"):
    """The SurfaceSolution of a ContactState `found` on a Condensed body."""
    law = solver.law
    forces = found.forces.reshape(len(law.corners), -1)
    psi = body.compliance.matrix[len(body.weights) :] @ body.compliance.loads(law, forces)
    return SurfaceSolution(
        solver,
        body,
        load,
        found.approach,
        forces,
        zones,
        iterations,
        found.kkt,
        body.unknowns,
        psi,
        estimate,
        method=method,
    )


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2 over the contact; beside an end of the obstacle its distance is the
    weight.
    """
    x, ell = fine.x, fine.problem.solid.ell
    shifts = fine.problem.law.shifts(ell)
    weights = fine.weights * distance_to_ends(x, getattr(fine.problem.obstacle, "ends", ()), shifts)
    p = np.array([coarse.pressure(corner, x) for corner in range(len(fine.pressures))])
    total = fine.pressures.sum(axis=0)
    moment = np.zeros_like(x)
    if len(p) == 2:
        levers = np.array([fine.problem.lever(np.full(len(x), corner), x) for corner in range(2)])
        moment = np.sum(levers * (p - fine.pressures), axis=0) / 2
    elif fine.problem.law.clamps_rotation:
        moment = (coarse.clamping(x) - fine.micromoment) * (total > 0) / ell
    return distance(weights, p.sum(axis=0) - total, moment, total)
