"""Rigid obstacles: heights of their lower side over x3 = 0.

Any callable ``height(x1, x2)`` of two arrays serves as well, with inf where there is no obstacle.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..errors import Checked, checked, require_choice, require_positive
from . import roughness
from .height_map import HeightMap
from .obstacles import RigidObstacle, SelfAffine
from .quadrature import form_grid, in_blocks
from .roughness import Statistics
from .types import AnyArray as Array


@dataclass(frozen=True)
class Sphere(RigidObstacle, Checked):
    """Sphere, the paraboloid ``(x1^2 + x2^2)/(2 R)``.

    Parameters
    ----------
    R : float
        Radius (length).

    Raises
    ------
    BadArgument
        If R is not positive.

    Examples
    --------
    >>> float(mb.Sphere(R=10.0).height(np.array([1.0]), np.array([0.0]))[0])
    0.05
    """

    R: float = field(metadata=checked(require_positive))

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns heights at (x1, x2) (lengths)."""
        return (x1**2 + x2**2) / (2 * self.R)


@dataclass(frozen=True)
class Ellipsoid(RigidObstacle, Checked):
    """Ellipsoid, ``x1^2/(2 R1) + x2^2/(2 R2)``.

    Parameters
    ----------
    R1, R2 : float
        Radii of curvature along x1 and x2 (lengths).

    Raises
    ------
    BadArgument
        If one of them is not positive.

    Examples
    --------
    >>> round(float(mb.Ellipsoid(R1=10.0, R2=5.0).height(np.array([1.0]), np.array([1.0]))[0]), 12)
    0.15
    """

    R1: float = field(metadata=checked(require_positive))
    R2: float = field(metadata=checked(require_positive))

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns heights at (x1, x2) (lengths)."""
        return x1**2 / (2 * self.R1) + x2**2 / (2 * self.R2)


@dataclass(frozen=True)
class Cone(RigidObstacle, Checked):
    """Blunt cone of the height ``slope*r``.

    Parameters
    ----------
    slope : float
        Slope of its side (dimensionless).

    Raises
    ------
    BadArgument
        If the slope is not positive.

    Examples
    --------
    >>> round(float(mb.Cone(slope=0.1).height(np.array([3.0]), np.array([4.0]))[0]), 12)
    0.5
    """

    slope: float = field(metadata=checked(require_positive))

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns heights at (x1, x2) (lengths)."""
        return self.slope * np.hypot(x1, x2)


@dataclass(frozen=True)
class FlatPunch(RigidObstacle, Checked):
    """Flat punch with a round or a square face.

    Parameters
    ----------
    half_width : float
        Radius of a round face, half the side of a square one (length).
    face : "round" or "square"

    Raises
    ------
    BadArgument
        If the half-width is not positive, or the face neither.

    Examples
    --------
    >>> mb.FlatPunch(half_width=1.0).height(np.array([0.0, 2.0]), np.zeros(2)).tolist()
    [0.0, inf]
    """

    half_width: float = field(metadata=checked(require_positive))
    face: str = field(default="round", metadata=checked(require_choice, ("round", "square")))

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns heights at (x1, x2) (lengths); inf beside the face."""
        norm = {"round": np.hypot, "square": np.maximum}[self.face]
        distance = norm(np.abs(x1), np.abs(x2))
        return np.where(distance <= self.half_width * (1 + 1e-12), 0.0, np.inf)  # whatever the unit of length


@dataclass(frozen=True)
class RoughSurface(SelfAffine):
    """Self-affine surface of a period in x1 and x2: cosines of random phases in all directions, amplitudes
    like (wavenumber)^-(hurst + 1).

    A seed draws the same phases for all waves that two surfaces have in common.

    Parameters
    ----------
    period : float
        Length after which the surface repeats.
    slope : float
        Root mean square of ``|grad h|`` (dimensionless).
    hurst : float
        Hurst exponent, from 0 to 1: the power spectral density falls like (wavenumber)^-(2 hurst + 2).
    waves : (int, int)
        The first and the last wavenumber, in waves to the period.
    seed : int
    plateau : int
        Wavenumber, in waves to the period, below which the power spectral density is constant.

    Raises
    ------
    BadArgument
        If a value is out of range.

    Examples
    --------
    >>> rough = mb.RoughSurface(period=1.0, slope=0.1, seed=7)
    >>> x1, x2 = np.array([0.2, 1.2]), np.array([0.3, -0.7])
    >>> bool(np.ptp(rough.height(x1, x2)) < 1e-12)      # it repeats
    True
    """

    waves: tuple[int, int] = (2, 32)

    most = 1024  # 3 million waves
    from_heights = staticmethod(HeightMap.from_heights)
    from_file = staticmethod(HeightMap.from_file)

    @cached_property
    def amplitudes(self) -> Array:
        """Amplitudes of exp(2 pi i (m1 x1 + m2 x2)/period), m1 = 0 ... n, m2 = -n ... n, array
        (n + 1, 2 n + 1).
        """
        shortest = self.waves[1]
        m1, m2 = map(np.ravel, np.mgrid[: shortest + 1, -shortest : shortest + 1])
        square = m1**2 + m2**2
        waves = np.flatnonzero((square <= shortest**2) & ((m1 > 0) | (m2 > 0)))  # of k and -k one
        waves = waves[np.lexsort((m2[waves], m1[waves], square[waves]))]  # shorter waves have later phases
        amplitudes = np.zeros(len(m1), complex)
        amplitudes[waves] = self._of_waves(np.sqrt(square[waves]), self.hurst + 1)
        return amplitudes.reshape(shortest + 1, -1)

    @cached_property
    def _matrix(self) -> Array:
        """Heights of products of `_waves` of x1 and of x2, array (2 n + 2, 2 n + 2)."""
        n = self.waves[1]
        ahead = self.amplitudes[:, n:]
        back = self.amplitudes[:, n::-1] * (np.arange(n + 1) > 0)
        even = ahead + back
        odd = ahead - back
        return np.block([[even.real, -odd.imag], [-even.imag, -odd.real]])

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns heights at (x1, x2) (lengths)."""
        x1 = np.asarray(x1, float)
        x2 = np.asarray(x2, float)
        if form_grid(x1, x2):
            return self._waves(x1[:, 0]) @ self._matrix @ self._waves(x2[0]).T
        heights = []
        for block in in_blocks(x1.size, 4 * self.waves[1]):
            first = self._waves(x1.ravel()[block]) @ self._matrix
            heights.append(np.einsum("km,km->k", first, self._waves(x2.ravel()[block])))
        return np.concatenate(heights).reshape(x1.shape)

    def statistics(self) -> Statistics:
        """Returns rms_height, rms_slope, rms_curvature (half the Laplacian) and nayak, Nayak's parameter,
        exact for these waves.
        """
        return roughness.of_surface(*self.mean_squares)

    @property
    def mean_squares(self) -> list[float]:
        """Those of heights, gradients and Laplacians."""
        n = self.waves[1]
        m1, m2 = np.mgrid[: n + 1, -n : n + 1]
        square = (2 * np.pi / self.period) ** 2 * (m1**2 + m2**2)
        power = np.abs(self.amplitudes) ** 2 / 2
        return [float(np.sum(square**k * power)) for k in (0, 1, 2)]

    def _waves(self, x: Array) -> Array:
        """Returns cosines and sines of 2 pi m x/period at x, array (k,), for m = 0 ... n, array
        (k, 2 n + 2).
        """
        powers = np.vander(np.exp(2j * np.pi / self.period * x), self.waves[1] + 1, increasing=True)
        return np.hstack((powers.real, powers.imag))
