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


class Drawing(Figure):
    """A figure that shows itself in a notebook."""

    def _repr_png_(self) -> bytes:
        return self.png()

    def png(self, before: Drawing | None = None) -> bytes:
        """Returns the picture. Its panels are where those of the drawing `before` it are, if that has the
        room for titles, legends and numbers: to lay panels out takes as long as to draw them.
        """
        engine = self.get_layout_engine()
        self._room = _room(self)
        if before is not None and _has_room(before._room, self._room):
            self._room = before._room
            for axis, axis_before in zip(self.axes, before.axes):
                axis.set_position(axis_before.get_position(original=True).bounds)
            for text, text_before in zip(self.texts, before.texts):
                text.set_position(text_before.get_position())
        elif engine is not None:
            engine.execute(self)
        self.set_layout_engine(None)  # else matplotlib draws twice
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=110, pil_kwargs={"compress_level": 1})
        self.set_layout_engine(engine)
        return image.getvalue()


class Room(NamedTuple):
    """What a layout leaves room for.

    Attributes
    ----------
    titles : lines of the figure's titles
    panels : of each panel its place on the grid, None of a colour bar, and whether it has a legend
    letters : of each panel those of its longest number along x2
    """

    titles: list[int]
    panels: list[tuple[Any, bool]]
    letters: list[int]


def _room(drawing: Figure) -> Room:
    """Returns the Room that a figure needs."""
    places = [axis.get_subplotspec() for axis in drawing.axes]
    return Room(
        titles=[text.get_text().count("\n") for text in drawing.texts],
        panels=[
            (place and place.get_position(drawing).bounds, axis.get_legend() is None)
            for axis, place in zip(drawing.axes, places)
        ],
        letters=[
            max((len(label.get_text()) for label in axis.get_yticklabels()), default=0)
            for axis in drawing.axes
        ],
    )


def _has_room(layout: Room, needed: Room) -> bool:
    """Returns whether a layout leaves the room that another drawing needs, without colour bars, which lie
    beside a grid.
    """
    alike = layout.titles == needed.titles and layout.panels == needed.panels
    on_grids = all(place for place, _ in needed.panels)
    return alike and on_grids and all(a >= b for a, b in zip(layout.letters, needed.letters))


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
