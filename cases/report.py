"""All figures on one page: the paper's, those beyond it, and what the methods cost.

Runs the scripts of `cases` and `cases/paper`, two at a time, each in a process of its own, and writes
DIR/index.html with DIR/figures/*.png; DIR is "out" without --out. The page needs no network. Its findings are
computed in the same run. A script that fails does not stop the others: the page says so, and the exit status
is 1.
"""

import html
import os
import re
import shutil
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from string import Template

import matplotlib

from microblock.data.records import versions, write_text
from microblock.errors import NotConverged, require_choice
from microblock.view.plots import STYLE

HERE = Path(__file__).parent
GROUPS = {"The paper": "cases.paper", "Methods": "cases.benchmarks", "Beyond the paper": "cases"}
PAPER = "strip", "hertz", "size_effect", "layers"  # problems of the paper, whose scripts are with the others


def modules():
    """Returns {name: dotted module} of all that is drawn, in the order of the page."""
    found = {}
    for package in GROUPS.values():
        for path in sorted(HERE.parent.joinpath(*package.split(".")).glob("*.py")):
            # studies take hours: their figures are of their records, which are the default value
            needed = r"\ndef figure\(\w+=" if package == GROUPS["Methods"] else r"\ndef figure\("
            if re.search(needed, path.read_text()):
                found[path.stem] = f"{package}.{path.stem}"
    return found


def solve(only: tuple[str, ...] | None = None, out: str | None = None):
    """Runs the scripts and writes the page; returns a record of each, with its seconds.

    Parameters
    ----------
    only : names of the scripts to run; all if none is given
    """
    known = modules()
    for name in only or ():
        require_choice(known, only=name)
    chosen = {name: known[name] for name in known if name in ("findings", *(only or known))}
    return {"items": make(chosen, Path(out or "out"))}


def make(chosen, folder):
    """Draws modules {name: dotted module} and writes the page; returns a record of each.

    Raises
    ------
    NotConverged
        If one of them failed. The page is written all the same, with the others.
    """
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    items = {
        name: {"name": name, "package": GROUPS["The paper"] if name in PAPER else module.rpartition(".")[0]}
        for name, module in chosen.items()
    }
    with ThreadPoolExecutor(2) as pool:
        waiting = {pool.submit(alone, *entry, folder): entry[0] for entry in chosen.items()}
        for done in as_completed(waiting):
            item, failure = items[waiting[done]], done.exception()
            item |= {"failed": f"{type(failure).__name__}: {failure}"} if failure else done.result()
            print(f"{item['name']}: {item.get('failed', 'done')}", file=sys.stderr)
    shutil.copytree(HERE / "playground", folder / "playground", dirs_exist_ok=True)
    write_text(folder / "index.html", page(items, folder, time.perf_counter() - start))
    failed = [f"{name} ({item['failed']})" for name, item in items.items() if "failed" in item]
    if failed:
        raise NotConverged(f"{len(failed)} of {len(items)} scripts failed: {'; '.join(failed)}")
    return list(items.values())


def table(result):
    """What is printed: titles without marks, and seconds."""
    rows = [
        {
            "name": item["name"],
            "title": re.sub(r":\w+:`|[`$\\]", "", item["title"]),
            "seconds": round(item["seconds"], 1),
        }
        for item in result["items"]
    ]
    return {"scripts": rows}


def alone(name, module, folder):
    """Draws a module in a process of its own: if that crashes, the others go on."""
    context = get_context("forkserver")
    context.set_forkserver_preload(["cases.report", "ngsolve"])
    with ProcessPoolExecutor(1, mp_context=context) as process:
        return process.submit(drawn, name, module, folder).result()


