"""Histories of frictional contact on the condensed nodes of a body in space (docs/theory/friction.md).

1. The contact under the largest normal force, without friction, and two rows of nodes about it, are what may
   touch; they are more where the contact comes to their rim.
2. The compliance of these nodes, for normal forces, moments and shear forces, is formed once.
3. The history is followed twice, in half of the increments and in all: their errors are proportional to their
   length, so that the change between both is that of the second.
"""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import vstack

from ..contact_solvers.fft_compliance import with_least_work
from ..contact_solvers.friction_increments import (
    RESIDUAL,
    FrictionIncrements,
    Increment,
    SlidingSolution,
    noted_state,
)
from ..errors import require
from ..model.history import History
from ..model.intervals import distance
from ..model.types import Array, Flags
from . import supports
from .body_fields import BodyFields
from .condensation import DEPENDENT, NodalFlexibility
from .facet_rules import ROUNDED
from .space_boundary import SpaceBoundary
from .state3d import SurfaceNodes

FEWEST_INCREMENTS = 16  # from first touch to the largest normal force
ON_NODES = "forces", "tangential", "slip", "apart", "stick"  # of an Increment


@dataclass(frozen=True, repr=False, eq=False)
class SlidingNodes(SlidingSolution, SurfaceNodes):
    """A solution on contact nodes at loads (P, Q), with its Increment on all nodes.

    Attributes
    ----------
    followed : SurfaceFriction
    of_increments : float, relative error by the length of increments
    """

    _: KW_ONLY
    increment: Any
    followed: Any
    of_increments: float = 0.0

    @property
    def areas(self) -> Array:
        return np.asarray(self.nodes.weights)

    def along_surface(self, values: Array, places: Array) -> Array:
        """Returns nodal values, array (n,), at places, (k, 2) or (k, 3): array (k,)."""
        return self.between(values, places)

    @property
    def loads(self) -> Array:
        """Those of the base, with the moments of shear forces on the faces of blocks."""
        loads = super().loads
        loads[1:] -= self.followed.height * self.increment.tangential
        return loads

    @cached_property
    def fields(self) -> BodyFields:
        return self.followed.fields(self.increment)

    @cached_property
    def error_estimate(self) -> float:
        """That of `recovery`, and that of increments."""
        return super().error_estimate + self.of_increments

    def change(self, coarse: "SlidingNodes") -> float:
        """Returns the relative L2 change of p, M/ell and q/f from a solution on the same nodes."""
        boundary = SpaceBoundary(self)
        p, *others = boundary.nodal - SpaceBoundary(coarse).nodal
        M = np.hypot(*others[:2])
        q = np.hypot(*others[2:])
        weights = self.areas * boundary.norm_weights(self.nodes.points)
        return distance(weights, p, M, self.pressures.sum(axis=0), q)


class NodeFaces(NodalFlexibility):
    """The compliance of some nodes: a flexibility, and the ShearResponse of the faces of their blocks.

    Parameters
    ----------
    compliance : array (k n + 2 n, k n + 2 n)
        Of u into the body, of blocks also phi1 and phi2, k = 1 or 3, and of two displacements of faces along
        the surface, under the forces that are conjugate to them.
    directions : array (corners, k, n), as of `NodalFlexibility`
    """

    def __init__(self, compliance: Array, directions: Array) -> None:
        super().__init__(directions)
        count = directions[0].size
        self._normal = compliance[:count, :count]
        self._cross = compliance[count:, :count]
        self._tangential = compliance[count:, count:]

    def surface(self, forces: Array) -> Array:
        return self._on_nodes(self._normal @ self.resultants(forces).ravel())

    def loads_from(self, surface: Array) -> Array:
        return self._on_nodes(self._normal_inverse(surface.ravel()))

    def _on_nodes(self, values: Array) -> Array:
        """Returns values of u and phi, array (k n,), as (k, n)."""
        return values.reshape(self.directions[0].shape)

    def settled(self, forces: Array, g0: Array, slope: Array) -> Array:
        return with_least_work(forces, g0)

    @cached_property
    def _normal_inverse(self) -> Callable[[Array], Array]:
        return _inverse(self._normal)

    @cached_property
    def _tangential_inverse(self) -> Callable[[Array], Array]:
        return _inverse(self._tangential)

    def moved(self, tangential: Array) -> Array:
        return (self._tangential @ tangential.ravel()).reshape(2, -1)

    def inverse(self, displacement: Array) -> Array:
        return self._tangential_inverse(displacement.ravel()).reshape(2, -1)

    def raised(self, tangential: Array) -> Array:
        return self.gaps(self._on_nodes(tangential.ravel() @ self._cross))

    def dragged(self, forces: Array) -> Array:
        return (self._cross @ self.resultants(forces).ravel()).reshape(2, -1)


