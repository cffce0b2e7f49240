"""What a statement of the paper is, and how the verdict on it is reached.

A statement is data: where it stands, what it says, the quantity that decides it, how that is computed from
the records of the report (or from further states), and a function that compares it with its error bar. No
result is typed in.
"""

from collections.abc import Callable
from dataclasses import dataclass

AGREES, DIFFERS, OPEN = "agrees", "differs", "not determined here"


@dataclass(frozen=True)
class Statement:
    """One statement of the paper.

    Parameters
    ----------
    where, says : place in the paper, and its words in short
    here : the quantity that is computed
    compute : records -> (value, error); None where nothing here can decide. `records` gives the records of a
        figure by its name. (None, None) where the quantity does not exist.
    verdict : (value, error) -> True, False, or None where the error bar leaves it open
    because : how the verdict is reached, or why there is none
    """

    where: str
    says: str
    here: str
    compute: Callable | None
    verdict: Callable | None
    because: str


def row(statement, records):
    """A statement as a row of the table."""
    value, error = statement.compute(records) if statement.compute else (None, None)
    verdict = None if value is None else statement.verdict(value, error)
    return {
        "where": statement.where,
        "the_paper": statement.says,
        "here": statement.here,
        "value": None if value is None else float(value),
        "error": None if error is None else float(error),
        "verdict": {True: AGREES, False: DIFFERS, None: OPEN}[verdict],
        "because": statement.because,
    }


def printed(number, half_digit):
    """Verdict: equal to a printed number, to half a unit of its last digit and the error."""
    return lambda value, error: bool(abs(value - number) <= half_digit + error)


def above(limit):
    """Verdict: larger than a limit by more than the error; open within it."""
    return lambda value, error: None if 0 < error >= abs(value - limit) else bool(value > limit)


def below(limit):
    """Verdict: smaller than a limit by more than the error; open within it."""
    return lambda value, error: None if 0 < error >= abs(value - limit) else bool(value < limit)


def no_verdict(value, error):
    """Verdict: none; a choice made in the paper, beside a number of ours."""
    return None
