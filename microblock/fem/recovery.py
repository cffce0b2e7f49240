"""Refinement of a user's mesh by recovery, for bodies whose zones nobody knows beforehand.

Gradients averaged in the nodes (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 24 (1987) 337) are nearer to
the true ones than those of the elements, so that the difference stands for the error:

energy    that of the difference of gradients over the energy of the state
surface   difference of the averaged traction and couple -(n.sigma n), m.n from the nodal p and M, max over
          the two of the L2 norm on the contact boundary over that of p

What neither shows is added to `surface`: an edge between nodes, off by a spacing over sqrt(12), as a shift
of ``p = K sqrt(r)``, and the obstacle between the nodes (`between`). The larger one is the estimate. Elements
that make up more than is allowed are cut, deeper at singular points of the surface. Straight quadrilaterals
become triangles before: NGSolve cuts a quadrilateral one way, again and again.
"""

import math
from dataclasses import dataclass, replace

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from tqdm.auto import tqdm

from ..errors import NotConverged, out_of_reach
from ..model.quadrature import lagrange
from .between import of_body
from .facets import at_all_facets, elements_at, lobatto, mapped, outward_sides

LEFT = 0.5  # of rtol, what elements that are not cut may add to a part of the estimate
# times more, elements are cut at singular points of the surface that need it: one a pass would take three
# times as many passes, for as many unknowns
DEEPER = 3
# ... at most, where the obstacle names the place: there the error falls like the square root of the size
DEEPEST = 12
# times the difference from averaged tractions, the error at ends and slope discontinuities of the obstacle:
# averages of singular fields are hardly better than the fields (2.5 to 4.2 were seen)
UNSEEN = 4.0
# times all of the estimate below order 3: errors up to 2.3 times it were seen, of which the coarse elements
# away from the surface have a part that their energy does not show
LOW_ORDER = 3.0
AT = 0.05  # of an element, which is at a point that lies no farther outside
PASSES = 40  # of refinement
TRIANGLE = 10  # netgen's type of an element
MOST = 300_000  # unknowns


@dataclass(frozen=True)
class Recovered:
    """Relative errors of a state by recovery, and what elements add to them.

    Attributes
    ----------
    energy, surface : float
    of_energy, of_surface : arrays (elements,), their sums are energy and surface^2
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
    factor = LOW_ORDER if body.order < 3 else 1.0
    of_energy = factor * _energy_of_difference(body, fields, averaged) / max(state.energy, 1e-300)
    of_surface = factor**2 * _surface(state, averaged)
    return Recovered(float(of_energy.sum()), math.sqrt(of_surface.sum()), of_energy, of_surface)


def _averaged(body, fields):
    """Gradients of u1, u2, psi, averaged between elements: three pairs of continuous functions."""
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
    """Squares of what p and M/ell differ from averaged tractions, array (elements,)."""
    mesh, nodes, ell = state.nodes.body.mesh, state.nodes, state.nodes.compliance.ell
    above, sides = elements_at(mesh, nodes.region), outward_sides(mesh, nodes.region)
    own = np.array((state.pressures.sum(axis=0), state.micromoment / ell))
    found, size = np.zeros((2, mesh.ne)), 0.0
    xis, shares = np.polynomial.legendre.leggauss(nodes.body.order + 2)
    xis, shares = (1 + xis) / 2, shares / 2
    seen = _traction(state, averaged)(at_all_facets(mesh, nodes.region, xis)).reshape(-1, len(xis), 2)
    seen = seen * np.column_stack((np.ones_like(sides), sides / ell))[:, None]
    places, lengths, _ = mapped(mesh, nodes.region, xis)
    orders = np.array([len(members) - 1 for members in nodes.facets])
    for order in np.unique(orders):
        here = np.flatnonzero(orders == order)
        members, basis = np.array([nodes.facets[i] for i in here]), lagrange(lobatto(int(order))[0], xis)
        x = places[here, :, 0]
        weights = shares * lengths[here] * state.tamed(x.ravel()).reshape(x.shape)
        between = own[:, members] @ basis.T
        wrong = (between - np.moveaxis(seen[here], -1, 0)) ** 2 + _beyond(state, members, basis, x)
        np.add.at(found, (slice(None), above[here]), np.sum(weights * wrong, axis=-1))
        size += np.sum(weights * between[0] ** 2)
    for there in _at(mesh, _named(state)):
        found[:, there] *= UNSEEN**2
    for last, outside, square in _edges(state):
        facet = next(number for number, members in enumerate(nodes.facets) if {last, outside} <= set(members))
        found[:, above[facet]] += square * np.array((1, 1 / 4 if len(state.forces) == 2 else 0))
    np.add.at(found, (slice(None), above), of_body(state))
    return found[np.argmax(found.sum(axis=1))] / max(size, 1e-300)  # nothing may touch yet


def _edges(state):
    """(last closed node, first open one, square of what a shift changes p in L2) of all free edges."""
    x = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(state.nodes.points, axis=0).T))))
    for closed, p, gaps in zip(state.closed, state.pressures, state.gaps):
        for i in np.flatnonzero((closed[:-1] != closed[1:]) & ~state.nodes.apart):
            last, outside = (i, i + 1) if closed[i] else (i + 1, i)
            before = 2 * last - outside
            # an end of the obstacle, or of the boundary
            if not np.isfinite(gaps[outside]) or not 0 <= before < len(x):
                continue
            way = abs(x[outside] - x[last])
            slope = max((p[before] ** 2 - p[last] ** 2) / abs(x[last] - x[before]), p[last] ** 2 / way)  # K^2
            yield last, outside, slope * way**2 / 12 * (0.5 + 0.25 * math.log(np.count_nonzero(closed) + 1))


def _traction(state, averaged):
    """Pressure -n.(sigma n) and couple m.n by NGSolve's normal, as an expression on the boundary."""
    solid, n = state.nodes.body.solid, ng.specialcf.normal(2)
    gradient = ng.CF((*(averaged[0][i] for i in range(2)), *(averaged[1][i] for i in range(2))), dims=(2, 2))
    rows = solid.stress(gradient, state.fields.psi)
    m = solid.couple_stress(averaged[2])
    return ng.CF(
        (-sum(n[i] * rows[i][j] * n[j] for i in range(2) for j in range(2)), m[0] * n[0] + m[1] * n[1])
    )


