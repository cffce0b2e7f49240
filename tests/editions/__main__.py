"""python -m tests.editions: see `tests.editions`."""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

from . import __doc__
from .problems import BEGINNING, END, PROBLEMS

ROOT = Path(__file__).parents[2]
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "microblock" / "editions"


def git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def edition(commit, at):
    """The folder of a commit's files, checked out where it is not there yet; of "." that of this checkout."""
    if commit == ".":
        return ROOT
    place = Path(at).resolve() / git("rev-parse", "--verify", f"{commit}^{{commit}}")[:12]
    if not place.exists():
        git("worktree", "prune")
        git("worktree", "add", "--detach", str(place), commit)
    return place


def solved(root, text):
    """{"numbers", "seconds", "MiB"} of a problem's text, from a process of its own."""
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
    environment = os.environ | threads | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, Path(__file__).with_name("run.py")]
    done = subprocess.run(command, cwd=root, env=environment, input=text, text=True, capture_output=True)
    result = json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {"library": "none"}
    if not Path(result.pop("library")).is_relative_to(root):
        raise SystemExit(f"{root} did not run: {done.stderr.strip()[-500:]}")
    return result


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


def compared(roots, problem, rounds):
    """(name, old, new, words on their difference) of what two editions give in turns."""
    results = [[solved(root, text_of(problem)) for root in roots] for _ in range(rounds)]
    old, new = (result["numbers"] for result in results[-1])
    for name in old | new:
        pair = old.get(name, "missing"), new.get(name, "missing")
        yield name, *pair, difference(*pair)
    for name in ("seconds", "MiB"):
        pairs = [[result[name] for result in both] for both in results]
        ratios = sorted(b / a for a, b in pairs)
        spread = f"{median(ratios):.3f} times ({ratios[0]:.3f} to {ratios[-1]:.3f})"
        yield name, *(f"{median(values):.4g}" for values in zip(*pairs)), spread


words = argparse.ArgumentParser(
    "python -m tests.editions", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
words.add_argument("commits", nargs="+", metavar="COMMIT")
words.add_argument("--problem", nargs="+", default=[], metavar="FILE|NAME[:SIZE]")
words.add_argument("--rounds", type=int, default=3, metavar="N", help="runs of each, in turns")
words.add_argument("--at", default=CACHE, metavar="DIR", help="where editions are kept")
given = words.parse_args()
roots = [edition(commit, given.at) for commit in (*given.commits, ".")[:2]]
for problem in given.problem:
    print(f"{problem:26}" + "".join(f"{root.name:>24}" for root in roots))
    for name, one, other, differ in compared(roots, problem, given.rounds):
        print(f"  {name[:24]:24}{one!s:>24}{other!s:>24}  {differ}", flush=True)
