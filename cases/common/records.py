"""What a case gives back, and what it leaves in its folder: records as CSV, and the picture drawn from what
the file says.
"""

import time
from dataclasses import asdict

from microblock.data.records import read_records, versions, write_records


def returned(parameters, start, setup=0.0, /, **found):
    """The object that a case returns: parameters (tuples as lists), versions, seconds, and what was found.

    Parameters
    ----------
    parameters : a case's dataclass
    start : float, what `time.perf_counter` said when the work, or after the setup the solving, began
    setup : float, seconds before that
    """
    given = {
        name: list(value) if isinstance(value, tuple) else value for name, value in asdict(parameters).items()
    }
    seconds = {"setup": setup, "solve": time.perf_counter() - start}
    return {"parameters": given, "versions": versions(), "seconds": seconds, **found}


def keep(out, name, rows, drawing):
    """Write rows [{column: value}] as NAME.csv into the folder `out` (a Path), and ``drawing(records) ->
    Figure`` beside it.
    """
    from microblock.view import plots  # when something is drawn: listing the cases does without matplotlib

    plots.draw(drawing, kept(out / f"{name}.csv", rows), out, name)


def kept(path, rows):
    """Write rows as CSV; the records as they come back from the file."""
    write_records(path, rows)
    return read_records(path)


def print_table(rows, columns, digits=4):
    """Print these columns of records, each as wide as its longest cell; words to the left, numbers to the
    right.
    """
    lines = [columns, *([_shown(row.get(name), digits) for name in columns] for row in rows)]
    widths = [max(len(line[place]) for line in lines) for place in range(len(columns))]
    sides = ["<" if all(isinstance(row.get(name), str | None) for row in rows) else ">" for name in columns]
    for line in lines:
        print("  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(line, sides, widths)).rstrip())


def print_events(events):
    """Print the events of a load path, a line each."""
    for event in events:
        print(
            f"load {event['load']:.7f} +- {event['load_error']:.1e}: "
            f"{event['zone']} {event['kind']} at x = {event['x']:.5f}"
        )


def print_entries(answer, names, digits=9):
    """Print these entries of an answer, a line each."""
    width = max(map(len, names))
    for name in names:
        values = answer[name] if isinstance(answer[name], list) else [answer[name]]
        print(f"{name:>{width}}  " + "  ".join(_shown(value, digits) for value in values))


def _shown(value, digits):
    if value is None:
        return "-"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def without_seconds(rows):
    """Rows without their seconds, which no other run has again."""
    return [{name: cell for name, cell in row.items() if name != "seconds"} for row in rows]
