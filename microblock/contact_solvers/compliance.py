"""The answer of every body to the contact law: one symmetric compliance in (u.n, psi) at nodes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import require
from ..model.corner_geometry import Blocks
from ..model.types import Array, Flags, ObstacleLike


@dataclass(frozen=True)
class Compliance:
    """Surface response of a linear body at its contact nodes.

    Attributes
    ----------
    points, normals : arrays (n, 2)
    weights : array (n,), lengths of surface
    matrix : array (2 n, 2 n), symmetric
        (u.n at all nodes, psi at all nodes) from (normal forces along n, moments), per thickness.
    ell : length of a microblock
    interrupted : boolean array (n - 1,), optional, whether the surface is interrupted after a node

    Examples
    --------
    >>> from microblock.contact_solvers.compliance import Compliance
    >>> points = np.column_stack((np.linspace(-1, 1, 5), np.zeros(5)))
    >>> springs = np.diag([0.01] * 5 + [2.0] * 5)
    >>> Compliance(points, np.tile([0.0, 1.0], (5, 1)), np.full(5, 0.5), springs, ell=0.1).matrix.shape
    (10, 10)
    """

    points: Array
    normals: Array
    weights: Array
    matrix: Array
    ell: float
    interrupted: Flags | None = None

    def __post_init__(self) -> None:
        count = len(self.weights)
        require(count, "weights", self.weights, "must be of one node or more")
        require(
            self.matrix.shape == (2 * count, 2 * count),
            "matrix",
            self.matrix.shape,
            f"must have the shape {(2 * count, 2 * count)}",
        )
        # two of a crack are at one place
        require(
            np.all(np.diff(self.points[:, 0]) >= 0), "points", self.points[:, 0], "must have ascending x1"
        )

    def require_symmetric(self) -> None:
        """BadArgument unless the matrix is finite and symmetric."""
        size = np.repeat((1.0, self.ell / 2), len(self.weights))  # psi as it moves a corner
        scaled = size[:, None] * self.matrix * size
        require(np.isfinite(scaled).all(), "matrix", self.matrix, "must be finite")
        require(
            np.abs(scaled - scaled.T).max() <= 1e-8 * np.abs(scaled).max(),
            "matrix",
            self.matrix,
            "must be symmetric",
        )

    @cached_property
    def twins(self) -> Flags:
        """Nodes with prescribed psi = 0 (rows of zeros): boolean array (n,)."""
        return np.asarray(~self.matrix[len(self.weights) :].any(axis=1))

    def corner_system(self, blocks: Blocks, obstacle: ObstacleLike) -> tuple[Array, Array, Array]:
        """The corners of blocks on this body: flexibility, initial gaps, weights in the load.

        Forces f >= 0 along -n leave ``g0 - weights*approach + flexibility @ f``, corner after corner. Where
        psi = 0 is prescribed, g0 of all but the nearest corner is inf.
        """
        own_blocks = blocks if blocks.ell == self.ell else Blocks(blocks.law, self.ell)
        geometry = own_blocks.under(obstacle, self.points, self.normals)
        gaps = nearest_alone(geometry.initial_gaps, self.twins)
        # of corners that cannot touch it does not matter
        weights = np.where(np.isfinite(gaps), self.normals[:, 1], 1.0)
        onto = self._onto_corners(blocks)
        return onto @ (onto @ self.matrix).T, gaps.ravel(), weights.ravel()

    def loads(self, blocks: Blocks, forces: Array) -> Array:
        """Nodal forces along n and moments, array (2 n,), of corner forces, array (corners, n)."""
        return self._onto_corners(blocks).T @ forces.ravel()

    def _onto_corners(self, blocks: Blocks) -> Any:
        """Changes of the gaps from (u.n, psi): sparse (corners n, 2 n)."""
        from scipy import sparse  # here: names of the half-plane load without it

        ones = np.ones(len(self.weights))
        levers = self.ell / 2 * blocks.levers(self.points[:, 0])
        return sparse.bmat([[sparse.diags(-ones), sparse.diags(lever)] for lever in levers]).tocsr()


def nearest_alone(gaps: Array, twins: Flags) -> Array:
    """Gaps, array (corners, n), inf of all but the nearest corner at `twins`, whose corners move together."""
    nearest = np.arange(len(gaps))[:, None] == np.argmin(gaps, axis=0)
    return np.where(twins & ~nearest, np.inf, gaps)
