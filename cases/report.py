"""All figures and tables that exist so far, with one page to look at.

Writes DIR/figures/*.png and *.pdf, DIR/data/*.csv (a row a run or a node, with every parameter, the
command that repeats it and the versions) and DIR/index.html. Figures are drawn from the CSV files.
"""

import html
import time
from dataclasses import asdict, dataclass

from tqdm import tqdm

from cases import figures_fe, figures_hertz, figures_layers, figures_strip, limits_table, paper_and_here
from cases.options import option
from microblock import plots
from microblock.errors import BadArgument
from microblock.study import read_records, versions, write_records, write_text

OUT = "out"
PLATES = {**figures_strip.PLATES, **figures_fe.PLATES, **figures_hertz.PLATES, **figures_layers.PLATES}
TABLES = {**figures_strip.TABLES, **figures_layers.TABLES, **limits_table.TABLES}
JUDGED = paper_and_here.TABLES     # made from the records of the others
KNOWN = (*PLATES, *TABLES, *JUDGED)
SHOWN = 4     # significant digits of a table on the page; the CSV has them all


@dataclass(frozen=True)
class Parameters:
    only: tuple = option((), f"names to make, of {', '.join(KNOWN)}", str, nargs="+", metavar="NAME")

    def __post_init__(self):
        for name in self.only:
            if name not in KNOWN:
                raise BadArgument("only", name, f"must be one of {', '.join(KNOWN)}")


def run(parameters, out, quiet=False):
    """Make what is asked for; returns paths and seconds of each."""
    start = time.perf_counter()
    for folder in ("figures", "data"):
        (out/folder).mkdir(exist_ok=True)
    names = list(parameters.only) or KNOWN
    made, records = [], Records(out/"data")
    progress = tqdm(names, disable=quiet, unit="item")
    for name in progress:
        progress.set_description(name)
        made.append(make(name, records, out))
    write_text(out/"index.html", page(made))
    if not quiet:
        print(f"{len(made)} items under {out}/; look at {out/'index.html'}")
    return {"parameters": asdict(parameters), "versions": versions(),
            "seconds": {"setup": 0.0, "solve": time.perf_counter() - start}, "items": made}


class Records:
    """Records by the name of their figure or table: computed and written once in a run, then read."""

    def __init__(self, folder):
        self.folder, self.written = folder, set()

    def path(self, name):
        return self.folder/f"{name}.csv"

    def __call__(self, name):
        """Rows of the named figure or table, as they come back from its file."""
        if name not in self.written:
            write_records(self.path(name), self._made(name))
            self.written.add(name)
        return read_records(self.path(name))

    def _made(self, name):
        if name in JUDGED:
            return JUDGED[name](self)
        return TABLES[name]() if name in TABLES else PLATES[name][0]()


def make(name, records, out):
    """Compute the records of an item, write them, and draw or show what was written."""
    start = time.perf_counter()
    rows, draw = records(name), PLATES[name][1] if name in PLATES else None
    made_by = draw or TABLES.get(name) or JUDGED[name]
    figure = str(plots.draw(draw, rows, out/"figures", name)[0].relative_to(out)) if draw else None
    table = None if draw else [{key: cell for key, cell in row.items() if not key.startswith("version_")} for row in rows]
    return {"name": name, "caption": " ".join(made_by.__doc__.split()), "data": str(records.path(name).relative_to(out)),
            "figure": figure, "table": table, "seconds": time.perf_counter() - start}


def page(made):
    """The page that shows all items, with the commands that make them."""
    items = "\n".join(_item(one) for one in made)
    told = ", ".join(f"{name} {version}" for name, version in versions().items())
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>microblock: report</title>
<style>
body {{ font-family: sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }}
img {{ max-width: 100%; }} code {{ background: #f3f3f3; }}
table {{ border-collapse: collapse; font-size: 85%; }} td, th {{ padding: 0.2em 0.7em; text-align: left; }}
tr:nth-child(even) {{ background: #f5f5f5; }} figure {{ margin: 2em 0; }}
</style></head><body>
<h1>microblock: report</h1>
<p>{html.escape(told)}</p>
{items}
</body></html>
"""


def _item(one):
    content = f'<img src="{one["figure"]}" alt="{one["name"]}">' if one["figure"] else _table(one["table"])
    return (f'<figure id="{one["name"]}">{content}<figcaption><b>{one["name"]}.</b> {html.escape(one["caption"])}<br>'
            f'<code>python -m cases report --only {one["name"]}</code>, {one["seconds"]:.1f} s, '
            f'<a href="{one["data"]}">records</a></figcaption></figure>')


def _table(rows):
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{html.escape(_shown(cell))}</td>" for cell in row.values()) + "</tr>"
                   for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _shown(cell):
    if cell is None:
        return ""
    return f"{cell:.{SHOWN}g}" if isinstance(cell, float) else str(cell)
