"""Does the program take the fastest method?

The method that the program takes is the fastest, or nearly so, of those that can answer.

:Geometry:  200 seeded problems on half-planes, periods, blocks, meshes and half-spaces, as in `verification`
:Equations: those of the paper, with a second body and with friction where a problem has them
:Method:    each problem by the method that the program takes and by every other one that can answer
:Reference: the second codes of `verification`, for the chosen method, or else another method
:Units:     processor seconds of one thread; relative L2 errors

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

from .verification import SEED, friction, judging, lines, obstacles, space_problems

RECORD = Path(__file__).parent / "results" / "choice.csv"
KINDS = {"line": 80, "samples": 20, "period": 20, "block": 20, "mesh": 20, "space": 20, "friction": 20}
TOLERANCES = 1e-2, 1e-3, 1e-5
LONGEST = 60  # seconds of a run, and of a judge
ANSWERS = ["right", "warned", "wrong", "unjudged"]


def drawn(kind, k):
    """(words, Contact without a method, load, rtol, verify) of problem k of a kind but friction."""
    if kind == "line":
        words, problem, load, window, features = obstacles.drawn(SEED, k, mb)
        verify = lines.by_panels(problem, load, window=window, features=features)
        return words, problem, load, TOLERANCES[k % 3], verify
    if kind == "samples":  # the tenth kind of obstacles are profiles
        words, problem, load, window, features = obstacles.drawn(SEED, 15 * k + 10, mb)
        return words, problem, load, 1e-2, lines.by_panels(problem, load, window=window, features=features)
    if kind == "space":
        surface = space_problems.surface(8 * k)
        problem, load = space_problems.problem(surface)
        verify = space_problems.case(8 * k).verify
        return surface.kind, problem, load, space_problems.RTOL, verify
    if kind == "mesh":
        return lines.drawn("body", 3 * k)
    method = {"period": "cells", "block": "fitted"}[kind]
    number = 3 * k
    words, problem, load, rtol, verify = lines.drawn(method, number)
    while kind == "period" and not problem.body.period:
        number += 1
        words, problem, load, rtol, verify = lines.drawn(method, number)
    return words, problem.with_(method=None), load, rtol, verify


def answered(kind, k):
    """A row for each method of a problem, the chosen one first."""
    if kind == "friction":
        case = friction.case(k)
        return [{"words": case.text, "rtol": case.rtol, "method": "chosen", **judging.outcome(case, LONGEST)}]
    words, problem, load, rtol, verify = drawn(kind, k)
    start = time.process_time()
    candidates = []
    with suppress(mb.MicroblockError):
        plan = problem.plan(load=load, rtol=rtol)
        candidates = [*plan.candidates, *plan.refused]
    planning = time.process_time() - start
    warm_up(problem, load, candidates)
    about = {"words": words, "rtol": rtol}
    chosen = judging.Case(words, rtol, lambda: problem.solve(load=load, rtol=rtol), verify)
    rows = [about | {"method": "chosen", "planning": planning} | judging.outcome(chosen, LONGEST)]
    if candidates:
        rows[0] |= {"taken": candidates[0].name} | expected(candidates[0])
    # a method that takes much longer than the chosen one need not end
    longest = min(LONGEST, 2 * (rows[0]["seconds"] or LONGEST) + 1)
    for candidate in candidates:
        solve = partial(problem.with_(method=candidate.method).solve, load=load, rtol=rtol)
        case = judging.Case(words, rtol, solve, lambda state: (0.0, state.error_estimate, 0.0))
        outcome = judging.outcome(case, longest)
        rows.append(about | {"method": candidate.name} | expected(candidate) | outcome)
    return rows


def warm_up(problem, load, candidates):
    """Imports, and the kernels of the solid."""
    simple = mb.Sphere(1.0) if isinstance(problem.body, mb.HalfSpace) else mb.Cylinder(1.0)
    for candidate in candidates:
        with suppress(mb.MicroblockError):
            problem.with_(obstacle=simple, method=candidate.method).solve(load=load)


def expected(candidate):
    """What a candidate of a plan is expected to take."""
    names = "predicted", "predicted_memory", "predicted_unknowns"
    return dict(zip(names, candidate.cost or ()))


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


def summary(runs):
    """A line on the choice and on the predicted seconds of the methods that were taken and answered."""
    near, far = (np.mean(profile(runs) <= bar) for bar in (1.5, 3))
    taken = runs[(runs.method == "chosen") & runs["class"].isin(ANSWERS) & runs.predicted.notna()]
    predicted = np.mean(np.abs(np.log(taken.predicted / taken.seconds)) <= np.log(3))
    return (
        f"chosen within 1.5 and 3 times the least time: {near:.0%} and {far:.0%}; "
        f"predicted within 3 times: {predicted:.0%} of {len(taken)}"
    )


def figure(runs=None):
    """The method that the program takes is nearly always the fastest."""
    if runs is None:
        runs = pd.read_csv(RECORD)
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
    options = parser.parse_args(words)
    problems = [(kind, k) for kind, count in KINDS.items() for k in range(count)]
    for kind, k in problems[options.first : options.first + options.count]:
        rows = pd.DataFrame(alone(kind, k))
        record = pd.read_csv(RECORD) if RECORD.exists() else rows[:0]
        pd.concat([record, rows], ignore_index=True).to_csv(RECORD, index=False)
        print(rows.drop(columns="message").to_string(header=False, index=False), flush=True)
    print(summary(pd.read_csv(RECORD)))


if __name__ == "__main__":
    main()
