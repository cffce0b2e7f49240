"""Half-spaces: contacts are seen or refused by name; the estimate speaks of what `pressure_at` returns."""

import copy
import pickle

import numpy as np
import pytest

import microblock as mb
from microblock import BadArgument, NotConverged
from tests.frozen.library_space import mesh_of
from tests.frozen.problems_space import FUNCTIONS

UNILATERAL, BLOCKS, CLAMPED = mb.Unilateral(), mb.Microblock(), mb.Microclamped()
LAWS = [UNILATERAL, BLOCKS, CLAMPED, mb.Microblock((0.02, -0.01))]
SPHERE = mb.Sphere(1.0)


def solid(ell, modulus=1.0, nu=0.3):
    return mb.Cosserat(E=modulus * (1 - nu**2), nu=nu, beta=1, ell=ell)


def problem(obstacle=SPHERE, law=UNILATERAL, ell=0.05, period=None, **cells):
    return mb.Contact(mb.HalfSpace(solid(ell), period), obstacle, law, mb.Cells(**cells))


def summits(*places, radius=1.0):
    """The lowest of paraboloids with their tips at (x1, x2, height)."""
    return lambda x1, x2: np.min(
        [((x1 - a) ** 2 + (x2 - b) ** 2) / (2 * radius) + c for a, b, c in places], axis=0
    )


def waves(x1, x2):
    return 0.1 * (2 - np.cos(2 * np.pi * x1) - np.cos(2 * np.pi * x2))


# contacts in few cells


@pytest.mark.parametrize(
    "scene, load, words",
    [
        (lambda: problem(waves, ell=0.005, period=1.0), 1e-6, "error"),
        (lambda: problem(window=(-100, 100)), 4 / 3, "error"),
        (lambda: problem(law=BLOCKS, ell=100), 4 / 3, "4 places within 100"),
        (lambda: problem(summits((10, 0, 0), (-10, 0, 0))), 1e-3, "2 places within 20.*window="),
        (
            lambda: problem(summits(*((a, b, 0) for a in (-10, 10) for b in (-10, 10)))),
            1e-3,
            "4 places within 20",
        ),
    ],
    ids=["wave", "wide window", "large blocks", "two far", "four far"],
)
def test_what_one_grid_cannot_resolve_is_refused(scene, load, words):
    """Peaks were 5, 4 and 2 times too low under estimates below 1e-11; one of two contacts had all."""
    with pytest.raises(NotConverged, match=words) as caught:
        scene().solve(load=load, rtol=1e-2)
    met = caught.value.rtol_reached
    assert met is None or 1e-2 < met < 1  # None where no rtol below 1 is known to work


def test_what_is_advised_can_be_had():
    with pytest.raises(NotConverged, match="ask for rtol") as caught:
        problem().solve(load=1.0, rtol=1e-4)
    advised = float(str(caught.value).split("ask for rtol=")[1].split(" ")[0])
    assert problem().solve(load=1.0, rtol=advised).error_estimate <= advised == caught.value.rtol_reached


def pinned(away, width, turn=0.4, deep=0.1):
    """A sphere with a pin (a cosine) beside its contact of radius 1, below the surface deformed by that."""
    x, y = away * np.cos(turn), away * np.sin(turn)
    outside = ((2 - away**2) * np.arcsin(1 / away) + np.sqrt(away**2 - 1)) / np.pi  # displacement by Hertz
    tip = away**2 / 2 - 1 + outside + deep

    def height(x1, x2):
        r = np.hypot(x1 - x, x2 - y)
        return (x1**2 + x2**2) / 2 - np.where(r < width / 2, tip * (1 + np.cos(2 * np.pi * r / width)) / 2, 0)

    return height, (x, y)


