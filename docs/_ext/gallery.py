"""The gallery: each page has an example that is run when the pages are built, and shown with its picture.

```{example} words for who cannot see the picture``` holds some ten lines of Python that end with a `figure`.
```{thumbnails}``` shows the pictures of all pages of the gallery, with links. ```{playground}``` links to the
page that the case `playground` writes, and shows nothing where there is no such case. Pictures are kept among
the doctrees until the example or a file of the program changes. With `-D gallery_pictures=0` nothing is run:
the pages have their code alone.
"""

import contextlib
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import traceback
from pathlib import Path

import matplotlib
from cycler import cycler
from docutils import nodes
from docutils.parsers.rst import directives
from PIL import Image
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from microblock.view.plots import COLOURS

FOLDER = "gallery"
DPI = 130  # of a picture: some 700 pixels for the width of a page
THUMBNAIL = 420, 315  # pixels, for half of that on the page
EXAMPLE = re.compile(r"^```\{example\}[^\n]*\n(.*?)^```", re.M | re.S)
TITLE = re.compile(r"^# (.+)$", re.M)
logger = logging.getLogger(__name__)


def code(page):
    """The example of a page of the gallery, None where it has none."""
    found = EXAMPLE.search(page.read_text())
    return found and found[1]


def style():
    """Colours that the colour-blind can tell apart, and no window."""
    return matplotlib.rc_context({"backend": "Agg", "axes.prop_cycle": cycler(color=COLOURS)})


def run(example):
    """The figure that an example ends with."""
    import matplotlib.pyplot as plt

    names = {}
    with style(), contextlib.redirect_stdout(io.StringIO()):
        exec(compile(example, "example", "exec"), names)
    plt.close("all")  # which leaves the figure itself as it is
    return names["figure"]


def make_pictures(app):
    """Run the examples that have changed, and keep their pictures."""
    app.env.pictures = {}
    if not app.config.gallery_pictures:
        return
    kept = Path(app.doctreedir) / FOLDER
    kept.mkdir(parents=True, exist_ok=True)
    for page in sorted((Path(app.srcdir) / FOLDER).glob("*.md")):
        example = code(page)
        if example is None:
            continue
        depends = app.config.gallery_digest + example + Path(__file__).read_text()
        known = hashlib.sha256(depends.encode()).hexdigest()[:16]
        picture = kept / f"{page.stem}-{known}" / f"{page.stem}.png"
        try:
            if not picture.exists():
                _draw(example, picture)
        except Exception:  # whatever the example does
            logger.warning("the example failed: %s", traceback.format_exc(), location=str(page))
            continue
        app.env.pictures[page.stem] = picture


def _draw(example, picture):
    """Write the picture of an example, after its thumbnail."""
    whole = io.BytesIO()
    with style():
        run(example).savefig(whole, format="png", dpi=DPI)
    with Image.open(whole) as drawn:
        # of a tall picture its lower part, where the blocks are
        top = max(drawn.height - drawn.width * THUMBNAIL[1] // THUMBNAIL[0], 0)
        reduced = drawn.convert("RGB").crop((0, top, drawn.width, drawn.height))
    reduced.thumbnail(THUMBNAIL, Image.Resampling.LANCZOS)
    picture.parent.mkdir(exist_ok=True)
    reduced.save(small(picture), optimize=True)
    picture.write_bytes(whole.getvalue())


def small(picture):
    """Path of the thumbnail of a picture."""
    return picture.with_name(f"{picture.stem}_small.png")


def make_playground(app):
    """Write the page of the case `playground`, if there is one, and note where it is."""
    from cases.common.catalog import headlines

    app.env.playground = None
    if not app.config.gallery_pictures or "playground" not in headlines():
        return
    folder = Path(app.doctreedir) / f"playground-{app.config.gallery_digest}"
    if not list(folder.glob("*.html")):
        command = [sys.executable, "-m", "cases", "playground", "--out", str(folder)]
        made = subprocess.run(command, cwd=Path(app.srcdir).parent, capture_output=True, text=True)
        if made.returncode:
            logger.warning("the playground failed: %s", made.stderr)
            return
    app.env.playground = next(folder.glob("*.html"))


def copy_playground(app, failure):
    """Put the playground beside the pages."""
    if not failure and app.env.playground and app.builder.format == "html":
        shutil.copytree(app.env.playground.parent, Path(app.outdir) / "playground", dirs_exist_ok=True)


class Example(SphinxDirective):
    """Code that makes a picture, below the picture."""

    has_content = True
    required_arguments = 1
    final_argument_whitespace = True

    def run(self):
        block = nodes.literal_block("\n".join(self.content), "\n".join(self.content), language="python")
        self.set_source_info(block)
        picture = self.env.pictures.get(Path(self.env.docname).name)
        return [*([_image(self, picture, self.arguments[0])] if picture else []), block]


class Thumbnails(SphinxDirective):
    """Pictures of the pages of the gallery, with links; `only` names some of them."""

    option_spec = {"only": directives.unchanged}

    def run(self):
        folder = Path(self.env.srcdir) / FOLDER
        only = self.options.get("only", "").split()
        pages = [folder / f"{name}.md" for name in only] or [
            page for page in sorted(folder.glob("*.md")) if code(page) is not None
        ]
        grid = nodes.container(classes=["thumbnails"])
        for page in pages:
            self.env.note_dependency(str(page))
            grid += self._entry(page)
        return [grid]

    def _entry(self, page):
        up = os.path.relpath(FOLDER, Path(self.env.docname).parent)
        link = nodes.reference("", "", internal=True, refuri=Path(up, page.stem).as_posix() + ".html")
        picture = self.env.pictures.get(page.stem)
        if picture:
            link += _image(self, small(picture), "")  # the words below it say what it is
        title = TITLE.search(page.read_text())[1]
        link += nodes.inline(title, title)
        return nodes.paragraph("", "", link)


class Playground(SphinxDirective):
    """A link to the playground, with the words that follow it."""

    has_content = True
    required_arguments = 1
    final_argument_whitespace = True

    def run(self):
        if self.env.playground is None:
            return []
        target = Path("playground", self.env.playground.name)
        up = os.path.relpath(target, Path(self.env.docname).parent)
        link = nodes.reference("", self.arguments[0], refuri=Path(up).as_posix())
        words = " " + " ".join(self.content)
        return [nodes.paragraph("", "", link, nodes.Text(words))]


def _image(directive, picture, alt):
    source = Path(directive.env.doc2path(directive.env.docname)).parent
    return nodes.image(uri=Path(os.path.relpath(picture, source)).as_posix(), alt=alt)


def setup(app):
    app.add_config_value("gallery_pictures", True, "env", bool)
    app.add_config_value("gallery_digest", "", "")
    app.add_directive("example", Example)
    app.add_directive("thumbnails", Thumbnails)
    app.add_directive("playground", Playground)
    app.connect("builder-inited", make_pictures)
    app.connect("builder-inited", make_playground)
    app.connect("build-finished", copy_playground)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
