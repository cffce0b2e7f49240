"""Flat punch on a block in three dimensions, beside the half-space and the classical punch."""

import math

import pytest

import microblock as mb
from cases import punch3d


def test_block_and_half_space_agree():
    near, far = (punch3d.solve(size=size, facets=4, cells=64) for size in (3.0, 6.0))
    block, half_space = far.values()
    # a small block is stiffer; its size counts like 1/size; facets of 1/4 and what follows leave 8 %
    assert near["block"].approach < block.approach < half_space.approach
    assert 2 * block.approach - near["block"].approach == pytest.approx(half_space.approach, rel=0.08)
    # corners of blocks up to half of a block, 0.25, beside the face touch; nodes and cells cut the rim
    assert 4 * block.contact_area == pytest.approx(2.5**2, rel=0.05)
    assert half_space.contact_area == pytest.approx(2.5**2, rel=0.02)


@pytest.mark.parametrize("face, approach", [("round", 0.5), ("square", math.sqrt(math.pi / 4) / 2.024)])
def test_small_blocks_are_the_classical_punch(face, approach):
    """For the square King, Int. J. Solids Struct. 23 (1987) 1657."""
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.01, beta=1)
    problem = mb.Contact(mb.HalfSpace(solid), mb.FlatPunch(1.0, face), mb.Unilateral(), mb.Cells(nodes=96))
    # cells cut the round rim into steps
    assert problem.solve(load=1.0).approach == pytest.approx(approach, rel=0.01)
