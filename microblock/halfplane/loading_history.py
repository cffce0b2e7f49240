"""Histories of loads under which the shear traction is a sum of pressures without friction
(docs/theory/friction.md),

    q(x) = integral over 0 < xi < P of g(xi) dp(x; xi)/dxi,     |g| <= f.
"""

from dataclasses import dataclass

import numpy as np

from ..contact_solvers.rounding import EPS_PIVOT
from ..errors import BadArgument
from ..model.types import Array


@dataclass(frozen=True, eq=False)
class LoadingHistory:
    """The integral of g, a polyline: loads along it lead to the same state without slip.

    Attributes
    ----------
    loads, shears : arrays (n,), corners of the polyline from (0, 0) to (P, Q), loads ascending
    stuck : the load whose contact has stuck since the pair before
    """

    loads: Array
    shears: Array
    stuck: float = 0.0

    @property
    def load(self) -> float:
        return float(self.loads[-1])

    @property
    def shear(self) -> float:
        return float(self.shears[-1])

    def __call__(self, loads: Array | float) -> Array:
        """Returns the shear forces of the polyline at loads, array (n,)."""
        return np.asarray(np.interp(loads, self.loads, self.shears), float)

    def reserve(self, loads: Array, limit: float) -> Array:
        """Returns the shear that slip to g = `limit`, f or -f, may still add under loads (ascending), array
        (n,).
        """
        return np.abs(limit * loads - self(loads))

    @property
    def slopes(self) -> Array:
        """g between the corners of the polyline, array (n - 1,)."""
        return np.diff(self.shears) / np.diff(self.loads)

    @property
    def pressure_terms(self) -> list[tuple[float, float]]:
        """[(factor, load), ...] of the pressures of which q is the sum."""
        g = self.slopes
        factors = -np.diff(g, append=0.0)
        least = EPS_PIVOT * np.abs(g).max(initial=0.0)
        terms = zip(factors.tolist(), self.loads[1:].tolist())
        return [(factor, load) for factor, load in terms if abs(factor) > least]

    def extended(self, load: float, shear: float, friction: float) -> "LoadingHistory":
        """Returns the history at the next pair; BadArgument where friction cannot bear the shear."""
        load = self.load if abs(load - self.load) <= EPS_PIVOT * load else load
        grows = load > self.load
        if grows and abs(shear - self.shear) > friction * (load - self.load) * (1 + EPS_PIVOT):
            raise BadArgument(
                "pairs",
                (load, shear),
                "must not add more shear force than friction times the normal force it adds: panels "
                "follow slip while the normal force is constant or falls; method=Cells() follows both",
            )
        missing = float(shear - self(load))
        least = EPS_PIVOT * friction * load
        stuck = load
        if abs(missing) > least and not grows:
            limit = float(np.copysign(friction, missing))
            target = abs(limit * load - shear)
            stuck = 0.0
            if target > least:
                stuck = float(np.interp(target, self.reserve(self.loads, limit), self.loads))
        loads = np.unique((0.0, *self.loads[self.loads < stuck * (1 - EPS_PIVOT)], stuck, load))
        return LoadingHistory(loads, np.append(self(loads[:-1]), shear), stuck)
