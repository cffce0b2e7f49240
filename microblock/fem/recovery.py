"""Refinement of a user's mesh by recovery.

Gradients averaged in the nodes (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24 (1987) 337) are nearer to
the true ones than those of the elements. The larger part is the estimate:

energy    that of the difference of gradients over the energy of the state
surface   difference of the averaged traction and couple from the nodal p and M/ell, the larger L2 norm over
          that of p, with an edge off by a spacing over sqrt(12), and what nodes miss of the obstacle

Gradients and moduli jump between the solids of a body: each region has averages of its own. What depends on
the dimension is that of `PlaneBoundary` and `SpaceBoundary`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import ngsolve as ng
import numpy as np

from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.progress import counted
from ..model.refinement import RefinementLevel, refine
from ..model.types import Array, Flags
from . import contact_term
from .body import Body
from .body_fields import BodyFields
from .facet_rules import at_rules, outward
from .mesh_cuts import too_small
from .meshes import elements_at
from .plane_boundary import PlaneBoundary
from .space_boundary import SpaceBoundary

PASSES = 40  # of refinement


@dataclass(frozen=True)
class Recovered:
    """Relative errors of a solution by recovery.

    Attributes
    ----------
    of_energy, of_surface : arrays (elements,), with sums energy and surface^2
    of_second : (float, float), parts of both sums that a second body has
    """

    of_energy: Array
    of_surface: Array
    of_second: tuple[float, float] = (0.0, 0.0)

    @property
    def parts(self) -> Array:
        """Those of energy and surface, array (2,)."""
        energy, surface = self.of_second
        return np.array((self.of_energy.sum() + energy, math.sqrt(self.of_surface.sum() + surface)))

    @property
    def total(self) -> float:
        return float(self.parts.max())


def estimate(solution: Any) -> Recovered:
    """Returns the Recovered errors of a MeshSolution or SurfaceNodes."""
    body = solution.nodes.body
    boundary = _boundary(solution)
    averaged = _averaged(body, solution.fields)
    difference = _energy_of_difference(body, solution.fields, averaged)
    safety = boundary.safety(body.order)
    of_energy = safety * difference / max(solution.energy, 1e-300)
    of_surface = safety**2 * _surface(solution, boundary, averaged)
    return Recovered(of_energy, of_surface, _of_second(solution, boundary))


def _of_second(solution: Any, boundary: PlaneBoundary | SpaceBoundary) -> tuple[float, float]:
    """Returns the parts of a second body: the energy of averaged gradients less its own, over that of both
    bodies, and the square of what averaged tractions differ from the pressures upon it, over that of these.
    """
    fields = solution.fields.second
    if fields is None:
        return 0.0, 0.0
    body = fields.body
    averaged = _averaged(body, fields)
    energy = _energy_of_difference(body, fields, averaged).sum() / max(solution.energy, 1e-300)
    region = body.boundary(body.contact)
    facets = list(region.Elements())
    rules = _rules(body)
    values = _tractions(fields, averaged)(body.mesh.MapToAllElements(rules, region)).reshape(-1, 10)
    places, weights, normals = at_rules(body.mesh, facets, [rules[facet.type] for facet in facets])
    pressure = solution.solver.counter.pressures(solution.pressures, places, normals)
    square = weights @ (pressure - values[:, 0]) ** 2 / max(weights @ pressure**2, 1e-300)
    safety = boundary.safety(body.order)
    return float(safety * energy), float(safety**2 * square)


def _rules(body: Body) -> dict[Any, Any]:
    """Returns {kind of a facet: rule} that integrates squares of tractions."""
    return {kind: ng.IntegrationRule(kind, 2 * body.order + 3) for kind in (ng.SEGM, ng.TRIG, ng.QUAD)}


def _boundary(solution: Any) -> PlaneBoundary | SpaceBoundary:
    if solution.nodes.dim == 3:
        return SpaceBoundary(solution)
    return PlaneBoundary(solution)


def _averaged(body: Body, fields: BodyFields) -> list[Any]:
    """Returns averaged gradients of the components of u and, where there is one, psi: (dim,) functions."""
    components = dict(zip(body.names, fields))
    groups: list[Any] = [([f for name, f in components.items() if name.startswith("u")], body.order)]
    if body.rotates:
        groups.append(([f for name, f in components.items() if name.startswith("psi")], body.order_psi))
    dim = body.mesh.dim
    averaged = []
    for functions, order in groups:
        gradients = ng.CF(tuple(map(ng.grad, functions)))
        slopes = body.by_region(lambda region: _average(body.mesh, gradients, order, region))
        averaged += [tuple(slopes[dim * i + j] for j in range(dim)) for i in range(len(functions))]
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
    slopes = [ng.CF(mean) - ng.grad(field) for mean, field in zip(averaged, fields)]
    density = contact_term.energy(body.moduli, body.strains([ng.CF(0)] * len(slopes), slopes))
    return body.integrated(density.Compile(), element_wise=True).NumPy()


def _surface(solution: Any, boundary: PlaneBoundary | SpaceBoundary, averaged: Sequence[Any]) -> Array:
    """Returns squares of what p, M/ell and q/f of friction differ from averaged tractions, (elements,)."""
    nodes = solution.nodes
    mesh = nodes.body.mesh
    above = elements_at(mesh, nodes.region)
    rules = _rules(nodes.body)
    places, weights, _, basis = nodes.at_points([rules[facet.type] for facet in nodes.region.Elements()])
    values = _tractions(solution.fields, averaged)(mesh.MapToAllElements(rules, nodes.region))
    tractions = values.reshape(-1, 10).T
    surface = boundary.nodal @ basis.T
    recovered = _recovered(boundary, tractions, surface[0], solution.solver.law.friction)
    borders = np.cumsum([len(field) for field in recovered])[:-1]
    by_field = np.split((surface - np.vstack(recovered)) ** 2, borders)
    beyond = boundary.beyond_ends(places, tractions[4:7], solution.pressures @ basis.T)
    weights = weights * boundary.norm_weights(places)
    squares = np.zeros((len(recovered), mesh.ne))
    elements = np.repeat(above, [len(rules[facet.type]) for facet in nodes.region.Elements()])
    for row, difference, square in zip(squares, by_field, (*beyond, beyond[0])):
        np.add.at(row, elements, weights * (difference.sum(axis=0) + square))
    squares[:, above[boundary.singular]] *= 4**2
    facets, of_edges = boundary.edges()
    edges = np.zeros_like(squares)
    edges[::2] = np.bincount(above[facets], of_edges, mesh.ne)  # of p, and of q/f, which is no larger
    if len(solution.forces) > 1:  # of M/ell
        edges[1] = edges[0] / 4
    squares = boundary.with_edges(squares, edges)
    missed = boundary.missed()
    for row in squares:
        np.add.at(row, above, missed)
    # nothing may touch yet
    return squares[np.argmax(squares.sum(axis=1))] / max(weights @ surface[0] ** 2, 1e-300)


def _recovered(
    boundary: PlaneBoundary | SpaceBoundary, tractions: Array, pressure: Array, friction: float
) -> list[Array]:
    """Returns p, M/ell and with friction q/f, arrays (k, n), of averaged tractions, array (10, n), at points
    with a computed pressure, array (n,).
    """
    traction, couple, normals, force = np.split(tractions, (1, 4, 7))
    recovered = [traction, boundary.along_sides(couple, normals)]
    if friction:
        shear = boundary.along_sides(force, normals) / friction
        # the true one is within p: what is nearest there is nearer to it
        sizes = np.maximum(np.hypot(*shear), np.finfo(float).tiny)
        recovered.append(shear * np.clip(pressure / sizes, 0.0, 1.0))
    return recovered


def _tractions(fields: BodyFields, averaged: Sequence[Any]) -> Any:
    """Returns the pressure -n.(sigma n) on the boundary, the couple m n/ell of averaged gradients, n, and
    sigma n.
    """
    body = fields.body
    normal = outward(body.mesh)
    n = ng.CF((*(normal[axis] for axis in range(body.mesh.dim)), 0)[:3])
    gamma, kappa = body.strains(fields.components, averaged)
    sigma = ng.BoundaryFromVolumeCF(contact_term.stress(body.moduli, gamma))
    m = ng.BoundaryFromVolumeCF(contact_term.couple_stress(body.moduli, kappa))
    return ng.CF((-ng.InnerProduct(n, sigma * n), m * n / body.solid.ell, n, sigma * n))


def refine_until(solver: Any, load: float | None, approach: float | None, rtol: float) -> Any:
    """Returns the solution on a mesh that is cut until the estimate is at most rtol.

    Raises
    ------
    NotConverged
        Beyond the most unknowns of the boundary or PASSES passes, beyond what is soon if the most would miss
        rtol, or if PASSES would; `rtol_reached` is 1.4 times the smallest estimate, or what a few more
        unknowns leave.
    """
    passed: list[tuple[int, Array]] = []

    def refusal(
        best: RefinementLevel[Any], last: RefinementLevel[Any], failure: NotConverged | None
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
) -> Iterator[RefinementLevel[Any]]:
    """Yields the RefinementLevels of meshes that are cut more and more, and adds their (unknowns, parts of
    the estimate) to `passed`.
    """
    solution = None
    mesh = solver.body.mesh
    for number in range(1, PASSES + 1):
        try:
            if solution is None:
                solution = solver.solution_at(load, approach)
            else:
                solver = solver.on(mesh)
                solution = solver.refined_at(load, approach, solution)
            errors = estimate(solution)
            boundary = _boundary(solution)
        except BadArgument as failure:
            if not passed:
                raise
            raise NotConverged(str(failure)) from failure
        unknowns = solution.unknowns
        counted(error=errors.total, unknowns=unknowns)
        passed.append((unknowns, errors.parts))
        far = unknowns > boundary.soon and all(
            cannot_reach(rtol, some, boundary.most_unknowns) for some in (passed, passed[-2:])
        )
        stuck = errors.of_surface[too_small(mesh)].sum() > rtol**2
        stalled = _stalled(rtol, [parts.max() for _, parts in passed])
        yield RefinementLevel(
            solution.changed(error_estimate=errors.total),
            errors.total,
            cannot_reach=unknowns > boundary.most_unknowns or far or stuck or stalled,
            # a few more unknowns halve what is left, but at sharp places of the obstacle
            margin=0.7 if far and not boundary.is_singular else 1.4,
        )
        # not all at a time: for much less all elements are cut alike, and not the worst ones first
        chosen = marked(errors, max(rtol / 2, errors.total / boundary.fall))
        mesh = (number == 1 and boundary.of_simplices()) or boundary.finer(chosen)
        if mesh.ne == solution.nodes.body.mesh.ne:  # all that should be cut is too small
            break


def cannot_reach(rtol: float, passed: Sequence[tuple[int, Array]], most_unknowns: int) -> bool:
    """Returns whether a part of the estimate misses rtol with the most unknowns, at twice the order from the
    first to the last of passes, [(unknowns, parts of the estimate)].
    """
    unknowns, coarse = passed[0]
    last_unknowns, fine = passed[-1]
    if (
        last_unknowns <= unknowns
    ):  # triangles of quadrilaterals may have as many, and a first pass none before
        return False
    ahead = 2 * math.log(most_unknowns / last_unknowns) / math.log(last_unknowns / unknowns)
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