def _inverse(matrix: Array) -> Callable[[Array], Array]:
    """Returns the inverse of a compliance, but for what supports hold, as a function of arrays (k,)."""
    diagonal = np.diag(matrix)
    free = diagonal > DEPENDENT * diagonal.max()
    part = matrix[np.ix_(free, free)]
    factor = cho_factor(part + DEPENDENT * diagonal.max() * np.eye(len(part)))

    def apply(values: Array) -> Array:
        result = np.zeros(len(values))
        result[free] = cho_solve(factor, values[free])
        return result

    return apply


class SurfaceFriction:
    """Histories of a Contact of a body in space with a rigid obstacle.

    Parameters
    ----------
    solver : Solver3D, of a law with friction
    loads : array (k, 3), of (P, Q1, Q2)
    coupled : bool, whether shear acts on the gaps

    Raises
    ------
    BadArgument
        Unless the contact boundary is level, Q is 0 across planes of symmetry, and supports hold the body.
    """

    def __init__(self, solver: Any, loads: Array, coupled: bool) -> None:
        self.solver = solver
        self.nodes = solver.nodes
        self.loads = loads
        self.coupled = coupled
        self._require_level()
        self._require_driven()
        arm = solver.at_nodes.offsets_from_centre[0, 0]
        self.height = float(arm @ self.nodes.normals[0]) / (solver.solid.ell / 2)

    def _require_level(self) -> None:
        tilted = np.abs(self.nodes.normals[:, :2]).max() > ROUNDED
        words = (
            "must be level for histories with friction, whose shear forces lie in one plane: turn the mesh, "
            "or name a level part"
        )
        require(not tilted, "contact", self.solver.body.contact, words)

    def _require_driven(self) -> None:
        body = self.nodes.body
        for axis in np.flatnonzero(~self.given):
            words = (
                f"must have Q{axis + 1} = 0 on a part of a body between planes of symmetry across x{axis + 1}"
            )
            require(not self.loads[:, 1 + axis].any(), "pairs", self.loads.tolist(), words)
        free = supports.free_motions(body, self.nodes.points, self.nodes.normals)
        words = f"leaves {' and '.join(free)} free, which shear forces drive: hold it"
        require(not free, "fixed", body.fixed, words)

    @cached_property
    def given(self) -> Flags:
        """Whether no plane of symmetry cuts the body across an axis: boolean array (2,)."""
        planes = supports.planes_of_symmetry(self.solver.body, self.nodes.region)
        return np.array([all(plane.axis != axis for plane in planes) for axis in range(2)])

    @cached_property
    def _pressed(self) -> Flags:
        """Nodes in contact under the largest P without friction, boolean array (n,)."""
        return np.asarray(self.solver.solution_at(float(self.loads[:, 0].max()), None).closed > 0)

    @cached_property
    def count(self) -> int:
        """The smaller number of increments to the largest P: about that of nodes across the contact."""
        across = np.sqrt(4 / np.pi * np.count_nonzero(self._pressed))
        return max(FEWEST_INCREMENTS, int(np.ceil(across)))

    def history(self) -> History:
        """Returns the History, with the errors of the mesh and of the increments."""
        touching = self._pressed
        beyond = touching
        counts = self.count, 2 * self.count
        while beyond.any():
            touching = touching | beyond
            candidates = self._faced & self._about(touching)
            faces = self._faces(candidates)
            coarser, finer = (self._solutions(candidates, faces, count) for count in counts)
            touched = np.any([self._touched(solution) for solution in (*coarser, *finer)], axis=0)
            beyond = touched & ~self._inside(candidates)
        states = [
            noted_state(replace(after, of_increments=after.change(before)), before.increment)
            for before, after in zip(coarser, finer)
        ]
        return History(self.solver.contact, states, [])

    @cached_property
    def _faced(self) -> Flags:
        """Nodes that a corner of the obstacle may touch, boolean array (n,)."""
        return np.asarray(np.isfinite(self.solver.initial_gaps).any(axis=0))

    def _about(self, flags: Flags) -> Flags:
        """Returns nodes with a flag and the two rows about them, boolean arrays (n,)."""
        return self.nodes.beside(self.nodes.beside(flags))

    def _inside(self, candidates: Flags) -> Flags:
        """Returns the candidates whose neighbours are candidates, or touch nothing: boolean array (n,)."""
        return ~self.nodes.beside(self._faced & ~candidates)

    def _touched(self, solution: SlidingNodes) -> Flags:
        """Returns nodes that touch the obstacle or lie in it, boolean array (n,)."""
        depth = 100 * RESIDUAL * np.abs(solution.displacement).max()
        return np.asarray((solution.closed > 0) | (solution.overlap_of_nodes > depth))

    @cached_property
    def _rows(self) -> list[Any]:
        """Rows of u into the body, of blocks phi1 and phi2, and of displacements of faces along t1 and t2:
        sparse arrays (n, unknowns).
        """
        nodes = self.nodes
        count = len(nodes.weights)
        u, *phi = (nodes.onto[first : first + count] for first in range(0, 3 * count, count))
        along = nodes.displacements_along_sides
        faces = [along[axis] - self.height * phi[axis] for axis in range(2)]
        if not self.height:
            phi = []
        return [u, *phi, *faces]

    def _faces(self, candidates: Flags) -> NodeFaces:
        directions = self.solver.at_nodes.directions[:, : len(self._rows) - 2, candidates]
        rows = vstack([row[candidates] for row in self._rows], format="csr")
        return NodeFaces(self.nodes.response(rows), directions)

    def _solutions(self, candidates: Flags, faces: NodeFaces, count: int) -> list[SlidingNodes]:
        """Returns the solutions at the given loads, in so many increments to the largest normal force."""
        gaps = self.solver.initial_gaps[:, candidates]
        friction = float(self.solver.law.friction)
        increments = FrictionIncrements(faces, gaps, faces, friction, self.coupled, RESIDUAL, self.given)
        return [self._solution(candidates, end) for end in increments.follow(self.loads, count)]

    def _solution(self, candidates: Flags, end: Increment) -> SlidingNodes:
        """Returns the solution of an Increment on the candidates."""

        def on_all(values: Array) -> Array:
            on_all_nodes = np.zeros((*values.shape[:-1], len(candidates)), values.dtype)
            on_all_nodes[..., candidates] = values
            return on_all_nodes

        fields: dict[str, Any] = {name: on_all(getattr(end, name)) for name in ON_NODES}
        increment = replace(end, **fields)
        surface = self.nodes.surface(self._exerted(increment), self._all_rows)
        u, phi1, phi2 = surface
        psi = np.array((phi2, -phi1)) * 2 / self.solver.solid.ell
        gaps = self.solver.at_nodes.gaps(u, psi, end.approach)
        closed = gaps <= 2 * max(end.residual, RESIDUAL) * np.abs(u).max()
        return self.solver.solution(
            end.load,
            end.approach,
            increment.forces,
            closed,
            surface,
            end.residual,
            end.iterations,
            kind=SlidingNodes,
            increment=increment,
            followed=self,
        )

    @cached_property
    def _all_rows(self) -> Any:
        return vstack(self._rows, format="csr")

    def _exerted(self, increment: Increment) -> Array:
        """Returns the forces and moments of an Increment on `_rows`, array (rows,)."""
        directions = self.solver.at_nodes.directions[:, : len(self._rows) - 2]
        pressing = np.einsum("cin,cn->in", directions, increment.forces)
        return np.concatenate((pressing.ravel(), increment.tangential.ravel()))

    def fields(self, increment: Increment) -> BodyFields:
        """Returns the fields of the body under the forces of an Increment."""
        return self.nodes.fields(self._exerted(increment), self._all_rows)
