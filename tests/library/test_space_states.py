"""States of half-spaces: contacts are seen or refused by name, the estimate speaks of what `pressure_at`
returns, and neither units nor starts nor what was asked before change them.
"""

import copy
import pickle

import numpy as np
import pytest

import microblock as mb
from tests.frozen.library_space import mesh_of
from tests.frozen.problems_space import FUNCTIONS
from tests.states import on_cells

UNILATERAL, BLOCKS = mb.Unilateral(), mb.Microblock()
LAWS = [UNILATERAL, BLOCKS, mb.Microclamped(), mb.Microblock((0.02, -0.01))]
SPHERE = mb.Sphere(1.0)


def solid(ell, modulus=1.0, nu=0.3):
    return mb.Cosserat(E=modulus * (1 - nu**2), nu=nu, beta=1, ell=ell)


def problem(obstacle=SPHERE, law=UNILATERAL, ell=0.05, period=None, **cells):
    return mb.Contact(mb.HalfSpace(solid(ell), period), obstacle, law, mb.Cells(**cells))


def summits(*places):
    """The lowest of paraboloids with their tips at (x1, x2, height)."""
    return lambda x1, x2: np.min([((x1 - a) ** 2 + (x2 - b) ** 2) / 2 + c for a, b, c in places], axis=0)


def waves(x1, x2):
    return 0.1 * (2 - np.cos(2 * np.pi * x1) - np.cos(2 * np.pi * x2))


def disc(x, y):
    """A flat face of radius 1 about (x, y)."""
    return lambda x1, x2: np.where((x1 - x) ** 2 + (x2 - y) ** 2 < 1, 0, np.inf)


# --- contacts are seen


SQUARE = mb.FlatPunch(1.0, face="square")


@pytest.mark.parametrize(
    "scene, load, rtol, words, most",
    [
        (lambda: problem(waves, ell=0.005, period=1.0), 1e-3, 2e-3, "cells", 512),
        pytest.param(
            lambda: problem(waves, ell=0.005, period=1.0),
            1e-3,
            1e-3,
            "cells",
            1024,
            marks=pytest.mark.nightly,
        ),
        (lambda: problem(window=(-100, 100)), 4 / 3, 1e-2, "error", 1024),
        (lambda: problem(SQUARE, BLOCKS), 1.0, 1e-2, "on (64 x 64|128 x 128) cells", 256),
        pytest.param(
            lambda: problem(SQUARE, BLOCKS),
            1.0,
            0.3,
            "on (64 x 64|128 x 128|256 x 256) cells",
            1024,
            marks=pytest.mark.nightly,
        ),
    ],
    ids=["wave", "wave, to the end", "wide window", "flat face", "flat face, loose"],
)
def test_what_one_grid_cannot_resolve_is_refused(monkeypatch, scene, load, rtol, words, most):
    """Peaks were 4 and 5 times too low under estimates below 1e-11; of flat faces the estimate falls slower
    than grids get finer, which few of them show. Coarse grids show both faults, fine ones take the time.
    """
    monkeypatch.setattr("microblock.halfspace.surface_solver.SurfaceSolver.most", most)
    with pytest.raises(mb.NotConverged, match=words) as caught:
        scene().solve(load=load, rtol=rtol)
    met = caught.value.rtol_reached
    assert met is None or rtol < met < 1  # None where no rtol below 1 is known to work


@pytest.mark.parametrize("obstacle, rtol", [(SPHERE, 1e-4), ("pinned", 1e-2)])
def test_what_is_advised_can_be_had(obstacle, rtol):
    """A pin outside made the window grow from another grid, or not at all, at the rtol that was advised."""
    asked = problem(pinned(2.2, 0.2)[0] if obstacle == "pinned" else obstacle)
    try:
        assert asked.solve(load=4 / 3, rtol=rtol).error_estimate <= rtol
    except mb.NotConverged as failure:
        met = failure.rtol_reached
        assert met is None or asked.solve(load=4 / 3, rtol=met).error_estimate <= met


def pinned(away, width, turn=0.4, deep=0.1):
    """A sphere with a pin (a cosine) beside its contact of radius 1, below the surface deformed by that."""
    x, y = away * np.cos(turn), away * np.sin(turn)
    outside = ((2 - away**2) * np.arcsin(1 / away) + np.sqrt(away**2 - 1)) / np.pi  # displacement by Hertz
    tip = away**2 / 2 - 1 + outside + deep

    def height(x1, x2):
        r = np.hypot(x1 - x, x2 - y)
        return (x1**2 + x2**2) / 2 - np.where(r < width / 2, tip * (1 + np.cos(2 * np.pi * r / width)) / 2, 0)

    return height, (x, y)


