"""Statements of section 4.2 on size effects (Figs 10, 11): what decides each, from the records of both
figures.
"""

import math

import numpy as np

from microblock.data.records import column
from microblock.halfplane.contact_line import load_at_inner_edge
from microblock.halfplane.kernels import coalescence_exponent

from .statement import Statement, above, below, printed
from .statements_zones import EDGE, solved

SMALL, LARGE = (0.01, 0.05, 0.1), (0.5, 1.0, 1.25)
CONSTANT = 0.05  # "approximately": within 5 % of each other
EXACT = 1e-5


def curve(records, law, name):
    """(alphas, values, error) of one law in Fig. 11's records, ascending in alpha."""
    rows = _ascending(records, law, "halfplane")
    error = EDGE * max(column(rows, "error_estimate"))
    return np.array(column(rows, "alpha")), np.array(column(rows, name)), error


def _ascending(records, law, model):
    chosen = (row for row in records("fig11") if (row["contact"], row["model"]) == (law, model))
    return sorted(chosen, key=lambda row: row["alpha"])


def nominal(records, law):
    """(alphas, nominal hardness over its limit for alpha -> 0, error) by finite elements, ascending in
    alpha.
    """
    rows = _ascending(records, law, "fe")
    return tuple(
        np.array(column(rows, name)) for name in ("alpha", "hardness_nominal", "hardness_nominal_error")
    )


def nominal_step(law):
    """Smallest step of the nominal hardness between the alphas of LARGE, and from the smallest alpha to
    them.
    """

    def compute(records):
        alphas, values, errors = nominal(records, law)
        chosen = [0, *(i for i, alpha in enumerate(alphas) if alpha in LARGE)]
        return np.diff(values[chosen]).min(), 2 * errors[chosen].max()

    return compute


def nominal_excess(chosen, pick):
    """Nominal hardness of microblock less unilateral, the smallest (or largest, by `pick`) at chosen
    alphas.
    """

    def compute(records):
        alphas, blocks, first = nominal(records, "microblock")
        _, classic, second = nominal(records, "unilateral")
        here = np.isin(alphas, chosen)
        return pick((blocks - classic)[here]), (first + second)[here].max()

    return compute


def nominal_limit(records):
    """Nominal hardness at the largest alpha over that for alpha -> 0, microblock."""
    _, values, errors = nominal(records, "microblock")
    return values[-1], errors[-1]


def alpha_mid(records):
    row = records("fig11")[0]
    return row["alpha_mid"], row["alpha_mid_error"]


def least_step(law, name):
    """Smallest step of a curve towards larger alpha: positive where it only rises."""

    def compute(records):
        _, values, error = curve(records, law, name)
        return np.diff(values).min(), 2 * error

    return compute


def largest_step(law, name):
    """Largest step towards larger alpha: negative where it only falls."""

    def compute(records):
        _, values, error = curve(records, law, name)
        return np.diff(values).max(), 2 * error

    return compute


def spread(law, name, beyond=0.0):
    """Largest over smallest value for alpha > beyond, less 1."""

    def compute(records):
        alphas, values, error = curve(records, law, name)
        chosen = values[alphas > beyond]
        return chosen.max() / chosen.min() - 1, 2 * error

    return compute


def gap_topology(records):
    """Share of the alphas of Fig. 11 with a gap in the middle exactly beyond alpha_mid."""
    alphas, inner, _ = curve(records, "microblock", "inner_half_width")
    return np.mean((inner > 0) == (alphas > alpha_mid(records)[0])), 0.0


def hertz_distance(law):
    """Relative L2 distance of the pressure at alpha = 0.01 from the Hertz ellipse."""

    def compute(records):
        _, _, estimate, record = solved(alpha=0.01, contact=law)
        x, p, weight = (np.array(record["profile"][name]) for name in ("x", "pressure", "weight"))
        ellipse = np.sqrt(np.maximum(1 - x**2, 0))
        return math.sqrt(weight @ (p - ellipse) ** 2 / (weight @ ellipse**2)), estimate

    return compute


