"""What panels and cells are expected to take under an obstacle, from its ContactCandidates.

Panels are those of zones where the gap is no larger than the rise of a classical contact. On cells square
roots at edges leave a relative error like cell/zone, inverse roots at ends, and logarithms at peaks that no
one has named, one like the root of cell/contact.
"""

from dataclasses import replace

import numpy as np

from .. import cost
from ..model.contact_candidates import ContactCandidates, may_touch
from ..model.intervals import runs
from ..model.obstacles import jumps_of
from ..model.problem import Problem
from ..model.scales import classical_rise
from ..model.types import Array, CornerZones
from .panels import make_panels, orders


def likely_zones(problem: Problem, candidates: ContactCandidates) -> CornerZones:
    """Returns {corner: intervals} where a classical contact would reach under the candidates."""
    sample_points = candidates.sample_points
    last = len(sample_points) - 1
    touching = [
        (sample_points[max(i - 1, 0)], sample_points[min(j + 1, last)])
        for i, j in runs(may_touch(candidates, sample_points))
    ]
    return problem.computed(
        {
            corner: tuple((float(left + shift), float(right + shift)) for left, right in touching)
            for corner, shift in enumerate(problem.shifts)
        }
    )


def panels_cost(problem: Problem, load: float, rtol: float | None, order: int | None = None) -> cost.Cost:
    """Returns the Cost of panels for a Problem with candidates, to rtol or of an order."""
    # the candidates may be those of four times the load
    candidates = replace(problem.candidates, rise=classical_rise(load, problem.E_star))
    order = order or orders(candidates.simple, rtol or 0.0)[-1]
    count = len(make_panels(problem, likely_zones(problem, candidates), order).e)
    # zones are searched for again and again where peaks part them
    peaks = np.count_nonzero(may_touch(candidates, candidates.kinks) & (np.array(candidates.jumps) > 0))
    return cost.predict("panels", order * count, 1 + int(peaks))


def bends(candidates: ContactCandidates) -> float:
    """Returns the norm of the curvature where it is convex and would touch, over that of a classical contact
    of 1/2.
    """
    x, index = np.unique(candidates.sample_points, return_index=True)
    slopes = np.diff(candidates.heights[index]) / np.diff(x)
    middles = (x[1:] + x[:-1]) / 2
    lengths = np.diff(middles)
    curvature = np.diff(slopes) / lengths
    kinks = np.sort((-np.inf, *candidates.kinks, *candidates.height_jumps, np.inf))
    after = np.searchsorted(kinks, x[1:-1])
    distance = np.minimum(x[1:-1] - kinks[after - 1], kinks[after] - x[1:-1])
    bent = (curvature > 0) & may_touch(candidates, x[1:-1]) & (distance > 1e-3 * candidates.half_width)
    square = candidates.half_width**3 / candidates.rise**2 * (lengths[bent] @ curvature[bent] ** 2)
    return float(np.sqrt(square)) / 2


def cells_cost(
    candidates: ContactCandidates, rtol: float, fewest: float, most: float, times: float
) -> cost.Cost:
    """Returns the Cost of equal cells under candidates, between `fewest` and `most`, solved for so many
    times.
    """
    valleys = np.count_nonzero(may_touch(candidates, candidates.minima))
    ends = np.count_nonzero(may_touch(candidates, (*candidates.ends, *candidates.height_jumps)))
    peaks, jumps = np.reshape([pair for pair in jumps_of(candidates) if pair[1] > 0], (-1, 2)).T
    slopes = jumps[may_touch(candidates, peaks)] * candidates.half_width / candidates.rise
    left = candidates.stretches[0][0]
    right = candidates.stretches[-1][1]
    width = (right - left) / candidates.half_width
    smooth = max(2.0 * int(valleys), bends(candidates), 2.0)
    needed = smooth / rtol + 8 * ends / rtol**2
    # cells know the logarithms under named peaks
    needed += np.sum(slopes**2) / 2 / rtol**2 if candidates.detected else 2 * np.sum(slopes) / rtol
    count = 2.0 ** np.ceil(np.log2(width * needed))
    return cost.predict("cells", max(fewest, min(count, most)), times)._replace(misses=bool(count > most))


def period_cost(gaps: Array, corners: int, rtol: float, fewest: float) -> cost.Cost:
    """Returns the Cost of equal cells on a period, from gaps over the rise of a classical contact, array
    (n,).
    """
    touching = gaps <= gaps.min() + 1
    width = max(int(np.count_nonzero(touching)), 1) / len(gaps) / max(len(runs(touching)), 1)
    return cost.predict("cells", corners * max(fewest, 2.0 ** np.ceil(np.log2(corners / width / rtol))))
