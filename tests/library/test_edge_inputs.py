"""Input at its edges: what is unusual and allowed, formulas in x, and results that are no numbers."""

import gc
import json
import os
import time
from fractions import Fraction

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock.data.expressions import ALLOWED, FUNCTIONS, function_of_x
from microblock.errors import LONGEST_SHOWN, replacing, shown
from microblock.fem import meshes

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PLANE = mb.HalfPlane(SOLID)
CYLINDER = mb.Cylinder(R=10)


def test_the_empty_surroundings_of_a_punch_are_no_error(capsys):
    """Blocks ten times as wide as the punch: around one corner's edges there is nothing over the other's."""
    words = (
        "hertz --obstacle punch --contact microblock --P 1.45418e-07 --alpha 16.0308 --beta 0.00927023 "
        "--psi0-deg 6.107761 "
        "--punch-half-width 1.6965 --json -"
    )
    assert main(words.split()) in (0, 1)
    printed = capsys.readouterr()
    if printed.out:
        assert json.loads(printed.out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))[
            "states"
        ]
    else:
        assert printed.err.count("\n") == 1


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    """What stops the writing leaves the file as it was, and a pipe where it is."""
    file, pipe = tmp_path / "file", tmp_path / "pipe"
    file.write_text("before")
    os.mkfifo(pipe)
    for place in (file, pipe):
        with pytest.raises(KeyboardInterrupt), replacing(place) as part:
            assert part == pipe or part.write_text("half")
            raise KeyboardInterrupt
    assert file.read_text() == "before" and sorted(tmp_path.iterdir()) == [file, pipe]


@pytest.mark.parametrize(
    "height",
    [
        lambda x: list(np.asarray(x) ** 2 / 20),
        lambda x: np.array([Fraction(float(one)) ** 2 / 20 for one in x], dtype=object),
    ],
)
def test_heights_that_return_lists_or_fractions_are_heights(height):
    state, expected = (
        mb.Contact(PLANE, obstacle, mb.Unilateral()).solve(1.0, rtol=1e-3) for obstacle in (height, CYLINDER)
    )
    # two estimates below 1e-3
    assert state.half_width == pytest.approx(expected.half_width, rel=2e-3)


# --- bad arguments of which `refusals.csv` can have no row: values as they are shown, too many elements


@pytest.mark.parametrize(
    "value, words",
    [
        (1.5, "1.5"),
        ("one", "'one'"),
        (np.float64(-1), "-1.0"),
        ([1, 2], "[1, 2]"),
        (len, "function len"),
        (mb.Plane, "class Plane"),
        (np.zeros((9, 2)), "9 entries ("),
        (tuple(range(7)), "7 entries (0, 1, 2, ...)"),
        (None, "None"),
        ("a" * 500, " ..."),
    ],
)
def test_values_are_shown_on_a_short_line(value, words):
    line = shown(value)
    assert words in line and "\n" not in line and len(line) <= LONGEST_SHOWN


def test_microclamped_constrains_psi_on_a_surface_named_like_another():
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0)
    mesh.ngmesh.SetBCName([*mesh.GetBoundaries()].index("side"), "contact_side")
    supports = {"u1": "bottom", "u2": "bottom", "psi": "contact_side"}
    body = mb.Body(meshes.ng.Mesh(mesh.ngmesh), SOLID, 1, fixed=supports)
    state = mb.Contact(body, CYLINDER, mb.Microclamped()).solve(load=0.1)
    assert not state.psi.any() and state.micromoment.any()


# --- formulas in x: their values, and that nothing but formulas is read


X = np.linspace(-2.0, 2.0, 9)
VALUES = {
    "x**2/20": X**2 / 20,
    " -x ** 2 ": -(X**2),  # the power binds stronger, as in Python
    "2**3**2 + x": 512 + X,  # from the right
    "1e-3*abs(x)": 1e-3 * np.abs(X),
    "0.5": np.full(9, 0.5),
    "1 - cos(2*pi*x/3)": 1 - np.cos(2 * np.pi * X / 3),
    "where(x < 0, -x, 2*x)": np.where(X < 0, -X, 2 * X),
    "where(abs(x) <= 1, 0.1*x, inf)": np.where(np.abs(X) <= 1, 0.1 * X, np.inf),
    "(x > 1)*(x - 1)**2 - -(x < 0)": np.where(X > 1, (X - 1) ** 2, 0) + (X < 0),
    "where(x, 1, 2)": np.where(X, 1, 2),
    "where(x != 0, 1, e)": np.where(X != 0, 1, np.e),
    "minimum((x-1)**2, maximum(x, hypot(x, 1)))": np.minimum((X - 1) ** 2, np.maximum(X, np.hypot(X, 1))),
    "clip(power(x, 3), -1, +1)": np.clip(X**3, -1, 1),
    "2**x": 2.0**X,
    "9**9**9 + x": np.inf + X,  # at once, in doubles
    "+".join(["x"] * 90): 90 * X,
}

