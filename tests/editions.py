"""Two editions of the library run the same problems in turns: numbers, seconds and peak memory, side by side.

    python -m tests.editions COMMIT [COMMIT] --problem FILE|NAME[:SIZE] ... [--rounds N] [--at DIR]
    python -m tests.editions COMMIT --frozen [ROW OF THE TABLE'S PACKAGE ...]
    python -m tests.editions COMMIT --record FILE.csv [--weight SCRIPT]

An edition is a commit of the repository's own history, or "." for this checkout as it stands, which is the second
one where one is named. Its files lie below DIR (usually microblock/editions in the user's cache) and are taken
again. It shares the packages that this Python has where it asks for the same ones, else pip installs its own.

A problem is a file of Python that uses public names and leaves a dictionary `numbers`, or has a function `solve()`
that returns one; then `solve` alone is timed. NAME is one of `tests.edition_problems`. Every run is a process of
its own with one thread; seconds are the processor's, medians of the runs. Errors are numbers, too: their type and
their first line.
"""

import argparse
import ast
import csv
import json
import os
import runpy
import shutil
import statistics
import subprocess
import sys
import sysconfig
import tempfile
import venv
from configparser import ConfigParser
from dataclasses import dataclass
from pathlib import Path

from tests.edition_problems import BEGINNING, PROBLEMS

ROOT = Path(__file__).parents[1]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock" / "editions"
HERE = "."
RUN = """
import json, re, sys, time
scope, result = {"__name__": "problem"}, {}
source = sys.stdin.read()
def timed(call):
    start = time.process_time()
    value = call()
    result["seconds"] = time.process_time() - start
    return value
def plain(value):
    if hasattr(value, "tolist"):
        value = value.tolist()
    return list(map(plain, value)) if isinstance(value, (list, tuple)) else value
try:
    numbers = timed(lambda: exec(compile(source, "problem", "exec"), scope))
    numbers = timed(scope["solve"]) if "solve" in scope else scope["numbers"]
except Exception as error:
    numbers = {"error": f"{type(error).__name__}: {error}".splitlines()[0]}
result["numbers"] = {str(name): plain(value) for name, value in numbers.items()}
status = open("/proc/self/status").read()
result["MiB"] = int(re.search(r"VmHWM:\\s*(\\d+)", status)[1]) / 1024
result["library"] = getattr(sys.modules.get("microblock"), "__file__", None)
print(json.dumps(result))
"""


@dataclass(frozen=True)
class Edition:
    """The library of a commit: where its files are and the Python that runs them."""

    name: str
    root: Path
    python: Path

    def run(self, arguments, root=None, **options):
        """A finished process of the edition's Python, of one thread."""
        threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        environment = {
            **os.environ,
            **threads,
            "PYTHONPATH": str(root or self.root),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        return subprocess.run(
            [self.python, *arguments], env=environment, cwd=root or self.root, text=True, **options
        )

    def solve(self, text):
        """{"numbers", "seconds", "MiB"} of a problem's text, from a process of its own."""
        done = self.run(["-c", RUN], input=text, capture_output=True)
        if done.returncode:
            raise SystemExit(f"{self.name} ended with {done.returncode}: {done.stderr.strip()[-500:]}")
        result = json.loads(done.stdout.splitlines()[-1])
        library = result.pop("library")
        if library and not Path(library).is_relative_to(self.root):
            raise SystemExit(f"{self.name} took the library of {library}, not that of {self.root}")
        return result


def git(*arguments, **options):
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, **options)
    if done.returncode:
        raise SystemExit(f"git {' '.join(arguments)}: {done.stderr.decode().strip().splitlines()[-1]}")
    return done.stdout