@pytest.mark.parametrize(
    "away, turn, width", [(1.6, 0, None), (3, 2, None), (1.2, 1, 0.2), (2.2, 0.4, 0.1), (3.6, 3, 0.05)]
)
def test_pins_are_seen(away, turn, width):
    """At least as narrow as the promised width: they press, or a warning says where they would."""
    width = width or 1.05 * problem(nodes=64).solve(load=4 / 3).seen_width
    height, (x, y) = pinned(away, width, turn)
    state = problem(height, nodes=64).solve(load=4 / 3)
    near = np.hypot(*(state.points[:, :2] - (x, y)).T) < width + state.squares[0].width
    assert state.pressure[near].any() or "between cells" in str(state.warnings)


def test_a_pin_between_cells_is_met_by_the_corner_of_a_rotated_block():
    """Half a side beyond the pin a block has a corner over it, which the rotation displaces as well, by 0.03;
    the nearest centre is worth 0.005.
    """
    x, half = 1.1875, 0.25  # between centres of cells
    free = problem(law=BLOCKS, ell=2 * half, nodes=64, window=(-2, 2))
    state = on_cells(free.solve(load=4 / 3))
    i, j = np.abs(state.x1 - x - half).argmin(), np.abs(state.x2 - half).argmin()
    met, width = (
        state.approach - state.displacement[i, j] + half * state.psi[:, i, j].sum(),
        1.05 * state.seen_width,
    )
    for above, words in ((-0.015, True), (0.015, False)):

        def height(x1, x2, z=met + above):
            inside, sphere = ((x1 - x) ** 2 + x2**2) / width**2, (x1**2 + x2**2) / 2
            return np.where(inside < 1, np.minimum(sphere, z + inside * (x**2 / 2 - z)), sphere)

        warnings = free.with_(obstacle=height).solve(load=4 / 3).warnings
        assert any("between cells" in one for one in warnings) == words


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("apart, ell", [(1.0, 1e-4), (2.0, 1e-4), (2.0, 0.05)])
def test_equal_summits_carry_equal_loads(apart, ell, second):
    """Small blocks: each is Hertz under half of the load, and displaced by the other as by a point."""
    pair, a = summits((apart, 0, 0), (-apart, 0, 0)), (3 * 0.05 / 4) ** (1 / 3)
    state = problem(mb.Deformable(mb.HalfSpace(solid(0.2)), pair) if second else pair, ell=ell).solve(
        0.1, rtol=0.1
    )
    left = (state.weights * state.pressure)[state.points[:, 0] < 0].sum()
    assert left / state.load == pytest.approx(0.5, abs=1e-3)  # cells at the edges
    if ell < 1e-3 and not second:
        assert state.approach == pytest.approx(a**2 + 0.05 / (np.pi * 2 * apart), rel=5e-3)


def test_obstacles_that_end_are_found_far_from_the_origin_or_refused():
    """The steps of their rims differ; what was not seen is not called infinite."""
    far, here = (problem(disc(*place), nodes=32).solve(load=1.0) for place in ((30, -40), (0, 0)))
    assert far.approach == pytest.approx(here.approach, rel=0.05)
    with pytest.raises(mb.BadArgument, match=r"none was seen.* move it near there"):
        problem(disc(1000, 0)).solve(load=1.0)


def test_a_window_that_cuts_the_contact_says_so():
    """And the pressure up to the rim of its cells, where it was zero, is that of the last ones."""
    beside = problem(summits((3, 0, 0), (-3, 0, 0)), window=(-5, 1), nodes=64).solve(load=0.1)
    assert any("outside of the window" in words for words in beside.warnings)
    assert problem(window=(-1.5, 1.5), nodes=64).solve(load=4 / 3).warnings == []
    slanted = problem(lambda x1, x2: 0.1 * x1 + SPHERE.height(x1, x2), window=(-0.2, 0.2), nodes=32)
    state = slanted.solve(load=1.0)
    (first, last), rim = state.pressure.reshape(state.shape)[[0, -1], 16], 0.199
    read = state.pressure_at(np.array([(-rim, state.x2[16], 0.0), (rim, state.x2[16], 0.0)]))
    assert any("cuts the contact" in words for words in state.warnings)
    assert 0 < last < 0.97 * first and read == pytest.approx([first, last], rel=1e-12)


# --- contacts far apart have squares of cells of their own


