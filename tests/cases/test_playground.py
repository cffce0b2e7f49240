"""The page of the playground: what it holds is what was computed, its errors hold, and it needs nothing.

`python -m pytest -m browser` looks at it in Chromium (Debian's package `chromium`).
"""

import configparser
import html
import math
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from cases.__main__ import main
from cases.report import playground, playground_page, playground_survey
from cases.report.playground_map import ROWS, TIP, blended
from cases.report.playground_states import BOTH, LOAD, RTOL, A, B, error, fields, gap_error, sampled, solve
from cases.scenes import hertz
from microblock import NotConverged

ROOT = Path(__file__).parents[2]
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
COARSE = playground.Parameters(fineness=0.25, checks=8)
SAMPLED = 4e-4  # what 24 nodes on a piece, and two bytes a number, leave at worst, next to TIP
PLACES = [(0.25, 0.1), (1.0, 0.2), (0.05, 0.3), (0.5, 0.7)]  # full, apart, inside, one corner


@pytest.fixture(scope="module")
def table():
    """(answer, what is kept) of a coarse table: a quarter of the usual fineness along rows and columns."""
    return playground.made(COARSE)


@pytest.fixture(scope="module")
def made(table):
    """(answer, page) of the coarse table."""
    return table[0], playground.page(table[1])


@pytest.fixture(scope="module")
def found(made):
    return playground_page.read(made[1])


@pytest.mark.parametrize("alpha, psi0", [*PLACES, (TIP * 1.01, 0.0)])
def test_a_sampled_state_is_the_state(alpha, psi0):
    state = solve(alpha, psi0)
    own = sampled(state)
    assert error(own, state, alpha, psi0) < SAMPLED
    for name, corner in (("A", A), ("B", B)):
        # edges are kept as they are
        assert own.zones(corner) == [pytest.approx(zone, abs=1e-12) for zone in state.zones[name]]
    # gaps of both corners over one that is closed, or none: what the picture of blocks is drawn from
    x = np.linspace(-3, 3, 61)
    one, other, psi, gap = fields(own, x, alpha, psi0)
    half = alpha * (psi0 + psi - x) / 2
    for name, gaps in (("A", gap + half), ("B", gap - half)):
        # a height of 1 takes 60 pixels of the picture: less than a tenth of a pixel
        assert gaps == pytest.approx(state.gap_at(name, x) / playground.SLOPE, abs=1.5e-3)


def test_rotation_the_other_way_is_the_mirror_image():
    own, other = sampled(solve(0.4, 0.3)).mirrored(), sampled(solve(0.4, -0.3))
    assert own.closed == other.closed
    # two solutions of the same accuracy, which RTOL bounds in L2; edges and single values have more
    assert own.edges == pytest.approx(other.edges, abs=50 * RTOL)
    assert own.values[1:-1] == pytest.approx(other.values[1:-1], abs=50 * RTOL)


def test_the_load_is_no_dimension_of_its_own():
    """The case hertz at load 2 is the state of alpha and psi0 over sqrt(2), in its own units."""
    parameters = hertz.Parameters(R=1e7, alpha=0.5, loads=(2.0,), rtol=1e-5)
    psi0 = 0.2 * parameters.a_Hz / parameters.R
    parameters = hertz.Parameters(R=1e7, alpha=0.5, loads=(2.0,), rtol=1e-5, psi0_deg=math.degrees(psi0))
    there, here = hertz.result(parameters)["states"][0], solve(0.5 / math.sqrt(2), 0.2 / math.sqrt(2))
    scale = math.sqrt(2.0)
    # a_Hz/R = 3e-5 there, of which psi0 makes 6e-6 in the levers, and RTOL of both
    assert there["half_width"] == pytest.approx(here.half_width * scale, rel=1e-5)
    assert there["pressure_centre"] == pytest.approx(float(here.pressure_at(0.0)) * scale, rel=1e-4)


def test_numbers_of_the_page_decode_to_the_states(found):
    """Nodes of the decoded table, computed again."""
    for patch in found.patches:
        i, j = len(patch.rows) // 2, patch.columns // 2
        alpha = patch.alpha(patch.rows[i])
        psi0 = patch.psi0(alpha, j / max(patch.columns - 1, 1)) if patch.columns > 1 else 1.0
        assert error(patch.states[i][j], solve(alpha, psi0), alpha, psi0) < SAMPLED, patch.name
        # cubics go through their nodes
        assert error(found.at(alpha, psi0), solve(alpha, psi0), alpha, psi0) < SAMPLED, patch.name


