"""Charts of the study `limits`, from its records: a row a panel, what became of each run, its error, its
iterations.
"""

import textwrap

import numpy as np
from matplotlib import cm, colors
from matplotlib.ticker import LogFormatterMathtext, LogLocator, MaxNLocator, NullLocator, StrMethodFormatter

from microblock.view import plots

from .limits_maps import ANSWERED, KINDS

BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = plots.COLOURS
STYLES = dict(
    zip(
        KINDS,
        (
            ("o", SKY),
            ("s", GREEN),
            ("^", ORANGE),
            ("X", RED),
            ("P", BLACK),
            ("D", PINK),
            ("v", BLACK),
            ("*", BLACK),
        ),
    )
)
COLUMNS = ("error", "iterations", "oscillation", "wrong_sign")
ROOM = 0.04  # of an axis, beyond its ends
ACROSS, WIDTH, HEIGHT = 3, 2.33, 1.7  # panels in a row, and the size of one: two columns of a page
ABOVE = 0.9  # inches for the question, bars and the legend
LETTERS = 34  # of a question, over a panel
SIZE = 10  # of a mark
TICKS = 4  # of a bar or an axis
SHADES = "cividis"
# ticks where there is less than a decade
NICE = np.outer(10.0 ** np.arange(-6, 6), (1, 1.2, 1.5, 2, 3, 4, 5, 7)).ravel()


def chart(drawn, rows):
    """The records of one map, a panel of the map a row (a column where it has more measures than a page has
    room for).
    """
    name, values = drawn.panels
    columns = {
        column: norm
        for column in COLUMNS
        if (norm := _norm([row[column] for row in rows if _shaded(row, column)]))
    }
    upright = 1 + len(columns) > ACROSS
    shape = (1 + len(columns), len(values)) if upright else (len(values), 1 + len(columns))
    drawing, axes = plots.figure(*shape, height=HEIGHT, width=WIDTH, squeeze=False)
    drawing.set_size_inches(shape[1] * WIDTH, shape[0] * HEIGHT + ABOVE)
    panels = axes.T if upright else axes
    for line, value in zip(panels, values):
        mine = [row for row in rows if not name or row[name] == value]
        _kinds(line[0], drawn, mine)
        for axis, (column, norm) in zip(line[1:], columns.items()):
            _shades(axis, drawn, [row for row in mine if _shaded(row, column)], column, norm)
        line[0].set_title(f"{name} {value}".strip(), fontsize=8, loc="left")
    for axis in axes.flat:
        _frame(axis, *drawn.axes[:2])
        axis.label_outer()
    for line, (column, norm) in zip(panels.T[1:], columns.items()):
        _bar(
            drawing, list(line), norm, drawn.error if column == "error" else column.replace("_", " "), upright
        )
    drawing.suptitle(textwrap.fill(drawn.question, LETTERS * shape[1]), fontsize=9)
    handles = {
        text: handle for axis in panels[:, 0] for handle, text in zip(*axis.get_legend_handles_labels())
    }
    drawing.legend(
        handles.values(),
        handles,
        loc="outside lower center",
        ncols=4,
        title="what became of each run",
        title_fontsize=7,
    )
    return drawing


def _shaded(row, column):
    return row[column] is not None and row["kind"] in ANSWERED and row[column] > 0


def _norm(values):
    """Shades of these values, logarithmic over more than a decade; None without values."""
    if not values:
        return None
    kind = colors.LogNorm if max(values) > 10 * min(values) else colors.Normalize
    return kind(min(values), max(values))


def _places(drawn, rows):
    """Where the runs lie in the chart: two arrays."""
    return [np.array([axis.place(row[axis.name]) for row in rows], float) for axis in drawn.axes[:2]]


def _kinds(axis, drawn, rows):
    for kind in KINDS:
        mine = [row for row in rows if row["kind"] == kind]
        if mine:
            marker, colour = STYLES[kind]
            axis.scatter(
                *_places(drawn, mine),
                s=SIZE,
                marker=marker,
                color=colour,
                edgecolors="0.3",
                linewidths=0.2,
                label=kind,
            )


def _shades(axis, drawn, rows, column, norm):
    axis.scatter(
        *_places(drawn, rows),
        c=[row[column] for row in rows],
        s=SIZE,
        norm=norm,
        cmap=SHADES,
        edgecolors="0.3",
        linewidths=0.2,
    )


def _bar(drawing, axes, norm, label, upright):
    """One bar for all panels of a measure: below them, or right of them."""
    bar = drawing.colorbar(
        cm.ScalarMappable(norm, SHADES),
        ax=axes,
        label=label,
        location="right" if upright else "top",
        **({"aspect": 15, "pad": 0.02} if upright else {"aspect": 20, "pad": 0.01}),
    )
    bar.ax.tick_params(labelsize=7)
    if isinstance(norm, colors.LogNorm):
        decades = np.log10(norm.vmax / norm.vmin)
        few = LogLocator(subs=(1, 3) if decades > 1.3 else (1, 2, 5))
        bar.locator = LogLocator(numticks=TICKS) if decades > 2 else few
        bar.formatter = LogFormatterMathtext() if decades > 2 else StrMethodFormatter("{x:g}")
    else:
        bar.locator, bar.formatter = (
            MaxNLocator(TICKS - 1, integer=label == "iterations"),
            StrMethodFormatter("{x:g}"),
        )
    bar.minorlocator = NullLocator()
    bar.update_ticks()


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
        axis.set(**{f"{name}lim": ends})  # degenerate ends lie where the axis goes


def _scaled(axis, side, name, one):
    """Scale and ticks of an axis of numbers; its ends, with room for the marks."""
    if one.scale == "linear":
        side.set_major_locator(MaxNLocator(TICKS, integer=one.high - one.low > TICKS))
        room = ROOM * (one.high - one.low)
        return one.low - room, one.high + room
    axis.set(**{f"{name}scale": "log"})
    if 0.1 < one.low / one.high < 10:  # no decade to mark
        ticks = NICE[(0.99 * min(one.low, one.high) < NICE) & (1.01 * max(one.low, one.high) > NICE)]
        side.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    else:
        side.set_major_locator(LogLocator(numticks=4))  # labels of twelve decades overlap else
    side.set_minor_locator(NullLocator())
    room = (one.high / one.low) ** ROOM
    return one.low / room, one.high * room
