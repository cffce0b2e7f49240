"""A load path on fitted states: any state on it, and the events at which zones are born, meet, part or vanish.

Topologies are looked at on a geometric scan of loads, from where the contact is small against a block. Between two of
them an event is approached from the side on which something is still left to measure: the width of a zone that is
born or vanishes, or of the gap between two that meet or part. Its square is linear in the load next to the event;
where the two corners' edges cross, the power is 2 s with the exponent s of coalescence. There it has a sign, gap or
overlap, so that states of both sides count and none needs to be so near that the edges cannot be told apart.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile

import numpy as np
from tqdm.auto import tqdm

from .display import Row, Shown, path_summary
from .errors import BadArgument, NotConverged, require_positive
from .halfplane import coalescence_exponent
from .observables import contact_zones, lowest, zone_changes
from .threads import bounded

FACTOR = 2.5          # between the loads of the scan
UNSEEN = 1e-3         # of the load: a zone that is born and merges within is not seen
START = 0.2           # of ell: the contact is that narrow where the scan begins
LEAST = 1e-9          # of the last load, if it never is
SAME = 1e-9           # of the width: a contact that does not grow with the load, as under a punch
EVENT_ORDER = 10      # of the panels meanwhile
APPROACH = 0.05       # of the way to an event that is left between one state and the next
SETTLED = 1e-6        # relative correction of an event's load that ends its search
STEPS = 16
MOST = 4              # changes between two states that may be one event
CAUTION = 0.1         # least share of a step that is tried where no state is found
HARDLY = 1e-3         # of the load: nearer to its birth a zone is too small to be told, and a bracket of loads is no narrower
TWINS = 1e-3          # of the width: changes whose places mirror each other as well as that happen at once
NARROW = 1e-5         # of the load: several events within are given as one bracket
MEETING = {("full", "born"), ("contact", "merged")}      # edges of the two corners cross, all at once
PARTING = {("full", "vanished"), ("contact", "split")}
TOLD = 5e-3           # of the load: nearer to such a crossing states of EVENT_ORDER do not tell the two edges well apart
LEFT = 5e-4           # of the way from there to the farther state beside it: least error of its load; a hundredth is seen
INTERPOLATED = 5      # states from which its load is interpolated
NAMES = ("A", "B", "full", "contact")
TOUCH_SAMPLES = 33    # over a zone, between which its lowest point is looked for


@dataclass(frozen=True)
class Event:
    """A zone that is "born", "vanished", or two that "merged" or one that "split", at x.

    `load` (force per thickness) with its error; `zone` is "A", "B", "full" or "contact". At load 0 x is where the initial gap
    is least; where it is equally small elsewhere, as under a flat punch, the middle of the first zone that is seen.
    All numbers are plain floats.
    """

    load: float
    load_error: float
    kind: str
    zone: str
    x: float

    def __post_init__(self):
        for name in ("load", "load_error", "x"):
            object.__setattr__(self, name, float(getattr(self, name)))


class PathView(Shown):
    """Base of load paths: `events`, and states `at` any load up to `last`."""


def require_on_path(load, last):
    """BadArgument unless a load lies on the path that ends with the load `last`."""
    require_positive(load=load)
    if load > last:
        raise BadArgument("load", load, f"must lie between 0 and the end of the path, {last:g}")


@dataclass(frozen=True, repr=False)
class LinePath(PathView):
    """States of a scene from first touch to the load `last`.

    What was computed is kept: after an interruption (KeyboardInterrupt) the same call goes on from there. With `progress`
    a bar counts the states.
    """

    scene: object
    last: float
    rtol: float
    progress: bool = False

    def summary(self):
        return path_summary(self, self.__dict__.get("events"), Row("accuracy asked for", "rtol", self.rtol),
                            Row("coarse states kept", "", len(self._kept)))

    @bounded
    def at(self, load):
        """The state at a load up to the last one, from the nearest that is known; errors as of `Contact.at`."""
        require_on_path(load, self.last)
        near = min(self._scan, key=lambda state: abs(np.log(state.load/load)))
        return self.scene.at(load, self.rtol, near=near)

    @cached_property
    def _kept(self):
        """{load: coarse state, or NotConverged where there is none}."""
        return {}

    @cached_property
    def _bar(self):
        return tqdm(desc="load path", unit=" states", disable=not self.progress)

    def _coarse(self, load, near=None):
        """The coarse state at a load, computed once; NotConverged is kept as well."""
        if load not in self._kept:
            try:
                self._kept[load] = self.scene.at(load, order=EVENT_ORDER, near=near)
            except NotConverged as failure:
                self._kept[load] = failure
            self._bar.update()
        found = self._kept[load]
        if isinstance(found, NotConverged):
            raise found
        return found

    @cached_property
    def _scan(self):
        """States at geometric loads, ascending, coarse."""
        states = [self._coarse(self.last)]
        while not self._is_small(states[0]) and states[0].load > LEAST*self.last:
            state = self._coarse(states[0].load/FACTOR, states[0])
            if len(states) > 1 and abs(_width(state) - _width(states[0])) <= SAME*_width(state):
                break
            states.insert(0, state)
        return states

    def _is_small(self, state):
        zones = _named(state)
        narrow = all(right - left < START*state.line.solid.ell for left, right in zones["contact"])
        return narrow and not zones["full"]

    @cached_property
    @bounded
    def events(self):
        """All events, ascending."""
        found = self._births(self._scan[0])
        for low, high in zip(self._scan, self._scan[1:]):
            found += self._between(low, high)
        return sorted(found, key=lambda event: (event.load, NAMES.index(event.zone)))

    def _births(self, first):
        """Those up to the first load of the scan: at first touch for the corners that are nearest, else no later than that."""
        found, lows = [], _lowest_of_zones(first)
        nearest = min(gap for own in lows.values() for gap, _ in own.values())
        touching = {corner: {interval: x for interval, (gap, x) in own.items() if gap <= nearest + SAME*_width(first)}
                    for corner, own in lows.items()}
        own_corners = {"A": [0], "B": [1], "full": [], "contact": list(lows)}
        for name, intervals in _named(first).items():
            for left, right in intervals:
                early = [x for corner in own_corners[name] if corner in lows
                         for (a, b), x in touching[corner].items() if left <= a and b <= right]
                late = 0.0 if early else first.load/2
                known = len(early) == 1 and early[0] is not None
                found.append(Event(late, late, "born", name, early[0] if known else (left + right)/2))
        return found

    def _between(self, low, high):
        """Events between two states, ascending in load."""
        changes = _changes(low, high)
        if not changes:
            return self._hidden(low, high)
        crossing = self._crossing(low, high, changes)
        if crossing:
            return [Event(*crossing[:2], change.kind, change.zone, crossing[2]) for change in changes]
        if high.load - low.load <= NARROW*high.load:
            half, told = (high.load - low.load)/2, HARDLY*high.load
            errors = [max(half, told) if change.kind in ("born", "vanished") else half for change in changes]
            return [Event(low.load + half, error, change.kind, change.zone, change.x) for change, error in zip(changes, errors)]
        several = len(changes) > MOST or any(abs(change.high - change.low) != 1 and not _mirrored(change, changes, _width(high))
                                             for change in changes)
        if several:
            between = self._state((low.load + high.load)/2, low)
            if between is not None:
                return self._between(low, between) + self._between(between, high)
        visited = self._approached(low, high, changes[0])
        low_side, high_side = _sides(visited, changes[0])
        found = [self._located(visited, low_side, high_side, change) for change in _changes(low_side, high_side)]
        return self._between(low, low_side) + _crossing_once(found) + self._between(high_side, high)

    def _hidden(self, low, high):
        """Events between two states with zones alike: of zones that are born and merge in between.

        Where a gap has a minimum of its own before, and is closed afterwards, a zone may have been born there; halving the step
        shows it, or an edge that comes so near that the minimum is gone.
        """
        closed = high.all_zones
        arisen = [x for corner, x, _ in low.least if any(left < x < right for left, right in closed[corner])]
        if not arisen or high.load - low.load <= UNSEEN*high.load:
            return []
        between = self._state(float(np.sqrt(low.load*high.load)), low)
        return [] if between is None else self._between(low, between) + self._between(between, high)

    def _crossing(self, low, high, changes):
        """(load, error, x) where edges of the two corners cross between two states; None unless that is all that happens."""
        kinds = {(change.zone, change.kind) for change in changes}
        if len(changes) != 2 or kinds not in (MEETING, PARTING):
            return None
        if self.scene.may_meet_on_axis and kinds == MEETING:
            load, error = self.scene.coalescence()
            return (load, error, 0.0) if low.load < load < high.load else None
        gaps, later = _gaps(low), _gaps(high)
        turned = [pair for pair in gaps if gaps.keys() == later.keys() and gaps[pair][0]*later[pair][0] < 0]
        if len(turned) != 1:
            return None
        states, power = [low, high], 2*coalescence_exponent(low.line.solid)
        for _ in range(STEPS):
            size = [np.copysign(abs(gap)**power, gap) for gap, _ in (_gaps(state)[turned[0]] for state in states)]
            load, error = _root([state.load for state in states], size)
            below = max((state for state in states if size[0]*_gaps(state)[turned[0]][0] > 0), key=lambda state: state.load)
            above = min((state for state in states if size[0]*_gaps(state)[turned[0]][0] < 0), key=lambda state: state.load)
            if not below.load < load < above.load:
                load = (below.load + above.load)/2
                error = (above.load - below.load)/2
            farther = max(below, above, key=lambda state: abs(state.load - load))
            way = farther.load - load
            error = max(error, LEFT*abs(way))
            if abs(way) <= 2*TOLD*load:
                break
            state = self._state(load + np.copysign(max(APPROACH*abs(way), TOLD*load), way), farther)
            if state is None or _gaps(state).keys() != gaps.keys():
                break
            states = sorted([*states, state], key=lambda each: each.load)
        return load, error, _gaps(below)[turned[0]][1]

    def _approached(self, low, high, change):
        """States ascending in load towards an event, from the side on which something is left to measure."""
        visited, cautious = [low, high], 1.0
        for _ in range(STEPS):
            low, high = _sides(visited, change)
            near = low if change.measured_low else high
            event = self._located(visited, low, high, change)
            if event.load_error <= SETTLED*event.load:
                break
            target = event.load + APPROACH*(near.load - event.load)
            if not low.load < target < high.load:
                target = (low.load + high.load)/2
            state = self._state(near.load + cautious*(target - near.load), near)
            if state is None:
                cautious /= 2
                if cautious < CAUTION:
                    break
            else:
                visited = sorted([*visited, state], key=lambda each: each.load)
        return visited

    def _located(self, visited, low, high, change):
        """An event between two states, extrapolated from up to three on the side where it can be measured."""
        half = (high.load - low.load)/2
        if change.measured_low:
            side, number = [state for state in reversed(visited) if state.load <= low.load], change.low
        else:
            side, number = [state for state in visited if state.load >= high.load], change.high
        alike = list(takewhile(lambda state: len(_named(state)[change.zone]) == number, side[:3]))
        side = alike[::-1]      # towards the event
        sizes = [(state.load, self._size(state, change)) for state in side]
        guesses = [_zero(pair) for pair in zip(sizes, sizes[1:])]
        load, error = low.load + half, half
        if guesses and guesses[-1] is not None and low.load <= guesses[-1] <= high.load:
            load = guesses[-1]
            if len(guesses) > 1 and guesses[0] is not None:
                # a correction, but no less than what the way left to go makes likely
                error = min(half, max(abs(load - guesses[0]), APPROACH**2*abs(load - side[-1].load)))
        return Event(load, error, change.kind, change.zone, change.x)

    def _size(self, state, change):
        """What is left of a zone that is born or vanishes, or of the gap next to x, to the power that is linear."""
        intervals = _named(state)[change.zone]
        own = [interval for corner in state.all_zones.values() for interval in corner]
        if change.kind in ("merged", "split"):
            intervals = [(a[1], b[0]) for a, b in zip(intervals, intervals[1:])]
            own = [(a[1], b[0]) for corner in state.all_zones.values() for a, b in zip(corner, corner[1:])]
        left, right = min(intervals, key=lambda each: abs(each[0] + each[1] - 2*change.x))
        return (right - left)**(2 if (left, right) in own else 2*coalescence_exponent(state.line.solid))

    def _state(self, load, near):
        """A state from a neighbour on; None where none can be found."""
        try:
            return self._coarse(load, near)
        except NotConverged:
            return None


@dataclass(frozen=True)
class Change:
    """What differs between two neighbouring states; `low`, `high`: the numbers of such zones."""

    zone: str
    kind: str
    x: float
    low: int
    high: int

    @property
    def measured_low(self):
        """Whether there is something to measure before the event, not after it."""
        return self.kind in ("merged", "vanished")


def _changes(low, high):
    before, after = _named(low), _named(high)
    return [Change(name, kind, x, len(before[name]), len(after[name]))
            for name in NAMES for kind, x in zone_changes(before[name], after[name])]


def _mirrored(change, changes, width):
    """Whether a change is one of two that are each other's mirror image, and so happen at once."""
    twins = [other for other in changes if (other.zone, other.kind) == (change.zone, change.kind)]
    return len(twins) == 2 and abs(change.high - change.low) == 2 and abs(twins[0].x + twins[1].x) < TWINS*width


