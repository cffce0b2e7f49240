"""The case tangential: what its command returns, and Cattaneo and Mindlin beside it."""

import json
import math

import pytest

from cases.__main__ import main
from cases.scenes import tangential

KEYS = {
    "normal",
    "shear",
    "stick",
    "slip",
    "half_width",
    "dissipation",
    "energy",
    "work",
    "error_estimate",
    "profile",
}
PROFILE = {"x", "weight", "pressure", "shear", "micromoment", "psi", "slip"}


def test_the_command_returns_what_other_programs_rely_on(capsys):
    loads = ["--normal", "2", "--shear", "0.5", "1", "0"]
    assert main(["tangential", "--alpha", "0.25", *loads, "--rtol", "0.08", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [one["shear"] for one in answer["states"]] == pytest.approx([0.5, 1, 0], abs=1e-9)
    for one in answer["pressed"] + answer["states"]:
        assert one.keys() >= KEYS and one["profile"].keys() >= PROFILE
        assert len({len(values) for values in one["profile"].values()}) == 1
        weights = one["profile"]["weight"]
        total = sum(w * p for w, p in zip(weights, one["profile"]["pressure"]))
        assert total == pytest.approx(2 * math.pi / 2, rel=1e-9)
        sheared = sum(w * q for w, q in zip(weights, one["profile"]["shear"]))
        assert sheared == pytest.approx(one["shear"] * 0.3 * total, abs=1e-8)
        assert one["balance"] < 1e-8 and one["normal"] == pytest.approx(2)
    dissipated = [one["dissipation"] for one in answer["states"]]
    assert dissipated == sorted(dissipated)
    assert not answer["states"][1]["stick"] and answer["pressed"][0]["shear"] == 0
    # pressing drags the surface outwards on both sides: the shear sticks the side where it is against that
    ((left, right),), ((sheared_left, sheared_right),) = (
        one["stick"] for one in (*answer["pressed"], answer["states"][0])
    )
    assert sheared_left < left < sheared_right < right and sheared_right - sheared_left > right - left
    assert "full slip" in [event["kind"] for event in answer["events"]]


@pytest.mark.parametrize("second", ["same", "1 0.3 0 0.01"])
def test_cattaneo_and_mindlin(second, capsys):
    """Also with a second body that is classical: two equal ones to the order of alpha."""
    arguments = f"--alpha 1e-3 --contact unilateral --second {second} --shear 0.5 -0.5 --rtol 0.01".split()
    assert main(["tangential", *arguments, "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    loaded, sheared, back = answer["pressed"] + answer["states"]
    # cells of this rtol: their edges are known to 1e-3
    assert loaded["half_width"] == pytest.approx(1, abs=2e-3)
    for state in (sheared, back):  # after a reversal by 2 * 0.5 the zone is as before: sqrt(1 - 1/2)
        (left, right), *others = state["stick"]
        assert not others and (-left, right) == pytest.approx([math.sqrt(0.5)] * 2, abs=2e-3)


def test_figure_draws_each_state():
    parameters = tangential.Parameters(contact="unilateral", shear=(0.5, 0.0), rtol=0.08)
    records, drawing = tangential.FIGURES["tangential"]
    from cases.common.case import named

    rows = named(tangential, parameters, records(parameters, tangential.result(parameters)))
    figure = drawing(rows)
    assert len(figure.axes[0].lines) == 3 + 2
