"""An elastic layer on a rigid base: from the half-plane to a Winkler foundation.

Geometry   a layer of thickness h, bonded to a rigid base (u = psi = 0) or sliding on it (u2 = psi = 0, sides
           free), pressed by a cylinder and by a tilted punch; the mesh is a user's, netgen's triangles that
           do not follow the zones.
Equations  equilibrium (14)-(17), microblock and unilateral law.
Model      condensed body, its mesh refined by recovery until the estimate holds (`Contact(Body(...),
           ...).solve(load, rtol)`).
Reference  thick layers: the half-plane on its contact line; thin ones: `ThinLayer` of docs/theory/model.md.
Look at    differences fall like (a/h)^2 to the half-plane, and like (h/a)^(3/2) (cylinder: its edges) and h/a
           (punch: its ends) to the Winkler foundation; energy of the fields, work of the corners and work of
           the load are one.
Units      a_Hz = 1, R = 10, E* = 20; thick layers carry pi/2, thin ones what the Winkler foundation carries
           at an approach of a_Hz^2/(2 R).
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import microblock as mb
from microblock.data.records import column, grouped

from ..common.bodies import balances, draw_body, mesh_of, points_of, polygon
from ..common.case import of_kinds
from ..common.options import Checked, coupling, option, poisson
from ..common.records import print_table, returned, without_seconds

LOAD, RADIUS, STIFFNESS = math.pi / 2, 10.0, 20.0
OBSTACLES = {"cylinder": mb.Cylinder(RADIUS), "punch": mb.Punch(1.0, tilt=0.01)}
LAWS = {"microblock": mb.Microblock(), "unilateral": mb.Unilateral()}
THIN = 1.0  # below this h the Winkler foundation is the reference
APPROACH = 1 / (2 * RADIUS)  # of the Winkler foundation: its contact under the cylinder has the half-width 1
BESIDE = 0.6  # half-width of the contact boundary beyond 1 + ell/2
WIDER = 4.0  # half-length of the layer beyond that, over h
SIDES = {"bonded": "bottom", "sliding": {"u1": "left", "u2": "bottom", "psi": "bottom"}}
SAMPLES = 20001  # of the contact boundary, for the load of a Winkler foundation
TIGHTER = 0.1  # of rtol: error asked of the half-plane
PICTURE = 1.0  # h of the layer that is drawn
SEEN, CUT = 2.0, 1.6  # half of its length in the records, whole triangles, and in the picture
BASES = tuple(SIDES)


@dataclass(frozen=True)
class Parameters(Checked):
    thicknesses: tuple = option(
        (0.05, 0.1, 0.2, 0.4, 4.0, 8.0, 16.0),
        "h over a_Hz",
        at_least=0.01,
        at_most=1000,
        order="ascending",
        nargs="+",
        metavar="H",
    )
    alpha: float = option(0.5, "ell over a_Hz", at_least=0.01, at_most=2)
    nu: float = poisson()
    beta: float = coupling()
    base: str = option("bonded", "what the base constrains", str, choices=BASES)
    order: int = option(4, "of the elements", int, at_least=2, at_most=12)
    rtol: float = option(3e-3, "of the refinement", above=0, below=1)

    @property
    def solid(self):
        return mb.Cosserat(E=STIFFNESS * (1 - self.nu**2), nu=self.nu, ell=self.alpha, beta=self.beta)


def problem(parameters, h, obstacle, law):
    """The layer, not refined yet."""
    reach = 1 + parameters.alpha / 2 + BESIDE
    side = reach + WIDER * max(h, 0.25)
    face = polygon(
        [(side, 0), (side, -h), (-side, -h), (-side, 0), (-reach, 0), (reach, 0)],
        ["right", "bottom", "left", "free", "contact", "free"],
    )
    for edge in face.edges:
        if edge.name == "contact":
            edge.maxh = min(0.2, h)
    body = mb.Body(
        mesh_of(face, max(h, 0.1), parameters.order),
        parameters.solid,
        parameters.order,
        fixed=SIDES[parameters.base],
    )
    return mb.Contact(body, OBSTACLES[obstacle], LAWS[law])


def foundation(parameters, h):
    """The closed form for thin layers."""
    solid = parameters.solid
    modulus = solid.lam + 2 * solid.mu if parameters.base == "bonded" else solid.E_star
    from microblock.model.closed_forms import ThinLayer  # for verification only

    return ThinLayer(modulus / h, solid.curvature * solid.ell**2 * solid.mu / h, solid.ell)


def gaps(parameters, obstacle, law, x):
    """Initial gaps of the corners over a flat surface, array (corners, n)."""
    up = np.column_stack((np.zeros(len(x)), np.ones(len(x))))
    points = np.column_stack((x, np.zeros(len(x))))
    return np.array(list(LAWS[law].initial_gaps(points, up, parameters.alpha, OBSTACLES[obstacle]).values()))


def reference(parameters, h, obstacle, law):
    """(load, approach or None, pressure(corner, x)) of the limit that is nearer."""
    if h > THIN:
        limit = mb.Contact(mb.HalfPlane(parameters.solid), OBSTACLES[obstacle], LAWS[law])
        return LOAD, None, limit.solve(load=LOAD, rtol=TIGHTER * parameters.rtol).solution.pressure
    springs = foundation(parameters, h)
    x = np.linspace(-2, 2, SAMPLES) * (1 + parameters.alpha)
    load = (x[1] - x[0]) * springs.pressures(APPROACH - gaps(parameters, obstacle, law, x)).sum()

    def pressure(corner, x):
        return springs.pressures(APPROACH - gaps(parameters, obstacle, law, x))[corner]

    return float(load), APPROACH, pressure


def solve(parameters, h, obstacle, law):
    """(record, State) of one layer."""
    load, approach, pressure = reference(parameters, h, obstacle, law)
    start = time.perf_counter()
    state = problem(parameters, h, obstacle, law).solve(load=load, rtol=parameters.rtol)
    seconds = time.perf_counter() - start
    energy, work = balances(state)
    return {
        "obstacle": obstacle,
        "law": law,
        "h": h,
        "limit": "half-plane" if h > THIN else "Winkler foundation",
        "load": load,
        "approach": state.approach,
        "approach_over_limit": approach and state.approach / approach,
        "difference": state.solution.difference(pressure),
        "error_estimate": state.error_estimate,
        "energy_balance": energy,
        "work_balance": work,
        "unknowns": state.unknowns,
        "seconds": seconds,
    }, state


def result(parameters, quiet=True):
    """The case's object: a row a layer."""
    start = time.perf_counter()
    chosen = [(h, obstacle, law) for obstacle in OBSTACLES for law in LAWS for h in parameters.thicknesses]
    layers = [solve(parameters, *one)[0] for one in tqdm(chosen, disable=quiet, unit="layer")]
    return returned(parameters, start, layers=layers)