def refine_until(solver, load, approach, rtol, progress=False):
    """The solution on a mesh that is cut where the estimate asks for it, until it is at most rtol.

    `progress` shows a bar of passes with the estimate.

    Raises
    ------
    NotConverged
        If that takes more than MOST unknowns or PASSES passes; `rtol_reached` is the smallest
        estimate, rounded up.
    """
    best, found = math.inf, None
    with tqdm(desc=f"refined to {rtol:g}", unit=" passes", disable=not progress) as bar:
        for passes in range(1, PASSES + 1):
            try:
                found = solver.at(load, approach, found)
                parts = estimate(found)
            except NotConverged as failure:
                if best == math.inf:
                    raise
                stopped = f"take another mesh: on the next one, {failure}"
                raise out_of_reach(rtol, best, "", stopped, passes, load=load, approach=approach) from failure
            bar.update()
            bar.set_postfix(estimate=f"{parts.total:.1e}", unknowns=found.unknowns)
            best = min(best, parts.total)
            if parts.total <= rtol:
                return replace(found, error_estimate=parts.total)
            if found.unknowns > MOST:
                break
            triangles = of_triangles(found.nodes.body.mesh) if passes == 1 else None
            # an rtol far away asks for all elements alike, and not for the worst ones first
            solver = solver.on(triangles or _finer(found, parts, max(rtol, parts.total / 1000)))
    besides = "".join(found.beyond()) or f"raise the order of the body ({found.unknowns} unknowns)"
    raise out_of_reach(rtol, best, "", besides, passes, load=load, approach=approach)


def marked(found, rtol):
    """Elements (boolean array) without which each part that is above rtol would be LEFT of it."""
    chosen = np.zeros(len(found.of_energy), bool)
    for part, added, left in (
        (found.energy, found.of_energy, LEFT * rtol),
        (found.surface, found.of_surface, (LEFT * rtol) ** 2),
    ):
        if part > rtol:
            order = np.argsort(added)
            chosen[order[np.searchsorted(np.cumsum(added[order]), left) :]] = True
    return chosen


def _finer(state, parts, rtol):
    """The mesh of a state with the marked elements cut, those at singular points among them more often."""
    mesh, order = state.nodes.body.mesh, state.nodes.body.order
    chosen, points, named = marked(parts, rtol), singular(state), len(_named(state))
    there = _at(mesh, points) & chosen
    worst = np.sqrt(np.max(parts.of_surface * there, axis=1, initial=0.0)) / (LEFT * rtol)
    deeper = np.where(np.arange(len(points)) < named, 2 * np.log2(np.maximum(worst, 1.0)), DEEPER)
    deeper = np.where(there.any(axis=1), np.clip(deeper, DEEPER, DEEPEST).astype(int), 0)
    finer = ng.Mesh(mesh.ngmesh.Copy())
    cut(finer, chosen)
    for done in range(deeper.max(initial=0)):
        cut(finer, np.any(_at(finer, points[deeper > done]), axis=0))
    return finer.Curve(order)


