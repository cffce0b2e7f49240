"""States on meshes in the plane, a body without contact, and Newton's load steps."""

from .. import library, problems
from ..states import rows_of_paths, rows_of_states


def rows():
    yield from rows_of_states(problems.FITTED + problems.UNIFORM + problems.BODIES + problems.NEWTON)
    yield from rows_of_paths(problem for problem in problems.PATHS if problem["method"] == "body")
    for problem in problems.COALESCENCE:
        if problem["method"] != "panels":
            yield problem["name"], library.coalescence_of(problem), "discrete"
    for part in (library.of_bodies, library.of_two_faces):
        yield from (
            (name, value, "outcome" if isinstance(value, str) else "discrete")
            for name, value in part().items()
        )
