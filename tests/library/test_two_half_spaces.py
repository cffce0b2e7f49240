"""Two half-spaces: limits, twins, the plane, a dense reference of its own, balance, and what refuses them."""

import copy
import pickle

import ngsolve as ng
import numpy as np
import pytest
from netgen.csg import unit_cube
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.optimize import nnls
from scipy.special import j0

import microblock as mb
from microblock.data.export import profile
from microblock.data.records import read_records
from microblock.halfplane.kernels import normal_symbol, short_waves, symbol
from microblock.halfspace.counter import Counter, kernel
from microblock.halfspace.solver import Grid, _grid
from microblock.halfspace.surface_law import CORNERS
from tests import half_space_scenes

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7, alpha_prime=0.3, beta_prime=-0.2)
CLASSICAL = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=0)
STIFF = mb.Cosserat(E=1e12, nu=0.3, ell=0.2, beta=0.5)
SPHERE = mb.Sphere(R=10)
LAWS = [mb.Unilateral(), mb.Microclamped(), mb.Microblock(), mb.Microblock((0.01, -0.02))]
OFFSETS = np.array(list(CORNERS.values()), float)


def means(values):
    """Means over 2 x 2 cells, of the last two axes."""
    n = values.shape[-1] // 2
    return values.reshape(*values.shape[:-2], n, 2, n, 2).mean(axis=(-3, -1))


def waves(x1, x2):
    return -0.01 * (np.cos(2 * np.pi * x1) + np.cos(2 * np.pi * x2) * (1 + np.sin(2 * np.pi * x1)))


def problem(law, second, shape=SPHERE, period=None, solid=SOLID, **cells):
    obstacle = shape if second is None else mb.Deformable(mb.HalfSpace(second, period), shape)
    return mb.Contact(mb.HalfSpace(solid, period), obstacle, law, mb.Cells(**cells))


# limits


@pytest.mark.parametrize("period, shape", [(None, SPHERE), (1.0, waves)], ids=["alone", "period"])
@pytest.mark.parametrize("times", [1.0, 4.0])
def test_smooth_bodies_of_proportional_moduli_are_one_on_a_rigid_obstacle_of_less_height(
    times, period, shape
):
    """One corner at the contact point: the compliances add. Rounding alone is between them: 1e-10."""
    softer = mb.Cosserat(E=100 / times, nu=0.3, ell=0.1, beta=1)

    def lower(x1, x2):
        return (shape.height if period is None else shape)(x1, x2) / (1 + times)

    one = problem(mb.Unilateral(), None, lower, period, nodes=48, residual=1e-12).solve(load=1.0)
    two = problem(mb.Unilateral(), softer, shape, period, nodes=48, residual=1e-12).solve(load=1.0)
    assert two.pressure == pytest.approx(one.pressure, abs=1e-10 * one.pressure.max())
    assert two.approach == pytest.approx((1 + times) * one.approach, rel=1e-10)
    assert two.counter_displacement == pytest.approx(
        times * one.displacement, abs=1e-10 * np.ptp(two.counter_displacement)
    )


@pytest.mark.parametrize("period, shape", [(None, SPHERE), (1.0, waves)], ids=["alone", "period"])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_body_ten_orders_stiffer_is_rigid(law, period, shape):
    """1e-10 of the stiffness, some times the condition of the pressures, and the residual of both."""
    rigid, stiff = (
        problem(law, second, shape, period, nodes=32, residual=1e-11).solve(load=1.0)
        for second in (None, STIFF)
    )
    assert stiff.pressure == pytest.approx(rigid.pressure, abs=1e-9 * rigid.pressure.max())
    assert stiff.micromoment == pytest.approx(rigid.micromoment, abs=1e-9 * rigid.pressure.max() * SOLID.ell)
    assert stiff.approach == pytest.approx(rigid.approach, rel=1e-9)


