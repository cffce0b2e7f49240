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
FIRST = 0.02  # of the depth: the uppermost row; nearer to the surface a stress may have no bound


def draw_below(state, quantity="psi", axis=None):
    """A Figure of one of QUANTITIES below the contact, of a state whose solution has fields_below(box) ->
    (x1, x2, triangles (m, 3), psi, stress (2, 2, n)) at points (n,), box ((left, right), depth).
    """
    require_choice(QUANTITIES, field=quantity)
    contact = state.zones["contact"]
    if not contact:
        raise NotConverged("nothing touches: there is no field below a contact")
    left, right = contact[0][0], contact[-1][1]
    depth, middle = right - left, (left + right) / 2
    found = state.solution.fields_below(((middle - depth, middle + depth), depth))
    ends = (middle - depth, middle + depth), (max(found[1].min(), -depth), max(0.03 * depth, found[1].max()))
    deep = found[1] <= -FIRST * depth
    return _filled(2.9, axis, found, quantity, deep, ends, contact)


def draw_body(state, quantity="psi", axis=None):
    """A Figure of one of QUANTITIES in all of a body on a mesh."""
    require_choice(QUANTITIES, field=quantity)
    found = state.solution.fields_below(((-np.inf, np.inf), np.inf))
    ends = [(x.min(), x.max()) for x in found[:2]]
    wide, deep = (high - low for low, high in ends)
    height = float(np.clip(4.2 * deep / wide + 0.9, 1.5, 6.0))
    return _filled(height, axis, found, quantity, slice(None), ends)


@plots.styled
def _filled(height, axis, found, quantity, shown, ends, contact=()):
    """A Figure with contours of a quantity, the contact in black, and a bar of the colours, whose ends are
    those of the values at the points `shown`, but for few.
    """
    drawing, axis = plots.in_place(axis, height=height, width=5.2)
    triangulation, field = Triangulation(*found[:3]), values(*found[3:], quantity)
    # next to edges of the contact and corners of the body a stress may have no bound
    low, high = np.quantile(field[shown], (2e-3, 1 - 2e-3))
    signed, size = quantity in ("psi", "skew"), max(abs(low), abs(high))
    levels = MaxNLocator(20).tick_values(*((-size, size) if signed else (low, high)))
    for left, right in contact:
        axis.plot([left, right], [0, 0], color="k", linewidth=5, solid_capstyle="butt")
    if (
        signed
    ):  # dashed where it is negative: the ends of the colours are equally dark in print; at 0 is noise
        lines = levels[np.abs(levels) > (levels[1] - levels[0]) / 2]
        axis.tricontour(triangulation, field, lines, colors="k", linewidths=0.4)
    colours = "RdBu_r" if signed else "cividis"  # distinguished by the colour-blind
    drawn = axis.tricontourf(triangulation, field, levels, cmap=colours, extend="both")
    axis.set(xlabel="$x_1$ (length)", ylabel="$x_2$ (length)", aspect="equal", xlim=ends[0], ylim=ends[1])
    drawing.colorbar(drawn, ax=axis, label=QUANTITIES[quantity], shrink=0.75)
    return drawing


def half_plane_grid(box):
    """(x1, x2, triangles) of points below the contact that are denser towards the surface, arrays (n,),
    (n,), (m, 3).
    """
    (left, right), depth = box
    down = -depth * (FIRST + (1 - FIRST) * np.linspace(0, 1, 25) ** 2)
    x1, x2 = (part.ravel() for part in np.meshgrid(np.linspace(left, right, 61), down))
    number = np.arange(x1.size).reshape(25, 61)
    corner, beside, under, across = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    halves = (corner, beside, under), (beside, across, under)
    return x1, x2, np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])


def values(psi, stress, quantity):
    """The quantity from psi (n,) and stress (2, 2, n)."""
    (s11, s12), (s21, s22) = stress
    if quantity == "shear":  # over all planes through a point: of the symmetric and the skew part
        return np.sqrt(((s11 - s22) / 2) ** 2 + ((s12 + s21) / 2) ** 2) + np.abs(s12 - s21) / 2
    return {"psi": np.degrees(psi), "s22": -s22, "s11": -s11, "skew": s12 - s21}[quantity]
