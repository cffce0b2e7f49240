"""What users hand over as heights: masks, holes, arrays of every kind, and a period given on any window."""

import datetime

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import microblock as mb
from microblock.errors import real_numbers

CLASSICAL = mb.Elastic(100, 0.3)
PLANE, LAW = mb.HalfPlane(CLASSICAL), mb.Unilateral()
BLOCKS = mb.Cosserat(100, 0.3, beta=1, ell=0.01)
X = np.linspace(-1, 1, 201).round(2)
Z = X**2 / 20


def samples(z, x=X):
    return mb.Obstacle.from_samples(x, z)


def masked(x):
    return np.ma.masked_where(abs(x) > 0.2, x**2 / 20)


def test_a_mask_is_no_obstacle_along_a_line():
    """The height under the mask was taken: half-width .3404."""
    problem = mb.Contact(PLANE, masked, LAW)
    state = problem.solve(1.0)
    cut = problem.with_(obstacle=lambda x: np.where(abs(x) > 0.2, np.inf, x**2 / 20)).solve(1.0)
    assert state.half_width == pytest.approx(0.2, abs=1e-12)  # an end that is known but for rounding
    assert np.array_equal(state.pressure, cut.pressure)


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


def test_a_mask_is_no_obstacle_over_a_surface():
    """4.2 times the area of the disc was pressed."""

    def sphere(x, y):
        return np.ma.masked_where(np.hypot(x, y) > 0.2, (x**2 + y**2) / 20)

    problem = mb.Contact(mb.HalfSpace(CLASSICAL), sphere, LAW, mb.Cells(64, window=(-0.5, 0.5)))
    area = problem.solve(1.0).contact_area
    assert area == pytest.approx(np.pi * 0.04, rel=0.1)  # cells of 1/64 along the edge of the disc


@pytest.mark.filterwarnings("error")
def test_an_obstacle_that_is_nowhere_is_refused_without_a_warning_of_numpy():
    method = mb.Cells(64, window=(-0.5, 0.5))
    problem = mb.Contact(mb.HalfSpace(CLASSICAL), lambda x, y: np.ma.masked_all(x.shape), LAW, method)
    with pytest.raises(mb.BadArgument, match="finite height"):
        problem.solve(1.0)
    with pytest.raises(mb.BadArgument, match="no finite height at places up to"):
        mb.Contact(PLANE, lambda x: np.full(len(x), np.inf), LAW).solve(1.0)


def test_a_mask_of_a_rotation_is_refused():
    law = mb.Microblock(lambda x: np.ma.masked_where(abs(x) > 0.1, 0.01 + 0 * x))
    with pytest.raises(mb.BadArgument, match="psi0 = .*must be finite"):
        mb.Contact(mb.HalfPlane(BLOCKS), mb.Cylinder(10), law).solve(1.0)


@pytest.mark.parametrize("value", [np.inf, np.nan, None, "mask"])
def test_samples_have_holes(value):
    """A fill value became a spike; a straight line joins neighbours that are both there."""
    z = np.ma.masked_where(abs(X) < 0.095, Z) if value == "mask" else np.where(abs(X) < 0.095, value, Z)
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
    whole = mb.Contact(PLANE, samples(Z), LAW, mb.Cells(nodes=512, window=(-0.9, 0.9)))
    holed = whole.with_(obstacle=samples(np.where(abs(X - 0.8) < 0.05, np.nan, Z)))
    first, second = whole.solve(1.0).pressure, holed.solve(1.0).pressure
    assert np.allclose(first, second, atol=1e-4 * first.max())  # residuals of cells


@pytest.mark.parametrize(
    "values",
    [
        np.array([1, 2], "datetime64[D]"),
        np.array([1, 2], "timedelta64[s]"),
        [datetime.datetime(2026, 1, 1)] * 2,
        np.array(["1", "2"]),
        np.array(["1", 2], object),
        [1j, 2j],
        [1, {}],
        [[1], [1, 2]],
    ],
)
def test_what_is_no_real_number_is_refused_by_name(values):
    """Dates and texts were taken as numbers."""
    for name in ("x", "z"):
        with pytest.raises(mb.BadArgument, match=f"{name} = "):
            mb.Obstacle.from_samples(**{"x": [0, 1], "z": [0, 1], name: values})
    with pytest.raises(mb.BadArgument, match="obstacle = "):
        mb.Contact(PLANE, lambda x: values, LAW)


