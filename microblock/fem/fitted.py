"""Contact of the ground with a rigid obstacle by finite elements whose mesh follows the edges of the zones.

A pass closes the gaps on trial zones, on a mesh with vertices at their edges. At a free edge
``p = K0/sqrt(r) + K1 sqrt(r)``, and ``dK0_i/de_j = -delta_ij K1_i/2`` at the solution: to move the edges
outwards by ``2 K0/K1`` is Newton's method. Mesh and orders are refined until the estimate holds:

discretisation   difference of pressure and micromoment between two refinement levels
edges            p by K1 delta/(2 sqrt r) beside an edge, of its next step
truncation       2 (outer edge/far)^2 (docs/theory/finite_elements.md)
obstacle         what nodes miss of the height, and overlaps that change no zones

The first zones are those of a half-plane.
"""

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..corners import active_set
from ..errors import BOUNDED, BadArgument, NotConverged, out_of_reach
from ..halfplane.first_zones import first_zones
from ..halfplane.kernels import HalfPlane
from ..halfplane.search import CONDITIONS_SHARE
from ..model import picture
from ..model.methods import Panels
from ..model.obstacles import heights
from ..model.problem import Problem
from ..model.progress import counted
from ..model.zones import common, joined, runs, without, zone_edges
from .fitted_mesh import FittedMesh, MeshFitter
from .fitted_path import FittedPath
from .ground import Within
from .surface_solution import Estimate, SurfaceSolution, difference, surface_solution

