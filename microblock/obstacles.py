"""Rigid obstacles: their height over the plane x2 = 0, and the gap that they leave to a point.

An obstacle's ``height(x)`` takes an array of x1 and returns x2 of its lower surface, ``inf``
where there is no obstacle. It approaches along -e2. Any callable height serves as well. An obstacle may have `kinks`, a
tuple, ascending: the abscissae at which the slope, or a higher derivative, jumps; `jumps`, as long: by how much the slope does;
`ends`, a pair: those beyond which there is no obstacle; `formulas`, True: between all of these the height is a polynomial, and
need not be looked at.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .errors import BadArgument, MicroblockError, require_finite, require_positive, require_whole

SCALES = np.geomspace(1e-3, 1e5, 65)     # of ell, at which an obstacle of a half-plane is looked at
TAIL = 9            # outermost of them, over which an obstacle without a lowest point falls all the way
MOST_WAVES = 10**6
STEEPEST = 0.5      # n2 of the steepest surface that can touch


@dataclass(frozen=True)
class Plane:
    """Horizontal plane at x2 = level (length).

    Examples
    --------
    >>> mb.Plane(level=0.1).height(np.zeros(2)).tolist()
    [0.1, 0.1]
    """

    level: float = 0.0

    formulas = True

    def __post_init__(self):
        require_finite(level=self.level)

    def height(self, x):
        return np.full(np.shape(x), float(self.level))


@dataclass(frozen=True)
class Cylinder:
    """Cylinder of radius R (length) as the parabola x^2/(2 R), section 4.2.

    Examples
    --------
    >>> mb.Cylinder(R=10).height(np.array([0.0, 1.0])).tolist()
    [0.0, 0.05]
    """

    R: float

    formulas = True

    def __post_init__(self):
        require_positive(R=self.R)

    def height(self, x):
        return np.asarray(x, float)**2/(2*self.R)


@dataclass(frozen=True)
class Wedge:
    """Blunt wedge of the height ``slope*abs(x1)``: `slope` is that of its flanks, tan of their angle (dimensionless).

    Examples
    --------
    >>> mb.Wedge(slope=0.1).height(np.array([-1.0, 0.0])).tolist()
    [0.1, 0.0]
    """

    slope: float

    kinks = (0.0,)

    @property
    def jumps(self):
        return (2*self.slope,)

    formulas = True

    def __post_init__(self):
        require_positive(slope=self.slope)

    def height(self, x):
        return self.slope*np.abs(x)


@dataclass(frozen=True)
class Shape:
    """Any height, with the places at which it is less than smooth: there the computation puts its nodes.

    A bare callable height serves as well: `Contact` looks for its singular points, and finds what is not too faint.

    Parameters
    ----------
    height : callable, of an array of x1 (length)
    kinks : tuple of abscissae at which a derivative jumps or has no bound, as those of ``|x|^1.5`` and ``|x|^3`` do at 0
    jumps : tuple, by how much the slope itself jumps at each of them; not at all without it

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.2, ell=0.085, beta=0.5)
    >>> tip = mb.Shape(lambda x: np.abs(x)**1.5, kinks=(0.0,))
    >>> mb.Contact(mb.HalfPlane(solid), tip, mb.Microblock()).at(1.0, rtol=1e-5).error_estimate < 1e-5
    True
    """

    height: object
    kinks: tuple = ()
    jumps: tuple | None = None

    def __post_init__(self):
        if not callable(self.height):
            raise BadArgument("height", self.height, "must be a function of an array of x1")
        kinks = _tuple(self.kinks)
        jumps = (0.0,)*len(kinks) if self.jumps is None else _tuple(self.jumps)
        if len(jumps) != len(kinks):
            raise BadArgument("jumps", self.jumps, f"must be one for each of the {len(kinks)} kinks")
        for place, jump in zip(kinks, jumps):
            require_finite(kinks=place, jumps=jump)
        object.__setattr__(self, "kinks", kinks)
        object.__setattr__(self, "jumps", jumps)


def _tuple(values):
    return tuple(values) if np.iterable(values) else (values,)


@dataclass(frozen=True)
class Punch:
    """Flat punch -half_width <= x1 <= half_width of the height ``tilt*x1``: `tilt` is the slope of its face (dimensionless).

    Examples
    --------
    >>> mb.Punch(half_width=1.0).height(np.array([0.0, 2.0])).tolist()      # no obstacle beside it
    [0.0, inf]
    """

    half_width: float
    tilt: float = 0.0

    @property
    def ends(self):
        return -self.half_width, self.half_width

    formulas = True

    def __post_init__(self):
        require_positive(half_width=self.half_width)
        require_finite(tilt=self.tilt)

    def height(self, x):
        x = np.asarray(x, float)
        return np.where(np.abs(x) <= self.half_width, self.tilt*x, np.inf)


@dataclass(frozen=True)
class Profile:
    """Sampled profile: piecewise linear through (x, z), no obstacle outside; a level one is a flat punch.

    `x` ascending and finite, shape (n,), n >= 2; `z` of the same shape. Each sample inside is a kink, where microblocks have
    a peak of pressure each: that takes seconds to a minute. Give a smooth curve as a function height(x) instead.

    Examples
    --------
    >>> mb.Profile(x=np.array([-1.0, 0.0, 1.0]), z=np.array([0.5, 0.0, 0.5])).height(np.array([0.5])).tolist()
    [0.25]
    """

    x: np.ndarray
    z: np.ndarray = None

    @property
    def kinks(self):
        return tuple(self.x[1:-1])

    @property
    def jumps(self):
        return tuple(np.diff(np.diff(self.z)/np.diff(self.x)))

    @property
    def ends(self):
        return self.x[0], self.x[-1]

    formulas = True

    def __post_init__(self):
        if callable(self.x):
            raise BadArgument("x", self.x, "must be numbers; a function height(x) serves as obstacle as it is")
        x, z = _numbers("x", self.x), _numbers("z", self.z)
        if x.ndim != 1 or x.size < 2 or not np.all(np.diff(x) > 0):
            raise BadArgument("x", self.x, "must be a strictly ascending sequence of at least two numbers")
        if z.shape != x.shape or not (np.all(np.isfinite(x)) and np.all(np.isfinite(z))):
            raise BadArgument("z", self.z, f"must hold {x.size} finite numbers, one for each x")
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "z", z)

    def height(self, x):
        return np.interp(x, self.x, self.z, left=np.inf, right=np.inf)


def _numbers(name, values):
    try:
        return np.asarray(() if values is None else values, float)
    except (TypeError, ValueError, OverflowError) as failure:
        raise BadArgument(name, values, "must be a sequence of numbers") from failure


@dataclass(frozen=True)
class Wave:
    """Wavy surface of an amplitude and a wavelength (lengths), its lowest points at 0, +-wavelength, ...

    Examples
    --------
    >>> mb.Wave(amplitude=0.01, wavelength=1.0).height(np.array([0.0, 1.0])).tolist()
    [0.0, 0.0]
    """

    amplitude: float
    wavelength: float

    def __post_init__(self):
        require_positive(amplitude=self.amplitude, wavelength=self.wavelength)

    def height(self, x):
        return self.amplitude*(1 - np.cos(2*np.pi*np.asarray(x, float)/self.wavelength))


@dataclass(frozen=True)
class Rough:
    """Self-affine profile of a period: cosines of seeded random phases, amplitudes falling like (wavenumber)^-(hurst + 1/2).

    Parameters
    ----------
    period : float (length)
    slope : float, root mean square
    hurst : float, in [0, 1]
    waves : (longest, shortest), numbers of waves in the period, both included
    seed : int

    Examples
    --------
    >>> rough = mb.Rough(period=1.0, slope=0.1, seed=7)
    >>> x = np.array([0.2, 1.2])
    >>> bool(np.ptp(rough.height(x)) < 1e-12)      # it repeats
    True
    """

    period: float
    slope: float
    hurst: float = 0.8
    waves: tuple = (4, 256)
    seed: int = 1

    def __post_init__(self):
        require_positive(period=self.period, slope=self.slope)
        require_finite(hurst=self.hurst)
        if not 0 <= self.hurst <= 1:
            raise BadArgument("hurst", self.hurst, "must lie between 0 and 1")
        try:
            longest, shortest = self.waves
            require_whole(1, waves=longest)
            require_whole(longest, MOST_WAVES, waves=shortest)
        except (TypeError, ValueError) as failure:
            raise BadArgument("waves", self.waves,
                              f"must be two whole numbers, 1 <= longest <= shortest <= {MOST_WAVES}") from failure
        require_whole(0, seed=self.seed)

    @cached_property
    def amplitudes(self):
        """Complex amplitudes of exp(2 pi i m x/period), m from the longest to the shortest wave."""
        m = np.arange(self.waves[0], self.waves[1] + 1)
        phases = 2*np.pi*np.random.default_rng(self.seed).random(len(m))
        shape = m**(-self.hurst - 0.5)*np.exp(1j*phases)
        return self.slope/np.sqrt(np.sum(np.abs(2*np.pi*m/self.period*shape)**2)/2)*shape

    def height(self, x):
        """Horner's rule in exp(2 pi i x/period): time goes like the number of waves."""
        turn = np.exp(2j*np.pi*np.asarray(x, float)/self.period)
        total = np.zeros_like(turn)
        for amplitude in self.amplitudes[::-1]:
            total = total*turn + amplitude
        return (total*turn**self.waves[0]).real