def test_packing_loses_half_a_step_of_two_bytes():
    state = sampled(solve(0.3, 0.2))
    rows = np.array([0.0, 1.0])
    patch = playground_survey.Patch("one", "even", "even", (1.0, math.e), rows, rows, rows, 1, [[state]] * 2)
    data = playground_page.packed(playground_survey.Map([patch], patch))
    back = playground_page.unpacked(data).patches[0].states[0][0]
    assert back.closed == state.closed and back.edges == pytest.approx(state.edges, rel=1e-7)  # float32
    steps = {"pressure": playground_page.PRESSURE / 65535, "angle": 2 * playground_page.ANGLE / 65535}
    for code, own, other in zip(state.closed, state.values, back.values):
        for kind, one, two in zip(playground_page.kinds(code), own, other):
            if kind == "gap":  # its root has steps
                one, two, kind = np.sqrt(one), np.sqrt(two), "root"
            # half a step, and rounding of the sum
            step = steps.get(kind, playground_page.GAP / 65535)
            assert np.abs(two - one).max() <= 0.5001 * step


def test_the_errors_that_are_shown_hold(made, found):
    answer, _ = made
    assert len(answer["checks"]) == COARSE.checks
    # in cells four times as wide as usual, where the middle says less of the rest
    assert 0 < answer["gap_error_max"] < 1.5  # of zones apart, with three columns here
    assert sum(one["error"] > one["error_shown"] for one in answer["checks"]) == answer["checks_above"] <= 1
    for one in answer["checks"][:3]:
        own = playground.deviation(found.at(one["alpha"], one["psi0"]), one["alpha"], one["psi0"])
        assert own == pytest.approx(one["error"], rel=1e-6)
        # two digits on the page
        assert found.error(one["alpha"], one["psi0"]) == pytest.approx(one["error_shown"], rel=0.06)


def test_a_wrong_table_shows_a_large_error(found):
    """Negative control: the state of blocks four times as large is far beyond what is shown."""
    alpha = 0.05  # where cells are wide, as at alpha 2, the error of so coarse a table is large as well
    assert playground.deviation(found.at(4 * alpha), alpha, 0.0) > 2 * found.error(alpha)


def test_every_place_has_a_state_with_the_load(found):
    """Also in the strips, where states are blended: pressures add up to the load."""
    random = np.random.default_rng(3)
    for _ in range(200):
        alpha = math.exp(random.uniform(*np.log(playground.SPAN)))
        psi0 = random.uniform(-0.6, 0.6)
        state = found.at(alpha, psi0)
        assert np.all(np.diff(state.edges) >= 0) and state.closed[0] == state.closed[-1] == 0
        ends = np.array([state.edges[0], state.edges[-1]])
        x = ends.mean() - np.ptp(ends) / 2 * np.cos(np.pi * (np.arange(2000) + 0.5) / 2000)
        weights = np.pi / 2000 * np.ptp(ends) / 2 * np.sin(np.pi * (np.arange(2000) + 0.5) / 2000)
        one, other = fields(state, x, alpha, psi0)[:2]
        # the errors of this coarse table; the rule itself has 1e-4 beside inner edges
        assert weights @ (one + other) == pytest.approx(LOAD, rel=3 * found.error(alpha, psi0) + 1e-3)


def leap(state, alpha, psi0):
    """The largest leap of the mean gap at the edges of a state."""
    sides = (fields(state, state.edges + side, alpha, psi0)[3] for side in (-1e-7, 1e-7))
    return float(np.abs(np.subtract(*sides)).max())


# one corner alone, of blocks of many sizes; at the first the page showed steps of the surface
ONE_CORNER = [
    (2 / math.sqrt(1.492), -0.8 / math.sqrt(1.492)),
    (2.0, 0.4),
    (0.2, 1.5),
    (0.05, 0.5),
    (4.0, -3.0),
]


@pytest.mark.parametrize("alpha, psi0", ONE_CORNER)
def test_the_gap_under_one_corner_is_that_of_the_library(found, alpha, psi0):
    """There one state stands for all psi0, which changes the gap of the open corner alone."""
    state = found.at(alpha, psi0)
    assert sorted(set(state.closed)) == [0, A if psi0 < 0 else B]
    # two bytes of a root leave up to 5e-3, where gaps are 80; without what psi0 adds it is 0.02 to 4
    assert gap_error(state, solve(alpha, psi0), alpha, psi0) < 0.01
    assert leap(state, alpha, psi0) < 5e-3


