"""Bodies in three dimensions: states by each method, loads without contact, nodes."""

from .. import library_reports, library_space, of_kind, problems_space
from ..states import rows_of

SOLVED = 2e-8  # twenty times the residual of solvers of bodies: without it rows move by up to 6e-9
NOTHING = 1e-9  # what balances or vanishes by symmetry, but for that residual


def rows(choice):
    numbers = [
        (f"{problem['name']} {quantity}", value)
        for problem in choice.of(problems_space.BODIES)
        for quantity, value in library_space.measured(library_space.solve(problem), problem).items()
    ]
    for row in (*numbers, *library_space.that_travel("body").items()):
        name, value, kind = of_kind(*row, "discrete")
        exact = kind != "discrete"
        yield (name, value, kind) if exact else (name, value * (abs(value) >= NOTHING), kind, SOLVED)
    yield from rows_of("discrete", library_space.of_bodies)
    yield from library_reports.reports("bodies3d", choice)
