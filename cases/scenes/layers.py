"""Layers below the contact: what the microblock law adds to the microrotation (Figs 12, 13).

Geometry   half-plane x2 < 0 under a rigid cylinder, the same load with two laws: microblock (psi0 = 0) and
           unilateral (M = 0).
Equations  (10)-(18) in the half-plane, corner gaps and micromoment (21), (22), (29) at the surface.
Model      halfplane: pressures on panels of the contact line, the fields below them from the half-plane's
           modes. fe: fitted finite elements that shrink towards the lines too, domain 1000 a_Hz.
Reference  the bi-exponential decay (51), fitted to the difference of psi along vertical lines; 1/sqrt(beta)
           of the thick strip, (49).
Look at    L_bl/ell beside mode_length_over_ell: the micropolar mode's share of the difference over its own
           derivative at the surface, which needs no fit. Both tend to 1/sqrt(beta) under the full-contact
           zone.
Units      lengths over a_Hz (alpha = ell/a_Hz), psi as psi R/a_Hz. L_bl_error is that of L_bl_over_ell: two
           standard deviations of the fit and the largest change when its depths are varied; with fe also the
           change from a coarser mesh. Beyond 10 % a length is null, and reason says why.
"""

import time
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

import microblock as mb
from microblock.data.records import column

from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned
from . import layers_fe

MODELS = ("halfplane", "fe")
ALPHAS = (0.01, 0.02, 0.05, 0.1)
POSITIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
STATE_RTOL = 1e-7  # of the two pressures: the difference of the laws is some hundredth of either
SAMPLES = 80  # depths, evenly in log(1 + depth/ell), so that layer and bulk count alike
DEPTHS = (0.0, 2.0)  # of the fit: from (over ell) and to (over a_Hz)
VARIED = ((0.5, 2.0), (0.0, 1.0), (0.0, 4.0))
LENGTHS = (0.05, 20.0)  # searched: from this times ell to this times a_Hz
GRID = (300, 30)  # short and long lengths tried before the fit is refined
APART = 0.05  # of their logarithms there, at least
FAINT = 1e-6  # amplitude over the largest value, below which it is an error of the states
CONFIDENCE = 2  # standard deviations of the fit that count as its error
SENSITIVITY = 0.1  # relative error beyond which a length is not determined
RESIDUAL = 0.02  # relative L2 residual beyond which (51) is no description
ALIKE = 10.0  # amplitude over the largest value, beyond which two exponentials are one


@dataclass(frozen=True)
class Parameters(Checked):
    alphas: tuple = option(
        ALPHAS,
        "length scales of the material over a_Hz",
        at_least=1e-3,
        at_most=2.0,
        nargs="+",
        metavar="ALPHA",
    )
    positions: tuple = option(
        POSITIONS,
        "abscissae x1 > 0 of the vertical lines over a_Hz",
        at_least=1e-3,
        at_most=100.0,
        nargs="+",
        metavar="X1",
    )
    nu: float = poisson()
    beta: float = coupling()
    model: str = option(
        "halfplane", "modes of the half-plane, or fitted finite elements", str, choices=MODELS
    )


@dataclass(frozen=True)
class Fit:
    """The bi-exponential (51) fitted to samples over depth; lengths ascending, amplitudes in their order."""

    lengths: np.ndarray
    amplitudes: np.ndarray
    deviations: np.ndarray  # relative standard deviations of the lengths
    residual: float  # relative, in L2 of the samples

    def __call__(self, x2):
        return np.exp(np.divide.outer(x2, self.lengths)) @ self.amplitudes


def solve(alpha, nu=0.3, beta=1.0):
    """The states of both laws in units a_Hz = p_Hz = R = 1: (microblock, unilateral)."""
    solid = mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta)
    return tuple(
        mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=1.0), law).solve(load=np.pi / 2, rtol=STATE_RTOL)
        for law in (mb.Microblock(), mb.Unilateral())
    )


def depths(alpha):
    """x2 of the samples, from the surface downwards."""
    deepest = max(to for _, to in (DEPTHS, *VARIED))
    return -alpha * np.expm1(np.linspace(0, np.log1p(deepest / alpha), SAMPLES))


