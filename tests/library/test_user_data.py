"""Data of users: samples, masks, holes, periods given on any window, files of instruments, noise."""

import json
import pickle
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured3DMesh
from scipy.interpolate import CubicSpline, RegularGridInterpolator, UnivariateSpline
from scipy.optimize import brentq

import microblock as mb
from microblock.data.samples import read_profile, read_samples
from microblock.errors import real_numbers
from microblock.fem import fitted_mesh
from microblock.halfplane import zone_path
from microblock.halfplane.zone_path import ZonePath
from tests.parts import ELASTIC, SOLID

X = np.linspace(-1, 1, 21)
PARABOLA = mb.Obstacle.from_samples(X, X**2 / 20)
PLACES = [
    (mb.HalfPlane(SOLID), (), mb.Unilateral()),
    (mb.HalfPlane(SOLID), (mb.Cells(512),), mb.Microblock()),
    (mb.Block(SOLID, 6.0), (mb.Uniform(h=0.1),), mb.Microblock()),
]


def warned(state, words):
    return sum(words in warning for warning in state.warnings)


@pytest.mark.parametrize(("body", "method", "law"), PLACES)
def test_a_contact_that_reaches_the_last_sample_says_so(body, method, law):
    def samples_reached(load, obstacle=PARABOLA):
        return warned(mb.Contact(body, obstacle, law, *method).solve(load=load), "last sample")

    assert (samples_reached(3.0), samples_reached(12.0)) == (0, 2)
    # a level face has sharp edges that are meant, as a Punch
    face = mb.Obstacle.from_samples([-1.0, 0.1, 1.0], [0.01, 0.01, 0.01])
    assert samples_reached(3.0, face) == samples_reached(3.0, mb.Punch(1.0)) == 0
    # samples over a whole period have no last one
    wave = mb.Obstacle.from_samples(X, -0.001 * np.cos(np.pi * X))
    closed = mb.Contact(mb.HalfPlane(SOLID, period=2.0), wave, law, mb.Cells(64)).solve(load=9.0)
    assert closed.zones["contact"] == [(-1.0, 1.0)] and not warned(closed, "last sample")


@pytest.mark.parametrize(("body", "method", "law"), PLACES)
def test_kinks_between_samples_are_named_with_a_curve_that_has_none(body, method, law):
    def sentences(obstacle, load=3.0):
        state = mb.Contact(body, obstacle, law, *method).solve(load=load)
        return [words for words in state.warnings if words.startswith("straight lines")]

    (words,) = sentences(PARABOLA)
    assert "21 samples" in words and "unbounded at 1" in words and "CubicSpline(x, z)" in words
    assert not sentences(mb.Obstacle(CubicSpline(X, X**2 / 20)))
    # heights on one line within rounding have no kinks
    assert not sentences(mb.Obstacle.from_samples(X, 0.01 * X + 0.3))


CUBE = MakeStructured3DMesh(hexes=False, nx=2, mapping=lambda x, y, z: (x, y, z - 1))
CUBOID = mb.Body(CUBE, SOLID, 1, fixed="bottom", contact="top")


def test_the_advised_height_presses_a_body_in_space():
    state = mb.Contact(CUBOID, lambda x, y: x**2 / 20 + 0 * y, mb.Microblock()).solve(approach=0.001)
    assert state.load > 0


class TwoWedges:
    even = True

    def height(self, x):
        return 0.02 * np.abs(np.abs(x) - 1)


@pytest.mark.parametrize(
    "most", [1100, pytest.param(900, marks=pytest.mark.nightly)]
)  # the levels need 1000 nodes and 1300
def test_levels_out_of_reach_say_what_the_ones_before_reached(most, monkeypatch):
    """Also where not even the first of these fits; and a block of a size is not sent to a half-plane."""
    monkeypatch.setattr(fitted_mesh, "MOST_NODES", most)
    problem = mb.Contact(mb.Block(SOLID, 4.0), TwoWedges(), mb.Unilateral())
    with pytest.raises(mb.NotConverged, match="larger rtol, or take a Body on a mesh") as caught:
        problem.solve(load=1.0, rtol=1e-4)
    assert 1e-4 < caught.value.rtol_reached < 1e-2
    assert problem.solve(load=1.0, rtol=caught.value.rtol_reached).error_estimate


def test_a_refusal_comes_without_the_tracebacks_of_what_was_tried():
    with pytest.raises(mb.NotConverged) as caught:
        mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0, rtol=1e-14)
    failure = caught.value
    assert failure.rtol_reached and failure.__cause__ is None and failure.__suppress_context__


# --- what users hand over as heights: masks, holes, arrays of every kind, and a period given on any window


