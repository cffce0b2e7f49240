"""Rigid obstacles: their height over the plane x2 = 0, and the gap that they leave to a point.

An obstacle's ``height(x)`` returns x2 of its lower surface at an array of x1, ``inf`` where there is none.
Any callable height serves as well. An obstacle may have these attributes:

kinks      tuple, ascending: abscissae at which the slope or a higher derivative is discontinuous
jumps      tuple, as long: by how much the slope jumps there
ends       pair: left and right edge of the obstacle
formulas   True: between all of these the height is a polynomial
even       True: the obstacle is symmetric about x1 = 0
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from ..errors import (
    LARGEST,
    BadArgument,
    Checked,
    MicroblockError,
    checked,
    require,
    require_finite,
    require_floats,
    require_numbers,
    require_positive,
    require_whole,
    shortened,
)
from .types import AnyArray, Array, Interval, ObstacleLike

STEEPEST = 0.5  # n2 of the steepest surface that can touch


class Formula(Checked):
    """Base of obstacles that are polynomials between their named places."""

    even: Any = True  # a bool, or a property
    formulas = True


@dataclass(frozen=True)
class Plane(Formula):
    """Horizontal plane at x2 = level.

    Parameters
    ----------
    level : float
        Height of the plane (length).

    Raises
    ------
    BadArgument
        If the level is no finite number.

    Examples
    --------
    >>> mb.Plane(level=0.1).height(np.zeros(2)).tolist()
    [0.1, 0.1]
    """

    level: float = field(default=0.0, metadata=checked(require_finite))

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        return np.full(np.shape(x), float(self.level))


@dataclass(frozen=True)
class Cylinder(Formula):
    """Cylinder as the parabola x^2/(2 R), section 4.2.

    Parameters
    ----------
    R : float
        Radius (length).

    Raises
    ------
    BadArgument
        If the radius is not positive.

    Examples
    --------
    >>> mb.Cylinder(R=10).height(np.array([0.0, 1.0])).tolist()
    [0.0, 0.05]
    """

    R: float = field(metadata=checked(require_positive))

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        return np.asarray(x, float) ** 2 / (2 * self.R)


@dataclass(frozen=True)
class Wedge(Formula):
    """Blunt wedge of the height ``slope*abs(x1)``.

    Parameters
    ----------
    slope : float
        Slope of the flanks, tan of their angle (dimensionless).

    Raises
    ------
    BadArgument
        If the slope is not positive.

    Examples
    --------
    >>> mb.Wedge(slope=0.1).height(np.array([-1.0, 0.0])).tolist()
    [0.1, 0.0]
    """

    slope: float = field(metadata=checked(require_positive))

    kinks = (0.0,)

    @property
    def jumps(self) -> tuple[float, ...]:
        return (2 * self.slope,)

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        return self.slope * np.abs(x)


@dataclass(frozen=True)
class Obstacle:
    """Any height, with the places at which it is less than smooth.

    Parameters
    ----------
    height : callable
        Returns the height (length) at an array of x1 (length); inf where there is no obstacle.
    kinks : tuple of float, optional
        Abscissae at which a derivative is discontinuous or has no bound, as that of ``|x|^1.5`` at 0.
    jumps : tuple of float, optional
        By how much the slope jumps at each of them; without it the slope is continuous.

    Raises
    ------
    BadArgument
        If the height is not callable, or the jumps are not as many as the kinks.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    >>> tip = mb.Obstacle(lambda x: np.abs(x)**1.5, kinks=(0.0,))
    >>> mb.Contact(mb.HalfPlane(solid), tip, mb.Microblock()).solve(load=1.0, rtol=1e-5).error_estimate < 1e-5
    True
    """

    height: Callable[[Array], ArrayLike]
    kinks: tuple[float, ...] | None = None
    jumps: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        require(callable(self.height), "height", self.height, "must be a function of an array of x1")
        kinks = require_numbers(kinks=() if self.kinks is None else self.kinks)
        jumps = np.zeros(len(kinks)) if self.jumps is None else require_numbers(jumps=self.jumps)
        words = f"must be one for each of the {len(kinks)} kinks"
        require(len(jumps) == len(kinks), "jumps", self.jumps, words)
        for name, values in (("kinks", kinks), ("jumps", jumps)):
            object.__setattr__(self, name, tuple(values.tolist()))

    @staticmethod
    def from_samples(x: ArrayLike, z: ArrayLike, noise: float | None = None) -> Samples:
        """Returns the obstacle through samples: piecewise linear, and none beyond them.

        Parameters
        ----------
        x, z : arrays (n,), n >= 2
            Abscissae, strictly ascending, and heights (lengths) of the obstacle's lower side, upwards: -z of
            what was measured from above.
        noise : float, optional
            Standard deviation of the heights (length). An rtol far below what it, or leaving out every second
            sample, changes of the pressure is answered with a warning.

        Raises
        ------
        BadArgument
            If the samples are not finite, not ascending or not as many, or the noise is not positive.
        """
        return Samples(cast(Any, x), cast(Any, z), noise)  # which makes tuples of them


@dataclass(frozen=True)
class Punch(Formula):
    """Flat punch -half_width <= x1 <= half_width of the height ``tilt*x1``.

    Parameters
    ----------
    half_width : float
        Half of the width of the punch (length).
    tilt : float
        Slope of its face (dimensionless).

    Raises
    ------
    BadArgument
        If the half-width is not positive, or the tilt no finite number.

    Examples
    --------
    >>> mb.Punch(half_width=1.0).height(np.array([0.0, 2.0])).tolist()      # no obstacle beside it
    [0.0, inf]
    """

    half_width: float = field(metadata=checked(require_positive))
    tilt: float = field(default=0.0, metadata=checked(require_finite))

    @property
    def ends(self) -> Interval:
        return -self.half_width, self.half_width

    @property
    def even(self) -> bool:
        """Whether the face is level, so that left and right are mirror images."""
        return self.tilt == 0

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths); inf beside the punch."""
        x = np.asarray(x, float)
        return np.where(np.abs(x) <= self.half_width, self.tilt * x, np.inf)


