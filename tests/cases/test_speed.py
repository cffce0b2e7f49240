"""The study of speed against accuracy: its measure, its records, its failures."""

import json

import numpy as np
import pytest

from cases.__main__ import main
from cases.common.catalog import DATA
from cases.common.three_ways import seen
from cases.studies import facts, judged_line, speed, speed_figures, speed_growth
from cases.studies.speed_methods import (
    AL_RHO,
    METHODS,
    PAPER_DOMAIN,
    PAPER_SCENE,
    REACH,
    Answer,
    Method,
    fitted,
    half_plane,
    on_squares,
    uniform,
)
from cases.studies.speed_scenes import CLASSICAL, LOAD, SCENES, WHERE, rule
from microblock import NotConverged
from microblock.data.records import read_records

SCENE = SCENES["microblock-0.25"]
NAMED = {method.name: method for method in METHODS if "line" in method.kinds}


def test_rule_integrates_roots_at_its_places():
    x, weights = rule([-1.5, -1.0, 1.0, 1.5])
    inside = np.sqrt(np.maximum(1 - x**2, 0))
    # four Gauss points on cells of ratio two, and what is left beyond 40 halvings
    assert weights @ inside == pytest.approx(np.pi / 2, rel=1e-8)
    assert weights @ inside**2 == pytest.approx(4 / 3, rel=1e-12)


def test_measure_sees_a_wrong_scale_and_a_wrong_edge():
    scene = SCENES["classical"]
    right = scene._reference[0]
    scaled = scene.errors(lambda x: (1.01 * right(x)[0], right(x)[1]))
    # linear: rounding alone
    assert scaled["error_p"] == pytest.approx(0.01, rel=1e-9) and scaled["error_m"] == 0
    a = 1.001

    def wider(x):
        return np.sqrt(np.maximum(1 - (x / a) ** 2, 0)), 0 * x

    x = np.cos(np.linspace(0, np.pi, 2_000_001)) * a
    exact, found = np.sqrt(np.maximum(1 - x**2, 0)), wider(x)[0]
    expected = np.sqrt(np.trapezoid((found - exact) ** 2, -x) / (4 / 3))
    # at the displaced edge, which the rule does not know, the square of the error is only Lipschitz
    assert scene.errors(wider)["error_p"] == pytest.approx(expected, rel=1e-3)


def test_measure_is_that_of_the_sample_of_problems():
    """tanh-sinh between all breaks, cases/studies/judged_line.py, against the one rule for all methods."""
    fine, _ = judged_line.reference(SCENE.half_plane)
    state = SCENE.half_plane.solve(load=LOAD, rtol=1e-3)
    # the state's own edges are off the rule's: its error there is small beside the rest
    assert max(SCENE.errors(seen(state)).values()) == pytest.approx(judged_line.error(state, fine), rel=0.01)


def test_psi_in_the_layers_is_verified_by_modes():
    """Finite elements know nothing of the modes of the half-plane: both agree as far as either promises."""
    scene = SCENES["microblock-0.01"]
    assert scene.deep and 0 < scene.floor_psi < 1e-9 and scene.floor < 1e-9
    asked = {rtol: scene.remarks(run(scene, rtol)) for run, rtol in ((fitted, 1e-3), (half_plane, 1e-5))}
    assert all(0 < found["error_psi"] < rtol for rtol, found in asked.items())
    assert scene.remarks(
        Answer(
            scene._reference[0], 1, 1, 0.0, 0.0, psi=lambda x1, x2: 1.01 * scene._known_psi[1] * (x1 == WHERE)
        )
    )["error_psi"] == pytest.approx(0.01, rel=1e-9)  # linear: rounding alone
    others = [other for other in SCENES.values() if not getattr(other, "deep", False)]
    assert len(others) == len(SCENES) - 2 and all(other.floor_psi is None for other in others)


