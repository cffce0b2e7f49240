"""The classical limit on uniform cells: Hertz ellipse, punch's inverse root, wedge's logarithm.

Geometry   half-plane x2 < 0; a cylinder, a flat punch, a blunt wedge pressed down by a force per thickness.
Equations  classical unilateral contact: the law `Unilateral` at a coupling beta of 1e-10.
Model      uniform cells without images, products by FFT (`GridContact`); beside it panels fitted to the edges (`Contact`).
Reference  the closed forms of `microblock.references`.
Look at    order 1 for the cylinder, 1/2 for the wedge (its logarithm), 1/4 for the punch (infinite at its ends); panels know
           the edges.
Units      lengths over the half-width of the contact a; errors are relative, in L2, at the centres of the cells (panels: at the
           cells' centres of the second finest grid), for the punch with the weight sqrt(1 - (x/a)^2) that makes the norm finite.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, MicroblockError
from microblock.grid_contact import GridContact
from microblock.halfplane import HalfPlane
from microblock.law import Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Cylinder, Punch, Wedge
from microblock.scene import Contact
from microblock.study import grouped

NU, BETA = 0.3, 1e-10
WINDOW = (-1.25, 1.25)
SLOPE = 0.01
# obstacle, load for the half-width 1 at E* = 1
OBSTACLES = {"cylinder": (Cylinder(1.0), math.pi/4), "punch": (Punch(1.0), 1.0), "wedge": (Wedge(SLOPE), SLOPE)}


@dataclass(frozen=True)
class Parameters:
    nodes: tuple = option((1000, 3000, 10000, 30000, 100000), "cells of the window of 2.5 half-widths", int,
                          nargs="+", metavar="N")
    rtol: float = option(1e-3, "of the fitted panels")

    def __post_init__(self):
        object.__setattr__(self, "nodes", tuple(sorted(self.nodes)))
        if len(set(self.nodes)) < max(2, len(self.nodes)) or not 32 <= self.nodes[0] <= self.nodes[-1] <= 2**21:
            raise BadArgument("nodes", self.nodes, f"must be two different numbers or more between 32 and {2**21}")
        if not 1e-12 <= self.rtol < 1:
            raise BadArgument("rtol", self.rtol, "must lie between 1e-12 and 1")


def scene(kind, *arguments, **more):
    return kind(HalfPlane(Cosserat(E=1 - NU**2, nu=NU, ell=1.0, beta=BETA)), *arguments, Unilateral(), **more)


def solve(obstacle, nodes):
    """(GridState, seconds)."""
    shape, load = OBSTACLES[obstacle]
    start = time.perf_counter()
    state = scene(GridContact, shape, window=WINDOW).at(load, nodes=nodes)
    return state, time.perf_counter() - start


def reference(obstacle, x):
    """The closed form at x."""
    from microblock import references      # judges only: the computation does without
    pressure = {"cylinder": references.hertz, "punch": references.punch, "wedge": references.wedge}[obstacle]
    return pressure(x, OBSTACLES[obstacle][1], 1.0)


def error(obstacle, x, pressure):
    """Relative L2 error, see the header; equal weights of the points."""
    weight = np.sqrt(np.maximum(1 - x**2, 0)) if obstacle == "punch" else np.ones_like(x)
    exact = reference(obstacle, x)
    return float(np.sqrt(weight @ (pressure - exact)**2/(weight @ exact**2)))


def on_panels(obstacle, x, rtol):
    """Row of the fitted panels, judged at x; failed if they do not reach rtol."""
    shape, load = OBSTACLES[obstacle]
    start = time.perf_counter()
    try:
        state = scene(Contact, shape).at(load, rtol=rtol)
    except MicroblockError as failure:
        return {"obstacle": obstacle, "method": "panels", "nodes": None, "error": None, "order": None, "estimate": None,
                "seconds": time.perf_counter() - start, "failure": " ".join(str(failure).split())}
    seconds = time.perf_counter() - start
    return {"obstacle": obstacle, "method": "panels", "nodes": len(state.q), "error": error(obstacle, x, state.pressure(0, x)),
            "order": None, "estimate": state.error_estimate, "seconds": seconds, "failure": None}


def result(parameters, quiet=True):
    """The case's object: a row a run."""
    start, runs = time.perf_counter(), []
    for obstacle in tqdm(OBSTACLES, disable=quiet, unit="obstacle"):
        grid = []
        for nodes in parameters.nodes:
            state, seconds = solve(obstacle, nodes)
            found = error(obstacle, state.x, state.pressures[0])
            order = math.log(grid[-1]["error"]/found)/math.log(nodes/grid[-1]["nodes"]) if grid and found else None
            grid.append({"obstacle": obstacle, "method": "cells", "nodes": nodes, "error": found, "order": order,
                         "estimate": state.error_estimate, "seconds": seconds, "failure": None})
        x = WINDOW[0] + (WINDOW[1] - WINDOW[0])*(np.arange(parameters.nodes[-2]) + 0.5)/parameters.nodes[-2]
        runs += [*grid, on_panels(obstacle, x, parameters.rtol)]
    return returned(parameters, start, runs=runs)


def run(parameters, out=None, quiet=False):
    """Solve, print a table, draw errors over nodes into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "classical", rows(parameters, answer), figure)
    return answer


def show(answer):
    columns = ("obstacle", "method", "nodes", "error", "order", "estimate", "seconds")
    print("  ".join(f"{name:>10}" for name in columns))
    for row in answer["runs"]:
        cells = (f"{row[name]:.3g}" if isinstance(row[name], float) else "-" if row[name] is None else str(row[name])
                 for name in columns)
        print("  ".join(f"{cell:>10}" for cell in cells), row["failure"] or "")


def rows(parameters, answer):
    """A row a run; its seconds, which no other run has again, are left to the table."""
    own = {"command": command("classical", parameters)}
    return [{**own, **{name: cell for name, cell in row.items() if name != "seconds"}, "rtol": parameters.rtol}
            for row in answer["runs"]]


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """Classical limit against the closed forms: relative L2 error over nodes of uniform cells (lines) and of fitted panels (open
    marks), for cylinder, flat punch and wedge.
    """
    drawing, axis = plots.figure(height=3.0)
    for (obstacle, rows), colour, marker in zip(grouped(records, "obstacle").items(), plots.COLOURS, plots.MARKERS):
        cells = [row for row in rows if row["method"] == "cells"]
        axis.loglog([row["nodes"] for row in cells], [row["error"] for row in cells], color=colour, marker=marker, label=obstacle)
        panels = [row for row in rows if row["method"] == "panels" and row["error"]]
        axis.loglog([row["nodes"] for row in panels], [row["error"] for row in panels], color=colour, marker=marker,
                    linestyle="none", markerfacecolor="none")
    axis.set(xlabel="nodes", ylabel="relative $L_2$ error of the pressure")
    plots.legend_below(axis, 3, title="lines: uniform cells, single marks: fitted panels")
    return drawing
