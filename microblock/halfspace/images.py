"""What loads on a half-space displace far away, also with their images on a period.

With the filter chi(k), 1 of long waves and 0 of short ones, the sum over images is that of the nearest ones,
less their long waves, and of these as a Fourier series: both converge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.special import jv

from ..model.quadrature import gauss_rule, in_blocks
from ..model.types import AnyArray as Array

LONG = 20.0  # over the period, wavenumber up to which waves are summed


class Response:
    """Components of a response at distances.

    Parameters
    ----------
    alone, waves : functions
        Kernels of distances r, and what they are transforms of, of wavenumbers k: arrays (parts, ...).
    orders : sequence of int
        Of their Bessel functions.
    resolved : function
        Of values and (x, y) or (k1, k2): components along the axes.
    odd : array of bool
        Which of these change their sign with that of the distance.
    mean : array
        Their integral over a period.
    period : float or None
    """

    def __init__(
        self,
        alone: Callable[[Array], Array],
        waves: Callable[[Array], Array],
        orders: Sequence[int],
        resolved: Callable[..., Array],
        odd: Array,
        mean: Array,
        period: float | None,
    ) -> None:
        self.alone, self.resolved, self.odd, self.mean, self.period = alone, resolved, odd, mean, period
        if period is None:
            return
        most, (points, gauss) = 1.6 * LONG / period, gauss_rule(16)  # chi of 1.6 is rounding
        edges = most * np.concatenate(([0], 2.0 ** np.arange(-16, -2), np.arange(2, 9) / 8))
        wide = np.diff(edges)[:, None]
        k, dk = (edges[:-1, None] + wide * points).ravel(), (wide * gauss).ravel()
        r, spectrum = np.linspace(0, 4 * period, 800), waves(k) * (self._chi(k) * k * dk / (2 * np.pi))
        signs = {0: 1, 1: 1, 2: -1}
        table = [signs[order] * row @ jv(order, np.outer(k, r)) for row, order in zip(spectrum, orders)]
        self._long: Any = make_interp_spline(r, np.transpose(table), k=5)
        ways = 2 * np.pi / period * (np.indices((11, 11)).reshape(2, -1) - 5)
        self.ways = ways[:, : ways.shape[1] // 2]  # the others are their opposites
        k = np.hypot(*self.ways)
        self.spectrum = 2 / period**2 * resolved(waves(k) * self._chi(k), *self.ways)

    def _chi(self, k: Array) -> Array:
        return np.asarray(np.exp(-((k * (self.period or 0.0) / LONG) ** 8)))

    def __call__(self, x: Array, y: Array, itself: bool) -> Array:
        """Returns components at distances, array (parts, ...), on a period with images; of a square and
        `itself` only these.
        """
        if self.period is None:
            return self.resolved(self.alone(np.hypot(x, y)), x, y)
        shape, away = np.shape(x), np.array((np.ravel(x), np.ravel(y)))
        if not itself:
            away -= self.period * np.rint(away / self.period)
        found = np.zeros((len(self.odd), away.shape[1])) + self.mean[:, None] / self.period**2
        for block in in_blocks(away.shape[1], self.ways.shape[1]):
            phases, odd = self.ways.T @ away[:, block], self.odd[:, None]
            waves = np.where(odd, self.spectrum @ np.sin(phases), self.spectrum @ np.cos(phases))
            found[:, block] += waves
        for image in np.ndindex(3, 3):
            x, y = away - self.period * (np.array(image)[:, None] - 1)
            r = np.hypot(x, y)
            values = -np.moveaxis(self._long(r), -1, 0)
            if not itself or image != (1, 1):
                values += self.alone(r)
            found += self.resolved(values, x, y)
        return found.reshape(len(found), *shape)
