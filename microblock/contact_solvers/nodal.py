"""Contact of any body with a compliance at nodes: states, and the load path node by node."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from scipy import linalg

from ..errors import require
from ..model.deformable import second_solid, shape_of
from ..model.events import Event, LoadPath, following
from ..model.intervals import borders, contact_zones, in_interruption, runs, zone_changes
from ..model.law import Law
from ..model.problem import Problem
from ..model.progress import counted, kept
from ..model.refinement import FEWEST
from ..model.solution import PlaneSolution, Solution
from ..model.solver import Solver
from ..model.types import Array, Flags, Interval, Zones
from . import active_set
from .compliance import Compliance


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
    forces: Array
    displacement: Array
    psi: Array
    residual: float
    iterations: int
    unknowns: int
    mirrored: bool = False

    @property
    def nodes(self) -> Any:
        return self.solver.nodes

    @cached_property
    def points(self) -> Array:
        return self._on_both_sides(self.nodes.points.T, [[-1], [1]]).T

    @cached_property
    def normals(self) -> Array:
        return self._on_both_sides(self.nodes.normals.T, [[-1], [1]]).T

    @cached_property
    def weights(self) -> Array:
        """Lengths (areas) of the surface: the load is ``weights @ (p*n2)``."""
        on_axis = self.mirrored & (self.nodes.points[:, 0] == 0)
        return self._on_both_sides(np.where(on_axis, 2, 1) * self.nodes.weights)

    def _on_both_sides(self, values: Any, sign: Any = 1, corners: bool = False) -> Any:
        """Values on the whole line from those of the computed part, (..., n), the mirrored ones times `sign`;
        `corners` change places.
        """
        if not self.mirrored:
            return values
        return np.concatenate((sign * (values[::-1] if corners else values)[..., :0:-1], values), axis=-1)

    @property
    def carried(self) -> Array:
        """Force of each corner, (corners, n); of corners that move together the mean."""
        return np.where(self.nodes.twins, self.forces.mean(axis=0), self.forces)

    @cached_property
    def pressures(self) -> Array:
        """Pressure of each corner, (corners, n)."""
        return self._on_both_sides(self.carried / self.nodes.weights, corners=True)

    @cached_property
    def energy(self) -> float:
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
    gaps: Array
    closed: Flags

    @property
    def stiffness(self) -> float:
        """dP/dd (force per thickness and length)."""
        flexibility, weights = self.corner_flexibility()
        closed = self.forces.ravel() > 0
        forces = linalg.solve(flexibility[np.ix_(closed, closed)], weights[closed], assume_a="sym")
        return (1 + self.mirrored) * float(weights[closed] @ forces)

    def corner_flexibility(self) -> tuple[Array, Array]:
        """Returns the flexibility of corners, array (corners n, corners n), and their weights in the load."""
        flexibility, _, weights = self.solver.system
        return flexibility, weights

    @property
    def law(self) -> Any:
        return self.solver.law

    @cached_property
    def problem(self) -> Problem:
        solver = self.solver
        obstacle = solver.obstacle
        counter = second_solid(obstacle)
        return Problem(solver.solid, self.law, shape_of(obstacle), counter=counter, blocks=solver.blocks)

    @property
    def x(self) -> Array:
        return self.points[:, 0]

    def interpolated(self, values: Array, x: Array) -> Array:
        """Nodal values at x, array (n,): a polygon."""
        return np.asarray(np.interp(x, self.x, values))

    def covers(self, x: Array) -> Flags:
        """Whether x lies on the contact boundary, boolean array (n,)."""
        return (x >= self.x[0]) & (x <= self.x[-1]) & ~in_interruption(self.x, self.interrupted, x)

    def pressure(self, corner: int, x: Array) -> Array:
        """Pressure of a corner (number) at x1 = x, array (n,)."""
        return np.where(self.covers(x), self.interpolated(self.pressures[corner], x), 0.0)

    def moment_at(self, x: Array) -> Array:
        """M at x1 = x, array (n,)."""
        return np.where(self.covers(x), self.interpolated(self.micromoment, x), 0.0)

    @classmethod
    def of_forces(
        cls,
        solver: Any,
        nodes: Any,
        load: float,
        approach: float,
        forces: Array,
        gaps: Array,
        closed: Flags,
        *counts: Any,
        **fields: Any,
    ) -> Any:
        """The solution of corner forces, array (corners, n); `counts` are the residual and iterations."""
        compliance = getattr(nodes, "compliance", nodes)
        outward, psi = np.split(compliance.matrix @ compliance.loads(solver.blocks, forces), 2)
        counts = *counts, getattr(nodes, "unknowns", forces.size)
        return cls(solver, load, approach, forces, -outward, psi, *counts, gaps=gaps, closed=closed, **fields)

    @property
    def interrupted(self) -> Flags | None:  # type: ignore[override]
        return self.nodes.interrupted

    @cached_property
    def micromoment(self) -> Array:
        """M of (29), or the reaction to a prescribed psi."""
        if self.law.clamps_rotation:
            rows = self.solver.body.compliance(False).matrix[len(self.x) :]
            of_forces, of_moments = np.split(rows, 2, axis=1)
            rotation = of_forces @ self.forces.sum(axis=0)
            return np.asarray(np.linalg.lstsq(of_moments, rotation, rcond=None)[0] / self.weights)
        levers = self.solver.blocks.levers(self.x)
        return np.asarray(self.solver.solid.ell / 2 * np.sum(levers * self.pressures, axis=0))

    @cached_property
    def zones_by_name(self) -> Zones:
        """{"A", "B", "full", "contact": [(left, right), ...]} of x1."""
        return zones_of(self.x, self.closed, self.law, self.interrupted)

    def remarks(self) -> list[str]:
        """Sentences where the contact reaches the last node and the obstacle goes on."""
        return [
            f"the contact reaches the last node, x1 = {self.x[end]:.3g}: if the body goes on there, "
            "give its compliance at nodes beyond it"
            for end, inner in ((0, 1), (-1, -2))
            if len(self.x) > 1 and self.goes_on(end, 2 * self.points[end] - self.points[inner])
        ]

    def goes_on(self, end: int, place: Array) -> bool:
        """Whether a corner of an end (0 or -1) is closed and the obstacle lies over a place beyond it."""
        beyond = self.solver.blocks.under(self.problem.obstacle, place[None], self.normals[[end]])
        return bool(self.closed[:, end].any() and np.isfinite(beyond.initial_gaps).any())


class NodalSolver(Solver):
    """States of a body with a method ``compliance(clamped)`` that returns a Compliance."""

    solution: Any = NodalSolution
    body: Any
    verifies = True
    most_corners = None

    @property
    def crossing(self) -> float:
        """Power of the nodes' distance with which loads converge at which edges of two corners cross."""
        return 0.5  # of most solids it is 0.5 to 0.8

    @cached_property
    def compliance(self) -> Compliance:
        compliance = self.body.compliance(self.law.clamps_rotation)
        compliance.require_symmetric()
        return compliance

    @property
    def nodes(self) -> Any:
        """Points, normals, weights and twins of the nodes."""
        return self.compliance

    def solve(
        self, load: float | None, approach: float | None, rtol: float | None, initial: Any = None
    ) -> Any:
        require(
            rtol is None,
            "rtol",
            rtol,
            "needs a method that chooses its nodes: the compliance is given at some",
        )
        return self.solution_at(load, approach, initial)

    def solution_at(self, load: float | None, approach: float | None = None, initial: Any = None) -> Any:
        flexibility, gaps, weights = self.system
        count = len(self.law.corners)
        start = None
        if isinstance(initial, NodalSolution) and len(initial.closed) == count:  # at the nearest nodes
            x = self.compliance.points[:, 0]
            start = initial.closed
            if len(x) != len(initial.x):
                start = start[:, np.searchsorted(borders(initial.x)[1:-1], x)]
            start = start.ravel()
        contact = active_set.solve(flexibility, gaps, load=load, approach=approach, c=weights, start=start)
        if load is None:  # a load is as it was asked for: the sum of the forces is rounded
            load = contact.load
        return self.solution.of_forces(
            self,
            self.nodes,
            load,
            contact.approach,
            contact.forces.reshape(count, -1),
            gaps.reshape(count, -1),
            self.together(contact.closed),
            contact.kkt,
            contact.iterations,
        )

    def path(self, last: float, rtol: float | None) -> LoadPath:
        return NodalPath(self.contact, last, None)

    @cached_property
    def system(self) -> tuple[Array, Array, Array]:
        """(flexibility, initial gaps, weights in the load) of the law's corners."""
        flexibility, gaps, weights = self.compliance.corner_system(self.blocks, self.obstacle)
        require(
            np.isfinite(gaps).any(),
            "obstacle",
            self.obstacle,
            "faces no node of the contact boundary: it has to be above it, and the boundary's outward "
            "normal has to point up, along x2",
        )
        require(
            np.isfinite(flexibility).all(),
            "law",
            self.law,
            "must have finite levers at every node of the body",
        )
        return flexibility, gaps, weights

    def together(self, closed: Flags) -> Flags:
        """Closed corners, array (corners, nodes), all where psi is constrained."""
        closed = closed.reshape(len(self.law.corners), -1)
        return np.asarray(closed | (self.nodes.twins & closed.any(axis=0)))


