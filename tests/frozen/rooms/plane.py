"""Formulas of the plane at points: kernels of shear, averages over cells, products, second bodies, zones."""

from .. import library, library_friction, library_plane, library_reports, of_kind
from .. import problems_friction as problems
from ..states import rows_of

# sums of hundreds of differences of tabulated kernels, whose own rounding is 1e-13
ROUNDING_OF_SUMS = 1e-11


def rows(choice):
    for part in (library_plane.of_shear_kernels, library_plane.of_averages, library_plane.of_products):
        yield from ((name, value, "definition", ROUNDING_OF_SUMS) for name, value in part().items())
    for part in (library_plane.of_second_bodies, library_plane.of_memories, library_plane.of_others):
        for name, value, kind in rows_of("definition", part):
            # jumps of a slope that was sampled
            yield (name, value, "estimated", 1e-6) if name.startswith("kinks") else (name, value, kind)
    yield from rows_of("discrete", library_plane.of_gradients)
    names = "of_pictures", "of_intervals", "of_edges", "of_ways"
    yield from (row for name in names for row in getattr(library_plane, name)())
    yield from states(choice)
    yield from library_reports.parts()
    yield from library_reports.candidates_in_the_plane()


def states(choice):
    """Rows of states between two half-planes."""
    for problem in choice.of(problems.BETWEEN):
        contact = library_friction.contact_of(problem)
        rtol = {"rtol": problem["rtol"]} if "rtol" in problem else {}
        state = contact.solve(problem["load"], **rtol)
        kind = "estimated" if library.estimated(problem) else "discrete"
        values = library.measured(state, problem)
        values |= {
            f"counter displacement at {x:g}": float(state.counter_displacement(x)) for x in problem["at"]
        }
        if kind == "discrete":
            values |= library_friction.profile(state)
        if problem["method"] == "cells":
            x = problem["beside"]
            values |= {f"gap {corner} at {x:g}": state.gap_at(corner, x) for corner in state.law.corners}
        for name, value in values.items():
            yield of_kind(f"{problem['name']} {name}", value, kind, state.error_estimate or 0.0)
