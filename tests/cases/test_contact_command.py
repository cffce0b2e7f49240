"""The command `contact`: any obstacle on a half-plane, against Hertz and the library's own states."""

import subprocess
import sys

import numpy as np
import pytest

import microblock as mb

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)


def test_states_and_events_are_the_librarys(answer):
    words = "--height x*x/20+0.001*x --loads 0.05 0.3 --psi0-deg 0.05 --E 80 --nu 0.2 --beta 0.5 --ell 0.12"
    found = answer(f"contact {words} --rtol 1e-4 --path")
    problem = mb.Contact(
        mb.HalfPlane(mb.Cosserat(E=80, nu=0.2, beta=0.5, ell=0.12)),
        lambda x: x * x / 20 + 0.001 * x,  # squares of old NumPy are not its powers to the bit
        mb.Microblock(psi0=np.radians(0.05)),
    )
    first = problem.solve(load=0.05, rtol=1e-4)
    assert found["states"][0] == first.to_dict()
    second = problem.solve(load=0.3, rtol=1e-4, initial=first)
    assert found["states"][1] == second.to_dict()
    assert found["events"] == problem.path(load=0.3, rtol=1e-4).to_dict()["events"]


@pytest.mark.parametrize(
    "between, header", [(", ", "x, height\n"), (";", ""), ("\t", "x1 (mm)\tz (mm)\n"), ("  ", "\n\n")]
)
def test_samples(between, header, tmp_path, answer):
    file = tmp_path / "samples.csv"
    file.write_text(header + "-1 0.05\n0 0\n1 0.05".replace(" ", between), encoding="utf-8-sig")
    (state,) = answer(f"contact --samples {file} --contact unilateral")["states"]
    tent = mb.Obstacle.from_samples([-1.0, 0.0, 1.0], [0.05, 0.0, 0.05])
    assert (
        state == mb.Contact(mb.HalfPlane(SOLID), tent, mb.Unilateral()).solve(load=1.0, rtol=1e-3).to_dict()
    )


def test_a_window_takes_cells(answer):
    found = answer("contact --height=-0.1*cos(x) --window -1 1")
    assert found["states"][0]["method"] == "cells"


@pytest.mark.parametrize("law", ["microblock", "unilateral", "microclamped"])
def test_a_punch_has_no_infinite_number(law, answer):
    (state,) = answer(f'contact --height "where(abs(x) <= 0.5, 0, inf)" --contact {law}')["states"]
    assert np.dot(state["weights"], state["pressure"]) == pytest.approx(1.0, rel=1e-9)  # rounding


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("content", [b"", b"0, 0\n1, high\n2, 1", b"\x89PNG\r\n\x1a\n"])
def test_bad_files_get_one_line(content, tmp_path, run):
    """The reader's own refusals stand in tests/library/test_user_data.py."""
    file = tmp_path / "samples.csv"
    file.write_bytes(content)
    status, out, err = run(f"contact --samples {file}")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("python -m cases contact: --samples: ")


def test_figures(tmp_path, run):
    status, out, _ = run(f'contact --height "(x - 0.2)**2/20" --out {tmp_path}')
    figures = {"contact_1.0.png", "contact_1.0.pdf"}
    assert (status, {path.name for path in tmp_path.iterdir()}) == (0, figures) and "contact_length" in out


def test_a_table_has_what_is_asked_for_and_warnings_are_said_once(run, tmp_path):
    """Parameters as they are taken, the whole length of two zones, and what is unbounded in words."""
    words = 'contact --height "where(abs(x) <= 0.5, 0, inf)" --loads 0.1 0.2'
    status, out, err = run(words)
    solid, law, rtol, _, names, *rows = out.splitlines()
    assert status == 0 and repr(SOLID) in solid and repr(mb.Microblock()) in law and rtol == "rtol  0.001"
    assert names.split() == ["load", "contact_length", "zones", "pressure_max", "error_estimate"]
    problem = mb.Contact(mb.HalfPlane(SOLID), mb.Punch(0.5), mb.Microblock())
    length = sum(right - left for left, right in problem.solve(load=0.1).zones["contact"])
    load, shown, zones, largest, _ = rows[0].split()
    assert (load, zones, largest) == ("0.1", "3", "unbounded")
    assert abs(float(shown) / length - 1) < 1e-3  # rtol
    _, _, err = run("contact --height x**2/2 --ell 5 --loads 0.1 0.2 --json -")
    assert len(err.splitlines()) == len({*err.splitlines()}) > 0 and err.startswith("warning: ")


def test_samples_in_python_name_the_first_entry_at_fault():
    x = np.arange(201.0)
    with pytest.raises(mb.BadArgument, match="entry 100 is nan"):
        mb.Obstacle.from_samples(np.where(x == 100, np.nan, x), x)
    with pytest.raises(mb.BadArgument, match="entry 2 is 1 after 1: sort it, average duplicates"):
        mb.Obstacle.from_samples([0, 1, 1], [0, 1, 2])


def test_a_command_that_is_none_is_named_on_the_error_stream():
    for word, said in (("contct", "did you mean contact?"), ("hertz", "python -m cases lists the others")):
        done = subprocess.run([sys.executable, "-m", "microblock", word], capture_output=True, text=True)
        assert done.returncode == 2 and said in done.stderr and not done.stdout
