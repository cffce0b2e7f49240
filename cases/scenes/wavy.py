"""Wavy obstacle on a half-plane, from first touch to full closure: periodic contact.

Geometry   half-plane x2 < 0; a rigid cosine of the given wavelength pressed down by a mean pressure; blocks
           of side ell.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      one period of uniform cells, products by FFT, no mesh (docs/theory/halfplane.md, "Large problems").
Reference  Westergaard's closed form for the classical limit; for microblocks the mean pressure of full
           closure.
Look at    microblocks close later and carry a micromoment; the classical contact of the same load beside
           them. The path from first touch to full closure: contact and approach over the load, classical
           markers on the closed form.
Units      lengths over the wavelength, pressures over pi E* amplitude/wavelength, the mean pressure of full
           closure in the classical limit; M over that and ell. The amplitude drops out (psi0 = 0).
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped
from microblock.halfplane.kernels import symbol

from ..common.case import of_kinds, over, profiles
from ..common.laws import LAWS
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned

RTOL = 1e-3
CLASSICAL_BETA = 1e-10  # coupling of the classical limit: results differ from it by as much
AMPLITUDE = 1 / math.pi  # with E* = 1 and the wavelength 1 the unit of pressure is 1
DRAWN = 1024  # cells of a state that the records keep
SAMPLES = 16  # to a cell, for L2 errors
PATH_LAST = 1.05  # of the path, over the mean pressure of full closure
PATH_FIRST = 1e-3
# what is said of the curves of the path, beside the first mark from PATH_NAMED on: points right and up
PATH_NAMED = 0.5
PATH_NAMES = {"microblock": ("one corner or both", (-6, 7)), "classical": ("classical", (6, -4))}


@dataclass(frozen=True)
class Parameters(Checked):
    ell_over_wavelength: float = option(0.05, "length scale of the material over the wavelength", above=0)
    nu: float = poisson()
    beta: float = coupling()
    loads: tuple = option(
        (0.01, 0.1, 0.4, 0.8, 1.0, 1.2),
        "mean pressures, in units of the classical full closure",
        above=0,
        nargs="+",
        metavar="LOAD",
    )
    contact: str = option("microblock", "contact law beside the classical limit", str, choices=tuple(LAWS))
    nodes: int | None = option(None, "cells of the period: fixes what --rtol would choose", int, at_least=32)
    path: int = option(
        20, "loads of the path from first touch to full closure, 0 for none", int, at_least=0, at_most=1000
    )
    path_nodes: int = option(4096, "cells of the path", int, at_least=32, at_most=2**20)
    rtol: float | None = option(
        None,
        "relative L2 error of pressure and of micromoment over ell, both over "
        "the pressure "
        f"({RTOL:g} if nothing is given)",
        above=0,
        below=1,
        not_with={"nodes": "it chooses the nodes"},
    )

    def solid(self, beta):
        return mb.Cosserat(E=1 - self.nu**2, nu=self.nu, ell=self.ell_over_wavelength, beta=beta)

    def problem(self, contact, beta, nodes):
        """The contact problem on so many cells; without a number rtol chooses."""
        body = mb.HalfPlane(self.solid(beta), period=1.0)
        return mb.Contact(body, mb.Wave(AMPLITUDE, 1.0), LAWS[contact](), mb.Cells(nodes=nodes))

    def resolved(self):
        return replace(self, rtol=RTOL if self.nodes is None and self.rtol is None else self.rtol)


def solve(parameters, contact, beta):
    """The State at each load."""
    problem = parameters.problem(contact, beta, parameters.nodes)
    return [problem.solve(load=load, rtol=parameters.rtol) for load in parameters.loads]


def reference(parameters):
    """Westergaard's contact at each load."""
    from microblock.model.closed_forms import Wavy  # for verification only

    return [Wavy(1.0, 1.0, load) for load in parameters.loads]


def full_closure(solid, amplitude=AMPLITUDE, wavelength=1.0):
    """Mean pressure from which all corners of microblocks (psi0 = 0) stay closed, and the waves (p1, m1) of p
    and m.

    Closed gaps ask for u = d - D + D cos(k ell/2) cos(k x) and phi = D sin(k ell/2) sin(k x), D the
    amplitude; so (U, V; V, W) (p1, m1) = D (cos(k ell/2), sin(k ell/2)) with p = mean + p1 cos(k x), m = m1
    sin(k x), and corner pressures (p -+ m)/2 >= 0 for mean >= hypot(p1, m1).
    """
    k = 2 * np.pi / wavelength
    (U,), (V,), (W,) = symbol(solid, np.array([k]))
    p1, m1 = np.linalg.solve(
        [[U, V], [V, W]], amplitude * np.array((np.cos(k * solid.ell / 2), np.sin(k * solid.ell / 2)))
    )
    return float(np.hypot(p1, m1)), (float(p1), float(m1))