def test_numbers_of_every_kind_are_numbers():
    pandas = pytest.importorskip("pandas")
    x = [-1, 0, 1]
    known = mb.Obstacle.from_samples([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0])
    series = pandas.Series([-1, 0, 1], index=[7, 3, 5])
    for given in (
        x,
        tuple(x),
        np.int8(x),
        np.float16(x),
        np.float32(x),
        np.array(x, object),
        series,
        range(-1, 2),
    ):
        z = np.abs(np.asarray(given, float))
        assert mb.Obstacle.from_samples(given, z) == known
        assert mb.Obstacle.from_samples(series[::-1], z[::-1]) == known  # from right to left
    assert real_numbers(pandas.Series([1, None], dtype="Int64"))[0] == 1.0


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

    known, answer = state(-0.5 + np.linspace(0, L, 41)), state((start + np.linspace(0, L, 41))[part])
    # samples a multiple of a spacing apart are the same places, 1e3 to thirteen digits of the heights
    if abs(start * 40 - round(start * 40)) < 1e-9:
        assert np.allclose(answer.pressure, known.pressure, atol=1e-8 * known.pressure.max())
    assert np.allclose(answer.zones["contact"], known.zones["contact"], atol=2 / 128)  # two cells
    assert not any("last sample" in words for words in answer.warnings)


@pytest.mark.parametrize("start", [-0.5, -1.0, 0.0, 0.3])
@pytest.mark.parametrize("closed", [False, True])
def test_heights_with_ends_lie_in_any_window_of_a_period(start, closed):
    def height(x):
        beyond = (x > start + L) if closed else (x >= start + L)
        return np.where((x < start) | beyond, np.inf, profile(x))

    problem = mb.Contact(mb.HalfPlane(BLOCKS, period=L), profile, mb.Microblock(), mb.Cells(128))
    known, answer = problem.solve(0.2), problem.with_(obstacle=height).solve(0.2)
    assert np.allclose(answer.pressure, known.pressure, atol=1e-9 * known.pressure.max())  # rounding of x


@pytest.mark.parametrize("start", [(-0.5, -0.5), (0.0, 0.0), (0.3, -1.0)])
def test_maps_lie_in_any_window_of_a_period(start):
    axes = [first + np.linspace(0, L, 33) for first in start]
    heights = [profile(axis) for axis in axes]
    plane = RegularGridInterpolator(axes, np.add.outer(*heights), bounds_error=False, fill_value=np.nan)
    line = mb.HalfSpace(BLOCKS, period=L)
    problem = mb.Contact(
        line, lambda x, y: np.ma.masked_invalid(plane((x, y))), mb.Microblock(), mb.Cells(32)
    )
    known = problem.with_(obstacle=lambda x, y: profile(x) + profile(y)).solve(0.05)
    # straight lines between samples of a wave of 32: 2 pi^2/32^2/8 of its amplitude
    assert problem.solve(0.05).contact_area == pytest.approx(known.contact_area, rel=0.05)


def test_pads_narrower_than_a_period_are_the_same_wherever_they_lie():
    problem = mb.Contact(mb.HalfPlane(BLOCKS, period=L), mb.Punch(0.2), mb.Microblock(), mb.Cells(128))
    pad = problem.with_(obstacle=mb.Obstacle.from_samples([0.3, 0.5, 0.7], [0, 0, 0]))
    first, second = problem.solve(0.1), pad.solve(0.1)
    # half a period apart, up to rounding
    assert np.allclose(first.pressure, np.roll(second.pressure, 64), atol=1e-9 * first.pressure.max())
    assert second.error_estimate == pytest.approx(first.error_estimate, rel=1e-6)


@pytest.mark.parametrize(
    "obstacle",
    [
        samples(X, np.linspace(0, 1, 201)),
        lambda x: np.where((x < 0.3) | (x > 1.3), np.inf, x),
        lambda x: 0.01 * x,
    ],
)
def test_what_does_not_repeat_is_refused(obstacle):
    with pytest.raises(mb.BadArgument, match="must repeat with the period, 1"):
        mb.Contact(mb.HalfPlane(CLASSICAL, period=L), obstacle, LAW)
