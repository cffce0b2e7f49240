"""Does the program take the fastest method?

The method that the program takes is the fastest, or nearly so, of those that can answer.

:Geometry:  180 seeded problems on half-planes, periods, blocks, meshes and half-spaces, as in `verification`
:Equations: those of the paper, with a second body and with friction where a problem has them
:Method:    each problem by the method that the program takes and by every other one that can answer
:Reference: none: a method that raises no error has answered; sets of `verification` verify answers
:Units:     processor seconds of one thread

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

from .verification import SEED, judging, lines, obstacles, space_problems

RECORD = Path(__file__).parent / "results" / "choice.csv"
KINDS = {"line": 80, "samples": 20, "period": 20, "block": 20, "mesh": 20, "space": 20}
TOLERANCES = 1e-2, 1e-3, 1e-5
LONGEST = 60  # seconds of a run
ANSWERS = ["right", "warned", "wrong", "unjudged"]


def drawn(kind, k):
    """(words, Contact without a method, load, rtol) of problem k of a kind."""
    if kind == "line":
        return *obstacles.drawn(SEED, k, mb)[:3], TOLERANCES[k % 3]
    if kind == "samples":  # the tenth kind of obstacles are profiles
        return *obstacles.drawn(SEED, 15 * k + 10, mb)[:3], 1e-2
    if kind == "space":
        surface = space_problems.surface(8 * k)
        return surface.kind, *space_problems.problem(surface), space_problems.RTOL
    method = {"period": "cells", "block": "fitted", "mesh": "body"}[kind]
    problems = (lines.drawn(method, number)[:4] for number in range(3 * k, 10**6))
    words, problem, load, rtol = next(row for row in problems if kind != "period" or row[1].body.period)
    return words, problem.with_(method=None), load, rtol


def answered(kind, k):
    """A row for each method of a problem, the chosen one first."""
    words, problem, load, rtol = drawn(kind, k)
    about = {"words": words, "rtol": rtol}
    candidates = []
    start = time.process_time()
    with suppress(mb.MicroblockError):
        plan = problem.plan(load=load, rtol=rtol)
        candidates = [*plan.candidates, *plan.refused]
    first = {"method": "chosen", "planning": time.process_time() - start}
    if candidates:
        first |= {"taken": candidates[0].name} | expected(candidates[0])
    measured(about, problem, load, LONGEST)  # imports and the kernels of the solid
    rows = [about | first | measured(about, problem, load, LONGEST)]
    # a method that takes much longer than the chosen one need not end
    longest = min(LONGEST, 2 * (rows[0]["seconds"] or LONGEST) + 1)
    for candidate in candidates:
        row = measured(about, problem.with_(method=candidate.method), load, longest)
        rows.append(about | {"method": candidate.name} | expected(candidate) | row)
    return rows


def measured(about, problem, load, longest):
    """What became of a problem, and its seconds, up to the longest."""
    solve = partial(problem.solve, load=load, rtol=about["rtol"])
    case = judging.Case(about["words"], about["rtol"], solve, lambda state: (0.0, state.error_estimate, 0.0))
    return judging.outcome(case, longest)


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
