"""Problems of every method at three sizes, as texts that any edition of the library can run.

They use public names only. A text finds its size in SIZE, prepares what is not to be timed at its top, and
returns its numbers, a dictionary, from `solve()`. BEGINNING stands before each.
"""

BEGINNING = """
import numpy as np
import microblock as mb

solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)


def numbers(state):
    p, w = np.asarray(state.pressure), np.asarray(state.weights)
    return {
        "load": state.load, "approach": state.approach, "half-width": getattr(state, "half_width", None),
        "pressure, L2": np.sqrt((w * p**2).sum()), "largest pressure": p.max(),
        "largest rotation": np.abs(state.psi).max(), "energy": state.energy,
        "estimate": state.error_estimate, "unknowns": state.unknowns,
    }


def last(history):
    state = history.states[-1]
    p, q, w = (np.asarray(value) for value in (state.pressure, state.shear_traction, state.weights))
    return {
        "pressure, L2": np.sqrt((w * p**2).sum()), "shear, L2": np.sqrt((w * q**2).sum()),
        "dissipation": state.dissipation, "work": state.work,
        "estimate": state.error_estimate, "points": len(p), "events": len(history.events),
    }


def mesh(n, far=2.0):
    from ngsolve import Mesh
    from ngsolve.meshes import MakeStructured2DMesh

    def place(x, y):
        return far * (2 * x - 1), far * (y - 1)

    made = MakeStructured2DMesh(quads=True, nx=2 * n, ny=n, mapping=place)
    for number, name in enumerate(made.GetBoundaries()):
        made.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
    return Mesh(made.ngmesh)
"""

PUSHED = "[(1.0, 0.0), (1.0, 0.15), (1.0, -0.1)]"

# name: (three sizes, what SIZE is, text)
PROBLEMS = {
    "panels": (
        (1e-3, 1e-6, 1e-9),
        "rtol",
        """
def solve():
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    return numbers(problem.solve(load=1.0, rtol=SIZE))
""",
    ),
    "panels, path": (
        (1e-3, 1e-6, 1e-8),
        "rtol",
        """
def solve():
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    path = problem.path(load=1.0, rtol=SIZE)
    return numbers(path.at(1.0)) | {f"event {k}": event.load for k, event in enumerate(path.events)}
""",
    ),
    "cells": (
        (2**11, 2**14, 2**17),
        "cells",
        """
def solve():
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock(), mb.Cells(nodes=SIZE))
    return numbers(problem.solve(load=1.0))
""",
    ),
    "cells, period": (
        (2**11, 2**14, 2**17),
        "cells",
        """
rough = mb.Rough(period=1.0, slope=0.1)
def solve():
    problem = mb.Contact(mb.HalfPlane(solid, period=1.0), rough, mb.Microblock(), mb.Cells(nodes=SIZE))
    return numbers(problem.solve(load=0.5))
""",
    ),
    "fitted": (
        (1e-2, 1e-4, 1e-6),
        "rtol",
        """
import ngsolve  # which is not to be timed
def solve():
    problem = mb.Contact(mb.Block(solid, 6.0), mb.Cylinder(R=10), mb.Microblock(), mb.Fitted())
    return numbers(problem.solve(load=1.0, rtol=SIZE))
""",
    ),
    "uniform": (
        (0.04, 0.02, 0.01),
        "h",
        """
import ngsolve  # which is not to be timed
def solve():
    problem = mb.Contact(mb.Block(solid, 6.0), mb.Cylinder(R=10), mb.Microblock(), mb.Uniform(h=SIZE))
    return numbers(problem.solve(load=1.0))
""",
    ),
    "newton": (
        (12, 24, 48),
        "elements in depth",
        """
body = mb.Body(mesh(SIZE), solid, order=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock(), mb.Newton())
    return numbers(problem.solve(load=1.0))
""",
    ),
    "penalty": (
        (12, 24, 48),
        "elements in depth",
        """
body = mb.Body(mesh(SIZE), solid, order=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock(), mb.Newton("penalty"))
    return numbers(problem.solve(load=1.0))
""",
    ),
    "body": (
        (16, 32, 64),
        "elements in depth",
        """
body = mb.Body(mesh(SIZE), solid, order=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock())
    return numbers(problem.solve(load=1.0))
""",
    ),
    "body, orders 3 and 2": (
        (8, 16, 32),
        "elements in depth",
        """
body = mb.Body(mesh(SIZE), solid, order=3, order_psi=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock())
    return numbers(problem.solve(load=1.0))
""",
    ),
    "body in space": (
        (2, 3, 4),
        "elements in depth",
        """
from ngsolve import Mesh
from ngsolve.meshes import MakeStructured3DMesh
made = MakeStructured3DMesh(
    hexes=True, nx=2 * SIZE, ny=2 * SIZE, nz=SIZE, mapping=lambda x, y, z: (2 * x - 1, 2 * y - 1, z - 1)
)
for number, name in enumerate(made.GetBoundaries()):
    made.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
body = mb.Body3D(Mesh(made.ngmesh), solid, order=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Sphere(R=10), mb.Microblock())
    return numbers(problem.solve(load=1.0))
""",
    ),
    "half-space": (
        (64, 128, 256),
        "cells a side",
        """
def solve():
    problem = mb.Contact(mb.HalfSpace(solid), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=SIZE))
    return numbers(problem.solve(load=1.0))
""",
    ),
    "friction, cells": (
        (0.1, 0.03, 0.003),
        "rtol",
        f"""
law = mb.Microblock(friction=0.3)
def solve():
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), law)
    return last(problem.history({PUSHED}, rtol=SIZE))
""",
    ),
    "friction, panels": (
        (1e-3, 1e-5, 1e-7),
        "rtol",
        """
law, body = mb.Unilateral(friction=0.3), mb.HalfPlane(solid)
def solve():
    problem = mb.Contact(body, mb.Deformable(body, mb.Cylinder(R=10)), law, mb.Panels())
    return last(problem.history([(1.0, 0.0), (1.0, 0.15)], rtol=SIZE))
""",
    ),
    "friction, condensed": (
        (8, 16, 32),
        "elements in depth",
        f"""
body = mb.Body(mesh(SIZE), solid, order=2, fixed="bottom")
def solve():
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Microblock(friction=0.3))
    return last(problem.history({PUSHED}))
""",
    ),
}
