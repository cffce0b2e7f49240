"""Fields at points below a surface, of whatever body."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from ..errors import BadArgument, require, require_numbers
from .types import Array, Integers, Interval

# of the depth, above which a picture does not look for its extremes: there a stress may have no bound
FIRST_ROW = 0.02

Fields = TypeVar("Fields", bound="FieldsAtPoints")


class FieldsAtPoints:
    """Base of fields at points, arrays over the points last; scalars are (n,), or have the shape in which the
    points were given.

    Yield criteria take the symmetric part of the force stress, as J2 of de Borst (Eng. Comput. 8 (1991) 317)
    with a1 = a2 = 1/4 and without couple stresses: its skew part and the couple stress are fields beside.

    Attributes
    ----------
    stress : array (2, 2, n) or (3, 3, n)
        Force stress.
    """

    stress: Array

    def shaped(self: Fields, shape: tuple[int, ...]) -> Fields:
        """Returns the fields with scalars in this shape."""
        arrays = {name: values.reshape((*values.shape[:-1], *shape)) for name, values in vars(self).items()}
        return replace(cast(Any, self), **arrays)

    @property
    def symmetric_stress(self) -> Array:
        """Symmetric part of the force stress with its components out of the plane, array (3, 3, n)."""
        return (self.stress + self.stress.swapaxes(0, 1)) / 2

    @property
    def principal(self) -> Array:
        """Principal stresses of the symmetric part, the largest (most tensile) first: array (3, n)."""
        matrices = np.moveaxis(self.symmetric_stress, (0, 1), (-2, -1))
        descending = np.asarray(np.linalg.eigvalsh(matrices), float)[..., ::-1]
        return np.moveaxis(descending, -1, 0)

    @property
    def max_shear(self) -> Array:
        """Half the difference of the largest and the smallest principal stress (Tresca)."""
        principal = self.principal
        return (principal[0] - principal[2]) / 2

    @property
    def von_mises(self) -> Array:
        """Equivalent stress of von Mises, sqrt(3 J2)."""
        s = self.symmetric_stress
        deviator = s - np.multiply.outer(np.eye(3), np.trace(s) / 3)
        return np.sqrt(1.5 * np.einsum("ij...,ij...->...", deviator, deviator))


@dataclass(frozen=True, eq=False)
class PointFields(FieldsAtPoints):
    """Fields at points of a body in plane strain, arrays over the points last: (n,), or the shape in which
    the points were given.

    Attributes
    ----------
    x1, x2 : arrays (n,)
        The points (lengths).
    psi : array (n,)
        Microrotation (radians).
    u : array (2, n)
        Displacement (length); of a half-plane up to the constants of its kernels.
    stress : array (2, 2, n)
        Force stress, stress[0, 1] = sigma_12.
    couple_stress : array (2, n)
        Couple stress m_31, m_32 (stress x length).
    s33 : array (n,)
        Force stress out of the plane, sigma_33.
    """

    x1: Array
    x2: Array
    psi: Array
    u: Array
    stress: Array
    couple_stress: Array
    s33: Array

    @property
    def symmetric_stress(self) -> Array:
        symmetric = np.zeros((3, 3, *self.s33.shape))
        symmetric[:2, :2] = super().symmetric_stress
        symmetric[2, 2] = self.s33
        return symmetric

    @property
    def shear(self) -> Array:
        """Largest shear stress over the planes along x3, with the skew part, which acts on all of them."""
        return largest_shear(self.stress)


@dataclass(frozen=True, eq=False)
class SpaceFields(FieldsAtPoints):
    """Fields at points in space, arrays over the points last: (n,), or the shape in which the points were
    given.

    Attributes
    ----------
    x1, x2, x3 : arrays (n,)
        The points (lengths).
    psi, u : arrays (3, n)
        Microrotation (radians) and displacement (length).
    stress : array (3, 3, n)
        Force stress, stress[0, 1] = sigma_12: along x1, on a plane with the normal x2.
    couple_stress : array (3, 3, n)
        Couple stress (stress x length), couple_stress[0, 1] = m_12: about x1, on a plane with the normal x2.
    """

    x1: Array
    x2: Array
    x3: Array
    psi: Array
    u: Array
    stress: Array
    couple_stress: Array


class FieldsBelow(Protocol):
    """What `State.fields` is: fields at points, of a body in the plane at x1, x2, in space at x1, x2, x3."""

    @property
    def resolved(self) -> float:
        """Depth below which tractions are known well enough: 0 where they are no means of cells (length)."""

    @property
    def second(self) -> FieldsBelow | None:
        """Fields of the second body."""

    def __call__(self, *places: Any) -> Any:
        """Returns PointFields, in space SpaceFields, at places, numbers or arrays that broadcast; raises
        BadArgument outside of the body.
        """


def largest_shear(stress: Array) -> Array:
    """Returns the largest shear stress, of the symmetric and the skew part, of a stress (2, 2, n)."""
    (s11, s12), (s21, s22) = stress
    return np.hypot((s11 - s22) / 2, (s12 + s21) / 2) + np.abs(s12 - s21) / 2


def points(
    x1: ArrayLike, x2: ArrayLike, x3: ArrayLike | None, in_space: bool
) -> tuple[list[Array], tuple[int, ...]]:
    """Returns coordinates x1, x2 and in space x3 of points, arrays (n,), and their shape; raises BadArgument
    unless they are numbers that broadcast, and x3 is given in space alone.
    """
    require((x3 is not None) == in_space, "x3", x3, "must be given of a body in space, and there alone")
    places = (x1, x2) if x3 is None else (x1, x2, x3)
    names = [f"x{number}" for number in range(1, 1 + len(places))]
    try:
        coordinates = np.broadcast_arrays(*(np.asarray(x, float) for x in places))
    except (TypeError, ValueError, OverflowError) as failure:
        words = "must be numbers or arrays that broadcast"
        raise BadArgument(", ".join(names), places, words) from failure
    flat = [require_numbers(**{name: part.ravel()}).copy() for name, part in zip(names, coordinates)]
    return flat, coordinates[0].shape


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
    where they begin, and the `halves` of the rectangles between them.
    """
    (left, right), depth = box
    down = -depth * np.linspace(0, 1, 33) ** 2
    x1, x2 = np.meshgrid(np.linspace(left, right, 81), down)
    # not Delaunay's, which rounding chooses: the corners of a rectangle lie on a circle
    return x1.ravel(), x2.ravel(), halves(np.arange(x1.size).reshape(x1.shape))
