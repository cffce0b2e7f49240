"""Figure style: sizes for print, colours for the colour-blind."""

from __future__ import annotations

import io
from typing import Any, Literal, NamedTuple

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


class Room(NamedTuple):
    """What a layout leaves room for.

    Attributes
    ----------
    titles : lines of the figure's titles
    legends : of each panel whether it has one
    letters : of each panel those of its longest number beside it
    """

    titles: list[int]
    legends: list[bool]
    letters: list[int]


class Drawing(Figure):
    """A figure that shows itself in a notebook.

    Attributes
    ----------
    room : Room or None, of its last layout
    """

    room: Room | None = None

    def _repr_png_(self) -> bytes:
        self.lay_out()
        return self.png()

    def lay_out(self) -> None:
        """Places the panels, which takes as long as to draw them."""
        self.room = self._needed_room()
        engine = self.get_layout_engine()
        if engine is not None:
            engine.execute(self)

    def png(self) -> bytes:
        """Returns the picture of the panels where they are."""
        engine = self.get_layout_engine()
        self.set_layout_engine(None)  # with one matplotlib draws twice
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=110, pil_kwargs={"compress_level": 1})
        self.set_layout_engine(engine)
        return image.getvalue()

    def has_room(self) -> bool:
        """Returns whether the last layout has the room for what is drawn now."""
        needed = self._needed_room()
        if self.room is None or self.room._replace(letters=needed.letters) != needed:
            return False
        return all(letters >= now for letters, now in zip(self.room.letters, needed.letters))

    def empty(self) -> None:
        """Takes what is drawn in the panels out of them, and gives them the limits of new ones: in others a
        line of zeros gets those of the rounding of a transform.
        """
        for axis in self.axes:
            for artist in (*axis.lines, *axis.collections, *axis.texts, axis.get_legend()):
                if artist is not None:
                    artist.remove()
            axis.relim()
            axis.set(xlim=(0, 1), ylim=(0, 1), autoscale_on=True)

    def _needed_room(self) -> Room:
        numbers = [[label.get_text() for label in axis.get_yticklabels()] for axis in self.axes]
        return Room(
            titles=[text.get_text().count("\n") for text in self.texts],
            legends=[axis.get_legend() is not None for axis in self.axes],
            letters=[max(map(len, of_panel), default=0) for of_panel in numbers],
        )


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
