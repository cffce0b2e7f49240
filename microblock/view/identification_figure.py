"""Figure of identified moduli: readings with their fit, and the profile of each modulus."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..model.types import Axes, Figure
from . import plots

UNITS_OF_READINGS = {"depth": "length", "half_width": "length", "radius": "length", "area": "area"}
SYMBOLS = {
    "E": "$E$ (stress)",
    "ell": r"$\ell$ (length)",
    "beta": r"$\beta$",
    "nu": r"$\nu$",
    "curvature": r"$\gamma\'$",
}


@plots.styled
def draw_identification(result: Any, axis: Axes | None) -> Figure:
    """Returns the figure of an Identification: readings over the load (a), and below the profile of each
    modulus; of an axis with the readings alone.
    """
    if axis is not None:
        return _draw_readings(axis, result)
    drawing, axes = plots.figure(1 + len(result.values), height=1.9)
    _draw_readings(axes[0], result)
    axes[0].set_title("(a)  readings and fit", loc="left")
    axes[0].legend(loc="upper left")
    for letter, name, panel in zip("bcdefg", result.values, axes[1:]):
        _draw_profile(panel, result, name)
        word = "" if result.determined[name] else ": undetermined"
        panel.set_title(f"({letter})  profile of {SYMBOLS[name].partition(' ')[0]}{word}", loc="left")
    return drawing


def _draw_readings(axis: Axes, result: Any) -> Figure:
    """Draws readings with their scatter and the fit over the load, each kind and contact in a colour."""
    drawing, axis = plots.in_place(axis)
    several = len({row["scene"] for row in result.readings}) > 1
    for scene, kind in dict.fromkeys((row["scene"], row["kind"]) for row in result.readings):
        rows = [row for row in result.readings if (row["scene"], row["kind"]) == (scene, kind)]
        rows.sort(key=lambda row: row["load"])
        loads, measured, predicted, sigma = (
            [row[name] for row in rows] for name in ("load", "measured", "predicted", "sigma")
        )
        words = f"{kind.replace('_', '-')} ({UNITS_OF_READINGS[kind]})" + f", contact {scene + 1}" * several
        (fit,) = axis.plot(loads, predicted)
        axis.errorbar(loads, measured, sigma, fmt="o", color=fit.get_color(), label=words)
    axis.set(xlabel="load", ylabel="reading")
    return drawing


def _draw_profile(axis: Axes, result: Any, name: str) -> None:
    """Draws the excess of the misfit over a modulus, with its threshold and the interval shaded."""
    values, excess = result.profiles[name][:, np.isfinite(result.profiles[name][1])]
    best = result.values[name]
    # its root is straight where the model is, and smooth through the least
    root = PchipInterpolator(values, np.sign(values - best) * np.sqrt(excess))
    top = 2 * result.threshold
    fine = np.linspace(values[0], values[-1], 400)
    if not result.determined[name]:
        fine = np.geomspace(values[0], values[-1], 400)
        axis.set_xscale("log")
    low, high = result.intervals[name]
    axis.axvspan(max(low, values[0]), min(high, values[-1]), color="0.9", linewidth=0)
    axis.plot(fine, root(fine) ** 2, color=plots.COLOURS[0])
    axis.plot(values, excess, "o", color=plots.COLOURS[0])
    axis.axhline(result.threshold, linestyle=":", color="0.4")
    beside = axis.get_yaxis_transform()
    axis.text(1.01, result.threshold, f"{100 * result.level:g} %", va="center", transform=beside)
    axis.axvline(best, linestyle="--", color="0.4")
    axis.set(xlabel=SYMBOLS[name], ylabel="excess of misfit", ylim=(-0.03 * top, top))