def cost(state):
    """Products with the flexibility times cells."""
    return state.iterations * len(state.points)


@pytest.mark.parametrize("apart", [5, 30, 1000])
def test_contacts_far_apart_are_those_of_hertz(apart):
    """Heights are such that known loads act: point loads displace as contacts do up to (a/apart)^2/3. Two
    equal spheres take some more steps than one to find their loads.
    """
    P, places = np.array([0.05, 0.04, 0.02]), np.array([(0, 0), (0.6, 0.8), (-0.8, 0.6)]) * apart
    distances = np.hypot(*np.transpose(places[:, None] - places)) + np.diag([np.inf] * 3)
    lowered = (0.75 * P) ** (2 / 3) + (P / distances).sum(axis=1) / np.pi
    tips = np.column_stack((places, lowered.max() - lowered))
    state = problem(summits(*tips), ell=1e-4).solve(load=P.sum(), rtol=0.02)
    nearest = np.hypot(*np.transpose(state.points[:, None, :2] - places)).argmin(axis=0)
    loads = np.bincount(nearest, state.weights * state.pressure)
    assert len(state.squares) == 3 and loads == pytest.approx(P, rel=2e-3)
    assert state.approach == pytest.approx(lowered.max(), rel=1e-3)
    pair, single = (summits((0, 0, 0), *more) for more in ([(0, apart, 0)], []))
    both, alone = (problem(own).solve(0.05 * (1 + (own is pair)), rtol=0.02) for own in (pair, single))
    assert cost(both) < 4 * cost(alone)


def test_corners_of_blocks_much_larger_than_the_contact_are_four_contacts_of_hertz():
    """Each with a quarter of the load; short waves meet U and the rotation of a block on one corner. They
    displace each other by the contact's width over ell.
    """
    state = problem(law=BLOCKS, ell=1e4).solve(load=4 / 3, rtol=0.02)
    softer = 1 / (1 + 0.7) + 1 / (2 * state.solid.curvature * 0.7)
    loads = (state.weights * state.pressure).reshape(4, -1).sum(axis=1)
    assert state.approach == pytest.approx((softer / 4) ** (2 / 3), rel=1e-3)
    assert loads == pytest.approx(1 / 3, rel=1e-6)


THREE = [
    (0, 0, 0, 1),
    (2.2, 0.5, 0.01, 0.3),
    (-1.8, 1.1, 0.01, 0.1),
]  # x1, x2, height, radius: the last a pin


def spheres(x1, x2):
    return np.min([((x1 - a) ** 2 + (x2 - b) ** 2) / (2 * R) + c for a, b, c, R in THREE], axis=0)


@pytest.mark.parametrize(
    "obstacle, law, ell, second, window, load",
    [
        (spheres, UNILATERAL, 0.05, None, (-2.2, 2.8), 0.05),
        (spheres, LAWS[2], 0.05, 1.0, (-2.2, 2.8), 0.05),
        (spheres, LAWS[3], 0.05, None, (-2.2, 2.8), 0.05),
        (SPHERE, BLOCKS, 8.0, None, (-5, 5), 0.5),
    ],
    ids=["unilateral", "microclamped two", "microblocks", "large blocks"],
)
def test_squares_have_the_state_of_one_grid_that_covers_them(obstacle, law, ell, second, window, load):
    """To the estimates of both, the approach to the square of these."""
    shape = (
        obstacle
        if second is None
        else mb.Deformable(mb.HalfSpace(mb.Cosserat(E=2, nu=0.2, ell=0.2, beta=second)), obstacle)
    )
    several = problem(shape, law, ell, nodes=64).solve(load=load)
    single = problem(shape, law, ell, nodes=360, window=window, residual=1e-6).solve(load=load)
    error = np.linalg.norm(several.pressure_at(single.points) - single.pressure) / np.linalg.norm(
        single.pressure
    )
    assert len(several.squares) == 3 + (ell > 1) and len(single.squares) == 1
    assert error < several.error_estimate + single.error_estimate < 0.3
    assert several.approach == pytest.approx(single.approach, rel=2e-3)
    if second is not None:
        opposite = several.counter_displacement(several.points), single.counter_displacement(several.points)
        assert opposite[0] == pytest.approx(opposite[1], abs=0.01 * several.opposite.max())


