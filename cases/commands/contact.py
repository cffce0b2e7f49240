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
import sys
import time
from dataclasses import dataclass, replace
from functools import cached_property

import microblock as mb
from microblock.data.expressions import function_of_x
from microblock.data.records import write_records
from microblock.data.samples import read_samples
from microblock.model.summary import intervals

from ..common.case import named, profiles
from ..common.laws import LAWS
from ..common.options import Checked, coupling, option, poisson, rotation
from ..common.records import print_events, print_table, returned

RTOL = {"panels": 1e-3, "cells": 1e-2}
CELLS = "Cells(nodes=..., window=...) take"  # the advice of an obstacle that is too wide for panels


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
    psi0_deg: float = rotation()
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
    """The State at each load, in the order given, and what the contract returns of them."""
    start, chosen, states = time.perf_counter(), parameters.resolved(), []
    try:
        for load in chosen.loads:
            initial = states[-1] if states else None
            states.append(chosen.problem.solve(load=load, rtol=chosen.rtol, initial=initial))
        found = {"states": [state.to_dict() for state in states]}
        if chosen.path:
            path = chosen.problem.path(load=max(chosen.loads), rtol=chosen.rtol)
            found["events"] = path.to_dict()["events"]
    except mb.BadArgument as failure:
        if failure.name != "obstacle":
            raise
        name = "height" if chosen.samples is None else "samples"
        words = failure.allowed.replace(CELLS, "--window L R takes")
        raise mb.BadArgument(name, getattr(chosen, name), words) from failure
    return states, returned(chosen, start, **found)


def result(parameters, quiet=True):
    """The contract's object: `State.to_dict` of each load, and the events of the path, if asked for."""
    return solve(parameters)[1]


def show(answer):
    """A table of the states, their zones, the events and what is to be kept in mind."""
    print_table(answer["states"], ("load", "half_width", "method", "unknowns", "error_estimate"), 9)
    for state in answer["states"]:
        zones = [f"{name} {intervals(pairs)}" for name, pairs in state["zones"].items() if pairs]
        print(f"load {state['load']:g}: {'; '.join(zones)}")
        for words in state["warnings"]:
            print(f"warning: {words}")
    print_events(answer.get("events", ()))


def run(parameters, out=None, quiet=False):
    """The contract's object; it is printed unless `quiet`. A folder gets `State.plot` of each load, with
    pressure, micromoment and zones, and a table of the nodes.
    """
    states, answer = solve(parameters)
    if not quiet:
        show(answer)
    if out:
        for state in states:
            picture = out / f"contact_{state.load}"
            state.plot(f"{picture}.png").savefig(f"{picture}.pdf")
        columns = "x", "weight", "pressure", "micromoment", "psi"
        nodes = profiles(answer["states"], "load", "error_estimate", columns=columns)
        write_records(out / "contact.csv", named(sys.modules[__name__], parameters, nodes))
    return answer
