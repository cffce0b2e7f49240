"""Contact of any body with a compliance at nodes: states, and the load path node by node."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np

from ..errors import require
from ..model.deformable import second_solid, shape_of
from ..model.events import Event, LoadPath, following
from ..model.intervals import borders, contact_zones, interrupted, runs, zone_changes
from ..model.problem import Problem
from ..model.progress import counted, kept
from ..model.refinement import FEWEST
from ..model.solution import PlaneSolution, Solution
from ..model.solver import Solver
from . import active_set


@dataclass(frozen=True, eq=False, repr=False)
class OfNodes(Solution):
    """Base of solutions from forces at nodes.

    Attributes
    ----------
    solver : Solver
    load, approach : float, force per thickness (force in space) and approach of the obstacle
    forces : array (corners, n), along -n
    displacement, psi : arrays (n,), in space psi (2, n): -u.n and microrotation
    residual : float, the largest relative one
    iterations, unknowns : int
    gaps : array (corners, n), initial ones, inf where a corner cannot touch
    nodes : Compliance or ContactNodes
    mirrored : whether they are the half x1 > 0 of a symmetric problem
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
    mirrored: bool = False

    @property
    def nodes(self):
        return self.solver.nodes

    @cached_property
    def points(self):
        return self._whole(self.nodes.points.T, [[-1], [1]]).T

    @cached_property
    def normals(self):
        return self._whole(self.nodes.normals.T, [[-1], [1]]).T

    @cached_property
    def weights(self):
        """Lengths (areas) of the surface: the load is ``weights @ (p*n2)``."""
        on_axis = self.mirrored & (self.nodes.points[:, 0] == 0)
        return self._whole(np.where(on_axis, 2, 1) * self.nodes.weights)

    def _whole(self, values, sign=1, corners=False):
        """Values on the whole line from those of the computed part, (..., n), the mirrored ones times `sign`;
        `corners` change places.
        """
        if not self.mirrored:
            return values
        return np.concatenate((sign * (values[::-1] if corners else values)[..., :0:-1], values), axis=-1)

    @property
    def carried(self):
        """Force of each corner, (corners, n); of corners that move together the mean."""
        return np.where(self.nodes.twins, self.forces.mean(axis=0), self.forces)

    @cached_property
    def pressures(self):
        """Pressure of each corner, (corners, n)."""
        return self._whole(self.carried / self.nodes.weights, corners=True)

    @cached_property
    def energy(self):
        """Elastic energy (per thickness), half the work of the corners."""
        depth = self.approach * self.nodes.normals[:, -1] - np.where(self.forces > 0, self.gaps, 0)
        return (1 + self.mirrored) * float(np.sum(np.where(self.forces > 0, self.forces * depth, 0)) / 2)


