"""The page of the report: one HTML file that needs nothing but the figures and records beside it."""

import html
import re
import struct

from .findings import measured

SHOWN = 4  # significant digits of a table on the page; the CSV has them all
HIDDEN = ("command",)  # columns that are shown elsewhere
ABOUT = """Contact of bodies with microstructure: at each point of the surface a rigid block of the
material's length scale ell touches the obstacle with two corners. This page has what a paper on this
contact law says and what comes out when it is computed to many digits, contact problems beyond the paper,
and what the methods cost and where they fail. Figures are made to be read at a width of 9 cm."""
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
GREEK = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "Delta": "Δ",
    "ell": "ℓ",
    "lambda": "λ",
    "mu": "μ",
    "nu": "ν",
    "psi": "ψ",
    "rho": "ρ",
    "sigma": "σ",
    "kappa": "κ",
}
NUMBERED = ("x", "u", "L")  # letters whose number is an index
NAME = re.compile(r"(?<!\w)([A-Za-z]+)([0-9])?(?:_([A-Za-z]+))?(?!\w)")
POWER = re.compile(r"\^(?:\(([^()]*)\)|(-?\w+))")
# a space within a number or before its per cent sign or unit
UNBROKEN = re.compile(r"(?<=\d) (?=\d{3}\b|%|(?:s|cm|GiB|MiB)\b)")
STYLE = """
:root { color-scheme: light dark; --ink: #1d2125; --soft: #4d5560; --ground: #ffffff; --card: #f4f5f7;
  --line: #d0d4da; --link: #0b57a4; --bad: #9c3000; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e8eb; --soft: #b3bac4; --ground: #15181c; --card: #20242a; --line: #3d444d;
    --link: #8ab8f0; --bad: #ff9e70; }
}
* { box-sizing: border-box; }
body { margin: 0; font: 1rem/1.5 system-ui, sans-serif; color: var(--ink); background: var(--ground); }
a { color: var(--link); }
code { font-size: 0.9em; overflow-wrap: anywhere; }
summary { cursor: pointer; }
sub, sup { line-height: 0; }
header, footer, .contents, main { padding: 0 1rem; }
header p { max-width: 50rem; }
h1 { margin: 1.2rem 0 0.3rem; }
h2 { margin: 0; display: inline; font-size: 1.35rem; }
h3 { margin: 0 0 0.6rem; font-size: 1rem; line-height: 1.35; }
.soft, .made, .reading { color: var(--soft); font-size: 0.9rem; }
.failed { color: var(--bad); }
section { margin: 2rem 0 0; border-top: 1px solid var(--line); padding-top: 1rem; }
.findings { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 1rem;
  margin-top: 0; }
.findings h2, .findings h3 { display: block; margin: 0 0 0.5rem; }
dl { display: grid; gap: 0.2rem 1.5rem; margin: 0 0 1rem; }
dt { font-weight: 600; margin-top: 0.5rem; }
dd { margin: 0; }
.contents ul { list-style: none; margin: 0.2rem 0 0.6rem; padding: 0; }
.contents li { margin: 0.1rem 0; line-height: 1.35; }
.contents li li { margin-left: 0.8rem; font-size: 0.88rem; }
.plates { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 20.5rem), 1fr));
  gap: 1.5rem; align-items: start; margin-top: 1rem; }
figure { margin: 0; }
figure.table { grid-column: 1 / -1; min-width: 0; }
figcaption { margin-top: 0.5rem; }
figcaption p { margin: 0 0 0.4rem; }
.plate { display: block; background: #ffffff; border: 1px solid var(--line); border-radius: 6px;
  padding: 2px; overflow: hidden; }
.plate img { display: block; width: 100%; height: auto; }
.box { overflow: auto; max-height: 26rem; border: 1px solid var(--line); border-radius: 6px; }
.whole { max-height: none; }
table { border-collapse: collapse; font-size: 0.85rem; width: 100%; }
td, th { padding: 0.25rem 0.7rem; text-align: left; vertical-align: top;
  border-bottom: 1px solid var(--line); }
th { position: sticky; top: 0; background: var(--card); }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
@media (min-width: 64rem) {
  .columns { display: grid; grid-template-columns: 15rem minmax(0, 1fr); gap: 1rem; max-width: 110rem; }
  .contents { position: sticky; top: 0; align-self: start; max-height: 100vh; overflow: auto; }
  dl { grid-template-columns: 8rem 1fr; max-width: 60rem; }
  dt { margin: 0; }
}
@media print {
  .box { max-height: none; }
  .contents { display: none; }
  .columns { display: block; }
}
"""
# small screens begin with the sections folded; a link into one of them opens it
SCRIPT = """
const folds = document.querySelectorAll("details.fold");
if (matchMedia("(max-width: 63.99rem)").matches) folds.forEach(one => { one.open = false; });
const reveal = () => {
  const aim = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!aim) return;
  for (let one = aim; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  aim.scrollIntoView();
};
addEventListener("hashchange", reveal);
addEventListener("load", reveal);
addEventListener("beforeprint", () => folds.forEach(one => { one.open = true; }));
"""


