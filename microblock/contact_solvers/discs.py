"""Forces of two components within discs, with a given sum."""

from dataclasses import dataclass, field

import numpy as np

from ..model.types import Array, Flags
from .rounding import EPS_SUM

AT_RIM = 1e-12  # relative, below a radius, within which forces are at it: rounding of a projection
SMALLER = 1e-9  # relative, by which a step has to make an excess smaller
LEAST_FALL = 1e-4  # of a convex function over that of its tangent
PARALLEL = 1e-9  # relative, below the sum of all radii, within which all are parallel
STEPS_AND_HALVINGS = 80  # of Newton's method, and of each step; 5 to 20 are met


@dataclass(frozen=True)
class Discs:
    """The set of (d) in `coulomb_discs`: forces within radii, array (n,), with a resultant, array (2,). It is
    0 along axes on which it is not `given`, boolean array (2,), and no condition.
    """

    radii: Array
    resultant: Array
    given: Flags = field(default_factory=lambda: np.ones(2, bool))

    @property
    def all_slide(self) -> bool:
        """Whether the resultant leaves no other forces than those of sliding along it."""
        return bool(np.hypot(*self.resultant) >= self.radii.sum() * (1 - PARALLEL))

    def within(self, values: Array) -> Array:
        """Returns the nearest forces within the radii, array (2, n)."""
        sizes = np.hypot(*values)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(sizes > self.radii, values * (self.radii / sizes), values)

    def project(self, values: Array) -> Array:
        """Returns the nearest forces of the set to values, array (2, n)."""
        return self._with_resultant(self.within(values - self.shift(values)[:, None]))

    def shift(self, values: Array) -> Array:
        """Returns t for which ``within(values - t)`` has the resultant, array (2,), by Newton's method on the
        convex function of t whose gradient is less the excess; 0 along axes on which none is given.
        """
        t = np.zeros(2)
        excess = self._excess(values, t)
        for _ in range(STEPS_AND_HALVINGS):
            if np.abs(excess).max() <= 1e-13 * self.radii.sum():
                break
            slope = self._slope(values - t[:, None])
            step = np.zeros(2)
            step[self.given] = np.linalg.solve(slope[np.ix_(self.given, self.given)], excess[self.given])
            # where all forces but few are at their radii it would be far beyond all values
            farthest = np.hypot(*(values - t[:, None])).max() + self.radii.max()
            step *= min(1.0, 2 * farthest / np.hypot(*step))
            t, excess = self._searched(values, t, step, excess)
        return t

    def _potential(self, values: Array, t: Array) -> float:
        """Returns the convex function of `shift`."""
        sizes = np.hypot(*(values - t[:, None]))
        inside = np.minimum(sizes, self.radii)
        return float((inside * (sizes - inside / 2)).sum() + self.resultant @ t)

    def _excess(self, values: Array, t: Array) -> Array:
        """Returns the resultant of ``within(values - t)`` less the given one."""
        return self.given * (self.within(values - t[:, None]).sum(axis=1) - self.resultant)

    def _slope(self, values: Array) -> Array:
        """Returns the derivative of the resultant of `within`, array (2, 2), positive definite."""
        sizes = np.maximum(np.hypot(*values), 1e-300)
        outside = sizes > self.radii
        ratio = np.where(outside, self.radii / sizes, 1.0)
        e = values / sizes
        slope = ratio.sum() * np.eye(2) - (ratio * outside * e) @ e.T
        return np.asarray(slope + 1e-10 * np.trace(slope) * np.eye(2))

    def _searched(self, values: Array, t: Array, step: Array, excess: Array) -> tuple[Array, Array]:
        """Returns (t, excess) after the longest of halved steps that makes the potential smaller, or, where
        that is rounding, the excess.
        """
        before = self._potential(values, t)
        rounding = EPS_SUM * (self.radii.sum() * np.hypot(*values).max() + abs(before))
        for _ in range(STEPS_AND_HALVINGS):
            trial = t + step
            changed = self._excess(values, trial)
            fall = before - self._potential(values, trial)
            smaller = np.hypot(*changed) < (1 - SMALLER) * np.hypot(*excess)
            if fall > max(rounding, LEAST_FALL * (step @ excess)) or (smaller and fall > -rounding):
                return trial, changed
            step = step / 2
        return t, excess

    def _with_resultant(self, forces: Array) -> Array:
        """Returns forces with what rounding has left of the resultant on those inside of their discs."""
        inside = np.hypot(*forces) < (1 - AT_RIM) * self.radii
        missing = self.given * (self.resultant - forces.sum(axis=1))
        room = np.where(inside, self.radii - np.hypot(*forces), 0.0)
        if room.sum() > np.hypot(*missing):
            forces = forces + missing[:, None] * (room / room.sum())
        return forces
