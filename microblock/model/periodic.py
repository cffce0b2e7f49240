"""An obstacle and its images, a period apart along a line, or along both axes of a surface.

An obstacle may be given on any window of one period, such as [0, L] or [a, a + L], with one of its ends or
both. What is given everywhere is taken from [-L/2, L/2].
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .obstacles import Samples, as_obstacle, heights
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
        left, right = window
        if abs(right - left - self.period) <= EQUAL * self.period:
            return window
        middle = (left + right) / 2
        return middle - self.period / 2, middle + self.period / 2

    @cached_property
    def profile(self) -> ObstacleLike:
        """The obstacle; of samples whose last one is missing, closed by the first one."""
        if isinstance(self.obstacle, Samples):
            return self.obstacle.closed(self.period)
        return self.obstacle

    @property
    def edges(self) -> Interval | tuple[()]:
        """(left, right) of an obstacle along a line that is less wide than a period; else none."""
        left, right = self.windows[0]
        if right - left < (1 - EQUAL) * self.period:
            return left, right
        return ()

    @cached_property
    def windows(self) -> list[Interval]:
        """(left, right) along each axis: where the obstacle ends, or else the period about 0."""
        ends = as_obstacle(self.profile).ends or (-np.inf, np.inf)
        if np.isfinite(ends).all():
            return [(float(min(ends)), float(max(ends)))]
        about = [(-self.period / 2, self.period / 2)] * self.dimensions
        covered = np.isfinite(self._sampled(about)).astype(float)
        if covered.any() and agree_at_ends(covered, range(self.dimensions)):
            return about
        around = [(3 * left, 3 * right) for left, right in about]
        covered = np.isfinite(self._sampled(around))
        if not covered.any():
            return about
        middle = [int(np.median(numbers)) for numbers in np.nonzero(covered)]
        return [self._window(axis, middle, covered, about[axis]) for axis in range(self.dimensions)]

    def _axes(self, windows: Iterable[Interval]) -> list[Array]:
        """Returns places along each axis, both ends of a window among them."""
        count = {1: 769, 2: 193}[self.dimensions]
        return [np.linspace(*window, count) for window in windows]

    def _sampled(self, windows: Iterable[Interval]) -> Array:
        """Returns the heights at places of windows, array (n,) or (n, n)."""
        return heights(self.profile, *np.meshgrid(*self._axes(windows), indexing="ij"))

    def _window(self, axis: int, middle: list[int], covered: Flags, about: Interval) -> Interval:
        """Returns where the obstacle begins and ends on the line along an axis through the place `middle` of
        samples, or else the period about 0.
        """
        samples = self._axes([(3 * about[0], 3 * about[1])])[0]
        (across,) = [*middle[:axis], *middle[axis + 1 :]] or [0]

        def along(x: Array) -> Array:
            places = [x, samples[across] + 0 * x][: self.dimensions]
            return heights(self.profile, *places[:: 1 - 2 * axis])

        row = np.moveaxis(covered, axis, 0).reshape(len(samples), -1)[:, across]
        edges = np.sort(places_of_ends(along, samples, row))
        if len(edges) == 2:
            return float(edges[0]), float(edges[1])
        return about

    def repeats(self) -> bool:
        """Returns whether the heights at both ends of a period are the same, and none that is given beyond it
        is lower than its image there, as far as samples see. A formula that is given everywhere may be: the
        period is cut out of it.
        """
        period = [self._span(window) for window in self.windows]
        values = self._sampled(period)
        if not agree_at_ends(values, range(self.dimensions)):
            return False
        steps = self.period * np.vstack((np.eye(self.dimensions), -np.eye(self.dimensions)))
        beyond = [
            self._sampled([(left + step, right + step) for (left, right), step in zip(period, along)])
            for along in steps
        ]
        if np.isfinite(beyond).all() and not as_obstacle(self.profile).ends:
            return True
        return not any((image < values - _allowed(values)).any() for image in beyond)


def agree_at_ends(values: Array, axes: Iterable[int]) -> bool:
    """Returns whether samples of a period, both its ends among them, are the same there along these axes."""
    allowed = _allowed(values)
    pairs = [(values.take(0, axis), values.take(-1, axis)) for axis in axes]
    return all(np.allclose(first, last, rtol=0.0, atol=allowed) for first, last in pairs)


def _allowed(values: Array) -> float:
    """Returns how much values that are equal may differ."""
    finite = values[np.isfinite(values)]
    return EQUAL * float(np.ptp(finite)) if len(finite) else 0.0
