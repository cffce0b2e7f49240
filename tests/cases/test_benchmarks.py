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

from cases.__main__ import main
from cases.benchmarks import chart, growth, limits, limits_maps, sampling, speed
from cases.benchmarks.sampling import Outcome
from microblock import NotConverged

RESULTS = Path(chart.RECORD).parent


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


@pytest.mark.parametrize("method", ["panels", "cells", "fitted", "mesh"])
def test_a_method_keeps_its_promise(method):
    out = limits_maps.asked(method, "rotated", 0.3, nu=0.3, eta=1.0, alpha=0.25, psi0=0.01, slope=0.1)
    assert 0 < out.error < out.promise


def test_quick_maps(tmp_path, capsys):
    words = "limits --quick --only strip newton --workers 1 --json - --out"
    assert main([*words.split(), str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {row["map"] for row in answer["counts"]} == {"strip", "newton"}
    assert all((row["failed"] == "not run") == (row["runs"] == 0) for row in answer["table"])
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".png", ".pdf"}


@pytest.mark.parametrize("study", ["speed", "limits"])
def test_an_unknown_part_of_a_study_is_refused(study, capsys):
    """It was passed over: all of the study ran, or nothing."""
    assert main([study, "--quick", "--only", "nowhere"]) == 2
    assert "--only: only = 'nowhere': must be one of" in capsys.readouterr().err


@pytest.mark.parametrize("name, setting", [
    ("fitted fe", {"rtol": 1e-2}), ("cells", {"nodes": 512}),
    ("AL, order 1", {"h": 0.4, **speed.AL}), ("scikit-fem, order 2", {"h": 0.4, "order": 2}),
    ("ContactBoundary, order 1", {"h": 0.4, "order": 1, "rho": 1e2}),
])  # fmt: skip
def test_errors_are_those_of_the_record(name, setting):
    """Of another version: the discrete problems are the same, so are their errors."""
    row = speed.measure(speed.PROBLEMS["classical"], speed.METHODS[name], setting, 1)
    record = pd.read_csv(chart.RECORD).query("scene == 'classical' and method == @name")
    assert np.abs(record.error / row["error"] - 1).min() < 1e-3 and row["failure"] is None


def test_benchmark_runs_hold_their_tolerance():
    runs = pd.read_csv(chart.RECORD).dropna(subset=["rtol", "error"])
    assert len(runs) == 99 and (runs.error / runs.rtol).max() <= 0.16  # as README says
    assert len(chart.figure().axes[0].lines) == len(chart.NAMES)


def test_growth_is_measured_in_a_process_of_its_own():
    row = growth.apart("cells", {"nodes": 2**14})
    assert row["unknowns"] == 2**15 and row["seconds"] > 0 and 1 < row["megabytes"] < 100
