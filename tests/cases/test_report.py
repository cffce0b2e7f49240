"""The report: one page of all scripts that needs no network, and says what failed."""

import re
from html.parser import HTMLParser

import pytest

from cases import report
from cases.__main__ import main
from microblock import NotConverged


class Page(HTMLParser):
    """Tags of a page with their attributes."""

    def __init__(self, folder):
        super().__init__()
        self.tags, self.text = [], (folder / "index.html").read_text()
        self.feed(self.text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def check(self, folder):
        """Language, headings in order, pictures with words, files that are there, nothing of the network."""
        levels = [int(tag[1]) for tag, _ in self.tags if re.fullmatch("h[1-6]", tag)]
        assert ("html", {"lang": "en"}) in self.tags and levels.count(1) == 1
        assert all(after <= before + 1 for before, after in zip(levels, levels[1:]))
        for tag, given in self.tags:
            place = given.get("src") or given.get("href", "#")
            assert not re.match(r"\w+:|//", place) and (place[0] == "#" or (folder / place).exists()), place
            assert tag != "img" or len(given["alt"]) > 20
        assert self.text.count("<tr><td>") == 12  # results that differ from the paper


def test_a_script_that_fails_does_not_stop_the_others(tmp_path):
    with pytest.raises(NotConverged, match=r"1 of 2 scripts failed: broken \(ModuleNotFound"):
        report.make({"broken": "cases.broken", "findings": "cases.findings"}, tmp_path)
    page = Page(tmp_path)
    page.check(tmp_path)
    assert "broken failed: ModuleNotFound" in page.text and "larger than 0.8343 a" in page.text
    assert main(["report", "--only", "nowhere", "--out", str(tmp_path)]) == 2


@pytest.mark.site
def test_all_scripts_are_on_the_page(tmp_path):
    assert main(["report", "--out", str(tmp_path)]) == 0
    page = Page(tmp_path)
    page.check(tmp_path)
    shown = {given.get("id") for tag, given in page.tags if tag == "figure"}
    assert shown == {*report.modules()} - {"findings", "chart"}
