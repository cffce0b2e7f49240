"""The events of a load path: loads at which zones are born, merge, split or vanish, over their places."""

from . import plots

MARKS = {"born": "o", "merged": "^", "split": "v", "vanished": "x"}


@plots.styled()
def draw(path, axis=None):
    """The figure of the events of a LoadPath: a mark for each kind, a colour for each zone."""
    drawing, axis = plots.in_place(axis, width=plots.COLUMN)
    zones = list(dict.fromkeys(event.zone for event in path.events))
    for kind, zone in dict.fromkeys((event.kind, event.zone) for event in path.events):
        events = [event for event in path.events if (event.kind, event.zone) == (kind, zone)]
        axis.errorbar(
            [event.x for event in events],
            [event.load for event in events],
            yerr=[event.load_error for event in events],
            fmt=MARKS[kind],
            color=plots.COLOURS[zones.index(zone) % len(plots.COLOURS)],
            label=f"{zone} {kind}",
        )
    axis.set(xlabel="$x_1$ (length)", ylabel="load (force per thickness)", ylim=(0, 1.05 * path.last))
    if path.events:
        plots.legend_below(axis)
    return drawing
