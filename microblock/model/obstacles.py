"""Rigid obstacles: their height over the plane x2 = 0, and the gap that they leave to a point.

`RigidObstacle` says what an obstacle offers. Of a user's obstacle, a callable height or an object with one,
`as_obstacle` makes a `RigidObstacle`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from ..errors import (
    LARGEST,
    BadArgument,
    Checked,
    MicroblockError,
    StandsFor,
    checked,
    real_numbers,
    require,
    require_finite,
    require_flag,
    require_floats,
    require_heights,
    require_numbers,
    require_positive,
    require_whole,
    shortened,
)
from . import roughness
from .intervals import runs
from .material import Varying
from .roughness import Statistics
from .types import AnyArray, Array, Flags, Interval, ObstacleLike

STEEPEST = 0.5  # n2 of the steepest surface that a height can touch
SIDEWAYS = 0.05  # of a normal gap, which an approach along x2 hardly changes beyond it


class RigidObstacle:
    """What an obstacle offers to solvers, with defaults; a user's obstacle may have it as base.

    1. ``height(x1)``, over a surface ``height(x1, x2)``, takes arrays of one shape (lengths) and returns x2
       (x3) of the lower surface in this shape, inf where there is no obstacle.
    2. Along a line it names the abscissae at which the slope or a higher derivative is discontinuous, and the
       jumps of the slope there; places that it does not name are looked for.
    3. At its ends the height is finite, beyond them there is no obstacle.
    4. What it says of itself holds: `Contact` checks `even` and `jumps`.
    5. ``normal_gap(points, normals)``, if it has one, returns the gaps (lengths), array (n,), along the unit
       normals of points of a body, arrays (n, dim), inf where nothing is there. It stands for the rule of
       heights, `initial_gap`, where the surface turns through more than 60 degrees, as of a pin in a hole.

    Attributes
    ----------
    kinks : tuple of float
        Abscissae, ascending, at which the slope or a higher derivative is discontinuous.
    jumps : tuple of float
        By how much the slope jumps at each of them; none where it nowhere jumps.
    ends : tuple of float
        Left and right edge of the obstacle, or of each of its pieces; none where it goes on.
    formulas : bool
        Whether the height is a polynomial between all of these places.
    even : bool
        Whether the obstacle is symmetric about x1 = 0.
    period : float or None
        Length after which it repeats.
    """

    kinks: Any = ()  # each a value, or a property
    jumps: Any = ()
    ends: Any = ()
    formulas: Any = False
    even: Any = False
    period: Any = None
    normal_gap: Any = None

    if TYPE_CHECKING:

        @property
        def height(self) -> Callable[..., ArrayLike]:
            """As rule 1 says; no default, which a field `height` of a dataclass would take."""


@dataclass(frozen=True, repr=False)
class GivenObstacle(StandsFor, RigidObstacle):
    """A user's obstacle, a callable height or an object with one, and what it says of itself."""

    given: Any

    @property
    def height(self) -> Callable[..., ArrayLike]:
        if hasattr(self.given, "height"):
            return cast(Callable[..., ArrayLike], self.given.height)
        return cast(Callable[..., ArrayLike], self.given)


def asks_another(kind: type, offered: Callable[..., Any]) -> None:
    """Makes each attribute of `RigidObstacle` a property of a class, ``offered(obstacle, name)``."""
    for name in RigidObstacle.__annotations__:
        setattr(kind, name, property(partial(offered, name=name)))


def _of_given(obstacle: GivenObstacle, name: str) -> Any:
    """Returns what the user's obstacle says at the time, or the default."""
    default = getattr(RigidObstacle, name)
    value = getattr(obstacle.given, name, default)
    if isinstance(default, tuple) and isinstance(value, np.ndarray) and value.ndim == 1:
        return tuple(value.tolist())  # which is true where it is not empty
    return value


asks_another(GivenObstacle, _of_given)


def as_obstacle(given: Any) -> RigidObstacle:
    """Returns an obstacle as it is, or the `GivenObstacle` of a callable height or an object with one."""
    if isinstance(given, RigidObstacle) and hasattr(given, "height"):
        return given
    return GivenObstacle(given)


