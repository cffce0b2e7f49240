"""The notebooks of docs/tutorials, executed in fresh kernels: pages with all outputs, and times.

Look at    DIR/NAME.html, a page a notebook, which opens without a kernel (its sliders do not move there).
Model      nbclient and a kernel that finds this checkout first; extra `notebook`.
Reference  none: an error in a cell stops the case, and says which cell.
Units      seconds elapsed, of the kernel's start, of each cell and of all.
"""

import os
import time
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from microblock.data.records import write_text
from microblock.errors import MissingExtra, NotConverged

from ..common.options import Checked, command, names
from ..common.records import kept, print_table, returned

ROOT = Path(__file__).parents[2]
NOTEBOOKS = {path.stem: path for path in sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))}
PATIENCE = 300  # seconds for a cell


@dataclass(frozen=True)
class Parameters(Checked):
    only: tuple = names(f"of {', '.join(NOTEBOOKS)}", NOTEBOOKS)


def execute(path):
    """(notebook with its outputs, seconds of the kernel's start, seconds of each code cell).

    Raises
    ------
    NotConverged
        With the cell that failed, and why.
    """
    nbclient, nbformat = _packages("nbclient", "nbformat")
    book, environment = nbformat.read(path, as_version=4), {**os.environ}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    client, seconds, start = (
        nbclient.NotebookClient(book, timeout=PATIENCE, kernel_name="python3"),
        [],
        time.perf_counter(),
    )
    with client.setup_kernel(env=environment):
        ready = time.perf_counter()
        for number, cell in enumerate(book.cells):
            if cell.cell_type != "code":
                continue
            began = time.perf_counter()
            try:
                client.execute_cell(cell, number)
            except nbclient.exceptions.CellExecutionError as failure:
                raise NotConverged(
                    f"cell {number} of {path.name} failed: {failure.ename}: {failure.evalue}"
                ) from failure
            seconds.append(time.perf_counter() - began)
    return book, ready - start, seconds


def page(book):
    """HTML of a notebook with its outputs."""
    (nbconvert,) = _packages("nbconvert")
    return nbconvert.HTMLExporter(template_name="lab").from_notebook_node(book)[0]


def _packages(*names):
    try:
        return [__import__(name) for name in names]
    except ImportError as failure:
        raise MissingExtra("the case notebooks", failure.name, "notebook") from failure


def result(parameters, out=None, quiet=True):
    """The case's object: a row for each notebook."""
    if not NOTEBOOKS:
        raise NotConverged("the notebooks are not here: they are in docs/tutorials of a checkout")
    start, rows = time.perf_counter(), []
    for name in tqdm(parameters.only or NOTEBOOKS, disable=quiet, unit="notebook"):
        book, kernel, cells = execute(NOTEBOOKS[name])
        rows.append(
            {
                "notebook": name,
                "cells": len(cells),
                "kernel": kernel,
                "slowest": max(cells),
                "all": kernel + sum(cells),
            }
        )
        if out:
            write_text(out / f"{name}.html", page(book))
    return returned(parameters, start, notebooks=rows)


def run(parameters, out=None, quiet=False):
    """Execute the notebooks, print what they took, write their pages into the folder `out`."""
    answer = result(parameters, out, quiet)
    if not quiet:
        print("seconds elapsed")
        print_table(answer["notebooks"], ("notebook", "cells", "kernel", "slowest", "all"), 3)
    if out:
        kept(
            out / "notebooks.csv",
            [{"command": command("notebooks", parameters), **row} for row in answer["notebooks"]],
        )
    return answer
