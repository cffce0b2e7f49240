"""Pictures of the fields below the surface: of the half-plane by matplotlib, of bodies on meshes by NGSolve's webgui."""

import matplotlib
import numpy as np
from matplotlib.ticker import MaxNLocator

from . import plots
from .errors import BadArgument

QUANTITIES = {"psi": r"microrotation $\psi$ (degrees)", "s22": r"$-\sigma_{22}$ (stress)", "s11": r"$-\sigma_{11}$ (stress)",
              "skew": r"$\sigma_{12} - \sigma_{21}$ (stress)", "shear": "largest shear stress (stress)"}
ACROSS, DOWN = 61, 25      # points of the picture, the latter denser towards the surface
WIDE, DEEP = 2.0, 2.0      # of the half-width of the contact
FIRST = 0.02               # of the depth: the uppermost row
SEQUENTIAL, DIVERGING = "cividis", "RdBu_r"      # told apart by the colour-blind
LEVELS = 20          # at most


def draw_below(state, fields, quantity="psi"):
    """A Figure of one of QUANTITIES below the contact.

    fields : (state, x1, x2) -> Fields, `microblock.subsurface.fields`
    """
    require_quantity(quantity)
    contact = state.named_zones["contact"]
    middle, half = (contact[-1][1] + contact[0][0])/2, (contact[-1][1] - contact[0][0])/2
    x1 = middle + WIDE*half*np.linspace(-1, 1, ACROSS)
    x2 = -DEEP*half*(FIRST + (1 - FIRST)*np.linspace(0, 1, DOWN)**2)
    grid = np.meshgrid(x1, x2)
    values = _values(fields(state, *(part.ravel() for part in grid)), quantity).reshape(DOWN, ACROSS)
    with matplotlib.rc_context(plots.STYLE):
        drawing, axis = plots.figure(height=2.9, width=5.2)
        signed = quantity in ("psi", "skew")
        size = np.abs(values).max()
        levels = MaxNLocator(LEVELS).tick_values(-size if signed else values.min(), size if signed else values.max())
        drawn = axis.contourf(*grid, values, levels, cmap=DIVERGING if signed else SEQUENTIAL)
        if signed:      # dashed where it is negative: the two ends of the colours are equally dark in print
            axis.contour(*grid, values, levels, colors="k", linewidths=0.4)
        for left, right in contact:
            axis.plot([left, right], [0, 0], color="k", linewidth=5, solid_capstyle="butt")
        axis.set(xlabel="$x_1$ (length)", ylabel="$x_2$ (length)", aspect="equal", ylim=(x2[-1], 0.03*DEEP*half),
                 title="contact in black")
        drawing.colorbar(drawn, ax=axis, label=QUANTITIES[quantity], shrink=0.75, ticks=MaxNLocator(6))
    return drawing


def require_quantity(quantity):
    """BadArgument unless it is one of QUANTITIES."""
    if quantity not in QUANTITIES:
        raise BadArgument("quantity", quantity, f"must be one of {', '.join(QUANTITIES)}")


def _values(fields, quantity):
    (s11, s12), (s21, s22) = fields.stress
    return {"psi": np.degrees(fields.psi), "s22": -s22, "s11": -s11, "skew": s12 - s21, "shear": fields.shear}[quantity]


def draw_webgui(fields, mesh, quantity="psi"):
    """The same on a mesh, in a notebook (extra `notebook`)."""
    require_quantity(quantity)
    if quantity == "shear":
        raise BadArgument("quantity", quantity, "is not drawn on meshes")
    from ngsolve.webgui import Draw
    stress = fields.stress
    functions = {"psi": fields.psi*180/np.pi, "s22": -stress[1, 1], "s11": -stress[0, 0], "skew": stress[0, 1] - stress[1, 0]}
    return Draw(functions[quantity], mesh, quantity)
