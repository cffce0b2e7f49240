"""Figure of a history of shear within the bounds of friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from ..model.intervals import contains
from ..model.state import State
from ..model.types import Array, Axes, Figure
from . import plots, surface_figure

FAR_APART = 0.3  # of f P between two loads, on which a loop of hysteresis has no area that is seen


@plots.styled
def draw_history(states: Sequence[State], axis: Axes | None) -> Figure:
    """Returns the figure of a history: shear traction of the last state (a), the way there (b) and the
    dissipated energy (c); of an axis with the way alone.
    """
    if axis is not None:
        return draw_loop(axis, states)
    drawing, (tractions, loop, dissipation) = plots.figure(3, 1, height=2.2)
    if not states[-1].flat:
        surface_figure.draw_shear(tractions, states[-1])
        tractions.set_title("")
        tractions.set_title("(a)  $|q|$; white line: stick zone", loc="left")
    else:
        _draw_tractions(tractions, states[-1])
        tractions.set_title("(a)  shaded: stick", loc="left")
        plots.legend_below(tractions)
    draw_loop(loop, states)
    loop.set_title("(b)  loading path", loc="left")
    _draw_dissipation(dissipation, states)
    dissipation.set_title("(c)  dissipation", loc="left")
    return drawing


def _draw_tractions(axis: Axes, state: State) -> None:
    """Draws the shear traction of a state within the bounds of friction, stick shaded."""
    x = state.x
    traction: Any = state.shear_traction
    bound = state.law.friction * state.pressure
    contact = state.zones["contact"]
    left = contact[0][0]
    right = contact[-1][1]
    margin = 0.15 * (right - left)
    top = 1.15 * float(bound.max())
    axis.fill_between(x, -top, top, where=contains(state.zones["stick"], x), color="0.9", linewidth=0)
    axis.plot(x, traction, color=plots.COLOURS[1], label="shear traction $q$")
    axis.plot(x, bound, ":", color="0.4", label=r"friction allows $\pm f p$")
    axis.plot(x, -bound, ":", color="0.4")
    axis.set(xlabel="$x_1$ (length)", ylabel="stress", ylim=(-top, top), xlim=(left - margin, right + margin))


@plots.styled
def draw_loop(axis: Axes | None, states: Sequence[State]) -> Figure:
    """Returns the figure of an axis with Q/(f P) of states over their mean slip, a spot a load; in space of
    the parts along the largest shear force. Between loads that are far apart straight lines are dotted: the
    way there is none.
    """
    drawing, axis = plots.in_place(axis)
    direction = _direction(states)
    slips = [_mean_slip(state) @ direction for state in states]
    shears = [_relative_shear(state) @ direction for state in states]
    is_coarse = np.abs(np.diff(shears)).max(initial=0.0) > FAR_APART
    style = ":" if is_coarse else "-"
    axis.plot(slips, shears, style, color=plots.COLOURS[0], marker="o", markersize=3)
    if is_coarse:
        axis.text(
            0.02,
            0.97,
            "dotted: more loads show the way between",
            transform=axis.transAxes,
            va="top",
            fontsize=7,
        )
    axis.set(xlabel="mean slip, weighted by pressure (length)", ylabel="$Q/(fP)$", ylim=(-1.1, 1.1))
    return drawing


def _draw_dissipation(axis: Axes, states: Sequence[State]) -> None:
    """Draws the energy that the steps to each state have dissipated."""
    dissipated: Any = [state.dissipation for state in states]
    axis.plot(np.arange(1, len(states) + 1), dissipated, color=plots.COLOURS[2], marker="o")
    thickness = " per thickness" if states[-1].flat else ""
    axis.set(xlabel="number of the load", ylabel=f"energy{thickness}")
    axis.set_ylim(bottom=0)
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))


def _direction(states: Sequence[State]) -> Array:
    """Returns the unit vector along the largest Q/(f P) of states in space, array (2,); in the plane (1,)."""
    if states[-1].flat:
        return np.ones(1)
    largest = max(map(_relative_shear, states), key=np.linalg.norm)
    size = float(np.linalg.norm(largest))
    return largest / size if size else np.array((1.0, 0.0))


def _mean_slip(state: State) -> Array:
    """Returns the slip of a state with friction, weighted by pressure, array (1,) or (2,) (length)."""
    slip: Any = state.slip
    return np.atleast_1d((state.weights * state.pressure) @ slip / state.load)


def _relative_shear(state: State) -> Array:
    """Returns Q/(f P) of a state with friction, array (1,) or (2,)."""
    return np.atleast_1d(state.shear / (state.law.friction * state.load))
