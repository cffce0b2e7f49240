"""Records of runs: CSV tables with versions."""

import csv
import io
import os
import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib import metadata
from typing import Any

from .. import __version__
from ..errors import replacing


@cache
def versions() -> dict[str, str]:
    """Returns the versions of microblock, packages that compute and Python, and the "machine"."""
    packages = {name: metadata.version(name) for name in ("ngsolve", "netgen-mesher", "numpy", "scipy")}
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return {"microblock": __version__, **packages, "python": platform.python_version(), "machine": machine}


def write_text(path: str | os.PathLike[str], text: str, name: str = "path") -> None:
    """Writes a text file, whole or not at all; raises BadArgument, by `name`, if the system refuses it."""
    with replacing(path, name) as part:
        part.write_text(text, newline="")


def write_records(path: str | os.PathLike[str], rows: Sequence[Mapping[str, object]]) -> None:
    """Writes a CSV file, whole or not at all: rows {column: value}, and versions unless there are some."""
    common = {f"version_{name}": version for name, version in versions().items()}
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, dict.fromkeys(column for row in (*rows, common) for column in row))
    table.writeheader()
    table.writerows({**common, **row} for row in rows)
    write_text(path, text.getvalue())


def read_records(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Returns the rows of a CSV file, {column: value}: numbers as numbers, empty cells None, else texts."""
    with open(path, newline="") as table:
        return [{name: cell_value(cell) for name, cell in row.items()} for row in csv.DictReader(table)]


def cell_value(cell: str) -> Any:
    """Returns a cell's number, None of an empty one, else its text."""
    for kind in (int, float):
        with suppress(ValueError):
            return kind(cell)
    return cell or None
