"""Statements of section 4.2 on the subsurface layers (Figs 12, 13): what decides each, from the records of
both figures.
"""

import numpy as np

from microblock.data.records import column, grouped

from .statement import Statement, above, below, no_verdict, printed

STATE = 1e-6  # error of psi R/a_Hz: states to 1e-7, as much again from the path of integration
CLOSE = 0.1  # "close to unity"
BELOW_FULL = 0.5  # positions that lie under full contact for every alpha shown
WEAK = 2.0  # a factor by which something that depends weakly on alpha does not change over a decade
FAR = 1.0  # depth over a_Hz at which nothing is left of the layers: exp(-10)


def lines(records, panel):
    """{(alpha, x1): (x2, psi of microblock, psi of unilateral)} of a panel of Fig. 12."""
    found = {}
    for alpha, rows in grouped([row for row in records("fig12") if row["panel"] == panel], "alpha").items():
        for x1, nodes in grouped(rows, "x1").items():
            found[alpha, x1] = [
                np.array(column(nodes, name)) for name in ("x2", "psi_microblock", "psi_unilateral")
            ]
    return found


def slope_at_surface(x2, psi):
    """Derivative along x2 at the surface, one-sided of second order on the first three depths."""
    return np.polyfit(x2[:3], psi[:3], 2)[1]


def surface_slopes(law):
    """|psi,2| at the surface over psi/ell, largest (unilateral) or smallest (microblock) of Fig. 12a."""

    def compute(records):
        found = [
            abs(slope_at_surface(x2, (blocks, classic)[law == "unilateral"])) * alpha / abs(blocks[0])
            for (alpha, _), (x2, blocks, classic) in lines(records, "a").items()
        ]
        # second order on steps of ell/20
        return (max(found) if law == "unilateral" else min(found)), 1e-3

    return compute


def difference_below(records):
    """Largest |Delta psi| at half a_Hz over that at the surface, Fig. 12a."""
    found = []
    for x2, blocks, classic in lines(records, "a").values():
        deep = np.argmin(np.abs(x2 + 0.5))
        found.append(abs((blocks - classic)[deep] / (blocks - classic)[0]))
    return max(found), STATE / 0.005  # the least difference at the surface is 0.005


def residuals(records):
    """Largest relative residual of the fit (51) over all lines of Fig. 13."""
    fits = [row for row in records("fig13") if row["kind"] == "layer"]
    return max(column(fits, "fit_residual")), 0.0


def along_the_interface(records):
    """Largest over smallest L_sol along x1, alpha = 0.1, where it is determined; less 1."""
    rows = [row["L_sol"] for row in records("fig13") if row["alpha"] == 0.1 and row["L_sol"] is not None]
    return max(rows) / min(rows) - 1, 0.2  # 10 % of either, beyond which a length counts as not determined


def solution_length_over_alpha(records):
    """Largest ratio of two L_sol at one position where two alphas have one; none otherwise."""
    ratios = []
    for rows in grouped([row for row in records("fig13") if row["L_sol"] is not None], "x1").values():
        lengths = column(rows, "L_sol")
        ratios += [max(lengths) / min(lengths)] if len(lengths) > 1 else []
    return (max(ratios), 0.2 * max(ratios)) if ratios else (None, None)


def deep_difference(records):
    """Delta psi at the depth a_Hz, x1 = 0.3 a_Hz: alpha = 0.1 over alpha = 0.05."""
    values = {}
    for (alpha, x1), (x2, blocks, classic) in lines(records, "b").items():
        if x1 == 0.3:
            values[alpha] = np.interp(FAR, -x2, blocks - classic)
    ratio = values[0.1] / values[0.05]
    return ratio, abs(ratio) * STATE * (1 / abs(values[0.1]) + 1 / abs(values[0.05]))


def order_of_lengths(records):
    """Smallest L_sol/L_bl where both are determined."""
    rows = [row for row in records("fig13") if row["L_sol"] is not None]
    ratios = [row["L_sol"] / (row["L_bl_over_ell"] * row["alpha"]) for row in rows]
    least = int(np.argmin(ratios))
    return ratios[least], ratios[least] * 0.1  # beyond 10 % a length counts as not determined


def largest_deviation(choose):
    """Largest |L_bl/ell - 1| of chosen lines on which it is determined."""

    def compute(records):
        rows = [row for row in records("fig13") if choose(row) and row["L_bl_over_ell"] is not None]
        worst = max(rows, key=lambda row: abs(row["L_bl_over_ell"] - 1))
        return abs(worst["L_bl_over_ell"] - 1), worst["L_bl_error"]

    return compute


def mode_length(records):
    """Largest |mode length/ell - 1| under full contact."""
    return max(
        abs(row["mode_length_over_ell"] - 1)
        for row in records("fig13")
        if row["kind"] == "layer" and row["x1"] <= BELOW_FULL
    ), STATE


def thick_strip(records):
    """L_bl/ell under full contact, smallest alpha, less sqrt(beta) L_psi/ell of the thickest strip of Fig.
    5.
    """
    strip = min(records("fig5"), key=lambda row: row["ell_over_H"])
    line = next(row for row in records("fig13") if row["alpha"] == 0.01 and row["x1"] == 0.3)
    scaled = strip["L_psi"] / strip["ell_over_H"] * np.sqrt(strip["beta"])
    return line["L_bl_over_ell"] - scaled, line["L_bl_error"]


