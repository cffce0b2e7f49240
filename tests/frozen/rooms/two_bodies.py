"""Two bodies in the plane: half-planes on panels and cells, bodies on meshes, load paths."""

from .. import library_two, problems_two
from ..states import rows_of_paths, rows_of_states


def rows(choice):
    yield from rows_of_states(choice.of(problems_two.STATES), library_two)
    yield from rows_of_paths(choice.of(problems_two.PATHS), library_two)
