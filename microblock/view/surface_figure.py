"""Figures of a state in three dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.tri import Triangulation

from ..model.state import State
from ..model.types import AnyArray, Axes, Figure
from . import plots

ARROWS = 16  # along an axis


@plots.styled
def draw(state: State, axis: Axes | None) -> Figure:
    """Returns the figure of a state on cells or at nodes, with friction of its shear traction in place of
    closed corners; of an axis with the pressure alone.
    """
    if axis is not None:
        drawing, axis = plots.in_place(axis)
        _draw_pressure(axis, state)
        return drawing
    # panels of equal sides, which else push labels out
    drawing, (pressure, micromoment, closed) = plots.figure(1, 3, 2.4, 2 * plots.COLUMN, layout="compressed")
    _draw_pressure(pressure, state)
    moment = np.hypot(*state.micromoment.T) / state.solid.ell
    _from_above(micromoment, state, moment, r"$|M|/\ell$", cmap="cividis")
    if state.shear is None:
        _draw_closed(closed, state)
    else:
        draw_shear(closed, state)
    return drawing


def _draw_pressure(axis: Axes, state: State) -> None:
    _from_above(axis, state, state.pressure, "$p$", cmap="cividis")


def draw_shear(axis: Axes, state: State) -> None:
    """Draws the size of the shear traction of a state on one square of cells or at nodes, arrows along it,
    and the edge of the stick zone.
    """
    traction: Any = state.shear_traction
    _from_above(axis, state, np.hypot(*traction.T), "$|q|$", cmap="cividis")
    centres: Any = state.points[:, :2].T
    arrows = traction.T
    stick: Any = state.stick
    inside = stick.astype(float)
    edge: dict[str, Any] = {"levels": [0.5], "colors": "w", "linewidths": 1}
    mixed = 0 < inside.sum() < inside.size
    if state.squares is not None:
        shape: Any = state.shape
        every = _thinned(shape[0])
        centres, arrows = (rows.reshape(2, *shape)[:, every, every] for rows in (centres, arrows))
        if mixed:
            axis.contour(state.x1, state.x2, inside.reshape(shape).T, **edge)
    elif mixed:
        axis.tricontour(_triangulation(state), inside, **edge)
    pressed = np.hypot(*arrows) > 0
    axis.quiver(*centres[:, pressed], *arrows[:, pressed], color="w", width=0.006, pivot="mid")


def _triangulation(state: State) -> Triangulation:
    """Returns the triangles between the nodes of a state."""
    x1: Any = state.x1
    x2: Any = state.x2
    return Triangulation(x1, x2, state.triangles)


def _thinned(count: int) -> slice:
    """Returns the cells of a row of so many that have an arrow."""
    step = -(-count // ARROWS)
    return slice(step // 2, None, step)


def _draw_closed(axis: Axes, state: State) -> None:
    """Draws the number of closed corners."""
    corners = len(state.pressures)
    none = "w"
    if state.squares is None:
        none = "0.85"  # not white at nodes: a mark has to be seen
    colours = ListedColormap([none, *("#C6DBEF", "#6BAED6", "#3182BD", "#08306B")[-corners:]])
    norm = BoundaryNorm(np.arange(-0.5, corners + 1), colours.N)
    bar = _from_above(axis, state, state.closed, "closed corners", cmap=colours, norm=norm)
    bar.set_ticks(range(corners + 1))


def _from_above(axis: Axes, state: State, values: AnyArray, label: str, **look: Any) -> Any:
    """Returns the colour bar of values at cells or nodes, array (n,), drawn from above."""
    drawn: Any
    x1: Any = state.x1
    x2: Any = state.x2
    if state.squares is not None:
        look = {"norm": Normalize(values.min(), values.max()), **look}
        for square, cells in zip(state.squares, np.split(values, len(state.squares))):
            rows = cells.reshape(square.count, square.count).T
            drawn = axis.pcolormesh(*square.axes, rows, rasterized=True, **look)
    elif "norm" in look:  # numbers have nothing between nodes
        drawn = axis.scatter(x1, x2, c=values, s=5, linewidths=0, **look)
    else:
        drawn = axis.tripcolor(_triangulation(state), values, shading="gouraud", rasterized=True, **look)
    axis.set(xlabel="$x_1$", ylabel="$x_2$", title=label)
    axis.set(aspect="equal", adjustable="datalim", box_aspect=1)  # a row of squares has room above it
    axis.locator_params(nbins=4)  # as many as are there when the layout is made
    return axis.figure.colorbar(drawn, ax=axis, shrink=0.9, pad=0.02)
