"""Speed against accuracy: processor time over true error, one curve a method.

:Geometry:  a cylinder on a half-plane for both laws, alpha = 0.01, 0.05, 0.25, 1, and its classical limit
:Equations: those of the paper
:Method:    panels, cells, fitted elements, equal squares condensed or with the paper's augmented Lagrangian
            or the penalty; tamaas in the classical limit
:Reference: Hertz' ellipse, else the second code `verification.panels`; its own error is the floor
:Units:     processor seconds of one thread, setup (what further loads reuse) and solution, each the
            best of `repeats` after a warm-up; errors max(|dp|, |dM|/ell)/|p| in L2

Where an accuracy is asked for nothing is tuned. tamaas is tuned in its favour: the period is the best of each
grid, as only someone who has the answer knows.
"""

import argparse
import importlib.util
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from time import process_time as clock  # what other programs do on this machine does not count

import numpy as np
import pandas as pd
from tqdm import tqdm

import microblock as mb
from microblock.contact_solvers.cell_solver import halvings
from microblock.contact_solvers.fft_compliance import Grid
from microblock.data.records import versions
from microblock.errors import require_choice
from microblock.halfplane.kernels import gap_kernel, kernels

from . import chart
from .verification import panels
from .verification.lines import fields

NU, CLASSICAL = 0.3, 1e-10  # coupling beta of the classical limit
LOAD, REACH = math.pi / 2, 2.0  # the load; half-width of the equal squares over a_Hz
DOMAIN = 18.0  # size of the paper's block over a_Hz
PAPER = "microblock-0.25"  # alone has the refinements that take a minute
COLUMNS = ("rtol", "h", "order", "solver", "rho", "domain", "nodes", "period", "unknowns", "error", "floor",
           "setup", "solve", "spent", "repeats", "estimate", "failure")  # fmt: skip


@dataclass(frozen=True)
class Problem:
    """A cylinder R = 1 with E* = 2: lengths are over a_Hz, pressures over p_Hz, alpha is ell over a_Hz."""

    name: str
    contact: str
    alpha: float
    beta: float = 1.0

    @property
    def solid(self):
        return mb.Cosserat(E=2 * (1 - NU**2), nu=NU, ell=self.alpha, beta=self.beta)

    @property
    def half_plane(self):
        law = {"microblock": mb.Microblock, "unilateral": mb.Unilateral}[self.contact]()
        return mb.Contact(mb.HalfPlane(self.solid), mb.Cylinder(1.0), law)

    @cached_property
    def reference(self):
        """(x -> (p, M/ell), edges, its error)"""
        if self.beta == CLASSICAL:  # what is left of the coupling is of the order beta log(beta)
            return lambda x: (np.sqrt(np.maximum(1 - x**2, 0)), 0 * x), [-1.0, 1.0], 2.3e-9
        fine, bar = panels.reference(self.half_plane, LOAD, self.half_plane.solve(load=LOAD, rtol=1e-3))
        return fine.fields, list(panels.all_edges(fine.zones)), bar

    def error(self, fields):
        """Error of x -> (p, M/ell), by a rule that is the same for all methods."""
        exact, edges, _ = self.reference
        outer = 1.5 * edges[-1]
        return panels.distance(fields, exact, [*edges, *np.linspace(-outer, outer, 100)])


@dataclass(frozen=True)
class Answer:
    """What a run gives: x -> (p, M/ell), unknowns, and processor seconds."""

    fields: Callable
    unknowns: int
    setup: float
    solve: float
    estimate: float | None = None


def answered(contact, rtol=None, prepare=lambda: None, read=fields):
    """The Answer of a contact problem, with the seconds of what `prepare` leaves for further loads apart."""
    start = clock()
    prepare()
    ready = clock()
    state = contact.solve(load=LOAD, rtol=rtol)
    return Answer(read(state), int(state.unknowns), ready - start, clock() - ready, state.error_estimate)


def half_plane(problem, rtol):
    """What is setup is the material's table of kernels."""
    point = np.zeros(1)
    kernels.cache_clear()
    contact = problem.half_plane
    return answered(contact, rtol, lambda: gap_kernel(contact.solver.problem, point + 1, point, point))


def fitted(problem, rtol):
    """Every load has meshes of its own: nothing is setup."""
    return answered(problem.half_plane.with_(body=mb.Block(problem.solid)), rtol)


