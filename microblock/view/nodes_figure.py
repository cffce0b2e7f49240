"""The figure of a state at the nodes of a body: that of all states of three dimensions."""

from .surface_figure import draw as draw
