"""Records of runs: CSV tables and JSON objects that carry all parameters and the versions."""

import csv
import json
import math
import os
import platform
import tempfile
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from . import __version__
from .errors import BadArgument, NotConverged


def versions():
    """Versions of everything that a result depends on, and the machine."""
    packages = {name: metadata.version(name) for name in ("ngsolve", "netgen-mesher", "numpy", "scipy")}
    return {"microblock": __version__, **packages, "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"}


def write_text(path, text):
    """Write a text file, whole or not at all; a device or pipe is written to as it is."""
    path = Path(path)
    if path.exists() and not path.is_file():
        path.write_text(text)
        return
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    try:
        with os.fdopen(handle, "w", newline="") as file:
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def write_json(path, result):
    """Write one JSON object, whole or not at all; NotConverged where a number in it is none."""
    write_text(path, json_text(result) + "\n")


def json_text(result):
    """An object as JSON; NotConverged names the first entry that is NaN or infinite."""
    wrong = _no_number(result)
    if wrong:
        raise NotConverged(f"the result has no number in {wrong}: nothing is written")
    return json.dumps(result, indent=1, allow_nan=False)


def _no_number(value, place=""):
    """The first place in lists and mappings where a number is NaN or infinite; empty if there is none."""
    if isinstance(value, float) and not math.isfinite(value):
        return place or "itself"
    inner = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, (list, tuple)) else ()
    return next(filter(None, (_no_number(one, f"{place}.{key}".lstrip(".")) for key, one in inner)), "")


def write_records(path, rows):
    """Write a CSV file, whole or not at all: one row a run, the columns of the first row, versions last.

    Rows that come with versions, from earlier records, keep them.
    """
    known = {f"version_{name}": version for name, version in versions().items()}
    with tempfile.SpooledTemporaryFile(mode="w+", newline="", max_size=10**8) as text:
        table = csv.DictWriter(text, fieldnames=[*rows[0], *(name for name in known if name not in rows[0])])
        table.writeheader()
        for row in rows:
            table.writerow({**known, **row})
        text.seek(0)
        write_text(path, text.read())


def read_records(path):
    """Rows of a CSV file as dictionaries; numbers as numbers, empty cells as None."""
    with open(path, newline="") as table:
        return [{name: _number(cell) for name, cell in row.items()} for row in csv.DictReader(table)]


def column(rows, name):
    """One column of records as a list."""
    return [row[name] for row in rows]


def grouped(rows, name):
    """{value of one column: the records that have it}, in the order in which the values come."""
    return {value: [row for row in rows if row[name] == value] for value in dict.fromkeys(column(rows, name))}


def check_writable(name, path):
    """Raise BadArgument unless a file can be written at `path`: before the work, not after it."""
    parent = Path(path).resolve().parent
    if not parent.is_dir() or not os.access(parent, os.W_OK) or Path(path).is_dir():
        raise BadArgument(name, str(path), "must be a file in an existing folder that can be written to")


def _number(cell):
    if cell == "":
        return None
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell
