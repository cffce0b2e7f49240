"""A load path on fitted states: any state on it, and the events at which zones are born, meet, part or
vanish.

Topologies are compared on a geometric scan of loads, from where the contact is small against a block. Between
two of them an event is approached from the side on which something is still left to measure: the width of a
zone that is born or vanishes, or of the gap between two that meet or part. Its square is linear in the load
next to the event; where the two corners' edges cross, the power is 2 s with the exponent s of coalescence.
There it has a sign, gap or overlap, so that states of both sides count and none needs to be so near that the
edges cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from tqdm.auto import tqdm

from .errors import NotConverged
from .halfplane.carried import meeting_exponent
from .model.events import Event, LoadPath, require_on_path
from .model.problem import Problem
from .model.state import State
from .model.types import Array, ContactLike, Integers, Interval, Zones
from .model.zones import contact_zones, lowest, without, zone_changes
from .threads import bounded

if TYPE_CHECKING:
    from .halfplane.panel_solution import PanelSolution
    from .halfplane.panel_solver import PanelSolver

Gaps: TypeAlias = dict[tuple[int, int], tuple[float, float]]

FACTOR = 2.5  # between the loads of the scan
UNSEEN = 1e-3  # of the load: a zone that is born and merges within is not seen
START = 0.2  # of ell: the contact is that narrow where the scan begins
LEAST = 1e-9  # of the last load, if it never is
SAME = 1e-9  # of the width: gaps that differ by less are equally small
VALLEY = 1e-12  # of the width: of a gap at a valley of the obstacle that is not resolved
STILL = 1e-4  # of the width: between two loads of the scan no edge moves more, as under a flat punch
FOLLOWED = 1e-2  # of the last load: if no smaller state is found below it, the path begins there
SKIPPED = 2  # loads of the scan, at most, at which no state is found before it goes on
EVENT_ORDER = 10  # of the panels meanwhile
APPROACH = 0.05  # of the way to an event that is left between one state and the next
SETTLED = 1e-6  # relative correction of an event's load that ends its search
STEPS = 16
MOST = 4  # changes between two states that may be one event
CAUTION = 0.1  # least share of a step that is tried where no state is found
# of the load: nearer to its birth a zone is too small to be resolved, and a bracket no narrower
HARDLY = 1e-3
TWINS = 1e-3  # of the width: changes whose places mirror each other as well as that happen at once
NARROW = 1e-5  # of the load: several events within are given as one bracket
MEETING = {("full", "born"), ("contact", "merged")}  # edges of the two corners cross, all at once
PARTING = {("full", "vanished"), ("contact", "split")}
# of the load: nearer to such a crossing states of EVENT_ORDER do not resolve the two edges
DISTINCT = 5e-3
# of the way from there to the farther state beside it: least error of its load; seen: a hundredth
LEFT = 5e-4
UNDONE = {"born": "vanished", "vanished": "born", "merged": "split", "split": "merged"}
INTERPOLATED = 5  # states from which its load is interpolated
NAMES = ("A", "B", "full", "contact")
# of the load: steps are halved down to it where a gap is concave, so that a zone may be born and merge there
BENT = 0.02
CURVED = 1e-5  # of the range of a gap: smaller second differences are rounding
TOUCH_SAMPLES = 33  # over a zone, between which its lowest point is searched


class ZonePath(LoadPath):
    """The load path on fitted panels, whose solutions have the edges of the zones as unknowns.

    Parameters
    ----------
    problem : Contact
        A problem that `PanelSolver` solves.
    last : float
        Load at the end of the path (force per thickness).
    rtol : float, optional
        Relative error of the states as of `Contact.solve`, without it the usual one; events have their own
        `load_error`.
    progress : bool
        Whether a bar counts the solutions.
    """

    def __init__(self, problem: ContactLike, last: float, rtol: float | None, progress: bool = False) -> None:
        self._solver, self._progress = cast("PanelSolver", problem.solver), progress
        self._rtol: float = self._solver.usual_rtol if rtol is None else rtol
        super().__init__(problem, last, self._rtol)
        self._coarse_ones: dict[float, PanelSolution | NotConverged] = {}

    @bounded
    def at(self, load: float) -> State:
        """Returns the State at a load on the path; see `LoadPath.at`."""
        require_on_path(load, self.last)
        near = min(self._scan, key=lambda one: abs(np.log(one.load / load)))
        return State(self._solver.at(load, self._rtol, near=near))

    @cached_property
    def _bar(self) -> Any:  # of tqdm, which has no types
        return tqdm(desc="load path", unit=" states", disable=not self._progress)

    def _coarse(self, load: float, near: PanelSolution | None = None) -> PanelSolution:
        """Returns the coarse solution at a load, computed once; NotConverged is kept as well."""
        if load not in self._coarse_ones:
            try:
                self._coarse_ones[load] = self._solver.at(load, order=EVENT_ORDER, near=near)
            except NotConverged as failure:
                self._coarse_ones[load] = failure
            self._bar.update()
        found = self._coarse_ones[load]
        if isinstance(found, NotConverged):
            raise found
        return found

    @cached_property
    @bounded  # here: whatever is read first, `first` or `events`, begins with it
    def _scan(self) -> list[PanelSolution]:
        """States at geometric loads, ascending, coarse."""
        states = [self._coarse(self.last)]
        while not self._is_small(states[0]) and states[0].load > LEAST * self.last:
            state = self._smaller(states[0])
            if state is None:
                break
            still = _is_still(state, states[0])
            states.insert(0, state)
            if still:
                break
        return states

    def _smaller(self, state: PanelSolution) -> PanelSolution | None:
        """Returns the next state of the scan; None where the path may begin with the one before.

        Raises
        ------
        NotConverged
            If none is found, and the contact is not yet small.
        """
        for skipped in range(1 + SKIPPED):
            try:
                return self._coarse(state.load / FACTOR ** (1 + skipped), state)
            except NotConverged as failure:
                last = failure
        if state.load > FOLLOWED * self.last:
            raise last
        return None

    @property
    def first(self) -> float:
        """Load from which zones are followed; see `LoadPath`."""
        return self._scan[0].load

    def _is_small(self, state: PanelSolution) -> bool:
        zones = _zones(state)
        narrow = all(right - left < START * state.problem.solid.ell for left, right in zones["contact"])
        return narrow and not zones["full"] and all(event.load == 0 for event in self._births(state))

    @cached_property
    @bounded
    def events(self) -> list[Event]:
        """All events, ascending in load."""
        found = self._births(self._scan[0])
        for low, high in zip(self._scan, self._scan[1:]):
            found += self._between(low, high)
        found = sorted(found, key=lambda event: (event.load, NAMES.index(event.zone)))
        return _without_returns(found, TWINS * _width(self._scan[-1]))

    def _births(self, first: PanelSolution) -> list[Event]:
        """Returns events up to the first load of the scan: at first touch for the nearest corners, else
        before that.
        """
        found, lows = [], _lowest_of_zones(first)
        nearest = min(gap for own in lows.values() for gap, _ in own.values())
        most = nearest + SAME * _width(first)
        touching = {
            corner: {interval: x for interval, (gap, x) in own.items() if gap <= most}
            for corner, own in lows.items()
        }
        own_corners: dict[str, list[int]] = {"A": [0], "B": [1], "full": [], "contact": list(lows)}
        for name, intervals in _zones(first).items():
            for left, right in intervals:
                early = [
                    x
                    for corner in own_corners[name]
                    if corner in lows
                    for (a, b), x in touching[corner].items()
                    if left <= a and b <= right
                ]
                late = 0.0 if early else first.load / 2
                place = early[0] if len(early) == 1 else None
                found.append(Event(late, late, "born", name, (left + right) / 2 if place is None else place))
        return found

    def _between(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events between two states, ascending in load."""
        changes = _changes(low, high)
        if not changes:
            return self._hidden(low, high)
        crossing = self._crossing(low, high, changes)
        if crossing:
            load, error, x = crossing
            return [Event(load, error, change.kind, change.zone, x) for change in changes]
        if high.load - low.load <= NARROW * high.load:
            half, least = (high.load - low.load) / 2, HARDLY * high.load
            errors = [max(half, least) if change.kind in ("born", "vanished") else half for change in changes]
            return [
                Event(low.load + half, error, change.kind, change.zone, change.x)
                for change, error in zip(changes, errors)
            ]
        if len(changes) > MOST or any(
            abs(change.high - change.low) != 1 and not _mirrored(change, changes, _width(high))
            for change in changes
        ):
            between = self._state((low.load + high.load) / 2, low)
            if between is not None:
                return self._between(low, between) + self._between(between, high)
        visited = self._approached(low, high, changes[0])
        low_side, high_side = _sides(visited, changes[0])
        found = [
            self._located(visited, low_side, high_side, change) for change in _changes(low_side, high_side)
        ]
        return self._between(low, low_side) + _crossing_once(found) + self._between(high_side, high)

    def _hidden(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events between two states with zones alike: of zones that are born and merge in between.

        Where a gap has a minimum out of contact before, and is closed afterwards, a zone may have been born
        there; halving the step shows it, or an edge that comes so near that the minimum is gone. Where the
        gap is concave before, such a minimum may still arise: the step is halved down to BENT of the load.
        """
        closed, step = high.all_zones, (high.load - low.load) / high.load
        arisen = [x for corner, x, _ in low.least if any(left < x < right for left, right in closed[corner])]
        if not (arisen and step > UNSEEN) and not (step > BENT and _concave(low, high)):
            return []
        between = self._state(float(np.sqrt(low.load * high.load)), low)
        return [] if between is None else self._between(low, between) + self._between(between, high)

    def _crossing(
        self, low: PanelSolution, high: PanelSolution, changes: Sequence[Change]
    ) -> tuple[float, float, float] | None:
        """Returns (load, error, x) where edges of the two corners cross; None unless that is all that
        happens.
        """
        kinds = {(change.zone, change.kind) for change in changes}
        if len(changes) != 2 or kinds not in (MEETING, PARTING):
            return None
        if self._solver.may_meet_on_axis and kinds == MEETING:
            load, error = self._solver.coalescence()
            return (load, error, 0.0) if low.load < load < high.load else None
        gaps, later = _gaps(low), _gaps(high)
        crossed = [
            pair for pair in gaps if gaps.keys() == later.keys() and gaps[pair][0] * later[pair][0] < 0
        ]
        if len(crossed) != 1:
            return None
        pair, states, power = (
            crossed[0],
            [low, high],
            2 * meeting_exponent(low.problem, low.all_zones, gaps[crossed[0]][1]),
        )
        for _ in range(STEPS):
            size = [
                float(np.copysign(abs(gap) ** power, gap))
                for gap, _ in (_gaps(state)[pair] for state in states)
            ]
            load, error = _root([state.load for state in states], size)
            below = max((state for state in states if size[0] * _gaps(state)[pair][0] > 0), key=_load)
            above = min((state for state in states if size[0] * _gaps(state)[pair][0] < 0), key=_load)
            if not below.load < load < above.load:
                load = (below.load + above.load) / 2
                error = (above.load - below.load) / 2
            farther = max(below, above, key=lambda state: abs(state.load - load))
            way = farther.load - load
            error = max(error, LEFT * abs(way))
            if abs(way) <= 2 * DISTINCT * load:
                break
            step = float(np.copysign(max(APPROACH * abs(way), DISTINCT * load), way))
            state = self._state(load + step, farther)
            if state is None or _gaps(state).keys() != gaps.keys():
                break
            states = sorted([*states, state], key=_load)
        return load, error, _gaps(below)[pair][1]

    def _approached(self, low: PanelSolution, high: PanelSolution, change: Change) -> list[PanelSolution]:
        """Returns states ascending in load towards an event, from the side on which something is left to
        measure.
        """
        visited, cautious = [low, high], 1.0
        for _ in range(STEPS):
            low, high = _sides(visited, change)
            near = low if change.measured_low else high
            event = self._located(visited, low, high, change)
            if event.load_error <= SETTLED * event.load:
                break
            target = event.load + APPROACH * (near.load - event.load)
            if not low.load < target < high.load:
                target = (low.load + high.load) / 2
            state = self._state(near.load + cautious * (target - near.load), near)
            if state is None:
                cautious /= 2
                if cautious < CAUTION:
                    break
            else:
                visited = sorted([*visited, state], key=_load)
        return visited

    def _located(
        self, visited: Sequence[PanelSolution], low: PanelSolution, high: PanelSolution, change: Change
    ) -> Event:
        """Returns an event between two states, extrapolated from up to three on the side where it can be
        measured.
        """
        half = (high.load - low.load) / 2
        if change.measured_low:
            side, number = [state for state in reversed(visited) if state.load <= low.load], change.low
        else:
            side, number = [state for state in visited if state.load >= high.load], change.high
        alike = list(takewhile(lambda state: len(_zones(state)[change.zone]) == number, side[:3]))
        side = alike[::-1]  # towards the event
        sizes = [(state.load, self._size(state, change)) for state in side]
        guesses = [_zero(pair) for pair in zip(sizes, sizes[1:])]
        load, error = low.load + half, half
        if guesses and guesses[-1] is not None and low.load <= guesses[-1] <= high.load:
            load = guesses[-1]
            if len(guesses) > 1 and guesses[0] is not None:
                # the last correction, but no less than the remaining way makes likely
                error = min(half, max(abs(load - guesses[0]), APPROACH**2 * abs(load - side[-1].load)))
        return Event(load, error, change.kind, change.zone, change.x)

    def _size(self, state: PanelSolution, change: Change) -> float:
        """Returns the width of a zone that is born or vanishes, or of the gap next to x, to the power that is
        linear.
        """
        intervals = _zones(state)[change.zone]
        own = [interval for zones in state.all_zones.values() for interval in zones]
        if change.kind in ("merged", "split"):
            intervals = [(a[1], b[0]) for a, b in zip(intervals, intervals[1:])]
            own = [(a[1], b[0]) for zones in state.all_zones.values() for a, b in zip(zones, zones[1:])]
        left, right = min(intervals, key=lambda each: abs(each[0] + each[1] - 2 * change.x))
        return (right - left) ** (
            2
            if (left, right) in own
            else 2 * meeting_exponent(state.problem, state.all_zones, (left + right) / 2)
        )

    def _state(self, load: float, near: PanelSolution) -> PanelSolution | None:
        """Returns a state that starts from a neighbour; None where none is found."""
        try:
            return self._coarse(load, near)
        except NotConverged:
            return None


@dataclass(frozen=True)
class Change:
    """A difference between two neighbouring states; `low` and `high` are the numbers of such zones."""

    zone: str
    kind: str
    x: float
    low: int
    high: int

    @property
    def measured_low(self) -> bool:
        """Whether the width is measured before the event, not after it."""
        return self.kind in ("merged", "vanished")


def _load(state: PanelSolution) -> float:
    return state.load


def _zones(state: PanelSolution) -> Zones:
    """Returns the zones by name, open at valleys of the obstacle."""
    return contact_zones(_open_at_valleys(state), state.problem.law.corners)


def _open_at_valleys(state: PanelSolution) -> dict[int, Sequence[Interval]]:
    """Returns the zones of all corners by number. Under a valley of the obstacle the pressure is never
    positive: with the load the gap only gets too narrow to matter.
    """
    found, half = dict(state.all_zones), VALLEY * _width(state) / 2
    for place, jumps in state.problem.kinks.items():
        for corner in [each for each, jump in jumps.items() if jump < 0 and each in found]:
            found[corner] = tuple(without(found[corner], place - half, place + half))
    return found


def _changes(low: PanelSolution, high: PanelSolution) -> list[Change]:
    before, after = _zones(low), _zones(high)
    return [
        Change(name, kind, x, len(before[name]), len(after[name]))
        for name in NAMES
        for kind, x in zone_changes(before[name], after[name])
    ]


def _mirrored(change: Change, changes: Iterable[Change], width: float) -> bool:
    """Returns whether a change is one of two that are each other's mirror image, and so happen at once."""
    twins = [other for other in changes if (other.zone, other.kind) == (change.zone, change.kind)]
    return (
        len(twins) == 2
        and abs(change.high - change.low) == 2
        and abs(twins[0].x + twins[1].x) < TWINS * width
    )


def _concave(low: PanelSolution, high: PanelSolution) -> bool:
    """Returns whether a gap of the first solution is concave somewhere on what only the second has closed."""
    for corner, intervals in high.all_zones.items():
        own = sorted(low.all_zones.get(corner, ()))
        for left, right in intervals:
            ends = [left, *(edge for pair in own for edge in pair if left < edge < right), right]
            for a, b in zip(ends, ends[1:]):
                if any(first <= (a + b) / 2 <= last for first, last in own):
                    continue
                gaps = low.gaps(corner, np.linspace(a, b, TOUCH_SAMPLES))
                if np.diff(gaps, 2).min() < -CURVED * np.ptp(gaps):
                    return True
    return False


def _sides(visited: Sequence[PanelSolution], change: Change) -> tuple[PanelSolution, PanelSolution]:
    """Returns the neighbouring states between which a change happens, seen from where it is measured."""
    numbers, last = [len(_zones(state)[change.zone]) for state in visited], len(visited) - 2
    if change.measured_low:
        last = next((i for i, number in enumerate(numbers[1:]) if number != change.low), last)
    else:
        last = max((i for i, number in enumerate(numbers[:-1]) if number != change.high), default=last)
    return visited[last], visited[last + 1]


def _gaps(state: PanelSolution) -> Gaps:
    """Returns {(number of a zone of A, of one of B): (gap between them, below 0 where they overlap, its
    middle)}.
    """
    found: Gaps = {}
    for i, a in enumerate(state.all_zones[0]):
        for j, b in enumerate(state.all_zones[1]):
            left, right = max((b[1], a[0]), (a[1], b[0]), key=lambda edges: edges[1] - edges[0])
            found[i, j] = right - left, (left + right) / 2
    return found


def _root(loads: Sequence[float], sizes: Sequence[float]) -> tuple[float, float]:
    """Returns the load at which sizes vanish, interpolated as a polynomial of the size, and the last state's
    share.
    """

    def interpolated(numbers: Integers) -> float:
        shares = [np.prod([sizes[j] / (sizes[j] - sizes[i]) for j in numbers if j != i]) for i in numbers]
        return float(sum(share * loads[i] for share, i in zip(shares, numbers)))

    nearest = np.argsort(np.abs(sizes))[:INTERPOLATED]
    load = interpolated(nearest)
    return load, abs(load - interpolated(nearest[:-1]))


def _zero(pair: tuple[tuple[float, float], tuple[float, float]]) -> float | None:
    """Returns the load at which the line through two (load, size) crosses zero; None if it does not."""
    (P, a), (Q, b) = pair
    return None if a == b else Q - b * (Q - P) / (b - a)


def _crossing_once(found: list[Event]) -> list[Event]:
    """Returns events with one load where A's and B's edges cross: two zones meet and full contact is born
    there.
    """
    meeting = [event for event in found if (event.zone, event.kind) in MEETING | PARTING]
    if len(meeting) != 2 or {event.zone for event in meeting} != {"contact", "full"}:
        return found
    best = min(meeting, key=lambda event: event.load_error)
    error = max(best.load_error, abs(meeting[0].load - meeting[1].load))
    return [
        replace(event, load=best.load, load_error=error) if event in meeting else event for event in found
    ]


def _without_returns(events: Iterable[Event], near: float) -> list[Event]:
    """Returns events, ascending, without pairs that undo each other within their errors: next to a load at
    which a zone hardly begins or ends, one state may have it and the next may not.

    The event that is left beside such a pair gets an error that reaches it.
    """
    kept: list[Event] = []
    for event in events:
        alike = [
            i
            for i, other in enumerate(kept)
            if other.zone == event.zone
            and abs(other.x - event.x) <= near
            and event.load - other.load <= other.load_error + event.load_error
        ]
        undone = next((i for i in alike[::-1] if kept[i].kind == UNDONE[event.kind]), None)
        if undone is None:
            kept.append(event)
            continue
        del kept[undone]
        for i in (i for i in alike if i < undone):
            kept[i] = replace(kept[i], load_error=max(kept[i].load_error, event.load - kept[i].load))
    return kept


def _lowest_of_zones(state: PanelSolution) -> dict[int, dict[Interval, tuple[float, float | None]]]:
    """Returns {corner number: {interval: (least initial gap of the corner there, its x or None)}} of all
    zones.
    """
    problem: Problem = state.problem
    found: dict[int, dict[Interval, tuple[float, float | None]]] = {}
    for corner, intervals in _open_at_valleys(state).items():

        def gap(x: Array, corner: int = corner) -> Array:
            return problem.initial_gap(np.full(len(x), corner), x)

        found[corner] = {}
        for left, right in intervals:
            kinks = [
                place for place, jumps in problem.kinks.items() if corner in jumps and left <= place <= right
            ]
            x = np.unique((*np.linspace(left, right, TOUCH_SAMPLES), *kinks))
            found[corner][left, right] = lowest(gap, x)
    return found


def _is_still(low: PanelSolution, high: PanelSolution) -> bool:
    """Whether the contact does not shrink any more on the way to load 0."""
    one, other = low.all_zones, high.all_zones
    if any(len(one[corner]) != len(other[corner]) for corner in one):
        return False
    edges, others = (np.ravel([pair for own in zones.values() for pair in own]) for zones in (one, other))
    return bool(np.abs(edges - others).max() <= STILL * _width(low))


def _width(state: PanelSolution) -> float:
    return float(state.x[-1] - state.x[0])