def _sides(visited, change):
    """The neighbouring states between which a change happens, seen from where it is measured."""
    numbers, last = [len(_named(state)[change.zone]) for state in visited], len(visited) - 2
    if change.measured_low:
        last = next((i for i, number in enumerate(numbers[1:]) if number != change.low), last)
    else:
        last = max((i for i, number in enumerate(numbers[:-1]) if number != change.high), default=last)
    return visited[last], visited[last + 1]


def _gaps(state):
    """{(number of a zone of A, of one of B): (what is between them, below 0 where they overlap, and the middle of it)}."""
    found = {}
    for i, a in enumerate(state.all_zones[0]):
        for j, b in enumerate(state.all_zones[1]):
            left, right = max((b[1], a[0]), (a[1], b[0]), key=lambda edges: edges[1] - edges[0])
            found[i, j] = right - left, (left + right)/2
    return found


def _root(loads, sizes):
    """Load at which sizes vanish, interpolated as a polynomial of the size, and what the last of the states changes."""
    def interpolated(numbers):
        shares = [np.prod([sizes[j]/(sizes[j] - sizes[i]) for j in numbers if j != i]) for i in numbers]
        return sum(share*loads[i] for share, i in zip(shares, numbers))

    nearest = np.argsort(np.abs(sizes))[:INTERPOLATED]
    load = interpolated(nearest)
    return load, abs(load - interpolated(nearest[:-1]))


