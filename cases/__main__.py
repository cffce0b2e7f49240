"""`python -m cases`: list the cases, or run one. Exit status 0, 2 for a bad argument, 1 for a failure."""

import os

# threads stall small dense work on busy cores; said before numpy, and tamaas, are first imported
for library in ("OPENBLAS", "OMP"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import json  # noqa: E402
import pkgutil  # noqa: E402
import sys  # noqa: E402
from argparse import RawDescriptionHelpFormatter  # noqa: E402
from importlib import import_module  # noqa: E402
from pathlib import Path  # noqa: E402

import cases  # noqa: E402
from cases.options import OneLineParser, add_options, complaint  # noqa: E402
from microblock.errors import BadArgument, MicroblockError  # noqa: E402
from microblock.study import check_writable, write_json  # noqa: E402


def modules(asked=None):
    """{name: module} of all cases, the modules here with `Parameters` and `run`; of the one asked for alone, sooner."""
    names, found = [entry.name for entry in pkgutil.iter_modules(cases.__path__) if entry.name != "__main__"], {}
    for name in [asked] if asked in names else names:
        module = import_module(f"cases.{name}")
        if hasattr(module, "Parameters") and hasattr(module, "run"):
            found[name] = module
    return found or modules()


def parser(known):
    top = OneLineParser(prog="python -m cases", description="Cases of the microblock contact model.")
    commands = top.add_subparsers(dest="case", metavar="CASE", parser_class=OneLineParser)
    for name, module in known.items():
        headline, _, text = module.__doc__.partition("\n")
        command = commands.add_parser(name, help=headline, description=headline, epilog=text.strip(),
                                      formatter_class=RawDescriptionHelpFormatter, allow_abbrev=False)
        add_options(command, module.Parameters)
        command.add_argument("--json", metavar="FILE", help="write the result as one JSON object (- for standard output)")
        command.add_argument("--out", metavar="DIR", help="folder for figures", default=getattr(module, "OUT", None))
    return top


def main(words=None):
    words = sys.argv[1:] if words is None else words
    known = modules(words[0] if words else None)
    arguments = vars(parser(known).parse_args(words))
    name, json_path, out = (arguments.pop(key, None) for key in ("case", "json", "out"))
    if name is None:
        for case, module in known.items():
            print(f"{case:12} {module.__doc__.partition(chr(10))[0]}")
        return 0
    module = known[name]
    try:
        parameters = module.Parameters(**arguments)
        if json_path not in (None, "-"):
            check_writable("json", json_path)
        out = None if out is None else _folder(out)
        result = module.run(parameters, out, quiet=json_path == "-")
        if json_path == "-":
            print(json.dumps(result, indent=1, allow_nan=False))
        elif json_path:
            write_json(json_path, result)
    except BadArgument as failure:
        return _fail(2, name, complaint(failure, module.Parameters))
    except MicroblockError as failure:
        return _fail(1, name, failure)
    except (MemoryError, OSError, RuntimeError) as failure:      # NGSolve's own are RuntimeErrors
        return _fail(1, name, f"stopped by {type(failure).__name__}: {failure}")
    return 0


def _folder(out):
    try:
        if not out:
            raise BadArgument("out", repr(out), "must name a folder")
        Path(out).mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise BadArgument("out", out, f"is no folder that can be made ({failure.strerror})") from failure
    check_writable("out", Path(out)/"figure")
    return Path(out)


def _fail(status, name, message):
    print(f"python -m cases {name}: {' '.join(str(message).split())}", file=sys.stderr)
    return status


def _silence_libraries():
    """Leave standard output to Python: what compiled libraries print there themselves is dropped."""
    sys.stdout.flush()
    sys.stdout = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    _silence_libraries()
    sys.exit(main())