class NodalPath(LoadPath):
    """The load path at the nodes of a compliance, or of the Contact `followed`."""

    def __init__(self, problem: Any, last: float, rtol: float | None, followed: Any = None) -> None:
        super().__init__(problem, last, rtol)
        self._solver = (followed or problem).solver

    @cached_property
    @following
    def events(self) -> list[Event]:
        """Zones that are born, merge, split or vanish, ascending in load.

        Nodes see an event off by a fraction h/a of its load (h the distance of nodes, a the half-width then),
        or 1.7 (h/a)^s, with the solver's `crossing` s, where edges of two corners cross; `load_error` extends
        from the nodal change before to the last load whose event may be seen here. First touch is exact. x is
        good to h.
        """
        events: list[Event] = []
        before: Zones = {}
        kept(events)
        loads, zones, unseen, _ = self._followed
        corners = self.problem.law.corners
        crossing = crossing_error(unseen, self._solver.crossing) if len(corners) > 1 else unseen
        for number, (load, after) in enumerate(zip(loads, zones)):
            for zone, intervals in after.items():
                relative_error = crossing if zone in ("full", "contact") else unseen
                below = load - loads[max(number - 1, 0)] + relative_error[number] * load
                seen_here = np.divide(
                    load,
                    1 - relative_error,
                    out=np.full(len(relative_error), np.inf),
                    where=relative_error < 1,
                )
                above = np.minimum(seen_here, loads[1:])[seen_here >= loads[:-1]].max() - load
                error = 0.0 if load == 0 and zone != "full" else max(below, above)
                changes = zone_changes(before.get(zone, ()), intervals)
                events += [Event(load, error, kind, zone, x) for kind, x in changes]
            before = after
        return events

    @cached_property
    def _followed(self) -> tuple[Array, list[Zones], Array, float]:
        """Loads at which nodes close or open, and the last one; zones after each; the largest distance of
        nodes over the half-width of the contact, array, and over that of its narrowest zone at the end.
        """
        solver = self._solver
        loads: list[float] = []
        zones: list[Zones] = []
        flexibility, gaps, weights = solver.system
        x = solver.compliance.points[:, 0]
        interrupted = solver.compliance.interrupted
        closed = np.zeros(len(gaps), bool)
        corner_events = active_set.path(flexibility, gaps, self.last, c=weights)
        for load, changes in groupby(corner_events, key=lambda event: event.load):
            counted(load=load)
            for change in changes:
                closed[change.corner] ^= True
            loads.append(load)
            zones.append(zones_of(x, solver.together(closed), self.problem.law, interrupted))
        unseen = np.array([_spacing_over_half_width(x, interrupted, at_load["contact"]) for at_load in zones])
        narrowest = max(
            _spacing_over_half_width(x, interrupted, [interval]) for interval in zones[-1]["contact"]
        )
        return np.array([*loads, self.last]), zones, unseen, narrowest

    @cached_property
    def warnings(self) -> list[str]:
        blurred = [
            event.load + event.load_error for event in self.events if event.load_error > 0.1 * event.load
        ]
        few = self._followed[3] >= 2 / FEWEST  # of the half-width; a state warns as well
        last = max(blurred + [self.last] * few, default=0.0)
        words = (
            f"up to load {min(last, self.last):.2g} the contact has few nodes: events there may be missing; "
        )
        return [words + "take smaller elements"] * bool(last)


