"""A scan of loads for the events of a path: states at loads, and their zones as connected places.

Zones are compared on a geometric scan of loads, and where they differ on halves of its steps. What is born
and gone, or split and merged, between two loads of the scan is not seen. Places are the cells of a grid
(`cell_path`) or the nodes of a mesh.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..model.events import Event
from ..model.periodic import EQUAL
from ..model.progress import counted
from ..model.types import Array, Flags, Integers

STEP = 1.5  # from load to load of the scan
BRACKET = 2e-4  # of a load, between which an event lies
UNDOES = {"born": "vanished", "vanished": "born", "merged": "split", "split": "merged"}

Spots = dict[str, Integers]  # labels of connected places, array (n, ...), by the zone's name


class ZoneChange(NamedTuple):
    """What happens to spots between two loads.

    Attributes
    ----------
    kind : str, of an `Event`
    labels : array (n, ...), at the load where the spots are
    spots : their labels, two of a merger or a split
    """

    kind: str
    labels: Integers
    spots: tuple[int, ...]


class ZoneScan:
    """Zones at loads on one discretisation. A subclass defines `solved`, `labels`, `initial_gaps`,
    `coordinates`, `middle` and `is_small`.

    Attributes
    ----------
    states : {load: solution with `touching`}
    zones : {load: {name: labels of connected places}}
    near : float, length over which edges that move from place to place may do and undo an event
    box : int or None, period of `coordinates`
    """

    near: float
    box: int | None = None

    def __init__(self) -> None:
        self.states: dict[float, Any] = {}
        self.zones: dict[float, Spots] = {}

    def solved(self, load: float, start: Any) -> Any:
        """Returns the solution at a load, from that at another load or None."""
        raise NotImplementedError

    def labels(self, flags: Flags) -> Integers:
        """Returns labels of connected places, from 1, in the shape of the flags."""
        raise NotImplementedError

    def initial_gaps(self) -> tuple[tuple[str, ...], Array]:
        """Returns the names of corners, and their initial gaps, array (corners, n, ...)."""
        raise NotImplementedError

    def coordinates(self, places: Integers) -> Array | Integers:
        """Returns coordinates, array (k, d), of places by their numbers, array (k, d or 1)."""
        raise NotImplementedError

    def middle(self, places: Integers) -> float:
        """Returns x1 of the middle of places, array (k, d or 1)."""
        raise NotImplementedError

    def is_small(self, contact: Integers) -> bool:
        """Returns whether a contact has too few places to follow it further down."""
        raise NotImplementedError

    def down_from(self, last: float) -> tuple[float, list[Event]]:
        """Returns (first load, events up to the last)."""
        events: list[Event] = []
        high = last
        self.zones_at(last)
        small = False
        while high > EQUAL * last and not small:
            low = high / STEP
            counted(load=low)
            events += self.between(low, high)
            high = low
            small = self.is_small(self.zones[low]["contact"])
        steady = self.steady(sorted(events, key=lambda event: (event.load, event.x)))
        return high, sorted([*self.births(high), *steady], key=lambda event: (event.load, event.x))

    def steady(self, events: list[Event]) -> list[Event]:
        """Returns events without those that undo each other: edges move by whole places, and where zones just
        touch, or just part, spots of a few places come and go.
        """
        chains: list[list[Event]] = []
        for event in events:
            for chain in chains:
                before = chain[-1]
                undone = event.zone == before.zone and event.kind == UNDOES[before.kind]
                if undone and abs(event.x - before.x) <= self.near and event.load <= 1.1 * before.load:
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
            state = self.solved(load, None if near is None else self.states[near])
            self.states[load] = state
            self.zones[load] = {name: self.labels(flags) for name, flags in state.touching.items()}
        return self.zones[load]

    def between(self, low: float, high: float) -> list[Event]:
        """Returns the events between two loads."""
        before = self.zones_at(low)
        after = self.zones_at(high)
        changes = [
            (name, change.kind, self.place(change))
            for name in after
            for change in self.changes(before[name], after[name])
        ]
        half = (high - low) / 2
        if not changes:
            return []
        if half > BRACKET * high:
            middle = float(np.sqrt(low * high))
            return [*self.between(low, middle), *self.between(middle, high)]
        return [Event(low + half, half, kind, name, x) for name, kind, x in changes]

    def births(self, first: float) -> list[Event]:
        """Returns births up to a load: at first touch of the lowest places, else between 0 and it."""
        corners, gaps = self.initial_gaps()
        zones = self.zones[first]
        lowest = gaps.min(axis=0)
        least = lowest.min() + EQUAL * np.ptp(lowest[zones["contact"] > 0])
        initial = dict(zip(corners, gaps)) | {"contact": lowest}
        events = []
        for name, labels in zones.items():
            for number in np.unique(labels[labels > 0]):
                spot = labels == number
                at_first_touch = name in initial and initial[name][spot].min() <= least
                late = 0.0 if at_first_touch else first / 2
                events.append(Event(late, late, "born", name, self.middle(np.argwhere(spot))))
        return events

    def changes(self, before: Integers, after: Integers) -> Iterator[ZoneChange]:
        """Yields what happens to spots."""
        stays: Flags = (before > 0) & (after > 0)
        pairs = set(zip(before[stays].tolist(), after[stays].tolist()))
        for kind, labels, side in (("vanished", before, 0), ("born", after, 1)):
            alone = set(np.unique(labels[labels > 0]).tolist()) - {pair[side] for pair in pairs}
            for number in sorted(alone):
                yield ZoneChange(kind, labels, (number,))
        for kind, labels, side in (("split", after, 0), ("merged", before, 1)):
            for joint in sorted({pair[side] for pair in pairs}):
                pieces = sorted(pair[1 - side] for pair in pairs if pair[side] == joint)
                for two in zip(pieces, pieces[1:]):
                    yield ZoneChange(kind, labels, two)

    def place(self, change: ZoneChange) -> float:
        """Returns x1 of the middle of a spot, or between the nearest places of two."""
        places, *others = (np.argwhere(change.labels == number) for number in change.spots)
        if not others:
            return self.middle(places)
        from scipy.spatial import cKDTree  # here: most states do without

        targets = others[0]
        tree = cKDTree(self.coordinates(targets), boxsize=self.box)
        distances, numbers = tree.query(self.coordinates(places))
        nearest = int(np.argmin(distances))
        return self.middle(np.array((places[nearest], targets[numbers[nearest]])))
