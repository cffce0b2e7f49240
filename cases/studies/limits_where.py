"""What fails where: a row a map of the study `limits` in which runs fail, from its records.

A run fails that gives no answer, exceeds its promise, or, where nothing is promised, is off by more than
TOO_FAR. Where they fail is said by the one condition on a parameter that tells failed runs from the others
best (least entropy of the two parts), and by a second one on the rest.
"""

import math
from collections import Counter

from microblock.data.records import grouped

from .limits import MAPS

TOO_FAR = 0.1  # relative error of an answer that is of no use
FEW = 8  # values of a parameter that are told apart one by one; more of them by a bound
REST = 0.1  # share of failures among the rest from which a second condition is looked for
LEAST = 3  # failures, for a second condition
# map: what is asked, and what to do about it
ADVICE = {
    "line_wedge": (
        "panels under wedges",
        "the same runs answer on an idle machine, in 15 s with their reference",
    ),
    "line_coalescence": (
        "panels next to the load at which two zones touch",
        "ask for 1e-4, or for the load itself: problem.solver.coalescence()",
    ),
    "line_touching": (
        "panels next to the load at which the second corner touches",
        "ask for no less than 1e-5",
    ),
    "states_random": (
        "contact states by a plain active set",
        "block pivoting or the path, as the solvers do",
    ),
    "cells_asked": (
        "cells under a cylinder",
        "the panels that verify raised it, in version 0.1; those of today answer",
    ),
    "layer_fit": (
        "the length of the layer by the fit (51)",
        "read the length of the micropolar mode instead, or take smaller blocks",
    ),
    "locking_beta_large": (
        "squares of one order, towards couple stresses",
        "fitted elements, or the contact line",
    ),
    "locking_beta_small": ("squares of one order, incompressible", "order 4, fitted elements, or panels"),
    "thin_layer_fluxes": (
        "fluxes of a layer thinner than an element",
        "elements of a third of ell at order 2; warnings say so",
    ),
    "shape_ground": ("a user's mesh with tall elements", "flat or square elements at the contact"),
    "oscillation_rule": ("Gauss's rule for the contact term", "the nodal rule, which is the default"),
    "turned": ("bilinear squares, rotated blocks, thin layers", "fitted elements"),
    "fitted_beta_large": ("fitted elements next to nu = 1/2", "its error is 1.07 times the promised one"),
    "penalty_strip": ("the penalty in the strip", "a larger rho, or the augmented Lagrangian"),
    "penalty_squares": ("the penalty under a cylinder", "the augmented Lagrangian, which needs no rho"),
    "supports": ("bodies with too few supports", "fix what the error names"),
    "friction_cylinder": (
        "friction under a cylinder, where it is large",
        "a smaller friction, or coupled=False",
    ),
    "friction_square": (
        "friction on all of a square's side, where it is large",
        "a smaller friction, or coupled=False",
    ),
}
WORDS = {
    "typed error": "raised an error",
    "missed": "beyond their promise",
    "time limit": "stopped after 60 s",
}


def fails(row):
    """Whether a run is of no use."""
    if row["kind"] not in ("delivered", "other method"):
        return True
    return row["promise"] is None and row["error"] is not None and row["error"] > TOO_FAR


def table(records):
    """Methods fail where zones meet, layers are thinner than elements, or moduli reach their ends; each has a
    way out.

    Runs are those of the study of limits, a fifth of them next to a degenerate end of a parameter. A run
    fails that raises an error, exceeds its promised error, or is off by more than 10 % where nothing is
    promised. Where they fail is the one condition on a parameter that tells them from the others best, and a
    second one where it leaves some. All other maps of the study have no failure.
    """
    found = []
    for name, rows in grouped(records, "map").items():
        bad = [row for row in rows if fails(row)]
        if bad:
            what, advice = ADVICE.get(name, (MAPS[name].question, ""))
            useless = f"{MAPS[name].error} above {TOO_FAR:.0%}"
            how = Counter(WORDS.get(row["kind"], useless) for row in bad)
            found.append(
                {
                    "what": what,
                    "runs": len(rows),
                    "failed": len(bad),
                    "how": ", ".join(f"{words}: {count}" for words, count in how.most_common()),
                    "where": where(MAPS[name], rows),
                    "instead": advice,
                }
            )
    return found


def where(drawn, rows):
    """The conditions under which runs of a map fail, in words."""
    words, inside, outside = best_condition(drawn, rows)
    found = f"{words}: {_counted(inside)}"
    left = sum(map(fails, outside))
    if left >= LEAST and left > REST * len(outside):
        second, also, last = best_condition(drawn, outside)
        return f"{found}; else {second}: {_counted(also)}; rest {_counted(last)}"
    return f"{found}; rest {_counted(outside)}"


def _counted(rows):
    return f"{sum(map(fails, rows))} of {len(rows)}"


def best_condition(drawn, rows):
    """(words, rows that meet it, the others) of the condition on one parameter with the least entropy of
    failures in its two parts; more of those that meet it fail.
    """
    found = []
    for words, other, meets in _conditions(drawn, rows):
        parts = [row for row in rows if meets(row)], [row for row in rows if not meets(row)]
        shares = [sum(map(fails, part)) / len(part) for part in parts]
        if shares[0] < shares[1]:
            words, parts = other, parts[::-1]
        found.append((sum(map(_entropy, parts)), words, parts))
    _, words, (inside, outside) = min(found, key=lambda one: one[0])
    return words, inside, outside


def _entropy(rows):
    share = sum(map(fails, rows)) / len(rows)
    return -len(rows) * sum(part * math.log(part) for part in (share, 1 - share) if part)


def _conditions(drawn, rows):
    """(words, words of the opposite, whether a row meets it) of all bounds and values of all parameters."""
    axes = {axis.name: axis for axis in drawn.axes if axis.name != "seed"}
    for name in dict.fromkeys((*axes, *filter(None, drawn.panels[:1]))):
        values = sorted({row[name] for row in rows}, key=lambda value: (str(type(value)), value))
        if len(values) < 2:
            continue
        if len(values) <= FEW:
            for value in values:
                others = [other for other in values if other != value]
                rest = f"= {others[0]}" if len(others) == 1 else f"other than {value}"
                yield f"{name} = {value}", f"{name} {rest}", lambda row: row[name] == value
            continue
        axis = axes[name]
        shown, signs = axis.label or name, "><" if axis.scale == "gap" else "<>"
        for low, high in zip(values, values[1:]):
            bound = math.sqrt(low * high) if axis.scale == "log" and low > 0 else (low + high) / 2
            yield (
                f"{shown} {signs[0]} {axis.place(bound):.2g}",
                f"{shown} {signs[1]} {axis.place(bound):.2g}",
                lambda row: row[name] < bound,
            )
