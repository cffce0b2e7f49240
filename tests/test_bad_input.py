"""Bad input gets one clear error that names the argument, the value and what is allowed."""

import math

import numpy as np
import pytest

import microblock as mb
from microblock import meshes
from microblock.errors import LONGEST, shown

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
GROUND, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
LONG = 250      # characters of a message: a line or two on a screen


def body():
    mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    return mb.Body(mesh, SOLID, order=1, fixed="bottom")


# of each kind of scene: how it is made, and what it may stand on
SCENES = {"Contact": (mb.Contact, GROUND, "mb.HalfPlane(solid)?"),
          "GridContact": (lambda *scene: mb.GridContact(*scene, window=(-1, 1)), GROUND, "mb.HalfPlane(solid)?"),
          "FittedContact": (mb.FittedContact, SOLID, "a Cosserat"), "UniformContact": (mb.UniformContact, SOLID, "a Cosserat"),
          "BodyContact": (mb.BodyContact, body(), "a Body")}


def refused(make, name, *words):
    """The message of the BadArgument that this raises."""
    with pytest.raises(mb.BadArgument) as caught:
        make()
    told = str(caught.value)
    assert caught.value.name == name and told.startswith(f"{name} = ") and "\n" not in told and len(told) < LONG, told
    assert all(word in told for word in words), told
    return told


@pytest.mark.parametrize("kind", SCENES)
def test_a_scene_says_which_of_its_parts_is_none(kind):
    make, stand, words = SCENES[kind]
    name = "solid" if stand is SOLID else "body"
    refused(lambda: make(GROUND if stand is SOLID else SOLID, CYLINDER, LAW), name, words)
    refused(lambda: make(stand, LAW, CYLINDER), "obstacle", "Microblock(", "height(x)")
    refused(lambda: make(stand, mb.Cylinder, LAW), "obstacle", "class Cylinder", "an instance")
    refused(lambda: make(stand, CYLINDER, mb.Microblock), "law", "class Microblock", "an instance, mb.Microblock()")
    refused(lambda: make(stand, CYLINDER, CYLINDER), "law", "Cylinder(R=10)", "must be a law")
    refused(lambda: make(stand, math.fabs, LAW), "obstacle", "function fabs", "array of x", "np.vectorize")
    refused(lambda: make(stand, lambda x: 0.0, LAW), "obstacle", "for each x")
    make(stand, lambda x: x**2, LAW)


HELD = ["contact", "bottom|contact", ".*", "bottom|c.*", {"u1": "bottom", "u2": "bottom|contact"}, {"u2": ".*", "psi": "bottom"}]
PRESSED = {"Contact": lambda held, law: mb.Contact(held, CYLINDER, law), "Condensed": lambda held, law: mb.Condensed(held),
           "ContactFacets": lambda held, law: mb.ContactFacets(held, law, CYLINDER)}


@pytest.mark.parametrize("kind", PRESSED)
def test_a_surface_that_cannot_move_is_not_pressed(kind):
    mesh, make = body().mesh, PRESSED[kind]
    for fixed in HELD:
        held = mb.Body(mesh, SOLID, 1, fixed=fixed)
        refused(lambda held=held: make(held, LAW), "boundary", "'contact'", "held in u2", "psi alone")
    down = mb.Body(mesh, SOLID, 1, fixed="bottom", prescribed={"u2": {"contact": -0.01}})
    refused(lambda: make(down, LAW), "prescribed" if kind != "ContactFacets" else "boundary")
    # psi alone, as the microclamped law has it, and u1, which a flat frictionless contact does not feel, may be held
    supports = {"u1": "bottom", "u2": "bottom", "psi": "contact"}
    for fixed in (supports, {**supports, "u1": "bottom|contact"}):
        for law in (LAW, mb.Microclamped()):
            make(mb.Body(mesh, SOLID, 1, fixed=fixed), law)
    if kind == "ContactFacets":
        make(mb.Body(mesh, SOLID, 1, fixed={"u1": "bottom", "u2": "bottom"}, prescribed={"psi": {"contact": 0.01}}), LAW)


def test_microclamped_holds_psi_on_a_surface_named_like_another():
    mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("side"), "contact_side")
    mesh = meshes.ng.Mesh(mesh.ngmesh)
    held = mb.Body(mesh, SOLID, 1, fixed={"u1": "bottom", "u2": "bottom", "psi": "contact_side"})
    assert "contact" in mb.Contact(held, CYLINDER, mb.Microclamped()).at(0.1).nodes.body.fixed["psi"].split("|")


def test_a_periodic_body_is_pressed_by_newton_alone():
    column = mb.Body(meshes.column(1.0, 2), SOLID, 1, fixed={"u1": "middle", "u2": "middle"}, periodic=True)
    refused(lambda: mb.Contact(column, mb.Plane(), LAW), "body", "must not be periodic", "Newton")
    mb.ContactFacets(column, LAW, mb.Plane())


def test_half_plane_and_body_may_not_be_swapped_with_the_obstacle():
    refused(lambda: mb.Contact(CYLINDER, GROUND, LAW), "body", "must be a HalfPlane or a Body")
    refused(lambda: mb.Contact(body(), LAW, CYLINDER), "obstacle")


