"""One figure style: sizes for print, colours that the colour-blind can tell apart."""

import io
from textwrap import fill

import matplotlib
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

SCREEN_DPI = 110  # of what notebooks show
COLUMN = 3.5  # inches, one column of a journal page
# Okabe and Ito's palette (2008), ordered for contrast on white
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LINES = ("-", "--", "-.", ":")
CAPTION = 8  # points
LETTERS = 16  # of a caption in an inch; 17.5 were measured
BELOW = 5.5  # of a legend under a panel, in its letters: room for ticks and label
STYLE = {
    "font.size": 8,
    "axes.labelsize": 9,
    "legend.fontsize": 7,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "axes.prop_cycle": cycler(color=COLOURS),
    "savefig.dpi": 200,
    "mathtext.fontset": "stix",
    "axes.spines.top": False,
    "axes.spines.right": False,
}


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
        with matplotlib.rc_context(STYLE):
            super().draw(renderer)

    def savefig(self, fname, **settings):
        with matplotlib.rc_context(STYLE):
            super().savefig(fname, **settings)

    def _repr_png_(self):
        written = io.BytesIO()
        self.savefig(written, format="png", dpi=SCREEN_DPI)
        return written.getvalue()


def figure(rows=1, columns=1, height=2.6, width=COLUMN, **grid):
    """An empty figure: (Figure, Axes or array of Axes); sizes in inches a panel, `grid` as for subplots."""
    drawing = Drawing(figsize=(width * columns, height * rows), layout="constrained")
    return drawing, drawing.subplots(rows, columns, **grid)


def legend_below(axis, columns=2, title=None):
    """A legend under the panel and its label, where it cannot cover data."""
    axis.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, 0),
        borderaxespad=BELOW,
        ncols=columns,
        title=title,
        title_fontsize=7,
    )


def legend_of_all(drawing, axis, columns=4, title=None):
    """One legend below all panels for what `axis` shows."""
    drawing.legend(
        *axis.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=columns,
        title=title,
        title_fontsize=7,
    )


def plain_log(side):
    """Labels 1, 2, 5, 10, ... of a logarithmic axis (`axis.xaxis` or `axis.yaxis`) over few decades."""
    side.set_major_locator(LogLocator(subs=(1, 2, 5)))
    side.set_major_formatter(StrMethodFormatter("{x:g}"))
    side.set_minor_locator(NullLocator())


def draw(drawing, data, folder, name):
    """Call ``drawing(data) -> Figure`` in the house style and write PNG and PDF, each whole or not at all;
    their paths.
    """
    paths = [folder / f"{name}.{kind}" for kind in ("png", "pdf")]
    with matplotlib.rc_context(STYLE):
        finished = drawing(data)
        finished.draw_without_rendering()
        finished.set_layout_engine("none")  # laid out once for both files
        for path in paths:
            part = path.with_name(f".{path.name}")
            finished.savefig(part)
            part.replace(path)
    return paths
