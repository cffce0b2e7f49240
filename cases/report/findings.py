"""What the report found, for the box at the top of its page: sentences with numbers out of the records of
this run, and the statements of the paper that differ.
"""

import math
from dataclasses import dataclass

from microblock.data.records import column

from ..paper.statement import AGREES, DIFFERS, OPEN

PAPER_ALPHA_MID = 0.8874
SMALL_ALPHAS, INSIDE = 0.02, 0.7  # of the sentence on the layers: alpha, and x1 over a_Hz
SHOWN = 10  # decimals of a value, at most
TOGETHER = 5  # decimals, up to which an error is written as its value is
SMALL = 1e-3  # below it value and error have a power of ten in common


@dataclass(frozen=True)
class Findings:
    """What stands in the box.

    sentences : list of (heading, text, name of the item that shows it)
    counts : {verdict: number of statements}
    statements : rows of the table "the paper and here"; none where it was not made
    """

    sentences: list
    counts: dict
    statements: list

    @property
    def differing(self):
        return [row for row in self.statements if row["verdict"] == DIFFERS]


def found(names, records):
    """The Findings of the items that are there: `names`; records(name) are the rows of one."""
    sentences = [(heading, tell(records(name)), name) for heading, name, tell in SENTENCES if name in names]
    statements = records("paper_and_here") if "paper_and_here" in names else []
    verdicts = column(statements, "verdict")
    counts = {verdict: verdicts.count(verdict) for verdict in (AGREES, DIFFERS, OPEN)}
    return Findings(sentences, counts, statements)


def measured(value, error):
    """A number with its error bar, to the digits that the error leaves: "6.2 ± 0.3", "(1.12 ± 0.05)e-05"."""
    if not error:
        return f"{value:.4g}"
    digit = math.floor(math.log10(error))
    decimals = min(SHOWN, max(0, -digit))
    if error >= abs(value):
        return f"{value:.1e} ± {error:.0e}"
    if abs(value) < SMALL:
        power = math.floor(math.log10(abs(value)))
        return f"({measured(value / 10.0**power, error / 10.0**power)})e{power:03d}"
    return f"{value:.{decimals}f} ± {error:{f'.{decimals}f' if decimals <= TOGETHER else '.0e'}}"


def alpha_mid(rows):
    """From the records of Fig. 11."""
    value, error = rows[0]["alpha_mid"], rows[0]["alpha_mid_error"]
    return (
        f"The contact of microblocks splits in two at alpha_mid = {measured(value, error)} (nu = "
        f"{rows[0]['nu']:g}, beta = {rows[0]['beta']:g}). The paper has {PAPER_ALPHA_MID}, "
        f"{100 * (PAPER_ALPHA_MID / value - 1):.0f} % more: that is the value of its mesh."
    )


def curve(rows, contact, name):
    """[(alpha, value)] of the half-plane, ascending."""
    chosen = [row for row in rows if (row["contact"], row["model"]) == (contact, "halfplane")]
    return sorted(zip(column(chosen, "alpha"), column(chosen, name)))


def real_hardness(rows):
    """From the records of Fig. 11."""
    real = curve(rows, "microblock", "hardness_real")
    beyond = [(alpha, value) for alpha, value in real if alpha > rows[0]["alpha_mid"]]
    falls = all(one > other for (_, one), (_, other) in zip(real, real[1:]))
    (first, high), (last, low) = beyond[0], beyond[-1]
    course = "falls throughout" if falls else "does not only fall"
    return (
        f"Force over the length of the contact zones {course} with alpha: it is {real[0][1]:.3f} of Hertz's "
        f"at alpha = {real[0][0]:g}, {high:.3f} at {first:g} and {low:.3f} at {last:g}. The paper has it "
        "rise beyond alpha_mid."
    )


def size_effect(rows):
    """From the records of Fig. 11."""
    (alpha, blocks), (_, classic) = (
        curve(rows, contact, "hardness_apparent")[-1] for contact in ("microblock", "unilateral")
    )
    return (
        f"Size effects are opposite, as in the paper: at alpha = {alpha:g} the apparent hardness is "
        f"{blocks:.3f} of Hertz's with microblocks, {classic:.3f} without corners."
    )


def layers(rows):
    """From the records of Fig. 13."""
    chosen = [
        abs(row["L_bl_over_ell"] - 1)
        for row in rows
        if row["alpha"] <= SMALL_ALPHAS and row["x1"] <= INSIDE and row["L_bl_over_ell"] is not None
    ]
    return (
        "Under full contact the two laws differ within a layer of the length ell, to "
        f"{100 * max(chosen):.1f} % for alpha up to {SMALL_ALPHAS:g} and x1 up to {INSIDE:g} a_Hz. The "
        "exception that the paper sees for alpha = 0.01 does not appear."
    )


SENTENCES = (
    ("alpha_mid", "fig11", alpha_mid),
    ("Real hardness", "fig11", real_hardness),
    ("Size effects", "fig11", size_effect),
    ("Layers", "fig13", layers),
)
