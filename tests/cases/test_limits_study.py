"""The study of where methods fail: its samples, what it calls an answer, and runs that do not come back."""

import json
import os
import time

import numpy as np
import pytest

from cases.__main__ import main
from cases.studies import facts, limits, limits_figures, limits_friction, limits_pool, limits_where
from cases.studies.limits_maps import Axis, Map, Outcome, attempt, choice
from microblock import NotConverged
from microblock.data.records import read_records


def answers(error=0.0, **measures):
    return Outcome(error, **measures)


def refuses():
    raise NotConverged("the active set\n cycles")


def breaks():
    raise ZeroDivisionError("division by zero")


def sleeps(seconds):
    time.sleep(seconds)
    return Outcome(0.0)


def dies():
    os._exit(3)


TWO = Map(
    "two",
    "?",
    answers,
    (
        Axis("nu", "1/2 - nu", 0.5, 1e-4, "gap", "high", 0.5),
        Axis("alpha", "", 0.01, 1.0, "log", "both"),
        Axis("tilt", "", 0.0, 20.0, "linear"),
    ),
    ("law", ("a", "b")),
)


def test_samples_are_stratified_and_a_fifth_is_near_a_degeneracy():
    drawn = TWO.settings(200, seed=3)
    for law in ("a", "b"):
        mine = [setting for setting, near in drawn if setting["law"] == law and not near]
        # four fifths of a hundred, and 49 of them make the largest square of a prime
        assert len(mine) == 80
        places = np.array(
            [
                (
                    np.log10(0.5 / (0.5 - one["nu"])) / np.log10(5000),
                    np.log10(one["alpha"] / 0.01) / 2,
                    one["tilt"] / 20,
                )
                for one in mine
            ]
        )
        for pair in ((0, 1), (0, 2), (1, 2)):
            cells = {tuple(cell) for cell in np.floor(7 * places[:, pair]).astype(int)}
            assert len(cells) == 49  # at least one in each cell of each pair of axes
    near = [setting for setting, near in drawn if near]
    assert len(near) / len(drawn) == pytest.approx(0.2, abs=0.02)  # rounded up to whole runs
    # 1/25 of an axis
    assert all(0.5 - one["nu"] < 2e-4 or not 0.0121 < one["alpha"] < 0.83 for one in near)
    assert drawn == TWO.settings(200, seed=3) != TWO.settings(200, seed=4)


def test_axes_of_names_and_whole_numbers():
    one = choice("method", "", "al", "penalty", "condensed")
    assert [one.value(share) for share in (0.0, 0.34, 0.999, 1.0)] == [
        "al",
        "penalty",
        "condensed",
        "condensed",
    ]
    elements = Axis("elements", "", 1, 64, whole=True)
    assert [elements.value(share) for share in (0, 0.5, 1)] == [1, 8, 64] and isinstance(
        elements.value(0.3), int
    )


@pytest.mark.parametrize(
    "outcome, kind",
    [
        (Outcome(1e-5, promise=1e-4), "delivered"),
        (Outcome(1e-3), "delivered"),
        (Outcome(1e-3, promise=1e-4), "missed"),
        (Outcome(float("nan")), "not finite"),
        (Outcome(1e-5, estimate=float("inf")), "not finite"),
        (Outcome(1e-5, promise=1e-4, fallback="path"), "other method"),
        (Outcome(1.0, promise=1e-4, fallback="path"), "missed"),
    ],
)
def test_what_an_answer_is_called(outcome, kind):
    assert outcome.kind == kind


def test_errors_are_told_apart_and_no_record_holds_a_nan():
    assert attempt(refuses, {})["kind"] == "typed error"
    assert attempt(refuses, {})["message"] == "NotConverged: the active set cycles"
    assert attempt(breaks, {})["kind"] == "untyped error"
    assert attempt(answers, {"error": float("nan")})["error"] is None
    assert attempt(lambda: Outcome(float(np.float64(1) / np.float64(0))), {})["message"].startswith(
        "divide by zero"
    )


def test_runs_that_do_not_come_back_do_not_stop_the_others():
    work = [(answers, {"error": 1.0}), (sleeps, {"seconds": 600.0}), (dies, {}), (answers, {"error": 2.0})]
    done = []
    rows = limits_pool.records(work, 1, 2.0, lambda: done.append(1))
    assert [row["kind"] for row in rows] == ["delivered", "time limit", "crash", "delivered"] and len(
        done
    ) == 4
    assert [row["error"] for row in rows] == [1.0, None, None, 2.0]


@pytest.mark.nightly
def test_quick_study(tmp_path, capsys):
    assert main(["limits", "--quick", "--json", str(tmp_path / "a.json"), "--out", str(tmp_path / "o")]) == 0
    assert "typed error" in capsys.readouterr().out
    rows = json.loads((tmp_path / "a.json").read_text())["runs"]
    # defects, each of them; "time limit" is told apart from them because a busy machine may cause it
    assert [row for row in rows if row["kind"] in ("missed", "not finite", "untyped error", "crash")] == []
    assert {row["map"] for row in rows} == set(limits.MAPS)
    assert {path.name for path in (tmp_path / "o").iterdir()} == {
        "limits.csv",
        *(f"limits_{name}.{kind}" for name in limits_figures.DRAWINGS for kind in ("png", "pdf")),
    }
    assert len(read_records(tmp_path / "o" / "limits.csv")) == len(rows)


def test_quick_maps_of_friction(tmp_path):
    words = "limits --quick --only friction_cylinder friction_square --workers 1 --out"
    assert main([*words.split(), str(tmp_path)]) == 0
    rows = read_records(tmp_path / "limits.csv")
    assert [row["map"] for row in rows] == ["friction_cylinder"] * 4 + ["friction_square"] * 2
    assert {row["kind"] for row in rows} <= {"delivered", "typed error"}
    assert {path.name for path in tmp_path.iterdir()} == {
        "limits.csv",
        "limits_friction.png",
        "limits_friction.pdf",
    }


