"""The page of columns and keys names what tables and JSON objects have, and nothing else."""

import re
from dataclasses import asdict
from pathlib import Path

import pytest

import microblock as mb
from cases.__main__ import main
from microblock.data.records import read_records

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "columns.md").read_text()
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PROBLEM = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock())


def told(heading):
    """Names in the first column of the table under a heading."""
    section = PAGE.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    first = re.findall(r"^\| (`.*?) \|", section, re.M)
    return {name for cell in first for name in re.findall(r"`(.+?)`", cell)}


def written(what, folder):
    mb.to_csv(what, folder / "table.csv")
    return {name for name in read_records(folder / "table.csv")[0] if not name.startswith("version_")}


def test_columns_of_states(tmp_path):
    plane = written(PROBLEM.solve(load=1.0, rtol=1e-2), tmp_path)
    assert plane == told("States in the plane")
    point = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=32))
    surface = written(point.solve(load=1.0), tmp_path)
    common = plane - {"pressure_A", "pressure_B", "micromoment", "psi"}
    assert surface == told("States on a half-space") | common


def test_columns_of_histories_and_events(tmp_path):
    history = PROBLEM.with_(law=mb.Microblock(friction=0.3)).history([(1.0, 0.1)], rtol=0.1)
    assert written(history, tmp_path) == told("States in the plane") | told("Histories with friction")
    assert set(asdict(history.events[0])) == told("Events")
    path = PROBLEM.path(load=0.05, rtol=1e-2)
    assert written(path, tmp_path) == told("Events") | {"warnings"}


@pytest.mark.parametrize(
    "words", ["strip --elements 4 --order 2", "hertz", "size_effect --alphas 0.5", "lattice --blocks-per-a 2"]
)
def test_keys_of_json(words, capsys):
    assert main([*words.split(), "--json", "-"]) == 0
    keys = set(re.findall(r"\"([\w']+)\":", capsys.readouterr().out))  # at any depth
    rows = re.findall(rf"^\| {words.split()[0]} \| (.*?) \| (.*?) \|$", PAGE, re.M)
    for names, meaning in rows:
        assert set(re.findall(r"([\w']+)`", names + meaning * meaning.startswith("list of"))) <= keys
    assert len(rows) > 1
