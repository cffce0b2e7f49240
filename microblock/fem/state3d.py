"""A solution on the contact nodes of a body in space."""

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..contact_solvers import projected_gradients
from ..model.corner_geometry import CornerGeometry
from ..model.law import side_directions
from ..model.solution import SpaceSolution
from ..model.state import State
from ..model.types import Array, Flags, Integers
from . import recovery
from .body_spaces import COMPONENTS, FIELDS3D
from .facet_nodes import linear_on
from .mesh_solution import OnMesh

FEW = 25  # nodes in contact


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
        grid = {"x1": x1, "x2": x2, "triangles": self.nodes.triangles}
        return self.state_at(points, self.nodes.normals, self.nodes.weights, **grid)

    @property
    def touching(self) -> dict[str, Flags]:
        """{zone: which nodes are closed}; full contact is that of squares and triangles between nodes, for
        where the obstacle is twisted four corners touch on lines at most.
        """
        zones = super().touching
        return {**zones, "full": self.nodes.filling(zones["full"])} if "full" in zones else zones

    @cached_property
    def micromoment(self) -> Array:
        """M about t1 and t2, or the reaction to psi = 0, array (2, n) (stress x length)."""
        nodes = self.nodes
        moments = np.array((self.loads[2], -self.loads[1])) * self.solver.solid.ell / 2
        if self.solver.law.clamps_rotation and nodes.body.rotates:  # not of planes of symmetry
            free = nodes.free_of(self.solver.body)
            names = [name for name in nodes.touching if name.startswith("psi")]
            reactions = np.zeros((3, len(self.weights)))
            for name in names:
                reactions[COMPONENTS[name] - 3] = nodes.moments_of(name, self.fields.forces) * free[name]
            moments = np.einsum("snd,dn->sn", side_directions(nodes.normals), reactions)
        return moments / self.weights * nodes.body.rotates

    @property
    def stiffness(self) -> float | None:
        """dP/dd; None of a method that does not condense to the nodes."""
        if self.method == "newton":
            return None
        return float(projected_gradients.forces_by_approach(self.solver.flexibility, self.forces > 0).sum())

    @property
    def loads(self) -> Array:
        """Nodal forces, and moments in the measure of (-psi2, psi1) ell/2, array (3, n) (force)."""
        return np.einsum("cin,cn->in", self.solver.at_nodes.directions, self.forces)

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner at places, (k, 2) or (k, 3): array (k,)."""
        return self.between(self.pressures[corner], places)

    def between(self, values: Array, places: Array) -> Array:
        """Returns nodal values, (n,), at places, (k, 2) or (k, 3): (k,), linear on triangles, 0 beyond."""
        return np.nan_to_num(self.nodes.interpolated(values[None], *places.T[:2])[0])

    def pressures_over(self, finer: Any) -> Array:
        """Returns pressures of the corners at the nodes of a solver on another mesh, array (corners, k), at
        least 0: linear between nodes, of which open ones have the tension that would close them over their
        spacing.
        """
        gaps = self.solver.at_nodes.gaps(self.displacement, self.psi, self.approach, self.counter_along)
        tension = self.solver.solid.E_star * gaps / np.sqrt(self.nodes.weights)
        highest = self.pressures.max()  # gaps may be infinite
        pressures = np.where(self.pressures > 0, self.pressures, -np.clip(tension, 0.0, highest))
        pressures = np.fmax(self.nodes.interpolated(pressures, *finer.nodes.points.T[:2]), 0.0)
        return np.where(np.isfinite(finer.initial_gaps), pressures, 0.0)

    def counter_displacement(self, places: Array) -> Array:
        counter = self.solver.counter
        if counter is None:
            return super().counter_displacement(places)
        return np.asarray(counter.lifted(self.forces, places[:, :2]), float)

    def counter_along(self, points: Array, normals: Array) -> Array:
        """Returns the displacement along unit normals of a second body's surface over points, arrays (n, 3):
        array (n,) (length).
        """
        counter = self.solver.counter
        if counter is None:
            return np.zeros(len(points))
        return np.asarray(counter.along(self.forces, points, normals), float)

    @property
    def opposite(self) -> Array:
        """Displacement along x3 of a second body's surface at the nodes, array (n,)."""
        return self.counter_displacement(self.nodes.points)

    @property
    def gaps(self) -> Array:
        return self.solver.initial_gaps

    @cached_property
    def error_estimate(self) -> float:
        """That of `recovery`."""
        return recovery.estimate(self).total

    def remarks(self) -> list[str]:
        """Returns sentences on what the estimate does not say, or why it is large."""
        count = np.count_nonzero(self.closed)
        moved = np.abs(self.displacement).max()
        remarks = [*self.deep_indentation(), *self.free_motions()]
        if self.solver.penalizes:
            remarks += self.overlap(self.overlap_of_nodes.max())
        if count < FEW and self.error_estimate > 0.1:
            remarks.append(f"only {count} nodes in contact: {self._finer}")
        radius = float(np.sqrt(self.nodes.weights[self.closed > 0].sum() / np.pi))
        remarks += self.coarse(radius, ", or ask for an rtol" * self.solver.refines)
        remarks += self.beyond()
        if self.solver.counter is not None:
            remarks += self.solver.counter.ends_in(self.forces > 0)
        between, (x1, x2) = self._between_nodes()
        if between > 0.05 * moved:
            remarks.append(
                f"between nodes, at x1 = {x1:.4g} and x2 = {x2:.4g}, the obstacle reaches {between:.2g} into "
                f"the surface: {self._finer}"
            )
        return remarks

    def beyond(self) -> list[str]:
        """Returns a sentence where the obstacle reaches into the surface beside the contact boundary."""
        beside = self._beside()
        if beside <= 1e-3 * np.abs(self.displacement).max():
            return []
        words = f"beside the contact boundary the obstacle reaches {beside:.2g} into the surface: "
        return [words + "name all that it may touch"]

    @property
    def _finer(self) -> str:
        return "take a finer mesh" + ", or ask for rtol=" * self.solver.refines

    def _between_nodes(self) -> tuple[float, list[float]]:
        """Returns how deep a low place of the obstacle reaches into the contact boundary, and this place,
        (2,).
        """
        depths = self.overlaps
        deepest = float(depths.max(initial=0.0))
        if deepest == 0.0:
            return deepest, [np.nan, np.nan]
        # symmetric scenes have several, as deep but for rounding: the first of them
        _, place = np.argwhere(depths > 0.99 * deepest)[0]
        return deepest, self.solver.low_places[:2, place].tolist()

    @cached_property
    def overlaps(self) -> Array:
        """How deep the low places of the obstacle reach into the contact boundary at each corner, array
        (corners, k), 0 beside it.
        """
        nodes = self.nodes
        values = np.vstack((nodes.points[:, 2], nodes.normals.T, self.displacement, self.psi))
        return self._overlaps(self.solver.low_places, partial(nodes.interpolated, values))

    def _overlaps(self, low: Array, surface: Callable[..., Array]) -> Array:
        """Returns the same of low places with their heights, array (3, k), and a surface that has x3, n,
        displacement and psi at places x1 and x2, array (7, k), nan where it ends.
        """
        values = surface(*low[:2])
        covers = np.isfinite(values[0])
        covered = low[:, covers]
        overlaps = np.zeros((len(self.forces), len(covers)))
        # contact points of blocks with corners below the places: blocks turn slowly along the surface
        below = self._blocks_with(covered[:2], values[:, covers])[0]
        for corner, offset in enumerate(below.offsets_from_contact_point):
            contact_points = covered[:2] - offset.T[:2]
            geometry, displacement, psi = self._blocks_with(contact_points, surface(*contact_points))
            corners = geometry.corners[corner]
            inside = (self.approach + corners[:, 2] - covered[2]) * geometry.normals[:, 2]
            inside -= displacement + geometry.rotated(psi)[corner]
            inside -= self.counter_along(corners, geometry.normals)
            overlaps[corner, covers] = np.nan_to_num(inside, nan=0.0)
        return overlaps

    def _blocks_with(self, places: Array, values: Array) -> tuple[CornerGeometry, Array, Array]:
        """Returns the corners of blocks of a surface at places, array (2, k), with displacement, (k,), and
        psi, (2, k), from what the surface has there, array (7, k).
        """
        level, *normals, displacement, psi1, psi2 = values
        points = np.column_stack((*places, level))
        units = np.column_stack(normals / np.linalg.norm(normals, axis=0))
        geometry = self.solver.blocks.under(self.solver.obstacle, points, units)
        return geometry, displacement, np.array((psi1, psi2))

    def _beside(self) -> float:
        """Returns how deep the obstacle reaches into the surface beside the contact boundary."""
        vertices, normals, triangles = self.nodes.surface_beside
        if not len(vertices):
            return 0.0
        points = self.nodes.body.mesh.ngmesh.Coordinates()[vertices]
        # an unknown of a vertex is the value there
        moved = np.zeros((len(FIELDS3D), len(vertices)))
        for name, field in zip(self.nodes.body.names, self.fields):
            moved[COMPONENTS[name]] = field.vec.FV().NumPy()[vertices]
        psi = np.einsum("snd,dn->sn", side_directions(normals), moved[3:])
        values = np.vstack((points[:, 2], normals.T, -np.sum(normals.T * moved[:3], axis=0), psi))
        surface = partial(linear_on, points, triangles, values)
        return float(self._overlaps(self.solver.low_places_beside, surface).max(initial=0.0))

    @cached_property
    def overlap_of_nodes(self) -> Array:
        """How deep corners lie in the obstacle at the nodes, array (n,): with a penalty beyond rounding."""
        blocks = self.solver.at_nodes
        gaps = blocks.gaps(self.displacement, self.psi, self.approach, self.counter_along)
        return np.maximum(-gaps.min(axis=0), 0.0)

    def inside(self, blocks: CornerGeometry, displacement: Array, psi: Array) -> float:
        """Returns how deep the obstacle reaches into the surface at blocks with displacement, array (k,), and
        psi, (2, k).
        """
        return -float(blocks.gaps(displacement, psi, self.approach, self.counter_along).min(initial=0.0))
