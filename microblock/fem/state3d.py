"""A solution on the nodes of the contact boundary of a body in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import at_most
from ..model.state import Solution
from ..model.types import AnyArray as Array
from .body import Fields
from .meshes import locking, longest_element

if TYPE_CHECKING:
    from .facets import ContactNodes


@dataclass(frozen=True, repr=False, eq=False)
class SurfaceNodes(Solution):
    """A solution on the contact nodes of a body in space; on a part of a symmetric body, that of the part.

    Attributes
    ----------
    solver : Solver3D
    load, approach : float
    nodes : ContactNodes
    pressures : array (corners, n)
    moved : array (3, n), displacement u into the body and phi = (-psi2, psi1) ell/2 (lengths)
    loads : array (3, n), nodal forces, and moments in the measure of phi, on the body (force)
    closed : array (n,) of int, closed corners: those with a force, and all four where no gap is open
    residual, iterations : float, int
    method : "condensed" or "newton"
    found : Fields, where the method has them
    """

    solver: Any
    load: float
    approach: float
    nodes: ContactNodes
    pressures: Array
    moved: Array
    loads: Array
    closed: Array
    residual: float
    iterations: int

    method: str = "condensed"
    found: Fields | None = None

    @property
    def displacement(self) -> Array:
        """Normal displacement into the body, array (n,) (length)."""
        return self.moved[0]

    @property
    def psi(self) -> Array:
        """Microrotations about x1 and x2, array (2, n) (radians)."""
        return np.array((self.moved[2], -self.moved[1])) * 2 / self.solver.solid.ell

    @property
    def micromoment(self) -> Array:
        """M1 and M2 of the corners' forces, or the reaction to psi = 0, array (2, n) (stress x length)."""
        return np.array((self.loads[2], -self.loads[1])) / self.nodes.weights * self.solver.solid.ell / 2

    @property
    def unknowns(self) -> int:
        """Free unknowns of the body."""
        return int(self.nodes.body.space.FreeDofs().NumSet())

    def pressure(self, corner: int, places: Array) -> Array:
        """Returns the pressure of a corner at places, (k, 2) or (k, 3): linear on triangles, 0 beyond."""
        from matplotlib.tri import LinearTriInterpolator, Triangulation  # here: it takes its time

        x1, x2, _ = self.nodes.points.T
        between = LinearTriInterpolator(Triangulation(x1, x2, self.nodes.triangles), self.pressures[corner])
        return np.ma.filled(between(*places.T[:2]), 0.0)

    def reaction_on(self, boundary: str) -> Any:
        """Returns force and moment (3 components each) of the supports on a boundary."""
        return self.fields.reaction(boundary)

    @property
    def energy(self) -> float:
        """Elastic energy: half the work of the corner forces from the unloaded state on."""
        gaps = self.solver.initial_gaps
        lowered = self.approach - np.where(np.isfinite(gaps), gaps, 0.0)
        return float(np.sum(self.pressures * self.nodes.weights * lowered) / 2)

    @cached_property
    def fields(self) -> Fields:
        """Displacement, microrotation and stresses in the body, and the reactions of its supports."""
        if self.found is not None:
            return self.found
        fields: Fields = self.nodes.fields(self.loads)  # type: ignore[attr-defined]
        return fields

    def remarks(self) -> list[str]:
        """Returns sentences on what the state has no estimate for."""
        area = self.nodes.weights[self.closed > 0].sum()
        body, half_width = self.nodes.body, float(np.sqrt(area / np.pi))
        locked = locking(body.solid, body.order, self._depth, half_width)
        own = self._few(), self._long(), *locked, self._beyond(), self._between()
        return [words for words in own if words]

    @property
    def _depth(self) -> float:
        """How deep the deepest element below the contact reaches."""
        pressed = [bool(np.any(self.closed[own] > 0)) for own in self.nodes.facets]
        return float(self.nodes.depths[pressed].max())

    def _few(self) -> str:
        count = int(np.count_nonzero(self.closed))
        return f"only {count} nodes in contact and no error estimate: take a finer mesh" * (count < 25)

    def _long(self) -> str:
        """Whether the elements below the contact are too long for the layer at the surface."""
        body = self.nodes.body
        longest = longest_element(body.solid, body.order)
        return (
            f"elements of order {body.order} that reach {self._depth:.2g} below the contact, more than "
            f"{at_most(longest)}, do not resolve the layer: take shorter ones, or a higher order"
        ) * bool(self._depth > longest)

    def _beyond(self) -> str:
        """Whether the obstacle reaches into the surface beside the contact boundary."""
        body, numbers = self.nodes.body, self.nodes.beyond
        places = np.array([body.mesh.vertices[int(number)].point for number in numbers]).reshape(-1, 3)
        low = self._gaps(places, np.zeros((3, len(numbers)))).min(axis=0, initial=np.inf) < 0
        if not low.any():
            return ""
        # an unknown of a vertex is the value there
        own = (getattr(self.fields, name).vec.FV().NumPy() for name in ("u3", "psi1", "psi2"))
        u3, psi1, psi2 = (values[numbers[low]] for values in own)
        half = self.solver.solid.ell / 2
        inside = -self._gaps(places[low], np.array((-u3, -half * psi2, half * psi1))).min()
        return (
            f"beside the contact boundary the obstacle reaches {inside:.2g} into the surface: name all that "
            "it may touch"
        ) * bool(inside > 1e-3 * np.abs(self.displacement).max())

    def _between(self) -> str:
        """Whether the obstacle reaches into the surface between the nodes."""
        places, values = self.nodes.between
        inside = -self._gaps(places, np.array([values @ part for part in self.moved])).min()
        words = f"between nodes the obstacle reaches {inside:.2g} into the surface: take a finer mesh"
        return words * bool(inside > 0.05 * np.abs(self.displacement).max())

    def _gaps(self, places: Array, surface: Array) -> Array:
        """Gaps of all corners at places, array (k, 3), with this (u, phi1, phi2), array (3, k)."""
        solver = self.solver
        gaps = solver.surface_law.initial_gaps(solver.obstacle, solver.solid.ell, *places[:, :2].T)
        added = np.einsum("cin,in->cn", solver.directions(places), surface)
        found: Array = gaps - places[:, 2] - self.approach + added
        return found
