"""Rotated blocks along a surface: squares of side ell with their outer side at the surface, rotated by
psi0 + psi. Displacements, heights and angles are magnified alike: a corner touches where its gap (21), (22)
is closed.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from ..errors import require
from ..model import intervals
from ..model.law import level_surface, tangents
from ..model.obstacles import heights
from ..model.surface import Surface
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


def interrupted(surface, values):
    """Values (..., n) along a `Surface`, with a nan wherever it is interrupted."""
    ends = np.flatnonzero([] if surface.apart is None else surface.apart)
    return np.insert(values, ends + 1, np.nan, axis=-1)


def blocks(surface, window):
    """The blocks of a `Surface` in a window (left, right), about the point nearest to its middle.

    squares : array (m, 4, 2), corners A, B, and those below B and A
    closed : boolean array (m, 2), of A and B; False without corners
    surface, obstacle : arrays (2, n); nan where there is none, and of the surface beyond the window
    ends : (left, right) about that point
    magnification : float
    """
    (left, right), ell, surface = window, surface.ell, without_rounding(surface)
    half, middle = (right - left) / 2, surface.x[np.abs(surface.x - (left + right) / 2).argmin()]
    beside = int(half / ell - 0.5)
    x = middle + ell * np.arange(-beside, beside + 1)
    x = x[(x >= surface.x[0]) & (x <= surface.x[-1]) & ~intervals.interrupted(surface.x, surface.apart, x)]
    rows = *surface.points.T, *surface.normals.T, surface.rotation, surface.displacement
    fields = np.column_stack([np.interp(x, surface.x, row) for row in rows])
    middles, normals, rotation, depths = np.split(fields, (2, 4, 5), axis=1)
    magnified = magnification(np.abs(rotation).max(), np.ptp(depths) / (0.24 * half))
    along, turned = tangents(normals), magnified * rotation
    # the outer side reaches from -ell/2 to ell/2 along the surface, as the small-angle form has it
    side = ell * (along + turned * normals)
    down = ell * (turned * along - normals) / np.hypot(1, turned)
    A, B = (middles - magnified * depths * normals + sign * side / 2 for sign in (-1, 1))
    inside = np.where(np.abs(surface.x - middle) <= half, surface.displacement, np.nan)
    over = np.where(np.isfinite(surface.obstacle), surface.obstacle, np.nan)
    return SimpleNamespace(
        squares=np.stack((A, B, B + down, A + down), axis=1),
        closed=_closed(surface, x),
        surface=interrupted(surface, surface.points.T - magnified * inside * surface.normals.T),
        obstacle=surface.points.T + magnified * over * surface.normals.T,
        ends=(middle - half, middle + half),
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


def section(state):
    """The `Surface` of a state on cells of a half-space in the row of a square with the largest pressure, its
    contact and where it is: corners on the left are A, those on the right B. Raises BadArgument if the law
    has no blocks, or the state is at nodes.
    """
    law, (x1, x2, _), pressures = state.law, state.points.T, np.array([*state.pressures.values()])
    require(len(pressures) > 1, "law", state.law, "has no blocks: plot_blocks() is for Microblock")
    words = "has no cells, in a row of which blocks are drawn in three dimensions"
    require(state.squares, "method", state.method, words)
    most = np.isclose(state.pressure, state.pressure.max()).argmax()  # of rows that are alike the first
    count = state.squares[0].count
    first = most - most % count**2  # cell of the square
    row = slice(first + most % count, first + count**2, count)
    x, pressures = x1[row], pressures[:, row].reshape(2, 2, -1).sum(axis=1)
    opposite = 0.0 if state.opposite is None else state.opposite[row]
    surface = Surface(
        *level_surface(x),
        pressures,
        np.where(pressures > 0, 0.0, np.inf),
        -state.micromoment[row, 1],
        -state.psi[row, 1],
        law.psi0_in_gaps * state.problem.blocks.tilt(x, x2[row])[0] - state.psi[row, 1],
        state.displacement[row],
        heights(state.obstacle, x, x2[row]) + opposite - state.approach,
        ("A", "B"),
        state.solid.ell,
    )
    ends = tuple(x[pressures.any(axis=0)][[0, -1]])
    return surface, [ends], f" in the row at $x_2$ = {x2[most]:.2g}"


@plots.styled
def draw_blocks(state, axis):
    """The figure of an axis, or a new one, with the rotated blocks."""
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=3.3)
    row, contact, where = (None, state.zones["contact"], "") if state.flat else section(state)
    around = window(state.solid.ell, contact)
    surface, width = row or state.surface(around), around[1] - around[0]
    corners, shown = surface.corners, blocks(surface, around)
    top, look = np.nanmax(shown.surface[1]), {"edgecolor": "0.35", "linewidth": 0.5}
    highest = top + 0.08 * width
    fills = np.array(list(FILLS.values()))[shown.closed @ (1, 2)]
    axis.add_collection(PolyCollection(shown.squares, facecolor=fills, **look))
    axis.plot(*shown.surface, color="k", linewidth=0.5)
    x, over = shown.obstacle
    axis.fill_between(x, over, np.fmax(over, highest), facecolor="0.75", edgecolor="k", lw=0.5, zorder=0.5)
    lowest = shown.squares[..., 1].min() - 0.06 * width  # with room for the key of the blocks
    axis.set(aspect="equal", xlabel="$x_1$ (length)", xlim=shown.ends, ylim=(lowest, highest))
    axis.set(yticks=())
    axis.spines["left"].set_visible(False)
    if len(corners) == 2:
        keys = [Patch(facecolor=fill, label=word, **look) for word, fill in FILLS.items()]
        axis.legend(handles=keys[1:], loc="lower right", ncols=3)
    touches = "" if len(corners) == 2 else "; their middle touches"
    words = f"blocks{where}: rotations and heights {shown.magnification:g} times{touches}"
    axis.set_title(words, loc="left")
    return drawing


def _closed(surface, x):
    if len(surface.corners) == 1:
        return np.zeros((len(x), 2), bool)
    # between two points of a closed zone the gap is closed too; a single open neighbour opens it
    return np.column_stack([np.interp(x, surface.x, gaps > 0) == 0 for gaps in surface.gaps])
