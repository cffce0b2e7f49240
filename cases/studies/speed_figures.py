"""Charts of the study `speed`, from its records: time over true error, and over the size of the problem."""

from dataclasses import dataclass

import numpy as np
from matplotlib.ticker import LogLocator

from microblock.data.records import grouped
from microblock.view import plots

from .speed_growth import TOLD

BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK = plots.COLOURS
GREY = "0.45"


@dataclass(frozen=True)
class Look:
    """How a method is called and drawn; in all charts the same."""

    name: str
    colour: str
    marker: str
    line: str = "-"

    @property
    def style(self):
        """Keywords of `plot`."""
        return {"color": self.colour, "marker": self.marker, "linestyle": self.line}


LOOKS = {
    "half-plane": Look("panels on the contact line", BLUE, "o"),
    "cells": Look("uniform cells", SKY, "h"),
    "fitted fe": Look("fitted finite elements", GREEN, "^"),
    "condensed, order 1": Look("uniform mesh, condensed", ORANGE, "v", ":"),
    "condensed, order 4": Look("uniform mesh of order 4", ORANGE, "X"),
    "AL, order 1": Look("uniform mesh, augmented Lagrangian", RED, "s"),
    "tamaas": Look("tamaas", BLACK, "*"),
    "scikit-fem, order 1": Look("scikit-fem", PURPLE, "<", ":"),
    "ContactBoundary, order 1": Look("NGSolve's ContactBoundary", GREY, "P", "--"),
}
CLASSICAL, LAW = "classical", "microblock-0.25"  # the problems of the two charts over the error
SAME_LAW = "microblock-"  # how problems with that law begin
# methods that are drawn, and where their names stand over their last points: points right and up
CLASSICAL_NAMES = {
    "half-plane": (6, -18),
    "cells": (5, -1),
    "fitted fe": (0, 8),
    "tamaas": (-16, -68),
    "scikit-fem, order 1": (6, -6),
    "ContactBoundary, order 1": (6, 0),
    "AL, order 1": (-30, 30),
}
LAW_NAMES = {
    "half-plane": (0, -20),
    "cells": (-25, -58),
    "fitted fe": (6, -7),
    "condensed, order 4": (10, 26),
    "AL, order 1": (-30, 9),
}
ERRORS, SECONDS = (3, 3e-11), (4e-4, 400)  # of the axes: errors fall to the right
FAINT = 0.35  # opacity of the other problems
# names in (a) and in (b): beside which mark they stand, points right and up
COST_NAMES = {
    "half-plane": ((-1, (6, 0)), (-1, (6, 0))),
    "cells": ((-2, (7, -4)), (-2, (7, -4))),
    "AL, order 1": ((-1, (-35, 6)), (-1, (-35, 12))),
    "condensed, order 1": ((-1, (4, 9)), (-1, (4, 4))),
}
COST_SECONDS, COST_MEMORY = (1e-2, 1e3), (1, 4e4)  # of the axes
SIZE, TIME = "unknowns", "processor time (s)"


def total(row):
    """Seconds of setup and solving."""
    return row["setup"] + row["solve"]


def best(rows):
    """[(error, seconds)] of the runs that no other run of the method beats in both, the smallest error
    first.
    """
    found, least = [], np.inf
    for row in sorted((row for row in rows if row["error"] is not None), key=lambda row: row["error"]):
        if total(row) < least:
            least = total(row)
            found.append((row["error"], least))
    return found


def _over_errors(rows, names, faint=()):
    """Seconds over true error, a curve a method of `names`, which says where its name stands.

    faint : records of other problems, drawn without names
    """
    drawing, axis = plots.figure(height=3.3)
    for method, shift in names.items():
        look, own = LOOKS[method], [row for row in rows if row["method"] == method]
        for others in grouped([row for row in faint if row["method"] == method], "scene").values():
            axis.plot(*zip(*best(others)), color=look.colour, alpha=FAINT, linewidth=0.7, zorder=1)
        points = best(own)
        if points:
            axis.plot(*zip(*points), **look.style)
            # the name of the curve that ends at the right edge stands to the left
            side = {"ha": "right"} if points[0][0] < 10 * ERRORS[1] else {"ha": "left"}
            plots.label(axis, *points[0], look.name, look.colour, shift, **side)
        _failures(axis, own, look)
    axis.set(xscale="log", yscale="log", xlim=ERRORS, ylim=SECONDS)
    axis.set(xlabel="true relative error ($L_2$)", ylabel=TIME)
    axis.xaxis.set_major_locator(LogLocator(numticks=7))
    axis.minorticks_off()
    return drawing


