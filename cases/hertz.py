"""Rigid obstacle pressed on a Cosserat half-plane with microblocks (section 4.2).

Geometry   half-plane x2 < 0; a cylinder x^2/(2 R), a wedge or a flat punch (tilted or not) pressed down by a force
           P per thickness; blocks of side ell at each point of the surface, turned by psi0.
Equations  (10)-(18) in the half-plane, the corner gaps (20)-(22) and conditions (26) on its surface.
Model      halfplane: the contact line alone, no mesh; the surface response from Fourier's symbol, panels fitted to
           the zones of each corner. fe: finite elements on a square, fitted to the zones, or the paper's mesh and method.
Reference  the Hertz ellipse for alpha -> 0; scaling: at fixed psi0 and R/a_Hz results depend on nu, beta, alpha only.
Look at    two zones above alpha_mid, kinks of pressure and micromoment where full contact ends.
Units      those of the cylinder at load P, (50): lengths over a_Hz, pressures over p_Hz, M over p_Hz ell, psi as
           psi R/a_Hz, energy over p_Hz a_Hz^3/R (up to the level of a half-plane); angles in degrees as they are.
"""

import math
import time
from dataclasses import asdict, dataclass, replace

import numpy as np

from cases import hertz_fe
from cases.options import command, option
from cases.records import keep, returned
from microblock import line_state, law, obstacles, plots
from microblock.errors import BadArgument, require_finite
from microblock.halfplane import HalfPlane
from microblock.material import Cosserat
from microblock.newton import PENALTY
from microblock.observables import contact_zones, half_widths, largest
from microblock.panels import zone_edges
from microblock.scene import Contact
from microblock.study import column, grouped
from microblock.surface_view import LARGE_TURN, STEEP

RTOL = 1e-3
ALPHA = 0.25
SAMPLES = 24           # on each panel for largest values
FE_ONLY = ("domain", "method", "rho", "mesh", "h")


