"""Contact of bodies on meshes in the plane beside those of `tests.frozen.problems`, as plain data: monolithic
methods through the door that all methods share, approaches, orders of single fields and elements.

solver     "condensed", "al" or "penalty" on a mesh, "fitted" or "uniform" on a block
orders     (of u, of psi), or "graded": other orders on some elements
"""

from .problems import CYLINDER, MICROBLOCK, MICROCLAMPED, ROTATED, SOLID, UNILATERAL, VARYING, problem

LAWS = {"microblock": ROTATED, "unilateral": UNILATERAL, "microclamped": MICROCLAMPED}


def on_mesh(name, solver="condensed", obstacle=CYLINDER, law=MICROBLOCK, load=1.0, *, mesh="block", **more):
    more = {"orders": (2, 2), "at": (0.06, 0.6), **more}
    return problem(f"mesh {name}", "body", obstacle, law, load, solver=solver, mesh=mesh, **more)


STATES = [
    *(
        on_mesh(f"{solver} {name}", solver, "shifted parabola", law, below=((0.1, -0.1),))
        for solver in ("al", "penalty")
        for name, law in LAWS.items()
    ),
    on_mesh("approach al", "al", approach=0.02),
    on_mesh("approach penalty rho", "penalty", approach=0.02, rho=3e4),
    on_mesh("approach condensed", approach=0.02, law=VARYING),
    on_mesh("psi of order 2", orders=(3, 2), law=ROTATED, below=((0.1, -0.1),)),
    on_mesh("psi of order 3", orders=(2, 3), law=MICROCLAMPED),
    on_mesh("psi of order 3 al", "al", orders=(5, 3)),
    on_mesh("orders of elements", orders="graded", law=ROTATED, below=((0.1, -0.1),)),
    on_mesh("curved al", "al", ("Plane", {"level": 1.0}), ROTATED, mesh="bent", at=(0.05,), orders=(2, 2)),
    on_mesh(
        "curved", "condensed", ("Plane", {"level": 1.0}), ROTATED, mesh="bent", at=(0.05,), orders=(2, 2)
    ),
    on_mesh("block fitted approach", "fitted", approach=0.02, order=4, domain=4.0, at=(0.06, 0.45)),
    on_mesh("block uniform approach", "uniform", approach=0.02, h=0.08, reach=0.8, domain=4.0),
    on_mesh("small blocks", solid=SOLID | {"ell": 0.01}, orders=(1, 1)),
]
