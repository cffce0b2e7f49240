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

from ..errors import BadArgument, NotConverged, out_of_reach
from ..model.intervals import contains
from ..model.progress import counted
from ..model.refinement import RefinementLevel, refine
from ..model.types import Flags
from . import contact_term
from .facet_rules import outward
from .meshes import elements_at
from .off_node_violations import missed_by_nodes

PASSES = 40  # of refinement
MOST_UNKNOWNS = 300_000  # unknowns
SOON = 40_000  # unknowns, with which no mesh is cut any more if rtol is out of reach: some seconds


@dataclass(frozen=True)
class Recovered:
    """Relative errors of a state by recovery.

    Attributes
    ----------
    of_energy, of_surface : arrays (elements,), with sums energy and surface^2
    """

    of_energy: np.ndarray
    of_surface: np.ndarray

    @property
    def parts(self):
        """Those of energy and surface, array (2,)."""
        return np.array((self.of_energy.sum(), math.sqrt(self.of_surface.sum())))

    @property
    def total(self):
        return float(self.parts.max())


def estimate(state):
    """Recovered errors of a MeshSolution."""
    body, fields = state.nodes.body, state.fields
    averaged = _averaged(body, fields)
    # below order 3 errors up to 2.3 times all of the estimate were seen: coarse elements away from the
    # surface have a part that their energy does not show
    factor = 3 if body.order < 3 else 1
    of_energy = factor * _energy_of_difference(body, fields, averaged) / max(state.energy, 1e-300)
    of_surface = factor**2 * _surface(state, averaged)
    return Recovered(of_energy, of_surface)


def _averaged(body, fields):
    """Averaged gradients of u1, u2 and, where there is one, psi: pairs of functions."""
    averaged = []
    for alike, order in (((fields.u1, fields.u2), body.order), ((fields.psi,), body.order_psi))[
        : 1 + body.rotates
    ]:
        # twice as fast as a VectorH1 for each
        slopes = ng.GridFunction(ng.H1(body.mesh, order=order, dim=2 * len(alike)))
        slopes.Set(ng.CF(tuple(map(ng.grad, alike))))
        averaged += [(slopes[2 * i], slopes[2 * i + 1]) for i in range(len(alike))]
    return averaged


def _energy_of_difference(body, fields, averaged):
    """Array (elements,)."""
    wrong = [ng.CF((mean[0], mean[1])) - ng.grad(field) for mean, field in zip(averaged, fields)]
    density = contact_term.energy(body.solid, body.strains([ng.CF(0)] * len(wrong), wrong))
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
    facets, squares = _edges(state)
    np.add.at(found[0], above[facets], squares)
    if len(state.forces) == 2:  # of M/ell
        np.add.at(found[1], above[facets], squares / 4)
    np.add.at(found, (slice(None), above), missed_by_nodes(state))
    return found[np.argmax(found.sum(axis=1))] / max(weights @ own[0] ** 2, 1e-300)  # nothing may touch yet


def _free_edges(state):
    """Whether a corner is closed at one of a node and the next, array (corners, n - 1)."""
    return (state.closed[:, :-1] != state.closed[:, 1:]) & ~state.nodes.apart


def _edges(state):
    """(Numbers of the facets with a free edge, squares of what its shift changes p): arrays."""
    nodes, (corner, i) = state.nodes, np.nonzero(_free_edges(state))
    last = np.where(state.closed[corner, i], i, i + 1)
    outside = 2 * i + 1 - last
    before = 2 * last - outside
    # not an end of the obstacle, or of the boundary
    free = np.isfinite(state.gaps[corner, outside]) & (before >= 0) & (before < len(nodes.points))
    corner, i, last, outside, before = np.array((corner, i, last, outside, before))[:, free]
    way, inner = (np.hypot(*(nodes.points[other] - nodes.points[last]).T) for other in (outside, before))
    p, q = state.pressures[corner, last] ** 2, state.pressures[corner, before] ** 2
    slopes, counts = np.maximum((q - p) / inner, p / way), np.count_nonzero(state.closed, axis=1)  # K^2
    weights = np.maximum(*state.tamed(state.x)[[last, outside]])
    return nodes.joined[i], weights * slopes * way**2 / 12 * (0.5 + 0.25 * np.log(counts[corner] + 1))


