"""An elastic layer on a rigid base: from the half-plane to a mattress of springs.

Geometry   a layer of thickness h, bonded to a rigid base (u = psi = 0) or sliding on it (u2 = psi = 0, sides free), pressed by
           a cylinder and by a tilted punch; the mesh is a user's, netgen's triangles that know of no zones.
Equations  equilibrium (14)-(17), microblock and unilateral law.
Model      condensed body, its mesh refined by recovery until the estimate holds (`Contact(Body(...), ...).at(load, rtol)`).
Reference  thick layers: the half-plane on its contact line; thin ones: `ThinLayer` of docs/theory.md.
Look at    differences fall like (a/h)^2 to the half-plane, and like (h/a)^(3/2) (cylinder: its edges) and h/a (punch: its ends)
           to the mattress; energy of the fields, work of the corners and work of the load are one.
Units      a_Hz = 1, R = 10, E* = 20; thick layers carry pi/2, thin ones what the mattress carries at an approach of a_Hz^2/(2 R).
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from cases.bodies import balances, draw_body, mesh_of, points_of, polygon
from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.body import Body
from microblock.errors import BadArgument, require_finite
from microblock.halfplane import HalfPlane
from microblock.law import Microblock, Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Cylinder, Punch
from microblock.scene import Contact
from microblock.study import column, grouped

LOAD, RADIUS, STIFFNESS = math.pi/2, 10.0, 20.0
OBSTACLES = {"cylinder": Cylinder(RADIUS), "punch": Punch(1.0, tilt=0.01)}
LAWS = {"microblock": Microblock(), "unilateral": Unilateral()}
THIN = 1.0                  # below this h the mattress is the reference
SUNK = 1/(2*RADIUS)         # approach of the mattress: its contact under the cylinder has the half-width 1
BESIDE = 0.6                # half-width of the contact boundary beyond 1 + ell/2
WIDER = 4.0                 # half-length of the layer beyond that, over h
SIDES = {"bonded": "bottom", "sliding": {"u1": "left", "u2": "bottom", "psi": "bottom"}}
SAMPLES = 20001             # of the contact boundary, for the load of a mattress
JUDGE = 0.1                 # of rtol, to which the half-plane is asked
PICTURE = 1.0               # h of the layer that is drawn
SEEN, CUT = 2.0, 1.6        # half of its length in the records, whole triangles, and in the picture
BASES = tuple(SIDES)


@dataclass(frozen=True)
class Parameters:
    thicknesses: tuple = option((0.05, 0.1, 0.2, 0.4, 4.0, 8.0, 16.0), "h over a_Hz", nargs="+", metavar="H")
    alpha: float = option(0.5, "ell over a_Hz")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number 2 eta/(1 + eta), 0 < beta < 2")
    base: str = option("bonded", "what the base holds", str, choices=BASES)
    order: int = option(4, "of the elements", int)
    rtol: float = option(3e-3, "of the refinement")

    def __post_init__(self):
        object.__setattr__(self, "thicknesses", tuple(sorted(self.thicknesses)))
        require_finite(**{name: getattr(self, name) for name in ("alpha", "rtol")})
        for value in self.thicknesses:
            require_finite(thicknesses=value)
            if not 0.01 <= value <= 1000:
                raise BadArgument("thicknesses", value, "must lie between 0.01 and 1000")
        if not self.thicknesses:
            raise BadArgument("thicknesses", self.thicknesses, "must be at least one number")
        if not 0.01 <= self.alpha <= 2:
            raise BadArgument("alpha", self.alpha, "must lie between 0.01 and 2")
        if not 0 < self.rtol < 1:
            raise BadArgument("rtol", self.rtol, "must lie between 0 and 1")
        if self.base not in SIDES:
            raise BadArgument("base", self.base, f"must be one of {', '.join(BASES)}")
        if not 2 <= self.order <= 12:
            raise BadArgument("order", self.order, "must lie between 2 and 12")
        self.solid      # bad moduli are named at once

    @property
    def solid(self):
        return Cosserat(E=STIFFNESS*(1 - self.nu**2), nu=self.nu, ell=self.alpha, beta=self.beta)


def scene(parameters, h, obstacle, law):
    """The layer, not refined yet."""
    reach = 1 + parameters.alpha/2 + BESIDE
    side = reach + WIDER*max(h, 0.25)
    face = polygon([(side, 0), (side, -h), (-side, -h), (-side, 0), (-reach, 0), (reach, 0)],
                   ["right", "bottom", "left", "free", "contact", "free"])
    for edge in face.edges:
        if edge.name == "contact":
            edge.maxh = min(0.2, h)
    body = Body(mesh_of(face, max(h, 0.1), parameters.order), parameters.solid, parameters.order, fixed=SIDES[parameters.base])
    return Contact(body, OBSTACLES[obstacle], LAWS[law])


def mattress(parameters, h):
    """The closed form for thin layers."""
    solid = parameters.solid
    modulus = solid.lam + 2*solid.mu if parameters.base == "bonded" else solid.E_star
    from microblock.references import ThinLayer      # judges only: the computation does without
    return ThinLayer(modulus/h, solid.curvature*solid.ell**2*solid.mu/h, solid.ell)


def gaps(parameters, obstacle, law, x):
    """Initial gaps of the corners over a flat surface, array (corners, n)."""
    up = np.column_stack((np.zeros(len(x)), np.ones(len(x))))
    points = np.column_stack((x, np.zeros(len(x))))
    return np.array(list(LAWS[law].initial_gaps(points, up, parameters.alpha, OBSTACLES[obstacle]).values()))


def reference(parameters, h, obstacle, law):
    """(load, approach or None, pressure(corner, x)) of the limit that is nearer."""
    if h > THIN:
        state = Contact(HalfPlane(parameters.solid), OBSTACLES[obstacle], LAWS[law]).at(LOAD, JUDGE*parameters.rtol)
        return LOAD, None, state.pressure
    springs = mattress(parameters, h)
    x = np.linspace(-2, 2, SAMPLES)*(1 + parameters.alpha)
    load = (x[1] - x[0])*springs.pressures(SUNK - gaps(parameters, obstacle, law, x)).sum()
    return float(load), SUNK, lambda corner, x: springs.pressures(SUNK - gaps(parameters, obstacle, law, x))[corner]


def solve(parameters, h, obstacle, law):
    """(record, BodyState) of one layer."""
    load, approach, pressure = reference(parameters, h, obstacle, law)
    start = time.perf_counter()
    state = scene(parameters, h, obstacle, law).at(load, parameters.rtol)
    seconds = time.perf_counter() - start
    energy, work = balances(state)
    return {"obstacle": obstacle, "law": law, "h": h, "limit": "half-plane" if h > THIN else "mattress", "load": load,
            "approach": state.approach, "approach_over_limit": approach and state.approach/approach,
            "difference": state.difference(pressure), "error_estimate": state.error_estimate, "energy_balance": energy,
            "work_balance": work, "unknowns": state.unknowns, "seconds": seconds}, state


def result(parameters, quiet=True):
    """The case's object: a row a layer."""
    start = time.perf_counter()
    chosen = [(h, obstacle, law) for obstacle in OBSTACLES for law in LAWS for h in parameters.thicknesses]
    layers = [solve(parameters, *one)[0] for one in tqdm(chosen, disable=quiet, unit="layer")]
    return returned(parameters, start, layers=layers)


