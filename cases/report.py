"""All figures and tables that exist so far, with one page to look at.

Writes DIR/figures/*.png and *.pdf, DIR/data/*.csv (a row a run or a node, with every parameter, the
command that repeats it and the versions) and DIR/index.html. Figures are drawn from the CSV files.
Records of an earlier run are kept if nothing that they depend on has changed: the code that makes them with all that
it imports, versions, the file itself (DIR/data/*.json). So an interrupted report goes on where it stopped.
Items are made by --workers processes, but those whose records are times, and what is judged from the others: these come last
and alone. An item that fails does not stop the others.
"""

import os
import time
from collections import Counter
from dataclasses import asdict, dataclass

from tqdm import tqdm

from cases import (figures_fe, figures_hertz, figures_layers, figures_scenes, figures_strip, figures_studies, limits_table,
                   paper_and_here, report_page)
from cases.options import did_you_mean, option
from cases.report_items import File, Task, together
from microblock import provenance
from microblock.errors import BadArgument, NotConverged
from microblock.study import read_records, versions, write_text

OUT = "out"
# modules with PLATES {name: (records, drawing)} or TABLES {name: records}: what is named here is part of the report
ROOMS = (figures_strip, figures_fe, figures_hertz, figures_layers, figures_scenes, figures_studies, limits_table)
PLATES = {name: plate for room in ROOMS for name, plate in getattr(room, "PLATES", {}).items()}
TABLES = {name: table for room in ROOMS for name, table in getattr(room, "TABLES", {}).items()}
CLOCKED = {name for room in ROOMS for name in getattr(room, "CLOCKED", ())}      # records are times: nothing runs beside them
JUDGED = paper_and_here.TABLES     # made from the records of the others
KNOWN = (*JUDGED, *PLATES, *TABLES)
HALF_PLANE = ("classical", "timing")
# headings of the page and how the names under them begin; tables have one of their own
SECTIONS = {"The paper and here": tuple(JUDGED), "Figures of the paper": ("fig",), "Strip": ("strip_",),
            "Half-plane": HALF_PLANE, "Finite elements": ("coalescence", "facets"),
            "Scenes": tuple(name for name in figures_scenes.PLATES if name not in HALF_PLANE),
            "Methods: speed and accuracy": ("speed_",), "Methods: limits": ("limits_",)}
LONG = ("coalescence", "coating", "fig11", "hole", "wedge", "punch", "fig9", "facets", "scatter", "fig13", "strip_convergence",
        "classical", "fig10", "fig8")     # the longest first: so that no process ends long after the others
COMMANDS = 12     # of an item's runs, at most, on the page
MOST = 8          # processes, if nothing is said
BOUND = 64        # processes that can be asked for


@dataclass(frozen=True)
class Parameters:
    only: tuple = option((), "names to make, all if none is given; DIR/index.html shows them under the headings "
                         f"{'; '.join((*SECTIONS, 'Tables'))}; README.md has most, and a name that is none is answered with all",
                         str, nargs="+", metavar="NAME")
    anew: bool = option(False, "compute all records again", bool)
    workers: int | None = option(None, f"processes, 1 for this one alone; without it one a core, {MOST} at most", int)

    def __post_init__(self):
        for name in self.only:
            if name not in KNOWN:
                raise BadArgument("only", name, f"is no item of the report{did_you_mean(name, KNOWN)}; all: {', '.join(KNOWN)}")
        if self.workers is None:
            object.__setattr__(self, "workers", min(len(os.sched_getaffinity(0)), MOST))
        if not 1 <= self.workers <= BOUND:
            raise BadArgument("workers", self.workers, f"must lie between 1 and {BOUND}")


def run(parameters, out, quiet=False):
    """Make what is asked for; returns paths and seconds of each. The page shows what else of the folder still holds."""
    start, busy = time.perf_counter(), _processor_seconds()
    names = [name for name in KNOWN if name in parameters.only] or KNOWN
    records = Records(out, parameters.anew)
    try:
        with tqdm(total=len(names), disable=quiet, unit="item") as progress:
            _make(names, records, parameters.workers, progress)
    except KeyboardInterrupt:
        raise NotConverged(f"stopped after {len(records.drawn)} of {len(names)} items; "
                           "the same command goes on from there") from None
    finally:
        seconds = time.perf_counter() - start
        made = [name for name in names if name in records.drawn]
        told = (f"{len(made)} of {len(names)} items in {seconds:.0f} s ({_processor_seconds() - busy:.0f} s of processor time) "
                f"by {parameters.workers} process{'es'*(parameters.workers > 1)}, "
                f"{sum(records.told[name]['kept'] for name in made)} from kept records")
        items = shown(made, records)
        write_text(out/"index.html", report_page.page(items, told, versions(), records.failed))
    if records.failed:
        whats = "; ".join(f"{name} ({what})" for name, what in records.failed.items())
        raise NotConverged(f"{len(records.failed)} of {len(names)} items failed, the others are made: {whats}")
    if not quiet:
        print(f"{told}; look at {out/'index.html'}")
    return {"parameters": asdict(parameters), "versions": versions(), "seconds": {"setup": 0.0, "solve": seconds},
            "processor_seconds": _processor_seconds() - busy, "items": [one for one in items if one["name"] in made]}


