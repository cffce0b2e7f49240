"""The pages: their Python blocks run as they stand, one after the other, page by page, and print what the
pages say.
"""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [
    page
    for page in (*sorted(DOCS.glob("*.md")), *sorted((DOCS / "howto").glob("*.md")))
    if "```python\n" in page.read_text() and page.stem != "description"
]
BLOCKS = r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?"
LONGEST = 40  # lines that an obstacle, a law or a body of one's own may take


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_run(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # some write files
    names = {}
    for block, printed in re.findall(BLOCKS, page.read_text(), re.S):
        assert "assert" in block or printed  # each says what it shows
        exec(compile(block, str(page), "exec"), names)
        shown = capsys.readouterr().out
        assert not printed or shown == printed


def test_own_parts_are_short():
    text = (DOCS / "howto" / "extend.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 3 and all(len(block.splitlines()) <= LONGEST for block in blocks)
