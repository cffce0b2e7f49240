"""Events of a history of frictional contact: first and full slip, reversals, stick zones."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from ..model.events import Event
from ..model.history import SLIDING
from ..model.intervals import runs
from ..model.refinement import FEWEST_GRADED
from ..model.types import Array, Flags
from .event_driven import Change

Stretch = tuple[int, int]  # first and last cell


class Leg(NamedTuple):
    """A straight way between two pairs (P, Q); whether shear turns at its start, and full slip begins at its
    end.
    """

    number: int
    start: Array
    end: Array
    turns: bool
    slides: bool

    def event(self, fraction: float, kind: str, zone: str, x: Array) -> Event:
        """Returns an event at a fraction of the leg, in the middle of cells at x, array (k,)."""
        load, shear = self.start + fraction * (self.end - self.start)
        return Event(load, None, kind, zone, float(x.mean()), shear, self.number)


def legs(pairs: Array, friction: float) -> Iterator[Leg]:
    """Yields the Legs of pairs (P, Q), array (legs, 2), from no load on."""
    direction = 0.0
    for number, (start, end) in enumerate(pairwise(np.vstack(((0.0, 0.0), pairs)))):
        change = end[1] - start[1]
        slides_before, slides_after = (abs(Q) >= friction * P * (1 - SLIDING) for P, Q in (start, end))
        goes_on = slides_before and start[0] and start[1] * end[1] > 0
        yield Leg(number, start, end, change * direction < 0, bool(slides_after and not goes_on))
        direction = change or direction


class _ShearZones:
    """Cells that stick and that slip, flags (cells,), and the stick zones.

    Parameters
    ----------
    edges : array (cells, 2)
    nodes : number of tangential forces: several on a cell where corners have their own
    """

    def __init__(self, edges: Array, nodes: int) -> None:
        corners = -(-nodes // len(edges))
        self.edges = edges
        self.stick = np.zeros(len(edges), bool)
        self.slip = np.zeros(len(edges), bool)
        self.zones: list[Stretch] = []
        self._kinds = np.full((corners, len(edges)), "leave", dtype="<U5")

    def apply(self, changes: Iterable[Change]) -> None:
        for change in changes:
            self._kinds[divmod(change.index, len(self.edges))] = change.kind
        self.stick = (self._kinds == "stick").any(axis=0)
        self.slip = (self._kinds == "slip").any(axis=0) & ~self.stick

    def update_zones(self) -> Iterator[tuple[str, Stretch]]:
        """Yields the stick zones that vanish, then those that are born, as (kind, stretch)."""
        before = self.zones
        self.zones = [stretch for stretch in runs(self.stick) if self._is_zone(stretch)]
        for stretch in before:
            if not _overlaps_any(stretch, self.zones):
                yield "vanished", stretch
        for stretch in self.zones:
            if not _overlaps_any(stretch, before):
                yield "born", stretch

    def _is_zone(self, stretch: Stretch) -> bool:
        """Whether a stretch that sticks goes on from a zone, or is wide enough to be a new one."""
        if _overlaps_any(stretch, self.zones):
            return True
        first, last = stretch
        width = np.ptp(self.edges[first : last + 1])
        return bool(
            last - first > FEWEST_GRADED and width >= 0.05 * np.ptp(self.edges[self.stick | self.slip])
        )


def events(changes: Sequence[Change], friction: float, edges: Array, pairs: Array) -> list[Event]:
    """Returns the events on cells with edges, array (n, 2), in order, from changes of contact. On each leg
    come

    1. the reversal of slip,
    2. at each fraction with changes, the first slip, then stick zones that vanish and are born,
    3. full slip.
    """
    changes = [change for change in changes if change.kind in ("stick", "slip", "leave")]
    x = edges.mean(axis=1)
    cells = _ShearZones(edges, 1 + max((change.index for change in changes), default=0))
    history: list[Event] = []
    slipped = False
    for leg in legs(pairs, friction):
        if leg.turns and cells.slip.any():
            history.append(leg.event(0.0, "reversal", "slip", x[cells.slip]))
        on_leg = [change for change in changes if change.leg == leg.number]
        for fraction, step in groupby(on_leg, key=lambda change: round(change.fraction, 9)):
            cells.apply(step)
            if cells.slip.any() and not slipped:
                slipped = True
                history.append(leg.event(fraction, "first slip", "slip", x[cells.slip][:1]))
            for kind, (first, last) in cells.update_zones():
                history.append(leg.event(fraction, kind, "stick", x[first : last + 1]))
        if leg.slides:
            where: Flags = cells.stick if cells.stick.any() else cells.slip
            history.append(leg.event(1.0, "full slip", "slip", x[where]))
            cells.zones = []
    return history


def _overlaps_any(stretch: Stretch, zones: Iterable[Stretch]) -> bool:
    first, last = stretch
    return any(first <= right and left <= last for left, right in zones)
