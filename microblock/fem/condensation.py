"""A body condensed to the nodes of a contact boundary.

The trailing block L of the Cholesky factor is that of the Schur complement, ``S = L L^T``. With R the values
of u.n and psi at the nodes the compliance is ``R S^-1 R^T``; in space R has (u, phi1, phi2), and it is
applied, not formed.
"""

from functools import cached_property

import ngsolve as ng
import numpy as np
from scipy.linalg import cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse.linalg import splu

from .. import cost
from ..contact_solvers.compliance import Compliance
from ..contact_solvers.projected_gradients import MatrixFree
from ..errors import require, require_kind
from ..model.law import level_surface
from ..model.types import LawLike
from ..threads import bounded, with_outer_threads
from . import factors, supports
from .body import Body, Fields
from .bulk import Bulk
from .facets import ContactNodes

LINKED = 6 * 27  # entries of a row for elements of order 1, and about as many for each order more


class Condensed(ContactNodes):
    """Body condensed to the nodes of its contact boundary.

    Parameters
    ----------
    body : Body, of any orders
    followed : bool, whether friction is followed, also on 1D and periodic bodies

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
    >>> from microblock.fem.condensation import Condensed
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> round(float(Condensed(body).weights.sum()), 9)
    4.0
    """

    @bounded
    def __init__(self, body, followed=False):
        require_kind(Body, "a Body", body=body)
        require_pressed(body, followed)
        super().__init__(body)
        self._made_of = body, followed
        self.unknowns = body.unknowns
        self._advice = (
            "take longer elements, a smaller contact boundary, or Newton(...), which iterates"
            if self.dim == 3
            else "take longer elements, a lower order or a larger rtol, or name less of the surface as "
            "contact boundary"
        )
        self._require_room()
        seen = self.traces.values() if followed else [self.onto]
        seen = np.concatenate([values.indices for values in seen])
        self._bulk = Bulk(body.bulk(symmetric=True, condense=True), seen, self._advice)
        self.factor, self.rows = self._bulk.block, self.onto[:, self._bulk.contact]

    @cached_property
    @bounded
    def compliance(self):
        surface, ell = (self.points, self.normals, self.weights), self.body.solid.ell
        return Compliance(*surface, self.response(self.onto), ell, self.apart)

    @property
    def twins(self):
        """Nodes whose corners move together, boolean array (n,)."""
        return self.dim < 3 and ~self.free["psi"]

    def _require_room(self):
        mesh, space, count = self.body.mesh, self.body.space, len(self.weights)
        rows = space.FreeDofs(True).NumSet()
        if self.dim == 3:
            needed = of_factors(rows, LINKED * self.body.order) + 8 * 3 * (3 * count) ** 2
            if factors.usual is factors.SuperLU:
                needed = max(needed, cost.of("condensed in space by SuperLU", self.unknowns).memory)
        else:
            # of an element; of each all unknowns there are linked
            sides = (2 * mesh.nedge - mesh.GetNE(ng.BND)) / mesh.ne
            orders = self.body.order if self.body.element_orders is None else self.body.element_orders
            entries = mesh.ne * np.mean((len(self.body.spaces) * sides * orders) ** 2)
            needed = cost.of_factors(rows, entries) + cost.of_nodes(count)
        what = f"a body of {self.unknowns} unknowns with {count} contact nodes"
        cost.require_room(needed, what, self._advice)

    def response(self, rows):
        """Displacements in rows, sparse (k, unknowns), from forces on them: array (k, k)."""
        with with_outer_threads(len(self.factor)):
            upper, _ = dpotri(self.factor.T)  # of S^-1; what is below the diagonal stays 0
        inverse, rows = upper + upper.T, rows[:, self._bulk.contact]
        np.fill_diagonal(inverse, np.diag(upper))
        matrix = rows @ (rows @ inverse).T
        return (matrix + matrix.T) / 2

    def surface(self, loads, onto=None):
        """The rows of R, array (k, n), under nodal loads on them, or on those of `onto`."""
        forces = (self.rows if onto is None else onto[:, self._bulk.contact]).T @ np.ravel(loads)
        return (self.rows @ cho_solve((self.factor, True), forces)).reshape(-1, len(self.points))

    @bounded
    def fields(self, loads, onto=None):
        """Fields under nodal loads on the rows of R, or on those of `onto`."""
        onto, state = self.onto if onto is None else onto, ng.GridFunction(self.body.space)
        return Fields(self.body, state.components, self._bulk.solve(onto.T @ np.ravel(loads), state))


