"""Figures of a history of shear within the bounds of friction, and of the events of a path."""

import numpy as np

from ..model.intervals import contains
from . import plots

MARKS = {"born": "o", "merged": "^", "split": "v", "vanished": "x"}


@plots.styled
def draw_history(states, axis):
    """The figure of a history: shear traction of the last state (a), and the way there (b); of an axis with
    the way alone.
    """
    if axis is not None:
        return draw_loop(axis, states)
    drawing, (tractions, loop) = plots.figure(2, 1)
    state = states[-1]
    bound, x = state.law.friction * state.pressure, state.x
    left, right = state.zones["contact"][0][0], state.zones["contact"][-1][1]
    beside, top = 0.15 * (right - left), 1.15 * float(bound.max())
    stick = contains(state.zones["stick"], x)
    tractions.fill_between(x, -top, top, where=stick, color="0.9", linewidth=0)
    tractions.plot(x, state.shear_traction, color=plots.COLOURS[1], label="shear traction $q$")
    tractions.plot(x, bound, ":", color="0.4", label=r"friction allows $\pm f p$")
    tractions.plot(x, -bound, ":", color="0.4")
    tractions.set(xlabel="$x_1$", ylabel="stress", ylim=(-top, top), xlim=(left - beside, right + beside))
    tractions.set_title("(a)  shaded: stick", loc="left")
    plots.legend_below(tractions)
    draw_loop(loop, states)
    loop.set_title("(b)  the way so far", loc="left")
    return drawing


@plots.styled
def draw_loop(axis, states):
    """The figure of an axis with Q/(f P) of states over their mean slip."""
    drawing, axis = plots.in_place(axis)
    slips = [state.weights @ (state.pressure * state.slip) / state.load for state in states]
    shares = [state.shear / (state.law.friction * state.load) for state in states]
    axis.plot(slips, shares, color=plots.COLOURS[0], marker="o", markevery=[-1])
    axis.set(xlabel="mean slip, weighted by pressure", ylabel="$Q/(fP)$", ylim=(-1.1, 1.1))
    return drawing


@plots.styled
def draw_path(path, axis):
    """The figure of the events of a LoadPath."""
    drawing, axis = plots.in_place(axis)
    for kind, zone in dict.fromkeys((event.kind, event.zone) for event in path.events):
        rows = [(e.x, e.load, e.load_error) for e in path.events if (e.kind, e.zone) == (kind, zone)]
        axis.errorbar(*np.transpose(rows), fmt=MARKS[kind], label=f"{zone} {kind}")
    axis.set(xlabel="$x_1$ (length)", ylabel="load (force per thickness)", ylim=(0, 1.05 * path.last))
    if path.events:
        plots.legend_below(axis)
    return drawing
