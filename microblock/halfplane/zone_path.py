"""A load path on fitted states, and its events.

Zones are compared on a geometric scan of loads. Of the topologies beside an event the one with fewer edges is
continued past it: there the least gap of a birth, or the least pressure of a merger, changes its sign. Where
edges of the two corners pass each other the gap between them does, to the power 2 s, with the exponent s of
coalescence.
"""

from dataclasses import replace
from functools import cached_property, partial
from itertools import product

import numpy as np

from ..errors import NotConverged
from ..model.events import Event, LoadPath, following, require_on_path
from ..model.intervals import contact_zones, lowest, moved_on, without, zone_changes, zone_edges
from ..model.methods import Cells
from ..model.progress import counted, kept
from ..model.state import State
from .edges import newton_zone_edges
from .transmitted_singularities import meeting_exponent

NEAR = 1e-3  # of a load: zones that are born and merge within are not seen; of a width: of twins
FINE = 1e-5  # of a load, a width or a gap: less is not told apart
SAME = 1e-9  # of a load, a width or the pressure that is left at an edge: less is nothing
ORDERS = (10, 14)  # of the panels that see an event, and of those that tell their error
DOUBTS = (0.01, 0.04, 0.16, 0.64)  # of a load, up to which coarse states may miss an event
SAMPLES = 33  # over a zone, between which its lowest point is searched