def fit(x2, values, scale):
    """Fit (51) by variable projection: amplitudes are linear, the logarithms of two lengths are searched.

    Parameters
    ----------
    x2, values : arrays (n,), samples that count alike
    scale : length of the layer to expect; LENGTHS[0] times it is the shortest that is searched
    """
    bounds, largest = np.log((LENGTHS[0] * scale, LENGTHS[1])), np.abs(values).max()
    found = least_squares(
        _misfit,
        _best_pair(x2, values / largest, bounds),
        args=(x2, values / largest, bounds),
        method="lm",
        xtol=1e-8,
        ftol=1e-12,
    )
    order = np.argsort(found.x)
    logarithms, amplitudes = found.x[order], _projected(found.x[order], x2, values, bounds)[1]
    lost = (logarithms <= bounds[0]) | (logarithms >= bounds[1]) | (np.abs(amplitudes) <= FAINT * largest)
    return Fit(
        np.exp(np.clip(logarithms, *bounds)),
        amplitudes,
        np.where(lost, np.inf, _deviations(found, len(x2) - 4)[order]),
        float(np.sqrt(2 * found.cost / np.sum((values / largest) ** 2))),
    )


def _deviations(found, freedom):
    """Standard deviations of both logarithms, from the residual and the Jacobian; infinite where it does not
    see them.
    """
    sizes = np.maximum(np.linalg.norm(found.jac, axis=0), 1e-300)
    cosine = np.prod(found.jac / sizes, axis=1).sum()
    return np.sqrt(2 * found.cost / freedom / max(1 - cosine**2, 1e-300)) / sizes


def _best_pair(x2, values, bounds):
    """The best of a grid of pairs of logarithms, by the normal equations of their amplitudes."""
    short, long = (np.linspace(*bounds, count) for count in GRID)
    first, second = (np.exp(np.divide.outer(x2, np.exp(trials))) for trials in (short, long))
    a, b, c = np.sum(first**2, axis=0)[:, None], first.T @ second, np.sum(second**2, axis=0)
    p, q = (first.T @ values)[:, None], second.T @ values
    explained = (c * p**2 - 2 * b * p * q + a * q**2) / np.maximum(a * c - b**2, 1e-300)
    explained[long - short[:, None] < APART] = 0
    # where the long part is weak the valley in the short length is narrower than the grid: a parabola finds
    # its floor
    left, top, right = explained[:-2], explained[1:-1], explained[2:]
    bend = left - 2 * top + right
    peak = (right > 0) & (top >= left) & (top >= right) & (bend < 0)
    bend = np.where(peak, bend, -1.0)
    floor = np.where(peak, top - (right - left) ** 2 / (8 * bend), 0)
    i, j = np.unravel_index(np.argmax(floor), floor.shape)
    return short[1 + i] + (left - right)[i, j] / (2 * bend[i, j]) * (short[1] - short[0]), long[j]


def _projected(logarithms, x2, values, bounds):
    """Exponentials of the lengths, and the amplitudes that fit best."""
    shapes = np.exp(np.divide.outer(x2, np.exp(np.clip(logarithms, *bounds))))
    return shapes, np.linalg.lstsq(shapes, values, rcond=None)[0]


def _misfit(logarithms, x2, values, bounds):
    shapes, amplitudes = _projected(logarithms, x2, values, bounds)
    return shapes @ amplitudes - values


def layer(x2, values, alpha, uncertain=0.0):
    """The fit on DEPTHS and what varying them does: the row's entries, null where nothing is determined.

    `uncertain`, a number or an array (2,), is what the error of the samples does to the lengths.
    """
    base, *others = [fit_between(x2, values, alpha, *window) for window in (DEPTHS, *VARIED)]
    changes = np.max([np.abs(other.lengths - base.lengths) for other in others], axis=0)
    errors = uncertain + changes + CONFIDENCE * base.deviations * base.lengths
    (L_bl, L_sol), (A_bl, A_sol) = base.lengths, base.amplitudes
    row = {
        "L_bl_over_ell": L_bl / alpha,
        "L_bl_error": errors[0] / alpha,
        "L_sol": L_sol,
        "A_bl": A_bl,
        "A_sol": A_sol,
        "fit_from": DEPTHS[0] * alpha,
        "fit_to": DEPTHS[1],
        "fit_residual": base.residual,
        "reason": None,
    }
    row = {name: value if value is None else float(value) for name, value in row.items()}
    reason, lost = _doubt(base, errors, np.abs(values).max())
    return {**row, **dict.fromkeys(lost), "reason": reason}


