"""A notebook with sliders in JupyterLab and headless Chromium, without a net: what is asked of it, and when
its picture is painted.
"""

import json
import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import ExitStack, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from microblock.errors import MissingExtra, NotConverged

from ..common.catalog import CASES, PACKAGE

ROOT = CASES.parents[PACKAGE.count(".")]  # of the checkout, or where the packages are installed
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")  # names of its command
OFFLINE = "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1"
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
HEIGHT = 768  # pixels of the window
PATIENCE = 120.0  # seconds for a page, a kernel and its first state
WAIT = 5.0  # seconds for a picture, after which none is expected
TURN = 20  # moves, after which a drag goes back
REST = 150  # milliseconds between a picture and what is asked next: the numbers and the field follow it
NOTEBOOK = "sliders.ipynb"
NEWS = "@jupyterlab/apputils-extension/notification.jupyterlab-settings"
# From what was asked (a key, a move or the release of the mouse) to the frame after the picture has loaded:
# a message posted in that frame arrives when it is painted.
WATCH = """() => {
  const watch = window.watch = {asked: null, waits: [], last: 0, resolve: null};
  for (const kind of ["keydown", "mousemove", "mouseup", "pointermove", "pointerup"])
    document.addEventListener(kind, event => { watch.asked = event.timeStamp; }, true);
  const channel = new MessageChannel();
  channel.port1.onmessage = () => {
    watch.last = performance.now();
    watch.waits.push(watch.last - watch.asked);
    if (watch.resolve) { watch.resolve(watch.last - watch.asked); watch.resolve = null; }
  };
  document.querySelector(".microblock-picture img").addEventListener("load",
    () => requestAnimationFrame(() => channel.port2.postMessage(0)));
}"""
SOON = f"""words => Promise.race([eval(words), new Promise((_, fail) =>
  setTimeout(() => fail(new Error(words + " takes too long")), {1e3 * PATIENCE:.0f}))])"""
NEXT = """wait => { watch.next = new Promise(resolve => {
  watch.resolve = resolve;
  setTimeout(() => { if (watch.resolve === resolve) { watch.resolve = null; resolve(null); } }, wait);
}); }"""


class Lab:
    """JupyterLab on this machine with a notebook of the given cells, and Chromium; a context manager."""

    def __init__(self, *cells):
        self.cells = cells

    def __enter__(self):
        with ExitStack() as stack:
            self.folder = Path(stack.enter_context(TemporaryDirectory(ignore_cleanup_errors=True)))
            self._write()
            self.address = self._served(stack)
            self.browser = self._started(stack)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, kind, failure, trace):
        (playwright,) = needed("playwright.sync_api")
        broken = isinstance(failure, playwright.Error)
        with suppress(playwright.Error) if broken else nullcontext():  # what is broken need not close
            self._stack.__exit__(kind, failure, trace)
        if broken:
            raise NotConverged(f"the browser stopped: {failure}; try again") from failure

    def _write(self):
        (nbformat,) = needed("nbformat")
        book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(each) for each in self.cells])
        # without a name JupyterLab asks which kernel is meant
        book.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
        (self.folder / "notebooks").mkdir()
        nbformat.write(book, self.folder / "notebooks" / NOTEBOOK)
        quiet = self.folder / "settings" / NEWS
        quiet.parent.mkdir(parents=True)
        quiet.write_text(json.dumps({"fetchNews": "false", "checkForUpdates": False}))

    def _served(self, stack):
        """The address of a server of its own, whose kernels find these packages first."""
        needed("jupyterlab", "ipywidgets")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        folders = {
            "JUPYTER_CONFIG_DIR": "config",
            "JUPYTER_DATA_DIR": "data",
            "JUPYTER_RUNTIME_DIR": "runtime",
            "JUPYTERLAB_WORKSPACES_DIR": "workspaces",
            "JUPYTERLAB_SETTINGS_DIR": "settings",
        }
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        own = {name: str(self.folder / folder) for name, folder in folders.items()}
        words = [
            "--no-browser",
            "--allow-root",
            "--ip=127.0.0.1",
            f"--port={port}",
            "--IdentityProvider.token=",
            f"--ServerApp.root_dir={self.folder / 'notebooks'}",
            "--LabApp.expose_app_in_browser=True",
        ]
        log = stack.enter_context(open(self.folder / "log", "w"))
        server = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *words],
            env={**os.environ, **own, "PYTHONPATH": path},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        stack.callback(_stop, server)
        address = f"http://127.0.0.1:{port}"
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and server.poll() is None:
            try:
                urllib.request.urlopen(f"{address}/api").close()
                return address
            except OSError:
                time.sleep(0.2)
        raise NotConverged(f"JupyterLab does not answer: {(self.folder / 'log').read_text()[-300:]}")

    def _started(self, stack):
        (playwright,) = needed("playwright.sync_api")
        chromium = next(filter(None, map(shutil.which, CHROMIUM)), None)
        if chromium is None:
            raise NotConverged("no Chromium is installed; of Debian it is the package chromium")
        started = stack.enter_context(playwright.sync_playwright())
        browser = started.chromium.launch(executable_path=chromium, args=[*QUIET, OFFLINE])
        stack.callback(browser.close)
        return browser

    def sliders(self, width, height=HEIGHT):
        """The page of the executed notebook in a window of this width (pixels), scrolled to its sliders."""
        page = self.browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(PATIENCE * 1e3)
        page.goto(f"{self.address}/lab/tree/{NOTEBOOK}?reset")
        page.wait_for_function("window.jupyterapp && document.querySelector('.jp-NotebookPanel .jp-Cell')")
        page.evaluate(SOON, "jupyterapp.shell.currentWidget.sessionContext.ready")
        page.evaluate(SOON, "jupyterapp.commands.execute('notebook:run-all-cells')")
        page.wait_for_selector(".microblock-picture img", state="attached")
        page.wait_for_function("document.querySelector('.microblock-picture img').naturalWidth > 0")
        page.evaluate("document.querySelector('.microblock-explore').scrollIntoView()")
        page.wait_for_timeout(1000)
        page.evaluate(WATCH)
        return page


