"""The part of a line that equal cells cover."""

import math
from dataclasses import dataclass, field

from numpy import inf

from ..contact_solvers.fft_compliance import Grid
from ..model.contact_candidates import ContactCandidates
from ..model.types import Array

COARSEST = 128  # cells of a first grid


@dataclass(frozen=True)
class Window(Grid):
    """Equal cells of a line, and what is known of the obstacle there.

    Attributes
    ----------
    sample_points : array (n,) or None
        Places of the contact candidates; None where the window was given.
    jumps : tuple of float
        Places at which the height jumps, or ends without a name.
    coarsest : int
        Number of the first cells.
    """

    sample_points: Array | None = field(default=None, compare=False)
    jumps: tuple[float, ...] = ()
    coarsest: int = COARSEST


def window_about(candidates: ContactCandidates, ell: float, ends: tuple[float, ...] = ()) -> Window:
    """Returns the window of one cell about all that may touch; `ends` are those that the obstacle names."""
    left = candidates.stretches[0][0] - ell
    right = candidates.stretches[-1][1] + ell
    width = 1.1 * (right - left)
    # a feature shows on some of 12 cells on the shortest piece
    least = 12 * width / min(candidates.lengths.min(initial=inf), width)
    hidden = set(candidates.ends) - {*ends, -inf, inf}
    return Window(
        1,
        width,
        ((left + right) / 2,),
        sample_points=candidates.sample_points,
        jumps=(*candidates.height_jumps, *sorted(hidden)),
        coarsest=COARSEST * 2 ** max(0, math.ceil(math.log2(least / COARSEST)) - 2),
    )
