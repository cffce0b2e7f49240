"""
Layers below the contact
========================
Below full contact two contact laws differ in a layer that is as thick as :math:`\\ell/\\sqrt\\beta`.

:Geometry:  half-plane :math:`x_2 < 0` under a rigid cylinder, the same load with two laws: microblock and
            unilateral (M = 0)
:Equations: (10)-(18) in the half-plane, corner gaps and micromoment (21), (22), (29) at the surface
:Method:    panels on the contact line, and the modes of the half-plane below it
:Reference: :math:`1/\\sqrt\\beta` of the thick strip, (49)
:Units:     lengths over :math:`a_\\mathrm{Hz}`, microrotations as :math:`\\psi R/a_\\mathrm{Hz}`, alpha is
            :math:`\\ell/a_\\mathrm{Hz}`
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import microblock as mb

# %%
# The states of both laws, and the fields below them


def problems(alpha, nu=0.3, beta=1.0, body=mb.HalfPlane, method=None):
    """The contact problems of both laws in units a_Hz = p_Hz = R = 1; their load is pi/2."""
    solid = mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta)
    return [
        mb.Contact(body(solid), mb.Cylinder(1.0), law, method) for law in (mb.Microblock(), mb.Unilateral())
    ]


def depths(alpha):
    """x2 (80,) from 0 to -4 a_Hz, evenly in log(1 + depth/ell), so that layer and bulk count alike."""
    return -alpha * np.expm1(np.linspace(0, np.log1p(4 / alpha), 80))


def profiles(alpha, positions, nu=0.3, beta=1.0, x2=None):
    """psi of both laws and the length of the micropolar mode below the positions.

    Returns x2 (n,), psi of microblock and of unilateral (positions, n), and the mode's part of their
    difference over its own derivative at the surface (positions,), which needs no fit.
    """
    x2 = depths(alpha) if x2 is None else np.asarray(x2, float)
    points = np.repeat(positions, len(x2)), np.tile(x2, len(positions))
    # the laws differ in some hundredth of either pressure
    states = [problem.solve(load=np.pi / 2, rtol=1e-7) for problem in problems(alpha, nu, beta)]
    fields = [state.fields(*points) for state in states]
    psi, theta, slope = (
        [getattr(field, name).reshape(len(positions), len(x2)) for field in fields]
        for name in ("psi", "theta", "theta_slope")
    )
    return x2, *psi, (theta[0] - theta[1])[:, 0] / (slope[0] - slope[1])[:, 0]


# %%
# The fit (51): two exponentials, whose amplitudes are linear and whose lengths are searched


def fit(x2, values, alpha):
    """Lengths (2,), amplitudes, relative deviations of the lengths, and relative residual in L2.

    Lengths lie between alpha/20 and 20 a_Hz, the shorter one goes first, but for a part too faint to be seen.
    A deviation is infinite where the values do not see the length.
    """
    bounds = np.log((alpha / 20, 20))
    largest = np.abs(values).max()

    def misfit(logarithms):
        shapes = np.exp(np.divide.outer(x2, np.exp(np.clip(logarithms, *bounds))))
        amplitudes = np.linalg.lstsq(shapes, values / largest, rcond=None)[0]
        return shapes @ amplitudes - values / largest, amplitudes

    def distances(logarithms):
        return misfit(logarithms)[0]

    start = min(valleys(x2, values / largest, bounds), key=lambda start: np.sum(distances(start) ** 2))
    search = least_squares(distances, start, method="lm", xtol=1e-8, ftol=1e-12)
    amplitudes = misfit(search.x)[1]
    faint = np.abs(amplitudes) <= 1e-6  # those are errors of the states
    order = np.lexsort((search.x, faint))
    sizes = np.maximum(np.linalg.norm(search.jac, axis=0), 1e-300)
    squared_sine = 1 - np.prod(search.jac / sizes, axis=1).sum() ** 2
    deviations = np.sqrt(2 * search.cost / (len(x2) - 4) / max(squared_sine, 1e-300)) / sizes
    lengths = np.exp(np.clip(search.x, *bounds))
    deviations[(search.x <= bounds[0]) | (search.x >= bounds[1]) | faint] = np.inf
    return (
        lengths[order],
        largest * amplitudes[order],
        deviations[order],
        np.sqrt(2 * search.cost) / np.linalg.norm(values / largest),
    )


def valleys(x2, values, bounds):
    """Pairs of logarithms at which the misfit has its valleys, by the normal equations of the amplitudes.

    On a grid, fine in one length and coarse in the other: where one of the parts is weak, be it the shorter
    or the longer one, the valley in the length of the other is narrower than the coarse grid.
    """
    fine, coarse = np.linspace(*bounds, 300), np.linspace(*bounds, 30)
    first, second = (np.exp(np.divide.outer(x2, np.exp(trials))) for trials in (fine, coarse))
    a, b, c = np.sum(first**2, axis=0)[:, None], first.T @ second, np.sum(second**2, axis=0)
    p, q = (first.T @ values)[:, None], second.T @ values
    explained = (c * p**2 - 2 * b * p * q + a * q**2) / np.maximum(a * c - b**2, 1e-300)
    differences = coarse - fine[:, None]
    explained[np.abs(differences) < 0.05] = 0
    # in the fine length the bottom is that of a parabola
    left, top, right = explained[:-2], explained[1:-1], explained[2:]
    peak = (np.minimum(left, right) > 0) & (top >= np.maximum(left, right)) & (left - 2 * top + right < 0)
    bend = np.where(peak, left - 2 * top + right, -1.0)
    step, bottom = (left - right) / (2 * bend), top - (right - left) ** 2 / (8 * bend)
    for side in (1, -1):  # the fine length is the shorter, or the longer one
        best = np.where(peak & (side * differences[1:-1] > 0), bottom, 0)
        rows = np.argmax(best, axis=0)
        most = np.pad(best.max(axis=0), 1)
        for j in np.flatnonzero((most[1:-1] > most[:-2]) & (most[1:-1] >= most[2:])):
            yield fine[1 + rows[j]] + step[rows[j], j] * (fine[1] - fine[0]), coarse[j]


def fitted_exponentials(x2, values, alpha, start, stop):
    """The fit from `start` times ell to `stop` times a_Hz below the surface."""
    chosen = (-x2 >= start * alpha * (1 - 1e-9)) & (-x2 <= stop * (1 + 1e-9))
    return fit(x2[chosen], values[chosen], alpha)


def layer(x2, values, alpha, uncertain=0.0):
    """The fit from the surface to 2 a_Hz, as a dictionary; None, with a reason, where it is not determined.

    The errors are two standard deviations, the largest change when the depths vary, and `uncertain`, what the
    error of the values does to the lengths.
    """
    lengths, amplitudes, deviations, residual = fitted_exponentials(x2, values, alpha, 0.0, 2.0)
    lengths_of_windows = [
        fitted_exponentials(x2, values, alpha, *window)[0] for window in ((0.5, 2.0), (0.0, 1.0), (0.0, 4.0))
    ]
    errors = uncertain + np.abs(lengths_of_windows - lengths).max(axis=0) + 2 * deviations * lengths
    entries = {
        "L_bl_over_ell": lengths[0] / alpha,
        "L_bl_error": errors[0] / alpha,
        "L_sol": lengths[1],
        "A_bl": amplitudes[0],
        "A_sol": amplitudes[1],
    }
    relative = errors / lengths
    moves = [f"{change:.0%}" if change < 1 else "over 100%" for change in relative]
    doubts = (
        (
            residual > 0.02,
            f"the residual of the fit is {residual:.0%}: (51) does not describe the difference here",
        ),
        (
            np.abs(amplitudes).max() > 10 * np.abs(values).max(),
            "two exponentials of nearly the same length cancel: they cannot be distinguished",
        ),
        (relative[0] > 0.1, f"L_bl moves by {moves[0]} with the depths used"),
        (relative[1] > 0.1, f"L_sol and A_sol move by {moves[1]} with the depths used"),
    )
    reason = next((words for holds, words in doubts if holds), None)
    lost = () if reason is None else ("L_sol", "A_sol") if reason == doubts[-1][1] else entries
    window = {"fit_from": 0.0, "fit_to": 2.0, "fit_residual": residual}
    return {**entries, **dict.fromkeys(lost), **window, "reason": reason}


def solve(
    alphas=(0.01, 0.02, 0.05, 0.1),
    positions=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95),
    nu=0.3,
    beta=1.0,
):
    """Layer lengths below the positions x1 > 0 for each ell, alphas; all of them over a_Hz."""
    layers = []
    for alpha in alphas:
        x2, microblock, unilateral, modes = profiles(alpha, positions, nu, beta)
        for x1, values, mode in zip(positions, microblock - unilateral, modes):
            length = mode / alpha if np.isfinite(mode) else None
            layers.append(
                {"alpha": alpha, "x1": x1, **layer(x2, values, alpha), "mode_length_over_ell": length}
            )
    return {"layers": layers}


# %%
# Symbols: L_bl of the fit with its error; bars: the micropolar mode, without a fit


def figure(result):
    """Thickness of the layer over the position."""
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 3.0))
    for number, alpha in enumerate(dict.fromkeys(row["alpha"] for row in result["layers"])):
        rows = [row for row in result["layers"] if row["alpha"] == alpha]
        x1, mode, length, error = (
            np.array([row[name] for row in rows], float)
            for name in ("x1", "mode_length_over_ell", "L_bl_over_ell", "L_bl_error")
        )
        axis.plot(x1[mode > 0], mode[mode > 0], "_", color=f"C{number}", markersize=9)
        style = {"color": f"C{number}", "markerfacecolor": "none", "capsize": 2, "label": f"{alpha:g}"}
        axis.errorbar(x1, length, error, fmt="os^Dv"[number % 5], **style)
    axis.set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$L_\mathrm{bl}/\ell$")
    style = {"loc": "outside upper center", "ncols": 5, "title": r"$\ell/a_\mathrm{Hz}$"}
    drawing.legend(*axis.get_legend_handles_labels(), **style)
    return drawing


if __name__ == "__main__":
    result = solve()
    for row in result["layers"]:
        print("{alpha:5.2f} {x1:5.2f}  mode {mode_length_over_ell:.4f}  fit {L_bl_over_ell}".format(**row))
    figure(result)
    plt.show()