# {formula: (what stands there, at which place)}
HOSTILE = {
    "": ("the end", 1),
    "x.real": ("x.real", 1),
    "().__class__.__bases__": ("().__class__.__bases__", 1),
    "__import__(x)": ("__import__", 1),
    "__import__('os').system('true')": ("'", 12),
    "abs(x)(x)": ("abs(x)", 1),
    "eval(x)": ("eval", 1),
    "exec": ("exec", 1),
    "np.sin(x)": ("np.sin", 1),
    "lambda: x": (":", 7),
    "lambda x": (None, None),
    'f"{x}"': ('"', 2),
    "'x'": ("'", 1),
    "x[0]": ("[", 2),
    "[x for x in x]": ("[", 1),
    "sum(x for y in x)": ("sum", 1),
    "abs(x for y in x)": (None, None),
    "{x}": ("{", 1),
    "(y := x)": (":", 4),
    "9" * 60: ("9" * 60, 1),
    "1e999": ("1e999", 1),
    "(" * 240 + "x" + ")" * 240: (None, None),
    "-" * 150 + "x": (None, None),
    "abs(" * 99 + "x*1*1*1" + ")" * 99: (None, None),
    "+".join(["x"] * 200): (None, None),
    "x+" * 300 + "x": (None, 501),
    "\N{CYRILLIC SMALL LETTER HA}**2": ("\\u0445", 1),
    "\N{MATHEMATICAL BOLD SMALL X}**2": ("\\U0001d431", 1),
    "x**\N{SUPERSCRIPT TWO}": ("\\xb2", 4),
    "x\0": ("\\x00", 2),
    "x\n+1": ("\\n", 2),
    "x # y": ("#", 3),
    "x; x": (";", 2),
    "abs(x=x)": ("abs(x=x)", 1),
    "abs(x, out=x)": ("abs(x, out=x)", 1),
    "abs(*x)": ("*x", 5),
    "abs(**x)": ("abs(**x)", 1),
    "clip(x, 1)": ("clip(x, 1)", 1),
    "abs()": ("abs()", 1),
    "x, x": ("x, x", 1),
    "x = 1": ("=", None),
    "where(x in x, 1, 2)": ("x in x", 7),
    "where(x is x, 1, 2)": ("x is x", 7),
    "where(-1 < x < 1, 1, 2)": ("-1 < x < 1", 7),
    "x if x else x": ("x if x else x", 1),
    "x and x": ("x and x", 1),
    "not x": ("not x", 1),
    "~x": ("~", 1),
    "x^2": ("^", 2),
    "x // 2": ("x // 2", 1),
    "x % 2": ("%", 3),
    "x @ x": ("@", 3),
    "1j*x": ("1j", 1),
    "True": ("True", 1),
    "None": ("None", 1),
    "...": ("...", 1),
    "nan": ("nan", 1),
    "sin": ("sin", 1),
    "y": ("y", 1),
    "(yield x)": ("yield x", 2),
    "await x": (None, None),
    "x +": ("the end", 4),
    "2x": (None, None),
    "1if x else 2": ("1if x else 2", 1),
}


@pytest.mark.parametrize("formula", VALUES)
def test_a_formula_has_the_values_of_numpy(formula):
    height = function_of_x(formula)
    assert np.array_equal(height(X), VALUES[formula])
    assert height(np.empty(0)).shape == (0,) and height(1).shape == ()


def test_every_function_of_the_list_is_numpys():
    for name, function in FUNCTIONS.items():
        first = ("x < 1", X < 1) if name == "where" else ("x", X)
        number = getattr(function, "nin", 3)
        formula = f"{name}({', '.join([first[0], '2', '3'][:number])})"
        with np.errstate(all="ignore"):
            wanted = function(*[first[1], 2.0, 3.0][:number])
        assert np.array_equal(function_of_x(formula)(X), wanted, equal_nan=True), formula
        assert f" {name}," in ALLOWED


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("formula", HOSTILE, ids=lambda formula: ascii(formula)[:30])
def test_what_is_no_formula_is_refused_with_its_place(formula):
    """Each at once: a tenth of a second is a hundred times what it takes, and what a power of whole numbers
    would exceed by ages; without the collector, which takes longer where other tests have left much."""
    gc.disable()
    start = time.process_time()
    try:
        with pytest.raises(mb.BadArgument) as caught:
            function_of_x(formula, "height")
        assert time.process_time() - start < 0.1
    finally:
        gc.enable()
    what, place = HOSTILE[formula]
    failure = caught.value
    assert failure.name == "height" and "\n" not in str(failure) and failure.allowed.isascii()
    assert failure.allowed.endswith(ALLOWED)
    assert place is None or f" at place {place} " in failure.allowed
    assert what is None or what[:20] in failure.allowed


def test_where_there_is_no_number_the_function_says_so():
    assert np.isnan(function_of_x("log(x)")(X)[0]) and function_of_x("1/abs(x)")(X)[4] == np.inf