def crossing_error(unseen: Any, crossing: float) -> Any:
    """Returns the relative error of loads at which edges of two corners cross, from the distance of nodes
    over the half-width of the contact, array (n,): 0.6 to 1.6 times that power of it were seen.
    """
    return np.minimum(1, 1.7 * unseen**crossing)


def _spacing_over_half_width(x: Array, interrupted: Flags | None, contact: list[Interval]) -> float:
    """Largest distance of nodes over the half-width of contact, at most 1."""
    if not contact:
        return 0.0
    left = contact[0][0]
    right = contact[-1][1]
    beside = (x[1:] >= left) & (x[:-1] <= right)
    if interrupted is not None:
        beside &= ~interrupted
    distance = float(np.diff(x)[beside].max(initial=0.0))
    return min(1.0, distance / max((right - left) / 2, np.finfo(float).tiny))


def zones_of(
    x: Array, closed: Flags, law: Law, interrupted: Flags | None = None, end: float | None = None
) -> Zones:
    """{name: intervals} of closed nodes, half the way to their neighbours, at the last node up to `end`."""
    pieces = np.split(np.arange(len(x)), [] if interrupted is None else np.flatnonzero(interrupted) + 1)
    zones: list[list[Interval]] = [[] for _ in closed]
    for piece in pieces:
        edges = borders(x[piece], last=end)
        for intervals, flags in zip(zones, closed[:, piece]):
            flags[1:-1] |= flags[:-2] & flags[2:]  # one node may close after its neighbours
            intervals += [(float(edges[first]), float(edges[last + 1])) for first, last in runs(flags)]
    return contact_zones(dict(enumerate(zones)), law.corners)