@dataclass(frozen=True)
class Parameters:
    alpha: float | None = option(None, f"ell over a_Hz ({ALPHA} if neither it nor --ell is given)")
    ell: float | None = option(None, "length scale of the material, in the length unit of R")
    E: float = option(100.0, "Young's modulus")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number, 0 < beta < 2")
    R: float = option(10.0, "radius of the cylinder; with E, nu and P it sets the units for every obstacle")
    P: float = option(1.0, "force per thickness")
    loads: tuple = option((1.0,), "loads at which states are returned, as multiples of P", nargs="+", metavar="LOAD")
    obstacle: str = option("cylinder", "obstacle", str, choices=("cylinder", "wedge", "punch"))
    wedge_deg: float = option(1.0, "slope of the wedge's flanks in degrees")
    punch_half_width: float = option(1.0, "half-width of the punch over a_Hz")
    tilt_deg: float = option(0.0, "tilt of the punch in degrees, counterclockwise")
    psi0_deg: float = option(0.0, "initial rotation of the blocks in degrees, counterclockwise")
    psi0_reading: str = option("gap", "psi0 in gaps and levers, or in the levers only", str, choices=law.READINGS)
    contact: str = option("microblock", "contact law", str, choices=("microblock", "unilateral", "microclamped"))
    model: str | None = option(None, "fe or halfplane; without it the smallest that can answer, halfplane", str,
                               choices=("fe", "halfplane"))
    domain: str | None = option(None, "fe: size of the square over a_Hz, or inf for a half-plane, cut off far away "
                                f"({hertz_fe.DEFAULTS['domain']} if not given)", str)
    method: str | None = option(None, f"fe: condensed, al or penalty ({hertz_fe.DEFAULTS['method']} if not given; the others "
                                "go with --mesh uniform)", str, choices=("condensed", "al", "penalty"))
    rho: float | None = option(None, "fe: regularisation of al and penalty (stress over length); without it the stiffness of the "
                               f"contact, and {PENALTY:g} times that for penalty")
    mesh: str | None = option(None, f"fe: fitted or uniform ({hertz_fe.DEFAULTS['mesh']} if not given)", str,
                                choices=("fitted", "uniform"))
    h: float | None = option(None, "fe: near-zone element over a_Hz; without it --rtol chooses; with --order alone "
                             f"{hertz_fe.PAPER_H:g} on a uniform mesh, on a fitted one what suits the contact")
    order: int | None = option(None, "Gauss points on a panel, 4 to 30, or order of the finite elements: fixes what --rtol "
                               f"would choose; with --h alone 1 on a uniform mesh, {hertz_fe.LADDER[0][0]} on a fitted one",
                               int)
    rtol: float | None = option(None, "relative error of pressure and of micromoment over ell, both over the pressure, in L2 on "
                                "the Gauss points of the panels, whose weights vanish at edges: for a punch, whose L2 norm is "
                                f"infinite, it is that of this rule ({RTOL:g} if nothing is given)")

    def __post_init__(self):
        numbers = {name: value for name, value in asdict(self).items() if isinstance(value, (int, float))}
        require_finite(**numbers)
        for name in ("E", "R", "P", "punch_half_width", "wedge_deg", "alpha", "ell", "rtol"):
            if name in numbers and not numbers[name] > 0:
                raise BadArgument(name, numbers[name], "must be positive")
        loads = self.loads if isinstance(self.loads, (tuple, list)) else (self.loads,)
        for load in loads:
            require_finite(loads=load)
            if not load > 0:
                raise BadArgument("loads", load, "must be positive")
        object.__setattr__(self, "loads", tuple(float(load) for load in loads))
        if self.alpha is not None and self.ell is not None:
            raise BadArgument("ell", self.ell, "does not go together with --alpha: both set the length scale")
        if not 0 < self.beta < 2:
            raise BadArgument("beta", self.beta, "must satisfy 0 < beta < 2")
        for name, most in (("psi0_deg", 45), ("tilt_deg", 45), ("wedge_deg", 45)):
            if abs(numbers[name]) > most:
                raise BadArgument(name, numbers[name], f"must lie within {most} degrees")
        if self.model == "fe":
            hertz_fe.check(self)
        else:
            for name in FE_ONLY:
                if getattr(self, name) is not None:
                    raise BadArgument(name, getattr(self, name), "belongs to --model fe")
            if self.order is not None and not 4 <= self.order <= 30:
                raise BadArgument("order", self.order, "must lie between 4 and 30")
        if self.order is not None and self.rtol is not None:
            raise BadArgument("rtol", self.rtol, "chooses the order: not together with --order")
        if self.rtol is not None and not self.rtol < 1:
            raise BadArgument("rtol", self.rtol, "must satisfy 0 < rtol < 1")
        if self.contact != "microblock" and self.psi0_deg != 0:
            raise BadArgument("psi0_deg", self.psi0_deg, f"has no place in the {self.contact} law")
        self.solid      # Inadmissible moduli are named here

    @property
    def a_Hz(self):
        """Hertz half-width (50)."""
        return math.sqrt(4*self.P*self.R*(1 - self.nu**2)/(math.pi*self.E))

    @property
    def p_Hz(self):
        """Hertz pressure (50)."""
        return 2*self.P/(math.pi*self.a_Hz)

    @property
    def solid(self):
        ell = self.ell if self.ell is not None else (self.alpha or ALPHA)*self.a_Hz
        return Cosserat(self.E, self.nu, ell, beta=self.beta)

    @property
    def law(self):
        if self.contact == "microblock":
            return law.Microblock(math.radians(self.psi0_deg), self.psi0_reading)
        return law.Unilateral() if self.contact == "unilateral" else law.Microclamped()

    @property
    def shape(self):
        if self.obstacle == "cylinder":
            return obstacles.Cylinder(self.R)
        if self.obstacle == "wedge":
            return obstacles.Wedge(math.tan(math.radians(self.wedge_deg)))
        return obstacles.Punch(self.punch_half_width*self.a_Hz, math.tan(math.radians(self.tilt_deg)))

    @property
    def scene(self):
        return Contact(HalfPlane(self.solid), self.shape, self.law)

    def resolved(self):
        """These parameters with the defaults filled in."""
        chosen = self.rtol is None and self.order is None and self.h is None
        return replace(self, model=self.model or "halfplane", alpha=self.solid.ell/self.a_Hz, ell=None,
                       rtol=RTOL if chosen else self.rtol, **(hertz_fe.resolved(self) if self.model == "fe" else {}))


