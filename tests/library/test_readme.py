"""README's Python runs as it is printed, from top to bottom in one kernel, and prints what README says."""

import re
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"
LONGEST = 100  # lines: a page for someone with a minute


def test_python_of_the_readme_prints_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # it writes files
    text, names = README.read_text(), {}
    found = re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)", text, re.S)
    assert len(found) == text.count("```python") == 1
    for code, printed in found:
        exec(code, names)
        assert capsys.readouterr().out == printed
    assert {path.name for path in tmp_path.iterdir()} == {"contact.png"}


def test_readme_is_one_page():
    assert len(README.read_text().splitlines()) <= LONGEST


def test_links_of_the_readme_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", README.read_text()):
        assert (README.parent / target).exists(), target
