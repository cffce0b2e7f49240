"""The rotated blocks along a surface: squares of side ell with their outer side at the surface, rotated by
psi0 + psi. Displacements, heights of the obstacle and angles are magnified alike, so that a corner touches in
the picture where its gap (21), (22) is closed.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadArgument
from ..model import zones

MOST = 25  # blocks in a picture, side by side
LEAST = 10  # of them that would fit: the picture is flat
BEYOND = 6  # of them outside the contact, where it is too wide for all
MARGIN = 0.3  # of the half-width of the contact, shown on either side, and a block and a half more
SHOWN_TURN = 0.35  # largest magnified angle (radians)
SHOWN_DEPTH = 0.12  # largest magnified difference of displacements, over the width of the picture
ROUNDING = 1e-10  # of displacements, below which gaps and what else comes from them are nothing
CLOSED = 1e-6  # of the range of the gaps: rounding in one that is closed


@dataclass(frozen=True)
class Blocks:
    """What a picture of blocks shows.

    Attributes
    ----------
    squares : array (m, 4, 2), corner A, corner B, and the two below B and A
    closed : boolean array (m, 2), of A and B; False of laws without corners
    surface, obstacle : arrays (n, 2), lines; nan where there is none
    window : (left, right)
    magnification : float
    """

    squares: np.ndarray
    closed: np.ndarray
    surface: np.ndarray
    obstacle: np.ndarray
    window: tuple
    magnification: float


def without_rounding(surface):
    """A `Surface` without what rounding leaves of gaps, rotations and differences of displacements."""
    size = ROUNDING * np.abs(surface.displacement).max(initial=0.0)
    level = surface.displacement
    return replace(
        surface,
        gaps=np.where(np.abs(surface.gaps) > size, surface.gaps, 0.0),
        rotation=np.where(np.abs(surface.rotation) > size / surface.ell, surface.rotation, 0.0),
        displacement=level if np.ptp(level) > size else np.full_like(level, level.mean()),
    )


def interrupted(surface, x, values):
    """x and values (..., n) there, with a nan wherever the surface is interrupted: a line breaks there."""
    if surface.apart is None or not surface.apart.any():
        return x, values
    ends = np.flatnonzero(surface.apart)
    places = np.searchsorted(x, (surface.x[ends] + surface.x[ends + 1]) / 2)
    return np.insert(x, places, np.nan), np.insert(values, places, np.nan, axis=-1)


def blocks(surface, contact, frame=None):
    """The Blocks of a `Surface` with the contact zones [(left, right), ...].

    frame : (left, right); without it that of `window`
    """
    left, right = frame or within(window(surface.ell, contact), surface)
    if not left < right:
        raise BadArgument("window", frame, "must be (left, right), left < right")
    count = int(np.clip(np.floor((right - left) / surface.ell), 1, 4 * MOST))
    x = (left + right) / 2 + surface.ell * (np.arange(count) - (count - 1) / 2)
    surface = without_rounding(surface)
    x = x[(x >= surface.x[0]) & (x <= surface.x[-1]) & ~zones.interrupted(surface.x, surface.apart, x)]
    ends = np.clip((left, right), surface.x[0], surface.x[-1])
    inside = np.union1d(surface.x[(surface.x >= left) & (surface.x <= right)], (*ends, *x))
    rotation, displacement = (
        np.interp(x, surface.x, values) for values in (surface.rotation, surface.displacement)
    )
    magnification = _magnification(rotation, np.interp(inside, surface.x, surface.displacement), right - left)
    shown = _along(surface, inside)
    level = np.interp(inside, surface.x, surface.displacement)
    over = np.interp(inside, surface.x, np.where(np.isfinite(surface.obstacle), surface.obstacle, np.nan))
    squares = _squares(
        *_along(surface, x), magnification * rotation, magnification * displacement, surface.ell
    )
    line = shown[0] - magnification * level[:, None] * shown[1]
    return Blocks(
        squares,
        _closed(surface, x),
        interrupted(surface, inside, line.T)[1].T,
        shown[0] + magnification * over[:, None] * shown[1],
        (left, right),
        magnification,
    )


def window(ell, contact):
    """(left, right) of the contact [(left, right), ...] and its surroundings, or of its right edge alone."""
    left, right = (contact[0][0], contact[-1][1]) if len(contact) else (-ell, ell)
    margin = max(MARGIN * (right - left) / 2 + 1.5 * ell, (LEAST * ell - (right - left)) / 2)
    if right - left + 2 * margin > MOST * ell:
        return right - (MOST - BEYOND) * ell, right + BEYOND * ell
    return left - margin, right + margin


def within(frame, surface):
    """A frame without what lies beyond the surface, as far as that leaves room for a few blocks."""
    middle, half = (surface.x[0] + surface.x[-1]) / 2, max(np.ptp(surface.x), LEAST / 2 * surface.ell) / 2
    return max(frame[0], middle - half), min(frame[1], middle + half)


def _magnification(rotation, displacement, width):
    """The largest of 1, 2, 5, 10, ... that keeps angles and displacements within what is shown well."""
    most = min(
        SHOWN_TURN / max(np.abs(rotation).max(initial=0.0), 1e-12),
        SHOWN_DEPTH * width / max(np.ptp(displacement), 1e-12 * width),
    )
    if not rotation.any() and not np.ptp(displacement):
        return 1.0
    decade = 10.0 ** np.floor(np.log10(max(most, 1.0)))
    return float(max(digit * decade for digit in (1, 2, 5) if digit * decade <= max(most, 1.0)))


def _along(surface, x):
    """Points and normals of the undeformed surface at x."""
    points, normals = (
        np.column_stack([np.interp(x, surface.x, part) for part in values.T])
        for values in (surface.points, surface.normals)
    )
    return points, normals / np.linalg.norm(normals, axis=1)[:, None]


def _squares(points, normals, rotation, displacement, ell):
    tangents = np.column_stack((normals[:, 1], -normals[:, 0]))
    # the outer side reaches from -ell/2 to ell/2 along the surface, as the small-angle form has it
    side = ell * (tangents + rotation[:, None] * normals)
    down = ell * (rotation[:, None] * tangents - normals) / np.hypot(1, rotation)[:, None]
    middle = points - displacement[:, None] * normals
    A, B = middle - side / 2, middle + side / 2
    return np.stack((A, B, B + down, A + down), axis=1)


def _closed(surface, x):
    if len(surface.corners) == 1:
        return np.zeros((len(x), 2), bool)
    finite = surface.gaps[np.isfinite(surface.gaps)]
    size = CLOSED * max(np.ptp(finite), 1e-300)
    # between two points of a closed zone the gap is closed too; a single open neighbour opens it
    return np.column_stack(
        [np.interp(x, surface.x, np.where(gaps > size, 1.0, 0.0)) == 0 for gaps in surface.gaps]
    )