def edition(commit, at=CACHE):
    """The Edition of a commit, made where it is not there yet."""
    at = Path(at).resolve()
    at.mkdir(parents=True, exist_ok=True)
    if commit == HERE:
        return Edition("this checkout", ROOT, _shared(at))
    known = subprocess.run(
        ["git", "rev-parse", "--verify", "-q", f"{commit}^{{commit}}"], cwd=ROOT, capture_output=True
    )
    if known.returncode:
        raise SystemExit(f"{commit} is no commit of {ROOT}")
    name = known.stdout.decode()[:12]
    place = at / name
    if not place.exists():
        with tempfile.TemporaryDirectory(dir=at) as half:
            subprocess.run(["tar", "-x", "-C", half], input=git("archive", name), check=True)
            shutil.copytree(half, place.with_suffix(f".{os.getpid()}"), symlinks=True)
        place.with_suffix(f".{os.getpid()}").rename(place)
    same = _required(place) == _required(ROOT)
    return Edition(name, place, _shared(at) if same else _installed(place))


def _required(root):
    """What an edition says that it needs."""
    read = ConfigParser()
    read.read(root / "setup.cfg")
    return sorted(read.get("options", "install_requires", fallback="none\n").split("\n"))


def _shared(at):
    """A Python that has the packages of this one, but not what is installed from a checkout."""
    place = at / f"shared{sys.version_info.major}.{sys.version_info.minor}"
    if not (place / "bin" / "python").exists():
        venv.create(place, symlinks=True)
    paths = sysconfig.get_paths()
    (packages,) = place.glob("lib/*/site-packages")
    (packages / "shared.pth").write_text("\n".join(sorted({paths["purelib"], paths["platlib"]})) + "\n")
    return place / "bin" / "python"


def _installed(place):
    """A Python with what the edition asks for."""
    python = place / ".venv" / "bin" / "python"
    if not python.exists():
        venv.create(place / ".venv", with_pip=True, symlinks=True)
        done = subprocess.run(
            [python, "-m", "pip", "install", "-q", f"{place}[test]"], capture_output=True, text=True
        )
        if done.returncode:
            shutil.rmtree(place / ".venv")
            raise SystemExit(f"pip could not install {place}: {done.stderr.strip().splitlines()[-1]}")
    return python


def text_of(problem):
    """{name: text} of a file, of a NAME:SIZE, or of the middle size of a NAME."""
    if Path(problem).is_file():
        return Path(problem).read_text()
    name, _, size = problem.partition(":")
    if name not in PROBLEMS:
        raise SystemExit(f"{problem} is no file, and no problem of {', '.join(PROBLEMS)}")
    return f"SIZE = {size or PROBLEMS[name][0][1]}\n{BEGINNING}{PROBLEMS[name][2]}"


def in_turns(editions, text, rounds):
    """[[a result of each edition] of each round], after one round that is not counted where there are more."""
    return [[one.solve(text) for one in editions] for _ in range(rounds)]


def leaves(value, name):
    if isinstance(value, list):
        for number, part in enumerate(value):
            yield from leaves(part, f"{name} {number}")
    else:
        yield name, value


def difference(old, new):
    """Relative difference of two numbers; 0 or inf of what is none."""
    if not all(isinstance(value, (int, float)) for value in (old, new)):
        return 0.0 if old == new else float("inf")
    return abs(new - old) / (max(abs(old), abs(new)) or 1.0)


def lines_of(results):
    """[(name, old, new, words on their difference)] of what `in_turns` gave of two editions."""
    old, new = (
        dict(leaf for name, value in result["numbers"].items() for leaf in leaves(value, name))
        for result in results[-1]
    )
    for name in old | new:
        one, other = old.get(name, "missing"), new.get(name, "missing")
        off = difference(one, other)
        yield name, one, other, "" if off == 0 else "differs" if off == float("inf") else f"off by {off:.1e}"
    for name in ("seconds", "MiB"):
        pairs = [[result[name] for result in round] for round in results]
        ratios = sorted(b / a for a, b in pairs)
        one, other = (statistics.median(values) for values in zip(*pairs))
        spread = f"{statistics.median(ratios):.3f} times ({ratios[0]:.3f} to {ratios[-1]:.3f} in {len(ratios)} rounds)"
        yield name, float(f"{one:.4g}"), float(f"{other:.4g}"), spread


