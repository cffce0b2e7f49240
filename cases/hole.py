"""A block with a hole under its surface, pressed by a cylinder and by a tilted punch.

Geometry   block of 4 x 2, its bottom held, with a round hole beside and under the contact; netgen's mesh of a user's, with
           curved sides, that knows of no zones.
Equations  equilibrium (14)-(17), microblock and unilateral law.
Model      condensed body, its mesh refined by recovery until the estimate holds (`Contact(Body(...), ...).at(load, rtol)`).
Reference  none in closed form: states of larger rtol against that of the smallest.
Look at    obtained differences below rtol; energy of the fields, work of the corners and work of the load are one; the
           contact leans away from the hole.
Units      the block's own; E = 1.
"""

import time
from dataclasses import dataclass

import netgen.occ as occ
from tqdm import tqdm

from cases.bodies import balances, draw_body, mesh_of, points_of
from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.body import Body
from microblock.errors import BadArgument, require_finite
from microblock.law import Microblock, Unilateral
from microblock.material import Cosserat
from microblock.obstacles import Cylinder, Punch
from microblock.scene import Contact
from microblock.study import grouped

OBSTACLES = {"cylinder": Cylinder(5.0), "punch": Punch(0.5, tilt=0.005)}
LAWS = {"microblock": Microblock(), "unilateral": Unilateral()}
REACH = 1.2                  # half-width of the contact boundary
SPACING = 0.25               # of its elements at first
PICTURE = "cylinder", "microblock"


@dataclass(frozen=True)
class Parameters:
    load: float = option(0.05, "force per thickness over E and the unit of length")
    ell: float = option(0.1, "length scale of the material")
    nu: float = option(0.3, "Poisson's ratio, -1 < nu < 1/2")
    beta: float = option(1.0, "coupling number 2 eta/(1 + eta), 0 < beta < 2")
    depth: float = option(0.7, "of the hole's centre; its radius is 0.4")
    order: int = option(4, "of the elements", int)
    rtols: tuple = option((0.1, 0.03, 0.01, 0.003), "of the refinement; the smallest judges", nargs="+", metavar="RTOL")

    def __post_init__(self):
        object.__setattr__(self, "rtols", tuple(sorted(self.rtols, reverse=True)))
        require_finite(load=self.load, ell=self.ell, depth=self.depth)
        if not self.load > 0:
            raise BadArgument("load", self.load, "must be positive")
        if not 0.45 <= self.depth <= 1.55:
            raise BadArgument("depth", self.depth, "must lie between 0.45 and 1.55: the hole has the radius 0.4")
        if not 2 <= self.order <= 12:
            raise BadArgument("order", self.order, "must lie between 2 and 12")
        if len(self.rtols) < 2 or not all(0 < rtol < 1 for rtol in self.rtols):
            raise BadArgument("rtols", self.rtols, "must be two numbers or more between 0 and 1")
        self.solid      # bad moduli are named at once

    @property
    def solid(self):
        return Cosserat(E=1.0, nu=self.nu, ell=self.ell, beta=self.beta)


def scene(parameters, obstacle, law):
    """The block, not refined yet."""
    block = occ.Rectangle(4, 2).Face().Move((-2, -2, 0))
    top = occ.Rectangle(2*REACH, 2).Face().Move((-REACH, -2, 0))      # its upper corners end the contact boundary
    face = occ.Glue([block - top, top - occ.Circle((0.3, -parameters.depth), 0.4).Face()])
    for edge in face.edges:
        edge.name = "bottom" if abs(edge.center.y + 2) < 1e-9 else "free"
        if abs(edge.center.y) < 1e-9 and abs(edge.center.x) < REACH/2:
            edge.name, edge.maxh = "contact", SPACING
    body = Body(mesh_of(face, 0.7, parameters.order), parameters.solid, parameters.order, fixed="bottom")
    return Contact(body, OBSTACLES[obstacle], LAWS[law])


