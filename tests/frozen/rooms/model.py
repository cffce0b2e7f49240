"""Materials, obstacles, laws, kernels and closed forms at points."""

from .. import library


def rows():
    for part in (
        library.of_materials,
        library.of_obstacles,
        library.of_laws,
        library.of_kernels,
        library.of_closed_forms,
    ):
        yield from (
            (name, value, "outcome" if isinstance(value, str) else "definition")
            for name, value in part().items()
        )