PLANE, LAW = mb.HalfPlane(ELASTIC), mb.Unilateral()
BLOCKS = mb.Cosserat(100, 0.3, beta=1, ell=0.01)
PLACES_X = np.linspace(-1, 1, 201).round(2)
Z = PLACES_X**2 / 20


def samples(z, x=PLACES_X):
    return mb.Obstacle.from_samples(x, z)


def masked(x):
    return np.ma.masked_where(abs(x) > 0.2, x**2 / 20)


MESH = mb.Block(BLOCKS, 4.0)


@pytest.mark.parametrize(
    "body, method",
    [
        (mb.HalfPlane(BLOCKS), mb.Cells(nodes=256, window=(-1, 1))),
        (mb.HalfPlane(BLOCKS, period=1.0), mb.Cells(nodes=64)),
        (MESH, mb.Uniform(h=0.2)),
        (MESH, mb.Fitted(order=2)),
    ],
)
@pytest.mark.parametrize("second", [False, True])
def test_a_mask_is_no_obstacle_for_every_body(body, method, second):
    """Of rigid and of deformable obstacles."""
    if second and body is MESH:
        pytest.skip("a block takes no second half-plane")
    cut = [masked, lambda x: np.where(abs(x) > 0.2, np.inf, x**2 / 20)]
    if second:
        cut = [mb.Deformable(body, height) for height in cut]
    states = [mb.Contact(body, obstacle, mb.Microblock(), method).solve(0.5) for obstacle in cut]
    assert np.array_equal(states[0].pressure, states[1].pressure)


@pytest.mark.parametrize("value", [np.inf, np.nan, None, "mask"])
def test_samples_have_holes(value):
    """A fill value became a spike; a straight line joins neighbours that are both there."""
    z = (
        np.ma.masked_where(abs(PLACES_X) < 0.095, Z)
        if value == "mask"
        else np.where(abs(PLACES_X) < 0.095, value, Z)
    )
    obstacle = samples(z)
    places = np.array([-1.1, -0.105, -0.1, -0.099, 0.0, 0.1, 0.101])
    beside = obstacle.height(places)
    assert np.isinf(beside).tolist() == [True, False, False, True, True, False, False]
    assert beside[1] == pytest.approx((0.1**2 + 0.11**2) / 40)  # the middle of a straight line
    state = mb.Contact(PLANE, obstacle, LAW, mb.Cells(nodes=2000)).solve(1.0)
    (first, second) = state.zones["contact"]
    assert (first[1], second[0]) == (pytest.approx(-0.1, abs=1e-3), pytest.approx(0.1, abs=1e-3))  # cells
    missing = np.isscalar(value) and value not in ("mask", np.inf) or value is None
    assert sum("19 of 201 heights are NaN" in words for words in state.warnings) == missing
    assert sum("reaches the last sample at x = 0.1," in words for words in state.warnings) == 1


def test_masked_entries_in_a_list_and_samples_beside_two_holes():
    values = list(np.ma.masked_equal([0.3, 9.0, 0.1, 9.0, 0.0, 0.0, 0.2], 9.0))
    obstacle = mb.Obstacle.from_samples(range(7), values)
    above = obstacle.height(np.array([0.0, 2.0, 4.0, 5.5, 6.0]))
    assert above.tolist() == [np.inf, np.inf, 0.0, 0.1, 0.2]
    assert obstacle.ends == (4.0, 6.0)
    with pytest.raises(mb.BadArgument, match="two neighbours"):
        mb.Obstacle.from_samples([0, 1, 2], [0, np.nan, 1])


@pytest.mark.parametrize(
    "holes, law",
    [
        ([(-0.1, 0.1)], mb.Unilateral()),
        ([(-0.1, 0.1)], mb.Microblock()),
        ([(0.1, 0.2)], mb.Unilateral()),
        ([(-0.05, 0.05), (0.18, 0.22), (-9, -0.3)], mb.Unilateral()),
        ([(0.75, 0.85)], mb.Microblock()),
    ],
)
def test_panels_follow_obstacles_of_several_pieces(holes, law):
    """They refused each hole, also where nothing touches."""

    def height(x):
        return np.where([any(a < place < b for a, b in holes) for place in x], np.inf, x**2 / 20)

    problem = mb.Contact(mb.HalfPlane(mb.Cosserat(100, 0.3, beta=1, ell=0.1)), height, law)
    state = problem.solve(1.0, rtol=1e-5)
    cells = problem.with_(method=mb.Cells(nodes=4096, window=(-0.5, 0.5))).solve(1.0)
    assert state.method == "panels" and state.error_estimate <= 1e-5
    # edges to two cells, and half a cell beside each end, where pressures have no bound
    assert np.allclose(state.zones["contact"], cells.zones["contact"], atol=2 / 4096)
    x = np.linspace(-0.33, 0.33, 67) + 1e-3
    apart = np.min([abs(x - edge) for edge in np.ravel(cells.zones["contact"])], axis=0) > 0.02
    assert np.allclose(state.pressure_at(x[apart]), cells.pressure_at(x[apart]), atol=0.02)