def test_the_windows_do_not_depend_on_what_is_asked():
    """A pin outside made the window grow from another grid, or not at all, at the rtol that was advised."""
    asked, met = problem(pinned(2.2, 0.2)[0]), 1e-2
    for _ in range(2):
        try:
            state = asked.solve(load=4 / 3, rtol=met)
            assert state.error_estimate <= met
        except NotConverged as failure:
            assert met == 1e-2, "advised in vain"
            if failure.rtol_reached is None:
                return
            met = failure.rtol_reached


@pytest.mark.parametrize("apart", [1.0, 2.0])
def test_equal_summits_carry_equal_loads(apart):
    pair = problem(summits((apart, 0, 0), (-apart, 0, 0)), ell=1e-4)
    state = pair.solve(load=0.1, rtol=0.1)
    sides = state.pressure.sum(axis=1)
    left = sides[state.x1 < 0].sum() / sides.sum()
    assert left == pytest.approx(0.5, abs=1e-3)  # rounding of places, and its cells at the edges
    # each is Hertz under half of the load, and displaced by the other as by a point: (a/apart)^3 of that
    a = (3 * 0.05 / 4) ** (1 / 3)
    assert state.approach == pytest.approx(a**2 + 0.05 / (np.pi * 2 * apart), rel=5e-3)


@pytest.mark.parametrize("ell", [1e4, 1e-8])
def test_windows_fit_contacts_of_any_size_beside_the_blocks(ell):
    """Blocks far larger than the contact leave U of short waves, far smaller ones Hertz."""
    state = problem(ell=ell).solve(load=4 / 3, rtol=2e-2)
    yields = 1.0 if ell < 1 else 1 / (1 + 0.7)  # 1/(1 + (1 - nu) beta)
    a = yields ** (1 / 3)
    assert state.approach == pytest.approx(a**2, rel=2e-3)
    assert state.pressure.max() == pytest.approx(2 / np.pi / a**2, rel=5e-3)


def test_light_loads_beside_a_second_body():
    second = mb.Deformable(mb.HalfSpace(solid(0.2)), summits((1, 0, 0), (-1, 0, 0)))
    state = problem(second).solve(load=0.1, rtol=0.1)
    sides = state.pressure.sum(axis=1)
    assert sides[state.x1 < 0].sum() / sides.sum() == pytest.approx(0.5, abs=1e-3)


# the picture


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("ell", [0.02, 0.5, 5.0])
@pytest.mark.parametrize(
    "obstacle",
    [SPHERE, mb.Ellipsoid(1.0, 4.0), mb.Cone(0.5), summits((0, 0, 0), (1.0, 0.5, 0.05))],
    ids=["sphere", "ellipsoid", "cone", "summits"],
)
def test_the_approach_is_below_its_bound(law, ell, obstacle):
    one = problem(obstacle, law, ell, nodes=48)
    picture = one.solver._picture(1.0, None, None)
    state = one.solve(load=1.0)
    # the levers of psi0 lower the corners by ell/2 |psi0|; cells see heights at their centres alone: 1e-2
    assert picture.lowest[2] < state.approach < picture.bound + 0.01 * state.approach


def test_of_hertz_the_bound_is_four_thirds_at_most_and_the_disc_is_the_contact():
    picture = problem(ell=1e-6).solver._picture(4 / 3, None, None)
    assert 1 < picture.bound < 4 / 3 and picture.radius == pytest.approx(1, rel=0.2)  # radii 1.41 apart


@pytest.mark.parametrize("seed", range(12))
def test_pins_are_seen(seed):
    """Pins of .05 to .2 of the contact's radius at 1 to 4 radii, so low that they must carry: they press, or
    a warning says where they would."""
    draw = np.random.default_rng([5, seed])
    away, turn, width = draw.uniform(1, 4), draw.uniform(0, 2 * np.pi), draw.uniform(0.05, 0.2)
    x, y = away * np.cos(turn), away * np.sin(turn)

    def height(x1, x2):
        inside = ((x1 - x) ** 2 + (x2 - y) ** 2) / width**2
        return np.where(
            inside < 1, np.minimum((x1**2 + x2**2) / 2, inside * away**2 / 2), (x1**2 + x2**2) / 2
        )

    state = problem(height, nodes=64).solve(load=4 / 3)
    near = np.hypot(*np.meshgrid(state.x1 - x, state.x2 - y, indexing="ij")) < width + state.width
    assert state.pressure[near].any() or "between cells" in str(state.warnings)