@dataclass(frozen=True)
class Samples:
    """Sampled profile: piecewise linear through (x, z), no obstacle outside.

    The slope jumps at each sample inside, where microblocks have a peak of pressure. A smooth curve is better
    given as a function height(x).

    Examples
    --------
    >>> samples = mb.Obstacle.from_samples(x=np.array([-1.0, 0.0, 1.0]), z=np.array([0.5, 0.0, 0.5]))
    >>> samples.height(np.array([0.5])).tolist()
    [0.25]
    """

    x: tuple[float, ...]
    z: tuple[float, ...]
    noise: float | None = None

    formulas = True

    def __post_init__(self) -> None:
        for name, values in (("x", self.x), ("z", self.z)):
            words = "is a function: hand it to Contact itself, where it serves as obstacle as it is"
            require(not callable(values), name, values, words)
            object.__setattr__(self, name, tuple(require_numbers(**{name: values}).tolist()))
        x, rises = self.x, np.diff(self.x) > 0
        words = "must be a strictly ascending sequence of at least two numbers"
        if not rises.all():
            i = int(np.argmin(rises))
            words += f"; entry {i + 1} is {x[i + 1]:g} after {x[i]:g}: sort it, average duplicates"
        require(len(x) >= 2 and rises.all(), "x", x, words)
        require(len(self.z) == len(x), "z", self.z, f"must hold {len(x)} finite numbers, one for each x")
        if self.noise is not None:
            require_positive(noise=self.noise)

    @cached_property
    def _profile(self) -> Array:
        return np.array((self.x, self.z))

    @property
    def kinks(self) -> tuple[float, ...]:
        return self.x[1:-1]

    @property
    def jumps(self) -> tuple[float, ...]:
        """Jumps of the slope; 0 where they are rounding."""
        lengths, rises = np.diff(self._profile)
        jumps = np.diff(rises / lengths)
        # of four heights, two to a slope, and of the abscissae
        rounding = 8 * np.finfo(float).eps * np.abs(self._profile[1]).max()
        return tuple(np.where(np.abs(jumps) * lengths.min() > rounding, jumps, 0.0))

    @property
    def ends(self) -> Interval:
        return self.x[0], self.x[-1]

    def alike(self) -> list[Samples]:
        """Returns profiles that the data cannot tell from this one: without every second sample, and with
        heights moved up and down in turn by the noise, if it is known.
        """
        fewer = Samples((*self.x[:-1:2], self.x[-1]), (*self.z[:-1:2], self.z[-1]))
        moved = self._profile[1] + (self.noise or 0.0) * (-1.0) ** np.arange(len(self.x))
        return [fewer, *[Samples(self.x, cast(Any, moved))] * (self.noise is not None)]

    def __repr__(self) -> str:
        return f"Samples({len(self.x)} points)"

    def height(self, x: Array) -> Array:
        """Returns the height at x, array (n,) (lengths); inf outside the samples."""
        places, heights = self._profile
        return np.interp(x, places, heights, left=np.inf, right=np.inf)


@dataclass(frozen=True)
class Wave(Checked):
    """Wavy surface, whose lowest points are at 0, +-wavelength, ...

    Parameters
    ----------
    amplitude, wavelength : float
        Half of the height between trough and crest, and the distance of two crests (lengths).

    Raises
    ------
    BadArgument
        If one of them is not positive.

    Examples
    --------
    >>> mb.Wave(amplitude=0.01, wavelength=1.0).height(np.array([0.0, 1.0])).tolist()
    [0.0, 0.0]
    """

    amplitude: float = field(metadata=checked(require_positive))
    wavelength: float = field(metadata=checked(require_positive))

    @property
    def period(self) -> float:
        return self.wavelength

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        return self.amplitude * (1 - np.cos(2 * np.pi * np.asarray(x, float) / self.wavelength))


