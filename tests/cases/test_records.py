"""What cases give back and leave in their folder."""

import time
from dataclasses import dataclass

from matplotlib.figure import Figure

from cases.common.records import keep, returned


@dataclass(frozen=True)
class Parameters:
    load: float = 1.0
    loads: tuple = (0.5, 1.0)


def test_returned_object_is_the_contract():
    # an answer may be called like an argument
    answer = returned(Parameters(), time.perf_counter(), 2.0, states=[1], setup=3)
    assert answer["parameters"] == {"load": 1.0, "loads": [0.5, 1.0]} and "ngsolve" in answer["versions"]
    # what the call itself takes, by far
    assert answer["seconds"]["setup"] == 2.0 and 0 <= answer["seconds"]["solve"] < 60
    assert answer["states"] == [1] and answer["setup"] == 3


def test_figures_are_drawn_from_what_the_file_says(tmp_path):
    drawn = []

    def figure(records):
        drawn.extend(records)
        return Figure(figsize=(1, 1))

    keep(tmp_path, "one", [{"x": 0.1 + 0.2, "law": None}], figure)
    assert drawn[0]["x"] == 0.1 + 0.2 and drawn[0]["law"] is None and drawn[0]["version_ngsolve"]
    assert {path.name for path in tmp_path.iterdir()} == {"one.csv", "one.png", "one.pdf"}
