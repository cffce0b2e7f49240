"""Polynomials of the facets of a contact boundary between its nodes."""

from collections.abc import Sequence

import numpy as np

from ..model.corner_geometry import Blocks
from ..model.material import Cosserat
from ..model.quadrature import lagrange
from ..model.types import Array, Flags, Integers, ObstacleLike


class FacetPolynomials:
    """The facets of a contact boundary from left to right, but for those with n2 up to `steepest`.

    Parameters
    ----------
    points, normals : arrays (nodes, 2)
    facets : [array (order + 1,)], the nodes of each facet
    solid : Cosserat, of the body

    Attributes
    ----------
    numbers : array (facets,), theirs among all facets
    members : [array (order + 1,)], the nodes of each
    left, right : arrays (facets,), x1 of their ends
    spacing : array (facets,), distance of nodes along x1
    """

    def __init__(
        self, points: Array, normals: Array, facets: Sequence[Integers], solid: Cosserat, steepest: float
    ) -> None:
        self.points = points
        self.normals = normals
        self.solid = solid
        x = points[:, 0]
        upper = [
            number
            for number, facet in enumerate(facets)
            if normals[facet, 1].min() > steepest and np.ptp(x[facet]) > 0
        ]
        self.numbers: Integers = np.array(sorted(upper, key=lambda number: facets[number].min()), int)
        self.members = [np.sort(facets[number]) for number in self.numbers]
        self.left: Array = np.array([x[facet[0]] for facet in self.members])
        self.right: Array = np.array([x[facet[-1]] for facet in self.members])
        self.spacing: Array = (self.right - self.left) / [len(facet) - 1 for facet in self.members]

    def below(self, x: Array) -> Integers:
        """Returns the number (here) of the facet at each x1, array (n,), -1 where there is none."""
        number = np.minimum(np.searchsorted(self.right, x), len(self.right) - 1)
        return np.where((self.left[number] <= x) & (x <= self.right[number]), number, -1)

    def interpolate(self, values: Array, x: Array) -> Array:
        """Returns nodal values, arrays (..., nodes), at x1, array (n,), by the facets' polynomials: (..., n);
        0 beyond them.
        """
        interpolated = np.zeros((*np.shape(values)[:-1], len(x)))
        below = self.below(x)
        for number in np.unique(below[below >= 0]):
            facet = self.members[number]
            chosen = below == number
            left = self.left[number]
            length = self.right[number] - left
            shares = lagrange((self.points[facet, 0] - left) / length, (x[chosen] - left) / length)
            interpolated[..., chosen] = values[..., facet] @ shares.T
        return interpolated

    def surface(self, x: Array) -> tuple[Array, Array]:
        """Returns points on the facets at x1, array (n,), and their unit normals, arrays (n, 2)."""
        x2, *normals = self.interpolate(np.vstack((self.points[:, 1], self.normals.T)), x)
        return np.column_stack((x, x2)), np.column_stack(normals / np.hypot(*normals))

    def initial_gaps(self, blocks: Blocks, obstacle: ObstacleLike, x: Array) -> Array:
        """Returns initial gaps of all corners on the facets at x1, (n,): array (corners, n)."""
        return blocks.under(obstacle, *self.surface(x)).initial_gaps

    def pressed(self, closed: Flags) -> Flags:
        """Returns whether two nodes or more of each facet are closed, array (facets,), of (nodes,)."""
        return np.array([closed[facet].sum() > 1 for facet in self.members])