class ZonePath(LoadPath):
    """The load path on the fitted panels of a `PanelSolver`; the rest is as of `Contact.path`."""

    def __init__(self, solver, last, rtol):
        self._solver = solver
        super().__init__(solver.contact, last, solver.goal(rtol))

    @following
    def at(self, load):
        require_on_path(load, self.last)
        near = min(self._scan, key=lambda one: abs(np.log(one.load / load)))
        return State(self._solver.at(load, self.rtol, near=near))

    @cached_property
    @following  # here: whatever is read first, `first` or `events`, begins with it
    def _scan(self):
        """States at geometric loads, ascending. Where none is found at three in turn the path
        begins, if that is below a hundredth of its last load.
        """
        states, skipped, still = [self._coarse(self.last)], 0, False
        while not (still or _is_small(states[0])) and states[0].load > SAME * self.last:
            try:
                state = self._coarse(states[0].load / 2.5 ** (1 + skipped), states[0])
                still, skipped = _is_still(state, states[0]), 0
                states.insert(0, state)
            except NotConverged:
                skipped += 1
                if skipped > 2:
                    if states[0].load > self.last / 100:
                        raise
                    break
        return states

    def _coarse(self, load, near=None):
        state = self._solver.at(load, order=ORDERS[0], near=near)
        if state.estimate.conditions > NEAR:
            wrong = state.estimate.conditions
            raise NotConverged(f"zones at load {load:g} violate the contact conditions by {wrong:.1e}")
        return state

    @property
    def first(self):
        """Load from which zones are followed; see `LoadPath`."""
        return float(self._followed[0])

    @cached_property
    def events(self):
        return self._followed[1]

    @property
    def warnings(self):
        return self._followed[2]

    @cached_property
    @following
    def _followed(self):
        """(first load, events, warnings) of panels, or of uniform cells where panels fail."""
        try:
            found = _births(self._scan[0])
            kept(found)
            for low, high in zip(self._scan, self._scan[1:]):
                counted(load=low.load)
                found += self._between(low, high)
        except NotConverged as failure:
            if self.problem.method is not None:
                raise
            path = self.problem.with_(method=Cells()).path(self.last)
            instead = f"events of uniform cells instead of panels ({failure})"
            return path.first, path.events, [instead, *path.warnings]
        return self._scan[0].load, sorted(found, key=lambda event: event.load), []

    def _between(self, low, high):
        """Returns events between two states."""
        half = (high.load - low.load) / 2
        changes = [each for each in _changes(low, high, _opened) if each[0] in high.problem.corners]
        try:
            if not changes and not _hides(low, high):
                return self._passings(low, high)
            if changes and (sides := self._sides(low, high, changes)):
                before, after, error = sides
                now = _events(before, after, before.load, error)
                return [*self._between(low, before), *now, *self._between(after, high)]
        except NotConverged:  # of no topology as far as that: states in between have nearer zones
            pass
        try:
            if half > FINE * high.load:
                between = self._coarse(float(np.sqrt(low.load * high.load)), low if low.iterations else high)
                return [*self._between(low, between), *self._between(between, high)]
        except NotConverged:  # the two are all that is known
            pass
        # no topology leads to it, as at an end of a punch
        return _events(low, high, low.load + half, half + self._missed(low, high))

    def _missed(self, low, high):
        """Returns how far (force per thickness) from two coarse states those to rtol agree with them in the
        zones that change; the whole load where they do not.
        """
        names = {name for name, *_ in _changes(low, high, _zones)}

        def agrees(coarse, load):
            try:
                state = self._solver.at(load, float(self.rtol))
            except NotConverged:
                return False
            known, found = _zones(coarse), _zones(state)
            return all(len(known[name]) == len(found[name]) for name in names)

        for share in DOUBTS:
            if agrees(low, (1 - share) * low.load) and agrees(high, min((1 + share) * high.load, self.last)):
                return share * high.load
        return high.load

    def _sides(self, low, high, changes):
        """Returns the states before and after the only change between two, at its load, and the error of
        that; None if there are several. Two that mirror each other are one.
        """
        kind, places = changes[0][1], [x for _, _, x in changes]
        twins = len(changes) == 2 and changes[1][1] == kind and abs(sum(places)) < NEAR * _width(high)
        if len(changes) > 1 and not twins:
            return None
        touches, grows = kind in ("born", "vanished"), kind in ("born", "split")
        fewer, more = (low, high) if grows else (high, low)
        states, roots = {fewer.load: fewer}, []
        for corner, _, x in changes:
            margin = partial(_margin, corner=corner, touches=touches, span=_span(more, corner, x, touches))
            roots.append(self._root(low, high, states, margin, {}))
        load, error, _ = max(roots)
        apart = load - min(roots)[0]
        if apart > FINE * load:
            return None
        state = self._continued(states, high.problem, load, ORDERS[0])
        width, zones = _width(state), dict(state.zones)
        for (corner, *_), (*_, x) in zip(changes, roots):
            tiny = x - SAME * width, x + SAME * width
            zones[corner] = tuple(sorted([*without(zones[corner], *tiny), *([tiny] if touches else [])]))
        state = replace(state, iterations=0)  # of an event, no fit
        other = replace(state, zones=dict(state.problem.computed(zones)))
        return (state, other, error + apart) if grows else (other, state, error + apart)

    def _passings(self, low, high):
        """Returns events at which edges of the two corners pass each other."""
        corners, found = _opened(low).values(), []
        fits = {state.load: state for state in (low, high) if state.iterations}
        for pair in product(*(range(len(own)) for own in corners)) if len(corners) == 2 else ():
            (gap, _), (later, x) = _passed(low, pair), _passed(high, pair)
            if gap * later < 0:
                passed = partial(_passed, pair=pair)
                ends = {state.load: passed(state) for state in (low, high) if not state.iterations}
                load, error, x = self._root(low, high, fits, passed, ends)
                kinds = ("born", "merged") if gap > 0 else ("vanished", "split")
                found += [Event(load, error, kind, zone, x) for kind, zone in zip(kinds, ("full", "contact"))]
        return found

    def _root(self, low, high, states, measured, ends):
        """Returns the load at which what is measured of continued states changes its sign, its error and the
        place; raises NotConverged where it does not, or they cannot be continued.

        Parameters
        ----------
        low, high : states between whose loads it lies
        states : {load: state} of the topology; more are added
        measured : function of a state: (number, place)
        ends : {load: (number, place)} at events
        """
        from scipy.optimize import brentq  # here: half a second that states do without

        def value(load):
            if load not in states:
                states[load] = self._continued(states, high.problem, load, ORDERS[0])
            return measured(states[load])

        def about(load):
            between = [other for other in states if low.load < other < high.load]
            new = low.load < load < high.load and load not in states
            if new and any(abs(load - other) < 30 * NEAR * load for other in between):
                return 0.0  # the polynomials do the rest
            try:
                return (ends[load] if load in ends else value(load))[0]
            except NotConverged:
                if not ends:
                    raise
                return next(iter(ends.values()))[0]  # as at the event

        if about(low.load) * about(high.load) >= 0:
            raise NotConverged(f"nothing changes between loads {low.load:g} and {high.load:g}")
        middle = brentq(about, low.load, high.load, xtol=SAME * high.load, rtol=NEAR)
        ways = np.arange(-3, 4, 2)
        for _ in range(5):
            step = min([NEAR * middle, (high.load - low.load) / 2, *(abs(middle - end) / 4 for end in ends)])
            values, places = np.transpose([value(each) for each in (middle + step * ways).tolist()])
            # the polynomial of the value through all and through three
            way, other = (np.polyfit(values[:count], ways[:count], count - 1)[-1] for count in (4, 3))
            if abs(way) <= 1:
                break
            margin = (high.load - low.load) / 100
            middle = float(np.clip(middle + step * way, low.load + margin, high.load - margin))
        else:
            raise NotConverged(f"nothing is found between loads {low.load:g} and {high.load:g}")
        one = middle + step * ways[1]
        fine = self._continued({one: states[one]}, high.problem, one, ORDERS[1])
        (finer, x), (moved, _) = (measured(each) for each in (fine, replace(fine, zones=fine.further)))
        slope = (values[2] - values[1]) / 2
        error = step * (abs(way - other) + (abs(finer - values[1]) + abs(moved - finer)) / abs(slope))
        root = middle + step * (way - (finer - values[1]) / slope)
        load = np.clip(root, low.load, high.load)
        error += abs(load - root) + 10 * SAME * load  # to which edges settle where they meet
        place = np.interp(way, ways, places) + x - places[1]
        return float(load), float(error), float(place)

    def _continued(self, states, problem, load, order):
        """Returns the state at a load with the topology of others, whether or not it violates (26); raises
        NotConverged where zones come or go.
        """
        known = [states[other] for other in sorted(states, key=lambda other: abs(other - load))]
        for near, other in zip(known, [*known[1:], known[0]]):
            share = (load - near.load) / (near.load - other.load) if len(known) > 1 else 0.0
            zones = moved_on(near.zones, other.zones, share) or near.zones
            state = newton_zone_edges(problem, load, zones, order, SAME)
            alike = [*map(len, _opened(near).values())] == [*map(len, _opened(state).values())]
            if alike and state.estimate.edges < 1e3 * SAME:
                return state
        raise NotConverged(f"zones are others, or edges do not settle, on the way to load {load:g}")


