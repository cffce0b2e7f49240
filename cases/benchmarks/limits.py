"""Where methods fail

Of seeded runs, a fifth near a degeneracy, no answer is beyond its promise; the others are refused or out of
time.

:Geometry:  strip, cylinders, wedges, user meshes, compliances drawn at random; see `limits_maps.MAPS`
:Equations: those of the paper and, with friction, Coulomb's law
:Method:    every method of the toolkit, ten maps of parameters by Latin hypercubes
:Reference: a closed form, a second code, or another method, as each map says
:Units:     each run has `limit` seconds of wall time

"delivered": the true error is below the promise, or nothing was promised and the error is recorded; "typed
error": an error that says what to try; "missed": an answer beyond its promise; "not finite", "time limit",
"untyped error", "crash": defects.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from tqdm import tqdm

from microblock.data.records import versions
from microblock.errors import require_choice

from .limits_maps import MAPS
from .questions import QUESTIONS
from .sampling import KINDS, Outcome, records

RECORD = Path(__file__).parent / "results" / "limits.csv"
TOO_FAR = 0.1  # relative error of an answer that is of no use, where nothing is promised
# curves of the profile: runs that were promised something
CURVES = {
    "panels": ("asked", "method == 'panels'"),
    "cells": ("asked", "method == 'cells'"),
    "fitted elements": ("asked", "method == 'fitted'"),
    "a user's mesh": ("asked", "method == 'mesh'"),
    "panels at an event": ("event", ""),
    "contact states": ("states", ""),
    "augmented Lagrangian": ("newton", "kind_of == 'al'"),
}


def solve(quick=False, only: tuple[str, ...] = (), share=1.0, seed=1, limit=60.0, workers=2, out=None):
    """Runs of all maps: a table, a row a run.

    Parameters
    ----------
    quick : two runs of each map
    only : maps to make
    share : of the runs of each map
    seed : of the random numbers
    limit : seconds of a run, beyond which it is stopped
    workers : processes
    """
    for name in only:
        require_choice([one.name for one in MAPS], only=name)
    work = [
        (one, setting, near)
        for one in MAPS
        if not only or one.name in only
        for setting, near in one.settings(2 if quick else max(2, round(share * one.runs)), seed)
    ]
    rows = records([(one.run, setting) for one, setting, _ in work], workers, limit)
    frame = pd.DataFrame(
        {"map": one.name, **setting, "near": near, **row}
        for (one, setting, near), row in zip(work, tqdm(rows, total=len(work), unit="run", disable=None))
    )
    parameters = dict.fromkeys(axis.name for one in MAPS for axis in one.axes if axis.name != "kind_of")
    columns = [
        "map",
        *parameters,
        "kind_of",
        "near",
        *Outcome.__dataclass_fields__,
        "kind",
        "message",
        "spent",
    ]
    frame = frame.reindex(columns=columns).assign(
        **{f"version_{name}": value for name, value in versions().items()}
    )
    if out:
        frame.to_csv(out / "limits.csv", index=False)
    return frame


def fails(frame):
    """Whether runs gave no answer, exceeded their promise or, where none is made, are off by TOO_FAR."""
    return (frame.kind != KINDS[0]) | (frame.promise.isna() & (frame.error > TOO_FAR))


def part(frame, name, condition):
    """The runs of a map under a condition."""
    own = frame[frame["map"] == name]
    return own.query(condition) if condition and len(own) else own


def table(frame):
    """What fails where: a row a question, with the share of the runs that fails, by kind."""
    rows = []
    for question, (name, condition, where, advice) in QUESTIONS.items():
        own = part(frame, name, condition)
        own = own.assign(outcome=own.kind.where(own.kind != KINDS[0], f"error above {TOO_FAR:.0%}"))
        shares = own[fails(own)].outcome.value_counts() / max(len(own), 1)
        failed = ", ".join(f"{share:.0%} {outcome}" for outcome, share in shares.items())
        rows.append((question, len(own), failed or ("none" if len(own) else "not run"), where, advice))
    return pd.DataFrame(rows, columns=("question", "runs", "failed", "where", "what to do"))


def to_dict(frame):
    """Plain data: counts of outcomes by map, and the table; the runs are in the file of the folder `out`."""
    return {
        "counts": pd.crosstab(frame["map"], frame.kind).reset_index().to_dict("records"),
        "table": table(frame).to_dict("records"),
    }


def figure(frame=None):
    """Performance profile: the share of runs whose true error is below a multiple of the promise."""
    frame = pd.read_csv(RECORD, low_memory=False) if frame is None else frame
    drawing, axis = plt.subplots(layout="constrained", figsize=(3.54, 3.2))
    axis.axvline(1, color="0.5", linewidth=0.8)
    for (name, runs), line in zip(CURVES.items(), ("-", "--", "-.", ":") * 2):
        own = part(frame, *runs)
        ratios = np.sort((own.error / own.promise).dropna().clip(1e-5))
        if len(ratios):
            shares = np.append(np.arange(len(ratios) + 1), len(ratios)) / len(own)
            axis.step([1e-5, *ratios, 1e2], shares, line, where="post", label=name)
    axis.set(
        xscale="log",
        xlim=(1e-5, 1e2),
        ylim=(0, 1.05),
        xlabel="true error over promised error",
        ylabel="share of runs",
    )
    drawing.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return drawing
