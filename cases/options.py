"""Parameters of a case, declared once: a frozen dataclass whose fields become the command's options."""

import argparse
from dataclasses import MISSING, field, fields

from microblock.errors import BadArgument


def option(default, text, kind=float, **choice):
    """A dataclass field with help text, type and argparse's `choices`, `nargs` or `action`; `positional`: without its name."""
    return field(default=default, metadata={"help": text, "type": kind, **choice})


def add_options(parser, parameters):
    """Give an argparse parser one --option for each field of the dataclass `parameters`."""
    for entry in fields(parameters):
        settings = dict(entry.metadata)
        shown = "" if entry.default in (None, (), MISSING) else f" (default {entry.default})"
        settings["help"] = (settings["help"] + shown).replace("%", "%%")
        if entry.type in (bool, "bool"):
            settings = {"help": entry.metadata["help"], "action": "store_true"}
        if settings.pop("positional", False):
            parser.add_argument(entry.name, **settings)
            continue
        parser.add_argument(flag(entry.name), dest=entry.name, default=entry.default, **settings)


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
    """A parser whose errors are one line on standard error, and exit status 2."""

    def error(self, message):
        self.exit(2, f"{self.prog}: {message}\n")


def complaint(failure: BadArgument, parameters):
    """A BadArgument in the words of the command line."""
    known = {entry.name for entry in fields(parameters)} | {"json", "out"}
    name = flag(failure.name) if failure.name in known else failure.name
    return f"{name} {failure.value}: {failure.allowed}"