def solve(parameters, obstacle, law):
    """(records, finest BodyState) of one scene."""
    rows, states = [], []
    start = scene(parameters, obstacle, law)
    for rtol in parameters.rtols:
        begin = time.perf_counter()
        state = start.at(parameters.load, rtol)
        seconds = time.perf_counter() - begin
        energy, work = balances(state)
        contact = state.zones["contact"]
        states.append(state)
        rows.append({"obstacle": obstacle, "law": law, "rtol": rtol, "error_estimate": state.error_estimate,
                     "approach": state.approach, "left": contact[0][0], "right": contact[-1][1], "energy_balance": energy,
                     "work_balance": work, "unknowns": state.unknowns, "seconds": seconds})
    for row, state in zip(rows, states):
        row["difference"] = state.difference(states[-1].pressure) if state is not states[-1] else None
    return rows, states[-1]


def result(parameters, quiet=True):
    """The case's object: a row a state."""
    start = time.perf_counter()
    chosen = [(obstacle, law) for obstacle in OBSTACLES for law in LAWS]
    states = [row for one in tqdm(chosen, disable=quiet, unit="scene") for row in solve(parameters, *one)[0]]
    return returned(parameters, start, states=states)


def run(parameters, out=None, quiet=False):
    """Solve, print a table, draw convergence and the deformed body into the folder `out`."""
    answer = result(parameters, quiet)
    if not quiet:
        show(answer)
    if out:
        keep(out, "hole", rows(parameters, answer), figure)
        keep(out, "hole_body", body_records(parameters), body_figure)
    return answer


def show(answer):
    columns = ("obstacle", "law", "rtol", "error_estimate", "difference", "approach", "left", "right", "energy_balance",
               "work_balance", "unknowns", "seconds")
    print("  ".join(f"{name:>10.10}" for name in columns))
    for row in answer["states"]:
        print("  ".join(f"{row[name]:10.4g}" if isinstance(row[name], float) else f"{row[name] or '-':>10}" for name in columns))


def rows(parameters, answer):
    """A row a state; its seconds, which no other run has again, are left to the table."""
    own = {"command": command("hole", parameters)}
    return [{**own, **{name: cell for name, cell in row.items() if name != "seconds"}} for row in answer["states"]]


def body_records(parameters):
    """What `body_figure` draws."""
    state = scene(parameters, *PICTURE).at(parameters.load, max(parameters.rtols[-1], 1e-2))
    return [{"command": command("hole", parameters), **row} for row in points_of(state, (-2, 2, -2))]


def body_figure(records):
    """Block with a hole under a cylinder: the deformed body (displacements magnified) with -sigma_22 in colours."""
    return draw_body(records)


def records(parameters):
    """What `figure` draws."""
    return rows(parameters, result(parameters))


def figure(records):
    """Block with a hole under a cylinder and a tilted punch: difference to the finest state (full) and estimate (dashed) over the
    unknowns of the refined meshes.
    """
    drawing, axis = plots.figure(height=3.0)
    scenes = [(obstacle, law, rows) for obstacle, own in grouped(records, "obstacle").items()
              for law, rows in grouped(own, "law").items()]
    for (obstacle, law, rows), colour, marker in zip(scenes, plots.COLOURS, plots.MARKERS):
        axis.loglog([row["unknowns"] for row in rows[:-1]], [row["difference"] for row in rows[:-1]], color=colour, marker=marker,
                    label=f"{obstacle}, {law}")
        axis.loglog([row["unknowns"] for row in rows], [row["error_estimate"] for row in rows], "--", color=colour, marker=marker,
                    markerfacecolor="none")
    plots.plain_log(axis.xaxis)
    axis.set(xlabel="unknowns", ylabel="relative $L_2$ difference, estimate")
    plots.legend_below(axis, title="full: difference to the finest state, dashed: estimate")
    return drawing