def squares(problem, h, order=1, solver=None, rho=None, domain=math.inf):
    """Condensed without a `solver`, "al" or "penalty"."""
    newton = solver and mb.Newton(solver, rho)
    method = mb.Uniform(h=h, order=order, newton=newton, reach=REACH)
    contact = problem.half_plane.with_(body=mb.Block(problem.solid, domain), method=method)
    return answered(contact, prepare=lambda: contact.solver.prepare())


def cells(problem, nodes):
    """Cells on a window a tenth wider than the contact."""
    outer = 1.1 * problem.reference[1][-1]
    contact = problem.half_plane.with_(method=mb.Cells(nodes=nodes, window=(-outer, outer)))

    def along_cells(state):
        columns = state.pressure, state.micromoment / problem.solid.ell
        return lambda x: tuple(np.interp(x, state.x, column, left=0, right=0) for column in columns)

    def prepare():
        for size in halvings(nodes):
            contact.solver.prepared(Grid(size, 2 * outer / size, (0.0,)))

    return answered(contact, None, prepare, along_cells)


def tamaas(problem, nodes, period):
    """E* = 2 here and 1 there: half the load gives half the pressures on the same zone."""
    import tamaas as library

    library.initialize(1)  # threads
    library.set_log_level(library.LogLevel.error)
    x = (np.arange(nodes) - nodes // 2) * period / nodes
    start = clock()
    model = library.ModelFactory.createModel(library.model_type.basic_1d, [float(period)], [nodes])
    model.E = 1.0
    model.nu = 0.0
    solver = library.PolonskyKeerRey(model, -(x**2) / 2, 1e-7)
    ready = clock()
    solver.solve(LOAD / 2 / period)
    spent = clock() - ready
    p = 2 * np.array(model.traction).ravel()
    return Answer(lambda at: (np.interp(at, x, p, left=0, right=0), 0 * at), nodes, ready - start, spent)


@dataclass(frozen=True)
class Method:
    """A curve: a function, its settings from the cheapest on, `dear` settings for one problem, and the
    package that it needs, where only the classical limit can be solved.
    """

    run: object
    settings: tuple
    dear: tuple = ()
    peer: str | None = None

    def discretisations(self, problem):
        """Settings for a problem; none where it cannot be solved, or the package is not installed."""
        if self.peer and (problem.beta != CLASSICAL or importlib.util.find_spec(self.peer) is None):
            return ()
        return self.settings + (self.dear if problem.name == PAPER else ())


def grid(**parameters):
    """Settings: all combinations of the values of each parameter, the first one outermost."""
    columns = [value if isinstance(value, tuple) else (value,) for value in parameters.values()]
    return tuple(dict(zip(parameters, row)) for row in product(*columns))


AL = {"solver": "al", "domain": DOMAIN, "rho": 2 * (1 - NU) ** 2 / (1 - 2 * NU) / REACH}
PENALTY = {"solver": "penalty", "domain": DOMAIN, "rho": tuple(10.0**power for power in range(1, 7))}
HALVED = 0.4, 0.2, 0.1, 0.05
METHODS = {
    "half-plane": Method(half_plane, grid(rtol=tuple(10.0**-power for power in range(2, 9)))),
    "fitted fe": Method(fitted, grid(rtol=(1e-2, 1e-3, 1e-4, 1e-5))),
    "condensed, order 1": Method(squares, grid(h=HALVED, order=1)),
    "condensed, order 2": Method(squares, grid(h=(0.8, *HALVED[:-1]), order=2)),
    "condensed, order 4": Method(squares, grid(h=(2.0, 1.0, 0.5, 0.25), order=4)),
    "condensed, order 6": Method(squares, grid(h=(2.0, 1.0, 0.5), order=6)),
    "AL, order 1": Method(squares, grid(h=HALVED, **AL), grid(h=0.02, **AL)),
    "AL, order 2": Method(squares, grid(h=(0.8, 0.4, 0.2), order=2, **AL), grid(h=0.1, order=2, **AL)),
    "penalty": Method(squares, grid(h=HALVED[:-1], **PENALTY), grid(h=0.05, **PENALTY)),
    "cells": Method(cells, grid(nodes=(128, 512, 2048, 8192, 32768))),
    "tamaas": Method(tamaas, grid(nodes=(512, 2048, 8192, 32768), period=(24, 48, 96, 192)),
        peer="tamaas"),
}  # fmt: skip
PROBLEMS = {"classical": Problem("classical", "unilateral", 1.0, CLASSICAL)} | {
    f"{law}-{alpha:g}": Problem(f"{law}-{alpha:g}", law, alpha)
    for law in ("microblock", "unilateral")
    for alpha in (0.01, 0.05, 0.25, 1.0)
}


def measure(problem, method, setting, repeats):
    """Columns of one setting; a failed run says why."""
    row = dict.fromkeys(COLUMNS) | setting | {"floor": problem.reference[2]}
    start = clock()
    try:
        answers = [method.run(problem, **setting)]  # the warm-up
        row["spent"] = clock() - start
        if row["spent"] < 1.0:  # dearer runs are not repeated
            answers = [method.run(problem, **setting) for _ in range(repeats)]
    except (mb.MicroblockError, MemoryError, RuntimeError) as failure:  # NGSolve's own are RuntimeErrors
        words = " ".join(str(failure).split())
        return row | {"spent": clock() - start, "failure": f"{type(failure).__name__}: {words}"}
    return row | {
        "error": problem.error(answers[0].fields),
        "unknowns": answers[0].unknowns,
        "estimate": answers[0].estimate,
        "setup": min(answer.setup for answer in answers),
        "solve": min(answer.solve for answer in answers),
        "repeats": len(answers),
    }


def refined(problem, name, settings, repeats, limit):
    """Rows of a method's refinements, up to where the next one would take longer than `limit`."""
    rows = []
    for setting in settings:
        finer = rows and any(setting.get(key) != rows[-1][key] for key in ("h", "nodes", "rtol"))
        if finer and rows[-1]["spent"] * 5.0 > limit:  # the next refinement is at most so many times dearer
            break
        rows.append(measure(problem, METHODS[name], setting, repeats))
    about = {"scene": problem.name, "contact": problem.contact, "alpha": problem.alpha, "nu": NU}
    return [{**about, "beta": problem.beta, "method": name, **row} for row in rows]


def solve(quick=False, only: tuple[str, ...] = (), repeats=3, limit=100.0, out=None):
    """Runs of all problems and methods, a table.

    Parameters
    ----------
    quick : two problems, two settings of each method
    only : problems and methods
    repeats : runs after the warm-up, of which the best counts
    limit : seconds of a run beyond which a method is not refined
    """
    for name in only:
        require_choice([*PROBLEMS, *METHODS], only=name)
    names = [*filter(PROBLEMS.get, only)] or (("classical", PAPER) if quick else PROBLEMS)
    methods = [*filter(METHODS.get, only)] or METHODS
    most = 2 if quick else None
    curves = [(PROBLEMS[name], method) for name in names for method in methods]
    rows = [
        row
        for problem, method in tqdm(curves, unit="curve", disable=None)
        for row in refined(problem, method, METHODS[method].discretisations(problem)[:most], repeats, limit)
    ]
    runs = pd.DataFrame(rows).assign(**{f"version_{key}": value for key, value in versions().items()})
    if out:
        runs.to_csv(out / "speed.csv", index=False)
    return runs


def to_dict(runs):
    """Plain data: the runs without the versions, and seconds over unknowns in `growth`."""
    plain = runs.astype(object).where(runs.notna(), None).filter(regex="^(?!version)")
    growth = runs.assign(seconds=runs.setup + runs.solve).dropna(subset="seconds")
    return {
        "runs": plain.to_dict("records"),
        "growth": growth[["scene", "method", "unknowns", "seconds"]].to_dict("records"),
    }


def figure(runs):
    """Processor time over true error in the classical limit."""
    return chart.figure(runs)


def main(words=None):
    """Prints the table of `beside`; the study itself is `python -m cases speed`."""
    from . import beside  # which is made of this module

    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "python -m cases.benchmarks.speed", description=beside.__doc__, formatter_class=form
    )
    parser.add_argument("--peers", action="store_true", required=True, help="print the table")
    parser.add_argument("--only", nargs="+", default=(), metavar="WORD", help="rows with one of some words")
    parser.add_argument("--long", action="store_true", help="also rows that take some ten seconds each")
    parser.add_argument("--write", action="store_true", help="write the record, results/beside.csv")
    options = parser.parse_args(words)
    table = beside.table(options.only, options.long)
    print(table.to_string(index=False, na_rep="", float_format="{:.2g}".format))
    if options.write:
        table.to_csv(beside.RECORD, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
