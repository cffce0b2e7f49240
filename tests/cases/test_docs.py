"""The pages under docs: what they name exists, links lead somewhere, and words are those of the glossary."""

import json
import re
from pathlib import Path

import pytest

import microblock as mb
from cases.common.catalog import headlines
from cases.report.report import KNOWN

ROOT = Path(mb.__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
NOTEBOOKS = sorted((DOCS / "tutorials").glob("*.ipynb"))
WORDED = [page for page in (*PAGES, *NOTEBOOKS) if page.name != "description.md"]
# words that nobody but us has for what the field has words for
PRIVATE = (
    "scenes?|sinking|mattress|rungs?|ladders?|held|turned|judged?|refused|told|pulls|"
    "paper's way|clocked|GridContact|FittedContact"
)
REQUIRED = {
    "born",
    "vanished",
    "merged",
    "split",
    "full",
    "contact",
    "A, B",
    "psi0_in",
    "refinement level",
    "normal displacement",
    "rigid-body constant",
}
FOLDERS = (
    "",
    "microblock",
    *(f"microblock/{part}" for part in ("model", "corners", "halfplane", "fem", "view", "data")),
)


def named(path):
    """A page in the name of a test."""
    return path.relative_to(ROOT).as_posix()


def text(path):
    """What a page says; of a notebook its words and its code."""
    if path.suffix == ".ipynb":
        return "\n".join("".join(cell["source"]) for cell in json.loads(path.read_text())["cells"])
    return path.read_text()


def anchors(path):
    """What headings of a page are linked by."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("path", [*PAGES, *NOTEBOOKS], ids=named)
def test_links_lead_somewhere(path):
    for target, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", text(path)):
        page = (path.parent / target).resolve() if target else path
        assert page.exists(), target
        assert not anchor or anchor in anchors(page), (target, anchor)


def test_an_anchor_that_is_none_would_be_seen():
    known = anchors(DOCS / "theory" / "halfplane.md")
    assert "contact-line" in known and "contact-lines" not in known


@pytest.mark.parametrize("path", [*PAGES[1:], *NOTEBOOKS], ids=named)
def test_files_commands_tests_and_names_exist(path):
    page = text(path)
    for file in re.findall(r"`((?:[\w*]+/)*[\w*]+\.py)`", page):
        assert [found for folder in FOLDERS for found in (ROOT / folder).glob(file)], file
    for case in re.findall(r"python -m cases ([a-z]\w*)", page):
        assert case in headlines(), case
    tests = "".join(one.read_text() for one in (ROOT / "tests").rglob("*.py"))
    for test in re.findall(r"`(test_\w+)`", page):
        assert f"def {test}(" in tests, test
    for public in re.findall(r"\bmb\.(\w+)", page):
        assert public in mb.__all__, public
    for item in re.findall(r"(?:figure|table) `(\w+)`", page):
        assert item in KNOWN, item


@pytest.mark.parametrize("path", WORDED, ids=named)
def test_words_are_the_fields(path):
    page = re.sub(r"```.*?```|`[^`\n]*`", "", text(path), flags=re.S)  # code says what it is called
    assert re.findall(rf"\b(?:{PRIVATE})\b", page, re.I) == []


def glossary():
    """{terms: what they mean}."""
    page = (DOCS / "notation.md").read_text().partition("## Glossary")[2]
    lines = [line for line in page.splitlines() if line.startswith("- ")]
    return dict(re.fullmatch(r"- \*\*(.+?)\*\*: (.+[.;])", line).groups() for line in lines)


def test_glossary_has_a_line_for_each_term_in_order():
    terms = list(glossary())
    assert {*REQUIRED} <= {*terms}
    plain = [re.sub(r"[^a-z0-9 ]", "", term.lower()) for term in terms]
    assert plain == sorted(plain) and len(set(plain)) == len(plain)


def test_glossary_has_what_methods_laws_and_zones_are_called():
    page = (DOCS / "notation.md").read_text()
    for name in ("Panels", "Cells", "Fitted", "Uniform", "Condensed", "Newton"):
        assert name in mb.__all__ and f"`{name}`" in page
    for law in (mb.Microblock, mb.Unilateral, mb.Microclamped):
        assert law.__name__.lower() in page
