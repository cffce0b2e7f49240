"""The nodes of the contact boundary of a body, and the values of its fields there."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack
from scipy.sparse.linalg import splu

from ..errors import require, require_kind
from ..model.law import side_directions
from ..model.obstacles import STEEPEST
from ..model.types import Array, Flags, Integers
from . import supports
from .body import Body
from .body_spaces import COMPONENTS, FIELDS3D, free_unknowns
from .facet_nodes import FacetNodes
from .facet_polynomials import FacetPolynomials
from .facet_rules import ROUNDED, at_rules, require_nodal_rule, rule_at, units
from .meshes import elements_beside

LEAST_FREE = 0.1  # part of n: where less of it is free forces would be a hundred times those beside them


class ContactNodes(FacetNodes):
    """The `FacetNodes` of the contact boundary of a body, whose facets have the lower one of the orders of u
    and psi.

    Parameters
    ----------
    body : Body, of any orders and dimension

    Attributes
    ----------
    traces : {field: sparse array (n, unknowns)}, its values at the nodes from all unknowns
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
        self._made_of: tuple[Any, ...] = (body,)
        region = supports.pressed(body)
        facets = list(region.Elements())
        if body.mesh.dim > 1:
            alone = all(len(beside) == 1 for beside in elements_beside(body.mesh, region))
            require(alone, "contact", body.contact, "must have the body on one side, not on both or none")
        if body.in_space:
            self._require_nodal_rule(facets)
        orders = [self._facet_order()] * len(facets)
        if body.element_orders is not None:
            orders = [len(body.spaces[0].GetDofNrs(facet)) - 1 for facet in facets]
        super().__init__(region, body.spaces[0], orders)
        self._trace_fields()
        self.twins: Flags = np.zeros(len(self.points), bool)
        if body.in_space:
            self.require_upwards()
            require(
                self.moves.any(),
                "contact",
                body.contact,
                f"is constrained in u3 by the supports on {body.fixed.get('u3')}: an obstacle cannot press "
                "what cannot move",
            )

    def scalar(self, order: int, **options: Any) -> Any:
        return self.body.scalar(order, **options)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is made anew."""
        return type(self), self._made_of

    def require_upwards(self) -> None:
        """Raises BadArgument where the contact boundary is too steep for any obstacle."""
        upwards = min(self.normals[:, -1].max(), 1.0)  # which rounding exceeds
        tilt = np.degrees(np.arccos(upwards))
        words = f"must face upwards: it is tilted by {tilt:.0f} degrees, and from 60 on no surface can touch"
        require(upwards > STEEPEST, "contact", self.body.contact, words)

    def _facet_order(self) -> int:
        """Returns the lower one of the orders of u and psi; raises BadArgument in the plane where the rule of
        such nodes does not integrate u: an even pressure would not pass.
        """
        body = self.body
        order = min(body.order, body.order_psi or body.order)
        least = (body.order + 2) // 2  # the rule is exact up to twice the order less one
        words = f"must be at least {least} on a body whose u has order {body.order} and is pressed"
        require(body.mesh.dim != 2 or order >= least, "order_psi", body.order_psi, words)
        return order

    def _require_nodal_rule(self, facets: Sequence[Any]) -> None:
        words = "must be the order of u on a body in space that is pressed"
        require(self.body.order_psi in (0, self.body.order), "order_psi", self.body.order_psi, words)
        require_nodal_rule(facets, self.body.order)
        kinds = {facet.type for facet in facets}
        words = "must be 1 where triangles and quadrilaterals are in contact: of order 2 they share no nodes"
        require(self.body.order == 1 or len(kinds) == 1, "order", self.body.order, words)

    def _trace_fields(self) -> None:
        """Fills `traces`."""
        body = self.body
        displacement = self.trace(body.spaces[0])
        rotation = self.trace(body.spaces[-1])
        shape = (len(self.points), body.space.ndof)
        self.traces: dict[str, Any] = {name: csr_matrix(shape) for name in body.all_names}
        for name in body.names:
            trace = displacement if name[0] == "u" else rotation
            columns = trace.indices + body.unknowns_of(name).start
            self.traces[name] = csr_matrix((trace.data, columns, trace.indptr), shape=shape)

    def free_of(self, body: Body) -> dict[str, Flags]:
        """Returns {field: whether a body on this mesh does not hold it at a node, boolean array (n,)}."""
        free = free_unknowns(body.space)
        return {name: abs(self.traces[name]) @ free > 0 for name in body.all_names}

    @cached_property
    def free(self) -> dict[str, Flags]:
        """{field: whether supports leave it free at a node, boolean array (n,)}."""
        return self.free_of(self.body)

    @cached_property
    def moves(self) -> Flags:
        """Whether an obstacle can press a node in space, boolean array (n,): n has a part along components of
        u that supports leave free.
        """
        free = np.array([self.free[name] for name in FIELDS3D[:3]]).T
        return np.linalg.norm(self.normals * free, axis=1) > LEAST_FREE

    def motion(self, directions: Array, arms: Array) -> Any:
        """Returns the displacement u + psi x arm along directions, of arrays (n, dim): sparse (n,
        unknowns).
        """
        pad = ((0, 0), (0, 3 - directions.shape[1]))
        along = np.pad(directions, pad)
        return self._combined(np.hstack((along, np.cross(np.pad(arms, pad), along))).T)

    def _combined(self, factors: Array) -> Any:
        """Returns sums of factors, array (6, n), times the components of u and psi: sparse (n, unknowns)."""
        rows = csr_matrix((factors.shape[1], self.body.space.ndof))
        for name in self.body.names:
            factor = factors[COMPONENTS[name]]
            if np.abs(factor).max() > ROUNDED:
                rows = rows + diags(factor) @ self.traces[name]
        return rows

    @cached_property
    def onto(self) -> Any:
        """R: (u.n, psi) at the nodes from all unknowns, in space (u, phi1, phi2), u into the body and phi =
        (-psi2, psi1) ell/2, of the rotations about the sides of blocks; sparse (2 n or 3 n, unknowns).
        """
        if self.dim < 3:
            return vstack((self.motion(self.normals, 0 * self.normals), self.traces["psi"]), format="csr")
        half = self.body.solid.ell / 2
        t1, t2 = side_directions(self.normals)
        none = 0 * t1
        factors = [(-self.normals, none), (none, -half * t2), (none, half * t1)]
        return vstack([self._combined(np.hstack(pair).T) for pair in factors], format="csr")

    @cached_property
    def displacements_along_sides(self) -> list[Any]:
        """Displacements along the sides t1 and t2 of blocks in space: sparse arrays (n, unknowns)."""
        return [self.motion(side, 0 * side) for side in side_directions(self.normals)]

    @property
    def touching(self) -> list[str]:
        """Names of the fields that `onto` sees."""
        seen = np.unique(self.onto.indices)
        unknowns = {name: self.body.unknowns_of(name) for name in self.body.names}
        return [name for name, part in unknowns.items() if np.any((seen >= part.start) & (seen < part.stop))]

    def moments_of(self, name: str, exerted: Array) -> Array:
        """Returns nodal moments, array (n,), that do the work of what is exerted, (unknowns,), on a psi."""
        dofs = self._own_unknowns(self.body.spaces[-1])
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
    def surface_beside(self) -> tuple[Integers, Array, Integers]:
        """The surface in space beside the contact that an obstacle may meet: vertices, array (k,), their mean
        normals, (k, 3), and triangles between them, numbers (m, 3) of these.
        """
        facets = list((~self.region).Elements())
        normals = at_rules(self.body.mesh, facets, [rule_at([(1 / 3, 1 / 3)])] * len(facets))[2]
        sums = np.zeros((self.body.mesh.nv, 3))
        triangles = [np.zeros((0, 3), int)]
        for facet, normal in zip(facets, normals):
            corners = np.array([vertex.nr for vertex in facet.vertices])
            if normal[2] > STEEPEST:
                sums[corners] += normal
                triangles.append(corners[[(0, 1, 2), (0, 2, 3)][: len(corners) - 2]])
        vertices = np.flatnonzero(sums.any(axis=1))
        return vertices, units(sums[vertices]), np.searchsorted(vertices, np.concatenate(triangles))
