"""Numbers out of the records of the studies `speed` and `limits`, each with the rows that it rests on."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from microblock.data.records import read_records
from microblock.errors import NotConverged

RENAMED = {"paper's way": "AL, order 1"}  # methods of earlier records


@dataclass(frozen=True)
class Fact:
    """A number out of some records of a study.

    where : {column: a value, a tuple of values, or a `Range`}
    measure : records -> number
    """

    study: str
    where: dict
    measure: Callable

    def rows(self, records):
        """The records that it rests on; NotConverged where there is none: a sentence without data is none."""
        found = [
            row
            for row in records[self.study]
            if all(_within(row[name], wanted) for name, wanted in self.where.items())
        ]
        if not found:
            raise NotConverged(f"no record of {self.study} for the {self.told}")
        return found

    def value(self, records):
        return self.measure(self.rows(records))

    @property
    def told(self):
        """The selection and the measure, in words."""
        words = [
            f"{name} {wanted}" if isinstance(wanted, Range) else f"{name} = {wanted}"
            for name, wanted in self.where.items()
        ]
        return f"{self.measure.__doc__} of {', '.join(words)}"


@dataclass(frozen=True)
class Range:
    """Numbers from `low` to `high`, both included."""

    low: float = -math.inf
    high: float = math.inf

    def __str__(self):
        if self.low == -math.inf:
            return f"<= {self.high:g}"
        return f">= {self.low:g}" if self.high == math.inf else f"in [{self.low:g}, {self.high:g}]"


def records(path):
    """Records of a study, methods by the names that they have today."""
    return [
        {**row, "method": RENAMED.get(row["method"], row["method"])} if "method" in row else row
        for row in read_records(path)
    ]


def _within(cell, wanted):
    if isinstance(wanted, Range):
        return cell is not None and wanted.low <= cell <= wanted.high
    return cell in wanted if isinstance(wanted, tuple) else cell == wanted


def measured(text):
    """Decorator: the words for a measure."""

    def name(measure):
        measure.__doc__ = text
        return measure

    return name


def cost(error, column="total"):
    """Least seconds (setup and solving, or `column`) of the runs whose true error is below `error`: what
    reaching it costs.
    """

    @measured(f"least seconds ({column}) at a true error below {error:g}")
    def measure(rows):
        seconds = [
            row["setup"] + row["solve"] if column == "total" else row[column]
            for row in rows
            if row["error"] is not None and row["error"] <= error
        ]
        return min(seconds, default=math.inf)

    return measure


@measured("least true error, or the reference's own where that is larger,")
def best(rows):
    return min(
        (max(row["error"], row["floor"]) for row in rows if row["error"] is not None), default=math.inf
    )


@measured("number of runs")
def count(rows):
    return len(rows)


def share(*kinds):
    """Share of runs that became one of the kinds."""

    @measured(f"share of '{' or '.join(kinds)}'")
    def measure(rows):
        return sum(row["kind"] in kinds for row in rows) / len(rows)

    return measure


def below(bound, column="error"):
    """Share of the runs that answered in which a column stays below a bound."""

    @measured(f"share of answers with {column} below {bound:g}")
    def measure(rows):
        found = [row[column] for row in rows if row[column] is not None]
        return sum(value < bound for value in found) / max(len(found), 1)

    return measure


def worst_ratio(column, other):
    """Largest ratio of two columns over the runs that answered."""

    @measured(f"largest {column} over {other}")
    def measure(rows):
        return max((row[column] / row[other] for row in rows if row[column] is not None), default=math.nan)

    return measure


def of_finest(column, size):
    """A column of the run of the largest size that answered."""

    @measured(f"{column} at the largest {size}")
    def measure(rows):
        return max((row for row in rows if row[column] is not None), key=lambda row: row[size])[column]

    return measure


def quantile(column, level):
    """A quantile of a column over the runs that answered."""

    @measured(
        {0: "least ", 0.5: "median ", 1: "largest "}.get(level, f"{100 * level:g} % quantile of ") + column
    )
    def measure(rows):
        found = [row[column] for row in rows if row[column] is not None]
        return float(np.quantile(found, level)) if found else math.nan

    return measure


@dataclass(frozen=True)
class Claim:
    """A sentence with numbers in it: `text` formatted with the facts' values and what is `derived` from them.

    holds : says of the values, as keywords, whether the sentence is true; else it is no advice
    """

    text: str
    facts: dict
    holds: Callable
    derived: dict

    def values(self, records):
        """{name: number}; NotConverged where the sentence does not hold on these records."""
        found = {name: fact.value(records) for name, fact in self.facts.items()}
        found.update({name: work(**found) for name, work in self.derived.items()})
        if not all(math.isfinite(value) for value in found.values()) or not self.holds(**found):
            raise NotConverged(f"the records do not bear out: {self.text} ({found})")
        return found

    def told(self, records):
        return self.text.format(**self.values(records))


def claim(text, holds, derived=None, **facts):
    """A Claim, as data is written down: its facts by name."""
    return Claim(text, facts, holds, derived or {})