def drawn(name, module, folder):
    """Draws a module on a transparent ground; returns title, message, {figure: (width, height)}, seconds."""
    start, script = time.perf_counter(), import_module(module)
    with matplotlib.rc_context({**STYLE, "backend": "Agg", "savefig.transparent": True}):
        result = [] if module.startswith(GROUPS["Methods"]) else [script.solve()]
        figures = script.figure(*result)
        figures = figures if isinstance(figures, dict) else {name: figures}
        for file, drawing in figures.items():
            drawing.savefig(folder / "figures" / f"{file}.png")
    title, *others = re.sub(r"\n=+\n", "\n\n", script.__doc__.strip()).split("\n\n")
    return {
        "title": title,
        "message": " ".join(next((part for part in others[:1] if part[0] != ":"), title).split()),
        "figures": {file: (drawing.get_size_inches() * 100).tolist() for file, drawing in figures.items()},
        "sentences": result[0]["sentences"] if name == "findings" else [],
        "seconds": time.perf_counter() - start,
    }


# %%
# The page


def text(words):
    """Returns words of RST or Markdown as HTML: short formulas in italics, with Greek letters and indices."""
    words = re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", html.escape(words))  # links
    words = re.sub(r":math:`([^`]+)`|\$([^$]+)\$", r"<i>\1\2</i>", words.replace(r"\sqrt", r"\radic"))
    words = re.sub(r"_\{?(?:\\mathrm\{)?(\w+)\}*", r"<sub>\1</sub>", words)
    return re.sub(r"\\([a-z]+)", r"&\1;", re.sub(r"`+([^`]+)`+", r"<code>\1</code>", words))


def differences():
    """Returns the rows of docs/differences.md, where our results differ from the paper, as HTML."""
    rows = re.findall(r"^\| (.+) \|$", (HERE.parent / "docs" / "differences.md").read_text(), re.M)
    return "".join(f"<tr><td>{'<td>'.join(map(text, row.split(' | ')))}" for row in rows[1:])


def card(item):
    """Returns a script on the page: its message as headline, its figures, and the command that repeats it."""
    repeat = f"<code>python -m cases report --only {item['name']}</code>"
    if "failed" in item:
        return f'<p class="failed">{item["name"]} failed: {html.escape(item["failed"])}<br>{repeat}</p>'
    return (
        f'<figure id="{item["name"]}"><h3>{text(item["message"])}</h3>{pictures(item)}<figcaption>'
        f"{text(item['title'])} ({item['seconds']:.1f} s): {repeat}</figcaption></figure>"
    )


def pictures(item):
    """Returns the images of a script."""
    alt = re.sub("<.*?>", "", text(f"{item['title']}. {item['message']}"))
    image = '<img src="figures/{}.png" width="{:.0f}" height="{:.0f}" alt="{}">'
    return "".join(image.format(file, *size, alt) for file, size in item["figures"].items())


def page(items, folder, seconds):
    """Returns the page of the records of all scripts."""
    first, chart = items["findings"], items.get("chart", {})
    if "figures" not in chart:  # the chart of the last measurement stands in for it
        shutil.copy(HERE.parent / "docs" / "figures" / "speed.png", folder / "figures" / "chart.png")
        chart = {"figures": {"chart": (700, 500)}, "title": "Speed", "message": "Time over true error."}
    shown = [item for name, item in items.items() if name not in ("findings", "chart")]
    sections = []
    for heading, group in GROUPS.items():
        ours = [card(item) for item in shown if item["package"] == group]
        sections += [f'<h2>{heading}</h2><div class="cards">{"".join(ours)}</div>'] if ours else []
    return Template((HERE / "report.html").read_text()).substitute(
        first=pictures(first) if "figures" in first else card(first),
        chart=pictures(chart),
        findings="".join(f"<li>{text(sentence)}" for sentence in first.get("sentences", ())),
        differences=differences(),
        link=html.escape(os.path.relpath(HERE.parent / "docs" / "differences.md", folder)),
        sections="".join(sections),
        seconds=f"{seconds:.0f}",
        count=len(items),
        versions=html.escape(", ".join(f"{name} {version}" for name, version in versions().items())),
    )