PATH_COLUMNS = (
    "contact",
    "load",
    "nodes",
    "contact_fraction",
    "full_contact_fraction",
    "approach",
    "pressure_max",
    "micromoment_max",
)


def path(parameters):
    """Records of states from first touch to beyond full closure, each from the one before; classical ones by
    Westergaard's.
    """
    from microblock.model.closed_forms import Wavy  # for verification only

    found = []
    for contact, law, beta, last in (
        (parameters.contact, parameters.contact, parameters.beta, closure_of(parameters)),
        ("classical", "unilateral", CLASSICAL_BETA, 1.0),
    ):
        problem, state = parameters.problem(law, beta, parameters.path_nodes), None
        for load in last * path_loads(parameters.path):
            state = problem.solve(load=load, initial=state)
            seen = observe(parameters, contact, state)
            exact = Wavy(1.0, 1.0, load) if contact == "classical" else None
            found.append(
                {
                    **{name: seen[name] for name in PATH_COLUMNS},
                    "kkt": state.residual,
                    "contact_exact": 2 * exact.half_width if exact else None,
                    "approach_exact": exact.approach_over_amplitude if exact else None,
                }
            )
    return found


def closure_of(parameters):
    """Mean pressure of full closure in the law beside the classical limit: `full_closure`, or of the one gap
    without corners.
    """
    solid = parameters.solid(parameters.beta)
    if parameters.contact == "microblock":
        return full_closure(solid)[0]
    (U,), (V,), (W,) = symbol(solid, np.array([2 * np.pi]))
    return float(AMPLITUDE / (U if parameters.contact == "unilateral" else U - V**2 / W))


def path_loads(count):
    """Loads over that of full closure: dense at first touch and at the last gap, where the contact grows
    steeply.
    """
    share = (1 - np.cos(np.pi * np.arange(count) / max(count - 1, 1))) / 2
    return PATH_FIRST + (PATH_LAST - PATH_FIRST) * share


def polygon_error(x, values, exact):
    """Relative L2 error over a period 1 of the polygon through (x, values) against a function."""
    fine = (np.arange(SAMPLES * len(x)) + 0.5) / (SAMPLES * len(x)) - 0.5
    true = exact(fine)
    return float(np.linalg.norm(np.interp(fine, x, values, period=1.0) - true) / np.linalg.norm(true))


def observe(parameters, contact, state):
    """Record of a state."""
    pressure, corners = state.pressure, np.array(list(state.pressures.values()))
    units = {"x": 1, "weight": 1, "pressure": 1, "micromoment": parameters.ell_over_wavelength, "psi": 1}
    profile = over(state.to_dict()["profile"], units)
    return {
        "contact": contact,
        "load": state.load,
        "nodes": len(state.x),
        "contact_fraction": float(np.mean(pressure > 0)),
        "full_contact_fraction": float(np.mean((corners > 0).all(axis=0))),
        "pressure_max": float(pressure.max()),
        "micromoment_max": max(map(abs, profile["micromoment"])),
        "approach": state.approach / AMPLITUDE,
        "energy": state.energy,
        "kkt": state.residual,
        "products": state.iterations,
        "error_estimate": state.error_estimate,
        "profile": profile,
    }


def result(parameters, quiet=True):
    """The case's object; `classical` carries the true error beside the estimate."""
    start, chosen = time.perf_counter(), parameters.resolved()
    states = [observe(chosen, chosen.contact, one) for one in solve(chosen, chosen.contact, chosen.beta)]
    classical = [observe(chosen, "classical", one) for one in solve(chosen, "unilateral", CLASSICAL_BETA)]
    for state, exact in zip(classical, reference(chosen)):
        state["error"] = polygon_error(state["profile"]["x"], state["profile"]["pressure"], exact.pressure)
        state["contact_fraction_exact"] = 2 * exact.half_width
    return returned(
        chosen,
        start,
        model="halfplane",
        states=states,
        classical=classical,
        full_closure=closure_of(chosen),
        path=path(chosen),
    )


def show(answer):
    print_table(
        answer["states"] + answer["classical"],
        (
            "contact",
            "load",
            "nodes",
            "contact_fraction",
            "pressure_max",
            "micromoment_max",
            "error_estimate",
            "products",
            "error",
        ),
        6,
    )
    print(
        f"{answer['parameters']['contact']}: closed everywhere from the mean pressure "
        f"{answer['full_closure']:.9g} on (classical: 1)"
    )
    known = [row for row in answer["path"] if row["contact_exact"] is not None]
    if known:
        contact, approach = (
            max(abs(row[name] - row[exact]) for row in known)
            for name, exact in (("contact_fraction", "contact_exact"), ("approach", "approach_exact"))
        )
        print(
            f"classical path against Westergaard: contact off by {contact:.1e} of the wavelength at most "
            f"(a cell is {1 / known[0]['nodes']:.1e}), approach by {approach:.1e} of the amplitude"
        )


