"""Contact of the ground with a rigid obstacle by finite elements whose mesh follows the edges of the zones.

A pass meshes the ground with vertices at the trial edges, condenses it to the contact nodes and closes the gaps of each
corner on its zones. At a free edge ``p = K0/sqrt(r) + K1 sqrt(r)``; at the solution ``dK0_i/de_j = -delta_ij K1_i/2``, so
moving the edges outwards by ``2 K0/K1`` is Newton's method, a mesh a step. The state returned is that of the contact-state
solver on the last mesh. Mesh and orders climb a ladder until the estimate holds, which has three parts:

discretisation   difference of pressure and micromoment between the last two rungs, each fitted for itself
edges            what moving the edges by the next step would change: p by K1 delta/(2 sqrt r) beside an edge
truncation       TRUNCATION (outer edge/far)^2: the image of the load bends the surface like 1/far^2 (docs/theory.md)
obstacle         what nodes miss of the height between them, and of overlaps that are worth less than changing the zones

The obstacle's `picture` says where it could touch. Where that is one lowest place with nothing narrow beside it, a first mesh
without knowledge of the zones shows them; else the graded cells of a half-plane do, on all low stretches, and the contact
boundary covers these, with small elements where zones or features are. On each mesh the gaps of all corners are looked at, at all
places at which the height was looked at, and of the state that is returned on the surface beyond the contact boundary as well.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from . import active_set, between, picture, topology
from .body import Body
from .condensation import Condensed
from .errors import BadArgument, NotConverged, require_finite, require_kind, require_positive, require_tolerance, require_whole
from .graded_cells import of_corners, trial_zones
from .ground import GroundScene, Within
from .law import corner_shifts
from .line_solver import LooksTooNear
from .meshes import GRADING, RATIO, SLIVER as TOLD, Ground, falling_orders, graded
from .observables import joined, runs
from .panels import Line, zone_edges
from .surface_state import Estimate, SurfaceState, difference, surface_state
from .threads import bounded, released

FAR = 1000.0         # size of an unbounded domain over the reach
BEYOND = 1.3         # reach of the contact boundary over the outermost edge
LADDER = ((4, 3), (5, 4), (6, 4), (7, 4), (8, 4), (9, 5), (10, 5), (11, 6), (12, 6))      # (order, levels)
# a logarithm, or at an end 1/sqrt(r), between two nodes: sqrt(RATIO) a level in L2; rungs of equal depth would share that error
# and not see it
KINKED = tuple((order, order) for order, _ in LADDER)
SPACING = 0.7        # of the elements on the surface, over the half-width
LAYERS = 8.0         # of them, over the layer length: order 5 sees a layer of an eighth of the element
COARSE = 12, 3       # elements over the reach and order of the first mesh, which knows no edges
RATE = 0.5, -0.15    # digits that an order adds, and that order 0 lacks: where the ladder is entered, no more
LOWEST_EVEN = 1      # rung on which edges are looked for by elements of one order: order 4 locks as low orders do
LOCATED = 0.03       # error of the edges at which more order helps more than another step
MOST_ORDER = 20      # that may be fixed
MOST_COUNT = 10**6   # elements over the reach, likewise
STEPS = 6            # of the edges on one rung
LONGEST_MOVE = 0.4   # of an edge in one step, over the way to the next
FITTED = 0.4         # of the way to the next edge, or of the layer if that is less, from where K0 and K1 are read
FURTHEST = 0.8       # of it, on meshes with too few nodes for that
TERMS = 4            # K0, K1, ... of the series in which they are read
PARTIAL = 2.4        # width of a partial zone over ell as ell -> 0: a first guess where the first mesh does not see it
SLIVER = 1e-11       # of the outer edge, to which a node is at an edge
BESIDE = 2.0         # times what a mesh tells apart: nearer edges are one
SEEN = 0.05          # of the way to the next edge: sets that differ by more are another topology
MEETING = 0.1        # of the outer edge: zones whose inner edges are this near to the axis may meet there
AT_END = 0.7         # of the half-width, times RATIO for all levels but one: an edge this near to an end of the obstacle cannot
                     # be told from it by nodes, and need not be: it changes p by as much, the 1/sqrt(r) of an end by its root
COLLAPSED = 1e-5     # of the outer edge: an inner edge this near is none; p^2 there is below 1e-3 of its size
SHOWN = 4            # nodes next to the axis that make an overlap or a gap
FIXED = 1e-3         # where no rtol is asked for: overlap between nodes, of the pressure, that makes other zones
CONDITIONS = 0.3     # of rtol, above which an overlap between nodes changes the zones
PLAIN = 1.2          # half-widths from x1 = 0, within which a simple obstacle is lowest if the first mesh shall find it
WIDEST = 8           # times farther than a classical half-plane asks for is looked at most
OUTSIDE = 60         # places on either side beyond the contact boundary, beside the obstacle's own
WITHIN = 0.98        # of a bounded domain, up to which the contact boundary may reach
MOST_SIZES = 3000    # places at which features ask for smaller elements
FEW_TIPS = 12        # of a plain obstacle: its nodes follow from the layer length alone, and memory bounds them
MOST_NODES = 2000    # on the contact boundary: the contact problem of two corners on so many takes minutes
BELOW = 0.4          # grading of meshes with lines, whose fields below the surface are asked for
TRUNCATION = 2.0     # of (outer edge/far)^2: 0.7 to 1.9 were seen, most for the unilateral law and nu = 0.45


@dataclass(frozen=True)
class FittedContact(GroundScene):
    """A scene on fitted meshes; a half-plane is cut off at FAR times the reach of the contact boundary.

    Elements shrink also towards the surface points `lines` (abscissae of the computed part), so that fields below them,
    layers and all, are as good as the pressure. With `even` all elements have one order: the approach of a bounded domain
    feels its far field, which the pressure does not, and the estimate is that of the pressure.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> scene = mb.FittedContact(solid, mb.Cylinder(R=10), mb.Microblock(), domain=10.0)
    >>> state = scene.at(1.0, rtol=1e-2)
    >>> state.estimate.total <= 1e-2, state.approach > 0
    (True, True)
    """

    lines: tuple = ()
    even: bool = False
    picture: object = field(default=None, compare=False, repr=False)      # made for each load

    usual_rtol = 1e-3

    def __post_init__(self):
        super().__post_init__()
        lines = tuple(self.lines) if np.iterable(self.lines) else (self.lines,)
        for line in lines:
            require_finite(lines=line)
        object.__setattr__(self, "lines", lines)

    def varied(self, solid, obstacle, law):
        return replace(self, solid=solid, obstacle=obstacle, law=law, picture=None)

    @property
    def line(self):
        return Line(self.solid, self.law, self.obstacle, self.symmetric, self.picture)

    def _pictured(self, load, wider=1):
        """The scene with its obstacle's picture for a load, and the kinks and ends that this shows; `wider`: times farther."""
        cut_off = self.domain < math.inf
        line = Line(self.solid, self.law, Within(self.obstacle, self.domain) if cut_off else self.obstacle, self.symmetric)
        found = picture.picture(line, load, picture.BOUND*wider)
        if cut_off:
            found = line.obstacle.forgotten(found)
        if found.steps:
            raise NotConverged(f"the height of the obstacle jumps at x = {found.steps[0]:g}, where pressures have no bound")
        return replace(self, obstacle=picture.seen(self.obstacle, found), picture=found)

    def _looking(self, load, solve, wider=1):
        """What `solve` makes of the scene with its picture, with a wider one where something beyond that could touch."""
        try:
            return solve(self._pictured(load, wider))
        except LooksTooNear:
            if wider > WIDEST:
                raise NotConverged(f"at load {load:g} the ground touches the obstacle farther and farther away") from None
            return self._looking(load, solve, 2*wider)

    @cached_property
    def _plain(self):
        """Whether one lowest place near x1 = 0 is all there is."""
        known = self.picture
        return known is None or (known.simple and abs(known.lowest) <= PLAIN*known.half_width)

    def _starts_from(self, near):
        return near.line.mirror == self.symmetric and len(near.zones) == len(self.law.corners)

    @bounded
    def at(self, load, rtol=usual_rtol, near=None):
        """The state at a load (force per thickness) to a relative L2 error of pressure and micromoment.

        Parameters
        ----------
        near : SurfaceState of a nearby load, or with the same zones, to start from

        Returns
        -------
        SurfaceState; its `estimate` tells the parts of the error

        Raises
        ------
        NotConverged
            If the ladder ends above rtol, or the zones are not found; `reached` is the smallest estimate.
        """
        self.check_load(load)
        require_tolerance(rtol)
        if near is not None:
            require_kind(SurfaceState, "a SurfaceState", near=near)

        def solve(scene):
            zones, passes = (near.zones, 0) if near else scene.topology(load)
            scene._require_rung(zones, _first_rung(rtol) + 1)
            scene, zones, passes = scene._settled(load, zones, passes)
            return scene._climb(load, rtol, zones, passes)

        return self._looking(load, solve)

    def _climb(self, load, rtol, zones, passes):
        """The state to rtol from zones to which the first rung has moved the edges."""
        coarse, best, first = None, math.inf, _first_rung(rtol)
        for rung in range(2 - first % 2, first, 2):      # edges from the lowest rung would spoil the difference of higher ones
            zones, passes = self._pass(load, zones, *self._ladder[rung]).moved, passes + 1
        for order, levels in self._ladder[first:]:
            for _ in range(STEPS):
                trial = self._pass(load, zones, order, levels)
                passes += 1
                state = self._state(load, trial, passes)
                found = self._other_zones(state, trial, CONDITIONS*rtol)
                if not found and coarse is not None:
                    state = replace(state, estimate=replace(state.estimate, discretisation=difference(coarse, state)))
                    if state.estimate.total <= rtol:
                        found = self._outside(state, trial)
                        if not found:
                            return state
                zones = found or trial.moved
                if found:      # another topology: what was computed on the old one says nothing
                    coarse = None
                    continue
                if coarse is None:
                    break
                best = min(best, state.estimate.total)
                if state.estimate.total - state.estimate.edges > rtol:
                    break
            coarse = state
        if best == math.inf:
            raise NotConverged(f"zones still changing after {passes} meshes at load {load:g}: is it next to a change of "
                               "topology?", iterations=passes)
        raise NotConverged(f"rtol = {rtol:g} was not reached at load {load:g}, the smallest error estimate was {best:.1e}; "
                           "ask for that, or fix the discretisation instead", reached=best, iterations=passes)

    @property
    def _ladder(self):
        return KINKED if getattr(self.obstacle, "kinks", ()) or getattr(self.obstacle, "ends", ()) else LADDER

    def _settled(self, load, zones, passes):
        """The scene with orders on which the edges settle, the zones there, and the number of passes."""
        try:
            return self, *self._located(load, zones, passes)
        except NotConverged as failure:
            if self.even:
                raise
            # Low orders beside the edges lock where beta is close to 2, most with nu close to 1/2
            firm = replace(self, even=True)
            return firm, *firm._located(load, zones, passes + failure.iterations)

    def _located(self, load, zones, passes):
        """Zones to which a low rung of the ladder moves edges that were good to LOCATED, and the number of passes."""
        for _ in range(STEPS):
            trial = self._pass(load, zones, *self._ladder[LOWEST_EVEN if self.even else 0])
            passes += 1
            if trial.edge_error <= LOCATED:
                return trial.moved, passes
            zones = trial.moved
            state = self._state(load, trial, passes)
            zones = self._other_zones(state, trial, CONDITIONS*LOCATED) or zones
        raise NotConverged(f"zones still changing after {passes} meshes at load {load:g}: is it next to a change of "
                           "topology, or beta close to 2? Take another load, or the half-plane", iterations=passes)

    @bounded
    def of_order(self, load, order, spacing=None):
        """The state of one order, its edges moved until rounding or ever new meshes stop them; no estimate.

        `spacing` is that of the elements on the surface (length); without it the ladder's.
        """
        self.check_load(load)
        require_whole(1, MOST_ORDER, order=order)
        if spacing is not None:
            require_positive(spacing=spacing)

        def solve(scene):
            scene, zones, passes = scene._settled(load, *scene.topology(load))
            return scene._fixed(load, order, spacing, zones, passes)

        return self._looking(load, solve)

    def _fixed(self, load, order, spacing, zones, passes):
        """The same from zones to which the first rung has moved the edges."""
        levels, last = max(own for top, own in self._ladder if top <= max(order, LADDER[0][0])), math.inf
        for _ in range(STEPS):
            trial = self._pass(load, zones, order, levels, spacing)
            passes += 1
            if trial.edge_error > last/2:
                break
            zones, last = trial.moved, trial.edge_error
        state = self._state(load, trial, passes)
        if self._other_zones(state, trial, FIXED) or self._outside(state, trial):
            raise NotConverged(f"no zones fit at load {load:g} with order {order}; ask for more", iterations=passes)
        return state

    @bounded
    def evenly(self, load, order, count):
        """The body condensed on `count` even elements over the reach that this load needs, without knowledge of the zones."""
        self.check_load(load)
        require_whole(1, MOST_ORDER, order=order)
        require_whole(1, MOST_COUNT, count=count)
        scene = self._pictured(load)
        zones, _ = scene.topology(load)
        ground = scene._around(max(map(abs, zone_edges(zones))))
        return scene._condense(ground, scene._features(ground), ground.reach[1]/count, 0, order)

    def _around(self, outer):
        """The ground with a contact boundary around x1 = 0."""
        reach = BEYOND*outer
        far = FAR*reach if self.domain == math.inf else self.domain
        if not reach < far:
            raise BadArgument("domain", self.domain, f"must be larger than the contact of half-width {outer:g}")
        return Ground(far, (0.0 if self.symmetric else -reach, reach), self.symmetric)

    def _ground(self, zones):
        """The ground with a contact boundary that covers zones and all places that could touch."""
        edges = zone_edges(zones)
        if self._plain:
            return self._around(max(map(abs, edges)))
        most = WITHIN*self.domain
        clusters, (left, right) = _clusters(zones), np.clip(self.line.reach, -most, most)
        reach = (float(min(left, clusters[0][0])), float(max(right, clusters[-1][1])))
        far = FAR*max(map(abs, reach)) if self.domain == math.inf else self.domain
        if not -far < reach[0] < reach[1] < far:
            raise BadArgument("domain", self.domain, f"must be larger than the contact from {edges[0]:g} to {edges[-1]:g}")
        return Ground(far, reach, False)

    def _spacings(self, ground, zones, spacing):
        """Lengths of elements on parts of the contact boundary, as `graded` takes them."""
        longest = LAYERS*self.solid.layer_length
        if self._plain:
            edges = zone_edges(zones)
            half = (edges[-1] - (0 if self.symmetric else edges[0]))/(1 if self.symmetric else 2)
            return ((*ground.reach, spacing or min(SPACING*half, longest)),)
        return tuple((left, right, spacing or min(SPACING*(right - left)/2/BEYOND, longest)) for left, right in _clusters(zones))

    def _sizes(self, ground, longest):
        """((x, length), ...) where features of the obstacle ask for elements shorter than `longest`."""
        line = self.line
        if self.picture is None or not np.isfinite(self.picture.lengths).any() and self.picture.angle is None:
            return ()
        (x, right), found = ground.reach, []
        while x < right:
            size = line.scale(x, x, GRADING)
            if size < longest:
                found.append((x, size))
            x += min(size, longest)/2
            if len(found) > MOST_SIZES:
                raise NotConverged(f"the obstacle has features so small or many that more than {MOST_SIZES} elements would be "
                                   "needed to see them: take uniform cells (GridContact)")
        return tuple(found)

    def _condense(self, ground, tips, spacing, levels, order):
        spacing = spacing if isinstance(spacing, tuple) else ((*ground.reach, spacing),)
        self._require_few(ground, tips, spacing, levels, order)
        sizes = self._sizes(ground, max(length for _, _, length in spacing))
        grading = BELOW if self.lines else GRADING
        mesh = graded(ground, [*tips, *self.lines], spacing=spacing, levels=levels, grading=grading, sizes=sizes)
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact|free"
        orders = np.full(mesh.ne, order) if self.even or not levels else falling_orders(mesh, ground, tips, order)
        return Condensed(Body(mesh, self.solid, orders, fixed=supports))

    def _require_few(self, ground, tips, spacings, levels, order):
        """NotConverged for more contact nodes than a contact problem is solved on in reasonable time."""
        elements = sum((right - left)/length for left, right, length in spacings) + (2*levels + 1)*len(tips)
        elements += len(self._sizes(ground, max(length for _, _, length in spacings)))/2
        if elements*order > MOST_NODES and not (self._plain and len(tips) <= FEW_TIPS):
            raise NotConverged(f"the obstacle's features and the edges of the zones ask for some {elements*order:.2g} contact "
                               f"nodes, and up to {MOST_NODES} are in reach: take uniform cells (GridContact)")

    def _require_rung(self, zones, rung):
        """The same for the lowest rung on which a state can be returned, before anything is meshed."""
        ground, (order, levels) = self._ground(zones), self._ladder[rung]
        tips = [*self._features(ground), *zone_edges(zones)]
        self._require_few(ground, tips, self._spacings(ground, zones, None), levels, order)

    @bounded
    def topology(self, load):
        """Zones of the computed part as a mesh, or cells, without knowledge of them see them, and the number of meshes."""
        if not self._plain:
            zones, cell = list(trial_zones(self.line, load))[-1]
            return topology.set_apart(self.line, of_corners(self.line, zones), cell), 0
        outer = self.first_guess(load)
        for passes in range(1, 13):
            ground = self._around(outer)
            cell = ground.reach[1]/COARSE[0]
            body = self._condense(ground, self._features(ground), cell, 0, COARSE[1])
            system = body.compliance.corner_system(self.law, self.obstacle)
            found = active_set.solve(*system[:2], load=self.share(load), c=system[2])
            x, closed = body.points[:, 0], found.closed.reshape(len(self.law.corners), -1)
            widest = np.abs(x[closed.any(axis=0)]).max()
            if widest > 0.95*ground.reach[1]:
                outer *= 1.6
            elif 2.5*widest < ground.reach[1]:
                outer = max(widest, 2*cell)
            else:
                return self._set_apart(self.runs(x, closed, found.forces.reshape(closed.shape)/body.weights), cell), passes
        raise NotConverged(f"no contact zones found at load {load:g} within {outer:g} of x1 = 0")

    def _set_apart(self, zones, cell):
        """Edges of the two corners that fall on one cell of the first mesh are put a partial zone's width apart."""
        if len(zones) == 1 or not all(zones.values()):
            return zones
        apart = PARTIAL*self.solid.ell
        a, b = (list(map(list, zones[corner])) for corner in (0, 1))
        if abs(a[-1][1] - b[-1][1]) < cell and apart < 2*cell:
            b[-1][1] = a[-1][1] - apart
        if not self.symmetric and abs(a[0][0] - b[0][0]) < cell and apart < 2*cell:
            a[0][0] = b[0][0] + apart
        return {corner: tuple((left, right) for left, right in own if right > left) for corner, own in ((0, a), (1, b))}

    def _features(self, ground):
        """Abscissae of the contact point, of the computed part and within the reach, at which a corner meets a kink or an end."""
        shifts = corner_shifts(self.law, self.solid.ell)
        kinks = [kink + shift for kink in getattr(self.obstacle, "kinks", ()) for shift in shifts]
        left, right = ground.reach
        return sorted({abs(x) if self.symmetric else x for x in (*kinks, *self.ends())
                       if left < (abs(x) if self.symmetric else x) < right or x == 0 == left})

    def _meeting(self, zones, outer):
        """Whether the zones of the two corners are about to meet on the axis: there the pressure is singular too."""
        if not self.symmetric or len(zones) == 1:
            return False
        return any(0 < edge < MEETING*outer for edge in zone_edges(zones)) or (not zones[1] and zones[0][0][0] == 0)

    @bounded
    def edge_coefficients(self, zones, loads, order, levels):
        """((K0, K1) at the innermost edge at each load, the same at the outermost), on one mesh fitted to symmetric zones."""
        found = self._fit_mesh(zones, order, levels)
        left = found.zones[0][0][0]
        inner = (0, left) if left > 0 else (1, found.zones[1][0][1])
        both = []
        for corner, edge in (inner, (0, found.zones[0][-1][1])):
            inward = 1 if corner == 0 and edge == found.zones[0][0][0] else -1
            way = min(abs(tip - edge) for tip in found.tips if tip != edge)
            both.append([self._read(found, found.pressures(self.share(load))[corner], edge, inward, way, way)
                         for load in loads])
        return both

    def _read(self, mesh, p, edge, inward, way, length):
        """K0 and K1 at an edge, read beyond the element there: it cannot follow 1/sqrt(r), and swings."""
        r, beside = (mesh.x - edge)*inward, mesh.length_at(edge, inward)
        reach, furthest = FITTED*min(way, PARTIAL*self.solid.layer_length), FURTHEST*min(way, length)
        beyond = np.count_nonzero((r > beside) & (r < reach)) > TERMS
        return _coefficients(r, p, mesh.body.weights, beside if beyond else 0.0, reach, furthest)

    def _fit_mesh(self, zones, order, levels, spacing=None):
        """A mesh with vertices at the edges of trial zones, and the corners that are closed on them."""
        edges = zone_edges(zones)
        if not edges:
            raise NotConverged("no contact")
        outer = max(abs(edge) for edge in edges)
        near = AT_END*(edges[-1] - edges[0])/2*RATIO**max(levels - 1, 0)
        zones = self._at_ends(zones, near)
        if self.symmetric:      # an edge that has run into the axis is none
            zones = {corner: tuple((left if left > COLLAPSED*outer else 0.0, right) for left, right in own
                                   if right > COLLAPSED*outer) for corner, own in zones.items()}
        edges = zone_edges(zones)
        ground = self._ground(zones)
        tips = sorted({*self._features(ground), *(edge for edge in edges if edge != 0 or not self.symmetric),
                       *([0.0] if self._meeting(zones, outer) else [])})
        body = self._condense(ground, tips, self._spacings(ground, zones, spacing), levels, order)
        system = body.compliance.corner_system(self.law, self.obstacle)
        x, margin = body.points[:, 0], SLIVER*outer
        closed = [np.any([np.zeros(len(x), bool), *((x >= left - margin) & (x <= right + margin) for left, right in own)], axis=0)
                  for own in zones.values()]
        return _FittedMesh(body, system, np.ravel(closed) & np.isfinite(system[1]), zones, ground, tips, near)

    def _at_ends(self, zones, near):
        """Zones, edges near to an end of the obstacle for their corner put there; gaps and zones of no width go."""
        found, shifts = {}, corner_shifts(self.law, self.solid.ell)
        for corner, own in zones.items():
            ends = [end + shifts[corner] for end in getattr(self.obstacle, "ends", ())]
            placed = [tuple(next((end for end in ends if abs(edge - end) < near), edge) for edge in interval) for interval in own]
            found[corner] = tuple(joined((left, right) for left, right in placed if left < right))
        return _told_apart(found)

    def _pass(self, load, zones, order, levels, spacing=None):
        """One mesh fitted to trial zones, the gaps closed on them, and where the edges should go."""
        mesh = self._fit_mesh(zones, order, levels, spacing)
        p = mesh.pressures(self.share(load))
        moved, squares = {}, 0.0
        for corner, own in mesh.zones.items():
            moved[corner], found = self._moved(mesh, p[corner], own)
            squares += found
        return _Pass(**vars(mesh), moved=moved, edge_error=math.sqrt(squares/(mesh.body.weights @ p.sum(axis=0)**2)))

    def _moved(self, mesh, p, intervals):
        """Intervals with free ends moved by 2 K0/K1, and the square of what that changes in L2."""
        moved, square, fixed = [], 0.0, self.ends()
        others = sorted({*mesh.tips, *(-tip for tip in mesh.tips)}) if self.symmetric else mesh.tips
        for interval in intervals:
            new = []
            for edge, inward in zip(interval, (1, -1)):
                if (edge == 0 and self.symmetric) or any(abs(edge - end) < 1e-9*abs(end) for end in fixed):
                    new.append(edge)
                    continue
                way = min([abs(other - edge) for other in others if other != edge], default=interval[1] - interval[0])
                K0, K1 = self._read(mesh, p, edge, inward, way, interval[1] - interval[0])
                step = 2*K0/K1 if K1 > 0 else math.copysign(math.inf, K0)
                step = min(max(step, -LONGEST_MOVE*way), LONGEST_MOVE*way)
                new.append(float(edge - inward*step))
                if step:
                    square += (K1*step)**2*(0.5 + 0.25*math.log(way/abs(step)))
            moved.append(tuple(new))
        return tuple(moved), square

    def _state(self, load, trial, passes):
        """The contact state on the mesh of a pass."""
        flexibility, gaps, share = trial.system
        found = active_set.solve(flexibility, gaps, load=self.share(load), c=share, start=trial.closed)
        outer = max(abs(tip) for tip in trial.tips)
        truncation = TRUNCATION*(outer/trial.ground.far)**2 if self.domain == math.inf else 0.0
        estimate = Estimate(None, trial.edge_error, truncation)
        state = surface_state(self.line, trial.body, load, found, trial.zones, passes, estimate)
        square = sum(each.worth**2 for each in self._overlaps(state, trial))
        if not getattr(self.obstacle, "formulas", False) and self.picture is not None:
            square += between.missed(*self._nodes(trial), self._sites(trial, trial.ground.reach)).sum()
        return replace(state, estimate=replace(state.estimate, obstacle=math.sqrt(square)/_size(state)))

    def _nodes(self, trial):
        return between.Facets(trial.body), trial.closed.reshape(len(trial.zones), -1), self.law, self.obstacle

    def _sites(self, trial, within):
        """Contact points of each corner at which the obstacle was looked at, and between the nodes."""
        if self.picture is None:
            return [np.zeros(0)]*len(self.law.corners)
        between_nodes = (trial.x[1:] + trial.x[:-1])/2
        found = [np.union1d(self.line.sites(corner), between_nodes) for corner in range(len(self.law.corners))]
        return [x[(x >= within[0]) & (x <= within[1])] for x in found]

    def _overlaps(self, state, trial):
        """Overlaps between open nodes, but for those next to edges, which go with them."""
        tips, hidden = self._hidden(trial)
        sites = [x[~_beside(x, tips, hidden)] for x in self._sites(trial, trial.ground.reach)]
        return between.overlaps(*self._nodes(trial), sites, approach=state.approach, raised=state._raised,
                                psi=state.computed_psi)

    def _hidden(self, trial):
        """Tips of the mesh, and how far from each of them a wrong set is no other topology: arrays."""
        tips = np.array(trial.tips)
        apart = np.abs(tips[:, None] - tips) + np.where(np.eye(len(tips)), np.inf, 0)
        way = np.minimum(apart.min(axis=1), trial.ground.reach[1] - trial.ground.reach[0])
        return tips, np.where(np.isin(tips, self.ends()), np.minimum(SEEN*way, trial.near), SEEN*way)

    def _outside(self, state, trial):
        """None if no corner overlaps the obstacle on the surface beyond the contact boundary; else the zones with those that do.

        Raises
        ------
        LooksTooNear
            If something beyond the obstacle's picture could touch.
        """
        if self.picture is None:
            return None
        (left, right), most = trial.ground.reach, min(trial.ground.far, 1e3*max(map(abs, trial.ground.reach)))*(1 - 1e-9)
        away = [right + (most - right)*np.geomspace(1e-4, 1, OUTSIDE)]
        if not self.symmetric:
            away.append(left - (most + left)*np.geomspace(1e-4, 1, OUTSIDE))
        zones, wrong = {corner: list(own) for corner, own in trial.zones.items()}, False
        for corner, own in zones.items():
            sites = self.line.sites(corner)
            x = np.unique(np.concatenate([*away, sites[(sites > right) | (sites < left)]]))
            x = x[(x > -most) & (x < most) & ~((x >= left) & (x <= right)) & ((x > 0) | (not self.symmetric))]
            points = state.fields.body.mesh(x, np.zeros_like(x))
            risen = self.solid.ell/2*self.line.lever(np.full(len(x), corner), x)*np.ravel(state.fields.psi(points))
            risen -= state.approach + np.ravel(state.fields.u2(points))
            place = x - self.line.shift(corner)
            known = np.any([(a <= place) & (place <= b) for a, b in self.picture.stretches], axis=0)
            if np.any(self.picture.allowed(place[~known]) + risen[~known] < 0):
                raise LooksTooNear
            overlap = known & (self.line.initial_gap(np.full(len(x), corner), x) + risen < 0)
            for first, last in runs(overlap):
                own.append((float(x[max(first - 1, 0)]), float(x[min(last + 1, len(x) - 1)])))
                wrong = True
        return {corner: tuple(joined(own)) for corner, own in zones.items()} if wrong else None

    def _other_zones(self, state, trial, tolerance):
        """None if the state is closed on the zones of the pass, but for a little next to edges; else the zones it shows.

        Overlaps between the nodes that are worth more than `tolerance` of the pressure are added to these.
        """
        x, count = state.body.points[:, 0], len(trial.zones)
        closed = state.forces > 0
        tips, hidden = self._hidden(trial)
        far = ~_beside(x, tips, hidden)
        wrong = closed != trial.closed.reshape(count, -1)
        inner = MEETING*tips.max()
        if tips[0] == 0 and not np.any((tips > 0) & (tips < inner)):      # zones that meet: a small overlap or gap shows
            far |= (x > 0) & (x < inner) & (np.count_nonzero(wrong[:, (x > 0) & (x < inner)]) >= SHOWN)
        overlaps = self._overlaps(state, trial) if state.estimate.obstacle > tolerance else []
        overlaps = [each for each in overlaps if each.worth > tolerance*_size(state)]
        if not np.any(wrong & far) and not overlaps:
            return None
        zones = self.runs(x, closed, state.forces/state.body.weights) if np.any(wrong & far) else trial.moved
        return {corner: tuple(joined([*own, *((each.left, each.right) for each in overlaps if each.corner == corner)]))
                for corner, own in zones.items()}


