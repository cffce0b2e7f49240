"""The table "the paper and here": every statement of sections 4.1 and 4.2 beside what is computed.

A statement is data: where it stands, what it says, the quantity that decides it, how that is computed from the records
of the report (or from states of its own), and a judge that compares it with its error bar. No result is typed in.
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
    compute : records -> (value, error); None where nothing here can decide. `records` gives the records of a figure by
        its name. (None, None) where the quantity does not exist.
    judge : (value, error) -> True, False, or None where the error bar leaves it open
    because : how the verdict is reached, or why there is none
    """

    where: str
    says: str
    here: str
    compute: Callable | None
    judge: Callable | None
    because: str


def row(statement, records):
    """A statement as a row of the table."""
    value, error = statement.compute(records) if statement.compute else (None, None)
    verdict = None if value is None else statement.judge(value, error)
    return {"where": statement.where, "the_paper": statement.says, "here": statement.here,
            "value": None if value is None else float(value), "error": None if error is None else float(error),
            "verdict": {True: AGREES, False: DIFFERS, None: OPEN}[verdict], "because": statement.because}


def printed(number, half_digit):
    """Judge: equal to a printed number, to half a unit of its last digit and the error."""
    return lambda value, error: bool(abs(value - number) <= half_digit + error)


def above(limit):
    """Judge: larger than a limit by more than the error; open within it."""
    return lambda value, error: None if 0 < error >= abs(value - limit) else bool(value > limit)


def below(limit):
    """Judge: smaller than a limit by more than the error; open within it."""
    return lambda value, error: None if 0 < error >= abs(value - limit) else bool(value < limit)


def not_judged(value, error):
    """Judge: none; a choice of the paper's, and a number of ours beside it."""
    return None


def table(records):
    """Every statement of sections 4.1 and 4.2 of the paper, what is computed here, and whether the two agree."""
    from cases import paper_layers, paper_size, paper_strip, paper_zones      # they take their judges from here
    statements = (*paper_strip.STATEMENTS, *paper_zones.STATEMENTS, *paper_size.STATEMENTS, *paper_layers.STATEMENTS)
    return [row(statement, records) for statement in statements]


TABLES = {"paper_and_here": table}
