"""Bodies on meshes in the plane: monolithic methods, approaches, orders, prescribed values, copies."""

from .. import library, library_mesh, of_kind, problems_mesh
from ..states import rows_of_states

NOTHING = 1e-11  # what is 0 by balance, but for rounding


def rows():
    for name, value, kind, *tolerance in rows_of_states(problems_mesh.STATES, library_mesh):
        yield (name, 0.0 if kind == "discrete" and abs(value) < NOTHING else value, kind, *tolerance)
    for part in (library_mesh.of_bodies, library_mesh.that_travel):
        for name, value in part().items():
            yield of_kind(name, value, "discrete")
    for name, call in library_mesh.refusals().items():
        yield f"refused {name}", library.refused(call), "outcome"
