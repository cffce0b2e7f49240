"""The figure of a state of a half-space: pressure and closed corners from above, and a cut."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from . import plots

CLOSED = ("#FFFFFF", "#C6DBEF", "#6BAED6", "#3182BD", "#08306B")  # none to four corners


def draw(state):
    """The figure of a SurfaceState."""
    figure, axes = plots.figure(1, 3, height=2.8, width=2.9)
    half = state.width / 2
    box = (state.x1[0] - half, state.x1[-1] + half, state.x2[0] - half, state.x2[-1] + half)
    kept = {"extent": box, "origin": "lower", "interpolation": "nearest"}
    shown = axes[0].imshow(state.pressure.T, cmap="cividis", **kept)
    figure.colorbar(shown, ax=axes[0], label="pressure $p$", shrink=0.8)
    corners = len(state.pressures)
    colours = ListedColormap([CLOSED[0], *CLOSED[-corners:]])
    shown = axes[1].imshow(
        state.closed.T, cmap=colours, norm=BoundaryNorm(np.arange(-0.5, corners + 1), colours.N), **kept
    )
    figure.colorbar(shown, ax=axes[1], label="closed corners", ticks=range(corners + 1), shrink=0.8)
    for axis in axes[:2]:
        axis.set(xlabel="$x_1$", ylabel="$x_2$", aspect="equal")
    for number, (direction, label) in enumerate((("x1", "along $x_1$"), ("diagonal", "on the diagonal"))):
        cut = state.along(direction)
        along = cut["x1"] * (np.sqrt(2) if direction == "diagonal" else 1)
        axes[2].plot(along, cut["pressure"], color=plots.COLOURS[number], label=f"$p$ {label}")
    cut = state.along("x1")
    axes[2].plot(
        cut["x1"],
        cut["m2"] / state.problem.solid.ell,
        "--",
        color=plots.COLOURS[0],
        label=r"$M_2/\ell$ along $x_1$",
    )
    axes[2].set(xlabel="distance from the middle", ylabel="stress")
    plots.legend_below(axes[2], columns=1)
    return figure
