"""Contact of a body in space with a rigid obstacle by projected gradients."""

from functools import cached_property

import numpy as np

from ..contact_solvers import projected_gradients
from ..contact_solvers.corner_forces import closed_corners, least_norm_where_closed
from ..errors import NOT_YET, require
from ..model.corner_geometry import CornerGeometry
from ..model.obstacles import heights
from ..model.solver import SOLVED
from ..model.state import in_space
from ..model.types import Array
from . import factors
from .condensation import Flexibility3D
from .facets import initial_gaps
from .forecast import OnGivenMesh
from .state3d import SurfaceNodes

ROWS = 1024  # of heights of the obstacle that are looked at for what lies between nodes
TILE = 8  # of rows and columns, of which the lowest height counts


class Solver3D(OnGivenMesh):
    """States of a body in space on its condensed contact nodes."""

    most_corners, in_space = None, "nodes"
    no_rtol = "cannot be asked of a body in space: it has no error estimate; compare with a finer mesh"

    @property
    def rate(self):
        return "condensed in space" + " by SuperLU" * (factors.usual is factors.SuperLU)

    @cached_property
    def initial_gaps(self):
        """Array (corners, n); inf where a corner cannot touch."""
        return initial_gaps(self.geometry(self.nodes.points), self.nodes)

    @cached_property
    def low_places(self):
        """x1, x2 and height of the lowest of TILE * TILE places of the obstacle, array (3, k). Half of ROWS
        are evenly spaced over the contact boundary, the others as dense as its nodes.
        """
        even, dense = np.add.outer((0.5, 1.5), np.arange(0, ROWS, 2)) / ROWS
        axes = []
        for x in self.nodes.points.T[:2]:
            rows = *np.quantile((x.min(), x.max()), even), *np.quantile(np.unique(x), dense)
            axes.append(np.sort(rows))
        places = np.array(np.meshgrid(*axes, indexing="ij"))
        values = np.array((*places, heights(self.obstacle, *places)))
        tiles = values.reshape(3, ROWS // TILE, TILE, ROWS // TILE, TILE).swapaxes(2, 3)
        tiles = tiles.reshape(3, -1, TILE**2)
        lowest = np.argmin(tiles[2], axis=1)
        return tiles[:, np.arange(len(lowest)), lowest]

    def solve(self, load, approach, rtol, initial=None):
        self.require_given_mesh(rtol)
        H, residual = Flexibility3D(self.geometry(self.nodes.points).directions, self.nodes), 1e-9
        found = projected_gradients.solve_matrix_free(
            H, self.initial_gaps, load=load, approach=approach, rtol=residual
        )
        require(found.load > 0, "approach", approach, NOT_YET)
        surface = H.surface(found.forces)
        closed = found.gaps <= 2 * max(found.kkt, residual) * np.abs(surface[0]).max()
        return self.solution(
            found.load, found.approach, found.forces, closed, surface, found.kkt, found.iterations
        )

    def solution(self, load, approach, forces, closed, surface, residual, iterations, **how):
        """The SurfaceNodes of corner forces and closed corners, (corners, n), and (u, phi1, phi2) at the
        nodes, (3, n); BadArgument where the obstacle lies in held nodes.
        """
        forces, (u, phi1, phi2) = least_norm_where_closed(forces, closed), surface
        psi, touching = np.array((phi2, -phi1)) * 2 / self.solid.ell, closed_corners(forces, closed)
        found = SurfaceNodes(
            self,
            load,
            approach,
            forces,
            u,
            psi,
            residual,
            iterations,
            self.nodes.body.unknowns,
            closed=touching,
            **how,
        )
        held = ~self.nodes.free["u3"]
        inside = found.inside(self.nodes.points[held], np.vstack((found.displacement, found.psi))[:, held])
        words = f"reaches the rim of the contact boundary, where supports hold u3, by {inside:.3g}"
        require(inside <= SOLVED * np.abs(found.displacement).max(), "obstacle", self.obstacle, words)
        return found

    def state(self, solution):
        points, nodes = solution.nodes.points, solution.nodes
        return in_space(
            solution,
            points,
            nodes.weights,
            x1=points[:, 0],
            x2=points[:, 1],
            triangles=nodes.triangles,
            opposite=None,
        )

    def geometry(self, points: Array) -> CornerGeometry:
        """Returns the corners of blocks at points, array (n, 3)."""
        return self.blocks.under(self.obstacle, points)
