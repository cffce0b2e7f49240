"""A solution on the contact nodes of a body in space."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property

import numpy as np

from .mesh_solution import OnMesh


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceNodes(OnMesh):
    """A solution on the contact nodes of a body in space, or of a part of a symmetric one.

    Attributes
    ----------
    closed : array (n,) of int, closed corners: those with a force, and all four where no gap is open
    """

    _: KW_ONLY
    closed: np.ndarray

    @cached_property
    def micromoment(self):
        """M1 and M2, or the reaction to psi = 0, array (2, n) (stress x length)."""
        nodes, moments = self.nodes, np.array((self.loads[2], -self.loads[1])) * self.solver.solid.ell / 2
        if self.solver.law.clamps_rotation and nodes.body.rotates:  # not of planes of symmetry
            free, names = nodes.free_of(self.solver.body), ("psi1", "psi2")
            moments = [nodes.moments_of(name, self.fields.forces) * free[name] for name in names]
        return np.array(moments) / self.weights * nodes.body.rotates

    @property
    def loads(self):
        """Nodal forces, and moments in the measure of (-psi2, psi1) ell/2, array (3, n) (force)."""
        return np.einsum("cin,cn->in", self.solver.geometry(self.points).directions, self.forces)

    def pressure(self, corner, places):
        """Returns the pressure of a corner at places, (k, 2) or (k, 3)."""
        return self.between(self.pressures[corner], places)

    def between(self, values, places):
        """Returns nodal values at places, (k, 2) or (k, 3): linear on triangles, 0 beyond."""
        return np.nan_to_num(self.nodes.interpolated(values[None], *places.T[:2])[0])

    @property
    def gaps(self):
        return self.solver.initial_gaps

    def remarks(self):
        """Returns sentences on what the state has no estimate for."""
        count, moved = np.count_nonzero(self.closed), np.abs(self.displacement).max()
        half_width = float(np.sqrt(self.nodes.weights[self.closed > 0].sum() / np.pi))
        between, (x1, x2) = self._between_nodes()
        beside = self._beside()
        found = [
            (count < 25, f"only {count} nodes in contact and no error estimate: take a finer mesh"),
            *((True, words) for words in self.coarse(half_width)),
            (
                beside > 1e-3 * moved,
                f"beside the contact boundary the obstacle reaches {beside:.2g} into the surface: name all "
                "that it may touch",
            ),
            (
                between > 0.05 * moved,
                f"between nodes, at x1 = {x1:.4g} and x2 = {x2:.4g}, the obstacle reaches {between:.2g} into "
                "the surface: take a finer mesh",
            ),
        ]
        return [words for holds, words in found if holds]

    def _between_nodes(self):
        """How deep a low place of the obstacle reaches into the contact boundary, and this place, (2,)."""
        nodes, blocks, ell = self.nodes, self.solver.blocks, self.solver.solid.ell
        low = self.solver.low_places
        moved = [nodes.within(values) for values in (self.displacement, *self.psi)]
        deepest = [(0.0, [np.nan, np.nan])]
        for number, offset in enumerate(blocks.offsets):
            x1, x2 = low[:2] - ell / 2 * offset[:, None]
            (level,) = nodes.interpolated(nodes.points[None, :, 2], x1, x2)
            corners = blocks.on_level(self.solver.obstacle, x1, x2).offsets_from_contact_point
            depths = self.approach + level + corners[number, ..., 2] - low[2]
            near = np.flatnonzero(depths > 0)  # nan beside the contact boundary
            if len(near):
                places = np.column_stack((x1, x2, level))[near]
                at = nodes.body.mesh(*places.T)
                displacement, *psi = [function(at).ravel() for function in moved]
                added = displacement + self.solver.geometry(places).rotated(np.array(psi))
                depths = depths[near] - added[number]
                deepest.append((depths.max(), low[:2, near[np.argmax(depths)]].tolist()))
        return max(deepest)

    def _beside(self):
        """How deep the obstacle reaches into the surface beside the contact boundary."""
        numbers = self.nodes.beyond
        places = self.nodes.body.mesh.ngmesh.Coordinates()[numbers]
        if not self.inside(places, np.zeros((3, len(numbers)))) > 0:
            return 0.0
        # an unknown of a vertex is the value there
        fields = zip(self.nodes.body.names, self.fields)
        moved = {name: field.vec.FV().NumPy()[numbers] for name, field in fields}
        still = np.zeros(len(numbers))
        moved = -moved["u3"], moved.get("psi1", still), moved.get("psi2", still)
        return self.inside(places, np.array(moved))

    def inside(self, places, moved):
        """How deep the obstacle reaches into the surface at places, (k, 3), with displacement, psi1 and psi2
        `moved`, (3, k).
        """
        displacement, *psi = moved
        gaps = self.solver.geometry(places).gaps(displacement, np.array(psi), self.approach)
        return -float(gaps.min(initial=0.0))
