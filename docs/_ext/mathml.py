"""Equations as MathML, which browsers render themselves: no script, no network.

docutils, which Sphinx rests on, translates LaTeX to MathML. The font STIX Two Math comes from the package
ziamath, reduced to the characters of mathematics and put beside the pages. LaTeX that is not understood is
a warning, so that a build with -W fails.
"""

import logging as standard
import re
from importlib.resources import files
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

FONT = "STIXTwoMath.woff"
# Latin and Greek, punctuation and primes, arrows, operators, delimiters, letters of mathematics
CHARACTERS = (
    *range(0x20, 0x7F),
    *range(0xA0, 0x100),
    *range(0x2B0, 0x400),
    *range(0x2010, 0x2070),
    *range(0x20D0, 0x20F0),
    *range(0x2100, 0x2150),
    *range(0x2190, 0x2300),
    *range(0x2308, 0x230C),
    *range(0x239B, 0x23B4),
    *range(0x27E6, 0x27F0),
    *range(0x1D400, 0x1D800),
)
NONE = 'lspace="0" rspace="0"'
THIN = '<mspace width="0.1667em"/>'
# a function after a factor, and a function whose argument has no parentheses
BEFORE_FUNCTION = re.compile(r"(</(?:mi|mn|msub|msup|mfrac|msqrt|mrow)>)(\s*<mi>(?:\w{3,5})</mi>)")
AFTER_FUNCTION = re.compile(r"(<mo>&ApplyFunction;</mo>)(?!\s*(?:<mo[^>]*>[\[(]|<mrow>\s*<mo[^>]*>[\[(]))")
logger = logging.getLogger(__name__)
standard.getLogger("fontTools").setLevel(standard.WARNING)


def mathml(latex, block=False):
    """MathML of LaTeX, with the spaces of LaTeX: around functions, none around a slash and inside bars."""
    text = tex2mathml(latex.strip(), as_block=block)
    text = re.sub(r'<mo stretchy="false">([/|])</mo>', rf'<mo stretchy="false" {NONE}>\1</mo>', text)
    text = BEFORE_FUNCTION.sub(rf"\1{THIN}\2", text)
    return AFTER_FUNCTION.sub(rf"\1{THIN}", text)


def _mathml(translator, node, block):
    """MathML of a node; the LaTeX itself, and a warning, where docutils does not understand it."""
    try:
        return mathml(node.astext(), block)
    except MathError as failure:
        logger.warning("LaTeX that is not understood: %s", failure, location=node)
        return translator.encode(node.astext())


def visit_inline(translator, node):
    translator.body.append(f'<span class="math notranslate">{_mathml(translator, node, False)}</span>')
    raise nodes.SkipNode


def visit_block(translator, node):
    translator.body.append(translator.starttag(node, "div", CLASS="math notranslate", tabindex="0"))
    if node["number"]:
        number = get_node_equation_number(translator, node)
        translator.body.append(f'<span class="eqno">({number})</span>')
    translator.body.append(_mathml(translator, node, True) + "</div>\n")
    raise nodes.SkipNode


def write_font(app, failure):
    """Put the font beside the pages; the same bytes each time."""
    if failure or app.builder.format != "html":
        return
    with (files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf").open("rb") as source:
        font = TTFont(source, recalcTimestamp=False)
        subsetter = Subsetter(Options(layout_features=["ssty", "dtls", "flac"]))
        subsetter.populate(unicodes=CHARACTERS)
        subsetter.subset(font)
    font.flavor = "woff"
    target = Path(app.outdir) / "_static" / FONT
    target.parent.mkdir(exist_ok=True)
    font.save(target)


def setup(app):
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("build-finished", write_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
