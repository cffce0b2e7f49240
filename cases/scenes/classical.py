"""The classical limit on uniform cells: Hertz ellipse, punch's inverse root, wedge's logarithm.

Geometry   half-plane x2 < 0; a cylinder, a flat punch, a blunt wedge pressed down by a force per thickness.
Equations  classical unilateral contact: the law `Unilateral` at a coupling beta of 1e-10.
Model      uniform cells without images, products by FFT (`Cells`); beside it panels fitted to the edges
           (`Panels`).
Reference  the closed forms of `microblock.model.closed_forms`.
Look at    order 1 for the cylinder, 1/2 for the wedge (its logarithm), 1/4 for the punch (infinite at its
           ends); panels know the edges.
Units      lengths over the half-width of the contact a; errors are relative, in L2, at the centres of the
           cells (panels: at the cells' centres of the second finest grid), for the punch with the weight
           sqrt(1 - (x/a)^2) that makes the norm finite.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import grouped

from ..common.options import Checked, option
from ..common.records import print_table, returned, without_seconds

NU, BETA = 0.3, 1e-10
WINDOW = (-1.25, 1.25)
SLOPE = 0.01
# obstacle, load for the half-width 1 at E* = 1
OBSTACLES = {
    "cylinder": (mb.Cylinder(1.0), math.pi / 4),
    "punch": (mb.Punch(1.0), 1.0),
    "wedge": (mb.Wedge(SLOPE), SLOPE),
}


@dataclass(frozen=True)
class Parameters(Checked):
    nodes: tuple = option(
        (1000, 3000, 10000, 30000, 100000),
        "cells of the window of 2.5 half-widths",
        int,
        at_least=32,
        at_most=2**21,
        fewest=2,
        order="ascending",
        nargs="+",
        metavar="N",
    )
    rtol: float = option(1e-3, "of the fitted panels", at_least=1e-12, below=1)


def problem(obstacle, method=None):
    """The contact problem of an obstacle by its name."""
    body = mb.HalfPlane(mb.Cosserat(E=1 - NU**2, nu=NU, ell=1.0, beta=BETA))
    return mb.Contact(body, OBSTACLES[obstacle][0], mb.Unilateral(), method)


def solve(obstacle, nodes):
    """(State on cells, seconds)."""
    start = time.perf_counter()
    state = problem(obstacle, mb.Cells(nodes=nodes, window=WINDOW)).solve(load=OBSTACLES[obstacle][1])
    return state, time.perf_counter() - start


def reference(obstacle, x):
    """The closed form at x."""
    from microblock.model import closed_forms  # for verification only

    pressure = {"cylinder": closed_forms.hertz, "punch": closed_forms.punch, "wedge": closed_forms.wedge}[
        obstacle
    ]
    return pressure(x, OBSTACLES[obstacle][1], 1.0)


def error(obstacle, x, pressure):
    """Relative L2 error, see the header; equal weights of the points."""
    weight = np.sqrt(np.maximum(1 - x**2, 0)) if obstacle == "punch" else np.ones_like(x)
    exact = reference(obstacle, x)
    return float(np.sqrt(weight @ (pressure - exact) ** 2 / (weight @ exact**2)))


def on_panels(obstacle, x, rtol):
    """Row of the fitted panels, with the error at x; failed if they do not reach rtol."""
    start = time.perf_counter()
    try:
        state = problem(obstacle).solve(load=OBSTACLES[obstacle][1], rtol=rtol)
    except mb.MicroblockError as failure:
        return {
            "obstacle": obstacle,
            "method": "panels",
            "nodes": None,
            "error": None,
            "order": None,
            "estimate": None,
            "seconds": time.perf_counter() - start,
            "failure": " ".join(str(failure).split()),
        }
    seconds = time.perf_counter() - start
    return {
        "obstacle": obstacle,
        "method": "panels",
        "nodes": state.unknowns - 1,
        "error": error(obstacle, x, state.pressure_at(x)),
        "order": None,
        "estimate": state.error_estimate,
        "seconds": seconds,
        "failure": None,
    }


def result(parameters, quiet=True):
    """The case's object: a row a run."""
    start, runs = time.perf_counter(), []
    for obstacle in tqdm(OBSTACLES, disable=quiet, unit="obstacle"):
        grid = []
        for nodes in parameters.nodes:
            state, seconds = solve(obstacle, nodes)
            found = error(obstacle, state.x, state.pressure)
            before, order = grid[-1] if grid else None, None
            if before and found:
                order = math.log(before["error"] / found) / math.log(nodes / before["nodes"])
            grid.append(
                {
                    "obstacle": obstacle,
                    "method": "cells",
                    "nodes": nodes,
                    "error": found,
                    "order": order,
                    "estimate": state.error_estimate,
                    "seconds": seconds,
                    "failure": None,
                }
            )
        x = (
            WINDOW[0]
            + (WINDOW[1] - WINDOW[0]) * (np.arange(parameters.nodes[-2]) + 0.5) / parameters.nodes[-2]
        )
        runs += [*grid, on_panels(obstacle, x, parameters.rtol)]
    return returned(parameters, start, runs=runs)


def show(answer):
    print_table(
        answer["runs"], ("obstacle", "method", "nodes", "error", "order", "estimate", "seconds", "failure")
    )


def rows(parameters, answer):
    """A row a run; its seconds, which no other run has again, are left to the table."""
    return without_seconds(answer["runs"])


def figure(records):
    """In the classical limit cells converge as the pressure is smooth; panels, which know the edges, need
    twenty nodes.

    Relative L2 error of the pressure against the closed forms of Hertz's cylinder, the wedge and the flat
    punch, over the nodes of uniform cells (full marks, lines) and of panels fitted to the edges (open marks,
    at the left). The orders of the cells are 1 for the cylinder, whose pressure has a square root at its
    edges, 1/2 for the wedge, with a logarithm in the middle, and 1/4 for the punch, infinite at its ends.

    Seen: three falling lines at the right, from top to bottom the steeper ones: punch, wedge, cylinder; and
    three single marks at the lower left, below all lines.
    """
    from microblock.view import plots

    drawing, axis = plots.figure(height=2.6)
    for (obstacle, rows), colour, marker in zip(
        grouped(records, "obstacle").items(), plots.COLOURS, plots.MARKERS
    ):
        cells = [row for row in rows if row["method"] == "cells"]
        nodes, errors = [row["nodes"] for row in cells], [row["error"] for row in cells]
        axis.loglog(nodes, errors, color=colour, marker=marker)
        plots.label(axis, nodes[0], errors[0], obstacle, colour, (-6, 0))
        panels = [row for row in rows if row["method"] == "panels" and row["error"]]
        axis.loglog(
            [row["nodes"] for row in panels],
            [row["error"] for row in panels],
            color=colour,
            marker=marker,
            linestyle="none",
            markerfacecolor="none",
        )
    axis.set(xlabel="nodes", ylabel="relative $L_2$ error of the pressure")
    plots.label(axis, 30, 1e-6, "fitted panels", "0.35", (4, 0))
    plots.label(axis, 2e4, 0.5, "uniform cells", "0.35", (0, 0))
    axis.set_ylim(None, 1)
    return drawing


FIGURES = {"classical": (rows, figure)}
