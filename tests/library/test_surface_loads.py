"""Half-spaces from load to load: `initial` saves products, full closure comes where the closed form has
it."""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane.kernels import symbol
from microblock.halfspace.solver import Grid, _overlaps, _spread

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
AMPLITUDE, K = 1e-3, 2 * np.pi


def waves(x1, x2):
    return -AMPLITUDE * (np.cos(K * x1) + np.cos(K * x2))


def closing(law):
    """Mean pressure that closes all corners under `waves`, of a period 1.

    Closed, each wave is one of the half-plane: p1 cos and, with corners, moments m1 sin. Forces of four
    corners with the sum p and the moments m1, m2 are all positive if |m1| and |m2| are below p; worst is p1
    (cos - 1) + m1 |sin|.
    """
    U, V, W = symbol(SOLID, np.array([K]))[:, 0]
    if len(law.corners) == 1:
        return 2 * AMPLITUDE / U
    half = K * SOLID.ell / 2
    p1, m1 = np.linalg.solve([[U, V], [V, W]], AMPLITUDE * np.array((np.cos(half), np.sin(half))))
    return p1 + np.hypot(p1, m1)


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()], ids=str)
def test_waves_close_at_the_load_of_the_closed_form(law):
    last = closing(law)
    problem = mb.Contact(mb.HalfSpace(SOLID, 1.0), waves, law, mb.Cells(nodes=64, residual=1e-8))
    state, areas = None, []
    for load in last * np.array((0.3, 0.6, 0.9, 0.99, 1.003)):
        state = problem.solve(load=load, initial=state)
        areas.append(
            state.contact_area if state.problem.law.corners == ("C",) else np.mean(state.closed >= 3)
        )
    assert np.all(np.diff(areas) > 0)
    # cells see the wave at 64 places: within (pi/64)^2 of the load
    assert areas[-1] == 1 > areas[-2] > 0.9


@pytest.mark.parametrize(
    ("law", "load"), [(mb.Unilateral(), 1.1), (mb.Microblock((0.005, 0.0)), 1.01)], ids=["one corner", "four"]
)
def test_a_similar_state_saves_products(law, load):
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.02)
    rough = mb.RoughSurface(1.0, 0.1, waves=(1, 8), seed=2)
    problem = mb.Contact(mb.HalfSpace(solid, 1.0), rough, law, mb.Cells(nodes=128))
    before = problem.solve(load=1.0)
    alone, after = problem.solve(load=load), problem.solve(load=load, initial=before)
    # seen: 28 of 34 and 39 of 56; four corners begin from coarser grids as well as from a tenth less load
    assert after.iterations < 0.9 * alone.iterations
    # the residual of both, which relates to pressures as waves of two cells do
    assert after.pressure == pytest.approx(alone.pressure, abs=1e-5 * alone.pressure.max())
    assert after.approach == pytest.approx(alone.approach, rel=1e-7)
    assert after.error_estimate == pytest.approx(alone.error_estimate, rel=1e-3)


def test_products_hardly_grow_with_cells():
    """Forces that do nothing are settled, and each face has its preconditioner; else 100 to 190 are seen."""
    problem = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), mb.Microblock())
    few, many = (
        problem.with_(method=mb.Cells(nodes=nodes, window=(-0.55, 0.55))).solve(load=1.0).iterations
        for nodes in (64, 256)
    )
    assert few < 30 and many < 1.7 * few  # seen: 19 and 28


def test_corners_beyond_a_period_meet_the_image_of_the_obstacle():
    """A height that goes on beyond its period, pressed until all of it touches, and the same that repeats."""
    height = mb.Ellipsoid(10.0, 8.0).height
    problem = mb.Contact(mb.HalfSpace(SOLID, 1.0), height, mb.Microblock(), mb.Cells(nodes=32))
    folded = problem.with_(obstacle=lambda x1, x2: height((x1 + 0.5) % 1 - 0.5, (x2 + 0.5) % 1 - 0.5))
    pressures = [one.solve(load=12.0).pressure for one in (problem, folded)]
    assert pressures[0][0].min() > 0
    # rounding of places
    assert pressures[0] == pytest.approx(pressures[1], abs=1e-9 * pressures[0].max())


def test_windows_of_two_loads_differ():
    problem = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), mb.Microblock(), mb.Cells(nodes=64))
    before = problem.solve(load=1.0)
    alone, after = problem.solve(load=1.4), problem.solve(load=1.4, initial=before)
    assert after.width != before.width
    assert after.pressure == pytest.approx(alone.pressure, abs=1e-5 * alone.pressure.max())


