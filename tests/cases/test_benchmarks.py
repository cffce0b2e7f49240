"""The studies `speed` and `limits`: what they measure, what they call an answer, and what their records
say.
"""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from cases import report
from cases.__main__ import main
from cases.benchmarks import beside, chart, limits, peers, speed
from cases.benchmarks.verification import __main__ as verification
from cases.benchmarks.verification import judging
from microblock import NotConverged

RESULTS = Path(chart.RECORD).parent
SPECIAL = "locking", "strip", "stretched", "penalty", "supported"


def test_records_of_limits_hold_what_the_page_says():
    frame = pd.read_csv(RESULTS / "limits.csv")
    table = limits.table(frame)
    assert len(table) == len(limits.QUESTIONS) and set(frame["map"]) <= {*limits.QUESTIONS}
    assert not frame.kind.isin((limits.KINDS["wrong"], limits.KINDS["crash"])).any()
    kept = [name for name in ("panels", "cells", "fitted", "mesh", "zones") if name in {*frame["map"]}]
    assert frame.ratio[frame["map"].isin(kept)].max() <= 1
    assert len(limits.figure(frame).axes[0].lines) > len(kept)


@pytest.mark.parametrize("name", SPECIAL)
def test_each_question_is_answered(name):
    """A run that the library no longer answers as the question expects is an untyped error."""
    row = limits.run(name, 0, 60)
    assert row["kind"] in (limits.KINDS["right"], f"error above {limits.USEFUL:.0%}"), row


def test_two_zones_that_nearly_touch_have_a_verdict():
    row = limits.run("zones", 4, 60)
    assert row["kind"] == limits.KINDS["right"] and 0 < row["error"] <= row["estimate"]


def solving(what):
    if what == "typed error":
        raise NotConverged("the active set\n cycles")
    if what == "crash":
        raise ZeroDivisionError
    while what == "endless":
        pass
    return SimpleNamespace(warnings=["beware"] * (what == "warned"))


@pytest.mark.parametrize(
    "what, error, expected",
    [
        ("", 9e-3, "right"),
        ("", 2e-2, "wrong"),
        ("warned", 2e-2, "warned"),
        ("", np.nan, "unjudged"),
        ("typed error", 0.0, "error"),
        ("crash", 0.0, "crash"),
        ("endless", 0.0, "slow"),
    ],
)
def test_outcomes_are_told_apart_and_none_stops_the_study(what, error, expected):
    case = judging.Case("", 1e-2, lambda: solving(what), lambda state: (error, None, 0.0))
    row = judging.outcome(case, seconds=0.2)
    assert row["class"] == expected and expected in limits.KINDS


def test_quick_questions(tmp_path, capsys):
    words = "limits --quick --only strip supported --json - --out"
    assert main([*words.split(), str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {row["map"] for row in answer["counts"]} == {"strip", "supported"}
    assert all((row["failed"] == "not run") == (row["runs"] == 0) for row in answer["table"])
    assert [*answer["table"][0]] == ["question", "runs", "failed", "where", "what to do"]
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
    if not method.discretisations(problem):
        pytest.skip(f"{method.peer} is not installed")
    setting = method.discretisations(problem)[0]
    row = speed.measure(problem, method, setting, 1)
    record = pd.read_csv(chart.RECORD).query("scene == 'classical' and method == @name")
    assert np.abs(record.error / row["error"] - 1).min() < 1e-3 and row["failure"] is None


def test_benchmark_runs_hold_their_tolerance():
    runs = pd.read_csv(chart.RECORD).dropna(subset=["rtol", "error"])
    assert len(runs) == 99 and (runs.error / runs.rtol).max() <= 0.16  # as README says
    assert len(chart.figure().axes[0].lines) == len(chart.NAMES)


def test_the_study_of_speed_on_one_curve(monkeypatch):
    monkeypatch.setattr(speed, "METHODS", {"cells": speed.METHODS["cells"]})
    monkeypatch.setattr(speed, "PROBLEMS", {"classical": speed.PROBLEMS["classical"]})
    answer = speed.to_dict(speed.solve(repeats=1, limit=0.0))
    (run,) = answer["runs"]
    (grown,) = answer["growth"]
    assert run["failure"] is None and grown["unknowns"] == run["unknowns"] and grown["seconds"] > 0


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


# ---- beside NGSolve's ContactBoundary


def test_the_table_beside_contact_boundary_is_that_of_the_record():
    runs = pd.read_csv(peers.RECORD)
    page = (RESULTS.parents[2] / "docs" / "methods.md").read_text()
    rows = peers.table(runs)
    assert len(rows) >= 6
    for name, cells in rows.items():
        assert f"| {' | '.join([name, *cells])} |" in page
    plane = runs[(runs.dim == 2) & (runs.program == "ContactBoundary")]
    peaks = plane[(plane.stiffness >= 100) & (plane.rule > 2 * plane.order)].peak_error
    assert peaks.between(0.007, 2.6).all() and peaks.max() > 2.5
    assert plane[plane.stiffness == 1][["load_error", "peak_error"]].stack().between(0.04, 0.071).all()


def test_contact_boundary_and_the_program_agree_on_a_mesh():
    """A penalty of 30 is off by 1 % of the load; the search has pairs."""
    scene = peers.Scene(2, 2, 0.3)
    load, peak, _, _ = scene.own(None)
    load_of_peer, peak_of_peer, _, _ = peers.contact_boundary(scene, 30.0, 4)
    assert load_of_peer == pytest.approx(load, rel=0.02)
    assert peak_of_peer == pytest.approx(peak, rel=0.05)  # where its points lie


# ---- beside other programs, aims and floors


def test_a_row_beside_another_program(capsys, monkeypatch):
    """A program that is not installed has the figure of the record, which is then the aim."""
    work = beside.Work(lambda: lambda: None, floor=lambda: lambda: None, peer="not_installed")
    monkeypatch.setitem(beside.WORKS, "nothing", work)
    monkeypatch.setattr(beside, "ROUNDS", 1)
    row = beside.row("nothing", {"nothing": 1e-9})
    assert row["peer"] == "not_installed, stored" and row["aim"] == 1e-9
    assert row["reached"] == f"no, {row['seconds'] / 1e-9:.2g}x" and 0 <= row["floor"] < 1
    assert beside.row("nothing", {"nothing": 1e3})["reached"] == "yes"
    speed.main(["--peers", "--only", "panels to 0.001"])
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split() == [*row]
    assert len(rows) == 2  # alone, and from a neighbour


def test_the_record_beside_other_programs_has_all_works():
    record = pd.read_csv(beside.RECORD)
    assert [*record.work] == [*beside.WORKS]
    assert record.seconds.gt(0).all() and record.beside[record.peer.notna()].gt(0).all()
