"""Solutions on the contact nodes of a body."""

from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..contact_solvers.nodal import NodalSolution, OfNodes, zones_of
from ..errors import BadArgument, at_most, require
from ..model import contact_candidates
from ..model.intervals import along_surface, contact_zones, distance, distance_to_ends, joined
from ..model.problem import Problem
from ..model.quadrature import lagrange
from ..model.refinement import FEWEST
from ..model.solution import ErrorParts
from ..model.types import Array, CornerZones, Flags, Integers, Interval, Zones
from . import mesh_fields, meshes, off_node_violations, supports
from .body_fields import BodyFields, Reaction
from .contact_nodes import ContactNodes
from .facet_rules import lobatto


@dataclass(frozen=True, eq=False, repr=False)
class OnMesh(OfNodes):
    """Base of solutions on contact nodes.

    Attributes
    ----------
    computed : BodyFields, or None where they follow from the forces
    block : ContactNodes of a Block, its computed part, or None of a Body
    """

    computed: BodyFields | None = None
    block: ContactNodes | None = None

    fields_on_mesh = True

    @property
    def nodes(self) -> Any:
        return self.block or self.solver.nodes

    @property
    def loads(self) -> Array:
        """Nodal normal forces and moments, array (2 n,)."""
        return self.nodes.compliance.loads(self.solver.blocks, self.forces)

    @cached_property
    def fields(self) -> BodyFields:
        """Fields, with values at points of the whole body."""
        fields = self.computed or self.nodes.fields(self.loads)
        counter = self.solver.counter
        second = None if counter is None else counter.fields(self.forces)
        return BodyFields(fields.body, fields, fields.forces, self.mirrored, second)

    def fields_below(self, box: tuple[Interval, float], x2: float | None = None) -> tuple[Any, Integers]:
        """Returns what `draw_below` asks for, in elements within the box, ((left, right), depth)."""
        return mesh_fields.below(self.fields, box) if x2 is None else mesh_fields.cut(self.fields, box, x2)

    @cached_property
    def energy(self) -> float:
        """Elastic energy (per thickness)."""
        return super().energy if self.computed is None else float(self.fields.energy())

    def reaction_on(self, boundary: str) -> Reaction:
        """Returns force and moment that the supports of the whole body exert on a boundary."""
        body = self.nodes.body
        reaction = self.fields.reaction(boundary)
        if not self.mirrored:
            return reaction
        named = zip(body.mesh.GetBoundaries(), body.boundary(boundary).Mask())
        words = "is the axis of symmetry: nothing supports the whole body there"
        require({name for name, chosen in named if chosen} != {"axis"}, "boundary", boundary, words)
        return reaction._replace(force=np.array((0.0, 2 * reaction.force[1])), moment=0.0)

    def free_motions(self) -> list[str]:
        """Returns a sentence where supports leave a rigid motion free that changes no gap."""
        nodes = self.nodes
        body = nodes.body
        free = body.once("free motions", lambda: supports.free_motions(body, nodes.points, nodes.normals))
        words = f"supports leave {' and '.join(free)} free: displacements hold up to a rigid motion"
        return [words] if free else []

    def overlap(self, depth: float) -> list[str]:
        """Returns a sentence where a penalty lets corners this far into the obstacle."""
        share = depth / np.abs(self.displacement).max()
        words = f"corners lie {share:.1g} of the displacement inside the obstacle: take a larger rho"
        return [words] if share > 0.01 else []

    @property
    def indentation(self) -> float:
        """Approach beyond the first touch of a node, wherever the obstacle is, or what supports that move
        press the surface by (length).
        """
        moved = float(self.approach - self.gaps.min())
        return max(moved, float(np.ptp(self.displacement))) if self.nodes.body.prescribed else moved

    def deep_indentation(self) -> list[str]:
        """Returns a sentence where the indentation is no small part of the body's depth."""
        moved = self.indentation
        depth = np.ptp([vertex.point[-1] for vertex in self.nodes.body.mesh.vertices])
        words = f"the obstacle presses {moved:.2g} deep into a body {depth:.2g} deep: beyond small strain"
        return [words] if moved >= 0.1 * depth else []

    def coarse(self, half_width: float, advice: str = "") -> list[str]:
        """Returns sentences where elements below the contact lock, or do not resolve the layer, with more
        advice.
        """
        nodes = self.nodes
        body = nodes.body
        closed: Flags = np.any(np.atleast_2d(self.closed)[:, -len(nodes.weights) :], axis=0)
        pressed = np.array([closed[members].any() for members in nodes.facets])
        if not pressed.any() or half_width == 0:
            return []
        depths = meshes.thicknesses(body.mesh, nodes.region)[pressed]
        orders = np.array(nodes.orders)[pressed]
        sentences = meshes.locking(body.solid, body.order, depths.max(), half_width)
        longest = np.array([meshes.longest_element(body.solid, int(order)) for order in orders])
        first = np.argmin(np.where(depths > longest, longest, np.inf))
        if depths[first] > longest[first]:
            sentences.append(
                f"elements of order {orders[first]} that reach deeper than "
                f"{at_most(longest[first])} below the contact do not resolve the "
                f"layer: cut them, or take a higher order{advice}"
            )
        return sentences


