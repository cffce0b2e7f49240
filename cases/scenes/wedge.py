"""Blunt wedge on a half-plane with microblocks: from two separate zones to the classical wedge.

Geometry   half-plane x2 < 0; a blunt wedge whose flanks rise by a slope from its edge at x1 = 0, pressed down
           by a force P; blocks of side ell (psi0 = 0).
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      the contact line alone, panels fitted to zones and slope discontinuities
           (`Contact(HalfPlane(...), ...)`).
Reference  classical limit: closed form `closed_forms.wedge`. Microblocks: scaling laws (a/ell depends on
           P/(E* slope ell), nu, beta only; towards light loads each corner meets the wedge alone, with a
           compliance of its own; towards heavy ones the classical a follows), uniform cells and fitted finite
           elements.
Look at    light loads: two zones at -+ell/2, one for each corner; they merge at one load; then a plateau, and
           a classical wedge whose logarithm is split in two.
Units      lengths over ell, loads over E* slope ell (their classical half-width over ell), pressures over E*
           slope.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped
from microblock.halfplane.kernels import short_waves

from ..common import three_ways
from ..common.case import profiles
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

SLOPE = 0.01  # drops out: the problem is linear in slope and load together
NEAREST = 1e-4  # of the load: how near to the middle the classical pressure is drawn
OTHER = 3.0  # times as much slope, load and ell: the scaling law's check
DRAWN = (0.1, 1.0, 4.0)  # loads of the pressures in the figure: the nearest ones


@dataclass(frozen=True)
class Parameters(Checked):
    loads: tuple = option(
        (0.03, 0.1, 0.3, 0.6, 1.0, 2.0, 4.0, 10.0, 30.0),
        "P over E* slope ell",
        at_least=1e-3,
        at_most=1000,
        order="ascending",
        nargs="+",
        metavar="LOAD",
    )
    nu: float = poisson()
    beta: float = coupling()
    rtol: float = option(1e-5, "of the panels", above=0, below=1)
    nodes: int = three_ways.cells_that_verify(8000)
    rtol_fe: float = three_ways.elements_that_verify()
    alpha = 1.0  # ell is the unit


def solve(parameters, law, load):
    """(State, seconds) on panels."""
    return three_ways.on_panels(
        three_ways.solid_of(parameters, law), mb.Wedge(SLOPE), law, SLOPE * load, parameters.rtol
    )


def scaled(parameters, law, load):
    """The same with another slope and block: what must be the same state."""
    solid = replace(three_ways.solid_of(parameters, law), ell=OTHER)
    return three_ways.on_panels(
        solid, mb.Wedge(OTHER * SLOPE), law, OTHER**2 * SLOPE * load, parameters.rtol
    )[0]


def reference(load):
    """Pressure (x) of the classical closed form."""
    from microblock.model import closed_forms  # for verification only

    return lambda x: closed_forms.wedge(x, SLOPE * load, load)


def light(parameters, load):
    """Half-width of each corner's zone while the two do not feel each other: half the load on a compliance of
    its own.

    Over distances far below ell a corner acts on its own gap like a classical half-plane of the compliance
    c_u + c_phi (docs/theory/halfplane.md, "Where the corners meet") instead of c = 2/E*.
    """
    return load / 4 * sum(short_waves(three_ways.solid_of(parameters, "microblock")))


def coalescence(parameters):
    """(load, its error) at which the two zones merge."""
    solid = three_ways.solid_of(parameters, "microblock")
    problem = mb.Contact(mb.HalfPlane(solid), mb.Wedge(SLOPE), mb.Microblock())
    return tuple(one / SLOPE for one in problem.solver.coalescence())


def observe(parameters, law, load):
    """(record of a state, its profile)."""
    state, seconds = solve(parameters, law, load)
    zones, (outer, inner) = three_ways.zones_of(state)
    other = three_ways.zones_of(scaled(parameters, law, load))[1]
    found = {
        "law": law,
        "load": load,
        "zones": zones,
        "half_width": outer,
        "inner_half_width": inner,
        "over_classical": outer / load,
        "over_light": (outer - inner) / 2 / light(parameters, load) if law == "microblock" else None,
        "scaling_error": float(np.abs(np.array(other) / OTHER - (outer, inner)).max() / outer),
        "unknowns": state.unknowns,
        "error_estimate": state.error_estimate,
        **three_ways.verified(
            state, parameters.nodes, parameters.rtol_fe, reference(load) if law == "classical" else None
        ),
        "seconds": seconds,
    }
    return found, three_ways.profile_of(state, SLOPE)


def result(parameters, quiet=True):
    """The case's object: a state a load and law."""
    start, states = time.perf_counter(), []
    chosen = [(law, load) for load in parameters.loads for law in three_ways.LAWS]
    for one in tqdm(chosen, disable=quiet, unit="state"):
        found, profile = observe(parameters, *one)
        states.append({**found, "profile": {name: column(profile, name) for name in profile[0]}})
    load, error = coalescence(parameters)
    return returned(
        parameters, start, model="halfplane", coalescence=load, coalescence_error=error, states=states
    )


