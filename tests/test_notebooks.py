"""The notebooks run from top to bottom in a kernel of their own, and look like something in a browser.

`python -m pytest -m browser` runs the second: it needs Chromium (Debian's package `chromium`).
"""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT/"docs"/"notebooks").glob("*.ipynb"))
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="module")
def executed():
    """{name: the notebook with its outputs}, each executed once, in a kernel that finds this checkout first."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    known = {}

    def execute(path):
        if path not in known:
            book = nbformat.read(path, as_version=4)
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
            nbclient.NotebookClient(book, timeout=120, kernel_name="python3").execute(env=environment)
            known[path] = book
        return known[path]

    return execute


def outputs(book, mime):
    return [output.data[mime] for cell in book.cells if cell.cell_type == "code" for output in cell.outputs
            if mime in output.get("data", {})]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_from_top_to_bottom(executed, path):
    book = executed(path)      # an error in a cell is raised here
    assert len(outputs(book, "image/png")) >= 3
    assert any("error estimate" in table for table in outputs(book, "text/html"))
    assert not [output for cell in book.cells for output in cell.get("outputs", ()) if output.get("name") == "stderr"]


def test_there_are_notebooks_and_they_are_kept_without_outputs():
    import json
    assert {path.stem for path in NOTEBOOKS} == {"first_contact", "size_effects"}
    for path in NOTEBOOKS:
        assert not any(cell.get("outputs") for cell in json.loads(path.read_text())["cells"]), path.name


def test_sliders_of_the_first_notebook_are_there(executed):
    book = executed(ROOT/"docs"/"notebooks"/"first_contact.ipynb")
    assert len(outputs(book, "application/vnd.jupyter.widget-view+json")) == 1


@pytest.mark.browser
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_shows_something_in_a_browser(executed, path, tmp_path):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    nbconvert, images = pytest.importorskip("nbconvert"), pytest.importorskip("PIL.Image")
    page, picture = tmp_path/f"{path.stem}.html", Path(os.environ.get("SCREENSHOTS", tmp_path))/f"{path.stem}.png"
    page.write_text(nbconvert.HTMLExporter(template_name="lab").from_notebook_node(executed(path))[0])
    # scripts that the page wants from the net (mathematics, sliders) are not waited for
    subprocess.run([CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1000,5200",
                    "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=3000", f"--user-data-dir={tmp_path}/profile",
                    f"--screenshot={picture}", page.as_uri()], check=True, capture_output=True, timeout=120)
    seen = np.asarray(images.open(picture).convert("RGB")).reshape(-1, 1000, 3)
    inked = (seen.min(axis=2) < 200).mean(axis=1) > 0.002      # rows of pixels with text or lines
    # three figures of some 300 rows and a page of text: a blank page or an error of the browser has none of it
    assert inked.sum() > 1000
    # the blocks' colour, the obstacle's grey: the figures themselves, not frames around missing pictures
    for colour in ((251, 227, 208), (191, 191, 191)):
        assert (np.abs(seen.astype(int) - colour).max(axis=2) <= 3).sum() > 2000, colour
