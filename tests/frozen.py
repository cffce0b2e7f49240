"""Numbers of the library that a change of its shape must not change: tests/frozen.csv holds them, a row each.

`python -m tests.frozen` computes them anew and says how well they agree; with `--write` it writes the file,
in which rows that were there before keep tolerance and reason, and their value if it agrees. Problems are
plain data (`frozen_problems`). Only `frozen_library` knows the names of the library: it follows when names
change, problems and file stay.

A tolerance is relative; of a value 0 it is absolute. It is larger than 1e-12 where another order of sums
(another processor's BLAS, moduli that differ in their last digit) was seen to move the value; the reason says
why. Fresh processes on one machine, of one thread or two, agree in all digits.
"""

import csv
import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

for name in ("OPENBLAS", "OMP"):  # before numpy: sums are taken in one order
    os.environ.setdefault(f"{name}_NUM_THREADS", "1")

import numpy as np  # noqa: E402

from tests import frozen_library as library  # noqa: E402
from tests import frozen_problems as given  # noqa: E402

FILE = Path(__file__).with_name("frozen.csv")
COLUMNS = ("name", "value", "tolerance", "reason")
TOLERANCE = 1e-12
LEVELS = (1e-12, 1e-9, 1e-6)
VANISHES = 1e-12  # what should be 0, such as the rotation under a flat punch
LONG = 12  # numbers of a list that is given by its integrals
COUNTED = ("unknowns", "iterations", "products", "number", "nodes", "elements", "status")
LEFT_OUT = {
    "parameters",
    "versions",
    "seconds",
    "warnings",
    "load_error",
    "error_parts",
    "kkt",
    "error_psi",
    "error_u",
    "error_psi_paper",
    "edges_error",
    "reason",
    "failure_fe",
    "L_bl_error",
    "fit_residual",
    "alpha_mid_error",
}
DIGITS = 6  # of the loads by which events are put in order


def told(events):
    """{name: value} of events in an order that rounding does not change."""
    found = {}
    ordered = sorted(
        events,
        key=lambda event: (float(f"{event.load:.{DIGITS}g}"), event.zone, event.kind, round(event.x, DIGITS)),
    )
    for number, event in enumerate(ordered):
        found |= {
            f"event {number}": f"{event.kind} {event.zone}",
            f"event {number} load": event.load,
            f"event {number} x": event.x,
        }
    return found


def leaves(value, name=""):
    """(name, scalar) of all that a JSON object holds; long lists of numbers are left to `integrals`."""
    if isinstance(value, dict):
        if isinstance(value.get("x", value.get("x2")), list):
            yield from ((f"{name} {part}", own) for part, own in integrals(value).items())
            return
        for key, own in value.items():
            if key not in LEFT_OUT:
                yield from leaves(own, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        if len(value) <= LONG:
            for number, own in enumerate(value):
                yield from leaves(own, f"{name}.{number}")
    elif value is not None:
        yield name, value


def integrals(profile):
    """Integrals over a profile of its quantities and their squares, by its weights or by trapezia."""
    x = np.array(profile["x"] if "x" in profile else profile["x2"])
    weights = np.array(profile["weight"]) if "weight" in profile else np.convolve(np.diff(x) / 2, [1, 1])
    found = {}
    for name, values in profile.items():
        if name not in ("x", "x2", "weight", "zone") and values is not None:
            found[f"{name} squared"] = float(weights @ np.square(values))
    if "pressure" in profile:
        found["pressure integral"] = float(weights @ np.array(profile["pressure"]))
    return found


def values():
    """(name, value) of all that is frozen, one after the other."""
    for problem in given.PROBLEMS:
        for quantity, value in library.measured(library.solve(problem), problem).items():
            yield f"{problem['name']} {quantity}", value
    for problem in given.PATHS:
        events, at = library.path_of(problem)
        yield from ((f"{problem['name']} {quantity}", value) for quantity, value in told(events).items())
        for load in problem["states"]:
            yield f"{problem['name']} half_width at load={load:g}", at(load).half_width
    for problem in given.COALESCENCE:
        yield problem["name"], library.coalescence_of(problem)
    yield from library.plain_numbers().items()
    for name, call in library.refusals().items():
        yield f"refused {name}", library.refused(call)
    for words, kept in given.COMMANDS:
        status, printed = library.answered(words)
        yield f"cases {words}: exit status", status
        for name, value in leaves(json.loads(printed)):
            if not kept or name.startswith(kept):
                yield f"cases {words}: {name}", value
    for words in given.REFUSED_COMMANDS:
        yield f"cases {words}: exit status", library.answered(words)[0]


def written(value):
    """A value as the file has it: a text, or the float with all of its digits."""
    if value is None or isinstance(value, str):
        return "none" if value is None else value
    number = float(value)
    return repr(0.0 if abs(number) < VANISHES else number)


@dataclass(frozen=True)
class Row:
    """A row of the file beside what it is now."""

    name: str
    value: str
    now: str
    tolerance: float

    @property
    def off(self):
        """Relative difference, absolute of 0; inf of texts that differ and of what is missing."""
        try:
            old, new = float(self.value), float(self.now)
        except ValueError:
            return 0.0 if self.value == self.now else np.inf
        return abs(new - old) / (abs(old) or 1.0)

    @property
    def agrees(self):
        return self.off <= self.tolerance

    def __str__(self):
        return (
            f"{self.name}: {self.now} instead of {self.value}, "
            f"off by {self.off:.1e} where {self.tolerance:g} is allowed"
        )


def frozen_rows():
    """{name: {column: text}} of the file."""
    if not FILE.exists():
        return {}
    with FILE.open(newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def compared():
    """A Row for each of the file and for what is new."""
    known, now = frozen_rows(), {name: written(value) for name, value in values()}
    return [
        _row(name, known, now.get(name, "no longer computed"))
        if name in known
        else Row(name, "missing in the file", now[name], 0.0)
        for name in known | now
    ]


def _row(name, known, now):
    return Row(name, known[name]["value"], now, float(known[name]["tolerance"]))


def write():
    """Write the file; known rows keep tolerance and reason, counts are exact."""
    known, rows = frozen_rows(), {}
    for name, value in values():
        if name in rows:
            raise ValueError(f"two rows are called {name}")
        text = written(value)
        exact = isinstance(value, str) or value is None or name.replace(".", " ").split()[-1] in COUNTED
        rows[name] = {
            "tolerance": 0.0 if exact else TOLERANCE,
            "reason": "",
            **known.get(name, {}),
            "name": name,
        }
        if "value" not in rows[name] or not _row(name, rows, text).agrees:
            rows[name]["value"] = text
    with FILE.open("w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows.values())
    print(f"{len(rows)} rows in {FILE}")


def compare():
    """Print how well all rows agree; whether none is beyond its tolerance."""
    rows, bounds = compared(), (0.0, *LEVELS, np.inf)
    for low, high in zip(bounds, bounds[1:]):
        count = sum(low < row.off <= high or row.off == low == 0 for row in rows)
        print(f"{count:5} rows off by " + (f"{high:g} at most" if high < np.inf else f"more than {low:g}"))
    wrong = [row for row in rows if not row.agrees]
    print(*wrong, f"{len(wrong)} of {len(rows)} rows are beyond their tolerance", sep="\n")
    return not wrong


if __name__ == "__main__":
    sys.exit(write() if "--write" in sys.argv[1:] else not compare())