def test_a_hole_that_nothing_touches_changes_nothing():
    plain = mb.Contact(PLANE, samples(Z), LAW, mb.Cells(nodes=512, window=(-0.9, 0.9)))
    holed = plain.with_(obstacle=samples(np.where(abs(PLACES_X - 0.8) < 0.05, np.nan, Z)))
    first = plain.solve(1.0).pressure
    second = holed.solve(1.0).pressure
    assert np.allclose(first, second, atol=1e-4 * first.max())  # residuals of cells


def test_numbers_of_every_kind_are_numbers():
    pandas = pytest.importorskip("pandas", reason="the extra `report` brings it")
    x = [-1, 0, 1]
    expected = mb.Obstacle.from_samples([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0])
    series = pandas.Series([-1, 0, 1], index=[7, 3, 5])
    for abscissae in (
        x,
        tuple(x),
        np.int8(x),
        np.float16(x),
        np.float32(x),
        np.array(x, object),
        series,
        range(-1, 2),
    ):
        z = np.abs(np.asarray(abscissae, float))
        assert mb.Obstacle.from_samples(abscissae, z) == expected
        assert mb.Obstacle.from_samples(series[::-1], z[::-1]) == expected  # from right to left
    assert real_numbers(pandas.Series([1, None], dtype="Int64"))[0] == 1.0


@pytest.mark.parametrize(
    "make",
    [
        lambda z: mb.Obstacle.from_samples([0, 1, 2], z[0]),
        lambda z: mb.Rough.from_heights(z[0], 1.0),
        lambda z: mb.RoughSurface.from_heights(z, 1.0),
    ],
)
def test_unsigned_heights_are_refused(make):
    """-z of what a camera measured from above, 8 bits a height, was an obstacle 253 high without a word."""
    z = np.array([[1, 2, 3], [3, 4, 5]], np.uint8)
    with pytest.raises(mb.BadArgument, match="must not be unsigned integers"):
        make(-z)
    make(-z.astype(float))


@pytest.mark.parametrize("mark, unit", [(-9999, 1.0), (-32768, 2e4), (1.70141e38, 1.0)])
@pytest.mark.parametrize(
    "make", [lambda z: mb.Rough.from_heights(z.ravel(), 1.0), lambda z: mb.RoughSurface.from_heights(z, 1.0)]
)
def test_numbers_that_mark_holes_are_refused(make, mark, unit):
    """A hole of -9999 was the place of contact without a word; heights about 9999 are no marks."""
    z = unit * np.array([[0.1, 0.2, 0.3], [0.3, 0.4, 0.5]])
    z[1, 2] = mark
    with pytest.raises(mb.BadArgument, match="stands in 1 places, .* make them NaN"):
        make(z)
    z[1, 2] = np.nan
    make(z)
    make(np.array([[9990, 9999, 10008], [9999, 9995, 9991]]))


L = 1.0


def profile(x):
    return 0.002 * (1 - np.cos(2 * np.pi * (x - 0.2))) + 0.0007 * np.sin(4 * np.pi * x)


@pytest.mark.parametrize("start", [-0.5, 0.0, 0.3, 7.3, 1e3])
@pytest.mark.parametrize("part", [slice(None), slice(-1), slice(1, None)])
@pytest.mark.parametrize("second", [False, True])
def test_samples_of_a_period_lie_in_any_window(start, part, second):
    """With both ends or one, rigid and deformable; [0, L] was refused."""
    half_plane = mb.HalfPlane(BLOCKS, period=L)

    def state(x):
        obstacle = samples(profile(x), x)
        obstacle = mb.Deformable(half_plane, obstacle) if second else obstacle
        return mb.Contact(half_plane, obstacle, mb.Microblock(), mb.Cells(128)).solve(0.2)

    expected = state(-0.5 + np.linspace(0, L, 41))
    answer = state((start + np.linspace(0, L, 41))[part])
    # samples a multiple of a spacing apart are the same places, 1e3 to thirteen digits of the heights
    if abs(start * 40 - round(start * 40)) < 1e-9:
        assert np.allclose(answer.pressure, expected.pressure, atol=1e-8 * expected.pressure.max())
    assert np.allclose(answer.zones["contact"], expected.zones["contact"], atol=2 / 128)  # two cells
    assert not any("last sample" in words for words in answer.warnings)


