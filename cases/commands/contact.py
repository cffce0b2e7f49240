"""Any rigid obstacle on a half-plane: its height as a formula in x, or as samples in a file.

Geometry   half-plane x2 < 0; an obstacle of the given height over x1, pressed down by a force per thickness;
           blocks of side ell at each point of the surface, rotated by psi0.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      panels fitted to the zones of each corner; between the ends of a window uniform cells, which take
           many samples or waves in a second.
Reference  the cylinder x**2/(2 R) and the wedge, whose classical limits have closed forms.
Look at    the zones of either corner, and peaks of pressure where the slope of the obstacle jumps.
Units      as given, any that go together, such as mm, MPa and N/mm: nothing is scaled.
EXPR       numbers, x, pi, e, inf (no obstacle there), + - * / **, parentheses, and of numpy abs sqrt cbrt exp
           log sin cos tan arcsin arccos arctan sinh cosh tanh sign floor ceil minimum maximum hypot arctan2
           power clip, where(x < 0, 1, 2). One that begins with a minus is written --height=EXPR.
FILE       two columns, x (ascending) and height, with commas, semicolons or blanks between them; a header is
           left out. Straight lines between the samples, no obstacle beyond them. Each sample is a jump of the
           slope: a hundred in contact take seconds, a thousand minutes, with a window they cost nothing.
"""

import math
import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import microblock as mb
from microblock.data.expressions import function_of_x
from microblock.data.records import grouped
from microblock.data.samples import read_samples
from microblock.model.summary import intervals

from ..common.case import of_kinds, profiles
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_events, print_table, returned
from ..common.three_ways import draw_zones

RTOL = {"panels": 1e-3, "cells": 1e-2}
CELLS = "Cells(nodes=..., window=...) take"  # the advice of an obstacle that is too wide for panels
LAWS = {"microblock": mb.Microblock, "unilateral": mb.Unilateral, "microclamped": mb.Microclamped}
LEVELS = {"A": 0.2, "B": 0.0, "full": -0.2, "contact": 0.0}  # of the bars in the figure
SHOWN = ("load", "half_width", "method", "unknowns", "error_estimate")


@dataclass(frozen=True)
class Parameters(Checked):
    height: str | None = option(
        None,
        "height of the obstacle, a formula in x such as 'x**2/20' (length)",
        str,
        metavar="EXPR",
        not_with={"samples": "each is an obstacle"},
    )
    samples: str | None = option(None, "file with samples of the height (lengths)", str, metavar="FILE")
    window: tuple = option(
        (),
        "ends of the part of x1 in which the obstacle may touch: uniform cells in place of panels",
        nargs=2,
        metavar=("L", "R"),
        not_with={"path": "cells follow no events"},
    )
    loads: tuple = option((1.0,), "forces per thickness", above=0, nargs="+", metavar="LOAD")
    E: float = option(100.0, "Young's modulus (stress)", above=0)
    nu: float = poisson()
    beta: float = coupling()
    ell: float = option(0.1, "length scale of the material, and side of a block (length)", above=0)
    psi0_deg: float = option(
        0.0,
        "initial rotation of the blocks in degrees, counterclockwise",
        at_least=-45,
        at_most=45,
        only_with={"contact": "microblock"},
    )
    contact: str = option("microblock", "contact law", str, choices=tuple(LAWS))
    rtol: float | None = option(
        None,
        "relative L2 error of pressure and of micromoment over ell, both over the pressure "
        f"({RTOL['panels']:g} if not given, {RTOL['cells']:g} with a window)",
        above=0,
        below=1,
    )
    path: bool = option(False, "also the events from first touch to the largest load", bool)

    def relate(self):
        self.obstacle, self.method

    @cached_property
    def obstacle(self):
        if self.samples is not None:
            return read_samples(self.samples, "samples")
        if self.height is None:
            raise mb.BadArgument("height", "EXPR", "must be given, or --samples FILE")
        return function_of_x(self.height, "height")

    @property
    def method(self):
        return mb.Cells(window=self.window) if self.window else None

    @cached_property
    def problem(self):
        """The contact problem: on panels, or on cells of the window."""
        body = mb.HalfPlane(mb.Cosserat(self.E, self.nu, self.ell, beta=self.beta))
        law = (
            mb.Microblock(math.radians(self.psi0_deg))
            if self.contact == "microblock"
            else LAWS[self.contact]()
        )
        return mb.Contact(body, self.obstacle, law, self.method)

    def resolved(self):
        return replace(self, rtol=self.rtol or RTOL["cells" if self.window else "panels"])


