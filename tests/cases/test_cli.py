"""The command line of cases: their shape, and the contract with other programs."""

import ast
import json
import os
import re
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest

from cases.__main__ import cases
from microblock.command import flag, options, parser, summary

ROOT = Path(__file__).parents[2]
SCRIPTS = [path for path in ROOT.glob("cases/**/*.py") if path.parent.name in ("cases", "paper")]
SCRIPTS = [path for path in SCRIPTS if "\ndef solve(" in path.read_text() and path.stem != "report"]
FIELDS = "Geometry", "Equations", "Method", "Reference", "Units"
LIBRARIES = {
    "cases",
    "matplotlib",
    "microblock",
    "netgen",
    "ngsolve",
    "numpy",
    "scipy",
    *sys.stdlib_module_names,
}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_has_its_header_its_figure_and_its_test(path):
    paper = "paper." * (path.parent.name == "paper")
    module = import_module(f"cases.{paper}{path.stem}")
    assert all(re.search(rf"^:{field}: ", module.__doc__, re.M) for field in FIELDS)
    assert callable(module.solve) and callable(module.figure)
    tests = "\n".join(file.read_text() for file in ROOT.glob("tests/**/*.py"))
    # figures of the paper are drawn by the test of the report
    assert paper or re.search(rf"\bcases\b(.*| import \([^)]*)\b{path.stem}\b", tests)
    nodes = list(ast.walk(ast.parse(path.read_text())))
    imported = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    imported |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert {place.partition(".")[0] for place in imported} <= LIBRARIES  # so that it runs alone


@pytest.mark.parametrize("name", cases())
def test_help_has_every_option(name, run):
    status, out, err = run(f"{name} --help")
    assert (status, err) == (0, "") and "--json" in out and ":math:" not in out
    assert all(flag(option) in out for option in options(import_module(cases()[name][0]).solve))


def test_a_repeated_option_adds_to_what_it_had():
    """The last one alone counted: `report --only a --only b` drew b."""
    offered = options(import_module("cases.report").solve).values()
    words = parser("report", import_module("cases.report"), offered).parse_args(
        ["--only", "wave", "--only", "strip", "rough"]
    )
    assert words.only == ["wave", "strip", "rough"]


def test_help_has_defaults_of_zero(run):
    assert "alpha' of (12) (default 0.0)" in " ".join(run("sphere --help")[1].split())


def test_printed_tables_of_a_group_are_named_once():
    rows = [{"load": 1.0, "zones": [[0, 1]]}, {"load": 2.0, "zones": []}]
    lines = summary({"laws": {"unilateral": rows}, "zones": [[-1, 1]], "fields": [[0] * 9], "more": [rows]})
    assert lines == ["laws.unilateral", "load  zones", "   1    0 1", "   2      -", "zones  -1 1"]


def test_a_figure_that_fails_leaves_standard_output_empty(run, monkeypatch, tmp_path):
    def full(_):
        raise OSError("no space left")

    monkeypatch.setattr("cases.commands.lattice.figure", full)
    status, out, err = run(f"lattice --blocks-per-a 2 --json - --out {tmp_path}")
    assert (status, out) == (1, "") and "no space left" in err


def test_cases_are_listed_one_line_each_and_none_is_imported():
    code = "import sys; from cases.__main__ import main; main([]); assert 'cases.hertz' not in sys.modules"
    listed = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert [line.split()[0] for line in listed.stdout.splitlines()] == list(cases())


@pytest.mark.parametrize(
    "words, meant",
    [
        ("herz", "hertz"),
        ("hertz --alfa 1", "--alpha"),
        ("hertz --obstacle cylnder", "cylinder"),
        ("hertz --outt a", "--out"),
    ],
)
def test_misspelt_words_are_answered_with_the_nearest(words, meant, run):
    status, out, err = run(words)
    assert (status, out) == (2, "") and err.count("\n") == 1 and f": did you mean {meant}?" in err


