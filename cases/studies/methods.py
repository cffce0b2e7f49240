"""Advice: which method for which problem at which accuracy, and where each breaks.

Geometry   that of the studies `speed` and `limits`.
Equations  none: sentences with numbers out of records.
Model      each sentence names the records that it rests on, and must hold on them, or nothing is written.
Reference  that of the two studies.
Look at    methods.md, and methods.csv: a row for each number, with its study, its selection, and how many
           runs that is.
Units      seconds are processor seconds; errors relative.
"""

import re
import time
from dataclasses import dataclass
from pathlib import Path

from microblock.data.records import write_records, write_text
from microblock.errors import BadArgument

from ..common.catalog import DATA
from ..common.options import Checked, option
from ..common.records import returned
from . import facts as numbers
from .methods_text import HEAD, SECTIONS

# quantities of the sentences, and their LaTeX, the longest first; numbers with a power of ten
PRINTED = {
    "(lambda + 2 mu)/a_Hz": r"(\lambda + 2\mu)/a_\mathrm{Hz}",
    "(lambda + 2 mu)/H": r"(\lambda + 2\mu)/H",
    "1/2 - nu": r"1/2 - \nu",
    "2 - beta": r"2 - \beta",
    "alpha_mid": r"\alpha_\mathrm{mid}",
    "a_Hz": r"a_\mathrm{Hz}",
    "x1": "x_1",
    **{letter: rf"\{letter}" for letter in ("alpha", "beta", "ell", "nu", "psi", "rho")},
}
QUANTITY = re.compile(rf"(?<!\w)(?:{'|'.join(map(re.escape, PRINTED))})(?!\w)")
POWER = re.compile(r"(?<![\w.])(\d[\d.]*)e([+-]?)0*(\d+)(?!\w)")
PERCENT, SPACED = re.compile(r"(?<=\d) ?%"), "\N{NO-BREAK SPACE}%"
STUDIES = ("speed", "speed_cost", "limits")


@dataclass(frozen=True)
class Parameters(Checked):
    records: str = option(
        str(DATA), "folder of speed.csv, speed_cost.csv and limits.csv, as the two studies write them", str
    )

    def relate(self):
        for name in STUDIES:
            if not (Path(self.records) / f"{name}.csv").is_file():
                raise BadArgument("records", self.records, f"must be a folder with {name}.csv")


def numbered():
    """[(number, heading, claim)] of the page."""
    claims = [(heading, claim) for heading, claims in SECTIONS for claim in claims]
    return [(number, heading, claim) for number, (heading, claim) in enumerate(claims, 1)]


def facts(records):
    """A row for each number that a sentence rests on."""
    return [
        {
            "sentence": number,
            "name": name,
            "study": fact.study,
            "selection": fact.told,
            "runs": len(fact.rows(records)),
            "value": fact.value(records),
        }
        for number, _, claim in numbered()
        for name, fact in claim.facts.items()
    ]


def printed(sentence):
    """A sentence with its quantities in LaTeX; code stays as it is."""

    def power(found):
        factor, sign, exponent = found.groups()
        times = "" if factor == "1" else rf"{factor} \cdot "
        return f"${times}10^{{{sign.strip('+')}{exponent}}}$"

    parts = sentence.split("`")
    parts[::2] = [
        QUANTITY.sub(lambda found: f"${PRINTED[found[0]]}$", POWER.sub(power, PERCENT.sub(SPACED, part)))
        for part in parts[::2]
    ]
    return "`".join(parts)


def kept(folder=DATA):
    """{study: its records} of a folder."""
    return {name: numbers.records(Path(folder) / f"{name}.csv") for name in STUDIES}


def page(records):
    """The text of the page."""
    lines, last = [HEAD], None
    for number, heading, claim in numbered():
        if heading != last:
            lines += ["", f"## {heading}", ""]
            last = heading
        lines.append(f"- {printed(claim.told(records))} [{number}]")
    lines += [
        "",
        "## What each sentence rests on",
        "",
        "| sentence | study | number | runs | value |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['sentence']} | {row['study']} | {row['selection']} | {row['runs']} | {row['value']:.3g} |"
        for row in facts(records)
    ]
    return "\n".join(lines) + "\n"


def run(parameters, out=None, quiet=False):
    """Check each sentence on the records; print the page, or write it into the folder `out`."""
    start = time.perf_counter()
    records = kept(parameters.records)
    text, rows = page(records), facts(records)
    if out:
        write_records(out / "methods.csv", rows)
        write_text(out / "methods.md", text)
    elif not quiet:
        print(text)
    return returned(parameters, start, text=text, facts=rows)
