"""Laws of the user's: what a method cannot represent it refuses, and the rest agrees with other methods."""

from dataclasses import dataclass

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from microblock.model import obstacles
from microblock.model.law import Law, tangents

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.0851)
HALF, CYLINDER = mb.HalfPlane(SOLID), mb.Cylinder(R=10)


@dataclass(frozen=True)
class Corners(Law):
    """Corners at places s ell from the contact point, on blocks rotated by psi0 in the levers alone."""

    places: tuple
    psi0: float = 0.0
    friction: float = 0.0

    @property
    def corners(self):
        return ("C",) if len(self.places) == 1 else ("A", "B")

    def levers(self, x):
        return {c: np.full(np.shape(x), self.psi0 - 2 * s) for c, s in zip(self.corners, self.places)}

    def initial_gaps(self, points, normals, ell, obstacle):
        at = (points + s * ell * tangents(normals) for s in self.places)
        return {c: obstacles.gap(obstacle, there, normals) for c, there in zip(self.corners, at)}

    def shifts(self, ell):
        return tuple(-s * ell for s in self.places)


def pressed(law, body=HALF, method=None, **how):
    return mb.Contact(body, CYLINDER, law, method).solve(load=1.0, **how)


@pytest.mark.parametrize("law", [Corners((-0.5, 0.5), 0.3), Corners((-0.3, 0.7)), Corners((-0.3, 0.7), 0.2)])
def test_cells_take_the_levers_of_the_law(law):
    """They took those of psi0 = 0, or asked for an attribute `angle`; 1e-2 is what they promise."""
    panels, cells = pressed(law, rtol=1e-4), pressed(law, method=mb.Cells(), rtol=1e-2)
    assert cells.method == "cells" and panels.method == "panels"
    for name in ("pressure", "micromoment"):
        there = np.interp(cells.x, panels.x, getattr(panels, name))
        assert np.abs(getattr(cells, name) - there).max() < 0.05 * np.abs(there).max()  # cells at edges
    assert cells.micromoment.min() == pytest.approx(panels.micromoment.min(), rel=1e-2)


def test_blocks_that_are_rotated_in_the_levers_are_those_of_the_library():
    own, known = (
        pressed(law, method=mb.Cells(256))
        for law in (Corners((-0.5, 0.5), 0.3), mb.Microblock(0.3, "levers"))
    )
    assert np.allclose(own.pressure, known.pressure, rtol=0, atol=1e-9 * known.pressure.max())