def show(answer):
    print_table(
        answer["states"],
        (
            "load",
            "law",
            "half_width",
            "inner_half_width",
            "over_classical",
            "over_light",
            "scaling_error",
            "error_estimate",
            "error",
            "difference_fe",
            "estimate_fe",
            "difference_cells",
            "estimate_cells",
        ),
    )
    print(
        f"the two zones of microblocks merge at the load {answer['coalescence']:.9g} "
        f"+- {answer['coalescence_error']:.1e}"
    )


def rows(parameters, answer):
    """A row a node."""
    states = [{**state, "coalescence": answer["coalescence"]} for state in answer["states"]]
    return profiles(
        states,
        "law",
        "load",
        "half_width",
        "inner_half_width",
        "error_estimate",
        "error",
        "difference_fe",
        "difference_cells",
        "coalescence",
    )


def figure(records):
    """A blunt wedge touches blocks in two zones, one for each corner, which meet at a load of 3.8 E* slope
    ell.

    (a) Edges of the contact over the load, in blocks: dots outer, squares inner edge; s is the slope of the
    wedge. Light loads follow the dashed lines, on which each corner meets the wedge alone, heavy ones the
    classical wedge (grey); between them, at the vertical line, the zones meet. (b) Pressure at three loads;
    dotted: classical. All pressures are infinite at their peaks, like a logarithm, near which the lines end.

    Seen: in (a) an outer edge that stays at one half and then rises along the grey line, and an inner edge
    that falls to zero; in (b) pairs of peaks half a block beside the middle, where the classical ones are
    single.
    """
    from microblock.view import plots

    given = Parameters(**{name: records[0][name] for name in ("nu", "beta")})
    laws = grouped(records, "law")
    drawing, axes = plots.figure(2, 1, height=2.2)
    firsts = [own[0] for own in grouped(laws["microblock"], "load").values()]
    loads, outer = (np.array(column(firsts, name)) for name in ("load", "half_width"))
    axes[0].loglog(loads, outer, "o", color=plots.COLOURS[0])
    open_ = [row for row in firsts if row["inner_half_width"] > 0]
    axes[0].loglog(column(open_, "load"), column(open_, "inner_half_width"), "s", color=plots.COLOURS[1])
    fine = np.geomspace(loads[0], loads[-1], 201)
    axes[0].loglog(fine, fine, color="0.5", linewidth=0.8)
    alone = fine[light(given, fine) < 0.5]
    for sign in (1, -1):
        axes[0].loglog(alone, 0.5 + sign * light(given, alone), "--", color="k", linewidth=0.8)
    axes[0].axvline(records[0]["coalescence"], color="0.7", linewidth=0.8)
    plots.label(axes[0], records[0]["coalescence"], 0.04, "zones meet", "0.35", (4, 0))
    plots.label(axes[0], loads[0], outer[0], "outer edge", plots.COLOURS[0], (0, 9), ha="left")
    plots.label(axes[0], loads[0], outer[0], "inner edge", plots.COLOURS[1], (0, -11), ha="left")
    plots.label(axes[0], fine[30], fine[30], "classical wedge", "0.35", (5, -3))
    axes[0].set(xlabel=r"$P/(E^* s\,\ell)$", ylabel=r"edges over $\ell$", ylim=(0.02, None))
    chosen = dict.fromkeys(min(loads, key=lambda one: abs(math.log(one / drawn))) for drawn in DRAWN)
    colours = plots.shades(len(chosen))
    for load, colour in zip(chosen, colours):
        own = [row for row in laws["microblock"] if row["load"] == load]
        three_ways.draw_zones(axes[1], own, "pressure", color=colour)
        beside = np.geomspace(load, load * NEAREST, 400)  # of the middle, where the pressure is infinite
        x = np.concatenate((-beside, beside[::-1]))
        axes[1].plot(x, reference(load)(x) / SLOPE, ":", color=colour, linewidth=0.9)
    axes[1].set(xlabel=r"$x_1/\ell$", ylabel=r"$p/(E^* s)$", ylim=(0, 3))
    for place, (load, colour) in enumerate(zip(chosen, colours)):
        words = rf"$P/(E^* s\,\ell) = {load:g}$"
        axes[1].text(1.1, 2.7 - 0.35 * place, words, color=plots.legible(colour), fontsize=plots.SMALLEST)
    plots.letter(axes)
    return drawing


FIGURES = {"wedge": (rows, figure)}
