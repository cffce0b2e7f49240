"""A second body on a mesh: how its contact boundary gives way under the corners of the first one.

Nodes need not match. The normals of the first body, between nodes their means, meet the facets of the second
one. With w the displacement there

    w_i = integral of chi_i n_i . w / integral of chi_i

is what the gap of a corner of node i grows by, and its force f_i n_i is shared out by the same weights: it is
the same on both bodies, and the flexibility is symmetric and positive. The polynomials chi_i are dual to
those of the nodes on each facet (Wohlmuth, SIAM J. Numer. Anal. 38 (2000) 989): they sum up to 1, so that a
constant pressure stays constant, and where w is a polynomial of the nodes w_i is n_i . w at node i.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.sparse import csr_matrix, diags, vstack

from .. import cost
from ..errors import require
from ..model.corner_geometry import Blocks, CornerGeometry
from ..model.deformable import Deformable
from ..model.law import Unilateral, tangents, upwards
from ..model.obstacles import STEEPEST
from ..model.types import Array, Flags, Integers
from ..threads import bounded
from .body import Body
from .body_fields import BodyFields
from .body_spaces import COMPONENTS
from .bulk import Bulk
from .condensation import condensed_bytes, require_pressed, without_idle_rotation
from .contact_nodes import ContactNodes
from .facet_rules import composite, composite_line, rule_at, units
from .mesh_surface import Hits, MeshSurface, SymmetryPlane

LEVEL = 1e-9  # of the extent of a boundary, and of a normal: what rounding leaves of a level one
REFINES_ONE = "refines the mesh of the first body alone: with a second body solve without it"

SAMPLES = 9  # of a facet in the plane, between which vertices of the other body are looked for
PIECES = 4  # of a facet in space along a side, on a facet of the other body of its size
MOST_PIECES = 16
COVERED = 0.25  # of the area of a pressure: polynomials change their sign, and a mean over less has no bound


class SecondBody:
    """The second body of a problem, condensed to its contact boundary.

    Parameters
    ----------
    obstacle : Deformable of a Body
    nodes : ContactNodes of the first body
    blocks : Blocks, of the first body

    Attributes
    ----------
    body : Body
    surface : MeshSurface, its contact boundary

    Raises
    ------
    BadArgument
        Unless supports hold it, and its contact boundary is level where a shape lies under it.
    """

    def __init__(self, obstacle: Deformable, nodes: ContactNodes, blocks: Blocks) -> None:
        second: Any = obstacle.body
        self.obstacle = obstacle
        self.body: Body = without_idle_rotation(second, Unilateral())
        require_pressed(self.body)
        self.surface: MeshSurface = self.body.surface()
        self._nodes = nodes
        self._blocks = blocks
        if not self.is_shape:
            self._require_level()
        for plane in self.surface.planes:
            words = (
                f"its body ends at a plane of symmetry, x{plane.axis + 1} = {plane.place:g}, and the other "
                "one does not: mesh the same part of both"
            )
            inside = plane.side * (nodes.points[:, plane.axis] - plane.place) >= -self._rounding
            require(inside.all(), "obstacle", obstacle, words)

    @property
    def is_shape(self) -> bool:
        """Whether the surface of the mesh is the shape."""
        return self.obstacle.shape is None

    def _require_level(self) -> None:
        points = self.surface.points
        words = (
            "its body must be above its contact boundary, which is straight and level: heights are those of "
            "the shape; without a shape the surface of the mesh is the shape, level or not"
        )
        level = np.ptp(points[:, -1]) <= LEVEL * np.ptp(points, axis=0).max()
        downwards = self.surface.normals[:, -1].max() <= LEVEL - 1
        require(level and downwards, "obstacle", self.obstacle, words)

    @cached_property
    def _at_nodes(self) -> CornerGeometry:
        """The corners of the first body's blocks at its nodes."""
        return self._blocks.under(self.obstacle, self._nodes.points, self._nodes.normals)

    @cached_property
    @bounded
    def _bulk(self) -> Bulk:
        """The matrix of the body, with the unknowns of its contact boundary last."""
        body = self.body
        region = body.boundary(body.contact)
        on_boundary = [
            body.unknowns_of(name).start + np.flatnonzero(np.array(space.GetDofs(region)))
            for name, space in zip(body.names, body.spaces)
            if name[0] == "u"
        ]
        seen = np.concatenate(on_boundary)
        advice = "take longer elements, a lower order or a smaller contact boundary for it"
        words = f"a second body of {body.unknowns} unknowns with {len(seen)} on its contact boundary"
        cost.require_room(condensed_bytes(body, len(seen), len(seen) // body.mesh.dim), words, advice)
        return Bulk(body, body.bulk(symmetric=True, condense=True), seen, advice)

    def _met(self, points: Array, lines: Array) -> Hits:
        """Returns where lines through points, arrays (n, dim), meet the boundary; under a shape it is above
        the points.
        """
        if self.is_shape:
            return self.surface.met(points, lines)
        return self.surface.above(points[:, :-1])

    def _traced(self, hits: Hits) -> tuple[Integers, Integers, Array]:
        """Returns the functions of a component of u where lines meet the boundary: rows, unknowns and values,
        arrays (k,).
        """
        there = np.flatnonzero(hits.facets >= 0)
        space = self.body.spaces[0]
        rows, unknowns, values = self.surface.trace(space, hits.facets[there], hits.places[there])
        return there[rows], unknowns, values

    def _rows_along(self, traced: tuple[Integers, Integers, Array], along: Array) -> Any:
        """Returns the displacement along vectors, array (n, dim), from the unknowns on the boundary and what
        `_traced` returns: sparse (n, m), 0 where lines do not meet it.
        """
        rows, unknowns, values = traced
        body = self.body
        displacement = csr_matrix((len(along), body.space.ndof))
        for name in body.names:
            if name[0] == "u":
                columns = unknowns + body.unknowns_of(name).start
                part = (values * along[rows, COMPONENTS[name]], (rows, columns))
                displacement = displacement + csr_matrix(part, shape=displacement.shape)
        return displacement[:, self._bulk.contact]

    @cached_property
    def _shares(self) -> tuple[Any, Flags]:
        """Displacement of each corner from the unknowns on the boundary, sparse (corners n, m), and whether
        its pressure meets the boundary, boolean array (corners, n).
        """
        parts = [self._shares_of(corner) for corner in range(len(self._blocks.names))]
        rows = [of_corner for of_corner, _ in parts]
        covered = [of_corner for _, of_corner in parts]
        for plane in self.surface.planes:
            # a pressure there has its other half beyond the plane, where the corner's mirror image stands
            on_plane = np.abs(self._nodes.points[:, plane.axis] - plane.place) <= self._rounding
            half = diags(on_plane / 2)
            images = self._images(plane)
            rows = [here + half @ (rows[image] - here) for here, image in zip(rows, images)]
            covered = [here | (covered[image] & on_plane) for here, image in zip(covered, images)]
        return vstack(rows, format="csr"), np.array(covered)

    @property
    def _rounding(self) -> float:
        """Distance that rounding may leave on the boundary of the first body (length)."""
        return float(LEVEL * np.ptp(self._nodes.points, axis=0).max())

    def _images(self, plane: SymmetryPlane) -> list[int]:
        """Returns the corner that is each corner's mirror image; raises BadArgument where there is none."""
        blocks = self._blocks
        levers = blocks.levers(*np.zeros((self._nodes.dim - 1, 1))).reshape(len(blocks.names), -1)
        both = np.hstack((blocks.offsets, levers))
        mirrored = both.copy()
        mirrored[:, plane.axis :: self._nodes.dim - 1] *= -1
        apart = np.abs(mirrored[:, None] - both).max(axis=2)
        where = f"x{plane.axis + 1} = {plane.place:g}"
        words = f"must have blocks that are their own mirror images at the plane of symmetry {where}"
        require(apart.min(axis=1).max() <= LEVEL, "law", blocks.law, words)
        return np.argmin(apart, axis=1).tolist()

    def _shares_of(self, corner: int) -> tuple[Any, Flags]:
        """Returns what `_shares` has of a corner."""
        nodes = self._nodes
        rules = self._rules(corner)
        places, weights, outward, basis = nodes.at_points(rules)
        corners, normals = self._corners(corner, places, basis)
        hits = self._met(corners, normals)
        shares = (diags(weights) @ nodes.dual(rules, weights, basis)).tocoo()
        facing = np.sum(outward[shares.row] * nodes.normals[shares.col], axis=1) > STEEPEST
        shares = csr_matrix((shares.data * facing, (shares.col, shares.row)), shape=basis.T.shape)
        areas = shares @ (hits.facets >= 0)
        covered = areas > COVERED * (shares @ np.ones(len(corners)))
        averages = diags(covered / np.where(covered, areas, 1.0)) @ shares
        rows = csr_matrix((len(areas), len(self._bulk.contact)))
        traced = self._traced(hits)
        for axis, along in enumerate(nodes.normals.T):
            direction = hits.signs * np.eye(nodes.dim)[axis]
            rows = rows + diags(along) @ (averages @ self._rows_along(traced, direction))
        return rows, covered

    def _corners(self, corner: int, places: Array, basis: Any) -> tuple[Array, Array]:
        """Returns where a corner stands at places of the first body, array (k, dim), with values from the
        nodes, sparse (k, n), and normals there, means of those of the nodes: arrays (k, dim).
        """
        normals = units(basis @ self._nodes.normals)
        return self._blocks.under(self.obstacle, places, normals).corners[corner], normals

    def _corners_at(self, corner: int, rule: Any) -> tuple[Array, Array]:
        """Returns the same at the points of a rule on each of its facets."""
        places, _, _, basis = self._nodes.at_points([rule] * len(self._nodes.facets))
        return self._corners(corner, places, basis)

    def _rules(self, corner: int) -> list[Any]:
        """Returns a rule of each facet of the first body for the integrals over facets of both: in the plane
        it is cut where vertices of this one are met, in space in pieces.
        """
        facets = list(self._nodes.region.Elements())
        if self._nodes.dim == 2:
            return [composite_line(cuts) for cuts in self._cuts(corner)]
        hits = self._met(*self._corners_at(corner, rule_at([(1 / 3, 1 / 3)])))
        points = self._nodes.points
        sizes = np.array([np.ptp(points[members], axis=0).max() for members in self._nodes.facets])
        pieces = np.ceil(PIECES / 2 * sizes / self.surface.radii[hits.facets])
        pieces = np.where(hits.facets >= 0, np.clip(pieces, PIECES, MOST_PIECES), 1).astype(int)
        return [composite(facet.type, int(number)) for facet, number in zip(facets, pieces)]

    def _cuts(self, corner: int) -> Iterator[Array]:
        """Yields of each facet in the plane the reference coordinates, ascending from 0 to 1, of the places
        whose normals meet a vertex.
        """
        t = np.linspace(0, 1, SAMPLES)
        corners, normals = self._corners_at(corner, rule_at(t[:, None]))
        vertices = self._vertices()
        lines = normals if self.is_shape else upwards(corners)
        across = tangents(lines)
        beside = across @ vertices.T - np.sum(across * corners, axis=1)[:, None]
        for distances in beside.reshape(-1, SAMPLES, len(vertices)):
            before, after = distances[:-1], distances[1:]
            piece, number = np.nonzero(before * after < 0)
            share = before[piece, number] / (before - after)[piece, number]
            yield np.unique(np.concatenate(([0.0, 1.0], (piece + share) / (SAMPLES - 1))))

    def _vertices(self) -> Array:
        """Returns the vertices of its contact boundary and their mirror images, array (k, dim)."""
        numbers = {vertex.nr for facet in self.surface.facets for vertex in facet.vertices}
        vertices: Array = self.body.mesh.ngmesh.Coordinates()[sorted(numbers)]
        for plane in self.surface.planes:
            vertices = np.concatenate((vertices, plane.mirrored(vertices)))
        return vertices

    def over(self, gaps: Array) -> Array:
        """Returns the initial gaps of corners, array (corners, n): inf where the boundary meets no part of a
        corner's pressure, or hardly any; raises BadArgument if all are, or where the boundary ends over a
        shape.
        """
        if not self.is_shape:
            self._require_covered(gaps)
        gaps = np.where(self._shares[1], gaps, np.inf)
        words = "its contact boundary lies over no node of the other body's"
        require(np.isfinite(gaps).any(), "obstacle", self.obstacle, words)
        return gaps

    def _require_covered(self, gaps: Array) -> None:
        """Raises BadArgument for a corner below the shape, of a finite gap, (corners, n), and below no part
        of the contact boundary.
        """
        corners = self._at_nodes.corners[np.isfinite(gaps)]
        left, right = self.surface.points[:, 0].min(), self.surface.points[:, 0].max()
        words = (
            f"its contact boundary, from {left:g} to {right:g}, must reach over all corners below the shape, "
            f"from {corners[:, 0].min():g} to {corners[:, 0].max():g}"
        )
        require((self.surface.above(corners[:, :-1]).facets >= 0).all(), "obstacle", self.obstacle, words)

    @cached_property
    def flexibility(self) -> Array:
        """What forces of the corners add to their gaps, array (corners n, corners n)."""
        half = solve_triangular(self._bulk.block, self._shares[0].T.toarray(), lower=True)
        return half.T @ half

    def moved(self, forces: Array) -> Array:
        """Returns what forces of the corners, (corners, n), add to their gaps: array (corners, n)."""
        return (self._shares[0] @ self.unknowns(forces)).reshape(forces.shape)

    def unknowns(self, forces: Array) -> Array:
        """Returns the unknowns on the boundary, array (m,), under forces of the corners, (corners, n)."""
        return np.asarray(cho_solve((self._bulk.block, True), self._shares[0].T @ forces.ravel()))

    def ends_in(self, closed: Flags) -> list[str]:
        """Returns a sentence where the contact, of closed corners, boolean array (corners, n), reaches an end
        of the boundary beyond which the surface goes on.
        """
        nodes = self._nodes
        reached = np.zeros(len(nodes.points), bool)
        for members in nodes.facets:
            reached[members] |= closed[:, members].any()
        beside = MeshSurface(~self.body.boundary(self.body.contact), self.surface.planes)
        for corners, covered in zip(self._at_nodes.corners, self._shares[1]):
            ends = reached & ~covered
            facets = beside.met(corners[ends], nodes.normals[ends]).facets
            if np.any(facets >= 0):
                where = ", ".join(f"{x:.3g}" for x in corners[ends][np.argmax(facets >= 0)])
                words = f"the contact reaches an end of the second body's contact boundary, beside {where}"
                return [f"{words}, and its surface goes on: name all that may touch"]
        return []

    def held_apart(self, closed: Flags) -> list[str]:
        """Returns a sentence where psi is held in the plane at closed corners, boolean array (corners, n), of
        which the nearest one alone presses.
        """
        apart = self._nodes.twins & (len(closed) > 1)
        for plane in self.surface.planes:
            apart &= np.abs(self._nodes.points[:, plane.axis] - plane.place) > self._rounding
        words = "supports hold psi below the second body: of a block its nearest corner counts alone"
        return [words] * bool(closed[:, apart].any())

    def unknowns_between(self, left: float, right: float) -> int:
        """Returns how many unknowns of a component of u lie on the boundary from x1 = left to right."""
        x = self._vertices()[:, 0]
        return self.body.order * int(np.count_nonzero((x >= left) & (x <= right)))

    def along(self, forces: Array, points: Array, lines: Array) -> Array:
        """Returns the displacement along lines where they meet the boundary, of points and unit directions,
        arrays (n, dim), under forces of the corners, (corners, n): array (n,), inf where they do not.
        """
        return self._displacement(forces, self._met(points, lines), lines)

    def lifted(self, forces: Array, places: Array) -> Array:
        """Returns the displacement along x2, or x3, at x1, or x1 and x2, array (n, axes), under forces of the
        corners, (corners, n): array (n,), inf beside the boundary.
        """
        hits = self.surface.above(places)
        return self._displacement(forces, hits, upwards(hits.signs))

    def _displacement(self, forces: Array, hits: Hits, along: Array) -> Array:
        rows = self._rows_along(self._traced(hits), hits.signs * along)
        return np.where(hits.facets >= 0, rows @ self.unknowns(forces), np.inf)

    def pressures(self, pressures: Array, points: Array, normals: Array) -> Array:
        """Returns the sum of nodal pressures of the corners, array (corners, n), that act at points of its
        boundary with outward normals, arrays (k, dim): array (k,).
        """
        lines = normals if self.is_shape else -upwards(points)
        total = np.zeros(len(points))
        images = [(points, lines)]
        for plane in self.surface.planes:
            mirror = SymmetryPlane(plane.axis, 0.0, 1)
            images += [(plane.mirrored(places), mirror.mirrored(along)) for places, along in images]
        first = MeshSurface(self._nodes.region)  # what lies beyond a plane is an image's
        for places, along in images:
            offsets = self._blocks.under(self.obstacle, places, -along).offsets_from_contact_point
            for offset, pressure in zip(offsets, pressures):
                hits = first.met(places - offset, along)
                total += self._nodes.values_on(hits.facets, hits.places) @ pressure
        return total

    @bounded
    def fields(self, forces: Array) -> BodyFields:
        """Returns the fields of the body under forces of the corners, array (corners, n)."""
        state = ng.GridFunction(self.body.space)
        right = np.zeros(self.body.space.ndof)
        right[self._bulk.contact] = self._shares[0].T @ forces.ravel()
        exerted = self._bulk.solve(right, state)
        return BodyFields(self.body, state.components, exerted)