@pytest.mark.parametrize("start", [-0.5, -1.0, 0.0, 0.3])
@pytest.mark.parametrize("closed", [False, True])
def test_heights_with_ends_lie_in_any_window_of_a_period(start, closed):
    def height(x):
        beyond = (x > start + L) if closed else (x >= start + L)
        return np.where((x < start) | beyond, np.inf, profile(x))

    problem = mb.Contact(mb.HalfPlane(BLOCKS, period=L), profile, mb.Microblock(), mb.Cells(128))
    expected = problem.solve(0.2)
    answer = problem.with_(obstacle=height).solve(0.2)
    assert np.allclose(
        answer.pressure, expected.pressure, atol=1e-9 * expected.pressure.max()
    )  # rounding of x


@pytest.mark.parametrize("start", [(-0.5, -0.5), (0.0, 0.0), (0.3, -1.0)])
def test_maps_lie_in_any_window_of_a_period(start):
    axes = [first + np.linspace(0, L, 33) for first in start]
    heights = [profile(axis) for axis in axes]
    plane = RegularGridInterpolator(axes, np.add.outer(*heights), bounds_error=False, fill_value=np.nan)
    line = mb.HalfSpace(BLOCKS, period=L)
    problem = mb.Contact(
        line, lambda x, y: np.ma.masked_invalid(plane((x, y))), mb.Microblock(), mb.Cells(32)
    )
    expected = problem.with_(obstacle=lambda x, y: profile(x) + profile(y)).solve(0.05)
    # straight lines between samples of a wave of 32: 2 pi^2/32^2/8 of its amplitude
    assert problem.solve(0.05).contact_area == pytest.approx(expected.contact_area, rel=0.05)


@pytest.mark.parametrize("period, length", [(0.9, 1.0), (0.7, 2.0), (1.5, 2.0)])
def test_samples_wider_than_a_period_repeat_or_are_refused(period, length):
    """The middle was cut out without a word, and valleys of the rest were lost."""
    x = np.linspace(0.0, length, 129)
    samples = mb.Obstacle.from_samples(x, 0.01 * (1 - np.cos(2 * np.pi * x)))
    ground = mb.HalfPlane(mb.Elastic(E=100, nu=0.3), period=1.0)
    whole = mb.Contact(ground, samples, mb.Unilateral(), mb.Cells(nodes=128)).solve(load=0.1)
    assert whole.half_width == pytest.approx(0.0544, abs=1 / 128)  # Westergaard's, to a cell
    with pytest.raises(mb.BadArgument, match=f"must repeat with the period, {period}"):
        mb.Contact(mb.HalfPlane(ground.solid, period=period), samples, mb.Unilateral())


def test_maps_wider_than_a_period_repeat_or_are_refused():
    places = np.abs(np.arange(-20, 21.0))
    ridges = mb.RoughSurface.from_heights(-0.001 * np.minimum.outer(places, places), 0.03)
    ground = mb.HalfSpace(mb.Elastic(E=100, nu=0.3), period=1.0)
    with pytest.raises(mb.BadArgument, match="must repeat with the period"):
        mb.Contact(ground, ridges, mb.Unilateral())
    mb.Contact(ground, mb.Sphere(R=10), mb.Unilateral())  # of a formula the period is cut out


def test_a_profile_as_steep_as_heights_in_the_wrong_unit_is_named():
    """The user was told of an argument "matrix", which rounding had made indefinite."""
    ground = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1))
    steep = mb.Obstacle.from_samples([0.0, 0.2, 0.3, 0.5], [-93.3, -76.0, -64.4, -49.8])
    with pytest.raises(mb.NotConverged, match="too narrow beside the obstacle"):
        mb.Contact(ground, steep, mb.Microblock(), mb.Panels()).solve(load=1.0)


def test_the_methods_of_a_period_are_said_to_be_its_own():
    """Panels, the default of a half-plane, "must be Cells() on a HalfPlane"."""
    ground = mb.HalfPlane(mb.Elastic(E=100, nu=0.3), period=1.0)
    with pytest.raises(mb.BadArgument, match=r"must be Cells\(\) on a HalfPlane with a period"):
        mb.Contact(ground, mb.Cylinder(R=10), mb.Unilateral(), mb.Panels())


def test_pads_narrower_than_a_period_are_the_same_wherever_they_lie():
    problem = mb.Contact(mb.HalfPlane(BLOCKS, period=L), mb.Punch(0.2), mb.Microblock(), mb.Cells(128))
    pad = problem.with_(obstacle=mb.Obstacle.from_samples([0.3, 0.5, 0.7], [0, 0, 0]))
    first, second = problem.solve(0.1), pad.solve(0.1)
    # half a period apart, up to rounding
    assert np.allclose(first.pressure, np.roll(second.pressure, 64), atol=1e-9 * first.pressure.max())
    assert second.error_estimate == pytest.approx(first.error_estimate, rel=1e-6)


