"""Half-spaces: states alone and on a period, of one body and of two, symbols, kernels, what is refused."""

from .. import library, library_space, of_kind, problems_space

AGREED = 1e-3  # approach and energy are second order in errors of a state, of which the estimates are 0.05


def rows():
    for problem in problems_space.SPACES:
        for quantity, value in library_space.measured(library_space.solve(problem), problem).items():
            yield of_kind(f"{problem['name']} {quantity}", value, "discrete")
    for problem in problems_space.ESTIMATED:
        state = library_space.solve(problem)
        yield f"{problem['name']} approach", state.approach, "estimated", AGREED
        yield f"{problem['name']} energy", state.energy, "estimated", AGREED
        yield f"{problem['name']} error_estimate", state.error_estimate, "count"
        yield f"{problem['name']} cells", len(state.x1), "count"
    for part in (
        library_space.of_kernels,
        library_space.of_second_bodies,
        library_space.of_products,
        library_space.of_surfaces,
        library_space.of_least_norm,
    ):
        yield from (of_kind(name, value, "definition") for name, value in part().items())
    for found in (library_space.that_travel("cells"), library_space.outside()):
        yield from (of_kind(name, value, "discrete") for name, value in found.items())
    for name, kinds in library_space.warned().items():
        yield name, kinds, "outcome"
    for name, call in library_space.refusals_of_spaces().items():
        yield f"refused {name}", library.refused(call), "outcome"
