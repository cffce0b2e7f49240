"""A state of a history in a figure: shear traction within the bounds of friction, and the loop so far."""

import numpy as np

from ..model.zones import contains
from . import plots

ROOM = 0.15  # of the contact, beside it
HEADROOM = 1.15  # of the largest value, above it


class FrictionFigure:
    """Two panels that take new states: shear traction over x1 (a), shear force over slip (b).

    Attributes
    ----------
    drawing : matplotlib figure
    """

    def __init__(self):
        with plots.styled():
            self.drawing, (self._tractions, self._loop) = plots.figure(2, 1, height=2.2)
            colours = plots.COLOURS
            (self._shear,) = self._tractions.plot([], [], color=colours[1], label="shear traction $q$")
            self._bounds = [
                self._tractions.plot([], [], ":", color="0.4", label=label)[0]
                for label in (r"friction allows $\pm f p$", None)
            ]
            self._stick = None
            (self._way,) = self._loop.plot([], [], color=colours[0])
            (self._now,) = self._loop.plot([], [], "o", color=colours[0], ms=4)
            self._tractions.set(xlabel="$x_1$", ylabel="stress")
            self._loop.set(xlabel="mean slip, weighted by pressure", ylabel="$Q/(fP)$", ylim=(-1.1, 1.1))
            plots.legend_below(self._tractions)
            plots.letter((self._tractions, self._loop), "shaded: stick", "the way so far")

    def update(self, state, loop):
        """Shows a state with friction, and the way to it: pairs (slip, shear over f P)."""
        bound = state.law.friction * state.pressure
        self._shear.set_data(state.x, state.shear_traction)
        for line, sign in zip(self._bounds, (1, -1)):
            line.set_data(state.x, sign * bound)
        left, right = state.zones["contact"][0][0], state.zones["contact"][-1][1]
        beside, top = ROOM * (right - left), HEADROOM * float(bound.max())
        self._tractions.set(xlim=(left - beside, right + beside), ylim=(-top, top))
        if self._stick is not None:
            self._stick.remove()
        self._stick = self._tractions.fill_between(
            state.x,
            -top,
            top,
            where=contains(state.zones["stick"], state.x),
            color="0.9",
            linewidth=0,
            zorder=0,
        )
        slip, shear = np.transpose(loop)
        self._way.set_data(slip, shear)
        self._now.set_data(slip[-1:], shear[-1:])
        span = np.ptp(slip) or right - left  # one point alone
        self._loop.set_xlim(slip.min() - 0.05 * span, slip.max() + 0.05 * span)
        return self


@plots.styled()
def draw_loop(axis, loop):
    """The figure of an axis, into which the loop is drawn: pairs (slip, shear over f P)."""
    drawing, axis = plots.in_place(axis)
    axis.plot(*np.transpose(loop), color=plots.COLOURS[0])
    axis.set(xlabel="mean slip, weighted by pressure", ylabel="$Q/(fP)$")
    return drawing


def slip_and_shear(state):
    """A point of the loop: the mean slip with the pressure as weight, along which the work of the shear is
    dissipated where all slips; and Q/(f P).
    """
    slip = float(state.weights @ (state.pressure * state.slip)) / state.load
    return slip, state.shear / (state.law.friction * state.load)
