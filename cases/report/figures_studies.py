"""Charts of the report from the records of the two studies `speed` and `limits`, which take too long to
repeat for a report.
"""

from functools import cache

from microblock.data.provenance import content
from microblock.errors import NotConverged

from ..common.catalog import DATA, PROGRAM
from ..studies import facts, limits, limits_figures, speed_figures

DRAWINGS = {"speed": speed_figures.PLATES, "speed_cost": speed_figures.COST_PLATES}
# how to read charts of `limits`
READ = """A mark is a run at its parameters, other parameters are random. First the outcome; then, of
runs that answered, shades: their true error, relative unless the bar says otherwise, iterations, and, where
a map has them, how much the pressure oscillates and the largest one of the wrong sign. A measure's shades
are the same in all its panels; exact zeros have none. Axes run towards the degenerate side where there is
one, and a part of the runs lies right there."""


@cache
def _read(path, _):
    """Records of a file, read once for each content."""
    return facts.records(path)


def _records(study, **where):
    """A function that returns the records of a study with these values; the content of the file is a part of
    it.
    """
    path, now = DATA / f"{study}.csv", content(DATA / f"{study}.csv")

    def records():
        if now is None:
            raise NotConverged(
                f"no records of {study} in {DATA}: {PROGRAM} {study.partition('_')[0]} --out {DATA}"
            )
        return [row for row in _read(path, now) if all(row[name] == value for name, value in where.items())]

    return records


def _map(one):
    """A drawing of a map of `limits`, with its question and what is drawn as caption."""

    def draw(rows):
        return limits_figures.chart(one, rows)

    draw.__doc__ = f"{one.question} {READ}"
    return draw


FIGURES = {
    **{
        f"speed_{name}": (_records(study), drawing)
        for study, drawings in DRAWINGS.items()
        for name, drawing in drawings.items()
    },
    **{f"limits_{name}": (_records("limits", map=name), _map(one)) for name, one in limits.MAPS.items()},
}
