"""The studies `speed` and `limits`: what they measure, what they call an answer, and what their records
say.
"""

import json
import os
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from cases import report
from cases.__main__ import main
from cases.benchmarks import chart, choice, growth, limits, limits_maps, sampling, speed
from cases.benchmarks.sampling import Outcome
from cases.benchmarks.verification import __main__ as verification
from cases.benchmarks.verification import judging
from microblock import NotConverged

RESULTS = Path(chart.RECORD).parent
SOLID = {"nu": 0.3, "eta": 1.0, "alpha": 0.25}
# a cheap run of each branch of each map
TINY = {
    "asked": [
        {**SOLID, "method": method, "contact": "rotated", "strictness": 0.3, "psi0": 0.01, "slope": 0.1}
        for method in limits_maps.RTOLS
    ],
    "event": [
        {"kind_of": kind_of, "distance": 0.1, "strictness": 0.0, "psi0": 0.01, "alpha": 0.5}
        for kind_of in ("apart", "touching")
    ],
    "states": [
        {"problem": problem, "method": method, "degree": 0.5, "size": 9, "start": "random", "seed": 1}
        for problem in ("ill-conditioned", "copies", "no gaps", "rank", "weights")
        for method in ("pivoting", "path")
    ],
    "squares": [
        {**SOLID, "order": 2, "contact": contact, "psi0": 0.01, "spacing": 0.3}
        for contact in ("microblock", "rotated", "unilateral")
    ],
    "stretched": [
        {"shape": shape, "order": 2, "aspect": 1.0, "spacing": 0.3, "alpha": 0.25}
        for shape in ("quadrilaterals", "triangles")
    ],
    "newton": [
        {"kind_of": kind_of, "rho": 1.0, "spacing": 0.3, "alpha": 0.25} for kind_of in ("penalty", "al")
    ],
    "strip": [
        {"kind_of": kind_of, "order": 2, "elements": 4, "ell_over_h": 1.0, "nu": 0.3, "eta": 1.0, "rho": 1.0}
        for kind_of in ("penalty", "al")
    ],
    "supported": [
        {"solver": solver, "supports": "all", "eta": 1.0, "order": 2, "nu": 0.3, "ell": 0.3}
        for solver in ("no contact", "condensed", "al", "penalty")
    ],
    "friction": [
        {"body": body, "friction": 0.3, "alpha": 0.5, "contact": "unilateral"}
        for body in ("half-plane", "block", "square")
    ],
    "layer": [{"alpha": 0.05, "x1": 0.5, "beta": 1.0}],
}


def answers(what="error", seconds=0.0):
    if what == "nothing":
        raise NotConverged("the active set\n cycles")
    if what == "death":
        os._exit(3)
    time.sleep(seconds)
    return Outcome(float("nan") if what == "nan" else 2e-3, 1e-3 if what == "beyond" else None)


def test_outcomes_are_told_apart_and_no_run_stops_the_others():
    settings = [{"what": what} for what in ("error", "beyond", "nan", "nothing", "death")]
    work = [(answers, setting) for setting in [*settings, {"seconds": 600.0}, {}]]
    kinds = [row["kind"] for row in sampling.records(work, 1, 2.0)]
    middle = ["missed", "not finite", "typed error", "crash", "time limit"]
    assert kinds == ["delivered", *middle, "delivered"]


def test_records_of_limits_hold_what_the_page_says():
    frame = pd.read_csv(RESULTS / "limits.csv")
    table = limits.table(frame).set_index("question")
    assert (
        len(table) == 26
        and (table.runs > 0).all()
        and set(frame["map"]) == {one.name for one in limits_maps.MAPS}
    )
    assert (
        (table["where"] == "nowhere") == (table.failed == "none")
    ).sum() >= 25  # two wait for the second code
    assert not frame.kind.isin(("missed", "not finite", "untyped error", "crash")).any()
    assert len(limits.figure(frame).axes[0].lines) == 1 + len(limits.CURVES)


