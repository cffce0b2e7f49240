"""A body condensed to the nodes of a contact boundary.

The trailing block L of the Cholesky factor is that of the Schur complement, ``S = L L^T``. With R the values
of u.n and psi at the nodes the compliance is ``R S^-1 R^T``; in space R has (u, phi1, phi2), and it is
applied, not formed.
"""

import ngsolve as ng
import numpy as np
from scipy.linalg import cho_solve
from scipy.linalg.lapack import dpotri
from scipy.sparse.linalg import splu

from .. import cost
from ..corners.compliance import Compliance
from ..errors import BadArgument, require_kind
from ..threads import bounded, released
from . import supports
from .body import Body, Fields
from .bulk import Bulk
from .facets import ContactNodes

LINKED = 6 * 27  # entries of a row for elements of order 1, and about as many for each order more


class Condensed(ContactNodes):
    """Body condensed to the nodes of its contact boundary.

    Parameters
    ----------
    body : Body, of any orders
    boundary : str, name or pattern of the contact boundary

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
    def __init__(self, body, boundary="contact"):
        require_kind(Body, "a Body", body=body)
        self._require_pressed(body, boundary)
        super().__init__(body, boundary)
        self.unknowns = body.space.FreeDofs().NumSet()
        self._advice = (
            "take longer elements, a smaller contact boundary, or Newton(...), which iterates"
            if self.dim == 3
            else "take longer elements, a lower order or a larger rtol, or name less of the surface as "
            "contact boundary"
        )
        self._require_room()
        self._bulk = Bulk(body.bulk(symmetric=True, condense=True), self.onto.indices, self._advice)
        self.factor, self.rows = self._bulk.block, self.onto[:, self._bulk.contact]
        if self.dim < 3:
            surface, apart = (self.points, self.normals, self.weights), getattr(self, "apart", None)
            self.compliance = Compliance(*surface, self._matrix(), body.solid.ell, apart)

    def _require_pressed(self, body, boundary):
        require_pressed(body, boundary)

    @property
    def twins(self):
        """Nodes whose corners move together, boolean array (n,)."""
        return self.dim < 3 and self.compliance.constrained

    def _require_room(self):
        mesh, space, count = self.body.mesh, self.body.space, len(self.weights)
        rows = space.FreeDofs(True).NumSet()
        if self.dim == 3:
            needed = of_factors(rows, LINKED * self.body.order) + 8 * 3 * (3 * count) ** 2
        else:
            # of an element; of each all unknowns there are linked
            sides = (2 * mesh.nedge - mesh.GetNE(ng.BND)) / mesh.ne
            orders = self.body.element_orders
            orders = np.full(mesh.ne, self.body.order) if orders is None else orders
            entries = np.sum((len(self.body.spaces) * sides * orders) ** 2)
            needed = cost.of_factors(rows, entries) + cost.of_nodes(count)
        what = f"a body of {self.unknowns} unknowns with {count} contact nodes"
        cost.require_room(needed, what, self._advice)

    def _matrix(self):
        with released(len(self.factor)):
            upper, _ = dpotri(self.factor.T)  # of S^-1; what is below the diagonal stays 0
        inverse = upper + upper.T
        np.fill_diagonal(inverse, np.diag(upper))
        matrix = self.rows @ (self.rows @ inverse).T
        return (matrix + matrix.T) / 2

    @bounded
    def fields(self, loads):
        """Fields under nodal loads on the rows of R, array."""
        state = ng.GridFunction(self.body.space)
        exerted = self._bulk.solve(self.onto.T @ np.ravel(loads), state)
        return Fields(self.body, state.components, exerted)

    def flexibility(self, directions):
        return Flexibility3D(directions, self.factor, self.rows.tocsr())


class Flexibility3D:
    """Gaps of corners from their forces on contact nodes.

    Parameters
    ----------
    directions : array (corners, 3, n), (1, lever) of each corner
    factor, rows : as of `Condensed`
    """

    def __init__(self, directions, factor, rows):
        self.directions, self.factor, self.rows = directions, factor, rows
        self._there = np.diff(rows.indptr) > 0  # not where supports hold a field
        self._inverse = splu(rows[self._there].tocsc())
        self._back = np.linalg.pinv(np.moveaxis(directions, -1, 0))  # (n, 3, corners)

    def __matmul__(self, forces):
        """Gaps from forces, arrays (corners, n)."""
        return self.gaps(self.surface(self.loads(forces)))

    def loads(self, forces):
        """(F, m1, m2) at the nodes of corner forces, array (3, n)."""
        return np.einsum("cin,cn->in", self.directions, forces)

    def gaps(self, surface):
        """Gaps of the corners, (corners, n), from (u, phi1, phi2), array (3, n)."""
        return np.einsum("cin,in->cn", self.directions, surface)

    def surface(self, loads):
        """(u, phi1, phi2) at the nodes under nodal loads, arrays (3, n)."""
        return (self.rows @ cho_solve((self.factor, True), self.rows.T @ loads.ravel())).reshape(3, -1)

    def precondition(self, gaps):
        """Forces of least norm that leave about these gaps."""
        loads = np.zeros(self.rows.shape[0])
        wanted = np.einsum("nic,cn->in", self._back, gaps).ravel()[self._there]
        held = self.factor @ (self.factor.T @ self._inverse.solve(wanted))
        loads[self._there] = self._inverse.solve(held, trans="T")
        return np.einsum("nic,in->cn", self._back, loads.reshape(3, -1))


def of_factors(rows, entries):
    """Bytes to factorise the matrix of a body in space, of so many rows and entries in a row."""
    # 20 for each entry of the factors, of which there are 0.37 to 0.51 times rows^(4/3) times entries
    return 10 * entries * rows ** (4 / 3)


def require_pressed(body, boundary):
    """BadArgument unless an obstacle can press a body whose supports hold it with 0."""
    if body.mesh.dim == 1:
        raise BadArgument("body", body, "must be two-dimensional")
    if body.periodic:  # its ends are one node; as two they would share their force at random
        words = (
            "Newton() solves on periodic bodies" if body.mesh.dim == 2 else "contact in space has no period"
        )
        raise BadArgument("body", body, f"must not be periodic: {words}")
    if body.prescribed:
        raise BadArgument(
            "prescribed", body.prescribed, "supports of a condensed body, and of one in space, hold 0"
        )
    supports.pressed(body, boundary)
    supports.require_held(body)


def condensed(body, boundary=None, clamped=False, kind=Condensed):
    """A body as `Condensed` or another kind, made once; if `clamped`, psi is fixed on the contact."""
    boundary = body.contact if boundary is None else boundary
    key = kind.__name__, boundary, clamped
    return body.once(key, lambda: kind(with_psi_constrained(body, boundary) if clamped else body, boundary))


def with_psi_constrained(body, boundary):
    """A body with psi = 0, in space psi1 = psi2 = 0, on its contact boundary."""
    names = ("psi1", "psi2") if body.mesh.dim == 3 else ("psi",)
    more = {name: "|".join(filter(None, (body.fixed.get(name), boundary))) for name in names}
    return body.on(body.mesh, fixed={**body.fixed, **more})
