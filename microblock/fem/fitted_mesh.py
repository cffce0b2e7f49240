"""Meshes of a block with vertices at the edges of trial zones, and what their pressures say of the edges."""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..contact_solvers import active_set
from ..errors import NotConverged, require
from ..model.intervals import common, contains, joined, without, zone_edges
from ..model.missed_contact import overlaps
from ..threads import with_outer_threads
from . import off_node_violations
from .body import Body
from .condensation import CondensedNodes, without_idle_rotation
from .ground import FAR, WITHIN, GroundSolver
from .mesh_solution import MeshErrorParts, MeshSolution, change_between_meshes, unfolded
from .meshes import GRADING, RATIO, SLIVER, Ground, falling_orders, fitted_triangles

BEYOND = 1.3  # reach of the contact boundary over the outermost edge
MOST_NODES = 2000  # on the contact boundary: the contact problem of two corners on so many takes minutes
LAYERS = 2.4  # width of a partial zone over the layer length


def along_surface(tips, parts, levels):
    """Number of elements of a fitted mesh along the surface, about."""
    return sum((b - a) / length for a, b, length in parts) + (2 * levels + 1) * len(tips)


class MeshFitter(GroundSolver):
    """What makes fitted meshes, for the `picture` of the obstacle at a load, to `far` over the reach."""

    far = FAR

    @property
    def furthest(self):
        """How far from x1 = 0 zones are looked for."""
        return 0.99 * WITHIN * self.domain

    def surface(self, zones):
        """The Ground that covers zones, and lengths of elements, ((left, right, length), ...)."""
        intervals = [interval for own in zones.values() for interval in own]
        if self.symmetric:
            intervals += [(-right, -left) for left, right in intervals]
        most, parts = WITHIN * self.domain, _clusters(intervals)
        left, right = max(parts[0][0], -most), min(parts[-1][1], most)
        left = 0.0 if self.symmetric else left
        far = self.far * max(-left, right) if self.domain == math.inf else self.domain
        # elements of order 5 see a layer of an eighth of their length
        longest = 8 * self.solid.layer_length
        lengths = [self.options.spacing or min(0.35 * (b - a) / BEYOND, longest) for a, b in parts]
        parts = [(max(a, left), min(b, right), length) for (a, b), length in zip(parts, lengths) if b > left]
        return Ground(far, (left, right), self.symmetric), tuple(parts)

    def features(self, ground):
        """Contact points within the reach at a kink or an end, ascending."""
        left, right = ground.reach
        places = {abs(x) if self.symmetric else x for x in (*self.problem.kinks, *self.ends())}
        return sorted(x for x in places if left < x < right or x == 0 == left)

    def meshed(self, ground, tips, parts, levels, order, even):
        """The Body on a graded mesh; NotConverged for too many contact nodes."""
        sizes = self._sizes(ground, max(length for _, _, length in parts))
        count = (along_surface(tips, parts, levels) + len(sizes) / 2) * order
        if count > MOST_NODES and not self.candidates.simple:
            instead = "take HalfPlane(solid) with Cells()"
            if self.domain < math.inf:
                instead = "ask for a larger rtol, or take a Body on a mesh of yours"
            raise NotConverged(
                "the obstacle's features and the edges of the zones ask for some "
                f"{count:.2g} contact nodes or more, and up to {MOST_NODES} are in reach: {instead}"
            )
        mesh = fitted_triangles(
            ground, (*tips, *self.options.lines), spacings=parts, levels=levels, sizes=sizes
        )
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact|free"
        orders = falling_orders(mesh, ground, tips, order) if levels and not even else order
        return without_idle_rotation(Body(mesh, self.solid, orders, fixed=supports), self.law)

    def _sizes(self, ground, longest):
        """((x, length), ...) where the obstacle asks for shorter elements."""
        (x, right), found = ground.reach, []
        if right - x > MOST_NODES * longest:  # too many already, whatever the obstacle asks for
            return ()
        while x < right and len(found) < MOST_NODES:
            size = self.problem.scale(x, x, GRADING)
            if size < longest:
                found.append((x, size))
            x += min(size, longest) / 2
        return tuple(found)


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
    tips : places towards which elements shrink, ascending
    nodes : CondensedNodes
    system : (flexibility, initial gaps, shares in the load) of the corners
    closed, pressures : arrays (corners, n)
    moved : {corner: intervals with free ends moved by 2 K0/K1}
    step : float, what that changes of the pressure in L2, relative
    near : length, below which an edge is put to an end of the obstacle
    part : MeshSolution of the computed part
    estimate : MeshErrorParts

    Raises
    ------
    NotConverged
        If no zones are left, or a mesh is not made or not solved on.
    """

    def __init__(self, solver, load, zones, order, levels, even, coarse):
        self.solver, self.load, self.coarse = solver, solver.share(load), coarse
        inside = [(0.0 if solver.symmetric else -solver.furthest, solver.furthest)]
        zones = {corner: common(own, inside) for corner, own in zones.items()}
        edges = zone_edges(zones)
        if not edges:
            raise NotConverged(f"no zone is left within |x1| < {solver.furthest:g} at load {load:g}")
        self.near = 0.35 * (edges[-1] - edges[0]) * RATIO ** max(levels - 1, 0)
        self.zones = _cleaned(solver, zones, self.near)
        edges = zone_edges(self.zones)
        self.ground, parts = solver.surface(self.zones)
        inner = [edge for edge in edges if edge > 0 or not solver.symmetric]
        self.tips = sorted({*solver.features(self.ground), *inner})
        self.nodes = CondensedNodes(solver.meshed(self.ground, self.tips, parts, levels, order, even))
        self.system = self.nodes.compliance.corner_system(solver.blocks, solver.obstacle)
        self.x, margin = self.nodes.points[:, 0], 2 * SLIVER * (edges[-1] - edges[0])  # one in the mesh
        closed = [contains([(a - margin, b + margin) for a, b in own], self.x) for own in self.zones.values()]
        self.closed = np.array(closed) & np.isfinite(self.system[1]).reshape(len(closed), -1)
        self.pressures = self._closing()
        self.moved, self.step = self._moves()

    def solved(self, **control):
        """The MeshSolution of the computed part at a load or an approach."""
        flexibility, gaps, share = self.system
        found = active_set.solve(flexibility, gaps, c=share, start=self.closed.ravel(), **control)
        forces, gaps, closed = (own.reshape(self.closed.shape) for own in (found.forces, gaps, found.closed))
        return MeshSolution.of_forces(
            self.solver,
            self.nodes,
            found.load,
            found.approach,
            forces,
            gaps,
            closed,
            found.kkt,
            found.iterations,
            block=self.nodes,
        )

    @cached_property
    def part(self):
        return self.solved(load=self.load)

    @cached_property
    def estimate(self):
        bounded = self.solver.domain < math.inf
        # 0.7 to 1.9 of that were seen, most for the unilateral law and nu = 0.45
        truncation = 0.0 if bounded else 2 * (max(map(abs, self.tips)) / self.ground.far) ** 2
        discretisation = None if self.coarse is None else change_between_meshes(self.coarse, self.part)
        square = sum(each.worth**2 for each in self.violations)
        blocks, obstacle = self.solver.blocks, self.solver.obstacle
        if not getattr(obstacle, "formulas", False):
            square += off_node_violations.missed_heights(
                self.nodes.along, self.closed, blocks, obstacle, self._sites
            ).sum()
        return MeshErrorParts(discretisation, self.step, truncation, math.sqrt(square) / self._size)

    @property
    def _size(self):
        """L2 norm of the pressure of the computed part."""
        return math.sqrt(self.nodes.weights @ self.part.pressures.sum(axis=0) ** 2)

    def other_zones(self, tolerance, everywhere):
        """None if the solution is closed on these zones; else its own, with violations worth more than
        `tolerance` of the pressure amended, if `everywhere` also beyond the contact boundary.
        """
        part, violations = self.part, [one for one in self.violations if one.worth > tolerance * self._size]
        wrong = np.any((part.forces > 0) != self.closed, axis=0) & ~self.beside_tips(self.x)
        zones = self.moved
        if wrong.any():
            zones = self.solver.runs(self.x, part.forces > 0, part.forces / self.nodes.weights)
        elif everywhere and not violations:
            violations = [*self._beyond()]
        for each in violations:
            own, interval = zones[each.corner], (each.left, each.right)
            # a corner that overlaps is closed, one in tension opened
            own = joined([*own, interval]) if each.depth > 0 else without(own, *interval)
            zones = zones | {each.corner: own}
        return zones if wrong.any() or violations else None

    def _beyond(self):
        """Yields Violations beyond the contact boundary; BadArgument if the obstacle could touch beyond its
        picture.
        """
        solver, fields = self.solver, self.part.fields
        problem, (left, right), away = solver.problem, self.ground.reach, np.geomspace(1e-4, 1, 60)
        most = min(self.ground.far, 1e3 * max(-left, right)) * (1 - 1e-9)
        away = np.concatenate((right + (most - right) * away, left - (most + left) * away))
        for corner in self.zones:
            x = np.union1d(away, problem.sites(corner))
            x = x[(np.abs(x) < most) & ((x < left) | (x > right)) & ((x > 0) | (not solver.symmetric))]
            at = fields(x, np.zeros_like(x))
            turned = problem.ell / 2 * problem.levers(x)[corner] * at.psi
            risen = turned - self.part.approach - at.u[1]
            place = x - problem.shifts[corner]
            known = contains(solver.candidates.stretches, place)
            words = "could touch at this load where it is too high for that under a half-plane"
            above = solver.candidates.allowed(place[~known]) + risen[~known] >= 0
            require(np.all(above), "obstacle", solver.contact.obstacle, words)
            gaps = np.where(known, problem.initial_gap(np.array(corner), x) + risen, np.inf)
            for overlap in overlaps(corner, x, gaps, 1.0):
                yield replace(overlap, worth=math.inf)

    def _closing(self):
        """Pressures that close the gaps and carry the load, array (corners, n)."""
        (flexibility, gaps, share), closed = self.system, self.closed.ravel()
        c, forces = share[closed], np.zeros(len(gaps))
        try:
            with with_outer_threads(len(c)):
                H = flexibility[np.ix_(closed, closed)]
                rigid, elastic = np.linalg.solve(H, np.column_stack((c, -gaps[closed]))).T
        except np.linalg.LinAlgError as failure:
            raise NotConverged(f"singular flexibility of {len(c)} closed corners") from failure
        forces[closed] = elastic + (self.load - c @ elastic) / (c @ rigid) * rigid
        return forces.reshape(self.closed.shape) / self.nodes.weights

    def _moves(self):
        """(moved, step)."""
        solver, moved, square = self.solver, {}, 0.0
        fixed = [*solver.ends(), *([0.0] if solver.symmetric else [])]
        for corner, own in self.zones.items():
            moved[corner] = []
            for left, right in own:
                new = []
                for edge, inward in ((left, 1), (right, -1)):
                    if any(math.isclose(edge, place) for place in fixed):
                        new.append(edge)
                        continue
                    way = self.way(edge) or right - left
                    K0, K1 = self.read(self.pressures[corner], edge, inward, way, right - left)
                    step = 2 * K0 / K1 if K1 > 0 else math.copysign(math.inf, K0)
                    step = math.copysign(min(abs(step), 0.4 * way), step)
                    new.append(edge - inward * step)
                    if step:
                        square += (K1 * step) ** 2 * (0.5 + 0.25 * math.log(way / abs(step)))
                moved[corner].append(tuple(new))
        return moved, math.sqrt(square / (self.nodes.weights @ self.pressures.sum(axis=0) ** 2))

    def way(self, edge):
        """Distance from an edge to the next tip or image, or None."""
        images = [-tip for tip in self.tips] if self.solver.symmetric else []
        return min((abs(tip - edge) for tip in (*self.tips, *images) if tip != edge), default=None)

    def read(self, p, edge, inward, way, length):
        """K0, K1 of ``p = K0/sqrt(r) + K1 sqrt(r) + K2 r^(3/2) + ...`` at an edge, least squares in L2 beyond
        the element there; the reach grows until there are more nodes than terms.
        """
        r, terms = (self.x - edge) * inward, 6  # with 4 edges were off by 5e-5 of the width on all levels
        reach = 0.4 * min(way, LAYERS * self.solver.solid.layer_length)
        left, right = self.nodes.along.left, self.nodes.along.right
        number = np.argmin(np.abs((left if inward > 0 else right) - edge))
        beside = (1 + 1e-9) * (right[number] - left[number])
        if np.count_nonzero((r > beside) & (r < reach)) <= terms:
            beside = 0.0
        while np.count_nonzero((r > 1e-3 * reach) & (r < reach)) <= terms and reach < 0.8 * min(way, length):
            reach *= 1.5
        here = (r > max(beside, 1e-3 * reach)) & (r < reach)
        terms = min(terms, np.count_nonzero(here) - 1)
        if terms < 2:
            raise NotConverged(f"only {terms + 1} contact nodes within {reach:g} of an edge")
        scale = np.sqrt(self.nodes.weights[here])
        powers = (r[here, None] / reach) ** (np.arange(terms) - 0.5) * scale[:, None]
        K = np.linalg.lstsq(powers, p[here] * scale, rcond=None)[0]
        return float(K[0] * math.sqrt(reach)), float(K[1] / math.sqrt(reach))

    def beside_tips(self, x):
        """Whether x is so near to a tip that a wrong set is no other topology."""
        tips, (left, right) = np.array(self.tips), self.ground.reach
        apart = np.abs(tips[:, None] - tips) + np.where(np.eye(len(tips)), np.inf, 0)
        hidden = 0.05 * np.minimum(apart.min(axis=1), right - left)
        hidden = np.where(np.isin(tips, self.solver.ends()), np.minimum(hidden, self.near), hidden)
        nearest = np.argmin(np.abs(x[:, None] - tips), axis=1)
        return np.abs(x - tips[nearest]) <= hidden[nearest]

    @cached_property
    def violations(self):
        """[Violation] away from edges, without depth where tension has to open."""
        solver, sites = self.solver, [x[~self.beside_tips(x)] for x in self._sites]
        pressed = off_node_violations.overlaps_between_nodes(self.nodes.along, self.part, self.closed, sites)
        tips, reach = [*self.tips, *zone_edges(self.zones)], LAYERS * solver.solid.layer_length
        zones = unfolded(self.zones) if solver.symmetric else self.zones
        pulled = off_node_violations.pulled_at_valleys(
            solver.problem, zones, self.x, self.pressures, tips, reach
        )
        return [*pressed, *pulled]

    @cached_property
    def _sites(self):
        """[array] of contact points of each corner to look at."""
        left, right = self.ground.reach
        places = (self.x[1:] + self.x[:-1]) / 2
        found = [np.union1d(self.solver.problem.sites(corner), places) for corner in self.zones]
        return [x[(x >= left) & (x <= right)] for x in found]


def _cleaned(solver, zones, near):
    """Zones whose edges a mesh tells apart, at the axis or at ends of the obstacle."""

    def placed(edge, ends):
        if solver.symmetric and edge <= 0:
            return 0.0
        return next((end for end in ends if abs(edge - end) < near), edge)

    found, apart = {}, 2 * SLIVER * np.ptp(zone_edges(zones))
    for corner, own in zones.items():
        ends = solver.problem.ends_of(corner)
        own = joined([(placed(left, ends), placed(right, ends)) for left, right in own], apart)
        found[corner] = tuple((left, right) for left, right in own if right - left > apart)
    return found


def _clusters(intervals):
    """[(left, right)] around intervals with narrow gaps, ascending."""
    found = []
    for left, right in joined(intervals):
        if found and left - found[-1][1] <= max(right - left, found[-1][1] - found[-1][0]):
            left = found.pop()[0]
        found.append((left, right))
    more = (BEYOND - 1) / 2
    return [(left - more * (right - left), right + more * (right - left)) for left, right in found]
