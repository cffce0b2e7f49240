"""The case sphere: what its command returns, Hertz beside it, and its picture."""

import json

import pytest

from cases.__main__ import main
from cases.scenes import sphere

KEYS = {
    "load",
    "pressure_centre",
    "pressure_max",
    "radius",
    "radius_x",
    "radius_diagonal",
    "approach",
    "closed",
    "iterations",
    "residual",
    "error_estimate",
    "profile",
}


def test_the_command_returns_what_other_programs_rely_on(capsys):
    assert main(["sphere", "--cells", "32", "--loads", "0.5", "1", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [state["load"] for state in answer["states"]] == pytest.approx([0.5, 1.0])
    state = answer["states"][1]
    assert state.keys() >= KEYS and len(state["closed"]) == 4
    for cut in (state["profile"]["axis"], state["profile"]["diagonal"]):
        assert {len(values) for values in cut.values()} == {32}
        assert cut.keys() == {"x1", "pressure", "m1", "m2", "psi1", "psi2"}
    # all of the area is that with one to four corners closed
    assert sum(state["closed"]) == pytest.approx(state["radius"] ** 2, rel=1e-9)


def test_hertz_for_small_blocks():
    parameters = sphere.Parameters(alpha=1e-3, contact="unilateral", cells=128)
    (state,) = sphere.result(parameters)["states"]
    exact = sphere.reference(parameters, 1.0)
    # steps of the rim: a cell is 0.02
    assert state["radius"] == pytest.approx(exact["radius"], rel=1e-2)
    assert state["approach"] == pytest.approx(exact["approach"], rel=2e-3)
    assert state["pressure_max"] == pytest.approx(exact["pressure_max"], rel=2e-3)


@pytest.mark.parametrize("second", ["same", "0.5 0.2", "3 0.4 1.2 0.001"])
def test_hertz_for_small_blocks_with_the_moduli_of_both_bodies(second):
    parameters = sphere.Parameters(
        alpha=1e-3, contact="unilateral", cells=64, second=tuple(second.split()), loads=(1.0, 0.5)
    )
    for state, load in zip(sphere.result(parameters)["states"], parameters.loads):
        exact = sphere.reference(parameters, load)
        # steps of the rim: a cell is 0.04
        assert state["radius"] == pytest.approx(exact["radius"], rel=2e-2)
        assert state["approach"] == pytest.approx(exact["approach"], rel=2e-3)
        assert state["pressure_max"] == pytest.approx(exact["pressure_max"], rel=3e-3)


def test_blocks_widen_the_contact_and_soften_it():
    """As under the cylinder: beside the unilateral law the contact is wider, its centre less pressed."""
    (blocks,), (alone,) = (
        sphere.result(sphere.Parameters(contact=contact, cells=64))["states"]
        for contact in ("microblock", "unilateral")
    )
    assert blocks["radius"] > 1.05 > 1 > alone["radius"]
    assert blocks["pressure_centre"] < 1 < alone["pressure_centre"]


def test_the_picture_is_drawn_from_its_records(tmp_path):
    parameters = sphere.Parameters(cells=32)
    figure = sphere.figure(sphere.rows(parameters, None))
    figure.savefig(tmp_path / "sphere.png")
    assert (tmp_path / "sphere.png").stat().st_size > 20_000
