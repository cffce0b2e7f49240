"""Sliders of mb.explore in a browser: from a key, or a move of the mouse, to the painted picture.

Geometry   a cylinder on a half-plane with psi0 = 0 and 0.01, on a block (fitted elements), and a rough
           surface with a period (4096 cells), each with those of the sliders load, psi0, radius and alpha
           that it has.
Equations  those of `hertz` and `rough`.
Model      an executed notebook in JupyterLab and headless Chromium on this machine, without a net, in
           windows of 1366 and 1024 pixels; each slider is moved by arrow keys and by drags, a step once
           the picture of the last one is painted, and by a drag that does not wait. Extra `browser`, and
           Chromium.
Reference  none: what is measured is this machine with all that runs on it; `load_average` is how many
           processes wanted a processor when it began.
Look at    the median and the 95th percentile of `key`, against 60 and 90 ms on an idle machine; the share
           of the state itself; pictures per second of a drag; DIR/sliders_PROBLEM_WIDTH.png, what is seen.
Units      milliseconds elapsed. `state`: a neighbour's state; `picture`: that and its PNG, both without a
           browser; `key`, `drag`: to the frame that shows it; of a slider that waits until it is let go,
           `drag` counts from there.
"""

import math
import os
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.provenance import content
from microblock.data.records import read_records
from microblock.view.explorer import Explorer
from microblock.view.widgets import LABELS, RANGE, STEP_PSI0, STEPS

from ..common.catalog import DATA, PROGRAM
from ..common.options import Checked, command, names, option
from ..common.records import kept, print_table, returned
from . import sliders_browser as browser

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
CYLINDER, LOAD = mb.Cylinder(R=10), 1.0
WARM = 3  # steps of a slider that are not counted
NARROWEST = 1024  # pixels for which the sliders are made
SLIDERS = ("load", "psi0", "radius", "alpha")
COLUMNS = (
    "problem",
    "slider",
    "by",
    "width",
    "count",
    "median",
    "p95",
    "largest",
    "pictures_per_second",
    "load_average",
)


def rough():
    body = mb.HalfPlane(SOLID, period=1.0)
    return mb.Contact(body, mb.Rough(period=1.0, slope=0.1), mb.Microblock(), mb.Cells(nodes=4096))


PROBLEMS = {
    "cylinder": lambda: mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Microblock()),
    "psi0": lambda: mb.Contact(mb.HalfPlane(SOLID), CYLINDER, mb.Microblock(psi0=0.01)),
    "block": lambda: mb.Contact(mb.Block(SOLID, size=6.0), CYLINDER, mb.Microblock()),
    "rough": rough,
}


@dataclass(frozen=True)
class Parameters(Checked):
    only: tuple = names(f"problems, of {', '.join(PROBLEMS)}", PROBLEMS)
    widths: tuple = option(
        (1366, 1024), "of the window (pixels)", int, nargs="+", at_least=NARROWEST, at_most=8000
    )
    presses: int = option(
        30, "keys and moves that are counted, of each slider", int, at_least=1, at_most=1000
    )


def notebook(name):
    """Cells of a notebook with the sliders of a problem."""
    return (
        f"import microblock as mb\nfrom {__name__} import LOAD, PROBLEMS",
        f"mb.explore(PROBLEMS[{name!r}](), LOAD)",
    )


def without_browser(name, presses):
    """{(slider, by): milliseconds of steps} of states, and of states with their picture, in this process."""
    explorer, found = Explorer(PROBLEMS[name](), LOAD), {}
    explorer.png()
    for slider in SLIDERS:
        start = getattr(explorer.choice, slider)
        if start is None:
            continue
        found[slider, "state"], found[slider, "picture"] = [], []
        for number in range(WARM + presses):
            step = number + 1
            value = (
                start + math.radians(STEP_PSI0) * step
                if slider == "psi0"
                else start * RANGE ** (step / STEPS)
            )
            began = time.perf_counter()
            explorer.update(**{slider: value})
            explorer.png()
            found[slider, "picture"].append(1e3 * (time.perf_counter() - began))
            found[slider, "state"].append(1e3 * explorer.seconds)
        explorer.update(**{slider: start})
    return {key: taken[WARM:] for key, taken in found.items()}


