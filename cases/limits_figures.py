"""Charts of the study `limits`, from its records: a row a panel, what became of each run, its error, its iterations."""

import textwrap

import numpy as np
from matplotlib import colors
from matplotlib.ticker import LogLocator, NullLocator

from cases.limits_maps import ANSWERED, KINDS
from microblock import plots

BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = plots.COLOURS
STYLES = dict(zip(KINDS, (("o", SKY), ("s", GREEN), ("^", ORANGE), ("X", RED), ("P", BLACK), ("D", PINK), ("v", BLACK), ("*", BLACK))))
COLUMNS = ("error", "iterations", "oscillation", "wrong_sign")
ROOM = 0.04      # of an axis, beyond its ends


def chart(drawn, rows):
    """The records of one map; shades mean the same in all its panels."""
    name, values = drawn.panels
    columns = {column: norm for column in COLUMNS if (norm := _norm([row[column] for row in rows if _shaded(row, column)]))}
    drawing, axes = plots.figure(len(values), 1 + len(columns), height=2.0, width=2.5, squeeze=False)
    for line, value in zip(axes, values):
        mine = [row for row in rows if not name or row[name] == value]
        _kinds(line[0], drawn, mine)
        for axis, (column, norm) in zip(line[1:], columns.items()):
            _shades(drawing, axis, drawn, [row for row in mine if _shaded(row, column)], column, norm)
        line[0].set_title(f"{name} {value}".strip(), fontsize=8, loc="left")
    for axis in axes.flat:
        _frame(axis, *drawn.axes[:2])
        axis.label_outer()
    drawing.suptitle(textwrap.fill(drawn.question, 38*(1 + len(columns))), fontsize=9)
    handles = {text: handle for axis in axes[:, 0] for handle, text in zip(*axis.get_legend_handles_labels())}
    drawing.legend(handles.values(), handles, loc="outside lower center", ncols=4)
    return drawing


def _shaded(row, column):
    return row[column] is not None and row["kind"] in ANSWERED and row[column] > 0


def _norm(values):
    """Shades of these values, logarithmic over more than a decade; None without values."""
    if not values:
        return None
    kind = colors.LogNorm if max(values) > 10*min(values) else colors.Normalize
    return kind(min(values), max(values))


def _places(drawn, rows):
    """Where the runs lie in the chart: two arrays."""
    return [np.array([axis.place(row[axis.name]) for row in rows], float) for axis in drawn.axes[:2]]


def _kinds(axis, drawn, rows):
    for kind in KINDS:
        mine = [row for row in rows if row["kind"] == kind]
        if mine:
            marker, colour = STYLES[kind]
            axis.scatter(*_places(drawn, mine), s=9, marker=marker, color=colour, linewidths=0, label=f"{kind}")


def _shades(drawing, axis, drawn, rows, column, norm):
    points = axis.scatter(*_places(drawn, rows), c=[row[column] for row in rows], s=9, norm=norm, cmap="cividis", linewidths=0)
    bar = drawing.colorbar(points, ax=axis, label=drawn.error if column == "error" else column.replace("_", " "))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    if isinstance(norm, colors.LogNorm):
        bar.ax.yaxis.set_major_locator(LogLocator(numticks=5))


def _frame(axis, across, up):
    for one, name in ((across, "x"), (up, "y")):
        side = getattr(axis, f"{name}axis")
        side.set_label_text(one.label)
        if one.choices:
            side.set_ticks(range(len(one.choices)), one.choices)
            side.set_tick_params(rotation=90 if one is across else 0)
            ends = -0.5, len(one.choices) - 0.5
        else:
            ends = _scaled(axis, side, name, one)
        axis.set(**{f"{name}lim": ends})      # degenerate ends lie where the axis goes


def _scaled(axis, side, name, one):
    """Scale and ticks of an axis of numbers; its ends, with room for the marks."""
    if one.scale == "linear":
        room = ROOM*(one.high - one.low)
        return one.low - room, one.high + room
    axis.set(**{f"{name}scale": "log"})
    if 0.1 < one.low/one.high < 10:      # no decade to mark
        side.set_ticks((one.low, one.high), (f"{one.low:g}", f"{one.high:g}"))
    else:
        side.set_major_locator(LogLocator(numticks=4))      # labels of twelve decades overlap else
    side.set_minor_locator(NullLocator())
    room = (one.high/one.low)**ROOM
    return one.low/room, one.high*room