def fit_between(x2, values, alpha, start, stop):
    chosen = (-x2 >= start * alpha * (1 - 1e-9)) & (-x2 <= stop * (1 + 1e-9))
    return fit(x2[chosen], values[chosen], alpha)


def _doubt(base, errors, largest):
    """Why a fit, or its slower part, is not determined, and the entries that are lost by it."""
    everything = ("L_bl_over_ell", "L_bl_error", "L_sol", "A_bl", "A_sol")
    relative = errors / base.lengths
    if base.residual > RESIDUAL:
        reason = f"the residual of the fit is {base.residual:.0%}: (51) does not describe the difference here"
        return reason, everything
    if np.abs(base.amplitudes).max() > ALIKE * largest:
        return "two exponentials of nearly the same length cancel: they cannot be told apart", everything
    if relative[0] > SENSITIVITY:
        return f"L_bl moves by {_percent(relative[0])} with the depths used", everything
    if relative[1] > SENSITIVITY:
        return f"L_sol and A_sol move by {_percent(relative[1])} with the depths used", ("L_sol", "A_sol")
    return None, ()


def _percent(change):
    return f"{change:.0%}" if change < 1 else "over 100%"


def profiles(alpha, positions, nu=0.3, beta=1.0, x2=None):
    """Fields of both laws along vertical lines, (positions, depths): psi of each law, and the micropolar
    difference.

    Returns (x2, psi of microblock, psi of unilateral, theta's difference at the surface over its derivative,
    seconds of the two states).
    """
    start = time.perf_counter()
    states = solve(alpha, nu, beta)
    seconds = time.perf_counter() - start
    x2 = depths(alpha) if x2 is None else np.asarray(x2, float)
    points = (np.repeat(positions, len(x2)), np.tile(x2, len(positions)))
    microblock, unilateral = (state.fields(*points) for state in states)

    def difference(name):
        return (getattr(microblock, name) - getattr(unilateral, name)).reshape(len(positions), -1)[:, 0]

    shape = (len(positions), len(x2))
    mode_length = difference("theta") / difference("theta_slope")
    return x2, microblock.psi.reshape(shape), unilateral.psi.reshape(shape), mode_length, seconds


def result(parameters, quiet=True):
    """The contract's object: a row for each alpha and position."""
    start, setup, found, more = time.perf_counter(), 0.0, [], {}
    for alpha in parameters.alphas:
        if parameters.model == "fe":
            lines, unknowns, seconds = _by_finite_elements(alpha, parameters)
            more = {"unknowns": max(unknowns, more.get("unknowns", 0))}
        else:
            lines, seconds = _by_modes(alpha, parameters)
        found += lines
        setup += seconds
    return returned(parameters, start + setup, setup, model=parameters.model, **more, layers=found)


def _by_modes(alpha, parameters):
    """Rows of one alpha by the half-plane, and the seconds of the states."""
    material = parameters.nu, parameters.beta
    x2, microblock, unilateral, mode_length, seconds = profiles(alpha, parameters.positions, *material)
    return [
        {
            "alpha": alpha,
            "x1": x1,
            **layer(x2, values, alpha),
            "mode_length_over_ell": float(length / alpha) if np.isfinite(length) else None,
        }
        for x1, values, length in zip(parameters.positions, microblock - unilateral, mode_length)
    ], seconds


