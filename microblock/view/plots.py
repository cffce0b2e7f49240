"""One figure style: sizes for print, colours that the colour-blind can tell apart."""

import io
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill

import matplotlib
import numpy as np
from matplotlib import mathtext
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.rcsetup import cycler
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from ..errors import require_kind, require_place, writing

SCREEN_DPI = 110  # of what notebooks show
COLUMN = 3.54  # inches, 9 cm: one column of a journal page, or a telephone
SMALLEST = 7  # points, of letters at that width
# Okabe and Ito's palette (2008), ordered for contrast on white
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LINES = ("-", "--", "-.", ":")
SHADES = "viridis"  # of sequences: as light as they come also in grey
LIGHTEST = 0.8  # of it, where a line still stands out from white
CONTRAST = 4.5  # of letters with white, what the guidelines for accessible pages ask for
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
    """The house style while something is drawn: STYLE, and indices and exponents that are read at 9 cm.

    matplotlib has no setting for the latter; where it no longer has the constant they are as small as
    elsewhere.
    """
    layout = getattr(mathtext, "_mathtext", None)
    before = getattr(layout, "SHRINK_FACTOR", None)
    with matplotlib.rc_context(STYLE):
        if before is None:
            yield
            return
        layout.SHRINK_FACTOR = SCRIPTS
        try:
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


def letter(axes, *titles):
    """Titles "(a) ..." of panels, at their left."""
    for axis, name, title in zip(np.ravel(axes), "abcdefghijkl", titles or [""] * np.size(axes)):
        axis.set_title(f"({name})  {title}".strip(), loc="left")


def shades(count):
    """Colours of a sequence, such as loads, from dark to light."""
    return [matplotlib.colormaps[SHADES](LIGHTEST * place) for place in np.linspace(0, 1, count)]


def legible(colour):
    """A colour for letters on white: that of a curve, darker where it is too light for letters."""
    rgb = np.array(to_rgb(colour))
    while _contrast(rgb) < CONTRAST:
        rgb = 0.95 * rgb
    return tuple(rgb)


def _contrast(rgb):
    """Contrast with white, as the Web Content Accessibility Guidelines define it."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return 1.05 / (linear @ (0.2126, 0.7152, 0.0722) + 0.05)


def label(axis, x, y, text, colour="k", shift=(4, 0), **words):
    """Words beside a point, in the colour of its curve; a white edge keeps them legible across lines.

    shift : (right, up) in points
    """
    side = {"ha": "left" if shift[0] > 0 else "right" if shift[0] < 0 else "center", "va": "center"}
    return axis.annotate(
        text,
        (x, y),
        shift,
        textcoords="offset points",
        color=legible(colour),
        path_effects=[withStroke(linewidth=2, foreground="white")],
        **{"fontsize": SMALLEST, **side, **words},
    )


def key(drawing, words, colours, markers=None, **style):
    """One line above all panels that says which colour is what, in the order of the sequence; with `markers`
    also which mark.
    """
    looks = zip(words, colours, markers or [None] * len(words))
    handles = [
        Line2D([], [], color=colour, label=text, marker=marker, **style) for text, colour, marker in looks
    ]
    drawing.legend(
        handles=handles,
        loc="outside upper center",
        ncols=len(handles),
        handlelength=0.9,
        handletextpad=0.3,
        columnspacing=0.8,
    )


def legend_below(axis, columns=2, title=None):
    """A legend under the panel and its label, where it cannot cover data."""
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=BELOW, ncols=columns, title=title)


def legend_of_all(drawing, axis, columns=4, title=None):
    """One legend below all panels for what `axis` shows."""
    drawing.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=columns, title=title)


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
    with styled():
        finished = drawing(data)
        finished.draw_without_rendering()
        finished.set_layout_engine("none")  # laid out once for both files
        for path in paths:
            part = path.with_name(f".{path.name}")
            finished.savefig(part)
            part.replace(path)
    return paths