def compare(editions, problems, rounds):
    for problem in problems:
        print(f"{problem:28}{editions[0].name:>24}{editions[1].name:>24}")
        for name, one, other, words in lines_of(in_turns(editions, text_of(problem), rounds)):
            print(f"  {name[:26]:26}{one!s:>24}{other!s:>24}  {words}", flush=True)


def frozen(old, arguments):
    """This checkout's table of frozen numbers beside what the old library computes; the table's exit status."""
    with tempfile.TemporaryDirectory() as place:
        for file in ROOT.iterdir():
            if file.name != "microblock" and not file.name.startswith("."):
                (Path(place) / file.name).symlink_to(file)
        (Path(place) / "microblock").symlink_to(old.root / "microblock")
        return old.run(["-m", "tests.frozen", *arguments], root=place).returncode


def weights(root, measure):
    """{(room, quantity): count} of the library, with `measure(file)` of the script of weights."""
    sums = {}
    for file in sorted((root / "microblock").rglob("*.py")):
        counted = measure(file)
        classes = sum(isinstance(node, ast.ClassDef) for node in ast.walk(ast.parse(file.read_text())))
        quantities = zip(("statements", "tokens", "constants", "literals"), (*counted[:3], counted[7]))
        for quantity, count in (*quantities, ("classes", classes)):
            for room in (
                "microblock",
                str(file.parent.relative_to(root)) + "/" * (file.parent.parent == root),
            ):
                sums[room, quantity] = sums.get((room, quantity), 0) + count
    return sums


def record(one, file, script, rounds):
    """Write the edition's weights, and seconds, peak memory and numbers of all problems, a row each."""
    rows = []
    if script:
        counts = weights(one.root, runpy.run_path(script)["measure"])
        rows = [(one.name, room, "", quantity, count) for (room, quantity), count in counts.items()]
    for name, (sizes, meaning, _) in PROBLEMS.items():
        for size in sizes:
            runs = [one.solve(text_of(f"{name}:{size}")) for _ in range(rounds)]
            print(f"{name:24}{meaning} {size:<10}", *(f"{run['seconds']:9.3f} s" for run in runs), flush=True)
            medians = {
                key: float(f"{statistics.median(run[key] for run in runs):.4g}") for key in ("seconds", "MiB")
            }
            rows += [
                (one.name, name, f"{meaning} {size}", *pair)
                for pair in (medians | runs[0]["numbers"]).items()
            ]
    with Path(file).open("w", newline="") as table:
        csv.writer(table, lineterminator="\n").writerows(
            [("edition", "of", "size", "quantity", "value"), *rows]
        )


def main(given=None):
    words = argparse.ArgumentParser(prog="python -m tests.editions", description=__doc__.split("\n")[0])
    words.add_argument("commits", nargs="+", metavar="COMMIT")
    words.add_argument("--problem", nargs="+", default=[])
    words.add_argument("--rounds", type=int, default=3)
    words.add_argument("--at", default=CACHE, metavar="DIR")
    words.add_argument("--frozen", nargs=argparse.REMAINDER, metavar="ARGUMENT of tests.frozen")
    words.add_argument("--record", metavar="FILE.csv")
    words.add_argument("--weight", metavar="SCRIPT")
    given = words.parse_args(given)
    editions = [edition(commit, given.at) for commit in given.commits]
    if given.record:
        record(editions[0], given.record, given.weight, given.rounds)
    if given.problem:
        compare([*editions, edition(HERE, given.at)][:2], given.problem, given.rounds)
    return frozen(editions[0], given.frozen) if given.frozen is not None else 0


if __name__ == "__main__":
    sys.exit(main())
