"""The figure of a state of the plane: curves over x1, zones and rotated blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..model.state import State
from ..model.surface import Surface
from ..model.types import Array, Axes, Figure, Zones
from . import blocks, plots

LABELS = {
    "pressure": "pressure\n$p$ (stress)",
    "micromoment": "micromoment\n" r"$M/\ell$ (stress)",
    "gap": "gap\n$g$ (length)",
    "turn": "rotation\n(degrees)",
}


class Curve(NamedTuple):
    """A line over x1: values (n,) at the points of a surface, and options of matplotlib."""

    label: str
    values: Array
    look: dict[str, Any]


@plots.styled
def draw(state: State, drawing: plots.Drawing | None = None) -> Figure:
    """Returns the figure of a state about its contact: that of a state before, drawn anew, or a new one."""
    if drawing is None:
        drawing = plots.Drawing((2 * plots.COLUMN, 2 * plots.COLUMN), layout="constrained")
        panels: Any = [["pressure", "micromoment"], ["gap", "turn"], ["zones", "turn"], ["blocks", "blocks"]]
        drawing.subplot_mosaic(panels, height_ratios=(2, 2, 0.2 * (1 + len(state.zones)), 3))
    else:
        drawing.empty()
    surface = blocks.without_rounding(state.surface())
    axes = {axis.get_label(): axis for axis in drawing.axes}
    for name, lines in curves(surface).items():
        axes[name].axhline(0, color="0.85", linewidth=0.5, zorder=0)
        _plot(axes[name], surface, lines)
        axes[name].set_ylabel(LABELS[name])
        if len(lines) > 1:
            axes[name].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)
    if state.contact_area:
        for name in ("pressure", "micromoment"):
            _cut(axes[name], 4 * state.load / state.contact_area)
    _bars(axes["zones"], state.zones, tuple(state.pressures))
    for name in (*LABELS, "zones"):
        axes[name].set_xlim(surface.x[0], surface.x[-1])
        if name in ("turn", "zones"):  # the lowest panels
            axes[name].set_xlabel("$x_1$ (length)")
        else:
            axes[name].tick_params(labelbottom=False)
    blocks.draw_blocks(state, axes["blocks"])
    return drawing


@plots.styled
def draw_curves(axis: Axes, state: State) -> Figure:
    """Returns the figure of an axis with pressures and micromoment of a state."""
    drawing, axis = plots.in_place(axis)
    surface = state.surface()
    panels = curves(surface)
    dotted = [curve._replace(look=curve.look | {"ls": ":"}) for curve in panels["micromoment"]]
    lines = panels["pressure"] + dotted
    _plot(axis, surface, lines)
    axis.set(xlabel="$x_1$ (length)", ylabel="stress")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=len(lines))
    return drawing


def _plot(axis: Axes, surface: Surface, lines: Sequence[Curve]) -> None:
    for label, values, look in lines:
        x, heights = blocks.with_interruptions(surface, np.stack((surface.x, values)))
        axis.plot(x, heights, label=label, **look)


def curves(surface: Surface) -> dict[str, list[Curve]]:
    """Returns {panel: its curves} of a surface."""
    colour = plots.COLOURS[2]
    panels = {
        "pressure": _of_corners("p", surface, surface.pressures),
        "gap": _of_corners("g", surface, surface.gaps),
        "micromoment": [Curve(r"$M/\ell$", surface.micromoment / surface.ell, {"color": colour})],
        "turn": [Curve("", np.degrees(surface.rotation), {"color": colour})],
    }
    if len(surface.corners) > 1:
        panels["pressure"].append(Curve("$p$", surface.pressures.sum(axis=0), {"color": "0.45", "lw": 1}))
    return panels


def _of_corners(letter: str, surface: Surface, rows: Array) -> list[Curve]:
    """Returns the curves of rows (corners, n), the second one dashed."""
    return [
        Curve(rf"${letter}_{{\rm {corner}}}$", row, {"color": colour, "ls": style})
        for corner, row, colour, style in zip(surface.corners, rows, plots.COLOURS, ("-", "--"))
    ]


def _bars(axis: Axes, zones: Zones, corners: tuple[str, ...]) -> None:
    """Draws the zones of the corners and of both, of a law without corners the contact, as bars."""
    names = ["contact"]
    if len(corners) > 1:
        names = [*corners, "full"]
    for number, name in enumerate(names):
        colour = "k"
        if name in corners:
            colour = plots.COLOURS[number]
        for interval in zones[name]:
            axis.plot(interval, (number, number), color=colour, linewidth=5, solid_capstyle="butt")
    axis.set(yticks=range(len(names)), yticklabels=names, ylim=(len(names) - 0.5, -0.5), ylabel="closed")
    axis.tick_params(axis="y", length=0)


def _cut(axis: Axes, most: float) -> None:
    """Ends an axis at 4 times the mean pressure, of which a cylinder has 1.3, and says so."""
    low, high = axis.dataLim.intervaly
    if max(-low, high) <= most:
        return
    axis.set_ylim(max(low, -most), min(high, most))  # the curves beyond are cut off
    axis.text(1, 1.2, "cut at 4 times the mean pressure", transform=axis.transAxes, ha="right", fontsize=6)
