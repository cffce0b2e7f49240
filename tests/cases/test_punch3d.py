"""The case punch3d: what its command returns, the half-space and the classical punch, its picture."""

import json

import numpy as np
import pytest

from cases.__main__ import main
from cases.scenes import punch3d

# at 32 cells corners lie on the rim of the face, and rounding decides which touch
SMALL = ["--facets", "4", "--size", "6", "--cells", "64"]


def test_the_command_returns_a_block_of_two_sizes_and_the_half_space(capsys):
    assert main(["punch3d", *SMALL, "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [state["model"] for state in answer["states"]] == ["half of the size", "block", "half-space"]
    near, block, half = answer["states"]
    assert near["size"] == 3 and block["size"] == 6 and half["size"] is None
    # a small block is stiffer; facets of 1/4 and the finite size leave 8 %
    assert near["approach"] < block["approach"] < half["approach"]
    assert answer["approach_unbounded"] == pytest.approx(half["approach"], rel=0.08)
    inside = np.array(half["profile"]["x1"]) < 0.5
    between = np.interp(
        np.array(half["profile"]["x1"])[inside], block["profile"]["x1"], block["profile"]["pressure"]
    )
    # facets of 1/4 leave 25 % of the pressure, of 1/8 beside 96 cells 14 %
    assert between == pytest.approx(np.array(half["profile"]["pressure"])[inside], rel=0.25)
    assert (
        len(answer["nodes"]["x1"]) == len(answer["nodes"]["closed"]) and max(answer["nodes"]["closed"]) == 4
    )


@pytest.mark.parametrize("face", ["round", "square"])
def test_the_classical_punch_where_blocks_are_small(face):
    parameters = punch3d.Parameters(alpha=0.01, contact="unilateral", face=face, cells=96)
    state = parameters.problem(punch3d.mb.HalfSpace(parameters.solid()), punch3d.mb.Cells(nodes=96))
    # cells cut the round rim into steps
    assert state.solve(load=1.0).approach == pytest.approx(punch3d.reference(parameters), rel=0.01)


def test_the_picture_is_drawn_from_its_records(tmp_path):
    parameters = punch3d.Parameters(facets=4, size=6.0, cells=32)
    rows = punch3d.rows(parameters, punch3d.result(parameters))
    assert {row["kind"] for row in rows} == {"node", "block", "half-space"}
    punch3d.figure(rows).savefig(tmp_path / "punch.png")
    assert (tmp_path / "punch.png").stat().st_size > 20_000
