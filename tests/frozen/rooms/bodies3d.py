"""Bodies in three dimensions: states by each method, loads without contact, nodes, what is refused."""

from .. import library, library_space, of_kind, problems_space

SOLVED = 2e-8  # twenty times the residual of solvers of bodies: without it rows move by up to 6e-9
NOTHING = 1e-9  # what balances or vanishes by symmetry, but for that residual


def rows():
    for problem in problems_space.BODIES:
        for quantity, value in library_space.measured(library_space.solve(problem), problem).items():
            yield contact_row(f"{problem['name']} {quantity}", value)
    for name, value in library_space.of_bodies().items():
        yield of_kind(name, value, "discrete")
    for name, value in library_space.that_travel("body").items():
        yield contact_row(name, value)
    for name, call in library_space.refusals_of_bodies().items():
        yield f"refused {name}", library.refused(call), "outcome"


def contact_row(name, value):
    name, value, kind = of_kind(name, value, "discrete")
    if kind == "discrete" and abs(value) < NOTHING:
        value = 0.0
    return (name, value, kind, SOLVED) if kind == "discrete" else (name, value, kind)
