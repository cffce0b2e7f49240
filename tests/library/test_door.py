"""At the door: hostile command lines and arguments get one line or a typed error, and nothing is written."""

import json
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock.data.records import json_text, write_json
from microblock.errors import LARGEST, SMALLEST
from microblock.fem import meshes
from microblock.fem.condensation import Condensed
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton
from microblock.fem.newton_path import load_path
from microblock.view.explorer import Explorer

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PLANE, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
LINE = mb.Contact(PLANE, CYLINDER, LAW)
FITTED = mb.Contact(mb.Block(SOLID, 10.0), CYLINDER, LAW)
BODY = mb.Body(
    meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0), SOLID, order=1, fixed="bottom"
)
PRESSED = mb.Contact(BODY, CYLINDER, LAW)
FACETS = ContactFacets(BODY, LAW, CYLINDER)
NEWTON = MonolithicNewton(BODY, FACETS, control="load")
EXPLORED = Explorer(LINE, 1.0)


def cells(**options):
    return mb.Contact(PLANE, CYLINDER, LAW, mb.Cells(window=(-1, 1), **options))


# options that are one number, all of them scales: none of these was refused by name before
SCALES = [
    f"{case} --{option} {value}"
    for case, options in (
        ("hertz", ("E", "R", "P", "alpha", "ell", "loads")),
        ("rough", ("ell",)),
        ("wavy", ("ell-over-wavelength", "loads")),
        ("size_effect", ("alphas",)),
    )
    for option in options
    for value in ("1e300", "1e-300")
]
HOSTILE = [
    *SCALES,
    "hertz --obstacle punch --punch-half-width 1e300",
    "sweep hertz --over alpha nan 0.1",
    "sweep hertz --over alpha 0.1 1e300",
    "sweep hertz --over alpha inf",
    "classical --nodes 100 100",
    "wavy --loads nan",
    "hertz --rtol 1e-300",
    "hertz --E 1e51",
    "speed --only nothing",
    "speed --repeats 0",
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("words", HOSTILE)
def test_hostile_command_lines_get_one_line(words, tmp_path, capsys):
    told, out = tmp_path / "a.json", tmp_path / "figures"
    assert main([*words.split(), "--json", str(told), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    option = next(word for word in words.split() if word.startswith("--") and word != "--obstacle")
    assert printed.out == "" and printed.err.count("\n") == 1 and f"{option} " in printed.err
    assert not told.exists() and not out.exists()


def test_seeded_numbers_at_the_door(capsys):
    """Numbers of any size, at random: those that cannot be carried are told by the option's name, before any
    work.
    """
    random = np.random.default_rng(12)
    for _ in range(200):
        option = random.choice(["E", "R", "P", "alpha", "ell"])
        power = random.choice([-1, 1]) * random.uniform(50.1, 307)
        value = f"{random.choice(['', '-'])}{10**power:.3e}"
        assert main(["hertz", f"--{option}={value}"]) == 2
        told = capsys.readouterr()
        assert (
            told.out == ""
            and told.err.startswith(f"python -m cases hertz: --{option} ")
            and told.err.count("\n") == 1
        )


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


@pytest.mark.parametrize("result, place", [({"a": [1.0, {"b": math.nan}]}, "a.1.b"), ([math.inf], "0")])
def test_what_is_no_number_is_told_and_not_written(result, place, tmp_path):
    with pytest.raises(mb.NotConverged, match=place):
        write_json(tmp_path / "a.json", result)
    with pytest.raises(mb.NotConverged, match=place):
        json_text(result)
    assert not list(tmp_path.iterdir())


def all_but(*kinds):
    """Hostile values without those of some kinds, which an argument takes."""
    hostile = (
        None,
        "x",
        [],
        [1.0],
        {},
        1j,
        Fraction(1, 2),
        Decimal("0.5"),
        math.nan,
        -math.inf,
        -1,
        10**400,
        True,
        np.array([1.0, 2.0]),
        object(),
        float,
        b"a",
    )
    return [value for value in hostile if not isinstance(value, kinds or ())]


NUMBER, TEXT, PAIR = all_but(), all_but(str), all_but(np.ndarray)
MAYBE = [value for value in NUMBER if value is not None]
ENTRIES = {
    "E": (NUMBER, lambda it: mb.Cosserat(E=it, nu=0.3, ell=0.1, beta=1)),
    "nu": (NUMBER, lambda it: mb.Cosserat(E=1, nu=it, ell=0.1, beta=1)),
    "ell": (NUMBER, lambda it: mb.Cosserat(E=1, nu=0.3, ell=it, beta=1)),
    "solid": (NUMBER, mb.HalfPlane),
    "period": (MAYBE, lambda it: mb.HalfPlane(SOLID, it)),
    "R": (NUMBER, mb.Cylinder),
    "scales' solid": (NUMBER, lambda it: mb.hertz_scales(it, 10.0, 1.0)),
    "scales' R": (NUMBER, lambda it: mb.hertz_scales(SOLID, it, 1.0)),
    "P": (NUMBER, lambda it: mb.hertz_scales(SOLID, 10.0, it)),
    "slope": (NUMBER, mb.Wedge),
    "half_width": (NUMBER, mb.Punch),
    "amplitude": (NUMBER, lambda it: mb.Wave(it, 1.0)),
    "waves": (NUMBER, lambda it: mb.Rough(1.0, 0.1, waves=it)),
    "seed": (NUMBER, lambda it: mb.Rough(1.0, 0.1, seed=it)),
    "x": (PAIR, lambda it: mb.Obstacle.from_samples(it, [0, 1])),
    "psi0_in": (NUMBER, lambda it: mb.Microblock(0.0, it)),
    "law": (NUMBER, lambda it: mb.Contact(PLANE, CYLINDER, it)),
    "method": (MAYBE, lambda it: mb.Contact(PLANE, CYLINDER, LAW, it)),
    "load": (NUMBER, LINE.solve),
    "approach": (NUMBER, lambda it: FITTED.solve(approach=it)),
    "rtol": (MAYBE, lambda it: LINE.solve(1.0, rtol=it)),
    "order": ([*MAYBE, "14", 2.5, 1, 0, 101], lambda it: mb.Panels(order=it)),
    "initial": ([*MAYBE, "x", 0], lambda it: LINE.solve(1.0, initial=it)),
    "path rtol": (MAYBE, lambda it: LINE.path(1.0, rtol=it)),
    "path load": (NUMBER, LINE.path),
    "coalescence": (NUMBER, LINE.solver.coalescence),
    "window": ([value for value in PAIR if value is not None], lambda it: mb.Cells(window=it)),
    "cells load": (NUMBER, lambda it: cells(nodes=64).solve(it)),
    "nodes": ([*MAYBE, 31], lambda it: cells(nodes=it)),
    "cells initial": (MAYBE, lambda it: cells(nodes=64).solve(1.0, initial=it)),
    "residual": (NUMBER, lambda it: cells(nodes=64, residual=it)),
    "size": (NUMBER, lambda it: mb.Block(SOLID, it)),
    "fitted rtol": (MAYBE, lambda it: FITTED.solve(1.0, rtol=it)),
    "fitted initial": (MAYBE, lambda it: FITTED.solve(1.0, initial=it)),
    "fitted order": (MAYBE, lambda it: mb.Fitted(order=it)),
    "spacing": (MAYBE, lambda it: mb.Fitted(order=2, spacing=it)),
    "h": (NUMBER, lambda it: mb.Uniform(h=it)),
    "reach": (MAYBE, lambda it: mb.Uniform(h=0.2, reach=it)),
    "uniform order": (NUMBER, lambda it: mb.Uniform(h=0.2, order=it)),
    "newton": (MAYBE, lambda it: mb.Uniform(h=0.2, newton=it)),
    "kind": (NUMBER, mb.Newton),
    "rho": (MAYBE, lambda it: mb.Newton(rho=it)),
    "body load": (NUMBER, PRESSED.solve),
    "body rtol": (MAYBE, lambda it: PRESSED.solve(0.5, rtol=it)),
    "body initial": (MAYBE, lambda it: PRESSED.solve(0.5, initial=it)),
    "body path": (MAYBE, lambda it: PRESSED.path(0.5, rtol=it)),
    "boundary": (TEXT, lambda it: mb.Body(BODY.mesh, SOLID, 1, fixed="bottom", contact=it)),
    "nodes of": (NUMBER, Condensed),
    "facets": (NUMBER, lambda it: MonolithicNewton(BODY, it)),
    "facets' law": (NUMBER, lambda it: ContactFacets(BODY, it, CYLINDER)),
    "facets' boundary": (TEXT, lambda it: ContactFacets(BODY, LAW, CYLINDER, boundary=it)),
    "other loads": (NUMBER, lambda it: MonolithicNewton(BODY, FACETS, loads=it)),
    "control": (NUMBER, lambda it: MonolithicNewton(BODY, FACETS, control=it)),
    "Newton's rho": (MAYBE, lambda it: MonolithicNewton(BODY, FACETS, rho=it)),
    "level": (NUMBER, NEWTON.solve),
    "Newton's start": (MAYBE, lambda it: NEWTON.solve(0.5, start=it)),
    "levels": ([None, 1, 1j, math.nan, "x", ["x"]], lambda it: list(load_path(NEWTON, it))),
    "ground": (NUMBER, lambda it: meshes.Ground(10.0, it)),
    "far": (NUMBER, lambda it: meshes.Ground(it, (0.0, 1.0))),
    "explored": (NUMBER, lambda it: Explorer(it, 1.0)),
    "slider": (NUMBER, lambda it: EXPLORED.solve(load=it)),
    "psi0 slider": (NUMBER, lambda it: EXPLORED.solve(psi0=it)),
    "law slider": (NUMBER, lambda it: EXPLORED.solve(law=it)),
    "over": ([None, 1, 1j, math.nan], lambda it: mb.sweep(len, it)),
    "workers": (MAYBE, lambda it: mb.sweep(len, [], workers=it)),
    "abscissae": (PAIR, PLANE.compliance),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("entry", ENTRIES)
def test_hostile_arguments_are_refused_by_name(entry):
    values, call = ENTRIES[entry]
    for value in values:
        with pytest.raises(mb.MicroblockError) as caught:
            call(value)
            pytest.fail(f"{entry}: {value!r} was taken")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [np.float64(1.0), np.float32(1.0), np.int64(1), 1])
def test_numbers_of_numpy_are_numbers(value):
    assert mb.Cylinder(value).R == 1
    assert LINE.solve(value, rtol=1e-2).load == 1


@pytest.mark.parametrize("value", [1e51, -1e51, 1e-51, np.float64(1e300), 10**60])
def test_sizes_that_cannot_be_carried_say_between_what(value):
    with pytest.raises(mb.BadArgument, match=r"R = "):
        mb.Cylinder(value)
    assert mb.Cylinder(LARGEST).R == LARGEST and mb.Cylinder(SMALLEST).R == SMALLEST


def raising(failure):
    def height(x):
        raise failure

    return height


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "height",
    [
        lambda x: x**2 + 0j,
        lambda x: np.array([object() for _ in x]),
        lambda x: None,
        lambda x: "a",
        lambda x: np.zeros((len(x), 2)),
        lambda x: [None] * len(x),
        raising(ZeroDivisionError()),
        raising(IndexError("no")),
        raising(RuntimeError("no")),
        raising(AttributeError("no")),
    ],
)
def test_functions_that_give_no_numbers_are_refused(height):
    with pytest.raises(mb.BadArgument) as caught:
        mb.Contact(PLANE, height, LAW).solve(1.0)
    assert caught.value.name == "obstacle"
    with pytest.raises(mb.BadArgument) as caught:
        mb.Contact(PLANE, CYLINDER, mb.Microblock(height)).solve(1.0)
    assert caught.value.name == "psi0"


def test_a_height_that_fails_late_is_refused_as_well():
    def height(x):
        return x**2 / 20 if len(x) < 100 else x[10**9]

    with pytest.raises(mb.BadArgument, match="IndexError"):
        mb.Contact(PLANE, height, LAW).solve(1.0)


@pytest.mark.parametrize(
    "height",
    [
        lambda x: list(np.asarray(x) ** 2 / 20),
        lambda x: np.array([Fraction(float(one)) ** 2 / 20 for one in x], dtype=object),
    ],
)
def test_heights_that_return_lists_or_fractions_are_heights(height):
    found, known = (
        mb.Contact(PLANE, each, mb.Unilateral()).solve(1.0, rtol=1e-3) for each in (height, CYLINDER)
    )
    # two estimates below 1e-3
    assert found.half_width == pytest.approx(known.half_width, rel=2e-3)
