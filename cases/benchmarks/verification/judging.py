"""One loop for all sets: a problem is solved within a limit of time, a second code verifies it, a line says
how it went.
"""

import signal
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from microblock import MicroblockError


@dataclass(frozen=True)
class Case:
    """A problem of a set.

    Parameters
    ----------
    text : what it is
    rtol : what is asked for
    solve : gives a state, or a list of states
    verify : takes that; (error, estimate, what the judge does not know of it)
    """

    text: str
    rtol: float
    solve: Callable
    verify: Callable


class OutOfTime(BaseException):
    """Not an Exception, which a library may catch."""


def with_time_limit(seconds, function, *arguments):
    """The value of a function, or OutOfTime after so many seconds of processor time."""

    def stop(*_):
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return function(*arguments)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def outcome(case, seconds=60):
    """{class, ratio, error, estimate, bar, seconds, message} of a case.

    "right": the error is at most max(rtol, estimate) and what the judge does not know; "wrong", without a
    word, and "warned": it is not; "error": a typed error; "slow", "crash"; "unjudged": the judge has no
    answer.
    """
    row, start = dict.fromkeys(("ratio", "error", "estimate", "bar")) | {"message": ""}, time.process_time()
    try:
        state = with_time_limit(seconds, case.solve)
    except OutOfTime:
        return row | {"class": "slow", "seconds": seconds}
    except Exception as failure:  # whatever it is, it is a result
        name = "error" if isinstance(failure, MicroblockError) else "crash"
        return row | {"class": name, "message": f"{type(failure).__name__}: {failure}", "seconds": 0.0}
    row["seconds"] = time.process_time() - start
    return row | verdict(case, state, 4 * seconds)


def verdict(case, state, seconds=60):
    """{class, ratio, error, estimate, bar, message} of the state, or states, of a case."""
    words = [
        str(word) for solved in (state if isinstance(state, list) else [state]) for word in solved.warnings
    ]
    row = {"message": "; ".join(words)}
    try:
        error, estimate, bar = with_time_limit(seconds, case.verify, state)
    except Exception as failure:  # whatever it is, there is no verdict
        return row | {"class": "unjudged", "message": f"{type(failure).__name__}: {failure}"}
    except OutOfTime:
        return row | {"class": "unjudged", "message": "the judge takes too long"}
    ratio = error / (max(case.rtol, estimate or 0.0) + bar)
    name = "right" if ratio <= 1 else "unjudged" if np.isnan(ratio) else "warned" if words else "wrong"
    return row | {"class": name, "ratio": ratio, "error": error, "estimate": estimate, "bar": bar}


def told(number, case, row):
    """A case and its outcome on one line."""
    text = f"{number:4d} {row['class']:8s} {row['seconds']:5.1f} s  {case.text} rtol {case.rtol:.0e} "
    if row["ratio"] is not None:
        text += f" error {row['error']:.1e} estimate {row['estimate'] or np.nan:.1e} judge {row['bar']:.0e}"
        text += f" ratio {row['ratio']:.2f} "
    return text + row["message"][:100]


def run(name, cases, seconds=60):
    """Prints a line for each case, and a summary; the rows."""
    rows = []
    for number, case in cases:
        rows.append(outcome(case, seconds))
        print(told(number, case, rows[-1]), flush=True)
    known = [row for row in rows if row["ratio"] is not None]
    dull = [
        row["estimate"] / row["error"] for row in known if row["estimate"] and row["error"] > 2 * row["bar"]
    ]
    median, high = np.quantile(dull, [0.5, 0.9]) if dull else (np.nan, np.nan)
    worst = max((row["ratio"] for row in known), default=np.nan)
    print(
        f"== {name}: {dict(Counter(row['class'] for row in rows))}, largest ratio {worst:.2f}; "
        f"estimate over error: median {median:.2f}, 90 % {high:.2f} of {len(dull)}"
    )
    return rows
