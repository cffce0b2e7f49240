"""Figure of a load path: the edges of zones over the load, and the events on the way."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

import numpy as np

from ..errors import NotConverged
from ..model.events import Event, LoadPath
from ..model.state import State
from ..model.types import Axes, Figure
from . import plots

STATES = 24  # between first touch and the last load, closer where zones are narrow
BESIDE_EVENT = 1e-3  # relative distance of the states before and behind an event
MARKS = {"born": "o", "merged": "^", "split": "v", "vanished": "x"}
MARKER_SIZES = {"born": 6, "merged": 3.5, "split": 3.5, "vanished": 4}  # points: one shows through another


@plots.styled
def draw_path(path: LoadPath, axis: Axes | None) -> Figure:
    """Returns the figure of an axis, or a new one, with the zones of a path in the plane over its load, and
    with its events.
    """
    drawing, axis = plots.in_place(axis)
    flat = path.problem.solver.in_space is None
    if flat:
        _draw_zones(axis, path)
    for kind, events in groupby(sorted(path.events, key=lambda event: event.kind), lambda event: event.kind):
        _draw_events(axis, kind, [*events])
    per_thickness = " per thickness" if flat else ""
    axis.set(xlabel="$x_1$ (length)", ylabel=f"load (force{per_thickness})", ylim=(0, 1.05 * path.last))
    if axis.get_legend_handles_labels()[0]:
        plots.legend_below(axis)
    return drawing


def _draw_zones(axis: Axes, path: LoadPath) -> None:
    """Draws the edges of the zones of each corner over the load, apart where their number changes."""
    states = [*_states(path)]
    corners = path.problem.law.corners
    names = corners if len(corners) > 1 else ("contact",)
    for colour, name in zip(plots.COLOURS, names):
        label = f"edges of {name}" if len(names) > 1 else "edges of the contact"
        for _, alike in groupby(states, lambda state: len(state.zones[name])):
            rows = [(np.ravel(state.zones[name]), state.load) for state in alike]
            edges, loads = zip(*rows)
            for line in axis.plot(np.array(edges), loads, color=colour):
                line.set_label(label)
                label = "_"  # the first line has it
    axis.margins(x=0.08)


def _states(path: LoadPath) -> Iterable[State]:
    """Yields states of a path, ascending in load, but for those that do not converge."""
    loads = {path.last * (number / STATES) ** 2 for number in range(1, STATES + 1)}
    loads |= {event.load * (1 + way * BESIDE_EVENT) for event in path.events for way in (-1, 1)}
    for load in sorted(loads):
        if 0 < load <= path.last:
            try:
                yield path.at(load)
            except NotConverged:  # the others are drawn
                continue


def _draw_events(axis: Axes, kind: str, events: list[Event]) -> None:
    """Draws events of a kind, with the names of the zones in the legend."""
    zones = dict.fromkeys(event.zone for event in events)
    axis.errorbar(
        [event.x for event in events],
        [event.load for event in events],
        [event.load_error for event in events],
        fmt=MARKS[kind],
        color="0.2",
        markersize=MARKER_SIZES[kind],
        markerfacecolor="none" if kind == "born" else None,
        clip_on=False,
        label=f"{kind}: {', '.join(zones)}",
    )