REFUSED = {
    "lever of one corner": (Corners((-0.25,)), None, "one corner with a lever"),
    "lever of one corner, cells": (Corners((-0.25,)), mb.Cells(), "one corner with a lever"),
    "distance": (
        type("Far", (Corners,), {"shifts": lambda self, ell: (0.3 * ell, -0.3 * ell)})((-0.5, 0.5)),
        mb.Cells(),
        "differ",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_half_planes_do_not_know_is_refused(name):
    """The lever of one corner was dropped: 1 % of the pressure beside an estimate of 5e-5."""
    law, method, words = REFUSED[name]
    with pytest.raises(mb.BadArgument, match=words):
        pressed(law, method=method, rtol=1e-2)


def test_friction_on_a_half_plane_takes_no_other_levers_than_1_and_minus_1():
    """Those of the law were taken as 1 and -1."""
    problem = mb.Contact(HALF, CYLINDER, Corners((-0.3, 0.7), friction=0.3))
    with pytest.raises(mb.BadArgument, match="levers 1 and -1"):
        problem.history([(1.0, 0.0)])


class Elsewhere(Corners):
    """Levers are others for x beyond a place alone."""

    def levers(self, x):
        return {name: lever + 0.2 * (x > 0.1) for name, lever in super().levers(x).items()}


@pytest.mark.parametrize("places", [(0.0,), (-0.5, 0.5)])
def test_levers_are_looked_at_where_the_contact_is(places):
    """At x = 0 alone both laws are those of the library."""
    problem = mb.Contact(HALF, CYLINDER, Corners(places, friction=0.3))
    assert problem.history([(1.0, 0.0)], rtol=0.1).states[0].load == 1
    with pytest.raises(mb.BadArgument, match="lever"):
        mb.Contact(HALF, CYLINDER, Elsewhere(places, friction=0.3)).history([(1.0, 0.0)], rtol=0.1)


@pytest.mark.parametrize("where", ["half-space", "mesh"])
def test_over_a_surface_only_laws_of_the_library_are_known(where):
    """A law derived from Microblock was solved as Microblock itself."""
    mesh = MakeStructured3DMesh(nx=2, ny=2, nz=2, mapping=lambda x, y, z: (x, y, z - 1))
    body = (
        mb.HalfSpace(SOLID) if where == "half-space" else mb.Body(mesh, SOLID, fixed="bottom", contact="top")
    )
    for law in (type("Mine", (mb.Microblock,), {})(), Corners((-0.25,)), Corners((0.0,))):
        with pytest.raises(mb.BadArgument, match="over a surface"):
            mb.Contact(body, mb.Sphere(2.0), law)


class Broken(Corners):
    def __init__(self, **methods):
        object.__setattr__(self, "places", (-0.5, 0.5))
        for name, result in methods.items():
            object.__setattr__(self, name, lambda *_, result=result: result)


SLIPS = {
    "nothing": ({"levers": None}, "levers must return an array"),
    "a number": ({"levers": {"A": 1.0, "B": -1.0}}, r"at one point shapes are \{'A': \(\)"),
    "NaN": ({"levers": {"A": np.array([np.nan]), "B": np.array([-1.0])}}, "levers must be finite"),
    "complex": ({"levers": {"A": np.array([1j]), "B": np.array([-1.0])}}, "levers must be finite real"),
    "gap": ({"initial_gaps": {"A": np.array([np.nan]), "B": np.zeros(1)}}, "initial_gaps must be finite"),
    "shifts": ({"shifts": (0.1,)}, "shifts must return"),
    "one shift": ({"shifts": 0.1}, "shifts must return"),
    "no shifts": ({"shifts": None}, "shifts must return"),
    "NaN shift": ({"shifts": (0.1, np.nan)}, "shifts must return"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_in_a_law_are_named(slip):
    methods, words = SLIPS[slip]
    with pytest.raises(mb.BadArgument, match=words):
        mb.Contact(HALF, CYLINDER, Broken(**methods))


@pytest.mark.parametrize("names", [("A", "full"), (1, 2), ("A", "A"), ()])
def test_names_of_corners_are_words_of_their_own(names):
    with pytest.raises(mb.BadArgument, match="must name its corners"):
        mb.Contact(HALF, CYLINDER, type("Named", (Corners,), {"corners": names})((-0.5, 0.5)))


def test_what_a_law_lacks_is_named():
    for lacking, there in (("levers", "initial_gaps"), ("initial_gaps", "levers")):
        with pytest.raises(mb.BadArgument, match=f"it has no {lacking}"):
            mb.Contact(HALF, CYLINDER, type("Half", (Law,), {there: getattr(Corners, there)})())


def test_two_corners_with_a_constrained_rotation_are_refused_by_name():
    with pytest.raises(mb.BadArgument, match="2 corners and constrains psi"):
        mb.Contact(HALF, CYLINDER, type("Fixed", (Corners,), {"clamps_rotation": True})((-0.5, 0.5)))


class Unshifted(Corners):
    shifts = Law.shifts


class Mirrored(Corners):
    def shifts(self, ell):
        return tuple(s * ell for s in self.places)


@pytest.mark.parametrize("law", [Unshifted((-0.5, 0.5)), Mirrored((-0.5, 0.5))], ids=str)
def test_shifts_are_those_of_the_gaps_where_they_are_needed(law):
    """A second body gave way at other places than the corners': 15 % of the pressure, without a word."""
    second = mb.Deformable(mb.HalfPlane(SOLID), CYLINDER)
    for obstacle, method in ((second, None), (second, mb.Cells()), (mb.Punch(1.0), None)):
        with pytest.raises(mb.BadArgument, match="must have shifts"):
            mb.Contact(HALF, obstacle, law, method)
    mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, y: (x - 0.5, y - 1))
    mb.Contact(mb.Body(mesh, SOLID, fixed="bottom", contact="top"), CYLINDER, law)  # which needs none
