"""The page of the report: one HTML file that needs nothing but the figures and records beside it."""

import html
import re
import struct

from .findings import measured
from .looks import SCRIPT, STYLE
from .playground_page import PAPER
from .symbols import symbols

SHOWN = 4  # significant digits of a table on the page; the CSV has them all
HIDDEN = ("command",)  # columns that are shown elsewhere
ABOUT = """Contact of bodies with microstructure: at each point of the surface a rigid block of the
material's length scale ell touches the obstacle with two corners. This page has what the paper on this
contact law says and what comes out when it is computed to many digits, contact problems beyond the paper,
and what the methods cost and where they fail. Figures are made to be read at a width of 9 cm."""
REFERENCE = (  # as in docs/differences.md
    "The paper: M. J. Lewandowski-Szewczyk and S. Stupkiewicz, <i>Int. J. Solids Struct.</i> (2020), "
    f'<a href="{PAPER}">doi:{PAPER.removeprefix("https://doi.org/")}</a>.'
)
ROWS = 2, 3  # figures beside each other, on screens and on wide ones
# what an outsider meets on the page
WORDS = (
    (
        "ell, alpha",
        "size of the blocks, and the same over the half-width of Hertz's contact, alpha = ell/a_Hz",
    ),
    ("a_Hz, p_Hz", "half-width and largest pressure of the contact without microstructure, after Hertz"),
    ("psi, psi0", "microrotation of the blocks, and their rotation in the unloaded surface"),
    ("A, B", "the two corners of a block; where both touch there is full contact, else partial contact"),
    ("micromoment", "moment M of the two corner forces about the middle of the block"),
    ("microblock", "the contact law with two corners; unilateral: the same solid, touching without corners"),
    ("nu, beta", "Poisson's ratio and the coupling number: 0 is a classical solid, 2 a couple-stress solid"),
    ("rtol", "the relative error that is asked for; promised error: what the answer says of itself"),
    ("panels", "a half-plane on its contact line, elements of high order fitted to the edges of the zones"),
    ("cells", "a half-plane on a uniform grid of the surface, by fast Fourier transforms"),
    ("fitted elements", "finite elements with nodes on the edges of the zones; condensed: bulk eliminated"),
    ("rho", "parameter of the augmented Lagrangian or of the penalty, a stress per length"),
    ("(18), (51)", "numbers in brackets are those of the paper's equations"),
)


def page(items, findings, introductions, summary, versions, failed=(), beside=None):
    """The page that shows all items.

    Parameters
    ----------
    items : what `report.item` gives for each
    findings : `findings.Findings`
    introductions : {heading: a sentence or two}, in the order of the page
    summary : a line on this run
    versions : {name: version}
    failed : {name: what went wrong}
    beside : {name of a file in the introductions: its address}
    """
    software = ", ".join(f"{name} {version}" for name, version in versions.items())
    sections = {title: [one for one in items if one["section"] == title] for title in introductions}
    sections = {title: members for title, members in sections.items() if members}
    wrong = "".join(f'<p class="failed">{name} failed: {html.escape(failed[name])}</p>' for name in failed)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>microblock: report</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="description" content="The figures of the microblock paper, recomputed, and what differs.">
<style>{STYLE}</style></head><body>
<header><h1>microblock: report</h1>
<p>{symbols(ABOUT)}</p>
<p>{REFERENCE}</p>
{"".join(map(_link, items))}
<details><summary>Symbols and words</summary>{_words_of_the_page()}</details>
{wrong}</header>
<div class="columns">
{_contents(sections, bool(findings.statements))}
<main>
{_box(findings, next((one for one in items if one["name"] == "paper_and_here"), None))}
{"".join(_section(title, members, introductions[title], beside or {}) for title, members in sections.items())}
<section id="seconds"><details><summary><h2>Seconds of each item</h2></summary>
{_seconds(items)}
</details></section>
</main></div>
<footer><p class="soft">{html.escape(summary)}<br>{html.escape(software)}</p></footer>
<script>{SCRIPT}</script>
</body></html>
"""


def advice(head, sections, facts):
    """The page of the advice on methods: {heading: sentences}, and rows of the numbers that they rest on."""
    title, told = head.removeprefix("# ").split("\n\n")
    lists = ""
    for heading, sentences in sections.items():
        entries = "".join(f"<li>{_with_code(one)}</li>" for one in sentences)
        lists += f"<h2>{html.escape(heading)}</h2><ul>{entries}</ul>"
    rows = [
        {name: row[name] for name in ("sentence", "study", "selection", "runs", "value")} for row in facts
    ]
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>microblock: methods</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>{STYLE}</style></head><body>
<main class="advice"><h1>{html.escape(title)}</h1>
<p>{_with_code(told)}</p>
{lists}
<h2>What each sentence rests on</h2>
{_table(rows, "numbers of the sentences", all_columns=True)}
<p><a href="index.html">The report</a></p></main>
</body></html>
"""