@pytest.mark.parametrize("part", limits_maps.MAPS, ids=lambda part: part.name)
def test_each_map_delivers(part):
    """A run that the library no longer answers as the map expects is an untyped error."""
    rows = [sampling.attempt(part.run, setting) for setting in TINY[part.name]]
    assert [(row["kind"], row["message"]) for row in rows] == [("delivered", "")] * len(rows)
    assert all(set(setting) == {axis.name for axis in part.axes} for setting in TINY[part.name])


def test_quick_maps(tmp_path, capsys):
    words = "limits --quick --only states newton --workers 1 --json - --out"
    assert main([*words.split(), str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {row["map"] for row in answer["counts"]} == {"states", "newton"}
    assert all(row.keys() <= {"map", *sampling.KINDS[:2]} for row in answer["counts"])  # no defects
    assert all((row["failed"] == "not run") == (row["runs"] == 0) for row in answer["table"])
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".png", ".pdf"}


@pytest.mark.parametrize("study", ["speed", "limits"])
def test_an_unknown_part_of_a_study_is_refused(study, capsys):
    """It was passed over: all of the study ran, or nothing."""
    assert main([study, "--quick", "--only", "nowhere"]) == 2
    assert "--only: only = 'nowhere': must be one of" in capsys.readouterr().err


@pytest.mark.parametrize("name", speed.METHODS)
def test_errors_are_those_of_the_record(name):
    """Of another version: the discrete problems are the same, so are their errors."""
    problem, method = speed.PROBLEMS["classical"], speed.METHODS[name]
    if not method.levels(problem):
        pytest.skip(f"{method.peer} is not installed")
    setting = method.levels(problem)[0]
    row = speed.measure(problem, method, setting, 1)
    record = pd.read_csv(chart.RECORD).query("scene == 'classical' and method == @name")
    assert np.abs(record.error / row["error"] - 1).min() < 1e-3 and row["failure"] is None


def test_benchmark_runs_hold_their_tolerance():
    runs = pd.read_csv(chart.RECORD).dropna(subset=["rtol", "error"])
    assert len(runs) == 99 and (runs.error / runs.rtol).max() <= 0.16  # as README says
    assert len(chart.figure().axes[0].lines) == len(chart.NAMES)


def test_time_and_memory_are_measured_in_processes_of_their_own(monkeypatch):
    """The whole of the study of speed, on one curve."""
    monkeypatch.setattr(growth, "LEVELS", {"cells": [{"nodes": 2**14}]})
    monkeypatch.setattr(speed, "METHODS", {"cells": speed.METHODS["cells"]})
    monkeypatch.setattr(speed, "PROBLEMS", {"classical": speed.PROBLEMS["classical"]})
    tables = speed.to_dict(speed.solve(repeats=1, limit=0.0))
    (grown,) = tables["growth"]
    assert grown["unknowns"] == 2**15 and grown["seconds"] > 0 and 1 < grown["megabytes"] < 100
    assert [row["failure"] for row in tables["runs"]] == [None]


def test_a_problem_of_the_choice(monkeypatch, tmp_path):
    monkeypatch.setattr(choice, "RECORD", tmp_path / "choice.csv")
    monkeypatch.setattr(choice, "KINDS", {"mesh": 2})
    choice.main(["--first", "1", "--count", "1"])
    record = pd.read_csv(choice.RECORD)
    assert list(record.method) == ["chosen", "condensed", "newton"] and not (record["class"] == "crash").any()
    assert choice.figure(record).axes[0].lines


@pytest.mark.parametrize("name", verification.SETS)
def test_each_set_of_the_verification_begins(name):
    """Its problems are drawn; `tests/library/test_verification.py` solves some of each."""
    number, case = next(verification.cases(name, [0]))
    assert number == 0 and case.text and isinstance(case, judging.Case)


def test_a_set_of_the_verification(capsys):
    (row,) = verification.main(["space", "--first", "3", "--count", "1"])
    assert row["class"] == "right" and "== space" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["chart", "choice", "limits"])
def test_records_are_drawn_in_the_report(name, tmp_path):
    (tmp_path / "figures").mkdir()
    item = report.drawn(name, report.modules()[name], tmp_path)
    files = [tmp_path / "figures" / f"{file}.png" for file in item["figures"]]
    assert item["message"] and files and all(file.exists() for file in files)