@pytest.mark.parametrize("law, second", [(UNILATERAL, False), (LAWS[2], True)])
def test_squares_on_a_period_have_the_state_of_one_grid(law, second):
    """Two summits, one across the corners of the period; the approach counts from the mean of the surface. Of
    one grid the contacts are 20 cells wide, whose edges are worth 1 %.
    """

    def height(x1, x2):
        return np.minimum(waves(x1 - 0.5, x2 - 0.47), 2e-4 + waves(x1 - 0.05, x2))

    shape = mb.Deformable(mb.HalfSpace(solid(0.2), 1.0), height) if second else height
    several = problem(shape, law, 0.01, 1.0).solve(load=3e-5, rtol=0.05)
    single = problem(shape, law, 0.01, 1.0, nodes=720, residual=1e-6).solve(load=3e-5)
    error = np.linalg.norm(several.pressure_at(single.points) - single.pressure) / np.linalg.norm(
        single.pressure
    )
    assert len(several.squares) == 2 and error < several.error_estimate + 0.01
    assert several.approach == pytest.approx(single.approach, rel=1e-3)


def test_what_squares_do_not_know_beside_them_is_refused():
    """A pressure there is 0, the displacement of a second body and the moments that hold psi = 0 are not."""
    far, other = np.array([(50.0, 0.0)]), mb.HalfSpace(mb.Cosserat(E=2, nu=0.2, ell=0.2, beta=1))
    clamped = problem(SPHERE, LAWS[2], nodes=32).solve(load=0.05)
    pressed = problem(mb.Deformable(other, SPHERE), BLOCKS, nodes=32).solve(load=0.05)
    for state, asked in ((clamped, clamped.micromoment_at), (pressed, pressed.counter_displacement)):
        assert state.pressure_at(far) == 0 and np.isfinite(asked(state.points)).all()
        for refused in (lambda: asked(far), lambda: state.gap_at(list(state.pressures)[0], far)):
            with pytest.raises(mb.BadArgument):
                refused()
    assert not clamped.counter_displacement(far).any() and not pressed.micromoment_at(far).any()


def test_several_squares_are_shown_and_written(tmp_path):
    """Cells of all squares, one after the other; what one grid alone has is None."""
    state = problem(spheres, BLOCKS, nodes=32).solve(load=0.05)
    assert state.shape is state.x1 is state.x2 is state.width is None and len(state.points) == 3 * 32**2
    assert np.all(
        state.points[32**2 : 2 * 32**2, :2].mean(axis=0).round(9) == np.round(state.squares[1].middle, 9)
    )
    state.save(tmp_path / "state.npz")
    again = mb.load(tmp_path / "state.npz")
    assert again.squares == state.squares and np.array_equal(again.pressure, state.pressure)
    assert again.to_dict() == state.to_dict() and len(state.along("x1")["x1"]) in (32, 64, 96)
    (surface,) = mb.to_vtk(state, tmp_path / "state")
    assert surface.exists() and state.to_xarray().sizes["point"] == 3 * 32**2
    assert len(state.plot().axes[0].collections) == 3
    state.plot_blocks()


# --- estimates, readings


def test_an_estimate_above_a_tenth_is_said():
    state = problem(window=(-1.5, 1.5), nodes=32).solve(load=0.1)
    assert state.error_estimate > 1 and state.warnings[0].startswith("the error estimate is 1.1e+00")


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_estimate_holds_of_a_finer_grid(law):
    """Between cells, on a given window; of four times as many cells the pressure."""
    sphere = problem(law=law, ell=0.3, window=(-1.3, 1.3))
    state = sphere.solve(load=4 / 3, rtol=0.06)
    method = mb.Cells(nodes=2 * len(state.x1), window=(-1.3, 1.3), residual=1e-6)
    fine = sphere.with_(method=method).solve(load=4 / 3)
    error = np.linalg.norm(state.pressure_at(fine.points) - fine.pressure) / np.linalg.norm(fine.pressure)
    assert error <= state.error_estimate <= 0.06
    corners = sum(state.pressure_at(fine.points, corner=name) for name in state.pressures)
    assert corners == pytest.approx(state.pressure_at(fine.points), abs=1e-12)


@pytest.mark.parametrize("side", [1.6, 1.65])
def test_steps_of_a_rim_are_within_the_estimate(side):
    """Cells put corners beside the rim of a face, or on it: the approach is off by 5 %, either way."""
    coarse, fine = (
        problem(SQUARE, BLOCKS, 0.5, nodes=nodes, window=(-side, side)).solve(load=1.0) for nodes in (32, 128)
    )
    assert abs(coarse.approach / fine.approach - 1) < coarse.error_estimate