def test_every_curve_has_a_look_and_every_mesh_its_shape_and_rule():
    looks = speed_figures.LOOKS
    assert set(looks) <= {method.name for method in METHODS}
    names = (speed_figures.CLASSICAL_NAMES, speed_figures.LAW_NAMES, speed_figures.COST_NAMES)
    assert set(looks) == {name for drawn in names for name in drawn}
    for drawn in names:  # told apart by more than colour
        assert len({(looks[name].marker, looks[name].line) for name in drawn}) == len(drawn)
    for method in METHODS:
        if method.run is uniform:
            for setting in method.settings + method.dear:
                more = set() if setting["solver"] == "condensed" else {"rho", "domain"}
                assert (
                    set(setting) == {"h", "order", "solver", "reach", "shape"} | more <= set(speed.SETTINGS)
                )
            assert method.levels(SCENES[PAPER_SCENE]) == method.settings + method.dear
            assert method.levels(SCENES["unilateral-1"]) == method.settings


def test_recorded_rho_is_the_default_of_the_mesh():
    scene = SCENES["unilateral-1"]
    *_, newton = on_squares(scene, 0.5, 1, "al", PAPER_DOMAIN, reach=REACH).solver.prepare()
    assert newton.rho == pytest.approx(AL_RHO, rel=1e-12)


def test_runs_that_another_one_beats_in_both_are_not_drawn():
    rows = [
        {"error": error, "setup": 0.0, "solve": seconds}
        for error, seconds in ((1e-3, 5.0), (1e-2, 1.0), (2e-2, 2.0), (1e-1, 0.5), (None, 0.1))
    ]
    assert speed_figures.best(rows) == [(1e-3, 5.0), (1e-2, 1.0), (1e-1, 0.5)]


def test_charts_of_the_two_problems_have_the_same_axes():
    for drawing in speed_figures.PLATES.values():
        axis = drawing([]).axes[0]  # nothing was run
        assert axis.get_ylim() == speed_figures.SECONDS and axis.get_xlim() == speed_figures.ERRORS


def test_the_chart_over_sizes_shows_all_that_was_run():
    """Its axes are its own, tighter than those over the errors; names and crosses stand beside marks."""
    rows = facts.records(DATA / "speed_cost.csv")
    (drawing,) = speed_figures.COST_PLATES.values()
    for axis, value in zip(drawing(rows).axes, ("seconds", "megabytes")):
        low, high = axis.get_ylim()
        told = [row[value] for row in rows if row[value] and row[value] >= speed_growth.TOLD[value]]
        assert low <= min(told) and max(told) <= high < 100 * max(told)
    failed = [{**row, "failure": "no memory"} if row is rows[-1] else row for row in rows]
    crosses = [line for line in drawing(failed).axes[0].lines if line.get_marker() == "x"]
    assert crosses and all(line.get_transform() == line.axes.transData for line in crosses)


def test_what_is_asked_for_is_obtained_above_the_floor():
    rows = [
        speed.measure(SCENE, NAMED[name], {"rtol": rtol}, 1)
        for name, rtol in (("half-plane", 1e-3), ("half-plane", 1e-6), ("fitted fe", 1e-2))
    ]
    for row in rows:
        assert row["failure"] is None and speed.BETTER * row["floor"] <= row["error"] < row["rtol"]
        assert row["error"] <= row["estimate"] < row["rtol"] and row["judged"]


def test_condensed_and_monolithic_solve_one_discrete_problem():
    def error(**method):
        return max(SCENE.errors(uniform(SCENE, h=0.4, domain=18.0, **method).found).values())

    condensed = error(solver="condensed")
    # one discretisation: what Newton leaves
    assert condensed == pytest.approx(error(solver="al"), rel=1e-6)
    stiff, soft = (error(solver="penalty", rho=rho) for rho in (1e5, 10.0))
    # penetration falls like 1/rho
    assert stiff == pytest.approx(condensed, rel=0.01) and soft > 1.3 * stiff