def by_finite_elements(records):
    """Unknowns of finite elements that give the layers of alpha = 0.01 under two positions, over the paper's
    three million.
    """
    rows = [row for row in records("layers_fe") if row["alpha"] == 0.01]
    agreed = all(abs(row["L_bl_apart"]) <= row["L_bl_error"] for row in rows)
    return (max(column(rows, "unknowns_share")), 0.0) if agreed else (None, None)


STATEMENTS = (
    Statement(
        "4.2, Fig. 12a",
        "unilateral: the normal derivative of psi vanishes at the surface",
        "largest |psi,2| ell/psi, alpha = 0.05",
        surface_slopes("unilateral"),
        below(0.01),
        "M = 0; derivative from the first three depths",
    ),
    Statement(
        "4.2, Fig. 12a",
        "microblock: the normal derivative of psi does not vanish at the surface",
        "smallest |psi,2| ell/psi, alpha = 0.05",
        surface_slopes("microblock"),
        above(0.01),
        "M is not 0; derivative from the first three depths",
    ),
    Statement(
        "4.2, Fig. 12a",
        "the difference of psi between the laws shows next to the surface and vanishes far from it",
        "|Delta psi| at half a_Hz over that at the surface, largest",
        difference_below,
        below(0.01),
        "four positions, alpha = 0.05",
    ),
    Statement(
        "4.2, Fig. 12b, (51)",
        "Delta psi is very well approximated by two exponentials",
        "largest relative L2 residual of the fit",
        residuals,
        below(0.01),
        "all lines of Fig. 13, surface to 2 a_Hz",
    ),
    Statement(
        "4.2, (51)",
        "A_sol and L_sol depend on x1",
        "largest over smallest L_sol along x1, alpha = 0.1, less 1",
        along_the_interface,
        above(0),
        "positions at which the fit determines it",
    ),
    Statement(
        "4.2, (51)",
        "L_sol depends weakly on alpha",
        "largest ratio of L_sol at one position",
        solution_length_over_alpha,
        below(WEAK),
        "no position has it for two alphas: it moves by more than 10 % with the depths used",
    ),
    Statement(
        "4.2, (51)",
        "A_sol depends weakly on alpha",
        "Delta psi at the depth a_Hz, x1 = 0.3 a_Hz, alpha = 0.1 over 0.05",
        deep_difference,
        lambda value, error: bool(abs(np.log(abs(value))) <= np.log(WEAK) + error / abs(value)),
        "what is left below the layers, without a fit; weakly would be within a factor of 2",
    ),
    Statement(
        "4.2, (51)",
        "L_bl < L_sol",
        "smallest L_sol/L_bl",
        order_of_lengths,
        above(1),
        "lines on which both are determined",
    ),
    Statement(
        "4.2, after (51)",
        "three million unknowns, elements of ell/8 for alpha = 0.01",
        "unknowns of fitted elements over three million, alpha = 0.01, x1 = 0.3 and 0.6 a_Hz",
        by_finite_elements,
        no_verdict,
        "its mesh; here L_bl is within its error of the half-plane's, or there would be no number",
    ),
    Statement(
        "4.2, Fig. 13",
        "L_bl/ell is close to 1, below full contact",
        f"largest |L_bl/ell - 1|, x1 <= {BELOW_FULL:g} a_Hz",
        largest_deviation(lambda row: row["x1"] <= BELOW_FULL),
        below(CLOSE),
        "within 10 %; all four alphas",
    ),
    Statement(
        "4.2, Fig. 13",
        "L_bl/ell is close to 1 for alpha > 0.01 at all positions",
        "largest |L_bl/ell - 1|, alpha > 0.01",
        largest_deviation(lambda row: row["alpha"] > 0.01),
        below(CLOSE),
        "close is within 10 %; alpha = 0.1 and 0.05 are not, next to the end of full contact",
    ),
    Statement(
        "4.2, Fig. 13",
        "L_bl/ell is not close to 1 for alpha = 0.01 beyond x1 = 0.7 a_Hz",
        "largest |L_bl/ell - 1|, alpha = 0.01, x1 > 0.7 a_Hz",
        largest_deviation(lambda row: row["alpha"] == 0.01 and row["x1"] > 0.7),
        above(CLOSE),
        "an exception would be beyond 10 %",
    ),
    Statement(
        "4.2, Fig. 13, (49)",
        "thick strip, beta = 1: L_bl is about L_psi",
        "L_bl/ell less sqrt(beta) L_psi/ell of Fig. 5, alpha = 0.01, x1 = 0.3 a_Hz",
        thick_strip,
        printed(0, 0.01),
        "thickest strip computed",
    ),
    Statement(
        "4.2, Fig. 13",
        "the difference of psi between the laws is the boundary layer of the strip",
        f"largest |length of the micropolar mode/ell - 1|, x1 <= {BELOW_FULL:g} a_Hz",
        mode_length,
        below(CLOSE),
        "separated exactly, without a fit",
    ),
)