def _with_code(text):
    """HTML of a text with code between backquotes."""
    parts = text.split("`")
    parts[::2] = map(symbols, parts[::2])
    parts[1::2] = (f"<code>{html.escape(part)}</code>" for part in parts[1::2])
    return "".join(parts)


def size(path):
    """(width, height) of a PNG file in pixels, as its first chunk says."""
    with open(path, "rb") as picture:
        return struct.unpack(">II", picture.read(24)[16:])


def _link(one):
    """Where a case has written a page of its own, the way there."""
    return f'<p><a href="{one["page"]}">{symbols(one["label"])}</a>: {symbols(one["message"])}</p>' * bool(
        one["page"]
    )


def _words_of_the_page():
    rows = "".join(f"<dt>{symbols(word)}</dt><dd>{symbols(meaning)}</dd>" for word, meaning in WORDS)
    return f"<dl>{rows}</dl>"


def _anchor(title):
    return "section-" + "".join(letter if letter.isalnum() else "-" for letter in title.lower())


def _contents(sections, compared):
    found = '<li><a href="#findings">Findings</a></li>'
    if compared:
        found += '<li><a href="#paper_and_here">The paper and here</a></li>'
    for title, members in sections.items():
        links = "".join(f'<li><a href="#{one["name"]}">{symbols(one["label"])}</a></li>' for one in members)
        found += f'<li><a href="#{_anchor(title)}">{html.escape(title)}</a><ul>{links}</ul></li>'
    found += '<li><a href="#seconds">Seconds of each item</a></li>'
    return (
        '<nav class="contents" aria-label="Contents"><details class="fold" open><summary>Contents</summary>'
        f"<ul>{found}</ul></details></nav>"
    )


def _box(findings, compared):
    """What was found, and what the paper says and what is so."""
    sentences = "".join(
        f'<dt><a href="#{name}">{symbols(heading)}</a></dt><dd>{symbols(text)}</dd>'
        for heading, text, name in findings.sentences
    )
    told = f"<dl>{sentences}</dl>" if sentences else ""
    if findings.statements:
        number = len(findings.statements)
        counts = ", ".join(f"{verdict}: {count}" for verdict, count in findings.counts.items())
        rows, name = _compared(findings.differing), "statements of the paper that differ"
        differing = _table(rows, name, all_columns=True, kind="whole cards") if rows else ""
        verdicts = _compared(findings.statements, "verdict")
        all_of_them = _table(verdicts, "all statements of the paper", all_columns=True, kind="cards")
        made = _made(compared) if compared else ""
        told += (
            "<h3>What the paper says and what is so</h3>"
            f"<p>Of {number} statements of sections 4.1 and 4.2 ({counts}) these differ:</p>{differing}"
            f'<details id="paper_and_here"><summary>All {number} statements</summary>'
            f"{all_of_them}{made}</details>"
        )
    if not told:
        told = "<p>The items that they rest on are not among those that were made.</p>"
    return f'<section class="findings" id="findings"><h2>Findings</h2>{told}</section>'


def _compared(rows, *more):
    """The columns of the table for readers, a value with its error, and `more` of them."""
    return [
        {
            "place": row["where"],
            "the paper says": row["the_paper"],
            "computed here": "" if row["here"] == "-" else row["here"],
            "value": "" if row["value"] is None else measured(row["value"], row["error"]),
            **{name: row[name] for name in more},
            "because": row["because"],
        }
        for row in rows
    ]