def ellipse_shape(records):
    """Relative L2 distance of the unilateral pressure at alpha = 1.25 from the ellipse of the same width
    and load.
    """
    _, _, estimate, record = solved(alpha=1.25, contact="unilateral")
    x, p, weight = (np.array(record["profile"][name]) for name in ("x", "pressure", "weight"))
    ellipse = (
        np.sqrt(np.maximum(1 - (x / record["half_width"]) ** 2, 0))
        * (weight @ p)
        / (np.pi / 2 * record["half_width"])
    )
    return math.sqrt(weight @ (p - ellipse) ** 2 / (weight @ p**2)), estimate


def edges_closed(records):
    """Largest tensile pressure or penetration next to the edges, or the error of the pressure from the edges,
    relative, over both topologies.
    """
    return max(
        max(solved(alpha=alpha)[3]["kkt"], solved(alpha=alpha)[1].error_parts.edges) for alpha in (0.25, 1.25)
    ), 0.0


def at_coalescence(records):
    """Observed exponent s of p_A ~ x^s on the axis, from loads that miss coalescence by b^(2 s)."""
    problem = solved(alpha=0.25)[1].solution.problem
    ell = problem.ell
    loads = [load_at_inner_edge(problem, 10.0**-digits * ell, 1.4 * ell, 14)[0] for digits in (4.0, 4.5, 5.0)]
    observed = math.log10((loads[0] - loads[1]) / (loads[1] - loads[2]))
    return observed, abs(observed - coalescence_exponent(problem.solid))


def real_beyond(records):
    """Real hardness at the largest alpha less that at the first alpha beyond alpha_mid."""
    alphas, real, error = curve(records, "microblock", "hardness_real")
    return real[-1] - real[alphas > alpha_mid(records)[0]][0], 2 * error


def real_step(records):
    """Largest step of the real hardness towards larger alpha, beyond alpha_mid."""
    alphas, real, error = curve(records, "microblock", "hardness_real")
    return np.diff(real[alphas > alpha_mid(records)[0]]).max(), 2 * error


def parting(records):
    """Smallest distance of real from apparent hardness beyond alpha_mid."""
    alphas, real, error = curve(records, "microblock", "hardness_real")
    apart = real - curve(records, "microblock", "hardness_apparent")[1]
    return apart[alphas > alpha_mid(records)[0]].min(), error


def limit_of_hardness(law):
    def compute(records):
        _, values, error = curve(records, law, "hardness_apparent")
        return values[0], error

    return compute


def far_approach(alpha, law):
    """Approach against a point of the surface at the distance a_Hz times any fixed number, up to the same
    constant for all.

    The rigid-body constant of the kernels is such that u -> -(c/pi) log(x/ell) P far away; log(ell/a_Hz)
    makes the far field the same.
    """
    parameters, state, estimate, _ = solved(alpha=alpha, contact=law)
    c = (1 - parameters.nu) / parameters.solid.mu
    d = state.solution.approach - parameters.P * c / math.pi * math.log(alpha)
    return d * parameters.R / parameters.a_Hz**2, estimate


def stiffening(law):
    """Largest step of the approach towards larger alpha at one load: negative where the contact only
    stiffens.
    """

    def compute(records):
        found = [far_approach(alpha, law) for alpha in (*SMALL, *LARGE)]
        return np.diff([d for d, _ in found]).max(), 2 * max(error for _, error in found)

    return compute


def stiffer_blocks(alphas, pick):
    """The largest (or smallest, by `pick`) approach of microblock less unilateral at one of the alphas."""

    def compute(records):
        pairs = [(far_approach(alpha, "microblock"), far_approach(alpha, "unilateral")) for alpha in alphas]
        return pick(one[0] - other[0] for one, other in pairs), max(one[1] + other[1] for one, other in pairs)

    return compute


def enforced_rotation(records):
    """psi of microblocks less unilateral at the surface, x1 = 0.3 a_Hz, alpha = 0.05."""
    row = next(row for row in records("fig12") if (row["panel"], row["x1"], row["x2"]) == ("a", 0.3, 0))
    return row["psi_microblock"] - row["psi_unilateral"], 1e-6  # states to 1e-7