def _by_finite_elements(alpha, parameters):
    """The same by finite elements, and the unknowns of the largest mesh; what a coarser mesh changes is an
    error too.
    """
    x2 = depths(alpha)
    coarse, fine = layers_fe.refined(alpha, parameters.positions, parameters.nu, parameters.beta, x2)
    found = []
    for number, x1 in enumerate(parameters.positions):
        values, before = ((one.microblock - one.unilateral)[number] for one in (fine, coarse))
        change = abs(
            fit_between(x2, values, alpha, *DEPTHS).lengths - fit_between(x2, before, alpha, *DEPTHS).lengths
        )
        row = layer(x2, values, alpha, change)
        lengths = [one.mode_length[number] / alpha for one in (fine, coarse)]
        found.append(
            {
                "alpha": alpha,
                "x1": x1,
                **row,
                "mode_length_over_ell": float(lengths[0]),
                "mode_length_error": float(abs(lengths[0] - lengths[1])),
                "unknowns": fine.unknowns,
                "state_error": fine.error,
                "state_seconds": coarse.seconds + fine.seconds,
            }
        )
    return found, fine.unknowns, coarse.seconds + fine.seconds


def show(answer):
    print_table(
        answer["layers"],
        (
            "alpha",
            "x1",
            "L_bl_over_ell",
            "L_bl_error",
            "L_sol",
            "fit_residual",
            "mode_length_over_ell",
            "reason",
        ),
    )


def rows(parameters, answer):
    """A row a line."""
    return answer["layers"]


def figure(found):
    """Layer length over the position: fit with error bars, and the micropolar mode's own length."""
    from microblock.view import plots

    drawing, axis = plots.figure(height=3.2)
    draw_lengths(axis, found)
    return drawing


def mode_lengths(alpha, positions, nu=0.3, beta=1.0):
    """Rows of the micropolar mode's length without a fit, which would take longer, and of where full contact
    ends, over a_Hz.
    """
    corners = solve(alpha, nu, beta)[0].zones
    full_to = min(corners[corner][-1][1] for corner in "AB")
    lengths = profiles(alpha, positions, nu, beta, x2=[0.0])[3] / alpha
    return [
        {"alpha": alpha, "x1": x1, "mode_length_over_ell": float(length), "full_contact_to": float(full_to)}
        for x1, length in zip(positions, lengths)
        if np.isfinite(length)
    ]


def draw_lengths(axis, found, every=1, modes=()):
    """L_bl/ell with its error bars (marks) and the length of the micropolar mode (lines), alphas from dark to
    light; of fits only each `every`.

    modes : rows of `mode_lengths`, whose lines are interrupted where full contact ends, and where the mode
        does not decay; without them the lines join what was found beside the fits
    """
    from microblock.view import plots

    alphas = list(dict.fromkeys(column(found, "alpha")))
    colours = plots.shades(len(alphas))
    for number, (alpha, colour) in enumerate(zip(alphas, colours)):
        lines = [row for row in found if row["alpha"] == alpha]
        fitted = [row for row in lines[::every] if row["L_bl_over_ell"] is not None]
        own = [row for row in modes if row["alpha"] == alpha]
        branches = [
            own[: (end := len([row for row in own if row["x1"] < row["full_contact_to"]]))],
            own[end:],
        ]
        for branch in branches if own else [lines]:
            lengths = [row["mode_length_over_ell"] for row in branch]
            decays = [length if length and length > 0 else np.nan for length in lengths]
            axis.plot(column(branch, "x1"), decays, color=colour)
        axis.errorbar(
            column(fitted, "x1"),
            column(fitted, "L_bl_over_ell"),
            yerr=column(fitted, "L_bl_error"),
            fmt=plots.MARKERS[number % len(plots.MARKERS)],
            color=colour,
            markerfacecolor="none",
            capsize=2,
            linewidth=0.8,
        )
    axis.axhline(1 / np.sqrt(found[0]["beta"]), color="k", linewidth=0.5, zorder=0)
    axis.set(xlabel=r"$x_1/a_{\mathrm{Hz}}$", ylabel=r"$L_{\mathrm{bl}}/\ell$")
    words = [rf"$\alpha = {alpha:g}$" for alpha in alphas]
    plots.key(axis.figure, words, colours, plots.MARKERS, markerfacecolor="none")


FIGURES = {"layers": (rows, figure)}
