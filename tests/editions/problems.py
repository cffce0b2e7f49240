"""Problems of every method at three sizes, as texts that any edition of the library can run.

They use public names only. A text has a function `problem(size)` and one, `solve()`, that returns the numbers
of its problem at SIZE, a dictionary; that is timed. BEGINNING stands before each, END after it: what a
problem of the least size imports is not timed.
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


def named(made):
    for number, name in enumerate(made.GetBoundaries()):
        made.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
    return type(made)(made.ngmesh)


def mesh(n):
    from ngsolve.meshes import MakeStructured2DMesh

    return named(MakeStructured2DMesh(nx=2 * n, ny=n, mapping=lambda x, y: (4 * x - 2, 2 * y - 2)))


def mesh_in_space(n):
    from ngsolve.meshes import MakeStructured3DMesh

    place = lambda x, y, z: (2 * x - 1, 2 * y - 1, z - 1)
    return named(MakeStructured3DMesh(nx=2 * n, ny=2 * n, nz=n, mapping=place))


def body_in_space(*arguments, **options):
    return (mb.Body3D if "Body3D" in mb.__all__ else mb.Body)(*arguments, **options)
"""

END = """
problem(LEAST)
"""

CYLINDER = "mb.Cylinder(R=10)"
PUSHED = "[(1.0, 0.0), (1.0, 0.15), (1.0, -0.1)]"
STATE = """
def solve():
    return numbers(problem(SIZE).solve(load=1.0))
"""
TO_RTOL = STATE.replace("load=1.0", "load=1.0, rtol=SIZE")


def made(body, law, method="None", obstacle=CYLINDER):
    """The function `problem` of a text."""
    return f"""
def problem(size):
    return mb.Contact({body}, {obstacle}, {law}, {method})
"""


LINE, BLOCK, MESH = (
    "mb.HalfPlane(solid)",
    "mb.Block(solid, 6.0)",
    'mb.Body(mesh(size), solid, 2, fixed="bottom")',
)
BLOCKS, RUBBING = "mb.Microblock()", "mb.Microblock(friction=0.3)"
DEPTH = "elements in depth"

# name: (three sizes, what SIZE is, text)
PROBLEMS = {
    "panels": ((1e-3, 1e-6, 1e-9), "rtol", made(LINE, BLOCKS) + TO_RTOL),
    "panels, path": (
        (1e-3, 1e-6, 1e-8),
        "rtol",
        made(LINE, BLOCKS)
        + """
def solve():
    path = problem(SIZE).path(load=1.0, rtol=SIZE)
    return numbers(path.at(1.0)) | {f"event {k}": event.load for k, event in enumerate(path.events)}
""",
    ),
    "cells": ((2**11, 2**14, 2**17), "cells", made(LINE, BLOCKS, "mb.Cells(nodes=size)") + STATE),
    "cells, period": (
        (2**11, 2**14, 2**17),
        "cells",
        made("mb.HalfPlane(solid, 1.0)", BLOCKS, "mb.Cells(nodes=size)", "mb.Rough(period=1.0, slope=0.1)")
        + STATE,
    ),
    "fitted": ((1e-2, 1e-4, 1e-6), "rtol", made(BLOCK, BLOCKS, "mb.Fitted()") + TO_RTOL),
    "uniform": ((0.04, 0.02, 0.01), "h", made(BLOCK, BLOCKS, "mb.Uniform(h=size)") + STATE),
    "newton": ((12, 24, 48), DEPTH, made(MESH, BLOCKS, "mb.Newton()") + STATE),
    "penalty": ((12, 24, 48), DEPTH, made(MESH, BLOCKS, 'mb.Newton("penalty")') + STATE),
    "body": ((16, 32, 64), DEPTH, made(MESH, BLOCKS) + STATE),
    "body, orders 3 and 2": (
        (8, 16, 32),
        DEPTH,
        made(MESH.replace("solid, 2", "solid, 3, order_psi=2"), BLOCKS) + STATE,
    ),
    "body in space": (
        (2, 3, 4),
        DEPTH,
        made(
            'body_in_space(mesh_in_space(size), solid, 2, fixed="bottom")', BLOCKS, obstacle="mb.Sphere(R=10)"
        )
        + STATE,
    ),
    "half-space": (
        (64, 128, 256),
        "cells a side",
        made("mb.HalfSpace(solid)", BLOCKS, "mb.Cells(nodes=size)", "mb.Sphere(R=10)") + STATE,
    ),
    "friction, cells": (
        (0.1, 0.03, 0.003),
        "rtol",
        made(LINE, RUBBING)
        + f"""
def solve():
    return last(problem(SIZE).history({PUSHED}, rtol=SIZE))
""",
    ),
    "friction, panels": (
        (1e-3, 1e-5, 1e-7),
        "rtol",
        made(LINE, "mb.Unilateral(friction=0.3)", "mb.Panels()", f"mb.Deformable({LINE}, {CYLINDER})")
        + f"""
def solve():
    return last(problem(SIZE).history({PUSHED}[:2], rtol=SIZE))
""",
    ),
    "friction, condensed": (
        (8, 16, 32),
        DEPTH,
        made(MESH, RUBBING)
        + f"""
def solve():
    return last(problem(SIZE).history({PUSHED}))
""",
    ),
}
