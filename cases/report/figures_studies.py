"""Charts and a table of the report from the records of `speed`, `limits` and `friction_size`, which take too
long to repeat for a report.
"""

from functools import cache

from microblock.data.provenance import content
from microblock.errors import NotConverged

from ..common.catalog import DATA, PROGRAM
from ..scenes import friction_size
from ..studies import facts, limits_figures, limits_where, speed_figures


@cache
def _read(path, _):
    """Records of a file, read once for each content."""
    return facts.records(path)


def _records(study, maps=None, case=None):
    """A function that returns the records of a study, or of some of its maps; the content of the file is a
    part of it. `case` writes them; else the one that the study's name begins with.
    """
    case = case or study.partition("_")[0]
    path, now = DATA / f"{study}.csv", content(DATA / f"{study}.csv")

    def records():
        if now is None:
            raise NotConverged(f"no records of {study} in {DATA}: {PROGRAM} {case} --out {DATA}")
        return [row for row in _read(path, now) if maps is None or row["map"] in maps]

    return records


def _failures():
    """A function that returns the table of what fails where."""
    records = _records("limits")

    def table():
        return limits_where.table(records())

    table.__doc__ = limits_where.table.__doc__
    return table


MAPS = tuple(name for name in limits_figures.DRAWINGS if name != "profile")
FIGURES = {
    "friction_dissipation": (
        _records("friction_dissipation", case="friction_size"),
        friction_size.dissipation,
    ),
    **{
        f"speed_{name}": (_records(study), drawing)
        for study, drawings in (("speed", speed_figures.PLATES), ("speed_cost", speed_figures.COST_PLATES))
        for name, drawing in drawings.items()
    },
    **{
        f"limits_{name}": (_records("limits", maps), drawing)
        for name, (maps, drawing) in limits_figures.DRAWINGS.items()
    },
}
TABLES = {"limits_where": _failures()}