def rows(parameters, answer):
    """A row a cell, or one of several where there are more than DRAWN cells."""
    found = []
    for state in answer["states"] + answer["classical"]:
        columns = "x", "pressure", "micromoment", "psi"
        named = [{**state, "law": state["contact"]}]
        nodes = profiles(named, "law", "load", "error_estimate", columns=columns)
        found += nodes[:: 1 + state["nodes"] // DRAWN]
    return found


def path_rows(answer):
    """A row a state of the path."""
    return [{**row, "law": row["contact"], "full_closure": answer["full_closure"]} for row in answer["path"]]


def all_rows(parameters, answer):
    """Those of the states and those of the path."""
    return of_kinds(state=rows(parameters, answer), path=path_rows(answer))


def figure(records):
    """Microblocks under a wave close later than a classical solid: at 1.33 times its mean pressure.

    A rigid cosine of the wavelength lambda and the amplitude Delta pressed flat on a half-plane of E* = E/(1
    - nu^2). Pressure (a) and micromoment (b) over one period for mean pressures up to beyond full closure
    (from dark to light), over that of the classical closure, pi E* Delta/lambda; dashed: classical. (c)
    Length in contact over the mean pressure, from first touch on: squares on the grey line, classical on
    Westergaard's closed form; blue circles, microblocks on one corner or both; dotted, on both corners, which
    reach all of the surface at the vertical line, known in closed form and a point of the dotted line.

    Seen: arches of pressure that grow to the full width; micromoments that change sign in the middle; in (c)
    two curves that rise alike to 1 near 1 and 1.1, and a dotted one far below that reaches 1 last, where it
    meets the vertical line.
    """
    from microblock.view import plots

    kinds = grouped(records, "kind")
    drawing, axes = plots.figure(3 if "path" in kinds else 2, 1, height=1.7)
    laws = grouped(kinds["state"], "law")
    for law, chosen in laws.items():
        loads = grouped(chosen, "load")
        colours = plots.shades(len(loads))
        for colour, nodes in zip(colours, loads.values()):
            x, style = column(nodes, "x"), "--" if law == "classical" else "-"
            thin = {"linewidth": 0.7} if law == "classical" else {}
            axes[0].plot(x, column(nodes, "pressure"), style, color=colour, **thin)
            if law != "classical":
                axes[1].plot(x, column(nodes, "micromoment"), color=colour)
    first, *others = loads
    plots.key(drawing, [rf"$\bar p = {first:.3g}$", *(f"{load:.3g}" for load in others)], colours)
    axes[0].set(ylabel=r"$p\lambda/(\pi E^*\Delta)$")
    axes[0].sharex(axes[1])
    axes[0].tick_params(labelbottom=False)
    axes[1].set(xlabel=r"$x_1/\lambda$", ylabel=r"$M/(\bar p_\mathrm{closure}\,\ell)$")
    if "path" in kinds:
        _draw_path(axes[2], kinds["path"])
    plots.letter(axes)
    return drawing


def _draw_path(axis, records):
    """Length in contact over the mean pressure."""
    from microblock.model.closed_forms import Wavy  # for verification only
    from microblock.view import plots

    exact = [Wavy(1.0, 1.0, load) for load in np.geomspace(PATH_FIRST, PATH_LAST, 400)]
    axis.plot([one.mean for one in exact], [2 * one.half_width for one in exact], color="0.5")
    for (law, own), colour, marker in zip(grouped(records, "law").items(), plots.COLOURS, plots.MARKERS):
        loads = column(own, "load")
        line = "none" if law == "classical" else "-"
        look = {"color": colour, "marker": marker, "linestyle": line, "markerfacecolor": "none"}
        axis.plot(loads, column(own, "contact_fraction"), **look)
        if law == "microblock":
            # full closure is between two loads of the path
            full = [*zip(loads, column(own, "full_contact_fraction")), (records[0]["full_closure"], 1.0)]
            axis.plot(*zip(*sorted(full)), ":", color=colour)
            plots.label(axis, *full[len(own) // 2], "both corners", colour, (4, -5))
        words, beside = PATH_NAMES.get(law, (law, (-6, 7)))
        at = int(np.searchsorted(loads, PATH_NAMED))
        plots.label(axis, loads[at], own[at]["contact_fraction"], words, colour, beside)
    axis.axvline(records[0]["full_closure"], color="0.7", linewidth=0.8)
    plots.label(axis, records[0]["full_closure"], 0.06, "full closure", "0.35", (-3, 0))
    axis.set(xlabel=r"$\bar p\lambda/(\pi E^*\Delta)$", ylabel=r"contact over $\lambda$")


FIGURES = {"wavy": (all_rows, figure)}
