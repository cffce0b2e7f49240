"""What cases do alike: solve, print, write records with all parameters, and draw what the files say.

A case is a module with `Parameters`, ``result(parameters, quiet)``, ``show(answer)`` and `FIGURES`, which
maps the name of each figure to ``rows(parameters, answer)`` and ``drawing(records)``. A case that does
otherwise has a `run` of its own. The docstring of a drawing is its caption: the message in one sentence; how
to read it; and, after "Seen:", what is there, for those who cannot see it.
Functions that draw import `microblock.view` themselves: a run without figures does without matplotlib.
"""

from dataclasses import asdict
from functools import partial

import numpy as np

from .options import command
from .records import keep


def run(module, parameters, out=None, quiet=False):
    """The answer of a case; it is printed unless `quiet`, and drawn into the folder `out`, if there is
    one.
    """
    if hasattr(module, "run"):
        return module.run(parameters, out, quiet)
    answer = module.result(parameters, quiet)
    if not quiet:
        module.show(answer)
    if out:
        for name, (rows, drawing) in module.FIGURES.items():
            kept = named(module, parameters, rows(parameters, answer))
            if kept:
                keep(out, name, kept, drawing)
    return answer


def named(module, parameters, rows):
    """Rows with the command that repeats them and every parameter, as resolved, that is one value.

    Where a row has a column of that name, the row's own stays.
    """
    resolved = parameters.resolved() if hasattr(parameters, "resolved") else parameters
    given = {name: value for name, value in asdict(resolved).items() if not isinstance(value, (tuple, list))}
    own = {"command": command(module.__name__.rpartition(".")[2], parameters), **given}
    return [{**row, **{name: value for name, value in own.items() if name not in row}} for row in rows]


def records(module, name, parameters):
    """The records of a case's figure."""
    return named(module, parameters, module.FIGURES[name][0](parameters, module.result(parameters)))


def figure_of(module, name, **changes):
    """(function that computes the records, drawing) of a case's figure, with some parameters other than
    usual.
    """
    return partial(records, module, name, module.Parameters(**changes)), module.FIGURES[name][1]


def of_kinds(**tables):
    """Rows of several tables as one: `kind` says which, and columns that a table lacks are empty."""
    names = dict.fromkeys(name for rows in tables.values() for row in rows[:1] for name in row)
    return [{"kind": kind, **dict.fromkeys(names), **row} for kind, rows in tables.items() for row in rows]


def over(columns, units):
    """Columns of a profile over their units {name: unit}, as lists; None where a state has no such column."""
    return {
        name: None if columns[name] is None else (np.asarray(columns[name]) / unit).tolist()
        for name, unit in units.items()
    }


def profiles(states, *names, columns=None):
    """A row for each node of each state's `profile`, of all its columns or of these, with the state's entries
    of these names.
    """
    return [
        {**{name: state[name] for name in names}, **dict(zip(columns or state["profile"], node))}
        for state in states
        for node in zip(*(state["profile"][name] for name in columns or state["profile"]))
    ]
