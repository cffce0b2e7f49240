"""An obstacle and its images, a period apart along a line, or along both axes of a surface.

An obstacle may be given on any window of one period, such as [0, L] or [a, a + L], with one of its ends or
both. What is given everywhere is taken from [-L/2, L/2].
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .obstacles import Samples, heights
from .piecewise_chebyshev import places_of_ends
from .types import Array, Flags, Interval, ObstacleLike

EQUAL = 1e-6  # of a period, or of the range of heights or gaps: what differs less is equal


@dataclass(frozen=True, eq=False)
class Repeated:
    """Images of an obstacle.

    Attributes
    ----------
    obstacle : obstacle or callable
    period : float
        Distance of two images (length).
    dimensions : int
        1 along a line, 2 over a surface.
    """

    obstacle: ObstacleLike
    period: float
    dimensions: int

    def height(self, *x: Array) -> Array:
        """Returns the heights at places, an array for each axis (lengths); inf where there is no image."""
        return heights(self.profile, *map(self.original, x, self.windows))

    def original(self, x: Array, window: Interval) -> Array:
        """Returns the places of a window whose images x are, array (n,)."""
        start, stop = self._span(window)
        return np.clip(start + (x - start) % self.period, start, stop)

    def _span(self, window: Interval) -> Interval:
        """Returns a period about a window, or the window itself where its ends are a period apart."""
        middle, half = sum(window) / 2, self.period / 2
        whole = abs(window[1] - window[0] - self.period) <= EQUAL * self.period
        return window if whole else (middle - half, middle + half)

    @cached_property
    def profile(self) -> ObstacleLike:
        """The obstacle; of samples whose last one is missing, closed by the first one."""
        return self.obstacle.closed(self.period) if isinstance(self.obstacle, Samples) else self.obstacle

    @property
    def edges(self) -> Interval | tuple[()]:
        """(left, right) of an obstacle along a line that is less wide than a period; else none."""
        left, right = self.windows[0]
        return (left, right) if right - left < (1 - EQUAL) * self.period else ()

    @cached_property
    def windows(self) -> list[Interval]:
        """(left, right) along each axis: where the obstacle ends, or else the period about 0."""
        ends = getattr(self.profile, "ends", None) or (-np.inf, np.inf)
        if np.isfinite(ends).all():
            return [(float(min(ends)), float(max(ends)))]
        about = [(-self.period / 2, self.period / 2)] * self.dimensions
        seen = np.isfinite(self._sampled(about)).astype(float)
        if seen.any() and agree_at_ends(seen, range(self.dimensions)):
            return about
        around = [(3 * left, 3 * right) for left, right in about]
        there = np.isfinite(self._sampled(around))
        middle = [int(np.median(numbers)) if there.any() else 0 for numbers in np.nonzero(there)]
        return [self._window(axis, middle, there, about[axis]) for axis in range(self.dimensions)]

    def _axes(self, windows: Iterable[Interval]) -> list[Array]:
        """Returns places along each axis, both ends of a window among them."""
        return [np.linspace(*window, 769 if self.dimensions == 1 else 193) for window in windows]

    def _sampled(self, windows: Iterable[Interval]) -> Array:
        """Returns the heights at places of windows, array (n,) or (n, n)."""
        return heights(self.profile, *np.meshgrid(*self._axes(windows), indexing="ij"))

    def _window(self, axis: int, middle: list[int], there: Flags, about: Interval) -> Interval:
        """Returns where the obstacle begins and ends on the line along an axis through the place `middle` of
        samples, or else the period about 0.
        """
        places = self._axes([(3 * about[0], 3 * about[1])])[0]
        row = there[tuple(slice(None) if other == axis else i for other, i in enumerate(middle))]

        def along(x: Array) -> Array:
            return heights(
                self.profile, *(x if other == axis else places[i] + 0 * x for other, i in enumerate(middle))
            )

        edges = np.sort(places_of_ends(along, places, row))
        return (float(edges[0]), float(edges[1])) if len(edges) == 2 else about

    def repeats(self) -> bool:
        """Returns whether the heights at both ends of a period are the same, as far as samples see."""
        return agree_at_ends(self._sampled(map(self._span, self.windows)), range(self.dimensions))


def agree_at_ends(values: Array, axes: Iterable[int]) -> bool:
    """Returns whether samples of a period, both its ends among them, are the same there along these axes."""
    there = values[np.isfinite(values)]
    allowed = EQUAL * np.ptp(there) if len(there) else 0.0
    pairs = [(values.take(0, axis), values.take(-1, axis)) for axis in axes]
    return all(np.allclose(first, last, rtol=0.0, atol=allowed) for first, last in pairs)
