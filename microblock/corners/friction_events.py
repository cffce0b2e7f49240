"""Events of a history of frictional contact: first and full slip, reversals, stick zones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from ..model.events import Event
from ..model.history import SLIDING
from ..model.types import Array, Flags
from ..model.zones import runs
from .follower import Change


def legs(pairs: Array, friction: float) -> Iterator[tuple[Array, Array, bool, bool]]:
    """Yields pairs (P, Q) at the ends of a leg, whether shear turns at the first, and full slip begins at the
    second.
    """
    direction = 0.0
    for before, after in pairwise(np.vstack(((0.0, 0.0), pairs))):
        change = after[1] - before[1]
        limits = [abs(Q) >= friction * P * (1 - SLIDING) for P, Q in (before, after)]
        goes_on = limits[0] and before[0] and before[1] * after[1] > 0
        yield before, after, change * direction < 0, bool(limits[1] and not goes_on)
        direction = change or direction


def events(changes: Sequence[Change], friction: float, edges: Array, pairs: Array) -> list[Event]:
    """Returns the events on cells with edges, array (n, 2), in order."""
    nodes = [one for one in changes if one.kind in ("stick", "slip", "leave")]
    # where corners have tangential forces of their own, each counts
    each = np.zeros((2, 1 + max((one.index for one in nodes), default=0) // len(edges), len(edges)), bool)
    x, found, zones, slipped = edges.mean(axis=1), list[Event](), list[Flags](), False
    stick = slip = each[0, 0]
    for leg, (before, after, turns, slides) in enumerate(legs(pairs, friction)):

        def note(share: float, kind: str, zone: str, where: Any) -> None:
            P, Q = before + share * (after - before)
            found.append(Event(P, None, kind, zone, x[where].mean(), Q, leg))

        if turns and slip.any():
            note(0.0, "reversal", "slip", slip)
        own = [one for one in nodes if one.leg == leg]
        for share, group in groupby(own, key=lambda one: round(one.share, 9)):
            for one in group:
                corner, cell = divmod(one.index, len(x))
                each[:, corner, cell] = one.kind == "stick", one.kind == "slip"
            stick = np.asarray(each[0].any(axis=0))
            slip = each[1].any(axis=0) & ~stick
            if not slipped and slip.any():
                slipped = True
                note(share, "first slip", "slip", np.flatnonzero(slip)[:1])
            for zone in [zone for zone in zones if not (zone & stick).any()]:
                note(share, "vanished", "stick", zone)
            parts = list(_parts(stick, stick | slip, edges, zones))
            for part in parts:
                if not any((part & zone).any() for zone in zones):
                    note(share, "born", "stick", part)
            zones = parts
        if slides:
            note(1.0, "full slip", "slip", stick if stick.any() else slip)
            zones = []
    return found


def _parts(stick: Flags, touching: Flags, edges: Array, zones: list[Flags]) -> Iterator[Flags]:
    extent = np.ptp(edges[touching]) if touching.any() else 0.0
    for first, last in runs(stick):
        part = np.zeros(len(stick), bool)
        part[first : last + 1] = True
        wide = last - first > 4 and edges[last, 1] - edges[first, 0] >= 0.05 * extent
        if wide or any((part & zone).any() for zone in zones):
            yield part
