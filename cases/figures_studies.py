"""Charts of the report from the records of the two studies `speed` and `limits`, which take too long to repeat for a report."""

from functools import cache
from pathlib import Path

from cases import figures_growth, figures_peers, limits, limits_figures, speed_figures
from microblock.errors import NotConverged
from microblock.provenance import File
from microblock.study import read_records

FOLDER = Path(__file__).parents[1]/"docs"/"data"
DRAWINGS = {"speed": {**speed_figures.PLATES, **figures_peers.PLATES}, "speed_cost": figures_growth.PLATES}
# how to read charts of `limits`
READ = """A mark is a run at its parameters, other parameters are random. First what became of it; then, of runs that
answered, shades: their true error, relative unless the bar says otherwise, iterations, and, where a map has them, how much the
pressure oscillates and the largest one of the wrong sign. A measure's shades are the same in all its panels; exact zeros have
none. Axes run towards the degenerate end where there is one, and a part of the runs lies right there."""


@cache
def _read(file, content):
    """Records of a File, read once for each content."""
    return read_records(file.path)


def _records(study, **where):
    """A function that returns the records of a study with these values; its digest is that of the file."""
    file = File(FOLDER/f"{study}.csv")

    def records():
        content = file.content
        if content is None:
            raise NotConverged(f"no records of {study} in {FOLDER}: python -m cases {study.partition('_')[0]} --out docs/data")
        return [row for row in _read(file, content) if all(row[name] == value for name, value in where.items())]
    return records


def _map(one):
    """A drawing of a map of `limits`, with its question and what is drawn as caption."""
    def draw(rows):
        return limits_figures.chart(one, rows)
    draw.__doc__ = f"{one.question} {READ}"
    return draw


PLATES = {
    **{f"speed_{name}": (_records(study), drawing) for study, plates in DRAWINGS.items() for name, drawing in plates.items()},
    **{f"limits_{name}": (_records("limits", map=name), _map(one)) for name, one in limits.MAPS.items()},
}
