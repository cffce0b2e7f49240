"""Materials, obstacles, laws and kernels at points."""

from .. import library
from ..states import rows_of


def rows(_):
    yield from rows_of(
        "definition", library.of_materials, library.of_obstacles, library.of_laws, library.of_kernels
    )
