"""A state of a history in a figure: shear traction within the bounds of friction, and the loop so far."""

import numpy as np

from ..model.zones import contains
from . import plots


class FrictionFigure:
    """Two panels that take new states: shear traction over x1 (a), shear force over slip (b).

    Attributes
    ----------
    drawing : matplotlib figure
    """

    @plots.styled()
    def __init__(self):
        self.drawing, (self._tractions, self._loop) = plots.figure(2, 1, height=2.2)

    @plots.styled()
    def update(self, state, loop):
        """Shows a state with friction, and the way to it: pairs (slip, shear over f P)."""
        self._tractions.clear()
        self._loop.clear()
        bound = state.law.friction * state.pressure
        left, right = state.zones["contact"][0][0], state.zones["contact"][-1][1]
        beside, top = 0.15 * (right - left), 1.15 * float(bound.max())
        stick, words = contains(state.zones["stick"], state.x), r"friction allows $\pm f p$"
        self._tractions.fill_between(state.x, -top, top, where=stick, color="0.9", linewidth=0)
        self._tractions.plot(
            state.x, state.shear_traction, color=plots.COLOURS[1], label="shear traction $q$"
        )
        self._tractions.plot(state.x, bound, ":", color="0.4", label=words)
        self._tractions.plot(state.x, -bound, ":", color="0.4")
        self._tractions.set(xlabel="$x_1$", ylabel="stress", ylim=(-top, top))
        self._tractions.set_xlim(left - beside, right + beside)
        self._tractions.set_title("(a)  shaded: stick", loc="left")
        plots.legend_below(self._tractions)
        draw_loop(self._loop, loop)
        self._loop.plot(*loop[-1], "o", color=plots.COLOURS[0])
        self._loop.set_title("(b)  the way so far", loc="left")
        slips = [slip for slip, _ in loop]
        span = np.ptp(slips) or right - left  # one point alone
        self._loop.set(xlim=(min(slips) - 0.05 * span, max(slips) + 0.05 * span), ylim=(-1.1, 1.1))
        return self


@plots.styled()
def draw_loop(axis, loop):
    """The figure of an axis, into which the loop is drawn: pairs (slip, shear over f P)."""
    drawing, axis = plots.in_place(axis)
    axis.plot(*np.transpose(loop), color=plots.COLOURS[0])
    axis.set(xlabel="mean slip, weighted by pressure", ylabel="$Q/(fP)$")
    return drawing


def slip_and_shear(state):
    """A point of the loop: the mean slip with the pressure as weight, and Q/(f P)."""
    slip = float(state.weights @ (state.pressure * state.slip)) / state.load
    return slip, state.shear / (state.law.friction * state.load)