def show(answer):
    print_table(
        answer["layers"],
        (
            "obstacle",
            "law",
            "h",
            "limit",
            "difference",
            "error_estimate",
            "approach_over_limit",
            "energy_balance",
            "work_balance",
            "unknowns",
            "seconds",
        ),
    )


def rows(parameters, answer):
    """A row a layer, without its seconds, which no other run has again; and one a corner of a triangle of the
    layer that is drawn.
    """
    drawn = solve(parameters, PICTURE, "cylinder", "microblock")[1]
    return of_kinds(layer=without_seconds(answer["layers"]), body=points_of(drawn, (-SEEN, SEEN, -PICTURE)))


# slopes that are expected, over and under the curves: exponent, its words and where they stand, in points
# right and up of the middle; ends, size at the first end
SLOPES = (
    (1.5, "3/2", (8, -6), (0.1, 0.4), 0.005),
    (1, "1", (0, 7), (0.1, 0.4), 0.055),
    (-2, "−2", (8, 5), (4, 16), 0.09),
)


def figure(records):
    """An elastic layer is a Winkler foundation where it is thin, and a half-plane where it is thick.

    (a) Layer of thickness a_Hz, bonded to a rigid base, under a cylinder with the force 1.77 p_Hz a_Hz: the
    middle of the deformed body (displacements magnified as the title says), vertical stress in shades. The
    mesh is a user's and was refined until the estimated error was below the rtol. (b) Difference of the
    pressure to the foundation, left, and to the half-plane, right, over the thickness, under a cylinder and a
    tilted punch; full: microblocks, dotted: unilateral; bars are estimated errors. Dashed: the slopes that
    are expected.

    Seen: a slab that is most compressed in the middle of its dented top; below, curves that rise at the left,
    that of the punch less steeply than that of the cylinder, and fall together at the right; all are about
    as steep as the dashed lines beside them.
    """
    from microblock.view import plots

    kinds = grouped(records, "kind")
    drawing, (body, axis) = plots.figure(2, 1, height=2.1)
    # both are 1 in the units of the records
    magnified = draw_body(body, kinds["body"], r"a_\mathrm{Hz}", r"p_\mathrm{Hz}")
    body.set_xlim(-CUT, CUT)
    for colour, marker, (obstacle, own) in zip(
        plots.COLOURS, plots.MARKERS, grouped(kinds["layer"], "obstacle").items()
    ):
        for rows, style in zip(grouped(own, "law").values(), ("-", ":")):
            for chosen in grouped(rows, "limit").values():
                names = "h", "difference", "error_estimate"
                x, y, error = (column(chosen, name) for name in names)
                axis.errorbar(x, y, error, color=colour, marker=marker, linestyle=style, elinewidth=0.7)
        plots.label(axis, own[0]["h"], own[0]["difference"], obstacle, colour, (-6, 0))
    for power, words, shift, (first, last), size in SLOPES:
        sizes = size, size * (last / first) ** power
        axis.plot((first, last), sizes, "--", color="0.6", linewidth=0.7)
        plots.label(axis, (first * last) ** 0.5, (sizes[0] * sizes[1]) ** 0.5, words, "0.35", shift)
    axis.set(xscale="log", yscale="log", xlim=(0.02, 50), ylim=(1.5e-3, 0.5))
    axis.set(xlabel=r"$h/a_\mathrm{Hz}$", ylabel="difference to the limit")
    for x, words in ((0.2, "to the foundation"), (8, "to the half-plane")):
        plots.label(axis, x, 0.32, words, "0.35", (0, 0))
    plots.letter((body, axis), rf"displacements $\times$ {magnified:.2g}", "")
    return drawing


FIGURES = {"coating": (rows, figure)}