@dataclass(frozen=True, eq=False, repr=False)
class NodalSolution(OfNodes, PlaneSolution):
    """A solution at nodes in the plane, ascending in x1.

    Attributes
    ----------
    closed : boolean array (corners, n)
    """

    _: KW_ONLY
    gaps: np.ndarray
    closed: np.ndarray

    @property
    def law(self):
        return self.solver.law

    @cached_property
    def problem(self):
        solver, obstacle = self.solver, self.solver.obstacle
        counter = second_solid(obstacle)
        return Problem(solver.solid, self.law, shape_of(obstacle), counter=counter, blocks=solver.blocks)

    @property
    def x(self):
        return self.points[:, 0]

    def interpolated(self, values, x):
        """Nodal values at x, array (n,): a polygon."""
        return np.interp(x, self.x, values)

    def reaches(self, x):
        """Whether x lies on the contact boundary, boolean array (n,)."""
        return (x >= self.x[0]) & (x <= self.x[-1]) & ~interrupted(self.x, self.apart, x)

    def pressure(self, corner, x):
        """Pressure of a corner (number) at x1 = x, array (n,)."""
        return np.where(self.reaches(x), self.interpolated(self.pressures[corner], x), 0.0)

    def moment_at(self, x):
        """M at x1 = x, array (n,)."""
        return np.where(self.reaches(x), self.interpolated(self.micromoment, x), 0.0)

    @classmethod
    def of_forces(cls, solver, nodes, load, approach, forces, gaps, closed, *counts, **more):
        """The solution of corner forces, array (corners, n); `counts` are the residual and iterations."""
        compliance = getattr(nodes, "compliance", nodes)
        raised, psi = np.split(compliance.matrix @ compliance.loads(solver.blocks, forces), 2)
        counts = *counts, getattr(nodes, "unknowns", forces.size)
        return cls(solver, load, approach, forces, -raised, psi, *counts, gaps=gaps, closed=closed, **more)

    @property
    def apart(self):
        return self.nodes.apart

    @cached_property
    def micromoment(self):
        """M of (29), or the reaction to a prescribed psi."""
        if self.law.clamps_rotation:
            rows = self.solver.body.compliance(False).matrix[len(self.x) :]
            turned, across = np.split(rows, 2, axis=1)
            return np.linalg.lstsq(across, turned @ self.forces.sum(axis=0), rcond=None)[0] / self.weights
        return self.solver.solid.ell / 2 * np.sum(self.solver.blocks.levers(self.x) * self.pressures, axis=0)

    @cached_property
    def zones_by_name(self):
        """{"A", "B", "full", "contact": [(left, right), ...]} of x1."""
        return zones_of(self.x, self.closed, self.law, self.apart)

    def remarks(self):
        """Sentences where the contact reaches the last node and the obstacle goes on."""
        return [
            f"the contact reaches the last node, x1 = {self.x[end]:.3g}: if the body goes on there, "
            "give its compliance at nodes beyond it"
            for end, inner in ((0, 1), (-1, -2))
            if len(self.x) > 1 and self.goes_on(end, 2 * self.points[end] - self.points[inner])
        ]

    def goes_on(self, end, there):
        """Whether a corner of an end (0 or -1) is closed and the obstacle lies over a place beyond it."""
        beyond = self.solver.blocks.under(self.problem.obstacle, there[None], self.normals[[end]])
        return self.closed[:, end].any() and np.isfinite(beyond.initial_gaps).any()


class NodalSolver(Solver):
    """States of a body with a method ``compliance(clamped)`` that returns a Compliance."""

    solution = NodalSolution
    verifies = True
    most_corners = None

    @property
    def crossing(self) -> float:
        """Power of the nodes' distance with which loads converge at which edges of two corners cross."""
        return 0.5  # of most solids it is 0.5 to 0.8

    @cached_property
    def compliance(self):
        found = self.body.compliance(self.law.clamps_rotation)
        found.require_symmetric()
        return found

    @property
    def nodes(self):
        """Points, normals, weights and twins of the nodes."""
        return self.compliance

    def solve(self, load, approach, rtol, initial=None):
        require(
            rtol is None,
            "rtol",
            rtol,
            "needs a method that chooses its nodes: the compliance is given at some",
        )
        return self.at(load, approach, initial)

    def at(self, load, approach=None, initial=None):
        flexibility, gaps, share = self.system
        count = len(self.law.corners)
        start = None
        if isinstance(initial, NodalSolution) and len(initial.closed) == count:  # at the nearest nodes
            x, start = self.compliance.points[:, 0], initial.closed
            if len(x) != len(initial.x):
                start = start[:, np.searchsorted(borders(initial.x)[1:-1], x)]
            start = start.ravel()
        found = active_set.solve(flexibility, gaps, load=load, approach=approach, c=share, start=start)
        forces, closed = found.forces.reshape(count, -1), self.together(found.closed)
        load = found.load if load is None else load  # as it was asked for: the sum of the forces is rounded
        return self.solution.of_forces(
            self,
            self.nodes,
            load,
            found.approach,
            forces,
            gaps.reshape(count, -1),
            closed,
            found.kkt,
            found.iterations,
        )

    def path(self, last, rtol):
        return NodalPath(self.contact, last, None)

    @cached_property
    def system(self):
        """(flexibility, initial gaps, shares in the load) of the law's corners."""
        found = self.compliance.corner_system(self.blocks, self.obstacle)
        require(
            np.isfinite(found[1]).any(),
            "obstacle",
            self.obstacle,
            "faces no node of the contact boundary: it has to be above it, and the boundary's outward "
            "normal has to point up, along x2",
        )
        require(
            np.isfinite(found[0]).all(), "law", self.law, "must have finite levers at every node of the body"
        )
        return found

    def together(self, closed):
        """Closed corners, array (corners, nodes), all where psi is constrained."""
        closed = closed.reshape(len(self.law.corners), -1)
        return closed | (self.nodes.twins & closed.any(axis=0))


