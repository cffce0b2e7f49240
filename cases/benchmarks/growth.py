"""How time and peak memory grow with the number of unknowns, up to 10^6; a part of the study `speed`.

Each run is a process of its own: imports, a warm-up on the first level, then the run. Memory is the peak of
the resident set during the run over what was resident before it.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pandas as pd

from .peers import clock

LEVELS = {
    "half-plane": [{"rtol": 10.0**-power} for power in range(2, 9)],
    "cells": [{"nodes": 2**power} for power in (11, 14, 17, 20)],
    "condensed, order 4": [{"h": h, "order": 4} for h in (1.0, 0.5, 0.25, 0.125)],
    "AL, order 1": [{"h": h, "solver": "al", "domain": 18.0} for h in (0.2, 0.1, 0.05, 0.025, 0.0125)],
    "condensed, order 1": [{"h": h} for h in (0.2, 0.1, 0.05, 0.025, 0.0125)],
}
LONGEST, SPARE = 190.0, 0.7  # seconds, and share of the free memory, that a run may be expected to take


def line_of(file, name):
    """Megabytes of an entry of /proc."""
    lines = Path(f"/proc/{file}").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def measure(name, setting):
    """Columns of one run in this process, after a warm-up on the first level."""
    from . import speed

    problem = speed.PROBLEMS[speed.PAPER]
    problem.reference  # noqa: B018  cells take their window from it
    run = speed.METHODS[name].run
    run(problem, **LEVELS[name][0])
    before = line_of("self/status", "VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins again
    start = clock()
    answer = run(problem, **setting)
    spent, peak = clock() - start, line_of("self/status", "VmHWM")
    return {"unknowns": answer.unknowns, "seconds": spent, "megabytes": peak - before}


def apart(name, setting):
    """`measure` in a process of its own; a failed run says why."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        try:
            return process.submit(measure, name, setting).result()
        except Exception as failure:  # whatever it is, also a process that dies
            return {"failure": f"{type(failure).__name__}: {failure}"[:200]}


def solve(quick=False):
    """A table of all methods and levels, up to where the next one would take too long or too much memory."""
    rows = []
    for name, settings in LEVELS.items():
        own = []
        for setting in settings[: 2 if quick else None]:
            if len(own) > 1:
                larger = own[-1]["unknowns"] / own[-2]["unknowns"]
                # exponents over unknowns, for what the next level may cost
                seconds, megabytes = own[-1]["seconds"] * larger**1.4, own[-1]["megabytes"] * larger**1.25
                if seconds > LONGEST or megabytes > SPARE * line_of("meminfo", "MemAvailable"):
                    break
            own.append({"method": name, **setting, **apart(name, setting)})
            if "failure" in own[-1]:
                break
        rows += own
    return pd.DataFrame(rows)
