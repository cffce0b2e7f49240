"""`python -m cases sweep`: any case over its parameters."""

import json

from cases.__main__ import main
from microblock.data.records import column, read_records

STRIP = [
    "sweep",
    "strip",
    "--over",
    "ell-over-H",
    "0.1",
    "0.2",
    "--over",
    "psi0_deg",
    "1",
    "50",
    "2",
    "--given",
    "order=4",
    "elements=2",
    "--workers",
    "1",
]


def test_rows_are_the_case_itself_and_a_second_run_uses_them(tmp_path):
    assert main([*STRIP, "--out", str(tmp_path)]) == 0
    rows, kept = read_records(tmp_path / "sweep_strip.csv"), (tmp_path / "sweep_strip.jsonl").read_text()
    points = [(row["ell_over_H"], row["psi0_deg"]) for row in rows]
    assert points == [(a, b) for a in (0.1, 0.2) for b in (1, 50, 2)]
    words = ["strip", "--ell-over-H", "0.2", "--psi0-deg", "2", "--order", "4", "--elements", "2", "--json"]
    assert main([*words, str(tmp_path / "one.json")]) == 0
    one = json.loads((tmp_path / "one.json").read_text())
    assert [rows[5][name] for name in ("state", "micromoment", "L_psi", "unknowns")] == [
        one[name] for name in ("state", "micromoment", "L_psi", "unknowns")
    ]
    assert rows[1]["error"].startswith("BadArgument: psi0_deg = 50") and rows[1]["micromoment"] is None
    # the row says how it is repeated
    assert main(rows[0]["command"].split()[3:] + ["--out", str(tmp_path)]) == 0
    assert (tmp_path / "sweep_strip.jsonl").read_text() == kept
    assert column(read_records(tmp_path / "sweep_strip.csv"), "seconds") == column(rows, "seconds")
    assert (tmp_path / "sweep_strip.png").stat().st_size > 10_000  # an empty frame has less


def test_no_result_at_all_is_a_failure(capsys):
    assert main(["sweep", "strip", "--over", "nu", "0.5", "0.6", "--workers", "1", "--json", "-"]) == 1
    assert "nu = 0.5" in capsys.readouterr().err
