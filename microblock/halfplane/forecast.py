"""What panels and cells are expected to take under an obstacle, from its ContactCandidates.

Panels are those of zones where the gap is no larger than the rise of a classical contact. On cells square
roots at edges leave a relative error like cell/zone, inverse roots at ends, and logarithms at peaks that no
one has named, one like the root of cell/contact.
"""

from dataclasses import replace

import numpy as np

from .. import cost
from ..model.contact_candidates import low
from ..model.intervals import runs
from ..model.obstacles import jumps_of
from .panels import make_panels, orders


def likely_zones(problem, candidates):
    """{corner: intervals} where a classical contact would reach under a picture."""
    sites, last = candidates.sites, len(candidates.sites) - 1
    touching = [(max(i - 1, 0), min(j + 1, last)) for i, j in runs(low(candidates, sites))]
    return problem.computed(
        {
            corner: tuple((float(sites[i] + shift), float(sites[j] + shift)) for i, j in touching)
            for corner, shift in enumerate(problem.shifts)
        }
    )


def panels_cost(problem, load, rtol, order=None):
    """The Cost of panels for a Problem with a picture, to rtol or of an order."""
    # the picture may be that of four times the load
    candidates = replace(problem.candidates, rise=2 * load / (np.pi * problem.E_star))
    order = order or orders(candidates.simple, rtol)[-1]
    count = len(make_panels(problem, likely_zones(problem, candidates), order).e)
    # zones are searched for again and again where peaks part them
    peaks = np.count_nonzero(low(candidates, candidates.kinks) & (np.array(candidates.jumps) > 0))
    return cost.of("panels", order * count, 1 + peaks)


def bends(candidates):
    """Norm of the curvature where it is convex and would touch, over that of a classical contact of 1/2."""
    x, index = np.unique(candidates.sites, return_index=True)
    slopes, middles = np.diff(candidates.heights[index]) / np.diff(x), (x[1:] + x[:-1]) / 2
    curvature, lengths = np.diff(slopes) / np.diff(middles), np.diff(middles)
    kinks = np.sort((-np.inf, *candidates.kinks, *candidates.steps, np.inf))
    after = np.searchsorted(kinks, x[1:-1])
    away = np.minimum(x[1:-1] - kinks[after - 1], kinks[after] - x[1:-1])
    bent = (curvature > 0) & low(candidates, x[1:-1]) & (away > 1e-3 * candidates.half_width)
    square = candidates.half_width**3 / candidates.rise**2 * (lengths[bent] @ curvature[bent] ** 2)
    return float(np.sqrt(square)) / 2


def cells_cost(candidates, rtol, fewest, most, times):
    """The Cost of equal cells under a picture, between `fewest` and `most`, solved for so many times."""
    edges = *candidates.ends, *candidates.steps
    valleys, ends = (np.count_nonzero(low(candidates, x)) for x in (candidates.minima, edges))
    peaks, jumps = np.reshape([pair for pair in jumps_of(candidates) if pair[1] > 0], (-1, 2)).T
    slopes = jumps[low(candidates, peaks)] * candidates.half_width / candidates.rise
    width = (candidates.stretches[-1][1] - candidates.stretches[0][0]) / candidates.half_width
    smooth = max(2 * valleys, bends(candidates), 2)
    needed = smooth / rtol + 8 * ends / rtol**2
    # cells know the logarithms under named peaks
    needed += np.sum(slopes**2) / 2 / rtol**2 if candidates.detected else 2 * np.sum(slopes) / rtol
    count = 2.0 ** np.ceil(np.log2(width * needed))
    return cost.of("cells", max(fewest, min(count, most)), times)._replace(misses=bool(count > most))


def period_cost(gaps, corners, rtol, fewest):
    """The Cost of equal cells on a period, from gaps over the rise of a classical contact, array (n,)."""
    touching = gaps <= gaps.min() + 1
    width = max(np.count_nonzero(touching), 1) / len(gaps) / max(len(runs(touching)), 1)
    return cost.of("cells", corners * max(fewest, 2.0 ** np.ceil(np.log2(corners / width / rtol))))
