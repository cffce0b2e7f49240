"""Chart of the growth of time and memory, from the records of `speed_growth`."""

import numpy as np

from cases.speed_figures import STYLES, legend_below_all, look, stacked_shares
from cases.speed_growth import TOLD
from microblock import plots
from microblock.study import grouped

LABELS = {"unknowns": "unknowns", "contact_nodes": "contact nodes", "seconds": "setup and solving (s)",
          "megabytes": "memory (MiB)", "distance": "time over its floor"}
GUIDE = 1.5          # exponent of the grey line: a sparse factorisation in the plane


def cost(records):
    """Growth of processor seconds and memory: over unknowns (a, b) and over contact nodes (c, d); (e) time over its floor, one
    factorisation of the same matrix (dense: one solve; without a matrix: one product with the flexibility); (f) where the time
    of the largest run goes.
    Cross: the next one failed or was left out, drawn at the time of the last one."""
    drawing, axes = plots.figure(3, 2, height=2.3, width=2.9)
    good = grouped([row for row in records if not row["failure"]], "method")
    panels = [("unknowns", "seconds"), ("unknowns", "megabytes"), ("contact_nodes", "seconds"), ("contact_nodes", "megabytes"),
              ("unknowns", "distance")]
    for axis, letter, (size, value) in zip(axes.flat, "abcde", panels):
        for method, rows in good.items():
            rows = [row for row in rows if row[value] and row[value] >= TOLD.get(value, 0)]
            axis.plot([row[size] for row in rows], [row[value] for row in rows], label=method, **look(method))
        axis.set(xscale="log", yscale="log", xlabel=LABELS[size], ylabel=LABELS[value])
        axis.set_title(f"({letter})", loc="left", fontsize=8)
        axis.minorticks_off()
    _left_out(axes.flat[0], records)
    _guide(axes.flat[0])
    axes.flat[4].axhline(1.0, color="0.5", linewidth=0.8)
    _shares(axes.flat[5], {method: rows[-1] for method, rows in good.items()})
    known = {text: handle for axis in axes.flat for handle, text in zip(*axis.get_legend_handles_labels())}
    legend_below_all(drawing, known.values(), known)
    return drawing


def _left_out(axis, records):
    """A cross at the right for each method whose next rung was left out or failed, at its last time."""
    for method, rows in grouped(records, "method").items():
        good = [row for row in rows if not row["failure"]]
        if len(good) < len(rows) and good:
            axis.plot([0.98], [good[-1]["seconds"]], "x", color=STYLES[method][0], markersize=6,
                      transform=axis.get_yaxis_transform(), label="next one failed or left out")


def _guide(axis):
    low, high = axis.get_xlim()
    x = np.array([1e4, high])
    axis.plot(x, 0.02*(x/1e4)**GUIDE, color="0.6", linewidth=0.8, zorder=0, label=f"power {GUIDE:g}")
    axis.set_xlim(low, high)


def _shares(axis, last):
    """Shares of the largest run of each method; its seconds at the right."""
    stacked_shares(axis, last)
    axis.set_yticks(range(len(last)), [method.replace(", ", ",\n") for method in last], fontsize=6)
    axis.set(xlim=(0, 1), xlabel="share of the largest run's time")
    axis.set_title("(f)", loc="left", fontsize=8)
    axis.invert_yaxis()


PLATES = {"cost": cost}
