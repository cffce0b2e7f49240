"""Wedge: scaling laws, limits of light and heavy loads, the closed form, cells."""

import json
from dataclasses import replace

import numpy as np
import pytest

from cases.__main__ import main
from cases.common import three_ways
from cases.scenes import wedge

PARAMETERS = wedge.Parameters()


@pytest.mark.parametrize("law", three_ways.LAWS)
@pytest.mark.parametrize("load", [0.1, 2.0, 8.0])
def test_only_load_over_slope_and_block_counts(law, load):
    here, there = wedge.solve(PARAMETERS, law, load)[0], wedge.scaled(PARAMETERS, law, load)
    x = np.linspace(-1.1, 1.1, 300) * here.x[-1]  # not at the kink, where p is infinite
    p, q = (
        np.array([state.pressure_at(scale * x, corner) for corner in here.law.corners])
        for state, scale in ((here, 1.0), (there, wedge.OTHER))
    )
    assert q / wedge.OTHER == pytest.approx(p, rel=1e-6, abs=1e-6 * p.max())  # EDGE_SHARE of rtol


def test_classical_wedge():
    state, _ = wedge.solve(PARAMETERS, "classical", 2.0)
    x = np.linspace(-2.2, 2.2, 4001) + 1e-5
    assert three_ways.difference(state, x, {"C": wedge.reference(2.0)(x)}) < PARAMETERS.rtol


@pytest.mark.parametrize("nu, beta", [(0.3, 1.0), (0.45, 0.2)])
def test_light_loads_leave_each_corner_alone(nu, beta):
    """The other corner's zone, ell away, is felt like load (it tilts the surface by load/ell); so the width
    is off like load^2.
    """
    parameters = wedge.Parameters(nu=nu, beta=beta, rtol=1e-6)
    off = []
    for load in (0.04, 0.02):
        state, _ = wedge.solve(parameters, "microblock", load)
        ((left, right),) = state.zones["A"]
        # under the wedge's edge: corner A is ell/2 left of its block's middle
        assert (left + right) / 2 == pytest.approx(0.5, abs=load / 50)
        off.append((right - left) / 2 / wedge.light(parameters, load) - 1)
    assert abs(off[1]) < 0.3 * abs(off[0]) < 3e-3


def test_heavy_loads_are_classical():
    """The half-width misses the classical one by a share of ell that settles."""
    missed = [
        three_ways.zones_of(wedge.solve(PARAMETERS, "microblock", load)[0])[1][0] - load
        for load in (30.0, 60.0)
    ]
    # 0.193 and 0.201: what is left falls like ell/a
    assert 0.1 < missed[1] < 0.3 and missed[1] == pytest.approx(missed[0], rel=0.08)


def test_zones_merge_at_one_load():
    load, error = wedge.coalescence(PARAMETERS)
    below, above = (
        three_ways.zones_of(wedge.solve(PARAMETERS, "microblock", share * load)[0])[1]
        for share in (0.99, 1.01)
    )
    assert error < 1e-5 * load and below[1] > 0 == above[1]


def test_cells_tend_to_the_panels():
    state, _ = wedge.solve(PARAMETERS, "microblock", 1.0)
    cells = three_ways.on_cells(state, 4000)
    assert three_ways.difference(state, cells.x, cells.pressures) < cells.error_estimate < 0.1


def test_command(tmp_path, capsys):
    words = [
        "wedge",
        "--loads",
        "0.3",
        "--nodes",
        "1000",
        "--rtol-fe",
        "0.1",
        "--json",
        str(tmp_path / "a.json"),
        "--out",
        str(tmp_path),
    ]
    assert main(words) == 0
    states = json.loads((tmp_path / "a.json").read_text())["states"]
    assert "merge at the load 3.843819" in capsys.readouterr().out
    for state in states:
        assert state["difference_fe"] <= 0.1 and state["scaling_error"] < 1e-8
    assert {"wedge.png", "wedge.pdf", "wedge.csv"} <= {path.name for path in tmp_path.iterdir()}


def test_parameters_are_kept_ascending():
    assert replace(PARAMETERS, loads=(2, 1)).loads == (1.0, 2.0)
