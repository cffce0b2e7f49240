"""Charts of the study `speed`, from its records."""

import math

import numpy as np
from matplotlib.ticker import LogLocator

from microblock import plots
from microblock.study import grouped

BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = plots.COLOURS
GREY = "0.5"
STYLES = {      # a method keeps its colour, marker and line in all charts
    "half-plane": (BLUE, "o", "-"), "fitted fe": (GREEN, "^", "-"), "paper's way": (RED, "s", "-"), "penalty": (PINK, "D", "--"),
    "condensed, order 1": (ORANGE, "v", ":"), "condensed, order 2": (ORANGE, "P", "--"), "condensed, order 4": (ORANGE, "X", "-"),
    "cells": (SKY, "h", "-"), "tamaas": (BLACK, "*", "-"), "line, rtol": (BLUE, "o", "-"), "line, order 2": (ORANGE, "P", "--"),
    "line, order 4": (ORANGE, "X", "-"), "line, order 6": (GREEN, "^", "-"), "condensed, order 6": (ORANGE, "d", "-."),
    "triangles, order 1": (BLUE, "v", ":"), "triangles, order 2": (BLUE, "P", "--"), "triangles, order 4": (BLUE, "X", "-"),
    "triangles, order 6": (BLUE, "d", "-."), "AL, triangles": (SKY, ">", "--"), "AL, order 2": (BLACK, "p", "-"),
    "AL, Gauss": (GREEN, "<", ":"), "AL, order 2, Gauss": (PINK, "p", "-."),
    "scikit-fem, order 1": (BLACK, "<", ":"), "scikit-fem, order 2": (BLACK, ">", "--"),
    "ContactBoundary, order 1": (GREY, "v", ":"), "ContactBoundary, order 2": (GREY, "P", "--"),
    "ContactBoundary, order 4": (GREY, "X", "-")}
HOLLOW = ("triangles", "ContactBoundary")      # beginnings of names whose markers are empty: seen without colours
OTHERS = ("scikit-fem, order 1", "scikit-fem, order 2", "ContactBoundary, order 1", "ContactBoundary, order 2",
          "ContactBoundary, order 4")      # which have a plate of their own, `figures_peers`
# plates of their own, of meshes that are uniform; APART is what the plates of all methods leave out
ELEMENTS = tuple(f"{shape}, order {order}" for shape in ("condensed", "triangles") for order in (1, 2, 4, 6))
RULES = ("paper's way", "AL, Gauss", "AL, order 2", "AL, order 2, Gauss", "AL, triangles")
PRESSURES = (*ELEMENTS[:5], "AL, Gauss", "AL, order 2, Gauss")
APART = (set(ELEMENTS) | set(RULES) | set(OTHERS)) - {"paper's way", *ELEMENTS[:3]}
FLOOR_BAND = 100        # times the floor: there the reference no longer tells methods apart
PHASES = ("mesh", "tables", "assembly", "residual", "factor", "condensation", "states")
UNTUNED = (False, "False")      # as it is, and as a CSV file has it
NODES = (10, 20, 50, 100, 200, 500)      # ticks
FAINT = 1e-3            # part of the largest pressure below which pulls and swings are drawn linearly
ACROSS, WIDTH = 3, 2.33      # panels in a row, and the width of one: two columns of a page
TICKS = 4               # labels along a panel, at most
HATCHES = ("", "//", "--", "..", "xx", "++", "\\\\")      # of PHASES
COLUMN, ROW = 1.8, 0.2      # of a legend, inches


def look(method):
    """How a method is drawn: keywords of `plot`."""
    colour, marker, line = STYLES[method]
    return {"color": colour, "marker": marker, "linestyle": line,
            "markerfacecolor": "none" if method.startswith(HOLLOW) else colour}


def total(row):
    """Seconds of setup and solving."""
    return row["setup"] + row["solve"]


def slope(sizes, seconds):
    """Exponent of the growth between two records, None where there are not two, or sizes do not grow."""
    if len(sizes) < 2 or not sizes[1] > sizes[0] or not min(seconds) > 0:
        return None
    return math.log(seconds[1]/seconds[0])/math.log(sizes[1]/sizes[0])


def curves(records):
    """{method: records of its curve, those that failed}; the best rho or period of each mesh alone makes it."""
    found = {}
    for method, rows in grouped(records, "method").items():
        found[method] = ([row for row in rows if row["error"] is not None and row["best"] not in UNTUNED],
                         [row for row in rows if row["failure"]])
    return found


