"""Refinement of a user's mesh by recovery.

Gradients averaged in the nodes (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24 (1987) 337) are nearer to
the true ones than those of the elements. The larger part is the estimate:

energy    that of the difference of gradients over the energy of the state
surface   difference of the averaged traction and couple from the nodal p and M/ell, the larger L2 norm over
          that of p, with an edge off by a spacing over sqrt(12), and the obstacle between nodes (`between`)

Quadrilaterals become triangles before they are cut: NGSolve cuts them one way.
"""

import math
from dataclasses import dataclass, replace

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from tqdm.auto import tqdm

from ..errors import NotConverged, out_of_reach
from .between import of_body
from .facets import outward
from .meshes import elements_at

PASSES = 40  # of refinement
MOST = 300_000  # unknowns


@dataclass(frozen=True)
class Recovered:
    """Relative errors of a state by recovery.

    Attributes
    ----------
    energy, surface : float
    of_energy, of_surface : arrays (elements,), with sums energy and surface^2
    """

    energy: float
    surface: float
    of_energy: np.ndarray
    of_surface: np.ndarray

    @property
    def total(self):
        return max(self.energy, self.surface)


def estimate(state):
    """Recovered errors of a MeshSolution."""
    body, fields = state.nodes.body, state.fields
    averaged = _averaged(body, fields)
    # below order 3 errors up to 2.3 times all of the estimate were seen: coarse elements away from the
    # surface have a part that their energy does not show
    factor = 3 if body.order < 3 else 1
    of_energy = factor * _energy_of_difference(body, fields, averaged) / max(state.energy, 1e-300)
    of_surface = factor**2 * _surface(state, averaged)
    return Recovered(float(of_energy.sum()), math.sqrt(of_surface.sum()), of_energy, of_surface)


def _averaged(body, fields):
    """Averaged gradients of u1, u2, psi: three pairs of functions."""
    displacements, rotation = (
        ng.GridFunction(ng.H1(body.mesh, order=order, dim=dim))  # twice as fast as a VectorH1 for each
        for order, dim in ((body.order, 4), (body.order_psi, 2))
    )
    displacements.Set(ng.CF((ng.grad(fields.u1), ng.grad(fields.u2))))
    rotation.Set(ng.grad(fields.psi))
    return [(displacements[0], displacements[1]), (displacements[2], displacements[3]), rotation]


def _energy_of_difference(body, fields, averaged):
    """Array (elements,)."""
    wrong = [ng.CF((mean[0], mean[1])) - ng.grad(field) for mean, field in zip(averaged, fields)]
    gradient = ng.CF((wrong[0][0], wrong[0][1], wrong[1][0], wrong[1][1]), dims=(2, 2))
    density = body.solid.energy(gradient, ng.CF(0), wrong[2])
    return body.integrated(density.Compile(), element_wise=True).NumPy()


def _surface(state, averaged):
    """Squares of what p and M/ell differ from averaged tractions, (elements,)."""
    mesh, nodes, ell = state.nodes.body.mesh, state.nodes, state.nodes.compliance.ell
    above, order = elements_at(mesh, nodes.region), nodes.body.order
    rule = {ng.SEGM: ng.IntegrationRule(ng.SEGM, 2 * order + 3)}
    places, weights, between = nodes.at_points(rule)
    seen = _traction(state, averaged)(mesh.MapToAllElements(rule, nodes.region)).reshape(-1, 2).T
    x, own = places[:, 0], np.array((state.pressures.sum(axis=0), state.micromoment / ell)) @ between.T
    wrong = (own - seen) ** 2 + _beyond(state, state.pressures @ between.T, x)
    weights = weights * state.tamed(x)
    found = np.zeros((2, mesh.ne))
    np.add.at(found, (slice(None), np.repeat(above, order + 2)), weights * wrong)
    # at ends and slope discontinuities of the obstacle averages of singular fields are hardly better than the
    # fields: errors of 2.5 to 4.2 times the difference were seen
    found[:, above[_at(mesh, nodes.region, _named(state)).any(axis=0)]] *= 4**2
    for last, outside, square in _edges(state):
        facet = next(number for number, members in enumerate(nodes.facets) if {last, outside} <= set(members))
        found[:, above[facet]] += square * np.array((1, 1 / 4 if len(state.forces) == 2 else 0))
    np.add.at(found, (slice(None), above), of_body(state))
    return found[np.argmax(found.sum(axis=1))] / max(weights @ own[0] ** 2, 1e-300)  # nothing may touch yet


