"""Runs of studies in worker processes, each with a limit of its wall time, or of its processor time."""

import signal
from concurrent.futures import TimeoutError, as_completed

from pebble import ProcessExpired

from microblock.data.sweeps import processes

from .limits_maps import MEASURES, attempt

START = 300.0  # seconds that a new worker may take for its imports


def records(work, workers, limit, progress):
    """Answers of `attempt` in the order of `work`, [(run, setting)]; `progress()` is called after each.

    A run beyond `limit` seconds is stopped along with its process; so is one whose process dies.
    """
    blank = dict.fromkeys((*MEASURES, "spent"))

    def lost(_, words):
        return {**blank, "kind": "crash" if "died" in words else "time limit", "message": words}

    return answers(attempt, work, workers, limit, progress, lost)


def answers(function, work, workers, limit, progress, lost):
    """function(*arguments) for each arguments of `work`, in its order; where it was stopped or died,
    lost(arguments, words).
    """
    found = [None] * len(work)
    with processes(workers) as pool:
        for waiting in [pool.schedule(int, timeout=START) for _ in range(workers)]:
            waiting.result()
        numbers = {
            pool.schedule(function, arguments, timeout=limit): number for number, arguments in enumerate(work)
        }
        for future in as_completed(numbers):
            number = numbers[future]
            try:
                found[number] = future.result()
            except TimeoutError:
                found[number] = lost(work[number], f"stopped after {limit:g} s")
            except ProcessExpired as failure:
                found[number] = lost(work[number], f"the process died with exit code {failure.exitcode}")
            progress()
    return found


class OutOfTime(BaseException):
    """Not an Exception: what catches those must not catch this."""


def within(seconds, function):
    """function(), or OutOfTime after so many seconds of processor time; in a process's main thread."""

    def stop(*_):
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return function()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def told_on_a_line(failure):
    """Type and text of an exception on one line."""
    return f"{type(failure).__name__}: {' '.join(str(failure).split())}"