# --- text files of instruments: what is read of them, what is said of it, and what is left to be settled


FILE_X = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
FILE_Z = np.array([0.5, 0.125, 0.0, 0.125, 0.5])


def rows(separator, decimal=".", scale=(1, 1), end="\n", more=lambda i: ()):
    """Lines of x and z, in parts of their unit, and more cells."""
    lines = []
    for i, pair in enumerate(zip(FILE_X, FILE_Z)):
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
        "um",
        "height from column 2 (nm)",
    ),
    "Dektak with more separators below than above": (
        "Scan Data\nLateral um,Raw Micrometer,\n" + rows(",", scale=(1e3, 1e3), more=lambda i: ["", ""]),
        "latin-1",
        "um",
        "height from column 2 (um)",
    ),
    "units of axes": (
        "Horizontal unit: mm\nVertical unit: um\n" + rows(",", scale=(1, 1e3)),
        "utf-8",
        "mm",
        "height from column 2 (um)",
    ),
    "units in words": (
        "x (millimetres),z (nanometers)\n" + rows(",", scale=(1, 1e6)),
        "utf-8",
        "mm",
        "height from column 2 (nm)",
    ),
    "Alicona": ("Profile path [m]; height [m]\n" + rows(";", scale=(1e-3, 1e-3)), "utf-8", "m", "taken in m"),
    "KLA Tencor": (
        "Scan Type: 2D\n12:33:01 05-12-21\n#\tx(um)\tz(A)\n"
        + "".join(f"{i}\t{x * 1e3:g}\t{z}\n" for i, (x, z) in enumerate(zip(FILE_X, FILE_Z))),
        "ascii",
        None,
        "",
    ),
    "Zygo": ("Distance (mm),Height (nm)\n" + rows(",", scale=(1, 1e6)), "utf-8", "mm", "(nm)"),
    "Gwyddion": ("# x [m]  y [m]\n" + rows(" ", scale=(1e-3, 1e-3)), "utf-8", "m", "taken in m"),
    "Keyence": (
        '"Date","2021/05/12"\r\n"X [mm]","Z [µm]"\r\n'
        + "".join(f'"{x:.3f}","{z * 1e3:.3f}"\r\n' for x, z in zip(FILE_X, FILE_Z)),
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
        "x,y,z\n" + "".join(f"0.25,{x},{z}\n" for x, z in zip(FILE_X, FILE_Z)),
        "ascii",
        None,
        "x from column 2",
    ),
    "Mahr": (rows("\t", ",", end="\r\n") + "\x1a", "latin-1", None, "5 samples"),
    "Jenoptik": ("Länge / mm;Höhe / mm\r\n" + rows(";", ",", end="\r\n"), "latin-1", "mm", "taken in mm"),
    "Sensofar": (
        "No,x (um),z (um)\n"
        + "".join(f"{i},{x * 1e3},{z * 1e3}\n" for i, (x, z) in enumerate(zip(FILE_X, FILE_Z))),
        "utf-16-le",
        "um",
        "x from column 2 (um)",
    ),
    "Mountains": ("% Axis units: µm\n%\n" + rows("   ", scale=(1e3, 1e3)), "utf-8", "um", "taken in um"),
    "a spreadsheet": (
        '"x";"z"\n' + "".join(f'"{x}";"{z}"\n'.replace(".", ",") for x, z in zip(FILE_X, FILE_Z)),
        "utf-8",
        None,
        "5 samples",
    ),
    "from right to left": (
        "x,height\n" + "".join(f"{x},{z}\n" for x, z in zip(FILE_X[::-1], FILE_Z)),
        "utf-8",
        None,
        "5 samples",
    ),
}
DOUBTFUL = {  # text: (option of the reader, words of the refusal)
    FILES["KLA Tencor"][0]: ({"columns": ("2:um", "3:mm")}, "2:mm 3:um"),
    "x,raw,filtered\n" + rows(",", more=lambda i: [str(i * i)]): ({"columns": (1, "raw")}, "columns"),
    "Lateral um Raw Profile nm\n" + rows(" "): ({"columns": ("1:um", "2:nm")}, "names nm and um above"),
    "x-unit mm, z-unit um\nx,z\n" + rows(","): ({"columns": ("1:mm", "2:um")}, "names mm and um above"),
    ",height\n0,0.5\n1,0\n2,0.5\n": ({"columns": (1, 2)}, "counts its rows"),
    "Unit: mm/um\n" + rows(","): ({"columns": ("1:mm", "2:um")}, "names mm and um above"),
    "x (10^-6 m),z (m)\n" + rows(","): ({"columns": ("1:um", "2:m")}, "a number in the unit of 'x"),
    "x (mm),z\n" + rows(","): ({"columns": ("1:mm", "2:mm")}, "1:mm 2:um"),
    "7 0\n8 0 0\n" + rows(" "): ({"skip": 2}, "skip 2"),
    "0, low\n" + rows(","): ({"skip": 1}, "skip 1"),
    "-1,0,1,5\n0,0,0,0\n1,0,1,5\n": ({"columns": (1, 3)}, "decimal signs"),
}
NO_PROFILE = {
    b"": "no two columns",
    b"x, height\n": "no two columns",
    b"x, z\n-, -\n": "no two columns",  # was a ValueError of max
    b"1\n2\n3\n": "x is missing",
    b"0, 0\n1, high\n2, 1": "'1, high' in line 2",
    b"0, 0\n1, 1\n2, 1, 5": "line 3",
    b"0, 0\n1, inf\n": "line 2",
    b"0, 0\n1, 1e99\n": "line 2",
    b"0, 0\n2, 1\n1, 2\n": "sort it, average duplicates",
    b"0, 0\n0, 1\n": "average duplicates",
    b"0, 0\n": "at least two numbers",
    b"# Width: 6 mm\n2 1 0 0\n1 0 0 0\n0 0 0 0\n": "height maps are read by RoughSurface.from_file",
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
    part = {"mm": 1, "um": 1e3, "m": 1e-3, None: 1}[unit]
    assert profile.unit == unit and words in "; ".join(profile.understood)
    assert np.allclose(np.sort(profile.x[:5]), part * FILE_X, rtol=1e-6)  # the text has seven digits
    assert np.allclose(profile.z[:5], part * FILE_Z, rtol=1e-6)


@pytest.mark.parametrize("text", DOUBTFUL)
def test_what_could_be_read_in_several_ways_is_settled_by_the_option_that_is_named(text, written):
    options, words = DOUBTFUL[text]
    with pytest.raises(mb.BadArgument, match=words):
        read_samples(written(text))
    assert read_samples(written(text), **options).x


@pytest.mark.parametrize("content", NO_PROFILE)
def test_what_holds_no_profile_is_refused(content, written):
    with pytest.raises(mb.BadArgument, match="path = ") as caught:
        read_samples(written(content))
    assert NO_PROFILE[content] in str(caught.value)


def test_missing_heights_are_holes_and_rows_without_x_are_left_out(written):
    file = written("x\tz\n-1\t0.5\n-0.5\tNo Data\n***\t3\n0\t0\n0.5\t\n0.75\t0.2\n1\t0.5\n")
    profile = read_profile(file)
    assert (
        profile.x.tolist() == [-1, -0.5, 0, 0.5, 0.75, 1]
        and "rows without x left out: 1" in profile.understood
    )
    assert np.isnan(profile.z).tolist() == [False, True, False, True, False, False]
    assert np.isinf(read_samples(file).height(np.array([-0.25, 0.25, 0.8]))).tolist() == [True, True, False]


def test_lines_above_and_below_the_rows_are_counted(written):
    profile = read_profile(written("scan\nx\tz\n-1\t0.5\n0\t0\n1\t0.5\nend of the scan\n"))
    assert profile.understood[-2:] == ["lines above left out: 2", "lines below left out: 1"]


def test_lengths_are_brought_to_the_unit_that_is_asked_for(written):
    file = written(*FILES["Zygo"][:2])
    assert np.allclose(read_profile(file, unit="um").x, 1e3 * FILE_X)
    assert np.allclose(read_profile(file, unit="m").z, 1e-3 * FILE_Z)
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
    result = answer(words)
    assert result["parameters"]["understood"][0] == "5 samples" and result["parameters"]["unit"] == "mm"
    expected = mb.Contact(
        mb.HalfPlane(mb.Cosserat(100, 0.3, beta=1, ell=0.1)),
        mb.Obstacle.from_samples(FILE_X, FILE_Z),
        mb.Unilateral(),
    ).solve(1.0, rtol=1e-3)
    assert result["states"][0]["half_width"] == pytest.approx(expected.half_width, rel=1e-6)  # seven digits
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


# --- samples with noise on cells, and events that cells follow


GROUND = mb.HalfPlane(SOLID)


def error(state, exact):
    """Relative error of the pressure in L2 at the points of an exact state."""
    missing = state.pressure_at(exact.x) - exact.pressure
    return np.sqrt(exact.weights @ missing**2 / (exact.weights @ exact.pressure**2))


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Unilateral()])
def test_cells_have_the_logarithm_of_a_slope_discontinuity(law):
    problem = mb.Contact(GROUND, mb.Wedge(slope=0.02), law)
    cells = problem.with_(method=mb.Cells(nodes=2048, window=(-1, 1))).solve(load=1.0)
    # a polygon through the centres alone misses 2e-2, and cells without corrected gaps 5e-3
    assert error(cells, problem.solve(load=1.0, rtol=1e-6)) < 3e-3


