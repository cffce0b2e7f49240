"""Rough surface in three dimensions: the classical theories, and the order of the laws."""

import math

import pytest

from cases import rough3d


def test_the_classical_surface_touches_as_the_theories_say_and_blocks_more():
    states = rough3d.solve(loads=(0.01, 0.1), cells=128)
    kappa = {name: [rough3d.fraction(one) / one.load for one in solved] for name, solved in states.items()}
    assert all(math.sqrt(8 / math.pi) < one < math.sqrt(2 * math.pi) for one in kappa["classical"])
    # 2.505 and 2.077 on 1024 cells of another program, tamaas
    assert kappa["classical"] == pytest.approx([2.505, 2.077], rel=0.02)
    for blocks, classical, alone in zip(*(kappa[name] for name in rough3d.LAWS)):
        assert blocks > classical > alone
