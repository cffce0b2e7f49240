"""Digests: equal for what is equal, different for what makes a different result."""

import subprocess
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

import microblock as mb
from microblock.provenance import File, digest, foreign, sources


def scaled(factor):
    def inner(x):
        return factor*x
    return inner


def script(body, argument="f"):
    """The digest of something as a script of its own defines it."""
    names = {"__name__": "__main__", "digest": digest}
    exec(f"{body}\nfound = digest({argument})", names)
    return names["found"]


def test_values_are_told_apart():
    values = [1, 1.0, True, None, "1", (1,), [1], {"a": 1}, {"a": 2}, {"b": 1}, np.ones(1), np.ones(2), np.zeros(1), 1 + 3e-16,
              mb.Cylinder(1.0), mb.Cylinder(2.0), mb.Microblock(), mb.Unilateral(), mb.HalfPlane(mb.Cosserat(1, 0.3, 0.1, beta=1)),
              mb.HalfPlane(mb.Cosserat(1, 0.3, 0.1, beta=0.5)), scaled, scaled(1), scaled(2), partial(scaled, 1),
              partial(scaled, 2), lambda: 1, lambda: 2, np.sin, np.cos, abs, np.linalg]
    assert len({digest(value) for value in values}) == len(values)
    assert digest(np.float64(0.1)) == digest(0.1) and digest(scaled(1)) == digest(scaled(1))


def test_code_of_scripts_counts_without_comments_docstrings_and_places():
    plain = ('def g(x):\n "g"\n return x\nC = {"a": 1}\n'
             'def f(x):\n "f"\n return [C[y] + g(y) for y in x if y in {"a", "bc", "de"}]')
    same = ('"""A script."""\nunused = 3\ndef g(x):\n "What it is."\n return x   # a comment\n'
            'def f(x):\n "What it does."\n return [C[y] + g(y) for y in x if y in {"a", "bc", "de"}]\nC = {"a": 1}')
    assert script(plain) == script(same)
    code = f"from microblock.provenance import digest\n{plain}\nprint(digest(f))"
    elsewhere = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert elsewhere.split() == [script(plain)]      # where texts are hashed in another order
    for old, new in (("C[y] +", "C[y] -"), ('"a": 1', '"a": 2'), ("return x\n", "return 2*x\n"), ('"bc"', '"b"')):
        assert script(plain.replace(old, new)) != script(plain)
    kind = "class K:\n def __init__(self, x):\n  self.x = x\n def twice(self):\n  return 2*self.x"
    assert len({script(kind, "K(1)"), script(kind, "K(2)"), script(kind.replace("2*", "3*"), "K(1)")}) == 3


def test_modules_count_with_what_they_import(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    for name, text in (("far", "VALUE = 1\n"), ("near", "def f():\n    from far import VALUE\n    return VALUE\n"),
                       ("aside", "VALUE = 1\n")):
        (tmp_path/f"{name}.py").write_text(text)
    before = sources("near")
    (tmp_path/"aside.py").write_text("VALUE = 2\n")
    (tmp_path/"far.py").write_text('"""Told."""\n\nVALUE = 1      # why\n')
    assert sources("near") == before
    (tmp_path/"far.py").write_text("VALUE = 2\n")
    assert sources("near") != before


def test_files_count_by_their_content(tmp_path):
    one, other = (File(tmp_path/name) for name in ("one.csv", "other.csv"))
    assert one.content is None and digest(one) == digest(other)      # of no file: it can be told, and nothing raises
    for file in (one, other):
        file.path.write_text("a,b\n")
    before = digest(one)
    assert before == digest(other) != digest(one.path)
    one.path.write_text("a,c\n")      # as long as before
    assert digest(one) != before
    assert digest(lambda: one) != digest(lambda: other)      # held by a function


def test_installed_packages_count_by_their_version():
    assert all(foreign(name) for name in ("json", "numpy.linalg", "ngsolve")) and not foreign("microblock.scene")


@dataclass
class Holder:
    what: object


def test_what_cannot_be_told_apart_is_refused():
    ring = Holder(None)
    ring.what = ring
    for value in (object(), Holder(object()), ring):
        with pytest.raises(mb.BadArgument):
            digest(value)
