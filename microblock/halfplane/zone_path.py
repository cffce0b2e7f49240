"""A load path on fitted states, and its events.

Events are roots: the least gap (birth), the least pressure (merger), continued on the topology with fewer
edges. Zones are compared on a geometric scan of loads. Where edges of the two corners pass each other the gap
between them changes its sign, to the power 2 s, with the exponent s of coalescence.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import pairwise, product
from typing import Any

import numpy as np

from ..errors import NotConverged
from ..model.events import Event, LoadPath, following, require_on_path
from ..model.intervals import without
from ..model.methods import Cells
from ..model.progress import counted, kept
from ..model.state import State
from .event_roots import EVENT_ORDERS, Branch, EventSearch, least_in_span, passing_gap, span_of
from .panel_solution import PanelSolution
from .zone_events import (
    EDGE_TOLERANCE,
    RESOLUTION,
    SCAN_TOLERANCE,
    Change,
    births,
    changes,
    corner_zones,
    events_between,
    hides_events,
    is_small,
    is_still,
    named_zones,
    width_of,
)

FRACTIONS_IN_DOUBT = (0.01, 0.04, 0.16, 0.64)  # of a load, up to which coarse states may miss an event


class ZonePath(LoadPath):
    """The load path on the fitted panels of a `PanelSolver`; the rest is as of `Contact.path`."""

    def __init__(self, solver: Any, last: float, rtol: float | None) -> None:
        self._solver = solver
        super().__init__(solver.contact, last, solver.goal(rtol))

    @following
    def at(self, load: float) -> State:
        require_on_path(load, self.last)
        nearest = min(self._scan, key=lambda state: abs(np.log(state.load / load)))
        return self._solver.solution_at(load, self.rtol, near=nearest).state()

    @cached_property
    @following  # here: whatever is read first, `first` or `events`, begins with it
    def _scan(self) -> list[PanelSolution]:
        """States at geometric loads, ascending. Where none is found at three in turn the path
        begins, if that is below a hundredth of its last load.
        """
        states = [self._coarse(self.last)]
        skipped = 0
        still = False
        while not (still or is_small(states[0])) and states[0].load > EDGE_TOLERANCE * self.last:
            try:
                state = self._coarse(states[0].load / 2.5 ** (1 + skipped), states[0])
            except NotConverged:
                skipped += 1
                if skipped > 2:
                    if states[0].load > self.last / 100:
                        raise
                    break
            else:
                still = is_still(state, states[0])
                skipped = 0
                states.insert(0, state)
        return states

    def _coarse(self, load: float, near: PanelSolution | None = None) -> PanelSolution:
        """Returns the state at a load on panels that see an event; raises NotConverged if it violates the
        contact conditions.
        """
        state: PanelSolution = self._solver.solution_at(load, order=EVENT_ORDERS[0], near=near)
        violation = state.estimate.conditions
        if violation > SCAN_TOLERANCE:
            raise NotConverged(f"zones at load {load:g} violate the contact conditions by {violation:.1e}")
        return state

    @property
    def first(self) -> float:
        """Load from which zones are followed; see `LoadPath`."""
        return float(self._followed[0])

    @cached_property
    def events(self) -> list[Event]:
        return self._followed[1]

    @property
    def warnings(self) -> list[str]:
        return self._followed[2]

    @cached_property
    @following
    def _followed(self) -> tuple[float, list[Event], list[str]]:
        """(first load, events, warnings) of panels, or of uniform cells where panels fail."""
        try:
            events = births(self._scan[0])
            kept(events)
            for low, high in pairwise(self._scan):
                counted(load=low.load)
                events += self._between(low, high)
        except NotConverged as failure:
            if self.problem.method is not None:
                raise
            path = self.problem.with_(method=Cells()).path(self.last)
            words = f"events of uniform cells instead of panels ({failure})"
            return path.first, list(path.events), [words, *path.warnings]
        return self._scan[0].load, sorted(events, key=lambda event: event.load), []

    def _between(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events between two states."""
        corners = high.problem.corners
        computed = [change for change in changes(low, high, corner_zones) if change[0] in corners]
        try:
            if not computed and not hides_events(low, high):
                return self._passings(low, high)
            if computed and (sides := self._sides(low, high, computed)):
                before, after, error = sides
                events = events_between(before, after, before.load, error)
                return [*self._between(low, before), *events, *self._between(after, high)]
        except NotConverged:  # of no topology as far as that: states in between have nearer zones
            pass
        half = (high.load - low.load) / 2
        try:
            if half > RESOLUTION * high.load:
                near = low if low.iterations else high
                middle = self._coarse(float(np.sqrt(low.load * high.load)), near)
                return [*self._between(low, middle), *self._between(middle, high)]
        except NotConverged:  # the two are all that is known
            pass
        # no topology leads to it, as at an end of a punch
        return events_between(low, high, low.load + half, half + self._missed(low, high))

    def _missed(self, low: PanelSolution, high: PanelSolution) -> float:
        """Returns how far (force per thickness) from two coarse states those to rtol agree with them in the
        zones that change; the whole load where they do not.
        """
        names = {name for name, *_ in changes(low, high, named_zones)}
        rtol = self.rtol and float(self.rtol)  # asked for, not `Usual`

        def agrees(coarse: PanelSolution, load: float) -> bool:
            try:
                fine = named_zones(self._solver.solution_at(load, rtol))
            except NotConverged:
                return False
            return all(len(named_zones(coarse)[name]) == len(fine[name]) for name in names)

        for fraction in FRACTIONS_IN_DOUBT:
            if agrees(low, (1 - fraction) * low.load) and agrees(
                high, min((1 + fraction) * high.load, self.last)
            ):
                return fraction * high.load
        return high.load

    def _sides(
        self, low: PanelSolution, high: PanelSolution, computed: Sequence[Change]
    ) -> tuple[PanelSolution, PanelSolution, float] | None:
        """Returns the states before and after the only change between two, at its load, and the error of
        that; None if there are several. Two that mirror each other are one.
        """
        kind = computed[0][1]
        if len(computed) > 1:
            asymmetry = abs(sum(x for _, _, x in computed))
            if len(computed) > 2 or computed[1][1] != kind or asymmetry >= SCAN_TOLERANCE * width_of(high):
                return None
        touches = kind in ("born", "vanished")
        grows = kind in ("born", "split")
        fewer, more = (low, high) if grows else (high, low)
        branch = Branch(high.problem, {fewer.load: fewer})
        roots = []
        for corner, _, x in computed:
            span = span_of(more, corner, x, touches)
            measure = partial(least_in_span, corner=corner, touches=touches, span=span)
            roots.append(EventSearch(branch, low.load, high.load, measure).root())
        load = max(roots).load
        disagreement = load - min(roots).load
        if disagreement > RESOLUTION * load:
            return None
        state = replace(branch.continued(load, EVENT_ORDERS[0]), iterations=0)  # of an event, no fit
        half = EDGE_TOLERANCE * width_of(state)
        zones = dict(state.zones)
        for (corner, *_), root in zip(computed, roots):
            tiny = (root.x - half, root.x + half)
            zones[corner] = tuple(sorted([*without(zones[corner], *tiny), *([tiny] if touches else [])]))
        changed = replace(state, zones=dict(state.problem.computed(zones)))
        error = max(roots).error + disagreement
        return (state, changed, error) if grows else (changed, state, error)

    def _passings(self, low: PanelSolution, high: PanelSolution) -> list[Event]:
        """Returns events at which edges of the two corners pass each other."""
        counts = [range(len(zones)) for zones in corner_zones(low).values()]
        events: list[Event] = []
        if len(counts) != 2:
            return events
        branch = Branch(high.problem, {state.load: state for state in (low, high) if state.iterations})
        for pair in product(*counts):
            gap, _ = passing_gap(low, pair)
            if gap * passing_gap(high, pair)[0] < 0:
                measure = partial(passing_gap, pair=pair)
                ends = {state.load: measure(state)[0] for state in (low, high) if not state.iterations}
                root = EventSearch(branch, low.load, high.load, measure, ends).root()
                full, contact = ("born", "merged") if gap > 0 else ("vanished", "split")
                events.append(Event(root.load, root.error, full, "full", root.x))
                events.append(Event(root.load, root.error, contact, "contact", root.x))
        return events
