"""Charts of the study `limits`, from its records: how methods keep their promises, and maps on which a
boundary is seen.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib import cm, colormaps, colors
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

from microblock.data.records import column, grouped
from microblock.view import plots

from .limits_maps import ANSWERED

BLUE, RED, GREEN, _, ORANGE, SKY, BLACK = plots.COLOURS
SHADES = colors.ListedColormap([colormaps[plots.SHADES](one) for one in np.linspace(0, 0.9, 128)])
LINE = ("line_beta_small", "line_beta_large", "line_turned", "line_wedge", "line_touching")
FITTED = ("fitted_beta_large", "fitted_beta_small", "turned")
STATES = ("states_random", "states_degenerate")
LAGRANGIAN = ("lagrangian_strip", "lagrangian_squares")
RATIOS = 1e-5, 1e3  # on the axis of the profile: what is smaller stands at its left end
SIZE = 12  # of a mark, points squared
ROUNDING = 1e-16  # where an error of exactly nothing is drawn


@dataclass(frozen=True)
class Curve:
    """A method of the profile: the maps that ask it to keep a promise, without some values of `method`.

    at : share of runs at which its name stands; beside : shift of the name in points, right and up; led :
    whether a thin line leads from it to the curve
    """

    name: str
    maps: tuple
    colour: str
    line: str
    at: float
    beside: tuple
    without: tuple = ()
    led: bool = False

    def ratios(self, rows):
        """Error over promise of its runs, ascending; infinite where a run gave no answer."""
        own = [row for row in rows if row["map"] in self.maps and row["method"] not in self.without]
        return np.sort([row["error"] / row["promise"] if answered(row) else np.inf for row in own])


CURVES = (
    Curve("panels", LINE, BLUE, "-", 0.5, (-4, 3)),
    Curve("panels where\ntwo zones touch", ("line_coalescence",), BLUE, ":", 0.49, (14, -11)),
    Curve("cells", ("cells_asked",), SKY, "--", 0.3, (-4, 3)),
    # uniform squares of the same map are promised nothing
    Curve("fitted\nelements", FITTED, GREEN, "-", 0.9, (45, -22), ("equal squares",), led=True),
    Curve("a user's mesh,\nrefined", ("body_asked",), RED, "-.", 0.3, (40, -12), led=True),
    # the plain active set is there to fail
    Curve("contact states", STATES, ORANGE, "--", 0.97, (2, 13), ("plain",)),
    Curve("augmented Lagrangian", LAGRANGIAN, BLACK, ":", 0.84, (5, -8)),
)


def answered(row):
    """Whether a run gave a state."""
    return row["kind"] in ANSWERED


def of_maps(rows, *names):
    """The records of these maps."""
    return [row for row in rows if row["map"] in names]


def profile(records):
    """All but three answers keep their promised error; where a method cannot, it says so and gives none.

    A curve is the share of a method's runs whose true error is below a multiple of the promised one. Left of
    the line at 1 the promise holds; what a curve lacks to 1 at its right end raised an error instead. Runs
    are seeded; a fifth of them lie next to a degenerate end of a parameter, such as nu = 1/2, no coupling, or
    blocks rotated by 20 degrees. Promised are the rtol asked for, for contact states a residual of 1e-10, for
    the augmented Lagrangian one of 1e-6.

    Seen: seven rising curves, all left of the line at 1, most of them at a tenth of it or less; panels where
    two zones touch end at one half, panels and cells at 0.99, the others at 1.
    """
    drawing, axis = plots.figure(height=3.0)
    axis.axvline(1, color="0.5", linewidth=0.8)
    plots.label(axis, 1, 1.04, "promised error", "0.35", (0, 0))
    for curve in CURVES:
        ratios = curve.ratios(records)
        found = np.maximum(ratios[np.isfinite(ratios)], RATIOS[0])
        if len(found):
            shares = np.append(np.arange(len(found) + 1), len(found)) / len(ratios)
            axis.step(
                [RATIOS[0], *found, RATIOS[1]], shares, curve.line, where="post", color=curve.colour, zorder=3
            )
            place = np.searchsorted(shares, min(curve.at, shares[-1]))
            name_at = [RATIOS[0], *found, RATIOS[1]][place]
            lead = {"arrowstyle": "-", "color": curve.colour, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0}
            words = {"arrowprops": lead} if curve.led else {}
            plots.label(axis, name_at, curve.at, curve.name, curve.colour, curve.beside, zorder=4, **words)
    axis.set(xscale="log", xlim=RATIOS, ylim=(0, 1.08))
    axis.set(xlabel="true error over promised error", ylabel="share of runs")
    axis.xaxis.set_major_locator(LogLocator(numticks=9))
    axis.minorticks_off()
    return drawing


def coalescence(records):
    """Next to the load at which two zones touch, panels give some four digits and refuse more.

    A cylinder whose alpha is off alpha_mid by the abscissa: larger, so that there are two zones (a), or
    smaller, one zone (b). Ordinate and colour are the rtol that was asked for. Dots are answers, all within
    their promise; crosses raised NotConverged, which says to ask for less.

    Seen: crosses fill the lower right, where the distance and the rtol are small; the border falls from 1e-4
    next to alpha_mid to 1e-8 at a distance of one per cent.
    """
    rows = of_maps(records, "line_coalescence")
    drawing, axes = plots.figure(2, 1, height=1.8, sharex=True)
    norm = _decades(row["rtol"] for row in rows)
    for axis, side in zip(axes, ("apart", "joined")):
        _marks(axis, [row for row in rows if row["side"] == side], "distance", "rtol", "rtol", norm)
        axis.set(xscale="log", yscale="log", xlim=(0.2, 5e-13), ylim=(5e-10, 2e-2), ylabel="rtol asked for")
        axis.minorticks_off()
    axes[1].set_xlabel(r"$|\alpha/\alpha_\mathrm{mid} - 1|$")
    plots.letter(axes, "two zones", "one zone")
    _legend(drawing, {"o": "answer within its rtol", "x": "raised an error"})
    return drawing


def cells(records):
    """Cells under a cylinder keep the tolerance that they are asked for, whatever the size of the blocks.

    True error over the rtol asked for, against panels, over alpha from 0.001 to 3; the line at 1 is the
    promise, the colour the rtol. Errors stay below 0.27 of it. In one run with the thinnest layers the panels
    that verify raised an error (cross, at 1).

    Seen: a cloud of dots between 0.001 and 0.3 without a trend along alpha, and one cross at its left end.
    """
    axis_words = {"xlabel": r"$\alpha = \ell/a_\mathrm{Hz}$"}
    return _kept(of_maps(records, "cells_asked"), "alpha", **axis_words)


def touching(records):
    """Next to the load at which the second corner touches, two of 49 answers on the load path exceed their
    tolerance.

    Blocks rotated by psi0 under a cylinder, at loads beside the event of the load path. True error over the
    rtol asked for, over the distance from that load; the line at 1 is the promise, the colour the rtol.
    Squares are the two answers beyond it; both asked for less than 1e-5. One run raised an error (cross, at
    1).

    Seen: dots between 0.0002 and 0.2 at all distances, two squares above the line at distances near 1e-6, and
    a cross on it near 5e-9.
    """
    words = {"xlabel": r"$|P/P_\mathrm{touch} - 1|$", "xlim": (0.2, 5e-10)}
    return _kept(of_maps(records, "line_touching"), "distance", **words)


def _kept(rows, across, **words):
    """Error over promise, over a column of records, in shades of the rtol."""
    drawing, axis = plots.figure(height=2.9)
    norm = _decades(row["rtol"] for row in rows)
    axis.axhline(1, color="0.5", linewidth=0.8)
    shown = [{**row, "ratio": row["error"] / row["promise"] if answered(row) else 1.0} for row in rows]
    _marks(axis, shown, across, "ratio", "rtol", norm)
    axis.set(xscale="log", yscale="log", ylabel="true error over rtol", **words)
    axis.minorticks_off()
    _bar(drawing, axis, norm, "rtol asked for")
    return drawing


def layer_fit(records):
    """A fit determines the length of the layer where blocks are small against the contact and the place lies
    inside it.

    Each run fits (51) to the microrotation below the surface at x1. Dots: the length is determined, the
    colour is its distance from the length of the micropolar mode, relative. Crosses: it is not, and the error
    says why (two exponentials that cannot be told apart, a length that moves with the depths used). Dashed:
    the edge of Hertz's contact.

    Seen: dots at the lower left, nearly all for alpha below 0.1 and x1 below a_Hz, one at alpha = 0.15 next
    to the axis; crosses elsewhere, and one among the dots at the smallest alpha.
    """
    rows = of_maps(records, "layer_fit")
    drawing, axis = plots.figure(height=3.1)
    norm = _decades(row["error"] for row in rows if answered(row))
    axis.axhline(1, color="0.5", linewidth=0.8, linestyle="--")
    _marks(axis, rows, "alpha", "x1", "error", norm)
    axis.set(xscale="log", yscale="log", xlabel=r"$\alpha = \ell/a_\mathrm{Hz}$")
    axis.set(ylabel=r"$x_1/a_\mathrm{Hz}$")
    axis.minorticks_off()
    _bar(drawing, axis, norm, r"$|L_\mathrm{bl}/L_\mathrm{mode} - 1|$ where it is determined")
    return drawing


def penalty(records):
    """The augmented Lagrangian gives one state over twelve decades of rho; the penalty wants its rho found
    anew for each mesh.

    Errors over the parameter rho, over the stiffness lambda + 2 mu and H or a_Hz; the lighter the finer the
    mesh. (a) Strip, both against the closed form; the penalty on 2 to 512 bilinear elements, the augmented
    Lagrangian on order 8. (b) Cylinder on squares of side 0.4 to 0.2 a_Hz: the penalty against the
    half-plane, so that the error of the mesh is in it; the augmented Lagrangian against the condensed body,
    which solves the same discrete problem. Crosses raised an error: rho too soft for a contact of this size,
    or too stiff for the matrix.

    Seen: black dots stay below 1e-9 at every rho; coloured dots fall with rho in the strip and spread by
    mesh, and under the cylinder stay at one tenth between crosses at either end.
    """
    drawing, axes = plots.figure(2, 1, height=1.95, sharex=True)
    for axis, kind in zip(axes, ("strip", "squares")):
        rows = of_maps(records, f"penalty_{kind}")
        shown = [
            {
                **row,
                "error": row["error"] if answered(row) else 3.0,
                "fineness": row["elements"] if kind == "strip" else 1 / row["spacing"],
            }
            for row in rows
        ]
        fineness = [row["fineness"] for row in shown]
        norm = _decades(fineness) if kind == "strip" else colors.Normalize(min(fineness), max(fineness))
        _marks(axis, shown, "rho", "error", "fineness", norm)
        exact = of_maps(records, f"lagrangian_{kind}")
        values = [max(row["error"], ROUNDING) for row in exact]
        axis.plot([row["rho"] for row in exact], values, ".", color=BLACK, markersize=3)
        axis.set(xscale="log", yscale="log", ylim=(1e-17, 30), ylabel="relative error")
        axis.minorticks_off()
    plots.label(axes[0], 1e-6, 1e-11, "augmented Lagrangian", BLACK, (2, 0))
    plots.label(axes[0], 1e-5, 1e-1, "penalty", BLUE, (2, 0))
    axes[1].set_xlabel(r"$\rho H/(\lambda + 2\mu)$,  $\rho a_\mathrm{Hz}/(\lambda + 2\mu)$")
    plots.letter(axes, "strip", "cylinder")
    return drawing


SOLVERS = {"bulk": "no contact", "condensed": "condensed", "al": "augmented Lagrangian", "penalty": "penalty"}
SUPPORTS = {
    "all": "all fixed",
    "psi free": r"$\psi$ free",
    "u1 free": "$u_1$ free",
    "u2 free": "$u_2$ free",
    "rotation free": "only $u_1$ fixed",
    "none": "none fixed",
}


def supports(records):
    """A body without enough supports gives no wrong answer: it raises an error, or the contact supports it.

    A block under a cylinder, with more or fewer displacements fixed at its bottom (rows), by four solvers and
    for coupling numbers beta from none to almost couple stresses. Dots: the state passes the balance of
    energy and work; crosses: an error says that the matrix is singular, and what to fix; no mark: not among
    the runs.

    Seen: dots in the lowest row; in the second too, but for crosses at beta = 0 without contact and with the
    condensed body, and one of two runs at 1e-9; in the third row, with the augmented Lagrangian and the
    penalty alone, dots where beta is large and one at 1e-15; crosses everywhere else.
    """
    rows = of_maps(records, "supports")
    betas, kinds = sorted({row["beta"] for row in rows}), list(SUPPORTS)
    drawing, axes = plots.figure(2, 2, height=1.7, sharex=True, sharey=True)
    for axis, (solver, own) in zip(axes.flat, grouped(rows, "solver").items()):
        places = [
            {**row, "x": betas.index(row["beta"]), "y": kinds.index(row["supports"])}
            for row in sorted(own, key=answered)
        ]
        _marks(axis, places, "x", "y")
        axis.set_title(SOLVERS[solver])
        axis.set_yticks(range(len(kinds)), SUPPORTS.values())
        axis.set_xticks(range(len(betas)), [_beta(beta) for beta in betas], rotation=90)
        axis.set(xlim=(-0.6, len(betas) - 0.4), ylim=(-0.6, len(kinds) - 0.4))
    for axis in axes[-1]:
        axis.set_xlabel(r"coupling number $\beta$")
    _legend(drawing, {"o": "right state", "x": "raised an error"})
    return drawing


# {title: (map, method)}
FRICTION = {
    "cells": ("friction_cylinder", "cells"),
    "a mesh": ("friction_cylinder", "mesh"),
    "square": ("friction_square", None),
}
THIRDS = np.geomspace(0.01, 3.0, 4)  # ends of the ranges of alpha that have a critical friction each


def critical(rows):
    """The least friction that tells answers from errors with the fewest runs on the wrong side, None where
    there are not both.
    """
    own = sorted(rows, key=lambda row: row["friction"])
    if len({answered(row) for row in own}) < 2:
        return None
    good = np.array([answered(row) for row in own])
    wrong = [np.count_nonzero(~good[:k]) + np.count_nonzero(good[k:]) for k in range(1, len(own))]
    best = 1 + int(np.argmin(wrong))
    return float(np.sqrt(own[best - 1]["friction"] * own[best]["friction"]))


def friction(records):
    """Contact has one answer below a friction of two under microblocks, of three without corners; beyond, all
    methods say so.

    Pressed, sheared to full slip, and to full slip the other way, nu = 0.3: a rigid cylinder on a half-plane
    by cells (a, b), on a block by finite elements (c, d), and a square block of the half-width a_Hz pressed
    by a plane on all of its side (e, f). Dots are right: another method has the same states, and where that
    has none, work is energy and dissipation. Crosses raised an error that says that the friction may be too
    large; at a plus the contact had left the cells or squares. The line is the critical friction in a third
    of the abscissa, which tells dots and crosses apart with the fewest of them on the wrong side.

    Seen: dots below, crosses above, and a line between them that rises or falls little with the size of the
    blocks; no crosses in (d).
    """
    drawing, axes = plots.figure(3, 2, height=1.5, sharex=True, sharey=True)
    for row, (name, method) in zip(axes, FRICTION.values()):
        for axis, law in zip(row, ("microblock", "unilateral")):
            own = [one for one in of_maps(records, name) if (one["contact"], one["method"]) == (law, method)]
            wide = [one for one in own if not answered(one) and "unique" not in one["message"]]
            own = [one for one in own if one not in wide]
            _marks(axis, own, "alpha", "friction")
            axis.plot(column(wide, "alpha"), column(wide, "friction"), "+", color="0.45", markersize=5)
            for low, high in zip(THIRDS, THIRDS[1:]):
                bound = critical([one for one in own if low <= one["alpha"] <= high])
                if bound is not None:
                    axis.plot((low, high), (bound, bound), color=BLACK, linewidth=1.5)
            axis.set(xscale="log", yscale="log", xlim=(0.008, 3.8), ylim=(0.26, 11.5))
            plots.plain_log(axis.yaxis)
            axis.xaxis.set_minor_locator(NullLocator())
        row[0].set_ylabel("friction $f$")
    for axis in axes[-1]:
        axis.set_xlabel(r"$\alpha = \ell/a_\mathrm{Hz}$")
    plots.letter(axes, *(f"{law}, {how}" for how in FRICTION for law in ("microblock", "unilateral")))
    _legend(drawing, {"o": "right", "x": "error raised", "+": "contact too wide"})
    return drawing


def _beta(value):
    """A coupling number as a tick says it: the last one is 2 less a millionth."""
    return f"{value:g}" if value in (0, 1) else "~2" if value > 1 else f"$10^{{{np.log10(value):.0f}}}$"


def _marks(axis, rows, across, up, shade=None, norm=None):
    """Runs in shades of a column: dots for answers, crosses for errors, squares for answers beyond their
    promise.
    """
    for marker, kinds in (("o", ("delivered", "other method")), ("s", ("missed",)), ("x", None)):
        own = [row for row in rows if (row["kind"] in kinds if kinds else not answered(row))]
        if not own:
            continue
        shaded = shade and all(row[shade] is not None for row in own)
        look = {"c": [row[shade] for row in own], "norm": norm, "cmap": SHADES} if shaded else {}
        if not shaded:
            look = {"color": RED if marker == "x" else BLUE}
        x, y = ([row[name] for row in own] for name in (across, up))
        axis.scatter(x, y, s=SIZE, marker=marker, linewidths=0.9 if marker == "x" else 0.3, **look)


def _legend(drawing, marks):
    """What marks mean, below all panels."""
    handles = [
        Line2D([], [], linestyle="none", marker=marker, color="0.3", label=text)
        for marker, text in marks.items()
    ]
    drawing.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _decades(values):
    """Logarithmic shades from a whole decade to another; one decade where nothing is to be shaded."""
    logs = np.log10([value for value in values if value] or [0.5])
    return colors.LogNorm(10 ** np.floor(logs.min()), 10 ** np.floor(logs.max() + 1))


def _bar(drawing, axis, norm, text):
    bar = drawing.colorbar(cm.ScalarMappable(norm, SHADES), ax=axis, label=text, location="top", aspect=30)
    bar.ax.minorticks_off()


# {name: (maps that it shows, drawing of the records)}
DRAWINGS = {
    "profile": (tuple(dict.fromkeys(name for curve in CURVES for name in curve.maps)), profile),
    "coalescence": (("line_coalescence",), coalescence),
    "cells": (("cells_asked",), cells),
    "touching": (("line_touching",), touching),
    "layer_fit": (("layer_fit",), layer_fit),
    "penalty": (("penalty_strip", "penalty_squares", *LAGRANGIAN), penalty),
    "supports": (("supports",), supports),
    "friction": (("friction_cylinder", "friction_square"), friction),
}
