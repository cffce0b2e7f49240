"""The length of a contact, from its obstacle and its load alone: what a classical solid has in place of ell.

A classical contact is as wide as its obstacle rises by what load and modulus give: in the plane by
``2 P/(pi E*)``, in space by ``P/(2 E* a)`` over a disc of the radius a. Places are looked at on all scales of
that rise, so that no length decides which the user has not given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .bodies import BodyLike, offered_by, over_surface
from .deformable import Deformable, second_solid
from .material import Elastic, joint_modulus
from .obstacles import named_places, quiet_heights
from .types import Array, Flags, Interval, ObstacleLike

PER_DECADE = 8  # places: a parabola's lowest one is seen to a seventh of its distance, and then followed


def all_scales(unit: float) -> Array:
    """Returns positive lengths from 1e-10 to 1e40 units, ascending."""
    return unit * np.logspace(-10, 40, 50 * PER_DECADE + 1)


def on_own_scale(
    body: BodyLike, obstacle: ObstacleLike, load: float | None = None, approach: float | None = None
) -> tuple[BodyLike, ObstacleLike]:
    """Returns (body, obstacle) whose classical solids have the length of their contact under a load, or at an
    approach, as ell: a period, or the half-width or radius of a classical contact. They stay as they are
    where there is no such length; a mesh has given its own.
    """
    classical = [solid for solid in (body.solid, second_solid(obstacle)) if isinstance(solid, Elastic)]
    if not classical:
        return body, obstacle
    length = _contact_length(body, obstacle, load, approach)
    if length is None:
        return body, obstacle
    scaled = _with_length(body, length)
    if isinstance(obstacle, Deformable):
        obstacle = replace(obstacle, body=_with_length(obstacle.body, length))
    return scaled, obstacle


def _with_length(body: Any, length: float) -> Any:
    """Returns a body without a mesh whose classical solid has this ell."""
    offers = offered_by(body)
    if not isinstance(body.solid, Elastic) or offers.mesh is not None or offers.of is None:
        return body
    return offers.of(body.solid.with_length(length))


def classical_rise(load: float, modulus: float) -> float:
    """Returns by how much an obstacle rises within a classical contact in the plane (length), under a load
    (force per thickness) on bodies with the joint modulus E*.
    """
    return 2 * load / (np.pi * modulus)


def classical_rise_in_space(load: float, modulus: float, radius: Array) -> Array:
    """Returns by how much an obstacle rises within a classical contact of this radius, array (n,) (lengths),
    under a load (force) on bodies with the joint modulus E*.
    """
    return load / (2 * modulus * radius)


def _contact_length(
    body: BodyLike, obstacle: ObstacleLike, load: float | None, approach: float | None
) -> float | None:
    """Returns the period, or the half-width or radius of the contact (length); None where there is none."""
    period = offered_by(body).period
    if period is not None:
        return float(period)
    if load is None and approach is None:
        return None
    modulus = joint_modulus(body.solid, second_solid(obstacle))
    if over_surface(body):
        return _radius(obstacle, modulus, load, approach)
    contact = lowest_part(obstacle, approach if load is None else classical_rise(load, modulus))
    return contact and (contact[1] - contact[0]) / 2


def lowest_part(obstacle: ObstacleLike, rise: float | None) -> Interval | None:
    """Returns the ends (left, right) between which an obstacle is less than `rise` above its lowest place,
    about that place (lengths); None where it has no such ends, or is no wider than rounding.
    """
    if rise is None or not rise > 0:
        return None
    scales = all_scales(rise)
    x = np.unique(np.concatenate((-scales, [0.0], scales, named_places(obstacle))))
    above = quiet_heights(obstacle, x)
    lowest, least = _followed_down(obstacle, x, above)
    high = np.flatnonzero(~(above <= least + rise))
    behind = np.searchsorted(x[high], lowest)
    if not 0 < behind < len(high):
        return None

    def is_low(places: Array) -> Flags:
        return quiet_heights(obstacle, places) <= least + rise

    left, right = _edges(is_low, lowest, x[high[behind - 1 : behind + 1]])
    return (left, right) if right > left else None


def _followed_down(obstacle: ObstacleLike, x: Array, above: Array) -> tuple[float, float]:
    """Returns a place no higher than places, ascending, with these heights, and its height."""
    for _ in range(7):  # each 16 times nearer
        lowest = int(np.argmin(above))
        x = np.linspace(x[max(lowest - 1, 0)], x[min(lowest + 1, len(x) - 1)], 33)
        above = quiet_heights(obstacle, x)
    lowest = int(np.argmin(above))
    return float(x[lowest]), float(above[lowest])


def _edges(is_low: Callable[[Array], Flags], inside: float, outside: Array) -> list[float]:
    """Returns where the places that are low end, between one that is and others that are not, array (k,)."""
    outside = outside.astype(float)
    within = np.full(len(outside), inside)
    for _ in range(9):  # each 64 times nearer, to rounding
        places = np.linspace(within, outside, 65)
        number = np.argmin(is_low(places[1:].ravel()).reshape(64, -1), axis=0) + 1
        within = np.take_along_axis(places, number[None] - 1, axis=0)[0]
        outside = np.take_along_axis(places, number[None], axis=0)[0]
    return within.tolist()


def _radius(
    obstacle: ObstacleLike, modulus: float, load: float | None, approach: float | None
) -> float | None:
    """Returns the radius at which the mean height of a circle about the lowest place has risen by what a load
    or an approach asks for; None where it does not.
    """
    if load is None:
        unit = (approach or 0.0) - float(quiet_heights(obstacle, np.zeros(1), np.zeros(1))[0])
    else:
        unit = np.sqrt(load / (2 * modulus))
    if not 0 < unit < np.inf:
        return None
    angles = 2 * np.pi * np.arange(16) / 16
    directions = np.array((np.cos(angles), np.sin(angles)))
    scales = all_scales(unit)
    middle = _lowest_over_surface(obstacle, scales, directions)
    lowest = quiet_heights(obstacle, *middle[:, None])
    if not np.isfinite(lowest[0]):  # it was not seen
        return None

    def is_low(radii: Array) -> Flags:
        circles = middle[:, None, None] + directions[:, None, :] * radii[:, None]
        rises = quiet_heights(obstacle, *circles).mean(axis=1) - lowest
        required = unit if load is None else classical_rise_in_space(load, modulus, radii)
        return required - rises > 0

    high = np.flatnonzero(~is_low(scales))
    if not len(high) or high[0] == 0:
        return None
    return _edges(is_low, scales[high[0] - 1], scales[high[:1]])[0]


def _lowest_over_surface(obstacle: ObstacleLike, scales: Array, directions: Array) -> Array:
    """Returns the lowest place that is seen about (0, 0) on all scales, and then nearer to it, array (2,)."""
    places = np.concatenate((np.zeros((2, 1)), (directions[:, :, None] * scales).reshape(2, -1)), axis=1)
    middle = places[:, np.argmin(quiet_heights(obstacle, *places))]
    step = np.hypot(*middle) / 2
    around = np.reshape(np.meshgrid(*[np.linspace(-1, 1, 9)] * 2), (2, -1))
    around = np.column_stack((np.zeros(2), around))  # first, so that a horizontal face keeps its place
    for _ in range(40):
        near = middle[:, None] + step * around
        middle = near[:, np.argmin(quiet_heights(obstacle, *near))]
        step /= 2
    return middle