def heights(obstacle, x):
    """Heights of an obstacle at x, array (n,), ``inf`` where there is none.

    Raises
    ------
    BadArgument
        If that is no obstacle, or its height no function that gives a number, or inf, for each of many x.
    """
    above = returned(obstacle, x)
    if above.shape != np.shape(x):
        raise BadArgument("obstacle", obstacle, "its height(x) must return one number (or inf) for each x of an array")
    wrong = np.isnan(above) | (above == -np.inf)
    if np.any(wrong):
        raise BadArgument("obstacle", obstacle, f"its height(x) is {above[wrong][0]:g} at x = {x[wrong][0]:.4g}: must be "
                          "a number, or inf where there is no obstacle")
    return above


def check(obstacle):
    """BadArgument unless the obstacle has a height that takes arrays, whatever it is where."""
    if returned(obstacle, np.zeros(2)).shape != (2,):
        heights(obstacle, np.zeros(2))


def check_lowest(obstacle, ell):
    """BadArgument unless an obstacle without bounds is lowest somewhere, looked at on the scales of ell (length)."""
    sides = {side: heights(obstacle, side*ell*SCALES) for side in (-1, 1)}
    for side, above in sides.items():
        with np.errstate(invalid="ignore"):      # inf - inf
            falls = np.all(np.diff(above[-TAIL:]) < 0)
        if falls and above[-1] <= min(map(np.min, sides.values())):
            raise BadArgument("obstacle", obstacle,
                              f"must be lowest somewhere, but its height(x) falls towards x = {side*np.inf:g}")