def _traction(state, averaged):
    """Pressure -n.(sigma n) and couple m.n/ell on the boundary."""
    body = state.nodes.body
    solid, n = body.solid, ng.CF((outward(body.mesh), 0))
    gamma, kappa = body.strains(list(state.fields), averaged)
    sigma, m = contact_term.stress(solid, gamma), contact_term.couple_stress(solid, kappa)
    return ng.CF((-ng.InnerProduct(n, sigma * n), (m * n)[2] / solid.ell))


def refine_until(solver, load, approach, rtol):
    """The solution on a mesh that is cut until the estimate is at most rtol.

    Raises
    ------
    NotConverged
        Beyond MOST_UNKNOWNS or PASSES, beyond SOON if MOST_UNKNOWNS would miss rtol, or if PASSES would;
        `rtol_reached` is 1.4 times the smallest estimate, or what a few more unknowns leave.
    """

    passed = []

    def refusal(best, last, failure):
        besides = (
            f"take another mesh: on the next one, {failure}" if failure else "raise the order of the body"
        )
        besides = "".join(last.result.beyond()) or besides
        margin = last.margin
        passes = len(passed)
        return out_of_reach(
            rtol, best.error, "", besides, passes, load=load, approach=approach, margin=margin
        )

    return refine(_meshes(solver, load, approach, rtol, passed), rtol, refusal).result


def _meshes(solver, load, approach, rtol, passed):
    """Yields the RefinementLevels of meshes that are cut more and more, and adds their (unknowns, parts of
    the estimate) to `passed`.
    """
    found, mesh = None, solver.body.mesh
    for passes in range(1, PASSES + 1):
        try:
            solver = solver.on(mesh) if passes > 1 else solver
            found = solver.at(load, approach, found)
            parts = estimate(found)
        except BadArgument as failure:
            if found is None:
                raise
            raise NotConverged(str(failure)) from failure
        counted(error=parts.total, unknowns=found.unknowns)
        passed.append((found.unknowns, parts.parts))
        far = found.unknowns > SOON and _hopeless(rtol, passed) and _hopeless(rtol, passed[-2:])
        stuck = parts.of_surface[too_small(mesh)].sum() > rtol**2
        stalled = _stalled(rtol, [own.max() for _, own in passed])
        yield RefinementLevel(
            replace(found, error_estimate=parts.total),
            parts.total,
            cannot_reach=found.unknowns > MOST_UNKNOWNS or far or stuck or stalled,
            # a few more unknowns halve what is left, but at sharp places of the obstacle
            margin=0.7 if far and not len(_named(found)) else 1.4,
        )
        triangles = of_triangles(mesh) if passes == 1 else None
        # a tenth at a time: for much less all elements are cut alike, and not the worst ones first
        mesh = triangles or _finer(found, parts, max(rtol, parts.total / 10) / 2)
        if mesh.ne == found.nodes.body.mesh.ne:  # all that should be cut is too small
            break


def _hopeless(rtol, passed):
    """Whether a part of the estimate misses rtol with MOST_UNKNOWNS, at twice the order from the first to the
    last of passes, [(unknowns, parts of the estimate)].
    """
    (few, coarse), (more, fine) = passed[0], passed[-1]
    if more <= few:  # triangles of quadrilaterals may have as many, and a first pass has none before
        return False
    ahead = 2 * math.log(MOST_UNKNOWNS / more) / math.log(more / few)
    return np.any(fine * (fine / np.maximum(coarse, 1e-300)) ** ahead > rtol)


