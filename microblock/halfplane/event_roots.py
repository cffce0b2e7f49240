"""Loads of events: states of one topology are continued to where a measure of them changes its sign."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..errors import NotConverged
from ..model.intervals import moved_on
from ..model.problem import Problem
from ..model.types import Array, CornerZones, Interval
from .edges import newton_zone_edges
from .panel_solution import PanelSolution
from .transmitted_singularities import meeting_exponent
from .zone_events import EDGE_TOLERANCE, RESOLUTION, SCAN_TOLERANCE, ZONE_SAMPLES, corner_zones

EVENT_ORDERS = (10, 14)  # of the panels that see an event, and of those that tell their error
STENCIL = np.arange(-3.0, 4.0, 2.0)  # of loads about a root

Measure = Callable[[PanelSolution], tuple[float, float]]  # a number, and its place x (length)


class Root(NamedTuple):
    """Load of an event (force per thickness), its error, and the place (length)."""

    load: float
    error: float
    x: float


@dataclass(frozen=True, eq=False)
class Branch:
    """States of one topology, continued to other loads whether or not they violate (26).

    Attributes
    ----------
    problem : Problem
    states : {load: PanelSolution}, known ones; more are added
    """

    problem: Problem
    states: dict[float, PanelSolution]

    def state_at(self, load: float) -> PanelSolution:
        """Returns the state at a load on panels that see an event."""
        if load not in self.states:
            self.states[load] = self.continued(load, EVENT_ORDERS[0])
        return self.states[load]

    def continued(self, load: float, order: int) -> PanelSolution:
        """Returns the state at a load on panels of an order; NotConverged if zones come or go."""
        nearest = [self.states[x] for x in sorted(self.states, key=lambda x: abs(x - load))]
        for near, next_one in zip(nearest, [*nearest[1:], nearest[0]]):
            fraction = 0.0
            if len(nearest) > 1:
                fraction = (load - near.load) / (near.load - next_one.load)
            zones = moved_on(near.zones, next_one.zones, fraction) or near.zones
            state = newton_zone_edges(self.problem, load, zones, order, EDGE_TOLERANCE)
            alike = [*map(len, corner_zones(near).values())] == [*map(len, corner_zones(state).values())]
            if alike and state.estimate.edges < 1e3 * EDGE_TOLERANCE:
                return state
        raise NotConverged(f"zones are others, or edges do not settle, on the way to load {load:g}")


class Polynomial(NamedTuple):
    """A measure at the four loads ``middle + step STENCIL`` about its root.

    Attributes
    ----------
    values, places : arrays (4,)
    root, rough : of the load as a cubic and as a parabola of the measure, in `step` from `middle` on
    """

    middle: float
    step: float
    values: Array
    places: Array
    root: float
    rough: float


@dataclass(frozen=True, eq=False)
class EventSearch:
    """Search for the load at which a measure of the states of a branch changes its sign.

    Attributes
    ----------
    branch : Branch
    low, high : loads between which it lies (force per thickness)
    measure : function of a state
    ends : {load: number}, of the measure at events
    """

    branch: Branch
    low: float
    high: float
    measure: Measure
    ends: dict[float, float] = field(default_factory=dict)

    def root(self) -> Root:
        """Returns the Root; raises NotConverged where the measure does not change its sign, or states cannot
        be continued.
        """
        return self._with_error(self._polished(self._bracketed()))

    def _bracketed(self) -> float:
        """Returns the load of the sign change, to a step of the polynomials."""
        from scipy.optimize import brentq  # here: half a second that states do without

        if self._number(self.low) * self._number(self.high) >= 0:
            raise NotConverged(f"nothing changes between loads {self.low:g} and {self.high:g}")
        precision = EDGE_TOLERANCE * self.high
        return float(brentq(self._number, self.low, self.high, xtol=precision, rtol=SCAN_TOLERANCE))

    def _number(self, load: float) -> float:
        """Returns the measure at a load, 0 next to loads that are known."""
        inner = [x for x in self.branch.states if self.low < x < self.high]
        beside = any(abs(load - x) < 30 * SCAN_TOLERANCE * load for x in inner)
        if self.low < load < self.high and beside and load not in inner:
            return 0.0  # the polynomials do the rest
        try:
            return self.ends[load] if load in self.ends else self.measure(self.branch.state_at(load))[0]
        except NotConverged:
            if not self.ends:
                raise
            return next(iter(self.ends.values()))  # as at the event

    def _polished(self, middle: float) -> Polynomial:
        """Returns the Polynomial about the root, from a load next to it."""
        for _ in range(5):
            room = [abs(middle - end) / 4 for end in self.ends]
            step = min([SCAN_TOLERANCE * middle, (self.high - self.low) / 2, *room])
            loads = (middle + step * STENCIL).tolist()
            values, places = np.transpose([self.measure(self.branch.state_at(load)) for load in loads])
            root, rough = (float(np.polyfit(values[:n], STENCIL[:n], n - 1)[-1]) for n in (4, 3))
            if abs(root) <= 1:
                return Polynomial(middle, step, values, places, root, rough)
            margin = (self.high - self.low) / 100
            middle = float(np.clip(middle + step * root, self.low + margin, self.high - margin))
        raise NotConverged(f"nothing is found between loads {self.low:g} and {self.high:g}")

    def _with_error(self, about: Polynomial) -> Root:
        """Returns the Root of the polynomial corrected by finer panels, and its error from both."""
        load = about.middle + about.step * STENCIL[1]
        coarse = self.branch.states[load]
        fine = Branch(self.branch.problem, {load: coarse}).continued(load, EVENT_ORDERS[1])
        finer, x = self.measure(fine)
        moved, _ = self.measure(replace(fine, zones=fine.next_zones))
        slope = (about.values[2] - about.values[1]) / 2
        changes = (abs(finer - about.values[1]) + abs(moved - finer)) / abs(slope)
        error = about.step * (abs(about.root - about.rough) + changes)
        root = about.middle + about.step * (about.root - (finer - about.values[1]) / slope)
        load = np.clip(root, self.low, self.high)
        error += abs(load - root) + 10 * EDGE_TOLERANCE * load  # to which edges settle where they meet
        place = np.interp(about.root, STENCIL, about.places) + x - about.places[1]
        return Root(float(load), float(error), float(place))


def span_of(state: PanelSolution, corner: int, x: float, touches: bool) -> Interval:
    """Returns the zone of a corner around x, or the gap between two."""
    spans = corner_zones(state)[corner]
    if not touches:
        spans = [(left[1], right[0]) for left, right in zip(spans, spans[1:])]
    return min(spans, key=lambda span: abs(span[0] + span[1] - 2 * x))


def least_in_span(state: PanelSolution, corner: int, touches: bool, span: Interval) -> tuple[float, float]:
    """Returns the least gap near a span that does not touch, or the least pressure in one that does, over
    what it grows like from the edges beside it, and its place; raises NotConverged if zones leave it.
    """
    left, right = span
    edges = [-np.inf, *np.ravel(state.zones[corner]), np.inf]
    number = int(np.searchsorted(edges, (left + right) / 2))
    start, end = edges[number - 1 : number + 1]
    if number % 2 != touches:
        raise NotConverged(f"zones leave x = {(left + right) / 2:g} at load {state.load:g}")
    values = state.gap if touches else state.traction
    power = 1.5 if touches else 0.5
    width = half = right - left
    while half > RESOLUTION * width:
        inset = RESOLUTION * (right - left)
        x = np.linspace(max(left, start + inset), min(right, end - inset), ZONE_SAMPLES)
        x = np.union1d(x, [kink for kink in state.problem.kinks if x[0] < kink < x[-1]])
        ratios = values(corner, x) / np.minimum(1, np.minimum(x - start, end - x) / width) ** power
        i = int(np.argmin(ratios))
        outermost = x[i] in (left, right)  # it goes on falling beyond
        half = (right - left) / (2 if outermost else ZONE_SAMPLES - 1)
        left = x[i] - half
        right = x[i] + half
    return float(ratios[i]), float(x[i])


def passing_gap(state: PanelSolution, pair: tuple[int, ...]) -> tuple[float, float]:
    """Returns the gap between a zone of A and one of B, below 0 where they overlap, to the power that is
    linear in the load; and its middle.
    """
    zones: CornerZones = corner_zones(state)
    a, b = (intervals[number] for intervals, number in zip(zones.values(), pair))
    left, right = max((b[1], a[0]), (a[1], b[0]), key=lambda edges: edges[1] - edges[0])
    power = 2 * meeting_exponent(state.problem, state.all_zones, (left + right) / 2)
    return float(np.copysign(abs(right - left) ** power, right - left)), (left + right) / 2
