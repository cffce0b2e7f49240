"""Refinement of a user's mesh by recovery.

Gradients averaged in the nodes (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24 (1987) 337) are nearer to
the true ones than those of the elements. The larger part is the estimate:

energy    that of the difference of gradients over the energy of the state
surface   difference of the averaged traction and couple from the nodal p and M/ell, the larger L2 norm over
          that of p, with an edge off by a spacing over sqrt(12), and what nodes miss of the obstacle

Gradients and moduli jump between the solids of a body: each region has averages of its own.
Quadrilaterals become triangles before they are cut: NGSolve cuts them one way.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.corner_geometry import Blocks
from ..model.intervals import contains
from ..model.problem import Problem
from ..model.progress import counted
from ..model.refinement import RefinementLevel, refine
from ..model.types import Array, Flags, Integers
from . import contact_term
from .body import Body
from .body_fields import BodyFields
from .facet_rules import outward
from .mesh_cuts import cut, facets_at, of_triangles, too_small
from .mesh_solution import MeshSolution
from .meshes import elements_at
from .off_node_violations import missed_by_nodes

PASSES = 40  # of refinement
MOST_UNKNOWNS = 300_000
SOON = 40_000  # unknowns, with which no mesh is cut any more if rtol is out of reach: some seconds


@dataclass(frozen=True)
class Recovered:
    """Relative errors of a solution by recovery.

    Attributes
    ----------
    of_energy, of_surface : arrays (elements,), with sums energy and surface^2
    """

    of_energy: Array
    of_surface: Array

    @property
    def parts(self) -> Array:
        """Those of energy and surface, array (2,)."""
        return np.array((self.of_energy.sum(), math.sqrt(self.of_surface.sum())))

    @property
    def total(self) -> float:
        return float(self.parts.max())


def estimate(solution: MeshSolution) -> Recovered:
    """Returns the Recovered errors of a MeshSolution."""
    body = solution.nodes.body
    averaged = _averaged(body, solution.fields)
    # below order 3 errors up to 2.3 times all of the estimate were seen: coarse elements away from the
    # surface have a part that their energy does not show
    factor = 3 if body.order < 3 else 1
    difference = _energy_of_difference(body, solution.fields, averaged)
    of_energy = factor * difference / max(solution.energy, 1e-300)
    return Recovered(of_energy, factor**2 * _surface(solution, averaged))


def _averaged(body: Body, fields: BodyFields) -> list[Any]:
    """Returns averaged gradients of u1, u2 and, where there is one, psi: pairs of functions."""
    groups: list[Any] = [((fields.u1, fields.u2), body.order)]
    if body.rotates:
        groups.append(((fields.psi,), body.order_psi))
    averaged = []
    for functions, order in groups:
        gradients = ng.CF(tuple(map(ng.grad, functions)))
        slopes = body.by_region(lambda region: _average(body.mesh, gradients, order, region))
        averaged += [(slopes[2 * i], slopes[2 * i + 1]) for i in range(len(functions))]
    return averaged


def _average(mesh: Any, gradients: Any, order: int, region: Any) -> Any:
    """Returns the average of gradients in the nodes of a region, a function there."""
    # twice as fast as a VectorH1 for each
    space = ng.H1(mesh, order=order, dim=gradients.dim, definedon=region)
    slopes = ng.GridFunction(ng.Compress(space))
    slopes.Set(gradients, definedon=region)
    return slopes


def _energy_of_difference(body: Body, fields: BodyFields, averaged: Sequence[Any]) -> Array:
    """Returns the energy of averaged gradients less those of the fields, array (elements,)."""
    slopes = [ng.CF((mean[0], mean[1])) - ng.grad(field) for mean, field in zip(averaged, fields)]
    density = contact_term.energy(body.moduli, body.strains([ng.CF(0)] * len(slopes), slopes))
    return body.integrated(density.Compile(), element_wise=True).NumPy()


def _surface(solution: MeshSolution, averaged: Sequence[Any]) -> Array:
    """Returns squares of what p and M/ell differ from averaged tractions, (elements,)."""
    nodes = solution.nodes
    mesh = nodes.body.mesh
    above = elements_at(mesh, nodes.region)
    order = nodes.body.order
    rule = {ng.SEGM: ng.IntegrationRule(ng.SEGM, 2 * order + 3)}
    places, weights, basis = nodes.at_points(rule)
    x = places[:, 0]
    traction = _traction(solution, averaged)(mesh.MapToAllElements(rule, nodes.region)).reshape(-1, 2).T
    nodal = np.array((solution.pressures.sum(axis=0), solution.micromoment / nodes.compliance.ell))
    surface = nodal @ basis.T
    beyond = pressed_beyond_ends(solution.solver.blocks, solution.sampled, solution.pressures @ basis.T, x)
    weights = weights * solution.norm_weights(x)
    squares = np.zeros((2, mesh.ne))
    elements = np.repeat(above, order + 2)
    for row, density in zip(squares, (surface - traction) ** 2 + beyond):
        np.add.at(row, elements, weights * density)
    # at ends and slope discontinuities of the obstacle averages of singular fields are hardly better than the
    # fields: errors of 2.5 to 4.2 times the difference were seen
    squares[:, above[facets_at(mesh, nodes.region, _singular_places(solution)).any(axis=0)]] *= 4**2
    facets, of_edges = _edges(solution)
    np.add.at(squares[0], above[facets], of_edges)
    if len(solution.forces) == 2:  # of M/ell
        np.add.at(squares[1], above[facets], of_edges / 4)
    missed = missed_by_nodes(solution)
    for row in squares:
        np.add.at(row, above, missed)
    largest = squares[np.argmax(squares.sum(axis=1))]
    return largest / max(weights @ surface[0] ** 2, 1e-300)  # nothing may touch yet


def _free_edges(solution: MeshSolution) -> Flags:
    """Returns whether a corner is closed at one of a node and the next, array (corners, n - 1)."""
    return (solution.closed[:, :-1] != solution.closed[:, 1:]) & ~solution.nodes.interrupted


def _edges(solution: MeshSolution) -> tuple[Integers, Array]:
    """Returns numbers of the facets with a free edge, and squares of what its shift changes p, arrays
    (k,).
    """
    points = solution.nodes.points
    corner, i = np.nonzero(_free_edges(solution))
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


def _traction(solution: MeshSolution, averaged: Sequence[Any]) -> Any:
    """Returns the pressure -n.(sigma n) and the couple m.n/ell on the boundary, of averaged gradients."""
    body = solution.nodes.body
    n = ng.CF((outward(body.mesh), 0))
    gamma, kappa = body.strains(solution.fields.components, averaged)
    sigma = ng.BoundaryFromVolumeCF(contact_term.stress(body.moduli, gamma))
    m = ng.BoundaryFromVolumeCF(contact_term.couple_stress(body.moduli, kappa))
    return ng.CF((-ng.InnerProduct(n, sigma * n), (m * n)[2] / body.solid.ell))


def refine_until(solver: Any, load: float | None, approach: float | None, rtol: float) -> MeshSolution:
    """Returns the solution on a mesh that is cut until the estimate is at most rtol.

    Raises
    ------
    NotConverged
        Beyond MOST_UNKNOWNS or PASSES passes, beyond SOON if MOST_UNKNOWNS would miss rtol, or if PASSES
        would; `rtol_reached` is 1.4 times the smallest estimate, or what a few more unknowns leave.
    """
    passed: list[tuple[int, Array]] = []

    def refusal(
        best: RefinementLevel[MeshSolution], last: RefinementLevel[MeshSolution], failure: NotConverged | None
    ) -> NotConverged:
        besides = "raise the order of the body"
        if failure:
            besides = f"take another mesh: on the next one, {failure}"
        besides = "".join(last.result.beyond()) or besides
        passes = len(passed) + (failure is not None)  # the one that failed is none of those that passed
        return out_of_reach(
            rtol, best.error, "", besides, passes, load=load, approach=approach, margin=last.margin
        )

    return refine(_meshes(solver, load, approach, rtol, passed), rtol, refusal).result


def _meshes(
    solver: Any, load: float | None, approach: float | None, rtol: float, passed: list[tuple[int, Array]]
) -> Iterator[RefinementLevel[MeshSolution]]:
    """Yields the RefinementLevels of meshes that are cut more and more, and adds their (unknowns, parts of
    the estimate) to `passed`.
    """
    solution = None
    mesh = solver.body.mesh
    for number in range(1, PASSES + 1):
        try:
            solver = solver.on(mesh) if number > 1 else solver
            solution = solver.solution_at(load, approach, solution)
            errors = estimate(solution)
        except BadArgument as failure:
            if not passed:
                raise
            raise NotConverged(str(failure)) from failure
        unknowns = solution.unknowns
        counted(error=errors.total, unknowns=unknowns)
        passed.append((unknowns, errors.parts))
        far = unknowns > SOON and cannot_reach(rtol, passed) and cannot_reach(rtol, passed[-2:])
        stuck = errors.of_surface[too_small(mesh)].sum() > rtol**2
        stalled = _stalled(rtol, [parts.max() for _, parts in passed])
        yield RefinementLevel(
            replace(solution, error_estimate=errors.total),
            errors.total,
            cannot_reach=unknowns > MOST_UNKNOWNS or far or stuck or stalled,
            # a few more unknowns halve what is left, but at sharp places of the obstacle
            margin=0.7 if far and not len(_singular_places(solution)) else 1.4,
        )
        triangles = of_triangles(mesh) if number == 1 else None
        # a tenth at a time: for much less all elements are cut alike, and not the worst ones first
        mesh = triangles or _finer(solution, errors, max(rtol, errors.total / 10) / 2)
        if mesh.ne == solution.nodes.body.mesh.ne:  # all that should be cut is too small
            break


def cannot_reach(rtol: float, passed: Sequence[tuple[int, Array]]) -> bool:
    """Returns whether a part of the estimate misses rtol with MOST_UNKNOWNS, at twice the order from the
    first to the last of passes, [(unknowns, parts of the estimate)].
    """
    unknowns, coarse = passed[0]
    last_unknowns, fine = passed[-1]
    if (
        last_unknowns <= unknowns
    ):  # triangles of quadrilaterals may have as many, and a first pass none before
        return False
    ahead = 2 * math.log(MOST_UNKNOWNS / last_unknowns) / math.log(last_unknowns / unknowns)
    return bool(np.any(fine * (fine / np.maximum(coarse, 1e-300)) ** ahead > rtol))


def _stalled(rtol: float, totals: Sequence[float]) -> bool:
    """Returns whether the estimate misses rtol even if it fell in each pass left by 1.5 times the order of
    the best of the last ten. Ten halve an element to a thousandth: smaller features of an obstacle stay
    unseen.
    """
    last = totals[-1 - PASSES // 4 :]
    best = min((fine / coarse for coarse, fine in zip(last, last[1:])), default=0.0)
    return len(totals) > PASSES // 4 and totals[-1] * best ** (1.5 * (PASSES - len(totals))) > rtol


def marked(errors: Recovered, left: float) -> Flags:
    """Returns elements, boolean array (elements,), without which energy and surface would be `left`,
    about.
    """
    shares = errors.of_energy / left + errors.of_surface / left**2
    order = np.argsort(shares)
    chosen = np.zeros(len(shares), bool)
    chosen[order[np.searchsorted(np.cumsum(shares[order]), 1) :]] = True
    return chosen


def _finer(solution: MeshSolution, errors: Recovered, left: float) -> Any:
    """Returns the mesh with the `marked` elements cut, those at singular points three times more, or nine
    times where the obstacle names the place: there the error falls like the square root of the size.
    """
    body = solution.nodes.body
    region = solution.nodes.region
    chosen = marked(errors, left)
    middles = (solution.x[1:] + solution.x[:-1]) / 2
    singular = _singular_places(solution)
    x = np.concatenate([singular, *(middles[is_edge] for is_edge in _free_edges(solution))])
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


def _singular_places(solution: MeshSolution) -> Array:
    """Returns places x1, (k,), under ends, steps and slope discontinuities of the obstacle."""
    problem = solution.sampled
    kinks = [place for place, jumps in problem.kinks.items() if any(jumps.values())]
    x = np.append(np.add.outer(solution.ends, problem.shifts), kinks)
    return x[(x > solution.x[0]) & (x < solution.x[-1])]
