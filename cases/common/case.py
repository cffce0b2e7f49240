"""What cases do alike: solve, print, write records with all parameters, and draw what the files say.

A case is a module with `Parameters`, ``result(parameters, quiet)``, ``show(answer)`` and `FIGURES`, which
maps the name of each figure to ``rows(parameters, answer)`` and ``drawing(records)``. `PICTURES` are such
figures whose rows need no answer, ``rows(parameters)``. A case that does otherwise has a `run` of its own.
Functions that draw import `microblock.view` themselves: a run without figures does without matplotlib.
"""

from dataclasses import asdict
from functools import partial

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
        for name, (rows, drawing) in getattr(module, "PICTURES", {}).items():
            keep(out, name, named(module, parameters, rows(parameters)), drawing)
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
    pictures = getattr(module, "PICTURES", {})
    if name in pictures:
        return named(module, parameters, pictures[name][0](parameters))
    return named(module, parameters, module.FIGURES[name][0](parameters, module.result(parameters)))


def figure_of(module, name, **changes):
    """(function that computes the records, drawing) of a case's figure, with some parameters other than
    usual.
    """
    _, drawing = {**module.FIGURES, **getattr(module, "PICTURES", {})}[name]
    return partial(records, module, name, module.Parameters(**changes)), drawing


def profiles(states, *names):
    """A row for each node of each state's `profile`, with the state's entries of these names."""
    return [
        {**{name: state[name] for name in names}, **dict(zip(state["profile"], node))}
        for state in states
        for node in zip(*state["profile"].values())
    ]
