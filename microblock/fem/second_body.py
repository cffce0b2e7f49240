"""A second body on a mesh: how its straight lower surface gives way under corners."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import require
from ..model.deformable import Deformable
from ..model.law import Unilateral
from ..model.quadrature import gauss_rule
from ..model.types import Array, Flags
from .condensation import CondensedNodes, condensed, without_idle_rotation
from .facet_rules import rule_at


class CounterBody:
    """The second body of a problem, condensed to the nodes of its contact boundary.

    Nodes need not match: the force of a corner is a pressure, the polynomial of its node, and the
    displacement of the second body is its mean with this pressure.

    Parameters
    ----------
    obstacle : Deformable of a Body
    body : CondensedNodes, the first body
    shifts : how far right of each corner its contact point lies (lengths)

    Raises
    ------
    BadArgument
        Unless the second body lies above a straight, level contact boundary.
    """

    def __init__(self, obstacle: Deformable, body: CondensedNodes, shifts: Sequence[float]) -> None:
        self.obstacle = obstacle
        self.body = body
        self.shifts = shifts
        second: Any = obstacle.body
        self.nodes = condensed(without_idle_rotation(second, Unilateral()))
        words = (
            "its body must be above its contact boundary, which is straight and level: heights are those of "
            "the shape"
        )
        level = np.abs(self.nodes.normals - (0.0, -1.0)).max() <= 1e-9
        require(level, "obstacle", obstacle, words)

    @cached_property
    def _matrix(self) -> Array:
        """Displacements along x2 at the nodes from forces there, array (nodes, nodes)."""
        count = len(self.nodes.points)
        return self.nodes.compliance.matrix[:count, :count]

    @cached_property
    def _shares(self) -> Array:
        """Shares of the nodes in the force and displacement of each corner: array (corners n, nodes)."""
        return np.vstack([self._shares_of(shift) for shift in self.shifts])

    def _shares_of(self, shift: float) -> Array:
        """Returns the shares of the nodes in a corner's pressures, array (n, nodes)."""
        body = self.body
        gauss, weights = gauss_rule(12)
        pieces = 4  # of a facet, for the other mesh
        t = ((np.arange(pieces)[:, None] + gauss) / pieces).reshape(-1, 1)
        rule = {ng.ET.SEGM: rule_at(t, np.tile(weights, pieces) / pieces)}
        places, weights, basis = body.at_points(rule)
        x = places[:, 0] - shift * (basis @ body.normals[:, 1])
        shares = basis.T @ (weights[:, None] * self._at(x))
        return shares / (basis.T @ weights)[:, None] * body.normals[:, 1:]

    def _at(self, x: Array) -> Array:
        """Returns shares of the nodes at x, array (n, nodes); 0 beyond the boundary."""
        return self.nodes.along.interpolate(np.eye(len(self.nodes.points)), x).T

    def covers(self, x: Array) -> Flags:
        """Returns whether the contact boundary is above x, boolean array (n,)."""
        return self.nodes.along.below(x) >= 0

    def flexibility(self, gaps: Array) -> Array:
        """Returns what forces of the corners add to their gaps, array (corners n, corners n); `gaps`,
        (corners n,), are inf where nothing touches. Raises BadArgument for a corner below no part of the
        contact boundary.
        """
        points = self.body.points
        upwards = self.body.normals[:, 1]
        x = np.concatenate([points[:, 0] - shift * upwards for shift in self.shifts])[np.isfinite(gaps)]
        left, right = self.nodes.points[[0, -1], 0]
        words = (
            f"its contact boundary, from {left:g} to {right:g}, must reach over all corners below the shape, "
            f"from {x.min():g} to {x.max():g}"
        )
        require(self.covers(x).all(), "obstacle", self.obstacle, words)
        return self._shares @ self._matrix @ self._shares.T

    def displacement(self, forces: Array, places: Array) -> Array:
        """Returns the displacement along x2 at places, (k,), from the forces of the corners, array
        (corners n,): (k,).
        """
        return self._at(places) @ (self._matrix @ (self._shares.T @ forces))