def solve(parameters):
    """The State at each load, in the order given."""
    states = []
    for load in parameters.loads:
        initial = states[-1] if states else None
        states.append(parameters.problem.solve(load=load, rtol=parameters.rtol, initial=initial))
    return states


def result(parameters, quiet=True):
    """The contract's object: `State.to_dict` of each load, and the events of the path, if asked for."""
    start, chosen = time.perf_counter(), parameters.resolved()
    try:
        found = {"states": [state.to_dict() for state in solve(chosen)]}
        if chosen.path:
            path = chosen.problem.path(load=max(chosen.loads), rtol=chosen.rtol)
            found["events"] = path.to_dict()["events"]
    except mb.BadArgument as failure:
        if failure.name != "obstacle":
            raise
        name = "height" if chosen.samples is None else "samples"
        words = failure.allowed.replace(CELLS, "--window L R takes")
        raise mb.BadArgument(name, getattr(chosen, name), words) from failure
    return returned(chosen, start, **found)


def show(answer):
    """A table of the states, their zones, the events and what is to be kept in mind."""
    print_table(answer["states"], SHOWN, 9)
    for state in answer["states"]:
        zones = [f"{name} {intervals(own)}" for name, own in state["zones"].items() if own]
        print(f"load {state['load']:g}: {'; '.join(zones)}")
    print_events(answer.get("events", ()))
    for words in dict.fromkeys(words for state in answer["states"] for words in state["warnings"]):
        print(f"warning: {words}")


def rows(parameters, answer):
    """A row a node, with the number of its interval of contact, and one for each zone."""
    states = [
        {**state, "profile": {**state["profile"], "zone": _numbers(state)}} for state in answer["states"]
    ]
    nodes = profiles(
        states, "load", "error_estimate", columns=("zone", "x", "pressure", "micromoment", "psi")
    )
    zones = [
        {"load": state["load"], "name": name, "left": left, "right": right}
        for state in states
        for name, own in state["zones"].items()
        for left, right in own
    ]
    return of_kinds(node=nodes, zone=zones)


def _numbers(state):
    """The number of the interval of contact at or after each node."""
    return np.searchsorted([right for _, right in state["zones"]["contact"]], state["x"]).tolist()


def figure(records):
    """Pressure (a), micromoment (b) and zones (c) of an obstacle at each load.

    In (c) a bar for each interval in which the left corner (A), the right one (B) or both (full) are closed;
    of a law without corners the contact. Loads from dark to light in (a) and (b), upwards in (c).
    """
    from microblock.view import plots

    kinds = grouped(records, "kind")
    loads = grouped(kinds["node"], "load")
    drawing, axes = plots.figure(3, 1, height=1.6, sharex=True)
    for colour, (load, nodes) in zip(plots.shades(len(loads)), loads.items()):
        draw_zones(axes[0], nodes, "pressure", color=colour, label=f"{load:g}")
        draw_zones(axes[1], nodes, "micromoment", color=colour)
    last = {row["name"]: row for row in kinds["zone"]}
    colours = dict(zip(LEVELS, ("C0", "C1", "0.3", "0.3")))
    for row in kinds["zone"]:
        if row["name"] != "contact" or len(last) == 1:
            level = list(loads).index(row["load"]) + LEVELS[row["name"]]
            look = {"color": colours[row["name"]], "linewidth": 3, "solid_capstyle": "butt"}
            axes[2].plot((row["left"], row["right"]), (level, level), **look)
            if row is last[row["name"]]:
                plots.label(axes[2], row["right"], level, row["name"], look["color"], (3, -3))
    axes[0].set_ylabel("pressure")
    axes[1].set_ylabel("micromoment")
    axes[2].set(xlabel="$x_1$", ylabel="load", ylim=(-0.5, len(loads) - 0.5))
    axes[2].set_yticks(range(len(loads)), [f"{load:g}" for load in loads])
    plots.letter(axes)
    plots.legend_of_all(drawing, axes[0], title="load")
    return drawing


FIGURES = {"contact": (rows, figure)}
