"""The page of the report: one HTML file that needs nothing but the figures and records beside it."""

import html

SHOWN = 4     # significant digits of a table on the page; the CSV has them all
STYLE = """
body { font-family: sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }
img { max-width: 100%; } .wide { overflow-x: auto; } code { background: #f3f3f3; }
table { border-collapse: collapse; font-size: 85%; } td, th { padding: 0.2em 0.7em; text-align: left; }
tr:nth-child(even) { background: #f5f5f5; } figure { margin: 2em 0; } nav { column-width: 14em; font-size: 85%; }
.made, details { font-size: 85%; color: #555; }
"""


def page(items, told, versions):
    """The page that shows all items, with the commands that make them; `told` is a line on this run."""
    software = ", ".join(f"{name} {version}" for name, version in versions.items())
    links = "<br>".join(f'<a href="#{one["name"]}">{one["name"]}</a>' for one in items)
    shown = "\n".join(_item(one) for one in items)
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>microblock: report</title>
<style>{STYLE}</style></head><body>
<h1>microblock: report</h1>
<p>{html.escape(told)}</p>
<p>{html.escape(software)}</p>
<nav>{links}</nav>
{shown}
</body></html>
"""


def _item(one):
    content = (f'<a href="{one["pdf"]}"><img src="{one["figure"]}" alt="{one["name"]}"></a>' if one["figure"]
               else _table(one["table"]))
    estimate = "" if one["error_estimate"] is None else f', error estimates up to {one["error_estimate"]:.1e}'
    kept = ", records kept from an earlier run" if one["kept"] else ""
    commands = "".join(f"<li><code>{html.escape(told)}</code></li>" for told in one["commands"])
    details = f"<details><summary>its runs</summary><ul>{commands}</ul></details>" if commands else ""
    return (f'<figure id="{one["name"]}">{content}<figcaption><b>{one["name"]}.</b> {html.escape(one["caption"])}<br>'
            f'<span class="made"><code>{one["command"]}</code>, {one["seconds"]:.1f} s on {html.escape(one["machine"])}{kept}'
            f'{estimate}, <a href="{one["data"]}">records</a></span>{details}</figcaption></figure>')


def _table(rows):
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{html.escape(_shown(cell))}</td>" for cell in row.values()) + "</tr>"
                   for row in rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'


def _shown(cell):
    if cell is None:
        return ""
    return f"{cell:.{SHOWN}g}" if isinstance(cell, float) else str(cell)
