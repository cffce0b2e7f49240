"""Frictional contact of corners at nodes: its compliances, and a state at one pair of loads.

Corner forces n >= 0 and tangential forces t at nodes leave the gaps g and drag the surface by s along it. The
obstacle moves by u = (d, D), d along -e2 and D along e1, and bears the loads (P, Q):

    g = g0 + H n + C^T t - B_n u,     s = C n + T t + S e,     (P, Q) = B_n^T n + B_t^T t,              (c)

with the drag e of nodes under a unit bulk stress, of which S is, and the rows (n2, -n1) of B_n and (n1, n2)
of B_t at the normal (n1, n2). A node sticks while B_t u - s does not change; it slips in the direction sigma
of t while |t| = f times the sum of n. Uncoupled, C^T t is left out.

With x = (n, t, u) and y = (g, s - B_t u, (P, Q)), (c) is y = (g0, S e, 0) + M x with M = [[A, -B], [B^T, 0]].
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import require
from ..model.law import tangents
from ..model.types import Array, Flags


class RowsOfSystem(NamedTuple):
    """Rows of corners, nodes and motions in M: x are forces and motions, y are gaps, slip and loads."""

    corners: slice
    nodes: slice
    motions: slice


@dataclass(frozen=True, eq=False)
class FrictionalContact:
    """Compliances of corners and nodes (c).

    Attributes
    ----------
    normal : array (corners n, corners n), H (length per force), corner by corner
    cross : array (n, corners n), C
    tangential : array (n, n), T; symmetric as H
    gaps : array (corners n,), g0 (lengths), inf where a corner cannot touch
    coupled : whether tangential forces act on gaps
    normals : array (n, 2), of the nodes; (0, 1) without it
    stretch : array (n,), e (length per stress); 0 without a bulk stress
    """

    normal: Array
    cross: Array
    tangential: Array
    gaps: Array
    friction: float
    coupled: bool = True
    normals: Array | None = None
    stretch: Array | float = 0.0

    def __post_init__(self) -> None:
        require(self.nodes, "tangential", self.tangential, "must be of one node or more")

    @property
    def nodes(self) -> int:
        return len(self.tangential)

    @property
    def rows(self) -> RowsOfSystem:
        corners = len(self.gaps)
        forces = corners + self.nodes
        return RowsOfSystem(slice(0, corners), slice(corners, forces), slice(forces, forces + 2))

    def displaced(self, normal: Array, tangential: Array) -> Array:
        """Returns changes of the gaps, then the drag s, under forces: array (corners n + n,)."""
        gaps = self.normal @ normal
        if self.coupled:
            gaps += self.cross.T @ tangential
        return np.concatenate((gaps, self.cross @ normal + self.tangential @ tangential))

    @property
    def size(self) -> float:
        """Largest displacement of a node under a unit shear force there (length per force)."""
        return float(np.abs(np.diag(self.tangential)).max()) or 1.0

    @property
    def motions(self) -> Array:
        """B: rows of corners, then of nodes; columns d and D."""
        n = self.nodes
        normals = np.tile((0.0, 1.0), (n, 1)) if self.normals is None else self.normals
        return np.vstack((*[tangents(normals)] * (len(self.gaps) // n), normals))

    @property
    def matrix(self) -> Array:
        """M, compliances over `size`."""
        corners, nodes, motions = self.rows
        B = self.motions
        M = np.zeros(2 * [motions.stop], order="F")
        M[corners, corners] = self.normal
        M[nodes, corners] = self.cross
        M[nodes, nodes] = self.tangential
        M[corners, nodes] = self.cross.T * self.coupled
        M /= self.size
        fixed = corners.stop + np.flatnonzero(np.diag(self.tangential) == 0)  # which could not stick alone
        M[fixed, fixed] = np.sqrt(np.finfo(float).eps)
        M[: motions.start, motions] = -B
        M[motions, : motions.start] = B.T
        return M


@dataclass(frozen=True, eq=False)
class FrictionState:
    """The contact at one pair of loads.

    Attributes
    ----------
    load, shear, bulk : P and Q (force), and the bulk stress
    normal, gaps : arrays (corners n,), forces and gaps
    tangential, slip : arrays (n,), forces, and slip since first contact (length)
    gap_changes : array (corners n,), changes of the gaps by forces (lengths)
    closed : boolean array (corners n,)
    stick : boolean array (n,)
    at_limit : boolean array (n,), nodes with the largest shear force
    iterations : changes so far
    approach, offset : d and D (length)
    energy : of the forces
    residual : largest violated condition over the largest force or displacement
    """

    load: float
    shear: float
    normal: Array
    gaps: Array
    tangential: Array
    slip: Array
    gap_changes: Array
    closed: Flags
    stick: Flags
    at_limit: Flags
    iterations: int
    approach: float
    offset: float
    energy: float
    work: float
    dissipation: float
    residual: float
    bulk: float = 0.0
