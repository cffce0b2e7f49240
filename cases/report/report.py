"""All figures and tables, with one page to look at: findings first.

Writes DIR/figures/*.png and *.pdf, DIR/data/*.csv (a row a run or a node, with every parameter, the
command that repeats it and the versions) and DIR/index.html. Figures are drawn from the CSV files, and are
read at a width of 9 cm.
Records of an earlier run are kept if nothing that they depend on has changed: any Python file of the program,
versions, the file itself (DIR/data/*.json). So an interrupted report goes on where it stopped.
Items are made by --workers processes, but those whose records are times, and what is derived from the
others: these come last and alone. An item that fails does not stop the others.
"""

import inspect
import os
import time
from dataclasses import asdict, dataclass
from functools import partial

from tqdm import tqdm

from microblock.data.provenance import content, digest
from microblock.data.records import read_records, versions, write_text
from microblock.errors import NotConverged

from ..common.catalog import DATA, PROGRAM, case, headlines
from ..common.options import Checked, command, names, option
from ..paper import figures_fe, figures_hertz, figures_layers, figures_strip, statements
from ..studies import limits_table, methods, sliders
from ..studies.methods_text import HEAD
from . import figures_scenes, figures_studies, findings, page
from .items import File, Task, together
from .sections import LABELS, SECTIONS

OUT = "out"
# modules with FIGURES {name: (records, drawing)} or TABLES {name: records}, which are part of the report
MODULES = (
    figures_strip,
    figures_fe,
    figures_hertz,
    figures_layers,
    figures_scenes,
    figures_studies,
    limits_table,
    sliders,
)
FIGURES = {name: figure for module in MODULES for name, figure in getattr(module, "FIGURES", {}).items()}
TABLES = {name: table for module in MODULES for name, table in getattr(module, "TABLES", {}).items()}
# records are times: nothing runs beside them
TIMINGS = {name for module in MODULES for name in getattr(module, "TIMINGS", ())}
DERIVED = statements.TABLES  # made from the records of the others
# cases that write a page of their own beside the report, where they exist
PAGES = tuple(name for name in ("playground",) if name in headlines())
KNOWN = (*DERIVED, *(name for _, names in SECTIONS.values() for name in names), *PAGES)
# the longest first, so that no process ends long after the others
LONG = (
    "fig13",
    "tangential",
    "punch",
    "coalescence",
    "layers_fe",
    "sphere_size",
    "strip_convergence",
    "coating",
    "wedge",
    "fig11",
    "fig10",
    "hole",
    "fig5",
    "fig8",
    "rough3d",
    "two_bodies",
    "wavy",
    "classical",
    "fig9",
)
COMMANDS = 12  # of an item's runs, at most, on the page
MOST = 8  # processes, if nothing is said
BOUND = 64  # processes that can be asked for


@dataclass(frozen=True)
class Parameters(Checked):
    only: tuple = names(
        "names to make, all if none is given; DIR/index.html shows them under the headings "
        f"{'; '.join(SECTIONS)}; an unknown name is answered with all",
        lambda: KNOWN,
    )
    anew: bool = option(False, "compute all records again", bool)
    workers: int | None = option(
        None,
        f"processes, 1 for this one alone; without it one a core, {MOST} at most",
        int,
        at_least=1,
        at_most=BOUND,
    )

    def relate(self):
        if self.workers is None:
            object.__setattr__(self, "workers", min(len(os.sched_getaffinity(0)), MOST))


