"""Runs of the study `limits` in worker processes, each with a limit of its wall time."""

import multiprocessing
from concurrent.futures import TimeoutError, as_completed

from pebble import ProcessExpired, ProcessPool

from cases.limits_maps import MEASURES, attempt

START = 300.0     # seconds that a new worker may take for its imports


def records(work, workers, limit, progress):
    """Answers of `attempt` in the order of `work`, [(run, setting)]; `progress()` is called after each.

    A run beyond `limit` seconds is stopped along with its process; so is one whose process dies.
    """
    blank = dict.fromkeys((*MEASURES, "spent"))

    def lost(_, words):
        return {**blank, "kind": "crash" if "died" in words else "time limit", "message": words}
    return answers(attempt, work, workers, limit, progress, lost)


def answers(function, work, workers, limit, progress, lost):
    """function(*arguments) for each arguments of `work`, in its order; where it was stopped or died, lost(arguments, words)."""
    found = [None]*len(work)
    spawn = multiprocessing.get_context("spawn")      # a fresh NGSolve: forked ones share its task manager's locks
    with ProcessPool(workers, context=spawn) as pool:
        for waiting in [pool.schedule(int, timeout=START) for _ in range(workers)]:
            waiting.result()
        numbers = {pool.schedule(function, arguments, timeout=limit): number for number, arguments in enumerate(work)}
        try:
            for future in as_completed(numbers):
                number = numbers[future]
                try:
                    found[number] = future.result()
                except TimeoutError:
                    found[number] = lost(work[number], f"stopped after {limit:g} s")
                except ProcessExpired as failure:
                    found[number] = lost(work[number], f"the process died with exit code {failure.exitcode}")
                progress()
        except BaseException:
            pool.stop()      # else leaving would wait for all that is scheduled
            raise
    return found