def test_a_known_answer_is_right_and_a_known_refusal_refused():
    """Far below and beyond the critical friction, some 2.5 by cells and 4.5 by finite elements."""
    for method in ("cells", "mesh"):
        setting = {"alpha": 0.3, "contact": "microblock", "method": method}
        below = attempt(limits_friction.cylinder, {"friction": 0.5, **setting})
        assert below["error"] < 0.05 and below["judge"] == {"cells": "mesh", "mesh": "cells"}[method]
        beyond = attempt(limits_friction.cylinder, {"friction": 8.0, **setting})
        assert beyond["kind"] == "typed error" and "coupled=False" in beyond["message"]


def test_the_critical_friction_tells_answers_from_errors_with_the_fewest_mistakes():
    rows = [
        run_of("delivered" if friction < 2 or friction == 3 else "typed error", friction=friction)
        for friction in (1, 1.5, 2, 3, 4, 5)
    ]
    # one answer, at 3, is on the wrong side of the bound; a bound between 3 and 4 would have one error there
    assert limits_figures.critical(rows) == pytest.approx(np.sqrt(1.5 * 2))
    assert limits_figures.critical([*rows, run_of("delivered", friction=3.5)]) == pytest.approx(
        np.sqrt(3.5 * 4)
    )
    assert limits_figures.critical(rows[:2]) is None


def test_a_parameter_must_not_hide_a_column_of_the_records():
    for name in ("kind", "estimate"):
        with pytest.raises(ValueError, match="differ"):
            Map("bad", "?", answers, (Axis("error_of", "", 1.0, 2.0),), (name, (1, 2)))


def test_an_axis_of_choices_gives_equal_shares():
    axis = Axis("law", "", choices=("a", "b", "c"))
    assert [axis.value(share) for share in (0.0, 0.3, 0.34, 0.7, 1.0)] == ["a", "a", "b", "c", "c"]


def run_of(kind="delivered", error=1e-3, promise=1e-2, **parameters):
    return {"map": "two", "kind": kind, "error": error, "promise": promise, "method": None, **parameters}


def test_a_run_fails_that_gives_nothing_exceeds_its_promise_or_is_of_no_use():
    assert not limits_where.fails(run_of()) and not limits_where.fails(run_of("other method"))
    assert limits_where.fails(run_of("missed")) and limits_where.fails(run_of("typed error", None, None))
    # where nothing is promised 10 % is too far; within a promise it is what was asked for
    assert limits_where.fails(run_of(error=0.2, promise=None)) and not limits_where.fails(run_of(error=0.2))


def test_the_condition_under_which_runs_fail_is_found():
    def rows(bad):
        shares = np.linspace(0, 1, 40)
        found = [{axis.name: axis.value(share) for axis in TWO.axes} for share in shares]
        for number, row in enumerate(found):  # a parameter that has nothing to do with it
            row["law"] = "ab"[number % 2]
        return [run_of("typed error" if bad(row) else "delivered", **row) for row in found]

    # all three axes rise together: the first one that is named tells as much as the others
    assert (
        limits_where.where(TWO, rows(lambda row: row["nu"] > 0.49))
        == "1/2 - nu < 0.011: 22 of 22; rest 0 of 18"
    )
    other = limits_where.where(TWO, rows(lambda row: row["law"] == "b"))
    assert other == "law = b: 20 of 20; rest 0 of 20"
    both = limits_where.where(TWO, rows(lambda row: row["nu"] > 0.49 or row["law"] == "b"))
    # the run next to the bound is one of "b": it fails as well, and the bound is beyond it
    assert both == "1/2 - nu < 0.014: 23 of 23; else law = b: 8 of 8; rest 0 of 9"


def test_a_curve_of_the_profile_is_of_all_runs_that_were_promised_something():
    curve = limits_figures.Curve("a", ("two",), "k", "-", 0.5, (0, 0), ("plain",))
    rows = [
        run_of(),
        run_of("missed", 2e-2),
        run_of("typed error", None, None),
        {**run_of("missed", 1.0), "map": "three"},
        {**run_of("missed", 1.0), "method": "plain"},
    ]
    assert curve.ratios(rows).tolist() == [0.1, 2.0, np.inf]


def test_what_the_captions_of_the_profile_say_is_in_the_records():
    records = facts.records("cases/data/limits.csv")
    assert sum(row["kind"] == "missed" for row in records) == 3
    (touching,) = ([row for row in records if row["map"] == "line_touching"],)
    assert len(touching) == 49 and sum(row["kind"] == "missed" for row in touching) == 2
    apart = next(curve for curve in limits_figures.CURVES if "two zones" in curve.name).ratios(records)
    assert np.isfinite(apart).mean() == pytest.approx(0.5, abs=0.02)  # "one half", said in words
    bounds = {}
    for one in limits_figures.of_maps(records, "friction_cylinder", "friction_square"):
        if limits_figures.answered(one) or "unique" in one["message"]:
            bounds.setdefault((one["contact"], one["map"], one["method"]), []).append(one)
    found = {key: limits_figures.critical(rows) for key, rows in bounds.items()}
    assert found.pop(("unilateral", "friction_cylinder", "mesh")) is None
    least = {law: min(bound for key, bound in found.items() if key[0] == law) for law, *_ in found}
    assert 1.8 < least["microblock"] < 2.2 and 2.6 < least["unilateral"] < 3.4  # "two" and "three"
    told = {row["what"] for row in limits_where.table(records)}
    assert told == {what for what, _ in limits_where.ADVICE.values()}  # no advice is left over, none missing
