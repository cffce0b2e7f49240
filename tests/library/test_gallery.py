"""The gallery: each page has an equation and a short example that runs and ends with a picture; no scene of
the cases is left out.
"""

import importlib.util
import re
from pathlib import Path

import pytest

from cases.common.catalog import headlines

pytest.importorskip("sphinx", reason="the pages need the extra `docs`")
DOCS = Path(__file__).parents[2] / "docs"
source = importlib.util.spec_from_file_location("gallery", DOCS / "_ext" / "gallery.py")
gallery = importlib.util.module_from_spec(source)
source.loader.exec_module(gallery)
PAGES = [page for page in sorted((DOCS / "gallery").glob("*.md")) if page.stem != "index"]
LONGEST = 20  # lines of an example, those of a figure's labels included


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_example_ends_with_a_picture(page):
    example = gallery.code(page)
    assert len([line for line in example.splitlines() if line.strip()]) <= LONGEST
    assert "\n$$\n" in page.read_text()
    figure = gallery.run(example)
    # something is drawn, over something that has a name
    drawn = [axis for axis in figure.axes if axis.lines or axis.collections or axis.patches]
    assert any(axis.get_xlabel() for axis in drawn)


def test_every_scene_has_a_page():
    scenes = {name for name, (module, _) in headlines().items() if ".scenes." in module}
    shown = {name for page in PAGES for name in re.findall(r"python -m cases (\w+)", page.read_text())}
    assert scenes <= shown
