"""The equations of the pages: every letter is in the table of notation, and none is there twice."""

import importlib.util
import re
import unicodedata
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytest.importorskip("sphinx", reason="the pages need the extra `docs`")
DOCS = Path(__file__).parents[2] / "docs"
source = importlib.util.spec_from_file_location("mathml", DOCS / "_ext" / "mathml.py")
mathml = importlib.util.module_from_spec(source)
source.loader.exec_module(mathml)
NOTATION = DOCS / "notation.md"
PAGES = [
    *sorted((DOCS / "theory").glob("*.md")),
    *sorted((DOCS / "gallery").glob("*.md")),
    DOCS / "differences.md",
    NOTATION,
]
# what is no quantity: a derivative and a difference, an integral's d, signs and numbers without a name
SIGNS = set("∂Δd∞…")
LOWER = {"msub": 1, "munder": 1, "msubsup": 2, "munderover": 2}  # children below the base, by element


def equations(page):
    """The LaTeX of a page, displayed and in line."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)
    text = re.sub(r"`[^`\n]*`", "", text)
    blocks = re.findall(r"\$\$(.*?)\$\$", text, re.S)
    return blocks + re.findall(r"\$([^$]+)\$", re.sub(r"\$\$.*?\$\$", "", text, flags=re.S))


def letters(latex):
    """Letters of an equation without indices, whatever their face."""
    translate = pytest.importorskip("docutils.utils.math.latex2mathml").tex2mathml
    mathml = translate(latex.strip(), as_block=True).replace("&ApplyFunction;", "")
    return set(_letters(ElementTree.fromstring(mathml)))


def _letters(node):
    tag = node.tag.rpartition("}")[2]
    children = list(node)
    if tag in LOWER:  # an index says of what, not what; an exponent is a quantity
        children = children[:1] + children[2:]
    for child in children:
        yield from _letters(child)
    text = (node.text or "").strip()
    if tag == "mi" and len(text) == 1:
        # ℓ is a letter of its own, and a bold letter is the same one
        letter = text if text == "ℓ" else unicodedata.normalize("NFKC", text)
        if text not in SIGNS:
            yield letter


@cache
def table():
    """Rows of the table of notation: the letters of the first column of each."""
    rows = re.findall(r"^\| (\$.*?) \|", NOTATION.read_text(), re.M)
    return [set().union(*map(letters, re.findall(r"\$([^$]+)\$", row))) for row in rows]


def test_no_letter_means_two_things():
    rows = table()
    assert len(rows) > 50 and all(len(row) == 1 for row in rows)
    every = [letter for row in rows for letter in row]
    assert len(every) == len(set(every))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_every_letter_is_in_the_table(page):
    known = set().union(*table())
    unknown = {latex: letters(latex) - known for latex in equations(page) if letters(latex) - known}
    assert not unknown


def test_an_index_is_one_element():
    """No space is put into it, as before a function; an element with too many parts fails a build with -W."""
    assert "mspace" in mathml.mathml(r"2 \sin x") and "mspace" not in mathml.mathml(r"\alpha_\mathrm{mid}")
    index = ElementTree.fromstring(mathml.mathml(r"2 \alpha_\mathrm{mid}^2 \exp x"))
    assert [len(part) for part in index.iter() if part.tag.endswith("msubsup")] == [3]
    wrong = "<math><msub><mi>a</mi><mspace/><mi>b</mi></msub></math>"
    with pytest.MonkeyPatch.context() as patch, pytest.raises(ValueError, match="msub has 3 parts"):
        patch.setattr(mathml, "tex2mathml", lambda *_, **__: wrong)
        mathml.mathml("a_b")


def test_letters_are_those_of_equations():
    assert letters(r"\mathbf{u}_1 = \frac{\ell}{2} \exp(-\mathrm{i} k x) + \gamma' p_A^2") == set("uℓikxγp")
    assert letters(r"F = 1") - set().union(*table()) == {"F"}  # a letter that is not there would be seen
