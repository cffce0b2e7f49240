"""Where methods fail: what becomes of thousands of seeded runs, a fifth of them near a degeneracy.

Geometry   the strip, cylinders, wedges and punches on a half-plane or a square, user meshes, and contact
           problems drawn at random; see each map's question.
Equations  those of `strip`, `hertz` and, with friction, `tangential`.
Model      every method of the toolkit, one map each question: samples of Latin hypercubes of strength two, so
           that each pair of parameters is covered, and then as many again as make a fifth next to the
           degenerate ends of the axes.
Reference  a closed form, another method, or another kind of discretisation, as each map says.
Look at    what became of the runs. "delivered": the true error is below what was promised, or nothing was
           promised and the error is drawn; "other method": the same, by a method that the result names;
           "typed error": an error that says what to try; "missed": an answer beyond its promise; "not
           finite", "time limit", "untyped error", "crash": defects.
Units      each run has --limit seconds of wall time, in one of --workers processes of one thread.
"""

import time
from collections import Counter
from dataclasses import dataclass

from tqdm import tqdm

from microblock.data.records import grouped

from ..common.options import Checked, command, names, option
from ..common.records import kept, returned
from . import limits_friction, limits_line, limits_meshes, limits_newton, limits_pool, limits_states
from .limits_maps import KINDS

MAPS = {
    one.name: one
    for module in (limits_line, limits_states, limits_meshes, limits_newton, limits_friction)
    for one in module.MAPS
}
QUICK = 2  # runs of a panel, one of them near a degeneracy


@dataclass(frozen=True)
class Parameters(Checked):
    only: tuple = names(f"maps to make, of {', '.join(MAPS)}", MAPS)
    runs: int = option(3156, "of all maps together", int, at_least=1, at_most=10**6)
    seed: int = option(1, "of the random numbers", int, at_least=0, at_most=2**63)
    limit: float = option(60.0, "seconds of a run, beyond which it is stopped", at_least=0.1, at_most=1e5)
    workers: int = option(2, "processes", int, at_least=1, at_most=1024)
    quick: bool = option(False, f"{QUICK} runs of each panel", bool)

    @property
    def maps(self):
        return [MAPS[name] for name in self.only or MAPS]

    def runs_of(self, one):
        """Runs of a map: its share of those of all maps."""
        panels = len(one.panels[1])
        if self.quick:
            return QUICK * panels
        return max(QUICK * panels, self.runs * one.share / sum(each.share for each in MAPS.values()))


def result(parameters, quiet=True):
    """The case's object: a row a run, and how often each kind came, by map."""
    work = [
        (one, *drawn)
        for one in parameters.maps
        for drawn in one.settings(parameters.runs_of(one), parameters.seed)
    ]
    start = time.perf_counter()
    with tqdm(total=len(work), disable=quiet, unit="run") as progress:
        answers = limits_pool.records(
            [(one.run, setting) for one, setting, _ in work],
            parameters.workers,
            parameters.limit,
            progress.update,
        )
    names = dict.fromkeys(name for _, setting, _ in work for name in setting)
    rows = [
        {"map": one.name, **{name: setting.get(name) for name in names}, "near": near, **answer}
        for (one, setting, near), answer in zip(work, answers)
    ]
    counts = [
        {"map": name, **{kind: Counter(row["kind"] for row in mine)[kind] for kind in KINDS}}
        for name, mine in grouped(rows, "map").items()
    ]
    return returned(parameters, start, counts=counts, runs=rows)


def run(parameters, out=None, quiet=False):
    """Run, print a table, write the records into the folder `out` and draw charts whose maps are there."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        from microblock.view import plots

        from . import limits_figures  # when something is drawn

        records = kept(
            out / "limits.csv", [{**row, "command": command("limits", parameters)} for row in answer["runs"]]
        )
        there = {row["map"] for row in records}
        for name, (maps, drawing) in limits_figures.DRAWINGS.items():
            if there.issuperset(maps):
                plots.draw(drawing, records, out, f"limits_{name}")
    return answer


def show(answer):
    """A line a map."""
    width = max(len(name) for name in MAPS)
    print(f"{'map':>{width}}  " + "  ".join(KINDS))
    for row in answer["counts"]:
        print(f"{row['map']:>{width}}  " + "  ".join(f"{row[kind]:>{len(kind)}}" for kind in KINDS))
