"""Solutions on the contact nodes of a body."""

from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np

from ..contact_solvers.nodal import NodalSolution, OfNodes, zones_of
from ..errors import BadArgument, at_most, require
from ..model import contact_candidates
from ..model.intervals import contact_zones, distance, distance_to_ends, joined
from ..model.quadrature import lagrange
from ..model.state import ErrorParts
from . import mesh_fields, meshes, off_node_violations, supports
from .body_fields import BodyFields
from .contact_nodes import ContactNodes
from .facet_rules import lobatto


@dataclass(frozen=True, eq=False, repr=False)
class OnMesh(OfNodes):
    """Base of solutions on contact nodes.

    Attributes
    ----------
    found : BodyFields, or None where they follow from the forces
    """

    found: BodyFields | None = None
    block: ContactNodes | None = None

    @property
    def nodes(self):
        return self.block or self.solver.nodes

    @property
    def loads(self):
        """Nodal normal forces and moments, array (2 n,)."""
        return self.nodes.compliance.loads(self.solver.blocks, self.forces)

    @cached_property
    def fields(self):
        """Fields, with values at points of the whole body."""
        found = self.found or self.nodes.fields(self.loads)
        return BodyFields(found.body, found, found.forces, self.mirrored)

    def reaction_on(self, boundary):
        """Force and moment that the supports of the whole body exert on a boundary."""
        found, body = self.fields.reaction(boundary), self.nodes.body
        if not self.mirrored:
            return found
        named = zip(body.mesh.GetBoundaries(), body.boundary(boundary).Mask())
        words = "is the axis of symmetry: nothing supports the whole body there"
        require({name for name, chosen in named if chosen} != {"axis"}, "boundary", boundary, words)
        return found._replace(force=np.array((0.0, 2 * found.force[1])), moment=0.0)

    def coarse(self, half_width, more=""):
        """Sentences where elements below the contact lock, or do not resolve the layer, with more advice."""
        nodes, body = self.nodes, self.nodes.body
        closed = np.atleast_2d(self.closed)[:, -len(nodes.weights) :].any(axis=0)
        pressed = np.array([closed[members].any() for members in nodes.facets])
        if not pressed.any() or half_width == 0:
            return []
        depths, orders = meshes.thicknesses(body.mesh, nodes.region)[pressed], np.array(nodes.orders)[pressed]
        longest = np.array([meshes.longest_element(body.solid, int(order)) for order in orders])
        first = np.argmin(np.where(depths > longest, longest, np.inf))
        words = (
            f"elements of order {orders[first]} that reach deeper than "
            f"{at_most(longest[first])} below the contact do not resolve the "
            f"layer: cut them, or take a higher order{more}"
        )
        return [
            *meshes.locking(body.solid, body.order, depths.max(), half_width),
            *[words] * bool(depths[first] > longest[first]),
        ]


