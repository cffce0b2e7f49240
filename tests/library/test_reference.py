"""The reference: public names and lower levels are listed, and have examples that run."""

import doctest
import pkgutil
import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import microblock as mb

ROOT = Path(mb.__file__).parents[1]
PAGES = sorted((ROOT / "docs" / "reference").glob("*.rst"))
LISTED = [
    name
    for page in PAGES
    for name in re.findall(r"^\.\. auto(?:class|function):: microblock\.(\S+)$", page.read_text(), re.M)
]


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


def test_every_public_name_has_its_topic_at_a_glance():
    index = next(page for page in PAGES if page.stem == "index").read_text()
    assert sorted(re.findall(r":(?:class|func):`~microblock\.(\w+)`", index)) == mb.__all__