@pytest.mark.parametrize("beta", [0.7, 0.0])
@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()], ids=str)
def test_of_small_blocks_the_contact_is_that_of_hertz_with_both_moduli(law, beta):
    """ell/a = 2e-4, with blocks 2e-3; cells leave the steps of the edge in the pressure, and 1e-4 in
    the approach (3e-5 and 6e-6 on 128 and 256 cells).
    """
    ell = 1e-3 if isinstance(law, mb.Microblock) else 1e-4
    one, two = (mb.Cosserat(E=E, nu=nu, ell=ell, beta=b) for E, nu, b in ((100, 0.3, 1), (60, 0.2, beta)))
    modulus = 1 / (1 / one.E_star + 1 / two.E_star)
    a = (30 / (4 * modulus)) ** (1 / 3)
    errors = []
    for nodes in (32, 64):
        window = -1.65 * a, 1.65 * a  # 19 and 39 cells in the contact
        state = problem(law, two, solid=one, nodes=nodes, window=window, residual=1e-7).solve(load=1.0)
        fine = Grid(4 * nodes, state.width / 4, _grid(state).middle)
        r = np.hypot(*np.meshgrid(*fine.axes, indexing="ij"))
        exact = 3 / (2 * np.pi * a**2) * np.sqrt(np.maximum(1 - (r / a) ** 2, 0))
        for _ in range(3):
            exact = means(exact)
        errors.append(np.linalg.norm(means(state.pressure) - exact) / np.linalg.norm(exact))
        assert errors[-1] <= state.error_estimate
    assert errors[1] < 0.7 * errors[0]
    assert state.approach == pytest.approx(a**2 / 10, rel=1e-4)


# other discretisations


def on_a_line(law, ell, nodes, across=False):
    """A state of half-planes, and pressure, moment, u2 and approach of half-spaces along a row of cells."""
    period = 2.0
    one = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell, alpha_prime=0.3, beta_prime=-0.2)

    def height(x):
        return 0.05 * (1 - np.cos(np.pi * x)) + 0.01 * np.sin(np.pi * x)

    second = mb.Deformable(mb.HalfPlane(OTHER, period), height)
    method = mb.Cells(nodes=nodes, residual=1e-11)
    line = mb.Contact(mb.HalfPlane(one, period), second, law, method).solve(load=0.6)
    surface = problem(
        law, OTHER, lambda x1, x2: height(x2 if across else x1), period, one, nodes=nodes, residual=1e-11
    ).solve(load=0.6 * period)
    fields = surface.pressure, -surface.micromoment[1], surface.counter_displacement
    if across:
        fields = surface.pressure.T, surface.micromoment[0].T, surface.counter_displacement.T
    assert np.ptp(fields[0], axis=1).max() < 1e-8 * line.pressure.max()
    return line, *(values[:, 5] for values in fields), surface.approach


@pytest.mark.parametrize("law", [*LAWS[:3], mb.Microblock(0.05)], ids=str)
@pytest.mark.parametrize("across", [False, True])
def test_a_height_of_one_direction_is_contact_of_two_half_planes(law, across):
    """Corners stand at multiples of a cell, where shares are a shift as there: the residual of both, 1e-8."""
    if across and not law.even:
        return  # a number psi0 turns about x2
    line, p, moment, u2, approach = on_a_line(law, 0.25, 64, across)
    assert p == pytest.approx(line.pressure, abs=1e-8 * line.pressure.max())
    assert moment == pytest.approx(line.micromoment, abs=1e-8 * line.pressure.max())
    assert u2 == pytest.approx(line.counter_displacement(line.x), abs=1e-8 * np.ptp(u2))
    assert approach == pytest.approx(line.approach, rel=1e-9)


def test_corners_beside_the_centres_of_cells_are_there_as_in_the_plane():
    """The polynomial through five cells, and the waves of the plane, see kinks and edges of the pressure: 16
    and 32 cells wide, and falling with the cells.
    """
    errors = []
    for nodes in (64, 128):
        line, p, _, u2, _ = on_a_line(mb.Microblock(), 0.21, nodes)
        errors.append(np.linalg.norm(p - line.pressure) / np.linalg.norm(p))
        assert u2 == pytest.approx(line.counter_displacement(line.x), abs=5e-3 * np.ptp(u2))
    assert errors[0] < 3e-2 and errors[1] < 0.8 * errors[0]


