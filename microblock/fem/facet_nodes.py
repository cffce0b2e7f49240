"""The nodes of a boundary in one, two and three dimensions, and the rule whose points they are.

Gaps are checked, and multipliers live, at the Gauss-Lobatto points of segments and quadrilaterals, at the
vertices of triangles of order 1 and at the middles of the sides of triangles of order 2: at Gauss points
pressures would oscillate. Where the rule integrates the trace of a constant pressure exactly, as on these
facets, the contact passes the patch test: nodes at the vertices of triangles of order 2 would have no weight.
"""

from collections.abc import Iterator, Sequence
from functools import cache, cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..model.fields import squares
from ..model.obstacles import STEEPEST
from ..model.types import Array, Flags, Integers
from .facet_rules import ROUNDED, at_rules, between_vertices, nodal_rule, nodal_shapes, rule_at, shapes, units


class FacetNodes:
    """The nodes of a boundary, in the order of x1, in space in rows of x1.

    Parameters
    ----------
    region : ngsolve.Region, of the boundary
    space : scalar H1 space on its mesh, whose functions tell the nodes apart
    orders : list of int, of the facets

    Attributes
    ----------
    points, normals : arrays (n, 2), in space (n, 3); in 1D (0, x2) and e2
        Points (lengths) and outward unit normals, of a node of several facets their mean weighted by area;
        but see `_take_vectors`.
    weights : array (n,), lengths or areas (1 in 1D)
    facets : list of arrays, the nodes of each facet from end to end, of a quadrilateral row by row
    joined : array (n - 1,), in the plane the number of the facet that joins a node and the next, or -1
    interrupted : boolean array (n - 1,), whether none does
    shares : array (n,), areas by the rule
    """

    def __init__(self, region: Any, space: Any, orders: Sequence[int]) -> None:
        self.region = region
        self.mesh = region.mesh
        self.dim: int = region.mesh.dim
        self.orders = list(orders)
        self._space = space
        self.weights: Array
        self.normals: Array
        self.shares: Array
        self._place_nodes(list(region.Elements()))
        self.joined: Integers = np.full(len(self.points) - 1, -1)
        for number, nodes in enumerate(self.facets):
            self.joined[nodes.min() : nodes.max()] = number
        self.interrupted: Flags = self.joined < 0
        if self.dim == 3:
            self._take_areas()

    def scalar(self, order: int, **options: Any) -> Any:
        """Returns a scalar H1 space on the mesh."""
        return ng.H1(self.mesh, order=order, **options)

    @cached_property
    def _between_vertices(self) -> list[bool]:
        """Of each facet whether no node is a vertex."""
        return [between_vertices(facet.type, n) for facet, n in zip(self.region.Elements(), self.orders)]

    def _place_nodes(self, facets: Sequence[Any]) -> None:
        """Puts the nodes in order, with points, normals and weights from the rules of their facets."""
        members = self._merged(facets)
        numbers = np.concatenate(members)
        rules = [nodal_rule(facet.type, order) for facet, order in zip(facets, self.orders)]
        places, shares, outward = at_rules(self.mesh, facets, rules)
        if self.dim == 1:  # the only coordinate is x2
            places = np.pad(places, ((0, 0), (1, 0)))
            outward = np.pad(outward, ((0, 0), (1, 0)))
        points = np.full((numbers.max() + 1, places.shape[1]), np.inf)
        np.minimum.at(points, numbers, places)  # of a period its left end
        if self.dim == 3:
            points = self._snapped(points)
            order = _order_in_rows(points)
        else:
            order = _order_along_surface(points, members)
        self.points: Array = points[order]
        self.shares = np.asarray(np.bincount(numbers, shares)[order], float)
        rank = np.argsort(order)
        self.facets: list[Integers] = [rank[nodes] for nodes in members]
        self._take_vectors(rank[numbers], shares[:, None] * outward)

    def _merged(self, facets: Sequence[Any]) -> list[Integers]:
        """Returns the nodes of each facet, numbered as they come; nodes are one where the functions of the
        vertices have the same values.
        """
        numbers: dict[Any, int] = {}
        members = []
        for facet, (dofs, values) in zip(facets, self._shapes(self._space)):
            vertices = np.argsort(dofs[: len(facet.vertices)], kind="stable")
            keys = [tuple((dofs[i], round(row[i], 9)) for i in vertices if row[i]) for row in values]
            members.append(np.array([numbers.setdefault(key, len(numbers)) for key in keys]))
        return members

    def _take_areas(self) -> None:
        """Takes integrals of the nodal polynomials times n as areas and normals of the nodes in space: the
        rule fails the patch test on skew quadrilaterals.
        """
        facets = list(self.region.Elements())
        kinds = {facet.type for facet in facets}
        rules = {kind: ng.IntegrationRule(kind, 2 * max(self.orders) + 2) for kind in kinds}
        on_facets = [rules[facet.type] for facet in facets]
        values = cache(lambda kind, order: nodal_shapes(kind, order, rules[kind]))
        _, weights, normals = at_rules(self.mesh, facets, on_facets)
        parts = np.split(weights[:, None] * normals, np.cumsum([len(rule) for rule in on_facets])[:-1])
        elements = zip(facets, self.orders, parts)
        areas = np.concatenate([values(facet.type, order).T @ part for facet, order, part in elements])
        self._take_vectors(np.concatenate(self.facets), areas)

    def _take_vectors(self, numbers: Integers, areas: Array) -> None:
        """Takes weights and normals from the shares of facets in nodes, numbers (m,) and vectors along their
        normals, (m, dim).

        At an edge facets that no height can press, steeper than 60 degrees and as far from the most upward
        facet there, do not count. In space weights are lengths of sums of vectors: of a constant pressure the
        nodal forces are then those of weights and normals, whatever edges the surface has.
        """
        normals = units(areas)
        order = np.argsort(normals[:, -1])
        highest = np.empty((len(self.points), areas.shape[1]))
        highest[numbers[order]] = normals[order]  # the last one of a node stays
        counts = (normals[:, -1] > STEEPEST) | (np.sum(normals * highest[numbers], axis=1) > STEEPEST)
        vectors = np.zeros_like(highest)
        np.add.at(vectors, numbers[counts], areas[counts])
        self.weights = np.linalg.norm(vectors, axis=1)
        if self.dim < 3:
            lengths = np.linalg.norm(areas[counts], axis=1)
            self.weights = np.asarray(np.bincount(numbers[counts], lengths), float)
        self.normals = units(vectors)

    def _snapped(self, points: Array) -> Array:
        """Returns points, (n, 3), with coordinates of vertices: no rounding decides whether a node lies below
        a punch.
        """
        vertices = self.mesh.ngmesh.Coordinates()
        size = np.ptp(vertices, axis=0).max()
        snapped = np.empty_like(points)
        for axis in range(3):
            x = points[:, axis]
            ticks = np.unique(vertices[:, axis])
            nearest = ticks[np.searchsorted((ticks[1:] + ticks[:-1]) / 2, x)]
            snapped[:, axis] = np.where(np.abs(nearest - x) < ROUNDED * size, nearest, x)
        return snapped

    def _shapes(self, space: Any) -> Iterator[tuple[Any, Array]]:
        """Yields of each facet the unknowns of a space, and its functions at the nodes, array (nodes,
        unknowns): alike where the vertices are numbered in the same order.
        """
        values: dict[Any, Array] = {}
        for facet, order in zip(self.region.Elements(), self.orders):
            dofs = space.GetDofNrs(facet)
            kind = (facet.type, order, len(dofs), *np.argsort([vertex.nr for vertex in facet.vertices]))
            if kind not in values:
                values[kind] = shapes(space.GetFE(facet), nodal_rule(facet.type, order))
            yield dofs, values[kind]

    def trace(self, space: Any) -> Any:
        """Returns values at the nodes from the unknowns of a space, sparse (n, unknowns)."""
        rows: list[Any] = [()] * len(self.points)
        for nodes, (dofs, values) in zip(self.facets, self._shapes(space)):
            for node, row in zip(nodes, values):
                rows[node] = (dofs, row)
        trace = _sparse(rows, space.ndof)
        trace.eliminate_zeros()
        return trace

    def at_points(self, rules: Sequence[Any]) -> tuple[Array, Array, Array, Any]:
        """Returns at the points of rules, NGSolve's of each facet: places, (k, dim), weights, (k,), outward
        normals, (k, dim), and values from the nodes, sparse (k, n).
        """
        values = cache(nodal_shapes)
        facets = list(self.region.Elements())
        elements = zip(facets, self.facets, self.orders, rules)
        rows = [
            (nodes, row) for facet, nodes, order, rule in elements for row in values(facet.type, order, rule)
        ]
        places, weights, outward = at_rules(self.mesh, facets, rules)
        return places, weights, outward, _sparse(rows, len(self.points))

    def dual(self, rules: Sequence[Any], weights: Array, basis: Any) -> Any:
        """Returns at the points of rules, with what `at_points` returns of them, polynomials on each facet
        that are dual to those of the nodes, orthogonal to all but their own, with the same integrals: sparse
        (k, n).
        """
        ends = np.cumsum([0, *map(len, rules)])
        rows: list[Any] = []
        for first, last, nodes in zip(ends, ends[1:], self.facets):
            values = basis[first:last][:, nodes].toarray()
            weighted = values.T * weights[first:last]
            onto = np.linalg.solve(weighted @ values, np.diag(weighted.sum(axis=1)))
            rows += [(nodes, row) for row in values @ onto]
        return _sparse(rows, len(self.points))

    def values_on(self, facets: Integers, places: Array) -> Any:
        """Returns values from the nodes at reference coordinates, (k, axes), on facets, whose numbers are
        given, array (k,): sparse (k, n), 0 where a number is -1.
        """
        kinds = [facet.type for facet in self.region.Elements()]
        rows: list[Any] = [((), ())] * len(facets)
        for number in np.unique(facets[facets >= 0]):
            chosen = np.flatnonzero(facets == number)
            values = nodal_shapes(kinds[number], self.orders[number], rule_at(places[chosen]))
            for row, at_place in zip(chosen, values):
                rows[row] = (self.facets[number], at_place)
        return _sparse(rows, len(self.points))

    @cached_property
    def triangles(self) -> Integers:
        """Triangles between the nodes in space, array (m, 3), to draw on."""
        return np.concatenate([self._inside_facets, *self._around_vertices()])

    @property
    def _inside_facets(self) -> Integers:
        """The triangles between the nodes of facets, array (k, 3)."""
        between_nodes, triangles = self._parts
        halves = between_nodes[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return np.concatenate((halves, triangles))

    @cached_property
    def _parts(self) -> tuple[Integers, Integers]:
        """The nodes of squares between those of quadrilaterals, array (k, 4), and of triangles, (m, 3)."""
        size = self.orders[0] + 1
        place = np.arange(size * size).reshape(size, size)
        quadrilaterals = np.array([nodes for nodes in self.facets if len(nodes) > 3], int)
        triangles = np.array([nodes for nodes in self.facets if len(nodes) == 3], int)
        corners = quadrilaterals.reshape(-1, place.size)[:, squares(place.T)]
        return corners.reshape(-1, 4), triangles.reshape(-1, 3)

    @cached_property
    def neighbours(self) -> Any:
        """Whether two nodes in space are corners of one square or triangle between nodes, sparse boolean
        array (n, n).
        """
        rows = [np.repeat(part, part.shape[1], axis=1).ravel() for part in self._parts]
        columns = [np.tile(part, part.shape[1]).ravel() for part in self._parts]
        pairs = np.concatenate(rows), np.concatenate(columns)
        shape = (len(self.points), len(self.points))
        return csr_matrix((np.ones(len(pairs[0]), bool), pairs), shape=shape)

    def beside(self, flags: Flags) -> Flags:
        """Returns the nodes in space with a flag, boolean array (n,), and their neighbours."""
        return np.asarray(self.neighbours @ flags)

    def filling(self, flags: Flags) -> Flags:
        """Returns the nodes in space, boolean array (n,), of squares and triangles whose nodes all have a
        flag.
        """
        kept = np.zeros(len(flags), bool)
        for part in self._parts:
            kept[part[flags[part].all(axis=1)]] = True
        return kept

    def connected(self, flags: Flags) -> Integers:
        """Returns labels, from 1, of the pieces of nodes in space, boolean array (n,), that are connected by
        neighbours: array (n,), 0 of the others.
        """
        labels = np.zeros(len(flags), int)
        labels[flags] = 1 + connected_components(self.neighbours[flags][:, flags], directed=False)[1]
        return labels

    @cached_property
    def _beside_vertices(self) -> dict[int, list[Integers]]:
        """{number of a vertex that is no node: the nodes of each facet there, the opposite one first}."""
        beside: dict[int, list[Integers]] = {}
        for facet, nodes, between in zip(self.region.Elements(), self.facets, self._between_vertices):
            for number, vertex in enumerate(facet.vertices if between else ()):
                beside.setdefault(vertex.nr, []).append(np.roll(nodes, -number))
        return beside

    def _around_vertices(self) -> Iterator[Integers]:
        """Yields triangles, arrays (k, 3), that fill the surroundings of a vertex that is no node."""
        for facets in self._beside_vertices.values():
            sides = np.array([nodes[1:] for nodes in facets])
            nodes, times = np.unique(sides, return_counts=True)
            first = nodes[np.argmin(times)]  # an end, at the rim of the boundary
            others = sides[(sides != first).all(axis=1)]
            yield np.insert(others, 0, first, axis=1)

    @cached_property
    def continued(self) -> Any:
        """Values at the vertices that are no nodes, the mean of the linear continuations from the facets
        there, from those at the nodes: sparse (k, n).
        """
        rows = [
            (np.concatenate(facets), np.tile((-1.0, 1.0, 1.0), len(facets)) / len(facets))
            for facets in self._beside_vertices.values()
        ]
        return _sparse(rows, len(self.points))

    def unseen(self, space: Any) -> tuple[Integers, Any]:
        """Returns the unknowns of a space at the vertices that are no nodes, array (k,), and rows, sparse (k,
        unknowns): the values there less those that are `continued`.
        """
        vertices = [ng.NodeId(ng.VERTEX, number) for number in self._beside_vertices]
        unknowns = np.array([space.GetDofNrs(vertex)[0] for vertex in vertices], int)
        values = _sparse([([number], [1.0]) for number in unknowns], space.ndof)
        return unknowns, csr_matrix(values - self.continued @ self.trace(space))

    def interpolated(self, values: Array, x1: Array, x2: Array) -> Array:
        """Returns nodal values in space, array (m, n), at places, (k,), seen from above: array (m, k), linear
        on triangles, nan beyond.
        """
        vertices = [self.mesh.vertices[number].point for number in self._beside_vertices]
        points = np.vstack((self.points, np.reshape(vertices, (-1, 3))))
        beside = enumerate(self._beside_vertices.values(), len(self.points))
        at_vertices = [[(number, *nodes[1:]) for nodes in facets] for number, facets in beside]
        triangles = np.concatenate([self._inside_facets, *at_vertices])
        values = np.hstack((values, values @ self.continued.T))
        return linear_on(points, triangles, values, x1, x2)

    @cached_property
    def multipliers(self) -> Any:
        """The H1 space of one corner's multiplier, with as many unknowns as nodes."""
        space = self.scalar(self.orders[0], definedon=self.region)
        active = ng.BitArray(space.ndof)
        active.Clear()
        for dofs in self._own_unknowns(space):
            for dof in dofs:
                active[dof] = True
        return ng.Compress(space, active)

    def _own_unknowns(self, space: Any) -> list[Integers]:
        """Returns of each facet the unknowns of a space that belong to its nodes: of triangles whose nodes
        are no vertices those of the sides. The space is hierarchical: the first ones are of lower orders.
        """
        unknowns = []
        for facet, nodes, between in zip(self.region.Elements(), self.facets, self._between_vertices):
            first = len(facet.vertices) * between
            unknowns.append(np.array(space.GetDofNrs(facet)[first : first + len(nodes)], int))
        return unknowns

    @cached_property
    def _multiplier(self) -> tuple[Any, Any]:
        """Values at the nodes from unknowns of a multiplier, and factors of this matrix."""
        trace = self.trace(self.multipliers)
        return trace, splu(trace.tocsc())

    def multiplier(self, unknowns: Array) -> Array:
        """Returns a multiplier at the nodes, array (n,), from its unknowns."""
        return self._multiplier[0] @ unknowns

    def field(self, values: Array) -> Any:
        """Returns an expression with nodal values, array (n,), or (n, dim) of a vector."""
        if values.ndim == 1:
            function = ng.GridFunction(self.multipliers)
            function.vec.FV().NumPy()[:] = self._multiplier[1].solve(np.asarray(values, float))
            return function
        components = [self.field(part) if part.any() else ng.CF(0) for part in values.T]
        return ng.CF((*components, 0)[:3])

    @cached_property
    def rules(self) -> dict[Any, Any]:
        """{kind of a facet: NGSolve's rule}, whose points are the nodes."""
        return {facet.type: nodal_rule(facet.type, self.orders[0]) for facet in self.region.Elements()}

    def at_nodes(self, expression: Any) -> Array:
        """Returns the values of an expression at the nodes, array (n,), or (n, k) of a vector; of a
        discontinuous one those of the last facet.
        """
        points = self.mesh.MapToAllElements(self.rules, self.region)
        values = np.asarray(expression(points)).reshape(len(points), -1)
        nodal = np.zeros((len(self.points), values.shape[1]))
        nodal[np.concatenate(self.facets)] = values
        return nodal if expression.dim > 1 else nodal[:, 0]

    def integral(self, density: Any) -> Any:
        """Returns the integral over the contact boundary by these rules, with `weights`."""
        ratio = self.weights / self.shares
        if np.abs(ratio - 1).max() > ROUNDED:
            density = density * self.field(ratio)
        return density * ng.ds(definedon=self.region, intrules=self.rules)


def linear_on(points: Array, triangles: Integers, values: Array, x1: Array, x2: Array) -> Array:
    """Returns values at points in space, arrays (m, n) and (n, 3), at places, (k,), seen from above: array
    (m, k), linear on triangles, (t, 3), nan beyond.
    """
    from matplotlib.tri import LinearTriInterpolator, Triangulation  # here: it takes its time

    interpolated = np.full((len(values), *np.shape(x1)), np.nan)
    for piece in _pieces_from_above(points, triangles):  # at a step points lie one above the other
        surface = Triangulation(points[:, 0], points[:, 1], piece)
        on_piece = [LinearTriInterpolator(surface, each)(x1, x2).filled(np.nan) for each in values]
        interpolated = np.where(np.isnan(on_piece), interpolated, on_piece)
    return interpolated


def _pieces_from_above(points: Array, triangles: Integers) -> list[Integers]:
    """Returns triangles, array (m, 3), that an obstacle may meet, by connected pieces of the surface: arrays
    (k, 3).
    """
    first, second, third = np.moveaxis(points[triangles], 1, 0)
    normals = np.cross(second - first, third - first)
    steep = np.abs(normals[:, 2]) <= STEEPEST * np.linalg.norm(normals, axis=1)
    met = triangles[~steep]
    ends = np.concatenate((met[:, :2], met[:, 1:])).T
    links = csr_matrix((np.ones(len(ends[0])), ends), shape=2 * [len(points)])
    pieces = connected_components(links, directed=False)[1][met[:, 0]]
    return [met[pieces == piece] for piece in np.unique(pieces)]


def _order_in_rows(points: Array) -> Integers:
    """Returns the order of points, (n, 3), in rows of x1 one after the other, array (n,)."""
    return np.lexsort(np.round(points / (ROUNDED * np.ptp(points, axis=0).max())).T)


def _order_along_surface(points: Array, members: Sequence[Integers]) -> Integers:
    """Returns the order of points, (n, 2), by x1, then x2, and at a crack by the middle of their facets,
    whose nodes are `members`: array (n,).

    A vertical side begins where the surface comes from the left, or ends where it goes on to the right.
    """
    x, level = points.T.copy()
    along = np.zeros(len(points))
    middles = np.zeros(len(points))
    widths = np.array([np.ptp(x[nodes]) for nodes in members])
    heights = np.array([np.ptp(level[nodes]) for nodes in members])
    vertical = (widths < ROUNDED * np.ptp(x)) & (heights > widths)  # others are short: beside edges of zones
    sides = _joined([nodes for nodes, upright in zip(members, vertical) if upright], len(points))
    for side in sides:
        x[side] = x[side].min()
        level[side] = points[side, 1].min()
        along[side] = points[side, 1]
    for nodes, upright in zip(members, vertical):
        middles[nodes] += points[nodes, 0].mean()
        for side in () if upright else sides:
            for node in np.intersect1d(nodes, side):
                goes_on = points[nodes, 0].mean() > x[node]
                along[side] = np.abs(points[side, 1] - points[node, 1]) * (-1 if goes_on else 1)
    return np.lexsort((middles, along, level, x))


def _joined(members: Sequence[Integers], count: int) -> list[Integers]:
    """Returns the nodes of facets that hang together, of so many nodes."""
    links = [(nodes[0], node) for nodes in members for node in nodes]
    rows, columns = np.reshape(links, (-1, 2)).T.astype(int)
    labels = connected_components(csr_matrix((np.ones(len(rows)), (rows, columns)), (count, count)))[1]
    return [np.flatnonzero(labels == label) for label in np.unique(labels[rows])]


def _sparse(rows: Sequence[Any], width: int) -> Any:
    """Returns the sparse matrix, (rows, width), of rows (columns, values), those below 0 left out."""
    if not rows:
        return csr_matrix((0, width))
    i = np.repeat(np.arange(len(rows)), [len(columns) for columns, _ in rows])
    j = np.concatenate([columns for columns, _ in rows])
    values = np.concatenate([row for _, row in rows])
    there = j >= 0
    return csr_matrix((values[there], (i[there], j[there])), shape=(len(rows), width))
