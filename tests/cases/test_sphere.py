"""The sphere beside the closed forms of small and of large blocks, and what its command returns."""

import json
import math

import pytest

from cases import sphere
from cases.__main__ import main

KEYS = (
    "load pressure_centre pressure_max radius radius_x radius_diagonal approach closed iterations residual "
    "error_estimate profile"
)


def test_larger_blocks_are_stiffer_under_every_law_and_less_hard_under_microblocks_alone():
    result = sphere.solve(alphas=(0.3, 3.0, 6.0), cells=64)
    for contact, states in result["sizes"].items():
        small, large, largest = (state.approach / sphere.a_Hz**2 for state in states)
        end, hardness = sphere.large_blocks(states[0].problem.solid, contact)
        # contacts of corners, ell apart, push each other down like 1/ell
        assert 1 > small > large > largest > end and largest - end < 0.65 * (large - end)
        # steps of the rim: a cell is 0.04 of the radius
        area = states[-1].contact_area / (math.pi * sphere.a_Hz**2)
        assert states[-1].load / area == pytest.approx(hardness, rel=0.06)
        assert (hardness < 1) == (contact == "microblock")


def test_the_command_returns_what_other_programs_rely_on(capsys):
    words = ["sphere", "--cells", "32", "--loads", "0.5", "1", "--json", "-"]
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    state = answer["states"][1]
    assert state.keys() >= set(KEYS.split()) and [one["load"] for one in answer["states"]] == [0.5, 1.0]
    for cut in state["profile"].values():
        assert cut.keys() == {"x1", "pressure", "m1", "m2", "psi1", "psi2"} and len(cut["x1"]) == 32
    # all of the area is that with one to four corners closed
    assert sum(state["closed"]) == pytest.approx(state["radius"] ** 2, rel=1e-9)
    assert main([*words, "--rtol", "0.1"]) == 2 and "--rtol" in capsys.readouterr().err
