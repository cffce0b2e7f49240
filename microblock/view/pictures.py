"""Figures of results, as `microblock.model.views.Pictures` names them."""

from __future__ import annotations

from ..model.state import State
from ..model.types import Axes, Figure
from . import state_figure, surface_figure
from .below import draw_below as draw_below
from .blocks import draw_blocks as draw_blocks
from .history_figure import draw_history as draw_history
from .identification_figure import draw_identification as draw_identification
from .path_figure import draw_path as draw_path
from .sweep_figure import draw_rows as draw_rows


def draw_state(state: State, axis: Axes | None) -> Figure:
    """Returns the figure of a state; of an axis with pressures, in the plane also micromoment."""
    if not state.flat:
        return surface_figure.draw(state, axis)
    if axis is None:
        return state_figure.draw(state)
    return state_figure.draw_curves(axis, state)
