"""Where a height that comes as a mere function is less than smooth: intervals that a polynomial does not follow are halved.

A polynomial of degree NODES - 1 follows a smooth function on intervals that are short enough, but one with a singular point
on none that has it inside. What is seen ends where the change of the height over the interval is rounding beside the height.
"""

import numpy as np
from numpy.polynomial.chebyshev import chebpts2, chebval, chebvander

NODES = 14
START = 8            # intervals to begin with
FOLLOWED = 1e-8      # of the change over the interval: error of a polynomial that follows
ROUNDING = 1e-14     # of the height
SHORTEST = 1e-10     # interval that is halved, over all
NEXT = 1e-3          # of an interval: neighbourhood of its middle
MOST = 12            # unsmooth intervals at a time: a height with more is rough, and none are named
LOST = 1e-5          # interval of which no part is unsmooth any more, over all: rounding hides the rest
KINK = 0.9           # a jump of the slope that shrinks by more on a hundredth of the way is none

_points = chebpts2(NODES)
_between = (_points[1:] + _points[:-1])/2
_coefficients = np.linalg.inv(chebvander(_points, NODES - 1))


def kinks(height, left, right):
    """Singular points of a height in an interval, ascending, and the jumps of its slope there: ((x, ...), (jump, ...)).

    Parameters
    ----------
    height : callable of an array of x1 (length), finite in the interval
    left, right : float
    """
    whole, edges, found = right - left, np.linspace(left, right, START + 1), []
    intervals = [*zip(edges, edges[1:]), *((edge - NEXT*whole, edge + NEXT*whole) for edge in edges[1:-1])]
    unsmooth = [pair for pair in intervals if not _followed(height, *pair)]
    while unsmooth:
        if len(unsmooth) > MOST:
            return (), ()
        larger, unsmooth = unsmooth, []
        for a, b in larger:
            middle, near = (a + b)/2, NEXT*(b - a)
            # what lies around the middle lies in both halves as well
            parts = [pair for pair in ((middle - near, middle + near),) if not _followed(height, *pair)]
            parts = parts or [pair for pair in ((a, middle), (middle, b)) if not _followed(height, *pair)]
            if b - a <= SHORTEST*whole or not parts and b - a < LOST*whole:
                found.append((middle, b - a))
            else:
                unsmooth += parts
    places = _apart(sorted(found), LOST*whole)
    return tuple(places), tuple(_jump(height, place, whole/START) for place in places)


def _followed(height, a, b):
    """Whether a polynomial follows the height on an interval, as far as rounding lets that be seen."""
    x = (a + b)/2 + (b - a)/2*np.concatenate((_points, _between))
    values = np.asarray(height(x), float)
    if not np.all(np.isfinite(values)):
        return True      # where there is no obstacle nothing is to be followed
    nodes, between = np.split(values, [NODES])
    error = np.abs(chebval(_between, _coefficients @ nodes) - between).max()
    return error <= FOLLOWED*np.ptp(values) + ROUNDING*np.abs(values).max()


def _apart(found, least):
    """Of each cluster of (place, interval) the place that is known best."""
    clusters = []
    for entry in found:
        if clusters and entry[0] - clusters[-1][-1][0] <= least:
            clusters[-1].append(entry)
        else:
            clusters.append([entry])
    return [float(min(cluster, key=lambda entry: entry[1])[0]) for cluster in clusters]


def _jump(height, place, width):
    """Jump of the slope at a place, from differences beside it; 0 if it shrinks with the way that these look at."""
    def seen(step):
        farther, far, near, nearer = np.asarray(height(place + step*np.array((-2.0, -1.0, 1.0, 2.0))), float)
        return (nearer - near - far + farther)/step

    first, second, half = map(seen, width*np.array((1e-2, 1e-4, 5e-5)))
    return float(2*half - second) if abs(second) > KINK*abs(first) else 0.0
