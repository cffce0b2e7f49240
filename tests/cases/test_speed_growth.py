"""Growth of time and memory: what is measured, what is left out, and what is said of it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from cases.studies import speed_figures, speed_growth
from cases.studies.speed_growth import FAMILIES
from microblock.data.records import read_records, write_records


class Quiet:
    def update(self, number=1):
        pass

    set_description = update


def rows(count):
    """Runs of one method, four times as large each, seconds to the power 1.5, memory to the power 1.2 of the
    unknowns.
    """
    sizes = 1000 * 4 ** np.arange(count)
    return [
        {
            **speed_growth.blank(FAMILIES["cells"], {"nodes": int(size)}),
            "unknowns": int(size),
            "contact_nodes": int(size) // 10,
            "seconds": 1e-7 * size**1.5,
            "megabytes": 0.01 * size**1.2,
            "distance": 3.0,
            "share_mesh": 0.5,
        }
        for size in sizes
    ]


HUNGRY = """
import json
import numpy as np
from cases.studies import speed_growth
from cases.studies.speed_growth import Answer, Family

def hungry(size):
    np.ones(size).sum()      # touched, and given back
    return Answer(None, size, 1, 0.1, 0.2), None

family = Family("hungry", hungry, lambda _: lambda: None, ({"size": 1000},))
print(json.dumps(speed_growth.measure(family, {"size": 25_000_000})))
"""


def test_memory_of_a_run_is_its_peak():
    # in a process of its own, as the study does: of a large one the system may take back pages meanwhile
    row = json.loads(
        subprocess.run([sys.executable, "-c", HUNGRY], check=True, capture_output=True, text=True).stdout
    )
    # 25e6 numbers of 8 bytes; pages and what the interpreter takes besides
    assert row["megabytes"] == pytest.approx(25e6 * 8 / 2**20, rel=0.05)
    assert row["seconds"] == pytest.approx(0.3, rel=1e-12) and row["distance"] > 0


@pytest.mark.parametrize(
    "name", ["condensed, order 1", "condensed, order 4", "AL, order 1", "cells", "half-plane"]
)
def test_every_method_is_measured_against_its_floor(name):
    row = speed_growth.measure(FAMILIES[name], FAMILIES[name].settings[0])
    assert set(row) == set(speed_growth.MEASURED)
    # nothing is much faster than one factorisation of its own matrix: CHOLMOD may be, than NGSolve's
    assert row["distance"] > 0.3 and 0 < sum(row[f"share_{phase}"] for phase in speed_growth.PHASES) <= 1.05


def test_runs_apart_bring_records_or_failures():
    good = speed_growth.apart(FAMILIES["condensed, order 1"], {"h": 0.4, "order": 1})
    assert good["failure"] is None and good["unknowns"] == 1474 and good["before"] > 10
    bad = speed_growth.apart(FAMILIES["condensed, order 1"], {"h": -1.0, "order": 1})
    assert "BadArgument" in bad["failure"] and bad["seconds"] is None and set(bad) == set(good)


def test_exponents_are_those_of_the_last_decade():
    mine = rows(5)
    mine[0]["seconds"] = mine[1]["seconds"] = 1.0  # overheads of small problems do not count
    over_unknowns, over_nodes = speed_growth.slopes(mine)
    for slope in over_unknowns, over_nodes:
        # rounding alone
        assert slope["seconds"] == pytest.approx(1.5, rel=1e-9)
        assert slope["megabytes"] == pytest.approx(1.2, rel=1e-9)
    assert (over_unknowns["from"], over_unknowns["to"]) == (64000, 256000)
    assert speed_growth.slopes([{**row, "megabytes": 0.1} for row in mine])[0]["megabytes"] is None


def test_levels_that_are_too_dear_are_left_out(monkeypatch):
    monkeypatch.setattr(speed_growth, "available", lambda: None)  # where the system does not say
    assert speed_growth.refused(rows(2)) is None and speed_growth.refused(rows(1)) is None
    assert "s would go beyond" in speed_growth.refused(rows(6))
    monkeypatch.setattr(speed_growth, "available", lambda: 1000.0)
    assert "GiB" in speed_growth.refused(rows(4))
    monkeypatch.setattr(speed_growth, "apart", lambda family, setting: rows(6)[len(done)])
    done = []

    class Count(Quiet):
        def update(self, number=1):
            done.append(number)

    found = speed_growth.refined(FAMILIES["cells"], [{"nodes": 1}] * 6, Count())
    assert [bool(row["failure"]) for row in found] == [False] * (len(found) - 1) + [True] and sum(done) == 6


def test_chart_shows_what_was_left_out(tmp_path):
    mine = rows(4) + [
        {**speed_growth.blank(FAMILIES["cells"], {"nodes": 7}), "failure": "left out: too long"}
    ]
    write_records(tmp_path / "a.csv", mine)
    drawing = speed_figures.cost(read_records(tmp_path / "a.csv"))
    assert [line.get_marker() for line in drawing.axes[0].lines].count("x") == 1
    assert len(drawing.axes[1].lines[0].get_xdata()) == 4