def test_failed_runs_are_recorded_and_drawn_as_failed():
    def fails(scene, h):
        raise NotConverged("the active set cycles;\n take a smaller step")

    row = speed.measure(SCENE, Method("AL, order 1", fails, (), ("line",)), {"h": 0.1}, 3)
    assert row["failure"] == "NotConverged: the active set cycles; take a smaller step"
    assert row["error"] is None and row["setup"] is None
    real = speed.measure(SCENE, NAMED["half-plane"], {"rtol": 1e-15}, 1)
    assert real["failure"].startswith("NotConverged") and real["spent"] > 0
    good = speed.measure(SCENE, NAMED["cells"], {"nodes": 128}, 1)
    drawing = speed_figures.law([good, real])
    assert [line.get_marker() for line in drawing.axes[0].lines].count("x") == 1


def test_methods_end_where_the_limit_ends():
    """A level that would be too dear is said to be left out, and costs nothing."""
    calls = []

    def slow(scene, h):
        calls.append(h)
        return Answer(lambda x: (0 * x, 0 * x), 1, 1, 1.0, 1.0)

    class Quiet:
        def update(self, number=1):
            pass

        set_description = update

    parameters = speed.Parameters(limit=1e-9, repeats=1)
    rows = speed.refined(
        SCENE, Method("cells", slow, (), ("line",)), [{"h": 0.2}, {"h": 0.1}], parameters, Quiet()
    )
    assert (
        [row["failure"] is None for row in rows] == [True, False]
        and "--limit" in rows[1]["failure"]
        and set(calls) == {0.2}
    )


def test_best_rho_of_each_mesh_is_marked():
    rows = [
        {
            "scene": "a",
            "method": "penalty",
            "h": h,
            "elements": None,
            "nodes": None,
            "rho": rho,
            "error": error,
            "best": None,
        }
        for h, rho, error in ((0.2, 1, 0.3), (0.2, 2, 0.1), (0.1, 1, None), (0.1, 2, 0.2))
    ]
    assert [row["best"] for row in speed.marked(rows)] == [False, True, False, True]


@pytest.mark.nightly
def test_quick_study(tmp_path, capsys):
    assert (
        main(
            [
                "speed",
                "--quick",
                "--repeats",
                "1",
                "--json",
                str(tmp_path / "a.json"),
                "--out",
                str(tmp_path / "o"),
            ]
        )
        == 0
    )
    assert "seconds to the power" in capsys.readouterr().out
    answer = json.loads((tmp_path / "a.json").read_text())
    rows = answer["runs"]
    assert {row["scene"] for row in rows} == set(speed.QUICK) and not [row for row in rows if row["failure"]]
    # a reference no better than what it verifies would be none
    assert all(row["judged"] and 0 < row["floor"] <= row["error"] / speed.BETTER for row in rows)
    asked = [row for row in rows if row["rtol"]]
    assert len(asked) >= 10 and all(row["error"] < row["rtol"] for row in asked)
    assert {row["method"] for row in answer["cost"]["runs"]} == set(speed_growth.QUICK)
    assert not [row for row in answer["cost"]["runs"] if row["failure"]]
    # every run has its time told apart, and none takes more than all of it
    for row in answer["cost"]["runs"]:
        assert 0 <= sum(row[f"share_{phase}"] for phase in speed_growth.PHASES) <= 1.05
        assert all(
            row[f"share_{phase}"] > 0 for phase in ("mesh", "assembly", "factor", "condensation", "states")
        )
    plates = *speed_figures.PLATES, *speed_figures.COST_PLATES
    names = {f"speed_{plate}.{kind}" for plate in plates for kind in ("png", "pdf")}
    assert {path.name for path in (tmp_path / "o").iterdir()} == {*names, "speed.csv", "speed_cost.csv"}
    record = read_records(tmp_path / "o" / "speed.csv")[0]
    assert {"command", "version_ngsolve", "version_machine", "OMP_NUM_THREADS", *speed.SETTINGS} <= set(
        record
    )


def test_classical_limit_is_one():
    scene = SCENES["classical"]
    assert scene.kind == "classical" and scene.solid.beta == pytest.approx(CLASSICAL, rel=1e-6)
