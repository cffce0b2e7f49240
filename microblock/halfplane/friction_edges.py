"""Edges of contact, of zones and of stick below the length of a cell (docs/theory/friction.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.types import Array, Flags, Zones
from ..model.zones import common, contact_zones, runs, without

WINDOWS = ((6, 2, 5e-2), (16, 3, 2e-2))  # cells, powers, and residual at most, relative to each value


def beyond(cells: Array, values: Array, grows: bool) -> tuple[float, float] | None:
    """Returns (how far beyond the first cell values vanish, the doubt about it), or None.

    Parameters
    ----------
    cells : array (n, 2), near and far ends (lengths)
    values : array (n,), means over the cells
    grows : bool, whether values may fall like r^(3/2)
    """
    width, cells, y, found = float(np.ptp(cells[0])), cells[2:], values[2:], []  # the first two are off
    few = slice(WINDOWS[0][0])
    if len(y[few]) < WINDOWS[0][0] or not np.all(y[few] > 0):
        return None
    slope = np.polyfit(np.log(cells[few].mean(axis=1)), np.log(y[few]), 1)[0]
    if slope > 0.85 and not (grows and slope > 1.15):  # neither 1/2 nor 3/2
        return None
    for count, terms, residual in WINDOWS:
        if len(y) >= count and np.all(y[:count] > 0):
            powers = np.arange(terms, dtype=float) + (0.5 if slope < 1 else 1.5)
            shift, left = _fitted(cells[:count], y[:count], powers, width)
            if left <= residual:
                found.append(shift)
    if not found or np.ptp(found) > width / 4 or abs(found[-1]) > 0.99 * width:
        return None
    # fits may agree and be off together
    return found[-1], width / 8 + float(np.ptp(found)) if len(found) > 1 else width


def _fitted(cells: Array, values: Array, powers: Array, most: float) -> tuple[float, float]:
    """(shift, up to `most`, and relative residual) of powers of the distance + shift."""
    from scipy.optimize import minimize_scalar  # here: half a second that most states do without

    def residual(shift: float) -> float:
        near, far = (cells.T + shift)[:, :, None] / cells[-1, 1]
        means = (far ** (powers + 1) - near ** (powers + 1)) / (powers + 1) / (far - near) / values[:, None]
        left = 1 - means @ np.linalg.lstsq(means, np.ones(len(values)), rcond=None)[0]
        return float(np.sqrt(np.mean(left**2)))

    best = minimize_scalar(residual, bounds=(-most, most), method="bounded", options={"xatol": 1e-9 * most})
    return float(best.x), float(best.fun)


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
    doubts: dict[float, float] = {}
    touching = np.asarray(closed.any(axis=0))

    def edge(run: tuple[int, int], side: int, outside: Flags, values: Array, grows: bool = False) -> float:
        order = np.arange(run[0], run[1] + 1)[::-side]
        end, width = float(cells[order[0], (side + 1) // 2]), float(np.ptp(cells[order[0]]))
        beside = order[0] + side * np.arange(1, 4)
        shift, doubt = 0.0, width
        if any(abs(end - each) <= 1e-9 * max(abs(end), width) for each in fixed):
            doubt = 0.0
        elif beside.min() >= 0 and beside.max() < len(outside) and outside[beside].all():
            distances = np.sort(np.abs(end - cells[order]), axis=1)
            shift, doubt = beyond(distances, values[order], grows) or (0.0, width)
        doubts[end + side * shift] = doubt
        return end + side * shift

    def edge_of_stick(run: tuple[int, int], side: int) -> float:
        beside = run[side > 0] + side
        if 0 <= beside < len(touching) and touching[beside]:
            left = bound - np.sign(shear[beside]) * shear
            return edge(run, side, touching & ~stick, left, grows=True)
        end = cells[run[side > 0], (side + 1) // 2]
        return min(np.ravel(found["contact"]).tolist(), key=lambda own: abs(own - end))

    own = {
        corner: [(edge(run, -1, ~flags, p), edge(run, 1, ~flags, p)) for run in _runs(cells, flags)]
        for corner, (flags, p) in enumerate(zip(closed, pressures))
    }
    found = contact_zones(own, corners)
    inner = [
        (run, (edge_of_stick(run, -1), edge_of_stick(run, 1)))  # all of them for their doubts
        for run in _runs(cells, stick)
    ]
    zones = [pair for run, pair in inner if _is_zone(run, bound, shear)]
    found["stick"], found["slip"] = common(zones, found["contact"]), found["contact"]
    for left, right in found["stick"]:
        found["slip"] = without(found["slip"], left, right)
    return found, doubts


def _runs(cells: Array, inside: Flags) -> list[tuple[int, int]]:
    gaps = np.flatnonzero(cells[1:, 0] > cells[:-1, 1])
    pieces = zip([0, *(gaps + 1).tolist()], [*(gaps + 1).tolist(), len(cells)])
    return [(a + first, a + last) for a, b in pieces for first, last in runs(inside[a:b])]


def _is_zone(run: tuple[int, int], bound: Array, shear: Array) -> bool:
    """Whether sticking cells are more than a few at the limit."""
    first, last = run
    limit, sides = bound[first : last + 1], np.pad(shear, 1)
    left = limit - np.abs(shear[first : last + 1])
    # the cells of levels that do not sum up to the shear force are 1e-3 off
    return last - first > 4 or not (sides[first] * sides[last + 2] < 0 or left.max() < 1e-2 * limit.max())
