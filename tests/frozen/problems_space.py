"""Contact problems in three dimensions whose numbers are frozen, as plain data.

Entries are those of `tests.frozen.problems`, but for

method     "body" of a mesh in three dimensions ("condensed", "al" or "penalty" in `solver`), "cells" of a
           half-space
second     arguments of the solid of a second body below the obstacle
at         places (x1, x2) of contact points: the nearest node or cell tells its corners
between    places (x1, x2) at which `pressure_at` is asked
below      points (x1, x2, x3) in the body at which fields are evaluated

Obstacles have no symmetry where none is asked for, so that no corner can stand for another.
"""

import numpy as np

SOLID = {"E": 100.0, "nu": 0.3, "ell": 0.3, "beta": 1.0}
TWISTED = {"E": 80.0, "nu": 0.2, "ell": 0.3, "beta": 0.6, "alpha_prime": 0.4, "beta_prime": -0.3}
SOFTER = {"E": 60.0, "nu": 0.2, "ell": 0.2, "beta": 0.7, "alpha_prime": 0.3, "beta_prime": -0.2}
CLASSICAL = {"E": 150.0, "nu": 0.25, "ell": 0.2, "beta": 0.0}
UNILATERAL = ("Unilateral", {})
MICROBLOCK = ("Microblock", {})
MICROCLAMPED = ("Microclamped", {})
TURNED = ("Microblock", {"psi0": (0.01, -0.02)})
LEVERS = ("Microblock", {"psi0": (0.01, -0.02), "psi0_in": "levers"})
LAWS = {"unilateral": UNILATERAL, "microblock": TURNED, "microclamped": MICROCLAMPED}
SPHERE = ("Sphere", {"R": 10.0})
PUNCH = ("FlatPunch", {"half_width": 0.4, "face": "square"})
ROUGH = ("RoughSurface", {"period": 1.0, "slope": 0.1, "waves": (1, 6), "seed": 3})


def bowl(x1, x2):
    return (
        (x1 - 0.55) ** 2 + 1.5 * (x2 - 0.45) ** 2 + 0.5 * (x1 - 0.5) * (x2 - 0.5)
    ) / 6 + 0.02 * np.asarray(x1) ** 3


def skew(x1, x2):
    return ((x1 - 0.03) ** 2 + 2 * x2**2 + x1 * x2) / 20 + 0.004 * np.sin(3 * np.asarray(x1))


def waves(x1, x2):
    first = 2 * np.pi * np.asarray(x1)
    second = 2 * np.pi * np.asarray(x2)
    return -0.01 * (np.cos(first) + np.cos(second) * (1 + np.sin(first)))


def hills(x1, x2):
    return np.minimum((x1 - 0.5) ** 2, (x1 + 0.5) ** 2 + 0.02) / 20 + np.asarray(x2) ** 2 / 20


FUNCTIONS = {
    "bowl": bowl,
    "skew": skew,
    "waves": waves,
    "hills": hills,
    "raised bowl": lambda x1, x2: bowl(x1, x2) - 0.3,
    "ramp": lambda x1, x2: 0.004 * np.asarray(x1) - 0.002 * np.asarray(x2),
    "turns about x1": lambda x1, x2: 0.02 * np.cos(2 * np.pi * np.asarray(x1)),
    "turns about x2": lambda x1, x2: -0.01 + 0.01 * np.sin(2 * np.pi * np.asarray(x2)),
}
VARYING = ("Microblock", {"psi0": ("turns about x1", "turns about x2")})


def body(name, solver="condensed", *, mesh="block", order=1, law=TURNED, obstacle="bowl", load=2.0, **more):
    return {
        "name": f"body3d {name}",
        "method": "body",
        "solid": SOLID,
        "solver": solver,
        "mesh": mesh,
        "order": order,
        "law": law,
        "obstacle": obstacle,
        "load": None if "approach" in more else load,
        **more,
    }


