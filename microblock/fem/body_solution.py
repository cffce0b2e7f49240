"""A contact state of a body on a mesh: pressures, micromoment, zones, energy, fields, error estimate, a
picture.

Nodes lie on a straight or curved contact boundary in the order of x1; nothing is mirrored, the load is that
of the body.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..corners.nodal import NodalSolution
from ..errors import BadArgument, at_most
from ..model.zones import distance_to_ends
from . import between, meshes
from .mesh_fields import BelowOnMesh

DEEP = 0.1  # of the body's depth, by which an obstacle moves in small strain
MISSED = 0.03  # of the pressure: what nodes miss of the obstacle, from which on a state says so


@dataclass(frozen=True, eq=False, repr=False)
class BodySolution(BelowOnMesh, NodalSolution):
    """A solution on the contact nodes of a condensed body.

    Attributes
    ----------
    error_estimate : float, relative error of pressures and fields (`recovery.estimate`); None on a mesh that
        prescribed
    """

    error_estimate: float | None = None

    method = "condensed"

    def counter_displacement(self, x):
        """As of every solution."""
        counter = self.solver.counter
        if counter is None:
            return np.zeros_like(x)
        found, there = np.full_like(x, np.inf), counter.reaches(x)
        found[there] = counter.displacement(self.forces.ravel(), x[there])
        return found

    @property
    def nodes(self):
        """The body condensed to its contact nodes."""
        return self.solver.nodes

    @property
    def unknowns(self):
        return self.nodes.unknowns

    def remarks(self):
        """Where nodes are few or miss features of the obstacle, and where elements do not resolve the layer
        below the contact.

        All of it on a mesh that was prescribed alone: an estimate speaks for itself.
        """
        coarse = (
            []
            if self.error_estimate is not None
            else self._unresolved() + self.locking(self.nodes) + self._missed
        )
        return self._far_inside() + self.few_nodes("ask for rtol=") + coarse

    def _far_inside(self):
        """What is wrong, in a list of sentences, where the obstacle has moved too far into the body."""
        moved = self.approach - self.gaps.min()
        depth = np.ptp([vertex.point[1] for vertex in self.nodes.body.mesh.vertices])
        words = f"the obstacle presses {moved:.2g} deep into a body {depth:.2g} deep: beyond small strain"
        return [words] * bool(moved >= DEEP * depth)

    @cached_property
    def _missed(self):
        """What is wrong, in a list of sentences, where the obstacle has features that the nodes do not
        see.
        """
        try:
            square = between.of_body(self).sum()
        except BadArgument as failure:
            return [f"between the nodes the obstacle was not looked at: {failure}"]
        share = np.sqrt(square / (self.weights @ self.pressures.sum(axis=0) ** 2))
        return (
            []
            if share < MISSED
            else [
                "the obstacle has features shorter than the elements, worth "
                f"{share:.1g} of the pressure: cut the elements below them, or ask for an rtol"
            ]
        )

    def _unresolved(self):
        body, closed = self.nodes.body, self.closed.any(axis=0)
        numbers, across = meshes.thicknesses(body.mesh, self.nodes.region)
        pressed = np.array([closed[members].any() for members in self.nodes.facets])
        orders = (
            np.full(body.mesh.ne, min(body.order, body.order_psi))
            if body.element_orders is None
            else body.element_orders
        )
        for order in np.unique(orders[numbers[pressed]]):
            longest = meshes.longest_element(self.problem.solid, int(order))
            if across[pressed & (orders[numbers] == order)].max() > longest:
                return [
                    f"elements of order {order} that reach deeper than {at_most(longest)} below the "
                    "contact do not resolve the layer: cut them, take a higher order, or ask for an rtol"
                ]
        return []

    @property
    def micromoment(self):
        """M of (29); where the law or supports of the contact boundary hold psi, the reaction to it."""
        if "psi" in self.nodes.body.held_on(self.nodes.boundary):
            return self.nodes.reaction(self.fields) / self.weights
        return super().micromoment

    @cached_property
    def fields(self):
        """Displacement, microrotation and stresses as NGSolve functions, by one back-substitution."""
        return self.nodes.fields(*np.split(self._loads, 2))

    def interpolated(self, values, x):
        """Values at the nodes, between them at x, array (n,): on each facet the polynomial through its
        nodes.
        """
        return self.nodes.interpolate(values, x)

    def tamed(self, x):
        """1; near ends of the obstacle, where the pressure is infinite, the distance from them over half of
        its width.
        """
        shifts = self.law.shifts(self.compliance.ell)
        return distance_to_ends(x, getattr(self.solver.obstacle, "ends", ()), shifts)
