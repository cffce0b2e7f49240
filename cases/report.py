"""All figures and tables that exist so far, with one page to look at.

Writes DIR/figures/*.png and *.pdf, DIR/data/*.csv (a row a run or a node, with every parameter, the
command that repeats it and the versions) and DIR/index.html. Figures are drawn from the CSV files.
Records of an earlier run are kept if nothing that they depend on has changed: the code that makes them with all that
it imports, versions, the file itself (DIR/data/*.json). So an interrupted report goes on where it stopped.
"""

import hashlib
import json
import time
from dataclasses import asdict, dataclass

from tqdm import tqdm

from cases import figures_fe, figures_hertz, figures_layers, figures_strip, figures_studies, limits_table, paper_and_here, report_page
from cases.options import option
from microblock import plots, provenance
from microblock.errors import BadArgument, NotConverged
from microblock.study import read_records, versions, write_json, write_records, write_text

OUT = "out"
# modules with PLATES {name: (records, drawing)} or TABLES {name: records}: what is named here is part of the report
ROOMS = (figures_strip, figures_fe, figures_hertz, figures_layers, figures_studies, limits_table)
PLATES = {name: plate for room in ROOMS for name, plate in getattr(room, "PLATES", {}).items()}
TABLES = {name: table for room in ROOMS for name, table in getattr(room, "TABLES", {}).items()}
JUDGED = paper_and_here.TABLES     # made from the records of the others
KNOWN = (*PLATES, *TABLES, *JUDGED)
COMMANDS = 12     # of an item's runs, at most, on the page


@dataclass(frozen=True)
class Parameters:
    only: tuple = option((), f"names to make, of {', '.join(KNOWN)}", str, nargs="+", metavar="NAME")
    anew: bool = option(False, "compute all records again", bool)

    def __post_init__(self):
        for name in self.only:
            if name not in KNOWN:
                raise BadArgument("only", name, f"must be one of {', '.join(KNOWN)}")


def run(parameters, out, quiet=False):
    """Make what is asked for; returns paths and seconds of each. The page shows what else of the folder still holds."""
    start, busy = time.perf_counter(), time.process_time()
    for folder in ("figures", "data"):
        (out/folder).mkdir(exist_ok=True)
    names = list(parameters.only) or KNOWN
    made, records = {}, Records(out/"data", parameters.anew)
    try:
        with tqdm(names, disable=quiet, unit="item") as progress:
            for name in progress:
                progress.set_description(name)
                made[name] = make(name, records, out)
    except KeyboardInterrupt:
        raise NotConverged(f"stopped after {len(made)} of {len(names)} items; the same command goes on from there") from None
    finally:
        seconds = time.perf_counter() - start
        told = (f"{len(made)} of {len(names)} items in {seconds:.0f} s ({time.process_time() - busy:.0f} s of processor time), "
                f"{sum(one['kept'] for one in made.values())} from kept records")
        write_text(out/"index.html", report_page.page(shown(made, records, out), told, versions()))
    if not quiet:
        print(f"{told}; look at {out/'index.html'}")
    return {"parameters": asdict(parameters), "versions": versions(),
            "seconds": {"setup": 0.0, "solve": seconds}, "items": list(made.values())}


class Records:
    """Records by the name of their figure or table: made once, kept as long as they hold, and read from their file.

    They hold while the code that makes them and the versions are the same; judgements while those of all others hold.
    """

    def __init__(self, folder, anew=False):
        self.folder, self.anew, self.told = folder, anew, {}
        base = {name: provenance.digest(TABLES[name] if name in TABLES else PLATES[name][0], provenance.software())
                for name in (*PLATES, *TABLES)}      # now, and not when the code in the files may be newer than what runs
        self.depends_on = {**base, **{name: provenance.digest(judged, base) for name, judged in JUDGED.items()}}

    def path(self, name):
        return self.folder/f"{name}.csv"

    def __call__(self, name):
        """Rows of the named figure or table, as they come back from its file."""
        if name not in self.told:
            self.told[name] = (None if self.anew else self.kept(name)) or self._made(name)
        return read_records(self.path(name))

    def kept(self, name):
        """What is known of records from an earlier run {seconds, machine, kept}; None if they do not hold."""
        try:
            told = json.loads((self.folder/f"{name}.json").read_text())
            holds = told["depends_on"] == self.depends_on[name] and told["content"] == self._content(name)
        except (OSError, ValueError, KeyError):      # none, torn, or not ours
            return None
        return {**told, "kept": True} if holds else None

    def _made(self, name):
        start, others = time.perf_counter(), len(self.told)
        make = (lambda: JUDGED[name](self)) if name in JUDGED else TABLES[name] if name in TABLES else PLATES[name][0]
        write_records(self.path(name), make())
        nested = sum(one["seconds"] for one in list(self.told.values())[others:] if not one["kept"])
        seconds = time.perf_counter() - start - nested
        told = {"depends_on": self.depends_on[name], "content": self._content(name), "seconds": seconds,
                "machine": versions()["machine"]}
        write_json(self.folder/f"{name}.json", told)
        return {**told, "kept": False}

    def _content(self, name):
        return hashlib.sha256(self.path(name).read_bytes()).hexdigest()


def make(name, records, out):
    """Compute the records of an item where none hold, and draw or show what was written."""
    rows, draw = records(name), PLATES[name][1] if name in PLATES else None
    if draw:
        plots.draw(draw, rows, out/"figures", name)
    return item(name, records, rows)


def item(name, records, rows):
    """An item as the page shows it."""
    made_by = PLATES[name][1] if name in PLATES else TABLES.get(name) or JUDGED[name]
    cells = [{key: cell for key, cell in row.items() if not key.startswith("version_")} for row in rows]
    estimates = [row["error_estimate"] for row in rows if row.get("error_estimate") is not None]
    commands = list(dict.fromkeys(row["command"] for row in rows if row.get("command")))
    figures = {kind: f"figures/{name}.{kind}" if name in PLATES else None for kind in ("png", "pdf")}
    known = records.told.get(name) or records.kept(name)
    return {"name": name, "caption": " ".join(made_by.__doc__.split()), "data": f"data/{name}.csv", "figure": figures["png"],
            "pdf": figures["pdf"], "table": None if name in PLATES else cells, "command": f"python -m cases report --only {name}",
            "commands": commands[:COMMANDS], "error_estimate": max(estimates, default=None),
            **{key: known[key] for key in ("seconds", "machine", "kept")}}


def shown(made, records, out):
    """Items that were made, and those in the folder whose records still hold, in the report's order."""
    others = [name for name in KNOWN if name not in made and records.kept(name)
              and (name not in PLATES or (out/"figures"/f"{name}.png").exists())]
    return [made[name] if name in made else item(name, records, read_records(records.path(name)))
            for name in KNOWN if name in made or name in others]
