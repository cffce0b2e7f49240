"""Sliders as they are seen and moved in JupyterLab, and the case that measures them; no times here.

`python -m pytest -m browser` runs those in a browser: they need Chromium and the extra `browser`.
"""

import copy
import io
import os
import sys
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from cases.__main__ import main
from cases.report import notebooks
from cases.studies import sliders
from cases.studies import sliders_browser as browser
from microblock import MissingExtra, NotConverged
from microblock.data.records import read_records
from microblock.view.state_figure import BLOCK_FILLS
from microblock.view.widgets import LABELS

# of all parts of the sliders that have to be whole: their words do not go beyond their boxes, nor these
# beyond what shows them
PARTS = """() => {
  const box = element => element.getBoundingClientRect();
  const all = words => [...document.querySelectorAll(words)];
  const seen = box(document.querySelector(".jp-WindowedPanel-outer, .jp-Notebook"));
  const image = document.querySelector(".microblock-picture img"), picture = box(image);
  const parts = all(".microblock-controls .widget-readout, .microblock-controls .widget-label, " +
    ".microblock-controls button, .microblock-controls .noUi-handle, .microblock-controls select")
    .filter(part => box(part).width > 0);
  const outer = box(document.querySelector(".microblock-explore"));
  const within = part => part.left >= outer.left - 1 && part.right <= outer.right + 1;
  const shown = part => part.left >= seen.left && part.right <= seen.right &&
    part.top >= seen.top - 1 && part.bottom <= seen.bottom;
  const words = part => part.innerText || part.className;
  return {
    natural: [image.naturalWidth, image.naturalHeight],
    picture: [picture.width, picture.height],
    pictureSeen: shown(picture),
    hidden: parts.filter(part => !shown(box(part))).map(words),
    cut: parts.filter(part => part.scrollWidth > part.clientWidth + 1 && !part.matches(".noUi-handle"))
      .map(words),
    numbers: all(".microblock-numbers td").filter(part => box(part).width > 0)
      .filter(part => !within(box(part)) || part.scrollWidth > part.clientWidth + 1).map(words),
    readouts: all(".microblock-controls .widget-readout").map(words),
    beside: box(document.querySelector(".microblock-numbers")).right <= picture.left,
  };
}"""
ROWS = """() => Object.fromEntries([...document.querySelectorAll(".microblock-numbers tr")]
  .map(row => [row.cells[0].innerText, row.cells[row.cells.length - 1].innerText]))"""


@pytest.fixture(scope="module")
def lab():
    try:
        with browser.Lab(*sliders.notebook("psi0")) as opened:
            yield opened
    except MissingExtra as failure:
        pytest.skip(str(failure))


def kept(page, name):
    """Keep what is seen where someone wants to look at it."""
    if os.environ.get("SCREENSHOTS"):
        page.screenshot(path=Path(os.environ["SCREENSHOTS"]) / f"sliders_{name}.png")


@pytest.mark.browser
@pytest.mark.parametrize("width", [1366, 1024])
def test_sliders_numbers_and_blocks_are_in_view(lab, width):
    page = lab.sliders(width)  # with the list of files open beside the notebook
    kept(page, width)
    found = page.evaluate(PARTS)
    wide, high = found["natural"]
    # as large as it is, or smaller in the same shape: to half a pixel
    assert found["picture"][0] <= wide
    assert found["picture"][1] == pytest.approx(found["picture"][0] * high / wide, abs=0.6)
    assert found["pictureSeen"] and found["hidden"] == [] and found["cut"] == [] and found["numbers"] == []
    assert found["readouts"] == ["1.00", "0.57", "10.0", "0.250"]
    assert found["beside"] == (width == 1366)
    page.close()


@pytest.mark.browser
def test_keys_and_drags_move_what_is_shown_to_the_last_value(lab):
    page = lab.sliders(1366)
    assert set(sliders.names_of(page)) == set(LABELS) - {"law"}
    before = page.evaluate(ROWS)
    for name, handle in sliders.names_of(page).items():
        taken = browser.keys(page, handle, 2)
        assert None not in taken, name
        after = page.evaluate(ROWS)
        assert after["contact"] != before["contact"], name
        before = after
    assert None not in browser.drags(page, sliders.names_of(page)["load"], 2)
    moves = 40
    pictures, _, _ = browser.sweep(page, sliders.names_of(page)["load"], moves, pause=5)
    # moves that came while a picture was made are left out, but for the last one
    assert pictures < moves
    shown = float(page.locator(".microblock-controls .widget-readout").first.inner_text())
    # the slider shows three digits, the table four; on a busy machine it comes later
    page.wait_for_function(f"shown => Math.abs(parseFloat(({ROWS})().load)/shown - 1) < 5e-3", arg=shown)
    kept(page, "moved")
    page.close()