def in_browser(lab, width, presses, picture=None):
    """({(slider, by): milliseconds of steps}, {slider: pictures per second of a drag}) in a window."""
    page, found, rates = lab.sliders(width), {}, {}
    if picture:
        page.screenshot(path=picture)
    for name, slider in names_of(page).items():
        found[name, "key"] = browser.keys(page, slider, WARM + presses)[WARM:]
        found[name, "drag"] = browser.drags(page, slider, WARM + presses)[WARM:]
        pictures, seconds, _ = browser.sweep(page, slider, moves=50)
        rates[name] = pictures / seconds
    page.close()
    return found, rates


def names_of(page):
    """{name of a slider: its handle} on a page."""
    known = {label: name for name, label in LABELS.items()}
    return {known[label]: handle for label, handle in browser.handles(page).items()}


def summaries(found, **more):
    """A row for each slider and way of asking, and one for all sliders together."""
    together = {}
    for (_, by), taken in found.items():
        together.setdefault(("all", by), []).extend(taken)
    rows = []
    for (slider, by), taken in {**found, **together}.items():
        taken = [each for each in taken if each is not None]
        spread = (
            {"median": np.median(taken), "p95": np.percentile(taken, 95), "largest": max(taken)}
            if taken
            else {}
        )
        numbers = {name: float(value) for name, value in spread.items()}
        rows.append({"slider": slider, "by": by, "count": len(taken), **numbers, **more})
    return rows


def result(parameters, out=None, quiet=True):
    """The case's object: a row for each problem, slider, way of asking and width; in the folder `out` rows
    are kept problem by problem.
    """
    start, rows = time.perf_counter(), []
    for name in tqdm(parameters.only or PROBLEMS, disable=quiet, unit="problem"):
        busy = {"problem": name, "load_average": os.getloadavg()[0]}
        rows += summaries(without_browser(name, parameters.presses), **busy)
        with browser.Lab(*notebook(name)) as lab:
            for width in parameters.widths:
                picture = out and out / f"sliders_{name}_{width}.png"
                found, rates = in_browser(lab, width, parameters.presses, picture)
                rates["all"] = float(np.median(list(rates.values())))
                for row in summaries(found, width=width, **busy):
                    if row["by"] == "drag":
                        row["pictures_per_second"] = rates[row["slider"]]
                    rows.append(row)
        if out:
            line = command("sliders", parameters)
            kept(out / "sliders.csv", [{"command": line, **_shown(row)} for row in rows])
    return returned(parameters, start, rows=[_shown(row) for row in rows])


def _shown(row):
    return {name: row.get(name) for name in COLUMNS}


def run(parameters, out=None, quiet=False):
    """Measure, print a table, write the records into the folder `out`, and what is seen."""
    answer = result(parameters, out, quiet)
    if not quiet:
        print("milliseconds elapsed")
        print_table(answer["rows"], COLUMNS, 3)
    return answer


def table_of(path):
    """The table of the records in a file, whose content is a part of it."""
    now = content(path)

    def table():
        """From a key, or a move of a drag, to the painted picture in JupyterLab and headless Chromium.

        Milliseconds of all sliders of a problem together; beside them those of the same steps without a
        browser, of the state alone and of the state with its picture. A drag that does not wait shows so many
        pictures a second. What else ran on the machine is in the times: on an idle one the load average is
        below 1.
        """
        if now is None:
            raise mb.NotConverged(f"no records of sliders in {DATA}: {PROGRAM} sliders --out {DATA}")
        names = [name for name in COLUMNS if name != "slider"]
        return [
            {name: row[name] for name in names} | {"command": row["command"]}
            for row in read_records(path)
            if row["slider"] == "all"
        ]

    return table


TABLES = {"sliders": table_of(DATA / "sliders.csv")}
