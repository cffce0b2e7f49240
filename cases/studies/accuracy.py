"""How far states on a line are from a reference of another kind: a seeded sample.

Geometry   cylinders and wedges on a half-plane, all contact laws, psi0 of both signs and readings up to
           beyond what lets both corners touch; ranges in SAMPLES.
Equations  those of `hertz`.
Model      halfplane, or fitted elements (fe), asked for each rtol anew; fe at rtols below 1e-4 for a third of
           the problems.
Reference  for the half-plane graded Legendre panels in x with kernels, quadrature and edges of their own
           (reference_line.py), checked for (26), whose error is the distance of two of its refinement levels;
           for fe the half-plane at rtol 1e-8.
Look at    error over rtol, max(|dp|, |dM|/ell)/|p| in L2: below 1 in 98 % of the problems, and never above 3.
Obstacles  --obstacles: a sample of hard ones instead, verified by graded cells on all of the window
           (obstacle_cells.py).
Units      a_Hz = 1, R = 10, P = pi/2; for wedges the half-width of a classical contact is some ell.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped
from microblock.errors import BadArgument, MicroblockError, NotConverged

from ..common.options import Checked, command, option
from ..common.records import keep, print_table, returned
from . import accuracy_obstacles
from .judged_line import LOAD, Draw, error, error_of_elements, half_plane, reference

QUICK = 10  # problems
SCENES = {False: 60, True: 2000}  # without and with --obstacles
RTOLS = {"halfplane": (1e-3, 1e-6, 1e-9), "fe": (1e-2, 1e-3, 1e-4, 1e-5), "obstacles": (1e-3, 1e-6)}
PATHS = 100  # of the obstacles
FINER = 100  # times rtol, that a reference should be better than; counted in the table
COLUMNS = (
    "rtol",
    "kind",
    "scenes",
    "judged",
    "below",
    "above_3",
    "failed",
    "worst",
    "median",
    "fine_enough",
    "reference_worst",
    "seconds_median",
    "seconds_most",
    "unknowns_median",
)


@dataclass(frozen=True)
class Parameters(Checked):
    scenes: int | None = option(
        None,
        f"problems of the sample (default {SCENES[False]}, {SCENES[True]} of obstacles)",
        int,
        at_least=1,
    )
    seed: int = option(2020, "of the random numbers", int, at_least=0)
    rtols: tuple = option(
        (),
        f"accuracies asked for (default {' '.join(map(str, RTOLS['halfplane']))}, 1e-2 "
        f"to 1e-5 "
        "of fe, without the last of obstacles)",
        above=0,
        below=1,
        nargs="+",
        metavar="RTOL",
    )
    quick: bool = option(False, f"{QUICK} problems only", bool)
    model: str = option("halfplane", "what is verified", str, choices=("halfplane", "fe"))
    obstacles: bool = option(
        False, "a sample of obstacles that are meant to be hard, verified by cells instead", bool
    )
    paths: int | None = option(
        None, f"load paths of such obstacles (default {PATHS} of the full sample, else none)", int, at_least=0
    )
    workers: int = option(2, "processes, of obstacles", int, at_least=1)

    def relate(self):
        if self.obstacles and self.model != "halfplane":
            raise BadArgument(
                "model", self.model, "does not go together with --obstacles, which verify the half-plane"
            )
        resolved = {
            "scenes": self.scenes or SCENES[self.obstacles],
            "rtols": self.rtols or RTOLS["obstacles" if self.obstacles else self.model],
        }
        if self.quick:
            resolved["scenes"] = min(resolved["scenes"], QUICK)
        if self.paths is None:
            resolved["paths"] = PATHS if self.obstacles and resolved["scenes"] >= SCENES[True] else 0
        for name, value in resolved.items():
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Sample:
    """Shares of the kinds of contacts in a sample, and the ranges of what is drawn."""

    kinds: dict
    alpha: tuple
    nu: tuple
    beta: tuple
    psi0: tuple  # over a_Hz/R
    width: tuple = (1.5, 8.0)  # half-width over ell, of wedges

    def drawn(self, count, seed):
        """`count` draws, the kinds by their shares, alpha and psi0 stratified in their logarithms."""
        rng = np.random.default_rng(seed)
        numbers = np.diff(np.round(np.cumsum([0.0, *self.kinds.values()]) * count).astype(int))
        return [
            draw for kind, number in zip(self.kinds, numbers) for draw in self._of_kind(rng, kind, number)
        ]

    def _of_kind(self, rng, kind, count):
        def strata(low, high):
            place = (rng.permutation(count) + rng.uniform(size=count)) / max(count, 1) - np.arange(
                count
            ) / max(count, 1)
            return np.geomspace(low, high, count + 1)[:-1] * (high / low) ** place

        alphas, rotations, widths = strata(*self.alpha), strata(*self.psi0), strata(*self.width)
        for number in range(count):
            material = {
                "alpha": float(alphas[number]),
                "nu": float(rng.uniform(*self.nu)),
                "beta": float(rng.uniform(*self.beta)),
            }
            if kind == "psi0":
                yield Draw(
                    kind,
                    "microblock",
                    **material,
                    psi0=float(rng.choice((-1, 1)) * rotations[number]),
                    reading=("gap", "lever")[number % 2],
                )
            elif kind == "wedge":
                yield Draw(
                    kind, ("microblock", "unilateral")[number % 2], **material, width=float(widths[number])
                )
            else:
                yield Draw(kind, kind, **material)


@dataclass(frozen=True)
class Judged:
    """What is verified: its sample, how a problem is solved, by what it is verified, and the rtol below which
    it is dear.

    `judge(problem)` gives (reference, its own error), `error(state, reference)` the error of a state.
    """

    sample: Sample
    solve: Callable
    judge: Callable
    error: Callable
    dear: float = 0.0


def _solved(problem, rtol):
    return problem.solve(load=LOAD, rtol=rtol)


def _fitted(problem, rtol):
    return _solved(problem.with_(body=mb.Block(problem.solid)), rtol)


MODELS = {
    "halfplane": Judged(
        Sample(
            {"microblock": 0.30, "unilateral": 0.20, "microclamped": 0.14, "psi0": 0.26, "wedge": 0.10},
            alpha=(0.01, 2.0),
            nu=(0, 0.49),
            beta=(0.2, 1.9),
            psi0=(1e-3, 1.5),
        ),
        _solved,
        reference,
        error,
    ),
    "fe": Judged(
        Sample(
            {"microblock": 0.35, "unilateral": 0.30, "psi0": 0.25, "wedge": 0.10},
            alpha=(0.05, 1.25),
            nu=(0, 0.45),
            beta=(0.2, 1.8),
            psi0=(1e-2, 1.0),
        ),
        _fitted,
        half_plane,
        error_of_elements,
        dear=1e-4,
    ),
}


def judged(model, draw, rtols):
    """Records of one problem, one for each rtol; `failure` is what the solver, or the reference, raised."""
    way, problem, rows = MODELS[model], draw.problem(), []
    try:
        fine, own = way.judge(problem)
        objection = ""
    except NotConverged as failure:
        fine, own, objection = None, None, f"reference: {failure}"
    for rtol in rtols:
        row = {
            **asdict(draw),
            "rtol": rtol,
            "error_over_rtol": None,
            "estimate_over_rtol": None,
            "reference_error": own,
            "zones": None,
            "unknowns": None,
            "seconds": None,
            "failure": objection,
        }
        start = time.perf_counter()
        try:
            state = way.solve(problem, rtol)
        except MicroblockError as failure:
            row["failure"] = f"{type(failure).__name__}: {failure}"
        else:
            zones = {corner: len(pairs) for corner, pairs in state.solution.all_zones.items()}
            row.update(
                estimate_over_rtol=state.error_estimate / rtol, zones=str(zones), unknowns=state.unknowns
            )
            if fine:
                row["error_over_rtol"] = way.error(state, fine) / rtol
        row["seconds"] = time.perf_counter() - start
        rows.append(row)
    return rows


def table(rows):
    """One row for each kind and rtol, and for all kinds: how many, how far, how dear."""
    found = []
    for rtol, of_rtol in grouped(rows, "rtol").items():
        for kind, chosen in {**grouped(of_rtol, "kind"), "all": of_rtol}.items():
            errors, own, seconds, unknowns = (
                [row[name] for row in chosen if row[name] is not None]
                for name in ("error_over_rtol", "reference_error", "seconds", "unknowns")
            )
            found.append(
                {
                    "rtol": rtol,
                    "kind": kind,
                    "scenes": len(chosen),
                    "judged": len(errors),
                    "below": sum(one < 1 for one in errors),
                    "above_3": sum(one > 3 for one in errors),
                    "failed": sum(bool(row["failure"]) for row in chosen),
                    "worst": max(errors, default=None),
                    "median": _median(errors),
                    "fine_enough": sum(one <= rtol / FINER for one in own),
                    "reference_worst": max(own, default=None),
                    "seconds_median": _median(seconds),
                    "seconds_most": max(seconds, default=None),
                    "unknowns_median": _median(unknowns),
                }
            )
    return found


def _median(values):
    return float(np.median(values)) if values else None


def result(parameters, quiet=True):
    """Table, problems and failures as one object."""
    if parameters.obstacles:
        return accuracy_obstacles.result(parameters, quiet)
    start, rows, way = time.perf_counter(), [], MODELS[parameters.model]
    cheap = tuple(rtol for rtol in parameters.rtols if rtol >= way.dear)
    draws = way.sample.drawn(parameters.scenes, parameters.seed)
    for number, draw in enumerate(tqdm(draws, disable=quiet, unit="problem")):
        rows += judged(parameters.model, draw, cheap if number % 3 else parameters.rtols)
    return returned(
        parameters, start, table=table(rows), scenes=rows, failures=grouped(misses(rows), "failure")
    )


def misses(rows):
    """The records that failed, or whose error is above rtol (`failure` then says so)."""
    found = [row for row in rows if row["failure"]]
    return found + [
        {**row, "failure": "error above rtol"} for row in rows if (row["error_over_rtol"] or 0) > 1
    ]


def run(parameters, out=None, quiet=False):
    """Verify the sample, print the table and what exceeded its rtol, draw errors into the folder `out`."""
    if parameters.obstacles:
        return accuracy_obstacles.run(parameters, out, quiet)
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(
            out,
            "accuracy",
            [{**row, "command": command("accuracy", parameters)} for row in answer["scenes"]],
            figure,
        )
    return answer


def show(answer):
    """Print the table, and the problems that failed or exceeded their rtol."""
    print_table(answer["table"], COLUMNS)
    for failure, rows in answer["failures"].items():
        print(failure)
        for row in rows:
            over = "" if row["error_over_rtol"] is None else f"  error/rtol {row['error_over_rtol']:.3g}"
            print(
                "   ",
                ", ".join(f"{name}={row[name]!r}" for name in Draw.__dataclass_fields__),
                f"rtol={row['rtol']:g}{over}",
            )


def figure(records):
    """Obtained error over the one asked for, problem by problem, by kind."""
    from microblock.view import plots  # when something is drawn

    drawing, axis = plots.figure(height=3.0)
    kinds = grouped([row for row in records if row["error_over_rtol"]], "kind")
    for number, (marker, (kind, chosen)) in enumerate(zip("os^dv", kinds.items())):
        axis.loglog(
            [row["rtol"] * (1 + 0.15 * number) for row in chosen],
            np.multiply(column(chosen, "error_over_rtol"), column(chosen, "rtol")),
            marker,
            markersize=3,
            label=kind,
        )
    ends = min(column(records, "rtol")), max(column(records, "rtol"))
    axis.loglog(ends, ends, color="0.6", linewidth=0.7, label="as asked for")
    axis.set(xlabel="rtol asked for", ylabel="relative $L_2$ error obtained")
    plots.legend_below(axis)
    return drawing
