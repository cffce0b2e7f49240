"""Edges of contact, of each corner's zones and of stick below the length of a cell.

Towards an edge of a corner's zone its pressure p falls like the root of the distance r; so does f p - |q| in
a stick zone that shrinks, and like r^(3/2) in one that grows. Means over cells of such powers are fitted to
the cells next to the edge (docs/theory/friction.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..model.types import Array, Flags, Interval, Zones
from ..model.zones import common, contact_zones, runs, without

SKIPPED = 2  # cells at the edge that are not fitted to
WINDOWS = ((6, 2, 5e-2), (16, 3, 2e-2))  # cells, powers, and residual at most, relative to each value
STEEP = 0.85, 1.15  # d log y/d log r, below which the first power is 1/2, and above which it is 3/2


def beyond(cells: Array, values: Array, grows: bool) -> tuple[float, float] | None:
    """Returns (how far beyond the near end of the first cell values vanish, the doubt about it), or None.

    Parameters
    ----------
    cells : array (n, 2), near and far ends (lengths)
    values : array (n,), means over the cells
    grows : bool, whether values may also fall like the root's third power
    """
    few = slice(SKIPPED, SKIPPED + WINDOWS[0][0])
    if len(values[few]) < WINDOWS[0][0] or not np.all(values[few] > 0):
        return None
    slope = np.polyfit(np.log(cells[few].mean(axis=1)), np.log(values[few]), 1)[0]
    if STEEP[0] < slope and not (grows and slope > STEEP[1]):
        return None
    power, found = 0.5 if slope < STEEP[0] else 1.5, []
    for count, terms, residual in WINDOWS:
        own, y = cells[SKIPPED : SKIPPED + count], values[SKIPPED : SKIPPED + count]
        if len(own) == count and np.all(y > 0):
            shift, left = _fitted(own, y, power, terms)
            if left <= residual:
                found.append(shift)
    width = float(np.ptp(cells[0]))
    if not found or np.ptp(found) > width / 4 or abs(found[-1]) > width:
        return None
    # fits may agree and be off together
    return found[-1], width / 8 + float(np.ptp(found)) if len(found) > 1 else width


def _fitted(cells: Array, values: Array, power: float, terms: int) -> tuple[float, float]:
    """(shift, relative residual) of a sum of powers of the distance + shift."""
    unit = cells[-1, 1]
    near, far = cells.T / unit
    powers, shift = power + np.arange(terms)[:, None], 0.0
    for _ in range(20):  # Gauss and Newton
        a, b = near + shift, far + shift
        if not 0 < a[0] < 2:
            break
        means = (b ** (powers + 1) - a ** (powers + 1)) / (powers + 1) / (b - a) / values
        share = np.linalg.lstsq(means.T, np.ones(len(values)), rcond=None)[0]
        left = 1 - share @ means
        slopes = share @ (b**powers - a**powers) / (b - a) / values
        step = np.linalg.lstsq(np.vstack((means, slopes)).T, left, rcond=None)[0][-1]
        shift += step
        if abs(step) < 1e-4 * (far[0] - near[0]):
            return float(shift * unit), float(np.sqrt(np.mean(left**2)))
    return np.inf, np.inf


@dataclass(frozen=True, eq=False)
class FrictionEdges:
    """A frictional contact on cells, whose zones end where fits say.

    Attributes
    ----------
    cells : array (n, 2), left and right edges (lengths)
    closed, pressures : arrays (corners, n)
    stick, shear : arrays (n,), cells that stick and are not at the limit, q
    friction : float
    fixed : sequence of float, edges and slope discontinuities of the obstacle
    doubts : dict, doubt about each edge of `zones` (length)
    """

    cells: Array
    closed: Flags
    stick: Flags
    pressures: Array
    shear: Array
    friction: float
    fixed: Sequence[float]
    doubts: dict[float, float] = field(default_factory=dict)

    def zones(self, corners: Sequence[str]) -> Zones:
        """Returns zones of the corners, "contact", "full", "stick" and "slip"."""
        own: dict[int, list[Interval]] = {}
        for number, (closed, pressure) in enumerate(zip(self.closed, self.pressures)):
            own[number] = [
                (self._edge(run, -1, ~closed, pressure), self._edge(run, 1, ~closed, pressure))
                for run in self._runs(closed)
            ]
        found = contact_zones(own, corners)
        runs_of_stick = self._runs(self.stick)
        ends = [(self._stick_edge(run, -1, found), self._stick_edge(run, 1, found)) for run in runs_of_stick]
        stick = [pair for run, pair in zip(runs_of_stick, ends) if self._is_zone(run)]
        found["stick"] = common(stick, found["contact"])
        slip = found["contact"]
        for left, right in found["stick"]:
            slip = without(slip, left, right)
        return {**found, "slip": slip}

    def _runs(self, inside: Flags) -> list[tuple[int, int]]:
        found: list[tuple[int, int]] = []
        for first, last in runs(inside):
            cuts = np.flatnonzero(self.cells[first + 1 : last + 1, 0] > self.cells[first:last, 1]) + first
            found += zip([first, *(cuts + 1).tolist()], [*cuts.tolist(), last])
        return found

    def _is_zone(self, run: tuple[int, int]) -> bool:
        """Whether a run of sticking cells is a zone: a few next to their limit stick for the sake of
        the sum.
        """
        (first, last), touching = run, np.flatnonzero(self.closed.any(axis=0))
        bound = self.friction * self.pressures.sum(axis=0)[first : last + 1]
        left = bound - np.abs(self.shear[first : last + 1])
        sides = self.shear[touching[touching < first][-1:]], self.shear[touching[touching > last][:1]]
        turns = all(map(len, sides)) and sides[0][0] * sides[1][0] < 0
        # the cells of levels that do not sum up to the shear force are 1e-3 off
        return last - first > 4 or not (turns or left.max() < 1e-2 * bound.max())

    def _stick_edge(self, run: tuple[int, int], side: int, zones: Zones) -> float:
        touching, beside = np.asarray(self.closed.any(axis=0)), run[side > 0] + side
        if 0 <= beside < len(touching) and touching[beside]:
            bound = self.friction * self.pressures.sum(axis=0)
            left = bound - np.sign(self.shear[beside]) * self.shear
            return self._edge(run, side, touching & ~self.stick, left, grows=True)
        ends, own = [end for pair in zones["contact"] for end in pair], self._end(run, side)
        return min(ends, key=lambda end: abs(end - own))

    def _end(self, run: tuple[int, int], side: int) -> float:
        return float(self.cells[run[1], 1] if side > 0 else self.cells[run[0], 0])

    def _edge(
        self, run: tuple[int, int], side: int, outside: Flags, values: Array, grows: bool = False
    ) -> float:
        """The left (side = -1) or right end (1) of a run of cells, beyond which cells are `outside`."""
        (first, last), end = run, self._end(run, side)
        order = np.arange(last, first - 1, -1) if side > 0 else np.arange(first, last + 1)
        beside = order[0] + side * np.arange(1, 4)
        width = float(np.ptp(self.cells[order[0]]))
        at_obstacle = any(abs(end - each) <= 1e-9 * max(abs(end), width) for each in self.fixed)
        shift, doubt = 0.0, 0.0 if at_obstacle else width
        if not at_obstacle and beside.min() >= 0 and beside.max() < len(outside) and outside[beside].all():
            distances = np.sort(side * (end - self.cells[order]), axis=1)
            shift, doubt = beyond(distances, values[order], grows) or (0.0, width)
        self.doubts[end + side * shift] = doubt
        return end + side * shift
