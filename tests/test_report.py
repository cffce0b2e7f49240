"""The report: figures from records, records that can be repeated."""

import shlex

import pytest
from matplotlib.figure import Figure

from cases import report
from cases.__main__ import main
from microblock.errors import NotConverged
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


@pytest.fixture
def small(monkeypatch, tmp_path):
    """The report with three figures and a table: a log of what is computed, and what their code depends on."""
    log, near = tmp_path/"log", {"value": 1}

    def note(name):
        with open(log, "a") as notes:
            notes.write(f"{name} ")

    def records(name):
        def compute():
            note(name)
            if near.get("stop") == name:
                raise KeyboardInterrupt
            return [{"x": near["value"], "error_estimate": 0.5, "command": f"python -m cases {name}"}]
        return compute

    def draw(rows):
        """A caption."""
        return Figure(figsize=(1, 1))

    def judge(records):
        """Judged."""
        note("judged")
        return [{"sum": records("one")[0]["x"] + records("two")[0]["x"]}]

    monkeypatch.setattr(report, "PLATES", {name: (records(name), draw) for name in ("one", "two", "three")})
    monkeypatch.setattr(report, "TABLES", {})
    monkeypatch.setattr(report, "JUDGED", {"judged": judge})
    monkeypatch.setattr(report, "KNOWN", ("one", "two", "three", "judged"))
    return log, near


def test_records_are_kept_while_they_hold(small, tmp_path):
    log, near = small

    def again(*only, **options):
        log.write_text("")
        result = report.run(report.Parameters(only=only, **options), tmp_path, quiet=True)
        made = log.read_text().split()
        assert [one["name"] for one in result["items"] if not one["kept"]] == made
        return made

    assert again() == ["one", "two", "three", "judged"] and again() == []
    near["value"] = 2      # taken from around the functions that compute
    assert again("one") == ["one"] and again() == ["two", "three", "judged"]
    (tmp_path/"data"/"two.csv").write_text((tmp_path/"data"/"two.csv").read_text().replace("2", "3"))
    (tmp_path/"data"/"three.json").write_text('{"depends')
    assert again() == ["two", "three"] and again() == []
    (tmp_path/"figures"/"one.png").unlink()
    assert again() == [] and (tmp_path/"figures"/"one.png").exists()
    assert again(anew=True) == ["one", "two", "three", "judged"]


def test_an_interrupted_report_keeps_what_is_done_and_goes_on(small, tmp_path):
    _, near = small
    near["stop"] = "three"
    with pytest.raises(NotConverged, match="stopped after 2 of 4"):
        report.run(report.Parameters(), tmp_path, quiet=True)
    page = (tmp_path/"index.html").read_text()
    assert 'id="two"' in page and 'id="three"' not in page and "2 of 4 items" in page
    assert sorted(path.name for path in (tmp_path/"data").iterdir()) == ["one.csv", "one.json", "two.csv", "two.json"]


def test_the_page_shows_what_holds_with_command_time_estimate_and_records(small, tmp_path):
    _, near = small
    report.run(report.Parameters(only=("one", "two")), tmp_path, quiet=True)
    report.run(report.Parameters(only=("three",)), tmp_path, quiet=True)
    page = (tmp_path/"index.html").read_text()
    assert [f'id="{name}"' in page for name in ("one", "two", "three", "judged")] == [True, True, True, False]
    for told in ("python -m cases report --only two", "python -m cases two", "error estimates up to 5.0e-01", "data/two.csv",
                 "figures/two.pdf", "ngsolve 6", "cores", " s on ", "records kept"):
        assert told in page, told
    near["value"] = 7
    report.run(report.Parameters(only=("three",)), tmp_path, quiet=True)
    assert 'id="two"' not in (tmp_path/"index.html").read_text()      # it no longer holds


@pytest.mark.slow
def test_every_figure_and_table_can_be_made(tmp_path):
    drawn_elsewhere = {name for name in report.PLATES if name.startswith(("limits_", "speed_"))}      # by those studies' quick form
    drawn = [name for name in report.KNOWN if name not in drawn_elsewhere] + ["limits_cycling", "speed_seconds"]
    assert main(["report", "--out", str(tmp_path), "--only", *drawn]) == 0
    for name in {*report.PLATES} & {*drawn}:
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
