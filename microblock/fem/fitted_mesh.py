"""Meshes of a block with vertices at the edges of trial zones, and what their pressures say of the edges."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..contact_solvers import active_set
from ..errors import NotConverged, require
from ..model.intervals import common, contains, joined, without, zone_edges
from ..model.missed_contact import Violation, overlaps
from ..model.types import Array, CornerZones, Flags, Interval
from ..threads import with_outer_threads
from . import off_node_violations
from .body import Body
from .condensation import CondensedNodes, without_idle_rotation
from .ground import FAR, WITHIN, GroundSolver
from .mesh_solution import MeshErrorParts, MeshSolution, change_between_meshes, unfolded
from .meshes import GRADING, RATIO, SLIVER, Ground, Size, Spacing, falling_orders, fitted_triangles

BEYOND = 1.3  # reach of the contact boundary over the outermost edge
MOST_NODES = 2000  # on the contact boundary: the contact problem of two corners on so many takes minutes
LAYERS = 2.4  # width of a partial zone over the layer length


def along_surface(grading_points: Sequence[float], spacings: Iterable[Spacing], levels: int) -> float:
    """Returns the number of elements of a fitted mesh along the surface, about."""
    return sum((b - a) / length for a, b, length in spacings) + (2 * levels + 1) * len(grading_points)


class MeshFitter(GroundSolver):
    """What makes fitted meshes, for the `candidates` at a load, to `far` over the reach."""

    far = FAR

    @property
    def furthest(self) -> float:
        """How far from x1 = 0 zones are looked for."""
        return 0.99 * WITHIN * self.domain

    def surface(self, zones: CornerZones) -> tuple[Ground, tuple[Spacing, ...]]:
        """Returns the Ground that covers zones, and lengths of elements, ((left, right, length), ...)."""
        intervals = [interval for corner in zones.values() for interval in corner]
        if self.symmetric:
            intervals += [(-right, -left) for left, right in intervals]
        clusters = _clusters(intervals)
        most = WITHIN * self.domain
        left = max(clusters[0][0], -most)
        right = min(clusters[-1][1], most)
        if self.symmetric:
            left = 0.0
        far = self.domain
        if far == math.inf:
            far = self.far * max(-left, right)
        # elements of order 5 see a layer of an eighth of their length
        longest = 8 * self.solid.layer_length
        spacings = [
            (max(a, left), min(b, right), self.options.spacing or min(0.35 * (b - a) / BEYOND, longest))
            for a, b in clusters
            if b > left
        ]
        return Ground(far, (left, right), self.symmetric), tuple(spacings)

    def features(self, ground: Ground) -> list[float]:
        """Returns contact points within the reach at a slope discontinuity or an end, ascending."""
        left, right = ground.reach
        places = [*self.problem.kinks, *self.ends()]
        if self.symmetric:
            places = [abs(x) for x in places]
        return sorted(x for x in set(places) if left < x < right or x == 0 == left)

    def meshed(
        self,
        ground: Ground,
        grading_points: Sequence[float],
        spacings: Sequence[Spacing],
        levels: int,
        order: int,
        even: bool,
    ) -> Body:
        """Returns the Body on fitted triangles; raises NotConverged for too many contact nodes."""
        sizes = self._sizes(ground, max(length for _, _, length in spacings))
        count = (along_surface(grading_points, spacings, levels) + len(sizes) / 2) * order
        if count > MOST_NODES and not self.candidates.simple:
            instead = "take HalfPlane(solid) with Cells()"
            if self.domain < math.inf:
                instead = "ask for a larger rtol, or take a Body on a mesh of yours"
            raise NotConverged(
                "the obstacle's features and the edges of the zones ask for some "
                f"{count:.2g} contact nodes or more, and up to {MOST_NODES} are in reach: {instead}"
            )
        lines = (*grading_points, *self.options.lines)
        mesh = fitted_triangles(ground, lines, spacings=spacings, levels=levels, sizes=sizes)
        supports = ground.supports
        if self.law.clamps_rotation:
            supports["psi"] += "|contact|free"
        orders = falling_orders(mesh, ground, grading_points, order) if levels and not even else order
        return without_idle_rotation(Body(mesh, self.solid, orders, fixed=supports), self.law)

    def _sizes(self, ground: Ground, longest: float) -> tuple[Size, ...]:
        """Returns ((x, length), ...) where the obstacle asks for shorter elements."""
        x, right = ground.reach
        sizes: list[Size] = []
        if right - x > MOST_NODES * longest:  # too many already, whatever the obstacle asks for
            return ()
        while x < right and len(sizes) < MOST_NODES:
            size = self.problem.scale(x, x, GRADING)
            if size < longest:
                sizes.append((x, size))
            x += min(size, longest) / 2
        return tuple(sizes)


class FittedMesh:
    """A mesh fitted to trial zones, the pressures that close the gaps on them under a load, and the solution.

    Parameters
    ----------
    solver : FittedSolver
    load : float, force per thickness
    zones : {corner number: intervals}, of which those of the computed part are taken
    order, levels, even : of the elements, levels at the edges, and whether all have one order
    coarse : MeshSolution of the level before, or None

    Attributes
    ----------
    zones : those that a mesh can have
    grading_points : places towards which elements shrink, ascending
    nodes : CondensedNodes
    system : (flexibility, initial gaps, weights in the load) of the corners
    closed, pressures : arrays (corners, n)
    moved : {corner: intervals with free ends moved by 2 K0/K1}
    step : float, what that changes of the pressure in L2, relative
    near : length, below which an edge is put to an end of the obstacle
    x : array (n,), of the nodes
    part : MeshSolution of the computed part
    estimate : MeshErrorParts

    Raises
    ------
    NotConverged
        If no zones are left, or a mesh is not made or not solved on.
    """

    def __init__(
        self,
        solver: MeshFitter,
        load: float,
        zones: CornerZones,
        order: int,
        levels: int,
        even: bool,
        coarse: MeshSolution | None,
    ) -> None:
        self.solver = solver
        self.load = solver.share(load)
        self.coarse = coarse
        computed = [(0.0 if solver.symmetric else -solver.furthest, solver.furthest)]
        zones = {corner: common(intervals, computed) for corner, intervals in zones.items()}
        edges = zone_edges(zones)
        if not edges:
            raise NotConverged(f"no zone is left within |x1| < {solver.furthest:g} at load {load:g}")
        self.near = 0.35 * (edges[-1] - edges[0]) * RATIO ** max(levels - 1, 0)
        self.zones = _cleaned(solver, zones, self.near)
        edges = zone_edges(self.zones)
        self.ground, spacings = solver.surface(self.zones)
        inner = [edge for edge in edges if edge > 0 or not solver.symmetric]
        self.grading_points = sorted({*solver.features(self.ground), *inner})
        self.nodes = CondensedNodes(
            solver.meshed(self.ground, self.grading_points, spacings, levels, order, even)
        )
        self.system = self.nodes.compliance.corner_system(solver.blocks, solver.obstacle)
        self.x: Array = self.nodes.points[:, 0]
        self.closed = self._closed(2 * SLIVER * (edges[-1] - edges[0]))
        self.pressures = self._closing_pressures()
        self.moved, self.step = self._moved_edges()

    def _closed(self, margin: float) -> Flags:
        """Returns the closed nodes on the zones, array (corners, n); an edge is off by up to a margin."""
        closed = np.isfinite(self.system[1]).reshape(len(self.zones), -1)
        for flags, intervals in zip(closed, self.zones.values()):
            flags &= contains([(a - margin, b + margin) for a, b in intervals], self.x)
        return closed

    def solved(self, **control: float) -> MeshSolution:
        """Returns the MeshSolution of the computed part at a load or an approach."""
        flexibility, gaps, weights = self.system
        contact = active_set.solve(flexibility, gaps, c=weights, start=self.closed.ravel(), **control)
        shape = self.closed.shape
        return MeshSolution.of_forces(
            self.solver,
            self.nodes,
            contact.load,
            contact.approach,
            contact.forces.reshape(shape),
            gaps.reshape(shape),
            contact.closed.reshape(shape),
            contact.kkt,
            contact.iterations,
            block=self.nodes,
        )

    @cached_property
    def part(self) -> MeshSolution:
        return self.solved(load=self.load)

    @cached_property
    def estimate(self) -> MeshErrorParts:
        truncation = 0.0
        if self.solver.domain == math.inf:
            # 0.7 to 1.9 of that were seen, most for the unilateral law and nu = 0.45
            truncation = 2 * (max(map(abs, self.grading_points)) / self.ground.far) ** 2
        discretisation = None
        if self.coarse is not None:
            discretisation = change_between_meshes(self.coarse, self.part)
        square = sum(violation.worth**2 for violation in self.violations)
        obstacle = self.solver.obstacle
        if not obstacle.formulas:
            square += off_node_violations.missed_heights(
                self.nodes.along, self.closed, self.solver.blocks, obstacle, self._sample_points
            ).sum()
        return MeshErrorParts(discretisation, self.step, truncation, math.sqrt(square) / self._size)

    @property
    def _size(self) -> float:
        """L2 norm of the pressure of the computed part."""
        return math.sqrt(self.nodes.weights @ self.part.pressures.sum(axis=0) ** 2)

    def other_zones(self, tolerance: float, everywhere: bool) -> CornerZones | None:
        """Returns None if the solution is closed on these zones; else its own, with violations worth more
        than `tolerance` of the pressure amended, if `everywhere` also beyond the contact boundary.
        """
        forces = self.part.forces
        violations = [one for one in self.violations if one.worth > tolerance * self._size]
        wrong = np.any((forces > 0) != self.closed, axis=0) & ~self.beside_grading_points(self.x)
        zones: dict[int, Sequence[Interval]] = dict(self.moved)
        if wrong.any():
            zones |= self.solver.runs(self.x, forces > 0, forces / self.nodes.weights)
        elif everywhere and not violations:
            violations = list(self._overlaps_beyond())
        for violation in violations:
            interval = (violation.left, violation.right)
            if violation.depth > 0:  # a corner that overlaps is closed
                zones[violation.corner] = joined([*zones[violation.corner], interval])
            else:  # one in tension is opened
                zones[violation.corner] = without(zones[violation.corner], *interval)
        return zones if wrong.any() or violations else None

    def _overlaps_beyond(self) -> Iterator[Violation]:
        """Yields Violations beyond the contact boundary; raises BadArgument if the obstacle could touch
        beyond its candidates.
        """
        solver = self.solver
        problem = solver.problem
        left, right = self.ground.reach
        most = min(self.ground.far, 1e3 * max(-left, right)) * (1 - 1e-9)
        steps = np.geomspace(1e-4, 1, 60)
        places = np.concatenate((right + (most - right) * steps, left - (most + left) * steps))
        for corner in self.zones:
            x = np.union1d(places, problem.sample_points(corner))
            x = x[(np.abs(x) < most) & ((x < left) | (x > right)) & ((x > 0) | (not solver.symmetric))]
            fields = self.part.fields(x, np.zeros_like(x))
            rotated = problem.ell / 2 * problem.levers(x)[corner] * fields.psi
            risen = rotated - self.part.approach - fields.u[1]
            below = x - problem.shifts[corner]
            sampled = contains(solver.candidates.stretches, below)
            words = "could touch at this load where it is too high for that under a half-plane"
            above = solver.candidates.allowed(below[~sampled]) + risen[~sampled] >= 0
            require(np.all(above), "obstacle", solver.contact.obstacle, words)
            gaps = np.where(sampled, problem.initial_gap(np.array(corner), x) + risen, np.inf)
            for overlap in overlaps(corner, x, gaps, 1.0):
                yield replace(overlap, worth=math.inf)

    def _closing_pressures(self) -> Array:
        """Returns pressures that close the gaps and carry the load, array (corners, n)."""
        flexibility, gaps, weights = self.system
        closed = self.closed.ravel()
        c = weights[closed]
        try:
            with with_outer_threads(len(c)):
                H = flexibility[np.ix_(closed, closed)]
                rigid, elastic = np.linalg.solve(H, np.column_stack((c, -gaps[closed]))).T
        except np.linalg.LinAlgError as failure:
            raise NotConverged(f"singular flexibility of {len(c)} closed corners") from failure
        forces = np.zeros(len(gaps))
        forces[closed] = elastic + (self.load - c @ elastic) / (c @ rigid) * rigid
        return forces.reshape(self.closed.shape) / self.nodes.weights

    def _moved_edges(self) -> tuple[dict[int, list[Interval]], float]:
        """Returns `moved` and `step`."""
        square = 0.0
        moved: dict[int, list[Interval]] = {}
        for corner, intervals in self.zones.items():
            moved[corner] = []
            for left, right in intervals:
                to_left, change_left = self._edge_step(corner, left, 1, right - left)
                to_right, change_right = self._edge_step(corner, right, -1, right - left)
                moved[corner].append((left - to_left, right + to_right))
                square += change_left + change_right
        return moved, math.sqrt(square / (self.nodes.weights @ self.pressures.sum(axis=0) ** 2))

    def _edge_step(self, corner: int, edge: float, inward: int, width: float) -> tuple[float, float]:
        """Returns the distance 2 K0/K1 by which an edge moves outwards, and the square of what that changes
        of the pressure in L2; 0 of edges at the axis or at an end of the obstacle.
        """
        solver = self.solver
        if (solver.symmetric and edge == 0) or any(math.isclose(edge, end) for end in solver.ends()):
            return 0.0, 0.0
        space = self.distance_to_grading_point(edge) or width
        K0, K1 = self.edge_coefficients(self.pressures[corner], edge, inward, space, width)
        step = 2 * K0 / K1 if K1 > 0 else math.copysign(math.inf, K0)
        step = math.copysign(min(abs(step), 0.4 * space), step)
        if not step:
            return 0.0, 0.0
        return step, (K1 * step) ** 2 * (0.5 + 0.25 * math.log(space / abs(step)))

    def distance_to_grading_point(self, edge: float) -> float | None:
        """Returns the distance from an edge to the next grading point or image, or None."""
        grading_points = list(self.grading_points)
        if self.solver.symmetric:
            grading_points += [-place for place in self.grading_points]
        return min((abs(place - edge) for place in grading_points if place != edge), default=None)

    def edge_coefficients(
        self, p: Array, edge: float, inward: int, space: float, width: float
    ) -> tuple[float, float]:
        """Returns K0, K1 of ``p = K0/sqrt(r) + K1 sqrt(r) + K2 r^(3/2) + ...`` at an edge from pressures,
        (n,), least squares in L2 beyond the element there; the reach, about up to the next of
        `grading_points` at a distance `space` or within the zone's width, grows until there are more nodes
        than terms.
        """
        r = (self.x - edge) * inward
        terms = 6  # with 4 edges were off by 5e-5 of the width on all levels
        reach = 0.4 * min(space, LAYERS * self.solver.solid.layer_length)
        facets = self.nodes.along
        facet = np.argmin(np.abs((facets.left if inward > 0 else facets.right) - edge))
        nearest = (1 + 1e-9) * (facets.right[facet] - facets.left[facet])
        if np.count_nonzero((r > nearest) & (r < reach)) <= terms:
            nearest = 0.0
        while np.count_nonzero((r > 1e-3 * reach) & (r < reach)) <= terms and reach < 0.8 * min(space, width):
            reach *= 1.5
        chosen = (r > max(nearest, 1e-3 * reach)) & (r < reach)
        terms = min(terms, int(np.count_nonzero(chosen)) - 1)
        if terms < 2:
            raise NotConverged(f"only {terms + 1} contact nodes within {reach:g} of an edge")
        scale = np.sqrt(self.nodes.weights[chosen])
        powers = (r[chosen, None] / reach) ** (np.arange(terms) - 0.5) * scale[:, None]
        K = np.linalg.lstsq(powers, p[chosen] * scale, rcond=None)[0]
        return float(K[0] * math.sqrt(reach)), float(K[1] / math.sqrt(reach))

    def beside_grading_points(self, x: Array) -> Flags:
        """Returns whether x, array (k,), is so near to one of `grading_points` that a wrong set is no other
        topology.
        """
        places = np.array(self.grading_points)
        left, right = self.ground.reach
        distances = np.abs(places[:, None] - places) + np.where(np.eye(len(places)), np.inf, 0)
        hidden = 0.05 * np.minimum(distances.min(axis=1), right - left)
        hidden = np.where(np.isin(places, self.solver.ends()), np.minimum(hidden, self.near), hidden)
        nearest = np.argmin(np.abs(x[:, None] - places), axis=1)
        return np.abs(x - places[nearest]) <= hidden[nearest]

    @cached_property
    def violations(self) -> list[Violation]:
        """[Violation] away from edges, without depth where tension has to open."""
        solver = self.solver
        points = [x[~self.beside_grading_points(x)] for x in self._sample_points]
        pressed = off_node_violations.overlaps_between_nodes(self.nodes.along, self.part, self.closed, points)
        zones = unfolded(self.zones) if solver.symmetric else self.zones
        edges = [*self.grading_points, *zone_edges(self.zones)]
        reach = LAYERS * solver.solid.layer_length
        pulled = off_node_violations.pulled_at_valleys(
            solver.problem, zones, self.x, self.pressures, edges, reach
        )
        return [*pressed, *pulled]

    @cached_property
    def _sample_points(self) -> list[Array]:
        """Contact points of each corner to look at, [(k,)]."""
        left, right = self.ground.reach
        middles = (self.x[1:] + self.x[:-1]) / 2
        points = [np.union1d(self.solver.problem.sample_points(corner), middles) for corner in self.zones]
        return [x[(x >= left) & (x <= right)] for x in points]


def _cleaned(solver: GroundSolver, zones: CornerZones, near: float) -> dict[int, tuple[Interval, ...]]:
    """Returns zones whose edges a mesh tells apart, at the axis or at ends of the obstacle."""

    def placed(edge: float, ends: Sequence[float]) -> float:
        if solver.symmetric and edge <= 0:
            return 0.0
        return next((end for end in ends if abs(edge - end) < near), edge)

    cleaned = {}
    apart = 2 * SLIVER * np.ptp(zone_edges(zones))
    for corner, intervals in zones.items():
        ends = solver.problem.ends_of(corner)
        intervals = joined([(placed(left, ends), placed(right, ends)) for left, right in intervals], apart)
        cleaned[corner] = tuple((left, right) for left, right in intervals if right - left > apart)
    return cleaned


def _clusters(intervals: Iterable[Interval]) -> list[Interval]:
    """Returns [(left, right)] around intervals with narrow gaps, ascending."""
    clusters: list[Interval] = []
    for left, right in joined(intervals):
        if clusters and left - clusters[-1][1] <= max(right - left, clusters[-1][1] - clusters[-1][0]):
            left = clusters.pop()[0]
        clusters.append((left, right))
    margin = (BEYOND - 1) / 2
    return [(left - margin * (right - left), right + margin * (right - left)) for left, right in clusters]
