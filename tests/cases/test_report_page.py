"""The page of the report: findings first, words for outsiders, figures that are read at 9 cm, nothing that is
out of reach without eyes or on a telephone.
"""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from conftest import smallest_letters

from cases.common.catalog import headlines
from cases.paper import figures_fe
from cases.paper.statements import STATEMENTS
from cases.report import findings, page, report
from cases.report.symbols import symbols
from cases.scenes import size_effect
from microblock.data.records import read_records
from microblock.view import plots

DOCS = Path(__file__).parents[2] / "docs"


class Elements(HTMLParser):
    """[(tag, attributes)] of a page; raises where tags do not close as they opened."""

    VOID = {"meta", "img", "br"}

    def __init__(self, text):
        super().__init__()
        self.found, self.open = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def item(name="fig5", **more):
    known = {
        "name": name,
        "label": report.label(name),
        "section": report.section(name),
        **report.told(name),
        "data": f"data/{name}.csv",
        "figure": f"figures/{name}.png",
        "size": (885, 600),
        "pdf": f"figures/{name}.pdf",
        "table": None,
        "page": None,
        "command": "python -m cases report",
        "commands": ["python -m cases strip"],
        "error_estimate": 1e-9,
        "drawing": 1.0,
        "alone": False,
        "seconds": 2.0,
        "machine": "Linux",
        "kept": False,
    }
    return {**known, **more}


def statement(verdict="differs", value=0.5, error=1e-3):
    words = {"where": "4.2", "the_paper": "alpha_mid = 0.8874", "here": "alpha_mid", "because": "its mesh"}
    return {**words, "value": value, "error": error, "verdict": verdict}


def written(items, found=None):
    introductions = {title: words for title, (words, _) in report.SECTIONS.items()}
    found = found or findings.Findings([], {}, [])
    return page.page(items, found, introductions, "a run", {"ngsolve": "6"}, {})


RECORDS = {
    "fig11": [
        {
            "contact": contact,
            "model": "halfplane",
            "alpha": alpha,
            "hardness_real": real,
            "hardness_apparent": 0.9 if contact == "microblock" else 1.2,
            "alpha_mid": 0.8343132323,
            "alpha_mid_error": 2e-10,
            "nu": 0.3,
            "beta": 1.0,
        }
        for contact in ("microblock", "unilateral")
        for alpha, real in ((0.01, 0.99), (0.9, 0.83), (1.25, 0.81))
    ],
    "fig13": [
        {"alpha": alpha, "x1": x1, "L_bl_over_ell": length}
        for alpha, x1, length in ((0.01, 0.3, 1.002), (0.01, 0.95, 1.5), (0.1, 0.3, 1.4), (0.02, 0.5, None))
    ],
    "paper_and_here": [statement(), statement("agrees"), statement("not determined here", None, None)],
}


def test_findings_are_numbers_of_the_records():
    found = findings.found({"fig11", "fig13", "paper_and_here"}, RECORDS.get)
    texts = {heading: text for heading, text, _ in found.sentences}
    assert "alpha_mid = 0.8343132323 ± 2e-10" in texts["alpha_mid"] and "6 % more" in texts["alpha_mid"]
    assert "falls throughout" in texts["Real hardness"] and "0.830 at 0.9" in texts["Real hardness"]
    assert "0.2 %" in texts["Layers"]  # neither the edge of full contact nor the larger alpha count
    assert found.counts == {"agrees": 1, "differs": 1, "not determined here": 1} and len(found.differing) == 1


def test_a_real_hardness_that_rises_is_said_to_rise():
    rows = [{**row, "hardness_real": row["alpha"]} for row in RECORDS["fig11"]]
    assert "does not only fall" in findings.real_hardness(rows)


def test_findings_of_what_was_not_made_are_left_out():
    found = findings.found({"fig13"}, RECORDS.get)
    assert [heading for heading, _, _ in found.sentences] == ["Layers"] and found.statements == []
    assert findings.found(set(), RECORDS.get).sentences == []


@pytest.mark.parametrize(
    "value, error, told",
    [
        (0.8343132323162235, 1.2e-10, "0.8343132323 ± 1e-10"),
        (6.2495, 0.27, "6.2 ± 0.3"),
        (-0.0231644, 1.8e-5, "-0.02316 ± 0.00002"),
        (1.12e-5, 5.2e-7, "(1.12 ± 0.05)e-05"),
        (0.0794, 0.0, "0.0794"),
        (1e-12, 5e-12, "1.0e-12 ± 5e-12"),
    ],
)
def test_a_value_has_the_digits_that_its_error_leaves(value, error, told):
    assert findings.measured(value, error) == told


