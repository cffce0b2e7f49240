"""What a computation would take, of time and of memory, is estimated before it is begun."""

import math
import os
from pathlib import Path

from .errors import NotConverged

GIGABYTE = 1e9
UNKNOWN = 8 * GIGABYTE  # memory of a system that does not tell
SHARE = 0.8  # of the available memory that one computation may take
LITTLE = 2e8  # bytes that are tried anyway: others may be about to give memory back
# of the entries of a row times log2 of the rows, in the factors of a body: 0.31 to 0.46 were seen
FILLED = 0.45
ENTRY = 12  # bytes of an entry of a sparse matrix
# of the factors that are held at a time at most, matrix and what builds it included: 3.0 were seen
COPIES = 3
# bytes for each pair of contact nodes: 25 numbers, of flexibility, factors and their copies
DENSE = 200
# bytes for each pair of forces along a history of friction: 54 were seen
FORCES = 64
# seconds of a pair of loads, over the cube of the number of forces: 2e-10 to 1e-9 were seen
CUBED = 1e-9
LONGEST = 1800.0  # seconds of a computation that is begun


def available():
    """Bytes of memory that are free, or can be freed, for this process."""
    try:
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        return 1024 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return UNKNOWN


def of_factors(rows, entries):
    """Bytes to factorise the matrix of a plane body with so many rows and entries."""
    return COPIES * ENTRY * FILLED * entries * math.log2(max(rows, 2))


def of_nodes(count):
    """Bytes for the dense matrices of so many contact nodes."""
    return DENSE * count * count  # inf where it overflows


def too_much(needed):
    """What is wrong with so many bytes, in words; an empty string if they are there."""
    there = available()
    if needed <= max(SHARE * there, LITTLE):
        return ""
    return f"would take {needed / GIGABYTE:.2g} GB of memory, and {there / GIGABYTE:.2g} GB are available"


def require_room(needed, what, advice):
    """NotConverged unless so many bytes are there, before they are asked for."""
    words = too_much(needed)
    if words:
        raise NotConverged(f"{what} {words}: {advice}")


def require_history(cells, forces, pairs):
    """NotConverged where a history on so many cells would take more memory than there is, or too long."""
    what, advice = f"a history on {cells} cells", "take fewer pairs, smaller loads, or fewer features"
    require_room(FORCES * forces**2, what, advice)
    seconds = CUBED * pairs * forces**3
    if seconds > LONGEST:
        raise NotConverged(f"{what} would take some {seconds / 60:.2g} minutes: {advice}")
