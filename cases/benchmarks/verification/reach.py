"""What is out of reach: every problem is asked for ever smaller rtol, and for what each refusal advises.

python -m cases.benchmarks.verification.reach [KIND ...] [--first K] [--count N] prints a line for each call
and a summary. Problem k of a kind is that of the same number in `lines`, `obstacles`, `space_problems` or
`friction`, of whose states the one with the largest error counts.
"""

import argparse
import json
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import microblock as mb

from . import SEED, friction, lines, obstacles, space_problems
from .judging import OutOfTime, within

KINDS = *lines.METHODS, "obstacles", "space", "friction"
RTOLS = 1e-2, 1e-3, 1e-4, 1e-6, 1e-9


def drawn(kind, k):
    """(words, Contact, load) of a problem, or what solves as one."""
    if kind == "space":
        scene = space_problems.scene(k)
        return f"{scene.kind} {scene.law} {scene.note}", *space_problems.problem(mb, scene)
    if kind == "friction":
        given = friction.draw(k)

        def solve(load, rtol):
            states = friction.history(mb, replace(given, rtol=rtol))
            return max(states, key=lambda state: state.error_estimate)

        return f"{given.kind} {given.law} {len(given.pairs)} pairs", SimpleNamespace(solve=solve), None
    return (obstacles.drawn(SEED, k, mb) if kind == "obstacles" else lines.drawn(kind, k))[:3]


def call(problem, load, rtol, seconds):
    """{rtol, seconds, estimate, advice, words} of a call; None where there is none."""
    row, start = {"rtol": rtol, "estimate": None, "advice": None, "words": ""}, time.process_time()
    try:
        row["estimate"] = within(seconds, lambda: problem.solve(load=load, rtol=rtol)).error_estimate
    except OutOfTime:
        row["words"] = "slow"
    except mb.NotConverged as failure:
        row |= {"advice": failure.rtol_reached, "words": str(failure)}
    except mb.BadArgument as failure:
        row["words"] = f"BadArgument: {failure}"
    return row | {"seconds": round(time.process_time() - start, 3)}


def calls(problem, load, rtols=RTOLS, seconds=120):
    """Yields the calls of a problem: after a refusal that of its advice, once for each."""
    known = set()
    for rtol in rtols:
        yield (row := call(problem, load, rtol, seconds))
        if (advice := row["advice"]) and advice not in known:
            known.add(advice)
            yield call(problem, load, advice, seconds) | {"advised": True}
        if row["words"] == "slow" or row["words"].startswith("BadArgument"):
            return


def summary(rows):
    """Prints how many refusals advise, how many of these fail, and how far advice is from the best of a
    problem, its estimates and advice of all calls.
    """
    refused = [row for row in rows if row["words"] and not row["words"].startswith("BadArgument")]
    advised = [row for row in rows if row.get("advised")]
    best = {}
    for row in rows:
        reached = row["estimate"] or np.inf
        best[row["problem"]] = min(best.get(row["problem"], np.inf), reached)
    ratios = [row["advice"] / best[row["problem"]] for row in rows if row["advice"]]
    spent = [row["seconds"] for row in refused] or [0.0]
    print(
        f"== {len(rows)} calls, {len(refused)} refused, "
        f"{sum(not row['advice'] for row in refused)} without advice; "
        f"{sum(bool(row['words']) for row in advised)} of {len(advised)} advised fail; "
        f"seconds to refusal: median {np.median(spent):.2f}, 90 % {np.quantile(spent, 0.9):.2f}, "
        f"most {max(spent):.1f}; advice over best: median {np.median(ratios or [np.nan]):.2f}"
    )


def main(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", choices=[[], *KINDS], default=[])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=120, help="of the processor, for a call")
    given = parser.parse_args(words)
    rows = []
    for k in range(given.first, given.first + given.count):
        for kind in given.kinds or KINDS:
            text, problem, load = drawn(kind, k)
            for row in calls(problem, load, seconds=given.seconds):
                rows.append({"problem": f"{kind} {k}", "text": text} | row)
                print(json.dumps(rows[-1]), flush=True)
    summary(rows)


if __name__ == "__main__":
    main()
