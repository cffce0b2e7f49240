"""Quantities in the texts of the report: typed as "alpha_mid", "a_Hz^2", set as in print."""

import html
import re

GREEK = {
    "alpha": "α",
    "beta": "β",
    "gamma": "γ",
    "delta": "δ",
    "eta": "η",
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
NUMBERED = ("x", "u", "L", "g")  # letters whose number is an index
NAME = re.compile(r"(?<!\w)([A-Za-z]+)([0-9])?(?:_([A-Za-z]+|[0-9]+))?(?!\w)")
# signs as they are typed, a difference, a dash between numbers of equations, a minus
SIGNS = (
    (re.compile(r"\+-"), "±"),
    (re.compile(r"->"), "→"),
    (re.compile(r"<="), "≤"),
    (re.compile(r">="), "≥"),
    (re.compile(r"sqrt\((\w+)\)"), r"√\1"),
    (re.compile(r"sqrt\("), "√("),
    (re.compile(r"(?<=\d\))-(?=\(\d)"), "–"),
    (re.compile(r"(?<=[\w|)\]]) - (?=[\w|(\[])"), " − "),
    (re.compile(r"(?<![\w)\]|.-])-(?=[\d(]|\w+\(|psi)"), "−"),
)
# a number, or one with its error in parentheses, times a power of ten
TIMES = re.compile(r"(?<![\w.])(\d[\d.]*|\([^()]* ± [^()]*\))e([+-]?)0*(\d+)(?!\w)")
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
        index = GREEK.get(index, index)
        below = (", " if index and len(index) > 1 else "").join(filter(None, (number, index)))
        return GREEK.get(name, name) + (f"<sub>{below}</sub>" if below else "")

    def power(found):
        factor, sign, exponent = found.groups()
        power = f"10<sup>{'−' * (sign == '-')}{exponent}</sup>"
        return power if factor == "1" else f"{factor}\u202f·\u202f{power}"

    for typed, sign in SIGNS:
        text = typed.sub(sign, text)
    marked = NAME.sub(quantity, TIMES.sub(power, html.escape(text)))
    marked = POWER.sub(lambda found: f"<sup>{found[1] or found[2]}</sup>", marked)
    marked = marked.replace("Δ ", "Δ").replace(" ± ", "\u00a0±\u00a0")
    return UNBROKEN.sub("\u00a0", marked)
