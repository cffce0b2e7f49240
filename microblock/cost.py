"""What a computation would take is estimated before it is begun."""

import math
from pathlib import Path

from .errors import NotConverged

LITTLE = 2e8  # bytes that are tried anyway: others may be about to give memory back
ENTRY = 12  # bytes of an entry of a sparse matrix


def available():
    """Bytes of memory that this process can have."""
    try:
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        return 1024 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return 8e9  # of a system that does not tell


def of_factors(rows, entries):
    """Bytes to factorise the matrix of a plane body with so many rows and entries.

    Factors have 0.31 to 0.46 of the entries times log2 of the rows; three of them are held at a time.
    """
    return 3 * ENTRY * 0.45 * entries * math.log2(max(rows, 2))


def of_nodes(count):
    """Bytes for dense matrices of so many contact nodes: 25 numbers a pair."""
    return 200 * count * count  # inf where it overflows


def too_much(needed):
    """What is wrong with so many bytes, in words, or nothing."""
    there = available()
    if needed <= max(0.8 * there, LITTLE):
        return ""
    return f"would take {needed / 1e9:.2g} GB of memory, and {there / 1e9:.2g} GB are available"


def require_room(needed, what, advice):
    """Raises NotConverged unless so many bytes are there."""
    words = too_much(needed)
    if words:
        raise NotConverged(f"{what} {words}: {advice}")


def require_history(cells, forces, pairs):
    """Raises NotConverged where a history on so many cells would take more memory than there is, or half an
    hour.

    A pair of forces takes 54 bytes, and a pair of loads 5e-11 to 2e-10 seconds times the cube of the forces.
    """
    what, advice = f"a history on {cells} cells", "take fewer pairs, smaller loads, or fewer features"
    require_room(64 * forces**2, what, advice)
    seconds = 2e-10 * pairs * forces**3
    if seconds > 1800:
        raise NotConverged(f"{what} would take some {seconds / 60:.2g} minutes: {advice}")
