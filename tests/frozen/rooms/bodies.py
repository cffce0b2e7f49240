"""Bodies on meshes in the plane: monolithic methods, approaches, orders, prescribed values, copies."""

from .. import library_mesh, problems_mesh
from ..states import rows_of, rows_of_states

NOTHING = 1e-11  # what is 0 by balance, but for rounding


def rows(choice):
    for name, value, kind, *tolerance in rows_of_states(choice.of(problems_mesh.STATES), library_mesh):
        yield (name, 0.0 if kind == "discrete" and abs(value) < NOTHING else value, kind, *tolerance)
    yield from rows_of("discrete", library_mesh.of_bodies, library_mesh.that_travel)
