"""Records of runs: CSV tables with versions."""

import csv
import io
import os
import platform
from contextlib import suppress
from functools import cache
from importlib import metadata

from .. import __version__
from ..errors import replacing


@cache
def versions():
    """Returns the versions of microblock, packages that compute and Python, and the "machine"."""
    packages = {name: metadata.version(name) for name in ("ngsolve", "netgen-mesher", "numpy", "scipy")}
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return {"microblock": __version__, **packages, "python": platform.python_version(), "machine": machine}


def write_text(path, text, name="path"):
    """Writes a text file, whole or not at all; raises BadArgument, by `name`, if the system refuses it."""
    with replacing(path, name) as part:
        part.write_text(text, newline="")


def write_records(path, rows):
    """Writes a CSV file, whole or not at all: rows {column: value}, and versions unless there are some."""
    known = {f"version_{name}": version for name, version in versions().items()}
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, dict.fromkeys(column for row in (*rows, known) for column in row))
    table.writeheader()
    table.writerows({**known, **row} for row in rows)
    write_text(path, text.getvalue())


def read_records(path):
    """Returns the rows of a CSV file, {column: value}: numbers as numbers, empty cells as
    None, else texts.
    """
    with open(path, newline="") as table:
        return [{name: number(cell) for name, cell in row.items()} for row in csv.DictReader(table)]


def number(cell):
    """Returns a cell's number, None of an empty one, else its text."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(cell)
    return cell or None
