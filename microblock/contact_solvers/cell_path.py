"""A load path on equal cells of a line or a surface: the events of two grids."""

from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ..model.events import Event, SeenTwice, following
from ..model.refinement import FEWEST, GeometricSeries
from ..model.types import Array, Flags, Integers
from .fft_compliance import spots
from .zone_scan import STEP, ZoneScan

PASSINGS = [{("merged", "contact"), ("born", "full")}, {("split", "contact"), ("vanished", "full")}]


class CellPath(SeenTwice):
    """The load path on cells of a `CellSolver`: events of two grids in one window.

    `load_error` adds the bracket to what an error that falls by the root of two from grid to grid leaves of
    the change. In three dimensions x is x1 of the place, and the zones are "contact" and "full".
    """

    def __init__(self, solver: Any, last: float, rtol: float | None) -> None:
        super().__init__(solver.contact, last, rtol)
        self._solver = solver

    @cached_property
    def first(self) -> float:
        """Load from which zones are followed; see `LoadPath`."""
        return max(first for first, _ in self._followed)

    @cached_property
    def _seen(self) -> list[dict[Any, Event]]:  # type: ignore[override]
        return [self.numbered(events) for _, events in self._followed]

    @cached_property
    @following
    def _followed(self) -> list[tuple[float, list[Event]]]:
        """[(first load, events), ...] on a coarse and a fine grid."""
        solver = self._solver
        window = solver.window_of(self.last)
        fine = solver.options.nodes or solver.followed
        grids = [window.with_count(count) for count in (fine // 2, fine)]
        return [CellScan(solver, grid).down_from(self.last) for grid in grids]

    def judged(self, coarse: Event, fine: Event) -> Event:
        missing = GeometricSeries(2**0.5).error([abs(fine.load - coarse.load)])
        return replace(fine, load_error=fine.load_error + coarse.load_error + missing)


class CellScan(ZoneScan):
    """The scan of loads on one grid."""

    def __init__(self, solver: Any, grid: Any) -> None:
        super().__init__()
        self.solver = solver
        self.grid = grid
        self.near = FEWEST * grid.width
        self.periodic = solver.period is not None
        self.box = grid.count if self.periodic else None

    def solved(self, load: float, start: Any) -> Any:
        residual = self.solver.loose / self.grid.count / 100
        return self.solver.solved(self.grid, load, None, residual, start)

    def labels(self, flags: Flags) -> Integers:
        return spots(flags, self.periodic)

    def initial_gaps(self) -> tuple[tuple[str, ...], Array]:
        return self.solver.law.corners, self.solver.prepared(self.grid)[1]

    def coordinates(self, places: Integers) -> Integers:
        return places

    def is_small(self, contact: Integers) -> bool:
        return bool(np.count_nonzero(contact) ** (1 / self.solver.dimensions) <= FEWEST)

    def steady(self, events: list[Event]) -> list[Event]:
        steady = super().steady(events)
        return self.passings(steady) if self.solver.dimensions == 1 else steady

    def passings(self, events: list[Event]) -> list[Event]:
        """Returns events with one load where edges of the two corners pass each other: contacts merge with a
        cell between them, and full contact begins with another.
        """
        together = list(events)
        for (i, first), (j, second) in combinations(enumerate(events), 2):
            kinds = {(first.kind, first.zone), (second.kind, second.zone)}
            if kinds in PASSINGS and abs(first.x - second.x) <= self.near and second.load < STEP * first.load:
                load = (first.load + second.load) / 2
                error = first.load_error + second.load_error + (second.load - first.load) / 2
                together[i] = replace(first, load=load, load_error=error)
                together[j] = replace(second, load=load, load_error=error)
        return together

    def middle(self, places: Integers) -> float:
        """Returns x1 of the middle of cells, array (k, d), on a period by the shorter way."""
        offsets: Array | Integers = places - places[0]
        if self.periodic:
            offsets = offsets - self.grid.count * np.rint(offsets / self.grid.count)
        return float(self.grid.axes[0][0] + self.grid.width * (places[0] + offsets.mean(axis=0))[0])
