"""A solution on the contact nodes of a body in space."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np

from ..model.solution import SpaceSolution
from ..model.state import State
from ..model.types import Array, Integers
from .mesh_solution import OnMesh


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceNodes(OnMesh, SpaceSolution):
    """A solution on the contact nodes of a body in space, or of a part of a symmetric one.

    Attributes
    ----------
    closed : array (n,) of int, closed corners: those with a force, and all four where no gap is open
    """

    _: KW_ONLY
    closed: Integers

    def state(self) -> State:
        """Returns the State at the contact nodes."""
        points = self.nodes.points
        x1, x2 = points.T[:2]
        return self.state_at(points, self.nodes.weights, x1=x1, x2=x2, triangles=self.nodes.triangles)

    @cached_property
    def micromoment(self) -> Array:
        """M1 and M2, or the reaction to psi = 0, array (2, n) (stress x length)."""
        nodes = self.nodes
        moments = np.array((self.loads[2], -self.loads[1])) * self.solver.solid.ell / 2
        if self.solver.law.clamps_rotation and nodes.body.rotates:  # not of planes of symmetry
            free = nodes.free_of(self.solver.body)
            names = ("psi1", "psi2")
            moments = np.array([nodes.moments_of(name, self.fields.forces) * free[name] for name in names])
        return moments / self.weights * nodes.body.rotates

    @property
    def loads(self) -> Array:
        """Nodal forces, and moments in the measure of (-psi2, psi1) ell/2, array (3, n) (force)."""
        return np.einsum("cin,cn->in", self.solver.geometry(self.points).directions, self.forces)

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner at places, (k, 2) or (k, 3): array (k,)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns nodal values, (n,), at places, (k, 2) or (k, 3): (k,), linear on triangles, 0 beyond."""
        return np.nan_to_num(self.nodes.interpolated(values[None], *places.T[:2])[0])

    @property
    def gaps(self) -> Array:
        return self.solver.initial_gaps

    def remarks(self) -> list[str]:
        """Returns sentences on what the state has no estimate for."""
        count = np.count_nonzero(self.closed)
        moved = np.abs(self.displacement).max()
        remarks = []
        if count < 25:
            remarks.append(f"only {count} nodes in contact and no error estimate: take a finer mesh")
        remarks += self.coarse(float(np.sqrt(self.nodes.weights[self.closed > 0].sum() / np.pi)))
        beside = self._beside()
        if beside > 1e-3 * moved:
            remarks.append(
                f"beside the contact boundary the obstacle reaches {beside:.2g} into the surface: name all "
                "that it may touch"
            )
        between, (x1, x2) = self._between_nodes()
        if between > 0.05 * moved:
            remarks.append(
                f"between nodes, at x1 = {x1:.4g} and x2 = {x2:.4g}, the obstacle reaches {between:.2g} into "
                "the surface: take a finer mesh"
            )
        return remarks

    def _between_nodes(self) -> tuple[float, list[float]]:
        """Returns how deep a low place of the obstacle reaches into the contact boundary, and this place,
        (2,).
        """
        nodes = self.nodes
        blocks = self.solver.blocks
        low = self.solver.low_places
        fields = [nodes.extended(values) for values in (self.displacement, *self.psi)]
        deepest = [(0.0, [np.nan, np.nan])]
        for number, offset in enumerate(blocks.offsets):
            x1, x2 = low[:2] - blocks.ell / 2 * offset[:, None]
            (level,) = nodes.interpolated(nodes.points[None, :, 2], x1, x2)
            corners = blocks.on_horizontal_surface(self.solver.obstacle, x1, x2).offsets_from_contact_point
            depths = self.approach + level + corners[number, ..., 2] - low[2]
            near = np.flatnonzero(depths > 0)  # nan beside the contact boundary
            if len(near):
                places = np.column_stack((x1, x2, level))[near]
                points = nodes.body.mesh(*places.T)
                displacement, *psi = [field(points).ravel() for field in fields]
                added = displacement + self.solver.geometry(places).rotated(np.array(psi))
                depths = depths[near] - added[number]
                deepest.append((depths.max(), low[:2, near[np.argmax(depths)]].tolist()))
        return max(deepest)

    def _beside(self) -> float:
        """Returns how deep the obstacle reaches into the surface beside the contact boundary."""
        vertices = self.nodes.vertices_beside
        places = self.nodes.body.mesh.ngmesh.Coordinates()[vertices]
        still = np.zeros(len(vertices))
        if not self.inside(places, still, np.array((still, still))) > 0:
            return 0.0
        # an unknown of a vertex is the value there
        fields = zip(self.nodes.body.names, self.fields)
        values = {name: field.vec.FV().NumPy()[vertices] for name, field in fields}
        psi = np.array((values.get("psi1", still), values.get("psi2", still)))
        return self.inside(places, -values["u3"], psi)

    def inside(self, places: Array, displacement: Array, psi: Array) -> float:
        """Returns how deep the obstacle reaches into the surface at places, (k, 3), with displacement, (k,),
        and psi, (2, k).
        """
        gaps = self.solver.geometry(places).gaps(displacement, psi, self.approach)
        return -float(gaps.min(initial=0.0))
