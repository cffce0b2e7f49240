"""One figure style: sizes for print, colours that the colour-blind can tell apart."""

import io
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from types import SimpleNamespace

import matplotlib
from matplotlib import mathtext
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from ..errors import require_kind, require_place, writing

SCREEN_DPI = 110  # of what notebooks show
COLUMN = 3.54  # inches, 9 cm: one column of a journal page, or a telephone
SMALLEST = 7  # points, of letters at that width
# Okabe and Ito's palette (2008), ordered for contrast on white
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
SCRIPTS = 0.87  # of indices and exponents over what they stand at: with 0.7, as elsewhere, 5 points are left
CAPTION = 8  # points
LETTERS = 16  # of a caption in an inch; 17.5 were measured
BELOW = 5.5  # of a legend under a panel, in its letters: room for ticks and label
STYLE = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "legend.fontsize": SMALLEST,
    "legend.title_fontsize": SMALLEST,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "axes.prop_cycle": cycler(color=COLOURS),
    "savefig.dpi": 250,
    "mathtext.fontset": "dejavusans",
    "axes.spines.top": False,
    "axes.spines.right": False,
}


@contextmanager
def styled():
    """The house style while something is drawn: STYLE, and indices and exponents that are read at 9 cm, for
    which matplotlib has no setting.
    """
    layout = getattr(mathtext, "_mathtext", SimpleNamespace())
    before = vars(layout).get("SHRINK_FACTOR")
    try:
        layout.SHRINK_FACTOR = SCRIPTS
        with matplotlib.rc_context(STYLE):
            yield
    finally:
        layout.SHRINK_FACTOR = before


class Drawing(Figure):
    """A figure that keeps the house style when it is drawn and saved, and shows itself in a notebook."""

    def captioned(self, text):
        """This figure with small letters above it, any text, broken where it is longer than the figure is
        wide.
        """
        lines = [fill(problem, int(LETTERS * self.get_figwidth())) for problem in text.splitlines()]
        self.suptitle("\n".join(lines), fontsize=CAPTION, parse_math=False)
        return self

    def draw(self, renderer):
        with styled():
            super().draw(renderer)

    def savefig(self, fname, **settings):
        """Save as matplotlib does; without an ending ".png" is added."""
        if not hasattr(fname, "write"):
            formats = self.canvas.get_supported_filetypes()
            require_place(fname, "file", formats)
            path = Path(fname)
            known = path.suffix[1:].lower() in formats
            fname = path if known or "format" in settings else path.with_name(f"{path.name}.png")
        with styled(), writing(fname, "file"):
            super().savefig(fname, **settings)

    def _repr_png_(self):
        written = io.BytesIO()
        self.savefig(written, format="png", dpi=SCREEN_DPI)
        return written.getvalue()


def figure(rows=1, columns=1, height=2.6, width=COLUMN, **grid):
    """An empty figure: (Figure, Axes or array of Axes); inches of all its width and of the height of a panel,
    `grid` as for subplots.
    """
    drawing = Drawing(figsize=(width, height * rows), layout="constrained")
    return drawing, drawing.subplots(rows, columns, **grid)


def in_place(axis, **size):
    """(Figure, Axes) of an axis that is given, or of a figure of its own; BadArgument where it is no Axes."""
    if axis is None:
        return figure(**size)
    require_kind(Axes, "an Axes of matplotlib", ax=axis)
    return axis.figure, axis


def legend_below(axis):
    """A legend under the panel and its label, where it cannot cover data."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=BELOW, ncols=2)
