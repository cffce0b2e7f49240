"""The command line: its contract with other programs."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cases.__main__ import main
from cases.common.catalog import FOLDERS, all_cases, headlines

ROOT = Path(__file__).parents[2]
NUMBERS = (
    "psi_surface",
    "u1_surface",
    "u2_surface",
    "traction",
    "micromoment",
    "delta_fc",
    "L_psi",
    "L_u",
    "error_psi",
    "error_u",
    "error_psi_paper",
    "unknowns",
    "iterations",
)


def cases(*words, cwd=ROOT):
    return subprocess.run(
        [sys.executable, "-m", "cases", *words],
        cwd=cwd,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )


def test_cases_are_listed_one_line_each():
    listed = cases()
    assert listed.returncode == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()] == list(all_cases())
    folders = [FOLDERS.index(module.split(".")[1]) for module, _ in headlines().values()]
    assert folders == sorted(folders) and folders[0] == FOLDERS.index("commands")


def test_listing_imports_no_case():
    code = (
        "import sys; from cases.__main__ import main; assert main([]) == 0; "
        "assert not [name for name in sys.modules if name.startswith(('cases.scenes', 'cases.studies', "
        "'ngsolve'))]"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True).returncode == 0


def test_every_case_has_the_one_shape():
    for name, module in all_cases().items():
        assert module.__doc__.count("\n") > 2 and len(module.__doc__.partition("\n")[0]) < 100, name
        assert "--json" in cases(name, "--help").stdout
    for heading in ("Geometry", "Equations", "Model", "Reference", "Look at"):
        assert heading in all_cases()["strip"].__doc__


def test_json_on_standard_output_is_all_there_is():
    ran = cases("strip", "--ell-over-H", "0.2", "--delta-over-H", "0.03", "--json", "-")
    result = json.loads(ran.stdout, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))
    assert ran.returncode == 0 and ran.stderr == ""
    assert result["state"] == "full" and all(isinstance(result[name], (int, float)) for name in NUMBERS)
    assert result["parameters"]["ell_over_H"] == 0.2 and result["parameters"]["order"] > 1
    assert set(result["seconds"]) == {"setup", "solve"} and "ngsolve" in result["versions"]


def test_json_file_and_figures(tmp_path, capsys):
    assert main(["strip", "--json", str(tmp_path / "a.json"), "--out", str(tmp_path / "figures")]) == 0
    assert json.loads((tmp_path / "a.json").read_text())["state"] == "partial"
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"strip.png", "strip.pdf", "strip.csv"}
    assert "delta_fc" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words, meant",
    [
        ("herz", "hertz"),
        ("hertz --alfa 1", "--alpha"),
        ("hertz --obstacle cylnder", "cylinder"),
        ("strip --deltaoverH 1", "--delta-over-H"),
        ("report --only fig99", "fig9"),
        ("hertz --outt a", "--out"),
    ],
)
def test_misspelt_words_are_answered_with_the_nearest(words, meant, capsys):
    try:
        status = main(words.split())
    except SystemExit as stop:
        status = stop.code
    printed = capsys.readouterr()
    assert status == 2 and printed.err.count("\n") == 1 and f": did you mean {meant}?" in printed.err


def test_what_is_far_from_all_that_is_known_is_not_guessed(capsys):
    with pytest.raises(SystemExit):
        main(["xyzzy"])
    assert "did you mean" not in capsys.readouterr().err


def test_the_last_line_names_the_files_or_how_to_get_some(tmp_path, capsys):
    out = tmp_path / "mine"
    assert main(["strip", "--out", str(out)]) == 0
    assert capsys.readouterr().err == f"wrote {out / 'strip.csv'}, strip.pdf, strip.png\n"
    (out / "other").write_text("not ours")
    assert main(["strip", "--out", str(out), "--json", str(tmp_path / "a.json")]) == 0
    assert (
        capsys.readouterr().err == f"wrote {out / 'strip.csv'}, strip.pdf, strip.png, {tmp_path / 'a.json'}\n"
    )
    assert main(["strip"]) == 0
    assert capsys.readouterr().err == "no figures: give --out DIR\n"
    assert main(["strip", "--json", "-", "--out", str(out)]) == 0
    assert capsys.readouterr().err == ""


def test_many_files_are_counted(tmp_path):
    from cases.__main__ import LISTED, _told

    (tmp_path / "figures").mkdir()
    for number in range(LISTED + 1):
        (tmp_path / "figures" / f"{number}.png").touch()
    assert _told(tmp_path, {}, None) == f"wrote {LISTED + 1} files in {tmp_path}"


def test_help_says_what_happens_without_an_option(capsys):
    def explained(case):
        with pytest.raises(SystemExit):
            main([case, "--help"])
        return " ".join(capsys.readouterr().out.split())

    hertz, sweep, report = explained("hertz"), explained("sweep"), explained("report")
    assert "(default 1.0)" in hertz and "(default (" not in hertz
    assert "without it none are written" in hertz and "records (default out)" in report
    for words in (
        "(inf if not given)",
        "(condensed if not given",
        "(fitted if not given)",
        "without it the stiffness",
        "with --order alone",
    ):
        assert words in hertz
    assert "(default hertz)" not in sweep  # it must be given
    assert "Methods: limits" in report and "limits_cycling" not in report  # sections, not 88 names


@pytest.mark.parametrize("words", ["hertz --rtol 1e-15", "hertz --alpha 1e-8"])
def test_out_of_reach_is_told_without_names_of_python(words, capsys):
    assert main(words.split()) == 1
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "Contact" not in told
    assert "smallest error estimate" in told or "blocks wide" in told


@pytest.mark.parametrize("delta", ["-0.1", "0"])
def test_a_strip_that_is_not_pressed_says_so(delta, capsys):
    assert main(["strip", "--delta-over-H", delta, "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["state"] == "separation" and "do not press" in answer["warnings"][0]


def test_json_goes_through_a_pipe_and_leaves_it_one(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE, text=True)
    assert main(["strip", "--order", "2", "--json", str(pipe)]) == 0
    assert json.loads(reader.communicate(timeout=60)[0])["state"] == "partial" and pipe.is_fifo()


def test_what_compiled_libraries_print_stays_off_standard_output():
    ran = cases("strip", "--rho", "1e16", "--json", "-")  # UMFPACK gives up, with words of its own
    assert ran.returncode == 1 and ran.stdout == "" and ran.stderr.count("\n") == 1


def test_bad_arguments_leave_nothing_behind(tmp_path):
    ran = cases(
        "strip", "--nu", "0.5", "--json", str(tmp_path / "a.json"), "--out", str(tmp_path / "figures")
    )
    assert ran.returncode == 2 and "Traceback" not in ran.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_reached_gets_status_1_and_one_line(tmp_path):
    ran = cases("strip", "--rtol", "1e-17", "--json", str(tmp_path / "a.json"))
    assert ran.returncode == 1 and ran.stdout == "" and ran.stderr.count("\n") == 1
    assert "1e-17" in ran.stderr and list(tmp_path.iterdir()) == []


def test_the_closed_form_is_nowhere_in_the_computation(tmp_path):
    """The same numbers with closed_forms.py deleted; only the errors against it are gone, and that is
    said.
    """
    for package in ("microblock", "cases"):
        shutil.copytree(
            ROOT / package,
            tmp_path / package,
            ignore=shutil.ignore_patterns("closed_forms.py", "__pycache__"),
        )
    words = ("strip", "--psi0-deg", "-1.5", "--json", "-", "--out", str(tmp_path / "figures"))
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    # an editable installation must not find the module that is missing here
    code = (
        "import sys; sys.path.insert(0, '.'); "
        "sys.meta_path = [finder for finder in sys.meta_path if 'editable' not in repr(finder)]; "
        "from cases.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    without = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=tmp_path, capture_output=True, text=True, env=environment
    )
    assert without.returncode == 0, without.stderr
    bare, full = json.loads(without.stdout), json.loads(cases(*words).stdout)
    assert bare["error_psi"] is None and "closed_forms" in bare["warnings"][0]
    for name in NUMBERS:
        if not name.startswith("error_"):
            assert bare[name] == full[name], name
