"""The pages: built without a warning, all links lead somewhere, and nothing comes from the network.

`.ci/site` runs this. Notebooks and the scripts of the gallery do not run here. `python -m pytest -m browser`
opens the playground in Chromium.
"""

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

import microblock as mb

ROOT = Path(__file__).parents[1]
# links that leave the pages: the paper, and what the theme says of itself
EXTERNAL = (
    "https://doi.org/",
    "https://keepachangelog.com/",
    "https://www.sphinx-doc.org/",
    "https://pradyunsg.me",
    "https://github.com/pradyunsg/furo",
)
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Page(HTMLParser):
    """Ids, links and loaded files of a page."""

    def __init__(self, path):
        super().__init__()
        self.ids = set()
        self.links = set()
        self.loaded = set()
        self.equations = 0
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        named = {name: value for name, value in attributes if value}
        self.ids |= {named[name] for name in ("id", "name") if name in named}
        self.equations += tag == "math"
        (self.links if tag == "a" else self.loaded).update(
            named[name] for name in ("href", "src") if name in named
        )


def built(folder):
    """The pages, built into a folder without notebooks and pictures: {path: Page}."""
    words = [
        "-q",
        "-W",
        "--keep-going",
        "-d",
        folder / "trees",
        "-D",
        "nb_execution_mode=off",
        "-D",
        "plot_gallery=0",
    ]
    command = [sys.executable, "-m", "sphinx", *words, "docs", folder / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {path: Page(path) for path in sorted((folder / "site").rglob("*.html"))}


def lost(pages):
    """Links and files that lead nowhere, or out of the pages."""
    dead_links = []
    for path, page in pages.items():
        for target in page.links | page.loaded:
            file, _, anchor = target.partition("#")
            aim = (path.parent / unquote(file).partition("?")[0]).resolve() if file else path
            if re.match(r"\w+:", target):
                good = target.startswith(EXTERNAL) and target not in page.loaded
            else:
                good = aim.exists() and (not anchor or aim in pages and unquote(anchor) in pages[aim].ids)
            dead_links += [] if good else [(path.name, target)]
    return dead_links


@pytest.mark.site
def test_pages_are_built_and_lead_somewhere(tmp_path):
    """One build for all that is asked of it, since it takes seconds."""
    pytest.importorskip("sphinx_gallery", reason="the pages need the extra `docs`")
    pages, site = built(tmp_path), tmp_path / "site"
    assert not lost(pages)
    pages[site / "index.html"].links.add("theory/model.html#nowhere")
    pages[site / "index.html"].loaded.add("https://example.org/script.js")
    assert len(lost(pages)) == 2  # which would be seen
    styles = "".join(path.read_text() for path in site.rglob("*.css"))
    assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", styles)
    reference = set().union(*(page.ids for path, page in pages.items() if path.parent.name == "reference"))
    assert {*(f"microblock.{name}" for name in mb.__all__), "microblock.Microclamped.shifts"} <= reference
    assert pages[site / "theory" / "halfplane.html"].equations > 50
    # a script that imports another one does not run where it is downloaded to
    said = re.sub("<[^>]*>", "", (site / "gallery" / "space" / "sphere.html").read_text())
    assert "in the root of the checkout, python -m cases.sphere" in said
    assert (site / "_static" / "STIXTwoMath.woff").stat().st_size > 1e5


@pytest.mark.browser
def test_playground_shows_the_state(tmp_path):
    """Its first state, of blocks of a quarter of a_Hz, to its two decimals."""
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={tmp_path}",
        "--dump-dom",
    ]
    page = (ROOT / "cases" / "playground" / "playground.html").as_uri()
    shown = subprocess.run([*command, page], check=True, capture_output=True, timeout=120, text=True).stdout
    a_Hz, p_Hz = mb.hertz_scales(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1), R=10, P=1)
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.25 * a_Hz)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(10), mb.Microblock())
    state = problem.solve(load=1)
    edge = r"(-?[\d.]+)"
    zones = rf"Zones of A: {edge} to {edge}; of B: {edge} to {edge}; of both corners: {edge} to {edge}\."
    numbers = re.search(rf"Half-width {edge}, largest pressure {edge}\. {zones}", shown)
    edges = [edge / a_Hz for name in ("A", "B", "full") for edge in state.zones[name][0]]
    values = [state.half_width / a_Hz, state.pressure.max() / p_Hz, *edges]
    assert [*map(float, numbers.groups())] == pytest.approx(values, abs=0.0051)