def test_spread_keeps_the_load():
    state = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), mb.Unilateral(), mb.Cells(nodes=32)).solve(
        load=1.0
    )
    for count in (16, 32, 50, 64):
        grid = Grid(count, 2.0 / count, (0.1, -0.2))
        assert _spread(state, grid).sum() * grid.width**2 == pytest.approx(1.0, rel=1e-12)
    old, new = np.linspace(0.5, 7.5, 8), np.linspace(1.0, 7.0, 4)
    assert (_overlaps(old, new) @ old).tolist() == pytest.approx(new)  # means of pairs
    # a cell that is half outside has half of it
    assert (_overlaps(old, old - 0.5) @ np.ones(8)).tolist() == pytest.approx([0.5] + [1.0] * 7)


def test_a_state_of_another_law_is_passed_over():
    problem = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), mb.Unilateral(), mb.Cells(nodes=32))
    other = problem.with_(law=mb.Microblock()).solve(load=1.0)
    alone, found = problem.solve(load=1.0), problem.solve(load=1.0, initial=other)
    assert np.array_equal(found.pressure, alone.pressure)


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microclamped()], ids=str)
@pytest.mark.parametrize("waves", [(2, 1), (7, 4)], ids=str)
def test_waves_that_run_obliquely_are_those_of_the_half_plane(law, waves):
    """At 27 and 30 degrees to the cells; the half-plane has cells of its own, by another program."""
    length = 1 / np.hypot(*waves)
    amplitude = 0.01 * length

    def height(x1, x2):
        return amplitude * (1 - np.cos(2 * np.pi * (waves[0] * x1 + waves[1] * x2)))

    body = mb.HalfSpace(SOLID, period=1.0)
    state = mb.Contact(body, height, law, mb.Cells(nodes=512)).solve(load=0.9)
    plane = mb.Contact(
        mb.HalfPlane(SOLID, period=length),
        lambda x: amplitude * (1 - np.cos(2 * np.pi * x / length)),
        law,
        mb.Cells(nodes=2048),
    ).solve(load=0.9 * length)
    # cells cut the edges into steps, of which the mean is seen
    assert state.approach == pytest.approx(plane.approach, rel=1e-4)
    assert state.pressure.max() == pytest.approx(plane.pressure.max(), rel=1e-3)


def test_a_sphere_is_found_from_any_start_and_looks_alike_from_all_sides():
    cells = mb.Cells(nodes=64, residual=1e-12)
    problem = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), mb.Microblock(), cells)
    state, other = problem.solve(load=1.0), problem.solve(load=1.0, initial=problem.solve(load=0.7))
    # resultants are unique, whatever the corner forces
    for one, two in ((state.pressure, other.pressure), (state.micromoment, other.micromoment)):
        assert one == pytest.approx(two, abs=1e-8 * np.abs(one).max())
    assert np.rot90(state.pressure) == pytest.approx(state.pressure, abs=1e-8 * state.pressure.max())


def test_at_most_three_corners_touch_an_obstacle_that_is_twisted():
    """Four rigid corners are in one plane, over a twisted surface they are not; over a paraboloid with its
    axes along the blocks they may be.
    """
    cells = mb.Cells(nodes=64, residual=1e-11)
    counts = [
        np.bincount(mb.Contact(mb.HalfSpace(SOLID), height, mb.Microblock(), cells).solve(1.0).closed.ravel())
        for height in (lambda x1, x2: (x1**2 + x2**2 + x1 * x2 / 2) / 20, lambda x1, x2: (x1**2 + x2**2) / 20)
    ]
    assert len(counts[0]) == 4 and counts[0][3] > 0 and len(counts[1]) == 5


def test_blocks_of_a_hundredth_of_the_contact_are_hertz():
    a = (3 * 10.0 / (4 * SOLID.E_star)) ** (1 / 3)
    small = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.01 * a)
    loose = mb.Cosserat(E=100, nu=0.3, beta=1e-6, ell=0.01 * a)
    for solid, law, wider in ((loose, mb.Unilateral(), 0.0), (small, mb.Microblock(), 0.005)):
        cells = mb.Cells(nodes=256, window=(-1.3438 * a, 1.3438 * a))  # cells of the edge count as they fall
        state = mb.Contact(mb.HalfSpace(solid), mb.Sphere(10.0), law, cells).solve(load=1.0)
        assert state.pressure.max() == pytest.approx(3 / (2 * np.pi * a**2), rel=1e-3)
        assert state.approach == pytest.approx(a**2 / 10, rel=1e-3)
        # a block touches with its corners while its middle is half a block outside
        assert state.radius == pytest.approx(a * (1 + wider), rel=1e-3)