def _is_small(state):
    """Returns whether all that touches is narrow, and did so at first."""
    narrow = state.problem.solid.ell / 5
    return all(right - left < narrow for left, right in _zones(state)["contact"]) and not any(
        event.load for event in _births(state)
    )


def _is_still(low, high):
    """Returns whether the contact does not shrink towards load 0."""
    edges, others = zone_edges(low.all_zones), zone_edges(high.all_zones)
    return len(edges) == len(others) and np.allclose(edges, others, rtol=0, atol=FINE * _width(low))


def _births(first):
    """Returns births up to a load: at first touch of the nearest corners, else between 0 and it."""
    problem, lows, found = first.problem, [], []
    for corner, intervals in _opened(first).items():
        for left, right in intervals:
            kinks = [x for x, jumps in problem.kinks.items() if corner in jumps and left <= x <= right]
            low = lowest(
                partial(problem.initial_gap, np.array(corner)),
                np.union1d(np.linspace(left, right, SAMPLES), kinks),
            )
            lows.append((problem.law.corners[corner], left, right, *low))
    most = min(gap for *_, gap, _ in lows) + SAME * _width(first)
    for name, intervals in _zones(first).items():
        for left, right in intervals:
            places = [
                x
                for own, a, b, gap, x in lows
                if name in (own, "contact") and left <= a and b <= right and gap <= most
            ]
            x = places[0] if len(places) == 1 and places[0] is not None else (left + right) / 2
            late = 0.0 if places else first.load / 2
            found.append(Event(late, late, "born", name, x))
    return found


def _zones(state):
    return contact_zones(_opened(state), state.problem.law.corners)


