"""States of panels and cells, load paths, and loads at which zones meet."""

from .. import library, library_reports, problems
from ..states import rows_of_paths, rows_of_states


def rows(choice):
    yield from rows_of_states(choice.of(problems.PANELS + problems.CELLS + problems.SHARP + problems.WAVY))
    paths = [problem for problem in problems.PATHS if problem["method"] == "panels"]
    yield from rows_of_paths(choice.of(paths))
    for problem in problems.COALESCENCE:
        if problem["method"] == "panels":
            yield problem["name"], library.coalescence_of(problem), "estimated", 1e-6  # an event's own
    yield from library_reports.reports("halfplane", choice)