def run(parameters, out, quiet=False):
    """Make what is asked for; returns paths and seconds of each. The page shows what else of the folder is
    still valid.
    """
    start, busy = time.perf_counter(), _processor_seconds()
    names = [name for name in KNOWN if name in parameters.only] or KNOWN
    records = Records(out, parameters.anew)
    try:
        with tqdm(total=len(names), disable=quiet, unit="item") as progress:
            _make(names, records, parameters.workers, progress)
    except KeyboardInterrupt:
        raise NotConverged(
            f"stopped after {len(records.drawn)} of {len(names)} items; the same command goes on from there"
        ) from None
    finally:
        seconds = time.perf_counter() - start
        made = [name for name in names if name in records.drawn]
        summary = (
            f"{len(made)} of {len(names)} items in {seconds:.0f} s "
            f"({_processor_seconds() - busy:.0f} s of processor time) "
            f"by {parameters.workers} process{'es' * (parameters.workers > 1)}, "
            f"{sum(records.known[name]['kept'] for name in made)} from kept records"
        )
        items = shown(made, records)
        found = findings.found({one["name"] for one in items}, records)
        introductions = {title: words for title, (words, _) in SECTIONS.items()}
        text = page.page(items, found, introductions, summary, versions(), records.failed, _beside(out))
        write_text(out / "index.html", text)
    if records.failed:
        failures = "; ".join(f"{name} ({what})" for name, what in records.failed.items())
        raise NotConverged(
            f"{len(records.failed)} of {len(names)} items failed, the others are made: {failures}"
        )
    if not quiet:
        print(f"{summary}; look at {out / 'index.html'}")
    return {
        "parameters": asdict(parameters),
        "versions": versions(),
        "seconds": {"setup": 0.0, "solve": seconds},
        "processor_seconds": _processor_seconds() - busy,
        "items": [one for one in items if one["name"] in made],
    }


def _beside(out):
    """Put the advice on methods beside the page; {its name: its address}."""
    records, sections = methods.kept(), {}
    for number, heading, claim in methods.numbered():
        sections.setdefault(heading, []).append(f"{claim.told(records)} [{number}]")
    write_text(out / "methods.html", page.advice(HEAD, sections, methods.facts(records)))
    return {"docs/methods.md": "methods.html"}


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

    early = sorted(
        (name for name in names if name not in TIMINGS and name not in DERIVED),
        key=lambda name: LONG.index(name) if name in LONG else len(LONG),
    )
    late = sorted((name for name in names if name not in early), key=lambda name: name in DERIVED)
    if workers > 1 and len(early) > 1:
        together([records.task(name) for name in early], workers, keep, tell)
        early = []
    for name in (*early, *late):
        tell([name])
        try:
            outcome = records.make(name)
        except Exception as failure:  # whatever it is, the others go on
            outcome = failure
        keep(name, outcome)


class Records:
    """Records by the name of their figure or table: made once, kept as long as they are valid, and read from
    their file.

    They are valid while all code and the versions are the same; derived tables while all others are valid.
    `known` is what is known of them, `drawn` the seconds that the figures took (None for tables), `failed`
    what went wrong.
    """

    def __init__(self, out, anew=False):
        self.anew, self.known, self.drawn, self.failed = anew, {}, {}, {}
        for folder in ("figures", "data"):
            (out / folder).mkdir(exist_ok=True)
        read = {}
        base = {
            name: digest(TABLES[name] if name in TABLES else FIGURES[name][0], read=read)
            for name in (*FIGURES, *TABLES)
        }
        derived = {name: digest(table, base, read=read) for name, table in DERIVED.items()}
        pages = {name: digest(name, content(DATA / f"{name}.json"), read=read) for name in PAGES}
        self.files = {
            name: File(out, name, depends_on, name in PAGES)
            for name, depends_on in {**base, **derived, **pages}.items()
        }

    def task(self, name):
        """What another process needs to make an item."""
        file = self.files[name]
        if file.page:
            return Task(file, partial(written, name, file.out), None, self.anew)
        compute, drawing = FIGURES[name] if name in FIGURES else (TABLES[name], None)
        return Task(file, compute, drawing, self.anew)

    def make(self, name):
        """The same in this process: (what is known of the records, seconds of drawing)."""
        self(name)
        return self.known[name], self.files[name].draw(FIGURES[name][1]) if name in FIGURES else None

    def keep(self, name, outcome):
        """Take in what became of an item."""
        if isinstance(outcome, BaseException):
            self.failed[name] = f"{type(outcome).__name__}: {' '.join(str(outcome).split())}"
        else:
            self.known[name], self.drawn[name] = outcome

    def __call__(self, name):
        """Rows of the named figure or table, as they come back from its file."""
        if name in self.failed:
            raise NotConverged(f"needs {name}, which failed")
        if name not in self.known:
            self.known[name] = (None if self.anew else self.files[name].kept()) or self._made(name)
        return read_records(self.files[name].path)

    def _made(self, name):
        start, others = time.perf_counter(), len(self.known)
        rows = DERIVED[name](self) if name in DERIVED else self.task(name).compute()
        nested = sum(one["seconds"] for one in list(self.known.values())[others:] if not one["kept"])
        return self.files[name].write(rows, time.perf_counter() - start - nested)


