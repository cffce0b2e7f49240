"""Text files of instruments: what is read of them, what is said of it, and what is left to be settled."""

import json
import subprocess
import sys

import numpy as np
import pytest

import microblock as mb
from microblock.data.samples import read_profile, read_samples

X = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
Z = np.array([0.5, 0.125, 0.0, 0.125, 0.5])


def rows(separator, decimal=".", scale=(1, 1), end="\n", more=lambda i: ()):
    """Lines of x and z, in parts of their unit, and more cells."""
    lines = []
    for i, pair in enumerate(zip(X, Z)):
        cells = [f"{value * part:.7g}".replace(".", decimal) for value, part in zip(pair, scale)]
        lines.append(separator.join([*cells, *more(i)]))
    return end.join(lines) + end


# instrument: (text, encoding, unit that is read, words that are said)
FILES = {
    "Mitutoyo Surftest": (
        "Profile,Primary\nUnit,mm\nPoints,5\nX,Z\n" + rows(","),
        "utf-8",
        "mm",
        "lines above left out: 4",
    ),
    "Taylor Hobson Talysurf": ("5\n" + rows(" ", end="\r\n"), "ascii", None, "lines above left out: 1"),
    "Taylor Hobson Ultra": (
        "Measurement taken 12 May 2021\r\nX (mm)\tZ (µm)\r\n" + rows("\t", scale=(1, 1e3), end="\r\n"),
        "latin-1",
        "mm",
        "height from column 2 (um)",
    ),
    "Dektak": (
        "Meas Date:,12/05/2021\nScan Length,2000\nLateral,Total Profile,\num,Å,\n"
        + rows(",", scale=(1e3, 1e7), more=lambda i: [""]),
        "utf-8-sig",
        "um",
        "height from column 2 (å)",
    ),
    "Dektak 150": (
        "Lateral um  Raw Profile nm\n" + rows("  ", scale=(1e3, 1e6)),
        "ascii",
        None,
        "no unit named",  # titles of six words over two columns
    ),
    "Alicona": ("Profile path [m]; height [m]\n" + rows(";", scale=(1e-3, 1e-3)), "utf-8", "m", "taken in m"),
    "KLA Tencor": (
        "Scan Type: 2D\n12:33:01 05-12-21\n#\tx(um)\tz(A)\n"
        + "".join(f"{i}\t{x * 1e3:g}\t{z}\n" for i, (x, z) in enumerate(zip(X, Z))),
        "ascii",
        None,
        "",
    ),
    "Zygo": ("Distance (mm),Height (nm)\n" + rows(",", scale=(1, 1e6)), "utf-8", "mm", "(nm)"),
    "Gwyddion": ("# x [m]  y [m]\n" + rows(" ", scale=(1e-3, 1e-3)), "utf-8", "m", "taken in m"),
    "Keyence": (
        '"Date","2021/05/12"\r\n"X [mm]","Z [µm]"\r\n'
        + "".join(f'"{x:.3f}","{z * 1e3:.3f}"\r\n' for x, z in zip(X, Z)),
        "utf-16",
        "mm",
        "lines above left out: 2",
    ),
    "Keyence with invalid points": ("X,Z\n" + rows(",") + "1.5,-99999.9999\n", "utf-8", None, "6 samples"),
    "NanoFocus": (
        "x;z\n[mm];[µm]\n" + rows(";", ",", (1, 1e3)),
        "latin-1",
        "mm",
        "height from column 2 (um)",
    ),
    "SurfaceTopography XYZ": (
        rows(" ", more=lambda i: ()).replace(" ", " 3.5 "),
        "ascii",
        None,
        "height from column 3",
    ),
    "XYZ across": (
        "x,y,z\n" + "".join(f"0.25,{x},{z}\n" for x, z in zip(X, Z)),
        "ascii",
        None,
        "x from column 2",
    ),
    "Mahr": (rows("\t", ",", end="\r\n") + "\x1a", "latin-1", None, "5 samples"),
    "Jenoptik": ("Länge / mm;Höhe / mm\r\n" + rows(";", ",", end="\r\n"), "latin-1", "mm", "taken in mm"),
    "Sensofar": (
        "No,x (um),z (um)\n" + "".join(f"{i},{x * 1e3},{z * 1e3}\n" for i, (x, z) in enumerate(zip(X, Z))),
        "utf-16-le",
        "um",
        "x from column 2 (um)",
    ),
    "Mountains": ("% Axis units: µm\n%\n" + rows("   ", scale=(1e3, 1e3)), "utf-8", "um", "taken in um"),
    "a spreadsheet": (
        '"x";"z"\n' + "".join(f'"{x}";"{z}"\n'.replace(".", ",") for x, z in zip(X, Z)),
        "utf-8",
        None,
        "5 samples",
    ),
    "from right to left": (
        "x,height\n" + "".join(f"{x},{z}\n" for x, z in zip(X[::-1], Z)),
        "utf-8",
        None,
        "5 samples",
    ),
}
DOUBTFUL = {  # text: (option of the reader, words of the refusal)
    FILES["KLA Tencor"][0]: ({"columns": ("2:um", "3:mm")}, "2:mm 3:um"),
    "x,raw,filtered\n" + rows(",", more=lambda i: [str(i * i)]): ({"columns": (1, "raw")}, "columns"),
    "x (mm),z\n" + rows(","): ({"columns": ("1:mm", "2:mm")}, "1:mm 2:um"),
    "7 0\n8 0 0\n" + rows(" "): ({"skip": 2}, "skip 2"),
    "0, low\n" + rows(","): ({"skip": 1}, "skip 1"),
    "-1,0,1,5\n0,0,0,0\n1,0,1,5\n": ({"columns": (1, 3)}, "decimal signs"),
}
REFUSED = {
    b"": "no two columns",
    b"x, height\n": "no two columns",
    b"1\n2\n3\n": "x is missing",
    b"0, 0\n1, high\n2, 1": "'1, high' in line 2",
    b"0, 0\n1, 1\n2, 1, 5": "line 3",
    b"0, 0\n1, inf\n": "line 2",
    b"0, 0\n1, 1e99\n": "line 2",
    b"0, 0\n2, 1\n1, 2\n": "sort it, average duplicates",
    b"0, 0\n0, 1\n": "average duplicates",
    b"0, 0\n": "at least two numbers",
    b"0, nan\n1, 2\n": "two neighbours",
    b"0,05\n0,04\n": "decimal signs",
    b"\x89PNG\r\n\x1a\n": "no text",
    b"a\x00b\n\x00\x01\n": "no text",
    b"PK\x03\x04": "no text",
}


