"""The report: figures from records, records that can be repeated."""

import shlex

import pytest

from cases import report
from cases.__main__ import main
from microblock.study import read_records, write_json, write_records


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    assert main(["report", "--out", str(out), "--only", "fig5", "strip_table", "--json", str(out/"r.json")]) == 0
    return out


def test_report_writes_what_it_shows(made):
    page = (made/"index.html").read_text()
    for path in ("figures/fig5.png", "figures/fig5.pdf", "data/fig5.csv", "data/strip_table.csv"):
        assert (made/path).stat().st_size > 0
    assert 'src="figures/fig5.png"' in page and "delta_fc" in page and "http" not in page


def test_rows_carry_parameters_and_versions_and_can_be_repeated(made, tmp_path):
    rows = read_records(made/"data"/"fig5.csv")
    assert all(row["version_ngsolve"] and row["nu"] == 0.3 for row in rows)
    command = shlex.split(rows[3]["command"])
    assert command[:3] == ["python", "-m", "cases"]
    assert main([*command[3:], "--json", str(tmp_path/"again.json")]) == 0
    import json
    again = json.loads((tmp_path/"again.json").read_text())
    assert {name: again[name] for name in ("L_psi", "L_u", "unknowns")} == {name: rows[3][name] for name in ("L_psi", "L_u", "unknowns")}


def test_table_agrees_with_the_closed_form(made):
    for row in read_records(made/"data"/"strip_table.csv"):
        assert row["computed"] == pytest.approx(row["closed_form"], rel=1e-9)


@pytest.mark.slow
def test_every_figure_and_table_can_be_made(tmp_path):
    assert main(["report", "--out", str(tmp_path)]) == 0
    for name in report.PLATES:
        assert (tmp_path/"figures"/f"{name}.png").stat().st_size > 10_000      # an empty frame has less
    judged = read_records(tmp_path/"data"/"paper_and_here.csv")
    assert len(judged) > 100 and all((row["value"] is None) <= (row["verdict"] == "not determined here") for row in judged)
    verdicts = {row["the_paper"]: row["verdict"] for row in judged}
    assert verdicts["alpha_mid = 0.8874"] == verdicts["so the real hardness is not monotonic"] == "differs"
    assert verdicts["L_bl < L_sol"] == "agrees" and "alpha_mid = 0.8874" in (tmp_path/"index.html").read_text()


def test_records_come_back_as_written(tmp_path):
    rows = [{"a": 1, "b": 0.1 + 0.2, "c": None, "d": "x,y"}, {"a": 2, "b": 1e-300, "c": 3, "d": ""}]
    write_records(tmp_path/"r.csv", rows)
    back = read_records(tmp_path/"r.csv")
    assert [row["b"] for row in back] == [0.1 + 0.2, 1e-300] and back[0]["c"] is None and back[0]["d"] == "x,y"


def test_a_failed_write_leaves_the_old_file(tmp_path):
    write_json(tmp_path/"r.json", {"a": 1})
    with pytest.raises(ValueError):
        write_json(tmp_path/"r.json", {"a": float("nan")})
    assert (tmp_path/"r.json").read_text() == '{\n "a": 1\n}\n' and len(list(tmp_path.iterdir())) == 1
