"""Pictures of the fields below the surface."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from ..errors import require_choice
from ..model.fields import FIRST_ROW, largest_shear
from ..model.state import State
from ..model.types import Array, Axes, Figure
from . import plots

QUANTITIES = {
    "psi": r"microrotation $\psi$ (degrees)",
    "s22": r"$-\sigma_{22}$ (stress)",
    "s11": r"$-\sigma_{11}$ (stress)",
    "skew": r"$\sigma_{12} - \sigma_{21}$ (stress)",
    "shear": "largest shear stress (stress)",
}


SIGNED = ("psi", "skew")


@plots.styled
def draw_below(state: State, quantity: str, axis: Axes | None) -> Figure:
    """Returns the figure of an axis, or a new one, with contours of one of QUANTITIES below the contact of a
    state.
    """
    require_choice(QUANTITIES, field=quantity)
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=4.0)  # a wrong one before the fields
    contact = state.zones["contact"]
    left = contact[0][0]
    right = contact[-1][1]
    depth = right - left
    ends = (left - depth / 2, right + depth / 2)
    x1, x2, triangles, psi, stress = state.solution.fields_below((ends, depth))
    triangulation = Triangulation(x1, x2, triangles)
    field = _field(quantity, psi, stress)
    # edges of the contact and corners of a body may have no bound
    contours = _contour_values(quantity, field[x2 <= -FIRST_ROW * depth])
    for interval in contact:
        axis.plot(interval, [0, 0], color="k", linewidth=5, solid_capstyle="butt")
    colours = "cividis"  # both are distinguished by the colour-blind
    if quantity in SIGNED:
        colours = "RdBu_r"
        # dashed where negative: the ends of the colours are equally dark in print; at 0 is noise
        lines = contours[np.abs(contours) > (contours[1] - contours[0]) / 2]
        axis.tricontour(triangulation, field, lines, colors="k", linewidths=0.5)
    surfaces = axis.tricontourf(triangulation, field, contours, cmap=colours, extend="both")
    axis.set(xlabel="$x_1$ (length)", ylabel="$x_2$ (length)", aspect="equal", xlim=ends)
    axis.set_ylim(max(x2.min(), -depth), max(0.03 * depth, x2.max()))
    drawing.colorbar(surfaces, ax=axis, label=QUANTITIES[quantity], shrink=0.75)
    return drawing


def _field(quantity: str, psi: Array, stress: Array) -> Array:
    """Returns one of QUANTITIES, array (n,), of the microrotation (n,) and the stress (2, 2, n)."""
    (s11, s12), (s21, s22) = stress
    fields = {
        "psi": np.degrees(psi),
        "s22": -s22,
        "s11": -s11,
        "skew": s12 - s21,
        "shear": largest_shear(stress),
    }
    return fields[quantity]


def _contour_values(quantity: str, field: Array) -> Array:
    """Returns about 20 values of contour lines, array (m,), of a field (n,) without its extremes; of a field
    with a sign symmetric ones.
    """
    low, high = np.quantile(field, (2e-3, 1 - 2e-3))
    if quantity in SIGNED:
        high = max(abs(low), abs(high))
        low = -high
    return np.asarray(MaxNLocator(20).tick_values(low, high))
