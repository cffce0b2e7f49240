"""Does the program take the fastest method?

The method that the program takes is the fastest, or nearly so, of those that can answer.

:Geometry:  200 seeded problems on half-planes, periods, blocks, meshes and half-spaces, as in `verification`
:Equations: those of the paper, with a second body and with friction where a problem has them
:Method:    each problem by the method that the program takes and by every other one that can answer
:Reference: the second codes of `verification`, for the chosen method, or else another method
:Units:     processor seconds of one thread; bytes of the peak over what was there before; relative L2 errors

`python -m cases.benchmarks.choice [--first K] [--count N]` adds rows to the record.
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import microblock as mb

from .growth import line_of
from .verification import SEED, friction, judging, lines, obstacles, space_problems

RECORD = Path(__file__).parent / "results" / "choice.csv"
KINDS = {"line": 80, "samples": 20, "period": 20, "block": 20, "mesh": 20, "space": 20, "friction": 20}
TOLERANCES = 1e-2, 1e-3, 1e-5
LONGEST = 60  # seconds of a run, and of a judge
LARGE = 3e8  # bytes above which memory is compared: libraries take tens of MB to begin
ANSWERS = ["right", "warned", "wrong", "unjudged"]


def drawn(kind, k):
    """(words, Contact without a method, load, rtol, verify) of problem k of a kind but friction."""
    if kind in ("line", "samples"):
        number = 15 * k + 10 if kind == "samples" else k  # the tenth kind of obstacles are profiles
        words, problem, load, window, features = obstacles.drawn(SEED, number, mb)
        verify = lines.by_panels(problem, load, window=window, features=features)
        return words, problem, load, TOLERANCES[k % 3] if kind == "line" else 1e-2, verify
    if kind == "space":
        scene = space_problems.scene(8 * k)
        return (
            scene.kind,
            *space_problems.problem(mb, scene),
            space_problems.RTOL,
            space_problems.case(8 * k).verify,
        )
    method = {"period": "cells", "block": "fitted", "mesh": "body"}[kind]
    found = (lines.drawn(method, number) for number in range(3 * k, 10**6))
    return next(
        (words, problem.with_(method=None) if kind != "mesh" else problem, load, rtol, verify)
        for words, problem, load, rtol, verify in found
        if kind != "period" or problem.body.period
    )


def answered(kind, k):
    """A row for each method of a problem, the chosen one first."""
    if kind == "friction":
        case = friction.case(k)
        return [{"words": case.text, "rtol": case.rtol, "method": "chosen", **measured(case)[0]}]
    words, problem, load, rtol, verify = drawn(kind, k)
    plan, start = None, time.process_time()
    with suppress(mb.MicroblockError):
        plan = problem.plan(load=load, rtol=rtol)
    rows = [{"words": words, "rtol": rtol, "method": "chosen", "planning": time.process_time() - start}]
    for known in () if plan is None else plan.candidates:  # imports and the kernels of the solid
        simple = mb.Sphere(1.0) if kind == "space" else mb.Cylinder(1.0)
        with suppress(mb.MicroblockError):
            problem.with_(obstacle=simple, method=known.method).solve(load=load)
    if plan is not None and plan.candidates:
        rows[0] |= {"taken": plan.candidates[0].name} | expected(plan.candidates[0])
    verified = partial(judging.within, LONGEST, verify)
    row, state = measured(judging.Case(words, rtol, lambda: problem.solve(load=load, rtol=rtol), verified))
    rows[0] |= row
    # a method that takes much longer than the chosen one need not end, but where it judges
    longest = LONGEST if state is None or row["class"] == "unjudged" else 2 * row["seconds"] + 1
    for other in () if plan is None else (*plan.candidates, *plan.refused):
        alone = problem.with_(method=other.method)
        case = judging.Case(words, rtol, lambda alone=alone: alone.solve(load=load, rtol=rtol), None)
        row, second = measured(case, longest)
        rows.append({"words": words, "rtol": rtol, "method": other.name} | expected(other) | row)
        if (
            rows[0]["class"] == "unjudged"
            and rows[0].get("taken") != other.name
            and None not in (state, second)
        ):
            verify = partial(beside, second)
            rows[0] |= judging.verdict(judging.Case(words, rtol, None, verify), state)
    return rows


def beside(true, state):
    """A `Case.verify` by the State of another method."""
    return lines.error(state, true), state.error_estimate, true.error_estimate


def expected(candidate):
    """What a candidate of a plan is expected to take."""
    names = "predicted", "predicted_memory", "predicted_unknowns"
    return dict(zip(names, candidate.cost or ()))


def measured(case, longest=LONGEST):
    """What became of a case, its seconds, up to the longest, and the peak of its memory; and its state, or
    None.
    """
    before = line_of("self/status", "VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins again
    known, states = {}, [None]

    def solve():
        try:
            states.append(case.solve())
            known["unknowns"] = getattr(states[-1], "unknowns", None)  # a history has none
            return states[-1]
        finally:
            known["memory"] = 2**20 * (line_of("self/status", "VmHWM") - before)

    verify = case.verify or (lambda state: (0.0, state.error_estimate, 0.0))
    row = judging.outcome(judging.Case(case.text, case.rtol, solve, verify), longest)
    return row | known, states[-1]


def alone(kind, k):
    """`answered` in a process of its own, with the kind and the number."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        rows = process.submit(answered, kind, k).result()
    return [{"kind": kind, "number": k, **row} for row in rows]


