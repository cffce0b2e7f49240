"""Contact of two bodies in the plane whose numbers are frozen, as plain data: entries of
`tests.frozen.problems`, and `second`, the arguments of the solid of the second body.
"""

from .problems import MICROCLAMPED, ROTATED, UNILATERAL, VARYING, WAVE, WEDGE, problem, solid

SOFTER = {"E": 60.0, "nu": 0.2, "ell": 0.2, "beta": 0.7}
CLASSICAL = {"E": 150.0, "nu": 0.25, "ell": 0.2, "beta": 0.0}
LAWS = {"unilateral": UNILATERAL, "microblock": ROTATED, "microclamped": MICROCLAMPED}
AT, ON_PERIOD = (-0.31, 0.8), (-0.12, 0.4)
LINE = {"second": SOFTER, "at": AT}
WINDOW = {"window": (-1.0, 1.0), "nodes": 256, "obstacle": "shifted parabola", "at": AT}
PERIOD = {"period": 1.0, "nodes": 256, "obstacle": WAVE, "at": ON_PERIOD, "load": 0.5}
MESH = {"mesh": "block", "at": AT}

STATES = [
    problem(
        "two panels microblock cylinder", "panels", second=SOFTER, rtol=1e-6, at=AT, below=((0.2, -0.1),)
    ),
    problem("two panels unilateral wedge", "panels", WEDGE, UNILATERAL, **LINE, rtol=1e-5),
    problem("two panels microclamped", "panels", law=MICROCLAMPED, second=CLASSICAL, rtol=1e-6, at=AT),
    problem(
        "two panels psi0=0.01", "panels", "shifted parabola", ROTATED, second=CLASSICAL, rtol=1e-5, at=AT
    ),
    problem("two panels large blocks", "panels", solid=solid(ell=0.34), **LINE, rtol=1e-5),
    *(problem(f"two cells {name}", "cells", law=law, second=SOFTER, **WINDOW) for name, law in LAWS.items()),
    problem("two cells, the second classical", "cells", second=CLASSICAL, **WINDOW),
    *(
        problem(f"two cells of a period {name}", "cells", law=law, second=SOFTER, **PERIOD)
        for name, law in LAWS.items()
    ),
    problem("two cells of a period psi0(x)", "cells", law=VARYING, second=CLASSICAL, **PERIOD),
    *(
        problem(f"two meshes {name}", "body", "shifted parabola", law, second=SOFTER, **MESH)
        for name, law in LAWS.items()
    ),
    problem("two meshes approach", "body", approach=0.05, second=SOFTER, below=((0.2, -0.1),), **MESH),
    problem("two meshes wedge", "body", WEDGE, second=CLASSICAL | {"beta": 0.5}, **MESH),
]
PATHS = [
    problem(
        "two panels path", "panels", load=2.0, solid=solid(ell=0.34), second=SOFTER, rtol=1e-4, states=(1.0,)
    ),
    problem("two meshes path", "body", load=0.1, second=SOFTER, mesh="block", states=(0.05,)),
]
