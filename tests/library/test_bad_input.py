"""Bad input gets one clear error that names the argument, the value and what is allowed."""

import numpy as np
import pytest

import microblock as mb
from microblock.errors import LONGEST, shown
from microblock.fem import meshes

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
GROUND, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()


def test_microclamped_constrains_psi_on_a_surface_named_like_another():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("side"), "contact_side")
    mesh = meshes.ng.Mesh(mesh.ngmesh)
    beside = mb.Body(mesh, SOLID, 1, fixed={"u1": "bottom", "u2": "bottom", "psi": "contact_side"})
    state = mb.Contact(beside, CYLINDER, mb.Microclamped()).solve(load=0.1)
    assert "contact" in state.solution.nodes.body.fixed["psi"].split("|")


def circle(x):
    return np.where(np.abs(x) < 10, 10 - np.sqrt(np.maximum(100 - x**2, 0)), np.inf)


def test_a_circle_is_answered_like_its_parabola():
    state, other = (mb.Contact(GROUND, each, LAW).solve(load=1.0) for each in (circle, CYLINDER))
    # (x/R)^2 = 0.0013 at the edge of the contact, a quarter of it in height, and two estimates below 1e-3
    assert state.zones["A"][0] == pytest.approx(other.zones["A"][0], rel=3e-3)


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