def _opened(state):
    """Returns the zones of all corners by number, open at valleys: there the pressure is never positive."""
    found, tiny = dict(state.all_zones), SAME * _width(state)
    for place, jumps in state.problem.kinks.items():
        for corner in [each for each, jump in jumps.items() if jump < 0 and each in found]:
            found[corner] = tuple(without(found[corner], place - tiny, place + tiny))
    return found


def _changes(low, high, zones):
    """Returns what happens to `zones`, {name: intervals}: [(name, kind, x), ...]."""
    before, after = zones(low), zones(high)
    return [
        (name, kind, x)
        for name in before
        # what is just born has not moved to where it will be
        if low.iterations and high.iterations or len(before[name]) != len(after[name])
        for kind, x in zone_changes(before[name], after[name])
    ]


def _events(low, high, load, error):
    return [Event(load, error, kind, name, x) for name, kind, x in _changes(low, high, _zones)]


def _hides(low, high):
    """Returns whether zones may be born and merge between alike states: where contact spreads to, a gap has a
    minimum or is concave.
    """
    step, problem, outside = (high.load - low.load) / high.load, low.problem, []
    for corner, parts in high.all_zones.items():
        for left, right in low.all_zones[corner]:
            parts = tuple(without(parts, left, right))
        for left, right in parts if step > NEAR else ():
            sites, even = problem.sites(corner), np.linspace(left, right, SAMPLES)
            x = np.union1d(even, sites[(left < sites) & (sites < right)])
            outside.append((low.gap(corner, x), np.isin(x, even)))
    most = max((np.ptp(gaps) for gaps, _ in outside), default=0.0)
    for gaps, even in outside:
        least = FINE * max(np.ptp(gaps), most / 100)  # or what panels leave is taken for a minimum
        above = np.maximum.accumulate(gaps), np.maximum.accumulate(gaps[::-1])[::-1]
        # steps are halved down to a fiftieth of the load where a zone may be born and merge
        bends = 50 * step > 1 and np.diff(gaps[even], 2).min() < -least
        if bends or (np.minimum(*above) - gaps).max() > least:
            return True
    return False


def _span(state, corner, x, touches):
    """Returns the zone of a corner around x, or the gap between two."""
    zones = _opened(state)[corner]
    spans = zones if touches else [(a[1], b[0]) for a, b in zip(zones, zones[1:])]
    return min(spans, key=lambda span: abs(span[0] + span[1] - 2 * x))


def _margin(state, corner, touches, span):
    """Returns the least gap near a span that does not touch, or the least pressure in one that does, over
    what it grows like from the edges beside it, and its place; raises NotConverged if zones leave it.
    """
    (left, right), zones = span, [-np.inf, *np.ravel(state.zones[corner]), np.inf]
    number = int(np.searchsorted(zones, (left + right) / 2))
    start, end = zones[number - 1 : number + 1]
    if number % 2 != touches:
        raise NotConverged(f"zones leave x = {(left + right) / 2:g} at load {state.load:g}")
    values = state.gap if touches else state.traction
    width = half = right - left
    while half > FINE * width:
        inset = FINE * (right - left)
        x = np.linspace(max(left, start + inset), min(right, end - inset), SAMPLES)
        x = np.union1d(x, [kink for kink in state.problem.kinks if x[0] < kink < x[-1]])
        ratios = values(corner, x) / np.minimum(1, np.minimum(x - start, end - x) / width) ** (
            1.5 if touches else 0.5
        )
        i = int(np.argmin(ratios))
        on = x[i] in (left, right)  # it goes on falling beyond
        half = (right - left) / (2 if on else SAMPLES - 1)
        left, right = x[i] - half, x[i] + half
    return float(ratios[i]), float(x[i])


def _passed(state, pair):
    """Returns the gap between a zone of A and one of B, below 0 where they overlap, to the power that is
    linear in the load; and its middle.
    """
    a, b = (zones[number] for zones, number in zip(_opened(state).values(), pair))
    left, right = max((b[1], a[0]), (a[1], b[0]), key=lambda edges: edges[1] - edges[0])
    power = 2 * meeting_exponent(state.problem, state.all_zones, (left + right) / 2)
    return float(np.copysign(abs(right - left) ** power, right - left)), (left + right) / 2


def _width(state):
    return float(state.x[-1] - state.x[0])
