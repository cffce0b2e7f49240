"""Seeded systems of a few nodes, followed with friction through loads and reversals, and without friction.

Of each system an outcome, the kinds and numbers of its events leg by leg (c and o: a corner closes or opens;
s, d and l: a node sticks, slips or leaves), and one sum with weights that no exchange of two terms leaves as
it is: of the events' places on the path, and of forces, energies, motions and slip at the pairs. An error is
an outcome.
"""

import zlib
from dataclasses import replace

import numpy as np

from .. import library_friction as library
from .. import problems_friction as problems

KINDS = {"close": "c", "open": "o", "stick": "s", "slip": "d", "leave": "l"}
SOLVERS = "active set", "approach given", "path", "gradients", "exchange"  # without friction
LONG = 56  # letters of events that are written out
GOLDEN = (5**0.5 - 1) / 2
FOLLOWED = 1e-11  # of a sum of up to some hundred terms: each of them to 1e-9
WITHOUT = 4  # every so many are solved without friction


def rows(choice):
    for name, count in problems.SETS.items():
        numbers = {f"{name} {number}": number for number in range(count)}
        for row in choice.named({row: {name} for row in numbers}):
            number = numbers[row]
            system = problems.system(name, number)
            followed = library.answer(library.solve_system, system)
            yield from of_path(row, followed, system)
            if number % WITHOUT == 0:
                yield from without_friction(row, system)


def of_path(row, followed, system):
    """Rows of a followed path, or of the error."""
    if isinstance(followed, str):
        yield f"{row} events", followed, "outcome"
        return
    if row.startswith("ties"):  # which of two nodes alike counts as the one that sticks is free
        corners = [event for event in followed.events if event[2] in ("close", "open")]
        followed = replace(followed, events=corners)
    yield f"{row} events", text(followed.events), "outcome"
    yield f"{row} sum", total(followed, system), "discrete", FOLLOWED


def without_friction(row, system):
    """Rows of the state at the last load by all solvers, and of the events on the way."""
    solutions, events = library.touching(system["compliance"], system["gaps"], system["path"][-1][0])
    sums = {
        solver: weighted(*(np.where(np.isfinite(x), x, 0.0) for x in arrays))
        for solver, arrays in solutions.items()
    }
    wanted = sums["active set"]
    yield f"{row} without friction", wanted, "discrete", FOLLOWED
    off = [name for name in SOLVERS if not abs(sums.get(name, np.inf) - wanted) <= 1e-9 * wanted]
    yield f"{row} without friction others", " ".join(off) or "agree", "outcome"
    if row.startswith("ties"):  # rows twice, whose forces are shared
        twice = library.touching_twice(system["compliance"], system["gaps"], system["path"][-1][0])
        yield f"{row} without friction twice", weighted(*twice), "discrete"
    yield f"{row} path", text([(0, 0.0, kind[:-1], corner) for kind, corner, _ in events]), "outcome"
    yield f"{row} path sum", weighted([load for *_, load in events]), "discrete", FOLLOWED


def text(events):
    """Kinds and numbers of events, leg by leg; of many the first ones, their number and a check sum."""
    words = "/".join(
        " ".join(f"{KINDS[kind]}{number}" for at, _, kind, number in events if at == leg)
        for leg in range(events[-1][0] + 1)
    )
    if len(words) <= LONG:
        return words
    return f"{words[: LONG // 2]}... {len(events)} events {zlib.crc32(words.encode()):08x}"


def total(found, system):
    """The weighted sum of a followed path."""
    n, legs = system["gaps"].shape[1], len(system["path"])
    normal, tangential = found.forces[:, :-n], found.forces[:, -n:]
    bound = system["friction"] * normal.reshape(legs, -1, n).sum(axis=1)
    places = np.array([1 + leg + share for leg, share, _, _ in found.events])
    return weighted(
        places,
        normal,
        np.maximum(bound - tangential, 0),
        found.energies,
        np.abs(found.motions),
        np.abs(found.slip),
    )


def weighted(*parts):
    """A sum of positive terms with irrational weights from 1 to 2."""
    terms = np.concatenate([np.ravel(part) for part in parts])
    return float(terms @ (1 + GOLDEN * np.arange(1, len(terms) + 1) % 1))
