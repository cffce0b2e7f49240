"""The table "the paper and here": every statement of sections 4.1 and 4.2 beside what is computed."""

from . import statements_layers, statements_size, statements_strip, statements_zones
from .statement import row

STATEMENTS = (
    *statements_strip.STATEMENTS,
    *statements_zones.STATEMENTS,
    *statements_size.STATEMENTS,
    *statements_layers.STATEMENTS,
)


def table(records):
    """Every statement of sections 4.1 and 4.2 of the paper, what is computed here, and whether the two
    agree.
    """
    return [row(statement, records) for statement in STATEMENTS]


TABLES = {"paper_and_here": table}
