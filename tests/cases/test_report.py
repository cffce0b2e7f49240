"""The report: figures from records, records that can be repeated."""

import os
import shlex
import signal
import threading
import time

import pytest
from conftest import smallest_letters
from matplotlib.figure import Figure

from cases.__main__ import main
from cases.report import report
from microblock import BadArgument, NotConverged
from microblock.data.records import read_records, write_json, write_records


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("report")
    assert (
        main(
            [
                "report",
                "--out",
                str(out),
                "--only",
                "fig5",
                "strip_table",
                "--workers",
                "1",
                "--json",
                str(out / "r.json"),
            ]
        )
        == 0
    )
    return out


def test_items_are_the_same_made_by_one_process_or_by_two(made, tmp_path):
    result = report.run(report.Parameters(only=("strip_table", "fig5"), workers=2), tmp_path, quiet=True)
    assert [one["name"] for one in result["items"]] == ["fig5", "strip_table"] and not any(
        one["kept"] for one in result["items"]
    )
    for name in ("fig5", "strip_table"):
        assert (tmp_path / "data" / f"{name}.csv").read_bytes() == (
            made / "data" / f"{name}.csv"
        ).read_bytes()
    assert (tmp_path / "figures" / "fig5.png").read_bytes() == (made / "figures" / "fig5.png").read_bytes()
    # that of the two is counted
    assert result["processor_seconds"] > sum(one["drawing"] or 0 for one in result["items"]) / 2


def test_report_writes_what_it_shows(made):
    page = (made / "index.html").read_text()
    for path in ("figures/fig5.png", "figures/fig5.pdf", "data/fig5.csv", "data/strip_table.csv"):
        assert (made / path).stat().st_size > 0
    assert 'src="figures/fig5.png"' in page and "δ<sub>fc</sub>" in page
    # nothing is loaded from elsewhere; the paper is linked
    assert "http" not in page.replace('href="https://doi.org/10.1016/j.ijsolstr.2020.07.001"', "")


def test_rows_carry_parameters_and_versions_and_can_be_repeated(made, tmp_path):
    rows = read_records(made / "data" / "fig5.csv")
    assert all(row["version_ngsolve"] and row["nu"] == 0.3 for row in rows)
    command = shlex.split(rows[3]["command"])
    assert command[:3] == ["python", "-m", "cases"]
    assert main([*command[3:], "--json", str(tmp_path / "again.json")]) == 0
    import json

    again = json.loads((tmp_path / "again.json").read_text())
    assert {name: again[name] for name in ("L_psi", "L_u", "unknowns")} == {
        name: rows[3][name] for name in ("L_psi", "L_u", "unknowns")
    }


def test_table_agrees_with_the_closed_form(made):
    for row in read_records(made / "data" / "strip_table.csv"):
        assert row["computed"] == pytest.approx(row["closed_form"], rel=1e-9)


@pytest.fixture
def small(monkeypatch, tmp_path):
    """The report with three figures and a table: a log of what is computed and where, and what their code
    depends on.
    """
    log, near, here = tmp_path / "log", {"value": 1}, os.getpid()

    def note(name):
        with open(log, "a") as notes:
            notes.write(f"{name}{'' if os.getpid() == here else '*'} ")

    def records(name):
        def compute():
            note(name)
            if near.get("stop") == name:
                raise KeyboardInterrupt
            if near.get("fail") == name:
                raise ValueError(f"{name} is\nwrong")
            if (tmp_path / f"{name} waits").exists():
                time.sleep(60)
            return [{"x": near["value"], "error_estimate": 0.5, "command": f"python -m cases {name}"}]

        return compute

    def draw(rows):
        """A caption."""
        return Figure(figsize=(1, 1))

    def derive(records):
        """Derived."""
        note("derived")
        return [{"sum": records("one")[0]["x"] + records("two")[0]["x"]}]

    monkeypatch.setattr(report, "FIGURES", {name: (records(name), draw) for name in ("one", "two", "three")})
    monkeypatch.setattr(report, "TABLES", {})
    monkeypatch.setattr(report, "DERIVED", {"derived": derive})
    monkeypatch.setattr(report, "TIMINGS", {"one"})
    monkeypatch.setattr(report, "KNOWN", ("one", "two", "three", "derived"))
    monkeypatch.setattr(report, "SECTIONS", {"All": ("What there is.", report.KNOWN)})
    return log, near


