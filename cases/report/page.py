"""The page of the report: one HTML file that needs nothing but the figures and records beside it."""

import html

SHOWN = 4  # significant digits of a table on the page; the CSV has them all
STYLE = """
body { font-family: sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }
img { max-width: 100%; } code { background: #f3f3f3; }
h2 { margin-top: 2.5em; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; font-size: 85%; }
td, th { padding: 0.2em 0.7em; text-align: left; vertical-align: top; }
tr:nth-child(even) { background: #f5f5f5; }
figure { margin: 2em 0; } nav { font-size: 85%; } nav p { margin: 0.3em 0; }
.wide { overflow: auto; max-height: 36em; } th { position: sticky; top: 0; background: #fff; }
.made, details { font-size: 85%; color: #555; } .failed { color: #a04000; }
@media print { .wide { max-height: none; } th { position: static; } }
"""


def page(items, summary, versions, failed=()):
    """The page that shows all items, with the commands that make them; `summary` is a line on this run,
    `failed` {name: what}.
    """
    software = ", ".join(f"{name} {version}" for name, version in versions.items())
    sections = {}
    for one in items:
        sections.setdefault(one["section"], []).append(one)
    wrong = "".join(f'<p class="failed">{name} failed: {html.escape(failed[name])}</p>' for name in failed)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>microblock: report</title>
<style>{STYLE}</style></head><body>
<h1>microblock: report</h1>
<p>{html.escape(summary)}</p>
<p>{html.escape(software)}</p>
{wrong}
{"".join(map(_verdicts, items))}
<nav>{"".join(_contents(title, members) for title, members in sections.items())}
<p><a href="#seconds">Seconds of each item</a></p></nav>
{"".join(_section(title, members) for title, members in sections.items())}
<h2 id="seconds">Seconds of each item</h2>
{_seconds(items)}
</body></html>
"""


def _verdicts(one):
    """A line on verdicts, with a link to them; nothing for other items."""
    counts = ", ".join(f"{verdict} {count}" for verdict, count in sorted(one["verdicts"].items()))
    title = one["name"].replace("_", " ")
    link = f'<a href="#{one["name"]}">{title[:1].upper() + title[1:]}</a>'
    return f"<p>{link}, verdicts on what the paper says: {counts}.</p>" if counts else ""


def _anchor(title):
    return "section-" + "".join(letter if letter.isalnum() else "-" for letter in title.lower())


def _contents(title, items):
    links = ", ".join(f'<a href="#{one["name"]}">{one["name"]}</a>' for one in items)
    return f'<p><b><a href="#{_anchor(title)}">{html.escape(title)}</a></b>: {links}</p>\n'


def _section(title, items):
    shown = "\n".join(_item(one) for one in items)
    return f'<h2 id="{_anchor(title)}">{html.escape(title)}</h2>\n{shown}\n'


def _seconds(items):
    """Elapsed in the process that made the item, on the machine named there; drawing in this run."""
    longest = sorted(items, key=lambda one: -one["seconds"] - (one["drawing"] or 0))
    return (
        _table(
            [
                {
                    "item": one["name"],
                    "records": round(one["seconds"], 1),
                    "kept": "kept" if one["kept"] else "",
                    "drawing": one["drawing"] and round(one["drawing"], 1),
                    "beside others": "no" if one["alone"] else "",
                }
                for one in longest
            ]
        )
        if items
        else ""
    )


def _item(one):
    content = (
        f'<a href="{one["pdf"]}"><img src="{one["figure"]}" alt="{one["name"]}"></a>'
        if one["figure"]
        else _table(one["table"])
    )
    estimate = "" if one["error_estimate"] is None else f", error estimates up to {one['error_estimate']:.1e}"
    kept = ", records kept from an earlier run" if one["kept"] else ""
    commands = "".join(f"<li><code>{html.escape(line)}</code></li>" for line in one["commands"])
    details = f"<details><summary>its runs</summary><ul>{commands}</ul></details>" if commands else ""
    return (
        f'<figure id="{one["name"]}">{content}<figcaption><b>{one["name"]}.</b> '
        f"{html.escape(one['caption'])}<br>"
        f'<span class="made"><code>{one["command"]}</code>, {one["seconds"]:.1f} s on '
        f"{html.escape(one['machine'])}{kept}"
        f'{estimate}, <a href="{one["data"]}">records</a></span>{details}</figcaption></figure>'
    )


def _table(rows):
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(_shown(cell))}</td>" for cell in row.values()) + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'


def _shown(cell):
    if cell is None:
        return ""
    return f"{cell:.{SHOWN}g}" if isinstance(cell, float) else str(cell)
