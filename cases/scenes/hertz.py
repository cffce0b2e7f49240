"""Rigid obstacle pressed on a Cosserat half-plane with microblocks (section 4.2).

Geometry   half-plane x2 < 0; a cylinder x^2/(2 R), a wedge or a flat punch (tilted or not) pressed down by a
           force P per thickness; blocks of side ell at each point of the surface, rotated by psi0.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      halfplane: the contact line alone, no mesh; the surface response from Fourier's symbol, panels
           fitted to the zones of each corner. fe: finite elements on a square, fitted to the zones, or a
           uniform bilinear mesh with augmented Lagrangian.
Reference  the Hertz ellipse for alpha -> 0; scaling: at fixed psi0 and R/a_Hz results depend on nu, beta,
           alpha only.
Look at    two zones above alpha_mid, kinks of pressure and micromoment where full contact ends.
Units      those of the cylinder at load P, (50): lengths over a_Hz, pressures over p_Hz, M over p_Hz ell, psi
           as psi R/a_Hz, energy over p_Hz a_Hz^3/R (of a half-plane up to its rigid-body constant); angles in
           degrees as they are.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

import microblock as mb
from microblock.data.records import column, grouped
from microblock.halfplane.kernels import kernels
from microblock.model.zones import half_widths, largest

from ..common.case import over, profiles
from ..common.options import Checked, coupling, option, poisson, rotation
from ..common.records import print_events, print_table, returned
from . import hertz_fe

RTOL = 1e-3
ALPHA = 0.25
SAMPLES = 24  # on each panel for largest values
BETWEEN = 3  # points of a curve between two nodes
EDGE_SIDE = 1e-9  # of the width: a curve is drawn from this side of an edge to the other
FE = {"model": "fe"}  # what options of the finite elements belong to
PSI0_IN = {"gap": "gaps and levers", "lever": "levers"}


@dataclass(frozen=True)
class Parameters(Checked):
    alpha: float | None = option(None, f"ell over a_Hz ({ALPHA} if neither it nor --ell is given)", above=0)
    ell: float | None = option(
        None,
        "length scale of the material, in the length unit of R",
        above=0,
        not_with={"alpha": "both set the length scale"},
    )
    E: float = option(100.0, "Young's modulus", above=0)
    nu: float = poisson()
    beta: float = coupling()
    R: float = option(
        10.0, "radius of the cylinder; with E, nu and P it sets the units for every obstacle", above=0
    )
    P: float = option(1.0, "force per thickness", above=0)
    loads: tuple = option(
        (1.0,), "loads at which states are returned, as multiples of P", above=0, nargs="+", metavar="LOAD"
    )
    obstacle: str = option("cylinder", "obstacle", str, choices=("cylinder", "wedge", "punch"))
    wedge_deg: float = option(1.0, "slope of the wedge's flanks in degrees", above=0, at_most=45)
    punch_half_width: float = option(1.0, "half-width of the punch over a_Hz", above=0)
    tilt_deg: float = option(0.0, "tilt of the punch in degrees, counterclockwise", at_least=-45, at_most=45)
    psi0_deg: float = rotation()
    psi0_reading: str = option(
        "gap", "psi0 in gaps and levers, or in the levers only", str, choices=tuple(PSI0_IN)
    )
    contact: str = option(
        "microblock", "contact law", str, choices=("microblock", "unilateral", "microclamped")
    )
    model: str | None = option(
        None,
        "fe or halfplane; without it the smallest that can answer, halfplane",
        str,
        choices=("fe", "halfplane"),
    )
    domain: str | None = option(
        None,
        "fe: size of the square over a_Hz, or inf for a half-plane, cut off "
        f"far away ({hertz_fe.DEFAULTS['domain']} if not given)",
        str,
        only_with=FE,
    )
    method: str | None = option(
        None,
        f"fe: condensed, al or penalty ({hertz_fe.DEFAULTS['method']} if not "
        "given; the others go with --mesh uniform)",
        str,
        choices=("condensed", "al", "penalty"),
        only_with=FE,
    )
    rho: float | None = option(
        None,
        "fe: regularisation of al and penalty (stress over length); without it "
        "the stiffness of the contact, and a large multiple of it for penalty",
        above=0,
        only_with={**FE, "method": ("al", "penalty")},
    )
    mesh: str | None = option(
        None,
        f"fe: fitted or uniform ({hertz_fe.DEFAULTS['mesh']} if not given)",
        str,
        choices=("fitted", "uniform"),
        only_with=FE,
    )
    h: float | None = option(
        None,
        "fe: near-zone element over a_Hz; without it --rtol chooses; with --order "
        f"alone {hertz_fe.PAPER_H:g} on a uniform mesh, on a fitted one what suits the "
        "contact",
        above=0,
        only_with=FE,
    )
    order: int | None = option(
        None,
        "Gauss points on a panel, 4 to 30, or order of the finite elements: "
        "fixes what --rtol would choose; with --h alone 1 on a uniform mesh, "
        f"{hertz_fe.FITTED_ORDER} on a fitted one",
        int,
    )
    rtol: float | None = option(
        None,
        "relative error of pressure and of micromoment over ell, both over the "
        "pressure, in L2 on the Gauss points of the panels, whose weights vanish at "
        "edges: for a punch, whose L2 norm is infinite, it is that of this rule "
        f"({RTOL:g} if nothing is given)",
        above=0,
        below=1,
        not_with={"order": "it chooses the order", "h": "it chooses the elements"},
    )

    def relate(self):
        if self.model == "fe":
            hertz_fe.check(self)
        elif self.order is not None and not 4 <= self.order <= 30:
            raise mb.BadArgument("order", self.order, "must lie between 4 and 30")

    @property
    def a_Hz(self):
        """Hertz half-width (50)."""
        return math.sqrt(4 * self.P * self.R * (1 - self.nu**2) / (math.pi * self.E))

    @property
    def p_Hz(self):
        """Hertz pressure (50)."""
        return 2 * self.P / (math.pi * self.a_Hz)

    @property
    def solid(self):
        ell = self.ell if self.ell is not None else (self.alpha or ALPHA) * self.a_Hz
        return mb.Cosserat(self.E, self.nu, ell, beta=self.beta)

    @property
    def law(self):
        if self.contact == "microblock":
            return mb.Microblock(math.radians(self.psi0_deg), PSI0_IN[self.psi0_reading])
        return mb.Unilateral() if self.contact == "unilateral" else mb.Microclamped()

    @property
    def shape(self):
        if self.obstacle == "cylinder":
            return mb.Cylinder(self.R)
        if self.obstacle == "wedge":
            return mb.Wedge(math.tan(math.radians(self.wedge_deg)))
        return mb.Punch(self.punch_half_width * self.a_Hz, math.tan(math.radians(self.tilt_deg)))

    @property
    def problem(self):
        """The contact problem: on panels, or on fitted finite elements."""
        if self.model == "fe":
            return hertz_fe.fitted(self)
        return mb.Contact(
            mb.HalfPlane(self.solid), self.shape, self.law, mb.Panels(order=self.order, fallback=False)
        )

    def resolved(self):
        """These parameters with the defaults filled in."""
        chosen = self.rtol is None and self.order is None and self.h is None
        return replace(
            self,
            model=self.model or "halfplane",
            alpha=self.solid.ell / self.a_Hz,
            ell=None,
            rtol=RTOL if chosen else self.rtol,
            **(hertz_fe.resolved(self) if self.model == "fe" else {}),
        )


def solve(parameters):
    """State and error estimate at each load, ascending or not as the loads are given."""
    if parameters.model == "fe":
        return hertz_fe.solve(parameters)
    problem, states = parameters.problem, []
    rtol = None if parameters.order is not None else parameters.rtol or RTOL
    for load in parameters.loads:
        initial = states[-1] if states else None
        states.append(problem.solve(load=load * parameters.P, rtol=rtol, initial=initial))
    return [(state, state.error_estimate) for state in states]


def observe(parameters, state, estimate):
    """The contract's record of one state, normalised."""
    a, p, ell = parameters.a_Hz, parameters.p_Hz, parameters.solid.ell
    data = state.to_dict()
    zones = over(data["zones"], dict.fromkeys(data["zones"], a))
    outer, inner = half_widths(zones["contact"])
    units = {"x": a, "weight": a, "pressure": p, "pressure_A": p, "pressure_B": p, "micromoment": p * ell}
    infinite = _infinite(parameters, state)
    top, where = (None, []) if infinite else largest(state.pressure_at, samples(state))
    load = state.load / parameters.P
    moment = None if infinite and len(state.pressures) == 2 else _micromoment_max(state) / (p * ell)
    centre = float(state.pressure_at(0.0)) / p
    if infinite and len(state.pressures) == 1 and parameters.obstacle == "wedge":
        centre = None
    return {
        "load": load,
        "pressure_centre": centre,
        "pressure_max": None if infinite else top / p,
        "pressure_max_at": [x / a for x in where],
        "zones": zones,
        "half_width": outer,
        "inner_half_width": inner,
        "hardness_apparent": load / outer,
        "hardness_real": load / (outer - inner),
        "micromoment_max": moment,
        "energy": state.energy / (p * a**3 / parameters.R),
        "approach": None if state.approach is None else state.approach * parameters.R / a**2,
        "kkt": state.residual,
        **{name: data[name] for name in ("unknowns", "error_parts", "iterations")},
        "error_estimate": estimate,
        "profile": over({**data["profile"], "psi": state.psi * parameters.R}, {**units, "psi": a}),
    }


