"""Refinement: its one loop, the error that remains on the last level, and what has too few cells.

`refine` keeps the best result and decides where the loop ends; `GeometricSeries` is the rule for the error;
a contact of fewer cells than FEWEST says nothing of its own.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np

from ..errors import MicroblockError, NotConverged, out_of_reach
from .progress import counted, kept

SECONDS = 3.0  # of one core, that a further level may be expected to take if no rtol was asked for
# cells or nodes across a contact or a zone, with fewer of which two levels may agree and be wrong together:
# half a spacing is 1/16 of it then. Of cells that shrink towards edges so many do as well
FEWEST = 8
FEWEST_GRADED = 4

Size = TypeVar("Size")
Result = TypeVar("Result")


class Usual(float):
    """The usual rtol of a method, aimed at where none was asked for: the best that a few seconds give is
    returned if it is not reached.
    """


class Abandoned(Exception):
    """Raised by levels where no result so far is an answer, not even the best one; `failure` says why."""

    def __init__(self, failure: MicroblockError) -> None:
        super().__init__(str(failure))
        self.failure = failure


@dataclass(frozen=True)
class RefinementLevel(Generic[Result]):
    """A result on one level of refinement, and what it tells of finer ones.

    Attributes
    ----------
    result : object
    error : float
        Its error estimate.
    seconds : float
        Of one core, that the next level is expected to take.
    cannot_reach : bool
        Whether all finer levels are expected to miss an rtol that was asked for.
    suffices : bool
        Whether it is the answer even with an error above rtol.
    margin : float
        Over the smallest error, of an rtol that is advised where this level is the last.
    """

    result: Result
    error: float
    seconds: float = 0.0
    cannot_reach: bool = False
    suffices: bool = False
    margin: float = 1.0


Refusal: TypeAlias = Callable[
    [RefinementLevel[Result], RefinementLevel[Result], NotConverged | None], NotConverged
]


def refine(
    levels: Iterable[RefinementLevel[Result]], rtol: float, refusal: Refusal[Result], keeps: bool = True
) -> RefinementLevel[Result]:
    """Returns the first level, coarse to fine, whose error is at most rtol.

    1. The level with the smallest error so far is the best; it `keeps` it for an interruption.
    2. A level with an error of at most rtol, or that suffices, is the answer.
    3. No finer level is solved where none would reach an rtol that was asked for; or, where none was asked
       for (`Usual`), where the next one is expected to take more than SECONDS.
    4. If a finer level fails, or none is left, the best is the answer to a `Usual` rtol; for another
       `refusal(best, last, failure)` is raised, of the best level, the last one that was solved, and the
       failure of the next one or None. Without any level the failure itself is raised.
    5. Where levels are `Abandoned`, the failure that it has is raised, whatever there was before.
    """
    best: RefinementLevel[Result] | None = None
    failure: NotConverged | None = None
    try:
        for level in levels:
            if best is None or math.isnan(best.error) or level.error <= best.error:
                best = level
                if keeps:
                    kept(best.result, **({"error": best.error} if math.isfinite(best.error) else {}))
            if level.suffices or level.error <= rtol:
                return level
            if level.seconds > SECONDS if isinstance(rtol, Usual) else level.cannot_reach:
                break
    except Abandoned as end:
        raise end.failure from end.failure.__cause__
    except NotConverged as objection:
        if best is None:
            raise
        failure = objection
    if best is None:
        raise out_of_reach(rtol, math.inf)
    if isinstance(rtol, Usual):
        return best
    refused = refusal(best, level, failure)
    if refused is failure:
        raise refused  # with the cause that it has
    raise refused from failure


def levels(
    solve: Callable[[Size, Result | None], Result],
    sizes: Iterable[Size],
    change: Callable[[Result, Result], float],
) -> Iterator[tuple[Size, Result, Any, list[float]]]:
    """Yields (size, result, result before, changes so far) of levels of `sizes`, coarse to fine, which a bar
    counts: `solve` returns the result on one, from the result before or None, and `change` the relative
    change from one result to the next.
    """
    before: Result | None = None
    changes = list[float]()
    for number, size in enumerate(sizes, 1):
        counted(level=number)
        result = solve(size, before)
        if before is not None:
            changes.append(change(before, result))
        yield size, result, before, changes
        before = result


@dataclass(frozen=True)
class GeometricSeries:
    """The rule for the error that remains on the last level: errors of levels are a geometric series.

    Errors that fall by a ratio r from level to level leave the last change, over r - 1, as the error of the
    last level. The ratio is the geometric mean of those of the changes that are given. Safety: it is taken
    no larger than `fastest`, since a small change may be luck, and no smaller than `slowest`, at which the
    method converges in theory; and a last change that is less than 1/luck of the one before counts as that.

    Attributes
    ----------
    expected : float
        Ratio where there is one change alone; nan where there are always two.
    slowest, fastest : float
    luck : float or None
        None: the ratio itself.
    alike : float
        Part of the finer level's error that the coarser one shares: 1, or less where steps of cells along an
        edge make errors of two levels independent, whose change is ``sqrt(1 + r^2)`` of the finer one.

    Examples
    --------
    >>> from microblock.model.refinement import GeometricSeries
    >>> GeometricSeries(expected=2.0).error([0.1])
    0.1
    """

    expected: float = np.nan
    slowest: float = 1.0
    fastest: float = np.inf
    luck: float | None = None
    alike: float = 1.0

    def ratio(self, changes: Sequence[Any]) -> Any:
        """Returns the ratio of errors of successive levels from changes, numbers or arrays (n,)."""
        if len(changes) == 1:
            return self.expected
        last = np.maximum(changes[-1], np.finfo(float).tiny)
        return np.clip((changes[0] / last) ** (1 / (len(changes) - 1)), self.slowest, self.fastest)

    def error(self, changes: Sequence[Any], ratio: Any = None) -> Any:
        """Returns the error of the last level from changes, numbers or arrays (n,), oldest first, and a
        ratio, or that of these changes.
        """
        ratio = self.ratio(changes) if ratio is None else ratio
        last = changes[-1]
        if len(changes) > 1:
            last = np.maximum(last, changes[-2] / (self.luck or ratio))
        return last / (ratio - self.alike)