def test_the_load_of_coalescence_is_one_number_wherever_it_is_told():
    """In the box of findings, in the caption of its figure and in the page on the paper."""
    value, error = size_effect.coalescence_ratio(figures_fe.NU, figures_fe.BETA)
    # rounding, which other processors and numbers of threads change, moves the value within its error
    assert abs(value - 0.8343132323) <= error + 1e-10 and error < 2e-9
    assert "0.8343132323 +- 1e-10" in report.told("coalescence")["caption"]
    assert r"0.8343132323 \pm 10^{-10}" in (Path(__file__).parents[2] / "docs" / "differences.md").read_text()


def test_the_box_comes_first_with_what_differs_and_the_rest_folded():
    text = written([item(), item("fig8")], findings.found(set(RECORDS), RECORDS.get))
    box = text[text.index('id="findings"') : text.index('id="section-the-strip"')]
    assert text.index("<main>") < text.index('id="findings"') < text.index("<figure")
    open_part, folded = box.split('<details id="paper_and_here">')
    assert open_part.count(">4.2</td>") == 1 and folded.count(">4.2</td>") == 3
    assert "α<sub>mid</sub> = 0.8874" in open_part


def test_the_page_is_for_eyes_ears_and_telephones():
    table = [{"quantity": "psi", "value": 1.0, "nu": 0.3, "command": "long"}, {"quantity": "u", "value": 2.0}]
    table[1] |= {"nu": 0.3, "command": "longer"}
    text = written([item(), item("strip_table", figure=None, table=table)])
    elements = Elements(text).found
    tags = [tag for tag, _ in elements]
    assert {"header", "nav", "main", "footer", "h1", "h2", "h3"} <= {*tags} and tags.count("h1") == 1
    (picture,) = [attributes for tag, attributes in elements if tag == "img"]
    assert picture["loading"] == "lazy" and picture["width"] == "885" and picture["height"] == "600"
    assert len(picture["alt"]) > 40 and "fig5" not in picture["alt"]
    assert ("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}) in elements
    # the paper is named; nothing is loaded from anywhere
    assert "prefers-color-scheme: dark" in text and "Stupkiewicz" in text
    assert set(re.findall(r"https?:[^\s\"'<)]+", text)) == {page.PAPER}
    assert page.PAPER in (DOCS / "differences.md").read_text()
    links = {
        attributes["href"][1:] for tag, attributes in elements if attributes.get("href", "").startswith("#")
    }
    assert links <= {attributes.get("id") for _, attributes in elements}
    # boxes that scroll are reached by keys, and have a name
    boxes = [attributes for _, attributes in elements if "box" in attributes.get("class", "").split()]
    assert boxes and all(one["tabindex"] == "0" and one["aria-label"] for one in boxes)


def test_a_figure_that_would_be_alone_in_its_row_has_its_words_beside_it():
    figures = [item(name) for name in ("fig3", "fig4", "fig5", "fig6", "strip_curvature")]
    assert re.findall(r'id="(\w+)" class="(lone[^"]*)"', written(figures)) == [("strip_curvature", "lone-2")]
    assert re.findall(r'id="(\w+)" class="(lone[^"]*)"', written(figures[:4])) == [("fig6", "lone-3")]
    assert 'class="lone' not in written(figures[:2])


def test_files_that_are_named_are_linked_where_they_are(tmp_path):
    section = [item("limits_cells")]
    introductions = {title: words for title, (words, _) in report.SECTIONS.items()}
    found = findings.Findings([], {}, [])
    text = page.page(section, found, introductions, "a run", {}, {}, report._beside(tmp_path))
    assert '<a href="methods.html">docs/methods.md</a>' in text
    advice = (tmp_path / "methods.html").read_text()
    Elements(advice)
    assert advice.count("<li>") > 20
    assert "α = 0.25" in advice and "<code>Panels</code>" in advice and "http" not in advice


def test_rows_can_be_read_without_those_before():
    for one in STATEMENTS:
        words = f"{one.says}; {one.here}; {one.because}"
        assert not re.search(r"\bthe same\b(?! 20)|\bagain\b|next row|; its value\b", words), words
        assert not re.match(r"(?:so|then|except|they)\b", words), words
        assert not re.search(r"(?<![\w'])l(?![\w'])|Pmax", words)  # ell, P_max


def test_tables_have_short_rows():
    """What is the same in all rows stands once, and no command makes a row tall."""
    table = page._table([{"a": 1, "nu": 0.3, "command": "x" * 300}, {"a": 2, "nu": 0.3, "command": "y"}], "t")
    assert "In all rows: ν 0.3." in table and "xxx" not in table and table.count("0.3") == 1


@pytest.mark.parametrize(
    "text, shown",
    [
        ("alpha_mid and a_Hz^2/R", "α<sub>mid</sub> and a<sub>Hz</sub><sup>2</sup>/R"),
        ("psi0 at x1, u2", "ψ<sub>0</sub> at x<sub>1</sub>, u<sub>2</sub>"),
        ("u1_surface is 3 %", "u<sub>1, surface</sub> is 3\u00a0%"),
        ("9 000 unknowns, 40 s, 3 blocks", "9\u00a0000 unknowns, 40\u00a0s, 3 blocks"),
        ("h^(2 s), L_psi < 1", "h<sup>2\u00a0s</sup>, L<sub>ψ</sub> &lt; 1"),
        ("alphabet, contact_nodes, rtol", "alphabet, contact_nodes, rtol"),
        ("1e-9, -2.5e-17", "10<sup>−9</sup>, −2.5\u202f·\u202f10<sup>−17</sup>"),
        ("(1.12 ± 0.05)e-05", "(1.12\u00a0±\u00a00.05)\u202f·\u202f10<sup>−5</sup>"),
        ("alpha -> 0, x1 <= 3, +- 2", "α → 0, x<sub>1</sub> ≤ 3,\u00a0±\u00a02"),
        ("ell/sqrt(beta), (44)-(49), |a - 1|", "ℓ/√β, (44)–(49), |a − 1|"),
        ("Delta psi, |Delta psi|", "Δψ, |Δψ|"),
        ("m_2 = -psi(H), g0_B", "m<sub>2</sub> = −ψ(H), g<sub>0B</sub>"),
        ("one-dimensional, half-plane", "one-dimensional, half-plane"),
    ],
)
def test_quantities_are_set_as_in_print(text, shown):
    assert symbols(text) == shown


def test_the_size_of_a_figure_is_that_of_its_file(tmp_path):
    plots.draw(lambda _: plots.figure(height=2.0)[0], None, tmp_path, "a")
    width, height = page.size(tmp_path / "a.png")
    dpi = plots.STYLE["savefig.dpi"]
    assert (width, height) == (round(plots.COLUMN * dpi), round(2.0 * dpi))


@pytest.mark.parametrize("name", report.FIGURES)
def test_captions_say_the_message_how_to_read_it_and_what_is_seen(name):
    told = report.told(name)
    assert told["message"].endswith(".") and len(told["message"]) < 140
    assert len(told["caption"]) > 80 and len(told["alt"]) > 60 and told["alt"] != told["message"]
    # what the glossary has other words for
    words = " ".join(told.values())
    assert not re.search(r"\b(scenes?|turned|judged?|refused|paper's way|rungs?|ladders?|held)\b", words)


@pytest.mark.parametrize("name", [name for name in report.FIGURES if name.startswith(("speed", "limits"))])
def test_figures_of_kept_records_are_read_at_nine_centimetres(name):
    compute, drawing = report.FIGURES[name]
    assert smallest_letters(drawing, compute()) >= 7


def test_a_case_that_writes_a_page_is_linked_where_it_exists(tmp_path):
    """The page of a case counts as an item, and its records only as long as the page is there."""
    assert report.PAGES == ("playground",) and set(report.PAGES) <= set(headlines())
    result = report.run(report.Parameters(only=("playground",), workers=1), tmp_path, quiet=True)
    assert [(one["name"], one["page"]) for one in result["items"]] == [("playground", "playground.html")]
    assert '<a href="playground.html">Playground</a>' in (tmp_path / "index.html").read_text()
    (row,) = read_records(tmp_path / "data" / "playground.csv")
    assert row["command"].startswith("python -m cases playground")
    assert report.Records(tmp_path).files["playground"].kept()
    (tmp_path / "playground.html").unlink()
    assert report.Records(tmp_path).files["playground"].kept() is None
