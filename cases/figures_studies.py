"""Charts of the report from the records of the two studies `speed` and `limits`, which take too long to repeat for a report."""

from functools import cache
from pathlib import Path

from cases import figures_growth, figures_peers, limits, limits_figures, speed_figures
from microblock.errors import NotConverged
from microblock.provenance import File
from microblock.study import read_records

FOLDER = Path(__file__).parents[1]/"docs"/"data"
DRAWINGS = {"speed": {**speed_figures.PLATES, **figures_peers.PLATES}, "speed_cost": figures_growth.PLATES}


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
    """A drawing of a map of `limits`, with its question as caption."""
    def draw(rows):
        return limits_figures.chart(one, rows)
    draw.__doc__ = one.question
    return draw


PLATES = {
    **{f"speed_{name}": (_records(study), drawing) for study, plates in DRAWINGS.items() for name, drawing in plates.items()},
    **{f"limits_{name}": (_records("limits", map=name), _map(one)) for name, one in limits.MAPS.items()},
}
