"""Contact of the ground with a rigid obstacle by finite elements whose mesh follows the edges of the zones.

A pass meshes the ground with vertices at the trial edges, condenses it to the contact nodes and closes the
gaps of each corner on its zones. At a free edge ``p = K0/sqrt(r) + K1 sqrt(r)``; at the solution ``dK0_i/de_j
= -delta_ij K1_i/2``, so moving the edges outwards by ``2 K0/K1`` is Newton's method, a mesh a step. The state
returned is that of the contact-state solver on the last mesh. Mesh and orders are refined level by level
until the estimate holds, which has four parts:

discretisation   difference of pressure and micromoment between the last two refinement levels, each fitted
                 for itself
edges            what moving the edges by the next step would change: p by K1 delta/(2 sqrt r) beside an edge
truncation       TRUNCATION (outer edge/far)^2: the image of the load bends the surface like 1/far^2
                 (docs/theory/finite_elements.md)
obstacle         what nodes miss of the height between them, and of overlaps that are worth less than changing
                 the zones

The obstacle's `picture` says where it could touch. Where that is one lowest place with nothing narrow beside
it, a first mesh without knowledge of the zones shows them; else the graded cells of a half-plane do, on all
low stretches, and the contact boundary covers these, with small elements where zones or features are. On each
mesh the gaps of all corners are looked at, at all places at which the height was looked at, and of the state
that is returned on the surface beyond the contact boundary as well.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..corners import active_set
from ..errors import BadArgument, NotConverged, out_of_reach
from ..halfplane.first_zones import first_zones
from ..halfplane.kernels import HalfPlane
from ..halfplane.search import LooksTooNear
from ..model import picture
from ..model.methods import Panels
from ..model.problem import Problem
from ..model.progress import counted
from ..model.zones import common, joined, runs, without, zone_edges
from . import between
from .fitted_mesh import MEETING, MeshFitter, _FittedMesh
from .fitted_path import FittedPath
from .ground import WITHIN, Within
from .surface_solution import Estimate, SurfaceSolution, difference, surface_solution

# (order, levels of elements at the edges). Orders from 5 on are odd: an even one has nearly the error of the
# odd one before it, and their difference would not see it. Where depths are equal, what the depth leaves is a
# tenth of what order 5 does
LEVELS = ((4, 3), (5, 4), (7, 4), (9, 5), (11, 6), (13, 7))
# a logarithm, or at an end 1/sqrt(r), between two nodes: sqrt(RATIO) a level in L2; levels of equal depth
# would share that error and not see it
LEVELS_AT_CORNERS = tuple((order, order) for order in range(4, 13))
# width of a partial zone over ell as ell -> 0 (2.39 at nu = 0.3, beta = 1): a first guess
PARTIAL = 2.4
COARSE = 12, 3  # elements over the reach and order of the first mesh, which knows no edges
# of rtol, to which panels of a half-plane find the first zones; and the least that they are asked for
START, FINEST = 0.1, 1e-7
# refinement level on which edges are looked for by elements of one order: order 4 locks as low orders do
LOWEST_EVEN = 1
LOCATED = 0.03  # error of the edges at which more order helps more than another step
# of rtol: error of known edges, read on the first level, up to which the next one takes them as they are
CONFIRMED = 0.5
STEPS = 6  # of the edges on one refinement level
LONGEST_MOVE = 0.4  # of an edge in one step, over the way to the next
# of the way to the next edge, or of the layer if that is less, from where K0 and K1 are read
FITTED = 0.4
FURTHEST = 0.8  # of it, on meshes with too few nodes for that
# K0, K1, ... of the series in which they are read: with 4 edges stay off by up to 5e-5 of the width on all
# levels, with 6 by less than the elements make of it
TERMS = 6
SEEN = 0.05  # of the way to the next edge: sets that differ by more are another topology
SHOWN = 4  # nodes next to the axis that make an overlap or a gap
# where no rtol is asked for: overlap between nodes, of the pressure, that makes other zones
FIXED = 1e-3
CONDITIONS = 0.3  # of rtol, above which an overlap between nodes changes the zones
WIDEST = 8  # times farther than a classical half-plane asks for is looked at most
OUTSIDE = 60  # places on either side beyond the contact boundary, beside the obstacle's own
# of rtol, up to which the last mesh is that of an approach: the pressure errs by as much, a hundredth of what
# the estimate is asked for; and where the order is fixed, by what edges that are settled leave
LOWERED, SETTLED = 0.01, 1e-11
TRUNCATION = 2.0  # of (outer edge/far)^2: 0.7 to 1.9 were seen, most for the unilateral law and nu = 0.45


class FittedSolver(MeshFitter):
    """States of a Block on fitted meshes; a half-plane is cut off at FAR times the reach of the contact
    boundary.

    Its `options` are `Fitted`. `picture` and `obstacle` are those of one load: `_pictured` makes a solver for
    each.
    """

    usual_rtol = 1e-3

    def __init__(self, contact, options, seen=None, picture=None):
        self._seen, self.picture = seen, picture
        super().__init__(contact, options)
        self.lines, self.even = options.lines, options.even

    @property
    def obstacle(self):
        return self.contact.obstacle if self._seen is None else self._seen

    @cached_property
    def problem(self):
        return Problem(self.solid, self.law, self.obstacle, self.symmetric, self.picture)

    def solve(self, load, approach, rtol, initial=None, progress=False):
        order, spacing = self.options.order, self.options.spacing
        if order is not None and rtol is not None:
            raise BadArgument("rtol", rtol, "chooses the order: not together with Fitted(order=...)")

        wanted = self.usual_rtol if rtol is None else rtol

        def at(load, near):
            return self.solve(load, None, rtol, initial) if near is None else self.follow(load, rtol, near)

        if approach is not None:
            tolerance = LOWERED * wanted if order is None else SETTLED
            return self._lowered(self.at_approach(approach, at, tolerance), approach)
        return self.of_order(load, order, spacing) if order is not None else self.at(load, wanted, initial)

    def _lowered(self, state, approach):
        """A state whose approach is nearly the one given, at that approach on its mesh.

        Its edges stay: they are off by the share of their width by which the load moves, or less.
        """
        flexibility, gaps, share = state.body.compliance.corner_system(self.law, state.solver.obstacle)
        found = active_set.solve(flexibility, gaps, approach=approach, c=share)
        load = found.load / self.share(1.0)
        return surface_solution(
            state.solver, state.body, load, found, state.zones, state.iterations, state.estimate
        )

    def path(self, last, rtol, progress=False):
        return FittedPath(self.contact, last, rtol)

    def follow(self, load, rtol, initial):
        try:
            return self.solve(load, None, rtol, initial)
        except NotConverged:  # too far
            return self.solve(load, None, rtol)

    def _pictured(self, load, wider=1):
        """The solver with its obstacle's picture for a load, and the kinks and ends that this shows;
        `wider`: times farther.
        """
        cut_off = self.domain < math.inf
        problem = Problem(
            self.solid,
            self.law,
            Within(self.obstacle, self.domain) if cut_off else self.obstacle,
            self.symmetric,
        )
        found = picture.picture(problem, load, picture.BOUND * wider)
        if cut_off:
            found = problem.obstacle.forgotten(found)
        if found.steps:
            raise NotConverged(
                f"the height of the obstacle jumps at x = {found.steps[0]:g}, where pressures have no bound"
            )
        return FittedSolver(self.contact, self.options, picture.seen(self.obstacle, found), found)

    def _looking(self, load, solve, wider=1):
        """What `solve` makes of the solver with its picture, with a wider one where something beyond that
        could touch.
        """
        try:
            return solve(self._pictured(load, wider))
        except LooksTooNear:
            if wider > WIDEST:
                raise NotConverged(
                    f"at load {load:g} the ground touches the obstacle farther and farther away"
                ) from None
            return self._looking(load, solve, 2 * wider)

    def at(self, load, rtol=usual_rtol, near=None):
        """The SurfaceSolution at a load to a relative L2 error of pressure and micromoment, from a
        neighbour's zones on.

        Raises
        ------
        NotConverged
            If the refinement ends above rtol, or the zones are not found; `rtol_reached` is the smallest
            estimate, rounded up.
        """
        alike = isinstance(near, SurfaceSolution) and near.problem.mirror == self.symmetric
        near = near if alike and len(near.zones) == len(self.law.corners) else None

        def solve(solver):
            zones = near.zones if near else solver._of_half_plane(load, rtol) if solver._plain else None
            if zones:
                known = near.predicted if near else self.domain == math.inf
                try:
                    return solver._refined(load, rtol, zones, 0, known)
                except NotConverged:
                    if near:
                        raise
            return solver._refined(load, rtol, *solver.topology(load))

        return self._looking(load, solve)

    def _of_half_plane(self, load, rtol=usual_rtol):
        """Zones of the computed part on panels of a half-plane, to spare meshes; None where it has none."""
        contact = self.contact.with_(body=HalfPlane(self.solid), method=Panels(fallback=False))
        try:
            found = contact.solver.at(load, max(START * rtol, FINEST), fallback=False)
        except (BadArgument, NotConverged):
            return None
        return self._computed(found.all_zones)

    def _computed(self, zones):
        """The part of zones on the whole line that is computed."""
        part = [(0.0 if self.symmetric else -math.inf, math.inf)]
        return {corner: tuple(common(own, part)) for corner, own in zones.items()}

    def _refined(self, load, rtol, zones, passes, known=False):
        """The state to rtol from trial zones; of `known` ones, the edges are as good as rtol asks for."""
        self._require_level(zones, self._first_level(rtol) + 1)
        if known:
            return self._climb(load, rtol, zones, passes, known)
        solver, zones, passes = self._settled(load, zones, passes)
        # edges from the lowest level would spoil the difference of higher ones
        levels = solver._levels[: solver._first_level(rtol) + 1]
        for order, depth in levels[1:-1]:
            if (levels[-1][0] - order) % 2 == 0:
                zones, passes = solver._pass(load, zones, order, depth).moved, passes + 1
        return solver._climb(load, rtol, zones, passes)

    def _climb(self, load, rtol, zones, passes, known=False):
        """The state to rtol from zones whose edges are good to the first level.

        Known edges that this level confirms stay for the next one: what it reads of them is less accurate.
        """
        coarse, best, first = None, math.inf, self._first_level(rtol)
        for order, levels in self._levels[first:]:
            for _ in range(STEPS):
                try:
                    trial = self._pass(load, zones, order, levels)
                except NotConverged as failure:  # this level's mesh, and not the estimate of the one before
                    if best == math.inf:
                        raise
                    raise out_of_reach(rtol, best, f" ({failure})", load=load, iterations=passes) from None
                passes += 1
                state = self._state(load, trial, passes)
                found = self._other_zones(state, trial, CONDITIONS * rtol)
                if not found and coarse is not None:
                    state = replace(
                        state, estimate=replace(state.estimate, discretisation=difference(coarse, state))
                    )
                    if state.estimate.total <= rtol:
                        found = self._outside(state, trial)
                        if not found:
                            return state
                confirmed = known and coarse is None and trial.edge_error <= CONFIRMED * rtol
                zones = found or (zones if confirmed else trial.moved)
                if found:  # another topology: what was computed on the old one says nothing
                    coarse = None
                    continue
                if coarse is None:
                    break
                best = min(best, state.estimate.total)
                if state.estimate.total - state.estimate.edges > rtol:
                    break
            coarse = state
        if best == math.inf:
            raise self._unsettled(load, zones, passes)
        raise out_of_reach(
            rtol, best, load=load, besides="fix the discretisation, Fitted(order=...)", iterations=passes
        )

    @property
    def _levels(self):
        sharp = getattr(self.obstacle, "kinks", ()) or getattr(self.obstacle, "ends", ())
        return LEVELS_AT_CORNERS if sharp else LEVELS

    def _first_level(self, rtol):
        """Number of the level before the one that may reach rtol: an order adds half a digit."""
        order = math.ceil(2 * (-math.log10(rtol) - 0.15))
        return min(sum(own < order for own, _ in self._levels[1:]), len(self._levels) - 2)

    def _settled(self, load, zones, passes):
        """The solver with orders on which the edges settle, the zones there, and the number of passes."""
        try:
            return self, *self._located(load, zones, passes)
        except NotConverged as failure:
            if self.even:
                raise
            # Low orders beside the edges lock where beta is close to 2, most with nu close to 1/2
            firm = FittedSolver(self.contact, replace(self.options, even=True), self._seen, self.picture)
            return firm, *firm._located(load, zones, passes + failure.iterations)

    def _located(self, load, zones, passes):
        """Zones to which a low level moves edges that were good to LOCATED, and the number of passes."""
        for _ in range(STEPS):
            trial = self._pass(load, zones, *self._levels[LOWEST_EVEN if self.even else 0])
            passes += 1
            if trial.edge_error <= LOCATED:
                return trial.moved, passes
            zones = trial.moved
            state = self._state(load, trial, passes)
            zones = self._other_zones(state, trial, CONDITIONS * LOCATED) or zones
        raise self._unsettled(
            load, zones, passes, ", or beta close to 2? Take another load, or the half-plane"
        )

    def of_order(self, load, order, spacing=None):
        """The state of one order, its edges moved until rounding or ever new meshes stop them; no estimate.

        `spacing` is that of the elements on the surface (length); without it the usual one.
        """

        def solve(solver):
            solver, zones, passes = solver._settled(load, *solver.topology(load))
            return solver._fixed(load, order, spacing, zones, passes)

        return self._looking(load, solve)

    def _fixed(self, load, order, spacing, zones, passes):
        """The same from zones to which the first level has moved the edges."""
        levels, last = max(own for top, own in self._levels if top <= max(order, LEVELS[0][0])), math.inf
        for _ in range(STEPS):
            trial = self._pass(load, zones, order, levels, spacing)
            passes += 1
            if trial.edge_error > last / 2:
                break
            zones, last = trial.moved, trial.edge_error
        state = self._state(load, trial, passes)
        if self._other_zones(state, trial, FIXED) or self._outside(state, trial):
            raise NotConverged(
                f"no zones fit at load {load:g} with order {order}; ask for more", iterations=passes
            )
        return state

    def evenly(self, load, order, count):
        """The body condensed on `count` even elements over the reach that this load needs, without knowledge
        of the zones.
        """
        solver = self._pictured(load)
        zones, _ = solver.topology(load)
        ground = solver._around(max(map(abs, zone_edges(zones))))
        return solver._condense(ground, solver._features(ground), ground.reach[1] / count, 0, order)

    def _require_level(self, zones, number):
        """The same for the lowest level on which a state can be returned, before anything is meshed."""
        ground, (order, levels) = self._ground(zones), self._levels[number]
        tips = [*self._features(ground), *zone_edges(zones)]
        self._require_few(ground, tips, self._spacings(ground, zones, None), levels, order)

    def topology(self, load):
        """Zones of the computed part as a mesh, or cells, without knowledge of them see them, and the number
        of meshes.
        """
        if not self._plain:
            zones, cell = list(first_zones(self.problem, load))[-1]
            return self._set_apart(self._computed(zones), cell), 0
        outer = self.first_guess(load)
        for passes in range(1, 13):
            ground = self._around(outer)
            cell = ground.reach[1] / COARSE[0]
            body = self._condense(ground, self._features(ground), cell, 0, COARSE[1])
            system = body.compliance.corner_system(self.law, self.obstacle)
            found = active_set.solve(*system[:2], load=self.share(load), c=system[2])
            x, closed = body.points[:, 0], found.closed.reshape(len(self.law.corners), -1)
            widest = np.abs(x[closed.any(axis=0)]).max()
            if 0.95 * ground.reach[1] < widest < 0.95 * WITHIN * self.domain:
                outer *= 1.6
            elif 2.5 * widest < ground.reach[1]:
                outer = max(widest, 2 * cell)
            else:
                return (
                    self._set_apart(
                        self.runs(x, closed, found.forces.reshape(closed.shape) / body.weights), cell
                    ),
                    passes,
                )
        raise NotConverged(f"no contact zones found at load {load:g} within {outer:g} of x1 = 0")

    def _set_apart(self, zones, cell):
        """Edges of the two corners that fall on one cell of the first mesh are put a partial zone's width
        apart.
        """
        if len(zones) == 1 or not all(zones.values()):
            return zones
        apart = PARTIAL * self.solid.ell
        a, b = (list(map(list, zones[corner])) for corner in (0, 1))
        if abs(a[-1][1] - b[-1][1]) < cell and apart < 2 * cell:
            b[-1][1] = a[-1][1] - apart
        if not self.symmetric and abs(a[0][0] - b[0][0]) < cell and apart < 2 * cell:
            a[0][0] = b[0][0] + apart
        return {
            corner: tuple((left, right) for left, right in own if right > left)
            for corner, own in ((0, a), (1, b))
        }

    def edge_coefficients(self, zones, loads, order, levels):
        """((K0, K1) at the innermost edge at each load, the same at the outermost), on one mesh fitted to
        symmetric zones.
        """
        found = self._fit_mesh(zones, order, levels)
        left = found.zones[0][0][0]
        inner = (0, left) if left > 0 else (1, found.zones[1][0][1])
        both = []
        for corner, edge in (inner, (0, found.zones[0][-1][1])):
            inward = 1 if corner == 0 and edge == found.zones[0][0][0] else -1
            way = min(abs(tip - edge) for tip in found.tips if tip != edge)
            both.append(
                [
                    self._read(found, found.pressures(self.share(load))[corner], edge, inward, way, way)
                    for load in loads
                ]
            )
        return both

    def _read(self, mesh, p, edge, inward, way, length):
        """K0 and K1 at an edge, read beyond the element there: it cannot follow 1/sqrt(r), and swings."""
        r, beside = (mesh.x - edge) * inward, mesh.length_at(edge, inward)
        reach, furthest = (FITTED * min(way, PARTIAL * self.solid.layer_length), FURTHEST * min(way, length))
        beyond = np.count_nonzero((r > beside) & (r < reach)) > TERMS
        return _coefficients(r, p, mesh.body.weights, beside if beyond else 0.0, reach, furthest)

    def _pass(self, load, zones, order, levels, spacing=None):
        """One mesh fitted to trial zones, the gaps closed on them, and where the edges should go."""
        counted()
        mesh = self._fit_mesh(zones, order, levels, spacing)
        p = mesh.pressures(self.share(load))
        moved, squares = {}, 0.0
        for corner, own in mesh.zones.items():
            moved[corner], found = self._moved(mesh, p[corner], own)
            squares += found
        return _Pass(
            **vars(mesh),
            on_zones=p,
            moved=moved,
            edge_error=math.sqrt(squares / (mesh.body.weights @ p.sum(axis=0) ** 2)),
        )

    def _moved(self, mesh, p, intervals):
        """Intervals with free ends moved by 2 K0/K1, and the square of what that changes in L2."""
        moved, square, fixed = [], 0.0, self.ends()
        others = sorted({*mesh.tips, *(-tip for tip in mesh.tips)}) if self.symmetric else mesh.tips
        for interval in intervals:
            new = []
            for edge, inward in zip(interval, (1, -1)):
                if (edge == 0 and self.symmetric) or any(abs(edge - end) < 1e-9 * abs(end) for end in fixed):
                    new.append(edge)
                    continue
                way = min(
                    [abs(other - edge) for other in others if other != edge],
                    default=interval[1] - interval[0],
                )
                K0, K1 = self._read(mesh, p, edge, inward, way, interval[1] - interval[0])
                step = 2 * K0 / K1 if K1 > 0 else math.copysign(math.inf, K0)
                step = min(max(step, -LONGEST_MOVE * way), LONGEST_MOVE * way)
                new.append(float(edge - inward * step))
                if step:
                    square += (K1 * step) ** 2 * (0.5 + 0.25 * math.log(way / abs(step)))
            moved.append(tuple(new))
        return tuple(moved), square

    def _state(self, load, trial, passes):
        """The contact state on the mesh of a pass."""
        flexibility, gaps, share = trial.system
        found = active_set.solve(flexibility, gaps, load=self.share(load), c=share, start=trial.closed)
        outer = max(abs(tip) for tip in trial.tips)
        truncation = TRUNCATION * (outer / trial.ground.far) ** 2 if self.domain == math.inf else 0.0
        estimate = Estimate(None, trial.edge_error, truncation)
        state = surface_solution(self, trial.body, load, found, trial.zones, passes, estimate)
        wrong = self._overlaps(state, trial) + self._pulled(state, trial)
        square = sum(each.worth**2 for each in wrong)
        if not getattr(self.obstacle, "formulas", False) and self.picture is not None:
            square += between.missed(*self._nodes(trial), self._sites(trial, trial.ground.reach)).sum()
        return replace(state, estimate=replace(state.estimate, obstacle=math.sqrt(square) / _size(state)))

    def _nodes(self, trial):
        return between.Facets(trial.body), trial.closed.reshape(len(trial.zones), -1), self.law, self.obstacle

    def _sites(self, trial, within):
        """Contact points of each corner at which the obstacle was looked at, and between the nodes."""
        if self.picture is None:
            return [np.zeros(0)] * len(self.law.corners)
        between_nodes = (trial.x[1:] + trial.x[:-1]) / 2
        found = [
            np.union1d(self.problem.sites(corner), between_nodes) for corner in range(len(self.law.corners))
        ]
        return [x[(x >= within[0]) & (x <= within[1])] for x in found]

    def _overlaps(self, state, trial):
        """Overlaps between open nodes, but for those next to edges, which go with them."""
        tips, hidden = self._hidden(trial)
        sites = [x[~_beside(x, tips, hidden)] for x in self._sites(trial, trial.ground.reach)]
        known = {"approach": state.approach, "raised": state._raised, "psi": state.computed_psi}
        return between.overlaps(*self._nodes(trial), sites, **known)

    def _pulled(self, state, trial):
        """Places at which the zones of a pass put a corner in tension that has to be open."""
        tips, reach = [*trial.tips, *zone_edges(trial.zones)], PARTIAL * self.solid.layer_length
        return between.pulled_at_valleys(self.problem, state.all_zones, trial.x, trial.on_zones, tips, reach)

    def _hidden(self, trial):
        """Tips of the mesh, and how far from each of them a wrong set is no other topology: arrays."""
        tips = np.array(trial.tips)
        apart = np.abs(tips[:, None] - tips) + np.where(np.eye(len(tips)), np.inf, 0)
        way = np.minimum(apart.min(axis=1), trial.ground.reach[1] - trial.ground.reach[0])
        return tips, np.where(np.isin(tips, self.ends()), np.minimum(SEEN * way, trial.near), SEEN * way)

    def _outside(self, state, trial):
        """None if no corner overlaps the obstacle on the surface beyond the contact boundary; else the zones
        with those that do.

        Raises
        ------
        LooksTooNear
            If something beyond the obstacle's picture could touch.
        """
        if self.picture is None:
            return None
        (left, right), most = (
            trial.ground.reach,
            min(trial.ground.far, 1e3 * max(map(abs, trial.ground.reach))) * (1 - 1e-9),
        )
        away = [right + (most - right) * np.geomspace(1e-4, 1, OUTSIDE)]
        if not self.symmetric:
            away.append(left - (most + left) * np.geomspace(1e-4, 1, OUTSIDE))
        zones, wrong = {corner: list(own) for corner, own in trial.zones.items()}, False
        for corner, own in zones.items():
            sites = self.problem.sites(corner)
            x = np.unique(np.concatenate([*away, sites[(sites > right) | (sites < left)]]))
            x = x[(x > -most) & (x < most) & ~((x >= left) & (x <= right)) & ((x > 0) | (not self.symmetric))]
            points = state.fields.body.mesh(x, np.zeros_like(x))
            risen = (
                self.solid.ell
                / 2
                * self.problem.lever(np.full(len(x), corner), x)
                * np.ravel(state.fields.psi(points))
            )
            risen -= state.approach + np.ravel(state.fields.u2(points))
            place = x - self.problem.shift(corner)
            known = np.any([(a <= place) & (place <= b) for a, b in self.picture.stretches], axis=0)
            if np.any(self.picture.allowed(place[~known]) + risen[~known] < 0):
                raise LooksTooNear
            overlap = known & (self.problem.initial_gap(np.full(len(x), corner), x) + risen < 0)
            for first, last in runs(overlap):
                own.append((float(x[max(first - 1, 0)]), float(x[min(last + 1, len(x) - 1)])))
                wrong = True
        return {corner: tuple(joined(own)) for corner, own in zones.items()} if wrong else None

    def _other_zones(self, state, trial, tolerance):
        """None if the state is closed on the zones of the pass, but for a little next to edges; else the
        zones it shows.

        Overlaps between the nodes that are worth more than `tolerance` of the pressure are added to these.
        """
        x, count = state.body.points[:, 0], len(trial.zones)
        closed = state.forces > 0
        tips, hidden = self._hidden(trial)
        far = ~_beside(x, tips, hidden)
        wrong = closed != trial.closed.reshape(count, -1)
        inner = MEETING * tips.max()
        # zones that meet: a small overlap or gap shows
        if tips[0] == 0 and not np.any((tips > 0) & (tips < inner)):
            far |= (x > 0) & (x < inner) & (np.count_nonzero(wrong[:, (x > 0) & (x < inner)]) >= SHOWN)
        overlaps = self._overlaps(state, trial) if state.estimate.obstacle > tolerance else []
        overlaps = [each for each in overlaps if each.worth > tolerance * _size(state)]
        valleys = self._pulled(state, trial) if state.estimate.obstacle > tolerance else []
        valleys = [each for each in valleys if each.worth > tolerance * _size(state)]
        if not np.any(wrong & far) and not overlaps and not valleys:
            return None
        zones = (
            self.runs(x, closed, state.forces / state.body.weights) if np.any(wrong & far) else trial.moved
        )
        found = {}
        for corner, own in zones.items():
            added = [(each.left, each.right) for each in overlaps if each.corner == corner]
            opened = joined([*own, *added])
            for each in valleys:
                if each.corner == corner:
                    opened = without(opened, each.left, each.right)
            found[corner] = tuple(opened)
        return found


@dataclass(frozen=True)
class _Pass(_FittedMesh):
    on_zones: np.ndarray  # pressures that close the gaps on the trial zones, (corners, n)
    moved: dict
    edge_error: float


def _beside(x, tips, hidden):
    """Whether places are nearer to the nearest of the tips than what this hides, boolean array."""
    nearest = np.argmin(np.abs(x[:, None] - tips), axis=1)
    return np.abs(x - tips[nearest]) <= hidden[nearest]


def _size(state):
    """L2 norm of the pressure of the computed part."""
    return math.sqrt(state.body.weights @ state._computed.sum(axis=0) ** 2)


def _coefficients(r, p, weights, nearest, reach, furthest):
    """K0, K1 of ``p = K0/sqrt(r) + K1 sqrt(r) + K2 r^(3/2) + ...``, least squares in L2 over nearest < r <
    reach.

    On coarse meshes the reach grows, and the series gets shorter, until there are more nodes than terms.
    """
    while np.count_nonzero((r > 1e-3 * reach) & (r < reach)) <= TERMS and reach < furthest:
        reach *= 1.5
    here = (r > max(nearest, 1e-3 * reach)) & (r < reach)
    terms = min(TERMS, np.count_nonzero(here) - 1)
    if terms < 2:
        raise NotConverged(f"only {terms + 1} contact nodes within {reach:g} of an edge")
    r, scale = r[here] / reach, np.sqrt(weights[here])
    powers = r[:, None] ** (np.arange(terms) - 0.5) * scale[:, None]
    K = np.linalg.lstsq(powers, p[here] * scale, rcond=None)[0]
    return float(K[0] * math.sqrt(reach)), float(K[1] / math.sqrt(reach))
