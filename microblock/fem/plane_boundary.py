"""What errors on a contact boundary in the plane are made of, beside those of gradients.

Quadrilaterals become triangles before they are cut: NGSolve cuts them one way.
"""

from typing import Any

import ngsolve as ng
import numpy as np

from ..model.corner_geometry import Blocks
from ..model.intervals import contains
from ..model.problem import Problem
from ..model.types import Array, Flags, Integers
from .mesh_cuts import cut, facets_at, of_triangles
from .mesh_solution import MeshSolution
from .meshes import elements_at
from .off_node_violations import missed_by_nodes


class PlaneBoundary:
    """The contact boundary of a MeshSolution.

    Attributes
    ----------
    most_unknowns : int, of a mesh
    soon : int, unknowns with which no mesh is cut any more if rtol is out of reach: some seconds
    fall : float, the estimate over that of the elements which a pass leaves as they are
    """

    most_unknowns = 300_000
    soon = 40_000
    fall = 20

    def __init__(self, solution: MeshSolution) -> None:
        self.solution = solution

    @property
    def nodal(self) -> Array:
        """p and M/ell at the nodes, array (2, n)."""
        solution = self.solution
        moment = solution.micromoment / solution.nodes.compliance.ell
        return np.array((solution.pressures.sum(axis=0), moment))

    def norm_weights(self, places: Array) -> Array:
        """Returns the weights of the norm at places, (k, 2): array (k,)."""
        return self.solution.norm_weights(places[:, 0])

    def along_sides(self, couple: Array, normals: Array) -> Array:
        """Returns the components of couples, array (3, k), that M has, (1, k)."""
        return couple[2:]

    def beyond_ends(self, places: Array, normals: Array, pressures: Array) -> Array:
        """Returns squares of p and M/ell, (2, k), at places, (k, 2), beyond the ends of the obstacle, from
        pressures of the corners, (corners, k).
        """
        solution = self.solution
        return pressed_beyond_ends(solution.solver.blocks, solution.sampled, pressures, places[:, 0])

    def safety(self, order: int) -> float:
        """Returns the factor of the estimate of a body of this order: below 3 errors up to 2.3 times all of
        the estimate were seen, as coarse elements away from the surface have a part that their energy does
        not show.
        """
        return 3 if order < 3 else 1

    def with_edges(self, differences: Array, edges: Array) -> Array:
        """Returns squares of errors, (rows, elements), from those of averaged tractions and of free edges."""
        return differences + edges

    @property
    def singular(self) -> Flags:
        """Facets at ends and slope discontinuities of the obstacle, array (facets,): averages of singular
        fields are hardly better than the fields, and errors of 2.5 to 4.2 times the difference were seen.
        """
        nodes = self.solution.nodes
        return np.asarray(facets_at(nodes.body.mesh, nodes.region, self._singular_places).any(axis=0))

    @property
    def is_singular(self) -> bool:
        return len(self._singular_places) > 0

    def missed(self) -> Array:
        """Returns squares of pressures that the nodes miss, array (facets,)."""
        return missed_by_nodes(self.solution)

    @property
    def _free_edges(self) -> Flags:
        """Whether a corner is closed at one of a node and the next, array (corners, n - 1)."""
        solution = self.solution
        return (solution.closed[:, :-1] != solution.closed[:, 1:]) & ~solution.nodes.interrupted

    def edges(self) -> tuple[Integers, Array]:
        """Returns numbers of the facets with a free edge, and squares of what its shift changes p, arrays
        (k,).
        """
        solution = self.solution
        points = solution.nodes.points
        corner, i = np.nonzero(self._free_edges)
        last = np.where(solution.closed[corner, i], i, i + 1)
        outside = 2 * i + 1 - last
        before = 2 * last - outside
        # not an end of the obstacle, or of the boundary
        free = np.isfinite(solution.gaps[corner, outside]) & (before >= 0) & (before < len(points))
        corner, i, last, outside, before = np.array((corner, i, last, outside, before))[:, free]
        to_outside = np.hypot(*(points[outside] - points[last]).T)
        to_inside = np.hypot(*(points[before] - points[last]).T)
        p = solution.pressures[corner, last] ** 2
        q = solution.pressures[corner, before] ** 2
        slopes = np.maximum((q - p) / to_inside, p / to_outside)  # K^2
        counts = np.count_nonzero(solution.closed, axis=1)[corner]
        weights = np.maximum(*solution.norm_weights(solution.x)[[last, outside]])
        squares = weights * slopes * to_outside**2 / 12 * (0.5 + 0.25 * np.log(counts + 1))
        return solution.nodes.joined[i], squares

    def of_simplices(self) -> Any:
        """Returns the mesh with quadrilaterals cut into triangles; None without any."""
        return of_triangles(self.solution.nodes.body.mesh)

    def finer(self, chosen: Flags) -> Any:
        """Returns the mesh with the chosen elements cut, those at singular points three times more, or nine
        times where the obstacle names the place: there the error falls like the square root of the size.
        """
        solution = self.solution
        body = solution.nodes.body
        region = solution.nodes.region
        middles = (solution.x[1:] + solution.x[:-1]) / 2
        singular = self._singular_places
        x = np.concatenate([singular, *(middles[is_edge] for is_edge in self._free_edges)])
        times = np.where(np.arange(len(x)) < len(singular), 9, 3)
        times *= (facets_at(body.mesh, region, x) & chosen[elements_at(body.mesh, region)]).any(axis=1)
        finer = ng.Mesh(body.mesh.ngmesh.Copy())
        cut(finer, chosen)
        for done in range(times.max(initial=0)):
            region = finer.Boundaries(body.contact)
            deeper = np.zeros(finer.ne, bool)
            deeper[elements_at(finer, region)[facets_at(finer, region, x[times > done]).any(axis=0)]] = True
            cut(finer, deeper)
        return finer.Curve(body.order)

    @property
    def _singular_places(self) -> Array:
        """Places x1, (k,), under ends, steps and slope discontinuities of the obstacle."""
        solution = self.solution
        problem = solution.sampled
        kinks = [place for place, jumps in problem.kinks.items() if any(jumps.values())]
        x = np.append(np.add.outer(solution.ends, problem.shifts), kinks)
        return x[(x > solution.x[0]) & (x < solution.x[-1])]


def pressed_beyond_ends(blocks: Blocks, problem: Problem, pressures: Array, x: Array) -> Array:
    """Returns squares of p and M/ell, (2, n), at x, (n,), beyond the ends of the obstacle, from pressures of
    the corners, (corners, n).
    """
    levers = blocks.levers(x)
    squares = np.zeros((2, len(x)))
    for corner in problem.ends:
        p = np.where(contains(problem.pieces_of(corner), x), 0.0, pressures[corner])
        squares += np.array((p, levers[corner] / 2 * p)) ** 2
    return squares
