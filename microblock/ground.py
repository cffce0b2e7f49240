"""The ground pressed by a rigid obstacle: what all finite element scenes share, whatever their mesh."""

import math
from dataclasses import dataclass, replace

import numpy as np

from .display import scene_summary
from .errors import BadArgument, NotConverged, require_positive
from .law import corner_shifts, symmetric
from .material import Cosserat
from .observables import runs
from .obstacles import check_lowest, heights
from .panels import Line
from .scene_view import SceneView


@dataclass(frozen=True)
class Within:
    """An obstacle as far as a bounded body goes, |x| < `far`: what it is beyond matters to nobody."""

    whole: object
    far: float

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.whole, name)

    def height(self, x):
        return np.where(np.abs(x) < self.far, heights(self.whole, np.asarray(x, float)), np.inf)

    def forgotten(self, found):
        """A Picture without the ends and steps that are those of the body."""
        def own(place):
            return abs(place) < self.far*(1 - 1e-6)

        ends = tuple(end if own(end) else math.copysign(math.inf, end) for end in found.ends)
        ends = () if all(map(math.isinf, ends)) else ends
        return replace(found, ends=ends, steps=tuple(filter(own, found.steps)), found=found.found and bool(ends or found.kinks))

    def __repr__(self):
        return repr(self.whole)


@dataclass(frozen=True)
class GroundScene(SceneView):
    """Frictionless contact of the ground x2 < 0 with a rigid obstacle.

    Parameters
    ----------
    solid : Cosserat
    obstacle : an obstacle of `microblock.obstacles`, or a callable height(x)
    law : a law of `microblock.law`
    domain : size of the square that is modelled (length); inf for a half-plane, cut off far from the contact
    """

    solid: object
    obstacle: object
    law: object
    domain: float = math.inf

    stands_on = "solid", Cosserat, "a Cosserat"

    def __post_init__(self):
        super().__post_init__()
        if not (isinstance(self.domain, float) and self.domain == math.inf):
            require_positive(domain=self.domain)
        else:
            check_lowest(self.obstacle, self.solid.ell)

    def summary(self):
        body = "half-plane by finite elements" if self.domain == math.inf else f"square of {self.domain:g}"
        return scene_summary(type(self).__name__, body, self.solid, self.obstacle, self.law)

    def varied(self, solid, obstacle, law):
        """The scene with these, on the same domain."""
        return replace(self, solid=solid, obstacle=obstacle, law=law)

    @property
    def symmetric(self):
        """Whether obstacle and blocks are known to be symmetric about x = 0: then half the body is modelled."""
        return symmetric(self.law, self.obstacle)

    @property
    def line(self):
        return Line(self.solid, self.law, self.obstacle, self.symmetric)

    def share(self, load):
        """Load of the computed part."""
        return load/2 if self.symmetric else load

    def first_guess(self, load):
        """Half-width of a classical contact that would carry the load, and a block more."""
        width = self.solid.ell/100
        for _ in range(200):
            rise = np.ptp(np.minimum(heights(self.obstacle, np.linspace(-width, width, 9)), 1e300))
            if 1.3*self.solid.E_star*rise >= load:
                return 1.2*width + self.solid.ell
            width *= 1.3
        raise NotConverged(f"the obstacle does not rise enough to carry the load {load:g}")

    def runs(self, x, closed, pressures):
        """{corner: intervals} of closed nodes, their ends where p^2, continued linearly, vanishes."""
        closed = closed.copy()
        if self.symmetric:      # there one multiplier stands for all corners
            closed[:, 0] = closed[:, 0].any() & closed[:, 1]
            pressures = np.where(x == 0, pressures.mean(axis=0), pressures)
        zones = {}
        for corner, (own, p) in enumerate(zip(closed, pressures)):
            zones[corner] = tuple((self._end(x, p, i, j, -1), self._end(x, p, j, i, 1)) for i, j in runs(own))
        return zones

    def _end(self, x, p, i, j, side):
        """End of a run of closed nodes from i to j."""
        fixed = [end for end in self.ends() if abs(end - x[i]) < 1e-9*abs(end)]
        if fixed or (self.symmetric and x[i] == 0):
            return float(x[i])
        outside = abs(x[min(max(i + side, 0), len(x) - 1)] - x[i])
        if i == j:
            return float(x[i] + side*outside/2)
        step, fall = x[i] - x[i - side], p[i - side]**2 - p[i]**2
        return float(x[i] + side*min(outside, abs(step)*p[i]**2/fall if fall > 0 else outside))

    def ends(self):
        """Abscissae of the contact point at which a corner meets an end of the obstacle."""
        return [end + shift for end in getattr(self.obstacle, "ends", ()) for shift in corner_shifts(self.law, self.solid.ell)]

    def check_load(self, load):
        """BadArgument unless the load is a positive number."""
        require_positive(load=load)