def test_zones_follow_the_residual_that_is_reached():
    """Cells of the edge apart."""
    loose, usual = (
        problem(law=BLOCKS, window=(-1.5, 1.5), nodes=64, residual=residual).solve(load=4 / 3)
        for residual in (0.9, 1e-9)
    )
    assert loose.contact_area == pytest.approx(usual.contact_area, rel=0.02)


# --- the same problem otherwise


def test_order_copies_and_starts_do_not_matter():
    """Exactly, but from other loads by the residual, which relates to pressures as waves of two cells do."""
    fresh = problem(SPHERE, BLOCKS, 0.1).solve(load=0.5, rtol=0.2)
    used = problem(SPHERE, BLOCKS, 0.1)
    before = used.solve(load=2.0, rtol=0.3)
    for again in (used, copy.deepcopy(used), pickle.loads(pickle.dumps(used))):
        assert np.array_equal(again.solve(load=0.5, rtol=0.2).pressure, fresh.pressure)
    close = problem(SPHERE, BLOCKS, 0.1, nodes=32, residual=1e-12)
    other = problem(SPHERE, LAWS[2], 0.1, nodes=32).solve(load=0.5)
    alone = close.solve(load=0.5)
    for initial in (before, other, close.solve(load=0.4)):
        state = close.solve(load=0.5, initial=initial)
        assert state.pressure == pytest.approx(alone.pressure, abs=1e-8 * alone.pressure.max())
    pressure = alone.pressure.reshape(alone.shape)
    assert np.rot90(pressure) == pytest.approx(pressure, abs=1e-8 * pressure.max())


def test_corners_beyond_a_period_meet_the_image_of_the_obstacle():
    """A height that goes on beyond its period, pressed until all of it touches, and the same that repeats."""
    height = mb.Ellipsoid(10.0, 8.0).height
    here = problem(height, BLOCKS, 0.1, 1.0, nodes=32)
    folded = here.with_(obstacle=lambda x1, x2: height((x1 + 0.5) % 1 - 0.5, (x2 + 0.5) % 1 - 0.5))
    one, other = (each.solve(load=0.15) for each in (here, folded))
    assert one.pressure.reshape(one.shape)[0].min() > 0
    assert other.pressure == pytest.approx(one.pressure, abs=1e-9 * one.pressure.max())  # rounding of places


def test_at_most_three_corners_touch_an_obstacle_that_is_twisted():
    """Four rigid corners are in one plane, over a twisted surface they are not; over a paraboloid with its
    axes along the blocks they may be.
    """
    counts = [
        np.bincount(problem(height, BLOCKS, 0.2, nodes=64, residual=1e-11).solve(1.0).closed.ravel())
        for height in (lambda x1, x2: (x1**2 + x2**2 + x1 * x2 / 2) / 2, SPHERE)
    ]
    assert len(counts[0]) == 4 and counts[0][3] > 0 and len(counts[1]) == 5


def test_forces_that_displace_nothing_do_not_end_the_search():
    """On few facets microblocks have forces that displace nothing: a step along them has no curvature, and
    was taken as if the load were lost in rounding. Newton's method has the same energy.
    """
    body = mb.Body(mesh_of("bent"), mb.Cosserat(E=80.0, nu=0.3, ell=0.25, beta=1.0), 1, fixed="bottom")
    touching = body, FUNCTIONS["raised bowl"], mb.Microblock()
    states = [mb.Contact(*touching, *method).solve(load=2.0) for method in ((), (mb.Newton(),))]
    assert states[0].energy == pytest.approx(states[1].energy, rel=1e-6)


# --- rough surfaces


def test_a_rough_surface_is_self_affine_and_has_its_slope():
    """Parseval, to rounding; random phases within four deviations."""
    rough, m = (
        mb.RoughSurface(period=2.0, slope=0.1, hurst=0.7, waves=(3, 20), seed=5),
        np.fft.fftfreq(48, 1 / 48),
    )
    x, m = np.arange(48) / 24, np.hypot(m[:, None], m)
    spectrum = np.fft.fft2(rough.height(*np.meshgrid(x, x, indexing="ij"))) / 48**2
    power, inside = np.abs(spectrum) ** 2, (m >= 3) & (m <= 20)
    assert np.sum((np.pi * m) ** 2 * power) == pytest.approx(rough.slope**2, rel=1e-12)
    scaled = power[inside] * m[inside] ** 3.4
    assert np.ptp(scaled) < 1e-9 * scaled.mean() and power[~inside].max() < 1e-12 * power[inside].min()
    assert np.abs(np.exp(1j * np.angle(spectrum[inside])).mean()) < 4 / np.sqrt(inside.sum())
