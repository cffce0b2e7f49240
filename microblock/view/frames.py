"""Frames of a StateFigure as PNG: what a new state does not change is drawn once and kept as a picture."""

import struct
import zlib
from contextlib import contextmanager

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from . import plots

DPI = 96
LIGHT = 1  # compression of the PNG: higher takes longer than it saves
SAME = 1e-9  # of the ends of an axis: rounding
PAD = 1.02  # of a panel with its labels: next ones may be a little longer


class Frames:
    """Draws a figure with `drawing`, `axes`, `still` and `moving` again and again."""

    def __init__(self, figure, dpi=DPI):
        self.figure = figure
        figure.drawing.set_dpi(dpi)
        self.canvas = FigureCanvasAgg(figure.drawing)
        self._still = None

    def draw(self):
        """Draw the figure as it is; a panel's axes and labels anew only if they have changed."""
        if self._still is None:
            self._draw_all()
        looks = self.figure.still
        changed = [name for name in looks if not _alike(looks[name], self._drawn[name])]
        self.canvas.restore_region(self._still)
        if changed:
            self._draw_panels(changed)
            self._drawn = {**self._drawn, **{name: looks[name] for name in changed}}
        for axis, artist in self.figure.moving:
            axis.draw_artist(artist)

    def renew(self):
        """Draw all of it anew the next time: its legends have changed."""
        self._still = None

    def _draw_all(self):
        with plots.styled(), self._without_moving():
            self.canvas.draw()
            # laid out once; later the panels stay where they are
            self.figure.drawing.set_layout_engine("none")
            renderer = self.canvas.get_renderer()
            boxes = {
                name: axis.get_tightbbox(renderer).expanded(PAD, PAD)
                for name, axis in self.figure.axes.items()
            }
            self._still, self._drawn = (
                self.canvas.copy_from_bbox(self.figure.drawing.bbox),
                dict(self.figure.still),
            )
            renderer.clear()
            self.figure.drawing.patch.draw(renderer)  # white, or letters would lie on nothing
            self._blank = {name: self.canvas.copy_from_bbox(box) for name, box in boxes.items()}

    def _draw_panels(self, names):
        with plots.styled(), self._without_moving():
            for name in names:
                self.canvas.restore_region(self._blank[name])
                self.figure.axes[name].draw(self.canvas.get_renderer())
        self._still = self.canvas.copy_from_bbox(self.figure.drawing.bbox)

    @contextmanager
    def _without_moving(self):
        moving = self.figure.moving
        for _, artist in moving:
            artist.set_visible(False)
        yield
        for _, artist in moving:
            artist.set_visible(True)

    def png(self):
        """The picture as last drawn, bytes."""
        return png(np.asarray(self.canvas.buffer_rgba())[..., :3])


def _alike(look, other):
    (ends, words), (others, before) = look, other
    return words == before and np.allclose(ends, others, rtol=SAME, atol=0)


def png(pixels):
    """Pixels (height, width, 3), bytes, as a PNG, bytes.

    No row has a filter: curves on white are not smaller with one, and to choose one takes Pillow 10 ms of a
    picture.
    """
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    eight_bits_of_three_colours = 8, 2, 0, 0, 0
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(*each)
        for each in (
            (b"IHDR", struct.pack(">2I5B", width, height, *eight_bits_of_three_colours)),
            (b"IDAT", zlib.compress(rows, LIGHT)),
            (b"IEND", b""),
        )
    )


def _chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
