"""How objects show themselves: one line in a terminal, one table in a notebook, both from the same plain data."""

from dataclasses import dataclass, field, fields, is_dataclass
from html import escape
from numbers import Real

import numpy as np

MOST = 4      # intervals that are listed one by one


@dataclass(frozen=True)
class Row:
    """A line of a table: what, its symbol, its value and in what it is measured; numbers are shortened here."""

    name: str
    symbol: str
    value: object
    unit: str = ""


@dataclass(frozen=True)
class Summary:
    """What an object says of itself: a title, a few words for one line, the rows of a table, warnings below it."""

    title: str
    brief: str
    rows: tuple = ()
    warnings: tuple = field(default=())


def scene_summary(title, body, solid, obstacle, law):
    """The Summary of a scene from the words for its body, the solid, obstacle and law."""
    rows = (Row("body", "", body), Row("obstacle", "", short(obstacle)), Row("law", "", short(law)), *solid.summary().rows)
    return Summary(title, f"{short(obstacle)} on {body}, {short(law)}", rows)


def path_summary(path, events, *rows):
    """The Summary of a load path; `events` as far as they are known, else None."""
    listed = [Row(f"{event.zone} {event.kind}", "P", event.load, f"at x1 = {number(event.x)}") for event in events or ()]
    told = "not yet looked for" if events is None else f"{len(events)}"
    return Summary("Load path", f"up to load {number(path.last)}, events: {told}",
                   (Row("last load", "P", path.last, "force per thickness"), *rows, Row("events", "", told), *listed))


def short(thing, longest=60):
    """The repr of a thing, cut if it is long; a function by its name."""
    text = getattr(thing, "__name__", None) or " ".join(repr(thing).split())
    return text if len(text) <= longest else text[:longest - 3] + "..."


def call(thing, longest=48):
    """An obstacle or a law for a title, as it is called: numbers in four digits, texts only if they are not the usual ones."""
    if not is_dataclass(thing):
        return short(thing, longest)
    known = [(entry.name, getattr(thing, entry.name), entry.default) for entry in fields(thing)]
    told = ", ".join(f"{name}={_argument(value)}" for name, value, usual in known
                     if not isinstance(value, str) or value != usual)
    text = f"{type(thing).__name__}({told})"
    return text if len(text) <= longest else text[:longest - 4] + "...)"


def _argument(value):
    if isinstance(value, np.ndarray):
        return f"{value.size} numbers"
    return f"{value:.4g}" if isinstance(value, Real) else short(value)


class Shown:
    """Base of what shows itself: a class says what in `summary()`."""

    def summary(self):
        """The Summary of this object."""
        raise NotImplementedError

    def __repr__(self):
        own = self.summary()
        return f"<{own.title}: {own.brief}>"

    def _repr_html_(self):
        return html(self.summary())


def number(value):
    """A number in four digits; None as a dash."""
    if value is None:
        return "-"
    if isinstance(value, (bool, str)) or not np.isscalar(value):
        return str(value)
    return f"{value:d}" if isinstance(value, (int, np.integer)) else f"{value:.4g}"


def intervals(pairs):
    """A union of intervals in words: the intervals, or how many and how long together."""
    pairs = [(float(left), float(right)) for left, right in pairs]
    if not pairs:
        return "none"
    if len(pairs) > MOST:
        return f"{len(pairs)} intervals, {number(sum(right - left for left, right in pairs))} together"
    return ", ".join(f"[{number(left)}, {number(right)}]" for left, right in pairs)


def html(summary):
    """The one table style: names left, symbols in the middle, values with their unit right, warnings below."""
    edge = "text-align:left;padding:1px 12px 1px 0;background:none;border:none"
    rows = "".join(f'<tr style="background:none">{"".join(f"""<td style="{edge}">{cell}</td>""" for cell in cells)}</tr>'
                   for cells in map(_cells, summary.rows))
    told = "".join(f'<div style="color:#a04000;margin-top:2px">&#9888; {escape(text)}</div>' for text in summary.warnings)
    return (f'<div class="microblock"><b>{escape(summary.title)}</b> <span style="color:#555">{escape(summary.brief)}</span>'
            f'<table style="border-collapse:collapse;margin:4px 0">{rows}</table>{told}</div>')


def _cells(row):
    symbol = f"<i>{row.symbol}</i>" if row.symbol else ""      # symbols are ours and may hold <sub>
    unit = f' <span style="color:#777">{escape(row.unit)}</span>' if row.unit else ""
    return escape(row.name), symbol, escape(number(row.value)) + unit
