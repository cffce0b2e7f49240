"""Maps of the study `limits`, as data: axes, how they are sampled, what a run may answer, and how an answer is called.

A map's `run(**setting)` is a function of a module (worker processes look it up by name) and returns an `Outcome`.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from microblock.errors import MicroblockError

# what became of a run, from best to worst; the last five must not happen
KINDS = ("delivered", "other method", "typed error", "missed", "not finite", "time limit", "untyped error", "crash")
ANSWERED = ("delivered", "other method", "missed")
NEAR = 0.2           # share of the runs that lie near a degeneracy
BRINK = 0.04         # of an axis counts as near its degenerate end
SQUARES = tuple(number**2 for number in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31))      # sizes of samples of strength 2


@dataclass(frozen=True)
class Axis:
    """A parameter between two ends; `degenerate` tells which ends are: "low", "high", "both" or "".

    scale : "linear"; "log"; or "gap", where `low` and `high` are distances below the value `limit`, from far to near on a
        logarithmic axis, which is how nu -> 1/2 and beta -> 2 are looked at
    choices : the values of an axis of names or orders, drawn at their places in this list; `low` and `high` are 0 and 1
    whole : whether the parameter is an integer
    """

    name: str
    label: str
    low: float
    high: float
    scale: str = "log"
    degenerate: str = ""
    limit: float | None = None
    choices: tuple = ()
    whole: bool = False

    def drawn(self, share):
        """What the chart's axis shows at a share in [0, 1] of the axis."""
        if self.scale == "linear":
            return self.low + share*(self.high - self.low)
        return self.low*(self.high/self.low)**share

    def value(self, share):
        """The parameter at a share in [0, 1] of the axis."""
        if self.choices:
            return self.choices[min(int(share*len(self.choices)), len(self.choices) - 1)]
        value = float(self.limit - self.drawn(share) if self.scale == "gap" else self.drawn(share))
        return round(value) if self.whole else value

    def place(self, value):
        """What the chart's axis shows for a value of the parameter."""
        if self.choices:
            return self.choices.index(value)
        return self.limit - value if self.scale == "gap" else value

    def brink(self, share, end):
        """A share in [0, 1] moved next to an end, "low" or "high"."""
        return BRINK*share if end == "low" else 1 - BRINK*share

    @property
    def ends(self):
        return {"": (), "both": ("low", "high")}.get(self.degenerate, (self.degenerate,))


def choice(name, label, *choices, degenerate=""):
    """An axis of names or orders; a degenerate end is that of the first or the last of them."""
    return Axis(name, label, 0.0, 1.0, "linear", degenerate, choices=choices)


@dataclass(frozen=True)
class Map:
    """A question to a method: `panels` {name of a parameter: its values} are told apart, the first two axes are drawn."""

    name: str
    question: str
    run: Callable
    axes: tuple
    panels: tuple = ("", ("",))      # the parameter that tells panels apart, and its values
    share: float = 1.0               # of the study's runs, over those of other maps
    error: str = "error"             # what `error` is, for the chart

    def settings(self, runs, seed):
        """[(setting, near a degeneracy)]: stratified in every pair of axes, then NEAR of all next to a degenerate end."""
        name, values = self.panels
        found = []
        for number, panel in enumerate(values):
            rng = np.random.default_rng([seed, *self.name.encode(), number])
            fixed = {name: panel} if name else {}
            found += [({**fixed, **self._setting(shares)}, near) for shares, near in self._shares(runs/len(values), rng)]
        return found

    def _shares(self, runs, rng):
        """[(share of each axis, near a degeneracy)]"""
        size = max([one for one in SQUARES if one <= max((1 - NEAR)*runs, 4)])
        prime = math.isqrt(size)
        strength = 2 if 1 < len(self.axes) <= prime + 1 else 1
        spread = qmc.LatinHypercube(len(self.axes), strength=strength, rng=rng).random(size)
        brinks = [(column, end) for column, axis in enumerate(self.axes) for end in axis.ends]
        found = [(shares, False) for shares in spread]
        for number, shares in enumerate(rng.random((math.ceil(NEAR/(1 - NEAR)*size), len(self.axes))) if brinks else ()):
            column, end = brinks[number % len(brinks)]
            shares[column] = self.axes[column].brink(shares[column], end)
            found.append((shares, True))
        return found

    def _setting(self, shares):
        return {axis.name: axis.value(share) for axis, share in zip(self.axes, shares)}


@dataclass(frozen=True)
class Outcome:
    """What a run answered: its true error, the error that was promised (None: nothing was), and what it said of itself.

    fallback : what was done instead of what was asked, where the result reports that
    oscillation, wrong_sign : further measures of a pressure, over its norm (or largest value): None where a map has none
    """

    error: float | None = None
    promise: float | None = None
    iterations: int | None = None
    estimate: float | None = None
    fallback: str | None = None
    oscillation: float | None = None
    wrong_sign: float | None = None

    @property
    def kind(self):
        numbers = [value for value in (self.error, self.estimate, self.oscillation, self.wrong_sign) if value is not None]
        if not np.isfinite(numbers).all():
            return "not finite"
        if self.promise is not None and self.error > self.promise:
            return "missed"
        return "other method" if self.fallback else "delivered"


MEASURES = ("error", "promise", "iterations", "estimate", "fallback", "oscillation", "wrong_sign")


def attempt(run, setting):
    """{measures, kind, message} of one run, whatever becomes of it."""
    blank = dict.fromkeys(MEASURES)
    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            outcome = run(**setting)
    except MicroblockError as failure:
        return {**blank, "kind": "typed error", "message": f"{type(failure).__name__}: {' '.join(str(failure).split())}"}
    except Exception as failure:      # whatever it is, it is a finding
        return {**blank, "kind": "untyped error", "message": f"{type(failure).__name__}: {' '.join(str(failure).split())}"}
    found = {name: getattr(outcome, name) for name in MEASURES}
    found.update({name: None for name, value in found.items() if isinstance(value, float) and not math.isfinite(value)})
    said = "; ".join(dict.fromkeys(str(one.message) for one in heard))
    return {**found, "kind": outcome.kind, "message": said or None}