def returned(obstacle, x):
    """What the height says, as an array, whatever its shape."""
    if isinstance(obstacle, type):
        raise BadArgument("obstacle", obstacle, f"must be an instance, {obstacle.__name__}(...)")
    height = getattr(obstacle, "height", obstacle)
    if not callable(height):
        raise BadArgument("obstacle", obstacle, "must have a method height(x), or be a callable height(x)")
    try:
        with np.errstate(all="ignore"):      # what is no number is told of above
            return real(height(x))
    except MicroblockError:
        raise
    except (TypeError, ValueError) as failure:
        raise BadArgument("obstacle", obstacle, f"its height(x) must take an array of x ({failure}); np.vectorize makes it one "
                          "that does") from failure
    except Exception as failure:      # whatever the user's function does
        raise BadArgument("obstacle", obstacle, f"its height(x) failed: {failure!r}") from failure


def real(values):
    """Values of a user's function as an array of floats; TypeError for complex ones."""
    values = np.asarray(values)
    if values.dtype.kind == "c":
        raise TypeError("it returns complex numbers")
    return values.astype(float)


def gap(obstacle, points, normals):
    """Initial gap between points of a body's surface and the obstacle, along the surface normal.

    ``(height(x1) - x2) n2``: the distance along e2, in which the obstacle approaches, seen along
    n; for n = e2 the gap of section 4.2.

    Parameters
    ----------
    obstacle : object with ``height``, or a callable height
    points, normals : arrays (n, 2)

    Returns
    -------
    array (n,), ``inf`` where the obstacle has no surface above the point, or the body's surface is
        steeper than 60 degrees: there a gap seen along n is no measure of nearness
    """
    above = heights(obstacle, points[:, 0])
    seen = normals[:, 1] > STEEPEST
    return np.where(seen, (above - points[:, 1])*np.where(seen, normals[:, 1], 1.0), np.inf)