def written(name, out):
    """Rows of a page that a case makes from what it keeps: the command that computes it anew."""
    module = case(name)
    write_text(out / f"{name}.html", module.kept_page())
    return [{"command": command(name, module.Parameters()), "page": f"{name}.html"}]


def item(name, records):
    """An item as the page shows it."""
    rows = read_records(records.files[name].path)
    cells = [{key: cell for key, cell in row.items() if not key.startswith("version_")} for row in rows]
    estimates = [row["error_estimate"] for row in rows if row.get("error_estimate") is not None]
    commands = list(dict.fromkeys(row["command"] for row in rows if row.get("command")))
    figures = {kind: f"figures/{name}.{kind}" if name in FIGURES else None for kind in ("png", "pdf")}
    known = records.known.get(name) or records.files[name].kept()
    return {
        "name": name,
        "label": label(name),
        "section": section(name),
        **told(name),
        "data": f"data/{name}.csv",
        "figure": figures["png"],
        "size": page.size(records.files[name].figure) if name in FIGURES else None,
        "pdf": figures["pdf"],
        "table": None if name in FIGURES or name in PAGES else cells,
        "page": f"{name}.html" if name in PAGES else None,
        "command": f"{PROGRAM} report --only {name}",
        "commands": commands[:COMMANDS],
        "error_estimate": max(estimates, default=None),
        "drawing": records.drawn.get(name),
        "alone": name in TIMINGS,
        **{key: known[key] for key in ("seconds", "machine", "kept")},
    }


def told(name):
    """{"message", "caption", "alt"} of an item: the first paragraph of the docstring of what makes it, those
    that follow, and the one that begins with "Seen:" and says what a figure shows.
    """
    if name in PAGES:
        return {"message": headlines()[name][1], "caption": "", "alt": ""}
    made_by = FIGURES[name][1] if name in FIGURES else TABLES.get(name) or DERIVED[name]
    parts = [" ".join(part.split()) for part in inspect.cleandoc(made_by.__doc__).split("\n\n")]
    message, *others = parts
    seen = [part.removeprefix("Seen: ") for part in others if part.startswith("Seen: ")]
    reading = [part for part in others if not part.startswith("Seen: ")]
    alt = " ".join(seen) or message
    return {"message": message, "caption": " ".join(reading), "alt": alt[:1].upper() + alt[1:]}


def label(name):
    """What an item is called in the contents."""
    if name.startswith("fig"):
        return f"Figure {name[3:]}"
    words = LABELS.get(name, name.replace("_", " "))
    return words[:1].upper() + words[1:]


def section(name):
    """The heading under which the page shows an item; none for what stands above all headings."""
    return next((title for title, (_, names) in SECTIONS.items() if name in names), None)


def shown(made, records):
    """Items that were made, and those in the folder whose records are still valid, in the report's order."""

    def valid(name):
        file = records.files[name]
        return name not in records.failed and file.kept() and (name not in FIGURES or file.figure.exists())

    return [item(name, records) for name in KNOWN if name in made or valid(name)]
