"""How results show themselves: in a line of a terminal, and in the file of a figure."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..errors import require_place, writing
from .types import Interval, Target

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def line(title: str, words: str, warnings: Iterable[str] = ()) -> str:
    """Returns what a terminal shows of a result, warnings below."""
    return f"<{title}: {words}{''.join(f'{chr(10)}  warning: {text}' for text in warnings)}>"


def number(value: float | None) -> str:
    """Returns a number in four digits, None as a dash."""
    return "-" if value is None else f"{value:.4g}"


def intervals(pairs: Iterable[Interval]) -> str:
    """Returns a union of intervals in words, many as number and length."""
    pairs = [(float(left), float(right)) for left, right in pairs]
    if not pairs:
        return "none"
    if len(pairs) > 4:
        return f"{len(pairs)} intervals, {number(sum(right - left for left, right in pairs))} together"
    return ", ".join(f"[{number(left)}, {number(right)}]" for left, right in pairs)


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