def _processor_seconds():
    """Of this process and of those that it started and that have ended."""
    return sum(os.times()[:4])


def _make(names, records, workers, progress):
    """Make items, those that may not run beside others, or need them, after the others."""
    def keep(name, outcome):
        records.keep(name, outcome)
        progress.update()

    def tell(under_way):
        progress.set_description(" and ".join(under_way))

    early = sorted((name for name in names if name not in CLOCKED and name not in JUDGED),
                   key=lambda name: LONG.index(name) if name in LONG else len(LONG))
    late = sorted((name for name in names if name not in early), key=lambda name: name in JUDGED)
    if workers > 1 and len(early) > 1:
        together([records.task(name) for name in early], workers, keep, tell)
        early = []
    for name in (*early, *late):
        tell([name])
        try:
            outcome = records.make(name)
        except Exception as failure:      # whatever it is, the others go on
            outcome = failure
        keep(name, outcome)


class Records:
    """Records by the name of their figure or table: made once, kept as long as they hold, and read from their file.

    They hold while the code that makes them and the versions are the same; judgements while those of all others hold.
    `told` is what is known of them, `drawn` the seconds that the figures took (None for tables), `failed` what went wrong.
    """

    def __init__(self, out, anew=False):
        self.anew, self.told, self.drawn, self.failed = anew, {}, {}, {}
        for folder in ("figures", "data"):
            (out/folder).mkdir(exist_ok=True)
        base = {name: provenance.digest(TABLES[name] if name in TABLES else PLATES[name][0], provenance.software())
                for name in (*PLATES, *TABLES)}      # now, and not when the code in the files may be newer than what runs
        judged = {name: provenance.digest(judge, base) for name, judge in JUDGED.items()}
        self.files = {name: File(out, name, depends_on) for name, depends_on in {**base, **judged}.items()}

    def task(self, name):
        """What another process needs to make an item."""
        compute, drawing = PLATES[name] if name in PLATES else (TABLES[name], None)
        return Task(self.files[name], compute, drawing, self.anew)

    def make(self, name):
        """The same in this process: (what is known of the records, seconds of drawing)."""
        self(name)
        return self.told[name], self.files[name].draw(PLATES[name][1]) if name in PLATES else None

    def keep(self, name, outcome):
        """Take in what became of an item."""
        if isinstance(outcome, BaseException):
            self.failed[name] = f"{type(outcome).__name__}: {' '.join(str(outcome).split())}"
        else:
            self.told[name], self.drawn[name] = outcome

    def __call__(self, name):
        """Rows of the named figure or table, as they come back from its file."""
        if name in self.failed:
            raise NotConverged(f"needs {name}, which failed")
        if name not in self.told:
            self.told[name] = (None if self.anew else self.files[name].kept()) or self._made(name)
        return read_records(self.files[name].path)

    def _made(self, name):
        start, others = time.perf_counter(), len(self.told)
        rows = JUDGED[name](self) if name in JUDGED else self.task(name).compute()
        nested = sum(one["seconds"] for one in list(self.told.values())[others:] if not one["kept"])
        return self.files[name].write(rows, time.perf_counter() - start - nested)


def item(name, records):
    """An item as the page shows it."""
    rows = read_records(records.files[name].path)
    made_by = PLATES[name][1] if name in PLATES else TABLES.get(name) or JUDGED[name]
    cells = [{key: cell for key, cell in row.items() if not key.startswith("version_")} for row in rows]
    estimates = [row["error_estimate"] for row in rows if row.get("error_estimate") is not None]
    commands = list(dict.fromkeys(row["command"] for row in rows if row.get("command")))
    verdicts = Counter(row["verdict"] for row in rows) if name in JUDGED and "verdict" in rows[0] else {}
    figures = {kind: f"figures/{name}.{kind}" if name in PLATES else None for kind in ("png", "pdf")}
    known = records.told.get(name) or records.files[name].kept()
    return {"name": name, "section": section(name), "caption": " ".join(made_by.__doc__.split()), "data": f"data/{name}.csv",
            "figure": figures["png"], "pdf": figures["pdf"], "table": None if name in PLATES else cells,
            "verdicts": dict(verdicts), "command": f"python -m cases report --only {name}",
            "commands": commands[:COMMANDS], "error_estimate": max(estimates, default=None), "drawing": records.drawn.get(name),
            "alone": name in CLOCKED, **{key: known[key] for key in ("seconds", "machine", "kept")}}


def section(name):
    """The heading under which the page shows an item."""
    if name in TABLES:
        return "Tables"
    return next((title for title, starts in SECTIONS.items() if name.startswith(starts)), "Others")


def shown(made, records):
    """Items that were made, and those in the folder whose records still hold, in the report's order."""
    def holds(name):
        file = records.files[name]
        return name not in records.failed and file.kept() and (name not in PLATES or file.figure.exists())

    return [item(name, records) for name in KNOWN if name in made or holds(name)]