@pytest.mark.parametrize("kind", ["Contact", "FittedContact", "UniformContact"])
def test_an_obstacle_of_a_half_plane_is_lowest_somewhere(kind):
    make, stand, _ = SCENES[kind]
    refused(lambda: make(stand, lambda x: -x**2, LAW), "obstacle", "function <lambda>", "falls towards x = -inf")
    refused(lambda: make(stand, lambda x: -0.01*x, LAW), "obstacle", "falls towards x = inf")
    refused(lambda: make(stand, lambda x: x*math.nan, LAW), "obstacle", "is nan at x = ")
    refused(lambda: make(stand, lambda x: 10 - np.sqrt(100 - x**2), LAW), "obstacle", "is nan at x = ", "inf where there is no")
    for fine in (lambda x: -np.exp(-x**2), mb.Rough(period=1.0, slope=0.1), mb.Punch(1.0, tilt=0.1), mb.Wave(0.1, 1.0),
                 lambda x: np.where(np.abs(x) < 10, 10 - np.sqrt(np.maximum(100 - x**2, 0)), np.inf)):
        make(stand, fine, LAW)


def test_bounded_scenes_may_have_obstacles_that_fall():
    mb.FittedContact(SOLID, lambda x: -0.01*x, LAW, domain=4.0)
    mb.GridContact(GROUND, lambda x: -0.01*x, LAW, window=(-1, 1))
    mb.BodyContact(body(), lambda x: np.log(x), LAW)      # nothing is known of where the body is


def test_a_circle_is_answered_like_its_parabola():
    def circle(x):
        return np.where(np.abs(x) < 10, 10 - np.sqrt(np.maximum(100 - x**2, 0)), np.inf)

    state, other = (mb.Contact(GROUND, each, LAW).at(1.0) for each in (circle, CYLINDER))
    # (x/R)^2 = 0.0013 at the edge of the contact, a quarter of it in height, and two estimates below 1e-3
    assert state.all_zones[0][0] == pytest.approx(other.all_zones[0][0], rel=3e-3)


def test_profiles_take_numbers():
    refused(lambda: mb.Profile(lambda x: x**2), "x", "function <lambda>", "obstacle as it is")
    refused(lambda: mb.Profile([0, 1]), "z", "2 finite numbers")
    refused(lambda: mb.Profile("ab", [1, 2]), "x", "numbers")
    refused(lambda: mb.Profile(np.arange(1000.0)[::-1], np.zeros(1000)), "x", "1000 entries (999.0, 998.0, 997.0, ...)")


def test_a_level_profile_is_a_flat_punch():
    level, punch = (mb.Contact(GROUND, each, LAW).at(1.0, rtol=1e-6) for each in (mb.Profile([-1, 1], [0, 0]), mb.Punch(1.0)))
    # both to 1e-6, weighted, where zones differ by its square root next to the punch's ends at most
    assert np.ravel(level.all_zones[0]) == pytest.approx(np.ravel(punch.all_zones[0]), abs=1e-6)
    assert level.energy == pytest.approx(punch.energy, rel=1e-5)


@pytest.mark.parametrize("value, words", [
    (1.5, "1.5"), ("one", "'one'"), (np.float64(-1), "-1.0"), ([1, 2], "[1, 2]"), (len, "function len"), (mb.Plane, "class Plane"),
    (np.zeros((9, 2)), "9 entries ([0. 0.], "), (tuple(range(7)), "7 entries (0, 1, 2, ...)"), (None, "None"),
    ("a"*500, " ...")])
def test_values_are_shown_on_a_short_line(value, words):
    told = shown(value)
    assert words.replace("[0. 0.], ", "") in told and "\n" not in told and len(told) <= LONGEST


def test_a_tolerance_out_of_reach_is_answered_with_the_one_that_is_not():
    scene = mb.Contact(GROUND, CYLINDER, LAW)
    with pytest.raises(mb.NotConverged, match="rtol = 1e-15 was not reached .* smallest error estimate was") as caught:
        scene.at(1.0, rtol=1e-15)
    reached = caught.value.reached
    assert 1e-15 < reached < 1e-9      # rounding: 2e-11 here
    assert scene.at(1.0, rtol=3*reached).error_estimate <= 3*reached      # the message gives two digits, and is believed


def test_too_many_blocks_are_told_by_number():
    scene = mb.Contact(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-9)), CYLINDER, LAW)
    with pytest.raises(mb.NotConverged, match=r"some 7e\+08 blocks wide, and up to 2e\+05 are in reach"):      # 2 a_Hz/ell
        scene.at(1.0)


@pytest.mark.parametrize("path", [mb.Contact(GROUND, CYLINDER, LAW).load(0.5), mb.BodyContact(body(), CYLINDER, LAW).load(0.5)],
                         ids=["line", "body"])
def test_paths_end_where_they_end(path):
    for load in (2.0, 0.0, -1.0, math.nan):
        refused(lambda: path.at(load), "load")
    refused(lambda: path.at(0.5000001), "load", "the end of the path, 0.5")
    assert path.at(0.5).load == 0.5
