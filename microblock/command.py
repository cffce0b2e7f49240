"""Functions as commands: options from the signature of a function, one JSON object, figures, and exit
statuses: 0 done, 2 for a bad argument, 1 for a computation that failed, 130 after Ctrl-C.

A command is a module with ``solve(**options)``; default values or annotations give the types of its options,
the section "Parameters" of its docstring a line each. The module may have ``figure(result)``, a figure or
{name: figure}; ``to_dict(result)`` for JSON; ``table(result)`` for what is printed; `OUT`, the usual folder,
which a `solve` that writes files takes as `out`. Lists named "warnings" go to standard error.
"""

import argparse
import inspect
import json
import re
import sys
import time
import traceback
import types
import typing
from difflib import get_close_matches
from pathlib import Path

from .data.records import versions, write_text
from .errors import (
    BadArgument,
    MicroblockError,
    made_folder,
    replacing,
    require_place,
    require_size,
    shortened,
    shown,
)
from .model.results import plain_data


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, and exit status 2."""

    def error(self, message):
        if message.endswith("expected one argument"):
            message += "; a value that begins with - is written --NAME=VALUE"
        self.exit(2, f"{self.prog}: {message}\n")


def did_you_mean(word, known):
    """Returns a question after an unknown word, or nothing."""
    near = get_close_matches(word, list(known), n=1)
    return f": did you mean {near[0]}?" if near else ""


def flag(name):
    return "--" + name.replace("_", "-")


class Option:
    """A parameter of a function as an option: `name`, `default`, `text` of the docstring, `kind` of each
    value, `many` (False, a number, or "+" for any), `choices` of words.
    """

    def __init__(self, parameter, hint, text):
        self.name, self.default, self.text = parameter.name, parameter.default, text
        if typing.get_origin(hint) in (typing.Union, types.UnionType):
            hint = next(kind for kind in typing.get_args(hint) if kind is not types.NoneType)
        self.many = isinstance(self.default, tuple) or typing.get_origin(hint) is tuple
        if self.many:
            kinds = typing.get_args(hint)
            self.many = "+" if not kinds or ... in kinds else len(kinds)
            hint = (*kinds, *map(type, self.default or ()), str)[0]
        self.choices = typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()
        self.kind = str if self.choices else hint or type(self.default)

    def add_to(self, parser):
        """Adds the option to a parser, which leaves its value as text."""
        text = f"{', '.join(self.choices)}: {self.text}" if self.choices else self.text
        if self.kind is bool:
            more = {"action": "store_true"}
        else:
            more = {"nargs": self.many or None, "metavar": self.name.rpartition("_")[2].upper()}
            if self.default not in (None, ()):
                default = self.default if self.many else (self.default,)
                text += f" (default {' '.join(map(str, default))})"
        parser.add_argument(flag(self.name), default=argparse.SUPPRESS, help=text.replace("%", "%%"), **more)

    def value(self, text):
        """Returns the value of a text or a list of texts; raises BadArgument if it is none."""
        return tuple(map(self._one, text)) if self.many else self._one(text)

    def _one(self, text):
        if self.choices and text not in self.choices:
            words = f"must be one of {', '.join(self.choices)}{did_you_mean(text, self.choices)}"
            raise BadArgument(self.name, text, words)
        if self.kind in (bool, str):
            return text
        try:
            number = self.kind(text)
        except ValueError:
            words = "must be a whole number" if self.kind is int else "must be a finite number"
            raise BadArgument(self.name, text, words) from None
        require_size(**{self.name: number})
        return number


def options(function):
    hints = typing.get_type_hints(function)
    lines = re.findall(r"^\s*(\w+(?:, \w+)*) : (.+(?:\n {2,}\S.*)*)$", inspect.getdoc(function) or "", re.M)
    texts = {name: " ".join(text.split()) for names, text in lines for name in names.split(", ")}
    parameters = inspect.signature(function).parameters.values()
    return [
        Option(parameter, hints.get(parameter.name), texts.get(parameter.name, ""))
        for parameter in parameters
        if parameter.name != "out"
    ]


def parser(program, module, known):
    """Returns the parser of a command with these options."""
    head, _, rest = inspect.getdoc(module).partition("\n")
    command = OneLineParser(
        prog=program,
        description=_plain(head),
        epilog=_plain(rest.lstrip("=\n")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    for option in known:
        option.add_to(command)
    folder = getattr(module, "OUT", None)
    usual = f"default {folder}" if folder else "without it none are drawn"
    command.add_argument(
        "--json", metavar="FILE", help="one JSON object with the result (-: standard output)"
    )
    command.add_argument("--out", metavar="DIR", default=folder, help=f"folder for figures ({usual})")
    return command


def _plain(text):
    """A text without marks of RST."""
    return re.sub(r"(:\w+:)?`+([^`]+)`+", r"\2", text)


def run(program, module, words, setup=0.0):
    """Runs a command of a module, called `program`; returns the exit status. `setup` are the seconds of its
    import.
    """
    known = {option.name: option for option in options(module.solve)}
    top = parser(program, module, known.values())
    given, unknown = top.parse_known_args(words)
    if unknown:
        flags = [*map(flag, known), "--json", "--out", "--help"]
        top.error(f"unrecognized arguments: {' '.join(unknown)}{did_you_mean(unknown[0], flags)}")
    place = given.json
    try:
        arguments = {name: known[name].value(text) for name, text in vars(given).items() if name in known}
        if place not in (None, "-"):
            require_place(place, "json")
        folder = None if given.out is None else made_folder(given.out, "out")
        more = {"out": folder} if "out" in inspect.signature(module.solve).parameters else {}
        start = time.perf_counter()
        result = module.solve(**arguments, **more)
        seconds = {"setup": setup, "solve": time.perf_counter() - start}
        found = plain_data(module.to_dict(result) if hasattr(module, "to_dict") else result)
        found = found if isinstance(found, dict) else {"states": found}
        usual = {name: option.default for name, option in known.items()}
        resolved = plain_data(usual | arguments) | found.pop("parameters", {})
        entries = {"parameters": resolved, "versions": versions(), "seconds": seconds} | found
        if place != "-":
            print("\n".join(summary(module.table(result) if hasattr(module, "table") else found)))
        drawn = folder and hasattr(module, "figure")
        files = _draw(module, result, folder, program.split()[-1]) if drawn else []
        for sentence in dict.fromkeys(_warnings(entries)):
            print(f"warning: {sentence}", file=sys.stderr)
        text = json.dumps(entries, indent=1, allow_nan=False)
        if place == "-":  # after the figures: where they fail, nothing stands on standard output
            print(text)
        elif place:
            write_text(place, text + "\n", "json")
            files.append(place)
        if files and place != "-":
            print(f"wrote {', '.join(map(str, files))}", file=sys.stderr)
    except BadArgument as failure:
        named = [name for name in vars(given) if name in known]
        return _fail(2, program, _complaint(failure, known, named))
    except MicroblockError as failure:
        return _fail(1, program, failure)
    except KeyboardInterrupt as stop:  # with the status that shells give
        return _fail(130, program, str(stop) or "interrupted")
    except Exception as failure:  # of a script with its options, of NGSolve, of the machine
        place = traceback.extract_tb(failure.__traceback__)[-1]
        where = f"{Path(place.filename).name}, line {place.lineno}"
        return _fail(1, program, f"stopped by {type(failure).__name__} in {where}: {failure}")
    return 0


def _warnings(data):
    """Sentences of all lists named "warnings"."""
    if isinstance(data, dict):
        return [*(data.get("warnings") or ()), *_warnings([*data.values()])]
    return [words for part in data if isinstance(part, (dict, list)) for words in _warnings(part)]


def summary(entries, within=""):
    """Returns lines with the numbers and words of a result, and tables."""
    lines = []
    for name, value in entries.items():
        name = within + name
        if isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
            keys = dict.fromkeys(key for row in value for key, cell in row.items() if cell is not None)
            columns = [
                key for key in keys if not any(isinstance(row.get(key), (list, dict)) for row in value)
            ]
            cells = [columns, *([_shown(row.get(key)) for key in columns] for row in value)]
            widths = [max(len(line[place]) for line in cells) for place in range(len(columns))]
            lines += [name, *("  ".join(map(str.rjust, line, widths)).rstrip() for line in cells)]
        elif isinstance(value, dict):
            lines += summary(value, f"{name}.")
        elif _short(value):
            lines.append(f"{name}  {_shown(value)}")
    return lines


def _short(value):
    few = isinstance(value, list) and len(value) <= 7
    return few and all(map(_short, value)) or not isinstance(value, (list, dict))


def _shown(value):
    if isinstance(value, list):
        return " ".join(map(_shown, value)) or "-"
    return f"{value:.7g}" if isinstance(value, float) else "-" if value is None else shortened(str(value))


def _draw(module, result, folder, name):
    """Draws the figures of a result; returns the files."""
    from matplotlib import pyplot  # where something is drawn: other commands do without it

    from .view.plots import STYLE

    with pyplot.rc_context({**STYLE, "backend": "Agg"}):
        drawn = module.figure(result)
        figures = drawn if isinstance(drawn, dict) else {name: drawn}
        files = [folder / f"{name}.{ending}" for name in figures for ending in ("png", "pdf")]
        for file in files:
            with replacing(file, "out") as part:
                figures[file.stem].savefig(part, format=file.suffix[1:])
        pyplot.close("all")
    return files


def _complaint(failure, known, given):
    names = f"{failure.name}_deg", f"{failure.name}s"  # an angle in degrees, one of its loads
    near = [name for name in names if name in given] or given  # of one alone: the defaults are right
    near = near if len(near) == 1 else [name for name in names if name in known]
    name = failure.name if failure.name in (*known, "json", "out") else near[0] if near else None
    if name is None:
        return str(failure)
    value = failure.value if isinstance(failure.value, tuple) else (failure.value,)
    value = " ".join(shortened(one) if isinstance(one, str) else shown(one) for one in value).strip() or "''"
    value = value if name in (failure.name, f"{failure.name}s") else f"({failure.name} = {value})"
    return f"{flag(name)} {value}: {failure.allowed}"


def _fail(status, program, message):
    print(f"{program}: {' '.join(str(message).split())}", file=sys.stderr)
    return status
