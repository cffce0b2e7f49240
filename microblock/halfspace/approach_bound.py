"""An upper bound on the approach of a contact, from rigid flat punches.

f is the least initial gap of a block's corners. By reciprocity with a flat punch on a disc A of radius a,

    approach <= P/(2 E* a) + <h>_A,

<h>_A the mean of the initial gaps under the punch's pressure.

1. Discs of radii that fall by the square root of two lie about the lowest place, which may be at an edge of
   the obstacle, and about the place farthest from all edges.
2. Means over each disc by a Gauss rule in sqrt(1 - (r/a)^2), for which the punch's pressure has weight 1, and
   equal angles.
3. Under a load the smallest bound of all discs counts: the first term alone tells which discs are too small
   for it. One corner of a block may carry all, which yields more, and the bound is doubled, as the energy of
   the least forces is convex in P.
4. At a given approach the disc counts that is the last one to reach it.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ..model.quadrature import gauss_rule
from ..model.types import Array

RADII = 320  # each smaller than the one before by the square root of two
AT_ONCE = 16  # of them

Gaps = Callable[[Array, Array], Array]  # of (x1, x2): initial gaps, array (corners, ...) (length)


class PunchBound(NamedTuple):
    """A bound on the approach.

    Attributes
    ----------
    rise : float
        Of the bound over the lowest place (length).
    radius : float
        Of the disc that gives it (length).
    """

    rise: float
    radius: float


class MeanHeights(NamedTuple):
    """Means of the initial gaps under the first m flat punches, less a height.

    Attributes
    ----------
    radii : array (m,)
        Of the discs, falling (length).
    all_corners : array (m,)
        Where all corners carry alike; the least over the middles of the discs (length).
    one_corner : array (m,)
        Where one corner carries all; the least over the corners, too (length).
    corners : int
    """

    radii: Array
    all_corners: Array
    one_corner: Array
    corners: int

    def under_load(self, all_alike: float, one_alone: float) -> PunchBound | None:
        """Returns the bound under a load, from P/(2 E*) of all corners and of one (length^2), or None where a
        smaller disc may give less.
        """
        bounds = np.minimum(
            all_alike / self.radii + self.all_corners, one_alone / self.radii + self.one_corner
        )
        best = int(np.argmin(bounds))
        if len(bounds) < RADII and all_alike / self.radii[-1] < bounds[best]:
            return None
        factor = 1 if self.corners == 1 else 2
        return PunchBound(float(bounds[best]) * factor, float(self.radii[best]))

    def at_rise(self, rise: float) -> PunchBound | None:
        """Returns an approach that is given, over the lowest place, with its disc, or None where that may be
        smaller.
        """
        reached = np.flatnonzero(self.one_corner < rise)
        if not len(reached) and len(self.radii) < RADII:
            return None
        disc = max(int(reached[0]) - 1, 0) if len(reached) else RADII - 1
        return PunchBound(rise, float(self.radii[disc]))


def mean_heights(gaps: Gaps, middles: Array, widest: float, lowest: float) -> Iterator[MeanHeights]:
    """Yields the MeanHeights over a lowest height (length), of more and more discs about middles, array
    (k, 2), from a width (length) down.
    """
    radii = widest / 2 * 2.0 ** (-np.arange(RADII) / 2)  # 1
    z, weights = gauss_rule(8)  # 2
    angles = 2 * np.pi * (np.arange(16) + 0.5) / 16
    r = np.sqrt(1 - z**2)
    means = []
    for end in range(AT_ONCE, RADII + 1, AT_ONCE):
        discs = radii[end - AT_ONCE : end, None]
        x1 = middles[:, 0, None, None] + discs * np.outer(r, np.cos(angles)).ravel()
        x2 = middles[:, 1, None, None] + discs * np.outer(r, np.sin(angles)).ravel()
        with np.errstate(all="ignore"):  # far away heights overflow
            means.append(gaps(x1, x2) @ (np.repeat(weights, len(angles)) / len(angles)) - lowest)
        of_corners = np.concatenate(means, axis=-1)
        yield MeanHeights(
            radii[:end],
            of_corners.mean(axis=0).min(axis=0),
            of_corners.min(axis=0).min(axis=0),
            corners=len(of_corners),
        )