def solve(parameters):
    """State and error estimate at each load, ascending or not as the loads are given."""
    if parameters.model == "fe":
        return hertz_fe.solve(parameters)
    scene, states = parameters.scene, []
    for load in parameters.loads:
        near = states[-1][0] if states else None
        state = scene.at(load*parameters.P, parameters.rtol or RTOL, parameters.order, near=near, fallback=False)
        states.append((state, state.estimate.total))
    return states


def observe(parameters, state, estimate):
    """The contract's record of one state, normalised."""
    a, p, ell = parameters.a_Hz, parameters.p_Hz, parameters.solid.ell
    zones = {name: [[left/a, right/a] for left, right in intervals]
             for name, intervals in contact_zones(state.all_zones, state.line.law.corners).items()}
    outer, inner = half_widths(zones["contact"])
    infinite = parameters.obstacle == "punch" or (parameters.obstacle == "wedge" and _holds_kink(state))
    top, where = (None, []) if infinite else largest(lambda x: total_pressure(state, x), samples(state))
    corners = list(state.pressures/p)
    load = state.load/parameters.P
    moment = None if infinite and len(corners) == 2 else _micromoment_max(state)/(p*ell)
    centre = float(total_pressure(state, np.zeros(1))[0])/p
    if infinite and len(corners) == 1 and parameters.obstacle == "wedge":
        centre = None
    return {"load": load, "pressure_centre": centre,
            "pressure_max": None if infinite else top/p, "pressure_max_at": [x/a for x in where], "zones": zones,
            "half_width": outer, "inner_half_width": inner, "hardness_apparent": load/outer,
            "hardness_real": load/(outer - inner), "micromoment_max": moment,
            "energy": state.energy/(p*a**3/parameters.R), **_of_the_model(parameters, state), "iterations": state.iterations,
            "error_estimate": estimate,
            "profile": {"x": (state.x/a).tolist(), "weight": (state.weights/a).tolist(),
                        "pressure": (state.pressures.sum(axis=0)/p).tolist(),
                        "pressure_A": corners[0].tolist() if len(corners) == 2 else None,
                        "pressure_B": corners[1].tolist() if len(corners) == 2 else None,
                        "micromoment": (state.micromoment/(p*ell)).tolist(),
                        "psi": (state.psi*parameters.R/a).tolist()}}


def _of_the_model(parameters, state):
    """What the two models say each in its own way: residual, unknowns, and the approach where the domain bounds it."""
    if parameters.model != "fe":
        return {"approach": None, "kkt": line_state.violation(state), "unknowns": len(state.q) + 1,
                "error_parts": asdict(state.estimate)}
    bounded = math.isfinite(hertz_fe.size(parameters))
    return {"approach": state.approach*parameters.R/parameters.a_Hz**2 if bounded else None, "kkt": state.kkt,
            "unknowns": int(state.unknowns), "error_parts": asdict(state.estimate) if state.estimate else None}


def total_pressure(state, x):
    """Pressure of all corners at x."""
    return sum(state.pressure(corner, x) for corner in range(len(state.line.law.corners)))


