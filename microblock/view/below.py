"""Pictures of the fields below the surface."""

import numpy as np
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from ..errors import require_choice
from ..model.fields import FIRST_ROW, largest_shear
from . import plots

QUANTITIES = {
    "psi": r"microrotation $\psi$ (degrees)",
    "s22": r"$-\sigma_{22}$ (stress)",
    "s11": r"$-\sigma_{11}$ (stress)",
    "skew": r"$\sigma_{12} - \sigma_{21}$ (stress)",
    "shear": "largest shear stress (stress)",
}


@plots.styled
def draw_below(state, quantity, axis):
    """A Figure with contours of one of QUANTITIES of a state whose solution has fields_below(box): x1, x2,
    triangles (m, 3), psi, stress (2, 2, n) at points (n,), box ((left, right), depth).
    """
    require_choice(QUANTITIES, field=quantity)
    contact = state.zones["contact"]
    left, right = contact[0][0], contact[-1][1]
    depth = right - left
    ends = left - depth / 2, right + depth / 2
    x1, x2, triangles, psi, stress = state.solution.fields_below((ends, depth))
    (s11, s12), (s21, s22) = stress
    known = {"psi": np.degrees(psi), "s22": -s22, "s11": -s11, "skew": s12 - s21}
    known["shear"] = largest_shear(stress)
    triangulation, field = Triangulation(x1, x2, triangles), known[quantity]
    deep = field[x2 <= -FIRST_ROW * depth]  # edges of the contact and corners of a body may have no bound
    low, high = np.quantile(deep, (2e-3, 1 - 2e-3))
    signed, size = quantity in ("psi", "skew"), max(abs(low), abs(high))
    levels = MaxNLocator(20).tick_values(*((-size, size) if signed else (low, high)))
    drawing, axis = plots.in_place(axis, width=2 * plots.COLUMN, height=4.0)
    for pair in contact:
        axis.plot(pair, [0, 0], color="k", linewidth=5, solid_capstyle="butt")
    if signed:  # dashed where negative: the ends of the colours are equally dark in print; at 0 is noise
        lines = levels[np.abs(levels) > (levels[1] - levels[0]) / 2]
        axis.tricontour(triangulation, field, lines, colors="k", linewidths=0.5)
    colours = "RdBu_r" if signed else "cividis"  # distinguished by the colour-blind
    drawn = axis.tricontourf(triangulation, field, levels, cmap=colours, extend="both")
    axis.set(xlabel="$x_1$ (length)", ylabel="$x_2$ (length)", aspect="equal", xlim=ends)
    axis.set_ylim(max(x2.min(), -depth), max(0.03 * depth, x2.max()))
    drawing.colorbar(drawn, ax=axis, label=QUANTITIES[quantity], shrink=0.75)
    return drawing
