"""The paper's way beside fitted meshes: the judge, and the command's object."""

import json

import pytest

from cases import hertz, paper_way
from cases.__main__ import main


def test_distance_is_that_of_the_estimate():
    """Two states of the half-plane: the finer one is exact beside the coarser, whose estimate holds."""
    coarse, fine = (hertz.solve(hertz.Parameters(rtol=rtol).resolved())[0] for rtol in (1e-2, 1e-8))
    found = paper_way.between(coarse[0], fine[0])
    assert 1e-6 < found <= coarse[1] and paper_way.between(fine[0], fine[0]) == 0


def test_command_on_a_coarse_mesh(tmp_path):
    words = ["paper_way", "--h", "0.2", "--loads", "0.5", "1", "--json", str(tmp_path/"a.json"), "--out", str(tmp_path)]
    assert main(words) == 0
    answer = json.loads((tmp_path/"a.json").read_text())
    for row in answer["loads"]:
        assert 0.01 < row["error_paper"] < 0.1      # elements of a fifth of the contact: per cents
        assert row["error_asked"] <= row["rtol_asked"] == paper_way.SHARE*row["error_paper"]
    asked = answer["asked"]
    assert asked["worst"] <= 1 and asked["ratio"] == pytest.approx(answer["paper"]["seconds"]/asked["seconds"])
    assert (tmp_path/"paper_way.png").exists()


@pytest.mark.parametrize("words, named", [("--h 0", "--h"), ("--loads 0", "--loads"), ("--alpha -1", "--alpha")])
def test_bad_arguments(words, named, capsys):
    assert main(["paper_way", *words.split()]) == 2
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1 and named in printed.err
