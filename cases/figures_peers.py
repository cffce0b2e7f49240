"""Chart of the classical limit near the errors that other programs reach, from the records of the study `speed`."""

from cases.speed_figures import STYLES, UNTUNED, curves, legend_below_all, look, total
from microblock import plots

SHOWN = ("condensed", "scikit-fem", "ContactBoundary", "tamaas", "paper's way", "cells")      # beginnings of names


def peers(records):
    """The classical limit beside other programs: processor seconds of setup and solving (a) and unknowns (b) over the true
    error of the pressure, relative in L2. Of tuned methods the best run of each mesh makes the curve, the others are
    dots. Empty markers: NGSolve's ContactBoundary."""
    rows = [row for row in records if row["scene"] == "classical" and row["method"].startswith(SHOWN)]
    drawing, axes = plots.figure(1, 2, height=3.2, width=3.3)
    for axis, letter, label, cost in zip(axes, "ab", ("setup and solving (s)", "unknowns"), (total, lambda row: row["unknowns"])):
        for method, (good, _) in curves(rows).items():
            others = [row for row in rows if row["method"] == method and row["best"] in UNTUNED and row["error"] is not None]
            axis.plot([row["error"] for row in others], [cost(row) for row in others], ".", color=STYLES[method][0],
                      markersize=2.5, zorder=1)
            axis.plot([row["error"] for row in good], [cost(row) for row in good], label=method, **look(method))
        axis.set(xscale="log", yscale="log", xlabel="true error", ylabel=label)
        axis.set_title(f"({letter})", loc="left", fontsize=8)
    legend_below_all(drawing, *axes[0].get_legend_handles_labels())
    return drawing


PLATES = {"peers": peers}