def test_records_are_kept_while_they_hold(small, tmp_path):
    log, near = small

    def again(*only, **options):
        log.write_text("")
        result = report.run(report.Parameters(only=only, workers=1, **options), tmp_path, quiet=True)
        made = log.read_text().split()
        assert sorted(one["name"] for one in result["items"] if not one["kept"]) == sorted(made)
        return made

    # what may not run beside others comes after them, and before what is derived
    assert again() == ["two", "three", "one", "derived"] and again() == []
    near["value"] = 2  # taken from around the functions that compute
    assert again("one") == ["one"] and again() == ["two", "three", "derived"]
    (tmp_path / "data" / "two.csv").write_text((tmp_path / "data" / "two.csv").read_text().replace("2", "3"))
    (tmp_path / "data" / "three.json").write_text('{"depends')
    assert again() == ["two", "three"] and again() == []
    (tmp_path / "figures" / "one.png").unlink()
    assert again() == [] and (tmp_path / "figures" / "one.png").exists()
    assert again(anew=True) == ["two", "three", "one", "derived"]


def test_two_processes_make_all_but_what_runs_alone(small, tmp_path):
    log, near = small
    result = report.run(report.Parameters(workers=2), tmp_path, quiet=True)
    made = log.read_text().split()
    assert sorted(made[:2]) == ["three*", "two*"] and made[2:] == ["one", "derived"]
    assert [one["name"] for one in result["items"]] == ["one", "two", "three", "derived"]
    near["value"] = 2  # travels with the functions
    report.run(report.Parameters(workers=2), tmp_path, quiet=True)
    assert read_records(tmp_path / "data" / "two.csv")[0]["x"] == 2


@pytest.mark.parametrize("workers", [1, 2])
def test_a_failing_item_is_named_and_the_others_are_made(small, tmp_path, workers):
    log, near = small
    near["fail"] = "two"
    with pytest.raises(
        NotConverged, match=r"^2 of 4 items failed.*two \(ValueError: two is wrong\); derived \(.*needs two"
    ):
        report.run(report.Parameters(workers=workers), tmp_path, quiet=True)
    # the derived table does not try again
    assert [word.strip("*") for word in log.read_text().split()].count("two") == 1
    page = (tmp_path / "index.html").read_text()
    assert (
        'id="three"' in page
        and 'id="one"' in page
        and 'id="two"' not in page
        and "two failed: ValueError: two is wrong" in page
    )


def test_an_interrupted_report_keeps_what_is_done_and_goes_on(small, tmp_path):
    _, near = small
    near["stop"] = "three"
    with pytest.raises(NotConverged, match="stopped after 1 of 4"):
        report.run(report.Parameters(workers=1), tmp_path, quiet=True)
    page = (tmp_path / "index.html").read_text()
    assert 'id="two"' in page and 'id="three"' not in page and "1 of 4 items" in page
    assert sorted(path.name for path in (tmp_path / "data").iterdir()) == ["two.csv", "two.json"]


def test_two_interrupted_processes_stop_and_keep_what_is_done(small, tmp_path):
    (tmp_path / "three waits").touch()

    def interrupt():  # as Ctrl-C does, once the other item is there
        while not (tmp_path / "figures" / "two.pdf").exists():
            time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    start = time.monotonic()
    # it may come before the word that `two` is done
    with pytest.raises(NotConverged, match="stopped after [01] of 4"):
        report.run(report.Parameters(workers=2), tmp_path, quiet=True)
    assert time.monotonic() - start < 50  # it does not wait for the one that sleeps for a minute
    assert 'id="two"' in (tmp_path / "index.html").read_text()
    (tmp_path / "three waits").unlink()
    result = report.run(report.Parameters(workers=1), tmp_path, quiet=True)
    assert {one["name"]: one["kept"] for one in result["items"]} == {
        "one": False,
        "two": True,
        "three": False,
        "derived": False,
    }


