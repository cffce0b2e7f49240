"""At the door: hostile command lines and arguments get one line or a typed error, and nothing is written."""

import json
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock import meshes
from microblock.errors import LARGEST, SMALLEST
from microblock.study import json_text, write_json

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PLANE, CYLINDER, LAW = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock()
LINE = mb.Contact(PLANE, CYLINDER, LAW)
CELLS = mb.GridContact(PLANE, CYLINDER, LAW, window=(-1, 1))
FITTED = mb.FittedContact(SOLID, CYLINDER, LAW, domain=10.0)
BODY = mb.Body(meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 1.0), SOLID, order=1, fixed="bottom")
PRESSED = mb.BodyContact(BODY, CYLINDER, LAW)
FACETS = mb.ContactFacets(BODY, LAW, CYLINDER)
NEWTON = mb.Newton(BODY, FACETS, control="load")
EXPLORED = mb.Explorer(LINE, 1.0)


def uniform(**changed):
    return mb.UniformContact(SOLID, CYLINDER, LAW, **{"domain": 4.0, "h": 0.2, "reach": 0.8, **changed})


# options that are one number, all of them scales: none of these was refused by name before
SCALES = [f"{case} --{option} {value}" for case, options in (
    ("hertz", ("E", "R", "P", "alpha", "ell", "loads")), ("rough", ("ell",)), ("wavy", ("ell-over-wavelength", "loads")),
    ("size_effect", ("alphas",)), ("timing", ("alphas",)), ("frames", ("alpha",)))
    for option in options for value in ("1e300", "1e-300")]
