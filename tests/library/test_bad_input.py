"""Bad input gets one clear error that names the argument, the value and what is allowed."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import microblock as mb
from microblock.errors import LONGEST, shown
from microblock.fem import meshes
from microblock.fem.condensation import Condensed
from microblock.fem.facets import ContactFacets

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
GROUND, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
LONG = 250  # characters of a message: a line or two on a screen


def body():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    return mb.Body(mesh, SOLID, order=1, fixed="bottom")


# of each method: a body on which it solves
PROBLEMS = {
    "panels": (GROUND, mb.Panels()),
    "cells": (GROUND, mb.Cells(window=(-1, 1))),
    "fitted": (mb.Block(SOLID), mb.Fitted()),
    "uniform": (mb.Block(SOLID), mb.Uniform(h=0.1)),
    "condensed": (body(), mb.Condensed()),
    "newton": (body(), mb.Newton()),
}


def refused(make, name, *words):
    """The message of the BadArgument that this raises."""
    with pytest.raises(mb.BadArgument) as caught:
        make()
    told = str(caught.value)
    assert caught.value.name == name and told.startswith(f"{name} = "), told
    assert "\n" not in told and len(told) < LONG, told
    assert all(word in told for word in words), told
    return told


def made(kind, obstacle, law=LAW):
    stand, method = PROBLEMS[kind]
    return mb.Contact(stand, obstacle, law, method)


@pytest.mark.parametrize("kind", PROBLEMS)
def test_a_problem_says_which_of_its_parts_is_none(kind):
    stand, method = PROBLEMS[kind]
    for wrong in (SOLID, CYLINDER, mb.HalfPlane):
        refused(lambda wrong=wrong: mb.Contact(wrong, CYLINDER, LAW, method), "body", "mb.HalfPlane(solid)?")
    refused(lambda: made(kind, LAW, CYLINDER), "obstacle", "Microblock(", "height(x)")
    refused(lambda: made(kind, mb.Cylinder), "obstacle", "class Cylinder", "an instance")
    refused(
        lambda: made(kind, CYLINDER, mb.Microblock), "law", "class Microblock", "an instance, mb.Microblock()"
    )
    refused(lambda: made(kind, CYLINDER, CYLINDER), "law", "Cylinder(R=10)", "must be a law")
    refused(lambda: made(kind, math.fabs), "obstacle", "function fabs", "array of x", "np.vectorize")
    refused(lambda: made(kind, lambda x: 0.0), "obstacle", "for each x")
    other = mb.Panels() if stand is not GROUND else mb.Fitted()
    refused(lambda: mb.Contact(stand, CYLINDER, LAW, other), "method", type(method).__name__)
    made(kind, lambda x: x**2)


@pytest.mark.parametrize(
    "make",
    [mb.HalfPlane, mb.Block, lambda solid: mb.Body(body().mesh, solid)],
    ids=["HalfPlane", "Block", "Body"],
)
def test_a_body_is_made_of_a_solid(make):
    refused(lambda: make(GROUND), "solid", "a Cosserat")


FIXED = [
    "contact",
    "bottom|contact",
    ".*",
    "bottom|c.*",
    {"u1": "bottom", "u2": "bottom|contact"},
    {"u2": ".*", "psi": "bottom"},
]
PRESSED = {
    "Contact": lambda fixed, law: mb.Contact(fixed, CYLINDER, law),
    "Newton": lambda fixed, law: mb.Contact(fixed, CYLINDER, law, mb.Newton()),
    "Condensed": lambda fixed, law: Condensed(fixed),
    "ContactFacets": lambda fixed, law: ContactFacets(fixed, law, CYLINDER),
}


@pytest.mark.parametrize("kind", PRESSED)
def test_a_surface_that_cannot_move_is_not_pressed(kind):
    mesh, make = body().mesh, PRESSED[kind]
    for fixed in FIXED:
        constrained = mb.Body(mesh, SOLID, 1, fixed=fixed)
        refused(
            lambda each=constrained: make(each, LAW),
            "boundary",
            "'contact'",
            "constrained in u2",
            "psi alone",
        )
    down = mb.Body(mesh, SOLID, 1, fixed="bottom", prescribed={"u2": {"contact": -0.01}})
    refused(lambda: make(down, LAW), "prescribed" if kind in ("Contact", "Condensed") else "boundary")
    # psi alone, as the microclamped law has it, and u1, which a flat frictionless contact does not feel,
    # may be
    supports = {"u1": "bottom", "u2": "bottom", "psi": "contact"}
    for fixed in (supports, {**supports, "u1": "bottom|contact"}):
        for law in (LAW, mb.Microclamped()):
            make(mb.Body(mesh, SOLID, 1, fixed=fixed), law)
    if kind == "ContactFacets":
        below = {"u1": "bottom", "u2": "bottom"}
        make(mb.Body(mesh, SOLID, 1, fixed=below, prescribed={"psi": {"contact": 0.01}}), LAW)


def test_microclamped_constrains_psi_on_a_surface_named_like_another():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("side"), "contact_side")
    mesh = meshes.ng.Mesh(mesh.ngmesh)
    beside = mb.Body(mesh, SOLID, 1, fixed={"u1": "bottom", "u2": "bottom", "psi": "contact_side"})
    state = mb.Contact(beside, CYLINDER, mb.Microclamped()).solve(load=0.1)
    assert "contact" in state.solution.nodes.body.fixed["psi"].split("|")


def test_a_periodic_body_is_pressed_by_newton_alone():
    column = mb.Body(meshes.column(1.0, 2), SOLID, 1, fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    refused(lambda: mb.Contact(column, mb.Plane(), LAW, mb.Condensed()), "method", "Newton")
    refused(lambda: Condensed(column), "body", "must not be periodic", "Newton")
    ContactFacets(column, LAW, mb.Plane())
    assert isinstance(mb.Contact(column, mb.Plane(), LAW).solver.options, mb.Newton)


def test_half_plane_and_body_may_not_be_swapped_with_the_obstacle():
    refused(
        lambda: mb.Contact(CYLINDER, GROUND, LAW),
        "body",
        "must be a HalfPlane, a HalfSpace, a Block or a Body",
    )
    refused(lambda: mb.Contact(body(), LAW, CYLINDER), "obstacle")


def circle(x):
    return np.where(np.abs(x) < 10, 10 - np.sqrt(np.maximum(100 - x**2, 0)), np.inf)


@pytest.mark.parametrize("kind", ["panels", "fitted", "uniform"])
def test_an_obstacle_of_a_half_plane_is_lowest_somewhere(kind):
    refused(lambda: made(kind, lambda x: -(x**2)), "obstacle", "function <lambda>", "falls towards x = -inf")
    refused(lambda: made(kind, lambda x: -0.01 * x), "obstacle", "falls towards x = inf")
    refused(lambda: made(kind, lambda x: x * math.nan), "obstacle", "is nan at x = ")
    refused(
        lambda: made(kind, lambda x: 10 - np.sqrt(100 - x**2)),
        "obstacle",
        "is nan at x = ",
        "inf where there is no",
    )
    for fine in (
        lambda x: -np.exp(-(x**2)),
        mb.Rough(period=1.0, slope=0.1),
        mb.Punch(1.0, tilt=0.1),
        mb.Wave(0.1, 1.0),
        circle,
    ):
        made(kind, fine)


def test_bounded_problems_may_have_obstacles_that_fall():
    mb.Contact(mb.Block(SOLID, 4.0), lambda x: -0.01 * x, LAW)
    mb.Contact(GROUND, lambda x: -0.01 * x, LAW, mb.Cells(window=(-1, 1)))
    mb.Contact(body(), lambda x: np.log(x), LAW)  # nothing is known of where the body is


def test_a_circle_is_answered_like_its_parabola():
    state, other = (mb.Contact(GROUND, each, LAW).solve(load=1.0) for each in (circle, CYLINDER))
    # (x/R)^2 = 0.0013 at the edge of the contact, a quarter of it in height, and two estimates below 1e-3
    assert state.zones["A"][0] == pytest.approx(other.zones["A"][0], rel=3e-3)


def test_samples_are_numbers():
    refused(
        lambda: mb.Obstacle.from_samples(lambda x: x**2, [0, 1]),
        "x",
        "function <lambda>",
        "obstacle as it is",
    )
    refused(lambda: mb.Obstacle.from_samples([0, 1], None), "z", "finite number")
    refused(lambda: mb.Obstacle.from_samples([0, 1], [2]), "z", "2 finite numbers")
    refused(lambda: mb.Obstacle.from_samples([0, 1], CubicSpline([0, 1], [0, 1])), "z", "obstacle as it is")
    refused(lambda: mb.Obstacle.from_samples("ab", [1, 2]), "x", "numbers")
    refused(
        lambda: mb.Obstacle.from_samples(np.arange(1000.0)[::-1], np.zeros(1000)),
        "x",
        "1000 entries (999.0, 998.0, 997.0, ...)",
    )


def test_level_samples_are_a_flat_punch():
    level, punch = (
        mb.Contact(GROUND, each, LAW).solve(load=1.0, rtol=1e-6)
        for each in (mb.Obstacle.from_samples([-1, 1], [0, 0]), mb.Punch(1.0))
    )
    # both to 1e-6, weighted, where zones differ by its square root next to the punch's ends at most
    assert np.ravel(level.zones["A"]) == pytest.approx(np.ravel(punch.zones["A"]), abs=1e-6)
    assert level.energy == pytest.approx(punch.energy, rel=1e-5)


@pytest.mark.parametrize(
    "value, words",
    [
        (1.5, "1.5"),
        ("one", "'one'"),
        (np.float64(-1), "-1.0"),
        ([1, 2], "[1, 2]"),
        (len, "function len"),
        (mb.Plane, "class Plane"),
        (np.zeros((9, 2)), "9 entries ([0. 0.], "),
        (tuple(range(7)), "7 entries (0, 1, 2, ...)"),
        (None, "None"),
        ("a" * 500, " ..."),
    ],
)
def test_values_are_shown_on_a_short_line(value, words):
    told = shown(value)
    assert words.replace("[0. 0.], ", "") in told and "\n" not in told and len(told) <= LONGEST


def test_a_tolerance_out_of_reach_is_answered_with_the_one_that_is_not():
    problem = mb.Contact(GROUND, CYLINDER, LAW)
    words = "rtol = 1e-15 was not reached.* smallest error estimate was"
    with pytest.raises(mb.NotConverged, match=words) as caught:
        problem.solve(load=1.0, rtol=1e-15)
    reached = caught.value.rtol_reached
    assert 1e-15 < reached < 1e-9 and caught.value.reached == 1.0  # rounding: 2e-11 here; and the load
    assert f"rtol={reached:.1e}" in str(caught.value)
    # the edges stop at a share of what is asked for, so that the same estimate comes out up to rounding
    assert problem.solve(load=1.0, rtol=reached).error_estimate <= reached


def test_too_many_blocks_are_told_by_number():
    problem = mb.Contact(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-9)), CYLINDER, LAW)
    words = r"some 7e\+08 blocks wide, and up to 2e\+05 are in reach"  # 2 a_Hz/ell
    with pytest.raises(mb.NotConverged, match=words):
        problem.solve(load=1.0)


@pytest.mark.parametrize(
    "path",
    [
        mb.Contact(GROUND, CYLINDER, LAW).path(load=0.5),
        mb.Contact(mb.Block(SOLID, 10.0), CYLINDER, LAW).path(load=0.5, rtol=1e-2),
        mb.Contact(body(), CYLINDER, LAW).path(load=0.5),
    ],
    ids=["panels", "fitted", "body"],
)
def test_paths_end_where_they_end(path):
    for load in (2.0, 0.0, -1.0, math.nan):
        refused(lambda: path.at(load), "load")
    refused(lambda: path.at(0.5000001), "load", "the end of the path, 0.5")
    assert path.at(0.5).load == 0.5
