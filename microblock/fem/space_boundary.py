"""What errors on a contact boundary in space are made of, beside those of gradients."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.spatial import cKDTree

from ..model.intervals import distance_to_edges
from ..model.law import side_directions
from ..model.types import Array, Flags, Integers
from .facet_rules import rule_at
from .mesh_cuts import cut, with_rows_halved

CELLS_IN_ROW = 512  # in a row, of which the distance from the edges of an obstacle is known


class SpaceBoundary:
    """The contact boundary of a SurfaceNodes.

    Attributes
    ----------
    most_unknowns, soon, fall : as of `PlaneBoundary`
    """

    soon = 15_000
    fall = 2  # of 20, with which the facets about the edge of a contact are cut as well, twice the unknowns

    def __init__(self, solution: Any) -> None:
        self.solution = solution
        self.nodes = solution.nodes
        self._solver = solution.solver

    @property
    def most_unknowns(self) -> int:
        return int(self._solver.most_unknowns)

    def safety(self, order: int) -> float:
        """Returns the factor of the estimate of a body of this order: without it errors of 0.86 times the
        estimate were seen for order 1, and for order 2 of 0.86 times with 40 nodes in contact and more, of
        1.2 times with 8.
        """
        return {1: 1.5, 2: 1.0}.get(order, 1.2)

    def with_edges(self, differences: Array, edges: Array) -> Array:
        """Returns squares of errors, (rows, elements), from those of averaged tractions and of free edges. On
        elements of order 2 averages see the shift of an edge, which is half of `edges` or less.
        """
        if self.nodes.body.order == 2:
            return np.maximum(differences, edges / 2)
        return differences + edges

    @property
    def nodal(self) -> Array:
        """p, M1/ell and M2/ell at the nodes, with friction also q1/f and q2/f: array (3, n), or (5, n)."""
        solution = self.solution
        rows = [solution.pressures.sum(axis=0), solution.micromoment / self._solver.solid.ell]
        if self._solver.law.friction:
            rows.append(solution.shear_traction / self._solver.law.friction)
        return np.vstack(rows)

    @cached_property
    def _closed(self) -> Flags:
        """Closed corners, array (corners, n)."""
        flags: Flags = self.solution.pressures > 0
        return flags | (len(flags) == self.solution.closed)

    @cached_property
    def _faced(self) -> Flags:
        """Whether the obstacle lies over a corner at a node, array (corners, n)."""
        return np.isfinite(self._solver.at_nodes.initial_gaps)

    @cached_property
    def is_singular(self) -> bool:
        """Whether the obstacle ends over the boundary, so that pressures have no bound."""
        return not np.isfinite(self._solver.low_places[2]).all()

    @cached_property
    def _to_edges(self) -> Array:
        """Distance to the edges of the obstacle over its half width, array (CELLS_IN_ROW, CELLS_IN_ROW)."""
        low, side = self._square
        rows = (np.arange(CELLS_IN_ROW) + 0.5) / CELLS_IN_ROW * side
        places = np.meshgrid(low[0] + rows, low[1] + rows, indexing="ij")
        solver = self._solver
        gaps = solver.blocks.initial_gaps_over_surface(solver.obstacle, *places)
        return distance_to_edges(np.isfinite(gaps))

    @property
    def _square(self) -> tuple[Array, float]:
        """Lowest x1 and x2 of the boundary, and its longer side."""
        places = self.nodes.points[:, :2]
        return places.min(axis=0), float(np.ptp(places, axis=0).max())

    def norm_weights(self, places: Array) -> Array:
        """Returns the weights of the norm at places, (k, 3), those of a half-space: array (k,)."""
        if not self.is_singular:
            return np.ones(len(places))
        low, side = self._square
        i, j = np.clip((places[:, :2] - low) / side * CELLS_IN_ROW, 0, CELLS_IN_ROW - 1).astype(int).T
        return self._to_edges[i, j] ** 2

    def along_sides(self, couple: Array, normals: Array) -> Array:
        """Returns the components of couples, array (3, k), about the sides of blocks on a surface with
        normals, (3, k): array (2, k).
        """
        return np.einsum("skd,dk->sk", side_directions(normals.T), couple)

    def beyond_ends(self, places: Array, normals: Array, pressures: Array) -> Array:
        """Returns squares of p and, at most, M/ell, (2, k), at places, (k, 3), that no obstacle lies over,
        from pressures of the corners, (corners, k).
        """
        if not self.is_singular:
            return np.zeros((2, len(places)))
        blocks = self._solver.blocks.under(self._solver.obstacle, places, normals.T)
        over = np.isfinite(blocks.initial_gaps)
        squares = np.where(over, 0.0, pressures**2).sum(axis=0)
        return np.array((squares, squares))

    @property
    def singular(self) -> Flags:
        """Facets at the edges of the obstacle, and those beside them, array (facets,)."""
        faced = self._faced
        at_edges = np.zeros(faced.shape[1], bool)
        for nodes in self.nodes.facets:
            if np.any(faced[:, nodes].any(axis=1) != faced[:, nodes].all(axis=1)):
                at_edges[nodes] = True
        return np.array([at_edges[nodes].any() for nodes in self.nodes.facets])

    def edges(self) -> tuple[Integers, Array]:
        """Returns numbers of the facets with a free edge, and squares of what its shift changes p, arrays
        (k,): those of the plane times the length of the edge.
        """
        parts = list(self._shifted_edges())
        numbers = np.array([number for number, _ in parts], int)
        return numbers, np.array([square for _, square in parts])

    def _shifted_edges(self) -> Iterator[tuple[int, float]]:
        """Yields what `edges` returns, of each corner."""
        nodes = self.nodes
        middles = nodes.points[[members[0] for members in nodes.facets]]
        weights = self.norm_weights(middles)
        counts = np.sqrt(np.count_nonzero(self._closed, axis=1))  # across the contact
        factors = (0.5 + 0.25 * np.log(counts + 1)) / 12
        slopes = self._steepest
        for number, members in enumerate(nodes.facets):
            for corner, closed in enumerate(self._closed[:, members]):
                inside = members[closed]
                outside = members[~closed & self._faced[corner, members]]
                if not len(inside) or not len(outside):
                    continue
                apart = np.linalg.norm(nodes.points[inside][:, None] - nodes.points[outside], axis=2)
                spacing = apart.min()
                # with nodes in the middles of sides half of the facets that an edge crosses have it between
                longest = np.sqrt(self._areas[number]) * (1.5 if len(members) == 3 else 1.0)
                length = min(self._areas[number] / spacing, longest)
                square = slopes[corner, members].max() * spacing**2 * length * factors[corner]
                yield number, weights[number] * square

    @cached_property
    def _areas(self) -> Array:
        """Areas of the facets, array (facets,)."""
        kinds = {ng.TRIG: 1 / 2, ng.QUAD: 1.0}  # areas of the reference facets
        middle = {kind: rule_at([(1 / 3, 1 / 3)], [area]) for kind, area in kinds.items()}
        rules = [middle[facet.type] for facet in self.nodes.region.Elements()]
        return np.asarray(self.nodes.at_points(rules)[1], float)

    @cached_property
    def _steepest(self) -> Array:
        """Largest slope of p^2 between a node and another one of a facet, K^2 at an edge, array (corners,
        n).
        """
        nodes = self.nodes
        squares = self.solution.pressures**2
        slopes = np.zeros(squares.shape)
        for members in nodes.facets:
            apart = np.linalg.norm(nodes.points[members][:, None] - nodes.points[members], axis=2)
            np.fill_diagonal(apart, np.inf)
            p = squares[:, members]
            steepest = (np.abs(p[:, :, None] - p[:, None]) / apart).max(axis=2)
            slopes[:, members] = np.maximum(slopes[:, members], steepest)
        return slopes

    def missed(self) -> Array:
        """Returns squares of pressures that the nodes miss, or a penalty leaves out, array (facets,): a depth
        d is worth E* d in L2, whatever its width.
        """
        nodes = self.nodes
        touched = self._with_any(np.asarray(self._closed.any(axis=0)))
        at_touched = np.zeros(len(nodes.points), bool)
        for number in np.flatnonzero(touched):
            at_touched[nodes.facets[number]] = True
        away = ~self._with_any(at_touched)  # beside the contact `edges` has it
        depths = np.zeros(len(touched))
        facets = self._facets_at(self._solver.low_places)
        for overlap in self.solution.overlaps:
            np.maximum.at(depths, facets, np.where(away[facets], overlap, 0.0))
        depths[touched] = self._roughness(facets)[touched]
        if self._solver.penalizes:
            overlap = self.solution.overlap_of_nodes
            depths += [np.ptp(overlap[members]) for members in nodes.facets]
        return (self._solver.solid.E_star * depths) ** 2

    def _with_any(self, flags: Flags) -> Flags:
        """Returns the facets with a node of these, array (n,): array (facets,)."""
        return np.array([flags[members].any() for members in self.nodes.facets])

    def _facets_at(self, places: Array) -> Integers:
        """Returns the numbers of the facets whose middles are nearest to places, array (3, k): array (k,)."""
        nodes = self.nodes
        middles = np.array([nodes.points[members, :2].mean(axis=0) for members in nodes.facets])
        return np.asarray(cKDTree(middles).query(places[:2].T)[1])

    def _roughness(self, facets: Integers) -> Array:
        """Returns how far low places of the obstacle over each facet, whose numbers are given, array (k,),
        are off a quadratic polynomial, array (facets,): what is smoother, elements follow.
        """
        places = self._solver.low_places
        finite = np.isfinite(places[2])
        x1, x2, height = places[:, finite]
        facets = facets[finite]
        order = np.argsort(facets, kind="stable")
        starts = np.searchsorted(facets[order], np.arange(len(self.nodes.facets) + 1))
        depths = np.zeros(len(self.nodes.facets))
        for number in np.flatnonzero(np.diff(starts) > 6):
            chosen = order[starts[number] : starts[number + 1]]
            x, y = (axis[chosen] - axis[chosen].mean() for axis in (x1, x2))
            scale = np.sqrt(self._areas[number])
            terms = np.polynomial.polynomial.polyvander2d(x / scale, y / scale, (2, 2))[:, [0, 1, 2, 3, 4, 6]]
            fit = np.linalg.lstsq(terms, height[chosen], rcond=None)[0]
            depths[number] = np.abs(height[chosen] - terms @ fit).max(initial=0.0)
        return depths

    def of_simplices(self) -> Any:
        """Returns None: the mesh has no elements but tetrahedra."""
        return None

    def finer(self, chosen: Flags) -> Any:
        """Returns the mesh with the chosen elements cut, boxes of a grid in whole rows."""
        mesh = self.nodes.body.mesh
        lines = self._solver.grid_lines
        if lines is not None:
            return with_rows_halved(mesh, lines, chosen)
        finer = ng.Mesh(mesh.ngmesh.Copy())
        cut(finer, chosen)
        return finer.Curve(mesh.GetCurveOrder())
