"""Texts, to the letter: help that is wrapped, options, calls that are cut, limits that are named."""

from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from microblock import command
from microblock.halfplane.first_zones import first_zones
from microblock.model import summary
from microblock.model.picture import within
from microblock.model.problem import Problem

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)


def test_help_is_wrapped_item_by_item(monkeypatch):
    monkeypatch.setenv("COLUMNS", "32")
    text = "A head of ``x`` that goes on, and on.\n\nlabel  its words, of which some\nare many more\n"
    text += ":of: :math:`y` alone"
    lines = [
        "A head of x that goes on, and",
        "on.",
        "",
        "label  its words, of which",
        "       some are many more",
    ]
    assert command._wrapped(text).split("\n") == [*lines, ":of: y alone"]


def test_options_are_of_the_kind_of_their_hints_or_defaults():
    def solve(load: float, nodes=4, names: tuple[str, ...] = (), window: tuple[float, float] | None = None):
        """Computes.

        load : it
            goes on
        nodes, names : both
        """

    found = command.options(solve)
    assert [(one.name, one.kind, one.many, one.text) for one in found] == [
        ("load", float, False, "it goes on"), ("nodes", int, False, "both"), ("names", str, "+", "both"),
        ("window", float, 2, ""),
    ]  # fmt: skip
    assert found[1].value("7") == 7 and found[3].value(["1", "2"]) == (1.0, 2.0)


def test_words_are_cut_where_they_are_long():
    law, samples = mb.Microblock(0.0123456), mb.Obstacle.from_samples([0, 1, 2], [0, 1, 2])
    assert summary.call(law) == "Microblock(psi0=0.01235)"
    assert summary.call(mb.Microblock(0.1, psi0_in="levers")) == "Microblock(psi0=0.1, psi0_in='levers')"
    assert summary.call(samples) == "Samples(x=3 numbers, z=3 numbers)"
    assert summary.call(samples, 20) == "Samples(x=3 numb...)" and summary.short("x" * 99, 9) == "'xxxxx..."
    assert summary.call(samples, 33) == summary.call(samples) and summary.short("x" * 7, 9) == "'xxxxxxx'"
    elastic = mb.Elastic(100, 0.3).summary()
    assert (elastic.title, elastic.brief, len(elastic.rows)) == ("Elastic solid", "E 100, nu 0.3", 2)
    assert repr(mb.Elastic(100, 0.3)) == "Elastic(E=100.0, nu=0.3)"


def test_samples_are_equal_where_their_numbers_are():
    one, same, other = (mb.Obstacle.from_samples([0, 1], [0, z]) for z in (1, 1.0, 2))
    assert one == same and hash(one) == hash(same) and one != other and one != "x"


@pytest.mark.parametrize("law, most", [(mb.Unilateral(), 41), (mb.Microblock(), 20)])
def test_no_more_first_cells_are_made_than_a_dense_matrix_may_have(law, most):
    """48 to a stretch, 2000 for all corners."""
    problem = Problem(SOLID, law, lambda x: 0.01 * np.sin(np.pi * x) ** 2)

    def zones(count):
        stretches = tuple((place - 0.1, place + 0.1) for place in range(count))
        return first_zones(replace(problem, picture=within(problem, 0.1, stretches, 0.1, 0.01)), 0.1)

    with pytest.raises(mb.NotConverged, match="^more than 2000 cells"):
        next(zones(most + 1))
