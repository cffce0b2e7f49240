"""An obstacle that deforms: what refuses it."""

import copy
import pickle

import ngsolve as ng
import numpy as np
import pytest
from netgen.geom2d import unit_square

import microblock as mb

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
ROLLER = mb.Deformable(mb.HalfPlane(SOLID), mb.Cylinder(R=10))


def rigid_only():
    mesh = ng.Mesh(unit_square.GenerateMesh(maxh=0.5))
    block = mb.Body(mesh, SOLID, order=1, fixed="bottom", contact="top")
    yield from ((mb.Block(SOLID, 10.0), method) for method in (mb.Fitted(), mb.Uniform(h=0.1)))
    yield from ((block, method) for method in (mb.Condensed(), mb.Newton()))


@pytest.mark.parametrize("body, method", [*rigid_only()])
def test_what_knows_rigid_obstacles_alone_refuses_one_that_deforms(body, method):
    with pytest.raises(mb.BadArgument, match="deforms"):
        mb.Contact(body, ROLLER, mb.Microblock(), method)


def test_a_half_space_refuses_a_half_plane_as_second_body():
    with pytest.raises(mb.BadArgument):
        mb.Contact(mb.HalfSpace(SOLID), ROLLER, mb.Microblock())


def test_only_a_body_and_a_shape_make_one():
    for body, shape in ((SOLID, mb.Cylinder(R=1)), (mb.HalfPlane(SOLID), ROLLER), (mb.HalfPlane(SOLID), 1.0)):
        with pytest.raises(mb.BadArgument):
            mb.Deformable(body, shape)


def test_heights_and_their_features_are_those_of_the_shape():
    shape = mb.Wedge(slope=0.1)
    both = mb.Deformable(mb.HalfPlane(SOLID), shape)
    assert both.height(np.ones(1)) == shape.height(np.ones(1))
    assert (both.kinks, both.jumps, both.even, both.formulas) == ((0.0,), (0.2,), True, True)
    assert not hasattr(both, "ends") and not hasattr(both, "period") and not hasattr(both, "R")
    assert mb.Deformable(mb.HalfPlane(SOLID), np.cosh).height(np.zeros(1)) == 1
    for again in (copy.deepcopy(both), pickle.loads(pickle.dumps(both))):
        assert again == both