def sampled(count, size=0.0, noise=None):
    x = np.linspace(-3, 3, count)
    z = x**2 / 20 + size * np.random.default_rng(1).standard_normal(count)
    return mb.Contact(GROUND, mb.Obstacle.from_samples(x, z, noise), mb.Microblock(), mb.Cells())


def sampling_uncertainty(state):
    (words,) = [sentence for sentence in state.warnings if "uncertain by" in sentence]
    return float(words.split("uncertain by ")[1].split(":")[0])


@pytest.mark.parametrize(
    "count, size, noise",
    [(100, 0.0, None), (300, 0.0, None), (100, 3e-4, None), (100, 3e-4, 3e-4), (1000, 1e-5, 1e-5)],
)
def test_samples_say_how_uncertain_they_leave_the_pressure(count, size, noise):
    exact = mb.Contact(GROUND, mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0, rtol=1e-5)
    state = sampled(count, size, noise).solve(load=1.0, rtol=1e-3)
    # the pressure of what was sampled, which smooth curves and all noise of that size share
    assert error(state, exact) < sampling_uncertainty(state) < 12 * error(state, exact)


def test_the_noise_counts():
    # of a smooth profile every second sample shows none
    quiet, noisy = (sampled(1000, 0.0, noise).solve(load=1.0, rtol=1e-3) for noise in (None, 1e-4))
    assert sampling_uncertainty(noisy) > 5 * sampling_uncertainty(quiet)
    warnings = sampled(10001).solve(load=1.0, rtol=1e-3).warnings
    assert not any("uncertain by" in words for words in warnings)


