"""Rotated blocks along a surface: squares of side ell with their outer side at the surface, rotated by
psi0 + psi. Displacements, heights and angles are magnified alike: a corner touches where its gap (21), (22)
is closed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from ..errors import require
from ..model import intervals
from ..model.law import horizontal_surface, tangents
from ..model.obstacles import heights
from ..model.state import State
from ..model.surface import Surface
from ..model.types import Array, Axes, Figure, Flags, Interval
from . import plots

MOST_BLOCKS_SHOWN = 25  # blocks in a picture, side by side
FEWEST_BLOCKS_SHOWN = 10
OVERLAP = 0.01  # of a side: less is not seen, as where rotations are alike
FILLS = {"none closed": "white", "A (left)": "#CFE4F3", "B (right)": "#FBDCC4", "both closed": "#DCD0E8"}


class BlockPicture(NamedTuple):
    """What a picture shows of blocks.

    Attributes
    ----------
    squares : array (m, 4, 2)
        Corners A, B, and those below B and A.
    closed : boolean array (m, 2)
        Of A and B; False without corners.
    surface, obstacle : arrays (2, n)
        NaN where there is none, and of the surface beyond the window.
    ends : (left, right)
        The window, about the middle of a block.
    magnification : float
    """

    squares: Array
    closed: Flags
    surface: Array
    obstacle: Array
    ends: Interval
    magnification: float


def without_rounding(surface: Surface) -> Surface:
    """Returns a surface without rounding in gaps, rotations and differences of displacements."""
    displacement = surface.displacement
    size = 1e-10 * np.abs(displacement).max(initial=0.0)
    if np.ptp(displacement) <= size:
        displacement = np.full_like(displacement, displacement.mean())
    least_gap = max(size, 1e-6 * np.ptp(surface.displacement))
    return replace(
        surface,
        gaps=np.where(np.abs(surface.gaps) > least_gap, surface.gaps, 0.0),
        rotation=np.where(np.abs(surface.rotation) > size / surface.ell, surface.rotation, 0.0),
        displacement=displacement,
    )


def with_interruptions(surface: Surface, values: Array) -> Array:
    """Returns values (..., n) along a surface, with a NaN wherever it is interrupted."""
    if surface.interrupted is None:
        return values
    return np.insert(values, np.flatnonzero(surface.interrupted) + 1, np.nan, axis=-1)


def blocks(surface: Surface, window: Interval) -> BlockPicture:
    """Returns the blocks of a surface in a window (left, right), about the point nearest to its middle."""
    surface = without_rounding(surface)
    left, right = window
    half = (right - left) / 2
    middle = surface.x[np.abs(surface.x - (left + right) / 2).argmin()]
    x = _contact_points(surface, middle, half)
    rows = (*surface.points.T, *surface.normals.T, surface.rotation, surface.displacement)
    fields = np.column_stack([np.interp(x, surface.x, row) for row in rows])
    middles, normals, rotation, depths = np.split(fields, (2, 4, 5), axis=1)
    magnified = magnification(np.abs(rotation).max(), np.ptp(depths) / (0.24 * half))
    outer = middles - magnified * depths * normals
    inside = np.where(np.abs(surface.x - middle) <= half, surface.displacement, np.nan)
    over = np.where(np.isfinite(surface.obstacle), surface.obstacle, np.nan)
    return BlockPicture(
        squares=_corners(outer, normals, magnified * rotation, surface.ell),
        closed=_closed(surface, x),
        surface=with_interruptions(surface, surface.points.T - magnified * inside * surface.normals.T),
        obstacle=surface.points.T + magnified * over * surface.normals.T,
        ends=(middle - half, middle + half),
        magnification=magnified,
    )


def _contact_points(surface: Surface, middle: float, half: float) -> Array:
    """Returns abscissae of blocks side by side on a surface, up to `half` from a middle, array (m,)."""
    beside = int(half / surface.ell - 0.5)
    x = middle + surface.ell * np.arange(-beside, beside + 1, dtype=np.float64)
    on_surface = (x >= surface.x[0]) & (x <= surface.x[-1])
    return x[on_surface & ~intervals.in_interruption(surface.x, surface.interrupted, x)]


def _corners(outer: Array, normals: Array, rotation: Array, ell: float) -> Array:
    """Returns the corners A, B and those below B and A of blocks with side ell, array (m, 4, 2), from middles
    of their outer sides and normals, arrays (m, 2), and their rotations, array (m, 1).
    """
    along = tangents(normals)
    # the outer side reaches from -ell/2 to ell/2 along the surface, as the small-angle form has it
    side = ell * (along + rotation * normals)
    down = ell * (rotation * along - normals) / np.hypot(1, rotation)
    A = outer - side / 2
    B = outer + side / 2
    return np.stack((A, B, B + down, A + down), axis=1)


def window(ell: float, contact: Sequence[Interval]) -> Interval:
    """Returns (left, right) about the contact [(left, right), ...], or about its right edge."""
    left = -ell
    right = ell
    if len(contact):
        left = contact[0][0]
        right = contact[-1][1]
    margin = max(0.15 * (right - left) + 1.5 * ell, (FEWEST_BLOCKS_SHOWN * ell - (right - left)) / 2)
    if right - left + 2 * margin > MOST_BLOCKS_SHOWN * ell:
        return right - 3 * MOST_BLOCKS_SHOWN * ell / 4, right + MOST_BLOCKS_SHOWN * ell / 4
    return left - margin, right + margin


def magnification(turn: float, depth: float) -> float:
    """Returns the largest of 1, 2, 5, 10, ... with which an angle stays below 0.35, and a depth below 1."""
    if not (turn or depth):
        return 1.0
    steps = [digit * 10.0**decade for decade in range(16) for digit in (1, 2, 5)]
    return max((step for step in steps if step * turn <= 0.35 and step * depth <= 1), default=1.0)


def section(state: State) -> tuple[Surface, list[Interval], str]:
    """Returns the surface of a state on cells of a half-space in the row of a square with the largest
    pressure, its contact and where it is: corners on the left are A, those on the right B. Raises BadArgument
    if the law has no blocks, or the state is at nodes.
    """
    law = state.law
    pressures = np.array([*state.pressures.values()])
    require(len(pressures) > 1, "law", law, "has no blocks: plot_blocks() is for Microblock")
    words = "has no cells, in a row of which blocks are drawn in three dimensions"
    require(state.squares, "method", state.method, words)
    squares: Any = state.squares
    most = np.isclose(state.pressure, state.pressure.max()).argmax()  # of rows that are alike the first
    count = squares[0].count
    first = most - most % count**2  # cell of the square
    row = slice(first + most % count, first + count**2, count)
    x1, x2, _ = state.points[row].T
    points, normals = horizontal_surface(x1)
    of_sides = pressures[:, row].reshape(2, 2, -1).sum(axis=1)
    turn = -state.psi[row, 1]
    approach: Any = state.approach  # which cells have
    obstacle = heights(state.obstacle, x1, x2)
    if state.opposite is not None:
        obstacle = obstacle + state.opposite[row]
    surface = Surface(
        points=points,
        normals=normals,
        pressures=of_sides,
        gaps=np.where(of_sides > 0, 0.0, np.inf),
        micromoment=-state.micromoment[row, 1],
        psi=turn,
        rotation=law.psi0_in_gaps * state.problem.blocks.tilt(x1, x2)[0] + turn,
        displacement=state.displacement[row],
        obstacle=obstacle - approach,
        corners=("A", "B"),
        ell=state.solid.ell,
    )
    left, right = x1[of_sides.any(axis=0)][[0, -1]]
    return surface, [(left, right)], f" in the row at $x_2$ = {x2[0]:.2g}"


@plots.styled
def draw_blocks(state: State, axis: Axes | None) -> Figure:
    """Returns the figure of an axis, or a new one, with the rotated blocks."""
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=3.3)
    place = ""
    if state.flat:
        around = window(state.solid.ell, state.zones["contact"])
        surface = state.surface(around)
    else:
        surface, contact, place = section(state)
        around = window(state.solid.ell, contact)
    width = around[1] - around[0]
    picture = blocks(surface, around)
    look: dict[str, Any] = {"edgecolor": "0.35", "linewidth": 0.5}
    fills = np.array(list(FILLS.values()))[picture.closed @ (1, 2)]
    axis.add_collection(PolyCollection(list(picture.squares), facecolor=fills, **look))
    axis.plot(*picture.surface, color="k", linewidth=0.5)
    highest = np.nanmax(picture.surface[1]) + 0.08 * width
    x, over = picture.obstacle
    axis.fill_between(x, over, np.fmax(over, highest), facecolor="0.75", edgecolor="k", lw=0.5, zorder=0.5)
    lowest = picture.squares[..., 1].min() - 0.06 * width  # with room for the key of the blocks
    axis.set(aspect="equal", xlabel="$x_1$ (length)", xlim=picture.ends, ylim=(lowest, highest))
    axis.set(yticks=())
    axis.spines["left"].set_visible(False)
    title = f"blocks{place}: rotations and heights {picture.magnification:g} times"
    if _sides_overlap(picture.squares):
        title += ";\nsides overlap, as motions along the surface are not drawn"
    if len(surface.corners) == 2:
        keys = [Patch(facecolor=fill, label=label, **look) for label, fill in FILLS.items()]
        axis.legend(handles=keys[1:], loc="lower right", ncols=3)
    else:
        title += "; their middle touches"
    axis.set_title(title, loc="left")
    return drawing


def _sides_overlap(squares: Array) -> bool:
    """Returns whether of blocks side by side, array (m, 4, 2), inner corners lie beyond each other."""
    sides = squares[1:, 1] - squares[1:, 0]
    apart = np.sum((squares[1:, 3] - squares[:-1, 2]) * sides, axis=1)
    return bool(np.any(apart < -OVERLAP * np.sum(sides**2, axis=1)))


def _closed(surface: Surface, x: Array) -> Flags:
    """Returns whether corners A and B are closed at x, (n,): array (n, 2)."""
    if len(surface.corners) == 1:
        return np.zeros((len(x), 2), bool)
    # between two points of a closed zone the gap is closed too; a single open neighbour opens it
    return np.column_stack([np.interp(x, surface.x, gaps > 0) == 0 for gaps in surface.gaps])
