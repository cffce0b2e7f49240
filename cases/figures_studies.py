"""Charts of the report from the records of the two studies `speed` and `limits`, which take too long to repeat for a report."""

import hashlib
from functools import cache
from pathlib import Path

from cases import figures_growth, figures_peers, limits, limits_figures, speed_figures
from microblock.errors import NotConverged
from microblock.study import read_records

FOLDER = Path(__file__).parents[1]/"docs"/"data"
DRAWINGS = {"speed": {**speed_figures.PLATES, **figures_peers.PLATES}, "speed_cost": figures_growth.PLATES}


@cache
def _read(study, content):
    return read_records(FOLDER/f"{study}.csv")


def _content(study):
    """What the records of a study are known by; None where there are none."""
    path = FOLDER/f"{study}.csv"
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None


def _records(study, **where):
    """A function that returns the records of a study with these values."""
    content = _content(study)

    def records():
        if content is None:
            raise NotConverged(f"no records of {study} in {FOLDER}: python -m cases {study.partition('_')[0]} --out docs/data")
        return [row for row in _read(study, content) if all(row[name] == value for name, value in where.items())]
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
