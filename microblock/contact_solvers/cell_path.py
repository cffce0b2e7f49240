"""A load path on equal cells of a line or a surface: states at loads, and their zones as connected cells.

Zones are compared on a geometric scan of loads, and where they differ on halves of its steps. What is born
and gone, or split and merged, between two loads of the scan is not seen.
"""

from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ..model.events import Event, SeenTwice, following
from ..model.periodic import EQUAL
from ..model.progress import counted
from ..model.refinement import FEWEST, GeometricSeries
from ..model.types import Array, Flags, Integers
from .fft_compliance import spots

STEP = 1.5  # from load to load of the scan
BRACKET = 2e-4  # of a load, between which an event lies
PASSINGS = [{("merged", "contact"), ("born", "full")}, {("split", "contact"), ("vanished", "full")}]
UNDOES = {"born": "vanished", "vanished": "born", "merged": "split", "split": "merged"}

Spots = dict[str, Integers]  # labels of connected cells, array (n, ...), by the zone's name


class CellPath(SeenTwice):
    """The load path on cells of a `CellSolver`: events of two grids in one window.

    `load_error` adds the bracket to what an error that falls by the root of two from grid to grid leaves of
    the change. In three dimensions x is x1 of the place, and the zones are "contact" and "full".
    """

    def __init__(self, solver: Any, last: float, rtol: float | None) -> None:
        super().__init__(solver.contact, last, rtol)
        self._solver = solver

    @cached_property
    def first(self) -> float:
        """Load from which zones are followed; see `LoadPath`."""
        return max(first for first, _ in self._followed)

    @cached_property
    def _seen(self) -> list[dict[Any, Event]]:  # type: ignore[override]
        return [self.numbered(events) for _, events in self._followed]

    @cached_property
    @following
    def _followed(self) -> list[tuple[float, list[Event]]]:
        """[(first load, events), ...] on a coarse and a fine grid."""
        solver = self._solver
        window = solver.window_of(self.last)
        fine = solver.options.nodes or solver.followed
        grids = [window.with_count(count) for count in (fine // 2, fine)]
        return [GridPath(solver, grid).down_from(self.last) for grid in grids]

    def judged(self, coarse: Event, fine: Event) -> Event:
        missing = GeometricSeries(2**0.5).error([abs(fine.load - coarse.load)])
        return replace(fine, load_error=fine.load_error + coarse.load_error + missing)


class GridPath:
    """Zones at loads on one grid.

    Attributes
    ----------
    states : {load: CellSolution}
    zones : {load: {name: labels of connected cells}}
    """

    def __init__(self, solver: Any, grid: Any) -> None:
        self.solver = solver
        self.grid = grid
        self.periodic = solver.period is not None
        self.states: dict[float, Any] = {}
        self.zones: dict[float, Spots] = {}

    def down_from(self, last: float) -> tuple[float, list[Event]]:
        """Returns (first load, events up to the last)."""
        events: list[Event] = []
        high = last
        cells_across = np.inf
        self.zones_at(last)
        while high > EQUAL * last and cells_across > FEWEST:
            low = high / STEP
            counted(load=low)
            events += self.between(low, high)
            high = low
            cells_across = np.count_nonzero(self.zones[low]["contact"]) ** (1 / self.solver.dimensions)
        steady = self.steady(sorted(events, key=lambda event: (event.load, event.x)))
        if self.solver.dimensions == 1:
            steady = self.passings(steady)
        return high, sorted([*self.births(high), *steady], key=lambda event: (event.load, event.x))

    def passings(self, events: list[Event]) -> list[Event]:
        """Returns events with one load where edges of the two corners pass each other: contacts merge with a
        cell between them, and full contact begins with another.
        """
        together = list(events)
        near = FEWEST * self.grid.width
        for (i, first), (j, second) in combinations(enumerate(events), 2):
            kinds = {(first.kind, first.zone), (second.kind, second.zone)}
            if kinds in PASSINGS and abs(first.x - second.x) <= near and second.load < STEP * first.load:
                load = (first.load + second.load) / 2
                error = first.load_error + second.load_error + (second.load - first.load) / 2
                together[i] = replace(first, load=load, load_error=error)
                together[j] = replace(second, load=load, load_error=error)
        return together

    def steady(self, events: list[Event]) -> list[Event]:
        """Returns events without those that undo each other: edges move by whole cells, and where zones just
        touch, or just part, spots of a few cells come and go.
        """
        near = FEWEST * self.grid.width
        chains: list[list[Event]] = []
        for event in events:
            for chain in chains:
                before = chain[-1]
                undone = event.zone == before.zone and event.kind == UNDOES[before.kind]
                if undone and abs(event.x - before.x) <= near and event.load <= 1.1 * before.load:
                    chain.append(event)
                    break
            else:
                chains.append([event])
        lasting = []
        for chain in chains:
            if len(chain) % 2:
                low = chain[0].load - chain[0].load_error
                high = chain[-1].load + chain[-1].load_error
                lasting.append(replace(chain[-1], load=(low + high) / 2, load_error=(high - low) / 2))
        return lasting

    def zones_at(self, load: float) -> Spots:
        """Returns the zones at a load."""
        if load not in self.zones:
            near = min(self.states, key=lambda known: abs(np.log(known / load)), default=None)
            residual = self.solver.loose / self.grid.count / 100
            start = None if near is None else self.states[near]
            state = self.solver.solved(self.grid, load, None, residual, start)
            self.states[load] = state
            self.zones[load] = {name: spots(flags, self.periodic) for name, flags in state.touching.items()}
        return self.zones[load]

    def between(self, low: float, high: float) -> list[Event]:
        """Returns the events between two loads."""
        before = self.zones_at(low)
        after = self.zones_at(high)
        changes = [(name, *change) for name in after for change in self.changes(before[name], after[name])]
        half = (high - low) / 2
        if not changes:
            return []
        if half > BRACKET * high:
            middle = float(np.sqrt(low * high))
            return [*self.between(low, middle), *self.between(middle, high)]
        return [Event(low + half, half, kind, name, x) for name, kind, x in changes]

    def births(self, first: float) -> list[Event]:
        """Returns births up to a load: at first touch of the lowest cells, else between 0 and it."""
        gaps = self.solver.prepared(self.grid)[1]
        zones = self.zones[first]
        lowest = gaps.min(axis=0)
        least = lowest.min() + EQUAL * np.ptp(lowest[zones["contact"] > 0])
        initial = dict(zip(self.solver.law.corners, gaps)) | {"contact": lowest}
        events = []
        for name, labels in zones.items():
            for number in np.unique(labels[labels > 0]):
                spot = labels == number
                at_first_touch = name in initial and initial[name][spot].min() <= least
                late = 0.0 if at_first_touch else first / 2
                events.append(Event(late, late, "born", name, self.middle(np.argwhere(spot))))
        return events

    def changes(self, before: Integers, after: Integers) -> list[tuple[str, float]]:
        """Returns what happens to spots, [(kind, x), ...]."""
        stays: Flags = (before > 0) & (after > 0)
        pairs = set(zip(before[stays].tolist(), after[stays].tolist()))
        changes = []
        for kind, labels, side in (("vanished", before, 0), ("born", after, 1)):
            alone = set(np.unique(labels[labels > 0]).tolist()) - {pair[side] for pair in pairs}
            changes += [(kind, self.middle(np.argwhere(labels == number))) for number in sorted(alone)]
        for kind, labels, side in (("split", after, 0), ("merged", before, 1)):
            for joint in sorted({pair[side] for pair in pairs}):
                pieces = sorted(pair[1 - side] for pair in pairs if pair[side] == joint)
                changes += [(kind, self.neck(labels, *two)) for two in zip(pieces, pieces[1:])]
        return changes

    def neck(self, labels: Integers, first: int, second: int) -> float:
        """Returns x1 between the nearest cells of two spots."""
        from scipy.spatial import cKDTree  # here: most states do without

        cells = np.argwhere(labels == first)
        targets = np.argwhere(labels == second)
        distances, numbers = cKDTree(targets, boxsize=self.grid.count if self.periodic else None).query(cells)
        nearest = int(np.argmin(distances))
        return self.middle(np.array((cells[nearest], targets[numbers[nearest]])))

    def middle(self, cells: Array | Integers) -> float:
        """Returns x1 of the middle of cells, array (k, d), on a period by the shorter way."""
        offsets = cells - cells[0]
        if self.periodic:
            offsets = offsets - self.grid.count * np.rint(offsets / self.grid.count)
        return float(self.grid.axes[0][0] + self.grid.width * (cells[0] + offsets.mean(axis=0))[0])
