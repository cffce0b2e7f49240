"""Charts of the study `speed`, from its records."""

import numpy as np
from matplotlib.ticker import LogLocator

from microblock.data.records import grouped
from microblock.view import plots

from .speed_growth import PHASES, TOLD

BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = plots.COLOURS
GREY = "0.5"
STYLES = {  # a method keeps its colour, marker and line in all charts
    "half-plane": (BLUE, "o", "-"),
    "fitted fe": (GREEN, "^", "-"),
    "AL, order 1": (RED, "s", "-"),
    "penalty": (PINK, "D", "--"),
    "condensed, order 1": (ORANGE, "v", ":"),
    "condensed, order 2": (ORANGE, "P", "--"),
    "condensed, order 4": (ORANGE, "X", "-"),
    "cells": (SKY, "h", "-"),
    "tamaas": (BLACK, "*", "-"),
    "line, rtol": (BLUE, "o", "-"),
    "line, order 2": (ORANGE, "P", "--"),
    "line, order 4": (ORANGE, "X", "-"),
    "line, order 6": (GREEN, "^", "-"),
    "condensed, order 6": (ORANGE, "d", "-."),
    "triangles, order 1": (BLUE, "v", ":"),
    "triangles, order 2": (BLUE, "P", "--"),
    "triangles, order 4": (BLUE, "X", "-"),
    "triangles, order 6": (BLUE, "d", "-."),
    "AL, order 2": (BLACK, "p", "-"),
    "scikit-fem, order 1": (BLACK, "<", ":"),
    "scikit-fem, order 2": (BLACK, ">", "--"),
    "ContactBoundary, order 1": (GREY, "v", ":"),
    "ContactBoundary, order 2": (GREY, "P", "--"),
    "ContactBoundary, order 4": (GREY, "X", "-"),
}
# beginnings of names whose markers are empty: seen without colours
HOLLOW = ("triangles", "ContactBoundary")
OTHERS = (
    "scikit-fem, order 1",
    "scikit-fem, order 2",
    "ContactBoundary, order 1",
    "ContactBoundary, order 2",
    "ContactBoundary, order 4",
)  # which have a figure of their own, `peers`
# plates of their own, of meshes that are uniform; APART is what the plates of all methods leave out
ELEMENTS = tuple(f"{shape}, order {order}" for shape in ("condensed", "triangles") for order in (1, 2, 4, 6))
APART = {"AL, order 2", *ELEMENTS, *OTHERS} - {*ELEMENTS[:3]}
FLOOR_BAND = 100  # times the floor: there the reference no longer tells methods apart
UNTUNED = (False, "False")  # as it is, and as a CSV file has it
ACROSS, WIDTH = 3, 2.33  # panels in a row, and the width of one: two columns of a page
TICKS = 4  # labels along a panel, at most
HATCHES = ("", "//", "--", "..", "xx", "++", "\\\\")  # of PHASES
COLUMN, ROW = 1.8, 0.2  # of a legend, inches
LABELS = {
    "unknowns": "unknowns",
    "contact_nodes": "contact nodes",
    "seconds": "setup and solving (s)",
    "megabytes": "memory (MiB)",
    "distance": "time over its floor",
}
GUIDE = 1.5  # exponent of the grey line: a sparse factorisation in the plane
# beginnings of names
SHOWN = ("condensed", "scikit-fem", "ContactBoundary", "tamaas", "AL, order 1", "cells")


def look(method):
    """How a method is drawn: keywords of `plot`."""
    colour, marker, line = STYLES[method]
    return {
        "color": colour,
        "marker": marker,
        "linestyle": line,
        "markerfacecolor": "none" if method.startswith(HOLLOW) else colour,
    }


def total(row):
    """Seconds of setup and solving."""
    return row["setup"] + row["solve"]


def curves(records):
    """{method: records of its curve, those that failed}; the best rho or period of each mesh alone makes
    it.
    """
    found = {}
    for method, rows in grouped(records, "method").items():
        found[method] = (
            [row for row in rows if row["error"] is not None and row["best"] not in UNTUNED],
            [row for row in rows if row["failure"]],
        )
    return found


