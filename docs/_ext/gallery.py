"""The gallery: each page has an example that is run when the pages are built, and shown with its picture.

```{example} words for who cannot see the picture``` holds some ten lines of Python that end with a `figure`.
```{thumbnails}``` shows the pictures of all pages of the gallery, with links. ```{playground}``` links to the
page of the case `playground`. Pictures are kept among the doctrees until the example or a file of the program
changes. With `-D gallery_pictures=0` nothing is run: the pages have their code alone.
"""

import contextlib
import hashlib
import io
import os
import re
import shutil
import traceback
from pathlib import Path

import matplotlib
from docutils import nodes
from docutils.parsers.rst import directives
from PIL import Image
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from microblock.view.plots import COLUMN, STYLE

FOLDER = "gallery"
DPI = 220  # of a picture: as sharp as screens of telephones
INCH = 150  # pixels of the page, on which there is room for them
WIDTHS = {1: COLUMN, 2: 4.4, 3: 5.4}  # inches, by the number of panels beside each other
HEIGHT = 2.4  # inches, of a figure that asks for none
THUMBNAIL = 420, 315  # pixels, for half of that on the page
# the panel that is the thumbnail of a tall picture; else the first one: here the shape of the obstacle
PANELS = {"samples": -1, "wedge": -1}
EXAMPLE = re.compile(r"^```\{example\}[^\n]*\n(.*?)^```", re.M | re.S)
TITLE = re.compile(r"^# (.+)$", re.M)
logger = logging.getLogger(__name__)


def code(page):
    """The example of a page of the gallery, None where it has none."""
    found = EXAMPLE.search(page.read_text())
    return found and found[1]


def style():
    """The style of our figures, at the width of one column, and no window."""
    return matplotlib.rc_context({**STYLE, "backend": "Agg", "figure.figsize": (COLUMN, HEIGHT)})


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
                _draw(example, picture, PANELS.get(page.stem, 0))
        except Exception:  # whatever the example does
            logger.warning("the example failed: %s", traceback.format_exc(), location=str(page))
            continue
        app.env.pictures[page.stem] = picture


def narrowed(figure):
    """A figure as wide as its panels need to be read on a telephone: letters keep their size."""
    width, height = figure.get_size_inches()
    grids = [axis.get_subplotspec().get_gridspec() for axis in figure.axes if axis.get_subplotspec()]
    least = WIDTHS[max(grid.ncols for grid in grids)]
    if least < width:
        figure.set_size_inches(least, height * (1 + least / width) / 2)
    return figure


def _draw(example, picture, panel):
    """Write the picture of an example, after its thumbnail: of a tall picture one panel."""
    whole = io.BytesIO()
    with style():
        figure = narrowed(run(example))
        figure.savefig(whole, format="png", dpi=DPI)
        box = figure.axes[panel].get_tightbbox().padded(0.05 * figure.dpi)
    scale = DPI / figure.dpi
    with Image.open(whole) as drawn:
        reduced = drawn.convert("RGB")
        if drawn.height * THUMBNAIL[0] > drawn.width * THUMBNAIL[1]:
            left, right = max(box.x0 * scale, 0), min(box.x1 * scale, drawn.width)
            top, bottom = (
                max(drawn.height - box.y1 * scale, 0),
                min(drawn.height - box.y0 * scale, drawn.height),
            )
            reduced = reduced.crop((round(left), round(top), round(right), round(bottom)))
    reduced.thumbnail(THUMBNAIL, Image.Resampling.LANCZOS)
    picture.parent.mkdir(exist_ok=True)
    reduced.save(small(picture), optimize=True)
    picture.write_bytes(whole.getvalue())


def small(picture):
    """Path of the thumbnail of a picture."""
    return picture.with_name(f"{picture.stem}_small.png")


def make_playground(app):
    """Write the page of the playground from its table, and note where it is."""
    from cases.report import playground

    app.env.playground = None
    if app.config.gallery_pictures:
        page = Path(app.doctreedir) / "playground" / playground.PAGE
        page.parent.mkdir(exist_ok=True)
        page.write_text(playground.kept_page())
        app.env.playground = page


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
    image = nodes.image(uri=Path(os.path.relpath(picture, source)).as_posix(), alt=alt)
    if alt:  # not a thumbnail
        with Image.open(picture) as drawn:
            image["width"] = f"{round(drawn.width / DPI * INCH)}px"
    return image


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