def _section(title, items, introduction, beside):
    figures = [one["name"] for one in items if one["figure"]]
    # of the last figure: in rows of how many it would stand by itself
    lone = [f"lone-{row}" for row in ROWS if len(figures) % row == 1]
    shown = "\n".join(_item(one, lone if one["name"] in figures[-1:] else []) for one in items)
    told = symbols(introduction)
    for name, address in beside.items():
        told = told.replace(name, f'<a href="{address}">{name}</a>')
    words = f"<p>{told}</p>" if introduction else ""
    return (
        f'<section id="{_anchor(title)}"><details class="fold" open>'
        f"<summary><h2>{html.escape(title)}</h2></summary>"
        f'{words}\n<div class="plates">{shown}</div></details></section>\n'
    )


def _seconds(items):
    """Elapsed in the process that made the item, on the machine named there; drawing in this run."""
    longest = sorted(items, key=lambda one: -one["seconds"] - (one["drawing"] or 0))
    rows = [
        {
            "item": one["name"],
            "records": round(one["seconds"], 1),
            "kept": "kept" if one["kept"] else "",
            "drawing": one["drawing"] and round(one["drawing"], 1),
            "beside others": "no" if one["alone"] else "",
        }
        for one in longest
    ]
    return _table(rows, "seconds of each item", all_columns=True) if rows else ""


def _item(one, kinds):
    if one["figure"]:
        width, height = one["size"]
        content = (
            f'<a class="plate" href="{one["pdf"]}">'
            f'<img src="{one["figure"]}" alt="{html.escape(one["alt"])}" '
            f'width="{width}" height="{height}" loading="lazy" decoding="async"></a>'
        )
    else:
        content = _table(one["table"], one["label"])
    kinds = kinds if one["figure"] else ["table"]
    kind = f' class="{" ".join(kinds)}"' if kinds else ""
    reading = f'<p class="reading">{symbols(one["caption"])}</p>' if one["caption"] else ""
    head = f"<h3>{symbols(one['label'])}. {symbols(one['message'])}</h3>"
    foot = f"<figcaption>{reading}{_made(one)}</figcaption>"
    return f'<figure id="{one["name"]}"{kind}>{head}{content}{foot}</figure>'


def _made(one):
    """How an item was made, folded."""
    estimate = "" if one["error_estimate"] is None else f", error estimates up to {one['error_estimate']:.1e}"
    kept = ", records kept from an earlier run" if one["kept"] else ""
    commands = "".join(f"<li><code>{html.escape(line)}</code></li>" for line in one["commands"])
    runs = f"<p>Its runs:</p><ul>{commands}</ul>" if commands else ""
    return (
        f'<details class="made"><summary>Records and command of {html.escape(one["name"])}</summary>'
        f"<p><code>{one['command']}</code>, {one['seconds']:.1f} s on "
        f"{html.escape(one['machine'])}{kept}{estimate}, "
        f'<a href="{one["data"]}">records of {html.escape(one["name"])}</a></p>{runs}</details>'
    )


def _table(rows, name, all_columns=False, kind=""):
    """A table in a box that scrolls, or a "whole" one; its rows may be "cards" where the screen is narrow.
    Columns that are the same in all rows stand above it.
    """
    names = [column for column in rows[0] if all_columns or column not in HIDDEN]
    same = {
        column: rows[0][column]
        for column in names
        if not all_columns and len(rows) > 1 and all(row[column] == rows[0][column] for row in rows)
    }
    same = {} if len(same) == len(names) else same
    above = ", ".join(f"{_words(column)} {_shown(cell)}" for column, cell in same.items() if _shown(cell))
    told = f'<p class="soft">In all rows: {symbols(above)}.</p>' if above else ""
    names = [column for column in names if column not in same]
    head = "".join(f'<th scope="col">{symbols(_words(column))}</th>' for column in names)
    body = "".join(
        "<tr>" + "".join(_cell(row[column], _words(column)) for column in names) + "</tr>" for row in rows
    )
    return (
        f'{told}<div class="{" ".join(filter(None, ("box", kind)))}" tabindex="0" role="region" '
        f'aria-label="{html.escape(name)}"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _words(column):
    """The name of a column in words; an index stays with its letter."""
    letter = re.match(r"[A-Z]_[a-z]+", column)
    kept = letter[0] if letter else ""
    return kept + column[len(kept) :].replace("_", " ")


def _cell(cell, column):
    kind = ' class="number"' if isinstance(cell, float | int) else ""
    return f'<td{kind} data-column="{html.escape(column)}">{symbols(_shown(cell))}</td>'


def _shown(cell):
    if cell is None:
        return ""
    return f"{cell:.{SHOWN}g}" if isinstance(cell, float) else str(cell)
