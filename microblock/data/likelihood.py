"""Least squares and profile likelihood of parameters, for a model with derivatives.

With residuals r of Gaussian scatter 1 the misfit is S(x) = r.r. The profile of a parameter is the least S
over all others; where its excess over the least of all reaches a threshold the interval ends (Venzon and
Moolgavkar, Appl. Statist. 37 (1988) 87). Where it does not up to a bound the data do not determine the
parameter on this side, however narrow the linearised model has it.

1. `scipy.optimize.least_squares` finds the least of all.
2. From it steps on either side of a parameter double, others being fitted again, until one is beyond the
   threshold, or at the bound.
3. Brent's method finds the root of the square root of the excess, which is straight where the model is.
4. Where a profile finds a smaller misfit, all begins again there.

Of a profile others begin on a straight line; where the linearised model says that they would gain next to
nothing, this is taken off and they stay.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.optimize import brentq, least_squares

from ..errors import MicroblockError, NotConverged, require
from ..model.progress import counted
from ..model.types import Array, Flags

END_TOLERANCE = 2e-3  # of the square root of the threshold, to which ends of intervals are found
GAIN = 0.02  # of the threshold, which the linearised model tells to a few per cent of it
BETTER = 1e-2  # of the threshold, by which a profile finds a smaller misfit
LEAST_STEP = 1e-12  # which rounding leaves of parameters up to some 10
ROUNDS = 4  # of such findings
AT_BOUND = 1e-3  # of the distance of bounds, within which a parameter has reached one
OTHER_SIDE = 0.05  # of this distance, from the other bound, where derivatives may be 0

Model = Callable[
    [Array], tuple[Array, Array]
]  # (p,) to residuals over their scatter, (n,), derivatives (n, p)


@dataclass(frozen=True)
class Profile:
    """The profile of a parameter: its values, ascending, and the excess of the misfit there, arrays (k,), and
    the ends of the interval, None on a side where it does not close.
    """

    values: Array
    excess: Array
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Fit:
    """Parameters of the least misfit.

    Attributes
    ----------
    x : array (p,)
    misfit : float, sum of the squares
    scatter_is_known : bool
    scatter : float, 1 or the standard deviation that the residuals tell, with whose square all misfits below
        are divided
    covariance : array (p, p), of the linearised model; inf where it is singular
    threshold : float, excess of the misfit at the ends of intervals
    profiles : list of Profile
    """

    x: Array
    misfit: float
    scatter_is_known: bool
    scatter: float
    covariance: Array
    threshold: float
    profiles: list[Profile]


class _Smaller(Exception):
    """A profile has found a smaller misfit at x, array (p,)."""

    def __init__(self, x: Array) -> None:
        super().__init__()
        self.x = x


def fit(
    model: Model, bounds: tuple[Array, Array], level: float, scatter_is_known: bool, rounding: float = 0.0
) -> Fit:
    """Returns the Fit from x = 0 on within bounds, arrays (p,), with intervals of a level of confidence: by
    the normal distribution, or Student's where the residuals tell the scatter.

    Raises the error of the model at x = 0, BadArgument if no scatter is known and that of the residuals is at
    most `rounding`, and NotConverged if smaller misfits are found again and again.
    """
    x = np.zeros(len(bounds[0]))
    misfit = Misfit(model, bounds, x)
    for _ in range(ROUNDS):
        x, least = misfit.least(x)
        derivatives = misfit.at(x)[1]
        freedom = len(derivatives) - len(x)
        quantile = float(stats.norm.ppf((1 + level) / 2))
        scatter = 1.0
        if not scatter_is_known:
            words = "must be given: the readings are those of the model, and tell no scatter"
            scatter = math.sqrt(least / freedom)
            require(scatter > rounding, "sigma", None, words)
            quantile = float(stats.t.ppf((1 + level) / 2, freedom))
        misfit.threshold = (scatter * quantile) ** 2
        inverse = _inverse(derivatives.T @ derivatives)
        try:
            profiles = [_profile(misfit, x, least, inverse, i) for i in range(len(x))]
        except _Smaller as smaller:
            x = smaller.x
            continue
        profiles = [replace(profile, excess=profile.excess / scatter**2) for profile in profiles]
        return Fit(x, least, scatter_is_known, scatter, scatter**2 * inverse, quantile**2, profiles)
    raise NotConverged(
        f"profiles have found a smaller misfit than the least one {ROUNDS} times: begin with other first "
        "guesses, or with fewer unknowns"
    )


class Misfit:
    """The sum of squares of a model, each point of which is computed once; inf where the model fails.

    Attributes
    ----------
    threshold : float, excess at the ends of intervals; 0 before the least misfit is known
    """

    threshold = 0.0

    def __init__(self, model: Model, bounds: tuple[Array, Array], first: Array) -> None:
        self.model = model
        self.bounds = bounds
        self._known = {first.tobytes(): model(first)}  # which raises its error

    def at(self, x: Array) -> tuple[Array, Array]:
        """Returns residuals and derivatives at x, array (p,)."""
        key = x.tobytes()
        if key not in self._known:
            counted()
            try:
                self._known[key] = self.model(x)
            except MicroblockError:
                residuals, derivatives = next(iter(self._known.values()))
                self._known[key] = np.full_like(residuals, np.inf), np.zeros_like(derivatives)
        return self._known[key]

    def least(self, start: Array, fixed: int | None = None) -> tuple[Array, float]:
        """Returns the x, array (p,), with the least misfit from a start on, and this, all but one parameter
        being free; inf where the model fails at the start.
        """
        free = np.arange(len(start)) != (-1 if fixed is None else fixed)
        residuals, derivatives = self.at(start)
        misfit = float(residuals @ residuals)
        if not free.any() or math.isinf(misfit) or misfit == 0:
            return start, misfit
        if fixed is not None:
            rises = derivatives.T @ residuals
            low, high = self.bounds
            inner = free & np.where(rises > 0, start > low, start < high)
            gradient = rises[inner]
            gain = gradient @ np.linalg.pinv(derivatives[:, inner].T @ derivatives[:, inner]) @ gradient
            if gain <= GAIN * self.threshold:
                return start, misfit - float(gain)

        def whole(part: Array) -> Array:
            x = start.copy()
            x[free] = part
            return x

        found = least_squares(
            lambda part: self.at(whole(part))[0],
            start[free],
            lambda part: self.at(whole(part))[1][:, free],
            (self.bounds[0][free], self.bounds[1][free]),
            ftol=max(1e-6, GAIN / 10 * self.threshold / misfit),
            xtol=1e-6,
        )
        return whole(found.x), 2 * float(found.cost)


def _inverse(matrix: Array) -> Array:
    """Returns the inverse of a symmetric matrix, inf where it is singular."""
    size = np.sqrt(np.diag(matrix))
    if size.all():
        scaled = matrix / np.outer(size, size)
        if np.linalg.cond(scaled) < 1 / np.finfo(float).eps:
            return np.asarray(np.linalg.inv(scaled) / np.outer(size, size))
    return np.full_like(matrix, np.inf)


def at_bounds(x: Array, bounds: tuple[Array, Array]) -> tuple[Flags, Flags]:
    """Returns which parameters, array (p,), have reached the lower and which the upper bound, (p,) each."""
    low, high = bounds
    nearness = AT_BOUND * (high - low)
    return x < low + nearness, x > high - nearness


def _from_other_sides(x: Array, fixed: int, bounds: tuple[Array, Array]) -> Iterator[Array]:
    """Yields x, array (p,), with each parameter but one that has reached a bound near its other bound: a
    valley may go on there, as that of nu does, whose square is seen.
    """
    low, high = bounds
    inside = OTHER_SIDE * (high - low)
    at_low, at_high = at_bounds(x, bounds)
    for reached, other_side in ((at_low, high - inside), (at_high, low + inside)):
        for j in np.flatnonzero(reached):
            if j != fixed:
                start = x.copy()
                start[j] = other_side[j]
                yield start


def _profile(misfit: Misfit, x: Array, least: float, inverse: Array, i: int) -> Profile:
    """Returns the Profile of parameter i about the best x, array (p,), where the inverse of the linearised
    model's matrix is given; raises _Smaller.
    """
    points = {float(x[i]): 0.0}
    height = math.sqrt(misfit.threshold)
    slope = np.zeros(len(x))
    first_step = 1.0
    if np.isfinite(inverse).all():
        slope = inverse[i] / inverse[i, i]
        first_step = min(first_step, max(LEAST_STEP, 1.05 * height * math.sqrt(inverse[i, i])))

    def fitted(value: float, near: Array, slope: Array) -> Array:
        """Returns the fit of all others at a value, begun on the straight line from one near by."""
        start = np.clip(near + slope * (value - near[i]), *misfit.bounds)
        start[i] = value
        others, smallest = misfit.least(start, i)
        if smallest > least + misfit.threshold:
            for start in _from_other_sides(others, i, misfit.bounds):
                others, smallest = min((others, smallest), misfit.least(start, i), key=lambda found: found[1])
        if smallest < least - BETTER * misfit.threshold:
            raise _Smaller(others)
        points[value] = max(smallest - least, 0.0)
        return others

    def beyond(value: float) -> float:
        """Returns the root of the excess less that of the threshold, 0 where they are nearly equal."""
        difference = math.sqrt(points[value]) - height
        return difference if abs(difference) > END_TOLERANCE * height else 0.0

    def end(side: int, bound: float) -> float | None:
        """Returns the end of the interval on a side, None where the profile does not close."""
        step = first_step
        inside = x
        line = slope
        while True:
            value = bound if side * (bound - inside[i]) <= step else float(inside[i]) + side * step
            outside = fitted(value, inside, line)
            if beyond(value) >= 0:
                break
            if value == bound:
                return None
            line = (outside - inside) / (value - inside[i])
            inside = outside
            step *= 2

        def root(at: float) -> float:
            if at not in points:
                fitted(at, inside, line)
            return beyond(at)

        if math.isinf(points[value]):  # where the model fails nobody knows
            return None
        return float(brentq(root, float(inside[i]), value, xtol=END_TOLERANCE * abs(value - x[i])))

    low, high = (end(side, float(bound[i])) for side, bound in zip((-1, 1), misfit.bounds))
    values = np.array(sorted(points))
    return Profile(values, np.array([points[value] for value in values.tolist()]), low, high)