@dataclass(frozen=True)
class MeshErrorParts(ErrorParts):
    """Parts of the relative L2 error of pressure and micromoment.

    Attributes
    ----------
    discretisation : float, distance to the next coarser level; None of a prescribed mesh
    edges : float, what the next step of the edges would change
    truncation : float, of a half-plane that is cut off
    obstacle : float, what the nodes miss of the obstacle
    """

    discretisation: float | None
    edges: float
    truncation: float
    obstacle: float


@dataclass(frozen=True, eq=False, repr=False)
class MeshSolution(OnMesh, NodalSolution):
    """A solution on a mesh of one or two dimensions; of a symmetric Block the half x1 > 0 is computed.

    Attributes
    ----------
    gaps, closed : arrays (corners, n), of the computed part
    error_estimate : float, of `recovery.estimate` or of `estimate`, or None
    zones : {corner number: intervals} of a Block
    """

    _: KW_ONLY
    error_estimate: float | None = None
    estimate: MeshErrorParts | None = None
    zones: CornerZones | None = None

    @property
    def stiffness(self) -> float | None:  # type: ignore[override]
        """That of the nodes; None of a method that does not condense to them, and with friction."""
        if self.method in ("newton", "uniform") or self.law.friction:
            return None
        return super().stiffness

    def corner_flexibility(self) -> tuple[Array, Array]:
        """Returns flexibility and weights of the computed part of a Block, or of a Body."""
        if self.block is None:
            return super().corner_flexibility()
        system = self.nodes.compliance.corner_system(self.solver.blocks, self.solver.obstacle)
        return system[0], system[2]

    @property
    def has_edges(self) -> bool:  # type: ignore[override]
        return self.nodes.dim == 2 and not self.nodes.body.periodic

    @property
    def interrupted(self) -> Flags | None:  # type: ignore[override]
        return self.nodes.interrupted if self.has_edges and self.block is None else None

    @property
    def period(self) -> float | None:  # type: ignore[override]
        return None if self.has_edges else self.weights.sum()

    @property
    def end(self) -> float | None:
        """Where the period that begins at the first node ends (x1), or None."""
        return None if self.period is None else self.x[0] + self.period

    @cached_property
    def micromoment(self) -> Array:
        """M of (29), or the reaction where psi is held, array (n,)."""
        nodes = self.nodes
        moments = self._moments / nodes.weights * nodes.body.rotates
        if self._psi_held:
            reaction = nodes.moments_of("psi", self.fields.forces) / nodes.weights
            for facet, node, end in self._shared_ends():
                inner = np.flatnonzero(facet != node)
                if len(facet) > 2:
                    inner = np.arange(1, len(facet) - 1)
                reaction[node] = lagrange(lobatto(len(facet) - 1)[0][inner], end) @ reaction[facet[inner]]
            if self.block is not None and self.solver.symmetric:
                reaction[0] = 0.0
            moments = moments + reaction
        return self._on_both_sides(moments, -1)

    def _shared_ends(self) -> Iterator[tuple[Integers, int, Array]]:
        """Yields (nodes of a facet, its end that supports beside the contact hold as well, 0 or 1 there)."""
        nodes = self.nodes
        body = nodes.body
        beside = body.space.GetDofs(body.boundary(body.fixed["psi"]) - nodes.region)
        shared = abs(nodes.traces["psi"]) @ ~np.array(beside, bool) == 0
        for facet in nodes.facets:
            for node, end in ((facet[0], 0.0), (facet[-1], 1.0)):
                if shared[node]:
                    yield facet, node, np.array(end)

    @property
    def _psi_held(self) -> bool:
        return "psi" in supports.held_on(self.nodes.body, self.nodes.body.contact)

    @property
    def _moments(self) -> Array:
        """Nodal moments, with reactions of corners that carry, not of the shares, array (n,)."""
        levers = self.solver.blocks.levers(self.nodes.points[:, 0])
        forces = self.forces if self._psi_held else self.carried
        return self.solver.solid.ell / 2 * np.sum(levers * forces, axis=0)

    @cached_property
    def zones_by_name(self) -> Zones:
        if self.zones is not None:
            return contact_zones(self.zones, self.law.corners)
        return zones_of(self.x, self.closed, self.law, self.interrupted, self.end)

    def interpolated(self, values: Array, x: Array) -> Array:
        """Returns nodal values, (n,), at x, (k,): polynomials of a condensed body, else a polygon."""
        if self.method == "newton":
            return along_surface(x, self.x, values, self.period)
        count = len(self.nodes.weights)
        polynomials = self.nodes.along
        right = polynomials.interpolate(values[-count:], x)
        if not self.mirrored:
            return right
        return np.where(x < 0, polynomials.interpolate(values[count - 1 :: -1], -x), right)

    def covers(self, x: Array) -> Flags:
        return super().covers(x) if self.has_edges else np.isfinite(x)

    def counter_displacement(self, x: Array) -> Array:
        counter = self.solver.counter
        if counter is None:
            return super().counter_displacement(x)
        return np.asarray(counter.lifted(self.forces, x[:, None]), float)

    def counter_along(self, points: Array, normals: Array) -> Array:
        counter = self.solver.counter
        if counter is None:
            return super().counter_along(points, normals)
        return np.asarray(counter.along(self.forces, points, normals), float)

    @cached_property
    def sampled(self) -> Problem:
        """The Problem with candidates where gaps are low, if some are, and with the slope discontinuities and
        ends that they show; BadArgument for a height of which none can be made.
        """
        problem = self.problem
        stretches = off_node_violations.low_stretches(self)
        if not stretches:
            return problem
        half = max((right - left) / 2 for left, right in stretches)
        floor = off_node_violations.LOW * self.indentation
        candidates = contact_candidates.candidates_within(problem, stretches, half, floor)
        obstacle = contact_candidates.with_detected_kinks(problem.obstacle, candidates)
        return replace(problem, candidates=candidates, obstacle=obstacle)

    @property
    def ends(self) -> tuple[float, ...]:
        """Places x1 where the obstacle ends or, over a Body, jumps: pressures have no bound there."""
        problem = self.problem if self.block else self.sampled
        height_jumps = problem.candidates.height_jumps if problem.candidates else ()
        ends = problem.obstacle.ends
        return (*(ends or (-np.inf,) * len(height_jumps[:1])), *height_jumps)

    def norm_weights(self, x: Array) -> Array:
        """Returns weights at x, arrays of one shape: 1; near `ends` their distance over half of their
        width.
        """
        return distance_to_ends(x, self.ends, self.solver.blocks.shifts)

    def remarks(self) -> list[str]:
        """Returns sentences on what the state has no estimate for."""
        remarks = self.overlap(-self.surface().gaps.min()) if self.solver.penalizes else []
        remarks += self.free_motions()
        if not self.has_edges:
            return remarks
        condensed = self.block is None and self.method == "condensed"
        if condensed:
            remarks = [*self.deep_indentation(), *remarks]
        if self.block is None:
            remarks += self.beyond()
        if self.error_estimate is None:
            remarks += self._few_nodes()
            zones = self.zones_by_name["contact"]
            widest = max((right - left for left, right in zones), default=0.0)
            remarks += self.coarse(widest / 2, self._or_rtol)
            remarks += self._on_second_body(zones)
            if self.block is None:
                remarks += self._missed
        return remarks

    @property
    def _or_rtol(self) -> str:
        """Advice where a mesh may be refined: not with `Newton`, nor for histories with friction."""
        refines = self.method == "condensed" and not self.law.friction and self.solver.counter is None
        return ", or ask for an rtol" * refines

    def _few_nodes(self) -> list[str]:
        """Returns a sentence where a zone has few nodes."""
        zones = self.zones_by_name["contact"]
        x = self.x[np.any(self.closed, axis=0)]  # a side has many nodes at one place
        counts = [np.count_nonzero((x >= left) & (x <= right)) for left, right in zones]
        few = min(counts, default=0)
        if few > FEWEST:
            return []
        where = "in contact" if len(counts) < 2 else "in a zone of the contact"
        advice = "take smaller elements"
        if self.block is not None:
            advice = "take a smaller h, or Fitted() with rtol="
        elif self._or_rtol:
            advice = "ask for rtol="
        return [f"only {few} nodes {where} and no error estimate: {advice}"]

    def _on_second_body(self, zones: Sequence[Interval]) -> list[str]:
        """Returns sentences where few unknowns of a second body lie over a zone of the contact, or none."""
        counter = self.solver.counter
        if counter is None:
            return []
        counts = sorted(counter.unknowns_between(left, right) for left, right in zones)
        few = [
            f"only {count} nodes of the second body over a zone of the contact: take smaller elements for it"
            for count in counts[:1]
            if count <= FEWEST
        ]
        return [*few, *counter.ends_in(self.closed), *counter.held_apart(self.closed)]

    def beyond(self) -> list[str]:
        """Returns a sentence where surface and obstacle go on beyond an end of the contact."""
        for end, way in ((0, -1), (-1, 1)):
            outside = self.points[end] + 1e-6 * np.ptp(self.x) * np.array((way, -1))
            if self.nodes.body.mesh.Contains(*outside) and self.goes_on(end, outside):
                words = "name all of the surface that may be touched: the contact would go on beyond x1 = "
                return [words + f"{self.x[end]:.3g}"]
        return []

    @cached_property
    def _missed(self) -> list[str]:
        """Sentences where nodes miss 3 % of the pressure."""
        try:
            square = off_node_violations.missed_by_nodes(self).sum()
        except BadArgument as failure:
            return [f"between the nodes the obstacle was not looked at: {failure}"]
        share = np.sqrt(square / (self.weights @ self.pressures.sum(axis=0) ** 2))
        words = f"the obstacle has features shorter than the elements, worth {share:.1g} of the pressure: "
        return [f"{words}cut the elements below them{self._or_rtol}"] if share >= 0.03 else []