def test_all_closed_on_a_period_corners_follow_the_waves():
    """Two crossed waves, all corners closed: those of the half-plane, corner by corner, added."""
    k, depth, ell = 2 * np.pi, 1e-4, 0.13
    one = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    state = problem(
        mb.Microblock(),
        OTHER,
        lambda x1, x2: -depth * (np.cos(k * x1) + np.cos(k * x2)),
        1.0,
        one,
        nodes=64,
        residual=1e-11,
    ).solve(load=1.0)
    (U,), (V,), (W,) = symbol(one, np.array([k]))
    U2, c, s = normal_symbol(OTHER, np.array([k]))[0], np.cos(k * ell / 2), np.sin(k * ell / 2)
    p, m = np.linalg.solve(
        [[U + U2 * c * c, V + U2 * c * s], [V + U2 * c * s, W + U2 * s * s]], depth * np.array((c, s))
    )
    x1, x2 = np.meshgrid(state.x1, state.x2, indexing="ij")
    # the polynomial through five cells leaves (k width)^6/100 of u2
    assert state.pressure == pytest.approx(1.0 + p * (np.cos(k * x1) + np.cos(k * x2)), abs=1e-7)
    assert -state.micromoment[1] == pytest.approx(ell / 2 * m * np.sin(k * x1), abs=1e-7)


def point_load(solid, r):
    """u2 at distances r under a unit force: the Hankel transform of U2 along real wavenumbers; beyond the
    last one U2 is that of short waves.
    """
    short, last = short_waves(solid)[0], 3000 / solid.ell
    k = np.concatenate((np.linspace(0, last / 100, 20001), np.linspace(last / 100, last, 100001)[1:]))
    middle, step = (k[1:] + k[:-1]) / 2, np.diff(k)
    rest = (middle * normal_symbol(solid, middle) - short) * step
    return np.array([short / each + rest @ j0(middle * each) for each in r]) / (2 * np.pi)


def test_the_table_is_the_hankel_transform_of_the_symbol():
    """What beyond the last wavenumber is left out falls with its square."""
    r = np.array([0.02, 0.1, 0.5, 2.0])
    for solid in (OTHER, CLASSICAL):
        assert kernel(solid, r) == pytest.approx(point_load(solid, r), rel=1e-5)


class Dense:
    """Two half-spaces at a given approach by a dense matrix: the first body column by column, the second by
    averages of its point load over both cells, each where the corner stands; non-negative least squares.
    """

    def __init__(self, first, solid, second, width):
        self.first, self.solid, self.width, n = first, solid, width, first.tilt.shape[-1]
        corners = len(first.offsets)
        table = np.geomspace(1e-3 * width, 100 * width, 80)
        values = CubicSpline(np.log(table), point_load(second, table) * table)
        own = [first @ each for each in np.eye(corners * n * n).reshape(-1, corners, n, n)]
        places = np.array([(i, j) for i in range(n) for j in range(n)], float) * width
        places = np.concatenate([places + solid.ell / 2 * each for each in first.offsets])
        apart = np.round((places[:, None] - places) / width, 9)
        different, which = np.unique(np.abs(apart) @ (1.0, 1j), return_inverse=True)
        far = [self.averaged(each.real * width, each.imag * width, values) for each in different]
        self.matrix = np.reshape(own, (len(places), -1)) + np.array(far)[which.ravel()].reshape(
            len(places), -1
        )

    def averaged(self, x1, x2, values):
        """Over two squares: midpoints of a tent of two cells, many where they touch."""
        count = 48 if max(x1, x2) < 2.5 * self.width else 8
        t = (np.arange(count) + 0.5) / count * 2 - 1
        tent = (1 - np.abs(t)) / np.sum(1 - np.abs(t))
        r = np.hypot(x1 + self.width * t[:, None], x2 + self.width * t)
        return tent @ (values(np.log(r)) / r) @ tent

    def forces(self, lowered):
        """Of the corners, from approach less initial gaps: the least of f.A f/2 - lowered.f for f >= 0."""
        size = np.trace(self.matrix) / len(self.matrix)
        root = np.linalg.cholesky((self.matrix + self.matrix.T) / 2 + 1e-9 * size * np.eye(len(self.matrix)))
        return nnls(root.T, np.linalg.solve(root, lowered.ravel()))[0].reshape(lowered.shape)