@pytest.fixture
def written(tmp_path):
    def write(content, encoding="utf-8"):
        file = tmp_path / "profile.txt"
        file.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
        return file

    return write


@pytest.mark.parametrize("instrument", sorted(set(FILES) - {"KLA Tencor"}))
def test_files_of_instruments_are_read(instrument, written):
    """15 of 20 were refused."""
    text, encoding, unit, words = FILES[instrument]
    profile = read_profile(written(text, encoding))
    # the text has seven digits; without titles lengths are as they stand
    part = {"mm": 1, "um": 1e3, "m": 1e-3, None: 1e3 if "Dektak 150" in instrument else 1}[unit]
    assert profile.unit == unit and words in "; ".join(profile.understood)
    assert np.allclose(np.sort(profile.x[:5]), part * X, rtol=1e-6)
    heights = part * Z if "Dektak 150" not in instrument else 1e6 * Z
    assert np.allclose(profile.z[:5], heights, rtol=1e-6)


@pytest.mark.parametrize("text", DOUBTFUL)
def test_what_could_be_read_in_several_ways_is_settled_by_the_option_that_is_named(text, written):
    options, words = DOUBTFUL[text]
    with pytest.raises(mb.BadArgument, match=words):
        read_samples(written(text))
    assert read_samples(written(text), **options).x


