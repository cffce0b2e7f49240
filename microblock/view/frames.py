"""Frames of a StateFigure as PNG: what a new state does not change is drawn once and kept as a picture."""

import io
from contextlib import contextmanager

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from . import plots

DPI = 96
LIGHT = 1  # compression of the PNG: higher takes longer than it saves
SAME = 1e-9  # of the ends of an axis: rounding
PAD = 1.02  # of a panel with its labels: next ones may be a little longer


class Frames:
    """Draws a figure with `drawing`, `axes` and `moving` again and again."""

    def __init__(self, figure, dpi=DPI):
        self.figure = figure
        figure.drawing.set_dpi(dpi)
        self.canvas = FigureCanvasAgg(figure.drawing)
        self._still = None

    def draw(self):
        """Draw the figure as it is; a panel's axes and labels anew only if they have other ends."""
        if self._still is None:
            self._draw_all()
        limits, canvas = self._limits(), self.canvas
        changed = [
            name for name in limits if not np.allclose(limits[name], self._drawn[name], rtol=SAME, atol=0)
        ]
        canvas.restore_region(self._still)
        with matplotlib.rc_context(plots.STYLE):
            if changed:
                self._draw_panels(changed)
                self._drawn = {**self._drawn, **{name: limits[name] for name in changed}}
            for axis, artist in self.figure.moving:
                axis.draw_artist(artist)

    def _limits(self):
        # heights of the blocks have no labels
        return {
            name: (*axis.get_xlim(), *(() if name == "blocks" else axis.get_ylim()))
            for name, axis in self.figure.axes.items()
        }

    def _draw_all(self):
        with self._without_moving():
            self.canvas.draw()
            # laid out once; later the panels stay where they are
            self.figure.drawing.set_layout_engine("none")
            renderer = self.canvas.get_renderer()
            boxes = {
                name: axis.get_tightbbox(renderer).expanded(PAD, PAD)
                for name, axis in self.figure.axes.items()
            }
            self._still, self._drawn = self.canvas.copy_from_bbox(self.figure.drawing.bbox), self._limits()
            renderer.clear()
            self.figure.drawing.patch.draw(renderer)  # white, or letters would lie on nothing
            self._blank = {name: self.canvas.copy_from_bbox(box) for name, box in boxes.items()}

    def _draw_panels(self, names):
        with self._without_moving():
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
        written = io.BytesIO()
        picture = Image.frombuffer("RGBA", self.canvas.get_width_height(), self.canvas.buffer_rgba())
        picture.save(written, format="png", compress_level=LIGHT)
        return written.getvalue()