def samples(state):
    """Points between the nodes of a state on panels or elements, ascending."""
    x, solution = state.x, state.solution
    order = solution.panels.order if state.method == "panels" else solution.order
    between = x[:-1, None] + np.diff(x)[:, None] * np.linspace(0, 1, max(2, SAMPLES // order) + 1)[:-1]
    return np.append(between.ravel(), x[-1])


def _infinite(parameters, state):
    """Whether the pressure has no bound: at edges of a punch, or at the apex of a wedge."""
    return parameters.obstacle == "punch" or (parameters.obstacle == "wedge" and _covers_apex(state))


def _micromoment_max(state):
    if len(state.pressures) == 1:
        return float(np.abs(state.micromoment).max())
    levers = state.law.levers(np.zeros(1))  # psi0 is one number
    half = state.solid.ell / 2
    return largest(
        lambda x: np.abs(
            half * sum(lever * state.pressure_at(x, corner) for corner, lever in levers.items())
        ),
        samples(state),
    )[0]


def _covers_apex(state):
    """Whether a corner is closed at the slope discontinuity of the wedge, where its pressure is infinite."""
    corners = state.law.corners if len(state.law.corners) == 2 else ("contact",)
    return any(
        left < place < right
        for corner, place in zip(corners, state.law.shifts(state.solid.ell))
        for left, right in state.zones[corner]
    )


def events(parameters, last):
    """Events from first touch to the last load, normalised."""
    a, P = parameters.a_Hz, parameters.P
    return [
        {
            "load": event.load / P,
            "load_error": event.load_error / P,
            "kind": event.kind,
            "zone": event.zone,
            "x": event.x / a,
        }
        for event in parameters.problem.path(load=last * P).events
    ]


def warnings(parameters, states):
    """Where the small-strain model, or the mesh, leaves its ground."""
    found = [words for state, _ in states for words in state.warnings]
    return list(dict.fromkeys(found + (hertz_fe.warnings(parameters) if parameters.model == "fe" else [])))


def result(parameters, quiet=True):
    """The contract's object."""
    start = time.perf_counter()
    resolved = parameters.resolved()
    if resolved.model == "halfplane":
        kernels(resolved.nu, resolved.beta, resolved.solid.curvature)  # their table is made once
    ready = time.perf_counter()
    states = solve(resolved)
    observed = [observe(resolved, *state) for state in states]
    return returned(
        resolved,
        ready,
        ready - start,
        model=resolved.model,
        unknowns=max(one["unknowns"] for one in observed),
        states=observed,
        events=events(resolved, max(resolved.loads)),
        warnings=warnings(resolved, states),
    )


def drawn(parameters, state):
    """The profile of a state as it is drawn: between the nodes too, and where the pressure is finite up to
    the edges of all zones. M is that of the corners.
    """
    a, p_Hz = parameters.a_Hz, parameters.p_Hz
    nodes, beside = state.x, []
    # off the middle between two nodes, where panels may meet and neither has the point
    between = nodes[:-1, None] + np.diff(nodes)[:, None] * (np.arange(BETWEEN) + 0.4) / BETWEEN
    if not _infinite(parameters, state):
        edges = np.array(sorted({edge for zones in state.zones.values() for zone in zones for edge in zone}))
        beside = np.outer((-1, 1), EDGE_SIDE * np.ptp(edges)) + edges
    x = np.unique(np.concatenate((nodes, between.ravel(), np.ravel(beside))))
    moment = sum(lever * state.pressure_at(x, corner) for corner, lever in state.law.levers(x).items())
    return {
        "x": (x / a).tolist(),
        "pressure": (state.pressure_at(x) / p_Hz).tolist(),
        "micromoment": (moment / (2 * p_Hz)).tolist(),
        "psi": (state.solution.rotation(x) * parameters.R / a).tolist(),
    }


def rows(parameters, answer):
    """A row a node along the contact line."""
    columns = "x", "pressure", "micromoment", "psi"
    return profiles(answer["states"], "load", "half_width", "error_estimate", columns=columns)


def curves(parameters, answer):
    """A row a point of the curves that are drawn; of finite elements a row a node."""
    resolved = parameters.resolved()
    if resolved.model == "fe":
        return rows(parameters, answer)
    profiles = [drawn(resolved, state) for state, _ in solve(resolved)]
    states = [{**one, "profile": profile} for one, profile in zip(answer["states"], profiles)]
    return rows(parameters, {"states": states})


def show(answer):
    """A table of the states and the events."""
    print_table(
        answer["states"],
        (
            "load",
            "half_width",
            "inner_half_width",
            "pressure_centre",
            "pressure_max",
            "micromoment_max",
            "hardness_apparent",
            "hardness_real",
            "error_estimate",
        ),
        9,
    )
    print_events(answer["events"])
    for words in answer["warnings"]:
        print(f"warning: {words}")


def figure(records):
    """Pressure (a) and micromoment (b) at each load."""
    loads = grouped(records, "load")
    return over_x({rf"$\bar P = {load:g}$": nodes for load, nodes in loads.items()})


def over_x(curves):
    """Pressure (a) and micromoment (b) over x1 of several states, {label: rows of its nodes}."""
    from microblock.view import plots

    drawing, axes = plots.figure(2, 1, height=1.9, sharex=True)
    for number, (label, nodes) in enumerate(curves.items()):
        look = {
            "color": plots.shades(len(curves))[number],
            "linestyle": plots.LINES[number % len(plots.LINES)],
        }
        axes[0].plot(column(nodes, "x"), column(nodes, "pressure"), **look, label=label)
        axes[1].plot(column(nodes, "x"), column(nodes, "micromoment"), **look)
    axes[0].set_ylabel(r"$p_n/p_\mathrm{Hz}$")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\ell)$")
    plots.letter(axes)
    plots.legend_of_all(drawing, axes[0])
    return drawing


FIGURES = {"hertz": (curves, figure)}
