"""The load path of a body in space: events on its contact nodes, and how far from the true ones they are.

Edges of zones move from node to node. Where a spot is born, the lowest place of the obstacle between the
nodes touches first: its gap is extrapolated to 0. Where spots merge, a state whose edges are off by a node
has the event at another load: that is where zones wider by a node do.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..contact_solvers.nodal import crossing_error
from ..contact_solvers.zone_scan import ZoneChange, ZoneScan
from ..model.events import Event, LoadPath, following
from ..model.progress import kept
from ..model.refinement import FEWEST
from ..model.types import Array, Flags, Integers
from . import recovery

NEARBY = 0.97  # of a load, from which the gap of what is born is extrapolated
# the load rises with this power of the distance from edges to the place of an event
POWER = 2


class Path3D(LoadPath):
    """The load path on the contact nodes of a `Solver3D`.

    The zones are "contact" and "full", and x is x1 of the place. `load_error` has the bracket of the load,
    what a node more or less at the edges of zones changes, and the relative error of the energy of the state,
    as much as elements are too stiff.
    """

    def __init__(self, problem: Any, last: float, rtol: float | None, solver: Any) -> None:
        super().__init__(problem, last, rtol)
        self._solver = solver

    @property
    def first(self) -> float:
        """Load from which zones are followed; see `LoadPath`."""
        return self._followed[0]

    @property
    def events(self) -> list[Event]:
        """Zones that are born, merge, split or vanish, ascending in load."""
        return self._followed[1]

    @cached_property
    @following
    def _followed(self) -> tuple[float, list[Event]]:
        """(first load, events)."""
        scan = NodeScan(self._solver)
        first, seen = scan.down_from(self.last)
        events = [event for event in seen if event.load < first]
        kept(events)
        events += [scan.judged(event) for event in seen if event.load >= first]
        return first, sorted(events, key=lambda event: event.load)

    @cached_property
    def warnings(self) -> list[str]:
        doubtful = [
            event.load + event.load_error for event in self.events if event.load_error > 0.2 * event.load
        ]
        words = (
            f"up to load {min(max(doubtful, default=0.0), self.last):.2g} zones have few nodes: events there "
            "may be missing; take smaller elements"
        )
        return [words] * bool(doubtful and max(doubtful))


class NodeScan(ZoneScan):
    """The scan of loads on the contact nodes of a Solver3D."""

    def __init__(self, solver: Any) -> None:
        super().__init__()
        self.solver = solver
        self.nodes = solver.nodes
        self.near = FEWEST * float(np.sqrt(self.nodes.weights.max()))

    def solved(self, load: float, start: Any) -> Any:
        return self.solver.solution_at(load, None, start)

    def labels(self, flags: Flags) -> Integers:
        return np.asarray(self.nodes.connected(flags))

    def initial_gaps(self) -> tuple[tuple[str, ...], Array]:
        return self.solver.law.corners, self.solver.initial_gaps

    def coordinates(self, places: Integers) -> Array:
        return np.asarray(self.nodes.points[places[:, 0]])

    def middle(self, places: Integers) -> float:
        return float(self.nodes.points[places[:, 0], 0].mean())

    def is_small(self, contact: Integers) -> bool:
        return bool(np.count_nonzero(contact) <= FEWEST)

    def judged(self, event: Event) -> Event:
        """Returns an event with its error, and nearer to where it is."""
        low = max(load for load in self.zones if load <= event.load - event.load_error * (1 - 1e-9))
        high = min(load for load in self.zones if load >= event.load + event.load_error * (1 - 1e-9))
        before, after = (self.zones[load][event.zone] for load in (low, high))
        changes = [change for change in self.changes(before, after) if change.kind == event.kind]
        if not changes:  # spots came and went, and merged meanwhile
            return replace(event, load_error=event.load)
        change = min(changes, key=lambda change: abs(self.place(change) - event.x))
        # what changes is open on one side, and closed on the other
        opened, closed = (low, high) if event.kind in ("born", "merged") else (high, low)
        error = event.load_error + event.load * self.stiffness_error(self.states[opened])
        if len(change.spots) == 2:
            return replace(event, load_error=error + self.wider(event, change, opened))
        if event.zone == "contact":
            load = self.lowest_touches(change, opened, opened * (NEARBY if opened < closed else 1 / NEARBY))
            return replace(event, load=load, load_error=error + abs(load - event.load) / 2)
        growth = self.growth(event, change, closed)
        return replace(event, load=event.load - growth / 2, load_error=error + abs(growth) / 2)

    def stiffness_error(self, state: Any) -> float:
        """Returns the relative error of the load at an approach: that of the energy, and the work of
        pressures that are off from node to node, or from block to block, whose response is that much smaller.
        """
        of_energy, of_surface = recovery.estimate(state).parts
        return float(of_energy + of_surface**2 * self.unseen(state, self.block) / 2)

    @property
    def block(self) -> float:
        """Side of a block with several corners (length), or 0."""
        return self.solver.solid.ell if len(self.solver.initial_gaps) > 1 else 0.0

    def unseen(self, state: Any, least: float = 0.0) -> float:
        """Returns the distance of nodes, or a length at least, over the half-width of the contact, or 1."""
        areas = self.nodes.weights[state.closed > 0]
        return float(min(1.0, max(np.sqrt(areas.mean()), least) / np.sqrt(areas.sum() / np.pi)))

    def wider(self, event: Event, change: ZoneChange, opened: float) -> float:
        """Returns by how much the load of a merger or split may be off, from where spots that are wider by a
        node have it, and as in the plane where edges of two corners may cross.
        """
        pressure = self.states[opened].pressures.sum(axis=0)
        seeds = [int(np.argmax(np.where(change.labels == number, pressure, -1.0))) for number in change.spots]

        def together(load: float) -> bool:
            flags = self.zones_at(load)[event.zone] > 0
            first, second = self.labels(self.nodes.beside(flags))[seeds]
            return bool(flags[seeds].all() and first == second)

        change_by_node = abs(event.load - self.end_of(together, event.load, opened))
        if self.block:
            crossing = crossing_error(self.unseen(self.states[opened]), self.solver.crossing)
            return max(change_by_node, event.load * float(crossing))
        rims = [self.nodes.beside(change.labels != number) for number in change.spots]
        resolved = not any(np.all(rim[change.labels == number]) for rim, number in zip(rims, change.spots))
        # edges are a node from the place at most, and two of zones that are wider
        return change_by_node / (2**POWER - 1) if resolved else change_by_node

    def growth(self, event: Event, change: ZoneChange, closed: float) -> float:
        """Returns by how much the load changes until a spot is wider by a node, or the whole load where it
        never is. Nodes see a spot late, by up to as much.
        """
        spot = change.labels == change.spots[0]
        rim = self.nodes.beside(spot) & ~spot

        def small(load: float) -> bool:
            closed_on_rim = np.count_nonzero(self.zones_at(load)[event.zone][rim])
            return bool(2 * closed_on_rim < np.count_nonzero(rim))

        end = self.end_of(small, event.load, closed)
        return float(np.sign(end - event.load) * event.load) if small(end) else end - event.load

    def end_of(self, holds: Callable[[float], bool], event: float, beside: float) -> float:
        """Returns the load, away from an event on the side of one beside it, from which on something does not
        hold any more; or the last one on this side that is known.
        """
        way = np.sign(beside - event)
        loads = sorted(
            (load for load in self.zones if way * (load - beside) >= 0), key=lambda load: way * load
        )
        inside = beside
        for load in loads:
            outside = load
            if not holds(load):
                break
            inside = load
        while abs(outside - inside) > max(abs(inside - event) / 10, 0.002 * event):
            middle = (inside + outside) / 2
            if holds(middle):
                inside = middle
            else:
                outside = middle
        return outside

    def lowest_touches(self, change: ZoneChange, load: float, further: float) -> float:
        """Returns the load at which the lowest place of the obstacle over a spot touches, from two at which
        no node of it does; the one itself where the gap does not get wider to the other.
        """
        spot = change.labels == change.spots[0]
        self.zones_at(further)
        depth, depth_further = (self.depth(self.states[x], spot) for x in (load, further))
        if depth <= depth_further:
            return load
        return load - depth * (load - further) / (depth - depth_further)

    def depth(self, state: Any, spot: Flags) -> float:
        """Returns how deep the obstacle reaches into the surface over a spot, below 0 if it does not."""
        fields = state.displacement, state.psi, state.approach, state.counter_along
        depth = -self.solver.at_nodes.gaps(*fields)[:, spot].min()
        places = self.solver.low_places[:2].T
        for corners, depths in zip(self.solver.at_nodes.corners, state.overlaps):
            # beside the boundary depths are 0
            over = spot[cKDTree(corners[:, :2]).query(places)[1]] & (depths != 0)
            depth = max(depth, depths[over].max(initial=-np.inf))
        return float(depth)
