"""Two editions of the library run the same problems in turns: numbers, seconds and peak memory, side by side.

    python -m tests.editions COMMIT [COMMIT] --problem FILE|NAME[:SIZE] ... [--rounds N] [--at DIR]
    python -m tests.editions COMMIT --frozen [ROOM ...]
    python -m tests.editions COMMIT --record FILE.csv --weight SCRIPT

An edition is a commit of the repository's own history, or "." for this checkout as it stands, which is the
second one unless one is named. Its files lie below DIR (usually microblock/editions in the user's cache) and
are used again. It shares the packages of this Python if it asks for the same ones, else pip installs its own.

A problem is a file of Python that uses public names and leaves a dictionary `numbers`, or has a function
`solve()` that returns one; then `solve` alone is timed. NAME is one of `tests.editions.problems`. Every run
is a process of its own with one thread; seconds are the processor's. An error is a number, too: its type and
its first line.
"""

import ast
import csv
import json
import os
import runpy
import shutil
import subprocess
import sysconfig
import tempfile
import venv
from configparser import ConfigParser
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .problems import BEGINNING, END, PROBLEMS

ROOT = Path(__file__).parents[2]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock" / "editions"
HERE = "."
THREADS = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
ROOM = """
import sys
from tests.frozen import Room
rows = Room(sys.argv[1]).compared()
wrong = sorted((row for row in rows if not row.agrees), key=lambda row: row.kind)
print(*wrong, f"{sys.argv[1]}: {len(wrong)} of {len(rows)} rows differ", sep="\\n")
"""


