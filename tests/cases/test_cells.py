"""Cases on uniform cells: closed forms of the wave, orders of the classical limit, their commands."""

import json

import numpy as np
import pytest

from cases.__main__ import main
from cases.scenes import classical, wavy


def test_classical_orders():
    answer = classical.result(classical.Parameters(nodes=(500, 1000, 4000)))
    last = {row["obstacle"]: row for row in answer["runs"] if row["nodes"] == 4000}
    # root, logarithm, inverse root at a cell
    for obstacle, order in (("cylinder", 1), ("wedge", 0.5), ("punch", 0.25)):
        assert last[obstacle]["order"] == pytest.approx(order, abs=0.03)
    panels = {row["obstacle"]: row for row in answer["runs"] if row["method"] == "panels"}
    assert panels["cylinder"]["error"] < 1e-4 and panels["punch"]["error"] < 1e-4


def test_commands(tmp_path, capsys):
    words = ["wavy", "--nodes", "256", "--loads", "0.5", "1.2"]
    assert main([*words, "--json", str(tmp_path / "a.json"), "--out", str(tmp_path)]) == 0
    assert "closed everywhere" in capsys.readouterr().out
    answer = json.loads((tmp_path / "a.json").read_text())
    assert [state["load"] for state in answer["states"]] == pytest.approx([0.5, 1.2])
    assert main(["rough", "--nodes", "2048", "--out", str(tmp_path)]) == 0
    assert {"wavy.csv", "wavy.png", "rough.csv", "rough.png"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize("contact", wavy.LAWS)
def test_path_from_first_touch_to_full_closure(contact):
    parameters = wavy.Parameters(path=9, path_nodes=1024, contact=contact)
    rows = wavy.path(parameters)
    own, classical = rows[:9], rows[9:]
    for row in classical:
        # a cell at either edge
        assert row["contact_fraction"] == pytest.approx(row["contact_exact"], abs=2 / 1024)
        # the cells' width squared
        assert row["approach"] == pytest.approx(row["approach_exact"], abs=2e-5)
    closure = wavy.closure_of(parameters)
    for row in own:  # all corners that there are
        assert (row["full_contact_fraction"] == 1) == (row["load"] >= closure)
    assert own[0]["contact_fraction"] < 0.05 and own[-1]["load"] > closure > own[0]["load"]
    for name in ("contact_fraction", "approach"):
        assert np.all(np.diff([row[name] for row in own]) >= -1e-12)  # rounding, from full closure on
