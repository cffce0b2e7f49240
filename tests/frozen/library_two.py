"""Frozen contact of two bodies in the plane in the names of the library, beside `tests.frozen.library`."""

from functools import cache

import numpy as np
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb

from . import library
from .library_mesh import short

estimated = library.estimated
RESIDUAL = 1e-12  # of cells: the digits of a row are not the solver's


@cache
def upper():
    """A mesh above x2 = 0, wider than that of the first body, whose nodes are others."""
    mapped = lambda x, y: (2.6 * x - 1.3, 0.8 * y)  # noqa: E731
    return library.with_contact(MakeStructured2DMesh(nx=17, ny=6, mapping=mapped), "bottom")


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
