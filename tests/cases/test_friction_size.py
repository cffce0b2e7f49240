"""The case friction_size: against finite elements, and what its command returns."""

import json
import math

import pytest

import microblock as mb
from cases.__main__ import main
from cases.common.catalog import DATA
from cases.scenes import friction_size
from microblock.data.records import read_records


def test_a_cycle_dissipates_what_finite_elements_say():
    """Under microblocks: friction on the nodes of squares of a tenth of the contact, which share neither mesh
    nor response with the cells; from squares of 0.2 to 0.1 they change by 1 %, and 3 % are allowed.
    """
    alpha, unit = 0.4, math.pi / 4
    parameters = friction_size.Parameters()
    chosen, states = parameters.history(alpha, "microblock", friction_size.CYCLE, 0.1)
    found, estimate = friction_size._cycle(chosen, states)
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=alpha, beta=1)
    body, law = mb.Block(solid, 20.0), mb.Microblock(friction=0.3)
    problem = mb.Contact(body, mb.Cylinder(R=1.0), law, mb.Uniform(h=0.1))
    _, first, _, last = problem.history([(unit, share * 0.3 * unit) for share in (0, 1, -1, 1)]).states
    assert found["dissipation"] == pytest.approx((last.dissipation - first.dissipation) / unit, rel=0.03)
    assert estimate < 0.1
    rows = read_records(DATA / "friction_dissipation.csv")  # the report draws it: it is of this code
    (kept,) = (
        row for row in rows if (row["kind"], row["contact"], row["alpha"]) == ("size", "microblock", alpha)
    )
    assert found["dissipation"] == pytest.approx(kept["dissipation"], rel=estimate)


def test_the_command_returns_measures_with_errors(tmp_path, capsys):
    words = [
        "friction_size",
        "--alphas",
        "0.8",
        "--contacts",
        "microclamped",
        "--rtol",
        "0.2",
        "--json",
        "-",
        "--out",
    ]
    assert main([*words, str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["contact"] for row in answer["states"]] == ["microclamped"]
    for row in answer["states"]:
        assert row["stick_0.25"] > row["stick_0.5"] > row["stick_0.75"] > 0 and row["dissipation"] > 0
        assert all(row[f"{name}_error"] >= 0 for name in friction_size.MEASURES)
    for name in friction_size.FIGURES:
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
