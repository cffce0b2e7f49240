"""Contact of a body in space with a rigid obstacle by projected gradients."""

from functools import cached_property

import numpy as np

from ..corners import projected_gradients
from ..corners.surface_law import closed_corners, on_surface
from ..errors import NOT_YET, BadArgument, require
from ..model.solver import SOLVED, Solver
from ..model.state import in_space
from .condensation import Flexibility3D, condensed
from .facets import initial_gaps
from .forecast import body_cost
from .state3d import SurfaceNodes


class Solver3D(Solver):
    """States of a body in space on its condensed contact nodes."""

    most_corners, verifies, in_space = None, True, "nodes"

    def __init__(self, contact, options):
        super().__init__(contact, options)
        self.surface_law = on_surface(self.law)

    @property
    def nodes(self):
        """The condensed body; a law that prescribes psi constrains psi1 and psi2."""
        return condensed(self.body, self.surface_law.clamped)

    @cached_property
    def initial_gaps(self):
        """Array (corners, n); inf where a corner cannot touch."""
        return initial_gaps(self.law, self.nodes, self.obstacle)

    def solve(self, load, approach, rtol, initial=None):
        self._require_given_mesh(rtol)
        H, residual = Flexibility3D(self.directions(self.nodes.points), self.nodes), 1e-9
        found = projected_gradients.solve(H, self.initial_gaps, load=load, approach=approach, rtol=residual)
        if not found.load > 0:
            raise BadArgument("approach", approach, NOT_YET)
        surface = H.surface(found.forces)
        closed = found.gaps <= 2 * max(found.kkt, residual) * np.abs(surface[0]).max()
        level = found.load, found.approach
        return self.solution(*level, found.forces, closed, surface, found.kkt, found.iterations)

    def solution(self, load, approach, forces, closed, surface, residual, iterations, **how):
        """The SurfaceNodes of corner forces and closed corners, (corners, n), and (u, phi1, phi2) at the
        nodes, (3, n); BadArgument where the obstacle lies in held nodes.
        """
        forces, unknowns = self.of_least_norm(forces, closed), self.nodes.body.space.FreeDofs().NumSet()
        u, phi1, phi2 = surface
        psi, touching = np.array((phi2, -phi1)) * 2 / self.solid.ell, closed_corners(forces, closed)
        counts = residual, iterations, int(unknowns)
        found = SurfaceNodes(self, load, approach, forces, u, psi, *counts, closed=touching, **how)
        held = ~self.nodes.free["u3"]
        inside = found.inside(self.nodes.points[held], np.vstack((found.displacement, found.psi))[:, held])
        if inside > SOLVED * np.abs(found.displacement).max():
            raise BadArgument(
                "obstacle",
                self.obstacle,
                f"reaches the rim of the contact boundary, where supports hold u3, by {inside:.3g}",
            )
        return found

    def _require_given_mesh(self, rtol):
        words = "cannot be asked of a body in space: it has no error estimate; compare with a finer mesh"
        require(rtol is None, "rtol", rtol, words)

    def predicted(self, load, approach, rtol):
        self._require_given_mesh(rtol)
        return body_cost("condensed", self.body)

    def state(self, solution):
        nodes = solution.nodes
        given = {"x1": nodes.points[:, 0], "x2": nodes.points[:, 1], "triangles": nodes.triangles}
        return in_space(solution, nodes.points, nodes.weights, opposite=None, **given)

    def directions(self, points):
        """(1, lever) of each corner at points, array (corners, 3, n)."""
        levers = -2 * self.law.arms(points, np.zeros_like(points) + (0.0, 0.0, 1.0))[..., :2]
        return np.concatenate((np.ones_like(levers[..., :1]), levers), axis=2).swapaxes(1, 2)

    def of_least_norm(self, forces, closed):
        """The forces of least norm with the same resultants."""
        if len(forces) == 1:
            return forces
        for axis, field in ((0, "psi2"), (1, "psi1")):
            pairs, both = forces.reshape(2, 2, -1), closed.reshape(2, 2, -1).all(axis=axis, keepdims=True)
            mean = pairs.mean(axis=axis, keepdims=True)
            forces = np.where(both & ~self.nodes.free[field], mean, pairs).reshape(forces.shape)
        return self.surface_law.of_least_norm(forces, closed)
