"""Parameters of a case, declared once: a frozen dataclass whose fields become the command's options."""

import argparse
import math
import re
from dataclasses import MISSING, field, fields
from difflib import get_close_matches

from microblock.errors import BadArgument, require_size, shortened, shown


def option(default, text, kind=float, **choice):
    """A dataclass field with help text, type and argparse's `choices`, `nargs` or `action`; `positional`: without its name."""
    return field(default=default, metadata={"help": text, "type": kind, **choice})


def add_options(parser, parameters):
    """Give an argparse parser one --option for each field of the dataclass `parameters`."""
    for entry in fields(parameters):
        settings = dict(entry.metadata)
        settings["help"] = (settings["help"] + _default(entry)).replace("%", "%%")
        if entry.type in (bool, "bool"):
            settings = {"help": entry.metadata["help"], "action": "store_true"}
        if settings.pop("positional", False):
            parser.add_argument(entry.name, **settings)
            continue
        parser.add_argument(flag(entry.name), dest=entry.name, default=entry.default, **settings)


def _default(entry):
    """What the help says of a parameter's default: nothing where it has none or must be given."""
    if entry.default in (None, (), MISSING) or entry.metadata.get("positional"):
        return ""
    words = entry.default if isinstance(entry.default, tuple) else (entry.default,)
    return f" (default {' '.join(map(str, words))})"


def check_sizes(parameters, arguments):
    """BadArgument for the first number on the command line that double precision cannot carry through products: the one guard.

    NaN and infinity are left to the cases: some options take them.
    """
    for entry in fields(parameters):
        value = arguments.get(entry.name)
        for one in value if isinstance(value, (tuple, list)) else (value,):
            if isinstance(one, float) and math.isfinite(one) and one:
                require_size(**{entry.name: one})


def flag(name):
    """The command-line option of a parameter."""
    return "--" + name.replace("_", "-")


def command(case, parameters):
    """The command line that repeats a run with these parameters."""
    words = [f"python -m cases {case}"]
    for entry in fields(parameters):
        value = getattr(parameters, entry.name)
        if entry.metadata.get("positional"):
            words.append(str(value))
            continue
        if entry.metadata.get("action") == "append":
            words += [f"{flag(entry.name)} {' '.join(one)}" for one in value or ()]
            continue
        if isinstance(value, bool):
            words += [flag(entry.name)]*value
            continue
        if isinstance(value, (tuple, list)):
            value = " ".join(str(one) for one in value) or None
        if value is not None:
            words.append(f"{flag(entry.name)} {value}")
    return " ".join(words)


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line on standard error, and exit status 2; it knows what a misspelt word may mean."""

    def error(self, message):
        wrong = re.match(r"argument [^:]*: invalid choice: '?([^' ]*)'? \(choose from (.*)\)", message)
        if wrong:
            message += did_you_mean(wrong[1], re.findall(r"[^', ]+", wrong[2]))
        if "are required" in message:
            message += f"; {self.prog} --help explains them"
        self.exit(2, f"{self.prog}: {message}\n")


def did_you_mean(word, known):
    """The question after an unknown word, empty if nothing that is known is near to it."""
    near = get_close_matches(word, list(known), n=1)
    return f": did you mean {near[0]}?" if near else ""


def complaint(failure: BadArgument, parameters):
    """A BadArgument in the words of the command line."""
    known = {entry.name for entry in fields(parameters)} | {"json", "out"}
    name = flag(failure.name) if failure.name in known else failure.name
    value = shortened(failure.value) if isinstance(failure.value, str) else shown(failure.value)
    return f"{name} {value}: {failure.allowed}"
