"""States on meshes in the plane, a body without contact, and Newton's load steps."""

from .. import library, library_reports, problems
from ..states import rows_of, rows_of_paths, rows_of_states


def rows(choice):
    on_meshes = problems.FITTED + problems.UNIFORM + problems.BODIES + problems.NEWTON
    yield from rows_of_states(choice.of(on_meshes))
    paths = [problem for problem in problems.PATHS if problem["method"] == "body"]
    yield from rows_of_paths(choice.of(paths))
    coalescence = [entry for entry in problems.COALESCENCE if entry["method"] != "panels"]
    met = {problem["name"]: library.coalescence_of(problem) for problem in coalescence}
    yield from rows_of("discrete", lambda: met, library.of_bodies, library.of_two_faces)
    yield from library_reports.reports("fem", choice)
