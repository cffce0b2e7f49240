"""Maps of the study `limits`, as data: axes, how they are sampled, what a run may answer, and how an answer
is called.

A map's `run(**setting)` is a function of a module (worker processes look it up by name) and returns an
`Outcome`.
"""

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from microblock.errors import MicroblockError

# what became of a run, from best to worst; the last five must not happen
KINDS = (
    "delivered",
    "other method",
    "typed error",
    "missed",
    "not finite",
    "time limit",
    "untyped error",
    "crash",
)
MEASURES = ("error", "promise", "iterations", "estimate", "fallback", "oscillation", "wrong_sign", "judge")
ANSWERED = ("delivered", "other method", "missed")
NEAR = 0.2  # share of the runs that lie near a degeneracy
BRINK = 0.04  # of an axis counts as near its degenerate end
# sizes of samples of strength 2
SQUARES = tuple(number**2 for number in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31))


@dataclass(frozen=True)
class Axis:
    """A parameter between two ends; `degenerate` tells which ends are: "low", "high", "both" or "".

    label : what the table of failures calls it; empty: its name
    scale : "linear"; "log"; or "gap", where `low` and `high` are distances below the value `limit`, from far
    to near on a
        logarithmic axis, which is how nu -> 1/2 and beta -> 2 are looked at
    choices : the values of an axis of names or orders; `low` and `high` are 0 and 1
    whole : whether the parameter is an integer
    """

    name: str
    label: str
    low: float = 0.0
    high: float = 1.0
    scale: str = "log"
    degenerate: str = ""
    limit: float | None = None
    choices: tuple = ()
    whole: bool = False

    def drawn(self, share):
        """The parameter, or its distance from `limit`, at a share in [0, 1] of the axis."""
        if self.scale == "linear":
            return self.low + share * (self.high - self.low)
        return self.low * (self.high / self.low) ** share

    def value(self, share):
        """The parameter at a share in [0, 1] of the axis."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        value = float(self.limit - self.drawn(share) if self.scale == "gap" else self.drawn(share))
        return round(value) if self.whole else value

    def place(self, value):
        """What `label` says: a value of the parameter, or its distance from `limit`."""
        return self.limit - value if self.scale == "gap" else value

    def brink(self, share, end):
        """A share in [0, 1] moved next to an end, "low" or "high"."""
        return BRINK * share if end == "low" else 1 - BRINK * share

    @property
    def ends(self):
        return {"": (), "both": ("low", "high")}.get(self.degenerate, (self.degenerate,))


def choice(name, label, *choices, degenerate=""):
    """An axis of names or orders; a degenerate end is that of the first or the last of them."""
    return Axis(name, label, 0.0, 1.0, "linear", degenerate, choices=choices)


@dataclass(frozen=True)
class Map:
    """A question to a method: `panels` (name of a parameter, its values) are sampled apart."""

    name: str
    question: str
    run: Callable
    axes: tuple
    panels: tuple = ("", ("",))  # the parameter that tells panels apart, and its values
    share: float = 1.0  # of the study's runs, over those of other maps
    error: str = "error"  # what `error` is

    def __post_init__(self):
        names = [axis.name for axis in self.axes] + [self.panels[0]]
        taken = {"map", "near", "kind", "message", "spent", *MEASURES} & {*names}
        if taken or len(set(names)) < len(names):  # a column of the records would hide the other
            raise ValueError(f"{self.name}: names of parameters must differ from each other and from {taken}")

    def settings(self, runs, seed):
        """[(setting, near a degeneracy)]: stratified in every pair of axes, then NEAR of all next to a
        degenerate end.
        """
        name, values = self.panels
        found = []
        for number, panel in enumerate(values):
            rng = np.random.default_rng([seed, *self.name.encode(), number])
            fixed = {name: panel} if name else {}
            found += [
                ({**fixed, **self._setting(shares)}, near)
                for shares, near in self._shares(runs / len(values), rng)
            ]
        return found

    def _shares(self, runs, rng):
        """[(share of each axis, near a degeneracy)]"""
        brinks = [(column, end) for column, axis in enumerate(self.axes) for end in axis.ends]
        near = math.ceil(NEAR * runs) if brinks else 0
        found = [(shares, False) for shares in self._spread(round(runs) - near, rng)]
        for number, shares in enumerate(rng.random((near, len(self.axes)))):
            column, end = brinks[number % len(brinks)]
            shares[column] = self.axes[column].brink(shares[column], end)
            found.append((shares, True))
        return found

    def _spread(self, runs, rng):
        """Shares of the axes, array (runs, axes): first a sample of strength two, then a plain one of what is
        left.
        """
        axes = len(self.axes)
        size = (
            max((one for one in SQUARES if one <= runs and axes <= math.isqrt(one) + 1), default=0)
            if axes > 1
            else 0
        )
        paired = [qmc.LatinHypercube(axes, strength=2, rng=rng).random(size)] if size else []
        return np.concatenate([*paired, qmc.LatinHypercube(axes, rng=rng).random(runs - size)])

    def _setting(self, shares):
        return {axis.name: axis.value(share) for axis, share in zip(self.axes, shares)}


@dataclass(frozen=True)
class Outcome:
    """What a run answered: its true error, the error that was promised (None: nothing was), and what it said
    of itself.

    fallback : what was done instead of what was asked, where the result reports that
    judge : what the error was measured against, where a map has several; its own error is part of the promise
    oscillation, wrong_sign : further measures of a pressure, over its norm (or largest value): None where a
    map has none
    """

    error: float | None = None
    promise: float | None = None
    iterations: int | None = None
    estimate: float | None = None
    fallback: str | None = None
    oscillation: float | None = None
    wrong_sign: float | None = None
    judge: str | None = None

    @property
    def kind(self):
        numbers = [
            value
            for value in (self.error, self.estimate, self.oscillation, self.wrong_sign)
            if value is not None
        ]
        if not np.isfinite(numbers).all():
            return "not finite"
        if self.promise is not None and self.error > self.promise:
            return "missed"
        return "other method" if self.fallback else "delivered"


def attempt(run, setting):
    """{measures, kind, message, spent} of one run, whatever becomes of it; `spent` are processor seconds."""
    start, found = time.process_time(), dict.fromkeys(MEASURES)
    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            outcome = run(**setting)
    except Exception as failure:  # whatever it is, it is a finding
        kind = "typed error" if isinstance(failure, MicroblockError) else "untyped error"
        message = f"{type(failure).__name__}: {' '.join(str(failure).split())}"
    else:
        found.update({name: _finite(getattr(outcome, name)) for name in MEASURES})
        kind, message = outcome.kind, "; ".join(dict.fromkeys(str(one.message) for one in heard)) or None
    return {**found, "kind": kind, "message": message, "spent": time.process_time() - start}


def _finite(value):
    return None if isinstance(value, float) and not math.isfinite(value) else value