class Formula(RigidObstacle, Checked):
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
class Obstacle(RigidObstacle):
    """Any height, with the places at which it is less than smooth.

    Parameters
    ----------
    height : callable
        Returns the height (length) at an array of x1 (length); inf where there is no obstacle.
    kinks : tuple of float, optional
        Abscissae at which a derivative is discontinuous or has no bound, as that of ``|x|^1.5`` at 0.
    jumps : tuple of float, optional
        By how much the slope jumps at each of them; without it that is measured.

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
        kinks = np.empty(0)
        if self.kinks is not None:
            kinks = require_numbers(kinks=self.kinks)
        jumps = np.zeros(len(kinks))
        if self.jumps is not None:
            jumps = require_numbers(jumps=self.jumps)
        words = f"must be one for each of the {len(kinks)} kinks"
        require(len(jumps) == len(kinks), "jumps", self.jumps, words)
        for name, values in (("kinks", kinks), ("jumps", jumps)):
            object.__setattr__(self, name, tuple(values.tolist()))

    @staticmethod
    def from_samples(x: ArrayLike, z: ArrayLike, noise: float | None = None) -> Samples:
        """Returns the obstacle through samples: a straight line between two neighbours that are both there,
        and no obstacle (inf) beyond them and in holes.

        Parameters
        ----------
        x, z : arrays (n,), n >= 2
            Abscissae, strictly ascending (or descending), and heights (lengths) of the obstacle's lower side,
            upwards: -z of what was measured from above. Where z is masked or inf there is no obstacle; where
            it is NaN as well, which the state's `warnings` say. A hole reaches from the last sample before it
            to the first behind it; a sample between two holes is left out.
        noise : float, optional
            Standard deviation of the heights (length). An rtol far below what it, or leaving out every second
            sample, changes of the pressure is answered with a warning.

        Raises
        ------
        BadArgument
            If abscissae are not finite or neither ascend nor descend, heights are -inf, unsigned integers or
            not as many, no two neighbours have one, or the noise is not positive.
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
        """Whether the face is horizontal, so that left and right are mirror images."""
        return self.tilt == 0

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths); inf beside the punch."""
        x = np.asarray(x, float)
        return np.where(np.abs(x) <= self.half_width, self.tilt * x, np.inf)


@dataclass(frozen=True)
class Samples(RigidObstacle):
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
    unknown: int = 0

    formulas = True

    def __post_init__(self) -> None:
        for name, values in (("x", self.x), ("z", self.z)):
            words = "is a function: hand it to Contact itself, where it serves as obstacle as it is"
            require(not callable(values), name, values, words)
        x = require_numbers(x=self.x)
        z = require_numbers(True, z=self.z)
        require_heights(z=self.z)
        rightwards = not (len(x) > 1 and np.all(np.diff(x) < 0))
        way = slice(None, None, 1 if rightwards else -1)
        object.__setattr__(self, "x", tuple(x[way].tolist()))
        object.__setattr__(self, "z", tuple(np.where(np.isnan(z), np.inf, z)[way].tolist()))
        object.__setattr__(self, "unknown", self.unknown + int(np.count_nonzero(np.isnan(z))))
        self._require_profile()
        if self.noise is not None:
            require_positive(noise=self.noise)

    def _require_profile(self) -> None:
        """Raises BadArgument unless abscissae ascend, there is a height for each, and a line between two."""
        rises = np.diff(self.x) > 0
        words = "must be a strictly ascending sequence of at least two numbers"
        if not rises.all():
            i = int(np.argmin(rises))
            words += f"; entry {i + 1} is {self.x[i + 1]:g} after {self.x[i]:g}: sort it, average duplicates"
        require(len(self.x) >= 2 and rises.all(), "x", self.x, words)
        words = f"must hold {len(self.x)} finite numbers, one for each x"
        require(len(self.z) == len(self.x), "z", self.z, words)
        words = "must have two neighbours that are neither masked, NaN nor inf: a straight line joins these"
        require(self._lines.any(), "z", self.z, words)

    @cached_property
    def _profile(self) -> Array:
        """Abscissae and heights, 0 where there is none, array (2, n)."""
        heights = np.array(self.z)
        return np.array((self.x, np.where(np.isinf(heights), 0.0, heights)))

    @cached_property
    def _lines(self) -> Flags:
        """Whether a straight line joins each sample with the next, array (n - 1,): both are there."""
        measured = np.isfinite(self.z)
        return measured[:-1] & measured[1:]

    @cached_property
    def _inner(self) -> Flags:
        """Whether a sample lies between two lines, array (n - 2,)."""
        return self._lines[:-1] & self._lines[1:]

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        return tuple(self._profile[0, 1:-1][self._inner].tolist())

    @cached_property
    def jumps(self) -> tuple[float, ...]:
        """Jumps of the slope; 0 where they are rounding."""
        lengths, rises = np.diff(self._profile)
        jumps = np.diff(rises / lengths)[self._inner]
        # of four heights, two to a slope, and of the abscissae
        rounding = 8 * np.finfo(float).eps * np.abs(self._profile[1]).max()
        return tuple(np.where(np.abs(jumps) * lengths.min() > rounding, jumps, 0.0))

    @cached_property
    def ends(self) -> tuple[float, ...]:
        return tuple(end for first, last in runs(self._lines) for end in (self.x[first], self.x[last + 1]))

    def alike(self) -> list[Samples]:
        """Returns profiles that the data cannot tell from this one: without every second sample, except for
        those next to a hole, and with heights moved up and down in turn by the noise, if it is known.
        """
        x = np.array(self.x)
        heights = np.array(self.z)
        measured = np.isfinite(heights)
        fewer = ~measured
        for first, last in runs(measured):
            fewer[first:last:2] = True
            fewer[last] = True
        profiles = [Samples(cast(Any, x[fewer]), cast(Any, heights[fewer]))]
        if self.noise is not None:
            moved = heights + self.noise * (-1.0) ** np.arange(len(x))
            profiles.append(Samples(self.x, cast(Any, moved)))
        return profiles

    def closed(self, period: float) -> Samples:
        """Returns the profile of a whole period: where the last sample is missing, the first one follows."""
        seam = self.x[0] + period - self.x[-1]
        if not 1e-6 * period < seam <= (1 + 1e-6) * np.diff(self.x).max():
            return self
        return Samples((*self.x, self.x[0] + period), (*self.z, self.z[0]), self.noise)

    def __repr__(self) -> str:
        return f"Samples({len(self.x)} points)"

    def height(self, x: Array) -> Array:
        """Returns the height at x, array (n,) (lengths); inf outside the samples and in holes."""
        places, heights = self._profile
        above = np.interp(x, places, heights, left=np.inf, right=np.inf)
        if self._lines.all():
            return above
        lines = np.append(self._lines, False)  # before the first sample and behind the last there is none
        after, before = (np.searchsorted(places, x, side) - 1 for side in ("right", "left"))
        return np.where(lines[after] | lines[before], above, np.inf)


@dataclass(frozen=True)
class Wave(RigidObstacle, Checked):
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


Affine = TypeVar("Affine", bound="SelfAffine")


@dataclass(frozen=True)
class SelfAffine(RigidObstacle, Checked):
    """Base of self-affine surfaces of a period."""

    period: float = field(metadata=checked(require_positive))
    slope: float = field(metadata=checked(require_positive))
    hurst: float = field(default=0.8, metadata=checked(require_finite))
    waves: tuple[int, int] = (4, 256)
    seed: int = field(default=1, metadata=checked(require_whole, 0))
    plateau: int = field(default=1, metadata=checked(require_whole, 1))

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

    @property
    def mean_squares(self) -> list[float]:
        """Those of heights, and of their first and second derivatives."""
        raise NotImplementedError

    @classmethod
    def from_spectrum(
        cls: type[Affine],
        period: float,
        hurst: float = 0.8,
        rms_slope: float | None = None,
        rms_height: float | None = None,
        roll_off: int = 2,
        cut_off: int = 32,
        seed: int = 1,
    ) -> Affine:
        """Returns the surface of a power spectral density that is constant from the period to `roll_off`,
        falls from there like a self-affine one, and ends at `cut_off`.

        Parameters
        ----------
        period : float
            Length after which the surface repeats.
        hurst : float
            Hurst exponent, from 0 to 1.
        rms_slope, rms_height : float
            Root mean square of the slope or of the heights (length), one of them.
        roll_off, cut_off : int
            Wavenumbers, in waves to the period.
        seed : int

        Raises
        ------
        BadArgument
            If a value is out of range, or not one of `rms_slope` and `rms_height` is given.

        Examples
        --------
        >>> rough = mb.RoughSurface.from_spectrum(1.0, rms_height=0.01, roll_off=4, cut_off=20)
        >>> round(rough.statistics()["rms_height"], 12), rough.waves
        (0.01, (1, 20))
        """
        require_positive(period=period)
        words = "must be given, or rms_height, and not both"
        require((rms_slope is None) != (rms_height is None), "rms_slope", rms_slope, words)
        require_whole(1, roll_off=roll_off)
        require_whole(roll_off, cls.most, cut_off=cut_off)
        slope = 1.0 if rms_slope is None else rms_slope
        require_positive(rms_slope=slope)
        surface = cls(period, slope, hurst, (1, cut_off), seed, roll_off)
        if rms_height is None:
            return surface
        require_positive(rms_height=rms_height)
        return replace(surface, slope=rms_height / surface.mean_squares[0] ** 0.5)

    def _of_waves(self, m: Array, falling: float) -> AnyArray:
        """Returns the amplitudes of wavenumbers m, array (k,), like m^-falling, with random phases."""
        phases = 2 * np.pi * np.random.default_rng(self.seed).random(len(m))
        sizes = np.where(m >= self.waves[0], np.maximum(m, self.plateau) ** -falling, 0.0)
        shape = sizes * np.exp(1j * phases)
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
    plateau : int
        Wavenumber, in waves to the period, below which the power spectral density is constant.

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

    @property
    def mean_squares(self) -> list[float]:
        square = (2 * np.pi / self.period * np.arange(self.waves[0], self.waves[1] + 1.0)) ** 2
        power = np.abs(self.amplitudes) ** 2 / 2
        return [float(np.sum(square**k * power)) for k in (0, 1, 2)]

    def statistics(self) -> Statistics:
        """Returns rms_height, rms_slope, rms_curvature (the second derivative) and nayak, Nayak's parameter,
        exact for these waves.
        """
        return roughness.of_profile(*self.mean_squares)

    @staticmethod
    def from_heights(z: ArrayLike, spacing: float) -> Samples:
        """Returns the obstacle of measured heights, equally spaced about the origin: `Obstacle.from_samples`
        of their abscissae.

        Parameters
        ----------
        z : array (n,)
            Heights (length) of the obstacle's lower side, upwards; masked, NaN or inf where there is none.
        spacing : float
            Distance of neighbours (length).

        Raises
        ------
        BadArgument
            As of `Obstacle.from_samples`, and if the spacing is not positive.

        Examples
        --------
        >>> mb.Rough.from_heights([0.1, 0.0, 0.1], spacing=0.5).x
        (-0.5, 0.0, 0.5)
        """
        require_positive(spacing=spacing)
        count = len(require_numbers(True, z=z))
        return Obstacle.from_samples((np.arange(count) - (count - 1) / 2) * spacing, z)

    def height(self, x: ArrayLike) -> Array:
        """Returns the height at x, array (n,) (lengths)."""
        phase = np.exp(2j * np.pi * np.asarray(x, float) / self.period)
        return (polyval(phase, self.amplitudes) * phase ** self.waves[0]).real


def heights(obstacle: Any, *x: Array) -> Array:
    """Returns the heights of an obstacle at x, array (n,), or over a surface at (x1, x2) (lengths); raises
    BadArgument if it does not return a number, or inf, for each place.
    """
    above = _returned_for_each(obstacle, *x)
    good = above > -np.inf
    if not good.all():
        wrong = ~good
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
    named = as_obstacle(obstacle)
    return zip(named.kinks, named.jumps)


def check(obstacle: ObstacleLike, in_space: bool) -> None:
    """Raises BadArgument unless an obstacle has a height that takes arrays, and attributes that fit."""
    if not isinstance(obstacle, type):  # which is refused as that
        _check_attributes(as_obstacle(obstacle))
    if in_space or returned(obstacle, np.zeros(2)).shape != (2,):
        heights(obstacle, *np.zeros((1 + in_space, 2)))


def _check_attributes(obstacle: RigidObstacle) -> None:
    """Raises BadArgument unless all but the height of an obstacle is as rules 2 to 4 say."""
    kinks = _numbers_of(kinks=obstacle.kinks)
    jumps = _numbers_of(jumps=obstacle.jumps)
    words = f"must be finite, one for each of the {len(kinks)} kinks, or none"
    as_many = len(jumps) in (0, len(kinks))
    require(as_many and np.isfinite(jumps).all(), "jumps", obstacle.jumps, words)
    ends = _numbers_of(ends=obstacle.ends)
    widths = np.diff(ends)
    words = "must be the left and the right end of each piece of the obstacle, ascending"
    good = len(ends) % 2 == 0 and np.all(widths >= 0) and np.all(widths[::2] > 0)
    require(good, "ends", obstacle.ends, words)
    require_flag(even=obstacle.even, formulas=obstacle.formulas)
    if obstacle.period is not None:
        require_positive(period=obstacle.period)


def _numbers_of(**values: Any) -> Array:
    """Returns an array (k,) of the numbers, inf included, that an obstacle names; raises BadArgument of
    others.
    """
    ((name, value),) = values.items()
    words = "must be a tuple of numbers; leave it out where there are none"
    numbers: Array = require_floats(words, **values)
    require(numbers.ndim == 1 and not np.isnan(numbers).any(), name, value, words)
    return numbers


def scales(ell: float) -> Array:
    """Returns the places (lengths), ascending and symmetric, at which what a user gives is looked at."""
    right = ell * np.geomspace(1e-3, 1e5, 65)
    return np.concatenate((-right[::-1], [0.0], right))


def named_places(obstacle: ObstacleLike) -> Array:
    """Returns the finite slope discontinuities and ends that an obstacle names, and the middles between ends,
    where there is an obstacle whatever rounding makes of its ends, array (k,).
    """
    named = as_obstacle(obstacle)
    ends = named.ends or ()
    middles = [left + (right - left) / 2 for left, right in zip(ends[::2], ends[1::2])]
    places = [*named.kinks, *ends, *middles]
    return np.array([place for place in places if np.isfinite(place)], float)


def quiet_heights(obstacle: ObstacleLike, *x: Array) -> Array:
    """Returns heights at places that are looked at for their scale alone: inf where there is no number."""
    above = _returned_for_each(obstacle, *x)
    return np.where(np.abs(above) <= LARGEST, above, np.where(above < 0, -np.inf, np.inf))


def check_lowest(obstacle: ObstacleLike) -> None:
    """Raises BadArgument unless an obstacle has a lowest place, on all scales of double precision."""
    distances = np.logspace(-45, 45, 361)
    sides = quiet_heights(obstacle, -distances), quiet_heights(obstacle, distances)
    lowest = min(side.min() for side in sides)
    for way, above in zip((-1, 1), sides):
        rises = np.any(above[-8:] >= above[-9:-1]) and above[-1] > -np.inf
        words = (
            "must have a lowest place, but its height(x) falls towards "
            f"x = {way * np.inf:g} as far as numbers go: give it one"
        )
        require(rises or above[-1] > lowest, "obstacle", obstacle, words)


def returned(obstacle: Any, *x: Array) -> Array:
    if isinstance(obstacle, type):
        raise BadArgument("obstacle", obstacle, f"must be an instance, {obstacle.__name__}(...)")
    if not isinstance(obstacle, RigidObstacle) and isinstance(obstacle, Varying):  # a Protocol: slow to ask
        words = "must be a function of arrays, lambda x: x**2; NGSolve's functions take points of a mesh"
        raise BadArgument("obstacle", obstacle, words)
    line = len(x) == 1
    places = "x" if line else "x1, x2"
    words = f"must have a method height({places}), or be a callable height({places})"
    offered = as_obstacle(obstacle)
    require(callable(offered.height), "obstacle", obstacle, words)
    ends = offered.ends or ()

    def above(*x: Array) -> Array:
        shape = np.shape(x[0])
        if not line:  # obstacles over a surface have no ends
            values: Array = real_numbers(offered.height(*x), masked=np.inf)
            return values if values.shape == shape else np.array(np.broadcast_to(values, shape))
        x_given = x[0].copy() if ends else x[0]  # a place, which height may change
        found: Array = real_numbers(offered.height(*x), masked=np.inf)
        if not ends or found.shape != shape:
            return found
        # an odd number of ends, those of its own piece, lies on the left
        inside = sum(np.searchsorted(ends, x_given, side) % 2 for side in ("left", "right")) > 0
        return np.where(inside, found, np.inf)

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


def initial_gap(obstacle: ObstacleLike, points: Array, normals: Array) -> Array:
    """Returns the initial gap along the unit normals of points of a surface (lengths), arrays (..., dim):
    ``(height(x1) - x2) n2``, for n = e2 that of section 4.2, or ``(height(x1, x2) - x3) n3``; ``inf`` where
    there is no obstacle above, or the surface is steeper than 60 degrees. An obstacle may have a `normal_gap`
    of its own.
    """
    if as_obstacle(obstacle).normal_gap is not None:
        return _normal_gap(obstacle, points, normals)
    *places, ordinate = np.moveaxis(points, -1, 0)
    return along_normals(clearance(obstacle, ordinate, *places), normals)


def clearance(obstacle: ObstacleLike, ordinate: Array | float, *places: Array) -> Array:
    """Returns vertical gaps of points with an ordinate at x1, or x1 and x2, arrays (...) (lengths)."""
    if len(places) == 1:
        places = (_moved_to_ends(obstacle, places[0]),)
    return heights(obstacle, *places) - ordinate


def _normal_gap(obstacle: ObstacleLike, points: Array, normals: Array) -> Array:
    """Returns the gap of an obstacle with a rule of its own, as `initial_gap`; ``inf`` also where the surface
    faces sideways or downwards; raises BadArgument where it overlaps there.
    """
    rule = as_obstacle(obstacle).normal_gap
    shape = points.shape[:-1]
    words = "its normal_gap(points, normals) must return one number (or inf) for each of the points (n, dim)"

    def returned_gaps(_: Array) -> Array:
        flat = np.array((points, normals)).reshape(2, -1, points.shape[-1])
        return real_numbers(rule(*flat), masked=np.inf).reshape(shape)

    gaps = evaluated(returned_gaps, points[..., 0], name="obstacle", given=obstacle, allowed=words)
    require(not np.any(np.isnan(gaps) | (gaps == -np.inf)), "obstacle", obstacle, words)
    upwards = normals[..., -1] > SIDEWAYS
    words = "must not overlap a body where its surface faces sideways or downwards: no load holds it there"
    require(not np.any(gaps[~upwards] < 0), "obstacle", obstacle, words)
    return np.where(upwards, gaps, np.inf)


def along_normals(clearance: Array, normals: Array) -> Array:
    """Returns gaps along unit normals, arrays (..., dim), from vertical ones, array (...) (lengths)."""
    upwards = normals[..., -1]
    can_touch = upwards > STEEPEST
    return np.where(can_touch, clearance * np.where(can_touch, upwards, 1.0), np.inf)


def _moved_to_ends(obstacle: ObstacleLike, x: Array) -> Array:
    """Returns abscissae, those at an end of the obstacle but for rounding moved there, array (n,)."""
    rounding = 8 * np.finfo(float).eps * np.abs(x).max(initial=0.0)  # whatever the unit of length
    for end in as_obstacle(obstacle).ends or ():
        x = np.where(np.abs(x - end) <= rounding, end, x)
    return x