def page(items, findings, introductions, summary, versions, failed=()):
    """The page that shows all items.

    Parameters
    ----------
    items : what `report.item` gives for each
    findings : `findings.Findings`
    introductions : {heading: a sentence or two}, in the order of the page
    summary : a line on this run
    versions : {name: version}
    failed : {name: what went wrong}
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
{"".join(map(_link, items))}
<details><summary>Symbols and words</summary>{_words_of_the_page()}</details>
{wrong}</header>
<div class="columns">
{_contents(sections, bool(findings.statements))}
<main>
{_box(findings, next((one for one in items if one["name"] == "paper_and_here"), None))}
{"".join(_section(title, members, introductions.get(title, "")) for title, members in sections.items())}
<section id="seconds"><details><summary><h2>Seconds of each item</h2></summary>
{_seconds(items)}
</details></section>
</main></div>
<footer><p class="soft">{html.escape(summary)}<br>{html.escape(software)}</p></footer>
<script>{SCRIPT}</script>
</body></html>
"""


def symbols(text):
    """HTML of a text in which quantities have names that can be typed: Greek letters, indices, powers."""

    def quantity(found):
        name, number, index = found.groups()
        known = name in GREEK or (name in NUMBERED if number else len(name) == 1 and index)
        if not known:
            return found[0]
        below = ", ".join(filter(None, (number, GREEK.get(index, index))))
        return GREEK.get(name, name) + (f"<sub>{below}</sub>" if below else "")

    marked = NAME.sub(quantity, html.escape(text))
    marked = POWER.sub(lambda found: f"<sup>{found[1] or found[2]}</sup>", marked)
    return UNBROKEN.sub("\u00a0", marked)


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
        differing = _table(rows, name, all_columns=True, whole=True) if rows else ""
        verdicts = _compared(findings.statements, "verdict")
        all_of_them = _table(verdicts, "all statements of the paper", all_columns=True)
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
            "computed here": row["here"],
            "value": "" if row["value"] is None else measured(row["value"], row["error"]),
            **{name: row[name] for name in more},
            "because": row["because"],
        }
        for row in rows
    ]


def _section(title, items, introduction):
    shown = "\n".join(map(_item, items))
    words = f"<p>{symbols(introduction)}</p>" if introduction else ""
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


def _item(one):
    if one["figure"]:
        width, height = one["size"]
        content = (
            f'<a class="plate" href="{one["pdf"]}">'
            f'<img src="{one["figure"]}" alt="{html.escape(one["alt"])}" '
            f'width="{width}" height="{height}" loading="lazy" decoding="async"></a>'
        )
    else:
        content = _table(one["table"], one["label"])
    kind = "" if one["figure"] else ' class="table"'
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


def _table(rows, name, all_columns=False, whole=False):
    """A table in a box that scrolls, or `whole`; columns that are the same in all rows stand above it."""
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
    body = "".join("<tr>" + "".join(map(_cell, (row[column] for column in names))) + "</tr>" for row in rows)
    return (
        f'{told}<div class="box{" whole" * whole}" tabindex="0" role="region" '
        f'aria-label="{html.escape(name)}"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _words(column):
    """The name of a column in words; an index stays with its letter."""
    letter = re.match(r"[A-Z]_[a-z]+", column)
    kept = letter[0] if letter else ""
    return kept + column[len(kept) :].replace("_", " ")


def _cell(cell):
    kind = ' class="number"' if isinstance(cell, float | int) else ""
    return f"<td{kind}>{symbols(_shown(cell))}</td>"


def _shown(cell):
    if cell is None:
        return ""
    return f"{cell:.{SHOWN}g}" if isinstance(cell, float) else str(cell)
