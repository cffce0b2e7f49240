"""The table "the paper and here": verdicts, and rows computed from records."""

import numpy as np
import pytest

from cases.paper import statements_size, statements_strip, statements_zones
from cases.paper.statement import AGREES, DIFFERS, OPEN, Statement, above, below, printed, row
from cases.paper.statements import STATEMENTS
from cases.report import report
from cases.report.report import Records


@pytest.mark.parametrize(
    "decide, value, error, verdict",
    [
        (printed(0.8874, 5e-5), 0.88744, 0.0, True),
        (printed(0.8874, 5e-5), 0.8343, 1e-9, False),
        (printed(0.07, 0.005), 0.09, 0.016, True),
        (above(0), 1.0, 0.5, True),
        (above(0), -1.0, 0.5, False),
        (above(0), 0.3, 0.5, None),
        (above(0), 0.0, 0.0, False),
        (below(0), -1.0, 0.5, True),
        (below(0), 1.0, 0.5, False),
        (below(0), -0.3, 0.5, None),
        (below(0), 0.0, 0.0, False),
    ],
)
def test_verdicts_mind_the_error(decide, value, error, verdict):
    assert decide(value, error) is verdict


def test_what_has_no_number_is_open():
    nothing = Statement("4.2", "a mesh", "-", None, None, "finite elements")
    absent = Statement("4.2", "a zone", "its middle", lambda records: (None, None), above(0), "no zone")
    assert row(nothing, None)["verdict"] == row(absent, None)["verdict"] == OPEN


def test_every_statement_is_complete():
    for one in STATEMENTS:
        assert one.where and one.says and one.here and one.because
        assert (one.compute is None) == (one.verdict is None)
    assert len({(one.where, one.says) for one in STATEMENTS}) == len(STATEMENTS)  # none twice


def test_statements_on_the_strip(tmp_path):
    """From fresh records: what is known to differ does, all the rest agrees."""
    records = Records(tmp_path)
    verdicts = {one.says: row(one, records)["verdict"] for one in statements_strip.STATEMENTS}
    differing = {says for says, verdict in verdicts.items() if verdict == DIFFERS}
    assert len(differing) == 4 and {verdict for verdict in verdicts.values()} == {AGREES, DIFFERS, OPEN}
    for part in ("gamma' = 1", "thickest strip", "-psi(H)/psi'(H)", "(t_B - t_A)(1 - psi0)"):
        assert any(part in says for says in differing)


def test_kink_is_a_square_root_inside_and_a_finite_slope_outside():
    # next terms d^1 beside d^(1/2), d^(3/2) beside d, on steps down to 1e-5
    assert statements_zones.exponent(-1)(None)[0] == pytest.approx(0.5, abs=0.01)
    assert statements_zones.exponent(1)(None)[0] == pytest.approx(1, abs=0.02)


def test_approach_against_the_far_field_tends_to_that_of_hertz():
    """d of the classical contact against a point at the distance L = a: P/(pi E*) [2 log(2 L/a) + 1], R/a^2
    of it.
    """
    hertz = 0.5 * np.log(2) + 0.25
    for law in ("microblock", "unilateral"):
        apart = [abs(statements_size.far_approach(alpha, law)[0] - hertz) for alpha in (0.02, 0.01)]
        assert apart[1] < 1e-4
        assert np.log2(apart[0] / apart[1]) == pytest.approx(2, abs=0.1)  # like alpha^2


def test_records_are_made_once_in_a_run(tmp_path, monkeypatch):
    made = []
    monkeypatch.setitem(report.TABLES, "strip_table", lambda: made.append(1) or [{"a": 0.5}])
    records = Records(tmp_path)
    assert records("strip_table")[0]["a"] == records("strip_table")[0]["a"] == 0.5 and len(made) == 1
    Records(tmp_path)("strip_table")  # what another run left is not taken for this one's
    assert len(made) == 2
