"""What themes and notebooks leave to be done on a page.

For readers without a mouse or without sight: what scrolls is reached by the keyboard, and the landmarks of a
page have names. For all: sliders need a kernel, so that a page has neither their state nor their scripts.
"""

import re
from pathlib import Path

import matplotlib

from microblock.view.plots import STYLE

NAMED = {
    r'(<div class="table-wrapper [^"]*")>': r'\1 tabindex="0">',
    '\n(<div id="search-results">)': r"\n<h1>Search</h1><p>The search field is in the menu.</p>\1",
    "<pre>": '<pre tabindex="0">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="All pages">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
    # the figure of a cell, which scrolls on a telephone
    r'<img alt="[^"]*_images/[^"]*"( src="[^"]*" />)': (
        r'<div class="wide" tabindex="0"><img alt="What the code above draws"\1</div>'
    ),
}


def names(app, failure):
    """Rewrite the pages; a page that is rewritten already stays as it is."""
    if failure or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        text = page.read_text()
        named = text
        for before, after in NAMED.items():
            named = re.sub(before, after, named)
        if named != text:
            page.write_text(named)


def without_sliders(app, name, template, context, doctree):
    """Drop what myst-nb would add to the page of a notebook with sliders."""
    getattr(app.env, "nb_metadata", {}).get(name, {}).pop("js_files", None)


def style(gallery, script):
    """Pictures of the gallery have our style, and no ground of their own: that of the page is seen."""
    matplotlib.rcParams.update({**STYLE, "savefig.transparent": True})


def setup(app):
    app.connect("html-page-context", without_sliders, priority=400)  # before myst-nb's
    app.connect("build-finished", names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
