"""Solutions on the contact nodes of a body."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any

import ngsolve as ng
import numpy as np

from ..corners.nodal import AtNodes, zones_of
from ..errors import BadArgument, at_most
from ..model.state import Solution
from ..model.zones import distance_to_ends
from . import between, meshes, supports
from .body import Fields
from .mesh_fields import BelowOnMesh


@dataclass(frozen=True, eq=False, repr=False)
class OnMesh(Solution):
    """Base of solutions on contact nodes.

    Attributes
    ----------
    solver : Solver
    load, approach : float
    forces : array (corners, n), along -n
    displacement, psi : arrays (n,), in space psi (2, n): -u.n and microrotation
    residual : float
    iterations, unknowns : int
    method : str
    found : Fields, or None where they follow from the forces
    nodes : ContactNodes
    """

    solver: Any
    load: float
    approach: float
    forces: np.ndarray
    displacement: np.ndarray
    psi: np.ndarray
    residual: float
    iterations: int
    unknowns: int
    method: str = "condensed"
    found: Fields | None = None

    @property
    def nodes(self):
        return self.solver.nodes

    @property
    def points(self):
        return self.nodes.points

    @property
    def normals(self):
        return self.nodes.normals

    @property
    def weights(self):
        """Lengths (areas) of the surface: the load is ``weights @ (p*n2)``."""
        return self.nodes.weights

    @cached_property
    def pressures(self):
        """Pressure of each corner, (corners, n); of corners that move together the mean."""
        return np.where(self.nodes.twins, self.forces.mean(axis=0), self.forces) / self.nodes.weights

    @property
    def loads(self):
        """Nodal normal forces and moments, array (2 n,)."""
        return self.nodes.compliance.loads(self.law, self.forces)

    @cached_property
    def fields(self):
        return self.found or self.nodes.fields(self.loads)

    def reaction_on(self, boundary):
        """Force and moment that the supports on a boundary exert."""
        return self.fields.reaction(boundary)


@dataclass(frozen=True, eq=False, repr=False)
class MeshSolution(BelowOnMesh, OnMesh, AtNodes):
    """A solution on a mesh of one or two dimensions.

    Attributes
    ----------
    gaps : array (corners, n), initial ones, inf where a corner cannot touch
    closed : boolean array (corners, n)
    error_estimate : float, of `recovery.estimate`, or None
    """

    _: KW_ONLY
    gaps: np.ndarray
    closed: np.ndarray
    error_estimate: float | None = None

    @property
    def has_edges(self):
        return self.nodes.dim == 2 and not self.nodes.body.periodic

    @property
    def apart(self):
        return self.nodes.apart if self.has_edges else None

    @property
    def period(self):
        return None if self.has_edges else self.weights.sum()

    @property
    def end(self):
        return None if self.has_edges else self.x[0] + self.period

    @cached_property
    def micromoment(self):
        """M of (29), or the reaction where psi is held."""
        moments, nodes = self._moments, self.nodes
        if self._psi_held:
            moments = moments + nodes.moments_of("psi", self.fields.forces)
        return moments / self.weights

    @property
    def _psi_held(self):
        return "psi" in supports.held_on(self.nodes.body, self.nodes.boundary)

    @property
    def _moments(self):
        """Nodal moments, with reactions of corners that carry, not of the shares."""
        levers = np.array(list(self.law.levers(self.x).values()))
        forces = self.forces if self._psi_held else self.pressures * self.weights
        return self.solver.solid.ell / 2 * np.sum(levers * forces, axis=0)

    @cached_property
    def zones_by_name(self):
        return zones_of(self.x, self.closed, self.law, self.apart, self.end)

    @cached_property
    def energy(self):
        """Elastic energy per thickness."""
        if self.found is not None:
            return float(self.found.energy())
        pressed = self.forces > 0
        depth = self.approach * self.normals[:, 1] - np.where(pressed, self.gaps, 0)
        return float(np.sum(self.forces * np.where(pressed, depth, 0)) / 2)

    def interpolated(self, values, x):
        """Nodal values at x: polynomials of a condensed body, else a polygon."""
        if self.method == "condensed":
            return self.nodes.along.interpolate(values, x)
        return np.interp(x, self.x, values, period=self.period)

    def reaches(self, x):
        return super().reaches(x) if self.has_edges else np.isfinite(x)

    def counter_displacement(self, x):
        counter = getattr(self.solver, "counter", None)
        if counter is None:
            return np.zeros_like(x)
        found, there = np.full_like(x, np.inf), counter.reaches(x)
        found[there] = counter.displacement(self.forces.ravel(), x[there])
        return found

    def tamed(self, x):
        """1; near ends of the obstacle their distance over half of its width."""
        shifts = self.law.shifts(self.solver.solid.ell)
        return distance_to_ends(x, getattr(self.solver.obstacle, "ends", ()), shifts)

    def remarks(self):
        found = self.overlap() if self.solver.penalizes else []
        if "u1" not in self.nodes.body.fixed:
            found.append("no support holds u1: displacements along x1 hold up to a translation")
        if not self.has_edges:
            return found
        condensed = self.method == "condensed"
        found += self.beyond()
        found += self.few_nodes("ask for rtol=" if condensed else "take smaller elements")
        found += self.locking(self.nodes)
        if not condensed:
            return found
        coarse = [] if self.error_estimate is not None else [*self._unresolved(), *self._missed]
        return [*self._far_inside(), *found, *coarse]

    def beyond(self):
        """Sentences where surface and obstacle go on beyond an end of the contact."""
        mesh, inside = self.nodes.body.mesh, self.nodes.region.Mask()
        facets = [facet.vertices for facet in mesh.Elements(ng.BND) if not inside[facet.index]]
        sides = np.array([[mesh[vertex].point for vertex in own] for own in facets]).reshape(-1, 2, 2)
        starts, ends = np.concatenate((sides, sides[:, ::-1])).swapaxes(0, 1)
        for end, way in ((0, -1), (-1, 1)):
            level = way * (ends - starts)[:, 0] > np.abs(ends - starts)[:, 1]
            near = np.abs(starts - self.points[end]).max(axis=1) < 1e-9 * np.ptp(self.x)
            there, upwards = ends[near & level], self.normals[[end] * np.count_nonzero(near & level)]
            gaps = self.law.initial_gaps(there, upwards, self.solver.solid.ell, self.solver.obstacle)
            if self.closed[:, end].any() and np.isfinite(list(gaps.values())).any():
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
            square = between.of_body(self).sum()
        except BadArgument as failure:
            return [f"between the nodes the obstacle was not looked at: {failure}"]
        share = np.sqrt(square / (self.weights @ self.pressures.sum(axis=0) ** 2))
        words = f"the obstacle has features shorter than the elements, worth {share:.1g} of the pressure: "
        return [words + "cut the elements below them, or ask for an rtol"] * bool(share >= 0.03)

    def _unresolved(self):
        body, closed = self.nodes.body, self.closed.any(axis=0)
        numbers, across = meshes.thicknesses(body.mesh, self.nodes.region)
        pressed = np.array([closed[members].any() for members in self.nodes.facets])
        orders = body.element_orders
        orders = np.full(body.mesh.ne, min(body.order, body.order_psi)) if orders is None else orders
        longest = np.array([meshes.longest_element(body.solid, int(order)) for order in orders[numbers]])
        late = np.flatnonzero(pressed & (across > longest))
        if len(late):
            first = late[np.argmin(longest[late])]
            yield (
                f"elements of order {orders[numbers[first]]} that reach deeper than "
                f"{at_most(longest[first])} below the contact do not resolve the layer: cut them, take a "
                "higher order, or ask for an rtol"
            )


def of_condensed(solver, load, approach, forces, gaps, closed, residual, iterations):
    """The MeshSolution of corner forces, array (corners, n)."""
    nodes = solver.nodes
    raised, psi = np.split(nodes.compliance.matrix @ nodes.compliance.loads(solver.law, forces), 2)
    counts = residual, iterations, nodes.unknowns
    return MeshSolution(solver, load, approach, forces, -raised, psi, *counts, gaps=gaps, closed=closed)


def of_newton(solver, state):
    """The MeshSolution of a NodalState of Newton's method."""
    raised, psi = state.surface
    surface, counts = (state.forces, -raised, psi), (state.kkt, state.iterations, state.unknowns)
    how = {"method": "newton", "found": state.fields, "gaps": solver.nodes.g0, "closed": state.closed}
    return MeshSolution(solver, state.load, state.approach, *surface, *counts, **how)