HOSTILE = [*SCALES, "hertz --obstacle punch --punch-half-width 1e300", "sweep hertz --over alpha nan 0.1",
           "sweep hertz --over alpha 0.1 1e300", "sweep hertz --over alpha inf", "classical --nodes 100 100", "wavy --loads nan",
           "hertz --rtol 1e-300", "hertz --E 1e51", "threads --only nothing", "threads --repeats 0"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("words", HOSTILE)
def test_hostile_command_lines_get_one_line(words, tmp_path, capsys):
    told, out = tmp_path/"a.json", tmp_path/"figures"
    assert main([*words.split(), "--json", str(told), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    option = next(word for word in words.split() if word.startswith("--") and word != "--obstacle")
    assert printed.out == "" and printed.err.count("\n") == 1 and f"{option} " in printed.err
    assert not told.exists() and not out.exists()


def test_seeded_numbers_at_the_door(capsys):
    """Numbers of any size, at random: those that cannot be carried are told by the option's name, before any work."""
    random = np.random.default_rng(12)
    for _ in range(200):
        option = random.choice(["E", "R", "P", "alpha", "ell"])
        power = random.choice([-1, 1])*random.uniform(50.1, 307)
        value = f"{random.choice(['', '-'])}{10**power:.3e}"
        assert main(["hertz", f"--{option}={value}"]) == 2
        told = capsys.readouterr()
        assert told.out == "" and told.err.startswith(f"python -m cases hertz: --{option} ") and told.err.count("\n") == 1


def test_the_empty_surroundings_of_a_punch_are_no_error(capsys):
    """Blocks ten times as wide as the punch: around one corner's edges there is nothing over the other's."""
    words = ("hertz --obstacle punch --contact microblock --P 1.45418e-07 --alpha 16.0308 --beta 0.00927023 --psi0-deg 6.107761 "
             "--punch-half-width 1.6965 --json -")
    assert main(words.split()) in (0, 1)
    printed = capsys.readouterr()
    if printed.out:
        assert json.loads(printed.out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))["states"]
    else:
        assert printed.err.count("\n") == 1


@pytest.mark.parametrize("result, place", [({"a": [1.0, {"b": math.nan}]}, "a.1.b"), ([math.inf], "0")])
def test_what_is_no_number_is_told_and_not_written(result, place, tmp_path):
    with pytest.raises(mb.NotConverged, match=place):
        write_json(tmp_path/"a.json", result)
    with pytest.raises(mb.NotConverged, match=place):
        json_text(result)
    assert not list(tmp_path.iterdir())


def all_but(*kinds):
    """Hostile values without those of some kinds, which an argument takes."""
    return [value for value in (None, "x", [], [1.0], {}, 1j, Fraction(1, 2), Decimal("0.5"), math.nan, -math.inf, -1, 10**400, True,
                                np.array([1.0, 2.0]), object(), float, b"a") if not isinstance(value, kinds or ())]


NUMBER, TEXT, PAIR = all_but(), all_but(str), all_but(np.ndarray)
MAYBE = [value for value in NUMBER if value is not None]
ENTRIES = {
    "E": (NUMBER, lambda it: mb.Cosserat(E=it, nu=0.3, ell=0.1, beta=1)),
    "nu": (NUMBER, lambda it: mb.Cosserat(E=1, nu=it, ell=0.1, beta=1)),
    "ell": (NUMBER, lambda it: mb.Cosserat(E=1, nu=0.3, ell=it, beta=1)),
    "solid": (NUMBER, mb.HalfPlane), "period": (NUMBER, lambda it: mb.PeriodicHalfPlane(SOLID, it)),
    "R": (NUMBER, mb.Cylinder), "slope": (NUMBER, mb.Wedge), "half_width": (NUMBER, mb.Punch),
    "amplitude": (NUMBER, lambda it: mb.Wave(it, 1.0)), "waves": (NUMBER, lambda it: mb.Rough(1.0, 0.1, waves=it)),
    "seed": (NUMBER, lambda it: mb.Rough(1.0, 0.1, seed=it)), "x": (PAIR, lambda it: mb.Profile(it, [0, 1])),
    "reading": (NUMBER, lambda it: mb.Microblock(0.0, it)), "law": (NUMBER, lambda it: mb.Contact(PLANE, CYLINDER, it)),
    "load": (NUMBER, LINE.at), "rtol": (NUMBER, lambda it: LINE.at(1.0, rtol=it)),
    "order": ([*MAYBE, "14", 2.5, 1, 0, 101], lambda it: LINE.at(1.0, order=it)),
    "near": ([*MAYBE, "x", 0], lambda it: LINE.at(1.0, near=it)),
    "path rtol": (NUMBER, lambda it: LINE.load(1.0, rtol=it)), "path load": (NUMBER, LINE.load),
    "coalescence": (NUMBER, LINE.coalescence),
    "window": (PAIR, lambda it: mb.GridContact(PLANE, CYLINDER, LAW, window=it)),
    "cells load": (NUMBER, lambda it: CELLS.at(it, nodes=64)), "nodes": ([*MAYBE, 31], lambda it: CELLS.at(1.0, nodes=it)),
    "start": (MAYBE, lambda it: CELLS.at(1.0, nodes=64, start=it)),
    "residual": (NUMBER, lambda it: CELLS.at(1.0, nodes=64, residual=it)), "prepared": (NUMBER, CELLS.prepare),
    "domain": (NUMBER, lambda it: mb.FittedContact(SOLID, CYLINDER, LAW, domain=it)),
    "fitted rtol": (NUMBER, lambda it: FITTED.at(1.0, rtol=it)), "fitted near": (MAYBE, lambda it: FITTED.at(1.0, near=it)),
    "fitted order": (NUMBER, lambda it: FITTED.of_order(1.0, it)),
    "spacing": (MAYBE, lambda it: FITTED.of_order(1.0, 2, it)), "count": (NUMBER, lambda it: FITTED.evenly(1.0, 2, it)),
    "h": (NUMBER, lambda it: uniform(h=it)), "reach": (NUMBER, lambda it: uniform(reach=it)),
    "uniform order": (NUMBER, lambda it: uniform(order=it)), "rho": (MAYBE, lambda it: uniform(method="al", rho=it)),
    "method": (NUMBER, lambda it: uniform(method=it)), "loads": (NUMBER, lambda it: uniform().states([it])),
    "body load": (NUMBER, PRESSED.at), "body rtol": (MAYBE, lambda it: PRESSED.at(0.5, rtol=it)),
    "body near": (MAYBE, lambda it: PRESSED.at(0.5, near=it)), "body path": (MAYBE, lambda it: PRESSED.load(0.5, rtol=it)),
    "boundary": (TEXT, lambda it: mb.BodyContact(BODY, CYLINDER, LAW, it)),
    "nodes of": (NUMBER, mb.Condensed), "facets": (NUMBER, lambda it: mb.Newton(BODY, it)),
    "facets' law": (NUMBER, lambda it: mb.ContactFacets(BODY, it, CYLINDER)),
    "facets' boundary": (TEXT, lambda it: mb.ContactFacets(BODY, LAW, CYLINDER, boundary=it)),
    "other loads": (NUMBER, lambda it: mb.Newton(BODY, FACETS, loads=it)), "control": (NUMBER, lambda it: mb.Newton(
        BODY, FACETS, control=it)), "Newton's rho": (MAYBE, lambda it: mb.Newton(BODY, FACETS, rho=it)),
    "level": (NUMBER, NEWTON.solve), "Newton's start": (MAYBE, lambda it: NEWTON.solve(0.5, start=it)),
    "levels": ([None, 1, 1j, math.nan, "x", ["x"]], lambda it: list(mb.load_path(NEWTON, it))),
    "ground": (NUMBER, lambda it: mb.Ground(10.0, it)), "far": (NUMBER, lambda it: mb.Ground(it, (0.0, 1.0))),
    "explored": (NUMBER, lambda it: mb.Explorer(it, 1.0)), "slider": (NUMBER, lambda it: EXPLORED.solve(load=it)),
    "psi0 slider": (NUMBER, lambda it: EXPLORED.solve(psi0=it)), "law slider": (NUMBER, lambda it: EXPLORED.solve(law=it)),
    "over": ([None, 1, 1j, math.nan], lambda it: mb.sweep(len, it)), "workers": (MAYBE, lambda it: mb.sweep(len, [], workers=it)),
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
    assert LINE.at(value, rtol=1e-2).load == 1


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
@pytest.mark.parametrize("height", [lambda x: x**2 + 0j, lambda x: np.array([object() for _ in x]), lambda x: None, lambda x: "a",
                                    lambda x: np.zeros((len(x), 2)), lambda x: [None]*len(x), raising(ZeroDivisionError()),
                                    raising(IndexError("no")), raising(RuntimeError("no")), raising(AttributeError("no"))])
def test_functions_that_give_no_numbers_are_refused(height):
    with pytest.raises(mb.BadArgument) as caught:
        mb.Contact(PLANE, height, LAW).at(1.0)
    assert caught.value.name == "obstacle"
    with pytest.raises(mb.BadArgument) as caught:
        mb.Contact(PLANE, CYLINDER, mb.Microblock(height)).at(1.0)
    assert caught.value.name == "psi0"


def test_a_height_that_fails_late_is_refused_as_well():
    def height(x):
        return x**2/20 if len(x) < 100 else x[10**9]

    with pytest.raises(mb.BadArgument, match="IndexError"):
        mb.Contact(PLANE, height, LAW).at(1.0)


@pytest.mark.parametrize("height", [lambda x: list(np.asarray(x)**2/20),
                                    lambda x: np.array([Fraction(float(one))**2/20 for one in x], dtype=object)])
def test_heights_that_return_lists_or_fractions_are_heights(height):
    found, known = (mb.Contact(PLANE, each, mb.Unilateral()).at(1.0, rtol=1e-3) for each in (height, CYLINDER))
    assert found.all_zones[0][0] == pytest.approx(known.all_zones[0][0], rel=2e-3)      # two estimates below 1e-3
