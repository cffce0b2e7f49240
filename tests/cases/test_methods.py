"""The page of advice: its sentences hold on the records beside it, and a sentence that does not hold is not
written.
"""

import math
import re
from pathlib import Path

import pytest

from cases.__main__ import main
from cases.studies import facts, methods
from cases.studies.methods_text import ASKED
from microblock import NotConverged

DATA = Path("cases/data")
READMES = {  # rows of README's table, and the methods of the records
    "`Panels` on a `HalfPlane`": "half-plane",
    "`Cells` on a `HalfPlane`": "cells",
    "`Fitted` elements in a `Block`": "fitted fe",
    "uniform bilinear mesh, augmented Lagrangian": "AL, order 1",
}
ROWS = {
    "speed": [
        {"scene": "a", "method": "m", "error": error, "setup": setup, "solve": 1.0, "kind": "delivered"}
        for error, setup in ((1e-2, 1.0), (1e-3, 4.0), (1e-4, 2.0), (None, None))
    ]
}
COST = facts.Fact("speed", {"scene": "a", "method": ("m", "n")}, facts.cost(1e-3))


def test_cost_is_the_least_of_what_is_good_enough():
    assert COST.value(ROWS) == 3.0  # the finer run was the cheaper one
    assert facts.Fact("speed", {"error": facts.Range(5e-4, 1)}, facts.count).value(ROWS) == 2
    assert facts.Fact("speed", {}, facts.cost(1e-9)).value(ROWS) == math.inf


def test_shares_and_quantiles():
    rows = {
        "limits": [
            {"kind": kind, "error": error}
            for kind, error in (
                ("delivered", 1.0),
                ("delivered", 3.0),
                ("typed error", None),
                ("missed", 2.0),
            )
        ]
    }
    assert facts.Fact("limits", {}, facts.share("delivered", "missed")).value(rows) == 0.75
    assert facts.Fact("limits", {}, facts.quantile("error", 0.5)).value(rows) == 2.0


def test_a_sentence_that_does_not_hold_is_refused():
    true = facts.claim(
        "it takes {twice:g} s", lambda twice, **_: twice < 7, {"twice": lambda one: 2 * one}, one=COST
    )
    assert true.told(ROWS) == "it takes 6 s"
    with pytest.raises(NotConverged, match="do not bear out: it takes"):
        facts.claim("it takes {one:g} s", lambda one: one > 7, one=COST).told(ROWS)
    with pytest.raises(NotConverged, match="no record of speed for the number of runs of scene = b"):
        facts.claim("{one}", lambda one: True, one=facts.Fact("speed", {"scene": "b"}, facts.count)).told(
            ROWS
        )


def test_methods_of_earlier_records_have_the_names_of_today(tmp_path):
    (tmp_path / "a.csv").write_text("method,error\npaper's way,0.1\nhalf-plane,0.2\n")
    assert [row["method"] for row in facts.records(tmp_path / "a.csv")] == ["AL, order 1", "half-plane"]


def test_quantities_of_the_page_are_printed():
    told = methods.printed(
        "alpha within 1e-4 of alpha_mid, 2 - beta < 5e-03, rho 1e8 (lambda + 2 mu)/a_Hz, `x1 = 1e-4`"
    )
    assert told == (
        r"$\alpha$ within $10^{-4}$ of $\alpha_\mathrm{mid}$, $2 - \beta$ < $5 \cdot 10^{-3}$, "
        r"$\rho$ $10^{8}$ $(\lambda + 2\mu)/a_\mathrm{Hz}$, `x1 = 1e-4`"
    )


def test_every_sentence_holds_on_the_records(tmp_path):
    assert main(["methods", "--out", str(tmp_path)]) == 0
    told = methods.numbered()
    assert len({claim.text for *_, claim in told}) == len(told) and all(claim.facts for *_, claim in told)


def cells(page):
    """Rows of the tables of a page, a list of words each."""
    return [[cell.strip() for cell in row.split("|")[1:-1]] for row in re.findall(r"^\|.*\|$", page, re.M)]


def test_times_of_readme_are_those_of_the_records():
    """Each number of its table to the digits that it has; a blank where no run came so far."""
    speed = facts.records(DATA / "speed.csv")
    table = {row[0]: row[1:] for row in cells(Path("README.md").read_text())}
    for name, method in READMES.items():
        rows = [row for row in speed if (row["scene"], row["method"]) == ("microblock-0.25", method)]
        values = [*(facts.cost(error)(rows) for error in (1e-2, 1e-4)), facts.best(rows)]
        for value, told in zip(values, table[name], strict=True):
            number = told.removesuffix(" s") or "inf"
            digits = len(number.partition("e")[0].replace(".", "").lstrip("0"))
            assert f"{value:.{digits}g}" == f"{float(number):.{digits}g}"


def test_numbers_of_readme_and_methods_are_those_of_the_records():
    records = {name: facts.records(DATA / f"{name}.csv") for name in methods.STUDIES}
    readme, advice = (" ".join(Path(page).read_text().split()) for page in ("README.md", "docs/methods.md"))
    asked = [
        row for row in records["speed"] if row["method"] in ASKED and row["rtol"] and row["error"] is not None
    ]
    assert f"In all {len(asked)} benchmark runs with a tolerance" in readme
    assert f"at most {max(row['error'] / row['rtol'] for row in asked):.2g} times the tolerance" in readme

    def runs(scene, method):
        return [row for row in records["speed"] if (row["scene"], row["method"]) == (scene, method)]

    def grown(method):
        largest = max(
            (row for row in records["speed_cost"] if row["method"] == method), key=lambda row: row["unknowns"]
        )
        return largest["seconds"], largest["megabytes"], largest["unknowns"]

    thin = [
        facts.best(runs("microblock-0.01", name))
        for name in ("AL, order 1", "condensed, order 6", "fitted fe")
    ]
    assert f"has an error of {thin[0]:.2g}, the finest condensed mesh of order 6 has {thin[1]:.2g}" in advice
    assert f"reach {thin[2]:.0e}.".replace("e-0", "e-") in advice
    cells, bulk = grown("cells"), grown("condensed, order 1")
    assert f"A million cells take {cells[0]:.0f} s and {cells[1]:.0f} MiB" in advice
    assert f"take {bulk[0]:.0f} s and {bulk[1]:.0f} MiB" in advice and min(cells[2], bulk[2]) > 1e6
    peers = [facts.cost(error)(runs("classical", "tamaas")) for error in (1e-2, 1e-3)]
    assert f"tamaas reaches 1 % in {peers[0]:.2g} s and 0.1 % in {peers[1]:.2g} s" in advice
    ours = [facts.cost(error)(runs("classical", "cells")) for error in (1e-2, 1e-3)]
    assert f"`Cells` take {ours[0]:.2g} s and {ours[1]:.2g} s" in advice
    nodal, squares = (
        facts.cost(2e-2)(runs("classical", name)) for name in ("scikit-fem, order 1", "condensed, order 1")
    )
    assert (
        f"reaches 2 % in {nodal:.2g} s at order 1. Condensed squares of order 1 take {squares:.2g} s"
        in advice
    )


def test_missing_records(capsys):
    assert main(["methods", "--records", "nowhere"]) == 2
    assert "--records nowhere" in capsys.readouterr().err
