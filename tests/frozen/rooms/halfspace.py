"""Half-spaces: states alone and on a period, of one body and of two, symbols, kernels."""

from .. import library_reports, library_space, of_kind, problems_space
from ..states import rows_of

AGREED = 1e-3  # approach and energy are second order in errors of a state, of which the estimates are 0.05


def rows(choice):
    for problem in choice.of(problems_space.SPACES):
        for quantity, value in library_space.measured(library_space.solve(problem), problem).items():
            yield of_kind(f"{problem['name']} {quantity}", value, "discrete")
    for problem in choice.of(problems_space.ESTIMATED):
        state = library_space.solve(problem)
        yield f"{problem['name']} approach", state.approach, "estimated", AGREED
        yield f"{problem['name']} energy", state.energy, "estimated", AGREED
        yield f"{problem['name']} error_estimate", state.error_estimate, "count"
        yield f"{problem['name']} cells", len(state.x1), "count"
    names = "kernels", "second_bodies", "products", "surfaces", "least_norm"
    yield from rows_of("definition", *(getattr(library_space, f"of_{name}") for name in names))
    yield from rows_of("discrete", lambda: library_space.that_travel("cells"), library_space.warned)
    yield from library_reports.reports("halfspace", choice)
    yield from library_reports.candidates_in_space(choice)
