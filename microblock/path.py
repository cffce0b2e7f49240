"""A load path on fitted states: any state on it, and the events at which zones are born, meet, part or
vanish.

Topologies are compared on a geometric scan of loads, from where the contact is small against a block. Of the
two topologies beside an event, the one with fewer edges is continued past it: there the least gap where a zone
is born, or the least pressure where two merge, changes its sign, as a smooth function of the load. Where edges
of the two corners pass each other the gap between them does so; to the power 2 s, with the exponent s of
coalescence, it is linear in the load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import product
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from tqdm.auto import tqdm

from .errors import NotConverged
from .halfplane.carried import meeting_exponent
from .halfplane.edges import fit
from .halfplane.survey import survey
from .model.events import Event, LoadPath, require_on_path
from .model.problem import Problem, half_line
from .model.state import State
from .model.types import Array, ContactLike, Interval, Zones
from .model.zones import contact_zones, lowest, moved_on, without, zone_changes
from .threads import bounded

if TYPE_CHECKING:
    from .halfplane.panel_solution import PanelSolution
    from .halfplane.panel_solver import PanelSolver

Change: TypeAlias = tuple[int, str, float]  # corner, kind, place
Gaps: TypeAlias = dict[tuple[int, int], tuple[float, float]]

FACTOR = 2.5  # between the loads of the scan
START = 0.2  # of ell: the contact is that narrow where the scan begins
LEAST = 1e-9  # of the last load, if it never is
SKIPPED = 2  # loads of the scan, at most, at which no state is found before it goes on
FOLLOWED = 1e-2  # of the last load: if no smaller state is found below it, the path begins there
STILL = 1e-4  # of the width: between two loads of the scan no edge moves more, as under a flat punch
SAME = 1e-9  # of the width: places nearer to each other are one
TWINS = 1e-3  # of the width: changes whose places mirror each other as well as that happen at once
UNSEEN = 1e-3  # of the load: a zone that is born and merges within is not seen
# of the load: steps are halved down to it where a gap is concave, so that a zone may be born and merge there
BENT = 0.02
NARROW = 1e-5  # of the load: several events within are given as one bracket
ORDERS = (10, 14)  # of the panels that see an event, and of those that tell their error
EDGES = 1e-9  # to which their edges are driven: rounding
SETTLED = 1e-6  # the same where the two corners' edges nearly meet
CLOSE = 1e-3  # of the load: distance of the states from the event between which it is interpolated
VALLEY = 1e-12  # of the width: of a gap at a valley of the obstacle that is not resolved
CURVED = 1e-5  # of the range of a gap: smaller second differences are rounding
FINE = 1e-5  # of a zone's width: to which the place of a least gap or pressure is found
SAMPLES = 33  # over a zone, between which its lowest point is searched


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
        """Returns the coarse solution at a load, from a neighbour."""
        self._bar.update()
        return self._solver.at(load, order=ORDERS[0], near=near)

    @cached_property
    @bounded  # here: whatever is read first, `first` or `events`, begins with it
    def _scan(self) -> list[PanelSolution]:
        """States at geometric loads, ascending, coarse."""
        states = [self._coarse(self.last)]
        while not self._is_small(states[0]) and states[0].load > LEAST * self.last:
            state = self._smaller(states[0])
            if state is None:
                break
            states.insert(0, state)
            if _is_still(*states[:2]):
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
        return sorted(found, key=lambda event: event.load)

    def _births(self, first: PanelSolution) -> list[Event]:
        """Returns events up to the first load of the scan: at first touch for the nearest corners, else
        before that.
        """
        found, lows, names = [], _lowest_of_zones(first), first.problem.law.corners
        most = min(gap for _, _, gap, _ in lows) + SAME * _width(first)
        for name, intervals in _zones(first).items():
            for left, right in intervals:
                places = [
                    x
                    for corner, (a, b), gap, x in lows
                    if name in (names[corner], "contact") and left <= a and b <= right and gap <= most
                ]
                x = places[0] if len(places) == 1 and places[0] is not None else (left + right) / 2
                late = 0.0 if places else first.load / 2
                found.append(Event(late, late, "born", name, x))
        return found

    def _between(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events between two states, ascending in load."""
        changes = _changes(low, high)
        try:
            if not changes and not _hides(low, high):
                return self._crossings(low, high)
            if changes and (sides := self._sides(low, high, changes)):
                before, after, error = sides
                now = _events(before, after, before.load, error)
                return [*self._between(low, before), *now, *self._between(after, high)]
        except NotConverged:  # so far, no topology can be continued: nearer states are nearer in zones
            pass
        half = (high.load - low.load) / 2
        try:
            if half > NARROW * high.load:
                between = self._coarse(float(np.sqrt(low.load * high.load)), low if low.iterations else high)
                return [*self._between(low, between), *self._between(between, high)]
        except NotConverged:  # what is known is the bracket
            pass
        return _events(low, high, low.load + half, half)

    def _sides(
        self, low: PanelSolution, high: PanelSolution, changes: Sequence[Change]
    ) -> tuple[PanelSolution, PanelSolution, float] | None:
        """Returns the zones at the load of the only change between two states, before and after it, and the
        load's error; None if there are several changes. Two that mirror each other happen at once.
        """
        (_, kind, x), *others = changes
        twins = [each for each in others if each[1] == kind and abs(each[2] + x) < TWINS * _width(high)]
        if len(changes) > 2 or len(twins) < len(others):
            return None
        touches, grows = kind in ("born", "vanished"), kind in ("born", "split")
        fewer, more = (low, high) if grows else (high, low)
        states = {fewer.load: fewer}
        margins = [
            partial(_margin, corner=corner, touches=touches, span=_span(more, corner, place, touches))
            for corner, _, place in changes
        ]
        found = [
            self._root(low, high, states, lambda state, margin=margin: margin(state)[0], {})
            for margin in margins
        ]
        load, error = max(found, key=lambda one: one[1])
        if any(abs(other - load) > error + NARROW * load for other, _ in found):
            return None
        state = self._continued(states, high.problem, load, ORDERS[0])
        places = [margin(state)[1] for margin in margins]
        gone = [
            (corner, x, gap)
            for corner, x, gap in survey(state).least
            if all(abs(x - place) > TWINS * _width(state) for place in places)
        ]
        zones, half = dict(state.zones), SAME * _width(state)
        for (corner, _, _), x in zip(changes, places):
            parts = without(zones[corner], x - half, x + half)
            zones[corner] = tuple(sorted([*parts, (x - half, x + half)]) if touches else parts)
        state = replace(state, iterations=0, least=tuple(gone))  # no fit any more
        other = replace(state, zones=state.problem.computed(zones))
        return (state, other, error) if grows else (other, state, error)

    def _crossings(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events between two states whose corners have zones alike: edges of the two corners pass
        each other.
        """
        gaps, later, found = _gaps(low), _gaps(high), []
        states = {state.load: state for state in (low, high) if state.iterations}
        for pair in [pair for pair in gaps if gaps[pair][0] * later[pair][0] < 0]:
            x = later[pair][1]
            power = 2 * meeting_exponent(low.problem, low.all_zones, x)

            def measured(state: PanelSolution, pair: tuple[int, int] = pair, power: float = power) -> float:
                gap = _gaps(state)[pair][0]
                return float(np.copysign(abs(gap) ** power, gap))

            meets = gaps[pair][0] > 0
            if meets and abs(x) < SAME * _width(low) and self._solver.may_meet_on_axis:
                load, error = self._solver.coalescence()
            else:
                known = {state.load: measured(state) for state in (low, high) if not state.iterations}
                load, error = self._root(low, high, states, measured, known)
                x = _gaps(_nearest(states, load)[0])[pair][1]
            kinds = ("born", "merged") if meets else ("vanished", "split")
            found += [Event(load, error, kind, zone, x) for kind, zone in zip(kinds, ("full", "contact"))]
        return found

    def _root(
        self,
        low: PanelSolution,
        high: PanelSolution,
        states: dict[float, PanelSolution],
        measured: Callable[[PanelSolution], float],
        values: dict[float, float],
    ) -> tuple[float, float]:
        """Returns the load at which what is measured of continued states changes its sign, and its error.

        Parameters
        ----------
        low, high : states of the two loads between which it lies
        states : {load: state} from which the topology is continued; more are added
        measured : function of a state
        values : {load: number} where it is known: at an event, where a zone is too small to be fitted

        Raises
        ------
        NotConverged
            If the topology cannot be continued, or nothing changes its sign.
        """
        from scipy.optimize import brentq  # here: half a second that states do without

        ends, at_end = [*values], next(iter(values.values()), None)

        def value(load: float) -> float:
            if load not in values:
                try:
                    if load not in states:
                        states[load] = self._continued(states, high.problem, load, ORDERS[0])
                    values[load] = measured(states[load])
                except NotConverged:
                    if at_end is None:
                        raise
                    values[load] = at_end  # as small as there
            return values[load]

        if not value(low.load) * value(high.load) < 0:
            raise NotConverged(f"nothing changes between loads {low.load:g} and {high.load:g}")
        about = brentq(value, low.load, high.load, xtol=SAME * high.load, rtol=CLOSE)
        step = min([CLOSE * about, *(abs(about - end) / 4 for end in ends)])
        around = {load: value(load) for load in (about + step * np.array((-1, 1, -3, 3))).tolist()}
        load, other = (_interpolated([*around.items()][:number]) for number in (4, 3))
        (one, first), (two, second), *_ = around.items()
        finer = measured(self._continued({one: states[one]}, high.problem, one, ORDERS[1]))
        shift = (first - finer) * (two - one) / (second - first)
        return float(np.clip(load + shift, low.load, high.load)), abs(load - other) + abs(shift)

    def _continued(
        self, states: dict[float, PanelSolution], problem: Problem, load: float, order: int
    ) -> PanelSolution:
        """Returns the state at a load with the topology of others, whether or not it violates (26).

        Raises
        ------
        NotConverged
            If its zones change on the way.
        """
        self._bar.update()
        known = _nearest(states, load)
        for near, other in zip(known, [*known[1:], known[0]]):
            share = (load - near.load) / (near.load - other.load) if near.load != other.load else 0.0
            zones = moved_on(near.zones, other.zones, share) or near.zones
            state = fit(problem, load, zones, order, EDGES)
            if state.estimate.edges < SETTLED and _counts(state) == _counts(near):
                return state
        raise NotConverged(f"zones or their edges change on the way to load {load:g}")


def _nearest(states: dict[float, PanelSolution], load: float) -> list[PanelSolution]:
    return [states[other] for other in sorted(states, key=lambda other: abs(other - load))]


def _counts(state: PanelSolution) -> list[int]:
    return [*map(len, _opened(state).values())]


def _interpolated(points: Sequence[tuple[float, float]]) -> float:
    """Returns the load at which a value vanishes, by the polynomial of the value through (load, value)."""
    shares = [np.prod([w / (w - v) for _, w in points if w != v]) for _, v in points]
    return float(sum(share * load for share, (load, _) in zip(shares, points)))


def _zones(state: PanelSolution) -> Zones:
    """Returns the zones by name, open at valleys of the obstacle."""
    return contact_zones(_opened(state), state.problem.law.corners)


def _opened(state: PanelSolution) -> dict[int, Sequence[Interval]]:
    """Returns the zones of all corners by number. Under a valley of the obstacle the pressure is never
    positive: with the load the gap only gets too narrow to matter.
    """
    found, half = dict(state.all_zones), VALLEY * _width(state)
    for place, jumps in state.problem.kinks.items():
        for corner in [each for each, jump in jumps.items() if jump < 0 and each in found]:
            found[corner] = tuple(without(found[corner], place - half, place + half))
    return found


def _changes(low: PanelSolution, high: PanelSolution) -> list[Change]:
    """Returns what happens to the zones of each corner that is computed: [(corner, kind, x), ...]."""
    before, after, problem = _opened(low), _opened(high), high.problem
    found = [
        (corner, kind, x)
        for corner in problem.corners
        for kind, x in zone_changes(before[corner], after[corner])
        if not half_line(problem) or x >= -SAME * _width(high)
    ]
    alike = _counts(low) == _counts(high)
    # a zone that is just born has not moved to where it will be
    return [] if alike and not (low.iterations and high.iterations) else found


def _events(low: PanelSolution, high: PanelSolution, load: float, error: float) -> list[Event]:
    """Returns what happens to the zones by name from one state to the other, at one load."""
    before, after = _zones(low), _zones(high)
    return [
        Event(load, error, kind, name, x)
        for name in before
        for kind, x in zone_changes(before[name], after[name])
    ]


def _hides(low: PanelSolution, high: PanelSolution) -> bool:
    """Returns whether zones may be born and merge between two states with zones alike.

    Where a gap has a minimum out of contact before, and is closed afterwards, a zone may have been born
    there; halving the step shows it, or an edge that comes so near that the minimum is gone. Where the gap is
    concave before, such a minimum may still arise.
    """
    closed, step = high.all_zones, (high.load - low.load) / high.load
    arisen = [x for corner, x, _ in low.least if any(left < x < right for left, right in closed[corner])]
    return bool(arisen and step > UNSEEN) or step > BENT and _concave(low, high)


def _concave(low: PanelSolution, high: PanelSolution) -> bool:
    """Returns whether a gap of the first solution is concave somewhere on what only the second has closed."""
    for corner, intervals in high.all_zones.items():
        own = sorted(low.all_zones.get(corner, ()))
        for left, right in intervals:
            ends = [left, *(edge for pair in own for edge in pair if left < edge < right), right]
            for a, b in zip(ends, ends[1:]):
                if any(first <= (a + b) / 2 <= last for first, last in own):
                    continue
                gaps = low.gaps(corner, np.linspace(a, b, SAMPLES))
                if np.diff(gaps, 2).min() < -CURVED * np.ptp(gaps):
                    return True
    return False


def _span(state: PanelSolution, corner: int, x: float, touches: bool) -> Interval:
    """Returns the zone of a corner around x, or, if not `touches`, the gap between two."""
    zones = _opened(state)[corner]
    spans = zones if touches else [(a[1], b[0]) for a, b in zip(zones, zones[1:])]
    return min(spans, key=lambda span: abs(span[0] + span[1] - 2 * x))


def _margin(state: PanelSolution, corner: int, touches: bool, span: Interval) -> tuple[float, float]:
    """Returns the least gap of a corner near a span where it does not touch, or its least pressure where it
    does, over what it grows like from the edges beside it; and its place.
    """
    (left, right), zones = span, [-np.inf, *np.ravel(state.zones[corner]), np.inf]
    number = int(np.searchsorted(zones, (left + right) / 2))
    start, end = zones[number - 1 : number + 1]
    if number % 2 != touches:
        raise NotConverged(f"the zones leave x = {(left + right) / 2:g} at load {state.load:g}")
    values, power = (state.gaps, 1.5) if touches else (state.pressure, 0.5)
    width = half = right - left
    while half > FINE * width:
        inset = FINE * (right - left)
        x = np.linspace(max(left, start + inset), min(right, end - inset), SAMPLES)
        x = np.union1d(x, [kink for kink in state.problem.kinks if x[0] < kink < x[-1]])
        ratios = values(corner, x) / np.minimum(1, np.minimum(x - start, end - x) / width) ** power
        i = int(np.argmin(ratios))
        on = (i == 0 and x[0] == left) or (i == len(x) - 1 and x[-1] == right)  # the slope goes on beyond
        half = (right - left) / (2 if on else SAMPLES - 1)
        left, right = x[i] - half, x[i] + half
    return float(ratios[i]), float(x[i])


def _gaps(state: PanelSolution) -> Gaps:
    """Returns {(number of a zone of A, of one of B): (gap between them, below 0 where they overlap, its
    middle)}; empty where there is one corner.
    """
    zones, found = [*_opened(state).values()], {}
    for (i, a), (j, b) in product(*map(enumerate, zones)) if len(zones) == 2 else ():
        left, right = max((b[1], a[0]), (a[1], b[0]), key=lambda edges: edges[1] - edges[0])
        found[i, j] = right - left, (left + right) / 2
    return found


def _lowest_of_zones(state: PanelSolution) -> list[tuple[int, Interval, float, float | None]]:
    """Returns (corner number, interval, least initial gap there, its x or None) of all zones."""
    problem: Problem = state.problem
    found = []
    for corner, intervals in _opened(state).items():

        def gap(x: Array, corner: int = corner) -> Array:
            return problem.initial_gap(np.full(len(x), corner), x)

        for left, right in intervals:
            kinks = [
                place for place, jumps in problem.kinks.items() if corner in jumps and left <= place <= right
            ]
            x = np.unique((*np.linspace(left, right, SAMPLES), *kinks))
            found.append((corner, (left, right), *lowest(gap, x)))
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
