"""Results as plain data: the attributes by their names, whatever body and method, and JSON without NaN."""

import json
import math

import numpy as np
import pytest

import microblock as mb
from microblock.fem import meshes3d
from microblock.model.plain_data import plain_data

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
HALF, CYLINDER = mb.HalfPlane(SOLID), mb.Cylinder(R=10)
TABLE = "x", "weight", "pressure", "pressure_A", "pressure_B", "micromoment", "psi"
SPACE = ("x1", "x2", "weights", "pressure", "pressures", "micromoment", "psi", "displacement", "closed")


def on_line(law, method=None, obstacle=CYLINDER):
    return mb.Contact(HALF, obstacle, law, method).solve(load=1.0)


def on_a_block():
    return mb.Contact(mb.Block(SOLID, 8.0), CYLINDER, mb.Microblock()).solve(load=1.0, rtol=1e-2)


def in_space():
    problem = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=1), mb.Microblock(), mb.Cells(nodes=32))
    return problem.solve(load=0.01)


def on_a_body():
    mesh = meshes3d.block(*([np.linspace(0, 1, 4)] * 2), np.linspace(-1, 0, 4), reach=0.9)
    body = mb.Body3D(mesh, SOLID, 1, fixed=meshes3d.supports("bottom", x1="left", x2="front"))
    return mb.Contact(body, mb.Sphere(R=1), mb.Unilateral()).solve(load=1.0)


def sheared():
    problem = mb.Contact(HALF, CYLINDER, mb.Unilateral(friction=0.3))
    return problem.history([(1.0, 0.0), (1.0, 0.15)], rtol=0.1)


def through_json(result):
    data = result.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data  # digit by digit, and no tuples
    return data


def same(data, values):
    """Whether a list has the values of an array."""
    return np.array_equal(np.array(data, float), np.asarray(values, float))


@pytest.mark.parametrize(
    "state",
    [
        lambda: on_line(mb.Microblock()),
        lambda: on_line(mb.Microblock(), mb.Cells(nodes=512)),
        lambda: on_line(mb.Microclamped(), obstacle=mb.Punch(0.5)),
        on_a_block,
        lambda: sheared().states[-1],
    ],
    ids=["panels", "cells", "punch", "block", "friction"],
)
def test_a_state_of_the_plane_is_its_attributes(state):
    state = state()
    data = through_json(state)
    friction = ("shear_traction", "slip") if isinstance(state, mb.FrictionState) else ()
    for name in ("x", "weights", "pressure", "micromoment", "psi", *friction):
        assert same(data[name], getattr(state, name)), name
    for name in ("load", "approach", "half_width", "energy", "residual", "iterations", "unknowns", "method"):
        assert data[name] == getattr(state, name), name
    assert (
        data["pressures"].keys() == state.pressures.keys() and data["error_estimate"] == state.error_estimate
    )
    for name, zones in state.zones.items():
        assert data["zones"][name] == [list(pair) for pair in zones]
    profile = data["profile"]
    assert tuple(profile) == TABLE + (("shear", "slip") if friction else ())
    assert np.dot(profile["weight"], profile["pressure"]) == pytest.approx(state.load, rel=1e-9)  # rounding
    renamed = {"weight": "weights", "shear": "shear_traction"}
    for name in set(profile) - {"pressure_A", "pressure_B"}:
        assert profile[name] == data[renamed.get(name, name)], name
    for corner in "AB":
        column, pressure = profile[f"pressure_{corner}"], dict(state.pressures).get(corner)
        assert column is None if pressure is None else same(column, pressure)
    assert np.all(np.diff(profile["x"]) > 0) and profile["x"][0] < 0 < profile["x"][-1]


@pytest.mark.parametrize("state", [in_space, on_a_body])
def test_a_state_in_space_is_its_attributes(state):
    state = state()
    data = through_json(state)
    for name in SPACE:
        values = getattr(state, name)
        assert (
            all(same(data[name][key], values[key]) for key in values)
            if name == "pressures"
            else same(data[name], values)
        ), name
    if state.method == "cells":
        assert same(data["profile"]["diagonal"]["m1"], state.along("diagonal")["m1"])
    else:
        assert np.shape(data["points"]) == (len(data["weights"]), 3)


def test_histories_and_paths_list_their_states_and_events():
    history = sheared()
    data = through_json(history)
    assert [state["shear"] for state in data["states"]] == [0.0, 0.15]
    assert [event["kind"] for event in data["events"]] == [event.kind for event in history.events]
    path = mb.Contact(HALF, CYLINDER, mb.Microblock()).path(load=1.0)
    data = through_json(path)
    assert [event["load"] for event in data["events"]] == [event.load for event in path.events]
    assert data["last"] == 1.0 and data["rtol"] == path.rtol


def test_numbers_that_do_not_exist_are_none():
    values = {"a": np.array([1.5, np.nan]), 2: (np.inf, np.float64("nan"), np.int64(3), True, None, "word")}
    assert plain_data(values) == {"a": [1.5, None], "2": [None, None, 3, True, None, "word"]}
    assert type(plain_data(np.array([1.5, np.nan]))[0]) is float and type(plain_data(np.bool_(True))) is bool


@pytest.mark.parametrize("R, P", [(10.0, 1.0), (0.3, 7.0)])
def test_scales_are_those_of_the_classical_contact(R, P):
    """Half-width and pressure in the middle of a contact whose blocks are small against it."""
    solid = mb.Cosserat(E=100, nu=0.3, beta=1e-10, ell=1e-3)
    a_Hz, p_Hz = mb.hertz_scales(solid, R, P)
    state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R), mb.Unilateral()).solve(load=P, rtol=1e-8)
    # the coupling 1e-10 and rtol
    assert (state.half_width, state.pressure_at(0.0)) == pytest.approx((a_Hz, p_Hz), rel=1e-7)
    assert math.pi / 2 * a_Hz * p_Hz == pytest.approx(P, rel=1e-15)
