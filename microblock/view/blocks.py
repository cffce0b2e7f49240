"""Rotated blocks along a surface: squares of side ell with their outer side at the surface, rotated by
psi0 + psi. Displacements, heights and angles are magnified alike: a corner touches where its gap (21), (22)
is closed.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from ..model import zones
from . import plots

MOST, LEAST = 25, 10  # blocks in a picture, side by side
FILLS = {"none closed": "white", "A (left)": "#CFE4F3", "B (right)": "#FBDCC4", "both closed": "#DCD0E8"}


def without_rounding(surface):
    """A `Surface` without rounding in gaps, rotations and differences of displacements."""
    level = surface.displacement
    size = 1e-10 * np.abs(level).max(initial=0.0)
    return replace(
        surface,
        gaps=np.where(np.abs(surface.gaps) > max(size, 1e-6 * np.ptp(level)), surface.gaps, 0.0),
        rotation=np.where(np.abs(surface.rotation) > size / surface.ell, surface.rotation, 0.0),
        displacement=level if np.ptp(level) > size else np.full_like(level, level.mean()),
    )


def interrupted(surface, x, values):
    """x and values (..., n), with a nan wherever the surface is interrupted."""
    ends = np.flatnonzero([] if surface.apart is None else surface.apart)
    places = np.searchsorted(x, (surface.x[ends] + surface.x[ends + 1]) / 2)
    return np.insert(x, places, np.nan), np.insert(values, places, np.nan, axis=-1)


def blocks(surface, contact):
    """The blocks of a `Surface` with contact zones [(left, right), ...], in the `window` of these within the
    surface.

    squares : array (m, 4, 2), corners A, B, and those below B and A
    closed : boolean array (m, 2), of A and B; False without corners
    surface, obstacle : arrays (n, 2); nan where there is none
    window : (left, right)
    magnification : float
    """
    ell = surface.ell
    left, right = window(ell, contact)
    middle, half = (surface.x[0] + surface.x[-1]) / 2, max(np.ptp(surface.x), LEAST / 2 * ell) / 2
    left, right = max(left, middle - half), min(right, middle + half)
    count = int(np.clip((right - left) / ell, 1, 4 * MOST))
    x = (left + right) / 2 + ell * (np.arange(count) - (count - 1) / 2)
    surface = without_rounding(surface)
    x = x[(x >= surface.x[0]) & (x <= surface.x[-1]) & ~zones.interrupted(surface.x, surface.apart, x)]
    ends = np.clip((left, right), surface.x[0], surface.x[-1])
    line = np.union1d(surface.x[(surface.x >= left) & (surface.x <= right)], (*ends, *x))
    known = np.where(np.isfinite(surface.obstacle), surface.obstacle, np.nan)
    rows = *surface.points.T, *surface.normals.T, surface.rotation, surface.displacement, known
    along = np.array([np.interp(line, surface.x, row) for row in rows])
    points, normals, (turn, down, over) = along[:2], along[2:4], along[4:]
    normals /= np.linalg.norm(normals, axis=0)
    here = np.searchsorted(line, x)
    magnified = magnification(np.abs(turn[here]).max(initial=0.0), np.ptp(down) / (0.12 * (right - left)))
    moved = points - magnified * down * normals
    return SimpleNamespace(
        squares=_squares(moved.T[here], normals.T[here], magnified * turn[here, None], ell),
        closed=_closed(surface, x),
        surface=interrupted(surface, line, moved)[1].T,
        obstacle=(points + magnified * over * normals).T,
        window=(left, right),
        magnification=magnified,
    )


def window(ell, contact):
    """(left, right) about the contact [(left, right), ...], or about its right edge."""
    left, right = (contact[0][0], contact[-1][1]) if len(contact) else (-ell, ell)
    margin = max(0.15 * (right - left) + 1.5 * ell, (LEAST * ell - (right - left)) / 2)
    wide = right - left + 2 * margin > MOST * ell
    return (right - 3 * MOST * ell / 4, right + MOST * ell / 4) if wide else (left - margin, right + margin)


def magnification(turn, depth):
    """The largest of 1, 2, 5, 10, ... with which an angle stays below 0.35, and a depth below 1."""
    steps = [digit * 10.0**decade for decade in range(16 if turn or depth else 0) for digit in (1, 2, 5)]
    return max((step for step in steps if step * turn <= 0.35 and step * depth <= 1), default=1.0)


def turn(corners):
    return r"$\psi_0 + \psi$" if len(corners) == 2 else r"$\psi$"


@plots.styled
def draw(axis, state):
    """The figure of an axis, or a new one, with the rotated blocks."""
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=3.3)
    contact, corners = state.zones["contact"], tuple(state.pressures)
    shown = blocks(state.surface(window(state.solid.ell, contact)), contact)
    (left, right), look = shown.window, {"edgecolor": "0.35", "linewidth": 0.5}
    # heights from the uppermost point of the surface on
    down = np.array((0.0, np.nanmax(shown.surface[:, 1], initial=shown.squares[..., 1].max(initial=-np.inf))))
    kinds = shown.closed @ (1, 2) if len(corners) == 2 else 3 * shown.closed.all(axis=1)
    fills = np.array(list(FILLS.values()))[kinds]
    axis.add_collection(PolyCollection(shown.squares - down, facecolor=fills, **look))
    axis.plot(*(shown.surface - down).T, color="k", linewidth=0.5)
    above = 0.08 * (right - left)
    lowest = (shown.squares - down)[..., 1].min(initial=0)
    x, over = (shown.obstacle - down).T
    axis.fill_between(x, over, np.fmax(over, above), facecolor="0.75", edgecolor="k", lw=0.5, zorder=0.5)
    axis.set(
        aspect="equal",
        xlabel="$x_1$ (length)",
        xlim=(left, right),
        ylim=(lowest - 0.06 * (right - left), above),  # with room for the key of the blocks
    )
    axis.tick_params(axis="y", left=False, labelleft=False)
    axis.spines["left"].set_visible(False)
    if len(corners) == 2:
        keys = [Patch(facecolor=fill, label=word, **look) for word, fill in FILLS.items()]
        axis.legend(handles=keys[1:], loc="lower right", ncols=3)
    touches = "" if len(corners) == 2 else "; their middle touches"
    words = f"blocks: {turn(corners)} and heights {shown.magnification:g} times{touches}"
    axis.set_title(words, loc="left")
    return drawing


def _squares(middle, normals, rotation, ell):
    """Corners, array (m, 4, 2); the middles of outer sides and normals are (m, 2), rotations (m, 1)."""
    tangents = np.column_stack((normals[:, 1], -normals[:, 0]))
    # the outer side reaches from -ell/2 to ell/2 along the surface, as the small-angle form has it
    side = ell * (tangents + rotation * normals)
    down = ell * (rotation * tangents - normals) / np.hypot(1, rotation)
    A, B = middle - side / 2, middle + side / 2
    return np.stack((A, B, B + down, A + down), axis=1)


def _closed(surface, x):
    if len(surface.corners) == 1:
        return np.zeros((len(x), 2), bool)
    # between two points of a closed zone the gap is closed too; a single open neighbour opens it
    return np.column_stack([np.interp(x, surface.x, gaps > 0) == 0 for gaps in surface.gaps])