@dataclass(frozen=True)
class _FittedMesh:
    body: Condensed
    system: tuple
    closed: np.ndarray
    zones: dict
    ground: Ground
    tips: list
    near: float      # to an end of the obstacle: an edge nearer to it is put there

    @property
    def x(self):
        return self.body.points[:, 0]

    def length_at(self, edge, inward):
        """Length of the element at an edge, with a margin of rounding."""
        ends = np.array([(left, right) for left, right, _ in self.body.interpolation])
        left, right = ends[np.argmin(np.abs(ends[:, 0 if inward > 0 else 1] - edge))]
        return (1 + 1e-9)*(right - left)

    def pressures(self, load):
        """Pressures that close the gaps on the zones and carry the load of the computed part, array (corners, n)."""
        return _closed(*self.system, self.closed, load).reshape(len(self.zones), -1)/self.body.weights


@dataclass(frozen=True)
class _Pass(_FittedMesh):
    moved: dict
    edge_error: float


def _beside(x, tips, hidden):
    """Whether places are nearer to the nearest of the tips than what this hides, boolean array."""
    nearest = np.argmin(np.abs(x[:, None] - tips), axis=1)
    return np.abs(x - tips[nearest]) <= hidden[nearest]


def _size(state):
    """L2 norm of the pressure of the computed part."""
    return math.sqrt(state.body.weights @ state._computed.sum(axis=0)**2)