@dataclass(frozen=True)
class Edition:
    """The library of a commit: where its files are and the Python that runs them."""

    name: str
    root: Path
    python: Path

    def run(self, *arguments, root=None, text=""):
        """A finished process of the edition's Python."""
        paths = {"PYTHONPATH": str(root or self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        return subprocess.run(
            [self.python, *arguments],
            env=os.environ | THREADS | paths,
            cwd=root or self.root,
            input=text,
            text=True,
            capture_output=True,
        )

    def solve(self, text):
        """{"numbers", "seconds", "MiB"} of a problem's text, from a process of its own."""
        done = self.run(Path(__file__).with_name("run.py"), text=text)
        if done.returncode:
            raise SystemExit(f"{self.name} ended with {done.returncode}: {done.stderr.strip()[-500:]}")
        result = json.loads(done.stdout.splitlines()[-1])
        library = result.pop("library")
        if library and not Path(library).is_relative_to(self.root):
            raise SystemExit(f"{self.name} took the library {library}, not that of {self.root}")
        return result


def edition(commit, at=CACHE):
    """The Edition of a commit, made where it is not there yet."""
    at = Path(at).resolve()
    at.mkdir(parents=True, exist_ok=True)
    if commit == HERE:
        return Edition("this checkout", ROOT, _shared(at))
    command = ["git", "rev-parse", "--verify", "-q", f"{commit}^{{commit}}"]
    known = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if known.returncode:
        raise SystemExit(f"{commit} is no commit of {ROOT}")
    name = known.stdout[:12]
    place = at / name
    if not place.exists():
        archive = subprocess.run(["git", "archive", name], cwd=ROOT, capture_output=True, check=True)
        half = tempfile.mkdtemp(dir=at)
        subprocess.run(["tar", "-x", "-C", half], input=archive.stdout, check=True)
        os.rename(half, place)  # whole, or not at all
    same = _required(place) == _required(ROOT)
    return Edition(name, place, _shared(at) if same else _installed(place))


def _required(root):
    """What an edition says that it needs."""
    read = ConfigParser()
    read.read(root / "setup.cfg")
    return sorted(read.get("options", "install_requires", fallback="").split("\n"))


def _shared(at):
    """A Python that has the packages of this one, but not what is installed from a checkout."""
    place, paths = at / "shared", sysconfig.get_paths()
    if not place.exists():
        venv.create(place, symlinks=True)
    (packages,) = place.glob("lib/*/site-packages")
    (packages / "shared.pth").write_text("\n".join({paths["purelib"], paths["platlib"]}))
    return place / "bin" / "python"


def _installed(place):
    """A Python with what the edition asks for."""
    home = place / ".venv"
    if not home.exists():
        venv.create(home, with_pip=True, symlinks=True)
        command = [home / "bin" / "pip", "install", "-q", f"{place}[test]"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            shutil.rmtree(home)
            raise SystemExit(f"pip could not install {place}: {done.stderr.strip().splitlines()[-1]}")
    return home / "bin" / "python"


def text_of(problem):
    """The text of a file, of a NAME:SIZE, or of the middle size of a NAME."""
    if Path(problem).is_file():
        return Path(problem).read_text()
    name, _, size = problem.partition(":")
    if name not in PROBLEMS:
        raise SystemExit(f"{problem} is no file, and none of the problems {'; '.join(PROBLEMS)}")
    sizes, _, text = PROBLEMS[name]
    return f"SIZE, LEAST = {size or sizes[1]}, {sizes[0]}\n{BEGINNING}{text}{END}"


def difference(old, new):
    """In words: relative difference of two numbers, or that others differ."""
    if old == new:
        return ""
    if not all(isinstance(value, (int, float)) for value in (old, new)):
        return "differs"
    return f"off by {abs(new - old) / max(abs(old), abs(new)):.1e}"


def compare(editions, problem, rounds):
    """(name, old, new, words on their difference) of what two editions give in turns."""
    text = text_of(problem)
    results = [[one.solve(text) for one in editions] for _ in range(rounds)]
    old, new = (result["numbers"] for result in results[-1])
    for name in old | new:
        pair = old.get(name, "missing"), new.get(name, "missing")
        yield name, *pair, difference(*pair)
    for name in ("seconds", "MiB"):
        pairs = [[result[name] for result in both] for both in results]
        ratios = sorted(b / a for a, b in pairs)
        spread = f"{median(ratios):.3f} times ({ratios[0]:.3f} to {ratios[-1]:.3f})"
        yield name, *(f"{median(values):.4g}" for values in zip(*pairs)), spread


def frozen(old, rooms):
    """Rows of this checkout's table of frozen numbers that an old library computes otherwise, by kind.

    Problems and rows are those of this checkout; what knows the names of a library is that of the edition.
    """
    with tempfile.TemporaryDirectory() as place:
        for file in ROOT.glob("[!.]*"):
            source = old.root if file.name in ("microblock", "cases") else ROOT
            if file.name != "tests":
                Path(place, file.name).symlink_to(source / file.name)
        tests = shutil.copytree(ROOT / "tests", Path(place, "tests"))
        for names in (old.root / "tests" / "frozen").glob("library*.py"):
            shutil.copy(names, tests / "frozen")
        for room in rooms or sorted(file.stem for file in (ROOT / "tests/frozen/rooms").glob("*.csv")):
            done = old.run("-c", ROOM, room, root=place)
            yield done.stdout.strip() or f"{room}: {done.stderr.strip().splitlines()[-1]}"


def weights(root, measure):
    """{(room, quantity): count} of the library, with `measure(file)` of the script of weights."""
    sums = {}
    for file in sorted((root / "microblock").rglob("*.py")):
        statements, tokens, constants, *_, literals, _ = measure(file)
        classes = sum(isinstance(node, ast.ClassDef) for node in ast.walk(ast.parse(file.read_text())))
        counts = dict(
            statements=statements, tokens=tokens, constants=constants, literals=literals, classes=classes
        )
        for quantity, count in counts.items():
            for room in ("all", file.parent.name):
                sums[room, quantity] = sums.get((room, quantity), 0) + count
    return sums


def record(one, file, script, rounds):
    """Write the edition's weights, and seconds, peak memory and numbers of all problems at all sizes."""
    counts = weights(one.root, runpy.run_path(script)["measure"])
    rows = [(one.name, room, "", quantity, count) for (room, quantity), count in counts.items()]
    for name, (sizes, meaning, _) in PROBLEMS.items():
        for size in sizes:
            runs = [one.solve(text_of(f"{name}:{size}")) for _ in range(rounds)]
            values = {key: f"{median(run[key] for run in runs):.4g}" for key in ("seconds", "MiB")}
            rows += [
                (one.name, name, f"{meaning} {size}", *pair) for pair in (values | runs[0]["numbers"]).items()
            ]
            print(f"{name:24}{meaning} {size:<8} {values['seconds']} s, {values['MiB']} MiB", flush=True)
    with Path(file).open("w", newline="") as table:
        writer = csv.writer(table, lineterminator="\n")
        writer.writerows([("edition", "of", "size", "quantity", "value"), *rows])
