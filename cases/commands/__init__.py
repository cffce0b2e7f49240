"""Commands whose options and JSON keys other programs rely on."""

import math

from microblock.errors import BadArgument, out_of_reach, require_size
from microblock.model.refinement import levels

OPEN = "open"  # as the third entry of a range: without its ends
POSITIVE = (0.0, math.inf, OPEN)
MATERIAL = {"nu": (-1.0, 0.5, OPEN), "beta": (0.0, 2.0, OPEN)}


def require_ranges(options, ranges):
    """Raises BadArgument for the first option of a command with a value outside its range.

    Parameters
    ----------
    options : {name: number, tuple of numbers or None}
    ranges : {name: (least, most) or (least, most, OPEN)}
    """
    for name, (least, most, *ends) in ranges.items():
        sign, inside = ("<", lambda x: least < x < most) if ends else ("<=", lambda x: least <= x <= most)
        for value in options[name] if isinstance(options[name], tuple) else (options[name],):
            if value:
                require_size(**{name: value})
            if value is not None and not inside(value):
                raise BadArgument(name, value, f"must satisfy {least:g} {sign} {name} {sign} {most:g}")


def refine(solve, sizes, distance, rtol):
    """Returns the result on the first of finer and finer levels that is within rtol of the one before, and
    this relative `distance`, which bounds its error as long as a level at least halves it; raises
    NotConverged where there is none.
    """
    for _, result, _, changes in levels(lambda level, _: solve(level), sizes, distance):
        if changes and changes[-1] <= rtol:
            return result, changes[-1]
    raise out_of_reach(rtol, min(changes), besides="fix the discretisation instead")
