"""What each method is expected to take for an answer; the methods are tried in the order of seconds."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..cost import MOST_MEMORY, Cost
from ..errors import MicroblockError, NotConverged, shortened
from .methods import MethodLike
from .refinement import SECONDS

COST_OF_A_MISS = 2.0  # seconds that an answer to rtol may take more than one that misses it


@dataclass(frozen=True)
class Candidate:
    """A method in a `Plan`.

    Attributes
    ----------
    solver : Solver
    cost : Cost or None
        None where the method predicts nothing, or cannot answer.
    refusal : str
        Why the method cannot answer, without a cost; empty where it can.
    """

    solver: Any
    cost: Cost | None = None
    refusal: str = ""

    @property
    def method(self) -> MethodLike:
        """The method, as `Contact` takes it."""
        return self.solver.options

    @property
    def name(self) -> str:
        return type(self.method).__name__.lower()

    def __repr__(self) -> str:
        cost = self.cost
        if cost is None:
            return f"{self.name:9s} {shortened(self.refusal) or 'no prediction'}"
        memory = f"{cost.memory / 1e6:9.2g} MB" if cost.memory < 9.95e8 else f"{cost.memory / 1e9:9.2g} GB"
        line = f"{self.name:9s} {cost.seconds:8.2g} s{memory}{cost.unknowns:9.2g} unknowns"
        return line + ", above rtol" * cost.misses


@dataclass(frozen=True)
class Plan:
    """The methods for an answer, in the order in which they are tried, and why others cannot answer.

    Attributes
    ----------
    candidates : tuple of Candidate
        Those that can answer.
    refused : tuple of Candidate
    """

    candidates: tuple[Candidate, ...]
    refused: tuple[Candidate, ...] = ()

    @property
    def reason(self) -> str:
        """Why the first candidate is the first."""
        if not self.candidates:
            return "no method can answer"
        if len(self.candidates) == 1:
            return "the only method"
        first, second = (candidate.cost for candidate in self.candidates[:2])
        if first is None or second is None or first.seconds > second.seconds:
            return "the usual method of the body"
        return "the fastest"

    def __repr__(self) -> str:
        first, *later = [*map(repr, self.candidates)] or [""]
        return "\n".join((f"{first}  <- {self.reason}", *later, *map(repr, self.refused)))


def planned(solvers: Sequence[Any], load: float | None, approach: float | None, rtol: float | None) -> Plan:
    """Returns the Plan of Solvers, the usual one first, at a load or an approach to rtol, or to the usual one
    of the first that has one: by their seconds if all predict them. Those of others count by their
    `time_factor`, since states of the usual method have more information: on a half-plane edges of zones and
    fields below the surface. What would take more than MOST_MEMORY is refused. What is expected to miss rtol
    comes COST_OF_A_MISS later.
    """
    able: list[tuple[float | None, Candidate]] = []
    refused: list[Candidate] = []
    if rtol is None:
        rtol = next((solver.goal(None) for solver in solvers if solver.usual_rtol), None)
    for number, solver in enumerate(solvers):
        try:
            cost = solver.predicted(load, approach, rtol)
            if cost and cost.memory > MOST_MEMORY:
                raise NotConverged(f"some {cost.memory / 1e9:.2g} GB of memory would be needed")
        except MicroblockError as failure:
            refused.append(Candidate(solver, refusal=str(failure)))
            continue
        weighted = None
        if cost:
            time_factor = solver.time_factor if number else 1.0
            weighted = cost.seconds * time_factor + COST_OF_A_MISS * cost.misses
        able.append((weighted, Candidate(solver, cost)))
    if all(weighted for weighted, _ in able):
        able.sort(key=lambda pair: pair[0] or 0.0)
    return Plan(tuple(candidate for _, candidate in able), tuple(refused))


def first_answer(
    candidates: Iterable[Candidate],
    answer: Callable[[Candidate], Any],
    shortfall: Callable[[Any], str] | None = None,
) -> Any:
    """Returns the answer of the first Candidate that converges, which notes those before that did not; raises
    NotConverged if none does. Where no rtol was asked for, `shortfall` says in words what an answer lacks: of
    such answers the one with the smallest error estimate is returned, and notes it, and what takes long is
    not tried: SECONDS after an answer, ten times that after failures alone.
    """
    failures: dict[str, NotConverged] = {}
    answers: list[Any] = []
    for candidate in candidates:
        longest = SECONDS if answers else 10 * SECONDS
        is_first = not answers and not failures
        if shortfall and not is_first and candidate.cost and candidate.cost.seconds > longest:
            continue
        try:
            result = answer(candidate)
        except NotConverged as failure:
            failures[candidate.name] = failure
            continue
        if failures:
            failed = "; ".join(f"{name} ({failure})" for name, failure in failures.items())
            result = result.noting(f"{candidate.name} instead of {failed}")
        if not shortfall or not shortfall(result):
            return result
        answers.append(result)
    if answers and shortfall:
        best = min(answers, key=lambda result: result.error_estimate)
        return best.noting(shortfall(best))
    raise _together(failures)


def _together(failures: dict[str, NotConverged]) -> NotConverged:
    """Returns the NotConverged of failures {method: failure}, with the smallest rtol that is met."""
    (_, first), *later = failures.items()
    if not later:
        return first
    words = str(first) + "".join(f"; {name}: {failure}" for name, failure in later)
    figures = [failure.rtol_reached for failure in failures.values() if failure.rtol_reached is not None]
    together = NotConverged(
        words, reached=first.reached, iterations=first.iterations, rtol_reached=min(figures, default=None)
    )
    together.__cause__ = first
    return together
