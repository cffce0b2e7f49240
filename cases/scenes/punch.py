"""Flat and tilted punch on a half-plane, classical and with microblocks.

Geometry   half-plane x2 < 0; a rigid punch |x1| <= b, flat or tilted so that its left end is deeper, pressed
           down by a force P; blocks of side ell = alpha b (psi0 = 0).
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      the contact line alone, panels fitted to the zones of each corner (`Contact(HalfPlane(...), ...)`).
Reference  classical limit: `closed_forms.punch`, `closed_forms.tilted_punch`. Microblocks: fitted finite
           elements, uniform cells.
Look at    each corner has its own two ends, ell/2 beside the punch's, so that blocks on the rim stand on one
           corner; a gap opens between rim and middle. A tilted punch leans on its deep end with a free edge
           that moves with the load.
Units      lengths over b, E* = 1; loads over pi/2 E* tilt b, from which on a classical punch lies on its
           whole width (0: the flat punch; the tilt drops out); pressures over P/(2 b). L2 norms with the
           distance from the ends as weight.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped

from ..common import three_ways
from ..common.case import profiles
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

TILT = 0.01  # drops out: the problem is linear in tilt and load together
FLAT = 0.0  # the load that stands for the flat punch
FLAT_LOAD = 0.02  # drops out too


@dataclass(frozen=True)
class Parameters(Checked):
    loads: tuple = option(
        (FLAT, 0.5, 1.0, 2.0),
        "loads of the tilted punch in units of that of full classical contact; 0: the flat punch",
        at_least=0.01,
        at_most=1000,
        besides=FLAT,
        nargs="+",
        metavar="LOAD",
    )
    alpha: float = option(0.3, "ell over b", at_least=0.01, at_most=2)
    nu: float = poisson()
    beta: float = coupling()
    rtol: float = option(1e-4, "of the panels", above=0, below=1)
    nodes: int = three_ways.cells_that_verify(20000)
    rtol_fe: float = three_ways.elements_that_verify()


def loaded(load):
    """(Punch, force)."""
    return (mb.Punch(1.0), FLAT_LOAD) if load == FLAT else (mb.Punch(1.0, TILT), load * math.pi / 2 * TILT)


def solve(parameters, law, load):
    """(State, seconds) on panels."""
    obstacle, force = loaded(load)
    return three_ways.on_panels(three_ways.solid_of(parameters, law), obstacle, law, force, parameters.rtol)


def reference(load):
    """(pressure(x), edges) of the classical closed form."""
    from microblock.model import closed_forms  # for verification only

    force = loaded(load)[1]
    if load == FLAT:
        return lambda x: closed_forms.punch(x, force, 1.0), (-1.0, 1.0)
    given = force, 1.0, TILT, 1.0
    return lambda x: closed_forms.tilted_punch(x, *given)[0], closed_forms.tilted_punch(0.0, *given)[1]


def observe(parameters, law, load):
    """(record of a state, its profile)."""
    state, seconds = solve(parameters, law, load)
    zones, widths = three_ways.zones_of(state)
    exact, edges = reference(load) if law == "classical" else (None, None)
    mean = state.load / 2
    found = {
        "law": law,
        "load": load,
        "zones": zones,
        "half_width": widths[0],
        "inner_half_width": widths[1],
        "centre": three_ways.centre(state),
        "unknowns": state.unknowns,
        "error_estimate": state.error_estimate,
        "edges_error": float(np.abs(np.subtract(zones["contact"][0], edges)).max()) if edges else None,
        **three_ways.verified(state, parameters.nodes, parameters.rtol_fe, exact),
        "seconds": seconds,
    }
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


def show(answer):
    print_table(
        answer["states"],
        (
            "load",
            "law",
            "half_width",
            "inner_half_width",
            "centre",
            "unknowns",
            "error_estimate",
            "error",
            "edges_error",
            "difference_fe",
            "estimate_fe",
            "difference_cells",
            "estimate_cells",
            "seconds",
        ),
    )


def rows(parameters, answer):
    """A row a node."""
    return profiles(
        answer["states"], "law", "load", "error_estimate", "error", "difference_fe", "difference_cells"
    )


def figure(records):
    """Under a punch each corner of the blocks has its own ends, half a block beside those of the punch.

    Pressure under a rigid punch of half-width b: flat (a) and tilted (b-d), at three loads over P_full, from
    which on a classical tilted punch lies on all its width. Orange: microblocks; blue, dashed: the same solid
    without corners; grey: the classical solid, closed form (line) and panels (dots).

    Seen: pressures that become infinite at the ends of the punch that touch, on both sides in (a) and (d), on
    the left in (b) and (c); there the orange ones have two steep ends each, one outside the punch and one
    inside, where the others have one; towards an end that does not touch all fall to zero.
    """
    from microblock.view import plots

    loads = grouped(records, "load")
    drawing, axes = plots.figure(
        -(-len(loads) // 2), min(2, len(loads)), height=1.7, sharex=True, sharey=True, squeeze=False
    )
    x = np.linspace(-1, 1, 2001)[1:-1]
    titles = []
    for axis, (load, nodes) in zip(axes.flat, loads.items()):
        laws = grouped(nodes, "law")
        exact = reference(load)[0](x) / (loaded(load)[1] / 2)
        axis.plot(x, exact, color="0.5", linewidth=0.8)
        classical = laws["classical"]
        axis.plot(column(classical, "x"), column(classical, "pressure"), ".", color="0.5", markersize=2)
        for law, colour, style in zip(("unilateral", "microblock"), plots.COLOURS, ("--", "-")):
            three_ways.draw_zones(axis, laws[law], "pressure", color=colour, linestyle=style)
        titles.append("flat" if load == FLAT else rf"tilted, $P/P_\mathrm{{full}} = {load:g}$")
        axis.set(xlabel="$x_1/b$", ylabel=r"$2 b\,p/P$", ylim=(0, 4))
        axis.label_outer()
    for axis in axes.flat[len(loads) :]:
        axis.set_visible(False)
    plots.letter(axes.flat[: len(loads)], *titles)
    return drawing


FIGURES = {"punch": (rows, figure)}