def unfolded(zones: CornerZones) -> dict[int, tuple[Interval, ...]]:
    """Returns zones of the whole line from those of x1 > 0, where corners change places."""
    images = {i: [(-right, -left) for left, right in zones[len(zones) - 1 - i]] for i in zones}
    return {i: tuple(joined([*images[i], *intervals])) for i, intervals in zones.items()}


def of_block(solver: Any, part: MeshSolution, load: float, zones: CornerZones, **more: Any) -> MeshSolution:
    """Returns the MeshSolution of a Block, on the whole line, from that of its computed part and the zones
    there.
    """
    if solver.symmetric:
        zones = unfolded(zones)
    more |= {"solver": solver, "block": part.nodes, "load": load, "zones": zones}
    solution = replace(part, mirrored=solver.symmetric, **more)
    return replace(
        solution,
        closed=solution._on_both_sides(part.carried > 0, corners=True),
        displacement=solution._on_both_sides(part.displacement),
        psi=solution._on_both_sides(part.psi, -1),
    )


def change_between_meshes(coarse: MeshSolution, fine: MeshSolution) -> float:
    """Returns max(|dp|, |dM|/ell)/|p| in L2, weighted by the distance to ends of the obstacle."""
    x = fine.x
    total = fine.pressures.sum(axis=0)
    pressure = coarse.interpolated(coarse.pressures.sum(axis=0), x) - total
    moment = (coarse.interpolated(coarse.micromoment, x) - fine.micromoment) / fine.solver.solid.ell
    # beside a contact that is clamped two levels share up to 0.7 of their error: elements there are long
    moment *= np.where(fine.law.clamps_rotation & (total <= 0), 4.0, 1.0) * coarse.covers(x)
    return distance(fine.weights * fine.norm_weights(x), pressure, moment, total)
