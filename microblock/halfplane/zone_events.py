"""Changes of the zones between two fitted states: births, mergers, and where states may hide some."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from ..model.events import Event
from ..model.intervals import contact_zones, lowest, without, zone_changes, zone_edges
from ..model.types import Array, Interval
from .panel_solution import PanelSolution

SCAN_TOLERANCE = 1e-3  # of a load: zones that are born and merge within are not seen; of a width: of twins
RESOLUTION = 1e-5  # of a load, a width or a gap: less is the same
EDGE_TOLERANCE = 1e-9  # of a load, a width or the pressure that is left at an edge: less is nothing
ZONE_SAMPLES = 33  # over a zone, between which its lowest point is searched

Change = tuple[Any, str, float]  # name of a zone or number of a corner, kind of an `Event`, x
ZonesOf = Callable[[PanelSolution], Any]  # zones of a state, {name or number: intervals}


def width_of(state: PanelSolution) -> float:
    """Returns the length between the outermost points of a state."""
    return float(state.x[-1] - state.x[0])


def named_zones(state: PanelSolution) -> dict[str, list[Interval]]:
    """Returns {"A", "B", "full", "contact": intervals}, open at valleys."""
    return contact_zones(corner_zones(state), state.problem.law.corners)


def corner_zones(state: PanelSolution) -> dict[int, Any]:
    """Returns the zones of all corners by number, open at valleys: there the pressure is never positive."""
    zones = dict(state.all_zones)
    half = EDGE_TOLERANCE * width_of(state)
    for valley, jumps in state.problem.kinks.items():
        for corner, jump in jumps.items():
            if jump < 0 and corner in zones:
                zones[corner] = tuple(without(zones[corner], valley - half, valley + half))
    return zones


def changes(low: PanelSolution, high: PanelSolution, zones_of: ZonesOf) -> list[Change]:
    """Returns what happens to zones from a state to the next: [(name, kind, x), ...]."""
    before = zones_of(low)
    after = zones_of(high)
    return [
        (name, kind, x)
        for name in before
        # what is just born has not moved to where it will be
        if low.iterations and high.iterations or len(before[name]) != len(after[name])
        for kind, x in zone_changes(before[name], after[name])
    ]


def events_between(low: PanelSolution, high: PanelSolution, load: float, error: float) -> list[Event]:
    """Returns the events between two states, all at one load with its error (force per thickness)."""
    return [Event(load, error, kind, name, x) for name, kind, x in changes(low, high, named_zones)]


def is_small(state: PanelSolution) -> bool:
    """Returns whether all that touches is narrow, and did so at first."""
    widths = [right - left for left, right in named_zones(state)["contact"]]
    return max(widths) < state.problem.solid.ell / 5 and not any(event.load for event in births(state))


def is_still(low: PanelSolution, high: PanelSolution) -> bool:
    """Returns whether the contact does not shrink towards load 0."""
    inner = zone_edges(low.all_zones)
    outer = zone_edges(high.all_zones)
    return len(inner) == len(outer) and np.allclose(inner, outer, rtol=0, atol=RESOLUTION * width_of(low))


def births(first: PanelSolution) -> list[Event]:
    """Returns births up to the load of a state: of the nearest corners at first touch, else halfway."""
    problem = first.problem
    touches = []  # (corner's name, left, right, least gap, its place) of each zone
    for corner, intervals in corner_zones(first).items():
        gap = partial(problem.initial_gap, np.array(corner))
        for left, right in intervals:
            kinks = [x for x, jumps in problem.kinks.items() if corner in jumps and left <= x <= right]
            samples = np.union1d(np.linspace(left, right, ZONE_SAMPLES), kinks)
            touches.append((problem.law.corners[corner], left, right, *lowest(gap, samples)))
    largest = min(gap for *_, gap, _ in touches) + EDGE_TOLERANCE * width_of(first)
    events = []
    for name, intervals in named_zones(first).items():
        for left, right in intervals:
            places = [
                x
                for corner, start, end, least, x in touches
                if name in (corner, "contact") and left <= start and end <= right and least <= largest
            ]
            x = places[0] if len(places) == 1 and places[0] is not None else (left + right) / 2
            load = 0.0 if places else first.load / 2
            events.append(Event(load, load, "born", name, x))
    return events


def hides_events(low: PanelSolution, high: PanelSolution) -> bool:
    """Returns whether zones may be born and merge between alike states: where contact spreads to, a gap has a
    minimum or is concave.
    """
    step = (high.load - low.load) / high.load
    if step <= SCAN_TOLERANCE:
        return False
    sampled = list(_gaps_ahead(low, high))
    largest = max((np.ptp(gaps) for gaps, _ in sampled), default=0.0)
    for gaps, even in sampled:
        least = RESOLUTION * max(np.ptp(gaps), largest / 100)  # or what panels leave is taken for a minimum
        # steps are halved down to a fiftieth of the load where a zone may be born and merge
        concave = 50 * step > 1 and np.diff(gaps[even], 2).min() < -least
        from_left = np.maximum.accumulate(gaps)
        from_right = np.maximum.accumulate(gaps[::-1])[::-1]
        if concave or (np.minimum(from_left, from_right) - gaps).max() > least:
            return True
    return False


def _gaps_ahead(low: PanelSolution, high: PanelSolution) -> Iterator[tuple[Array, Any]]:
    """Yields gaps of the lower state where contact spreads to, and which of them are equally spaced."""
    for corner, zones in high.all_zones.items():
        for left, right in low.all_zones[corner]:
            zones = tuple(without(zones, left, right))
        sample_points = low.problem.sample_points(corner)
        for left, right in zones:
            even = np.linspace(left, right, ZONE_SAMPLES)
            x = np.union1d(even, sample_points[(left < sample_points) & (sample_points < right)])
            yield low.gap(corner, x), np.isin(x, even)
