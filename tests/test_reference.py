"""The reference: every public name is documented, with an example that runs; the pages are built without a warning."""

import doctest
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import microblock as mb

ROOT = Path(mb.__file__).parents[1]


@pytest.mark.parametrize("name", mb.__all__)
def test_the_example_of_a_public_name_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)      # examples may write files
    thing = getattr(mb, name)
    example = doctest.DocTestParser().get_doctest(thing.__doc__, {"mb": mb, "np": np}, name, None, None)
    assert example.examples and "mb." in example.docstring
    told = []
    failed = doctest.DocTestRunner().run(example, out=told.append).failed
    assert not failed, "".join(told)


@pytest.mark.slow
def test_pages_are_built_without_a_warning(tmp_path):
    pytest.importorskip("sphinx", reason="the pages need the extra `docs`")
    built = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(tmp_path/"trees"),
                            "docs/reference", str(tmp_path/"pages")], cwd=ROOT, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    page = (tmp_path/"pages"/"index.html").read_text()
    assert all(f'id="microblock.{name}"' in page for name in mb.__all__)


def test_version_is_one_and_the_same():
    assert f"\nversion: {mb.__version__}\n" in (ROOT/"CITATION.cff").read_text()
    assert f"\n## {mb.__version__}" in (ROOT/"CHANGELOG.md").read_text()
