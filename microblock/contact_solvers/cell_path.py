"""A load path on equal cells of a line or a surface: states at loads, and their zones as connected cells.

Zones are compared on a geometric scan of loads, and where they differ on halves of its steps. What is born
and gone, or split and merged, between two loads of the scan is not seen.
"""

from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np

from ..model.events import Event, SeenTwice, following
from ..model.periodic import EQUAL
from ..model.progress import counted
from ..model.refinement import FEWEST, GeometricSeries
from .cell_solver import spots

STEP = 1.5  # from load to load of the scan
BRACKET = 2e-4  # of a load, between which an event lies
PASSINGS = [{("merged", "contact"), ("born", "full")}, {("split", "contact"), ("vanished", "full")}]
UNDOES = {"born": "vanished", "vanished": "born", "merged": "split", "split": "merged"}


class CellPath(SeenTwice):
    """The load path on cells of a `CellSolver`: events of two grids in one window.

    `load_error` adds the bracket to what an error that falls by the root of two from grid to grid leaves of
    the change. In three dimensions x is x1 of the place, and the zones are "contact" and "full".
    """

    def __init__(self, solver, last, rtol):
        super().__init__(solver.contact, last, rtol)
        self._solver = solver

    @cached_property
    def first(self):
        """Load from which zones are followed; see `LoadPath`."""
        return max(first for first, _ in self._followed)

    @property
    def _seen(self):
        return [self.numbered(events) for _, events in self._followed]

    @cached_property
    @following
    def _followed(self):
        """[(first load, events), ...] on a coarse and a fine grid."""
        solver, window = self._solver, self._solver.window_of(self.last)
        fine = solver.options.nodes or solver.followed
        return [_Followed(solver, window, count).down_from(self.last) for count in (fine // 2, fine)]

    def judged(self, coarse, fine):
        missing = GeometricSeries(2**0.5).error([abs(fine.load - coarse.load)])
        return replace(fine, load_error=fine.load_error + coarse.load_error + missing)


class _Followed:
    """Zones at loads on one grid: {name: labels of connected cells} of each load."""

    def __init__(self, solver, window, count):
        self.solver = solver
        self.grid = window.of(count)
        self.states, self.zones, self.periodic = {}, {}, solver.period is not None

    def down_from(self, last):
        """(first load, events up to the last)."""
        found, high, wide = [], last, np.inf
        self.at(last)
        while high > EQUAL * last and wide > FEWEST:
            low = high / STEP
            counted(load=low)
            found += self.between(low, high)
            high, wide = low, np.count_nonzero(self.zones[low]["contact"]) ** (1 / self.solver.dimensions)
        steady = self.steady(sorted(found, key=lambda event: (event.load, event.x)))
        steady = self.passings(steady) if self.solver.dimensions == 1 else steady
        return high, sorted([*self.births(high), *steady], key=lambda event: (event.load, event.x))

    def passings(self, events):
        """Events with one load where edges of the two corners pass each other: contacts merge with a cell
        between them, and full contact begins with another.
        """
        found, near = list(events), FEWEST * self.grid.width
        for (i, one), (j, other) in combinations(enumerate(events), 2):
            both = {(one.kind, one.zone), (other.kind, other.zone)}
            if both in PASSINGS and abs(one.x - other.x) <= near and other.load < STEP * one.load:
                error = one.load_error + other.load_error + (other.load - one.load) / 2
                middle = {"load": (one.load + other.load) / 2, "load_error": error}
                found[i], found[j] = replace(one, **middle), replace(other, **middle)
        return found

    def steady(self, events):
        """Events without those that undo each other: edges move by whole cells, and where zones just touch,
        or just part, spots of a few cells come and go.
        """
        chains, near = [], FEWEST * self.grid.width
        for event in events:
            for chain in chains:
                kind, zone, load, x = chain[-1].kind, chain[-1].zone, chain[-1].load, chain[-1].x
                undone = event.zone == zone and event.kind == UNDOES[kind]
                if undone and abs(event.x - x) <= near and event.load <= 1.1 * load:
                    chain.append(event)
                    break
            else:
                chains.append([event])
        found = []
        for first, *_, last in ((*chain, chain[-1]) for chain in chains if len(chain) % 2):
            low, high = first.load - first.load_error, last.load + last.load_error
            found.append(replace(last, load=(low + high) / 2, load_error=(high - low) / 2))
        return found

    def at(self, load):
        """The zones at a load."""
        if load not in self.zones:
            near = min(self.states, key=lambda other: abs(np.log(other / load)), default=None)
            residual = self.solver.loose / self.grid.count / 100
            state = self.solver.solved(self.grid, load, None, residual, self.states.get(near))
            self.states[load] = state
            self.zones[load] = {name: spots(own, self.periodic) for name, own in state.touching.items()}
        return self.zones[load]

    def between(self, low, high):
        """Events between two loads."""
        before, after = self.at(low), self.at(high)
        changes = [(name, *change) for name in after for change in self.changes(before[name], after[name])]
        half = (high - low) / 2
        if not changes:
            return []
        if half > BRACKET * high:
            middle = float(np.sqrt(low * high))
            return [*self.between(low, middle), *self.between(middle, high)]
        return [Event(low + half, half, kind, name, x) for name, kind, x in changes]

    def births(self, first):
        """Births up to a load: at first touch of the lowest cells, else between 0 and it."""
        gaps, zones, found = self.solver.prepared(self.grid)[1], self.zones[first], []
        lowest = gaps.min(axis=0)
        least = lowest.min() + EQUAL * np.ptp(lowest[zones["contact"] > 0])
        own = dict(zip(self.solver.law.corners, gaps)) | {"contact": lowest}
        for name, labels in zones.items():
            for number in np.unique(labels[labels > 0]):
                spot = labels == number
                late = 0.0 if name in own and own[name][spot].min() <= least else first / 2
                found.append(Event(late, late, "born", name, self.middle(np.argwhere(spot))))
        return found

    def changes(self, before, after):
        """What happens to spots, [(kind, x), ...]."""
        both = (before > 0) & (after > 0)
        pairs, found = set(zip(before[both].tolist(), after[both].tolist())), []
        for kind, labels, side in (("vanished", before, 0), ("born", after, 1)):
            gone = set(np.unique(labels[labels > 0]).tolist()) - {pair[side] for pair in pairs}
            found += [(kind, self.middle(np.argwhere(labels == number))) for number in sorted(gone)]
        for kind, labels, side in (("split", after, 0), ("merged", before, 1)):
            for whole in sorted({pair[side] for pair in pairs}):
                parts = sorted(pair[1 - side] for pair in pairs if pair[side] == whole)
                found += [(kind, self.neck(labels, *two)) for two in zip(parts, parts[1:])]
        return found

    def neck(self, labels, one, other):
        """x1 between the nearest cells of two spots."""
        from scipy.spatial import cKDTree  # here: most states do without

        here, there = (np.argwhere(labels == number) for number in (one, other))
        apart, number = cKDTree(there, boxsize=self.grid.count if self.periodic else None).query(here)
        i = int(np.argmin(apart))
        return self.middle(np.array((here[i], there[number[i]])))

    def middle(self, cells):
        """x1 of the middle of cells, array (k, d), on a period by the shorter way."""
        apart, n = cells - cells[0], self.grid.count
        apart = apart - n * np.rint(apart / n) if self.periodic else apart
        return float(self.grid.axes[0][0] + self.grid.width * (cells[0] + apart.mean(axis=0))[0])
