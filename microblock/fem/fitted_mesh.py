"""Meshes of a block whose vertices lie at the edges of trial zones, condensed to their contact nodes."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BadArgument, NotConverged
from ..model.zones import common, joined, zone_edges
from ..threads import released
from .body import Body
from .condensation import Condensed
from .ground import FAR, WITHIN, GroundSolver
from .meshes import GRADING, RATIO, Ground, falling_orders, graded
from .meshes import SLIVER as TOLD

BEYOND = 1.3  # reach of the contact boundary over the outermost edge
SPACING = 0.7  # of the elements on the surface, over the half-width
LAYERS = 8.0  # of them, over the layer length: order 5 sees a layer of an eighth of the element
SLIVER = 1e-11  # of the outer edge, to which a node is at an edge
BESIDE = 2.0  # times what a mesh tells apart: nearer edges are one
MEETING = 0.1  # of the outer edge: zones whose inner edges are this near to the axis may meet there
# of the half-width, times RATIO for all levels but one: an edge this near to an edge of the obstacle cannot
# be
# resolved by nodes, and need not be: it changes p by as much, the 1/sqrt(r) there by its root
AT_END = 0.7
COLLAPSED = 1e-5  # of the outer edge: an inner edge this near is none; p^2 there is below 1e-3 of its size
# half-widths from x1 = 0, within which a simple obstacle is lowest if the first mesh shall find it
PLAIN = 1.2
MOST_SIZES = 3000  # places at which features ask for smaller elements
# of a plain obstacle: its nodes follow from the layer length alone, and memory bounds them
FEW_TIPS = 12
MOST_NODES = 2000  # on the contact boundary: the contact problem of two corners on so many takes minutes
BELOW = 0.4  # grading of meshes with lines, whose fields below the surface are asked for


class MeshFitter(GroundSolver):
    """What makes fitted meshes; a solver adds the `picture` of the obstacle at a load, `lines` and `even`."""

    _last = None  # arguments of the last mesh, and the mesh

    @property
    def _instead(self):
        """What to take where a mesh would get too large: a half-plane is no answer for a body of a size."""
        if self.domain < math.inf:
            return "ask for a larger rtol, or take a Body on a mesh of yours"
        return "take HalfPlane(solid) with Cells()"

    @cached_property
    def _plain(self):
        """Whether one lowest place near x1 = 0 is all there is."""
        known = self.picture
        return known is None or (known.simple and abs(known.lowest) <= PLAIN * known.half_width)

    def _around(self, outer):
        """The ground with a contact boundary around x1 = 0."""
        reach = min(BEYOND * outer, WITHIN * self.domain)
        far = FAR * reach if self.domain == math.inf else self.domain
        return Ground(far, (0.0 if self.symmetric else -reach, reach), self.symmetric)

    def _ground(self, zones):
        """The ground with a contact boundary that covers zones and all places that could touch."""
        edges = zone_edges(zones)
        if self._plain:
            return self._around(max(map(abs, edges)))
        most, (left, right), clusters = WITHIN * self.domain, self.problem.reach, _clusters(zones)
        reach = np.clip((min(left, clusters[0][0]), max(right, clusters[-1][1])), -most, most).tolist()
        far = FAR * max(map(abs, reach)) if self.domain == math.inf else self.domain
        reach[0] = 0.0 if self.symmetric else reach[0]
        return Ground(far, tuple(reach), self.symmetric)

    @property
    def _furthest(self):
        """Distance from x1 = 0 up to which zones are looked for; inf on an unbounded block."""
        return 0.99 * WITHIN * self.domain

    def _unsettled(self, load, zones, passes, words="?"):
        """What to raise where zones still change."""
        edges = zone_edges(zones)
        if max(map(abs, edges), default=0.0) > self._furthest:
            where = f"from {edges[0]:.3g} to {edges[-1]:.3g}"
            allowed = f"must be larger: at load {load:g} the contact, {where}, reaches the end of the surface"
            return BadArgument("size", self.domain, allowed)
        return NotConverged(
            f"zones still changing after {passes} meshes at load {load:g}: is it next to a change of topology"
            f"{words}",
            iterations=passes,
        )

    def _spacings(self, ground, zones, spacing):
        """Lengths of elements on parts of the contact boundary, as `graded` takes them."""
        longest = LAYERS * self.solid.layer_length
        if self._plain:
            edges = zone_edges(zones)
            half = (edges[-1] - (0 if self.symmetric else edges[0])) / (1 if self.symmetric else 2)
            return ((*ground.reach, spacing or min(SPACING * half, longest)),)
        return tuple(
            (left, right, spacing or min(SPACING * (right - left) / 2 / BEYOND, longest))
            for left, right in _clusters(zones)
        )

    def _sizes(self, ground, longest):
        """((x, length), ...) where features of the obstacle ask for elements shorter than `longest`."""
        problem = self.problem
        if self.picture is None or (
            not np.isfinite(self.picture.lengths).any() and self.picture.angle is None
        ):
            return ()
        (x, right), found = ground.reach, []
        while x < right:
            size = problem.scale(x, x, GRADING)
            if size < longest:
                found.append((x, size))
            x += min(size, longest) / 2
            if len(found) > MOST_SIZES:
                raise NotConverged(
                    f"the obstacle has features so small or many that more than {MOST_SIZES} elements "
                    "would be "
                    f"needed to see them: {self._instead}"
                )
        return tuple(found)

    def _condense(self, ground, tips, spacing, levels, order):
        spacing = spacing if isinstance(spacing, tuple) else ((*ground.reach, spacing),)
        self._require_few(ground, tips, spacing, levels, order)
        sizes = self._sizes(ground, max(length for _, _, length in spacing))
        grading = BELOW if self.lines else GRADING
        mesh = self._mesh(ground, (*tips, *self.lines), spacing, levels, grading, sizes)
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact|free"
        orders = (
            np.full(mesh.ne, order) if self.even or not levels else falling_orders(mesh, ground, tips, order)
        )
        return Condensed(Body(mesh, self.solid, orders, fixed=supports))

    def _mesh(self, ground, tips, *sizes):
        """The graded mesh of these arguments; the last one is kept, for other orders on it."""
        if self._last is None or self._last[0] != (ground, tips, *sizes):
            names = ("spacing", "levels", "grading", "sizes")
            mesh = graded(ground, tips, **dict(zip(names, sizes)))
            self._last = (ground, tips, *sizes), mesh
        return self._last[1]

    def _require_few(self, ground, tips, spacings, levels, order):
        """NotConverged for more contact nodes than a contact problem is solved on in reasonable time."""
        elements = sum((right - left) / length for left, right, length in spacings) + (2 * levels + 1) * len(
            tips
        )
        elements += len(self._sizes(ground, max(length for _, _, length in spacings))) / 2
        if elements * order > MOST_NODES and not (self._plain and len(tips) <= FEW_TIPS):
            raise NotConverged(
                f"the obstacle's features and the edges of the zones ask for some {elements * order:.2g} "
                "contact "
                f"nodes, and up to {MOST_NODES} are in reach: {self._instead}"
            )

    def _features(self, ground):
        """Abscissae of the contact point, of the computed part and within the reach, at which a corner meets
        a kink or an end.
        """
        shifts = self.law.shifts(self.solid.ell)
        kinks = [kink + shift for kink in getattr(self.obstacle, "kinks", ()) for shift in shifts]
        left, right = ground.reach
        return sorted(
            {
                abs(x) if self.symmetric else x
                for x in (*kinks, *self.ends())
                if left < (abs(x) if self.symmetric else x) < right or x == 0 == left
            }
        )

    def _meeting(self, zones, outer):
        """Whether the zones of the two corners are about to meet on the axis: there the pressure is singular
        too.
        """
        if not self.symmetric or len(zones) == 1:
            return False
        return any(0 < edge < MEETING * outer for edge in zone_edges(zones)) or (
            not zones[1] and zones[0][0][0] == 0
        )

    def _fit_mesh(self, zones, order, levels, spacing=None):
        """A mesh with vertices at the edges of trial zones, and the corners that are closed on them."""
        seen = [(-self._furthest, self._furthest)]
        zones = {corner: tuple(common(own, seen)) for corner, own in zones.items()}
        edges = zone_edges(zones)
        if not edges:
            raise NotConverged("no contact")
        outer = max(abs(edge) for edge in edges)
        near = AT_END * (edges[-1] - edges[0]) / 2 * RATIO ** max(levels - 1, 0)
        zones = self._at_ends(zones, near)
        if self.symmetric:  # an edge that has run into the axis is none
            zones = {
                corner: tuple(
                    (left if left > COLLAPSED * outer else 0.0, right)
                    for left, right in own
                    if right > COLLAPSED * outer
                )
                for corner, own in zones.items()
            }
        edges = zone_edges(zones)
        ground = self._ground(zones)
        tips = sorted(
            {
                *self._features(ground),
                *(edge for edge in edges if edge != 0 or not self.symmetric),
                *([0.0] if self._meeting(zones, outer) else []),
            }
        )
        body = self._condense(ground, tips, self._spacings(ground, zones, spacing), levels, order)
        system = body.compliance.corner_system(self.law, self.obstacle)
        x, margin = body.points[:, 0], SLIVER * outer
        closed = [
            np.any(
                [
                    np.zeros(len(x), bool),
                    *((x >= left - margin) & (x <= right + margin) for left, right in own),
                ],
                axis=0,
            )
            for own in zones.values()
        ]
        return _FittedMesh(body, system, np.ravel(closed) & np.isfinite(system[1]), zones, ground, tips, near)

    def _at_ends(self, zones, near):
        """Zones, edges near to an end of the obstacle for their corner put there; gaps and zones of no width
        go.
        """
        found, shifts = {}, self.law.shifts(self.solid.ell)
        for corner, own in zones.items():
            ends = [end + shifts[corner] for end in getattr(self.obstacle, "ends", ())]
            placed = [
                tuple(next((end for end in ends if abs(edge - end) < near), edge) for edge in interval)
                for interval in own
            ]
            found[corner] = tuple(joined((left, right) for left, right in placed if left < right))
        return _told_apart(found)


@dataclass(frozen=True)
class _FittedMesh:
    body: Condensed
    system: tuple
    closed: np.ndarray
    zones: dict
    ground: Ground
    tips: list
    near: float  # to an end of the obstacle: an edge nearer to it is put there

    @property
    def x(self):
        return self.body.points[:, 0]

    def length_at(self, edge, inward):
        """Length of the element at an edge, with a margin of rounding."""
        ends = np.array([(left, right) for left, right, _ in self.body.interpolation])
        left, right = ends[np.argmin(np.abs(ends[:, 0 if inward > 0 else 1] - edge))]
        return (1 + 1e-9) * (right - left)

    def pressures(self, load):
        """Pressures that close the gaps on the zones and carry the load of the computed part, array
        (corners, n).
        """
        return _closed(*self.system, self.closed, load).reshape(len(self.zones), -1) / self.body.weights


def _clusters(zones):
    """[(left, right)] around zones that are near to each other, ascending: those with gaps no wider than
    they are.
    """
    found = []
    for left, right in joined([each for own in zones.values() for each in own]):
        if found and left - found[-1][1] <= max(right - left, found[-1][1] - found[-1][0]):
            found[-1] = (found[-1][0], right)
        else:
            found.append((left, right))
    return [
        (left - (BEYOND - 1) * (right - left) / 2, right + (BEYOND - 1) * (right - left) / 2)
        for left, right in found
    ]


def _told_apart(zones):
    """Zones whose edges a mesh can tell apart: those that are nearer to each other, of whatever corners, are
    one.
    """
    edges = zone_edges(zones)
    least, place = BESIDE * TOLD * (edges[-1] - edges[0]) if edges else 0.0, {}
    for edge in edges:
        before = next(reversed(place.values()), None)
        place[edge] = before if before is not None and edge - before < least else edge
    moved = {corner: [(place[left], place[right]) for left, right in own] for corner, own in zones.items()}
    return {
        corner: tuple(joined((left, right) for left, right in own if left < right))
        for corner, own in moved.items()
    }


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
