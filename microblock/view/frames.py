"""Frames of a StateFigure as PNG: what a new state does not change is drawn once and kept as a picture."""

import struct
import zlib

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from . import plots

DPI = 96
LIGHT = 1  # compression of the PNG: higher takes longer than it saves


class Frames:
    """Draws a figure with `drawing`, `still` and `moving` again and again."""

    def __init__(self, figure, dpi=DPI):
        self.figure, self._look, self._background = figure, None, None
        figure.drawing.set_dpi(dpi)
        self.canvas = FigureCanvasAgg(figure.drawing)
        for artist in figure.moving:
            artist.set_animated(True)  # matplotlib leaves it out, but of files

    @plots.styled()
    def png(self):
        """The picture of the figure as it is, bytes."""
        drawing, look = self.figure.drawing, self.figure.still
        if look != self._look:
            self.canvas.draw()
            drawing.set_layout_engine("none")  # laid out once: later the panels stay in place
            self._background, self._look = self.canvas.copy_from_bbox(drawing.bbox), look
        self.canvas.restore_region(self._background)
        for artist in self.figure.moving:
            artist.axes.draw_artist(artist)
        return png(np.asarray(self.canvas.buffer_rgba())[..., :3])


def png(pixels):
    """Pixels (height, width, 3), bytes, as a PNG, bytes.

    No row has a filter: curves on white are not smaller with one, and to choose one takes Pillow 10 ms of a
    picture.
    """
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)  # eight bits of three colours
    chunks = b"IHDR" + header, b"IDAT" + zlib.compress(rows, LIGHT), b"IEND"
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk)) for chunk in chunks
    )
