"""Closed corners, nodes that stick and nodes that slip, exchanged by principal pivots of M in (c) of
`microblock.contact_solvers.frictional_contact`.

Of a closed corner, of a node that sticks and of a motion x_i and y_i are exchanged: the gap, the slip or the
load is given, and the force or the motion follows. Where a node slips t = tau + f sigma n: the column of t is
added to those of its n.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dgemm

from ..errors import NotConverged
from ..model.types import Array, Flags, Integers
from ..threads import with_outer_threads
from .frictional_contact import FrictionalContact
from .rounding import EPS_PIVOT

AT_LIMIT = 1e-9  # of the largest bound: a node that is so near to its own slips or begins to
PENDING = 48  # pivots that are not yet in the tableau
UNIQUE = "the friction may be too large for a unique answer: try a smaller one, or coupled=False"


class PivotTableau:
    """y = M x after exchanges of some x_i with their y_i; pivots wait as products until there are PENDING.

    Parameters
    ----------
    matrix : array (N, N) in Fortran's order, which is overwritten

    Attributes
    ----------
    exchanged : boolean array (N,)
    sign : that of the product of all pivots
    """

    def __init__(self, matrix: Array) -> None:
        self.sign = 1.0
        self.exchanged = np.zeros(len(matrix), bool)
        self._matrix = matrix
        self._pending = 0
        self._columns, self._rows = np.zeros((2, PENDING, len(matrix))).transpose(0, 2, 1)

    def times(self, rows: slice | Flags, values: Array) -> Array:
        """Returns what values, array (k,), in k rows yield in all rows, array (N,)."""
        return self._matrix[:, rows] @ values + self._columns @ (self._rows[rows].T @ values)

    def entries(self, rows: int | Integers, columns: int | Integers) -> Array:
        """Returns entries of M after the exchanges, of the shape to which rows and columns broadcast."""
        pending = (self._columns[rows] * self._rows[columns]).sum(axis=-1)
        return np.asarray(self._matrix[rows, columns] + pending)

    def pivot(self, i: int) -> bool:
        """Exchanges a pair and returns True, unless the pivot is 0 to rounding."""
        column = self._matrix[:, i] + self._columns @ self._rows[i]
        row = self._matrix[i] + self._rows @ self._columns[i]
        pivot = column[i]
        if abs(pivot) <= EPS_PIVOT:
            return False
        self.exchanged[i] ^= True
        self.sign *= np.sign(pivot)
        row /= -pivot
        column[i] = row[i] = self._columns[i] = self._rows[i] = 0.0
        self._matrix[i] = row
        self._matrix[:, i] = column / pivot
        self._matrix[i, i] = 1 / pivot
        self._columns[:, self._pending] = column
        self._rows[:, self._pending] = row
        self._pending = (self._pending + 1) % PENDING
        if not self._pending:
            self._apply_pending()
        return True

    def _apply_pending(self) -> None:
        """Adds the products of the pivots that wait to the matrix."""
        with with_outer_threads(len(self._matrix)):
            self._matrix = dgemm(
                1.0, self._columns, self._rows, 1.0, self._matrix, trans_b=True, overwrite_c=True
            )
        self._columns[:] = self._rows[:] = 0.0

    def add_friction_coupling(self, shear: int, corners: Integers, factor: float) -> None:
        """Replaces x_shear by x_shear - factor*sum(x_corners); where it is not exchanged, the corners are
        not.
        """
        if not factor:  # of most
            return
        if self.exchanged[shear]:
            closed = self.exchanged[corners]
            self._matrix[shear] -= factor * self._matrix[corners[closed]].sum(axis=0)
            self._columns[shear] -= factor * self._columns[corners[closed]].sum(axis=0)
            self._matrix[shear, corners[~closed]] -= factor
        else:
            self._matrix[:, corners] += factor * self._matrix[:, shear, None]
            self._rows[corners] += factor * self._rows[shear]


class Pivot(NamedTuple):
    """The exchange of one limit: a corner closes or opens, or a node slips, sticks or leaves.

    Attributes
    ----------
    pairs : rows of M that are exchanged
    node : number of the node
    slip : sign of its tangential force afterwards if it slips, else 0
    """

    pairs: list[int]
    node: int
    slip: float


class ActiveSets:
    """Closed corners and nodes that stick or slip, with their tableau.

    Limits are numbered: a corner's force or gap as the corner, the bound of a node's tangential force
    forwards as its row in M, backwards n further.

    Parameters
    ----------
    pairs : rows in M of closed corners, nodes that stick and motions, in this order

    Attributes
    ----------
    slips : array (n,), sign of t where a node slips, else 0
    corners_of : array (corners, n), rows of each node's corners
    flat : whether all normals are (0, 1)

    Raises NotConverged if the answer is not unique.
    """

    def __init__(self, contact: FrictionalContact, pairs: list[int]) -> None:
        self.contact = contact
        self.rows = contact.rows
        self.slips = np.zeros(contact.nodes)
        self.tableau = PivotTableau(contact.matrix)
        self.corners_of = np.arange(len(contact.gaps)).reshape(-1, contact.nodes)
        self.flat = not contact.motions[self.rows.corners, 1].any()
        if not all([self.tableau.pivot(pair) for pair in pairs]):
            raise NotConverged(f"the rates of the contact are not unique; {UNIQUE}")
        self.tableau.sign = 1.0

    @property
    def closed(self) -> Flags:
        return self.tableau.exchanged[self.rows.corners]

    @property
    def stick(self) -> Flags:
        return self.tableau.exchanged[self.rows.nodes]

    @property
    def in_contact(self) -> Flags:
        """Which nodes stick or slip, array (n,)."""
        return self.stick | (self.slips != 0)

    @property
    def last_sticks(self) -> bool:
        """Whether one node alone sticks."""
        return self.flat and np.count_nonzero(self.stick) == 1

    def may_slip(self, direction: float) -> Flags:
        """Returns the nodes that stick and may begin to slip, boolean array (n,): the last one only where
        another, which slips the other way, can stick instead.
        """
        return self.stick & (not self.last_sticks or bool(np.any(self.slips == -direction)))

    def pivot_of(self, limit: int, velocity: Array) -> Pivot:
        """Returns the Pivot of a limit; see `exchange`."""
        first = self.rows.nodes.start
        node = (limit - first) % len(self.slips)
        shear = first + node
        slip = float(self.slips[node])
        if limit >= first:
            if slip:
                return Pivot([shear], node, 0.0)
            if not self.stick[node]:
                return Pivot([], node, 0.0)
            return Pivot([shear], node, 1.0 if limit == shear else -1.0)
        closed = self.closed[self.corners_of[:, node]].sum()
        if closed != self.closed[limit]:  # others of the node are closed
            return Pivot([limit], node, slip)
        if self.stick[node]:
            return Pivot([shear, limit], node, 0.0)
        if closed:
            return Pivot([limit], node, 0.0)
        if abs(velocity[node]) <= AT_LIMIT * np.abs(velocity).max():
            return Pivot([limit, shear], node, 0.0)
        return Pivot([limit], node, float(np.sign(velocity[node])))

    def exchange(self, limit: int, velocity: Array) -> bool:
        """Closes or opens a corner, or lets a node slip or stick; returns False where that is singular.

        Parameters
        ----------
        limit : int
        velocity : array (n,), of the obstacle over the surface
        """
        pairs, node, slip = self.pivot_of(limit, velocity)
        shear = self.rows.nodes.start + node
        corners = self.corners_of[:, node]
        factor = (slip - self.slips[node]) * self.contact.friction
        if shear in pairs and self.stick[node] and self.last_sticks and not self._hold(slip, velocity):
            return False
        if slip:
            self.tableau.add_friction_coupling(shear, corners, factor)
        done = [pair for pair in pairs if self.tableau.pivot(pair)]
        if done != pairs or not pairs:
            for pair in done:
                self.tableau.pivot(pair)
            if slip:
                self.tableau.add_friction_coupling(shear, corners, -factor)
            return False
        if not slip:
            self.tableau.add_friction_coupling(shear, corners, factor)
        self.slips[node] = slip
        return True

    def _hold(self, slip: float, velocity: Array) -> bool:
        """Lets the slowest node that slips another way stick, before the last one that sticks slips."""
        candidates = np.flatnonzero((self.slips != 0) & (self.slips != slip))
        if not len(candidates):
            return False
        slowest = candidates[np.argmin(np.abs(velocity[candidates]))]
        return self.exchange(self.rows.nodes.start + int(slowest), velocity)

    def determinant(self, limit: int, velocity: Array) -> float:
        """Returns the determinant of the pivots of a limit."""
        pairs, node, slip = self.pivot_of(limit, velocity)
        entries = self.tableau.entries
        shear = self.rows.nodes.start + node
        pivots = entries(np.reshape(pairs, (-1, 1)), np.array(pairs, int))
        if slip and slip != self.slips[node]:  # t = tau + f slip n from then on
            if limit < self.rows.nodes.start:
                slope = entries(limit, shear)
            else:
                corners = self.corners_of[:, node]
                slope = -entries(corners[self.closed[corners]], shear).sum()
            pivots = pivots + (slip - self.slips[node]) * self.contact.friction * slope
        return float(np.linalg.det(pivots))
