"""Rough psi0(x) under a cylinder: cells against panels, against four times as many, against another solver;
scatter over seeds.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from cases.scenes import scatter
from microblock.corners import active_set

PARAMETERS = scatter.Parameters()


def test_aligned_blocks_meet_the_panels():
    found = scatter.aligned(PARAMETERS)
    # the difference is that at the centres of cells, the estimate of what is read between them as well
    assert found["difference"] < found["estimate"] < 3e-3
    # a cell
    assert found["half_width"] == pytest.approx(
        found["half_width_panels"], abs=2 * scatter.WINDOW / PARAMETERS.nodes
    )


@pytest.mark.parametrize("amplitude", [0.1, 0.5])
def test_error_estimate_holds_on_rough_blocks(amplitude):
    for seed in (3, 4):
        state = scatter.solve(PARAMETERS, amplitude, seed)
        found = scatter.verified(PARAMETERS, amplitude, seed, state)
        assert found["difference"] < state.error_estimate < 0.025


def test_another_solver_finds_the_same_state():
    """Block pivoting on the dense matrix of the same cells, with the gaps of the law at their centres."""
    parameters = scatter.Parameters(nodes=256, shortest=2.0)
    state = scatter.solve(parameters, 0.5, 7)
    here = parameters.problem(0.5, 7)
    flexibility, gaps, share = here.body.compliance(state.x).corner_system(here.law, here.obstacle)
    found = active_set.solve(flexibility, gaps, load=scatter.LOAD, c=share)
    pressures = np.array(list(state.pressures.values()))
    # cells to a residual of 1e-9, their pressures to some ten times that
    assert found.forces.reshape(2, -1) == pytest.approx(
        pressures * state.weights, rel=0, abs=3e-8 * found.forces.max()
    )


def test_roughness_takes_contact_away_and_scatters():
    answer = scatter.result(scatter.Parameters(amplitudes=(0.1, 0.5), seeds=6, nodes=1024))
    smooth, rough = answer["summary"]
    # six seeds: differences of many standard errors
    assert rough["contact"] < smooth["contact"] - 5 * (rough["contact_se"] + smooth["contact_se"])
    assert rough["zones"] > 2 * smooth["zones"]
    assert rough["hardness_real_sd"] > 2 * smooth["hardness_real_sd"] > 0
    assert len(answer["states"]) == 12 and len({row["hardness_real"] for row in answer["states"]}) > 8
    again = scatter.result(scatter.Parameters(amplitudes=(0.1, 0.5), seeds=6, nodes=1024))
    assert again["summary"] == answer["summary"]  # seeds say all


def test_mirrored_psi0_gives_the_mirror_image():
    here = PARAMETERS.problem(0.3, 5)
    here = here.with_(method=replace(here.method, nodes=512))
    mirrored = here.with_(law=mb.Microblock(lambda x: -here.law.psi0(-x)))
    state, other = (one.solve(load=scatter.LOAD) for one in (here, mirrored))
    for corner, opposite in ("AB", "BA"):  # residuals of 1e-9, pressures of order 1
        assert other.pressures[opposite][::-1] == pytest.approx(state.pressures[corner], rel=0, abs=1e-7)


def test_command(tmp_path, capsys):
    words = [
        "scatter",
        "--amplitudes",
        "0",
        "0.3",
        "--seeds",
        "2",
        "--nodes",
        "640",
        "--json",
        str(tmp_path / "a.json"),
        "--out",
        str(tmp_path),
    ]
    assert main(words) == 0
    assert len(json.loads((tmp_path / "a.json").read_text())["states"]) == 3
    assert "panels" in capsys.readouterr().out
    assert {"scatter.png", "scatter.pdf", "scatter.csv"} <= {path.name for path in tmp_path.iterdir()}
    assert np.isfinite(json.loads((tmp_path / "a.json").read_text())["aligned"]["difference"])