@pytest.mark.browser
def test_toggles_show_hertz_and_the_field_below(lab):
    page = lab.sliders(1366)
    assert browser.waited(page, page.get_by_role("button", name="Hertz").click) is not None
    kept(page, "hertz")
    below = page.locator(".microblock-below img")
    assert not below.is_visible()
    page.get_by_role("button", name="field below").click()
    page.wait_for_function("document.querySelector('.microblock-below img').naturalWidth > 100")
    assert below.is_visible()
    below.scroll_into_view_if_needed()
    kept(page, "below")
    source = below.get_attribute("src")
    browser.keys(page, sliders.names_of(page)["load"], 1)
    # it follows when the slider rests
    page.wait_for_function(
        "source => document.querySelector('.microblock-below img').src !== source", arg=source
    )
    page.get_by_role("button", name="field below").click()
    below.wait_for(state="hidden")
    page.close()


@pytest.fixture(scope="module")
def executed():
    """A notebook with sliders, executed without a browser as `jupyter nbconvert --execute` does it."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    cells = [nbformat.v4.new_code_cell(each) for each in sliders.notebook("cylinder")]
    book = nbformat.v4.new_notebook(cells=cells)
    found = os.pathsep.join(filter(None, (str(browser.ROOT), os.environ.get("PYTHONPATH"))))
    client = nbclient.NotebookClient(book, timeout=300, kernel_name="python3")
    return client.execute(env={**os.environ, "PYTHONPATH": found})


def exported(book, with_state):
    """The notebook as nbconvert writes it, with the state of the widgets or without."""
    book = copy.deepcopy(book)
    assert book.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"]
    if not with_state:
        del book.metadata["widgets"]
    return notebooks.page(book)


@pytest.mark.parametrize("with_state", [True, False])
def test_a_still_picture_survives_nbconvert(executed, with_state):
    images = pytest.importorskip("PIL.Image")
    still = executed.cells[-1].outputs[-1].data["image/png"]
    assert f'src="data:image/png;base64,{still.strip()}"' in exported(executed, with_state)
    picture = np.asarray(images.open(io.BytesIO(b64decode(still))).convert("RGB"))
    # lines and letters on white, and the colour of blocks of which both corners are closed
    colour = 255 * np.array(to_rgb(BLOCK_FILLS[True, True]))
    assert picture.shape == (528, 624, 3) and (picture.min(axis=2) < 200).mean() > 0.01
    assert (np.abs(picture.astype(int) - colour).max(axis=2) <= 3).sum() > 2000


@pytest.mark.browser
@pytest.mark.parametrize("with_state", [True, False])
def test_the_still_picture_is_seen_where_there_is_no_kernel_and_no_net(lab, executed, with_state, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(exported(executed, with_state))
    page = lab.browser.new_page(viewport={"width": 1024, "height": 768})
    page.goto(path.as_uri())
    still = page.locator("img[class*='-still']")
    assert still.count() == 1 and still.is_visible()
    assert [still.evaluate(f"image => image.natural{side}") for side in ("Width", "Height")] == [624, 528]
    kept(page, f"still_{with_state}")
    page.close()


@pytest.mark.browser
def test_the_still_picture_is_not_seen_beside_living_sliders(lab):
    page = lab.sliders(1366)
    still = page.locator("img[class*='-still']")
    assert still.count() == 1 and not still.is_visible()
    page.close()


class Faked:
    """A browser that needs none."""

    def __init__(self, *cells):
        assert "mb.explore" in cells[-1]

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        pass


def test_the_case_keeps_what_it_measures(monkeypatch, tmp_path, capsys):
    taken = {("load", "key"): [10.0, 20.0, 30.0], ("psi0", "key"): [40.0], ("load", "drag"): [5.0, None]}
    monkeypatch.setattr(browser, "Lab", Faked)
    monkeypatch.setattr(sliders, "in_browser", lambda *given: (dict(taken), {"load": 7.0}))
    line = "sliders --only cylinder --widths 1366 --presses 2"
    assert main([*line.split(), "--out", str(tmp_path)]) == 0
    rows = read_records(tmp_path / "sliders.csv")
    assert all(row["command"].endswith(line) and row["version_machine"] for row in rows)
    keyed = next(row for row in rows if (row["slider"], row["by"]) == ("all", "key"))
    assert (keyed["count"], keyed["median"], keyed["largest"]) == (4, 25.0, 40.0)
    # the 95th percentile of four: 0.85 of the way from the third to the last
    assert keyed["p95"] == pytest.approx(30 + 0.85 * 10)
    dragged = next(row for row in rows if (row["slider"], row["by"]) == ("load", "drag"))
    assert dragged["count"] == 1 and dragged["pictures_per_second"] == 7.0
    # without a browser: a picture takes longer than the state in it
    alone = {row["by"]: row["median"] for row in rows if row["slider"] == "radius"}
    assert 0 < alone["state"] < alone["picture"]
    assert "milliseconds elapsed" in capsys.readouterr().out
    shown = sliders.table_of(tmp_path / "sliders.csv")()
    assert {row["by"] for row in shown} == {"state", "picture", "key", "drag"} and "slider" not in shown[0]


def test_without_records_the_table_says_how_to_make_them(tmp_path):
    with pytest.raises(NotConverged, match="cases sliders --out"):
        sliders.table_of(tmp_path / "none.csv")()


def test_without_a_browser_the_case_says_what_it_needs(monkeypatch):
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    with pytest.raises(MissingExtra, match=r"microblock\[browser\]"):
        browser.needed("playwright.sync_api")
