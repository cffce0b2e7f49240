"""Seeded runs of the study `limits`: how parameters are drawn, what a run may answer, and how an answer is
called.
"""

import math
import time
import warnings
from collections.abc import Callable
from concurrent.futures import TimeoutError
from dataclasses import asdict, dataclass

import numpy as np
from pebble import ProcessExpired
from scipy.stats import qmc

from microblock import MicroblockError
from microblock.data.sweeps import processes

# what became of a run, from best to worst; the last five must not happen
KINDS = ("delivered", "typed error", "missed", "not finite", "time limit", "untyped error", "crash")
NEAR = 0.2  # share of the runs that lie near a degeneracy
BRINK = 0.04  # of an axis counts as near its degenerate end


@dataclass(frozen=True)
class Axis:
    """A parameter between two ends, or of some names.

    scale : "log"; "linear"; "whole" (a logarithmic axis of integers); or "below 1/2", where low and high are
        distances from 1/2
    ends : which ends are degenerate, 0 and 1
    """

    name: str
    low: float = 0.0
    high: float = 1.0
    scale: str = "log"
    ends: tuple = ()
    names: tuple = ()

    def value(self, share):
        """The parameter at a share in [0, 1) of the axis."""
        if self.names:
            return self.names[int(share * len(self.names))]
        if self.scale == "linear":
            return self.low + share * (self.high - self.low)
        value = self.low * (self.high / self.low) ** share
        return {"whole": round(value), "below 1/2": 0.5 - value}.get(self.scale, float(value))


@dataclass(frozen=True)
class Map:
    """A function of a module (worker processes look it up by name), how often it runs, and its parameters."""

    name: str
    run: Callable
    runs: int
    axes: tuple

    def settings(self, runs, seed):
        """[(setting, near a degeneracy)]: a Latin hypercube, NEAR of it moved next to a degenerate end."""
        rng = np.random.default_rng([seed, *self.name.encode()])
        shares = qmc.LatinHypercube(len(self.axes), rng=rng).random(runs)
        brinks = [(column, end) for column, axis in enumerate(self.axes) for end in axis.ends]
        near = math.ceil(NEAR * runs) if brinks else 0
        for number, row in enumerate(shares[:near]):
            column, end = brinks[number % len(brinks)]
            row[column] = BRINK * row[column] if end == 0 else 1 - BRINK * (1 - row[column])
        settings = [{axis.name: axis.value(share) for axis, share in zip(self.axes, row)} for row in shares]
        return [(setting, number < near) for number, setting in enumerate(settings)]


@dataclass(frozen=True)
class Outcome:
    """What a run answered: its true error, the error that was promised, and what it said of itself.

    promise : None where nothing was promised
    judge : what the error was measured against; its own error is part of the promise
    oscillation, tension : further measures of a pressure
    """

    error: float
    promise: float | None = None
    estimate: float | None = None
    judge: str | None = None
    oscillation: float | None = None
    tension: float | None = None

    @property
    def kind(self):
        if not np.isfinite(
            [self.error, *(v for v in (self.estimate, self.oscillation) if v is not None)]
        ).all():
            return "not finite"
        if self.promise is not None and self.error > self.promise:
            return "missed"
        return "delivered"


def attempt(run, setting):
    """{measures, kind, message, spent} of one run, whatever becomes of it; `spent` are processor seconds."""
    start = time.process_time()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            outcome = run(**setting)
        words = "; ".join(dict.fromkeys(str(one.message) for one in caught))
        row = {**asdict(outcome), "kind": outcome.kind, "message": words}
    except Exception as failure:  # whatever it is, it is a result
        kind = "typed error" if isinstance(failure, MicroblockError) else "untyped error"
        row = {"kind": kind, "message": f"{type(failure).__name__}: {' '.join(str(failure).split())}"}
    return row | {"spent": time.process_time() - start}


def records(work, workers, limit):
    """Yields the rows of `attempt` in the order of `work`, [(run, setting)], by worker processes.

    A run beyond `limit` seconds is stopped along with its process; so is a run whose process dies.
    """
    with processes(workers) as pool:
        for future in [pool.schedule(attempt, one, timeout=limit) for one in work]:
            try:
                yield future.result()
            except TimeoutError:
                yield {"kind": "time limit", "message": f"stopped after {limit:g} s"}
            except ProcessExpired as failure:
                yield {"kind": "crash", "message": f"the process died with exit code {failure.exitcode}"}
