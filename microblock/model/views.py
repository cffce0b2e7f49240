"""Figures and data sets of results, which packages above the model offer: the model knows none by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:  # the types load NumPy, which `import microblock` does without
    from .types import Axes, Figure


class Pictures(Protocol):
    """Figures of results, new ones or those of an axis."""

    def draw_state(self, state: Any, ax: Axes | None, /) -> Figure:
        """Returns the figure of a state."""

    def draw_blocks(self, state: Any, ax: Axes | None, /) -> Figure:
        """Returns the figure of the blocks at the contact."""

    def draw_below(self, state: Any, field: str, ax: Axes | None, x2: float | None, /) -> Figure:
        """Returns the figure of a field below the surface, in space in the plane x2."""

    def draw_history(self, states: Sequence[Any], ax: Axes | None, /) -> Figure:
        """Returns the figure of a history with friction."""

    def draw_path(self, path: Any, ax: Axes | None, /) -> Figure:
        """Returns the figure of a load path."""

    def draw_identification(self, result: Any, ax: Axes | None, /) -> Figure:
        """Returns the figure of readings, fit and profiles."""

    def draw_rows(
        self, rows: Sequence[dict[str, Any]], x: str, y: str, others: Sequence[str], ax: Axes | None, /
    ) -> Figure:
        """Returns the figure of rows of a sweep, a curve for each value of the others."""


class Tables(Protocol):
    """Results as labelled data sets."""

    def data_set(self, result: Any, /) -> Any:
        """Returns a data set of xarray."""


_offers: dict[str, Callable[[], Any]] = {}


def offer(pictures: Callable[[], Pictures], tables: Callable[[], Tables]) -> None:
    """Takes the functions that load pictures and tables when they are first asked for."""
    _offers.update(pictures=pictures, tables=tables)


def pictures() -> Pictures:
    """Returns the Pictures, which load matplotlib."""
    return _offers["pictures"]()


def tables() -> Tables:
    """Returns the Tables."""
    return _offers["tables"]()
