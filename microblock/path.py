"""A load path on fitted states: any state on it, and the events at which zones are born, meet, part or vanish.

Topologies are looked at on a geometric scan of loads, from where the contact is small against a block. Between two of
them an event is approached from the side on which something is still left to measure: the width of a zone that is
born or vanishes, or of the gap between two that meet or part. Its square is linear in the load next to the event;
where the two corners' edges cross, the power is 2 s with the exponent s of coalescence.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .errors import NotConverged
from .halfplane import coalescence_exponent
from .observables import contact_zones, zone_changes

FACTOR = 2.5          # between the loads of the scan: a zone that comes and goes within is not seen
START = 0.2           # of ell: the contact is that narrow where the scan begins
LEAST = 1e-9          # of the last load, if it never is
SAME = 1e-9           # of the width: a contact that does not grow with the load, as under a punch
EVENT_ORDER = 10      # of the panels meanwhile
APPROACH = 0.05       # of the way to an event that is left between one state and the next
SETTLED = 1e-7        # relative correction of an event's load that ends its search
STEPS = 12
NAMES = ("A", "B", "full", "contact")
OPPOSITE = {"born": "vanished", "vanished": "born", "merged": "split", "split": "merged"}


@dataclass(frozen=True)
class Event:
    """A zone that is "born", "vanished", or two that "merged" or one that "split", at x.

    `load` (force per thickness) with its error; `zone` is "A", "B", "full" or "contact".
    """

    load: float
    load_error: float
    kind: str
    zone: str
    x: float


@dataclass(frozen=True)
class LinePath:
    """States of a scene from first touch to the load `last`."""

    scene: object
    last: float
    rtol: float

    def at(self, load):
        """The state at a load, from the nearest one that is known; errors as of `Contact.at`."""
        near = min(self._scan, key=lambda state: abs(np.log(state.load/load))) if load > 0 else None
        return self.scene.at(load, self.rtol, near=near)

    @cached_property
    def _scan(self):
        """States at geometric loads, ascending, coarse."""
        states = [self.scene.at(self.last, order=EVENT_ORDER)]
        while not self._is_small(states[0]) and states[0].load > LEAST*self.last:
            state = self.scene.at(states[0].load/FACTOR, order=EVENT_ORDER, near=states[0])
            if len(states) > 1 and abs(_width(state) - _width(states[0])) <= SAME*_width(state):
                break
            states.insert(0, state)
        return states

    def _is_small(self, state):
        zones = _named(state)
        narrow = all(right - left < START*state.line.solid.ell for left, right in zones["contact"])
        return narrow and not zones["full"]

    @cached_property
    def events(self):
        """All events, ascending."""
        found = self._births(self._scan[0])
        for low, high in zip(self._scan, self._scan[1:]):
            found += self._between(low, high)
        return sorted(found, key=lambda event: (event.load, NAMES.index(event.zone)))

    def _births(self, first):
        """Those up to the first load of the scan: at first touch for the corners that are nearest, else no later than that."""
        found, line = [], first.line
        heights = [line.initial_gap(np.full(len(first.x), corner), first.x) for corner in range(len(line.law.corners))]
        nearest = min(np.min(height) for height in heights)
        touching = {name for name, height in zip("AB", heights) if np.min(height) <= nearest + SAME*_width(first)}
        for name, intervals in _named(first).items():
            late = 0.0 if name == "contact" or name in touching else first.load/2
            found += [Event(late, late, "born", name, (left + right)/2) for left, right in intervals]
        return found

    def _between(self, low, high):
        """Events between two states, ascending in load."""
        before, after = _named(low), _named(high)
        changes = [(name, kind, x) for name in NAMES for kind, x in zone_changes(before[name], after[name])]
        if not changes:
            return []
        if self.scene.smooth_and_symmetric:      # all that can happen is that the two zones meet on the axis
            load, error = self.scene.coalescence()
            return [Event(load, error, kind, name, 0.0) for name, kind, _ in changes]
        if all(abs(len(before[name]) - len(after[name])) <= 1 for name in NAMES):
            return [self._located(low, high, *change) for change in changes]
        between = self._state((low.load + high.load)/2, low, high)
        if between is None:
            return [_bracketed(low, high, *change) for change in changes]
        return self._between(low, between) + self._between(between, high)

    def _located(self, low, high, name, kind, x):
        """One event, extrapolated from the side on which something is left to measure."""
        measured_low = kind in ("merged", "vanished")
        count = len(_named(low if measured_low else high)[name])
        sizes = []      # (load, size^power) towards the event
        guess, error = None, np.inf
        for _ in range(STEPS):
            near, far = (low, high) if measured_low else (high, low)
            if not sizes or sizes[-1][0] != near.load:
                sizes.append((near.load, self._size(near, name, kind if measured_low else OPPOSITE[kind], x)))
            if len(sizes) > 1:
                (P, a), (Q, b) = sizes[-2:]
                new = Q - b*(Q - P)/(b - a) if a != b else None
                if new is not None and low.load <= new <= high.load:
                    error = abs(new - guess) if guess is not None else np.inf
                    guess = new
                    if error <= SETTLED*new:
                        break
            middle = (low.load + high.load)/2
            target = middle if guess is None else guess + APPROACH*(near.load - guess)
            if not low.load < target < high.load or target == near.load:
                target = middle
            state = self._state(target, near, far)
            if state is None:
                break
            same = len(_named(state)[name]) == count
            low, high = (state, high) if same == measured_low else (low, state)
        event = _bracketed(low, high, name, kind, x)
        better = guess is not None and error < event.load_error
        return replace(event, load=float(guess), load_error=float(error)) if better else event

    def _size(self, state, name, kind, x):
        """What is left of a zone that vanishes, or of the gap between two that merge next to x, to the power that is linear."""
        zones, crossing = _named(state), 2*coalescence_exponent(state.line.solid)
        intervals = zones[name]
        own = {edge for corner in state.all_zones.values() for interval in corner for edge in (interval,)}
        if kind == "vanished":
            left, right = min(intervals, key=lambda each: abs(each[0] + each[1] - 2*x))
        else:
            gaps = [(a[1], b[0]) for a, b in zip(intervals, intervals[1:])]
            left, right = min(gaps, key=lambda each: abs(each[0] + each[1] - 2*x))
            own = {(a[1], b[0]) for corner in state.all_zones.values() for a, b in zip(corner, corner[1:])}
        return (right - left)**(2 if (left, right) in own else crossing)

    def _state(self, load, *neighbours):
        """A state with the zones of one of its neighbours, the first that fits; None if none does."""
        for near in neighbours:
            try:
                return self.scene.at(load, order=EVENT_ORDER, near=near, search=False)
            except NotConverged:
                pass
        return None


def _named(state):
    return contact_zones(state.all_zones, state.line.law.corners)


def _width(state):
    return state.x[-1] - state.x[0]


def _bracketed(low, high, name, kind, x):
    half = (high.load - low.load)/2
    return Event(float(low.load + half), float(half), kind, name, float(x))
