"""A block with a hole under its surface, pressed by a cylinder and by a tilted punch.

Geometry   block of 4 x 2, its bottom fixed, with a round hole beside and under the contact; a user's
           mesh from netgen, with curved sides, that does not follow the zones.
Equations  equilibrium (14)-(17), microblock and unilateral law.
Model      condensed body, its mesh refined by recovery until the estimate holds (`Contact(Body(...),
           ...).solve(load, rtol)`).
Reference  none in closed form: states of larger rtol against that of the smallest.
Look at    obtained differences below rtol; energy of the fields, work of the corners and work of the load are
           one; the contact leans away from the hole.
Units      the block's own; E = 1.
"""

import time
from dataclasses import dataclass

import netgen.occ as occ
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped

from ..common.bodies import balances, draw_body, mesh_of, points_of
from ..common.case import of_kinds
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned, without_seconds

OBSTACLES = {"cylinder": mb.Cylinder(5.0), "punch": mb.Punch(0.5, tilt=0.005)}
LAWS = {"microblock": mb.Microblock(), "unilateral": mb.Unilateral()}
REACH = 1.2  # half-width of the contact boundary
SPACING = 0.25  # of its elements at first
ROOM = 0.6  # of the fewest unknowns: where the abscissa of the figure begins
PICTURE = "cylinder", "microblock"
# names of curves beside their first marks: which of these, and points right and up of it
NAMES = {PICTURE: ("error_estimate", (6, 6)), ("cylinder", "unilateral"): ("difference", (0, -14))}


@dataclass(frozen=True)
class Parameters(Checked):
    load: float = option(0.05, "force per thickness over E and the unit of length", above=0)
    ell: float = option(0.1, "length scale of the material", above=0)
    nu: float = poisson()
    beta: float = coupling()
    depth: float = option(0.7, "of the hole's centre; its radius is 0.4", at_least=0.45, at_most=1.55)
    order: int = option(4, "of the elements", int, at_least=2, at_most=12)
    rtols: tuple = option(
        (0.1, 0.03, 0.01, 0.003),
        "of the refinement; the smallest is the reference",
        above=0,
        below=1,
        fewest=2,
        order="descending",
        nargs="+",
        metavar="RTOL",
    )

    @property
    def solid(self):
        return mb.Cosserat(E=1.0, nu=self.nu, ell=self.ell, beta=self.beta)


def problem(parameters, obstacle, law):
    """The block, not refined yet."""
    block = occ.Rectangle(4, 2).Face().Move((-2, -2, 0))
    # its upper corners end the contact boundary
    top = occ.Rectangle(2 * REACH, 2).Face().Move((-REACH, -2, 0))
    face = occ.Glue([block - top, top - occ.Circle((0.3, -parameters.depth), 0.4).Face()])
    for edge in face.edges:
        edge.name = "bottom" if abs(edge.center.y + 2) < 1e-9 else "free"
        if abs(edge.center.y) < 1e-9 and abs(edge.center.x) < REACH / 2:
            edge.name, edge.maxh = "contact", SPACING
    body = mb.Body(mesh_of(face, 0.7, parameters.order), parameters.solid, parameters.order, fixed="bottom")
    return mb.Contact(body, OBSTACLES[obstacle], LAWS[law])


def solve(parameters, obstacle, law):
    """(records, finest State) of one problem."""
    rows, states = [], []
    block = problem(parameters, obstacle, law)
    for rtol in parameters.rtols:
        begin = time.perf_counter()
        state = block.solve(load=parameters.load, rtol=rtol)
        seconds = time.perf_counter() - begin
        energy, work = balances(state)
        contact = state.zones["contact"]
        states.append(state)
        rows.append(
            {
                "obstacle": obstacle,
                "law": law,
                "rtol": rtol,
                "error_estimate": state.error_estimate,
                "approach": state.approach,
                "left": contact[0][0],
                "right": contact[-1][1],
                "energy_balance": energy,
                "work_balance": work,
                "unknowns": state.unknowns,
                "seconds": seconds,
            }
        )
    for row, state in zip(rows, states):
        finest = state is states[-1]
        row["difference"] = None if finest else state.solution.difference(states[-1].solution.pressure)
    return rows, states[-1]