@dataclass(frozen=True)
class Estimate(ErrorParts):
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
    block : ContactNodes of a Block, its computed part, or None of a Body
    zones : {corner number: intervals} of a Block
    """

    _: KW_ONLY
    error_estimate: float | None = None
    estimate: Estimate | None = None
    zones: dict | None = None

    @property
    def has_edges(self):
        return self.nodes.dim == 2 and not self.nodes.body.periodic

    @property
    def apart(self):
        return self.nodes.apart if self.has_edges and self.block is None else None

    @property
    def period(self):
        return None if self.has_edges else self.weights.sum()

    @property
    def end(self):
        return None if self.has_edges else self.x[0] + self.period

    @cached_property
    def micromoment(self):
        """M of (29), or the reaction where psi is held."""
        nodes = self.nodes
        moments = self._moments / nodes.weights * nodes.body.rotates
        if self._psi_held:
            reaction = nodes.moments_of("psi", self.fields.forces) / nodes.weights
            for own, node, end in self._shared_ends:
                within = np.arange(len(own))[1:-1] if len(own) > 2 else np.flatnonzero(own != node)
                reaction[node] = lagrange(lobatto(len(own) - 1)[0][within], end) @ reaction[own[within]]
            if self.block is not None and self.solver.symmetric:
                reaction[0] = 0.0
            moments = moments + reaction
        return self._whole(moments, -1)

    @property
    def _shared_ends(self):
        """[(nodes of a facet, its end that supports beside the contact hold as well, 0 or 1 there)]."""
        nodes, body = self.nodes, self.nodes.body
        beside = body.space.GetDofs(body.boundary(body.fixed["psi"]) - nodes.region)
        shared = abs(nodes.traces["psi"]) @ ~np.array(beside, bool) == 0
        ends = [(own, own[end], np.array(float(end))) for own in nodes.facets for end in (0, -1)]
        return [(own, node, abs(end)) for own, node, end in ends if shared[node]]

    @property
    def _psi_held(self):
        return "psi" in supports.held_on(self.nodes.body, self.nodes.body.contact)

    @property
    def _moments(self):
        """Nodal moments, with reactions of corners that carry, not of the shares."""
        levers = self.solver.blocks.levers(self.nodes.points[:, 0])
        forces = self.forces if self._psi_held else self.carried
        return self.solver.solid.ell / 2 * np.sum(levers * forces, axis=0)

    @cached_property
    def zones_by_name(self):
        if self.zones is not None:
            return contact_zones(self.zones, self.law.corners)
        return zones_of(self.x, self.closed, self.law, self.apart, self.end)

    @cached_property
    def energy(self):
        """Elastic energy per thickness."""
        return super().energy if self.found is None else float(self.fields.energy())

    def fields_below(self, box):
        """What `draw_below` asks for, in elements within the box."""
        return mesh_fields.below(self.fields, box)

    def interpolated(self, values, x):
        """Nodal values at x: polynomials of a condensed body, else a polygon."""
        if self.method == "newton":
            return np.interp(x, self.x, values, period=self.period)
        count, inner = len(self.nodes.weights), self.nodes.along.interpolate
        right = inner(values[-count:], x)
        return np.where(x < 0, inner(values[count - 1 :: -1], -x), right) if self.mirrored else right

    def reaches(self, x):
        return super().reaches(x) if self.has_edges else np.isfinite(x)

    def counter_displacement(self, x):
        counter = getattr(self.solver, "counter", None)
        if counter is None:
            return super().counter_displacement(x)
        return np.where(counter.reaches(x), counter.displacement(self.forces.ravel(), x), np.inf)

    @cached_property
    def sampled(self):
        """The Problem with a picture where gaps are low, if some are, and with the slope discontinuities and
        ends that it shows; BadArgument for a height of which none can be made.
        """
        problem, stretches = self.problem, off_node_violations.low_stretches(self)
        if not stretches:
            return problem
        half = max((right - left) / 2 for left, right in stretches)
        known = contact_candidates.within(problem, stretches, half, off_node_violations.LOW * self.approach)
        return replace(problem, candidates=known, obstacle=contact_candidates.seen(problem.obstacle, known))

    @property
    def ends(self):
        """Places x1 where the obstacle ends or, over a Body, jumps: pressures have no bound there."""
        problem = self.problem if self.block else self.sampled
        steps = problem.candidates.steps if problem.candidates else ()
        named = getattr(problem.obstacle, "ends", ())
        return (*(named or (-np.inf,) * len(steps[:1])), *steps)

    def tamed(self, x):
        """1; near `ends` their distance over half of their width."""
        return distance_to_ends(x, self.ends, self.solver.blocks.shifts)

    def remarks(self):
        body, zones = self.nodes.body, self.zones_by_name["contact"]
        found = self._overlap() if self.solver.penalizes else []
        if "u1" not in body.fixed:
            found.append("no support holds u1: displacements along x1 hold up to a translation")
        if not self.has_edges:
            return found
        advice = "take smaller elements"
        if self.block is not None:
            advice = "take a smaller h, or Fitted() with rtol="
        elif self.method == "condensed":
            found = [*self._far_inside(), *found]
            advice = "ask for rtol=" if self._or_rtol else advice
        found += [] if self.block is not None else self.beyond()
        if self.error_estimate is None:
            found += self._few_nodes(advice)
            widest = max((right - left for left, right in zones), default=0.0)
            found += self.coarse(widest / 2, self._or_rtol)
            found += self._missed if self.method == "condensed" else []
        return found

    @property
    def _or_rtol(self):
        """Advice where a mesh may be refined: not with `Newton`, nor for histories with friction."""
        return ", or ask for an rtol" * (self.method == "condensed" and not self.law.friction)

    def _few_nodes(self, advice):
        """Sentences where a zone has few nodes."""
        zones = self.zones_by_name["contact"]
        numbers = [np.count_nonzero((self.x >= left) & (self.x <= right)) for left, right in zones]
        few, where = min(numbers, default=0), "in contact" if len(numbers) < 2 else "in a zone of the contact"
        words = f"only {few} nodes {where} and no error estimate: {advice}"
        return [words] * bool(few <= 8)  # half a spacing is 1/16 of the zone then

    def _overlap(self):
        """Sentences where a penalty lets corners far into the obstacle."""
        inside, moved = -self.surface().gaps.min(), np.abs(self.displacement).max()
        words = f"corners lie {inside / moved:.1g} of the displacement inside the obstacle: take a larger rho"
        return [words] * bool(inside > 0.01 * moved)

    def beyond(self):
        """Sentences where surface and obstacle go on beyond an end of the contact."""
        for end, way in ((0, -1), (-1, 1)):
            there = self.points[end] + 1e-6 * np.ptp(self.x) * np.array((way, -1))
            if self.nodes.body.mesh.Contains(*there) and self.goes_on(end, there):
                words = "name all of the surface that may be touched: the contact would go on beyond x1 = "
                return [words + f"{self.x[end]:.3g}"]
        return []

    def _far_inside(self):
        moved = self.approach - self.gaps.min()
        depth = np.ptp([vertex.point[1] for vertex in self.nodes.body.mesh.vertices])
        if moved >= 0.1 * depth:
            yield f"the obstacle presses {moved:.2g} deep into a body {depth:.2g} deep: beyond small strain"

    @cached_property
    def _missed(self):
        """Sentences where nodes miss 3 % of the pressure."""
        try:
            square = off_node_violations.missed_by_nodes(self).sum()
        except BadArgument as failure:
            return [f"between the nodes the obstacle was not looked at: {failure}"]
        share = np.sqrt(square / (self.weights @ self.pressures.sum(axis=0) ** 2))
        words = f"the obstacle has features shorter than the elements, worth {share:.1g} of the pressure: "
        return [f"{words}cut the elements below them{self._or_rtol}"] * bool(share >= 0.03)


def unfolded(zones):
    """Zones of the whole line from those of x1 > 0, where corners change places."""
    others = {i: [(-right, -left) for left, right in zones[len(zones) - 1 - i]] for i in zones}
    return {i: tuple(joined([*others[i], *own])) for i, own in zones.items()}


def of_block(solver, part, load, zones, **more):
    """The MeshSolution of a Block, on the whole line, from that of its computed part and the zones there."""
    zones = unfolded(zones) if solver.symmetric else zones
    more |= {"solver": solver, "block": part.nodes, "load": load, "zones": zones}
    found = replace(part, mirrored=solver.symmetric, **more)
    return replace(
        found,
        closed=found._whole(part.carried > 0, corners=True),
        displacement=found._whole(part.displacement),
        psi=found._whole(part.psi, -1),
    )


def difference(coarse, fine):
    """max(|dp|, |dM|/ell)/|p| in L2, weighted by the distance to ends of the obstacle."""
    x, total = fine.x, fine.pressures.sum(axis=0)
    p = coarse.interpolated(coarse.pressures.sum(axis=0), x)
    moment = (coarse.interpolated(coarse.micromoment, x) - fine.micromoment) / fine.solver.solid.ell
    # beside a contact that is clamped two levels share up to 0.7 of their error: elements there are long
    moment *= np.where(fine.law.clamps_rotation & (total <= 0), 4.0, 1.0) * coarse.reaches(x)
    return distance(fine.weights * fine.tamed(x), p - total, moment, total)
