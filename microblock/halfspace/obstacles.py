"""Rigid obstacles over the surface x1, x2: heights of their lower side over x3 = 0.

Any callable ``height(x1, x2)`` of two arrays serves as well; it returns inf where there is no obstacle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, make_plain, require_choice, require_positive
from ..model.types import AnyArray as Array

FACES = ("round", "square")


@dataclass(frozen=True)
class Sphere:
    """Sphere of radius R near its lowest point, the paraboloid ``(x1^2 + x2^2)/(2 R)``.

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

    R: float

    def __post_init__(self) -> None:
        make_plain(self)
        require_positive(R=self.R)

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns the height at (x1, x2), arrays of one shape (lengths)."""
        return (x1**2 + x2**2) / (2 * self.R)


@dataclass(frozen=True)
class Ellipsoid:
    """Ellipsoid near its lowest point, ``x1^2/(2 R1) + x2^2/(2 R2)``.

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

    R1: float
    R2: float

    def __post_init__(self) -> None:
        make_plain(self)
        require_positive(R1=self.R1, R2=self.R2)

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns the height at (x1, x2), arrays of one shape (lengths)."""
        return x1**2 / (2 * self.R1) + x2**2 / (2 * self.R2)


@dataclass(frozen=True)
class Cone:
    """Blunt cone of the height ``slope*r``.

    Parameters
    ----------
    slope : float
        Slope of its side, tan of the angle to the surface (dimensionless).

    Raises
    ------
    BadArgument
        If the slope is not positive.

    Examples
    --------
    >>> round(float(mb.Cone(slope=0.1).height(np.array([3.0]), np.array([4.0]))[0]), 12)
    0.5
    """

    slope: float

    def __post_init__(self) -> None:
        make_plain(self)
        require_positive(slope=self.slope)

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns the height at (x1, x2), arrays of one shape (lengths)."""
        heights: Array = self.slope * np.hypot(x1, x2)
        return heights


@dataclass(frozen=True)
class FlatPunch:
    """Flat punch with a round or a square face.

    Parameters
    ----------
    half_width : float
        Radius of a round face, half of the side of a square one (length).
    face : "round" or "square"

    Raises
    ------
    BadArgument
        If the half-width is not positive, or the face neither word.

    Examples
    --------
    >>> mb.FlatPunch(half_width=1.0).height(np.array([0.0, 2.0]), np.zeros(2)).tolist()
    [0.0, inf]
    """

    half_width: float
    face: str = "round"

    def __post_init__(self) -> None:
        make_plain(self)
        require_positive(half_width=self.half_width)
        require_choice(FACES, face=self.face)

    def height(self, x1: Array, x2: Array) -> Array:
        """Returns the height at (x1, x2), arrays of one shape (lengths); inf beside the face."""
        away = np.hypot(x1, x2) if self.face == "round" else np.maximum(np.abs(x1), np.abs(x2))
        return np.where(away <= self.half_width, 0.0, np.inf)


def heights(obstacle: object, x1: Array, x2: Array) -> Array:
    """Returns the heights of an obstacle or a callable at (x1, x2), arrays of one shape.

    Raises
    ------
    BadArgument
        If it fails, or does not return as many numbers, finite or inf.
    """
    height = getattr(obstacle, "height", obstacle)
    if not callable(height):
        raise BadArgument("obstacle", obstacle, "must have a height(x1, x2), or be such a function")
    try:
        values: ArrayLike = height(np.array(x1), np.array(x2))  # a user's function may write into them
        found = np.broadcast_to(np.asarray(values, float), np.shape(x1))
    except BadArgument:
        raise
    except Exception as failure:  # whatever the user's function does
        raise BadArgument(
            "obstacle",
            obstacle,
            f"must have a height(x1, x2) of two arrays that returns as many numbers ({failure!r})",
        ) from failure
    if np.any(np.isnan(found)) or np.any(found == -np.inf):
        raise BadArgument("obstacle", obstacle, "must have heights that are numbers, or inf")
    return found
