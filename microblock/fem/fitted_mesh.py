"""Meshes of a block with vertices at the edges of trial zones, and what their pressures say of the edges."""

import math
from functools import cached_property

import numpy as np

from ..errors import NotConverged
from ..model.zones import common, contains, joined, zone_edges
from ..threads import released
from . import between
from .body import Body
from .condensation import Condensed
from .ground import FAR, WITHIN, GroundSolver
from .meshes import GRADING, RATIO, SLIVER, Ground, apart, falling_orders, graded

BEYOND = 1.3  # reach of the contact boundary over the outermost edge
MOST_NODES = 2000  # on the contact boundary: the contact problem of two corners on so many takes minutes
LAYERS = 2.4  # width of a partial zone over the layer length


class MeshFitter(GroundSolver):
    """What makes fitted meshes, for the `picture` of the obstacle at a load."""

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
        far = FAR * max(-left, right) if self.domain == math.inf else self.domain
        # elements of order 5 see a layer of an eighth of their length
        longest = 8 * self.solid.layer_length
        lengths = [self.options.spacing or min(0.35 * (b - a) / BEYOND, longest) for a, b in parts]
        parts = [(max(a, left), min(b, right), length) for (a, b), length in zip(parts, lengths) if b > left]
        return Ground(far, (left, right), self.symmetric), tuple(parts)

    def features(self, ground):
        """Contact points within the reach at a kink or an end, ascending."""
        left, right = ground.reach
        kinks = [
            kink + shift for kink in getattr(self.obstacle, "kinks", ()) for shift in self.problem.shifts
        ]
        places = {abs(x) if self.symmetric else x for x in (*kinks, *self.ends())}
        return sorted(x for x in places if left < x < right or x == 0 == left)

    def condense(self, ground, tips, parts, levels, order):
        """The block condensed on a graded mesh; NotConverged for too many contact nodes."""
        sizes = self._sizes(ground, max(length for _, _, length in parts))
        elements = sum((b - a) / length for a, b, length in parts) + (2 * levels + 1) * len(tips)
        count = (elements + len(sizes) / 2) * order
        if count > MOST_NODES and not getattr(self.picture, "simple", True):
            instead = "take HalfPlane(solid) with Cells()"
            if self.domain < math.inf:
                instead = "ask for a larger rtol, or take a Body on a mesh of yours"
            raise NotConverged(
                "the obstacle's features and the edges of the zones ask for some "
                f"{count:.2g} contact nodes or more, and up to {MOST_NODES} are in reach: {instead}"
            )
        mesh = graded(ground, (*tips, *self.options.lines), spacing=parts, levels=levels, sizes=sizes)
        supports = dict(ground.supports)
        if self.law.clamps_rotation:
            supports["psi"] += "|contact|free"
        if levels and not self.options.even:
            order = falling_orders(mesh, ground, tips, order)
        else:
            order = np.full(mesh.ne, order)
        return Condensed(Body(mesh, self.solid, order, fixed=supports))

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
    """A mesh fitted to trial zones, and the pressures that close the gaps on them under a load.

    Parameters
    ----------
    solver : MeshFitter
    load : float, force per thickness
    zones : {corner number: intervals} of the computed part
    order, levels : of the elements, and levels at the edges

    Attributes
    ----------
    zones : those that a mesh can have
    tips : places towards which elements shrink, ascending
    body : Condensed
    system : (flexibility, initial gaps, shares in the load) of the corners
    closed, pressures : arrays (corners, n)
    near : length, below which an edge is put to an end of the obstacle

    Raises
    ------
    NotConverged
        If no zones are left, or a mesh is not made or not solved on.
    """

    def __init__(self, solver, load, zones, order, levels):
        self.solver = solver
        inside = [(-solver.furthest, solver.furthest)]
        zones = {corner: common(own, inside) for corner, own in zones.items()}
        edges = zone_edges(zones)
        if not edges:
            raise NotConverged("no contact")
        self.near = 0.35 * (edges[-1] - edges[0]) * RATIO ** max(levels - 1, 0)
        self.zones = _cleaned(solver, zones, self.near)
        edges = zone_edges(self.zones)
        self.ground, parts = solver.surface(self.zones)
        tips = {*solver.features(self.ground), *edges}
        if solver.symmetric:
            tips = {tip for tip in tips if tip > 0 or tip in solver.features(self.ground)}
            tips |= self._meeting(edges)
        self.tips = sorted(tips)
        self.body = solver.condense(self.ground, self.tips, parts, levels, order)
        self.system = self.body.compliance.corner_system(solver.law, solver.obstacle)
        self.x, margin = self.body.points[:, 0], 1e-11 * max(-edges[0], edges[-1])
        closed = [contains([(a - margin, b + margin) for a, b in own], self.x) for own in self.zones.values()]
        self.closed = np.array(closed) & np.isfinite(self.system[1]).reshape(len(closed), -1)
        self.pressures = self.pressures_under(solver.share(load))

    def _meeting(self, edges):
        """{0.0} where zones are about to meet on the axis: p is singular there."""
        near = any(0 < edge < edges[-1] / 10 for edge in edges)
        meet = len(self.zones) > 1 and (near or not self.zones[1] and self.zones[0][0][0] == 0)
        return {0.0} if meet else set()

    def pressures_under(self, load):
        """Pressures that close the gaps and carry the load."""
        (flexibility, gaps, share), closed = self.system, self.closed.ravel()
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
        return forces.reshape(self.closed.shape) / self.body.weights

    @cached_property
    def moved(self):
        """({corner: intervals with free ends moved by 2 K0/K1}, what that changes in L2)."""
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
        return moved, math.sqrt(square / (self.body.weights @ self.pressures.sum(axis=0) ** 2))

    def way(self, edge):
        """Distance from an edge to the next tip or image, or None."""
        images = [-tip for tip in self.tips] if self.solver.symmetric else []
        return min((abs(tip - edge) for tip in (*self.tips, *images) if tip != edge), default=None)

    def read(self, p, edge, inward, way, length):
        """K0, K1 of ``p = K0/sqrt(r) + K1 sqrt(r) + K2 r^(3/2) + ...`` at an edge, least squares in L2 beyond
        the element there; the reach grows until there are more nodes than terms.
        """
        r, terms = (
            (self.x - edge) * inward,
            6,
        )  # with 4 edges are off by up to 5e-5 of the width on all levels
        reach = 0.4 * min(way, LAYERS * self.solver.solid.layer_length)
        left, right = self.body.along.left, self.body.along.right
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
        scale = np.sqrt(self.body.weights[here])
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

    def violations(self, state):
        """[Overlap] of the state away from edges, without depth where tension has to open."""
        problem, law, obstacle = self.solver.problem, self.solver.law, self.solver.obstacle
        sites = [x[~self.beside_tips(x)] for x in self._sites]
        raised, psi = (state.computed(values) for values in (-state.displacement, state.psi))
        known = {"approach": state.approach, "raised": raised, "psi": psi}
        found = between.overlaps(self.body.along, self.closed, law, obstacle, sites, **known)
        tips, reach = [*self.tips, *zone_edges(self.zones)], LAYERS * problem.solid.layer_length
        zones = state.all_zones
        return found + between.pulled_at_valleys(problem, zones, self.x, self.pressures, tips, reach)

    @property
    def missed(self):
        """What nodes miss of the height: squares of pressures in L2, a number."""
        law, obstacle = self.solver.law, self.solver.obstacle
        if getattr(obstacle, "formulas", False):
            return 0.0
        return between.missed(self.body.along, self.closed, law, obstacle, self._sites).sum()

    @cached_property
    def _sites(self):
        """[array] of contact points of each corner to look at."""
        left, right = self.ground.reach
        places = (self.x[1:] + self.x[:-1]) / 2
        found = [np.union1d(self.solver.problem.sites(corner), places) for corner in self.zones]
        return [x[(x >= left) & (x <= right)] for x in found]


def _cleaned(solver, zones, near):
    """Zones whose edges a mesh tells apart, at the axis or at ends of the obstacle."""
    edges = zone_edges(zones)
    width = edges[-1] - edges[0]

    def placed(edge, ends):
        if solver.symmetric and edge <= 0:
            return 0.0
        return next((end for end in ends if abs(edge - end) < near), edge)

    found = {}
    for corner, own in zones.items():
        shift = solver.problem.shifts[corner]
        ends = [end + shift for end in getattr(solver.obstacle, "ends", ())]
        found[corner] = [(placed(left, ends), placed(right, ends)) for left, right in own]
    distinct = np.array(apart(zone_edges(found), 2 * SLIVER * width))
    for corner, own in found.items():
        own = [distinct[np.searchsorted(distinct, pair, side="right") - 1].tolist() for pair in own]
        found[corner] = tuple(joined((left, right) for left, right in own if left < right))
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
