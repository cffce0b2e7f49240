"""Edges of contact, of zones and of stick below the length of a cell (docs/theory/friction.md)."""

import numpy as np

from ..model.history import with_stick
from ..model.intervals import contact_zones, runs


def beyond(cells, values, grows):
    """Returns how far beyond the first cell values vanish, and the doubt about it; 0 and the length of that
    cell where the values do not tell.

    Parameters
    ----------
    cells : array (n, 2), near and far ends (lengths)
    values : array (n,), means over the cells
    grows : bool, whether values may fall like r^(3/2)
    """
    width, cells, y, found = float(np.ptp(cells[0])), cells[2:], values[2:], []  # the first two are off
    few, many = 6, 16
    positive = int(np.argmin(np.append(y > 0, False)))
    if positive < few:
        return 0.0, width
    slope = np.polyfit(np.log(cells[:few].mean(axis=1)), np.log(y[:few]), 1)[0]
    if slope > 0.85 and not (grows and slope > 1.15):  # neither 1/2 nor 3/2
        return 0.0, width
    # cells, powers, and residual at most, relative to each value
    for count, terms, most in ((few, 2, 5e-2), (many, 3, 2e-2)):
        if positive >= count:
            powers = np.arange(terms) + (0.5 if slope < 1 else 1.5)
            shift, left = _fitted(cells[:count], y[:count], powers, width)
            if left <= most:
                found.append(shift)
    if not found or np.ptp(found) > width / 4 or abs(found[-1]) > 0.99 * width:
        return 0.0, width
    # fits may agree and be off together
    return found[-1], width / 8 + float(np.ptp(found)) if len(found) > 1 else width


def _fitted(cells, values, powers, most):
    """(shift, up to `most`, and relative residual) of powers of the distance + shift, by Gauss-Newton."""
    shift, size = 0.0, cells[-1, 1]
    for _ in range(20):
        near, far = (cells.T + shift)[:, :, None] / size
        relative = (far - near) * values[:, None]
        means = (far ** (powers + 1) - near ** (powers + 1)) / (powers + 1) / relative
        weights = np.linalg.lstsq(means, np.ones(len(values)), rcond=None)[0]
        left, rates = 1 - means @ weights, (far**powers - near**powers) / relative @ weights
        step = size * np.linalg.lstsq(np.column_stack((means, rates)), left, rcond=None)[0][-1]
        shift = float(np.clip(shift + step, -most, most))
        if abs(step) <= 1e-12 * most:
            break
    return shift, float(np.sqrt(np.mean(left**2)))


def zones_on_cells(cells, closed, stick, pressures, bound, shear, fixed, corners):
    """Returns zones of the corners, "contact", "full", "stick" and "slip", and the doubt about each edge.

    Parameters
    ----------
    cells : array (n, 2), left and right edges (lengths)
    closed, pressures : arrays (corners, n)
    stick, bound, shear : arrays (n,), cells that stick below the limit, f p, and q
    fixed : edges and slope discontinuities of the obstacle
    corners : names of the corners
    """
    touching, doubts = np.append(closed.any(axis=0), False), {}

    def edge(run, side, outside, values, grows=False):
        order = np.arange(run[0], run[1] + 1)[::-side]
        end, width = float(cells[order[0], (side + 1) // 2]), float(np.ptp(cells[order[0]]))
        beside = order[0] + side * np.arange(1, 4)
        shift, doubt = 0.0, width
        if np.isclose(end, fixed, rtol=1e-9, atol=1e-9 * width).any():
            doubt = 0.0
        elif np.pad(outside, 3)[beside + 3].all():
            shift, doubt = beyond(np.sort(np.abs(end - cells[order]), axis=1), values[order], grows)
        doubts[end + side * shift] = doubt
        return end + side * shift

    def edge_of_stick(run, side):
        beside = run[side > 0] + side
        if touching[beside]:
            left = bound - np.sign(shear[beside]) * shear
            return edge(run, side, touching[:-1] & ~stick, left, grows=True)
        end, contact = cells[run[side > 0], (side + 1) // 2], np.ravel(found["contact"])
        return float(contact[np.argmin(np.abs(contact - end))])

    own = [
        [(edge(run, -1, ~flags, p), edge(run, 1, ~flags, p)) for run in _runs(cells, flags)]
        for flags, p in zip(closed, pressures)
    ]
    found = contact_zones(own, corners)
    both = [(edge_of_stick(run, -1), edge_of_stick(run, 1)) for run in _runs(cells, stick)]  # for all doubts
    zones = [pair for pair, run in zip(both, _runs(cells, stick)) if _is_zone(run, bound, shear)]
    return with_stick(found, zones), doubts


def _runs(cells, inside):
    pieces = np.split(np.arange(len(cells)), np.flatnonzero(cells[1:, 0] > cells[:-1, 1]) + 1)
    return [(piece[first], piece[last]) for piece in pieces for first, last in runs(inside[piece])]


def _is_zone(run, bound, shear):
    """Whether sticking cells are more than a few at the limit."""
    first, last = run
    limit, sides = bound[first : last + 1], np.pad(shear, 1)
    left = limit - np.abs(shear[first : last + 1])
    # the cells of levels that do not sum up to the shear force are 1e-3 off
    return last - first > 4 or not (sides[first] * sides[last + 2] < 0 or left.max() < 1e-2 * limit.max())