def panels(records, draw, labels):
    """A figure with a panel a scene, `draw(axis, records of the scene)`, and one legend below all of them."""
    scenes = grouped(records, "scene")
    if not scenes:
        drawing, axis = plots.figure(height=0.6)
        axis.axis("off")
        axis.text(0.5, 0.5, "no such runs", ha="center", va="center")
        return drawing
    across = min(ACROSS, len(scenes))
    drawing, axes = plots.figure(-(-len(scenes)//across), across, height=2.4, width=WIDTH, squeeze=False)
    for axis, letter, (scene, rows) in zip(axes.flat, "abcdefghijkl", scenes.items()):
        draw(axis, rows)
        axis.minorticks_off()      # their labels run into each other
        if axis.get_yscale() == "log":
            axis.set_ylim(_decades(axis.get_ylim()))
            axis.xaxis.set_major_locator(LogLocator(numticks=TICKS))
        axis.set_title(f"({letter}) {_named(scene)}", fontsize=8)
    for axis in axes.flat[len(scenes):]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel(labels[1])
    for axis in axes.flat[max(0, len(scenes) - across):len(scenes)]:
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
    return 10.0**np.floor(least), 10.0**np.ceil(most)


def legend_below_all(drawing, handles, texts, columns=None):
    """Below all panels, in room of its own."""
    width, height = drawing.get_size_inches()
    columns = columns or max(1, int(width/COLUMN))
    rows = -(-len(texts)//columns)
    drawing.set_size_inches(width, height + ROW*rows)
    share = ROW*rows/(height + ROW*rows)
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
            axis.set_xlim(_decades((min(errors, default=0.1)/1.1, max(errors, default=0.1)*1.1)))
            axis.text(0.03, 0.03, f"reference: {floor:.0e}", transform=axis.transAxes, fontsize=7, color="0.4")
        else:
            axis.axvspan(floor, FLOOR_BAND*floor, color="0.92", zorder=0, label="reference less than 100 times better")
            axis.axvline(floor, color="0.5", linewidth=0.8, label="error of the reference")
        for method, (good, failed) in curves(rows).items():
            axis.plot([row["error"] for row in good], [cost(row) for row in good], label=method, **look(method))
            spent = [cost(row) for row in failed if cost(row)]
            if spent:
                axis.plot([0.98]*len(spent), spent, "x", color=STYLES[method][0], markersize=6,
                          transform=axis.get_yaxis_transform(), label="failed")
        untuned = [row for row in rows if row["best"] in UNTUNED and row["error"] is not None]
        for method, others in grouped(untuned, "method").items():
            axis.plot([row["error"] for row in others], [cost(row) for row in others], ".", color=STYLES[method][0], markersize=3,
                      zorder=1, label=f"{method}, not tuned")
    return draw


def _main(records):
    return [row for row in records if row["method"] not in APART]


def _uniform(records, names):
    """Records of these methods on uniform meshes, in the order of the names."""
    return [row for name in names for row in records if row["method"] == name and row["h"] is not None]


def _spent(row):
    return row["spent"] if row["failure"] else total(row)


def seconds(records):
    """Processor seconds of setup and solving over true error, a panel a scene. True error here and in the other charts of
    speed: of pressure and micromoment, the larger one in L2 over the norm of the pressure, against a reference by another
    method (strip: of psi and u, against the closed form). Grey: where the reference is less than 100 times better. Crosses at the
    right: failed runs, at what they had spent. Programs of others are in speed_peers, more elements in speed_elements."""
    return panels(_main(records), against_error(_spent), ("true error", "setup and solving (s)"))


def solving(records):
    """Processor seconds of solving alone, which is what a further load costs, over true error; otherwise as speed_seconds."""
    return panels(_main(records), against_error(lambda row: row["spent"] if row["failure"] else row["solve"]),
                  ("true error", "solving alone (s)"))


def unknowns(records):
    """Unknowns over true error, a panel a scene; a failed run has neither."""
    return panels(_main(records), against_error(lambda row: row["unknowns"]), ("true error", "unknowns"))


def elements(records):
    """Processor seconds of setup and solving over true error: squares ("condensed", filled markers) and triangles (empty ones) of
    orders 1 to 6 on uniform meshes, the bulk condensed in both. In words: the error of the reference, left of the panel."""
    return panels(_uniform(records, ELEMENTS), against_error(_spent, close=True), ("true error", "setup and solving (s)"))


def element_unknowns(records):
    """Unknowns over true error: squares ("condensed", filled markers) and triangles (empty ones) of orders 1 to 6 on uniform
    meshes. Where both have the same nodes and about the same error their curves lie on each other."""
    return panels(_uniform(records, ELEMENTS), against_error(lambda row: row["unknowns"], close=True), ("true error", "unknowns"))


def rules(records):
    """Processor seconds of setup and solving over true error: the paper's way (bilinear squares, augmented Lagrangian (AL) at
    the nodes) beside AL of order 2, with Gauss's rule for the contact term, and on triangles; uniform meshes."""
    return panels(_uniform(records, RULES), against_error(_spent, close=True), ("true error", "setup and solving (s)"))


def pulls(records):
    """Largest pressure of the wrong sign, a pull, over the largest pressure, over the number of contact nodes. The vertical
    scale is linear below 1e-3; methods without pulls lie on 0."""
    return panels(_uniform(records, PRESSURES), against_nodes("pull"), ("contact nodes", "largest pull"))


def swings(records):
    """Total variation of the pressure over that of the reference, less 1, over the number of contact nodes: above 0 it swings,
    below 0 its peak is cut. The vertical scale is linear between -1e-3 and 1e-3."""
    return panels(_uniform(records, PRESSURES), against_nodes("swing"), ("contact nodes", "excess variation"))


def against_nodes(name):
    """A panel: what a record says over contact nodes."""
    def draw(axis, rows):
        axis.set_xscale("log")
        axis.set_xticks(NODES, [str(number) for number in NODES])
        axis.set_yscale("symlog", linthresh=FAINT)
        axis.axhline(0, color="0.6", linewidth=0.8)
        for method, (good, _) in curves(rows).items():
            axis.plot([row["contact_nodes"] for row in good], [row[name] for row in good], label=method, **look(method))
    return draw


def layers(records):
    """Processor seconds of setup and solving over the error of psi below the surface, in the layer: relative, L2 over the depth
    against the half-plane's modes. Grey and dots as in speed_seconds and speed_peers."""
    deep = [{**row, "error": row["error_psi"], "floor": row["floor_psi"]} for row in records
            if row["floor_psi"] is not None and (row["error_psi"] is not None or row["failure"])]
    return panels([row for row in deep if row["method"] not in APART - {"condensed, order 6"}], against_error(_spent),
                  ("error of psi below the surface", "setup and solving (s)"))


def asked(records):
    """Obtained true error over requested one, of the methods that are asked for an accuracy, a panel a scene; below the grey
    line all is well, below the dotted one the reference is no judge."""
    def draw(axis, rows):
        axis.set(xscale="log", yscale="log")
        axis.axline((1e-3, 1e-3), (1e-4, 1e-4), color="0.6", linewidth=0.8, label="as requested")
        axis.axhline(rows[0]["floor"], color="0.5", linestyle=":", linewidth=0.8, label="error of the reference")
        for method, (good, failed) in curves(rows).items():
            axis.plot([row["rtol"] for row in good], [row["error"] for row in good], label=method, **look(method))
            if failed:
                axis.plot([row["rtol"] for row in failed], [0.98]*len(failed), "x", color=STYLES[method][0], markersize=6,
                          transform=axis.get_xaxis_transform(), label="failed")
    return panels([row for row in records if row["rtol"] is not None], draw, ("requested rtol", "true error"))


def growth(records):
    """Processor seconds of setup and solving over unknowns, a panel a scene."""
    def draw(axis, rows):
        axis.set(xscale="log", yscale="log")
        for method, (good, _) in curves(rows).items():
            good = sorted(good, key=lambda row: row["unknowns"])
            axis.plot([row["unknowns"] for row in good], [total(row) for row in good], label=method, **look(method))
    return panels(_main(records), draw, ("unknowns", "setup and solving (s)"))


def phases(records):
    """Where the time goes: shares of the finest run of each method, of one scene; at the right its processor seconds."""
    scenes = grouped([row for row in _main(records) if row["error"] is not None], "scene")
    scene = next((name for name in ("microblock-0.25", *scenes) if name in scenes), None)
    drawing, axis = plots.figure(height=2.8, width=5.0)
    finest = {method: good[-1] for method, (good, _) in curves(scenes.get(scene, [])).items() if good}
    stacked_shares(axis, {method: {**row, "seconds": total(row)} for method, row in finest.items()})
    axis.set_yticks(range(len(finest)), list(finest))
    axis.set(xlim=(0, 1), xlabel="share of the time of the finest run", title=_named(scene or ""))
    axis.invert_yaxis()
    legend_below_all(drawing, *axis.get_legend_handles_labels(), columns=4)
    return drawing


def stacked_shares(axis, rows):
    """Bars of PHASES and what is left, one a method; at the right its `seconds`."""
    left, places = np.zeros(len(rows)), range(len(rows))
    look = {"edgecolor": "white", "linewidth": 0.3}
    for number, phase in enumerate(PHASES):
        widths = np.array([row[f"share_{phase}"] or 0.0 for row in rows.values()])
        axis.barh(places, widths, left=left, color=plots.COLOURS[number], label=phase, hatch=HATCHES[number], **look)
        left = left + widths
    axis.barh(places, np.maximum(0, 1 - left), left=left, color="0.85", label="other", **look)
    for place, row in zip(places, rows.values()):
        axis.text(1.02, place, f"{float(format(row['seconds'], '.2g')):g} s", va="center", fontsize=7)


PLATES = {"seconds": seconds, "solving": solving, "unknowns": unknowns, "asked": asked, "growth": growth, "phases": phases,
          "elements": elements, "element_unknowns": element_unknowns, "rules": rules, "pulls": pulls, "swings": swings,
          "layers": layers}
