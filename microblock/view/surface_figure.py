"""Figures of a state in three dimensions."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize

from . import plots


@plots.styled
def draw(state, axis):
    """The figure of a state on cells or at nodes; of an axis with the pressure alone."""
    if axis is None:  # panels of equal sides, which else push labels out
        figure, axes = plots.figure(1, 3, 2.4, 2 * plots.COLUMN, layout="compressed")
    else:
        figure, axes = plots.in_place(axis)
    pressure, *others = np.ravel(axes)
    _from_above(pressure, state, state.pressure, "$p$", cmap="cividis")
    if others:
        moment = np.hypot(*state.micromoment.T) / state.solid.ell
        _from_above(others[0], state, moment, r"$|M|/\ell$", cmap="cividis")
        corners = len(state.pressures)
        none = "0.85" if state.squares is None else "w"  # not white at nodes: a mark has to be seen
        colours = ListedColormap([none, *("#C6DBEF", "#6BAED6", "#3182BD", "#08306B")[-corners:]])
        norm = BoundaryNorm(np.arange(-0.5, corners + 1), colours.N)
        bar = _from_above(others[1], state, state.closed, "closed corners", cmap=colours, norm=norm)
        bar.set_ticks(range(corners + 1))
    return figure


def _from_above(axis, state, values, label, **look):
    """The colour bar of values at cells or nodes, (n,), drawn from above."""
    if state.squares is not None:
        look = {"norm": Normalize(values.min(), values.max()), **look}
        for square, own in zip(state.squares, np.split(values, len(state.squares))):
            rows = own.reshape(square.count, square.count).T
            shown = axis.pcolormesh(*square.axes, rows, rasterized=True, **look)
    elif "norm" in look:  # numbers have nothing between nodes
        shown = axis.scatter(state.x1, state.x2, c=values, s=5, linewidths=0, **look)
    else:
        places = state.x1, state.x2, state.triangles
        shown = axis.tripcolor(*places, values, shading="gouraud", rasterized=True, **look)
    axis.set(xlabel="$x_1$", ylabel="$x_2$", title=label)
    axis.set(aspect="equal", adjustable="datalim", box_aspect=1)  # a row of squares has room above it
    axis.locator_params(nbins=4)  # as many as are there when the layout is made
    return axis.figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02)