@dataclass(frozen=True)
class SelfAffine(Checked):
    period: float = field(metadata=checked(require_positive))
    slope: float = field(metadata=checked(require_positive))
    hurst: float = field(default=0.8, metadata=checked(require_finite))
    waves: tuple[int, int] = (4, 256)
    seed: int = field(default=1, metadata=checked(require_whole, 0))

    most = 1_000_000

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 <= self.hurst <= 1, "hurst", self.hurst, "must lie between 0 and 1")
        try:
            longest, shortest = self.waves
            require_whole(1, waves=longest)
            require_whole(longest, self.most, waves=shortest)
        except (TypeError, ValueError) as failure:
            words = f"must be two whole numbers, 1 <= longest <= shortest <= {self.most}"
            raise BadArgument("waves", self.waves, words) from failure

    def _of_waves(self, m: Array, falling: float) -> AnyArray:
        """Returns the amplitudes of wavenumbers m, array (k,), like m^-falling, with random phases."""
        phases = 2 * np.pi * np.random.default_rng(self.seed).random(len(m))
        shape = np.where(m >= self.waves[0], m**-falling, 0.0) * np.exp(1j * phases)
        mean_square = np.sum(np.abs(2 * np.pi * m / self.period * shape) ** 2) / 2
        return self.slope / np.sqrt(mean_square) * shape


@dataclass(frozen=True)
class Rough(SelfAffine):
    """Self-affine profile of a period: cosines of random phases, amplitudes like (wavenumber)^-(hurst + 1/2).

    Parameters
    ----------
    period : float
        Length after which the profile repeats.
    slope : float
        Root mean square of the slope (dimensionless).
    hurst : float
        Hurst exponent, from 0 to 1.
    waves : (int, int)
        Numbers of the longest and of the shortest waves in the period.
    seed : int
        Seed of the phases.

    Raises
    ------
    BadArgument
        If a value is out of range.

    Examples
    --------
    >>> rough = mb.Rough(period=1.0, slope=0.1, seed=7)
    >>> x = np.array([0.2, 1.2])
    >>> bool(np.ptp(rough.height(x)) < 1e-12)      # it repeats
    True
    """

    @cached_property
    def amplitudes(self) -> AnyArray:
        """Complex amplitudes of exp(2 pi i m x/period), from the longest to the shortest wave."""
        return self._of_waves(np.arange(self.waves[0], self.waves[1] + 1.0), self.hurst + 0.5)

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        phase = np.exp(2j * np.pi * np.asarray(x, float) / self.period)
        return (polyval(phase, self.amplitudes) * phase ** self.waves[0]).real


def heights(obstacle: Any, *x: Array) -> Array:
    """Returns the heights of an obstacle at x, array (n,), or over a surface at (x1, x2) (lengths); raises
    BadArgument if it does not return a number, or inf, for each place.
    """
    above = _returned_for_each(obstacle, *x)
    wrong = np.isnan(above) | (above == -np.inf)
    if np.any(wrong):
        raise BadArgument(
            "obstacle",
            obstacle,
            f"its height(x) is {above[wrong][0]:g} at x = {x[0][wrong][0]:.4g}: must be a number, "
            "or inf where there is no obstacle",
        )
    return np.where(above > LARGEST, np.inf, above)  # products of what is that high would overflow


def _returned_for_each(obstacle: Any, *x: Array) -> Array:
    """Returns what an obstacle returns; raises BadArgument unless it is a number for each place."""
    above = returned(obstacle, *x)
    words = "its height(x) must return one number (or inf) for each x of an array"
    require(above.shape == np.shape(x[0]), "obstacle", obstacle, words)
    return above


def jumps_of(obstacle: Any) -> Iterable[tuple[float, float]]:
    """Returns (place, jump of the slope) of the slope discontinuities that an obstacle names."""
    return zip(getattr(obstacle, "kinks", ()), getattr(obstacle, "jumps", ()))


def repeated(obstacle: object, period: float) -> Callable[..., Array]:
    """Returns the height of an obstacle and its images along the line, or along both axes."""

    def height(*x: Array) -> Array:
        return heights(obstacle, *((along + period / 2) % period - period / 2 for along in x))

    return height


def check(obstacle: ObstacleLike, in_space: bool) -> None:
    """Raises BadArgument unless an obstacle has a height that takes arrays, and kinks that are numbers."""
    if in_space or returned(obstacle, np.zeros(2)).shape != (2,):
        heights(obstacle, *np.zeros((1 + in_space, 2)))
    for name in ("kinks", "jumps", "ends"):
        given = getattr(obstacle, name, ())
        words = "must be a tuple of numbers; leave it out where there are none"
        own = require_floats(words, **{name: given})
        require(own.ndim == 1 and not np.isnan(own).any(), name, given, words)