@pytest.mark.parametrize("count, size", [(1000, 1e-5), (2000, 1e-4)])
def test_cells_stop_below_the_sampling_uncertainty_or_say_that_all_is_noise(count, size):
    state = sampled(count, size, size).solve(load=1.0, rtol=1e-3)
    (words,) = [sentence for sentence in state.warnings if "cells stop at an error" in sentence]
    assert ("those of noise" in words) == (sampling_uncertainty(state) > 0.5)
    assert state.error_estimate <= sampling_uncertainty(state) or "those of noise" in words
    # where the contact ends and the work do not depend on noise that is small beside the approach of 6e-3
    smooth = sampled(count).solve(load=1.0, rtol=1e-3)
    assert abs(state.half_width - smooth.half_width) < 2e-2 * smooth.half_width
    assert abs(state.energy - smooth.energy) < 2e-2 * abs(smooth.energy)


def test_exhausted_data_are_told_by_a_flag():
    """The words of a note were read."""
    noisy = sampled(100, 3e-4).solve(load=1.0, rtol=1e-3)
    smooth = mb.Contact(GROUND, mb.Cylinder(R=10), mb.Microblock(), mb.Cells()).solve(load=1.0, rtol=0.1)
    assert sampling_uncertainty(noisy) > 0 and noisy.solution.data_exhausted
    assert not replace(smooth.solution, notes=("the samples leave nothing open",)).data_exhausted


def test_samples_know_their_kinks_once():
    """A sequence of a million was formed each time that one of them was read."""
    samples = mb.Obstacle.from_samples(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9) ** 2)
    for name in ("kinks", "jumps", "ends"):
        assert getattr(samples, name) is getattr(samples, name)
    assert pickle.loads(pickle.dumps(samples)) == samples


def test_noise_that_stops_cells_is_said_once_with_a_curve_that_is_answered():
    """A smaller rtol was advised beside, and CubicSpline(x, z), which was not done within a minute."""
    x = np.linspace(-1, 1, 400)
    z = x**2 / 20 + 2e-4 * np.random.default_rng(1).standard_normal(400)
    problem = mb.Contact(GROUND, mb.Obstacle.from_samples(x, z), mb.Microblock())
    for rtol in (None, 0.1):
        words = problem.solve(load=1.0, rtol=rtol).warnings
        assert ["error" in sentence for sentence in words].count(True) == 1
        assert "cells stop at an error" in words[-1]
    fit, obstacle = re.search(r"noise (Univ.*\)), and then (Obstacle.*)", words[-2]).groups()
    curve = eval(fit, {"UnivariateSpline": UnivariateSpline, "noise": 2e-4, "x": x, "z": z})
    smooth = eval(obstacle, {"Obstacle": mb.Obstacle, "np": np, "curve": curve, "x": x})
    state = problem.with_(obstacle=smooth).solve(load=1.0)
    exact = problem.with_(obstacle=mb.Cylinder(R=10)).solve(load=1.0)
    # noise of 2e-4 over some 6 coefficients of 400: 2e-5 of height beside 6e-3 of approach
    assert not state.warnings and error(state, exact) < 1e-2


