"""A body in three dimensions condensed to its contact nodes, and products with its flexibility.

As in the plane (`microblock.fem.condensation`) the bulk is assembled once and factorised with the unknowns
of the contact boundary last. The trailing block L of the Cholesky factor is that of their Schur complement,
``S = L L^T``. With R the values of (u, phi1, phi2) at the nodes the surface answers nodal loads (F, m1, m2)
by ``R S^-1 R^T``, two triangular solves, and nodal loads follow from a surface by ``R^-T S R^-1``, which is
what conjugate gradients are preconditioned with. The compliance itself is never formed.
"""

from dataclasses import dataclass

import ngsolve as ng
import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from .. import cost
from ..threads import bounded
from .body3d import HELD, Fields3D
from .bulk import Bulk
from .nodes3d import ContactNodes3D

# entries of the factors L and L^T of n unknowns in three dimensions, over n^(4/3) times the entries of a row:
# 0.37 to 0.51 were seen
FILLED = 0.5
LINKED = 6 * 27  # entries of a row for elements of order 1, and about as many for each order more
FACTOR_ENTRY = 20  # bytes of each, with what builds them: 20 were seen


class Condensed3D(ContactNodes3D):
    """A body in three dimensions condensed to its contact nodes.

    Parameters
    ----------
    body : Body3D

    Attributes
    ----------
    unknowns : int, free unknowns of the bulk
    factor : array (m, m), lower triangular, of the Schur complement of the unknowns that corners see
    rows : sparse array (3 n, m), (u, phi1, phi2) at the nodes from them

    Raises
    ------
    NotConverged
        If the supports leave a rigid motion free, the energy is not positive, or the factors would need more
        memory than there is.
    BadArgument
        As of `ContactNodes3D`.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> from microblock.fem.condensed3d import Condensed3D
    >>> x = np.linspace(0, 1, 3)
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> nodes = Condensed3D(mb.Body3D(meshes3d.block(x, x, x - 1), solid, fixed="bottom"))
    >>> nodes.factor.shape, nodes.unknowns
    ((27, 27), 108)
    """

    @bounded
    def __init__(self, body):
        super().__init__(body)
        body.require_held()
        self._require_room()
        self.form = body.bulk(condense=True)
        advice = "take longer elements, or Newton(...), which iterates"
        self._bulk = Bulk(self.form, self.onto.indices, advice, HELD)
        self.factor, self.rows = self._bulk.block, self.onto[:, self._bulk.contact]

    def _require_room(self):
        """NotConverged where factors need more memory than is there."""
        space = self.body.space
        self.unknowns, rows = space.FreeDofs().NumSet(), space.FreeDofs(True).NumSet()
        needed = of_factors(rows, LINKED * self.body.order) + 8 * 3 * (3 * len(self.weights)) ** 2
        cost.require_room(
            needed,
            f"a body of {self.unknowns} unknowns with {len(self.weights)} contact nodes",
            "take longer elements, a smaller contact boundary, or Newton(...), which iterates",
        )

    @bounded
    def fields(self, loads):
        """Fields3D under nodal loads (F, m1, m2), array (3, n), by one back-substitution."""
        state = ng.GridFunction(self.body.space)
        exerted = self._bulk.solve(self.onto.T @ loads.ravel(), state)
        return Fields3D(self.body, state.components, exerted)

    def flexibility(self, directions, clamped=False):
        """H of corners with these (1, lever) at the nodes, array (corners, 3, n), as a product; if `clamped`
        phi = 0."""
        factor, rows = self.factor, self.rows
        if clamped:
            pressed = self._lowering()
            factor, rows = _without_rotation(factor, pressed), rows[:, pressed]
        return Flexibility3D(directions, factor, rows.tocsr())

    def _lowering(self):
        """Numbers of the contact unknowns of u3."""
        return np.flatnonzero(np.diff(self.rows[: len(self.weights)].tocsc().indptr))

    def held_moments(self, forces):
        """Nodal moments (m1, m2), array (2, n), that keep phi = 0 under nodal forces F, array (n,)."""
        n, pressed = len(self.weights), self._lowering()
        turned = np.setdiff1d(np.arange(len(self.factor)), pressed)
        own = self.factor[pressed]
        lowered = _solved(_without_rotation(self.factor, pressed), self.rows[:n, pressed].T @ forces)
        moments = np.zeros(2 * n)
        rows, there = self.rows[n:, turned], np.concatenate((self.free["psi2"], self.free["psi1"]))
        moments[there] = splu(rows[there].T.tocsc()).solve(self.factor[turned] @ (own.T @ lowered))
        return moments.reshape(2, n)


@dataclass(frozen=True)
class Flexibility3D:
    """Gaps of corners from their forces on contact nodes, for `microblock.corners.projected_gradients`.

    Attributes
    ----------
    directions : array (corners, 3, n)
        (1, lever) of each corner at the nodes.
    factor, rows : as of `Condensed3D`
    """

    directions: np.ndarray
    factor: np.ndarray
    rows: csr_matrix

    def __post_init__(self):
        there = np.diff(self.rows.indptr) > 0  # not where supports hold a field
        back = np.linalg.pinv(np.moveaxis(self.directions, -1, 0))  # (n, 3, corners)
        for name, value in (("_there", there), ("_inverse", splu(self.rows[there].tocsc())), ("_back", back)):
            object.__setattr__(self, name, value)

    def __matmul__(self, forces):
        """Gaps from forces, arrays (corners, n)."""
        return self.gaps(self.surface(self.loads(forces)))

    def loads(self, forces):
        """(F, m1, m2) at the nodes of corner forces, array (3, n)."""
        return np.einsum("cin,cn->in", self.directions, forces)

    def gaps(self, surface):
        """What (u, phi1, phi2), array (3, n), add to the gap of each corner."""
        return np.einsum("cin,in->cn", self.directions, surface)

    def surface(self, loads):
        """(u, phi1, phi2) at the nodes under nodal loads, arrays (3, n)."""
        return (self.rows @ _solved(self.factor, self.rows.T @ loads.ravel())).reshape(3, -1)

    def precondition(self, gaps):
        """Forces of least norm that leave about these gaps."""
        loads = np.zeros(self.rows.shape[0])
        wanted = np.einsum("nic,cn->in", self._back, gaps).ravel()[self._there]
        held = self.factor @ (self.factor.T @ self._inverse.solve(wanted))
        loads[self._there] = self._inverse.solve(held, trans="T")
        return np.einsum("nic,in->cn", self._back, loads.reshape(3, -1))


def of_factors(rows, entries):
    """Bytes to factorise the matrix of a body in three dimensions with so many rows and entries in a row."""
    return FACTOR_ENTRY * FILLED * entries * rows ** (4 / 3)


def _without_rotation(factor, pressed):
    """The Cholesky factor of the Schur complement of u3 alone, the rotations being 0."""
    return cholesky(factor[pressed] @ factor[pressed].T, lower=True)


def _solved(factor, right):
    """(L L^T)^-1 right."""
    half = solve_triangular(factor, right, lower=True)
    return solve_triangular(factor, half, lower=True, trans="T")


def condensed3d(body):
    """A body as `Condensed3D`, made once and kept with the body."""
    return body.once("condensed", lambda: Condensed3D(body))
