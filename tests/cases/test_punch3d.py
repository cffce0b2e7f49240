"""Flat punch on a block in three dimensions, beside the half-space and the classical punch."""

import math

import pytest

import microblock as mb


@pytest.mark.parametrize("face, approach", [("round", 0.5), ("square", math.sqrt(math.pi / 4) / 2.024)])
def test_small_blocks_are_the_classical_punch(face, approach):
    """For the square King, Int. J. Solids Struct. 23 (1987) 1657."""
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.01, beta=1)
    problem = mb.Contact(mb.HalfSpace(solid), mb.FlatPunch(1.0, face), mb.Unilateral(), mb.Cells(nodes=96))
    # cells cut the round rim into steps
    assert problem.solve(load=1.0).approach == pytest.approx(approach, rel=0.01)
