"""Slope discontinuities of the obstacle on uniform cells.

Under a jump J of the slope the pressure is ``K log(1/|x|)`` and something smoother. Cells of mean pressure
leave there a gap J h D off from that of the pressure itself, in the width h of a cell, with a function D of
the place in the cell alone, whatever the solid: short waves of all kernels are alike. Initial gaps have J h D
in addition (`corrections`), and pressures between the centres the logarithms (`logarithms`). Places of kinks
are in cells, 0 at the first centre, ascending.
"""

from functools import lru_cache

import numpy as np
from scipy.ndimage import map_coordinates

from ..model.quadrature import gauss_rule

REACH = 8  # cells, beyond which D and what a polygon misses of a logarithm are below a hundredth


def corrections(kinks, jumps, count):
    """What initial gaps on so many cells have in addition, over the width of a cell, array (count,)."""
    row, kink = _pairs(kinks, np.arange(count))
    nearest = np.rint(kinks)
    beside, table = (kinks - nearest)[kink], _errors()
    # D of the mirror image is the mirror image of D
    way = np.where(beside < 0, -1, 1) * (row - nearest[kink])
    values = map_coordinates(
        table, (abs(beside) * 2 * (len(table) - 1), way + REACH), order=1, mode="nearest"
    )
    return np.bincount(row, values * jumps[kink], minlength=count)


def logarithms(kinks, sizes, cells, along=None):
    """Sum over kinks of ``size log(1/|x - kink|)`` less a parabola that ends it smoothly at REACH, at places
    in the numbered cells, or the mean over each cell: array like cells.
    """
    row, kink = _pairs(kinks, cells)
    if along is None:
        left, right = (np.clip((cells[row] + side - kinks[kink]) / REACH, -1, 1) for side in (-0.5, 0.5))
        low, high = (t * (0.5 - np.log(np.maximum(abs(t), 1e-300))) + t**3 / 6 for t in (left, right))
        values = REACH * (high - low)
    else:
        t = np.clip(abs(along[row] - kinks[kink]) / REACH, 1e-13, 1)
        values = -np.log(t) - (1 - t**2) / 2
    return np.bincount(row, values * sizes[kink], minlength=len(cells))


def _pairs(kinks, cells):
    """Indices into cells and kinks of all that are up to REACH apart, and a cell more."""
    first, last = (np.searchsorted(kinks, cells + way * (REACH + 1)) for way in (-1, 1))
    row = np.repeat(np.arange(len(cells)), last - first)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(last - first) - last, last - first)


def _mean(away):
    """The mean of log(1/|x|) over cells about places."""
    left, right = ((end * np.log(np.maximum(abs(end), 1e-300)) - end) for end in (away - 0.5, away + 0.5))
    return left - right


@lru_cache(maxsize=1)
def _errors():
    """D at REACH cells on either side of a kink, at distances 0 to 1/2 from the nearest centre: array (17,
    2 REACH + 1).

    It is the convolution of log(1/|x|)/pi with itself less that of the means over cells.
    """
    away, cells, most = np.linspace(0, 0.5, 17), np.arange(-REACH, REACH + 1), 3 * REACH
    points, gauss = gauss_rule(40)
    sides = points**4 + (1 - points) ** 4  # x = u^4/(u^4 + (1 - u)^4) flattens logarithms at both ends
    weights, points = gauss * 4 * (points * (1 - points)) ** 3 / sides**2, points**4 / sides
    found, whole = [], np.arange(-most, most + 1)
    for kink in away:
        edges = np.union1d(np.arange(-2 * most - 1, 2 * most + 2) / 2, kink)
        x = (edges[:-1, None] + np.diff(edges)[:, None] * points).ravel()
        rule = (np.diff(edges)[:, None] * weights).ravel() * np.log(abs(x - kink))
        exact = np.log(abs(cells[:, None] - x)) @ rule
        own = exact - _mean(cells[:, None] - whole) @ _mean(whole - kink)
        found.append(own - (own[0] + own[-1]) / 2)
    return np.array(found) / np.pi**2