def scales(ell: float) -> Array:
    """Returns the places (lengths), ascending and symmetric, at which what a user gives is looked at."""
    right = ell * np.geomspace(1e-3, 1e5, 65)
    return np.concatenate((-right[::-1], [0.0], right))


def named_places(obstacle: ObstacleLike) -> Array:
    """Returns the finite slope discontinuities and ends that an obstacle names, array (k,)."""
    places = [*getattr(obstacle, "kinks", ()), *(getattr(obstacle, "ends", ()) or ())]
    return np.array([place for place in places if np.isfinite(place)], float)


def quiet_heights(obstacle: ObstacleLike, *x: Array) -> Array:
    """Returns heights at places that are looked at for their scale alone: inf where there is no number."""
    above = _returned_for_each(obstacle, *x)
    return np.where(np.abs(above) <= LARGEST, above, np.where(above < 0, -np.inf, np.inf))


def check_lowest(obstacle: ObstacleLike) -> None:
    """Raises BadArgument unless an obstacle has a lowest place, on all scales of double precision."""
    away = np.logspace(-45, 45, 361)
    sides = quiet_heights(obstacle, -away), quiet_heights(obstacle, away)
    lowest = min(side.min() for side in sides)
    for way, above in zip((-1, 1), sides):
        rises = np.any(above[-8:] >= above[-9:-1]) and above[-1] > -np.inf
        words = (
            "must have a lowest place, but its height(x) falls towards "
            f"x = {way * np.inf:g} as far as numbers go: give it one"
        )
        require(rises or above[-1] > lowest, "obstacle", obstacle, words)


def returned(obstacle: Any, *x: Array) -> Array:
    name = getattr(obstacle, "__name__", "")
    require(not isinstance(obstacle, type), "obstacle", obstacle, f"must be an instance, {name}(...)")
    line, height = len(x) == 1, getattr(obstacle, "height", obstacle)
    places = "x" if line else "x1, x2"
    words = f"must have a method height({places}), or be a callable height({places})"
    require(callable(height), "obstacle", obstacle, words)

    def above(*x: Array) -> Array:
        found, shape = real(height(*x)), np.shape(x[0])
        if not line:
            return np.array(np.broadcast_to(found, shape))
        left, right = getattr(obstacle, "ends", None) or (-np.inf, np.inf)
        return np.where((x[0] < left) | (x[0] > right), np.inf, found) if found.shape == shape else found

    return evaluated(
        above,
        *x,
        name="obstacle",
        given=obstacle,
        allowed="its height(x) must take an array of x; np.vectorize(height, otypes=[float]) serves a "
        "function of one number, a HalfSpace one of (x1, x2)"
        if line
        else "must have a height(x1, x2) of two arrays that returns as many numbers; of a height over a "
        "line write lambda x, y: height(x) + 0*y",
    )


def evaluated(function: Callable[..., Array], *x: Array, name: str, given: object, allowed: str) -> Array:
    """Returns what a user's function returns at places of one shape; raises BadArgument where it fails."""
    if not np.size(x[0]):  # np.vectorize without `otypes` fails for no places
        return np.zeros(np.shape(x[0]))
    try:
        with np.errstate(all="ignore"):  # callers look at what is no number
            return function(*map(np.array, x))  # copies: a user's function may write into them
    except MicroblockError:
        raise
    except Exception as failure:  # whatever the user's function does
        raise BadArgument(name, given, f"{allowed} ({shortened(repr(failure))})") from failure


def real(values: ArrayLike) -> Array:
    """Returns values as an array of floats; raises TypeError for complex ones."""
    found = np.asarray(values)
    if found.dtype.kind == "c":
        raise TypeError("it returns complex numbers")
    return found.astype(float)


def gap(obstacle: ObstacleLike, points: Array, normals: Array) -> Array:
    """Returns the initial gap along the unit normals of points of a surface (lengths), arrays (n, 2):
    ``(height(x1) - x2) n2``, for n = e2 that of section 4.2; ``inf`` where there is no obstacle above, or the
    surface is steeper than 60 degrees.
    """
    places = points[:, 0]
    rounding = 8 * np.finfo(float).eps * np.abs(places).max(initial=0.0)
    for end in getattr(obstacle, "ends", None) or ():  # below which a place is whatever the unit of length
        places = np.where(np.abs(places - end) <= rounding, end, places)
    above = heights(obstacle, places)
    seen = normals[:, 1] > STEEPEST
    return np.where(seen, (above - points[:, 1]) * np.where(seen, normals[:, 1], 1.0), np.inf)
