"""What a state of the half-plane costs, from scene, load and tolerance to the state.

Geometry   cylinders, a wedge and a wavy parabola on a half-plane, as in `hertz`.
Equations  those of `hertz`.
Model      halfplane; kernels' tables are made beforehand (once a material), and their time is given beside.
Reference  none: times on this machine, to be compared within one run only; `accuracy` judges the states.
Look at    how little alpha and the digits asked for matter; a further state at a nearby load.
Units      milliseconds of processor time, the best of some repetitions, one thread; alpha = ell/a_Hz.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, NotConverged, require_finite
from microblock.halfplane import HalfPlane, Kernels
from microblock.law import Microblock, Microclamped, Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Cylinder, Wedge
from microblock.scene import Contact
from microblock.study import grouped

LOAD = math.pi/2       # with E* = 2, R = 1: a_Hz = 1
NU = 0.3
FURTHER = 0.97         # of the load: a further state
# psi0 R/a_Hz = 0.1, a wedge as wide in contact as the cylinder, a parabola with waves of length 1
SCENES = {"microblock": (Cylinder(1.0), Microblock()), "unilateral": (Cylinder(1.0), Unilateral()),
          "microclamped": (Cylinder(1.0), Microclamped()), "psi0": (Cylinder(1.0), Microblock(0.1)),
          "wedge": (Wedge(0.8), Microblock()),
          "wavy": (lambda x: x**2/2 + 0.002*np.cos(2*np.pi*x), Microblock())}


@dataclass(frozen=True)
class Parameters:
    alphas: tuple = option((0.01, 0.05, 0.25, 0.5, 1.0, 2.0), "ell over a_Hz", nargs="+", metavar="ALPHA")
    rtols: tuple = option((1e-3, 1e-6, 1e-9), "accuracies asked for", nargs="+", metavar="RTOL")
    repeats: int = option(3, "repetitions, of which the fastest counts", int)

    def __post_init__(self):
        for name, most in (("alphas", np.inf), ("rtols", 1)):
            values = getattr(self, name)
            values = values if isinstance(values, (tuple, list)) else (values,)
            for value in values:
                require_finite(**{name: value})
                if not 0 < value < most:
                    raise BadArgument(name, value, "must be positive" + (" and below 1" if most == 1 else ""))
            object.__setattr__(self, name, tuple(float(value) for value in values))
        if not 1 <= self.repeats <= 100:
            raise BadArgument("repeats", self.repeats, "must lie between 1 and 100")


def scene(kind, alpha):
    return Contact(HalfPlane(Cosserat(E=2*(1 - NU**2), nu=NU, ell=alpha, beta=1)), *SCENES[kind])


def clocked(work, repeats):
    """(what the work returns, the fastest time in milliseconds)."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        found = work()
        times.append(1e3*(time.process_time() - start))
    return found, min(times)


def solve(kind, alpha, rtol, repeats):
    """Record of one scene; a failed one says why."""
    here = scene(kind, alpha)
    row = {"scene": kind, "alpha": alpha, "rtol": rtol, "milliseconds": None, "further": None, "unknowns": None,
           "error_estimate": None, "failure": None}
    try:
        state, spent = clocked(lambda: here.at(LOAD, rtol), repeats)
        further = clocked(lambda: here.at(FURTHER*LOAD, rtol, near=state), repeats)[1]
    except NotConverged as failure:
        return {**row, "failure": " ".join(str(failure).split())}
    return {**row, "milliseconds": spent, "further": further, "unknowns": len(state.q) + 1,
            "error_estimate": state.error_estimate}


def result(parameters, quiet=True):
    """The case's object: a row a scene, alpha and tolerance."""
    start = time.perf_counter()
    setup = clocked(lambda: Kernels(NU, 1.0), 1)[1]
    scene("microblock", 1.0).at(LOAD)      # warm-up
    ready = time.perf_counter()
    runs = [(kind, alpha, rtol) for kind in SCENES for alpha in parameters.alphas for rtol in parameters.rtols]
    found = [solve(*run, parameters.repeats) for run in tqdm(runs, disable=quiet, unit="state")]
    return returned(parameters, ready, ready - start, table_milliseconds=setup, runs=found)


def run(parameters, out=None, quiet=False):
    """Time, print a table, draw times over alpha into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "timing", rows(parameters, answer), figure)
    return answer


def show(answer):
    """Milliseconds of a first state and of a further one, a line for each scene and alpha."""
    print(f"kernels' tables of a material: {answer['table_milliseconds']:.0f} ms; below: ms of a state (of a further one)")
    rtols = answer["parameters"]["rtols"]
    print(f"{'scene':>12}  {'alpha':>6}  " + "  ".join(f"{f'rtol {rtol:g}':>16}" for rtol in rtols))
    for kind, rows in grouped(answer["runs"], "scene").items():
        for alpha, cells in grouped(rows, "alpha").items():
            texts = ["failed" if cell["failure"] else f"{cell['milliseconds']:.1f} ({cell['further']:.1f})" for cell in cells]
            print(f"{kind:>12}  {alpha:>6g}  " + "  ".join(f"{text:>16}" for text in texts))


def rows(parameters, answer):
    """A row a scene, alpha and tolerance."""
    return [{"command": command("timing", parameters), **row} for row in answer["runs"]]


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """What a state of the half-plane costs on this machine: processor time over alpha, (a) at the first, (b) at the last of the
    tolerances.
    """
    rtols = list(grouped(records, "rtol"))
    drawing, axes = plots.figure(1, 2)
    for axis, rtol, letter in zip(axes, (rtols[0], rtols[-1]), "ab"):
        rows = [row for row in records if row["rtol"] == rtol and row["milliseconds"]]
        for (kind, mine), colour, marker in zip(grouped(rows, "scene").items(), plots.COLOURS, plots.MARKERS):
            axis.loglog([row["alpha"] for row in mine], [row["milliseconds"] for row in mine], color=colour, marker=marker,
                        label=kind)
        axis.set(xlabel=r"$\alpha = \ell/a_\mathrm{Hz}$", ylabel="time of a state (ms)", title=f"({letter}) rtol {rtol:g}")
    plots.legend_of_all(drawing, axes[0], columns=6)
    return drawing
