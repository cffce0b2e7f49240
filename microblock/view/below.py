"""Pictures of the fields below the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from ..errors import require, require_choice
from ..model.fields import FIRST_ROW, largest_shear
from ..model.intervals import joined
from ..model.state import State
from ..model.types import Array, Axes, Figure, Interval
from . import plots

QUANTITIES = {
    "psi": r"microrotation $\psi$ (degrees)",
    "s11": r"$-\sigma_{11}$ (stress)",
    "s22": r"$-\sigma_{22}$ (stress)",
    "s33": r"$-\sigma_{33}$ (stress)",
    "skew": r"skew shear stress (stress)",
    "shear": "largest shear stress in the plane (stress)",
    "max_shear": "largest shear stress (stress)",
    "von_mises": "von Mises stress (stress)",
}


SIGNED = ("psi", "skew")


@plots.styled
def draw_below(state: State, quantity: str, axis: Axes | None, x2: float | None) -> Figure:
    """Returns the figure of an axis, or a new one, with contours of one of QUANTITIES below the contact of a
    state, in space in the plane x2, without it in that of the centre of pressure.
    """
    require_choice(QUANTITIES, field=quantity)
    require(not state.flat or x2 is None, "x2", x2, "is the plane of a cut in space")
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=4.0)  # a wrong one before the fields
    if not state.flat and x2 is None:
        x2 = state.centre[1]
    contact = _contact(state, x2)
    left = contact[0][0]
    right = contact[-1][1]
    depth = right - left
    beside = depth / 2
    if state.solution.period is not None:  # the contact of one period is black
        beside = min(beside, max(state.solution.period - depth, 0.0) / 2)
    ends = (left - beside, right + beside)
    below, triangles = state.solution.fields_below((ends, depth), x2)
    up = below.x2 if state.flat else below.x3
    triangulation = Triangulation(below.x1, up, triangles)
    field = _field(quantity, below)
    # edges of the contact and corners of a body may have no bound
    bounded = field[up <= -FIRST_ROW * depth]
    contours = _contour_values(quantity, bounded)
    for interval in contact:
        axis.plot(interval, [0, 0], color="k", linewidth=5, solid_capstyle="butt")
    colours = "cividis"  # both are distinguished by the colour-blind
    if quantity in SIGNED:
        colours = "RdBu_r"
        # dashed where negative: the ends of the colours are equally dark in print; at 0 is noise
        lines = contours[np.abs(contours) > (contours[1] - contours[0]) / 2]
        axis.tricontour(triangulation, field, lines, colors="k", linewidths=0.5)
    surfaces = axis.tricontourf(triangulation, field, contours, cmap=colours, extend="both")
    vertical = "$x_2$" if state.flat else "$x_3$"
    axis.set(xlabel="$x_1$ (length)", ylabel=f"{vertical} (length)", aspect="equal", xlim=ends)
    axis.set_ylim(max(up.min(), -depth), max(0.03 * depth, up.max()))
    largest = bounded[np.abs(bounded).argmax()]
    at = np.flatnonzero(field == largest)[0]
    axis.plot(below.x1[at], up[at], "+", color="k", markersize=8)
    label = f"{QUANTITIES[quantity]}\n+ {largest:.3g}, largest deeper than {FIRST_ROW * depth:.1g}"
    drawing.colorbar(surfaces, ax=axis, label=label, shrink=0.75)
    return drawing


def _contact(state: State, x2: Any) -> list[Interval]:
    """Returns intervals of x1 in contact, in space in the row of cells next to the plane x2, beside which the
    whole extent is the first or last, empty, interval.
    """
    if state.flat:
        return state.zones["contact"]
    closed = state.points[state.closed > 0]
    half = np.sqrt(state.weights[state.closed > 0]) / 2 if state.squares else np.zeros(len(closed))
    left, right = float((closed[:, 0] - half).min()), float((closed[:, 0] + half).max())
    in_row = np.abs(closed[:, 1] - x2) <= half
    touching = 1 + 1e-9  # neighbours, for rounding
    row = [(float(x - h), float(x + h)) for x, h in zip(closed[in_row, 0], touching * half[in_row])]
    return [(left, left), *joined(row), (right, right)]


def _field(quantity: str, below: Any) -> Array:
    """Returns one of QUANTITIES, array (n,), of PointFields or SpaceFields."""
    if quantity in ("von_mises", "max_shear"):
        return np.asarray(getattr(below, quantity))
    if quantity in ("s11", "s22", "s33"):
        number = int(quantity[-1]) - 1
        return -below.symmetric_stress[number, number]
    up = len(below.stress) - 1
    in_cut = below.stress[np.ix_((0, up), (0, up))]
    fields = {
        "psi": np.degrees(below.psi if up == 1 else -below.psi[1]),
        "skew": in_cut[0, 1] - in_cut[1, 0],
        "shear": largest_shear(in_cut),
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
