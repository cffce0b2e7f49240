"""Two editions of the library run the same problems in turns: numbers, seconds and peak memory, side by side.

    python -m tests.editions COMMIT [COMMIT] --problem FILE|NAME[:SIZE] ... [--rounds N] [--at DIR]
    python -m tests.editions COMMIT --frozen [ROOM ...]

An edition is a commit of the repository's own history, or "." for this checkout as it stands, which is the
second one unless one is named. Its files lie below DIR (usually microblock/editions in the user's cache) and
are used again. It shares the packages of this Python if it asks for the same ones, else pip installs its own.

A problem is a file of Python that uses public names and leaves a dictionary `numbers`, or has a function
`solve()` that returns one; then `solve` alone is timed. NAME is one of `tests.editions.problems`. Every run
is a process of its own with one thread; seconds are the processor's. An error is a number, too: its type and
its first line.
"""

import json
import os
import shutil
import subprocess
import sysconfig
import tempfile
import venv
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .problems import BEGINNING, END, PROBLEMS

ROOT = Path(__file__).parents[2]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock" / "editions"
HERE = "."
ROOM = """
import sys
from tests.frozen import Room
rows = Room(sys.argv[1]).compared()
wrong = sorted((row for row in rows if not row.agrees), key=lambda row: row.kind)
print(*wrong, f"{sys.argv[1]}: {len(wrong)} of {len(rows)} rows differ", sep="\\n")
"""


@dataclass(frozen=True)
class Edition:
    """The library of a commit: where its files are and the Python that runs them, which knows no other."""

    name: str
    root: Path
    python: Path

    def run(self, *arguments, root=None, text=""):
        """A finished process of the edition's Python."""
        threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        paths = {"PYTHONPATH": str(root or self.root), "PYTHONDONTWRITEBYTECODE": "1"}
        more = {"cwd": root or self.root, "input": text, "text": True, "capture_output": True}
        return subprocess.run([self.python, *arguments], env=os.environ | threads | paths, **more)

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
    python, paths = Path(at) / "shared" / "bin" / "python", sysconfig.get_paths()
    if not python.exists():
        venv.create(python.parents[1], symlinks=True)
    # a Python that has the packages of this one, but not what is installed from a checkout
    (packages,) = python.parents[1].glob("lib/*/site-packages")
    (packages / "shared.pth").write_text("\n".join({paths["purelib"], paths["platlib"]}))
    if commit == HERE:
        return Edition("this checkout", ROOT, python)
    command = ["git", "rev-parse", "--verify", "-q", f"{commit}^{{commit}}"]
    known = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if known.returncode:
        raise SystemExit(f"{commit} is no commit of {ROOT}")
    name = known.stdout[:12]
    if not (place := Path(at) / name).exists():
        half = tempfile.mkdtemp(dir=at)
        archive = subprocess.run(["git", "archive", name], cwd=ROOT, capture_output=True, check=True)
        subprocess.run(["tar", "-x", "-C", half], input=archive.stdout, check=True)
        os.rename(half, place)  # whole, or not at all
    return Edition(name, place.resolve(), python.absolute())


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
    numbers = all(isinstance(value, (int, float)) for value in (old, new))
    off = f"off by {abs(new - old) / max(abs(old), abs(new)):.1e}" if numbers and old != new else "differs"
    return "" if old == new else off


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
