"""Quantities in the texts of the report: typed as "alpha_mid", "a_Hz^2", set as in print."""

import html
import re

GREEK = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "Delta": "Δ",
    "ell": "ℓ",
    "lambda": "λ",
    "mu": "μ",
    "nu": "ν",
    "psi": "ψ",
    "pi": "π",
    "rho": "ρ",
    "sigma": "σ",
    "kappa": "κ",
}
NUMBERED = ("x", "u", "L")  # letters whose number is an index
NAME = re.compile(r"(?<!\w)([A-Za-z]+)([0-9])?(?:_([A-Za-z]+))?(?!\w)")
POWER = re.compile(r"\^(?:\(([^()]*)\)|(-?\w+))")
# a space within a number or before its per cent sign or unit
UNBROKEN = re.compile(r"(?<=\d) (?=\d{3}\b|%|(?:s|cm|GiB|MiB)\b)")


def symbols(text):
    """HTML of a text in which quantities have names that can be typed: Greek letters, indices, powers."""

    def quantity(found):
        name, number, index = found.groups()
        known = name in GREEK or (name in NUMBERED if number else len(name) == 1 and index)
        if not known:
            return found[0]
        below = ", ".join(filter(None, (number, GREEK.get(index, index))))
        return GREEK.get(name, name) + (f"<sub>{below}</sub>" if below else "")

    marked = NAME.sub(quantity, html.escape(text))
    marked = POWER.sub(lambda found: f"<sup>{found[1] or found[2]}</sup>", marked)
    return UNBROKEN.sub("\u00a0", marked)
