"""Contact of a body in space with a rigid obstacle by projected gradients."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np

from .. import cost
from ..contact_solvers import projected_gradients
from ..contact_solvers.corner_forces import closed_corners, least_norm_where_closed
from ..errors import NOT_YET, require
from ..halfplane.kernels import coalescence_exponent
from ..model.corner_geometry import CornerGeometry
from ..model.deformable import shape_of
from ..model.events import LoadPath
from ..model.history import History
from ..model.obstacles import heights
from ..model.progress import counting
from ..model.solver import SOLVED
from ..model.types import Array, Flags
from . import factors
from .body import Body
from .condensation import CondensedNodes, Flexibility3D, condensed
from .facets import gaps_at_nodes
from .forecast import OnGivenMesh
from .friction import require_given
from .friction3d import SurfaceFriction
from .mesh_cuts import grid_lines
from .mesh_solution import OnMesh
from .mesh_surface import MeshSurface
from .path3d import Path3D
from .recovery import refine_until
from .second_body import REFINES_ONE, SecondBody
from .state3d import SurfaceNodes

ROWS = 1024  # of heights of the obstacle that are looked at for what lies between nodes
TILE = 8  # of rows and columns, of which the lowest height counts
LEAST_MOVED = 1e-3  # of the displacement of one corner alone


class FlexibilityOfTwo(Flexibility3D):
    """Gaps of corners from their forces on two bodies, of which the first one preconditions.

    Parameters
    ----------
    directions, nodes : as of `Flexibility3D`
    second : SecondBody
    share : array (n,), by which forces are divided where they are parts of the load
    """

    def __init__(self, directions: Array, nodes: CondensedNodes, second: SecondBody, share: Array) -> None:
        super().__init__(directions, nodes)
        self.second = second
        self.share = share

    def __matmul__(self, forces: Array) -> Array:
        return super().__matmul__(forces) + self.second.moved(forces / self.share) / self.share

    def on_face(self, face: Flags) -> Callable[[Array], Array]:
        of_first = super().on_face(face)
        return lambda gaps: of_first(gaps) + self._against_twists * self._twist(gaps)

    def _twist(self, gaps: Array) -> Array:
        """Returns the part of gaps that no displacement and rotation of the first body's blocks leaves,
        arrays (corners, n): it can only be the second one's.
        """
        return gaps - self.gaps(self.nearest_surface(gaps))

    @cached_property
    def _against_twists(self) -> float:
        """Force per gap of the twist of a block in the middle of the boundary, 0 with few corners."""
        middle = len(self.share) // 2
        unit = np.zeros((len(self.directions), len(self.share)))
        unit[0, middle] = 1.0
        twist = self._twist(unit)
        length = float(np.linalg.norm(twist))
        if length < LEAST_MOVED:
            return 0.0
        twist /= length
        moved, alone = (float(np.sum(forces * self.second.moved(forces))) for forces in (twist, unit))
        return 1 / max(moved, LEAST_MOVED * alone) if alone > 0 else 0.0


class Solver3D(OnGivenMesh):
    """States of a body in space on its condensed contact nodes."""

    most_corners = None
    most_unknowns = 150_000  # of a mesh that is refined: some GB, and a minute
    in_space = "nodes"
    counter_bodies: tuple[type, ...] = (Body,)
    no_rtol = (
        "needs a mesh of tetrahedra, or of hexahedra that are the boxes of a grid, which are cut where the "
        "error is; other meshes are taken as they are, with their error estimate"
    )

    def set_up(self) -> None:
        super().set_up()
        if self.counter is not None:
            self.no_rtol = REFINES_ONE

    @property
    def nodes(self) -> Any:
        return condensed(self.body, self.law.clamps_rotation, followed=self.law.friction > 0)

    def history(self, pairs: Array, coupled: bool, rtol: float | None) -> History:
        """Returns the History through pairs, array (n, 3); raises BadArgument for an rtol, a second body, and
        as SurfaceFriction.
        """
        require_given(self.obstacle, rtol)
        return SurfaceFriction(self, pairs, coupled).history()

    @property
    def rate(self) -> str:
        return "condensed in space" + " by SuperLU" * (factors.usual is factors.SuperLU)

    @property
    def refines(self) -> bool:
        simplices = all(element.type == ng.ET.TET for element in self.body.mesh.Elements())
        return (simplices or self.grid_lines is not None) and self.counter is None

    @cached_property
    def grid_lines(self) -> list[Array] | None:
        """Those of the body's mesh, if its elements are the boxes of a grid."""
        return grid_lines(self.body.mesh)

    def refined_cost(self, rtol: float) -> cost.Cost:
        # of a sphere: the error falls like the length of facets along the edge of the contact
        body = self.body
        of_field = 1300 * body.order if self.grid_lines else 400 * (3 - body.order)
        needed = body.unknowns + of_field * len(body.names) / rtol
        return cost.predict(self.rate, needed, times=2)

    @property
    def crossing(self) -> float:
        """Power of the nodes' distance with which loads converge at which edges of two corners cross."""
        return 2 * coalescence_exponent(self.solid)

    @cached_property
    def initial_gaps(self) -> Array:
        """Array (corners, n); inf where a corner cannot touch."""
        gaps = gaps_at_nodes(self.at_nodes, self.nodes)
        return gaps if self.counter is None else self.counter.over(gaps)

    @cached_property
    def at_nodes(self) -> CornerGeometry:
        """The corners of blocks at the nodes."""
        return self.blocks.under(self.obstacle, self.nodes.points, self.nodes.normals)

    @cached_property
    def low_places(self) -> Array:
        """Those over the contact boundary, as `_lowest_over` returns them."""
        return self._lowest_over(self.nodes.points)

    @cached_property
    def low_places_beside(self) -> Array:
        """Those over the surface beside it."""
        return self._lowest_over(self.body.mesh.ngmesh.Coordinates()[self.nodes.surface_beside[0]])

    def _lowest_over(self, points: Array) -> Array:
        """Returns x1, x2 and height of the lowest of TILE * TILE places of the obstacle, array (3, k). Half
        of ROWS are evenly spaced over points, array (n, 3), the others as dense as these. Of the surface
        of a mesh they are the points of its facets.
        """
        shape = shape_of(self.obstacle)
        if isinstance(shape, MeshSurface):
            return shape.points.T
        even = np.arange(0.5, ROWS, 2) / ROWS
        axes = []
        for x in points.T[:2]:
            rows = (np.quantile((x.min(), x.max()), even), np.quantile(np.unique(x), even + 1 / ROWS))
            axes.append(np.sort(np.concatenate(rows)))
        places = np.array(np.meshgrid(*axes, indexing="ij"))
        values = np.array((*places, heights(self.obstacle, *places)))
        tiles = values.reshape(3, ROWS // TILE, TILE, ROWS // TILE, TILE).swapaxes(2, 3)
        tiles = tiles.reshape(3, -1, TILE**2)
        lowest = np.argmin(tiles[2], axis=1)
        return tiles[:, np.arange(len(lowest)), lowest]

    def path(self, last: float, rtol: float | None) -> LoadPath:
        self.require_given_mesh(rtol)
        solver = self
        if rtol is not None:
            with counting("mesh"):  # its states are not what a path leaves
                solver = refine_until(self, last, None, rtol).solver
        return Path3D(self.contact, last, rtol, solver)

    def solution_at(self, load: float | None, approach: float | None, initial: Any = None) -> OnMesh:
        """Returns the solution on the mesh as it is, from another one there or None."""
        alike = isinstance(initial, SurfaceNodes) and initial.nodes is self.nodes
        alike = alike and len(initial.forces) == len(self.initial_gaps)
        return self._solution_from(initial.forces if alike else None, load, approach)

    def refined_at(self, load: float | None, approach: float | None, coarse: SurfaceNodes) -> OnMesh:
        return self._solution_from(coarse.pressures_over(self) * self.nodes.weights, load, approach)

    def _solution_from(self, start: Array | None, load: float | None, approach: float | None) -> OnMesh:
        """Returns the solution from forces of the corners, array (corners, n), or None."""
        share = self.shares
        H = self.flexibility
        residual = 1e-9
        contact = projected_gradients.solve_matrix_free(
            H,
            self.initial_gaps / share,
            load=load,
            approach=approach,
            start=None if start is None else start * share,
            rtol=residual,
        )
        require(contact.load > 0, "approach", approach, NOT_YET)
        surface = H.surface(contact.forces)
        moved = np.abs(H @ contact.forces).max()
        closed = contact.gaps <= 2 * max(contact.kkt, residual) * moved
        forces = contact.forces / share
        return self.solution(
            contact.load, contact.approach, forces, closed, surface, contact.kkt, contact.iterations
        )

    @cached_property
    def shares(self) -> Array:
        """Parts of the load of unit forces along -n, array (n,): the unknowns, and gaps are along x3."""
        return np.where(np.isfinite(self.initial_gaps).any(axis=0), self.nodes.normals[:, 2], 1.0)

    @cached_property
    def flexibility(self) -> Flexibility3D:
        """Gaps along x3 from parts of the load, on both bodies."""
        directions = self.at_nodes.directions / self.shares
        if self.counter is not None:
            return FlexibilityOfTwo(directions, self.nodes, self.counter, self.shares)
        return Flexibility3D(directions, self.nodes)

    def solution(
        self,
        load: float,
        approach: float,
        forces: Array,
        closed: Flags,
        surface: Array,
        residual: float,
        iterations: int,
        kind: type[SurfaceNodes] = SurfaceNodes,
        **fields: Any,
    ) -> Any:
        """Returns the SurfaceNodes, or a `kind` of these with more fields, of corner forces and closed
        corners, (corners, n), and (u, phi1, phi2) at the nodes, (3, n); raises BadArgument where the obstacle
        lies in held nodes.
        """
        if self.counter is None:  # a second body is pressed by each corner at its own place
            forces = least_norm_where_closed(forces, closed)
        u, phi1, phi2 = surface
        solution = kind(
            self,
            load,
            approach,
            forces,
            u,
            np.array((phi2, -phi1)) * 2 / self.solid.ell,
            residual,
            iterations,
            self.nodes.body.unknowns,
            closed=closed_corners(forces, closed),
            **fields,
        )
        held = ~self.nodes.moves
        rim = self.blocks.under(self.obstacle, self.nodes.points[held], self.nodes.normals[held])
        inside = solution.inside(rim, u[held], solution.psi[:, held])
        words = f"reaches the rim of the contact boundary, where supports hold it, by {inside:.3g}"
        require(inside <= SOLVED * np.abs(u).max(), "obstacle", self.obstacle, words)
        return solution