def _clusters(zones):
    """[(left, right)] around zones that are near to each other, ascending: those with gaps no wider than they are."""
    found = []
    for left, right in joined([each for own in zones.values() for each in own]):
        if found and left - found[-1][1] <= max(right - left, found[-1][1] - found[-1][0]):
            found[-1] = (found[-1][0], right)
        else:
            found.append((left, right))
    return [(left - (BEYOND - 1)*(right - left)/2, right + (BEYOND - 1)*(right - left)/2) for left, right in found]


def _told_apart(zones):
    """Zones whose edges a mesh can tell apart: those that are nearer to each other, of whatever corners, are one."""
    edges = zone_edges(zones)
    least, place = BESIDE*TOLD*(edges[-1] - edges[0]) if edges else 0.0, {}
    for edge in edges:
        before = next(reversed(place.values()), None)
        place[edge] = before if before is not None and edge - before < least else edge
    moved = {corner: [(place[left], place[right]) for left, right in own] for corner, own in zones.items()}
    return {corner: tuple(joined((left, right) for left, right in own if left < right)) for corner, own in moved.items()}


def _closed(flexibility, gaps, share, closed, load):
    """Forces that close the gaps of a set of corners and carry the load."""
    n = np.count_nonzero(closed)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = flexibility[np.ix_(closed, closed)]
    system[:n, n], system[n, :n] = -share[closed], share[closed]
    try:
        with released(n):
            solution = np.linalg.solve(system, np.append(-gaps[closed], load))
    except np.linalg.LinAlgError as failure:
        raise NotConverged(f"singular flexibility of {n} closed corners") from failure
    forces = np.zeros(len(gaps))
    forces[closed] = solution[:-1]
    return forces