@pytest.mark.parametrize("away, turn", [(1.6, 0), (2.2, 0.4), (3, 2), (3.6, 3)])
def test_the_width_that_is_promised_is_seen(away, turn):
    width = 1.05 * problem(nodes=64).solve(load=4 / 3).seen_width
    height, (x, y) = pinned(away, width, turn)
    state = problem(height, nodes=64).solve(load=4 / 3)
    near = np.hypot(*np.meshgrid(state.x1 - x, state.x2 - y, indexing="ij")) < width + state.width
    assert width < 0.03 and (state.pressure[near].any() or "between cells" in str(state.warnings))


def test_a_pin_between_cells_is_met_by_the_corner_of_a_rotated_block():
    """Half a side beyond the pin a block has a corner over it, which the rotation displaces as well."""
    x, half = 1.1875, 0.25  # between centres of cells
    free = problem(law=BLOCKS, ell=2 * half, nodes=64, window=(-2, 2))
    state = free.solve(load=4 / 3)
    i, j = np.abs(state.x1 - x - half).argmin(), np.abs(state.x2 - half).argmin()
    met = state.approach - state.displacement[i, j] + half * state.psi[:, i, j].sum()
    width = 1.05 * state.seen_width
    for above, words in (
        (-0.015, True),
        (0.015, False),
    ):  # the rotation is worth 0.03, the nearest centre 0.005

        def height(x1, x2, z=met + above):
            inside, sphere = ((x1 - x) ** 2 + x2**2) / width**2, (x1**2 + x2**2) / 2
            return np.where(inside < 1, np.minimum(sphere, z + inside * (x**2 / 2 - z)), sphere)

        warnings = free.with_(obstacle=height).solve(load=4 / 3).warnings
        assert any("between cells" in one for one in warnings) == words


def disc(x, y):
    """A flat face of radius 1 about (x, y)."""
    return lambda x1, x2: np.where((x1 - x) ** 2 + (x2 - y) ** 2 < 1, 0, np.inf)


def test_obstacles_that_end_are_found_far_from_the_origin():
    far, here = (problem(disc(*place), nodes=32).solve(load=1.0) for place in ((30, -40), (0, 0)))
    assert far.approach == pytest.approx(here.approach, rel=0.05)  # the steps of their rims differ


def test_obstacles_that_were_not_seen_are_not_called_infinite():
    with pytest.raises(BadArgument, match=r"none was seen.* move it near there"):
        problem(disc(1000, 0)).solve(load=1.0)
    with pytest.raises(BadArgument, match="no sample has one"):
        problem(disc(1000, 0), window=(-1001, 1001), nodes=32).solve(load=1.0)


def test_a_window_that_cuts_the_contact_says_so():
    cut = problem(window=(-0.5, 0.5), nodes=32).solve(load=4 / 3)
    assert any("cuts the contact" in words for words in cut.warnings) and "cuts" in cut._repr_html_()
    beside = problem(summits((3, 0, 0), (-3, 0, 0)), window=(-5, 1), nodes=64).solve(load=0.1)
    assert any("outside of the window" in words for words in beside.warnings)
    assert problem(window=(-1.5, 1.5), nodes=64).solve(load=4 / 3).warnings == ()