RIPPLES = {
    "valleys": lambda x: x**2 / 20 + 3e-4 * np.cos(2 * np.pi * x / 0.25 + 0.4),
    "cylinder": mb.Cylinder(R=10),
}


@pytest.mark.parametrize(
    "obstacle, law, last",
    [
        ("valleys", mb.Unilateral(), 1.0),
        pytest.param("valleys", mb.Microblock(), 1.5, marks=pytest.mark.nightly),
        ("cylinder", mb.Microblock(psi0=0.01), 1.0),
    ],
)
def test_cells_see_the_events_of_panels(obstacle, law, last):
    problem = mb.Contact(GROUND, RIPPLES[obstacle], law)
    cells, panels = (
        [event for event in problem.with_(method=method).path(load=last).events if event.load > last / 1000]
        for method in (mb.Cells(), mb.Panels())
    )
    key = lambda event: (event.kind, event.zone, round(event.x, 1))  # noqa: E731
    assert sorted(map(key, cells)) == sorted(map(key, panels))
    for by_cells, by_panels in zip(sorted(cells, key=key), sorted(panels, key=key)):
        assert abs(by_cells.load - by_panels.load) <= by_cells.load_error + by_panels.load_error
        assert by_cells.load_error < by_cells.load / 2


def test_a_wave_closes_on_a_period_as_westergaards():
    solid, amplitude = mb.Elastic(E=100, nu=0.3), 1e-3
    wave = mb.Contact(mb.HalfPlane(solid, period=2.0), mb.Wave(amplitude, 1.0), mb.Unilateral(), mb.Cells())
    full = 2 * np.pi * solid.E_star * amplitude  # load of two waves, pi E* amplitude/wavelength each
    *born, event = wave.path(load=1.1 * full).events
    assert [(event.kind, abs(round(event.x, 2))) for event in born] == [("born", 1.0), ("born", 0.0)]
    assert (event.kind, event.zone) == ("merged", "contact")
    # cells of 1/2048 of a wave
    assert abs(event.load - full) <= event.load_error < 1e-3 * full


def test_a_second_sphere_touches_where_hertz_and_boussinesq_say():
    apart = 0.6
    lower = 0.004
    solid = mb.Cosserat(E=100, nu=0.3, ell=1e-3, beta=1)
    two = lambda x, y: np.minimum((x + 0.3) ** 2 + y**2, (x - 0.3) ** 2 + y**2 + 2 * lower) / 2  # noqa: E731
    path = mb.Contact(mb.HalfSpace(solid), two, mb.Unilateral(), mb.Cells(nodes=128)).path(load=0.06)
    # of the radius 1: approach of Hertz less the displacement under the other
    E = solid.E_star
    birth = brentq(lambda P: (9 * P**2 / (16 * E**2)) ** (1 / 3) - P / (np.pi * E * apart) - lower, 1e-6, 1)
    first, second = path.events
    assert (first.load, first.kind, second.kind) == (0.0, "born", "born")
    assert abs(second.load - birth) <= second.load_error < 0.05 * birth
    assert second.x == pytest.approx(0.3, abs=0.01)  # a cell


def test_panels_with_wrong_zones_leave_the_path_to_cells(monkeypatch):
    monkeypatch.setattr(zone_path, "SCAN_TOLERANCE", -1.0)  # no zones are right then
    samples = mb.Obstacle.from_samples([-1, -0.6, -0.2, 0.2, 0.6, 1.0], [0.08, 0.012, 0, 0.006, 0.02, 0.1])
    path = ZonePath(mb.Contact(GROUND, samples, mb.Microblock()).solver, 1.0, None)
    assert any("cells instead of panels" in words for words in path.warnings)
    # B is pressed below the second valley from 0.828 on, as states of panels before and after it say
    zones = [
        len(mb.Contact(GROUND, samples, mb.Microblock()).solve(load=P).zones["B"]) for P in (0.82, 0.835)
    ]
    assert zones == [1, 2]
    assert any(event.zone == "B" and 0.82 < event.load < 0.835 for event in path.events)