def dense(law, second, shape, approach, nodes, side, solid=SOLID):
    """Package's state on cells, flexibility of its first body, and forces of the reference on the same."""
    solvers = [problem(law, each, shape, solid=solid).solver for each in (second, None)]
    grid = Grid(nodes, side / nodes, (0.0, 0.0))
    first = solvers[1]._flexibility(grid)
    forces = Dense(first, solid, second, grid.width).forces(approach - solvers[1].initial_gaps(*grid.axes))
    return solvers[0]._solved(grid, None, approach, 1e-9, None), first, forces


def test_the_reference_has_the_contact_of_hertz():
    """On 16 cells a side; classical bodies, one corner: approach, load 4/3 E* sqrt(R) d^(3/2)."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=1e-4, beta=1)
    _, _, forces = dense(mb.Unilateral(), CLASSICAL, SPHERE, 0.025, 16, 1.1, solid)
    modulus = 1 / (1 / solid.E_star + 1 / CLASSICAL.E_star)
    # steps of the edge, 8 cells from the middle
    assert forces.sum() == pytest.approx(4 / 3 * modulus * np.sqrt(10) * 0.025**1.5, rel=1e-2)


@pytest.mark.parametrize("ell, second", [(0.33, OTHER), (0.8, CLASSICAL)])
def test_states_are_those_of_a_dense_reference(ell, second):
    """No symmetry, rotated blocks; on the same cells: what shares are off by beside averages, which halves
    with the cells.
    """
    solid = mb.Cosserat(E=100, nu=0.3, ell=ell, beta=1)

    def shape(x1, x2):
        return ((x1 - 0.03) ** 2 + 2 * x2**2 + x1 * x2) / 20 + 0.02 * x1**3

    errors, loads = [], []
    for nodes in (7, 14):
        state, first, forces = dense(mb.Microblock((0.01, 0.03)), second, shape, 0.03, nodes, 1.8, solid)
        loads.append(abs(forces.sum() / state.load - 1))
        p, m1, m2 = first.resultants(forces) / state.width**2
        moment = np.array((m2, -m1)) * ell / 2
        size = np.linalg.norm(p)
        errors.append(
            max(np.linalg.norm(state.pressure - p), np.linalg.norm(state.micromoment - moment) / ell) / size
        )
    # with the corners pressing at x, the load is off by 0.1 and more, the fields by 0.4
    assert errors[1] < 0.05 and errors[1] < 0.5 * errors[0] and loads[1] < 6e-3


# balance, reciprocity, energy


@pytest.mark.parametrize("period", [None, 2.0])
def test_both_bodies_carry_the_same_force_and_moments(period):
    """On the cells of the second surface, and on those of the first one: rounding, 1e-12."""

    def shape(x1, x2):
        return (
            ((x1 - 0.03) ** 2 + 2 * x2**2 + x1 * x2) / 20
            + 0.004 * np.sin(3 * x1)
            + 0.003 * np.cos(4 * x2 + 1)
        )

    shape = shape if period is None else lambda x1, x2: waves(x1 / 2, x2 / 2)
    state = problem(mb.Microblock(), OTHER, shape, period, nodes=32).solve(load=1.0)
    counter = state.problem.solver._flexibility(_grid(state)).counter
    forces = np.array(list(state.pressures.values())) * state.width**2
    q = counter.pressed(forces)
    assert q.sum() == pytest.approx(1.0, rel=1e-12)
    if period is not None:  # a moment has no meaning where forces go on on the other side
        return
    y = [x[0] + state.width * (np.arange(len(q)) - counter.beyond) for x in (state.x1, state.x2)]
    p, (M1, M2) = state.pressure * state.width**2, state.micromoment * state.width**2
    assert q.sum(axis=1) @ y[0] == pytest.approx(p.sum(axis=1) @ state.x1 + M2.sum(), abs=1e-12)
    assert q.sum(axis=0) @ y[1] == pytest.approx(p.sum(axis=0) @ state.x2 - M1.sum(), abs=1e-12)
    assert abs(M2.sum()) > 1e-4  # or nothing is tested


@pytest.mark.parametrize("period", [None, 1.0])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_work_of_one_load_on_the_displacement_of_another_is_mutual(law, period):
    """Rounding, 1e-12; and forces of the sum 0 do work."""
    rng = np.random.default_rng(7)
    for second in (OTHER, CLASSICAL):
        solver = problem(law, second, lambda x1, x2: 0 * x1 + 0 * x2, period).solver
        H = solver._flexibility(Grid(16, 1 / 16, (0.0, 0.0)))
        f, g = rng.random((2, len(H.offsets), 16, 16))
        for matrix in (H, H.counter):
            assert np.sum(f * (matrix @ g)) == pytest.approx(np.sum(g * (matrix @ f)), rel=1e-12)
            none = f - f.mean()
            assert np.sum(none * (matrix @ none)) > 0


def test_load_is_the_slope_of_the_energy_of_both():
    """Differences of (1/150)^2, and cells that open or close meanwhile."""
    body = problem(mb.Microblock(), OTHER, nodes=32, window=(-0.9, 0.9))
    low, state, high = (body.solve(approach=d) for d in (0.0298, 0.03, 0.0302))
    assert (high.energy - low.energy) / 4e-4 == pytest.approx(state.load, rel=5e-4)
    assert body.solve(load=state.load).approach == pytest.approx(0.03, rel=1e-7)


@pytest.mark.parametrize("law", [LAWS[0], mb.Microblock((0.001, -0.002))], ids=str)
def test_gaps_are_those_of_both_surfaces_at_the_corners(law):
    """None is negative, closed ones are 0, up to what holds blocks back from twisting: 1e-3 of the approach.
    u2 at a corner is that of the surface by the spline through its cells.
    """
    state = problem(law, OTHER, nodes=64, window=(-1.0, 1.0)).solve(load=1.0)
    surface = RectBivariateSpline(state.x1, state.x2, state.counter_displacement)
    x, half = np.meshgrid(state.x1, state.x2, indexing="ij"), SOLID.ell / 2
    solver = state.problem.solver
    initial, tilt = solver.initial_gaps(state.x1, state.x2), solver.surface_law.tilt(*x)
    inside = (slice(4, -4),) * 2
    for number, ((a, b), own) in enumerate(zip(solver.surface_law.offsets, state.pressures.values())):
        phi = np.array((-half * state.psi[1], half * state.psi[0])) * (len(initial) > 1)
        gap = initial[number] - state.approach + state.displacement - a * phi[0] - b * phi[1]
        gap += (tilt * phi[: len(tilt)]).sum(axis=0) + surface.ev(x[0] + a * half, x[1] + b * half)
        gap, pressed = gap[inside], own[inside] > 0
        assert gap.min() > -1e-3 * state.approach and np.abs(gap[pressed]).max() < 1e-3 * state.approach


@pytest.mark.parametrize("law", [LAWS[0], LAWS[3]], ids=str)
def test_the_second_surface_outside_of_a_window_is_that_of_the_state(law):
    """Forces as points, where cells of 0.03 are 0.5 away: their second moments are 3e-4 of it."""
    state = problem(law, OTHER, nodes=64, window=(-1.0, 1.0)).solve(load=1.0)
    counter = state.problem.solver._flexibility(_grid(state)).counter
    forces = np.array(list(state.pressures.values())) * state.width**2
    places = [1, 50, 60], [20, 2, 60]
    x1, x2 = state.x1[places[0]], state.x2[places[1]]
    found, exact = counter.at(forces, (state.x1, state.x2), x1, x2), counter @ forces
    assert found == pytest.approx(exact[:, places[0], places[1]], rel=1e-3)


def test_blocks_are_held_from_twisting_by_less_than_a_cell_gives_way():
    """HELD of what short waves displace, 0.5 of what a cell does itself, whatever the cells."""
    for width in (0.1, 0.01):
        counter = Counter.on(OTHER, 0.1, OFFSETS, width, 8, False)
        one = np.zeros((8 + 2 * counter.beyond,) * 2)
        one[4, 4] = 1.0
        share = counter.held / counter.displacement(one).max()
        assert 0 < share < 1e-2


# error estimates


def test_the_estimate_holds():
    """Blocks, on 32 cells against 128, as means over the cells of the grid before."""
    blocks = problem(mb.Microblock(), OTHER, nodes=32, residual=1e-7)
    state = blocks.solve(load=1.0)
    assert 0.1 * state.error_estimate < half_space_scenes.errors(blocks, state) < state.error_estimate


@pytest.mark.parametrize("seed", [4, 8])
def test_the_estimate_holds_in_seeded_problems(seed):
    """Of the first 20 seeds the error is 0.61 of the estimate at most."""
    _, _, estimate, error = half_space_scenes.measured(seed, half_space_scenes.two_bodies)
    assert error <= estimate <= half_space_scenes.RTOL


# states, and what is refused


def test_states_show_and_write_the_second_surface(tmp_path):
    state = problem(mb.Microblock(), OTHER, nodes=32).solve(load=1.0)
    assert np.all(np.ravel(profile(state)["counter_displacement"]) == state.counter_displacement.ravel())
    mb.to_csv(state, tmp_path / "state.csv")
    rows = read_records(tmp_path / "state.csv")
    # in the middle of the contact both together are the approach, but for the rotated corners
    lowered = [row["displacement"] + row["counter_displacement"] for row in rows if row["closed"] >= 3]
    assert np.mean(lowered) == pytest.approx(state.approach, rel=0.5) and max(lowered) < 1.01 * state.approach
    figure = state.plot(tmp_path / "two.png")
    assert [axis.get_title() for axis in figure.axes].count("displacement") == 1
    rigid = problem(mb.Microblock(), None, nodes=32).solve(load=1.0)
    assert not rigid.counter_displacement.any() and len(rigid.plot().axes) == len(figure.axes) - 1
    assert "Deformable" in repr(state.problem.summary())
    for again in (copy.deepcopy(state.problem), pickle.loads(pickle.dumps(state.problem))):
        assert again.obstacle == state.problem.obstacle


def space(solid=SOLID, period=None):
    return mb.HalfSpace(solid, period)


def test_a_mesh_takes_rigid_obstacles_alone():
    mesh = ng.Mesh(unit_cube.GenerateMesh(maxh=1))
    body = mb.Body3D(mesh, SOLID, fixed="bottom", contact="top")
    with pytest.raises(mb.BadArgument, match="deforms, and .* on a Body3D takes rigid obstacles alone"):
        mb.Contact(body, mb.Deformable(space(), SPHERE), mb.Microblock())
    with pytest.raises(mb.BadArgument, match="takes a HalfSpace as second body alone"):
        mb.Contact(space(), mb.Deformable(body, SPHERE), mb.Microblock())


def test_a_classical_half_space_is_only_a_second_one():
    assert mb.HalfSpace(CLASSICAL).solid.beta == 0
    state = problem(mb.Microblock(), CLASSICAL, nodes=32).solve(load=1.0)
    assert state.counter_displacement.max() > 0
