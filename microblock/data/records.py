"""Records of runs: CSV tables and JSON objects that carry all parameters and the versions."""

import csv
import io
import json
import math
import os
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path

from .. import __version__
from ..errors import NotConverged, writing


@cache
def software() -> dict[str, str]:
    """Returns the versions of microblock, of the packages that compute, and of Python, by name."""
    packages = {name: metadata.version(name) for name in ("ngsolve", "netgen-mesher", "numpy", "scipy")}
    return {"microblock": __version__, **packages, "python": platform.python_version()}


def versions() -> dict[str, str]:
    """Returns what `software` does, and the "machine": system, processor and number of cores."""
    return {**software(), "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"}


def write_text(path: str | os.PathLike, text: str) -> None:
    """Writes a text file, whole or not at all; a device or pipe is written to as it is. Raises BadArgument if
    the system refuses to write there.
    """
    path = Path(path)
    with writing(path):
        if path.exists() and not path.is_file():
            path.write_text(text)
            return
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            temporary.write_text(text, newline="")
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


def write_json(path: str | os.PathLike, result: object) -> None:
    """Writes lists and mappings of numbers, texts and None as one JSON object, whole or not at all; raises
    NotConverged if a number is NaN or infinite.
    """
    write_text(path, json_text(result) + "\n")


def json_text(result: object) -> str:
    """Returns lists and mappings of numbers, texts and None as JSON in full precision; raises NotConverged,
    which names the first, if a number is NaN or infinite.
    """
    wrong = _no_number(result)
    if wrong:
        raise NotConverged(f"the result has no number in {wrong}: nothing is written")
    return json.dumps(result, indent=1, allow_nan=False)


def _no_number(value, place=""):
    """The first place in lists and mappings where a number is NaN or infinite; empty if there is none."""
    if isinstance(value, float) and not math.isfinite(value):
        return place or "itself"
    sequence = isinstance(value, (list, tuple))
    inner = value.items() if isinstance(value, Mapping) else enumerate(value) if sequence else ()
    return next(filter(None, (_no_number(one, f"{place}.{key}".lstrip(".")) for key, one in inner)), "")


def write_records(path: str | os.PathLike, rows: Sequence[Mapping[str, object]]) -> None:
    """Writes a CSV file, whole or not at all: rows {column: value} with the columns of the first one, and
    versions last, but where rows come with their own.
    """
    known = {f"version_{name}": version for name, version in versions().items()}
    text = io.StringIO(newline="")
    names = rows[0] if rows else ()
    table = csv.DictWriter(text, fieldnames=[*names, *(name for name in known if name not in names)])
    table.writeheader()
    table.writerows({**known, **row} for row in rows)
    write_text(path, text.getvalue())


def read_records(path: str | os.PathLike) -> list[dict]:
    """Returns the rows of a CSV file, {column: value}: numbers as numbers, empty cells as
    None, else texts.
    """
    with open(path, newline="") as table:
        return [{name: number(cell) for name, cell in row.items()} for row in csv.DictReader(table)]


def number(cell: str) -> int | float | str | None:
    """Returns the number that a cell holds, None of an empty one, else its text."""
    if cell == "":
        return None
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell
