"""Edges of contact, of zones and of stick below the length of a cell (docs/theory/friction.md)."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..model.history import with_stick
from ..model.intervals import contact_zones, runs
from ..model.refinement import FEWEST_GRADED
from ..model.types import Array, Flags, Zones

Run = tuple[int, int]  # first and last cell of several in a row


def edge_shift(cells: Array, values: Array, grows: bool) -> tuple[float, float]:
    """Returns how far beyond the first cell values vanish, and the doubt about it; 0 and the length of that
    cell where the values do not tell.

    Parameters
    ----------
    cells : array (n, 2), near and far ends (lengths)
    values : array (n,), means over the cells
    grows : bool, whether values may fall like r^(3/2)
    """
    width = float(np.ptp(cells[0]))
    cells = cells[2:]  # the first two are off
    values = values[2:]
    few, many = 6, 16
    positive = int(np.argmin(np.append(values > 0, False)))
    if positive < few:
        return 0.0, width
    slope = np.polyfit(np.log(cells[:few].mean(axis=1)), np.log(values[:few]), 1)[0]
    if slope > 0.85 and not (grows and slope > 1.15):  # neither 1/2 nor 3/2
        return 0.0, width
    first_power = 0.5 if slope < 1 else 1.5
    shifts = []
    # cells, powers, and residual at most, relative to each value
    for count, terms, most in ((few, 2, 5e-2), (many, 3, 2e-2)):
        if positive >= count:
            powers = first_power + np.arange(terms, dtype=float)
            shift, residual = _fitted_shift(cells[:count], values[:count], powers, width)
            if residual <= most:
                shifts.append(shift)
    if not shifts or np.ptp(shifts) > width / 4 or abs(shifts[-1]) > 0.99 * width:
        return 0.0, width
    if len(shifts) == 1:
        return shifts[0], width
    # fits may agree and be off together
    return shifts[-1], width / 8 + float(np.ptp(shifts))


def _fitted_shift(cells: Array, values: Array, powers: Array, most: float) -> tuple[float, float]:
    """Returns (shift, up to `most`, and relative residual) of powers of the distance + shift, by
    Gauss-Newton: arrays (n, 2), (n,), (terms,).
    """
    shift = 0.0
    size = cells[-1, 1]
    for _ in range(20):
        near, far = (cells.T + shift)[:, :, None] / size
        relative = (far - near) * values[:, None]
        means = (far ** (powers + 1) - near ** (powers + 1)) / (powers + 1) / relative
        weights = np.linalg.lstsq(means, np.ones(len(values)), rcond=None)[0]
        residual = 1 - means @ weights
        rates = (far**powers - near**powers) / relative @ weights
        step = size * np.linalg.lstsq(np.column_stack((means, rates)), residual, rcond=None)[0][-1]
        shift = float(np.clip(shift + step, -most, most))
        if abs(step) <= 1e-12 * most:
            break
    return shift, float(np.sqrt(np.mean(residual**2)))


@dataclass(frozen=True, eq=False)
class RunEdges:
    """Edges of runs of cells.

    Attributes
    ----------
    cells : array (n, 2), left and right edges (lengths)
    fixed : edges and slope discontinuities of the obstacle
    doubts : {edge: doubt} of all that were asked for
    """

    cells: Array
    fixed: Sequence[float]
    doubts: dict[float, float] = field(default_factory=dict)

    def runs(self, inside: Flags) -> list[Run]:
        """Returns runs of cells, array (n,), which gaps between cells interrupt."""
        pieces = np.split(
            np.arange(len(self.cells)), np.flatnonzero(self.cells[1:, 0] > self.cells[:-1, 1]) + 1
        )
        return [(piece[first], piece[last]) for piece in pieces for first, last in runs(inside[piece])]

    def end(self, run: Run, side: int) -> float:
        """Returns the end of the outermost cell on a side, -1 or 1."""
        return float(self.cells[run[side > 0], (side + 1) // 2])

    def edge(self, run: Run, side: int, outside: Flags, values: Array, grows: bool = False) -> float:
        """Returns where values, array (n,), vanish beyond a run; `outside`, array (n,), are cells without."""
        order = np.arange(run[0], run[1] + 1)[::-side]
        end = self.end(run, side)
        width = float(np.ptp(self.cells[order[0]]))
        beside = order[0] + side * np.arange(1, 4)
        shift = 0.0
        doubt = width
        if np.isclose(end, self.fixed, rtol=1e-9, atol=1e-9 * width).any():
            doubt = 0.0
        elif np.pad(outside, 3)[beside + 3].all():
            distances = np.sort(np.abs(end - self.cells[order]), axis=1)
            shift, doubt = edge_shift(distances, values[order], grows)
        edge = end + side * shift
        self.doubts[edge] = doubt
        return edge


def zones_on_cells(
    cells: Array,
    closed: Flags,
    stick: Flags,
    pressures: Array,
    bound: Array,
    shear: Array,
    fixed: Sequence[float],
    corners: Sequence[str],
) -> tuple[Zones, dict[float, float]]:
    """Returns zones of the corners, "contact", "full", "stick" and "slip", and the doubt about each edge.

    Parameters
    ----------
    cells : array (n, 2), left and right edges (lengths)
    closed, pressures : arrays (corners, n)
    stick, bound, shear : arrays (n,), cells that stick below the limit, f p, and q
    fixed : edges and slope discontinuities of the obstacle
    corners : names of the corners
    """
    edges = RunEdges(cells, fixed)
    by_corner = [
        [(edges.edge(run, -1, ~flags, p), edges.edge(run, 1, ~flags, p)) for run in edges.runs(flags)]
        for flags, p in zip(closed, pressures)
    ]
    zones = contact_zones(dict(enumerate(by_corner)), corners)
    contact = np.ravel(zones["contact"])
    touching = np.append(closed.any(axis=0), False)

    def edge_of_stick(run: Run, side: int) -> float:
        beside = run[side > 0] + side
        if touching[beside]:
            reserve = bound - np.sign(shear[beside]) * shear
            return edges.edge(run, side, touching[:-1] & ~stick, reserve, grows=True)
        return float(contact[np.argmin(np.abs(contact - edges.end(run, side)))])

    sticking = edges.runs(stick)
    stuck = [(edge_of_stick(run, -1), edge_of_stick(run, 1)) for run in sticking]  # for all doubts
    wide = [zone for zone, run in zip(stuck, sticking) if _is_zone(run, bound, shear)]
    return with_stick(zones, wide), edges.doubts


def _is_zone(run: Run, bound: Array, shear: Array) -> bool:
    """Returns whether sticking cells are more than a few at the limit."""
    first, last = run
    limit = bound[first : last + 1]
    reserve = limit - np.abs(shear[first : last + 1])
    sides = np.pad(shear, 1)
    # the cells of levels that do not sum up to the shear force are 1e-3 off
    at_limit = sides[first] * sides[last + 2] < 0 or reserve.max() < 1e-2 * limit.max()
    return last - first > FEWEST_GRADED or not at_limit
