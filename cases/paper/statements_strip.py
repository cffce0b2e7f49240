"""Statements of section 4.1, the strip: what decides each, from the records of Figs 3 to 6."""

import numpy as np

from microblock.data.records import column, grouped
from microblock.model.law import Microblock
from microblock.model.material import Cosserat
from microblock.model.obstacles import Plane

from ..scenes import strip
from . import figures_strip
from .statement import Statement, above, below, printed

ROUNDING = 1e-12  # of quantities of size 1 from a few operations on doubles
SOLVED = 1e-9  # the same after a linear solve of the strip
# two curves that agree to this cannot be distinguished in print, nor by the error of the mesh's records
PRINTED = 1e-6
LINE_WIDTH = 0.01  # of a figure's height: a marker off by less sits on the line
VANISHED = 0.02  # of the surface value


def worst(values):
    return float(np.max(np.abs(values)))


def branch(records, name, state):
    """A column of Fig. 6's records in one state, with the approach delta."""
    rows = [row for row in records("fig6") if row["state"] == state]
    return np.array(column(rows, "delta_over_H")), np.array(column(rows, name))


def proportional(name):
    """How far a quantity is from proportional to delta while contact is partial."""

    def compute(records):
        delta, values = branch(records, name, "partial")
        return worst(values / delta / (values / delta)[0] - 1), SOLVED

    return compute


def constant(name):
    """How far a quantity is from constant in full contact, from delta_fc on."""

    def compute(records):
        values = branch(records, name, "full")[1]
        return worst(values / values[0] - 1), SOLVED

    return compute


def corner_forces(row):
    """Pressures (p_A, p_B) from traction and micromoment by (29)."""
    t_n, M, psi0 = row["traction"], row["micromoment"], np.radians(row["psi0_deg"])
    t_A = ((1 - psi0) * t_n - 2 * M / row["ell_over_H"]) / 2
    return -t_A, t_A - t_n


def levers(row):
    """M over t_n ell/2."""
    return row["micromoment"] / (row["traction"] * row["ell_over_H"] / 2)


def initial_gaps(records):
    ell, psi0 = 0.5, np.radians(1)
    gaps = Microblock(psi0).initial_gaps(np.zeros((1, 2)), np.array([[0.0, 1.0]]), ell, Plane(ell * psi0 / 2))
    return gaps["A"][0] / (ell * psi0), abs(gaps["B"][0]) / (ell * psi0) + ROUNDING


def sideways(records):
    """A column of 2D elements against the depth alone, on the same mesh."""
    line = figures_strip.run_row(ell_over_H=0.5, model="line", order=1, elements=20)
    flat = next(row for row in records("fig4") if row["ell_over_H"] == 0.5)
    return worst(
        [flat[name] / line[name] - 1 for name in ("psi_surface", "u1_surface", "u2_surface", "traction")]
    ), SOLVED


def share_of_B(records):
    pairs = [corner_forces(row) for row in records("fig6")]
    return min(b / (a + b) for a, b in pairs), SOLVED


def states(records):
    """1 where A is open below delta_fc and closed from it on, at every load."""
    return np.mean(
        [
            (row["state"] == "full") == (row["delta_over_H"] >= row["delta_fc"] * (1 - 1e-9))
            for row in records("fig6")
        ]
    ), 0.0


def layer_of_printed_curvature(records):
    """L_psi/L_psi of (49) at the curvature printed in (18)."""
    row = next(row for row in records("strip_curvature") if row["curvature"] == 1.0 and row["rtol"])
    return row["L_psi"] / figures_strip.exact(row, curvature=2.0).L_psi, row["error_estimate"]


def uncoupled(records):
    """psi varies over the depth by cosh(sqrt(beta) H/ell) - 1, nothing for beta -> 0; over beta."""
    beta = 1e-4
    rows = figures_strip.profile_rows(ell_over_H=0.5, beta=beta, rtol=1e-6)
    return rows[-1]["psi"] / rows[0]["psi"] - 1, rows[0]["error_estimate"]


def condition_45(records):
    rows = [row for row in records("fig6") if row["state"] == "partial"]
    return worst([levers(row) / (1 - np.radians(row["psi0_deg"])) - 1 for row in rows]), SOLVED


def constant_rotation(records):
    rows = [row for row in records("fig6") if row["state"] == "full"]
    return worst([row["psi_surface"] / -np.radians(row["psi0_deg"]) - 1 for row in rows]), SOLVED


def closed_form(names):
    def compute(records):
        rows = [row for row in records("strip_table") if row["quantity"] in names]
        # rtol of these records
        return worst([row["difference"] / row["closed_form"] for row in rows]), 1e-9

    return compute


