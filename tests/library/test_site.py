"""The pages: they are built without a warning, all links lead somewhere, and nothing comes from the network.

`.ci/site` runs this. Notebooks and the examples of the gallery have tests of their own and do not run here.
`python -m pytest -m browser tests/library/test_site.py` opens pages in Chromium and reads its log.
"""

import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

import microblock as mb

ROOT = Path(mb.__file__).parents[1]
REFERENCE = ROOT / "docs" / "reference"
LISTED = re.findall(
    r"^\.\. auto(?:class|function):: microblock\.(\S+)$",
    "\n".join(page.read_text() for page in sorted(REFERENCE.glob("*.rst"))),
    re.M,
)
# links that leave the pages: the paper, and what the theme says of itself
EXTERNAL = {
    "https://doi.org/10.1016/j.ijsolstr.2020.07.001",
    "https://www.sphinx-doc.org/",
    "https://pradyunsg.me",
    "https://github.com/pradyunsg/furo",
}
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIET = (  # without a window, and without what a browser asks for by itself
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--virtual-time-budget=3000",
)


class Page(HTMLParser):
    """Ids, links and loaded files of a page."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links, self.loaded, self.equations = set(), set(), set(), 0
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids |= {given[name] for name in ("id", "name") if given.get(name)}
        self.equations += tag == "math"
        if tag == "a" and given.get("href"):
            self.links.add(given["href"])
        elif tag == "link" and given.get("href"):
            self.loaded.add(given["href"])
        elif given.get("src"):
            self.loaded.add(given["src"])


def built(folder):
    """The pages, built into a folder without notebooks and pictures: {path: Page}."""
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(folder / "trees")]
    quick = ["-D", "nb_execution_mode=off", "-D", "gallery_pictures=0"]
    done = subprocess.run(
        [*command, *quick, "docs", str(folder / "site")], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return {path: Page(path) for path in sorted((folder / "site").rglob("*.html"))}


def lost(pages):
    """Links and files that lead nowhere, or out of the pages."""
    found = []
    for path, page in pages.items():
        for target in page.links | page.loaded:
            file, _, anchor = target.partition("#")
            if re.match(r"\w+:", target):
                wrong = target not in EXTERNAL or target in page.loaded
            else:
                leads = (path.parent / unquote(file).partition("?")[0]).resolve() if file else path
                known = pages[leads].ids if leads in pages else ()
                wrong = not leads.exists() or bool(anchor) and unquote(anchor) not in known
            if wrong:
                found.append((path.name, target))
    return found


@pytest.mark.site
def test_pages_are_built_and_lead_somewhere(tmp_path):
    """One build for all that is asked of it, since it takes seconds."""
    pytest.importorskip("myst_nb", reason="the pages need the extra `docs`")
    pages = built(tmp_path)
    site = tmp_path / "site"
    assert not lost(pages)
    page = pages[site / "index.html"]
    page.links.add("theory/model.html#nowhere")
    page.loaded.add("https://example.org/script.js")
    assert len(lost(pages)) == 2  # which would be seen
    styles = "".join(path.read_text() for path in site.rglob("*.css"))
    assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", styles)
    reference = set().union(*(page.ids for path, page in pages.items() if path.parent.name == "reference"))
    assert {f"microblock.{name}" for name in LISTED} <= reference
    assert "microblock.Microclamped.initial_gaps" in reference  # which it inherits
    assert pages[site / "theory" / "halfplane.html"].equations > 50
    assert (site / "_static" / "STIXTwoMath.woff").stat().st_size > 1e5


def asked(page, folder):
    """Addresses that a page asks the network for, by Chromium's log; what the browser asks for itself has no
    origin there.
    """
    log = folder / "log.json"
    command = [CHROMIUM, *QUIET, f"--user-data-dir={folder}/profile", f"--log-net-log={log}"]
    subprocess.run([*command, "--dump-dom", page.as_uri()], check=True, capture_output=True, timeout=120)
    given = [event.get("params", {}) for event in json.loads(log.read_text())["events"]]
    return {one["url"] for one in given if one.get("initiator", "not an origin") != "not an origin"}


@pytest.mark.browser
def test_opened_pages_ask_nothing_of_the_network(tmp_path):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    built(tmp_path)
    for name in ("index", "theory/halfplane", "tutorials/first_contact", "gallery/index", "search"):
        assert not asked(tmp_path / "site" / f"{name}.html", tmp_path), name
    curious = tmp_path / "curious.html"
    curious.write_text('<img src="http://localhost:1/picture.png">')
    assert asked(curious, tmp_path) == {"http://localhost:1/picture.png"}  # which would be seen