# (order, levels of elements at the edges). Orders from 5 on are odd: an even one has nearly the error of the
# odd one before it, and their difference would not see it
LEVELS = ((4, 3), (5, 4), *((order, (order + 1) // 2) for order in range(7, 14, 2)))
# a logarithm, or at an end 1/sqrt(r), between two nodes: sqrt(RATIO) a level in L2; levels of equal depth
# would share that error and not see it
LEVELS_AT_CORNERS = tuple((order, order) for order in range(4, 13))


class FittedSolver(MeshFitter):
    """States of a Block on fitted meshes; `picture` and `obstacle` are those of one load."""

    usual_rtol = 1e-3

    def __init__(self, contact, options, known=None):
        self.picture = known
        super().__init__(contact, options)
        if known is not None:
            self.obstacle = picture.seen(self.obstacle, known)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        fixed = self.options.order is not None
        if fixed and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the order: not together with Fitted(order=...)")
        wanted = self.usual_rtol if rtol is None else rtol
        if approach is None:
            return self.at(load, wanted, initial)

        def at(load, near):
            return self.at(load, wanted, near or initial)

        # on the mesh of a neighbour the pressure errs by a hundredth of what the estimate is asked for
        state = self.at_approach(approach, at, 1e-11 if fixed else wanted / 100)
        # its edges stay: they are off by the share of their width by which the load moves, or less
        flexibility, gaps, share = state.body.compliance.corner_system(self.law, state.solver.obstacle)
        found = active_set.solve(flexibility, gaps, approach=approach, c=share)
        load, known = found.load / self.share(1.0), (state.zones, state.iterations, state.estimate)
        return surface_solution(state.solver, state.body, load, found, *known)

    def path(self, last, rtol, progress=False):
        return FittedPath(self.contact, last, rtol)

    def at(self, load, rtol=usual_rtol, near=None):
        """The SurfaceSolution at a load to rtol, from a neighbour's zones on, or of the order that is fixed;
        NotConverged with `rtol_reached`, the smallest estimate, if one is known.
        """
        alike = isinstance(near, SurfaceSolution) and near.problem.mirror == self.symmetric
        near = near if alike and len(near.zones) == len(self.law.corners) else None
        return self._pictured(load)._from_trials(load, rtol, near)

    def _pictured(self, load):
        """The solver with its obstacle's picture for a load."""
        cut_off = self.domain < math.inf
        obstacle = Within(self.obstacle, self.domain) if cut_off else self.obstacle
        found = picture.picture(Problem(self.solid, self.law, obstacle, self.symmetric), load)
        if cut_off:
            found = obstacle.forgotten(found)
        if found.steps:
            raise NotConverged(
                f"the height of the obstacle jumps at x = {found.steps[0]:g}, where pressures have no bound"
            )
        return FittedSolver(self.contact, self.options, found)

    def _from_trials(self, load, rtol, near):
        if near is not None and self.options.order is None:  # whose state is the same from wherever
            with suppress(NotConverged):  # too far
                return self._refined(load, rtol, near.zones)
        zones, failures = self.first_zones(load, rtol), []
        # low orders beside the edges lock where beta is close to 2, most with nu close to 1/2
        for even in sorted({self.options.even, True}):
            solver = FittedSolver(self.contact, replace(self.options, even=even), self.picture)
            try:
                return solver._refined(load, rtol, zones)
            except NotConverged as failure:
                failures.append(failure)
        raise min(failures, key=lambda failure: failure.rtol_reached or math.inf)

    def first_zones(self, load, rtol=usual_rtol):
        """Zones of the computed part of a half-plane."""
        zones = None
        if self.picture.simple:
            with suppress(BadArgument, NotConverged):  # it may touch beyond the ends of a body
                contact = self.contact.with_(body=HalfPlane(self.solid), method=Panels(fallback=False))
                zones = contact.solver.at(load, 0.1 * rtol, fallback=False).all_zones
        if zones is None:
            zones, _ = list(first_zones(self.problem, load))[-1]
        part = [(0.0 if self.symmetric else -math.inf, math.inf)]
        return {corner: tuple(common(own, part)) for corner, own in zones.items()}

    def _levels(self, rtol):
        """Refinement levels from the one before the first that may reach rtol; or the first and that of the
        fixed order.
        """
        sharp = getattr(self.obstacle, "kinks", ()) or getattr(self.obstacle, "ends", ())
        levels, order = LEVELS_AT_CORNERS if sharp else LEVELS, self.options.order
        levels = levels[self.options.even :]  # order 4 locks as low orders do
        if order is not None:
            depth = max((own for top, own in levels if top <= order), default=levels[0][1])
            return levels[0], (order, depth)
        first = sum(top < math.ceil(-2 * math.log10(rtol) - 0.3) for top, _ in levels[1:])
        return levels[min(first, len(levels) - 2) :]

    def _refined(self, load, rtol, zones):
        """The state to rtol, or of the fixed order. Edges move until they are located, then until they add
        little to the estimate; other zones begin the level anew.
        """
        fixed = self.options.order is not None
        tolerance, located = rtol if fixed else CONDITIONS_SHARE * rtol, 5 * rtol
        coarse, best, passes = None, math.inf, 0
        for level in self._levels(rtol):
            last = math.inf
            for _ in range(6):
                passes += 1
                try:
                    mesh, state, other = self._pass(load, zones, level, tolerance, passes)
                except NotConverged as failure:  # this level's mesh, and not the estimate of the one before
                    if best == math.inf:
                        raise
                    raise out_of_reach(rtol, best, f" ({failure})", load=load, iterations=passes) from None
                parts = state.estimate
                if other is None and coarse is not None:
                    parts = replace(parts, discretisation=difference(coarse, state))
                    state = replace(state, estimate=parts)
                    other = self._outside(state, mesh) if parts.total <= rtol else None
                    if other is None and parts.total <= rtol:
                        return state
                if other is not None:  # what was computed on other zones says nothing
                    zones, coarse, last = other, None, math.inf
                    continue
                moved, error = mesh.moved
                if passes > 1 or error > rtol / 2:  # a first mesh reads exact edges less accurately
                    zones = moved
                if coarse is None:
                    settled = error <= located or error > last / 2
                else:
                    best = min(best, parts.total)
                    settled = parts.total - parts.edges > rtol
                if settled:
                    break
                last = error
            if fixed:  # on the second level to rounding
                located = 0.0
            else:
                coarse = state
        if fixed and other is None and self._outside(state, mesh) is None:
            return state
        if best == math.inf or max(map(abs, zone_edges(zones)), default=0.0) > self.furthest:
            raise self._unsettled(load, zones, passes)
        besides = "fix the discretisation, Fitted(order=...)"
        raise out_of_reach(rtol, best, load=load, besides=besides, iterations=passes)

    def _pass(self, load, zones, level, tolerance, passes):
        """(FittedMesh, its state, other zones or None) of trial zones on a level."""
        counted()
        mesh = FittedMesh(self, load, zones, *level)
        state, violations = self._state(load, mesh, passes)
        return mesh, state, self._other_zones(state, mesh, violations, tolerance)

    def _unsettled(self, load, zones, passes):
        edges = zone_edges(zones)
        if max(map(abs, edges), default=0.0) > self.furthest:
            if not np.ptp(heights(self.obstacle, np.linspace(-1, 1, 9) * self.domain)) > 0:
                return BadArgument("obstacle", self.contact.obstacle, f"does not rise at all: {BOUNDED}")
            where = f"from {edges[0]:.3g} to {edges[-1]:.3g}"
            allowed = f"must be larger: at load {load:g} the contact, {where}, reaches the end of the surface"
            return BadArgument("size", self.domain, allowed)
        return NotConverged(
            f"zones still changing after {passes} meshes at load {load:g}: is it next to a change of "
            "topology, or beta close to 2? Take another load, or the half-plane",
            iterations=passes,
        )

    def _state(self, load, mesh, passes):
        flexibility, gaps, share = mesh.system
        start = mesh.closed.ravel()
        found = active_set.solve(flexibility, gaps, load=self.share(load), c=share, start=start)
        outer = max(map(abs, mesh.tips))
        # 0.7 to 1.9 of that were seen, most for the unilateral law and nu = 0.45
        truncation = 2 * (outer / mesh.ground.far) ** 2 if self.domain == math.inf else 0.0
        estimate = Estimate(None, mesh.moved[1], truncation)
        state = surface_solution(self, mesh.body, load, found, mesh.zones, passes, estimate)
        violations = mesh.violations(state)
        missed = math.sqrt(mesh.missed + sum(each.worth**2 for each in violations))
        return replace(state, estimate=replace(estimate, obstacle=missed / _size(state))), violations

    def _other_zones(self, state, mesh, violations, tolerance):
        """None if the state is closed on its zones; else its own, with violations worth more than `tolerance`
        amended.
        """
        closed = state.forces > 0
        wrong = np.any((closed != mesh.closed) & ~mesh.beside_tips(mesh.x))
        violations = [each for each in violations if each.worth > tolerance * _size(state)]
        if not wrong and not violations:
            return None
        zones = dict(self.runs(mesh.x, closed, state.forces / mesh.body.weights) if wrong else mesh.moved[0])
        for each in violations:
            own, interval = zones[each.corner], (each.left, each.right)
            # a corner that overlaps is closed, one in tension opened
            zones[each.corner] = joined([*own, interval]) if each.depth > 0 else without(own, *interval)
        return zones

    def _outside(self, state, mesh):
        """The zones with overlaps beyond the contact boundary, or None; BadArgument if the obstacle could
        touch beyond its picture.
        """
        (left, right), away = mesh.ground.reach, np.geomspace(1e-4, 1, 60)
        most = min(mesh.ground.far, 1e3 * max(-left, right)) * (1 - 1e-9)
        away = np.concatenate((right + (most - right) * away, left - (most + left) * away))
        zones, wrong = {corner: list(own) for corner, own in mesh.zones.items()}, False
        for corner, own in zones.items():
            x, number = np.union1d(away, self.problem.sites(corner)), np.array(corner)
            x = x[(np.abs(x) < most) & ((x < left) | (x > right)) & ((x > 0) | (not self.symmetric))]
            points = state.fields.body.mesh(x, np.zeros_like(x))
            u2, psi = (np.ravel(part(points)) for part in (state.fields.u2, state.fields.psi))
            risen = self.solid.ell / 2 * self.problem.lever(number, x) * psi - state.approach - u2
            place = x - self.problem.shifts[corner]
            known = np.any([(a <= place) & (place <= b) for a, b in self.picture.stretches], axis=0)
            if np.any(self.picture.allowed(place[~known]) + risen[~known] < 0):
                words = f"could touch at load {state.load:g} where it is too high for that under a half-plane"
                raise BadArgument("obstacle", self.contact.obstacle, words)
            for first, last in runs(known & (self.problem.initial_gap(number, x) + risen < 0)):
                own.append((float(x[max(first - 1, 0)]), float(x[min(last + 1, len(x) - 1)])))
                wrong = True
        return {corner: tuple(joined(own)) for corner, own in zones.items()} if wrong else None

    def evenly(self, load, order, count):
        """The body condensed on `count` even elements over the reach of a load."""
        solver = self._pictured(load)
        ground, _ = solver.surface(solver.first_zones(load))
        parts = ((*ground.reach, max(map(abs, ground.reach)) / count),)
        return solver.condense(ground, solver.features(ground), parts, 0, order)

    def edge_coefficients(self, zones, loads, order, levels):
        """((K0, K1) at the innermost edge at each load, those at the outermost)."""
        mesh, both = FittedMesh(self, loads[0], zones, order, levels), []
        (left, _), (_, outer) = mesh.zones[0][0], mesh.zones[0][-1]
        inner = (0, left, 1) if left > 0 else (1, mesh.zones[1][0][1], -1)
        for corner, edge, inward in (inner, (0, outer, -1)):
            way = mesh.way(edge)
            pressures = [mesh.pressures_under(self.share(load))[corner] for load in loads]
            both.append([mesh.read(p, edge, inward, way, way) for p in pressures])
        return both


def _size(state):
    """L2 norm of the pressure of the computed part."""
    return math.sqrt(state.body.weights @ state.computed(state.pressures).sum(axis=0) ** 2)