def test_the_surface_does_not_leap_at_edges(found):
    """At all edges of zones, also of blended ones: the picture of blocks draws the gap."""
    random = np.random.default_rng(5)
    for _ in range(200):
        alpha, psi0 = math.exp(random.uniform(*np.log(playground.SPAN))), random.uniform(-1.0, 1.0)
        patch, after, _ = found.place(alpha, abs(psi0))
        # those apart have three columns here, between which the gap is wrong by up to 1; at all nodes it fits
        if "apart" in (patch.name, after and after.name):
            alpha = patch.alpha(patch.rows[len(patch.rows) // 2])
            psi0 = patch.ends(alpha)[1]
        # what this table leaves where blocks are 8 a_Hz wide: 2 pixels of the picture, elsewhere less
        assert leap(found.at(alpha, psi0), alpha, psi0) < 0.03, (alpha, psi0)


def test_blended_zones_are_those_of_the_nearer_state():
    near, far = sampled(solve(0.5, 0.45)), sampled(solve(0.5, 0.7))
    assert near.closed != far.closed
    for share in (0.01, 0.99):
        mixed = blended([(1 - share, near, 0.45), (share, far, 0.7)], 0.5)
        assert mixed.closed == (near if share < 0.5 else far).closed
        # a hundredth of the other state, whose edges are 0.08 away
        other = (near if share < 0.5 else far).zones(B)[0]
        assert mixed.zones(B)[0] == pytest.approx(other, abs=0.04)


def test_rows_come_back():
    for to, back in ROWS.values():
        for alpha in (0.02, TIP, 0.8344, 5.0):
            assert back(to(alpha)) == pytest.approx(alpha, rel=1e-12)


class Page(HTMLParser):
    """Tags of a page with their attributes."""

    def __init__(self, text):
        super().__init__()
        self.tags = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def of(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def test_the_page_needs_nothing_from_anywhere(made):
    answer, page = made
    assert answer["bytes"] == len(page.encode()) < playground.LARGEST
    assert set(re.findall(r"\w+://[^\s\"'<)]+", page)) == {playground_page.PAPER}
    words = r"\b(?:src|fetch|XMLHttpRequest|import|WebSocket|@import|localStorage)\b\s*[=(\s'\"]"
    script = page[page.rindex("<script>") :]
    assert not re.search(words, script) and "url(" not in page
    assert all("src" not in attributes for _, attributes in Page(page).tags)
    assert not re.search(r"\{\{\w+\}\}", page)


@pytest.mark.parametrize("alpha, psi0", [*PLACES, (0.4, -0.3)])
def test_the_table_that_is_kept_is_that_of_this_code(alpha, psi0):
    """Places between its nodes: a state is off by no more than the page says."""
    kept = playground_page.read(playground.kept_page())
    off = playground.deviation(kept.at(alpha, psi0), alpha, psi0)
    assert off <= max(kept.error(alpha, psi0), SAMPLED) < 0.02


def test_without_a_table_the_command_that_makes_it_is_named(tmp_path):
    with pytest.raises(NotConverged, match="playground --out"):
        playground.kept_page(tmp_path / "playground.json")


def test_a_page_that_is_too_large_is_an_error():
    with pytest.raises(NotConverged, match="smaller --fineness"):
        playground.fitting("x" * (playground.LARGEST + 1))
    assert playground.fitting("x") == "x"


def test_the_page_can_be_used_with_keys_and_read_aloud(made):
    page = Page(made[1])
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(set(ids)) == len(ids)
    assert page.of("html")[0]["lang"] == "en" and len(page.of("h1")) == 1
    labelled = {attributes["for"] for attributes in page.of("label") if "for" in attributes}
    sliders = [attributes["id"] for attributes in page.of("input") if attributes["type"] == "range"]
    assert sliders == ["load", "alpha", "psi0"] and set(sliders) == labelled
    assert {attributes["for"] for attributes in page.of("output")} == set(sliders)
    for canvas in page.of("canvas"):
        assert canvas["role"] == "img" and {"aria-label", "aria-labelledby"} & set(canvas)
    # what the script asks for exists
    asked = set(re.findall(r'\$\("([\w-]+)"\)', made[1])) | set(
        re.findall(r'^    "([\w-]+)": ', made[1], re.M)
    )
    assert asked <= set(ids)


def test_script_and_python_agree_on_names(made):
    """Columns, rows and laws that the table may name are known to the script."""
    _, page = made
    script = page[page.rindex("<script>") :]
    for name in ("crowded", "even", "upper", "both"):
        assert re.search(rf"^  {name}: ", script, re.M), name
    for patch in (*playground_survey.REGIONS, ("B alone",)):
        assert f'"{patch[0]}"' in script or f"{patch[0]}: " in script


def test_the_template_travels_with_the_package():
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg")
    patterns = config["options.package_data"]["microblock.cases"].split(",")
    packed = {path for pattern in patterns for path in (ROOT / "cases").glob(pattern.strip())}
    assert {ROOT / "cases" / "report" / f"playground.{kind}" for kind in ("html", "css", "js")} <= packed


def test_the_command_writes_one_page_and_its_errors(table, made, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(playground, "made", lambda parameters, quiet: table)
    assert main(["playground", "--out", str(tmp_path), "--json", str(tmp_path / "a.json")]) == 0
    assert (tmp_path / "playground.html").read_text() == made[1]
    printed = capsys.readouterr()
    assert "times above what is shown" in printed.out and "playground.html" in printed.err
    answer, _ = made
    assert {"parameters", "versions", "seconds"} <= set(answer)
    assert answer["states_computed"] > answer["states"] > 100
    assert 0 < answer["error_median"] < answer["error_max"] < 1
    # psi0 adds a_Hz/R = 0.034 of itself to the levers
    assert 1e-3 < answer["hertz_difference"] < 0.034


def shown(page, folder, state, *options):
    """{id: text} of what Chromium makes of the page."""
    ran = subprocess.run(
        [
            CHROMIUM,
            *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
            *("--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=3000"),
            f"--user-data-dir={folder}/profile",
            *options,
            f"{page.as_uri()}#{state}",
        ],
        check=True,
        capture_output=True,
        text=True,
        timeout=120,
    )
    found = re.findall(r'id="([\w-]+)"[^>]*>([^<]*)<', ran.stdout)
    return {name: html.unescape(text) for name, text in found}


@pytest.mark.browser
@pytest.mark.parametrize(
    "load, alpha, psi0", [(1, 0.25, 0.1), (2, 0.5, -0.4), (0.1, 0.3, 0.2), (1, 0.2, 0.43)]
)
def test_the_script_shows_what_python_computes(made, found, tmp_path, load, alpha, psi0):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    (tmp_path / "playground.html").write_text(made[1])
    text = shown(
        tmp_path / "playground.html", tmp_path, f"load={load}&alpha={alpha}&psi0={psi0}", "--dump-dom"
    )
    scale = math.sqrt(load)
    own = found.at(alpha / scale, psi0 / scale)
    half_width = (own.edges[-1] - own.edges[0]) / 2 * scale
    numbers = {name: float(text[name].replace("\u2212", "-")) for name in ("half-width", "peak", "hardness")}
    assert numbers["half-width"] == pytest.approx(half_width, abs=6e-4)  # three decimals
    x = np.linspace(own.edges[0], own.edges[-1], 4001)
    one, other = fields(own, x, alpha / scale, psi0 / scale)[:2]
    assert numbers["peak"] == pytest.approx((one + other).max() * scale, abs=1e-3)  # samples of both
    contact = sum(right - left for left, right in own.zones(BOTH))
    assert numbers["hardness"] == pytest.approx(2 / contact, abs=6e-4)
    zones = [f"{left * scale:.3f} \u2026 {right * scale:.3f}" for left, right in own.zones(A)]
    assert text["zones-a"].replace("\u2212", "-") == ("; ".join(zones).replace("-0.000", "0.000") or "none")
    error_shown = 100 * found.error(alpha / scale, psi0 / scale)
    # rounded upwards to one digit
    assert error_shown * 0.99 <= float(text["error"].split()[0]) <= 2 * error_shown


@pytest.mark.browser
@pytest.mark.parametrize("size", ["1366,900", "500,1400"])
def test_the_pictures_are_drawn(made, tmp_path, size):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    images = pytest.importorskip("PIL.Image")
    (tmp_path / "playground.html").write_text(made[1])
    picture = tmp_path / "picture.png"
    shown(
        tmp_path / "playground.html", tmp_path, "load=1", f"--window-size={size}", f"--screenshot={picture}"
    )
    seen = np.asarray(images.open(picture).convert("RGB")).reshape(-1, 3).astype(int)
    # the cylinder, blocks with both corners closed, lines of A and B, two areas of the map
    for colour in ("b9bfc6", "a9e0cd", "0072b2", "c24e00", "bfe5d8", "e6d5f0"):
        wanted = [int(colour[i : i + 2], 16) for i in (0, 2, 4)]
        assert (np.abs(seen - wanted).max(axis=1) <= 2).sum() > 200, colour
