"""The chart of speed against accuracy: processor time over true error in the classical limit."""

from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

RECORD = Path(__file__).parent / "results" / "speed.csv"
NAMES = {  # of the curves, and how they are drawn
    "half-plane": ("panels", "o-", "C0"),
    "cells": ("uniform cells", "h-", "C5"),
    "fitted fe": ("fitted elements", "^-", "C2"),
    "AL, order 1": ("squares, augm. Lagrangian", "s-", "C1"),
    "condensed, order 1": ("squares, condensed", "v:", "C4"),
    "tamaas": ("tamaas", "*-", "C6"),
}


def best(runs):
    """The runs that no other run of the method beats in both error and seconds, by error."""
    runs = runs.dropna(subset="error").assign(seconds=runs.setup + runs.solve).sort_values("error")
    return runs[runs.seconds < runs.seconds.cummin().shift(fill_value=float("inf"))]


def figure(runs=None):
    """All programs can solve this problem: errors fall to the right, lower is faster."""
    if runs is None:
        runs = pd.read_csv(RECORD)
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 3.6))
    for method, (name, look, colour) in NAMES.items():
        curve = best(runs[(runs.scene == "classical") & (runs.method == method)])
        if len(curve):
            axis.plot(curve.error, curve.seconds, look, color=colour, label=name)
    axis.set(
        xscale="log",
        yscale="log",
        xlim=(3, 3e-11),
        xlabel="true relative error ($L_2$)",
        ylabel="processor time (s)",
    )
    axis.minorticks_off()
    drawing.legend(loc="outside lower center", ncols=2)
    return drawing