class NodalPath(LoadPath):
    """The load path at the nodes of a compliance, or of the Contact `followed`."""

    def __init__(self, problem, last, rtol, followed=None):
        super().__init__(problem, last, rtol)
        self._solver = (followed or problem).solver

    @cached_property
    @following
    def events(self):
        """Zones that are born, merge, split or vanish, ascending in load.

        Nodes see an event off by a share h/a of its load (h the distance of nodes, a the half-width then), or
        1.7 (h/a)^s, with the solver's `crossing` s, where edges of two corners cross; `load_error` reaches
        from the nodal change before to the last load whose event may be seen here. First touch is exact. x is
        good to h.
        """
        law, before, found = self.problem.law, {}, []
        kept(found)
        loads, zones, unseen, _ = self._followed
        # of the load at which edges of the two corners cross 0.6 to 1.6 times that were seen
        crossing = np.minimum(1, 1.7 * unseen**self._solver.crossing) if len(law.corners) > 1 else unseen
        for number, (load, after) in enumerate(zip(loads, zones)):
            for zone, intervals in after.items():
                share = crossing if zone in ("full", "contact") else unseen
                below = load - loads[max(number - 1, 0)] + share[number] * load
                seen_here = np.divide(load, 1 - share, out=np.full(len(share), np.inf), where=share < 1)
                above = np.minimum(seen_here, loads[1:])[seen_here >= loads[:-1]].max() - load
                error = 0.0 if load == 0 and zone != "full" else max(below, above)
                happened = zone_changes(before.get(zone, ()), intervals)
                found += [Event(load, error, kind, zone, x) for kind, x in happened]
            before = after
        return found

    @cached_property
    def _followed(self):
        """Loads at which nodes close or open, and the last one; zones after each; the largest distance of
        nodes over the half-width of the contact, array, and over that of its narrowest zone at the end.
        """
        solver, loads, zones = self._solver, [], []
        flexibility, gaps, share = solver.system
        x, apart = solver.compliance.points[:, 0], solver.compliance.apart
        closed = np.zeros(len(gaps), bool)
        followed = active_set.path(flexibility, gaps, self.last, c=share)
        for load, changes in groupby(followed, key=lambda event: event.load):
            counted(load=load)
            for change in changes:
                closed[change.corner] ^= True
            loads.append(load)
            zones.append(zones_of(x, solver.together(closed), self.problem.law, apart))
        unseen = np.array([_unseen(x, apart, own["contact"]) for own in zones])
        narrowest = max(_unseen(x, apart, [interval]) for interval in zones[-1]["contact"])
        return np.array([*loads, self.last]), zones, unseen, narrowest

    @cached_property
    def warnings(self):
        blurred = [
            event.load + event.load_error for event in self.events if event.load_error > 0.1 * event.load
        ]
        few = self._followed[3] >= 2 / FEWEST  # of the half-width; a state warns as well
        last = max(blurred + [self.last] * few, default=0.0)
        words = (
            f"up to load {min(last, self.last):.2g} the contact has few nodes: events there may be missing; "
        )
        return [words + "take smaller elements"] * bool(last)


def _unseen(x, apart, contact):
    """Largest distance of nodes over the half-width of contact, at most 1."""
    if not contact:
        return 0.0
    left, right = contact[0][0], contact[-1][1]
    beside = (x[1:] >= left) & (x[:-1] <= right) & (True if apart is None else ~apart)
    return min(
        1.0, float(np.diff(x)[beside].max(initial=0.0)) / max((right - left) / 2, np.finfo(float).tiny)
    )


def zones_of(x, closed, law, apart=None, end=None):
    """{name: intervals} of closed nodes, half the way to their neighbours, at the last node up to `end`."""
    pieces = np.split(np.arange(len(x)), [] if apart is None else np.flatnonzero(apart) + 1)
    own = [[] for _ in closed]
    for piece in pieces:
        here = x[piece]
        edges = borders(here, last=end)
        for found, flags in zip(own, closed[:, piece]):
            flags[1:-1] |= flags[:-2] & flags[2:]  # one node may close after its neighbours
            found += [(float(edges[first]), float(edges[after + 1])) for first, after in runs(flags)]
    return contact_zones(dict(enumerate(own)), law.corners)
