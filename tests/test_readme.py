"""README's Python runs as it is printed, from top to bottom in one kernel."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[1]/"README.md"


@pytest.mark.slow
def test_python_of_the_readme_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)      # it writes files
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.S)
    names = {}
    for block in blocks:
        exec(block, names)
    assert len(blocks) >= 5
    assert names["path"].at(0.05).load == pytest.approx(0.05)
    assert [row["error"] for row in names["rows"]] == [None]*4
    assert {"study.jsonl", "study.csv", "events.csv", "state.csv", "state_surface.vtu", "state_body.vtu"} == {path.name for path in tmp_path.iterdir()}
