"""What every body answers to the contact law: nodes, weights and one symmetric compliance in (u.n, psi)."""

from dataclasses import dataclass

import numpy as np

from .errors import BadArgument


@dataclass(frozen=True)
class Compliance:
    """Surface response of a linear body at its contact nodes.

    Attributes
    ----------
    points, normals : arrays (n, 2)
    weights : array (n,), length of surface that each node stands for
    matrix : array (2 n, 2 n), symmetric
        (u.n at all nodes, psi at all nodes) from (normal forces along n, moments), per thickness.
    ell : length of a microblock
    """

    points: np.ndarray
    normals: np.ndarray
    weights: np.ndarray
    matrix: np.ndarray
    ell: float

    def __post_init__(self):
        count = len(self.weights)
        if self.matrix.shape != (2*count, 2*count):
            raise BadArgument("matrix", self.matrix.shape, f"must have the shape {(2*count, 2*count)}")

    def corner_system(self, law, obstacle):
        """The law's corners on this body: corner, node, flexibility, initial gap, share in the load.

        Corner forces f >= 0 push along -n and with the levers of (29); the gaps of all corners, one corner of the
        law after the other, are ``g0 - share*approach + flexibility @ f``.
        """
        count, levers = len(self.weights), law.levers(self.points[:, 0])
        gaps = law.initial_gaps(self.points, self.normals, self.ell, obstacle)
        onto = np.vstack([np.column_stack((np.diag(-np.ones(count)), np.diag(self.ell/2*levers[name])))
                          for name in law.corners])
        return onto @ self.matrix @ onto.T, np.concatenate(list(gaps.values())), np.tile(self.normals[:, 1], len(law.corners))
