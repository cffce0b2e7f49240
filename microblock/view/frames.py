"""Frames of a StateFigure as PNG: what a new state does not change is drawn once and kept as a picture."""

import io

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from . import plots


class Frames:
    """Draws a figure with `drawing`, `still` and `moving` again and again."""

    def __init__(self, figure, dpi=96):
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
    """Pixels (height, width, 3), bytes, as a PNG, bytes; compressed as fast as can be."""
    written = io.BytesIO()
    Image.fromarray(pixels).save(written, "png", compress_level=1)
    return written.getvalue()
