"""What a computation would take is estimated before it is begun.

RATES are those of one core of a usual processor; `cases/benchmarks/results/choice.csv` has the seconds that
were measured. They are the same on every machine, so that a problem takes the same method everywhere, but for
bodies in space, where SciPy's SuperLU takes much longer than CHOLMOD.
"""

import gc
import math
from pathlib import Path
from typing import NamedTuple

from .errors import NotConverged

MOST_MEMORY = 20 * 2.0**30  # bytes of a method that is chosen
LITTLE = 2e8  # bytes that are tried anyway: others may be about to give memory back
ENTRY = 12  # bytes of an entry of a sparse matrix


class Cost(NamedTuple):
    """What an answer is expected to take.

    Attributes
    ----------
    seconds : float
        Of one processor core.
    memory : float
        Bytes at the peak that grow with the unknowns; below 3e8 the tens of MB that libraries take to begin
        weigh as much.
    unknowns : float
        Of the last discretisation.
    misses : bool
        Whether the answer is expected to end above rtol.
    """

    seconds: float
    memory: float
    unknowns: float
    misses: bool = False


class Rate(NamedTuple):
    """Seconds ``fixed + each n**power`` and bytes ``memory n**memory_power`` of n unknowns."""

    fixed: float
    each: float
    power: float
    memory: float
    memory_power: float


RATES = {
    "panels": Rate(0.015, 1.1e-5, 1.5, 120, 2),
    "cells": Rate(0.01, 3e-6, 1.06, 360, 1),
    "fitted": Rate(0.1, 9e-6, 1.2, 1.2e3, 1.2),
    "condensed": Rate(0.02, 8e-6, 1.05, 3.5e3, 1.05),
    "refined": Rate(0.02, 4e-7, 1.5, 7e3, 1.05),
    "newton": Rate(0.02, 4e-5, 1.07, 5e3, 1.05),
    "condensed in space": Rate(0.05, 4e-6, 1.4, 1e3, 1.39),
    "condensed in space by SuperLU": Rate(0.05, 1.9e-8, 2.08, 400, 1.515),
    "newton in space": Rate(0.05, 4e-5, 1.28, 4e3, 1.1),
    "cells in space": Rate(0.1, 3e-6, 1.08, 270, 1),
}


def predict(method: str, unknowns: float, times: float = 1.0) -> Cost:
    """Returns the Cost of a method, of RATES, with so many unknowns, which are solved for so many times as
    often as usual.
    """
    rate = RATES[method]
    seconds = rate.fixed + times * rate.each * unknowns**rate.power
    memory = rate.memory * unknowns**rate.memory_power
    return Cost(float(seconds), float(memory), float(unknowns))


def available() -> float:
    """Returns how many bytes of memory this process can have."""
    try:
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        return 1024.0 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return 8e9  # of a system that does not tell


def plane_factor_bytes(rows: float, entries: float) -> float:
    """Returns bytes to factorise the matrix of a plane body with so many rows and entries.

    Factors have 0.31 to 0.46 of the entries times log2 of the rows; three of them are held at a time.
    """
    return 3 * ENTRY * 0.45 * entries * math.log2(max(rows, 2))


def dense_bytes(nodes: float) -> float:
    """Returns bytes of the dense matrices of so many contact nodes: 25 numbers a pair; inf beyond floats."""
    return 200.0 * nodes * nodes


def too_much(needed: float) -> str:
    """Returns what is wrong with so many bytes, in words, or nothing."""
    if needed <= max(available() / 20, LITTLE):
        return ""
    if needed <= MOST_MEMORY:
        gc.collect()  # problems and their solvers know one another, and stay until they are looked for
    free = available()
    if needed <= 0.8 * free:
        return ""
    return f"would take {needed / 1e9:.2g} GB of memory, and {free / 1e9:.2g} GB are available"


def require_room(needed: float, what: str, advice: str) -> None:
    """Raises NotConverged unless so many bytes are available."""
    words = too_much(needed)
    if words:
        raise NotConverged(f"{what} {words}: {advice}")


def history_seconds(forces: float, pairs: float) -> float:
    """Returns seconds of a history of so many forces and pairs of loads, at most; a quarter was seen."""
    return 2e-10 * pairs * forces**3


def require_history(cells: int, forces: int, pairs: int) -> None:
    """Raises NotConverged where a history on so many cells would take more memory than is available, or half
    an hour. A pair of forces takes 54 bytes.
    """
    what = f"a history on {cells} cells"
    advice = "take fewer pairs, smaller loads, or fewer features"
    require_room(64 * forces**2, what, advice)
    seconds = history_seconds(forces, pairs)
    if seconds > 1800:
        raise NotConverged(f"{what} would take some {seconds / 60:.2g} minutes: {advice}")
