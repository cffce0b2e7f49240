"""`python -m cases`: list the cases, or run one. Exit status 0, 2 for a bad argument, 1 for a failure."""

import os

# threads stall small dense work on busy cores; said before numpy, and tamaas, are first imported
for library in ("OPENBLAS", "OMP"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import sys  # noqa: E402
from argparse import RawDescriptionHelpFormatter  # noqa: E402
from dataclasses import fields  # noqa: E402
from pathlib import Path  # noqa: E402

from microblock import __version__  # noqa: E402
from microblock.data.records import json_text, write_json  # noqa: E402
from microblock.errors import BadArgument, MicroblockError, require_place  # noqa: E402

from .common.case import run  # noqa: E402
from .common.catalog import PROGRAM, case, headlines  # noqa: E402
from .common.options import OneLineParser, add_options, complaint, did_you_mean, flag  # noqa: E402

LISTED = 8  # files that the last line names; of more it gives the number


def parser(asked, module):
    """The parser of the command line: of the case asked for with all its options, of others with their
    names.
    """
    top = OneLineParser(prog=PROGRAM, description="Cases of the microblock contact model.")
    top.add_argument("--version", action="version", version=f"microblock {__version__}")
    commands = top.add_subparsers(dest="case", metavar="CASE", parser_class=OneLineParser)
    for name, (_, headline) in headlines().items():
        if name != asked:
            commands.add_parser(name, help=headline)
            continue
        command = commands.add_parser(
            name,
            help=headline,
            description=headline,
            epilog=module.__doc__.partition("\n")[2].strip(),
            formatter_class=RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        add_options(command, module.Parameters)
        folder = f" (default {module.OUT})" if hasattr(module, "OUT") else "; without it none are written"
        command.add_argument(
            "--json", metavar="FILE", help="write the result as one JSON object (- for standard output)"
        )
        command.add_argument(
            "--out",
            metavar="DIR",
            default=getattr(module, "OUT", None),
            help="folder for figures and records" + folder,
        )
    return top


def parsed(asked, module, words):
    """{option: value} of the command line; one that is misspelt is answered with the nearest."""
    top = parser(asked, module)
    found, unknown = top.parse_known_args(words)
    if unknown:
        options = [flag(entry.name) for entry in fields(module.Parameters)] if found.case else []
        wrong = next((word for word in unknown if word.startswith("-")), unknown[0])
        known = [*options, "--json", "--out", "--help"]
        top.error(f"unrecognized arguments: {' '.join(unknown)}" + did_you_mean(wrong, known))
    return vars(found)


def main(words=None):
    words = sys.argv[1:] if words is None else words
    asked = words[0] if words else None
    module = case(asked)
    arguments = parsed(asked, module, words)
    name, json_path, out = (arguments.pop(key, None) for key in ("case", "json", "out"))
    if name is None:
        for one, (_, headline) in headlines().items():
            print(f"{one:12} {headline}")
        return 0
    try:
        parameters = module.Parameters(**arguments)
        if json_path not in (None, "-"):
            require_place(json_path, "json")
        out = None if out is None else _folder(out)
        before = _files(out)
        result = run(module, parameters, out, quiet=json_path == "-")
        if json_path == "-":
            print(json_text(result))
        elif json_path:
            write_json(json_path, result)
        if json_path != "-":
            print(_told(out, before, json_path), file=sys.stderr)
    except BadArgument as failure:
        return _fail(2, name, complaint(failure, module.Parameters))
    except MicroblockError as failure:
        return _fail(1, name, failure)
    # NGSolve's own are RuntimeErrors
    except (MemoryError, OSError, RuntimeError, ArithmeticError) as failure:
        return _fail(1, name, f"stopped by {type(failure).__name__}: {failure}")
    return 0


def _folder(out):
    try:
        if not out:
            raise BadArgument("out", repr(out), "must name a folder")
        Path(out).mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise BadArgument("out", out, f"is no folder that can be made ({failure.strerror})") from failure
    require_place(Path(out) / "figure", "out")
    return Path(out)


def _files(out):
    """{path: what changes when it is written} of a folder and the folders in it."""
    if out is None:
        return {}
    paths = [path for pattern in ("*", "*/*") for path in out.glob(pattern) if path.is_file()]
    return {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in paths}


def _told(out, before, json_path):
    """The last line: which files were written, or what to give for some."""
    after = _files(out)
    made = sorted(path for path in after if after[path] != before.get(path))
    names = [str(made[0]), *(str(path.relative_to(out)) for path in made[1:])] if made else []
    if len(names) > LISTED:
        names = [f"{len(names)} files in {out}"]
    wrote = f"wrote {', '.join([*names, *([json_path] if json_path else [])])}" if made or json_path else ""
    missing = "no figures: give --out DIR" if out is None else ""
    return "; ".join(words for words in (wrote, missing) if words) or "nothing written"


def _fail(status, name, message):
    print(f"{PROGRAM} {name}: {' '.join(str(message).split())}", file=sys.stderr)
    return status


def _silence_libraries():
    """Leave standard output to Python: what compiled libraries print there themselves is dropped."""
    sys.stdout.flush()
    sys.stdout = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    _silence_libraries()
    sys.exit(main())
