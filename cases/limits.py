"""Where methods fail: what becomes of thousands of seeded runs, a fifth of them near a degeneracy.

Geometry   the strip, cylinders, wedges and punches on a half-plane or a square, user meshes, and contact problems drawn at
           random; see each map's question.
Equations  those of `strip` and `hertz`.
Model      every method of the toolkit, one map each question: samples of Latin hypercubes of strength two, so that each pair
           of parameters is covered, and then as many again as make a fifth next to the degenerate ends of the axes.
Reference  a closed form, another method, or another kind of discretisation, as each map says.
Look at    what became of the runs. "delivered": the true error is below what was promised, or nothing was promised and the
           error is drawn; "other method": the same, by a method that the result names; "typed error": refused, with a word on
           what to try; "missed": an answer beyond its promise; "not finite", "time limit", "untyped error", "crash": defects.
Units      each run has --limit seconds of wall time, in one of --workers processes of one thread.
"""

import time
from collections import Counter
from dataclasses import dataclass

from tqdm import tqdm

from cases import limits_figures, limits_line, limits_meshes, limits_newton, limits_pool, limits_states
from cases.limits_maps import KINDS
from cases.options import command, option
from cases.records import kept, returned
from microblock import plots
from microblock.errors import BadArgument
from microblock.study import grouped

MAPS = {one.name: one for room in (limits_line, limits_states, limits_meshes, limits_newton) for one in room.MAPS}
QUICK = 2        # runs of a panel, one of them near a degeneracy


@dataclass(frozen=True)
class Parameters:
    only: tuple = option((), f"maps to make, of {', '.join(MAPS)}", str, nargs="+", metavar="MAP")
    runs: int = option(5000, "of all maps together", int)
    seed: int = option(1, "of the random numbers", int)
    limit: float = option(60.0, "seconds of a run, beyond which it is stopped")
    workers: int = option(2, "processes", int)
    quick: bool = option(False, f"{QUICK} runs of each panel", bool)

    def __post_init__(self):
        for name in self.only:
            if name not in MAPS:
                raise BadArgument("only", name, f"must be one of {', '.join(MAPS)}")
        for name, least, most in (("runs", 1, 10**6), ("seed", 0, 2**63), ("limit", 0.1, 1e5), ("workers", 1, 1024)):
            if not least <= getattr(self, name) <= most:
                raise BadArgument(name, getattr(self, name), f"must lie between {least:g} and {most:g}")

    @property
    def maps(self):
        return [MAPS[name] for name in self.only or MAPS]

    def runs_of(self, one):
        """Runs of a map: its share of those of all maps."""
        panels = len(one.panels[1])
        return QUICK*panels if self.quick else max(QUICK*panels, self.runs*one.share/sum(each.share for each in MAPS.values()))


def result(parameters, quiet=True):
    """The case's object: a row a run, and how often each kind came, by map."""
    work = [(one, *drawn) for one in parameters.maps for drawn in one.settings(parameters.runs_of(one), parameters.seed)]
    start = time.perf_counter()
    with tqdm(total=len(work), disable=quiet, unit="run") as progress:
        answers = limits_pool.records([(one.run, setting) for one, setting, _ in work], parameters.workers, parameters.limit,
                                      progress.update)
    names = dict.fromkeys(name for _, setting, _ in work for name in setting)
    rows = [{"map": one.name, **{name: setting.get(name) for name in names}, "near": near, **answer}
            for (one, setting, near), answer in zip(work, answers)]
    counts = [{"map": name, **{kind: Counter(row["kind"] for row in mine)[kind] for kind in KINDS}}
              for name, mine in grouped(rows, "map").items()]
    return returned(parameters, start, counts=counts, runs=rows)


def run(parameters, out=None, quiet=False):
    """Run, print a table, write and draw the records into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        records = kept(out/"limits.csv", [{**row, "command": command("limits", parameters)} for row in answer["runs"]])
        for name, mine in grouped(records, "map").items():
            plots.draw(lambda rows, drawn=MAPS[name]: limits_figures.chart(drawn, rows), mine, out, f"limits_{name}")
    return answer


def show(answer):
    """A line a map."""
    width = max(len(name) for name in MAPS)
    print(f"{'map':>{width}}  " + "  ".join(KINDS))
    for row in answer["counts"]:
        print(f"{row['map']:>{width}}  " + "  ".join(f"{row[kind]:>{len(kind)}}" for kind in KINDS))
