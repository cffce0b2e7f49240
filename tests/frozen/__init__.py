"""Numbers of the library that a change of its shape must not change.

`rooms/NAME.csv` holds the numbers of a room, a row each, and `rooms/NAME.py` computes them: its function
`rows(choice)` yields (name, value, kind) or, of an estimate, (name, value, "estimated", tolerance), of the
problems that a Choice of `tests.frozen.choice` takes.
`python -m tests.frozen [ROOM ...]` computes them anew and says how well they agree; with `--write` it
writes the files, in which a row that agrees keeps its value.

A kind says what may change a row and how far it may move:

definition   law, material, kernels, closed forms, problems at fixed nodes: 1e-12 relative
discrete     states and events on fixed meshes and cells: 1e-9
estimated    what an error estimate speaks of: the estimate, 1e-9 at least and 1e-3 at most
outcome      texts, classes of errors, numbers of zones and events: equal
doubt        estimates, errors of loads and edges, differences that rounding moves: 1e-2
count        unknowns and estimates, 0.1; iterations and residuals: shown, never a failure

Another tolerance stands in the row, with its reason. Of a value 0 it is absolute.
"""

import csv
import importlib
import os
import pkgutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

for name in ("OPENBLAS", "OMP"):  # before numpy: sums are taken in one order
    os.environ.setdefault(f"{name}_NUM_THREADS", "1")

import numpy as np  # noqa: E402

from .choice import Choice  # noqa: E402

FOLDER = Path(__file__).with_name("rooms")
COLUMNS = ("name", "value", "kind", "tolerance", "reason")
TOLERANCES = {"definition": 1e-12, "discrete": 1e-9, "estimated": 1e-3, "outcome": 0.0, "doubt": 1e-2}
TOLERANCES["count"] = np.inf
VANISHES = 1e-12  # what should be 0, such as the rotation under a flat punch
LEVELS = (0.0, 1e-12, 1e-9, 1e-6, np.inf)
ROOMS = tuple(module.name for module in pkgutil.iter_modules([str(FOLDER)]))
DRIFTS = {"unknowns": 0.1, "error_estimate": 0.1}  # of those counted, what a change of algorithm may move
COUNTED = {"unknowns", "iterations", "products", "nodes", "elements", "residual", "kkt", "error_estimate"}


def of_kind(name, value, kind, tolerance=None):
    """A row of a state: texts are outcomes, and what counts work or noise is of kind count."""
    if name.replace(".", " ").split()[-1] in COUNTED:
        return name, value, "count"
    if isinstance(value, (str, bool)) or value is None or name.endswith(" number"):
        return name, value, "outcome"
    if kind == "estimated":
        return name, value, kind, min(max(tolerance, TOLERANCES["discrete"]), TOLERANCES[kind])
    return name, value, kind


def usual(kind, name):
    """The tolerance of a row without one of its own."""
    return DRIFTS.get(name.replace(".", " ").split()[-1], np.inf) if kind == "count" else TOLERANCES[kind]


def written(value):
    """A value as the files have it: a text, or the float with all of its digits."""
    if value is None or isinstance(value, str):
        return "none" if value is None else value
    number = float(value)
    return repr(0.0 if abs(number) < VANISHES else number)


@dataclass(frozen=True)
class Row:
    """A row of a file beside what it is now."""

    name: str
    value: str
    kind: str
    tolerance: float
    now: str = ""
    reason: str = ""

    @property
    def off(self):
        """Relative difference, absolute of 0; inf of texts that differ and of what is missing."""
        try:
            old, new = float(self.value), float(self.now)
        except ValueError:
            return 0.0 if self.value == self.now else np.inf
        if max(abs(old), abs(new)) < 10 * VANISHES:
            return 0.0
        return abs(new - old) / (abs(old) or 1.0)

    @property
    def agrees(self):
        return self.off <= self.tolerance

    def __str__(self):
        return (
            f"{self.name}: {self.now} instead of {self.value}, off by {self.off:.1e} where "
            f"{self.tolerance:g} is allowed ({self.kind})"
        )


class Room:
    """The rows of a file, as they are written and as they are now: of all problems, or of a tenth of them."""

    def __init__(self, name, whole=True):
        self.name, self.file = name, FOLDER / f"{name}.csv"
        self._choice = Choice(whole)

    @cached_property
    def known(self):
        """{name: Row} of the file."""
        if not self.file.exists():
            return {}
        with self.file.open(newline="") as file:
            rows = list(csv.DictReader(file))
        return {
            row["name"]: Row(
                row["name"],
                row["value"],
                row["kind"],
                float(row["tolerance"] or usual(row["kind"], row["name"])),
                "no longer computed",
                row["reason"],
            )
            for row in rows
        }

    @cached_property
    def now(self):
        """{name: Row} as computed, with the tolerance of its kind."""
        rows = {}
        room = importlib.import_module(f"{__name__}.rooms.{self.name}")
        for name, value, kind, *tolerance in room.rows(self._choice):
            if name in rows:
                raise ValueError(f"two rows are called {name}")
            rows[name] = Row(name, written(value), kind, *(tolerance or [TOLERANCES[kind]]))
        return rows

    def compared(self):
        """A Row for each that is computed, each of the file that should be, and for what is new."""
        not_computed = [name for name in self.known if name not in self.now]
        missing = [name for name in not_computed if not self._choice.leaves_out(name)]
        return [
            Row(**{**vars(self.known[name]), "now": self.now[name].value if name in self.now else "nothing"})
            if name in self.known
            else Row(name, "missing in the file", self.now[name].kind, 0.0, self.now[name].value)
            for name in (*self.now, *missing)
        ]

    def write(self):
        """Write the file: a row that agrees keeps its value, and a reason its tolerance."""
        lines = [self._line(row) for row in self.now.values()]  # all of them before the old ones go
        with self.file.open("w", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(COLUMNS)
            table.writerows(lines)
        print(f"{len(self.now)} rows in {self.file}")

    def _line(self, row):
        old = self.known.get(row.name)
        kept = old and Row(row.name, old.value, old.kind, old.tolerance, row.value).agrees
        value = old.value if kept and row.kind != "count" else row.value
        if old and old.reason and row.kind == old.kind:
            return row.name, value, row.kind, f"{old.tolerance:g}", old.reason
        alike = row.tolerance == TOLERANCES[row.kind]
        return row.name, value, row.kind, "" if alike else f"{row.tolerance:.1e}", ""


def compare(rooms):
    """Print how well the rows of each room agree; whether none is beyond its tolerance."""
    good = True
    for room in map(Room, rooms):
        rows = room.compared()
        wrong = [row for row in rows if not row.agrees]
        spread = ", ".join(
            f"{sum(low < row.off <= high or row.off == low == 0 for row in rows)} to {high:g}"
            for low, high in zip(LEVELS, LEVELS[1:])
        )
        print(*wrong, f"{room.name}: {len(wrong)} of {len(rows)} rows beyond; off by {spread}", sep="\n")
        good = good and not wrong
    return good
