"""The how-to pages: their Python blocks run as they stand, one after the other, page by page."""

import re
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).parents[2] / "docs" / "howto").glob("*.md"))
LONGEST = 40  # lines that an obstacle, a law or a body of one's own may take


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_run(page):
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.S):
        assert "assert" in block  # each says what it shows
        exec(compile(block, str(page), "exec"), names)


def test_own_parts_are_short():
    text = next(page for page in PAGES if page.stem == "extend").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 3 and all(len(block.splitlines()) <= LONGEST for block in blocks)