def _failures(axis, rows, look):
    """Crosses at the left, at what runs without an answer had spent."""
    spent = [row["spent"] for row in rows if row["failure"] and row["spent"]]
    if spent:
        across = axis.get_yaxis_transform()
        axis.plot([0.02] * len(spent), spent, "x", color=look.colour, markersize=6, transform=across)


def front(records):
    """In the classical limit tamaas is the fastest down to an error of 0.5 %, uniform cells and panels
    beyond.

    All programs can solve this problem: a cylinder on a half-plane without microblocks. Each curve shows what
    a method needs to reach a true error (of the pressure, relative, L2), which falls to the right: lower and
    further to the right is better. Processor time is that of setup and solving on one thread. Only runs that
    no other run of the same method beats in both are shown. Period and penalty parameter of the other
    programs are the best ones.

    Seen: seven curves; finite elements on uniform meshes stay at errors above 0.5 percent, panels reach ten
    digits in a few hundredths of a second.
    """
    return _over_errors([row for row in records if row["scene"] == CLASSICAL], CLASSICAL_NAMES)


def law(records):
    """With microblocks, panels reach ten digits in the time in which uniform meshes reach one.

    As the chart of the classical limit, on the same axes, for the microblock law, which no other program has.
    Bold: alpha = 0.25; thin: alpha = 0.01, 0.05 and 1. The error is the larger one of pressure and
    micromoment. Uniform meshes cannot place the edges of the zones, at any order; fitted elements move their
    nodes there, and panels are made between the edges. The penalty and squares of order 1 to 6 lie beside the
    two uniform meshes that are drawn.

    Seen: five curves; both uniform meshes end near an error of one percent after 1 and 20 seconds, uniform
    cells at 2e-5 after half a second, fitted elements at 4e-6 after one second, panels at 5e-11.
    """
    rows = [row for row in records if row["scene"] == LAW]
    others = [row for row in records if row["scene"].startswith(SAME_LAW) and row["scene"] != LAW]
    return _over_errors(rows, LAW_NAMES, others)


def _broken(name):
    """A name in two lines, where there is little room beside its curve."""
    return name.replace(", ", ",\n").replace("the contact", "the\ncontact")


def cost(records):
    """Two million unknowns take 7 s and 0.6 GiB by cells, which need no matrix; one million 32 s and 7 GiB
    by finite elements.

    Processor time (a) and memory (b) over the size of the problem, a cylinder at alpha = 0.25; a cell has two
    unknowns. Panels need some hundred unknowns for ten digits. Right of a cross at the end of a curve the
    next, larger problem failed or was left out.

    Seen: straight lines on logarithmic axes with slopes a little above one; uniform cells are the lowest for
    large problems.
    """
    drawing, axes = plots.figure(2, 1, height=2.1, sharex=True)
    for method, places in COST_NAMES.items():
        rows = [row for row in records if row["method"] == method]
        look, good = LOOKS[method], [row for row in rows if not row["failure"]]
        for axis, value, (at, shift) in zip(axes, ("seconds", "megabytes"), places):
            told = [row for row in good if row[value] and row[value] >= TOLD[value]]
            if told:
                axis.plot([row[SIZE] for row in told], [row[value] for row in told], **look.style)
                plots.label(axis, told[at][SIZE], told[at][value], _broken(look.name), look.colour, shift)
        if good and len(good) < len(rows):
            # beside the last mark, so that it is seen whose it is
            axes[0].plot(2 * good[-1][SIZE], good[-1]["seconds"], "x", markersize=6, color=look.colour)
    for axis, text, ends in zip(axes, (TIME, "memory (MiB)"), (COST_SECONDS, COST_MEMORY)):
        axis.set(xscale="log", yscale="log", ylabel=text, ylim=ends)
        axis.minorticks_off()
    axes[1].set(xlabel=SIZE)
    plots.letter(axes)
    return drawing


PLATES = {"classical": front, "law": law}
COST_PLATES = {"cost": cost}  # of the records of growth
