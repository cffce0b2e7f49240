"""Frozen contact of two bodies in the plane in the names of the library, beside `tests.frozen.library`."""

from functools import cache

import numpy as np
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb

from . import library, problems
from . import problems_two as given
from .library_mesh import short

estimated = library.estimated
RESIDUAL = 1e-12  # of cells: the digits of a row are not the solver's


@cache
def upper(width=2.6, columns=17):
    """A mesh above x2 = 0, wider than that of the first body, whose nodes are others, or narrower."""
    rows = 6 if columns == 17 else 2
    height = 0.8 if columns == 17 else 1.0
    mapped = lambda x, y: (width * x - width / 2, height * y)  # noqa: E731
    return library.with_contact(MakeStructured2DMesh(nx=columns, ny=rows, mapping=mapped), "bottom")


def second_of(problem):
    solid = mb.Cosserat(**problem["second"])
    if problem["method"] == "body":
        return mb.Body(upper(), solid, 2, fixed="top")
    return mb.HalfPlane(solid, problem.get("period"))


def contact_of(problem):
    rigid = library.contact_of(problem)
    obstacle = mb.Deformable(second_of(problem), rigid.obstacle)
    if problem["method"] == "cells":
        method = mb.Cells(problem["nodes"], problem.get("window"), RESIDUAL)
        return rigid.with_(obstacle=obstacle, method=method)
    return rigid.with_(obstacle=obstacle)


def solve(problem):
    options = {name: problem[name] for name in ("approach", "rtol") if name in problem}
    return contact_of(problem).solve(problem["load"], **options)


def measured(state, problem):
    """{quantity: number} of a state, and how the second body gives way."""
    numbers = short(library.measured(state, problem))
    places = np.array(problem["at"])
    moved = state.counter_displacement(places)
    if problem["method"] == "panels" or (problem["method"] == "cells" and "period" not in problem):
        moved = moved - moved[0]  # the level of a half-plane is arbitrary
    return numbers | {f"counter displacement at {x:g}": u for x, u in zip(places, moved)}


def path_of(problem):
    path = contact_of(problem).path(problem["load"], **library._given(problem, "rtol"))
    return path.events, path.at


def refusals():
    """{what is asked for: a call that must fail}."""
    solid = mb.Cosserat(**problems.SOLID)
    cylinder = mb.Cylinder(R=10.0)
    law = mb.Microblock()
    plane = mb.HalfPlane(solid)
    roller = mb.Deformable(mb.HalfPlane(solid), cylinder)
    block = library.body_of({"solid": problems.SOLID, "mesh": "block", "order": 1})
    above = mb.Body(upper(), solid, 1, fixed="top")
    small = mb.Body(upper(1.0, 4), solid, 1, fixed="top")

    def pressed(body, obstacle, method=None, **asked):
        return lambda: mb.Contact(body, obstacle, law, method).solve(**asked or {"load": 1.0})

    return {
        "second body of a solid": lambda: mb.Deformable(solid, cylinder),
        "second body on a second body": lambda: mb.Deformable(plane, roller),
        "second body without a shape": lambda: mb.Deformable(plane, 1.0),
        "second half-plane on a body": pressed(block, roller),
        "second half-plane on a block": pressed(mb.Block(solid, 10.0), roller),
        "second half-plane, Newton": pressed(block, mb.Deformable(above, cylinder), mb.Newton()),
        "second half-plane, uniform": pressed(mb.Block(solid, 4.0), roller, mb.Uniform(h=0.1)),
        "second block": pressed(plane, mb.Deformable(mb.Block(solid, 10.0), cylinder)),
        "second body on a half-plane": pressed(plane, mb.Deformable(above, cylinder)),
        "second half-space": pressed(plane, mb.Deformable(mb.HalfSpace(solid), mb.Sphere(1.0))),
        "second body of another period": pressed(
            plane, mb.Deformable(mb.HalfPlane(solid, 1.0), mb.Wave(0.1, 1.0))
        ),
        "second body without the period": pressed(
            mb.HalfPlane(solid, 1.0), mb.Deformable(plane, mb.Wave(0.1, 1.0))
        ),
        "second body below": pressed(block, mb.Deformable(block, cylinder)),
        "second body too narrow": pressed(block, mb.Deformable(small, mb.Cylinder(R=500.0)), load=30.0),
        "second body and rtol": pressed(block, mb.Deformable(above, cylinder), load=1.0, rtol=0.1),
        "second punch that opens again": pressed(
            mb.HalfPlane(mb.Cosserat(**{**problems.SOLID, "ell": 0.4})),
            mb.Deformable(mb.HalfPlane(mb.Cosserat(**given.SOFTER)), mb.Punch(half_width=0.5)),
            mb.Panels(),
        ),
    }
