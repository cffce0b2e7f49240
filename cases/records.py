"""What a case gives back, and what it leaves in its folder: records as CSV, and the picture drawn from what the file says."""

import time
from dataclasses import asdict

from microblock import plots
from microblock.study import read_records, versions, write_records


def returned(parameters, start, setup=0.0, /, **found):
    """The object that a case returns: parameters (tuples as lists), versions, seconds, and what was found.

    Parameters
    ----------
    parameters : a case's dataclass
    start : float, what `time.perf_counter` said when the work, or after the setup the solving, began
    setup : float, seconds before that
    """
    given = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(parameters).items()}
    seconds = {"setup": setup, "solve": time.perf_counter() - start}
    return {"parameters": given, "versions": versions(), "seconds": seconds, **found}


def keep(out, name, rows, drawing):
    """Write rows [{column: value}] as NAME.csv into the folder `out` (a Path), and ``drawing(records) -> Figure`` beside it."""
    plots.draw(drawing, kept(out/f"{name}.csv", rows), out, name)


def kept(path, rows):
    """Write rows as CSV; the records as they come back from the file."""
    write_records(path, rows)
    return read_records(path)