def curvature_of_u2(records):
    """Distance of u2 from a straight line over its largest value."""
    found = []
    for nodes in grouped(records("fig4"), "ell_over_H").values():
        x2, u2 = np.array(column(nodes, "x2")), np.array(column(nodes, "u2"))
        found.append(worst(u2 - x2 * u2[-1]) / worst(u2))
    return max(found), SOLVED


def off_the_line(thick):
    """Markers of Fig. 4 off the closed form, over the largest value of the curve: thickest strip, or the
    others.
    """

    def compute(records):
        found = []
        for ratio, nodes in grouped(records("fig4"), "ell_over_H").items():
            form, x2 = figures_strip.exact(nodes[0]), np.array(column(nodes, "x2"))
            for name in ("psi", "u1"):
                line = getattr(form, name)(x2)
                found += [worst(np.array(column(nodes, name)) - line) / worst(line)] * (
                    (ratio == 0.1) == thick
                )
        return max(found), 0.0

    return compute


def left_inside(ratio):
    """psi at the middle over psi at the surface."""

    def compute(records):
        nodes = [row for row in records("fig4") if row["ell_over_H"] == ratio]
        return nodes[0]["psi"] / nodes[-1]["psi"], nodes[0]["error_psi"]

    return compute


def decay(records):
    """Length over which psi falls by e next to the surface of the thick strip, over ell/sqrt(beta)."""
    nodes = [row for row in records("fig4") if row["ell_over_H"] == 0.1 and row["x2"] >= 0.5]
    slope = np.polyfit(column(nodes, "x2"), np.log(np.abs(column(nodes, "psi"))), 1)[0]
    return 1 / slope / 0.1, 2 * nodes[0]["error_psi"]


def printed_48(records):
    """sqrt(beta)/ell times (48) with its minus sign and the derivative along x2, thickest strip of Fig. 5."""
    row = records("fig5")[0]
    return -row["L_psi"] * np.sqrt(row["beta"]) / row["ell_over_H"], row["error_estimate"]


def branch_independence(records):
    lengths = np.array([[row["L_psi"], row["L_u"]] for row in records("fig6")])
    return worst(lengths / lengths[0] - 1), SOLVED


def formula_49(records):
    rows = records("fig5")
    thickness = np.sqrt(column(rows, "beta")) / np.array(column(rows, "ell_over_H"))
    return worst(
        [
            np.array(column(rows, "L_psi")) * thickness * np.tanh(thickness) - 1,
            np.array(column(rows, "L_u")) * thickness / np.tanh(thickness) - 1,
        ]
    ), max(column(rows, "error_estimate"))


def scaled_lengths(records):
    rows = sorted(records("fig5"), key=lambda row: row["ell_over_H"])  # thickest first
    scale = np.sqrt(column(rows, "beta")) / np.array(column(rows, "ell_over_H"))
    lengths = [np.array(column(rows, name)) * scale for name in ("L_psi", "L_u")]
    return *lengths, max(column(rows, "error_estimate"))


def thick(records):
    L_psi, L_u, error = scaled_lengths(records)
    return max(abs(L_psi[0] - 1), abs(L_u[0] - 1)), error


def parting(records):
    """Smallest step of L_psi up and L_u down towards thinner strips, from where they part by 1e-6."""
    L_psi, L_u, error = scaled_lengths(records)
    apart = L_psi - L_u > PRINTED
    return min(np.diff(L_psi[apart]).min(), -np.diff(L_u[apart]).max()), 2 * error


def same_as_at_transition(records):
    """M at twice delta_fc over M at delta_fc, less 1."""
    rows = [row for row in records("fig6") if row["state"] == "full"]
    return worst([row["micromoment"] / rows[0]["micromoment"] - 1 for row in rows]), SOLVED


def falling_lever(records):
    rows = [row for row in records("fig6") if row["state"] == "full"]
    return np.diff([levers(row) for row in rows]).max(), SOLVED


def text_after_fig6(records):
    """[M - (ell/2)(t_B - t_A)(1 - psi0)]/(ell psi0 t_A), from the multipliers themselves."""
    parameters = strip.Parameters(delta_over_H=0.06, **figures_strip.PAPER_MESH).resolved()
    state = strip.solve_once(parameters).state
    t_A, t_B = (float(state.multipliers[corner][0]) for corner in "AB")
    lever = parameters.ell_over_H / 2 * (1 - parameters.psi0)
    return (float(state.micromoment[0]) - lever * (t_B - t_A)) / (
        parameters.ell_over_H * parameters.psi0 * t_A
    ), 1e-6


def bend_of_u2(records):
    """Slope of u2 over delta in full contact over that in partial contact, and how straight both are."""
    slopes, errors = [], []
    for state in ("partial", "full"):
        delta, u2 = branch(records, "u2_surface", state)
        steps = np.diff(u2) / np.diff(delta)
        slopes.append(steps.mean())
        errors.append(np.ptp(steps) / abs(slopes[-1]))
    return slopes[1] / slopes[0] - 1, max(errors) + SOLVED


