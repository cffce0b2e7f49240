"""python -m tests.editions: see `tests.editions`."""

import argparse

from . import CACHE, HERE, __doc__, compare, edition, frozen

words = argparse.ArgumentParser(
    "python -m tests.editions", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
words.add_argument("commits", nargs="+", metavar="COMMIT")
words.add_argument("--problem", nargs="+", default=[], metavar="FILE|NAME[:SIZE]")
words.add_argument("--rounds", type=int, default=3, metavar="N", help="runs of each, in turns")
words.add_argument("--at", default=CACHE, metavar="DIR", help="where editions are kept")
words.add_argument("--frozen", nargs="*", metavar="ROOM", help="rows of the frozen table that differ")
given = words.parse_args()
editions = [edition(commit, given.at) for commit in (*given.commits, HERE)[:2]]
for problem in given.problem:
    print(f"{problem:26}" + "".join(f"{one.name:>24}" for one in editions))
    for name, one, other, differ in compare(editions, problem, given.rounds):
        print(f"  {name[:24]:24}{one!s:>24}{other!s:>24}  {differ}", flush=True)
for room in () if given.frozen is None else frozen(editions[0], given.frozen):
    print(room, flush=True)
