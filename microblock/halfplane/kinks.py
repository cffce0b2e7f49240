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
from ..model.types import Array, Integers

REACH = 8  # cells, beyond which D and what a polygon misses of a logarithm are below a hundredth


def corrections(kinks: Array, jumps: Array, count: int) -> Array:
    """Returns what initial gaps on so many cells have in addition, over the width of a cell, array (count,),
    for jumps of the slope, arrays (k,).
    """
    row, kink = _pairs(kinks, np.arange(count))
    nearest = np.rint(kinks)
    beside = (kinks - nearest)[kink]
    table = _discrete_errors()
    # D of the mirror image is the mirror image of D
    cells = np.where(beside < 0, -1, 1) * (row - nearest[kink])
    places = np.array((abs(beside) * 2 * (len(table) - 1), cells + REACH))
    values = map_coordinates(table, places, order=1, mode="nearest")
    return np.asarray(np.bincount(row, values * jumps[kink], minlength=count), float)


def logarithms(kinks: Array, sizes: Array, cells: Integers, along: Array | None = None) -> Array:
    """Returns the sum over kinks, arrays (k,), of ``size log(1/|x - kink|)`` less a parabola that ends it
    smoothly at REACH, at places `along` in the numbered cells, or the mean over each cell: arrays (n,).
    """
    row, kink = _pairs(kinks, cells)
    if along is None:
        left = np.clip((cells[row] - 0.5 - kinks[kink]) / REACH, -1, 1)
        right = np.clip((cells[row] + 0.5 - kinks[kink]) / REACH, -1, 1)
        values = REACH * (_antiderivative(right) - _antiderivative(left))
    else:
        t = np.clip(abs(along[row] - kinks[kink]) / REACH, 1e-13, 1)
        values = -np.log(t) - (1 - t**2) / 2
    return np.asarray(np.bincount(row, values * sizes[kink], minlength=len(cells)), float)


def _antiderivative(t: Array) -> Array:
    """Returns the integral of ``-log|t| - (1 - t^2)/2`` from 0."""
    return t * (0.5 - np.log(np.maximum(abs(t), 1e-300))) + t**3 / 6


def _pairs(kinks: Array, cells: Integers) -> tuple[Integers, Integers]:
    """Returns indices into cells and kinks of all that are up to REACH apart, and a cell more."""
    first = np.searchsorted(kinks, cells - (REACH + 1))
    last = np.searchsorted(kinks, cells + REACH + 1)
    row = np.repeat(np.arange(len(cells)), last - first)
    return row, np.arange(len(row)) - np.repeat(np.cumsum(last - first) - last, last - first)


def _mean_logarithm(distance: Array) -> Array:
    """Returns the mean of log(1/|x|) over cells at distances."""
    left = distance - 0.5
    right = distance + 0.5
    left = left * np.log(np.maximum(abs(left), 1e-300)) - left
    return left - (right * np.log(np.maximum(abs(right), 1e-300)) - right)


@lru_cache(maxsize=1)
def _discrete_errors() -> Array:
    """D at REACH cells on either side of a kink, at distances 0 to 1/2 from the nearest centre: array (17,
    2 REACH + 1).

    It is the convolution of log(1/|x|)/pi with itself less that of the means over cells.
    """
    cells = np.arange(-REACH, REACH + 1)
    most = 3 * REACH
    points, gauss = gauss_rule(40)
    sides = points**4 + (1 - points) ** 4  # x = u^4/(u^4 + (1 - u)^4) flattens logarithms at both ends
    weights = gauss * 4 * (points * (1 - points)) ** 3 / sides**2
    points = points**4 / sides
    wide = np.arange(-most, most + 1.0)
    table = []
    for kink in np.linspace(0, 0.5, 17):
        edges = np.union1d(np.arange(-2 * most - 1, 2 * most + 2) / 2, kink)
        x = (edges[:-1, None] + np.diff(edges)[:, None] * points).ravel()
        rule = (np.diff(edges)[:, None] * weights).ravel() * np.log(abs(x - kink))
        exact = np.log(abs(cells[:, None] - x)) @ rule
        discrete = _mean_logarithm(cells[:, None] - wide) @ _mean_logarithm(wide - kink)
        error = exact - discrete
        table.append(error - (error[0] + error[-1]) / 2)
    return np.array(table) / np.pi**2
