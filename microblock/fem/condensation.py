"""A body condensed to the nodes of a contact boundary.

The trailing block L of the Cholesky factor is that of the Schur complement, ``S = L L^T``. With R the values
of u.n and psi at the nodes the compliance is ``R S^-1 R^T``; in space R has (u, phi1, phi2), and it is
applied, not formed.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np
from scipy.linalg import cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse import csr_matrix, identity, vstack
from scipy.sparse.linalg import splu

from .. import cost
from ..contact_solvers.compliance import Compliance
from ..contact_solvers.projected_gradients import MatrixFree
from ..errors import require, require_kind
from ..model.law import Law, horizontal_surface
from ..model.types import Array, Flags
from ..threads import bounded, with_outer_threads
from . import factors, supports
from .body import Body
from .body_fields import BodyFields
from .bulk import Bulk
from .contact_nodes import ContactNodes
from .facet_rules import at_rules, rule_at

DEPENDENT = 1e-12  # squares of singular values of R over the largest: below, rows depend on others
LINKED = 6 * 27  # entries of a row for elements of order 1, and about as many for each order more


class CondensedNodes(ContactNodes):
    """Body condensed to the nodes of its contact boundary.

    Parameters
    ----------
    body : Body, of any orders
    followed : bool, whether friction is followed, in the plane also on 1D and periodic bodies

    Attributes
    ----------
    compliance : Compliance, in the plane
    unknowns : int, free unknowns of the bulk
    factor : array (m, m), lower triangular, of the Schur complement
    rows : sparse array (n k, m), R

    Raises
    ------
    NotConverged
        As of `Bulk`.
    BadArgument
        As of `ContactNodes` and `require_pressed`.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> from microblock.fem.condensation import CondensedNodes
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> round(float(CondensedNodes(body).weights.sum()), 9)
    4.0
    """

    @bounded
    def __init__(self, body: Body, followed: bool = False) -> None:
        require_kind(Body, "a Body", body=body)
        require_pressed(body, followed)
        super().__init__(body)
        self._made_of = (body, followed)
        self.unknowns = body.unknowns
        advice = "a smaller contact boundary, or Newton(...), which iterates"
        if self.dim < 3:
            self.twins = ~self.free["psi"]
            advice = "a lower order or a larger rtol, or name less of the surface as contact boundary"
        advice = f"take longer elements, {advice}"
        contact = f"a body of {self.unknowns} unknowns with {len(self.weights)} contact nodes"
        traces = [self.onto]
        if followed:
            traces += self.displacements_along_sides if self.dim == 3 else self.traces.values()
        seen = np.concatenate([values.indices for values in traces])
        cost.require_room(condensed_bytes(body, len(np.unique(seen)), len(self.weights)), contact, advice)
        self._bulk = Bulk(body, body.bulk(symmetric=True, condense=True), seen, advice)
        self.factor = self._bulk.block
        self.rows = self.onto[:, self._bulk.contact]

    @cached_property
    @bounded
    def compliance(self) -> Compliance:
        response = self.response(self.onto)
        return Compliance(
            self.points, self.normals, self.weights, response, self.body.solid.ell, self.interrupted
        )

    @property
    def unseen_rows(self) -> Any:
        """Rows of free unknowns that the nodes do not see, sparse (k, m): 0 for what continues the nodes'
        values linearly.
        """
        body = self.body
        parts = [csr_matrix((0, body.space.ndof))]
        for name in self.touching:
            space = body.spaces[body.names.index(name)]
            start = body.unknowns_of(name).start
            vertices, rows = self.unseen(space)
            shape = (len(vertices), body.space.ndof)
            rows = csr_matrix((rows.data, rows.indices + start, rows.indptr), shape=shape)
            parts.append(rows[np.isin(vertices + start, self._bulk.contact)])
        return vstack(parts, format="csr")[:, self._bulk.contact]

    def response(self, rows: Any) -> Array:
        """Returns displacements in rows, sparse (k, unknowns), from forces on them: array (k, k)."""
        with with_outer_threads(len(self.factor)):
            upper, _ = dpotri(self.factor.T)  # of S^-1; what is below the diagonal stays 0
        inverse = upper + upper.T
        np.fill_diagonal(inverse, np.diag(upper))
        rows = rows[:, self._bulk.contact]
        matrix = rows @ (rows @ inverse).T
        return (matrix + matrix.T) / 2

    def surface(self, loads: Array, onto: Any = None) -> Array:
        """Returns the rows of R, array (k, n), under nodal loads on them, or on those of `onto`, (rows,)."""
        rows = self.rows if onto is None else onto[:, self._bulk.contact]
        solution = cho_solve((self.factor, True), rows.T @ np.ravel(loads))
        return (self.rows @ solution).reshape(-1, len(self.points))

    @bounded
    def fields(self, loads: Array, onto: Any = None) -> BodyFields:
        """Returns the fields under nodal loads on the rows of R, or on those of `onto`, (rows,)."""
        rows = self.onto if onto is None else onto
        state = ng.GridFunction(self.body.space)
        exerted = self._bulk.solve(rows.T @ np.ravel(loads), state)
        return BodyFields(self.body, state.components, exerted)


class NodalFlexibility(MatrixFree):
    """Gaps of corners from their forces, by displacements and rotations of the blocks of nodes in space; a
    subclass defines `surface` and `loads_from`.

    Parameters
    ----------
    directions : array (corners, k, n)
        Of each corner (1, lever), k = 3, or 1 where blocks have no levers.
    """

    def __init__(self, directions: Array) -> None:
        self.directions = directions
        self._back = np.linalg.pinv(np.moveaxis(directions, -1, 0))  # (n, k, corners)

    def surface(self, forces: Array) -> Array:
        """Returns u, and phi1 and phi2 of blocks, array (k, n), under corner forces, (corners, n)."""
        raise NotImplementedError

    def loads_from(self, surface: Array) -> Array:
        """Returns nodal forces and moments that about leave (u, phi), arrays (k, n)."""
        raise NotImplementedError

    def resultants(self, forces: Array) -> Array:
        """Returns nodal forces and moments, array (k, n), of corner forces, (corners, n)."""
        return np.asarray(np.einsum("cin,cn->in", self.directions, forces))

    def gaps(self, surface: Array) -> Array:
        """Returns changes of gaps, array (corners, n), from (u, phi), (k, n)."""
        return np.asarray(np.einsum("cin,in->cn", self.directions, surface))

    def nearest_surface(self, gaps: Array) -> Array:
        """Returns (u, phi), array (k, n), whose gaps are nearest to those given, (corners, n)."""
        return np.asarray(np.einsum("nic,cn->in", self._back, gaps))

    def __matmul__(self, forces: Array) -> Array:
        """Returns gaps from forces, arrays (corners, n)."""
        return self.gaps(self.surface(forces))

    def on_face(self, face: Flags) -> Callable[[Array], Array]:
        """Returns a function from gaps to forces, (corners, n), of least norm that leave about these; on all
        corners, whatever the face.
        """

        def precondition(gaps: Array) -> Array:
            loads = self.loads_from(self.nearest_surface(gaps))
            return np.asarray(np.einsum("nic,in->cn", self._back, loads))

        return precondition


class Flexibility3D(NodalFlexibility):
    """Gaps of corners from their forces on contact nodes.

    Parameters
    ----------
    directions : array (corners, 3, n), (1, lever) of each corner, over n3 where forces are parts of the load
    nodes : CondensedNodes
    """

    def __init__(self, directions: Array, nodes: CondensedNodes) -> None:
        super().__init__(directions)
        self.nodes = nodes
        rows = nodes.rows.tocsr()
        self._free: Flags = np.diff(rows.indptr) > 0  # not where supports hold a field
        self._rows = vstack((rows[self._free], nodes.unseen_rows), format="csr")
        square = (self._rows @ self._rows.T).tocsc()
        # on curved surfaces some rows depend on others where supports hold psi
        self._inverse = splu(square + DEPENDENT * square.max() * identity(square.shape[0], format="csc"))

    def surface(self, forces: Array) -> Array:
        return self.nodes.surface(self.resultants(forces))

    def loads_from(self, surface: Array) -> Array:
        factor = self.nodes.factor
        free = surface.ravel()[self._free]
        count = len(free)
        given = np.pad(free, (0, self._rows.shape[0] - count))
        reactions = factor @ (factor.T @ (self._rows.T @ self._inverse.solve(given)))
        loads = np.zeros(len(self._free))
        loads[self._free] = self._inverse.solve(self._rows @ reactions)[:count]
        return loads.reshape(3, -1)


def condensed_bytes(body: Body, seen: int, nodes: int) -> float:
    """Returns the bytes to condense a body to some unknowns that its contact boundary has seen, and nodes."""
    mesh = body.mesh
    rows = body.space.FreeDofs(True).NumSet()
    if mesh.dim == 3:
        needed = factor_bytes(rows, LINKED * body.order) + 8 * 3 * seen**2
        if factors.usual is factors.SuperLU:
            needed = max(needed, cost.predict("condensed in space by SuperLU", body.unknowns).memory)
        return needed
    # of an element; of each all unknowns there are linked
    sides = (2 * mesh.nedge - mesh.GetNE(ng.BND)) / mesh.ne
    orders = body.order if body.element_orders is None else body.element_orders
    entries = mesh.ne * np.mean((len(body.spaces) * sides * orders) ** 2)
    return cost.plane_factor_bytes(rows, entries) + cost.dense_bytes(nodes)


def factor_bytes(rows: float, entries: float) -> float:
    """Returns bytes to factorise the matrix of a body in space, of so many rows and entries in a row."""
    # 20 for each entry of the factors, of which there are 0.37 to 0.51 times rows^(4/3) times entries
    return 10 * entries * rows ** (4 / 3)


def require_pressed(body: Body, followed: bool = False, iterated: bool = False) -> None:
    """Raises BadArgument unless an obstacle can press a body; 1D and periodic ones only where friction is
    `followed`, supports that prescribe values only where its system is `iterated`, not condensed.
    """
    require(body.mesh.dim > 1 or followed, "body", body, "must be two-dimensional")
    # its ends are one node; as two they would share their force at random
    words = "Newton() solves on periodic bodies" if body.mesh.dim == 2 else "contact in space has no period"
    periodic = body.periodic and not (followed and body.mesh.dim < 3)
    require(not periodic, "body", body, f"must not be periodic: {words}")
    if not iterated:
        require_nothing_prescribed(body)
    supports.pressed(body)
    supports.require_held(body)


def require_nothing_prescribed(body: Body) -> None:
    """Raises BadArgument unless supports hold a body with 0."""
    words = (
        "must be empty with Condensed(), friction or a second body, and in the plane on a path or with an "
        "rtol: supports hold 0 there"
    )
    require(not body.prescribed, "prescribed", body.prescribed, words)


def condensed(body: Body, clamped: bool = False, followed: bool = False) -> CondensedNodes:
    """Returns the CondensedNodes of a body, made once; if `clamped`, psi is fixed on the contact."""
    supported = clamped_on_contact(body) if clamped else body
    return supported.once(("condensed", followed), lambda: CondensedNodes(supported, followed))


def without_idle_rotation(body: Body, law: Law) -> Body:
    """Returns the body without psi, made once, where neither the law nor the solid couples it to u and
    nothing prescribes it; else the body itself.
    """
    along = np.array([vertex.point[0] for vertex in body.mesh.vertices])
    prescribed = any(name.startswith("psi") for name in body.prescribed)
    rotated = prescribed or len(law.corners) > 1 or law.arms(*horizontal_surface(along)).any()
    if rotated or not (body.rotates and body.is_classical):
        return body
    return body.once("without rotation", lambda: body.on(body.mesh, order_psi=0))


def clamped_on_contact(body: Body) -> Body:
    """Returns a body with psi = 0 on its contact boundary, made once; in space psi3 is free where it is
    horizontal.
    """
    fixed = dict(body.fixed)
    for name in _clamped_names(body):
        fixed[name] = "|".join(filter(None, (body.fixed.get(name), body.contact)))
    return body.once("clamped", lambda: body.on(body.mesh, fixed=fixed))


def _clamped_names(body: Body) -> tuple[str, ...]:
    """Returns the components of psi that turn the sides of blocks on a contact boundary."""
    if not body.in_space:
        return ("psi",)
    facets = list(body.boundary(body.contact, "contact").Elements())
    normals = at_rules(body.mesh, facets, [rule_at([(1 / 3, 1 / 3)])] * len(facets))[2]
    if normals[:, 2].min() > 1 - 1e-9:
        return ("psi1", "psi2")
    return ("psi1", "psi2", "psi3")
