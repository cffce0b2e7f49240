"""The notebooks run from top to bottom in a kernel of their own, and look like something in a browser.

`.ci/site` runs the first. `python -m pytest -m browser` runs the second: it needs Chromium (Debian's package
`chromium`).
"""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from cases.__main__ import main
from cases.report import notebooks
from microblock import NotConverged

# two in kernels, with all that they show; the others, whose kernels would cost more than they do, as scripts
IN_KERNELS = [notebooks.NOTEBOOKS[name] for name in ("first_contact", "own_obstacle")]
AS_SCRIPTS = [path for path in notebooks.NOTEBOOKS.values() if path not in IN_KERNELS]
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="module")
def executed():
    """{name: the notebook with its outputs}, each executed once, in a kernel that finds this checkout
    first.
    """
    pytest.importorskip("nbclient")
    known = {}

    def execute(path):
        if path not in known:
            known[path], _, _ = notebooks.execute(path)
        return known[path]

    return execute


def outputs(book, mime):
    return [
        output.data[mime]
        for cell in book.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if mime in output.get("data", {})
    ]


@pytest.mark.site
@pytest.mark.parametrize("path", IN_KERNELS, ids=lambda path: path.stem)
def test_notebook_runs_from_top_to_bottom(executed, path):
    book = executed(path)  # an error in a cell is raised here
    assert len(outputs(book, "image/png")) >= 3
    assert any("error estimate" in table for table in outputs(book, "text/html"))
    assert not [
        output for cell in book.cells for output in cell.get("outputs", ()) if output.get("name") == "stderr"
    ]


@pytest.mark.site
@pytest.mark.parametrize("path", AS_SCRIPTS, ids=lambda path: path.stem)
def test_cells_run_from_top_to_bottom(path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.setattr(pyplot, "show", lambda: None)
    names = {"__name__": "__main__"}  # functions of a notebook travel to other processes
    for number, cell in enumerate(json.loads(path.read_text())["cells"]):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{path.stem}, cell {number}", "exec"), names)
    pyplot.close("all")


def test_there_are_notebooks_and_they_are_kept_without_outputs():
    assert {path.stem for path in notebooks.NOTEBOOKS.values()} == {
        "first_contact",
        "own_mesh",
        "own_obstacle",
        "rough_and_periodic",
        "three_dimensions",
    }
    for path in notebooks.NOTEBOOKS.values():
        assert not any(cell.get("outputs") for cell in json.loads(path.read_text())["cells"]), path.name


@pytest.mark.site
def test_sliders_of_the_first_notebook_are_there(executed):
    book = executed(notebooks.NOTEBOOKS["first_contact"])
    assert len(outputs(book, "application/vnd.jupyter.widget-view+json")) == 1


def small(folder, source):
    nbformat = pytest.importorskip("nbformat")
    book = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_markdown_cell("# Words"), nbformat.v4.new_code_cell(source)]
    )
    nbformat.write(book, folder / "small.ipynb")
    return folder / "small.ipynb"


def test_a_page_and_the_times_of_each_notebook_are_written(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(notebooks, "NOTEBOOKS", {"small": small(tmp_path, "import microblock; print(6*7)")})
    assert main(["notebooks", "--out", str(tmp_path / "out")]) == 0
    assert "42" in (tmp_path / "out" / "small.html").read_text() and "small" in capsys.readouterr().out
    assert (
        (tmp_path / "out" / "notebooks.csv")
        .read_text()
        .startswith("command,notebook,cells,kernel,slowest,all")
    )


def test_a_cell_that_fails_is_named(tmp_path):
    with pytest.raises(NotConverged, match="cell 1 of small.ipynb failed: ZeroDivisionError"):
        notebooks.execute(small(tmp_path, "1/0"))


@pytest.mark.browser
@pytest.mark.parametrize("path", IN_KERNELS, ids=lambda path: path.stem)
def test_notebook_shows_something_in_a_browser(executed, path, tmp_path):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    images = pytest.importorskip("PIL.Image")
    page, picture = (
        tmp_path / f"{path.stem}.html",
        Path(os.environ.get("SCREENSHOTS", tmp_path)) / f"{path.stem}.png",
    )
    page.write_text(notebooks.page(executed(path)))
    # scripts that the page wants from the net (mathematics, sliders) are not waited for
    subprocess.run(
        [
            CHROMIUM,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--window-size=1000,5200",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--virtual-time-budget=3000",
            f"--user-data-dir={tmp_path}/profile",
            f"--screenshot={picture}",
            page.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=120,
    )
    seen = np.asarray(images.open(picture).convert("RGB")).reshape(-1, 1000, 3)
    inked = (seen.min(axis=2) < 200).mean(axis=1) > 0.002  # rows of pixels with text or lines
    # three figures of some 300 rows and a page of text: a blank page or an error of the browser has none of
    # it
    assert inked.sum() > 1000
    # the blocks' colour, the obstacle's grey: the figures themselves, not frames around missing pictures
    for colour in ((251, 227, 208), (191, 191, 191)):
        assert (np.abs(seen.astype(int) - colour).max(axis=2) <= 3).sum() > 2000, colour