def _free_edges(state):
    """Whether a corner is closed at one of a node and the next, array (corners, n - 1)."""
    return (state.closed[:, :-1] != state.closed[:, 1:]) & ~state.nodes.apart


def _edges(state):
    """(last closed node, first open one, square of what a shift changes p) of all free edges."""
    x = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(state.nodes.points, axis=0).T))))
    for closed, p, gaps, is_edge in zip(state.closed, state.pressures, state.gaps, _free_edges(state)):
        for i in np.flatnonzero(is_edge):
            last, outside = (i, i + 1) if closed[i] else (i + 1, i)
            before = 2 * last - outside
            # an end of the obstacle, or of the boundary
            if not np.isfinite(gaps[outside]) or not 0 <= before < len(x):
                continue
            way = abs(x[outside] - x[last])
            slope = max((p[before] ** 2 - p[last] ** 2) / abs(x[last] - x[before]), p[last] ** 2 / way)  # K^2
            yield last, outside, slope * way**2 / 12 * (0.5 + 0.25 * math.log(np.count_nonzero(closed) + 1))


def _traction(state, averaged):
    """Pressure -n.(sigma n) and couple m.n/ell on the boundary."""
    solid, n = state.nodes.body.solid, outward(state.nodes.body.mesh)
    gradient = ng.CF((*(averaged[0][i] for i in range(2)), *(averaged[1][i] for i in range(2))), dims=(2, 2))
    sigma = ng.CF(tuple(sum(solid.stress(gradient, state.fields.psi), ())), dims=(2, 2))
    m = ng.CF(solid.couple_stress(averaged[2]))
    return ng.CF((-ng.InnerProduct(n, sigma * n), ng.InnerProduct(m, n) / solid.ell))


def refine_until(solver, load, approach, rtol, progress=False):
    """The solution on a mesh that is cut until the estimate is at most rtol.

    Raises
    ------
    NotConverged
        Beyond MOST unknowns or PASSES passes; `rtol_reached` is the smallest estimate.
    """
    best, found, besides, failed = math.inf, None, "raise the order of the body", None
    with tqdm(desc=f"refined to {rtol:g}", unit=" passes", disable=not progress) as bar:
        for passes in range(1, PASSES + 1):
            try:
                found = solver.at(load, approach, found)
                parts = estimate(found)
            except NotConverged as failure:
                if best == math.inf:
                    raise
                besides, failed = f"take another mesh: on the next one, {failure}", failure
                break
            bar.update()
            bar.set_postfix(estimate=f"{parts.total:.1e}", unknowns=found.unknowns)
            best = min(best, parts.total)
            if parts.total <= rtol:
                return replace(found, error_estimate=parts.total)
            if found.unknowns > MOST:
                break
            triangles = of_triangles(found.nodes.body.mesh) if passes == 1 else None
            # an rtol far away asks for all elements alike, and not for the worst ones first
            solver = solver.on(triangles or _finer(found, parts, max(rtol, parts.total / 1000) / 2))
    besides = "".join(found.beyond()) or besides
    raise out_of_reach(rtol, best, "", besides, passes, load=load, approach=approach) from failed


def marked(found, left):
    """Elements (boolean array) without which each part that is above 2 `left` would be `left`."""
    chosen = np.zeros(len(found.of_energy), bool)
    parts = (found.energy, found.of_energy, left), (found.surface, found.of_surface, left**2)
    for part, added, least in parts:
        if part > 2 * left:
            order = np.argsort(added)
            chosen[order[np.searchsorted(np.cumsum(added[order]), least) :]] = True
    return chosen


