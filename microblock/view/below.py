"""Pictures of the fields below the surface, and in all of a body on a mesh."""

import numpy as np
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation

from ..errors import NotConverged, require_choice
from . import plots

QUANTITIES = {
    "psi": r"microrotation $\psi$ (degrees)",
    "s22": r"$-\sigma_{22}$ (stress)",
    "s11": r"$-\sigma_{11}$ (stress)",
    "skew": r"$\sigma_{12} - \sigma_{21}$ (stress)",
    "shear": "largest shear stress (stress)",
}
ACROSS, DOWN = 61, 25  # points of the picture, the latter denser towards the surface
FIRST = 0.02  # of the depth: the uppermost row
LEVELS = 20  # colours at most
ROUNDING = 1e-9
RARE = 2e-3  # of the points of a body, on either side, that lie beyond the ends of the colours


def draw_below(state, quantity="psi", axis=None):
    """A Figure of one of QUANTITIES below the contact, of a state whose solution has fields_below(box) ->
    (x1, x2, triangles (m, 3), psi, stress (2, 2, n)) at points (n,), box ((left, right), depth).
    """
    require_choice(QUANTITIES, field=quantity)
    contact = state.solution.zones_by_name["contact"]
    if not contact:
        raise NotConverged("nothing touches: there is no field below a contact")
    middle, half = (contact[-1][1] + contact[0][0]) / 2, (contact[-1][1] - contact[0][0]) / 2
    box = (middle - 2 * half, middle + 2 * half), 2 * half
    x1, x2, triangles, psi, stress = state.solution.fields_below(box)
    deep = x2 <= -FIRST * box[1] * (1 - ROUNDING)  # nearer to the surface a stress may have no bound
    ends = box[0], (max(x2.min(), -box[1]), max(0.03 * box[1], x2.max()))
    field = values(psi, stress, quantity)
    return _filled(2.9, axis, Triangulation(x1, x2, triangles), field, quantity, deep, ends, contact)


def draw_body(state, quantity="psi", axis=None):
    """A Figure of one of QUANTITIES in all of a body on a mesh."""
    require_choice(QUANTITIES, field=quantity)
    x1, x2, triangles, psi, stress = state.solution.fields_below(((-np.inf, np.inf), np.inf))
    field = values(psi, stress, quantity)
    # next to edges of the contact and corners of the body a stress may have no bound
    low, high = np.quantile(field, (RARE, 1 - RARE))
    height = float(np.clip(4.2 * np.ptp(x2) / np.ptp(x1) + 0.9, 1.5, 6.0))
    ends, shown = ((x1.min(), x1.max()), (x2.min(), x2.max())), (field >= low) & (field <= high)
    return _filled(height, axis, Triangulation(x1, x2, triangles), field, quantity, shown, ends)


@plots.styled()
def _filled(height, axis, triangulation, field, quantity, shown, ends, contact=()):
    """A Figure with contours of a quantity, the contact in black, and a bar of the colours."""
    drawing, axis = plots.in_place(axis, height=height, width=5.2)
    for left, right in contact:
        axis.plot([left, right], [0, 0], color="k", linewidth=5, solid_capstyle="butt")
    drawn = _contours(axis, triangulation, field, quantity in ("psi", "skew"), shown)
    axis.set(xlabel="$x_1$ (length)", ylabel="$x_2$ (length)", aspect="equal", xlim=ends[0], ylim=ends[1])
    # those beyond the first and last colour would stand at its end, beside the one that belongs there
    low, high = drawn.levels[0], drawn.levels[-1]
    margin = ROUNDING * (high - low)
    ticks = [one for one in MaxNLocator(6).tick_values(low, high) if low - margin <= one <= high + margin]
    drawing.colorbar(drawn, ax=axis, label=QUANTITIES[quantity], shrink=0.75, ticks=ticks)
    return drawing


def _contours(axis, triangulation, values, signed, shown):
    """Filled contours whose ends are those of the values at the points `shown`."""
    low, high = values[shown].min(), values[shown].max()
    size = max(abs(low), abs(high))
    levels = MaxNLocator(LEVELS).tick_values(-size if signed else low, size if signed else high)
    beyond = ("neither", "min"), ("max", "both")
    # dashed where it is negative: the two ends of the colours are equally dark in print. At 0 is only noise
    if signed:
        axis.tricontour(
            triangulation, values, levels[np.abs(levels) > size / LEVELS / 2], colors="k", linewidths=0.4
        )
    return axis.tricontourf(
        triangulation,
        values,
        levels,
        cmap="RdBu_r" if signed else "cividis",  # distinguished by the colour-blind
        extend=beyond[int(values.max() > levels[-1])][int(values.min() < levels[0])],
    )


def half_plane_grid(box):
    """(x1, x2, triangles) of points below the contact that are denser towards the surface, arrays (n,),
    (n,), (m, 3).
    """
    (left, right), depth = box
    across, down = (
        np.linspace(left, right, ACROSS),
        -depth * (FIRST + (1 - FIRST) * np.linspace(0, 1, DOWN) ** 2),
    )
    x1, x2 = (part.ravel() for part in np.meshgrid(across, down))
    first = (np.arange(DOWN - 1)[:, None] * ACROSS + np.arange(ACROSS - 1)).reshape(-1, 1)
    halves = np.array((0, 1, ACROSS)), np.array((1, ACROSS + 1, ACROSS))
    return x1, x2, np.concatenate([first + half for half in halves])


def values(psi, stress, quantity):
    """The quantity from psi (n,) and stress (2, 2, n)."""
    (s11, s12), (s21, s22) = stress
    if quantity == "shear":  # over all planes through a point: of the symmetric and the skew part
        return np.sqrt(((s11 - s22) / 2) ** 2 + ((s12 + s21) / 2) ** 2) + np.abs(s12 - s21) / 2
    return {"psi": np.degrees(psi), "s22": -s22, "s11": -s11, "skew": s12 - s21}[quantity]
