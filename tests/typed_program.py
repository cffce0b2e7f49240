"""A program as users write it, for mypy alone (`.ci/lint`): it sees the types of results and wrong arguments.

An `ignore` that is not needed is an error itself, so that a wrong argument that mypy no longer sees fails.
"""

from collections.abc import Sequence

from typing_extensions import assert_type

import microblock as mb

solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
state = problem.solve(load=1.0, rtol=1e-4)
assert_type(state.zones, dict[str, list[tuple[float, float]]])
assert_type(problem.path(1.0).events, Sequence[mb.Event])
for body in (mb.Block(solid, 10.0), mb.HalfPlane(solid, period=1.0)):
    mb.Contact(body, lambda x: x**2, mb.Unilateral(), mb.Cells())
problem.solve(load="1.0")  # type: ignore[arg-type]
mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), "microblock")  # type: ignore[arg-type]