STATEMENTS = (
    Statement(
        "4.2, Fig. 10",
        "contact area numerically exact: g_A = 0 and p_A = 0 at both boundaries a and b",
        "largest tensile pressure, penetration or error of the edges, alpha = 0.25 and 1.25",
        edges_closed,
        below(EXACT),
        "edges by Newton's method, looked at from either side",
    ),
    Statement(
        "4.2, Fig. 10",
        "small alpha: simply connected; large alpha: separation in the middle",
        "share of 18 alphas with a gap exactly beyond alpha_mid",
        gap_topology,
        printed(1, 0),
        "records of Fig. 11",
    ),
    Statement(
        "4.2, Fig. 10",
        "alpha_mid = 0.8874",
        "alpha_mid",
        alpha_mid,
        printed(0.8874, 5e-5),
        "limit of gap and overlap; nodal values on a uniform mesh of the spacing b approach it as slowly as "
        "b^(2 s), where the pressure vanishes like x^s",
    ),
    Statement(
        "4.2, Fig. 10",
        "at coalescence g_A = p_A = 0 on the axis",
        "exponent of p_A ~ x^s there; error: from its closed form",
        at_coalescence,
        above(0),
        "the pressure vanishes, with infinite slope",
    ),
    Statement(
        "4.2, Fig. 10b",
        "unilateral: simply connected",
        "largest half-width of a gap",
        lambda records: (curve(records, "unilateral", "inner_half_width")[1].max(), 0.0),
        printed(0, 0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 10a",
        "significant size effects, microblock",
        "largest over smallest half-width, less 1",
        spread("microblock", "half_width"),
        above(0.1),
        "beyond 10 %",
    ),
    Statement(
        "4.2, Fig. 10b",
        "significant size effects, unilateral",
        "largest over smallest half-width, less 1",
        spread("unilateral", "half_width"),
        above(0.1),
        "beyond 10 %",
    ),
    Statement(
        "4.2, Fig. 10a",
        "alpha -> 0, see 0.01: Hertz, microblock",
        "relative L2 distance from the ellipse",
        hertz_distance("microblock"),
        below(0.02),
        "falls with alpha; below 2 % here",
    ),
    Statement(
        "4.2, Fig. 10b",
        "alpha -> 0, see 0.01: Hertz, unilateral",
        "relative L2 distance from the ellipse",
        hertz_distance("unilateral"),
        below(0.02),
        "falls with alpha; below 2 % here",
    ),
    Statement(
        "4.2, Fig. 10b",
        "unilateral: the pressure resembles the ellipse",
        "relative L2 distance from the ellipse of its width, alpha = 1.25",
        ellipse_shape,
        below(0.05),
        "within 5 %",
    ),
    Statement(
        "4.2, Fig. 10b",
        "unilateral: the maximum pressure increases with alpha",
        "smallest step",
        least_step("unilateral", "pressure_max"),
        above(0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 10b",
        "unilateral: the width decreases with alpha",
        "largest step",
        largest_step("unilateral", "half_width"),
        below(0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 11a",
        "unilateral: the hardness increases with alpha (with decreasing contact)",
        "smallest step",
        least_step("unilateral", "hardness_apparent"),
        above(0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 11a",
        "H/H_Hz -> 1 for alpha -> 0, unilateral",
        "H/H_Hz at alpha = 0.01",
        limit_of_hardness("unilateral"),
        printed(1, 0.005),
        "deviates like alpha",
    ),
    Statement(
        "4.2, Fig. 11a",
        "H/H_Hz -> 1 for alpha -> 0, microblock",
        "H/H_Hz at alpha = 0.01",
        limit_of_hardness("microblock"),
        printed(1, 0.005),
        "deviates like alpha",
    ),
    Statement(
        "4.2, Fig. 10a",
        "microblock: the half-width increases with alpha",
        "smallest step",
        least_step("microblock", "half_width"),
        above(0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 10a",
        "microblock: the maximum pressure is about constant for alpha > 0.5",
        "largest over smallest, less 1",
        spread("microblock", "pressure_max", beyond=0.5),
        below(CONSTANT),
        "within 5 % from the first alpha beyond 0.5 on",
    ),
    Statement(
        "4.2, Fig. 11a",
        "microblock: the apparent hardness decreases monotonically with alpha",
        "largest step",
        largest_step("microblock", "hardness_apparent"),
        below(0),
        "18 alphas",
    ),
    Statement(
        "4.2, Fig. 11a",
        "the real hardness increases with alpha for alpha > alpha_mid",
        "real hardness over Hertz's at alpha = 1.25 less that just beyond alpha_mid",
        real_beyond,
        above(0),
        "the length of the zones, 2 (a - b), goes on growing",
    ),
    Statement(
        "4.2, Fig. 11a",
        "the real hardness is not monotonic, since it increases beyond alpha_mid",
        "largest step of the real hardness over Hertz's, from one alpha to the next, beyond alpha_mid",
        real_step,
        above(0),
        "it falls at each step: with a positive one it would not be monotonic",
    ),
    Statement(
        "4.2, Fig. 11a inset (the text says Fig. 8a)",
        "the real hardness deviates from the apparent one beyond alpha_mid",
        "smallest distance beyond alpha_mid",
        parting,
        above(0),
        "records of Fig. 11",
    ),
    Statement(
        "4.2, Fig. 11b",
        "the nominal hardness of microblocks rises above its classical value",
        "H_nom/H_nom(alpha -> 0) at alpha = 1.25, microblock",
        nominal_limit,
        above(1),
        "finite elements on the square of 18 a_Hz; error: a coarser mesh",
    ),
    Statement(
        "4.2, Fig. 11b",
        "unilateral: the nominal hardness increases with alpha, on the paper's domain",
        "smallest step, alpha = 0.01, 0.5, 1, 1.25",
        nominal_step("unilateral"),
        above(0),
        "finite elements, 18 a_Hz",
    ),
    Statement(
        "4.2, Fig. 11b",
        "microblock: the nominal hardness increases with alpha, on the paper's domain",
        "smallest step, alpha = 0.01, 0.5, 1, 1.25",
        nominal_step("microblock"),
        above(0),
        "finite elements, 18 a_Hz",
    ),
    Statement(
        "4.2, Fig. 11b",
        "on the paper's domain nominal hardness increases more for microblocks",
        "smallest H_nom of microblock less unilateral, alpha >= 0.5, over the classical value",
        nominal_excess(LARGE, np.min),
        above(0),
        "finite elements, 18 a_Hz",
    ),
    Statement(
        "4.2, Fig. 11b",
        "unilateral: nominal hardness and stiffness increase with alpha",
        "largest step of d R/a_Hz^2 at equal far field",
        stiffening("unilateral"),
        below(0),
        "the smaller d the smaller a_nom; far from the contact all alphas are displaced alike",
    ),
    Statement(
        "4.2, Fig. 11b",
        "microblock: nominal hardness and stiffness increase with alpha",
        "largest step of d R/a_Hz^2 at equal far field",
        stiffening("microblock"),
        below(0),
        "the smaller d the smaller a_nom; far from the contact all alphas are displaced alike",
    ),
    Statement(
        "4.2, Fig. 11b",
        "nominal hardness and stiffness increase more for microblocks than for the unilateral law",
        "largest d R/a_Hz^2 of microblock less unilateral, alpha >= 0.5",
        stiffer_blocks(LARGE, max),
        below(0),
        "at each of three alphas",
    ),
    Statement(
        "4.2, Fig. 11b",
        "nominal hardness and stiffness increase more for microblocks, for small alpha, too",
        "smallest d R/a_Hz^2 of microblock less unilateral, alpha <= 0.1",
        stiffer_blocks(SMALL, min),
        below(0),
        "blocks are softer, by little: a flat block lets the parabola come ell^2/(8 R) deeper there",
    ),
    Statement(
        "4.2, Fig. 11b",
        "the unilateral stiffening comes from the energy of rotations and curvatures",
        "-",
        None,
        None,
        "an interpretation: no number here decides it",
    ),
    Statement(
        "4.2, Fig. 11b",
        "full contact enforces a microrotation that M = 0 would relax",
        "psi R/a_Hz, microblock less unilateral",
        enforced_rotation,
        above(0),
        "surface, x1 = 0.3 a_Hz, alpha = 0.05",
    ),
)