class Flexibility3D(MatrixFree):
    """Gaps of corners from their forces on contact nodes.

    Parameters
    ----------
    directions : array (corners, 3, n), (1, lever) of each corner
    nodes : Condensed
    """

    def __init__(self, directions, nodes):
        self.directions, self.nodes, rows = directions, nodes, nodes.rows.tocsr()
        self._there = np.diff(rows.indptr) > 0  # not where supports hold a field
        self._inverse = splu(rows[self._there].tocsc())
        self._back = np.linalg.pinv(np.moveaxis(directions, -1, 0))  # (n, 3, corners)

    def __matmul__(self, forces):
        """Gaps from forces, arrays (corners, n)."""
        return np.einsum("cin,in->cn", self.directions, self.surface(forces))

    def surface(self, forces):
        """(u, phi1, phi2) at the nodes, array (3, n), under corner forces."""
        return self.nodes.surface(np.einsum("cin,cn->in", self.directions, forces))

    def on_face(self, there):
        """A function from gaps to forces of least norm that leave about these; on all corners."""

        def precondition(gaps):
            loads, factor = np.zeros(len(self._there)), self.nodes.factor
            wanted = np.einsum("nic,cn->in", self._back, gaps).ravel()[self._there]
            held = factor @ (factor.T @ self._inverse.solve(wanted))
            loads[self._there] = self._inverse.solve(held, trans="T")
            return np.einsum("nic,in->cn", self._back, loads.reshape(3, -1))

        return precondition


def of_factors(rows, entries):
    """Bytes to factorise the matrix of a body in space, of so many rows and entries in a row."""
    # 20 for each entry of the factors, of which there are 0.37 to 0.51 times rows^(4/3) times entries
    return 10 * entries * rows ** (4 / 3)


def require_pressed(body, followed=False):
    """BadArgument unless an obstacle can press a body whose supports hold it with 0; 1D and periodic ones
    only where friction is `followed`.
    """
    require(body.mesh.dim > 1 or followed, "body", body, "must be two-dimensional")
    # its ends are one node; as two they would share their force at random
    words = "Newton() solves on periodic bodies" if body.mesh.dim == 2 else "contact in space has no period"
    require(not body.periodic or followed, "body", body, f"must not be periodic: {words}")
    words = "in space" if body.in_space else "but with Newton() and without friction"
    words = f"must be empty {words}: supports hold 0"
    require(not body.prescribed, "prescribed", body.prescribed, words)
    supports.pressed(body)
    supports.require_held(body)


def condensed(body, clamped=False, followed=False):
    """The Condensed of a body, made once; if `clamped`, psi is fixed on the contact."""
    made_of = clamped_on_contact(body) if clamped else body
    return made_of.once(("condensed", followed), lambda: Condensed(made_of, followed))


def without_idle_rotation(body: Body, law: LawLike) -> Body:
    """The body without psi, made once, where neither the law nor the solid couples it to u and nothing
    prescribes it; else the body itself.
    """
    along = np.array([vertex.point[0] for vertex in body.mesh.vertices])
    prescribed = any(name.startswith("psi") for name in body.prescribed)
    turned = prescribed or len(law.corners) > 1 or law.arms(*level_surface(along)).any()
    if turned or not (body.rotates and body.solid.is_classical):
        return body
    return body.once("without rotation", lambda: body.on(body.mesh, order_psi=0))


def clamped_on_contact(body):
    """A body with psi = 0, in space psi1 = psi2 = 0, on its contact boundary, made once."""
    names = ("psi1", "psi2") if body.in_space else ("psi",)
    more = {name: "|".join(filter(None, (body.fixed.get(name), body.contact))) for name in names}
    return body.once("clamped", lambda: body.on(body.mesh, fixed={**body.fixed, **more}))