ALL = ("delta_fc", "psi_surface", "u1_surface", "u2_surface", "traction", "micromoment")
STATEMENTS = (
    Statement(
        "4.1, Fig. 2",
        "corners B touch at first: g0_B = 0, g0_A = ell psi0, planes ell psi0/2 off the nominal surface",
        "g0_A/(ell psi0) under a plane ell psi0/2 up; error: g0_B",
        initial_gaps,
        printed(1, 0),
        "law of (20)-(22), no solve",
    ),
    Statement(
        "4.1",
        "the problem is one-dimensional",
        "column of 2D elements against the depth alone, relative",
        sideways,
        below(PRINTED),
        "surface values on the same 20 bilinear elements",
    ),
    Statement(
        "4.1",
        "u is odd and psi even in x2",
        "-",
        None,
        None,
        "the half thickness is computed, with u = 0 at the middle: symmetry goes in",
    ),
    Statement(
        "(42)",
        "B is in contact during the entire process",
        "smallest p_B/(p_A + p_B) over Fig. 6",
        share_of_B,
        above(0),
        "corner forces from t_n and M by (29)",
    ),
    Statement(
        "(43), (47)",
        "A is open at first and closes at delta_fc",
        "share of loads of Fig. 6 in the state said",
        states,
        printed(1, 0),
        "delta_fc found by the program, not by (47)",
    ),
    Statement(
        "(44) with (18)",
        "W_kappa = (1/2) ell^2 mu |grad psi|^2 (gamma' = 1) leads to (44)",
        "L_psi at gamma' = 1 over that of (44), (49)",
        layer_of_printed_curvature,
        printed(1, 0.005),
        "(44)-(49) follow from gamma' = 2: a factor sqrt(2) in the layer",
    ),
    Statement(
        "after (44)",
        "beta = 0: three harmonic, decoupled equations",
        "psi(H)/psi(0) - 1 at beta = 1e-4",
        uncoupled,
        below(1e-3),
        "harmonic psi with m = 0 at the middle is constant; of the order of beta (H/ell)^2/2",
    ),
    Statement(
        "(45)",
        "m_2(H) = (ell/2)(1 - psi0) sigma_22(H) in partial contact",
        "largest relative deviation over Fig. 6",
        condition_45,
        below(PRINTED),
        "t_n and M recovered from the computed fields",
    ),
    Statement(
        "(45)",
        "psi(H) = -psi0 from full contact on",
        "largest relative deviation over Fig. 6",
        constant_rotation,
        below(PRINTED),
        "gap of A closed at the nodes",
    ),
    Statement(
        "(46)",
        "closed form of psi, u1, u2",
        "largest relative difference over four thicknesses",
        closed_form(ALL),
        below(1e-8),
        "records of strip_table, rtol 1e-9; gamma' = 2",
    ),
    Statement(
        "(47)",
        "delta_fc in closed form",
        "largest relative difference over four thicknesses",
        closed_form(("delta_fc",)),
        below(1e-8),
        "gamma' = 2; event found by following the contact set",
    ),
    Statement(
        "4.1, Fig. 3",
        "eta = 1 for beta = 1",
        "eta",
        lambda records: (Cosserat(1.0, 0.3, 0.1, beta=1.0).eta, ROUNDING),
        printed(1, 0),
        "beta = 2 eta/(1 + eta)",
    ),
    Statement(
        "4.1, Fig. 3",
        "u2 is linear in x2",
        "distance of u2 from a line, relative",
        curvature_of_u2,
        below(PRINTED),
        "four thicknesses, all nodes",
    ),
    Statement(
        "4.1, Fig. 4",
        "finite elements (20 a half-thickness) agree perfectly with the closed form",
        "largest distance of a marker from the line, over the curve's height, ell/H = 0.2 to 1",
        off_the_line(False),
        below(LINE_WIDTH),
        "perfect to the eye: less than 1 % of the height",
    ),
    Statement(
        "4.1, Fig. 4",
        "finite elements agree perfectly with the closed form in the thickest strip, too",
        "largest distance of a marker from the line, over the curve's height, ell/H = 0.1",
        off_the_line(True),
        below(LINE_WIDTH),
        "two bilinear elements a layer length: figure strip_convergence",
    ),
    Statement(
        "4.1, Figs 3, 4",
        "ell/H = 0.1: psi decays exponentially from the surface",
        "length of decay over ell/sqrt(beta)",
        decay,
        printed(1, 0.02),
        "exponential fitted to the nodes of the upper half",
    ),
    Statement(
        "4.1, Figs 3, 4",
        "ell/H = 0.1: psi vanishes in the bulk",
        "psi(0)/psi(H)",
        left_inside(0.1),
        below(VANISHED),
        "below 2 % counts as vanished",
    ),
    Statement(
        "4.1, Figs 3, 4",
        "ell/H = 0.2: layers take almost the entire thickness; psi vanishes only at the middle",
        "psi(0)/psi(H)",
        left_inside(0.2),
        below(VANISHED),
        "below 2 % at the middle",
    ),
    Statement(
        "4.1, Figs 3, 4",
        "thinner strips: no region of vanishing psi",
        "psi(0)/psi(H), ell/H = 0.5",
        left_inside(0.5),
        above(VANISHED),
        "above 2 % everywhere",
    ),
    Statement(
        "(48)",
        "L_psi = -psi(H)/psi'(H), which (49) says is positive",
        "sqrt(beta)/ell times (48) as printed",
        printed_48,
        above(0),
        "the sign needs the derivative downwards; field over derivative is positive",
    ),
    Statement(
        "4.1, before (49)",
        "L_psi and L_u do not depend on the branch",
        "largest relative change over Fig. 6",
        branch_independence,
        below(PRINTED),
        "loads on either side of delta_fc",
    ),
    Statement(
        "(49), Fig. 5",
        "sqrt(beta) L/ell = coth, tanh of sqrt(beta) H/ell",
        "largest relative deviation, 17 thicknesses",
        formula_49,
        below(1e-7),
        "surface values over fluxes, rtol 1e-9",
    ),
    Statement(
        "4.1, Fig. 5",
        "thick strips: both lengths equal to ell/sqrt(beta)",
        "larger deviation from 1 at sqrt(beta) H/ell = 20",
        thick,
        below(PRINTED),
        "thickest strip of Fig. 5",
    ),
    Statement(
        "4.1, Fig. 5",
        "thinner strips: L_psi increases, L_u decreases",
        "smallest step in these directions",
        parting,
        above(0),
        "all pairs of neighbours in Fig. 5 from where the two part by 1e-6",
    ),
    Statement(
        "4.1, Fig. 6a",
        "M grows linearly for delta < delta_fc",
        "largest deviation of M/delta",
        proportional("micromoment"),
        below(PRINTED),
        "seven loads",
    ),
    Statement(
        "4.1, Fig. 6a",
        "the lever is constant and (ell/2)(1 - psi0), about ell/2, for delta < delta_fc",
        "largest relative deviation of M/t_n from (ell/2)(1 - psi0)",
        condition_45,
        below(PRINTED),
        "this is the condition (45)",
    ),
    Statement(
        "4.1, Fig. 6a",
        "M is constant beyond delta_fc, equal to that at delta_fc",
        "largest relative change of M",
        same_as_at_transition,
        below(PRINTED),
        "nine loads up to 2 delta_fc",
    ),
    Statement(
        "4.1, Fig. 6a",
        "the lever falls beyond delta_fc",
        "largest step of M/(t_n ell/2)",
        falling_lever,
        below(0),
        "nine loads",
    ),
    Statement(
        "4.1, after Fig. 6",
        "full contact: M = (ell/2)(t_B - t_A)(1 - psi0)",
        "M less what is printed, over ell psi0 t_A",
        text_after_fig6,
        printed(0, 0.01),
        "(29) has (1 + psi0) on A; the text is off by ell psi0 t_A, that is by 1 or -1 here",
    ),
    Statement(
        "4.1, Fig. 6b",
        "psi(H) grows linearly in absolute value until -psi0",
        "largest deviation of psi(H)/delta",
        proportional("psi_surface"),
        below(PRINTED),
        "seven loads",
    ),
    Statement(
        "4.1, Fig. 6b",
        "beyond delta_fc psi(H) is constant",
        "largest relative change of psi(H)",
        constant("psi_surface"),
        below(PRINTED),
        "nine loads",
    ),
    Statement(
        "4.1, Fig. 6b",
        "u1(H) is proportional to delta",
        "largest deviation of u1(H)/delta",
        proportional("u1_surface"),
        below(PRINTED),
        "seven loads",
    ),
    Statement(
        "4.1, Fig. 6b",
        "beyond delta_fc u1(H) is constant",
        "largest relative change of u1(H)",
        constant("u1_surface"),
        below(PRINTED),
        "nine loads",
    ),
    Statement(
        "4.1, Fig. 6b",
        "u2(H) is piecewise linear in delta, its slope changes at delta_fc",
        "slope of |u2| beyond over before, less 1; error: how straight",
        bend_of_u2,
        above(0),
        "steeper in full contact",
    ),
    Statement(
        "4.1, end",
        "layers of a thickness related to ell",
        "largest relative deviation of L from (49)",
        formula_49,
        below(1e-7),
        "all thicknesses of Fig. 5",
    ),
)
