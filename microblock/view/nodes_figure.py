"""The figure of a contact state of a body in three dimensions: what is at its nodes, from above."""

import numpy as np

from . import plots
from .surface_figure import colours_of, numbered

OPEN = "#D9D9D9"  # a mark that is seen on white


@plots.styled()
def draw(state, axis=None):
    """The figure of a state at nodes; into an axis that is given the pressure alone."""
    x1, x2, triangles = state.x1, state.x2, state.triangles
    moment = np.hypot(*state.micromoment.T) / state.solid.ell
    if axis is None:
        figure, axes = plots.figure(1, 3, height=2.4, width=7.2)
        panels = (axes[0], state.pressure, "$p$"), (axes[2], moment, r"$|M|/\ell$")
        closed_nodes(axes[1], x1, x2, state.closed, len(state.pressures))
    else:
        figure, axis = plots.in_place(axis)
        axes, panels = [axis], [(axis, state.pressure, "$p$")]
    for axis, values, label in panels:
        shown = axis.tripcolor(x1, x2, triangles, values, shading="gouraud", cmap="cividis", rasterized=True)
        axis.set_title(label)
        figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02)
    for axis in axes:
        axis.set(xlabel="$x_1$", ylabel="$x_2$", aspect="equal")
    return figure


def closed_nodes(axis, x1, x2, closed, corners):
    """The number of closed corners at nodes, as marks from above, of as many as the law has."""
    shown = axis.scatter(x1, x2, c=closed, s=5, linewidths=0, **colours_of(corners, none=OPEN))
    axis.set_title("closed corners")
    numbered(axis.figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02), corners)
