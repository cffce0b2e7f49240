"""States, obstacles and bodies as values: compared, copied, kept in files and sent to other processes."""

import copy
import pickle

import numpy as np
import pytest

import microblock as mb
from microblock import BadArgument
from microblock.fem import meshes

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)


def body():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    return mb.Body(mesh, SOLID, order=2, fixed="bottom")


PROBLEMS = {
    "panels": lambda: mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), mb.Microblock()),
    "cells": lambda: mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), mb.Microblock(), mb.Cells(nodes=64)),
    "fitted": lambda: mb.Contact(mb.Block(SOLID, 6.0), mb.Cylinder(10.0), mb.Microblock()),
    "condensed": lambda: mb.Contact(body(), mb.Cylinder(10.0), mb.Microblock()),
    "Newton": lambda: mb.Contact(body(), mb.Cylinder(10.0), mb.Microblock(), mb.Newton("al")),
}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("travel", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_states_travel(name, travel):
    """What belongs to NGSolve is made anew, so that all of a state's observables are there."""
    state = PROBLEMS[name]().solve(load=1.0)
    other = travel(state)
    # levers and lengths of the facets are computed anew: rounding of sums in another order
    assert other.pressure == pytest.approx(state.pressure, rel=1e-12, abs=1e-12 * state.pressure.max())
    assert other.zones == state.zones
    if name in ("fitted", "condensed", "Newton"):
        assert other.reaction("bottom").force == pytest.approx(state.reaction("bottom").force, abs=1e-12)
        there = other.fields(0.1, -0.2).stress, state.fields(0.1, -0.2).stress
        assert np.asarray(there[0]) == pytest.approx(
            np.asarray(there[1]), rel=1e-9
        )  # of a field that is small beside others


def test_a_state_that_travelled_is_one_to_start_from():
    problem = PROBLEMS["fitted"]()
    near = pickle.loads(pickle.dumps(problem.solve(load=1.0)))
    assert problem.solve(load=1.1, initial=near).load == pytest.approx(1.1, rel=1e-12)  # a sum of forces


def test_samples_are_those_at_the_time():
    x, z = np.array([-1.0, 0.0, 1.0]), np.array([0.5, 0.0, 0.5])
    samples = mb.Obstacle.from_samples(x, z)
    same = mb.Obstacle.from_samples(x, z)
    assert samples == same and hash(samples) == hash(same) and samples != mb.Obstacle.from_samples(x, 2 * z)
    z[1] = 0.25
    assert samples.height(np.zeros(1)) == 0.0 and samples != "samples"


def test_half_planes_are_equal_by_what_they_are_made_of():
    assert mb.HalfPlane(SOLID) == mb.HalfPlane(SOLID) and len({mb.HalfPlane(SOLID), mb.HalfPlane(SOLID)}) == 1
    assert mb.HalfPlane(SOLID) != mb.HalfPlane(SOLID, period=1.0) and mb.HalfPlane(SOLID) != SOLID


@pytest.mark.parametrize("window", [(1.0, 0.0), (0.0, np.nan), 3.0, "all"])
def test_windows_of_pictures_are_checked(window):
    state = PROBLEMS["cells"]().solve(load=1.0)
    for show in (state.surface, state.plot, state.plot_blocks):
        with pytest.raises(BadArgument, match="window"):
            show(window=window)


def test_true_is_no_order():
    with pytest.raises(BadArgument, match="order"):
        mb.Body(body().mesh, SOLID, order=True, fixed="bottom")


@pytest.mark.parametrize("name", ["fitted", "condensed"])
def test_energy_of_the_fields_is_that_of_the_state(name):
    """Also where half of a symmetric body is computed."""
    state = PROBLEMS[name]().solve(load=1.0)
    # half the work of the corners, beside an integral of the fields: both of the same discrete state
    assert state.fields.energy() == pytest.approx(state.energy, rel=1e-9)
