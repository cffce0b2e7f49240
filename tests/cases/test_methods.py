"""The page of advice: its sentences hold on the records beside it, and a sentence that does not hold is not
written.
"""

import math
from pathlib import Path

import pytest

from cases.__main__ import main
from cases.studies import facts, methods
from cases.studies.methods_text import README
from microblock import NotConverged

DATA = Path("cases/data")
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


def test_page_is_what_the_records_say(tmp_path):
    assert main(["methods", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "methods.md").read_text() == Path("docs/methods.md").read_text()
    told = methods.numbered()
    assert len({claim.text for *_, claim in told}) == len(told) and all(claim.facts for *_, claim in told)


def test_readme_quotes_the_records():
    records = {name: facts.records(DATA / f"{name}.csv") for name in methods.STUDIES}
    readme = " ".join(Path("README.md").read_text().split())
    for claim in README:
        assert claim.told(records) in readme


def test_missing_records(capsys):
    assert main(["methods", "--records", "nowhere"]) == 2
    assert "--records nowhere" in capsys.readouterr().err