def run(parameters, out=None, quiet=False):
    """Solve, print a table, draw differences over h and one deformed layer into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "coating", rows(parameters, answer), figure)
        keep(out, "coating_body", body_records(parameters), body_figure)
    return answer


def show(answer):
    columns = ("obstacle", "law", "h", "limit", "difference", "error_estimate", "approach_over_limit", "energy_balance",
               "work_balance", "unknowns", "seconds")
    print("  ".join(f"{name:>10.10}" for name in columns))
    for row in answer["layers"]:
        print("  ".join(f"{row[name]:10.3g}" if isinstance(row[name], float) else f"{row[name] or '-':>10}" for name in columns))


def rows(parameters, answer):
    """A row a layer; its seconds, which no other run has again, are left to the table."""
    own = {"command": command("coating", parameters)}
    return [{**own, **{name: cell for name, cell in row.items() if name != "seconds"}} for row in answer["layers"]]


def body_records(parameters):
    """What `body_figure` draws."""
    _, state = solve(parameters, PICTURE, "cylinder", "microblock")
    return [{"command": command("coating", parameters), **row} for row in points_of(state, (-SEEN, SEEN, -PICTURE))]


def body_figure(records):
    """Elastic layer of thickness a_Hz on a rigid base under a cylinder: the middle of the deformed body (displacements magnified)
    with -sigma_22 in colours.
    """
    drawing = draw_body(records)
    drawing.axes[0].set_xlim(-CUT, CUT)
    return drawing


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """Elastic layer on a rigid base: differences to the mattress (thin layers) and to the half-plane (thick ones) over the
    thickness h; dashed the orders 3/2, 1 and -2.
    """
    drawing, axis = plots.figure(height=3.0)
    for colour, marker, (obstacle, own) in zip(plots.COLOURS, plots.MARKERS, grouped(records, "obstacle").items()):
        for (law, rows), style in zip(grouped(own, "law").items(), ("-", ":")):
            for number, chosen in enumerate(grouped(rows, "limit").values()):
                axis.loglog(column(chosen, "h"), column(chosen, "difference"), style, color=colour, marker=marker,
                            label=f"{obstacle}, {law}" if number == 0 else None)
    axis.plot([], [], "--", color="0.6", linewidth=0.7, label="orders 3/2, 1 and $-2$")
    for power, (first, last), size in ((1.5, (0.05, 0.4), 0.0015), (1, (0.05, 0.4), 0.03), (-2, (4, 32), 0.2)):
        axis.loglog((first, last), (size, size*(last/first)**power), "--", color="0.6", linewidth=0.7)
    axis.set(xlabel=r"$h/a_\mathrm{Hz}$", ylabel="difference to the limit")
    plots.legend_below(axis)
    return drawing
