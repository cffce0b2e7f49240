"""Figure style: sizes for print, colours for the colour-blind."""

import io
from typing import Any, Literal

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

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=110, pil_kwargs={"compress_level": 1})
        return image.getvalue()


def figure(
    rows: int = 1,
    columns: int = 1,
    height: float = 2.6,
    width: float = COLUMN,
    layout: Literal["constrained", "compressed"] = "constrained",
) -> tuple[Drawing, Any]:
    """Returns an empty figure and its Axes, of several panels their array (rows, columns), without the ones
    among these; height of a panel and width of the figure in inches.
    """
    drawing = Drawing(figsize=(width, height * rows), layout=layout)
    return drawing, drawing.subplots(rows, columns)


def in_place(axis: Axes | None, height: float = 2.6, width: float = COLUMN) -> tuple[Any, Axes]:
    """Returns the figure and the Axes of an axis, or of a new figure of this size (inches); raises
    BadArgument if it is no Axes.
    """
    if axis is None:
        return figure(height=height, width=width)
    require_kind(Axes, "an Axes of matplotlib", ax=axis)
    return axis.figure, axis


def legend_below(axis: Axes) -> None:
    """Puts a legend under the panel and its label."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=5.5, ncols=2)
