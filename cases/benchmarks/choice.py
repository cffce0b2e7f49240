"""Does the program take the fastest method?

The method that the program takes is the fastest, or nearly so, of those that can answer.

:Geometry:  200 seeded problems on half-planes, periods, blocks, meshes and half-spaces, as in `verification`
:Equations: those of the paper, with a second body and with friction where a problem has them
:Method:    each problem by the method that the program takes and by every other one that can answer
:Reference: the second codes of `verification`, for the chosen method, or else another method
:Units:     processor seconds of one thread; bytes of the peak over what was there before; relative L2 errors

The record has a row for each problem and method, with seconds and memory, predicted and measured. The program
that made it is in the history of this file.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

RECORD = Path(__file__).parent / "results" / "choice.csv"
ANSWERS = ["right", "warned", "wrong", "unjudged"]


def profile(runs):
    """Time of the chosen method over the best one's, of problems that some method answers: array (n,), inf
    where it gave no answer.
    """
    answers = runs[runs["class"].isin(ANSWERS)]
    best = answers.groupby(["kind", "number"]).seconds.min()
    chosen = answers[answers.method == "chosen"].set_index(["kind", "number"]).seconds
    return np.sort((chosen.reindex(best.index) / best).fillna(np.inf).to_numpy())


def figure(runs=None):
    """The method that the program takes is nearly always the fastest."""
    if runs is None:
        runs = pd.read_csv(RECORD)
    ratios = profile(runs)
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 2.6))
    fractions = np.arange(1, len(ratios) + 1) / len(ratios)
    axis.step([1, *ratios], [0, *fractions], where="post", color="C0")
    axis.axvline(1.5, color="0.6", linestyle=":")
    axis.set(xscale="log", xlim=(0.95, 30), ylim=(0, 1.02), ylabel="fraction of problems")
    axis.set_xlabel("time of the method over the least time")
    axis.set_xticks([1, 1.5, 3, 10, 30], ["1", "1.5", "3", "10", "30"])
    axis.minorticks_off()
    return drawing