def test_a_cut_contact_presses_up_to_the_rim_of_its_cells():
    """Between the last centres and the rim the pressure is that of the last cells, which differ."""
    state = problem(lambda x1, x2: 0.1 * x1 + SPHERE.height(x1, x2), window=(-0.2, 0.2), nodes=32).solve(
        load=1.0
    )
    first, last, rim = state.pressure[0, 16], state.pressure[-1, 16], 0.199
    read = state.pressure_at(np.array([(-rim, state.x2[16], 0.0), (rim, state.x2[16], 0.0)]))
    assert 0 < last < 0.97 * first and read == pytest.approx([first, last], rel=1e-12)


@pytest.mark.parametrize("rtol, most", [(1e-2, 128), (0.3, 256)])
def test_flat_faces_are_refused_on_coarse_grids(rtol, most):
    """Their pressure has no bound: the estimate falls too slowly for any grid, which few of them show."""
    with pytest.raises(NotConverged, match="on [0-9]+ x [0-9]+ cells") as failure:
        problem(mb.FlatPunch(1.0, face="square"), BLOCKS).solve(load=1.0, rtol=rtol)
    assert int(str(failure.value).split(" x ")[0].split()[-1]) <= most


# the estimate


def hertz(points):
    return 2 / np.pi * np.sqrt(np.maximum(1 - (points**2).sum(axis=1), 0))


@pytest.mark.parametrize("rtol", [0.1, 0.03, 0.01])
def test_the_estimate_is_of_what_is_returned(rtol):
    state = problem(ell=1e-5).solve(load=4 / 3, rtol=rtol)
    x = np.linspace(-1.1, 1.1, 701)  # some places in each cell
    points = np.column_stack([each.ravel() for each in np.meshgrid(x, x)])
    error = np.linalg.norm(state.pressure_at(points) - hertz(points)) / np.linalg.norm(hertz(points))
    assert error <= state.error_estimate <= rtol and state.error_estimate < 4 * error


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_estimate_holds_of_a_finer_grid(law):
    sphere = problem(law=law, ell=0.3, window=(-1.3, 1.3))
    state = sphere.solve(load=4 / 3, rtol=0.06)
    nodes = 2 * len(state.x1)
    fine = sphere.with_(method=mb.Cells(nodes=nodes, window=(-1.3, 1.3), residual=1e-6)).solve(load=4 / 3)
    points = np.column_stack([each.ravel() for each in np.meshgrid(fine.x1, fine.x2, indexing="ij")])
    error = np.linalg.norm(state.pressure_at(points) - fine.pressure.ravel()) / np.linalg.norm(fine.pressure)
    assert error <= state.error_estimate <= 0.06


@pytest.mark.parametrize("ell", [1e-2, 1e-3])
def test_blocks_smaller_than_cells_take_few_products(ell):
    """The preconditioner of open corners took short waves for the cells', which are longer than blocks."""
    state = problem(law=BLOCKS, ell=ell, window=(-1.3, 1.3), nodes=64).solve(load=4 / 3)
    assert state.iterations < 60  # 29 and 32; 98 of ell 1e-3 with the limit of short waves


@pytest.mark.parametrize("side", [1.6, 1.6075, 1.65])
def test_steps_of_a_rim_are_within_the_estimate(side):
    """Cells put corners beside the rim of a face, or on it: the approach is off by 5 %, either way."""
    square, window = mb.FlatPunch(1.0, face="square"), (-side, side)
    coarse, fine = (
        problem(square, BLOCKS, 0.5, nodes=nodes, window=window).solve(load=1.0) for nodes in (32, 128)
    )
    assert abs(coarse.approach / fine.approach - 1) < coarse.error_estimate


def test_pressures_between_cells():
    state = problem(law=BLOCKS, nodes=32).solve(load=1.0)
    centres = np.column_stack([each.ravel() for each in np.meshgrid(state.x1, state.x2, indexing="ij")])
    assert state.pressure_at(centres) == pytest.approx(state.pressure.ravel(), rel=1e-12, abs=1e-12)
    places = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    corners = sum(state.pressure_at(places, corner=name) for name in state.pressures)
    assert corners == pytest.approx(state.pressure_at(places), abs=1e-12)
    assert state.pressure_at([[100.0, 0.0]]) == 0
    for points, corner, name in (
        ([1.0], None, "points"),
        ([[np.inf, 0]], None, "points"),
        ([[0, 0]], "A", "corner"),
    ):
        with pytest.raises(BadArgument) as caught:
            state.pressure_at(points, corner)
        assert caught.value.name == name


