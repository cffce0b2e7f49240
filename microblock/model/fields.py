"""Fields at points below a surface, of whatever body."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, require_numbers
from .types import Array, Integers, Interval

# of the depth: the uppermost row of a grid; nearer to the surface a stress may have no bound
FIRST_ROW = 0.02

Fields = TypeVar("Fields", bound="PointFields")


@dataclass(frozen=True, eq=False)
class PointFields:
    """Fields at points, arrays over the points last: (n,), or the shape in which the points were given.

    Attributes
    ----------
    x1, x2 : arrays (n,)
        The points (lengths).
    psi : array (n,)
        Microrotation (radians).
    u : array (2, n)
        Displacement (length); of a half-plane u2 up to the constant of its kernels.
    stress : array (2, 2, n)
        Force stress, stress[0, 1] = sigma_12.
    couple_stress : array (2, n)
        Couple stress (stress x length).
    """

    x1: Array
    x2: Array
    psi: Array
    u: Array
    stress: Array
    couple_stress: Array

    def shaped(self: Fields, shape: tuple[int, ...]) -> Fields:
        return replace(
            self,
            **{name: values.reshape((*values.shape[:-1], *shape)) for name, values in vars(self).items()},
        )

    @property
    def shear(self) -> Array:
        """Largest shear stress over all planes."""
        return largest_shear(self.stress)


def largest_shear(stress: Array) -> Array:
    """Returns the largest shear stress, of the symmetric and the skew part, of a stress (2, 2, n)."""
    (s11, s12), (s21, s22) = stress
    return np.hypot((s11 - s22) / 2, (s12 + s21) / 2) + np.abs(s12 - s21) / 2


def points(x1: ArrayLike, x2: ArrayLike) -> tuple[Array, Array, tuple[int, ...]]:
    """Returns x1 and x2 of points, arrays (n,), and their shape; raises BadArgument unless they are numbers
    that broadcast.
    """
    try:
        coordinates = np.broadcast_arrays(np.asarray(x1, float), np.asarray(x2, float))
    except (TypeError, ValueError, OverflowError) as failure:
        raise BadArgument("x1, x2", (x1, x2), "must be numbers or arrays that broadcast") from failure
    flat = [require_numbers(**{name: part.ravel()}).copy() for name, part in zip(("x1", "x2"), coordinates)]
    return flat[0], flat[1], coordinates[0].shape


def squares(numbers: Integers) -> Integers:
    """Returns corners of the squares of a grid of `numbers`, (rows, columns), one after the other: array
    (m, 4).
    """
    corners = numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def halves(numbers: Integers) -> Integers:
    """Returns the same of the triangles that these squares are cut into: array (2 m, 3)."""
    return squares(numbers)[:, [0, 1, 3, 1, 2, 3]].reshape(-1, 3)


def grid_below(box: tuple[Interval, float]) -> tuple[Array, Array, Integers]:
    """Returns x1 and x2 of points in a box ((left, right), depth), arrays (n,), denser towards the surface,
    and the `halves` of the rectangles between them.
    """
    (left, right), depth = box
    down = -depth * (FIRST_ROW + (1 - FIRST_ROW) * np.linspace(0, 1, 25) ** 2)
    x1, x2 = np.meshgrid(np.linspace(left, right, 61), down)
    # not Delaunay's, which rounding chooses: the corners of a rectangle lie on a circle
    return x1.ravel(), x2.ravel(), halves(np.arange(x1.size).reshape(x1.shape))
