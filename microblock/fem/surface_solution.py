"""A solution on the surface of a block along x1."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np

from ..corners.nodal import AtNodes
from ..errors import BadArgument
from ..model.state import ErrorParts, LineSolution
from ..model.zones import distance, distance_to_ends, joined
from .body import Fields
from .facets import ContactNodes
from .mesh_fields import BelowOnMesh
from .mesh_solution import OnMesh


@dataclass(frozen=True)
class Estimate(ErrorParts):
    """Parts of the relative L2 error of pressure and micromoment.

    Attributes
    ----------
    discretisation : float, distance to the next coarser level; None of a prescribed mesh
    edges : float, what the next step of the edges would change
    truncation : float, of a half-plane that is cut off
    obstacle : float, what the nodes miss of the obstacle
    """

    discretisation: float | None
    edges: float
    truncation: float
    obstacle: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceSolution(BelowOnMesh, LineSolution, OnMesh, AtNodes):
    """A solution on the contact nodes of a body whose contact boundary runs along x1.

    Attributes
    ----------
    solver : FittedSolver or UniformSolver
    body : ContactNodes or Condensed; of a symmetric problem the half x1 > 0, the computed part
    load : float, per thickness of the whole body
    forces : array (corners, nodes), of the computed part
    displacement, psi : arrays (n,), -u.n and microrotation, on the whole line
    zones : {corner number: ((left, right), ...)} of the computed part
    estimate : Estimate, or None
    """

    _: KW_ONLY
    body: ContactNodes
    zones: dict
    estimate: Estimate | None = None

    @property
    def problem(self):
        return self.solver.problem

    @property
    def nodes(self):
        return self.body

    @property
    def mirrored(self):
        return self.problem.mirror

    def remarks(self):
        return (
            self.overlap()
            + self.locking(self.body)
            + self.few_nodes("take a smaller h, or Fitted() with rtol=")
        )

    def computed(self, values):
        """Those of the computed part, of values (..., n)."""
        return values[..., -len(self.body.weights) :]

    def _unfold(self, values, mirrored):
        """Values on the whole line from computed and mirrored ones, (..., n)."""
        return np.concatenate((mirrored[..., :0:-1], values), axis=-1) if self.mirrored else values

    @cached_property
    def all_zones(self):
        """{corner number: ((left, right), ...)} on the whole line."""
        if not self.mirrored:
            return self.zones
        found = {}
        for corner, own in self.zones.items():
            other = self.zones[len(self.zones) - 1 - corner]
            found[corner] = tuple(joined([*((-right, -left) for left, right in other), *own]))
        return found

    @cached_property
    def points(self):
        """Contact nodes of the whole line, ascending."""
        x, x2 = self.body.points.T
        return np.column_stack((self._unfold(x, -x), self._unfold(x2, x2)))

    @property
    def normals(self):
        return np.tile((0.0, 1.0), (len(self.x), 1))

    @cached_property
    def weights(self):
        """Weights: their sum with the pressure is the load."""
        weights = self._unfold(self.body.weights, self.body.weights)
        return np.where(self.mirrored & (self.x == 0), 2, 1) * weights

    @cached_property
    def pressures(self):
        """Pressure of each corner, (corners, n); on the axis corners share one."""
        own = super().pressures
        return self._unfold(own, own[::-1])

    @property
    def closed(self):
        return self.pressures > 0

    def _reaction_at_nodes(self):
        moment = self.body.moments_of("psi", self.fields.forces) / self.body.weights
        # at its ends the boundary's neighbours add theirs, and the axis takes the reaction of its own
        moment[[0, -1]] = 0.0 if self.mirrored else moment[1], moment[-2]
        return self._unfold(moment, -moment)

    @cached_property
    def fields(self):
        """Fields, with values at points of the whole body."""
        found = super().fields
        return Fields(found.body, found, found.forces, self.mirrored)

    def interpolated(self, values, x):
        """Nodal values at x, by the facets' polynomials."""
        right = self.body.along.interpolate(self.computed(values), x)
        if not self.mirrored:
            return right
        return np.where(x < 0, self.body.along.interpolate(self.computed(values[::-1]), -x), right)

    def reaction(self, x):
        """Reaction to a prescribed psi at x, array (n,)."""
        return self.interpolated(self.micromoment, x)

    def reaction_on(self, boundary):
        """As of `OnMesh`, of the whole body."""
        found, body = super().reaction_on(boundary), self.fields.body
        if not self.mirrored:
            return found
        named = zip(body.mesh.GetBoundaries(), body.boundary(boundary).Mask())
        if {name for name, chosen in named if chosen} == {"axis"}:
            raise BadArgument(
                "boundary", boundary, "is the axis of symmetry: nothing supports the whole body there"
            )
        return found._replace(force=np.array((0.0, 2 * found.force[1])), moment=0.0)


def unfolded(solver, body, load, approach, forces, surface, *counts, **how):
    """The SurfaceSolution of forces and surface of the computed part."""
    if solver.problem.mirror:
        surface = (np.append(sign * one[:0:-1], one) for one, sign in zip(surface, (1, -1)))
    return SurfaceSolution(solver, load, approach, forces, *surface, *counts, body=body, **how)


def surface_solution(solver, body, load, found, zones, iterations, estimate):
    """The SurfaceSolution of a ContactState on a Condensed body that follows the edges."""
    forces = found.forces.reshape(len(solver.law.corners), -1)
    raised, psi = np.split(body.compliance.matrix @ body.compliance.loads(solver.law, forces), 2)
    counts, how = (found.kkt, iterations, body.unknowns), {"estimate": estimate, "method": "fitted"}
    return unfolded(solver, body, load, found.approach, forces, (-raised, psi), *counts, zones=zones, **how)


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2, weighted by the distance to ends of the obstacle."""
    x, ell, law = fine.x, fine.problem.ell, fine.problem.law
    ends = getattr(fine.problem.obstacle, "ends", ())
    weights = fine.weights * distance_to_ends(x, ends, law.shifts(ell))
    p, total = (
        sum(coarse.pressure(corner, x) for corner in range(len(law.corners))),
        fine.pressures.sum(axis=0),
    )
    moment = (coarse.interpolated(coarse.micromoment, x) - fine.micromoment) / ell
    return distance(weights, p - total, np.where(law.clamps_rotation & (total <= 0), 0.0, moment), total)
