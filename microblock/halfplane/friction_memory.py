"""The shear traction between equal bodies as a sum of pressures without friction (docs/theory/friction.md),

    q(x) = integral over 0 < xi < P of g(xi) dp(x; xi)/dxi,     |g| <= f,

with g constant on layers of loads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..corners.rounding import PATHS
from ..errors import BadArgument


@dataclass(frozen=True)
class Slipped:
    """A layer that slips: bounds, change of g, and loads P of slip there."""

    lower: float
    upper: float
    change: float
    load_at_lower: float
    load_at_upper: float


@dataclass(frozen=True)
class Memory:
    """g on layers.

    Attributes
    ----------
    bounds : loads, ascending from 0 to P
    shares : g between the bounds
    stuck : the load P* whose contact has stuck
    slipped : since the pair before
    """

    bounds: tuple[float, ...] = (0.0,)
    shares: tuple[float, ...] = ()
    stuck: float = 0.0
    slipped: tuple[Slipped, ...] = ()

    @property
    def load(self) -> float:
        return self.bounds[-1]

    @property
    def shear(self) -> float:
        return float(np.dot(self.shares, np.diff(self.bounds)))

    def to(self, load: float, shear: float, friction: float) -> Memory:
        """Returns the memory at the next pair; BadArgument where friction cannot bear the shear."""
        load = self.load if abs(load - self.load) <= PATHS * load else load
        grown, change = load - self.load, shear - self.shear
        if grown > 0 and abs(change) > friction * grown * (1 + PATHS):
            raise BadArgument(
                "pairs",
                (load, shear),
                "must not add more shear force than friction times the normal force it adds: panels follow "
                "slip while the normal force is constant or falls; method=Cells() follows both",
            )
        if grown > 0:
            share = float(np.clip(change / grown, -friction, friction))
            return Memory((*self.bounds, load), (*self.shares, share), load)
        kept = self._below(load)
        missing = shear - kept.shear
        if abs(missing) <= PATHS * friction * load:
            return kept
        return self._after_slip(load, shear, float(np.copysign(friction, missing)))

    def _below(self, load: float) -> Memory:
        inner = [bound for bound in self.bounds if bound < load * (1 - PATHS)]
        return Memory((*inner, load), self.shares[: len(inner)], load)

    def _after_slip(self, load: float, shear: float, limit: float) -> Memory:
        bounds = np.array(self.bounds)
        own = np.concatenate(([0.0], np.cumsum(self.shares * np.diff(bounds))))
        left = limit * bounds - own  # what slip may still add below a bound; it grows with the bound in size
        target = limit * load - shear
        stuck = float(np.interp(abs(target), np.abs(left), bounds))
        if stuck <= PATHS * load or abs(shear) >= abs(limit) * load * (1 - PATHS):
            stuck = 0.0  # all slides
        places = np.array([stuck, *bounds[bounds > stuck]])
        begun, way = limit * self.load - self.shear, limit * (load - self.load) - (shear - self.shear)
        share = (np.interp(places, bounds, left) - begun) / way
        loads = np.clip(self.load + share * (load - self.load), load, self.load)
        changes = limit - np.array([self.shares[np.searchsorted(bounds, each) - 1] for each in places[1:]])
        slipped = tuple(
            Slipped(*map(float, each))
            for each in zip(places[:-1], places[1:], changes, loads[:-1], loads[1:])
            if each[2]
        )
        if not stuck:
            return Memory((0.0, load), (limit,), 0.0, slipped)
        kept = self._below(stuck)
        return Memory((*kept.bounds, load), (*kept.shares, limit), stuck, slipped)