def _coefficients(r, p, weights, nearest, reach, furthest):
    """K0, K1 of ``p = K0/sqrt(r) + K1 sqrt(r) + K2 r^(3/2) + ...``, least squares in L2 over nearest < r < reach.

    On coarse meshes the reach grows, and the series gets shorter, until there are more nodes than terms.
    """
    while np.count_nonzero((r > 1e-3*reach) & (r < reach)) <= TERMS and reach < furthest:
        reach *= 1.5
    here = (r > max(nearest, 1e-3*reach)) & (r < reach)
    terms = min(TERMS, np.count_nonzero(here) - 1)
    if terms < 2:
        raise NotConverged(f"only {terms + 1} contact nodes within {reach:g} of an edge")
    r, scale = r[here]/reach, np.sqrt(weights[here])
    powers = r[:, None]**(np.arange(terms) - 0.5)*scale[:, None]
    K = np.linalg.lstsq(powers, p[here]*scale, rcond=None)[0]
    return float(K[0]*math.sqrt(reach)), float(K[1]/math.sqrt(reach))


def _first_rung(rtol):
    """Number of the rung before the one that may reach rtol."""
    order = (-math.log10(rtol) + RATE[1])/RATE[0]
    return min(max(0, math.ceil(order) - 1 - LADDER[0][0]), len(LADDER) - 2)
