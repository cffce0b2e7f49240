"""Editions of the library, side by side."""

import math

import pytest

from tests import editions

PROBLEM = """
from pathlib import Path
import microblock as mb
solid = mb.Cosserat(E=100, nu=0.25, ell=0.1, beta=1)
numbers = {"mu": solid.mu, "pair": [1.0, solid.mu], "under": "editions" in Path(mb.__file__).parts}
"""


@pytest.fixture
def both(tmp_path):
    if not (editions.ROOT / ".git").exists():
        pytest.skip("no history here")
    return [editions.edition(commit, tmp_path / "editions") for commit in ("HEAD", editions.HERE)]


def test_a_commit_beside_this_checkout(both, tmp_path):
    file = tmp_path / "problem.py"
    file.write_text(PROBLEM)
    rows = {name: (old, new, words) for name, old, new, words in editions.compare(both, str(file), rounds=1)}
    assert rows["mu"] == (40.0, 40.0, "") and rows["pair 1"] == rows["mu"]
    assert rows["under"] == (True, False, "off by 1.0e+00")  # each took the library of its own files
    assert all(float(rows[name][0]) > 0 for name in ("seconds", "MiB"))
    file.write_text("def solve():\n    raise ValueError('no such load')")
    assert both[0].solve(file.read_text())["numbers"] == {"error": "ValueError: no such load"}


def test_differences_in_words():
    assert editions.difference(2.0, 2.0) == editions.difference("left", "left") == ""
    assert editions.difference(1.0, -1.0) == "off by 2.0e+00"
    assert editions.difference(1.0, math.nan) == "off by nan"
    assert editions.difference(1.0, None) == "differs"


@pytest.mark.parametrize("call", [editions.edition, editions.text_of])
def test_what_is_not_known_is_named(call):
    with pytest.raises(SystemExit, match="nothing of that name"):
        call("nothing of that name")


def test_every_problem_is_python():
    for name, (sizes, _, _) in editions.PROBLEMS.items():
        for size in sizes:
            compile(editions.text_of(f"{name}:{size}"), name, "exec")