def _zero(pair):
    """Load at which the line through two (load, size) crosses zero; None if it does not."""
    (P, a), (Q, b) = pair
    return None if a == b else Q - b*(Q - P)/(b - a)


def _crossing_once(found):
    """Where A's and B's edges cross, two zones meet and full contact is born: one load, seen from either side."""
    meeting = [event for event in found if (event.zone, event.kind) in (("contact", "merged"), ("full", "born"),
                                                                       ("contact", "split"), ("full", "vanished"))]
    if len(meeting) != 2 or {event.zone for event in meeting} != {"contact", "full"}:
        return found
    best = min(meeting, key=lambda event: event.load_error)
    error = max(best.load_error, abs(meeting[0].load - meeting[1].load))
    return [replace(event, load=best.load, load_error=error) if event in meeting else event for event in found]


def _named(state):
    return contact_zones(state.all_zones, state.line.law.corners)


def _lowest_of_zones(state):
    """{corner number: {interval: (least initial gap of the corner there, its x or None)}} of all zones."""
    line, found = state.line, {}
    for corner, intervals in state.all_zones.items():
        found[corner] = {}
        for left, right in intervals:
            kinks = [place for place, jumps in line.kinks.items() if corner in jumps and left <= place <= right]
            x = np.unique((*np.linspace(left, right, TOUCH_SAMPLES), *kinks))
            found[corner][left, right] = lowest(lambda x, corner=corner: line.initial_gap(np.full(len(x), corner), x), x)
    return found


def _width(state):
    return state.x[-1] - state.x[0]
