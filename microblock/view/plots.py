"""Figure style: sizes for print, colours for the colour-blind."""

import io
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from ..errors import require_kind

COLUMN = 3.54  # inches, 9 cm: one column of a journal page, or a telephone
# Okabe and Ito's palette (2008), ordered for contrast on white
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.titlesize": "medium",
    # points, the smallest letters at the width of a column
    **dict.fromkeys(("legend.fontsize", "legend.title_fontsize", "xtick.labelsize", "ytick.labelsize"), 7),
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "axes.linewidth": 0.5,
    "legend.frameon": False,
    "legend.handlelength": 1.2,
    "axes.prop_cycle": cycler(color=COLOURS),
    "figure.dpi": 250,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
styled = matplotlib.rc_context(STYLE)


class Drawing(Figure):
    """A figure that shows itself in a notebook."""

    def _repr_png_(self):
        written = io.BytesIO()
        self.savefig(written, format="png", dpi=110, pil_kwargs={"compress_level": 1})
        return written.getvalue()


def figure(rows=1, columns=1, height=2.6, width=COLUMN, layout="constrained"):
    """An empty (Figure, Axes or array of Axes); inches of its width and of a panel's height."""
    drawing = Drawing(figsize=(width, height * rows), layout=layout)
    return drawing, drawing.subplots(rows, columns)


def in_place(axis, **size):
    """(Figure, Axes) of an axis, or of a new figure; BadArgument where it is no Axes."""
    if axis is None:
        return figure(**size)
    require_kind(Axes, "an Axes of matplotlib", ax=axis)
    return axis.figure, axis


def legend_below(axis):
    """A legend under the panel and its label."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=5.5, ncols=2)
