"""Digests: equal for what is equal, different for what makes a different result."""

import inspect
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import microblock as mb
from microblock.data.provenance import content, digest

SOLID = mb.Cosserat(1, 0.3, 0.1, beta=1)


def scaled(factor):
    def inner(x):
        return factor * x

    return inner


def script(body):
    """The digest of a function f as a script of its own defines it."""
    names = {"__name__": "__main__"}
    exec(body, names)
    return digest(names["f"])


def test_values_are_told_apart():
    values = [
        1,
        1.0,
        True,
        None,
        "1",
        (1,),
        [1],
        {"a": 1},
        {"a": 2},
        {"b": 1},
        {1: 1},
        {"1": 1},
        np.ones(1),
        np.ones(2),
        np.zeros(1),
        1 + 3e-16,
        mb.Cylinder(1.0),
        mb.Cylinder(2.0),
        mb.Microblock(),
        mb.Unilateral(),
        mb.HalfPlane(SOLID),
        mb.HalfPlane(mb.Cosserat(1, 0.3, 0.1, beta=0.5)),
        scaled,
        scaled(1),
        scaled(2),
        partial(scaled, 1),
        partial(scaled, 2),
        lambda: 1,
        lambda: 2,
        np.sin,
        np.cos,
        abs,
    ]
    assert len({digest(value) for value in values}) == len(values)
    assert digest(np.float64(0.1)) == digest(0.1) and digest(scaled(1)) == digest(scaled(1))


def test_code_of_scripts_counts_with_what_it_uses():
    plain = (
        'def g(x):\n return x\nC = {"a": 1}\n'
        'def f(x):\n return [C[y] + g(y) for y in x if y in {"a", "bc", "de"}]'
    )
    assert script(plain) == script("unused = 3\n\n" + plain)  # another line, another place
    for old, new in (
        ("C[y] +", "C[y] -"),
        ('"a": 1', '"a": 2'),
        ("return x\n", "return 2*x\n"),
        ('"bc"', '"b"'),
    ):
        assert script(plain.replace(old, new)) != script(plain)


def test_modules_count_with_what_they_import(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "near_here.py").write_text("def f():\n    from far_away import VALUE\n    return VALUE\n")
    for name in ("far_away", "aside"):
        (tmp_path / f"{name}.py").write_text("VALUE = 1\n")
    module = import_module("near_here")
    before = digest(module.f), digest(module)
    (tmp_path / "aside.py").write_text("VALUE = 2\n")
    assert (digest(module.f), digest(module)) == before
    (tmp_path / "far_away.py").write_text("VALUE = 2\n")
    assert digest(module.f) != before[0] and digest(module) != before[1]


def test_what_cannot_be_followed_is_never_used_again(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "bare_folder").mkdir()  # a package without __init__.py
    (tmp_path / "bare_folder" / "inside.py").write_text("def f():\n    return 1\n")
    function = import_module("bare_folder.inside").f
    assert digest(function) != digest(function)


def test_any_file_of_the_package_counts(tmp_path, monkeypatch):
    (tmp_path / "deep").mkdir()
    for path in (tmp_path / "__init__.py", tmp_path / "deep" / "one.py"):
        path.write_text("")
    found = SimpleNamespace(submodule_search_locations=[tmp_path])
    monkeypatch.setattr("importlib.util.find_spec", lambda name: found if name == "microblock" else None)
    before = digest(scaled)
    assert digest(scaled) == before
    (tmp_path / "deep" / "one.py").write_text("#")
    assert digest(scaled) != before


def in_another_process(first, folder):
    """The digest of f of edited.py in this folder, in a process that runs a line before."""
    code = f"from importlib import metadata\n{first}\nfrom edited import f\n"
    code += "from microblock.data.provenance import digest; print(digest(f))"
    environment = {**os.environ, "PYTHONPATH": f"{folder}:{Path(mb.__file__).parents[1]}"}
    ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert not ran.returncode, ran.stderr
    return ran.stdout.strip()


def test_a_file_that_changed_after_it_was_loaded_may_not_be_what_runs(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "edited.py").write_text("def f():\n    return 1\n")
    function = import_module("edited").f
    before = digest(function)
    (tmp_path / "edited.py").write_text("def f():\n    return 2\n")
    here, there = digest(function), digest(function, fresh=True)
    assert len({before, here, there}) == 3
    assert in_another_process("", tmp_path) == there  # which runs the new file
    other = "known = metadata.version; metadata.version = lambda of: '0' if of == 'numpy' else known(of)"
    assert in_another_process(other, tmp_path) != there


def test_files_count_by_name_and_content(tmp_path):
    file = tmp_path / "one.csv"
    assert content(file) is None
    file.write_text("a,b\n")
    before = content(file)
    file.write_text("a,c\n")  # as long as before
    assert content(file) != before
    file.write_text("a,b\n")
    assert content(file) == before != content(file.rename(tmp_path / "other.csv"))


@dataclass
class Holder:
    what: object


def test_what_cannot_be_told_apart_is_refused():
    ring = Holder(None)
    ring.what = ring
    for value in (object(), Holder(object()), ring):
        with pytest.raises(mb.BadArgument):
            digest(value)


@pytest.mark.parametrize("name", ["export", "provenance", "records", "sweeps"])
def test_public_functions_of_the_room_have_hints_and_sections(name):
    module = import_module(f"microblock.data.{name}")
    functions = [
        one
        for key, one in vars(module).items()
        if inspect.isfunction(one) and one.__module__ == module.__name__ and not key.startswith("_")
    ]
    assert functions
    for one in functions:
        signature = inspect.signature(one)
        assert all(entry.annotation is not entry.empty for entry in signature.parameters.values()), one
        assert signature.return_annotation is not signature.empty, one
        told = inspect.getdoc(one)
        assert all(
            section in told
            for section, needed in (
                ("Parameters\n---", signature.parameters),
                ("Returns\n---", signature.return_annotation not in (None, "None") and "Yields" not in told),
            )
            if needed
        ), one
