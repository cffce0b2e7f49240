"""Equations as MathML, which browsers render themselves: no script, no network.

docutils, which Sphinx rests on, translates LaTeX to MathML. The font STIX Two Math comes from the package
ziamath, reduced to the characters of mathematics and put beside the pages. LaTeX that is not understood is
a warning, so that a build with -W fails; so is an element that has not as many parts as it must have.
"""

import logging as standard
import re
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

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
NAMESPACE = "http://www.w3.org/1998/Math/MathML"
APPLY = "\N{FUNCTION APPLICATION}"
ROWS = ("math", "mrow", "mtd", "mstyle", "msqrt")  # whose parts stand side by side, as many as there are
FACTORS = ("mi", "mn", "msub", "msup", "mfrac", "msqrt", "mrow")
PARTS = {"msub": 2, "msup": 2, "msubsup": 3, "mfrac": 2, "munder": 2, "mover": 2, "munderover": 3, "mroot": 2}
# characters before and after a quantity from which no line may part it
CLOSING, OPENING = re.compile(r"^[^\w\s]+"), re.compile(r"[^\w\s]+$")
NUMBER = re.compile(r"(\d[\d.]*(?:e-\d+| ± [\d.]+\d))")
ElementTree.register_namespace("", NAMESPACE)
logger = logging.getLogger(__name__)
standard.getLogger("fontTools").setLevel(standard.WARNING)


def mathml(latex, block=False):
    """MathML of LaTeX, with the spaces of LaTeX: around functions, none around a slash and inside bars.

    ValueError where an element, an index for one, has more parts or fewer than it must have.
    """
    text = tex2mathml(latex.strip(), as_block=block).replace("&ApplyFunction;", APPLY)
    root = ElementTree.fromstring(text)
    for element in list(root.iter()):
        if _name(element) == "mo" and element.get("stretchy") == "false" and _letters(element) in ("/", "|"):
            element.set("lspace", "0")
            element.set("rspace", "0")
        if _name(element) in ROWS:
            _space(element)
    for element in root.iter():
        if len(element) != PARTS.get(_name(element), len(element)):
            found = ElementTree.tostring(element, encoding="unicode")
            raise ValueError(f"{_name(element)} has {len(element)} parts: {found}")
    return ElementTree.tostring(root, encoding="unicode")


def _name(element):
    return element.tag.rpartition("}")[2]


def _letters(element):
    return (element.text or "").strip()


def _space(row):
    """Put thin spaces between a factor and a function, and between a function and an argument that has no
    parentheses.
    """
    parts = list(row)
    for place in reversed(range(1, len(parts))):
        last, part = parts[place - 1 : place + 1]
        function = _name(part) == "mi" and re.fullmatch(r"\w{3,5}", _letters(part))
        first = part[0] if _name(part) == "mrow" and len(part) else part
        enclosed = _name(first) == "mo" and _letters(first) in ("(", "[")
        if function and _name(last) in FACTORS or _letters(last) == APPLY and not enclosed:
            row.insert(place, ElementTree.Element(f"{{{NAMESPACE}}}mspace", width="0.1667em"))


def _mathml(translator, node, block):
    """MathML of a node; the LaTeX itself, and a warning, where docutils does not understand it."""
    try:
        return mathml(node.astext(), block)
    except (MathError, ValueError) as failure:
        logger.warning("LaTeX that is not understood: %s", failure, location=node)
        return translator.encode(node.astext())


def keep_together(app, tree, page):
    """Put a quantity and the comma or bracket beside it, and a number, where no line can part them."""
    for text in list(tree.findall(nodes.Text)):
        parts = NUMBER.split(text)
        if len(parts) > 1 and isinstance(parent := text.parent, nodes.paragraph):
            place = parent.index(text)
            parent[place : place + 1] = [
                nodes.inline("", part, classes=["together"]) if k % 2 else nodes.Text(part)
                for k, part in enumerate(parts)
            ]
    for quantity in list(tree.findall(nodes.math)):
        parent, place = quantity.parent, quantity.parent.index(quantity)
        together = [quantity]
        for other, beside in ((place + 1, CLOSING), (place - 1, OPENING)):
            text = parent[other] if 0 <= other < len(parent) else None
            found = isinstance(text, nodes.Text) and beside.search(text)
            if found:
                parent[other] = nodes.Text(text[: found.start()] + text[found.end() :])
                together.insert(0 if beside is OPENING else len(together), nodes.Text(found[0]))
        if len(together) > 1:
            parent[place] = nodes.inline("", "", *together, classes=["together"])


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
    app.connect("doctree-resolved", keep_together)
    app.connect("build-finished", write_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
