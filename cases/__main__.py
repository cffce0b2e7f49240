"""`python -m cases`: list the cases, or run one. Exit status 0, 2 for a bad argument, 1 for a failure,
130 after Ctrl-C.
"""

import os

# threads stall small dense work on busy cores; set before numpy, and tamaas, are first imported
for library in ("OPENBLAS", "OMP"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import re  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from importlib import import_module  # noqa: E402
from pathlib import Path  # noqa: E402

PROGRAM = "python -m cases"


def cases():
    """{name: (dotted module, headline)} of all cases, read from their files: nothing is imported."""
    modules = {}
    # a command of the contract goes before the script of its name
    for folder in ("commands", "", "paper"):
        for path in sorted((Path(__file__).parent / folder).glob("[!_]*.py")):
            text = path.read_text()
            if (
                re.search(r"^(def solve\(|from .* import .*\bsolve\b)", text, re.M)
                and path.stem not in modules
            ):
                module = ".".join(filter(None, ("cases", folder, path.stem)))
                modules[path.stem] = module, re.match(r'"""\s*(.*?)("""|\n)', text)[1]
    return modules


def main(words=None):
    """Run the case that the words name; the exit status."""
    from microblock.command import did_you_mean, run

    words = sys.argv[1:] if words is None else words
    modules = cases()
    if not words or words[0] in ("-h", "--help"):
        print("\n".join(f"{name:12} {headline}" for name, (_, headline) in modules.items()))
        return 0
    if words[0] not in modules:
        print(f"{PROGRAM}: {words[0]}: no such case{did_you_mean(words[0], modules)}", file=sys.stderr)
        return 2
    start = time.perf_counter()
    module = import_module(modules[words[0]][0])
    return run(f"{PROGRAM} {words[0]}", module, words[1:], time.perf_counter() - start)


def _silence_libraries():
    """Leave standard output to Python: what compiled libraries print there themselves is dropped."""
    sys.stdout.flush()
    sys.stdout = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


if __name__ == "__main__":
    _silence_libraries()
    try:
        from microblock.command import quiet

        sys.exit(quiet(main)())
    except KeyboardInterrupt:  # before a case began
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        sys.exit(130)