def _finer(state, parts, left):
    """The mesh with the `marked` elements cut, those at singular points more often."""
    nodes, chosen, named = state.nodes, marked(parts, left), _named(state)
    mesh, region = nodes.body.mesh, nodes.region
    between = (state.x[1:] + state.x[:-1]) / 2
    x = np.concatenate([named, *(between[is_edge] for is_edge in _free_edges(state))])
    above = elements_at(mesh, region)
    wrong = np.sqrt(parts.of_surface * chosen)[above] * _at(mesh, region, x) / left
    worst = wrong.max(axis=1)
    # where the obstacle names the place the error falls like the square root of the size
    times = np.where(np.arange(len(x)) < len(named), 2 * np.log2(np.maximum(worst, 1.0)), 3)
    times = np.where(worst > 0, np.maximum(times, 3), 0).astype(int)
    finer = ng.Mesh(mesh.ngmesh.Copy())
    cut(finer, chosen)
    for done in range(times.max(initial=0)):
        region = finer.Boundaries(nodes.boundary)
        deeper = np.zeros(finer.ne, bool)
        deeper[elements_at(finer, region)[_at(finer, region, x[times > done]).any(axis=0)]] = True
        cut(finer, deeper)
    return finer.Curve(nodes.body.order)


def _beyond(state, pressures, x):
    """Squares of p and M/ell, (2, n), at x beyond the end of the obstacle."""
    levers, wrong = list(state.law.levers(x).values()), np.zeros((2, len(x)))
    for corner, (left, right) in state.problem.ends.items():
        p = np.where((x < left) | (x > right), pressures[corner], 0.0)
        wrong += np.array((p, levers[corner] / 2 * p)) ** 2
    return wrong


def _named(state):
    """Places x1 under ends and slope discontinuities of the obstacle."""
    problem = state.problem
    x = [place for ends in problem.ends.values() for place in ends]
    x += [place for place, jumps in problem.kinks.items() if any(jumps.values())]
    return np.array([place for place in x if state.x[0] < place < state.x[-1]])


def _at(mesh, region, x):
    """Whether places x, (k,), lie at each facet, about, array (k, facets)."""
    ends = np.array([[mesh[vertex].point[0] for vertex in facet.vertices] for facet in region.Elements()])
    left, right = ends.min(axis=1), ends.max(axis=1)
    return np.abs(x[:, None] - (left + right) / 2) <= 0.55 * (right - left)


def cut(mesh, chosen):
    """Cuts the chosen elements of a mesh, boolean array (elements,)."""
    mesh.SetRefinementFlags(chosen.tolist())
    mesh.Refine()


def of_triangles(mesh):
    """A mesh with quadrilaterals cut along their shorter diagonals; None without any, or with curved
    sides.
    """
    old, curved = mesh.ngmesh, ng.Mesh(mesh.ngmesh.Copy()).Curve(2)
    if not any(element.type == ng.ET.QUAD for element in mesh.Elements()):
        return None
    new, points = netgen.Mesh(dim=2), np.array([vertex.point for vertex in mesh.vertices])
    for point in points:
        new.Add(netgen.MeshPoint(netgen.Pnt(*point, 0)))
    for dim in (2, 1):
        for name in old.GetRegionNames(dim=dim):
            new.AddRegion(name, dim=dim)
    for element in old.Elements1D():
        new.Add(netgen.Element1D(element.vertices, index=element.index))
    for element in old.Elements2D():
        corners = element.vertices
        for part in _triangles(points[[corner.nr - 1 for corner in corners]]):
            new.Add(netgen.Element2D(element.index, [corners[i] for i in part]))
    found = ng.Mesh(new)
    lengths = [ng.Integrate(1.0, each, ng.BND, order=4) for each in (curved, found)]
    return found if math.isclose(*lengths, rel_tol=1e-12) else None


def _triangles(points):
    """Corners of the triangles that an element with corners (n, 2) becomes."""
    if len(points) == 3:
        return ((0, 1, 2),)
    first, second = (np.hypot(*(points[i] - points[i + 2])) for i in range(2))
    return ((0, 1, 2), (0, 2, 3)) if first <= second else ((0, 1, 3), (1, 2, 3))
