"""Figure of a parameter study."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from ..errors import shortened
from ..model.types import Axes, Figure
from . import plots


@plots.styled
def draw_rows(
    rows: Sequence[dict[str, Any]], x: str, y: str, others: Sequence[str], axis: Axes | None
) -> Figure:
    """Returns the figure of an axis, or a new one, with a column over another one, a curve for each
    combination of the values of other columns.
    """
    drawing, axis = plots.in_place(axis)
    curves: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for row in rows:
        label = ", ".join(f"{name} = {shortened(str(row.get(name)))}" for name in others)
        curves[label].append((row[x], row[y]))
    for label, points in curves.items():
        points.sort()
        axis.plot(*zip(*points), marker="o", label=label)
    axis.set(xlabel=x, ylabel=y)
    if len(curves) > 1:
        plots.legend_below(axis)
    return drawing