def samples(state):
    """Points between the nodes of a state, ascending."""
    x, order = state.x, state.panels.order if isinstance(state, line_state.LineState) else state.order
    between = x[:-1, None] + np.diff(x)[:, None]*np.linspace(0, 1, max(2, SAMPLES//order) + 1)[:-1]
    return np.append(between.ravel(), x[-1])


def _micromoment_max(state):
    if len(state.line.law.corners) == 1:
        return float(np.abs(state.micromoment).max())
    levers = [state.line.lever(np.array([corner]), np.zeros(1)) for corner in (0, 1)]
    half = state.line.solid.ell/2
    return largest(lambda x: np.abs(half*sum(lever*state.pressure(corner, x) for corner, lever in enumerate(levers))),
                   samples(state))[0]


def _holds_kink(state):
    shift = 0.0 if len(state.line.law.corners) == 1 else state.line.solid.ell/2
    places = {0: shift, 1: -shift}
    return any(left < places[corner] < right for corner, intervals in state.all_zones.items() for left, right in intervals)


def events(parameters, last):
    """Events from first touch to the last load, normalised."""
    a, P = parameters.a_Hz, parameters.P
    return [{"load": event.load/P, "load_error": event.load_error/P, "kind": event.kind, "zone": event.zone, "x": event.x/a}
            for event in parameters.scene.load(last*P).events]


def warnings(parameters, states):
    """Where the small-strain model leaves its ground."""
    found = []
    turn = max(float(np.abs(state.psi).max()) for state, _ in states) + math.radians(abs(parameters.psi0_deg))
    slope = max(abs(edge) for state, _ in states for edge in zone_edges(state.all_zones))/parameters.R
    if turn > LARGE_TURN:
        found.append(f"blocks turn by {math.degrees(turn):.0f} degrees: beyond the small-angle form (41)")
    if slope > STEEP and parameters.obstacle == "cylinder":
        found.append(f"slope {slope:.2g} at the edge of the contact: beyond small strain and the parabola")
    if parameters.solid.ell > parameters.a_Hz:
        found.append("ell is larger than a_Hz: blocks larger than the contact of a classical solid")
    if parameters.model == "fe":
        found += hertz_fe.warnings(parameters)
    return found


def result(parameters):
    """The contract's object."""
    start = time.perf_counter()
    resolved = parameters.resolved()
    if resolved.model == "halfplane":
        resolved.scene.line.kernel(np.ones(1), np.zeros(1), np.zeros(1))      # the kernels' table
    ready = time.perf_counter()
    states = solve(resolved)
    observed = [observe(resolved, *state) for state in states]
    history = (hertz_fe.events if resolved.model == "fe" else events)(resolved, max(resolved.loads))
    return returned(resolved, ready, ready - start, model=resolved.model, unknowns=max(one["unknowns"] for one in observed),
                    states=observed, events=history, warnings=warnings(resolved, states))


def run(parameters, out=None, quiet=False):
    """Solve, print a table, draw pressure and micromoment into the folder `out`."""
    answer = result(parameters)
    if not quiet:
        show(answer)
    if out:
        keep(out, "hertz", rows(parameters, answer["states"]), figure)
    return answer


def rows(parameters, states):
    """Observed states as records along the contact line: command, parameters and what it gave, a row a node."""
    common = {"command": command("hertz", parameters), **asdict(parameters.resolved()), "loads": None}
    found = []
    for state in states:
        seen = {name: state[name] for name in ("load", "half_width", "error_estimate")}
        profile = {name: state["profile"][name] for name in ("x", "pressure", "micromoment", "psi")}
        found += [{**common, **seen, **dict(zip(profile, node))} for node in zip(*profile.values())]
    return found


def show(answer):
    """A table of the states and the events."""
    columns = ("load", "half_width", "inner_half_width", "pressure_centre", "pressure_max", "micromoment_max",
               "hardness_apparent", "hardness_real", "error_estimate")
    print("  ".join(f"{name:>17}" for name in columns))
    for state in answer["states"]:
        print("  ".join(f"{'-':>17}" if state[name] is None else f"{state[name]:17.9g}" for name in columns))
    for event in answer["events"]:
        print(f"load {event['load']:.7f} +- {event['load_error']:.1e}: {event['zone']} {event['kind']} at x = {event['x']:.5f}")
    for told in answer["warnings"]:
        print(f"warning: {told}")


def figure(records):
    """Pressure (a) and micromoment (b) at each load."""
    drawing, axes = plots.figure(1, 2)
    for number, (load, nodes) in enumerate(grouped(records, "load").items()):
        look = {"color": plots.COLOURS[number % len(plots.COLOURS)], "linestyle": plots.LINES[number % len(plots.LINES)]}
        axes[0].plot(column(nodes, "x"), column(nodes, "pressure"), **look, label=rf"$\bar P = {load:g}$")
        axes[1].plot(column(nodes, "x"), column(nodes, "micromoment"), **look)
    axes[0].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$p_n/p_\mathrm{Hz}$", title="(a)")
    axes[1].set(xlabel=r"$x_1/a_\mathrm{Hz}$", ylabel=r"$M/(p_\mathrm{Hz}\ell)$", title="(b)")
    plots.legend_of_all(drawing, axes[0])
    return drawing
