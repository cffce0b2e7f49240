"""What happens along a history of frictional contact on cells: first and full slip, births and deaths of
stick zones.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from ..corners.follower import Change
from ..model.events import Event
from ..model.history import SLIDING
from ..model.types import Array, Flags
from ..model.zones import runs

SAME = 1e-9  # shares of a leg that are one
NODES = "stick", "slip", "leave"


def events(changes: Sequence[Change], friction: float, edges: Array, pairs: Array) -> list[Event]:
    """Returns the events on cells, edges of which are an array (n, 2), in order."""
    return _Story(changes, friction, edges, np.concatenate(([[0.0, 0.0]], pairs))).told()


class _Story:
    def __init__(self, changes: Sequence[Change], friction: float, edges: Array, pairs: Array) -> None:
        self.changes, self.friction, self.edges, self.pairs = changes, friction, edges, pairs
        self.x = edges.mean(axis=1)
        # where corners have tangential forces of their own, each counts
        last = max((one.index for one in changes if one.kind in NODES), default=0)
        self.each = np.zeros((2, 1 + last // len(edges), len(edges)), bool)
        self.stick: Flags = self.each[0].any(axis=0)
        self.slip: Flags = self.stick
        self.zones: list[Flags] = []
        self.found: list[Event] = []
        self.slipped, self.direction = False, 0.0

    def told(self) -> list[Event]:
        for leg in range(len(self.pairs) - 1):
            self._turn(leg)
            own = [one for one in self.changes if one.leg == leg]
            for share, group in groupby(own, key=lambda one: round(one.share / SAME)):
                self._after(leg, share * SAME, list(group))
            self._end(leg)
        return self.found

    def _note(self, leg: int, share: float, kind: str, zone: str, x: float) -> None:
        P, Q = self.pairs[leg] + share * (self.pairs[leg + 1] - self.pairs[leg])
        self.found.append(Event(P, None, kind, zone, x, Q, leg))

    def _turn(self, leg: int) -> None:
        change = float(self.pairs[leg + 1, 1] - self.pairs[leg, 1])
        if change * self.direction < 0 and self.slip.any():
            self._note(leg, 0.0, "reversal", "slip", self.x[self.slip].mean())
        self.direction = change or self.direction

    def _after(self, leg: int, share: float, group: list[Change]) -> None:
        for one in group:
            if one.kind in NODES:
                corner, cell = divmod(one.index, len(self.x))
                self.each[:, corner, cell] = one.kind == "stick", one.kind == "slip"
        self.stick = np.asarray(self.each[0].any(axis=0))
        self.slip = self.each[1].any(axis=0) & ~self.stick
        if not self.slipped and self.slip.any():
            self.slipped = True
            self._note(leg, share, "first slip", "slip", self.x[self.slip][0])
        self._zones(leg, share)

    def _zones(self, leg: int, share: float) -> None:
        for zone in [each for each in self.zones if not (each & self.stick).any()]:
            self._note(leg, share, "vanished", "stick", self.x[zone].mean())
        parts = []
        for first, last in runs(self.stick):
            part = np.zeros(len(self.x), bool)
            part[first : last + 1] = True
            known = any((part & each).any() for each in self.zones)
            if not known and self._is_wide(first, last):
                self._note(leg, share, "born", "stick", self.x[part].mean())
            if known or self._is_wide(first, last):
                parts.append(part)
        self.zones = parts

    def _is_wide(self, first: int, last: int) -> bool:
        touching = np.flatnonzero(self.stick | self.slip)
        extent = self.edges[touching[-1], 1] - self.edges[touching[0], 0]
        width = self.edges[last, 1] - self.edges[first, 0]
        return bool(last - first > 4 and width >= 0.05 * extent)  # less may come and go with the cells

    def _end(self, leg: int) -> None:
        P, Q = self.pairs[leg + 1]
        limit = self.friction * P
        before = self.pairs[leg]
        was = abs(before[1]) >= self.friction * before[0] * (1 - SLIDING) and before[0] > 0
        if abs(Q) >= limit * (1 - SLIDING) and not (was and before[1] * Q > 0):
            x = self.x[self.stick].mean() if self.stick.any() else self.x[self.slip].mean()
            self._note(leg, 1.0, "full slip", "slip", x)
            self.zones = []
