"""The nodes of a contact boundary in one, two and three dimensions.

Gaps are checked, and multipliers live, at the Gauss-Lobatto points of each facet, of triangles of order 1 at
the vertices: at Gauss points pressures would oscillate.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.sparse import csr_matrix, diags, vstack
from scipy.sparse.linalg import splu

from ..errors import require, require_kind
from ..model.fields import squares
from ..model.types import Array, Flags, Integers
from . import supports
from .body import Body
from .body_spaces import COMPONENTS
from .facet_polynomials import FacetPolynomials
from .facet_rules import ROUNDED, TRIANGLE, at_rules, nodal_rule, nodal_shapes, rule_at, shapes
from .meshes import elements_at


class ContactNodes:
    """The nodes of the contact boundary of a body, in the order of x1, in space in rows of x1.

    Facets have the lower one of the orders of u and psi.

    Parameters
    ----------
    body : Body, of any orders and dimension

    Attributes
    ----------
    points, normals : arrays (n, 2), in space (n, 3); in 1D (0, x2) and e2
    weights : array (n,), lengths or areas (1 in 1D)
    facets : list of arrays, the nodes of each facet from end to end, of a quadrilateral row by row
    orders : list of int, of the facets
    joined : array (n - 1,), in the plane the number of the facet that joins a node and the next, or -1
    apart : boolean array (n - 1,), whether none does
    traces : {field: sparse array (n, unknowns)}, its values at the nodes from all unknowns
    shares : array (n,), areas by the rule
    twins : boolean array (n,), nodes whose corners move together

    Raises
    ------
    BadArgument
        If supports hold what an obstacle presses; in space for other facets than those of `Body`.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> from microblock.fem.contact_nodes import ContactNodes
    >>> x = np.linspace(0, 1, 3)
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> nodes = ContactNodes(mb.Body(meshes3d.block(x, x, x - 1), solid, order=2, fixed="bottom"))
    >>> len(nodes.points), round(float(nodes.weights.sum()), 12)
    (25, 1.0)
    """

    def __init__(self, body: Body) -> None:
        require_kind(Body, "a Body", body=body)
        self.body = body
        self.dim: int = body.mesh.dim
        self.region = supports.pressed(body)
        self.weights: Array
        self.shares: Array
        self._made_of: tuple[Any, ...] = (body,)
        facets = list(self.region.Elements())
        if self.dim > 1:
            elements_at(body.mesh, self.region)  # which checks that there are some
        if self.dim == 3:
            self._require_upwards(facets)
        self.orders = [min(body.order, body.order_psi or body.order)] * len(facets)
        if body.element_orders is not None:
            self.orders = [len(body.spaces[0].GetDofNrs(facet)) - 1 for facet in facets]
        self._place_nodes(facets)
        self._trace_fields()
        self.joined: Integers = np.full(len(self.points) - 1, -1)
        for number, nodes in enumerate(self.facets):
            self.joined[nodes.min() : nodes.max()] = number
        self.apart: Flags = self.joined < 0
        self.twins: Flags = np.zeros(len(self.points), bool)
        if self.dim == 3:
            self.weights = self._areas()
            require(
                self.free["u3"].any(),
                "contact",
                body.contact,
                f"is constrained in u3 by the supports on {body.fixed.get('u3')}: an obstacle cannot press "
                "what cannot move",
            )

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew."""
        return type(self), self._made_of

    def _require_upwards(self, facets: Sequence[Any]) -> None:
        words = "must be the order of u on a body in space that is pressed"
        require(self.body.order_psi in (0, self.body.order), "order_psi", self.body.order_psi, words)
        require(
            self.body.order == 1 or all(facet.type != ng.ET.TRIG for facet in facets),
            "order",
            self.body.order,
            "must be 1 where triangles are in contact: of higher orders they have no nodal rule with "
            "positive weights; take hexahedra, or prisms with quadrilaterals on top",
        )
        normals = at_rules(self.body.mesh, facets, [rule_at(TRIANGLE)] * len(facets))[2]
        require(
            normals[:, 2].min() > 1 - 1e-9,
            "contact",
            self.body.contact,
            "must be horizontal and face upwards, its normal e3",
        )

    def _place_nodes(self, facets: Sequence[Any]) -> None:
        """Puts the nodes in order, with points, normals and weights from the rules of their facets."""
        members = self._merged(facets)
        numbers = np.concatenate(members)
        rules = [nodal_rule(facet.type, order) for facet, order in zip(facets, self.orders)]
        places, shares, outward = at_rules(self.body.mesh, facets, rules)
        if self.dim == 1:  # the only coordinate is x2
            places = np.pad(places, ((0, 0), (1, 0)))
            outward = np.pad(outward, ((0, 0), (1, 0)))
        points = np.full((numbers.max() + 1, places.shape[1]), np.inf)
        np.minimum.at(points, numbers, places)  # of a period its left end
        normals = np.zeros_like(points)
        np.add.at(normals, numbers, shares[:, None] * outward)
        if self.dim == 3:
            points = self._snapped(points)
            order = _order_in_rows(points)
        else:
            order = _order_along_surface(points, members)
        self.points: Array = points[order]
        self.normals: Array = normals[order] / np.linalg.norm(normals[order], axis=1)[:, None]
        self.shares = np.asarray(np.bincount(numbers, shares)[order], float)
        self.weights = self.shares
        rank = np.argsort(order)
        self.facets: list[Integers] = [rank[nodes] for nodes in members]

    def _merged(self, facets: Sequence[Any]) -> list[Integers]:
        """Returns the nodes of each facet, numbered as they come; nodes are one where the functions of the
        vertices have the same values.
        """
        numbers: dict[Any, int] = {}
        members = []
        for facet, (dofs, values) in zip(facets, self._shapes(self.body.spaces[0])):
            vertices = np.argsort(dofs[: len(facet.vertices)], kind="stable")
            keys = [tuple((dofs[i], round(row[i], 9)) for i in vertices if row[i]) for row in values]
            members.append(np.array([numbers.setdefault(key, len(numbers)) for key in keys]))
        return members

    def _trace_fields(self) -> None:
        """Fills `traces`."""
        body = self.body
        displacement = self._trace(body.spaces[0])
        rotation = self._trace(body.spaces[-1])
        shape = (len(self.points), body.space.ndof)
        self.traces: dict[str, Any] = {name: csr_matrix(shape) for name in body.all_names}
        for name in body.names:
            trace = displacement if name[0] == "u" else rotation
            columns = trace.indices + body.unknowns_of(name).start
            self.traces[name] = csr_matrix((trace.data, columns, trace.indptr), shape=shape)

    def _areas(self) -> Array:
        """Returns integrals of the nodal polynomials, array (n,): the rule fails the patch test on skew
        quadrilaterals.
        """
        integral = self.multipliers.TestFunction() * ng.ds(definedon=self.region, bonus_intorder=2)
        values = ng.LinearForm(integral).Assemble().vec.FV().NumPy()
        return self._multiplier[1].solve(values, trans="T")

    def _snapped(self, points: Array) -> Array:
        """Returns points, (n, 3), with coordinates of vertices: no rounding decides whether a node lies below
        a punch.
        """
        vertices = self.body.mesh.ngmesh.Coordinates()
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

    def _trace(self, space: Any) -> Any:
        """Returns values at the nodes from the unknowns of a space, sparse (n, unknowns)."""
        rows: list[Any] = [()] * len(self.points)
        for nodes, (dofs, values) in zip(self.facets, self._shapes(space)):
            for node, row in zip(nodes, values):
                rows[node] = (dofs, row)
        trace = _sparse(rows, space.ndof)
        trace.eliminate_zeros()
        return trace

    def free_of(self, body: Body) -> dict[str, Flags]:
        """Returns {field: whether a body on this mesh does not hold it at a node, boolean array (n,)}."""
        free = np.array(body.space.FreeDofs())
        return {name: abs(self.traces[name]) @ free > 0 for name in body.all_names}

    @cached_property
    def free(self) -> dict[str, Flags]:
        """{field: whether supports leave it free at a node, boolean array (n,)}."""
        return self.free_of(self.body)

    def motion(self, directions: Array, arms: Array) -> Any:
        """Returns the displacement u + psi x arm along directions, of arrays (n, dim): sparse (n,
        unknowns).
        """
        pad = ((0, 0), (0, 3 - directions.shape[1]))
        along = np.pad(directions, pad)
        factors = np.hstack((along, np.cross(np.pad(arms, pad), along))).T
        rows = csr_matrix((len(along), self.body.space.ndof))
        for name in self.body.names:
            factor = factors[COMPONENTS[name]]
            if np.abs(factor).max() > ROUNDED:
                rows = rows + diags(factor) @ self.traces[name]
        return rows

    @cached_property
    def onto(self) -> Any:
        """R: (u.n, psi) at the nodes from all unknowns, in space (u, phi1, phi2), u into the body and phi =
        (-psi2, psi1) ell/2; sparse (2 n or 3 n, unknowns).
        """
        if self.dim < 3:
            return vstack((self.motion(self.normals, 0 * self.normals), self.traces["psi"]), format="csr")
        half = self.body.solid.ell / 2
        rows = (-self.traces["u3"], -half * self.traces["psi2"], half * self.traces["psi1"])
        return vstack(rows, format="csr")

    def moments_of(self, name: str, exerted: Array) -> Array:
        """Returns nodal moments, array (n,), that do the work of what is exerted, (unknowns,), on a psi."""
        space = self.body.spaces[-1]  # hierarchical: the first unknowns are those of the lower orders
        elements = zip(self.region.Elements(), self.facets)
        dofs = [space.GetDofNrs(facet)[: nodes.size] for facet, nodes in elements]
        used = np.unique(np.concatenate(dofs)) + self.body.unknowns_of(name).start
        return splu(self.traces[name][:, used].T.tocsc()).solve(exerted[used])

    @cached_property
    def along(self) -> FacetPolynomials:
        """All facets in the plane from left to right."""
        return self.polynomials(-np.inf)

    def polynomials(self, steepest: float) -> FacetPolynomials:
        """Returns the facets in the plane with n2 above `steepest`."""
        return FacetPolynomials(self.points, self.normals, self.facets, self.body.solid, steepest)

    @cached_property
    def vertices_beside(self) -> Integers:
        """Vertices in space of facets beside the contact that face upwards, array (k,)."""
        beside = list((~self.region).Elements())
        normals = at_rules(self.body.mesh, beside, [rule_at([(1 / 3, 1 / 3)])] * len(beside))[2]
        upper = {v.nr for facet, n in zip(beside, normals) if n[2] > 0.5 for v in facet.vertices}
        pressed = {v.nr for facet in self.region.Elements() for v in facet.vertices}
        return np.array(sorted(upper - pressed), int)

    def at_points(self, rules: Mapping[Any, Any]) -> tuple[Array, Array, Any]:
        """Returns at the points of rules, {kind of a facet: NGSolve's}: places, (k, dim), weights, (k,), and
        values from the nodes, sparse (k, n).
        """
        values = cache(lambda kind, order: nodal_shapes(kind, order, rules[kind]))
        facets = list(self.region.Elements())
        elements = zip(facets, self.facets, self.orders)
        rows = [(nodes, row) for facet, nodes, order in elements for row in values(facet.type, order)]
        places, weights, _ = at_rules(self.body.mesh, facets, [rules[facet.type] for facet in facets])
        return places, weights, _sparse(rows, len(self.points))

    @cached_property
    def triangles(self) -> Integers:
        """Triangles between the nodes in space, array (m, 3), to draw on."""
        size = self.orders[0] + 1
        place = np.arange(size * size).reshape(size, size)
        cut = squares(place.T)[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return np.concatenate([nodes[cut] if len(nodes) > 3 else nodes[None] for nodes in self.facets])

    def interpolated(self, values: Array, x1: Array, x2: Array) -> Array:
        """Returns nodal values in space, array (m, n), at places, (k,): array (m, k), linear on triangles,
        nan beyond.
        """
        from matplotlib.tri import LinearTriInterpolator, Triangulation  # here: it takes its time

        points = self.points
        interpolated = np.full((len(values), *np.shape(x1)), np.nan)
        levels = np.rint(points[self.triangles[:, 0], 2] / (ROUNDED * np.ptp(points)))
        for level in np.unique(levels):  # at a step nodes lie one above the other
            surface = Triangulation(points[:, 0], points[:, 1], self.triangles[levels == level])
            on_level = [LinearTriInterpolator(surface, nodal)(x1, x2).filled(np.nan) for nodal in values]
            interpolated = np.where(np.isnan(on_level), interpolated, on_level)
        return interpolated

    @cached_property
    def multipliers(self) -> Any:
        """The H1 space of one corner's multiplier."""
        return ng.Compress(self.body.scalar(self.orders[0], definedon=self.region))

    @cached_property
    def _multiplier(self) -> tuple[Any, Any]:
        """Values at the nodes from unknowns of a multiplier, and factors of this matrix."""
        trace = self._trace(self.multipliers)
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

    def extended(self, values: Array) -> Any:
        """Returns a function in the body with nodal values, array (n,), at the boundary: NGSolve finds
        elements at places, and facets not.
        """
        function = ng.GridFunction(self.body.scalar(self.orders[0]))
        dofs = [function.space.GetDofNrs(facet) for facet in self.region.Elements()]
        used = np.unique(np.concatenate(dofs))  # in the order of `multipliers`
        function.vec.FV().NumPy()[used] = self.field(values).vec.FV().NumPy()
        return function

    @cached_property
    def rules(self) -> dict[Any, Any]:
        """{kind of a facet: NGSolve's rule}, whose points are the nodes."""
        return {facet.type: nodal_rule(facet.type, self.orders[0]) for facet in self.region.Elements()}

    def integral(self, density: Any) -> Any:
        """Returns the integral over the contact boundary by these rules; in space with `weights`."""
        if self.dim == 3:
            density = density * self.field(self.weights / self.shares)
        return density * ng.ds(definedon=self.region, intrules=self.rules)


def _order_in_rows(points: Array) -> Integers:
    """Returns the order of points, (n, 3), in rows of x1 one after the other, array (n,)."""
    return np.lexsort(np.round(points / (ROUNDED * np.ptp(points, axis=0).max())).T)


def _order_along_surface(points: Array, members: Sequence[Integers]) -> Integers:
    """Returns the order of points, (n, 2), by x1, x2, and at a crack by the middle of their facets, whose
    nodes are `members`: array (n,).
    """
    middles = np.zeros(len(points))
    for nodes in members:
        middles[nodes] += points[nodes, 0].mean()
    return np.lexsort((middles, *points.T[::-1]))


def _sparse(rows: Sequence[Any], width: int) -> Any:
    """Returns the sparse matrix, (rows, width), of rows (columns, values)."""
    i = np.repeat(np.arange(len(rows)), [len(columns) for columns, _ in rows])
    j = np.concatenate([columns for columns, _ in rows])
    values = np.concatenate([row for _, row in rows])
    return csr_matrix((values, (i, j)), shape=(len(rows), width))
