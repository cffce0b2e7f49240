"""How objects show themselves: a line in a terminal, a table in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from html import escape
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from ..errors import require_place, writing
from .types import Interval, Target

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Summary(NamedTuple):
    """A title, a few words for one line, the rows (name, value, unit) of a table, and warnings."""

    title: str
    brief: str
    rows: Sequence[tuple[str, object, str]] = ()
    warnings: Sequence[str] = ()


def short(thing: object, longest: int = 60) -> str:
    """Returns the repr of a thing, cut if long; of a function its name."""
    text: str = getattr(thing, "__name__", None) or " ".join(repr(thing).split())
    return text if len(text) <= longest else text[: longest - 3] + "..."


def told(thing: Any) -> list[tuple[str, Any]]:
    """Returns the fields (name, value) of a dataclass that have another value than the usual."""
    values = [(entry, getattr(thing, entry.name)) for entry in fields(thing)]
    return [(entry.name, own) for entry, own in values if entry.default is MISSING or own != entry.default]


def call(thing: object) -> str:
    """Returns an obstacle or a law as it is called, numbers in four digits."""
    if not is_dataclass(thing):
        return short(thing, 48)
    listed = ", ".join(f"{name}={_argument(value)}" for name, value in told(thing))
    text = f"{type(thing).__name__}({listed})"
    return text if len(text) <= 48 else text[:44] + "...)"


def _argument(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.size} numbers"
    return f"{value:.4g}" if isinstance(value, Real) else short(value)


class Shown:
    """Base of objects that show themselves; `summary` says what is shown."""

    def summary(self) -> Summary:
        """Returns the Summary of this object."""
        raise NotImplementedError

    def __repr__(self) -> str:
        own = self.summary()
        warnings = "".join(f"\n  warning: {text}" for text in own.warnings)
        return f"<{own.title}: {own.brief}{warnings}>"

    def _repr_html_(self) -> str:
        return html(self.summary())


def number(value: object) -> str:
    """Returns a number in four digits, None as a dash, of an array its range, of a mapping each value."""
    if value is None:
        return "-"
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {number(one)}" for name, one in value.items())
    if isinstance(value, np.ndarray):
        return f"{number(value.min())} to {number(value.max())}"
    if isinstance(value, list):
        return intervals(value)
    if isinstance(value, (bool, str)) or not np.isscalar(value):
        return str(value)
    return f"{value:d}" if isinstance(value, (int, np.integer)) else format(value, ".4g")


def intervals(pairs: Iterable[Interval]) -> str:
    """Returns a union of intervals in words, many as number and length."""
    pairs = [(float(left), float(right)) for left, right in pairs]
    if not pairs:
        return "none"
    if len(pairs) > 4:
        return f"{len(pairs)} intervals, {number(sum(right - left for left, right in pairs))} together"
    return ", ".join(f"[{number(left)}, {number(right)}]" for left, right in pairs)


def html(summary: Summary) -> str:
    """Returns the table in HTML."""
    edge = "text-align:left;padding:1px 12px 1px 0;background:none;border:none"
    cells = ((name, f"{number(value)} {unit}".strip()) for name, value, unit in summary.rows)
    lines = ("".join(f'<td style="{edge}">{escape(cell)}</td>' for cell in row) for row in cells)
    rows = "".join(f'<tr style="background:none">{line}</tr>' for line in lines)
    warnings = "".join(
        f'<div style="color:#a04000;margin-top:2px">&#9888; {escape(text)}</div>' for text in summary.warnings
    )
    return (
        f'<div class="microblock"><b>{escape(summary.title)}</b> '
        f'<span style="color:#555">{escape(summary.brief)}</span>'
        f'<table style="border-collapse:collapse;margin:4px 0">{rows}</table>{warnings}</div>'
    )


def saved(drawing: Any, file: Target = None, warnings: Iterable[str] = (), caption: str = "") -> Figure:
    """Returns a Figure, with caption and warnings above it, written to a file if there is one; raises
    BadArgument where no file can be.
    """
    if warnings or caption:
        lines = [caption or drawing.get_suptitle(), *(f"Warning: {text}" for text in warnings)]
        drawing.captioned("\n".join(lines).strip())
    if file is not None:
        require_place(file, "file", formats := drawing.canvas.get_supported_filetypes())
        path = Path(file)
        known = path.suffix[1:].lower() in formats  # what follows another point may be a number's digits
        with writing(file, "file"):
            drawing.savefig(path if known else path.with_name(f"{path.name}.png"))
    return cast("Figure", drawing)
