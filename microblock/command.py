"""Functions as commands: options from the signature of a function, one JSON object, figures, and exit
statuses: 0 done, 2 for a bad argument, 1 for a computation that failed, 130 after Ctrl-C.

A command is a module with ``solve(**options)``; default values or annotations give the types of its options,
the section "Parameters" of its docstring a line each. The module may have ``figure(result)``, a figure or
{name: figure}; ``to_dict(result)`` for JSON; ``table(result)`` for what is printed; a `solve` that writes
files takes their folder as `out`. Lists named "warnings" go to standard error.
"""

import argparse
import inspect
import json
import os
import re
import sys
import time
import traceback
import types
import typing
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import wraps
from pathlib import Path
from typing import Any, NoReturn

from .data.records import cell_value, versions, write_text
from .errors import (
    BadArgument,
    MicroblockError,
    made_folder,
    replacing,
    require,
    require_place,
    require_size,
    shortened,
)
from .model.results import plain_data

Main = Callable[[list[str] | None], int]


def quiet(main: Main) -> Callable[..., int]:
    """Returns a main that ends with the status of shells, and no words, where nobody reads its output on."""

    @wraps(main)
    def ended(words: list[str] | None = None) -> int:
        try:
            try:
                return main(words)
            finally:
                sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more
            return 141  # of SIGPIPE, which Windows does not know

    return ended


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line, and exit status 2."""

    def error(self, message: str) -> NoReturn:
        if message.endswith("expected one argument"):
            message += "; a value that begins with - is written --NAME=VALUE"
        self.exit(2, f"{self.prog}: {message}\n")


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """Returns a question after an unknown word, or nothing."""
    return "".join(f": did you mean {near}?" for near in get_close_matches(word, list(choices), n=1))


def flag(name: str) -> str:
    return "--" + name.replace("_", "-")


@dataclass
class Option:
    """A parameter of a function as an option: the type of its values, their number (None: one, "+": any),
    and words to choose from.
    """

    name: str
    default: Any
    text: str
    kind: type
    many: int | str | None = None
    choices: tuple[str, ...] = ()

    def value(self, text: Any) -> Any:
        """Returns the value of a text or a list of texts; raises BadArgument if it is none."""
        if isinstance(text, list):
            return tuple(map(self.value, text))
        if self.choices and text not in self.choices:
            words = f"must be one of {', '.join(self.choices)}{did_you_mean(text, self.choices)}"
            raise BadArgument(self.name, text, words)
        if self.kind not in (int, float):
            return text
        value = cell_value(text)
        require(self.kind is float or type(value) is int, self.name, text, "must be a whole number")
        require_size(**{self.name: value})
        return self.kind(value)


def options(function: Callable[..., Any]) -> dict[str, Option]:
    """Returns {name: option} of a function, by the types of its parameters or of their default values."""
    hints = typing.get_type_hints(function)
    lines = re.findall(r"^\s*(\w+(?:, \w+)*) : (.+(?:\n {2,}\S.*)*)$", inspect.getdoc(function) or "", re.M)
    texts = {name: " ".join(text.split()) for names, text in lines for name in names.split(", ")}
    return {
        name: _option(parameter, hints.get(name, type(parameter.default)), texts.get(name, ""))
        for name, parameter in inspect.signature(function).parameters.items()
        if name != "out"
    }


def _option(parameter: inspect.Parameter, hint: Any, text: str) -> Option:
    """Returns the option of a parameter with a type, which is optional or not, and words on it."""
    name = parameter.name
    default = parameter.default
    if types.NoneType in typing.get_args(hint):
        hint, _ = typing.get_args(hint)
    kinds = typing.get_args(hint)
    family = typing.get_origin(hint) or hint
    if family is typing.Literal:
        return Option(name, default, text, str, choices=kinds)
    if family is not tuple:
        return Option(name, default, text, family)
    many = "+" if not kinds or ... in kinds else len(kinds)
    return Option(name, default, text, kinds[0] if kinds else type(default[0]), many)


def parser(program: str, module: Any, offered: Iterable[Option]) -> OneLineParser:
    """Returns the parser of a command with options, which leaves values as texts."""
    head, _, body = (inspect.getdoc(module) or "").partition("\n")
    command = OneLineParser(
        prog=program,
        description=_plain(head),
        epilog=_plain(body.lstrip("=\n")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,
        allow_abbrev=False,
    )
    for option in offered:
        text = option.text
        short = option.name.rpartition("_")[2].upper()
        form: dict[str, Any] = {"nargs": option.many, "metavar": "|".join(option.choices) or short}
        if option.many == "+":  # an option that is repeated adds to what it had
            form["action"] = "extend"
        if option.kind is bool:
            form = {"action": "store_true"}
        elif option.default not in (None, ()):
            default = option.default if option.many else (option.default,)
            text += f" (default {' '.join(map(str, default))})"
        command.add_argument(flag(option.name), help=text.replace("%", "%%"), **form)
    result = "one JSON object with the result (-: standard output)"
    command.add_argument("--json", metavar="FILE", default=None, help=result)
    command.add_argument("--out", metavar="DIR", default=None, help="folder for figures, else none are drawn")
    return command


def _plain(text: str) -> str:
    """Returns a text without marks of RST."""
    return re.sub(r"(:\w+:)?`+([^`]+)`+", r"\2", text)


def run(program: str, module: Any, words: list[str] | None, setup: float = 0.0) -> int:
    """Runs a command of a module, called `program`; returns the exit status. `setup` are the seconds of its
    import.
    """
    offered = options(module.solve)
    top = parser(program, module, offered.values())
    namespace, unknown = top.parse_known_args(words)
    if unknown:
        flags = [*map(flag, offered), "--json", "--out", "--help"]
        top.error(f"unrecognized arguments: {' '.join(unknown)}{did_you_mean(unknown[0], flags)}")
    texts = vars(namespace)
    place = texts.pop("json")
    out = texts.pop("out")
    message: object
    try:
        arguments = {
            name: option.value(texts[name]) if name in texts else option.default
            for name, option in offered.items()
        }
        if place not in (None, "-"):
            require_place(place, "json")
        folder = None if out is None else made_folder(out, "out")
        _answer(program, module, arguments, place, folder, setup)
        return 0
    except BadArgument as failure:
        status = 2
        message = _complaint(failure, [*offered], [*texts])
    except MicroblockError as failure:
        status = 1
        message = failure
    except BrokenPipeError:
        raise
    except KeyboardInterrupt as stop:  # with the status that shells give
        status = 130
        message = str(stop) or "interrupted"
    except Exception as failure:  # of a script with its options, of NGSolve, of the machine
        frame = traceback.extract_tb(failure.__traceback__)[-1]
        where = f"{Path(frame.filename).name}, line {frame.lineno}"
        status = 1
        message = f"stopped by {type(failure).__name__} in {where}: {failure}"
    print(f"{program}: {' '.join(str(message).split())}", file=sys.stderr)
    return status


def _answer(
    program: str, module: Any, arguments: dict[str, Any], place: str | None, folder: Path | None, setup: float
) -> None:
    """Solves, prints and writes."""
    places = {"out": folder} if "out" in inspect.signature(module.solve).parameters else {}
    start = time.perf_counter()
    result = module.solve(**arguments, **places)
    seconds = {"setup": setup, "solve": time.perf_counter() - start}
    data = plain_data(module.to_dict(result) if hasattr(module, "to_dict") else result)
    if not isinstance(data, dict):
        data = {"states": data}
    resolved = plain_data(arguments) | data.pop("parameters", {})
    entries = {"parameters": resolved, "versions": versions(), "seconds": seconds} | data
    text = json.dumps(entries, indent=1, allow_nan=False)
    warnings: list[str] = []
    # lists of that name, wherever they stand
    json.loads(text, object_hook=lambda entry: warnings.extend(entry.get("warnings") or ()))
    if place != "-":
        print("\n".join(summary(module.table(result) if hasattr(module, "table") else data)))
    files: list[Any] = []
    if folder and hasattr(module, "figure"):
        files = _draw(module, result, folder, program.split()[-1])
    for sentence in dict.fromkeys(warnings):
        print(f"warning: {sentence}", file=sys.stderr)
    if place == "-":  # after the figures: where they fail, nothing stands on standard output
        print(text)
        return
    if place:
        write_text(place, text + "\n", "json")
        files.append(place)
    if files:
        print(f"wrote {', '.join(map(str, files))}", file=sys.stderr)


def summary(entries: dict[str, Any], within: str = "") -> list[str]:
    """Returns lines with the numbers and words of a result, and tables."""
    lines: list[str] = []
    for name, value in entries.items():
        if isinstance(value, dict):
            lines += summary(value, f"{within}{name}.")
        elif isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
            rows = [{key: _shown(cell) for key, cell in row.items()} for row in value]
            columns = [key for key in rows[0] if all(row.get(key) for row in rows)]
            cells = [columns, *([row[key] for key in columns] for row in rows)]
            widths = [max(map(len, column)) for column in zip(*cells)]
            lines += [within + name, *("  ".join(map(str.rjust, line, widths)) for line in cells)]
        elif shown := _shown(value):
            lines.append(f"{within}{name}  {shown}")
    return lines


def _shown(value: Any) -> str:
    """Returns a number, a word, or a list of few of them; nothing of what is longer."""
    if isinstance(value, list):
        entries = [_shown(entry) for entry in value[:8]]
        return (" ".join(entries) or "-") if all(entries) and len(entries) < 8 else ""
    if isinstance(value, dict):
        return ""
    if value is None:
        return "-"
    return f"{value:.7g}" if isinstance(value, float) else shortened(str(value))


def _draw(module: Any, result: Any, folder: Path, name: str) -> list[Path]:
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


def _complaint(failure: BadArgument, offered: list[str], asked: list[str]) -> object:
    """Returns the sentence of a BadArgument, after the option that it is about, of those that a command
    offers and those that were asked for.
    """
    names = failure.name, f"{failure.name}_deg", f"{failure.name}s"  # an angle in degrees, one of its loads
    near = [name for name in names if name in (*offered, "json", "out")]
    if failure.name not in near and len(asked) == 1:  # of one alone: the defaults are right
        near = asked
    return f"{flag(near[0])}: {failure}" if near else failure