def _stop(server):
    """End the server, which ends its kernels."""
    server.terminate()
    try:
        server.wait(30)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()


def needed(*names):
    """Modules of the extra `browser`."""
    try:
        return [__import__(name, fromlist=["_"]) for name in names]
    except ImportError as failure:
        raise MissingExtra("the case sliders", failure.name, "browser") from failure


def handles(page):
    """{description of a slider: its handle}."""
    rows = page.locator(".microblock-controls .widget-slider")
    return {
        rows.nth(number).locator(".widget-label").inner_text(): rows.nth(number).locator(".noUi-handle")
        for number in range(rows.count())
    }


def waited(page, ask, wait=WAIT):
    """Milliseconds from what `ask()` does to its painted picture; None if none comes in `wait` seconds."""
    page.evaluate(NEXT, wait * 1e3)
    ask()
    taken = page.evaluate("watch.next")
    page.wait_for_timeout(REST)
    return taken


def keys(page, handle, count):
    """Milliseconds from each of so many presses of the arrow key to its painted picture."""
    handle.focus()
    return [waited(page, lambda: page.keyboard.press("ArrowRight")) for _ in range(count)]


def grasp(page, handle):
    """Press the mouse on a handle; returns its place (x, y)."""
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    return x, y


def drags(page, handle, count, pixels=2):
    """The same of so many moves of the mouse that holds the handle, to and fro; once no picture has followed
    a move, of so many releases.
    """
    found, follows = [], True
    x, y = grasp(page, handle)
    for number in range(count):
        place = x + pixels * (1 + number % TURN if number % (2 * TURN) < TURN else TURN - number % TURN)
        if follows:
            taken = waited(page, lambda place=place: page.mouse.move(place, y))
            follows = taken is not None
        else:
            page.mouse.move(place, y)
        if not follows:
            taken = waited(page, page.mouse.up)
            grasp(page, handle)
        found.append(taken)
    page.mouse.up()
    page.wait_for_timeout(REST)
    return found


def sweep(page, handle, moves, pixels=1, pause=16):
    """(pictures, seconds, milliseconds from the last move to the last picture) of a drag that does not
    wait.
    """
    x, y = grasp(page, handle)
    page.evaluate("() => { watch.waits = []; }")
    start = time.perf_counter()
    for number in range(moves):
        page.mouse.move(x + pixels * (number + 1), y)
        page.wait_for_timeout(pause)
    seconds = time.perf_counter() - start
    page.wait_for_timeout(1e3 * WAIT / 2)
    pictures, late = page.evaluate("() => [watch.waits.length, watch.last - watch.asked]")
    page.mouse.up()
    return pictures, seconds, late
