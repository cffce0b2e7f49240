"""Flat and tilted punch on a half-plane, classical and with microblocks.

Geometry   half-plane x2 < 0; a rigid punch |x1| <= b, flat or turned so that its left end is deeper, pressed down by a force P;
           blocks of side ell = alpha b (psi0 = 0).
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      the contact line alone, panels fitted to the zones of each corner (`Contact(HalfPlane(...), ...)`).
Reference  classical limit: closed forms `references.punch`, `tilted_punch`. Microblocks: fitted finite elements, uniform cells.
Look at    each corner has its own two ends, ell/2 beside the punch's, so that blocks on the rim stand on one corner; a
           gap opens between rim and middle. A tilted punch leans on its deep end with a free edge that moves with the load.
Units      lengths over b, E* = 1; loads over pi/2 E* tilt b, from which on a classical punch lies on its whole width (0: the flat
           punch; the tilt drops out); pressures over P/(2 b). L2 norms with the distance from the ends as weight.
"""

import math
import time
from dataclasses import asdict, dataclass

import numpy as np
from tqdm import tqdm

from cases import three_ways
from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, require_finite
from microblock.obstacles import Punch
from microblock.study import column, grouped

TILT = 0.01              # drops out: the problem is linear in tilt and load together
FLAT = 0.0               # the load that stands for the flat punch
FLAT_LOAD = 0.02         # drops out too


@dataclass(frozen=True)
class Parameters:
    loads: tuple = option((FLAT, 0.5, 1.0, 2.0), "loads of the tilted punch in units of that of full classical contact; 0: the "
                          "flat punch", nargs="+", metavar="LOAD")
    alpha: float = option(0.3, "ell over b")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number, 0 < beta < 2")
    rtol: float = option(1e-4, "of the panels")
    nodes: int = option(20000, "cells that judge", int)
    rtol_fe: float = option(1e-2, "of the finite elements that judge")

    def __post_init__(self):
        object.__setattr__(self, "loads", tuple(float(load) for load in self.loads))
        for load in self.loads:
            require_finite(loads=load)
            if load < 0 or 0 < load < 0.01 or load > 1e3:
                raise BadArgument("loads", load, "must be 0 or lie between 0.01 and 1000")
        require_finite(alpha=self.alpha)
        if not 0.01 <= self.alpha <= 2:
            raise BadArgument("alpha", self.alpha, "must lie between 0.01 and 2")
        three_ways.check(self)


def scene(load):
    """(Punch, force)."""
    return (Punch(1.0), FLAT_LOAD) if load == FLAT else (Punch(1.0, TILT), load*math.pi/2*TILT)


def solve(parameters, law, load):
    """(LineState, seconds) on panels."""
    return three_ways.on_panels(three_ways.solid_of(parameters, law), *_order(scene(load), law), parameters.rtol)


def _order(scene, law):
    return scene[0], law, scene[1]


def reference(load):
    """(pressure(x), edges) of the classical closed form."""
    from microblock import references      # judges only: the computation does without
    punch, force = scene(load)
    if load == FLAT:
        return lambda x: references.punch(x, force, 1.0), (-1.0, 1.0)
    scene_of = force, 1.0, TILT, 1.0
    return lambda x: references.tilted_punch(x, *scene_of)[0], references.tilted_punch(0.0, *scene_of)[1]


def observe(parameters, law, load):
    """(record of a state, its profile)."""
    state, seconds = solve(parameters, law, load)
    zones, widths = three_ways.zones_of(state)
    exact, edges = reference(load) if law == "classical" else (None, None)
    mean = state.load/2
    found = {"law": law, "load": load, "zones": zones, "half_width": widths[0], "inner_half_width": widths[1],
             "centre": three_ways.centre(state), "unknowns": len(state.q) + 1, "error_estimate": state.error_estimate,
             "edges_error": float(np.abs(np.subtract(zones["contact"][0], edges)).max()) if edges else None,
             **three_ways.judged(state, parameters.nodes, parameters.rtol_fe, exact), "seconds": seconds}
    return found, three_ways.profile_of(state, mean)


def result(parameters, quiet=True):
    """The case's object: a state a load and law."""
    start = time.perf_counter()
    chosen = [(law, load) for load in parameters.loads for law in three_ways.LAWS]
    states = []
    for one in tqdm(chosen, disable=quiet, unit="state"):
        found, profile = observe(parameters, *one)
        states.append({**found, "profile": {name: column(profile, name) for name in profile[0]}})
    return returned(parameters, start, model="halfplane", states=states)


def run(parameters, out=None, quiet=False):
    """Solve, print a table, draw the pressures into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        three_ways.table(answer["states"], ("load", "law", "half_width", "inner_half_width", "centre", "unknowns",
                                            "error_estimate", "error", "edges_error", "difference_fe", "estimate_fe",
                                            "difference_cells", "estimate_cells", "seconds"), 14)
    if out:
        keep(out, "punch", rows(parameters, answer), figure)
    return answer


def rows(parameters, answer):
    """A row a node, with every parameter."""
    common = {"command": command("punch", parameters), **asdict(parameters), "loads": None}
    found = []
    for state in answer["states"]:
        seen = {name: state[name] for name in ("law", "load", "error_estimate", "error", "difference_fe", "difference_cells")}
        found += [{**common, **seen, **dict(zip(state["profile"], node))} for node in zip(*state["profile"].values())]
    return found


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """Flat and tilted punch: pressure of each load for microblocks, the unilateral law, and the classical limit (markers) on its
    closed form. Each corner has its own ends, half a block beside the punch's."""
    loads = grouped(records, "load")
    drawing, axes = plots.figure(-(-len(loads)//2), min(2, len(loads)), height=2.1, sharex=True, squeeze=False)
    x = np.linspace(-1, 1, 2001)[1:-1]
    for number, (axis, (load, nodes)) in enumerate(zip(axes.flat, loads.items())):
        laws = grouped(nodes, "law")
        exact = reference(load)[0](x)/(scene(load)[1]/2)
        axis.plot(x, exact, color="0.5", linewidth=0.8, label="classical closed form")
        axis.plot(column(laws["classical"], "x"), column(laws["classical"], "pressure"), ".", color="0.5", markersize=3,
                  label="classical, panels")
        for law, colour, style in zip(("unilateral", "microblock"), plots.COLOURS, ("--", "-")):
            three_ways.draw_zones(axis, laws[law], "pressure", color=colour, linestyle=style, label=law)
        told = "flat" if load == FLAT else rf"tilted, $P/P_\mathrm{{full}} = {load:g}$"
        axis.set(xlabel="$x_1/b$", ylabel=r"$2 b\,p/P$", ylim=(0, 4), title=f"({chr(97 + number)})  {told}")
        axis.label_outer()
    for axis in axes.flat[len(loads):]:
        axis.set_visible(False)
    plots.legend_of_all(drawing, axes[0, 0])
    return drawing