def test_pressures_repeat_with_the_period():
    state = problem(waves, ell=0.05, period=1.0, nodes=32).solve(load=1.0)
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 2))
    assert state.pressure_at(places + [1.0, -2.0]) == pytest.approx(state.pressure_at(places), abs=1e-9)


def test_zones_follow_the_residual_that_is_reached():
    loose, usual = (
        problem(law=BLOCKS, window=(-1.5, 1.5), nodes=64, residual=residual).solve(load=4 / 3)
        for residual in (0.9, 1e-9)
    )
    assert loose.contact_area == pytest.approx(usual.contact_area, rel=0.02)  # cells of the edge


# the same problem otherwise


@pytest.mark.parametrize("law", [UNILATERAL, BLOCKS], ids=str)
@pytest.mark.parametrize(
    "length, modulus, away, raised", [(1e-6, 1.0, 0, 0), (1.0, 1e9, 0, 1e3), (1e9, 1e-3, -1e3, -10)]
)
def test_units_and_places_do_not_matter(law, length, modulus, away, raised):
    def height(x1, x2):
        low = summits((0.5, 0.1, 0), (-0.6, 0, 0.02))(x1 / length - away, x2 / length + away)
        return (low + raised) * length

    moved = mb.Contact(mb.HalfSpace(solid(0.1 * length, modulus)), height, law).solve(
        load=0.5 * length**2 * modulus, rtol=0.2
    )
    alone = problem(summits((0.5, 0.1, 0), (-0.6, 0, 0.02)), law, 0.1).solve(load=0.5, rtol=0.2)
    # windows may differ by a cell of the coarse grid: the error of either
    assert moved.approach / length - raised == pytest.approx(alone.approach, rel=5e-3)
    assert moved.contact_area / length**2 == pytest.approx(alone.contact_area, rel=0.05)


def test_order_and_copies_do_not_matter():
    """A problem asked at other loads before, copied or pickled, gives what a fresh one gives."""
    pair = summits((0.5, 0.1, 0), (-0.6, 0, 0.02))
    fresh = problem(pair, BLOCKS, 0.1).solve(load=0.5, rtol=0.1)
    used = problem(pair, BLOCKS, 0.1)
    for load in (2.0, 0.1):
        used.solve(load=load, rtol=0.2)
    sphere = problem(SPHERE, BLOCKS, 0.1)
    sphere.solve(load=1.0, rtol=0.2)
    for again in (used, copy.deepcopy(used)):
        assert np.array_equal(again.solve(load=0.5, rtol=0.1).pressure, fresh.pressure)
    for again in (pickle.loads(pickle.dumps(sphere)), problem(SPHERE, BLOCKS, 0.1)):
        assert np.array_equal(
            again.solve(load=0.5, rtol=0.1).pressure, sphere.solve(load=0.5, rtol=0.1).pressure
        )


def test_forces_that_displace_nothing_do_not_end_the_search():
    """On few facets microblocks have forces that displace nothing: a step along them has no curvature, and
    was taken as if the load were lost in rounding. Newton's method has the same energy.
    """
    body = mb.Body3D(mesh_of("bent"), mb.Cosserat(E=80.0, nu=0.3, ell=0.25, beta=1.0), 1, fixed="bottom")
    touching = body, FUNCTIONS["raised bowl"], mb.Microblock()
    states = [mb.Contact(*touching, *method).solve(load=2.0) for method in ((), (mb.Newton(),))]
    assert states[0].energy == pytest.approx(states[1].energy, rel=1e-6)
