"""Charts of the study `limits`, from its records: a row a panel, what became of each run, its error, its iterations."""

import matplotlib
import numpy as np
from matplotlib.ticker import LogLocator, NullLocator

from cases.limits_maps import ANSWERED, KINDS
from microblock import plots

BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = plots.COLOURS
STYLES = dict(zip(KINDS, (("o", SKY), ("s", GREEN), ("^", ORANGE), ("X", RED), ("P", BLACK), ("D", PINK), ("v", BLACK), ("*", BLACK))))
COLUMNS = ("error", "iterations", "oscillation", "wrong_sign")


def chart(drawn, rows):
    """The records of one map."""
    name, values = drawn.panels
    columns = [column for column in COLUMNS if any(row[column] is not None for row in rows)]
    drawing, axes = plots.figure(len(values), 1 + len(columns), height=2.3, width=2.6, squeeze=False)
    for line, value in zip(axes, values):
        mine = [row for row in rows if not name or row[name] == value]
        _kinds(line[0], drawn, mine)
        for axis, column in zip(line[1:], columns):
            _shades(drawing, axis, drawn, mine, column)
        line[0].set_title(f"{name} {value}".strip(), fontsize=8, loc="left")
    for axis in axes.flat:
        _frame(axis, *drawn.axes[:2])
    handles = {text: handle for axis in axes[:, 0] for handle, text in zip(*axis.get_legend_handles_labels())}
    drawing.legend(handles.values(), handles, loc="outside lower center", ncols=4)
    return drawing


def _places(drawn, rows):
    """Where the runs lie in the chart: two arrays."""
    return [np.array([axis.place(row[axis.name]) for row in rows], float) for axis in drawn.axes[:2]]


def _kinds(axis, drawn, rows):
    for kind in KINDS:
        mine = [row for row in rows if row["kind"] == kind]
        if mine:
            marker, colour = STYLES[kind]
            axis.scatter(*_places(drawn, mine), s=9, marker=marker, color=colour, linewidths=0, label=f"{kind}")


def _shades(drawing, axis, drawn, rows, column):
    mine = [row for row in rows if row[column] is not None and row["kind"] in ANSWERED and row[column] > 0]
    if mine:
        norm = matplotlib.colors.LogNorm()
        points = axis.scatter(*_places(drawn, mine), c=[row[column] for row in mine], s=9, norm=norm, cmap="cividis", linewidths=0)
        drawing.colorbar(points, ax=axis, label=drawn.error if column == "error" else column.replace("_", " "))


def _frame(axis, across, up):
    for one, set_scale, invert, label, side in ((across, axis.set_xscale, axis.invert_xaxis, axis.set_xlabel, axis.xaxis),
                                                (up, axis.set_yscale, axis.invert_yaxis, axis.set_ylabel, axis.yaxis)):
        label(one.label)
        if one.choices:
            side.set_ticks(range(len(one.choices)), one.choices)
            side.set_tick_params(rotation=90 if one is across else 0)
            (axis.set_xlim if one is across else axis.set_ylim)(-0.5, len(one.choices) - 0.5)
        elif one.scale != "linear":
            set_scale("log")
            if 0.1 < one.low/one.high < 10:      # no decade to mark
                side.set_ticks((one.low, one.high), (f"{one.low:g}", f"{one.high:g}"))
            else:
                side.set_major_locator(LogLocator(numticks=4))      # labels of twelve decades overlap else
            side.set_minor_locator(NullLocator())
        if one.low > one.high:
            invert()      # degenerate ends lie where the axis goes