def result(parameters, quiet=True):
    """The case's object: a row a state."""
    start = time.perf_counter()
    chosen = [(obstacle, law) for obstacle in OBSTACLES for law in LAWS]
    states = []
    for one in tqdm(chosen, disable=quiet, unit="problem"):
        states += solve(parameters, *one)[0]
    return returned(parameters, start, states=states)


def show(answer):
    print_table(
        answer["states"],
        (
            "obstacle",
            "law",
            "rtol",
            "error_estimate",
            "difference",
            "approach",
            "left",
            "right",
            "energy_balance",
            "work_balance",
            "unknowns",
            "seconds",
        ),
    )


def rows(parameters, answer):
    """A row a state, without its seconds, which no other run has again; and one a corner of a triangle of the
    body that is drawn.
    """
    rtol = max(parameters.rtols[-1], 1e-2)
    drawn = problem(parameters, *PICTURE).solve(load=parameters.load, rtol=rtol)
    return of_kinds(state=without_seconds(answer["states"]), body=points_of(drawn, (-2, 2, -2)))


def figure(records):
    """On a mesh of one's own, refinement reaches the error that is asked for, and the estimate bounds it.

    A block of 4 L by 2 L with a round hole, bottom fixed, on a mesh that does not follow the contact. (a)
    Deformed by a cylinder under the force 0.05 E L (displacements magnified as the title says), vertical
    stress in shades: the contact leans away from the hole. (b) Difference of the pressure to the finest state
    (full marks) and estimated error (open marks, dashed) over the unknowns of the refined meshes, under a
    cylinder and a tilted punch, microblocks and unilateral; dotted: the rtol that were asked for.

    Seen: dark stress between the dented top and the left side of the hole; below, four pairs of falling
    lines, the open marks above the full ones, and each open mark below the dotted line of its rtol.
    """
    from microblock.view import plots

    kinds = grouped(records, "kind")
    drawing, (body, axis) = plots.figure(2, 1, height=2.3)
    magnified = draw_body(body, kinds["body"], "L", "E")
    problems = [
        (obstacle, law, rows)
        for obstacle, own in grouped(kinds["state"], "obstacle").items()
        for law, rows in grouped(own, "law").items()
    ]
    for (obstacle, law, rows), colour, marker in zip(problems, plots.COLOURS, plots.MARKERS):
        unknowns = [row["unknowns"] for row in rows]
        look = {"color": colour, "marker": marker}
        axis.loglog(unknowns[:-1], [row["difference"] for row in rows[:-1]], **look)
        estimates = [row["error_estimate"] for row in rows]
        axis.loglog(unknowns, estimates, "--", markerfacecolor="none", **look)
        # the cylinder's curves cross: names stand where neither runs
        at, shift = NAMES.get((obstacle, law), ("error_estimate", (0, 12)))
        plots.label(axis, unknowns[0], rows[0][at], f"{obstacle},\n{law}", colour, shift)
    least = min(column(kinds["state"], "unknowns"))
    for rtol in dict.fromkeys(column(kinds["state"], "rtol")):
        axis.axhline(rtol, color="0.6", linewidth=0.7, linestyle=":", zorder=0)
        plots.label(axis, ROOM * least, rtol, f"rtol {rtol:g}", "0.35", (2, 5))
    plots.plain_log(axis.xaxis)
    low, high = axis.get_ylim()
    axis.set(xlabel="unknowns", ylabel="relative $L_2$ difference", ylim=(0.35 * low, 3 * high))
    axis.set_xlim(ROOM * least, None)
    plots.letter((body, axis), rf"displacements $\times$ {magnified:.2g}", "")
    return drawing


FIGURES = {"hole": (rows, figure)}