def singular(state):
    """Points of the contact boundary under which fields are singular, array (k, 2)."""
    between = (state.x[1:] + state.x[:-1]) / 2
    x = [between[(closed[:-1] != closed[1:]) & ~state.nodes.apart] for closed in state.closed]
    return np.vstack((_named(state), _on_surface(state, np.concatenate(x))))


def _beyond(state, members, basis, x):
    """Squares of p and of M/ell at x, arrays (2, facets, n), of corners beyond the end of the obstacle."""
    levers = np.reshape(list(state.law.levers(x.ravel()).values()), (-1, *x.shape))
    wrong = np.zeros((2, *x.shape))
    for corner, (left, right) in state.problem.ends.items():
        p = np.where((x < left) | (x > right), state.pressures[corner, members] @ basis.T, 0.0)
        wrong = wrong + np.array((p, levers[corner] / 2 * p)) ** 2
    return wrong


def _named(state):
    """Points of the contact boundary that are under ends and slope discontinuities of the obstacle."""
    problem = state.problem
    x = [place for ends in problem.ends.values() for place in ends]
    x += [place for place, jumps in problem.kinks.items() if any(jumps.values())]
    return _on_surface(state, np.array([place for place in x if state.x[0] < place < state.x[-1]]))


def _on_surface(state, x):
    """Points of the contact boundary at x1 = x, array (n, 2)."""
    return np.column_stack((x, np.interp(x, state.x, state.nodes.points[:, 1])))


def _at(mesh, points):
    """Whether points, array (k, 2), lie in each element of a mesh, or hardly outside, boolean array (k,
    elements); sides are taken for straight.
    """
    faces, places = mesh.ngmesh.Elements2D().NumPy(), np.array(mesh.ngmesh.Coordinates())[:, :2] @ (1, 1j)
    nodes, quad = faces["nodes"].T.astype(int) - 1, faces["type"] != TRIANGLE
    last = nodes.take(3, 0, mode="clip")  # of a quadrilateral
    rest = nodes[0], np.where(quad, nodes[2], nodes[1]), np.where(quad, last, nodes[2])
    a, b, c = places[np.stack((nodes[:3], rest), axis=1)]  # corners of two triangles, arrays (2, elements)
    found = np.zeros((len(points), mesh.ne), bool)
    for there, p in zip(found, points @ (1, 1j)):
        parts = np.array((_area(b - p, c - p), _area(c - p, a - p), _area(a - p, b - p)))
        there[:] = np.any((parts / _area(b - a, c - a)).min(axis=0) >= -AT, axis=0)
    return found


def _area(first, second):
    """Signed area between complex numbers, arrays."""
    return (first.conj() * second).imag


def cut(mesh, chosen):
    """Cuts the chosen elements of a mesh, boolean array (elements,)."""
    mesh.SetRefinementFlags(chosen.tolist())
    mesh.Refine()


def of_triangles(mesh):
    """A mesh of the same straight-sided domain with each quadrilateral cut along its shorter diagonal.

    None where there are no quadrilaterals, or sides are curved, or would be on a finer mesh.
    """
    old, curved = mesh.ngmesh, ng.Mesh(mesh.ngmesh.Copy()).Curve(2)
    if not any(element.type == ng.ET.QUAD for element in mesh.Elements()):
        return None
    new = netgen.Mesh(dim=2)
    places = [new.Add(netgen.MeshPoint(netgen.Pnt(*vertex.point, 0))) for vertex in mesh.vertices]
    regions = [new.AddRegion(name, dim=2) for name in old.GetRegionNames(dim=2)]
    sides = [new.AddRegion(name, dim=1) for name in old.GetRegionNames(dim=1)]
    for element in old.Elements1D():
        new.Add(
            netgen.Element1D([places[v.nr - 1] for v in element.vertices], index=sides[element.index - 1])
        )
    points = np.array([vertex.point for vertex in mesh.vertices])
    for element in old.Elements2D():
        own = [v.nr - 1 for v in element.vertices]
        for part in _triangles(points[own]):
            corners = [places[own[i]] for i in part]
            new.Add(netgen.Element2D(regions[element.index - 1], corners))
    found = ng.Mesh(new)
    lengths = [ng.Integrate(1.0, each, ng.BND, order=4) for each in (curved, found)]
    return found if math.isclose(*lengths, rel_tol=1e-12) else None


def _triangles(points):
    """Numbers of the corners of the triangles that an element with these corners, array (n, 2), becomes."""
    if len(points) == 3:
        return ((0, 1, 2),)
    first, second = (np.hypot(*(points[i] - points[i + 2])) for i in range(2))
    return ((0, 1, 2), (0, 2, 3)) if first <= second else ((0, 1, 3), (1, 2, 3))
