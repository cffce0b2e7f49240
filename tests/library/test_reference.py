"""The reference: public names and lower levels have examples that run; pages are built without a warning."""

import doctest
import pkgutil
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import microblock as mb

ROOT = Path(mb.__file__).parents[1]
PAGE = ROOT / "docs" / "reference" / "index.rst"
LISTED = re.findall(r"^\.\. auto(?:class|function):: microblock\.(\S+)$", PAGE.read_text(), re.M)


def lower_levels():
    """Names below the top, from "microblock." on, of all that has an example there."""
    found = []
    for room in ("model", "corners", "halfplane", "fem"):
        package = import_module(f"microblock.{room}")
        for _, name, _ in pkgutil.iter_modules(package.__path__):
            module = import_module(f"microblock.{room}.{name}")
            own = (
                one
                for one, thing in vars(module).items()
                if getattr(thing, "__module__", "") == module.__name__
            )
            found += [
                f"{room}.{name}.{one}"
                for one in own
                if ">>>" in (vars(module)[one].__doc__ or "") and one not in mb.__all__
            ]
    return found


def run(example):
    told = []
    failed = doctest.DocTestRunner().run(example, out=told.append).failed
    assert not failed, "".join(told)


@pytest.mark.parametrize("name", mb.__all__)
def test_the_example_of_a_public_name_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # examples may write files
    names = {"mb": mb, "np": np}
    example = doctest.DocTestParser().get_doctest(getattr(mb, name).__doc__, names, name, None, None)
    assert example.examples and "mb." in example.docstring
    run(example)


@pytest.mark.parametrize("name", lower_levels())
def test_the_example_of_a_lower_level_runs(name):
    """Beside `mb` and `np` it imports what it needs."""
    module, _, own = name.rpartition(".")
    thing = getattr(import_module(f"microblock.{module}"), own)
    run(doctest.DocTestParser().get_doctest(thing.__doc__, {"mb": mb, "np": np}, name, None, None))


def test_every_public_name_is_listed_once():
    assert sorted(name for name in LISTED if "." not in name) == mb.__all__
    assert len(LISTED) == len(set(LISTED))
    missing = {name for name in lower_levels() if name.split(".")[0] in ("corners", "fem")} - set(LISTED)
    assert not missing


@pytest.mark.slow
def test_pages_are_built_without_a_warning(tmp_path):
    pytest.importorskip("sphinx", reason="the pages need the extra `docs`")
    built = subprocess.run(
        [
            sys.executable,
            "-m",
            "sphinx",
            "-q",
            "-W",
            "--keep-going",
            "-d",
            str(tmp_path / "trees"),
            "docs/reference",
            str(tmp_path / "pages"),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stderr
    page = (tmp_path / "pages" / "index.html").read_text()
    assert all(f'id="microblock.{name}"' in page for name in LISTED)