def panels(records, draw, labels):
    """A figure with a panel a problem, `draw(axis, its records)`, and one legend below all of them."""
    scenes = grouped(records, "scene")
    if not scenes:
        drawing, axis = plots.figure(height=0.6)
        axis.axis("off")
        axis.text(0.5, 0.5, "no such runs", ha="center", va="center")
        return drawing
    across = min(ACROSS, len(scenes))
    drawing, axes = plots.figure(-(-len(scenes) // across), across, height=2.4, width=WIDTH, squeeze=False)
    for axis, letter, (scene, rows) in zip(axes.flat, "abcdefghijkl", scenes.items()):
        draw(axis, rows)
        axis.minorticks_off()  # their labels run into each other
        if axis.get_yscale() == "log":
            axis.set_ylim(_decades(axis.get_ylim()))
            axis.xaxis.set_major_locator(LogLocator(numticks=TICKS))
        axis.set_title(f"({letter}) {_named(scene)}", fontsize=8)
    for axis in axes.flat[len(scenes) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel(labels[1])
    for axis in axes.flat[max(0, len(scenes) - across) : len(scenes)]:
        axis.set_xlabel(labels[0])
    known = _known(axes.flat)
    legend_below_all(drawing, known.values(), known)
    return drawing


def _named(scene):
    law, _, alpha = scene.partition("-")
    return rf"{law}, $\alpha = {alpha}$" if alpha else law


def _known(axes):
    """{text: handle} of a legend for all axes; methods that look alike share a line of it."""
    texts = {text: handle for axis in axes for handle, text in zip(*axis.get_legend_handles_labels())}
    alike = grouped([{"look": STYLES.get(text, text), "text": text} for text in texts], "look")
    return {" / ".join(row["text"] for row in rows): texts[rows[0]["text"]] for rows in alike.values()}


def _decades(ends):
    least, most = np.log10(ends)
    return 10.0 ** np.floor(least), 10.0 ** np.ceil(most)


def legend_below_all(drawing, handles, texts, columns=None):
    """Below all panels, in room of its own."""
    width, height = drawing.get_size_inches()
    columns = columns or max(1, int(width / COLUMN))
    rows = -(-len(texts) // columns)
    drawing.set_size_inches(width, height + ROW * rows)
    share = ROW * rows / (height + ROW * rows)
    drawing.get_layout_engine().set(rect=(0, share, 1, 1 - share))
    drawing.legend(handles, texts, loc="lower center", ncols=columns).set_in_layout(False)


def against_error(cost, close=False):
    """A panel: cost(row) over true error; failed runs as crosses at the right, at what they had spent.

    A `close` view spans the errors of the runs alone, and says in words where the reference's own is.
    """

    def draw(axis, rows):
        floor = rows[0]["floor"]
        axis.set(xscale="log", yscale="log")
        if close:
            errors = [row["error"] for row in rows if row["error"]]
            axis.set_xlim(_decades((min(errors, default=0.1) / 1.1, max(errors, default=0.1) * 1.1)))
            axis.text(
                0.03, 0.03, f"reference: {floor:.0e}", transform=axis.transAxes, fontsize=7, color="0.4"
            )
        else:
            axis.axvspan(
                floor,
                FLOOR_BAND * floor,
                color="0.92",
                zorder=0,
                label="reference less than 100 times better",
            )
            axis.axvline(floor, color="0.5", linewidth=0.8, label="error of the reference")
        for method, (good, failed) in curves(rows).items():
            axis.plot(
                [row["error"] for row in good], [cost(row) for row in good], label=method, **look(method)
            )
            spent = [cost(row) for row in failed if cost(row)]
            if spent:
                axis.plot(
                    [0.98] * len(spent),
                    spent,
                    "x",
                    color=STYLES[method][0],
                    markersize=6,
                    transform=axis.get_yaxis_transform(),
                    label="failed",
                )
        untuned = [row for row in rows if row["best"] in UNTUNED and row["error"] is not None]
        for method, others in grouped(untuned, "method").items():
            axis.plot(
                [row["error"] for row in others],
                [cost(row) for row in others],
                ".",
                color=STYLES[method][0],
                markersize=3,
                zorder=1,
                label=f"{method}, not tuned",
            )

    return draw


def _main(records):
    return [row for row in records if row["method"] not in APART]


def _uniform(records, names):
    """Records of these methods on uniform meshes, in the order of the names."""
    return [row for name in names for row in records if row["method"] == name and row["h"] is not None]


def _spent(row):
    return row["spent"] if row["failure"] else total(row)


def seconds(records):
    """Processor seconds of setup and solving over true error, a panel a problem. True error here and in the
    other charts of speed: of pressure and micromoment, the larger one in L2 over the norm of the pressure,
    against a reference by another method (strip: of psi and u, against the closed form). Grey: where the
    reference is less than 100 times better. Crosses at the right: failed runs, at what they had spent.
    Programs of others are in speed_peers, more elements in speed_elements.
    """
    return panels(_main(records), against_error(_spent), ("true error", "setup and solving (s)"))


def unknowns(records):
    """Unknowns over true error, a panel a problem; a failed run has neither."""
    return panels(_main(records), against_error(lambda row: row["unknowns"]), ("true error", "unknowns"))


def elements(records):
    """Processor seconds of setup and solving over true error: squares ("condensed", filled markers) and
    triangles (empty ones) of orders 1 to 6 on uniform meshes, the bulk condensed in both. In words: the error
    of the reference, left of the panel.
    """
    return panels(
        _uniform(records, ELEMENTS),
        against_error(_spent, close=True),
        ("true error", "setup and solving (s)"),
    )


def layers(records):
    """Processor seconds of setup and solving over the error of psi below the surface, in the layer: relative,
    L2 over the depth against the half-plane's modes. Grey and dots as in speed_seconds and speed_peers."""
    deep = [
        {**row, "error": row["error_psi"], "floor": row["floor_psi"]}
        for row in records
        if row["floor_psi"] is not None and (row["error_psi"] is not None or row["failure"])
    ]
    return panels(
        [row for row in deep if row["method"] not in APART - {"condensed, order 6"}],
        against_error(_spent),
        ("error of psi below the surface", "setup and solving (s)"),
    )


def asked(records):
    """Obtained true error over requested one, of the methods that are asked for an accuracy, a panel a
    problem; below the grey line all is well, below the dotted one the reference is no judge."""

    def draw(axis, rows):
        axis.set(xscale="log", yscale="log")
        axis.axline((1e-3, 1e-3), (1e-4, 1e-4), color="0.6", linewidth=0.8, label="as requested")
        axis.axhline(
            rows[0]["floor"], color="0.5", linestyle=":", linewidth=0.8, label="error of the reference"
        )
        for method, (good, failed) in curves(rows).items():
            axis.plot(
                [row["rtol"] for row in good], [row["error"] for row in good], label=method, **look(method)
            )
            if failed:
                axis.plot(
                    [row["rtol"] for row in failed],
                    [0.98] * len(failed),
                    "x",
                    color=STYLES[method][0],
                    markersize=6,
                    transform=axis.get_xaxis_transform(),
                    label="failed",
                )

    return panels([row for row in records if row["rtol"] is not None], draw, ("requested rtol", "true error"))


def stacked_shares(axis, rows):
    """Bars of PHASES and what is left, one a method; at the right its `seconds`."""
    left, places = np.zeros(len(rows)), range(len(rows))
    look = {"edgecolor": "white", "linewidth": 0.3}
    for number, phase in enumerate(PHASES):
        widths = np.array([row[f"share_{phase}"] or 0.0 for row in rows.values()])
        axis.barh(
            places, widths, left=left, color=plots.COLOURS[number], label=phase, hatch=HATCHES[number], **look
        )
        left = left + widths
    axis.barh(places, np.maximum(0, 1 - left), left=left, color="0.85", label="other", **look)
    for place, row in zip(places, rows.values()):
        axis.text(1.02, place, f"{float(format(row['seconds'], '.2g')):g} s", va="center", fontsize=7)


def peers(records):
    """The classical limit beside other programs: processor seconds of setup and solving (a) and unknowns (b)
    over the true error of the pressure, relative in L2. Of tuned methods the best run of each mesh makes the
    curve, the others are dots. Empty markers: NGSolve's ContactBoundary."""
    rows = [row for row in records if row["scene"] == "classical" and row["method"].startswith(SHOWN)]
    drawing, axes = plots.figure(1, 2, height=3.2, width=3.3)
    for axis, letter, label, cost in zip(
        axes, "ab", ("setup and solving (s)", "unknowns"), (total, lambda row: row["unknowns"])
    ):
        for method, (good, _) in curves(rows).items():
            others = [
                row
                for row in rows
                if row["method"] == method and row["best"] in UNTUNED and row["error"] is not None
            ]
            axis.plot(
                [row["error"] for row in others],
                [cost(row) for row in others],
                ".",
                color=STYLES[method][0],
                markersize=2.5,
                zorder=1,
            )
            axis.plot(
                [row["error"] for row in good], [cost(row) for row in good], label=method, **look(method)
            )
        axis.set(xscale="log", yscale="log", xlabel="true error", ylabel=label)
        axis.set_title(f"({letter})", loc="left", fontsize=8)
    legend_below_all(drawing, *axes[0].get_legend_handles_labels())
    return drawing


def cost(records):
    """Growth of processor seconds and memory: over unknowns (a, b) and over contact nodes (c, d); (e) time
    over its floor, one factorisation of the same matrix (dense: one solve; without a matrix: one product with
    the flexibility); (f) where the time of the largest run goes.
    Cross: the next one failed or was left out, drawn at the time of the last one."""
    drawing, axes = plots.figure(3, 2, height=2.3, width=2.9)
    good = grouped([row for row in records if not row["failure"]], "method")
    panels = [
        ("unknowns", "seconds"),
        ("unknowns", "megabytes"),
        ("contact_nodes", "seconds"),
        ("contact_nodes", "megabytes"),
        ("unknowns", "distance"),
    ]
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
    """A cross at the right for each method whose next level was left out or failed, at its last time."""
    for method, rows in grouped(records, "method").items():
        good = [row for row in rows if not row["failure"]]
        if len(good) < len(rows) and good:
            axis.plot(
                [0.98],
                [good[-1]["seconds"]],
                "x",
                color=STYLES[method][0],
                markersize=6,
                transform=axis.get_yaxis_transform(),
                label="next one failed or left out",
            )


def _guide(axis):
    low, high = axis.get_xlim()
    x = np.array([1e4, high])
    axis.plot(x, 0.02 * (x / 1e4) ** GUIDE, color="0.6", linewidth=0.8, zorder=0, label=f"power {GUIDE:g}")
    axis.set_xlim(low, high)


def _shares(axis, last):
    """Shares of the largest run of each method; its seconds at the right."""
    stacked_shares(axis, last)
    axis.set_yticks(range(len(last)), [method.replace(", ", ",\n") for method in last], fontsize=6)
    axis.set(xlim=(0, 1), xlabel="share of the largest run's time")
    axis.set_title("(f)", loc="left", fontsize=8)
    axis.invert_yaxis()


# method: its name on the curve, and where that stands over its last point: (points right, points up)
FRONTS = {
    "half-plane": ("panels on the contact line", (4, 9)),
    "cells": ("uniform cells", (2, -10)),
    "fitted fe": ("fitted finite elements", (0, 6)),
    "tamaas": ("tamaas", (4, -4)),
    "scikit-fem, order 1": ("scikit-fem", (6, -8)),
    "ContactBoundary, order 1": ("NGSolve\nContactBoundary", (6, -6)),
    "AL, order 1": ("uniform mesh, augmented Lagrangian", (0, 12)),
}


def front(records):
    """Who reaches which accuracy in which time, in the classical limit, which all programs can solve:
    processor seconds of setup and solving over the true error of the pressure, better to the right and below.
    Of each method only runs that no other run of it beats in both. tamaas is ahead down to 0.4 %, cells and
    panels beyond."""
    rows = [
        row
        for row in records
        if row["scene"] == "classical" and row["method"] in FRONTS and row["error"] is not None
    ]
    drawing, axis = plots.figure(height=3.4, width=5.6)
    for method, own in grouped(rows, "method").items():
        best, least = [], np.inf
        for row in sorted(own, key=lambda row: row["error"]):
            if total(row) < least:
                least = total(row)
                best.append((row["error"], least))
        axis.plot(*zip(*best), **look(method))
        words, (right, up) = FRONTS[method]
        axis.annotate(
            words,
            best[0],
            xytext=(right, up),
            textcoords="offset points",
            fontsize=7,
            color=STYLES[method][0],
            va="center",
            ha="right" if right < 0 or method == "half-plane" else "left",
        )
    axis.set(
        xscale="log",
        yscale="log",
        xlim=(3, 3e-11),
        ylim=(4e-4, 30),
        xlabel="true relative error of the pressure (L2)",
        ylabel="processor time, setup and solving (s)",
    )
    return drawing


PLATES = {
    "front": front,
    "seconds": seconds,
    "unknowns": unknowns,
    "asked": asked,
    "elements": elements,
    "layers": layers,
    "peers": peers,
}
COST_PLATES = {"cost": cost}  # of the records of growth