def test_the_page_shows_what_holds_with_command_time_estimate_and_records(small, tmp_path):
    _, near = small
    report.run(report.Parameters(only=("one", "two"), workers=1), tmp_path, quiet=True)
    report.run(report.Parameters(only=("three",), workers=1), tmp_path, quiet=True)
    page = (tmp_path / "index.html").read_text()
    assert [f'id="{name}"' in page for name in ("one", "two", "three", "derived")] == [
        True,
        True,
        True,
        False,
    ]
    for text in (
        "python -m cases report --only two",
        "python -m cases two",
        "error estimates up to 5.0e-01",
        "data/two.csv",
        "figures/two.pdf",
        "ngsolve 6",
        "cores",
        " s on ",
        "records kept",
    ):
        assert text in page, text
    near["value"] = 7
    report.run(report.Parameters(only=("three",), workers=1), tmp_path, quiet=True)
    assert 'id="two"' not in (tmp_path / "index.html").read_text()  # it no longer holds


def test_every_item_has_one_place_on_the_page_and_what_is_named_exists():
    placed = [name for _, names in report.SECTIONS.values() for name in names]
    # the statements of the paper stand in the box of findings, pages of cases above it
    assert sorted(placed) == sorted({*report.FIGURES, *report.TABLES})
    assert {*report.KNOWN} == {*placed, *report.DERIVED, *report.PAGES}
    assert {*report.TIMINGS, *report.LONG, *report.LABELS} <= {*report.KNOWN}


@pytest.mark.parametrize("workers", [0, 65])
def test_numbers_of_processes_have_bounds(workers):
    with pytest.raises(BadArgument, match="workers"):
        report.Parameters(workers=workers)


@pytest.mark.site
def test_every_figure_and_table_can_be_made(tmp_path):
    assert main(["report", "--out", str(tmp_path)]) == 0
    for name, (_, drawing) in report.FIGURES.items():
        assert (tmp_path / "figures" / f"{name}.png").stat().st_size > 10_000  # an empty frame has less
        # 7 points at a width of 9 cm
        assert smallest_letters(drawing, read_records(tmp_path / "data" / f"{name}.csv")) >= 7, name
    derived = read_records(tmp_path / "data" / "paper_and_here.csv")
    assert len(derived) > 100 and all(
        (row["value"] is None) <= (row["verdict"] == "not determined here") for row in derived
    )
    verdicts = {row["the_paper"]: row["verdict"] for row in derived}
    hardness = "the real hardness is not monotonic, since it increases beyond alpha_mid"
    assert verdicts["alpha_mid = 0.8874"] == verdicts[hardness] == "differs"
    assert (
        verdicts["L_bl < L_sol"] == "agrees"
        and "α<sub>mid</sub> = 0.8874" in (tmp_path / "index.html").read_text()
    )


def test_records_come_back_as_written(tmp_path):
    rows = [{"a": 1, "b": 0.1 + 0.2, "c": None, "d": "x,y"}, {"a": 2, "b": 1e-300, "c": 3, "d": ""}]
    write_records(tmp_path / "r.csv", rows)
    back = read_records(tmp_path / "r.csv")
    assert (
        [row["b"] for row in back] == [0.1 + 0.2, 1e-300] and back[0]["c"] is None and back[0]["d"] == "x,y"
    )


def test_a_failed_write_leaves_the_old_file(tmp_path):
    write_json(tmp_path / "r.json", {"a": 1})
    with pytest.raises(NotConverged, match="no number in a"):
        write_json(tmp_path / "r.json", {"a": float("nan")})
    assert (tmp_path / "r.json").read_text() == '{\n "a": 1\n}\n' and len(list(tmp_path.iterdir())) == 1
