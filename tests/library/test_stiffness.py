"""The stiffness of a contact beside closed forms and differences of states."""

import math

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from tests.parts import ELASTIC, SOLID, SPHERE

BLOCKS = mb.Microblock(0.02)
ROUGH = mb.RoughSurface(period=1.0, slope=0.1, waves=(1, 6), seed=2)


def body(dim):
    if dim == 2:
        mesh = MakeStructured2DMesh(nx=30, ny=12, mapping=lambda x, y: (2 * x - 1, y - 1))
    else:
        mesh = MakeStructured3DMesh(nx=8, ny=8, nz=4, mapping=lambda x, y, z: (2 * x - 1, 2 * y - 1, z - 1))
    return mb.Body(mesh, SOLID, 1, fixed="bottom", contact="top")


def cells(nodes):
    return mb.Cells(nodes=nodes)


@pytest.mark.parametrize("bodies", [1, 2])
def test_a_sphere_has_twice_modulus_times_radius(bodies):
    """Hertz: dP/dd = 2 E* a. The sum of 3e3 cells misses the area by .1 %, and its root by half of that."""
    obstacle = SPHERE if bodies == 1 else mb.Deformable(mb.HalfSpace(ELASTIC), SPHERE)
    state = mb.Contact(mb.HalfSpace(ELASTIC), obstacle, mb.Unilateral(), cells(128)).solve(load=1.0)
    modulus = ELASTIC.E / (1 - ELASTIC.nu**2) / bodies
    radius = (3 * state.load * SPHERE.R / (4 * modulus)) ** (1 / 3)
    assert state.stiffness == pytest.approx(2 * modulus * radius, rel=1e-3)


@pytest.mark.parametrize(
    "problem, load, rel",
    [
        # the zones of the discretisation stay as they are, and a difference is the derivative
        (mb.Contact(body(2), mb.Cylinder(R=10), BLOCKS), 0.5, 1e-9),
        (mb.Contact(body(3), SPHERE, BLOCKS), 0.5, 1e-6),
        # cells close and open on the way, each with little of the load
        (mb.Contact(mb.HalfSpace(SOLID), SPHERE, BLOCKS, cells(64)), 1.0, 1e-3),
        (mb.Contact(mb.HalfSpace(SOLID, period=1.0), ROUGH, mb.Microblock(), cells(64)), 1.0, 2e-3),
        (
            mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Wave(0.01, 1.0), mb.Microblock(), cells(512)),
            0.3,
            2e-3,
        ),
        # edges move, and the load of both states is known to 1e-4
        (mb.Contact(mb.Block(SOLID, 2.0), mb.Cylinder(R=10), BLOCKS), 0.5, 1e-3),
    ],
)
def test_stiffness_is_the_slope_of_load_over_approach(problem, load, rel):
    low, state, high = (problem.solve(load=load * factor) for factor in (0.999, 1.0, 1.001))
    slope = (high.load - low.load) / (high.approach - low.approach)
    assert state.stiffness == pytest.approx(slope, rel=rel)


def test_stiffness_where_there_is_none():
    wave = mb.Contact(mb.HalfPlane(SOLID, period=1.0), mb.Wave(0.001, 1.0), mb.Unilateral(), cells(256))
    closed = wave.solve(load=5.0)
    assert len(closed.x) == np.count_nonzero(closed.closed) and closed.stiffness == math.inf
    assert mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=10), BLOCKS).solve(load=1.0).stiffness is None
    assert mb.Contact(body(2), mb.Cylinder(R=10), BLOCKS, mb.Newton()).solve(load=0.5).stiffness is None