def _stalled(rtol, totals):
    """Whether the estimate misses rtol even if it fell in each pass left by 1.5 times the order of the best
    of the last ten. Ten halve an element to a thousandth: smaller features of an obstacle stay unseen.
    """
    last = totals[-1 - PASSES // 4 :]
    best = min((fine / coarse for coarse, fine in zip(last, last[1:])), default=0.0)
    return len(totals) > PASSES // 4 and totals[-1] * best ** (1.5 * (PASSES - len(totals))) > rtol


def marked(found, left):
    """Elements (boolean array) without which energy and surface would be `left`, about."""
    added, chosen = found.of_energy / left + found.of_surface / left**2, np.zeros(len(found.of_energy), bool)
    order = np.argsort(added)
    chosen[order[np.searchsorted(np.cumsum(added[order]), 1) :]] = True
    return chosen


def _finer(state, parts, left):
    """The mesh with the `marked` elements cut, those at singular points three times more, or nine times where
    the obstacle names the place: there the error falls like the square root of the size.
    """
    nodes, chosen, between = state.nodes, marked(parts, left), (state.x[1:] + state.x[:-1]) / 2
    named = _named(state)
    mesh, region, x = nodes.body.mesh, nodes.region, [between[is_edge] for is_edge in _free_edges(state)]
    x = np.concatenate([named, *x])
    times = np.where(np.arange(len(x)) < len(named), 9, 3)
    times *= (_at(mesh, region, x) & chosen[elements_at(mesh, region)]).any(axis=1)
    finer = ng.Mesh(mesh.ngmesh.Copy())
    cut(finer, chosen)
    for done in range(times.max(initial=0)):
        region, deeper = finer.Boundaries(nodes.body.contact), np.zeros(finer.ne, bool)
        deeper[elements_at(finer, region)[_at(finer, region, x[times > done]).any(axis=0)]] = True
        cut(finer, deeper)
    return finer.Curve(nodes.body.order)


def _beyond(state, pressures, x):
    """Squares of p and M/ell, (2, n), at x beyond the ends of the obstacle."""
    levers, wrong = state.solver.blocks.levers(x), np.zeros((2, len(x)))
    for corner in state.sampled.ends:
        p = np.where(contains(state.sampled.pieces_of(corner), x), 0.0, pressures[corner])
        wrong += np.array((p, levers[corner] / 2 * p)) ** 2
    return wrong


def _named(state):
    """Places x1 under ends, steps and slope discontinuities of the obstacle."""
    problem = state.sampled
    kinks = [place for place, jumps in problem.kinks.items() if any(jumps.values())]
    x = np.append(np.add.outer(state.ends, problem.shifts), kinks)
    return x[(x > state.x[0]) & (x < state.x[-1])]


def _at(mesh, region, x):
    """Whether places x, (k,), lie at each facet, about, array (k, facets)."""
    ends = np.array([[mesh[vertex].point[0] for vertex in facet.vertices] for facet in region.Elements()])
    left, right = ends.min(axis=1), ends.max(axis=1)
    return np.abs(x[:, None] - (left + right) / 2) <= 0.55 * (right - left)


def too_small(mesh: ng.Mesh) -> Flags:
    """Elements to be cut no more, boolean array (elements,): of their sides rounding leaves four digits."""
    points = mesh.ngmesh.Coordinates()
    corners = points[mesh.ngmesh.Elements2D().NumPy()["nodes"][:, :3] - 1]
    sizes = np.ptp(corners, axis=1).max(axis=1)
    return sizes <= 1e4 * np.finfo(float).eps * np.abs(points).max()


def cut(mesh, chosen):
    """Cuts the chosen triangles of a mesh, boolean array (elements,), but for those that are `too_small`."""
    mesh.SetRefinementFlags((chosen & ~too_small(mesh)).tolist())
    mesh.Refine()


def of_triangles(mesh):
    """A mesh with quadrilaterals cut along their shorter diagonals; None without any."""
    finer = mesh.ngmesh.Copy()
    cells, points = finer.Elements2D(), finer.Coordinates()
    quads = np.array([element.type == ng.ET.QUAD for element in mesh.Elements()])
    if not quads.any():
        return None
    corners = points[cells.NumPy()["nodes"] - 1]
    first, second = np.linalg.norm(corners[:, :2] - corners[:, 2:], axis=2).T
    for number in np.flatnonzero(quads).tolist():
        a, b, c, d = cells[number].vertices
        if second[number] < first[number]:
            a, b, c, d = b, c, d, a
        halves = [netgen.Element2D(cells[number].index, part) for part in ([a, b, c], [a, c, d])]
        cells[number] = halves[0]
        finer.Add(halves[1])
    return ng.Mesh(finer).Curve(mesh.GetCurveOrder())
