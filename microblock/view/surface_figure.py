"""The figure of a state in three dimensions: what is seen from above, and cuts or the micromoment."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from . import plots

CLOSED = ("#FFFFFF", "#C6DBEF", "#6BAED6", "#3182BD", "#08306B")  # none to four corners
OPEN = "#D9D9D9"  # none, where it is a mark that has to be seen on white


@plots.styled()
def draw(state, axis=None):
    """The figure of a state on cells or at nodes; into an axis that is given the pressure alone."""
    if axis is not None:
        figure, axis = plots.in_place(axis)
        from_above(axis, state, state.pressure, "$p$")
        return figure
    second = state.shape is not None and state.opposite is not None
    figure, axes = plots.figure(1, 3 + second, height=2.6, width=7.2 + 2.4 * second)
    figure.set_layout_engine("compressed")  # panels of equal sides, which else push labels out
    from_above(axes[0], state, state.pressure, "$p$")
    corners = len(state.pressures)
    look = colours_of(corners, CLOSED[0] if state.shape is not None else OPEN)
    numbered(from_above(axes[1], state, state.closed, "closed corners", **look), corners)
    if state.shape is None:
        from_above(axes[2], state, np.hypot(*state.micromoment.T) / state.solid.ell, r"$|M|/\ell$")
        return figure
    cuts(axes[2], state)
    if second:
        surfaces(axes[3], state)
    handles = [handle for axis in axes[2:] for handle in axis.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower right", ncols=len(handles))
    return figure


def from_above(axis, state, values, label, **look):
    """Values at cells or nodes, (n,), from above; the bar of their colours, which it returns."""
    look = {"cmap": "cividis"} | look
    if state.shape is not None:
        half = state.width / 2
        box = (state.x1[0] - half, state.x1[-1] + half, state.x2[0] - half, state.x2[-1] + half)
        cells = values.reshape(state.shape).T
        shown = axis.imshow(cells, extent=box, origin="lower", interpolation="nearest", **look)
    elif "norm" in look:  # numbers have nothing between nodes
        shown = axis.scatter(state.x1, state.x2, c=values, s=5, linewidths=0, **look)
    else:
        places = state.x1, state.x2, state.triangles
        shown = axis.tripcolor(*places, values, shading="gouraud", rasterized=True, **look)
    axis.set(xlabel="$x_1$", ylabel="$x_2$", aspect="equal", title=label)
    axis.locator_params(nbins=5)  # as many as are there when the layout is made
    return axis.figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02)


def cuts(axis, state):
    """Pressure along x1 and a diagonal, and the micromoment along x1."""
    along, across = state.along("x1"), state.along("diagonal")
    axis.plot(along["x1"], along["pressure"], label="$p$ along $x_1$")
    axis.plot(np.sqrt(2) * across["x1"], across["pressure"], label="$p$, diagonal")
    moment, look = along["m2"] / state.solid.ell, {"ls": "--", "color": plots.COLOURS[0]}
    axis.plot(along["x1"], moment, label=r"$M_2/\ell$ along $x_1$", **look)
    axis.set(xlabel="distance", ylabel="stress", xlim=state.x1[[0, -1]], box_aspect=1)


def surfaces(axis, state):
    """What both bodies are pressed in along x1, through the middle of the cells."""
    n = len(state.x2)
    for values, label, look in (
        (state.displacement, "first body", "-"),
        (state.opposite, "second body", "--"),
    ):
        middle = values.reshape(state.shape)[:, [(n - 1) // 2, n // 2]].mean(axis=1)
        axis.plot(state.x1, middle, look, color="k", label=label)
    axis.set(xlabel="$x_1$", xlim=state.x1[[0, -1]], title="displacement", box_aspect=1)


def colours_of(corners, none=CLOSED[0]):
    """Colours and their borders of numbers of closed corners, of as many as the law has."""
    colours = ListedColormap([none, *CLOSED[-corners:]])
    return {"cmap": colours, "norm": BoundaryNorm(np.arange(-0.5, corners + 1), colours.N)}


def numbered(bar, corners):
    """A bar of these colours with its numbers."""
    bar.set_ticks(range(corners + 1))
    bar.minorticks_off()