REFUSED = {
    "xyzzy": (2, "no such case"),
    "hertz --nu 0.5": (2, "nu = 0.5: must satisfy -1 < nu < 1/2"),
    "hertz --loads 1 nan": (2, "--loads: loads = nan"),
    "hertz --alpha 0.2 --ell 0.1": (2, "--ell: ell = 0.1: does not go together with --alpha"),
    "hertz --h 0.1": (2, "--h: h = 0.1: belongs to --model fe"),
    "hertz --model fe --mesh uniform --h 0.1 --domain 1.5": (2, "--domain: domain = '1.5': must be larger"),
    "hertz --rtol 1e-15": (1, "the smallest error estimate"),
    "hertz --alpha 1e-8": (1, "blocks wide"),
    "strip --rtol 1e-17": (1, "1e-17"),
    "strip --ell-over-H 1e-6": (1, ""),
    "strip --method penalty --rho 1e3 --rtol 1e-6": (1, ""),
    "strip --rho 1e16 --order 6 --elements 2": (1, ""),
    "strip --rtol 1e-3 --order 2": (2, "--rtol"),
    "sphere --cells 64 --rtol 0.1": (2, "--rtol: rtol = 0.1: does not go together with --cells"),
    "lattice --spring 1": (2, "--spring: expected 2 arguments"),
    "lattice --spring 1 1000": (2, "--spring: spring = (1.0, 1000.0): must be two"),
    "own_mesh --hole 1": (2, "--hole: expected 3 arguments"),
    "own_mesh --thicknesses 1 -1": (2, "--thicknesses: thicknesses = -1.0: must be positive"),
    "rough --seeds 0": (2, "--seeds: seeds = 0: must be at least 1"),
    "wave --loads 0": (2, "--loads: loads = 0: must be at least 1"),
    "wave --last 0": (2, "--last: load = 0.0: must be positive"),
    "lattice --loads 100": (2, "--far: far = 9.0: must be at least"),
    "rough3d --nu 7": (2, "--nu: nu = 7.0: must satisfy -1 < nu < 1/2"),
    "hertz --model=": (2, "--model: model = '': must be one of"),
    "contact": (2, "--height"),
    "contact --height x.real": (2, "'x.real' at place 1"),
    "contact --height 9**9**9": (2, "has no finite height"),
    "contact --height __import__(os)": (2, "'__import__(os)' at place 1"),
    "contact --height ''": (2, "--height"),
    "contact --height x": (2, "--height: height = 'x': must have a lowest place"),
    "contact --height 0": (2, "--height: height = '0': does not rise"),
    "contact --height log(x)": (2, "is nan at x"),
    "contact --height=-cos(x)": (2, "--window L R"),
    "contact --height -cos(x)": (2, "--NAME=VALUE"),
    "contact --height x**2 --samples a.csv": (2, "--samples"),
    "contact --height x^2/20": (2, "** for powers"),
    "contact --height x**2 --beta 0": (2, "nothing holds its rotation"),
    "contact --height x**2 --window 1 -1": (2, "--window"),
    "contact --height x**2 --window 1": (2, "--window"),
    "contact --height x**2 --noise 0.1": (2, "--noise"),
    "contact --height x**2 --loads 0": (2, "--loads: load = 0"),
    "contact --height x**2 --psi0-deg 1 --contact unilateral": (2, "--psi0-deg"),
    "contact --height x**2 --nu 0.5": (2, "--nu"),
    "contact --height x**2 --ell nan": (2, "--ell"),
    "contact --heigth x**2": (2, "did you mean --height?"),
    "contact --samples nowhere.csv": (2, "is no file"),
    "contact --samples .": (2, "is no file"),
    "contact --samples /dev/zero": (2, "is no file"),
    "contact --height x**2/20 --rtol 1e-17": (1, "1e-17"),
    "contact --height x**2/20 --window -0.01 0.01": (1, "widen"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("words", REFUSED)
def test_what_fails_says_so_in_one_line_and_leaves_nothing_behind(words, run, tmp_path):
    status, out, err = run(f"{words} --json {tmp_path / 'a.json'}")
    assert (status, out) == (REFUSED[words][0], "") and err.count("\n") == 1 and REFUSED[words][1] in err
    assert "Contact(" not in err and not list(tmp_path.iterdir())


@pytest.mark.parametrize("flag", ["--json", "--out"])
def test_of_one_option_beside_a_bad_place_the_place_is_blamed(flag, run):
    status, out, err = run(f"contact --height x**2 {flag} pyproject.toml/a")
    assert (status, out) == (2, "") and f": {flag}: {flag[2:]} = 'pyproject.toml/a': " in err


def test_json_has_parameters_versions_and_seconds(answer):
    start = time.perf_counter()
    entries = answer("strip --ell-over-H 0.2 --delta-over-H 0.03")
    assert 0 < sum(entries["seconds"].values()) <= time.perf_counter() - start
    assert entries["parameters"]["ell_over_H"] == 0.2 and entries["parameters"]["order"] > 1
    assert set(entries["seconds"]) == {"setup", "solve"} and "ngsolve" in entries["versions"]


def test_files_are_written_and_named(run, tmp_path):
    out, pipe = tmp_path / "figures", tmp_path / "pipe"
    os.mkfifo(pipe)
    with subprocess.Popen(["cat", pipe], stdout=subprocess.PIPE, text=True) as reader:
        status, printed, err = run(f"hertz --loads 0.1 1 --out {out} --json {pipe}")
        entries = json.loads(reader.communicate(timeout=60)[0])
    assert status == 0 and "half_width" in printed and len(entries["states"]) == 2
    assert err == f"wrote {out / 'hertz.png'}, {out / 'hertz.pdf'}, {pipe}\n"
    assert {path.name for path in out.iterdir()} == {"hertz.png", "hertz.pdf"}


def test_what_compiled_libraries_print_stays_off_standard_output():
    words = "strip", "--rho", "1e16", "--json", "-"  # UMFPACK gives up, with words of its own
    ran = subprocess.run([sys.executable, "-m", "cases", *words], cwd=ROOT, capture_output=True, text=True)
    assert (ran.returncode, ran.stdout) == (1, "") and ran.stderr.count("\n") == 1
