"""The figure of a state of a half-space: pressure and closed corners from above, and cuts."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from . import plots

CLOSED = ("#FFFFFF", "#C6DBEF", "#6BAED6", "#3182BD", "#08306B")  # none to four corners


@plots.styled()
def draw(state, axis=None):
    """The figure of a state on cells; into an axis that is given the pressure alone."""
    half = state.width / 2
    box = (state.x1[0] - half, state.x1[-1] + half, state.x2[0] - half, state.x2[-1] + half)
    pressure, closed = (values.reshape(state.shape) for values in (state.pressure, state.closed))
    if axis is not None:
        figure, axis = plots.in_place(axis)
        colour_map(axis, pressure, box, "$p$")
        return figure
    second = state.opposite is not None
    figure, axes = plots.figure(1, 3 + second, height=2.6, width=7.2 + 2.4 * second)
    figure.set_layout_engine("compressed")  # panels of equal sides, which else push labels out
    colour_map(axes[0], pressure, box, "$p$")
    closed_map(axes[1], closed, box, len(state.pressures))
    for axis in axes[:2]:
        axis.set(xlabel="$x_1$", ylabel="$x_2$")
        axis.locator_params(nbins=5)  # as many as are there when the layout is made
    for number, (direction, label) in enumerate((("x1", "$p$ along $x_1$"), ("diagonal", "$p$, diagonal"))):
        cut = state.along(direction)
        along = cut["x1"] * (np.sqrt(2) if direction == "diagonal" else 1)
        axes[2].plot(along, cut["pressure"], color=plots.COLOURS[number], label=label)
    cut = state.along("x1")
    axes[2].plot(
        cut["x1"], cut["m2"] / state.solid.ell, "--", color=plots.COLOURS[0], label=r"$M_2/\ell$ along $x_1$"
    )
    axes[2].set(xlabel="distance", ylabel="stress", xlim=box[:2])
    axes[2].set_box_aspect(1)
    if second:
        surfaces(axes[3], state, box)
    handles = [handle for axis in axes[2:] for handle in axis.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower right", ncols=len(handles))
    return figure


def surfaces(axis, state, box):
    """What both bodies are pressed in along x1, through the middle of the cells."""
    n = len(state.x2)
    for values, label, look in (
        (state.displacement, "first body", "-"),
        (state.opposite, "second body", "--"),
    ):
        values = values.reshape(state.shape)
        axis.plot(state.x1, values[:, [(n - 1) // 2, n // 2]].mean(axis=1), look, color="k", label=label)
    axis.set(xlabel="$x_1$", xlim=box[:2])
    axis.set_title("displacement")
    axis.set_box_aspect(1)


def colour_map(axis, values, box, label, **look):
    """Values of cells from above, (n1, n2), with a bar of colours as high as the panel."""
    look = {"cmap": "cividis"} | look
    shown = axis.imshow(values.T, extent=box, origin="lower", interpolation="nearest", aspect="equal", **look)
    axis.set_title(label)
    return axis.figure.colorbar(shown, ax=axis, shrink=0.9, pad=0.02)


def closed_map(axis, closed, box, corners):
    """The number of closed corners of cells from above, of as many as the law has."""
    numbered(colour_map(axis, closed, box, "closed corners", **colours_of(corners)), corners)


def colours_of(corners, none=CLOSED[0]):
    """Colours and their borders of numbers of closed corners, of as many as the law has."""
    colours = ListedColormap([none, *CLOSED[-corners:]])
    return {"cmap": colours, "norm": BoundaryNorm(np.arange(-0.5, corners + 1), colours.N)}


def numbered(bar, corners):
    """A bar of these colours with its numbers."""
    bar.set_ticks(range(corners + 1))
    bar.minorticks_off()