def profile(runs):
    """Time of the chosen method over the best one's, of problems that some method answers: array (n,), inf
    where it gave no answer.
    """
    answers = runs[runs["class"].isin(ANSWERS)]
    best = answers.groupby(["kind", "number"]).seconds.min()
    chosen = answers[answers.method == "chosen"].set_index(["kind", "number"]).seconds
    return np.sort((chosen.reindex(best.index) / best).fillna(np.inf).to_numpy())


def agreement(runs):
    """Predicted over measured seconds of the methods that were taken and answered, and bytes of those above
    LARGE: two arrays. Other methods run later in the same process, on memory that is there.
    """
    taken = runs[(runs.method == "chosen") & runs["class"].isin(ANSWERS) & runs.predicted.notna()]
    large = taken[taken.memory > LARGE]
    return (taken.predicted / taken.seconds).to_numpy(), (large.predicted_memory / large.memory).to_numpy()


def told(runs):
    """A line on the choice and the predictions."""
    shares = [np.mean(profile(runs) <= bar) for bar in (1.5, 3)]
    words = f"chosen within 1.5 and 3 times the least time: {shares[0]:.0%} and {shares[1]:.0%}"
    for name, ratios, bar in zip(("predicted", "memory"), agreement(runs), (3, 1.5)):
        if len(ratios):  # few problems need much memory
            within = np.mean(np.abs(np.log(ratios)) <= np.log(bar))
            words += f"; {name} within {bar} times: {within:.0%} of {len(ratios)}"
    return words


def figure(runs=None):
    """The method that the program takes is nearly always the fastest."""
    runs = pd.read_csv(RECORD) if runs is None else runs
    ratios = profile(runs)
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 2.6))
    shares = np.arange(1, len(ratios) + 1) / len(ratios)
    axis.step([1, *ratios], [0, *shares], where="post", color="C0")
    axis.axvline(1.5, color="0.6", linestyle=":")
    axis.set(xscale="log", xlim=(0.95, 30), ylim=(0, 1.02), ylabel="share of problems")
    axis.set_xlabel("time of the method over the least time")
    axis.set_xticks([1, 1.5, 3, 10, 30], ["1", "1.5", "3", "10", "30"])
    axis.minorticks_off()
    return drawing


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=sum(KINDS.values()))
    given = parser.parse_args(words)
    problems = [(kind, k) for kind, count in KINDS.items() for k in range(count)]
    for kind, k in problems[given.first : given.first + given.count]:
        rows = pd.DataFrame(alone(kind, k))
        known = pd.read_csv(RECORD) if RECORD.exists() else rows[:0]
        pd.concat([known, rows], ignore_index=True).to_csv(RECORD, index=False)
        print(rows.drop(columns="message").to_string(header=False, index=False), flush=True)
    print(told(pd.read_csv(RECORD)))


if __name__ == "__main__":
    main()