MIDDLE = ((0.5, 0.5),)
INSIDE = ((0.31, 0.62, -0.13),)
BENT = ((0.31, 0.62, -0.43),)
BODIES = [
    body(f"{solver} order={order} {name}", solver, order=order, law=law, brief=True)
    for order in (1, 2)
    for name, law in LAWS.items()
    for solver in ("condensed", "al", "penalty")
] + [
    body("quarter", mesh="quarter", law=MICROBLOCK, obstacle=SPHERE, load=0.25, at=((0.0, 0.0),)),
    body(
        "quarter of a sphere al", "al", mesh="quarter", law=MICROBLOCK, obstacle=SPHERE, load=0.25, brief=True
    ),
    body("tetrahedra", mesh="tetrahedra", solid=TWISTED, at=((0.6, 0.4),), below=INSIDE),
    body("tetrahedra microclamped al", "al", mesh="tetrahedra", law=MICROCLAMPED, at=MIDDLE),
    body("bent", mesh="bent", obstacle="raised bowl", load=0.5, at=((0.6, 0.4),), below=BENT),
    body("bent order=2", mesh="bent", order=2, obstacle="raised bowl", at=((0.6, 0.4),)),
    body("two heights", mesh="two heights", order=2, solid=TWISTED, load=4.0, at=((0.2, 0.5), (0.8, 0.5))),
    body("rotation in levers", order=2, solid=TWISTED, law=LEVERS, at=((0.25, 0.5),)),
    body("rotation varies", order=2, law=VARYING, at=((0.75, 0.5),)),
    body("microclamped", order=2, solid=TWISTED, law=MICROCLAMPED, at=MIDDLE),
    body("unilateral", order=3, solid=TWISTED, law=UNILATERAL, at=MIDDLE),
    body("approach", approach=0.03, at=MIDDLE),
    body("approach al", "al", approach=0.03, brief=True),
    body("approach penalty", "penalty", approach=0.03, rho=2e3, brief=True),
    body("square punch", order=2, obstacle=("FlatPunch", {"half_width": 0.5, "face": "square"}), load=3.0),
    body("classical", solid={**SOLID, "beta": 0.0}, law=UNILATERAL, at=MIDDLE),
    body("all closed", law=MICROBLOCK, obstacle="ramp", approach=0.05, at=((0.25, 0.75),)),
]


def cells(name, nodes=32, *, law=TURNED, obstacle="skew", load=1.0, **more):
    return {
        "name": f"half-space {name}",
        "method": "cells",
        "solid": SOLID,
        "law": law,
        "obstacle": obstacle,
        "load": None if "approach" in more else load,
        "nodes": nodes,
        **more,
    }


ALONE = {"window": (-1.0, 1.0), "at": ((-0.21, 0.17),), "between": ((0.05, -0.03),)}
WAVES = {"obstacle": "waves", "period": 1.0, "at": ((-0.02, 0.08),), "between": ((0.97, 0.04),)}
SMALL = {**SOLID, "ell": 0.06}
SPACES = [
    *(cells(f"{name} alone", law=law, **ALONE) for name, law in LAWS.items()),
    *(cells(f"{name} on a period", law=law, **WAVES) for name, law in LAWS.items()),
    *(cells(f"{name} two", law=law, second=SOFTER, **ALONE) for name, law in LAWS.items()),
    *(cells(f"{name} two on a period", law=law, second=SOFTER, **WAVES) for name, law in LAWS.items()),
    cells("two, the second classical", second=CLASSICAL, **ALONE),
    cells("twisted alone", solid=TWISTED, law=LEVERS, **ALONE),
    cells("twisted on a period", solid=TWISTED, law=VARYING, **WAVES),
    cells("approach alone", approach=0.03, brief=True),
    cells("approach on a period", brief=True, approach=-0.005, obstacle="waves", period=1.0),
    cells("approach two", approach=0.04, second=SOFTER, brief=True),
    cells("small blocks", 48, solid=SMALL, **ALONE),
    cells("small blocks two", 48, solid=SMALL, second=SOFTER, law=MICROBLOCK, **ALONE),
    cells("sphere", 48, law=MICROBLOCK, obstacle=SPHERE, brief=True, along=True),
    cells("ellipsoid", law=MICROBLOCK, obstacle=("Ellipsoid", {"R1": 10.0, "R2": 4.0}), brief=True),
    cells("cone", law=UNILATERAL, obstacle=("Cone", {"slope": 0.1}), brief=True, along=True),
    cells("round punch", obstacle=("FlatPunch", {"half_width": 0.4}), brief=True),
    cells("square punch", law=UNILATERAL, obstacle=PUNCH),
    cells("hills", law=UNILATERAL, obstacle="hills", load=0.4, brief=True),
    cells("rough", law=MICROBLOCK, solid=SMALL, obstacle=ROUGH, period=1.0, load=0.5),
    cells("closed wave", solid={**SOLID, "ell": 0.1}, law=MICROBLOCK, load=4.0, **WAVES),
]
ESTIMATED = [
    cells("sphere rtol", None, law=UNILATERAL, obstacle=SPHERE, rtol=0.03),
    cells("waves rtol", None, law=MICROBLOCK, rtol=0.05, obstacle="waves", period=1.0),
]
SOLIDS = {"beta=1": SOLID, "alpha' and beta'": TWISTED}
WAVENUMBERS = (1e-3, 0.5, 4.0, 1e4)
DISTANCES = (1e-5, 0.03, 0.7, 200.0)
OVER = {  # obstacles over a surface
    "sphere": SPHERE,
    "ellipsoid": ("Ellipsoid", {"R1": 10.0, "R2": 4.0}),
    "cone": ("Cone", {"slope": 0.1}),
    "punch": ("FlatPunch", {"half_width": 0.25, "face": "square"}),
    "round punch": ("FlatPunch", {"half_width": 0.25}),
    "rough": ROUGH,
}
