"""The figure of a state of the plane: curves over x1, zones and rotated blocks."""

import numpy as np

from . import blocks, plots

LABELS = {
    "pressure": "pressure\n$p$ (stress)",
    "micromoment": "micromoment\n" r"$M/\ell$ (stress)",
    "gap": "gap\n$g$ (length)",
    "turn": "rotation\n(degrees)",
}


@plots.styled
def draw(state):
    """The figure of a state about its contact."""
    surface, corners = blocks.without_rounding(state.surface()), tuple(state.pressures)
    drawing = plots.Drawing((2 * plots.COLUMN, 2 * plots.COLUMN), layout="constrained")
    places = [["pressure", "micromoment"], ["gap", "turn"], ["zones", "turn"], ["blocks", "blocks"]]
    axes = drawing.subplot_mosaic(places, height_ratios=(2, 2, 0.2 * (1 + len(state.zones)), 3))
    for name, lines in curves(surface).items():
        axes[name].axhline(0, color="0.85", linewidth=0.5, zorder=0)
        _plot(axes[name], surface, lines)
        axes[name].set_ylabel(LABELS[name])
        if len(lines) > 1:
            axes[name].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)
    most = 4 * state.load / state.contact_area if state.contact_area else np.inf
    for name in ("pressure", "micromoment"):
        _cut(axes[name], most)
    _bars(axes["zones"], state.zones, corners)
    for name in ("pressure", "micromoment", "gap", "turn", "zones"):
        axes[name].set(xlim=surface.x[[0, -1]], xlabel="$x_1$ (length)" * (name in ("turn", "zones")))
        axes[name].tick_params(labelbottom=name in ("turn", "zones"))
    blocks.draw_blocks(state, axes["blocks"])
    return drawing


@plots.styled
def draw_curves(axis, state):
    """The figure of an axis with pressures and micromoment of a state."""
    drawing, axis = plots.in_place(axis)
    surface = state.surface()
    shown = curves(surface)
    lines = *shown["pressure"], *((name, row, look | {"ls": ":"}) for name, row, look in shown["micromoment"])
    _plot(axis, surface, lines)
    axis.set(xlabel="$x_1$ (length)", ylabel="stress")
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=len(lines))
    return drawing


def _plot(axis, surface, lines):
    for label, row, look in lines:
        axis.plot(*blocks.interrupted(surface, np.stack((surface.x, row))), label=label, **look)


def curves(surface):
    """{panel: [(label, values, look), ...]} of a `Surface`."""
    looks = [{"color": colour, "ls": "--" if k == 1 else "-"} for k, colour in enumerate(plots.COLOURS)]
    look = {"color": plots.COLOURS[2]}
    shown = {
        "pressure": list(zip(_named("p", surface.corners), surface.pressures, looks)),
        "gap": list(zip(_named("g", surface.corners), surface.gaps, looks)),
        "micromoment": [(r"$M/\ell$", surface.micromoment / surface.ell, look)],
        "turn": [("", np.degrees(surface.rotation), look)],
    }
    if len(surface.corners) > 1:
        shown["pressure"].append(("$p$", surface.pressures.sum(axis=0), {"color": "0.45", "lw": 1}))
    return shown


def _named(letter, corners):
    return [rf"${letter}_{{\rm {corner}}}$" for corner in corners]


def _bars(axis, zones, corners):
    names = [*corners, "full"] if len(corners) > 1 else ["contact"]
    for number, name in enumerate(names):
        colour = plots.COLOURS[number] if name in corners else "k"
        for pair in zones[name]:
            axis.plot(pair, (number, number), color=colour, linewidth=5, solid_capstyle="butt")
    axis.set(yticks=range(len(names)), yticklabels=names, ylim=(len(names) - 0.5, -0.5), ylabel="closed")
    axis.tick_params(axis="y", length=0)


def _cut(axis, most):
    """Ends an axis at 4 times the mean pressure, of which a cylinder has 1.3, and says so."""
    low, high = axis.dataLim.intervaly
    if max(-low, high) <= most:
        return
    axis.set_ylim(max(low, -most), min(high, most))  # the curves beyond are cut off
    axis.text(1, 1.2, "cut at 4 times the mean pressure", transform=axis.transAxes, ha="right", fontsize=6)