@pytest.mark.parametrize("content", REFUSED)
def test_what_holds_no_profile_is_refused(content, written):
    with pytest.raises(mb.BadArgument, match="path = ") as caught:
        read_samples(written(content))
    assert REFUSED[content] in str(caught.value)


def test_missing_heights_are_holes_and_rows_without_x_are_left_out(written):
    file = written("x\tz\n-1\t0.5\n-0.5\tNo Data\n***\t3\n0\t0\n0.5\t\n0.75\t0.2\n1\t0.5\n")
    profile = read_profile(file)
    assert (
        profile.x.tolist() == [-1, -0.5, 0, 0.5, 0.75, 1]
        and "rows without x left out: 1" in profile.understood
    )
    assert np.isnan(profile.z).tolist() == [False, True, False, True, False, False]
    assert np.isinf(read_samples(file).height(np.array([-0.25, 0.25, 0.8]))).tolist() == [True, True, False]


def test_lengths_are_brought_to_the_unit_that_is_asked_for(written):
    file = written(*FILES["Zygo"][:2])
    assert np.allclose(read_profile(file, unit="um").x, 1e3 * X)
    assert np.allclose(read_profile(file, unit="m").z, 1e-3 * Z)
    assert "taken in nm" in read_profile(written(rows(" ")), unit="nm").understood
    with pytest.raises(mb.BadArgument, match="unit = 'V': must be one of"):
        read_profile(file, unit="V")
    for columns, words in (
        ((1, 3), "'3'"),
        (5, "5"),
        ((1, 1), ".*must be two"),
        ((1, 2, 1), ".*must be two"),
    ):
        with pytest.raises(mb.BadArgument, match=f"columns = {words}"):
            read_profile(file, columns=columns)
    assert read_profile(written("x (in),z (mil)\n\u22121,5\n0,0\n1,5\n")).unit == "inch"


def test_the_command_says_what_it_has_understood(run, answer, written):
    file = written(*FILES["Dektak"][:2])
    words = f"contact --samples {file} --unit mm --contact unilateral"
    status, out, _ = run(words)
    assert status == 0 and "x from column 1 (um); height from column 2 (å); taken in mm;" in out
    found = answer(words)
    assert found["parameters"]["understood"][0] == "5 samples" and found["parameters"]["unit"] == "mm"
    known = mb.Contact(
        mb.HalfPlane(mb.Cosserat(100, 0.3, beta=1, ell=0.1)), mb.Obstacle.from_samples(X, Z), mb.Unilateral()
    ).solve(1.0, rtol=1e-3)
    assert found["states"][0]["half_width"] == pytest.approx(known.half_width, rel=1e-6)  # seven digits
    status, _, err = run("contact --height x**2 --columns 1 2")
    assert status == 2 and "--columns" in err and "belongs to --samples" in err


@pytest.mark.parametrize("program", ["microblock", "cases"])
def test_a_reader_that_has_gone_ends_a_command_quietly(program):
    """`| head` ended with "Exception ignored ... BrokenPipeError", status 120."""
    command = [sys.executable, "-m", program, "contact", "--height", "x**2/20", "--json", "-"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b"" and process.wait() == 141


def test_titles_and_plans_have_honest_digits():
    """.01139 was shown as 1.2e-02, and 6 GB as 6e+03 MB."""
    state = mb.Contact(
        mb.HalfPlane(mb.Cosserat(100, 0.3, beta=1, ell=0.1)),
        mb.Cylinder(10),
        mb.Microblock(),
        mb.Cells(256, window=(-1, 1)),
    ).solve(1.0)
    shown = float(state.caption.rpartition("error ")[2])
    assert shown == pytest.approx(state.error_estimate, rel=0.05)  # half of the second digit
    candidate = mb.model.plan.Candidate
    for memory, words in ((3e8, "3e+02 MB"), (6e9, " 6 GB"), (9.97e8, " 1 GB")):
        cost = mb.cost.Cost(seconds=1.0, memory=memory, unknowns=10)
        solver = type("Solver", (), {"options": mb.Cells()})()
        assert words in repr(candidate(solver, cost))
    assert json.dumps(state.to_dict())
