"""The command `contact`: any obstacle on a half-plane, against closed forms and the library's own states."""

import csv
import json
import math
import shlex
from dataclasses import fields

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main, parsed
from cases.commands import contact
from cases.common.options import command
from microblock.data.samples import read_samples
from microblock.model import closed_forms

CLASSICAL = "--contact unilateral --beta 1e-10 --rtol 1e-5"
E_STAR = 100 / (1 - 0.3**2)
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
PARABOLA = [f"{x}, {x**2 / 20}" for x in np.linspace(-1, 1, 17)]


def asked(capsys, words):
    """The object that the command prints."""
    assert main(["contact", *shlex.split(words), "--json", "-"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    return json.loads(printed.out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))


@pytest.mark.parametrize("load", [1.0, 7.0])
def test_a_parabola_is_hertz(load, capsys):
    (state,) = asked(capsys, f"--height x**2/20 {CLASSICAL} --loads {load}")["states"]
    a, p = mb.hertz_scales(SOLID, 10.0, load)
    x, weight, pressure = (np.array(state["profile"][name]) for name in ("x", "weight", "pressure"))
    exact = p * np.sqrt(np.maximum(1 - (x / a) ** 2, 0))
    # rtol, for which the command was asked
    assert np.sqrt(weight @ (pressure - exact) ** 2 / (weight @ exact**2)) < 1e-5 > state["error_estimate"]
    assert state["half_width"] == pytest.approx(a, rel=1e-5)
    assert state["approach"] is None and state["profile"]["pressure_A"] is None


def test_a_wedge_has_its_closed_form(capsys):
    (state,) = asked(capsys, f"--height 0.02*abs(x) {CLASSICAL} --loads 0.5")["states"]
    a = 0.5 / (E_STAR * 0.02)
    assert state["half_width"] == pytest.approx(a, rel=1e-5)  # rtol
    x, pressure = np.array(state["x"]), np.array(state["pressure"])
    exact = closed_forms.wedge(x, 0.5, a)
    # away from its logarithm, which has no bound, and from its edges
    middle = (abs(x) > 0.01 * a) & (abs(x) < 0.99 * a)
    assert pressure[middle] == pytest.approx(exact[middle], rel=1e-3)


def test_states_are_the_librarys(capsys):
    words = "--height x**2/20+0.001*x --loads 0.05 0.3 --psi0-deg 0.05 --E 80 --nu 0.2 --beta 0.5 --ell 0.12"
    answer = asked(capsys, words + " --rtol 1e-4")
    solid = mb.Cosserat(E=80, nu=0.2, beta=0.5, ell=0.12)
    law = mb.Microblock(psi0=math.radians(0.05))
    problem = mb.Contact(mb.HalfPlane(solid), lambda x: x**2 / 20 + 0.001 * x, law)
    first = problem.solve(load=0.05, rtol=1e-4)
    states = [first, problem.solve(load=0.3, rtol=1e-4, initial=first)]
    assert answer["states"] == [state.to_dict() for state in states]
    assert {name: answer["parameters"][name] for name in ("ell", "loads", "rtol")} == {
        "ell": 0.12,
        "loads": [0.05, 0.3],
        "rtol": 1e-4,
    }
    assert set(answer["seconds"]) == {"setup", "solve"} and "microblock" in answer["versions"]
    assert "events" not in answer


def test_events_are_the_librarys(capsys):
    answer = asked(capsys, "--height x**2/20 --loads 0.2 0.1 --path")
    problem = mb.Contact(mb.HalfPlane(SOLID), lambda x: x**2 / 20, mb.Microblock())
    assert answer["events"] == problem.path(load=0.2, rtol=1e-3).to_dict()["events"]
    assert "merged" in [event["kind"] for event in answer["events"]]


@pytest.mark.parametrize(
    "between, header", [(", ", "x, height\n"), (";", ""), ("\t", "x1 (mm)\tz (mm)\n"), ("  ", "\n\n")]
)
def test_samples_of_a_parabola(between, header, tmp_path, capsys):
    file = tmp_path / "samples.csv"
    file.write_text(header + "\n".join(PARABOLA).replace(", ", between), encoding="utf-8-sig")
    x = np.linspace(-1, 1, 17)
    assert read_samples(file) == mb.Obstacle.from_samples(x, x**2 / 20)
    (state,) = asked(capsys, f"--samples {file} --contact unilateral")["states"]
    problem = mb.Contact(mb.HalfPlane(SOLID), mb.Obstacle.from_samples(x, x**2 / 20), mb.Unilateral())
    assert state == problem.solve(load=1.0, rtol=1e-3).to_dict()


def test_a_window_takes_cells(capsys):
    answer = asked(capsys, "--height=-0.1*cos(x) --window -1 1")
    (state,) = answer["states"]
    assert state["method"] == "cells" and answer["parameters"]["rtol"] == 1e-2 > state["error_estimate"]
    assert state["x"][0] > -1 and state["x"][-1] < 1
    # of the curvature 0.1: rtol, and what a cosine is flatter than its parabola there
    assert state["half_width"] == pytest.approx(
        asked(capsys, "--height x**2/20")["states"][0]["half_width"], rel=3e-2
    )


@pytest.mark.parametrize("law", ["microblock", "unilateral", "microclamped"])
def test_a_punch_has_no_infinite_number(law, capsys):
    (state,) = asked(capsys, f'--height "where(abs(x) <= 0.5, 0, inf)" --contact {law}')["states"]
    assert np.dot(state["weights"], state["pressure"]) == pytest.approx(1.0, rel=1e-9)  # rounding


BAD = {
    "": "--height",
    "--height x.real": "'x.real' at place 1",
    "--height 9**9**9": "'9**9' at place 4",
    "--height __import__(os)": "'__import__' at place 1",
    "--height ''": "--height",
    "--height x": "--height x: must be lowest",
    "--height 0": "--height 0: does not rise",
    "--height log(x)": "is nan at x",
    "--height=-cos(x)": "--window L R",
    "--height -cos(x)": "--NAME=VALUE",
    "--height x**2 --samples a.csv": "--samples",
    "--height x**2 --window 1 -1": "--window",
    "--height x**2 --window 1": "--window",
    "--height x**2 --window -1 1 --path": "--path",
    "--height x**2 --loads 0": "--loads 0",
    "--height x**2 --psi0-deg 1 --contact unilateral": "--psi0-deg",
    "--height x**2 --nu 0.5": "--nu",
    "--height x**2 --ell nan": "--ell",
    "--heigth x**2": "did you mean --height?",
    "--samples nowhere.csv": "is no file",
    "--samples .": "is no file",
    "--samples /dev/zero": "is no file",
}


def refused(words, named, capsys, status=2):
    try:
        found = main(["contact", *words])
    except SystemExit as stop:  # argparse's own way out
        found = stop.code
    printed = capsys.readouterr()
    assert found == status and printed.out == ""
    assert printed.err.count("\n") == 1 and named in printed.err, printed.err


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("words", BAD)
def test_bad_arguments_get_one_line(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    refused([*shlex.split(words), "--json", "a.json", "--out", "figures"], BAD[words], capsys)
    assert list(tmp_path.glob("a.json")) == []


@pytest.mark.parametrize("words", ["--rtol 1e-17", "--window -0.01 0.01"])
def test_what_is_out_of_reach_has_status_1(words, capsys):
    refused(["--height", "x**2/20", *words.split()], "1e-17" if "rtol" in words else "widen", capsys, 1)


FILES = {
    b"": "0 samples",
    b"x, height\n": "0 samples",
    b"0, 0\n": "1 samples",
    b"x\n0\n1\n": "'0' in line 2",
    b"0, 0, 0\n1, 1, 1": "'0, 0, 0' in line 1",
    b"0, 0, low\n1, 1, high": "line 1",
    b"0, 0\n\n1, nan\n": "'1, nan' in line 3",
    b"0, 0\n1, inf\n": "line 2",
    b"0, 0\n1, 1e99\n": "line 2",
    b"0, 0\n1, high\n": "line 2",
    b"x, 0\n1, 2\n2, 3": "line 1",
    b"0, 0\n1, \n2, 3": "line 2",
    b"0, 0\n2, 1\n1, 2\n": "ascend in x in line 3",
    b"0, 0\n0, 1\n": "ascend in x in line 2",
    b"0,5; 1,0\n": "line 1",
    b"\x89PNG\r\n\x1a\n": "is no text",
    b"a\x00b\n\x00\x01\n": "line 2",
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("content", FILES)
def test_bad_files_get_one_line(content, tmp_path, capsys):
    file = tmp_path / "samples.csv"
    file.write_bytes(content)
    refused(["--samples", str(file)], FILES[content], capsys)


def test_figure_and_records(tmp_path, capsys):
    words = ["contact", "--height", "(x - 0.2)**2/20", "--loads", "0.02", "1", "--out", str(tmp_path)]
    assert main(words) == 0
    assert "load 1: A [" in capsys.readouterr().out
    figures = {f"contact_{load}.{kind}" for load in ("0.02", "1.0") for kind in ("png", "pdf")}
    assert {path.name for path in tmp_path.iterdir()} == {"contact.csv", *figures}
    with open(tmp_path / "contact.csv") as file:
        rows = list(csv.DictReader(file))
    again = shlex.split(rows[0]["command"])[4:]
    assert again[:6] == ["--height", "(x - 0.2)**2/20", "--loads", "0.02", "1.0", "--E"]
    # each load is carried; the rule's weights are exact to rounding
    for load in ("0.02", "1.0"):
        nodes = [row for row in rows if row["load"] == load]
        carried = sum(float(row["weight"]) * float(row["pressure"]) for row in nodes)
        assert carried == pytest.approx(float(load), rel=1e-9)


@pytest.mark.parametrize("height", ["-cos(x)", "where(x < 0, -x, x**2)", "x**2/20"])
def test_the_command_that_repeats_a_run_is_read_back(height):
    given = contact.Parameters(height=height, window=(-1, 1), loads=(0.1, 1))
    words = shlex.split(command("contact", given))[3:]
    found = parsed("contact", contact, words)
    assert contact.Parameters(**{entry.name: found[entry.name] for entry in fields(given)}) == given
