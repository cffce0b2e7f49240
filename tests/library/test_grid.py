"""Large and periodic problems on uniform cells: products, contact states, closed forms."""

import math

import numpy as np
import pytest

import microblock as mb
from microblock import BadArgument, NotConverged
from microblock.corners import active_set, projected_gradients
from microblock.halfplane.cells import CellGrid
from microblock.halfplane.kernels import kernels, symbol
from microblock.model.closed_forms import Wavy
from microblock.model.quadrature import gauss_rule

SOLID = mb.Cosserat(E=2.0, nu=0.3, ell=0.2, beta=1.0)
STEPS = np.random.default_rng(7).uniform(-0.2, 0.2, 400)
AMPLITUDE = 1 / math.pi  # of waves of length 1: with E* = 1 the unit of pressure is that of full closure


def jagged(x):
    """Rough beyond any smoothness, of either sign."""
    return STEPS[np.round((np.asarray(x) + 2) * 97).astype(int) % len(STEPS)]


LAWS = {
    "unilateral": mb.Unilateral(),
    "microclamped": mb.Microclamped(),
    "microblock": mb.Microblock(),
    "rough psi0": mb.Microblock(jagged),
    "levers": mb.Microblock(jagged, psi0_in="levers"),
}
OBSTACLES = {
    "cylinder": mb.Cylinder(1.0),
    "punch": mb.Punch(0.5, 0.1),
    "wave": mb.Wave(0.1, 0.3),
    "jagged": jagged,
}


def dense(cells, law, obstacle):
    return cells.body.compliance(cells.x, clamped=law.clamps_rotation).corner_system(law, obstacle)


@pytest.mark.parametrize("name", LAWS)
def test_products_are_those_of_the_dense_matrix(name):
    law, cells = LAWS[name], CellGrid(mb.HalfPlane(SOLID), -1.0, 1.3, 57)
    H, _, _ = dense(cells, law, mb.Cylinder(1.0))
    flexibility = cells.flexibility(law)
    forces = np.random.default_rng(0).standard_normal(flexibility.shape)
    expected = (H @ forces.ravel()).reshape(forces.shape)
    # the same kernels; FFT rounding grows like log n only
    assert np.abs(flexibility @ forces - expected).max() <= 1e-13 * np.abs(expected).max()


def test_far_cells_need_fewer_gauss_points():
    table = mb.HalfPlane(SOLID)
    few, (many,) = table.cells(60, 0.07)[:, 40:41], [_averages(table, 40, 0.07)]
    assert few[:, 0] == pytest.approx(many, rel=1e-12, abs=1e-15)  # rounding of the table


def _averages(body, distance, width):
    points, gauss = gauss_rule(40)
    away = (distance + points - 0.5) * width / SOLID.ell
    values = kernels(SOLID.nu, SOLID.beta, SOLID.curvature)(away, range(5)) @ gauss
    return (1 - SOLID.nu) / SOLID.mu * values


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(jagged)])
def test_a_period_is_the_sum_of_its_images(law):
    """The symbol at k = 2 pi m/L against cells and many images of theirs, for forces that sum to nothing."""
    period, count, images = 2.0, 64, 60
    periodic = CellGrid(mb.HalfPlane(SOLID, period), -1.0, 1.0, count).flexibility(law)
    x = np.linspace(-1, 1, count, endpoint=False) + 1 / count
    smooth = np.array(
        [np.cos(np.pi * x + corner) + 0.3 * np.sin(3 * np.pi * x) for corner in range(len(periodic.levers))]
    )
    if len(smooth) == 2:  # whole waves in p and m: levers divided out
        a, b = periodic.levers
        smooth = np.array((smooth[1] - b * smooth[0], a * smooth[0] - smooth[1])) / (a - b)
    whole = CellGrid(mb.HalfPlane(SOLID), -1 - period * images, 1 + period * images, count * (2 * images + 1))
    many = np.tile(smooth, 2 * images + 1)
    wide = law
    if isinstance(law, mb.Microblock):
        wide = mb.Microblock(lambda y: jagged((y + 1) % period - 1))
    direct = (whole.flexibility(wide) @ many)[:, count * images : count * (images + 1)]
    found = periodic @ smooth
    direct, found = direct - direct.mean(), found - found.mean()
    # cells see sin(k h/2)/(k h/2) of a wave, 4e-3 at the third; the images left out 1/images
    assert np.abs(found - direct).max() <= 1e-2 * np.abs(found).max()


def test_a_uniform_moment_rotates_all_blocks_alike():
    """The mean of p does nothing on a period, that of m what the symbol does for k -> 0."""
    flexibility = CellGrid(mb.HalfPlane(SOLID, 1.0), -0.5, 0.5, 40).flexibility(mb.Microblock())
    # p = 0, m = 1 over the cells
    u, phi = flexibility.surface(np.array([np.full(40, 0.5 / 40), np.full(40, -0.5 / 40)]))
    assert phi == pytest.approx(np.full(40, symbol(SOLID, [1e-9])[2, 0]), rel=1e-6)
    assert np.abs(u).max() < 1e-15
    u, phi = flexibility.surface(np.full((2, 40), 1 / 40))
    assert np.abs(u).max() < 1e-15 and np.abs(phi).max() < 1e-15  # rounding


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("name", LAWS)
def test_products_are_symmetric_and_their_preconditioner_positive(name, periodic):
    body = mb.HalfPlane(SOLID, 2.3) if periodic else mb.HalfPlane(SOLID)
    flexibility = CellGrid(body, -1.0, 1.3, 36).flexibility(LAWS[name])
    unit = np.eye(flexibility.levers.size).reshape(-1, *flexibility.shape)
    H = np.array([(flexibility @ one).ravel() for one in unit])
    M = np.array([flexibility.precondition(one).ravel() for one in unit])
    for matrix in (H, M):
        assert np.abs(matrix - matrix.T).max() <= 1e-13 * np.abs(matrix).max()  # rounding
    assert np.linalg.eigvalsh(M)[0] > 0
    sums = np.eye(len(H)) - 1 / len(H)
    assert np.linalg.eigvalsh(sums @ H @ sums)[1] > 0  # the first is that of the constant, 0


@pytest.mark.parametrize("obstacle", OBSTACLES)
@pytest.mark.parametrize("name", LAWS)
def test_states_agree_with_pivoting(name, obstacle):
    # up to 256 corners are exchanged, others found by gradients alone
    count = 300 if obstacle in ("cylinder", "jagged") else 121
    law, cells = LAWS[name], CellGrid(mb.HalfPlane(SOLID), -1.0, 1.3, count)
    H, g0, _ = dense(cells, law, OBSTACLES[obstacle])
    for load in (0.01, 0.5):
        expected = active_set.solve(H, g0, load=load)
        gaps = g0.reshape(len(law.corners), -1)
        found = projected_gradients.solve(cells.flexibility(law), gaps, load=load, rtol=1e-12)
        # residual times the condition of H on zero-sum vectors, some hundreds here
        assert np.abs(found.forces.ravel() - expected.forces).max() <= 1e-9 * expected.forces.max()
        assert found.approach == pytest.approx(expected.approach, rel=1e-10, abs=1e-12)
        assert found.load == pytest.approx(load, rel=1e-13) and found.kkt <= 1e-12


def test_given_approach():
    law, cells = LAWS["rough psi0"], CellGrid(mb.HalfPlane(SOLID, 2.3), -1.0, 1.3, 121)
    flexibility, g0 = cells.flexibility(law), np.array([mb.Wave(0.1, 2.3).height(cells.x)] * 2)
    at_load = projected_gradients.solve(flexibility, g0, load=0.05, rtol=1e-12)
    again = projected_gradients.solve(flexibility, g0, approach=at_load.approach, rtol=1e-12)
    assert again.forces == pytest.approx(at_load.forces, abs=1e-9 * at_load.forces.max())
    apart = projected_gradients.solve(flexibility, g0, approach=-0.01)
    assert apart.load == 0 and apart.gaps == pytest.approx(g0 + 0.01)
    assert projected_gradients.solve(flexibility, g0, load=0).approach == g0.min()


def test_indefinite_level_is_refused_by_name():
    cells = CellGrid(mb.HalfPlane(SOLID), -200.0, 200.0, 64)  # -log x < 0 far away
    with pytest.raises(BadArgument, match="give the load instead"):
        projected_gradients.solve(cells.flexibility(mb.Unilateral()), cells.x[None] ** 2 / 1e3, approach=1.0)


def test_residual_out_of_reach(monkeypatch):
    monkeypatch.setattr(projected_gradients, "OUTER_STEPS", 2)
    cells = CellGrid(mb.HalfPlane(SOLID), -1.0, 1.0, 300)
    with pytest.raises(NotConverged, match=r"relative residual \d\.\de-\d\d") as failure:
        projected_gradients.solve(cells.flexibility(mb.Unilateral()), cells.x[None] ** 2, load=0.5)
    assert failure.value.iterations == 2 and failure.value.reached is None  # which is a load


def wave(law, ell=0.05, beta=1.0, nodes=None):
    """A cosine of the wavelength 1 on blocks of side ell, E* = 1."""
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=ell, beta=beta)
    return mb.Contact(mb.HalfPlane(solid, period=1.0), mb.Wave(AMPLITUDE, 1.0), law, mb.Cells(nodes=nodes))


def classical_wave(nodes=None):
    return wave(mb.Unilateral(), beta=1e-10, nodes=nodes)


def polygon_error(x, values, exact):
    """Relative L2 error over a period 1 of the polygon through (x, values) against a function."""
    fine = (np.arange(16 * len(x)) + 0.5) / (16 * len(x)) - 0.5
    true = exact(fine)
    return float(np.linalg.norm(np.interp(fine, x, values, period=1.0) - true) / np.linalg.norm(true))


@pytest.mark.parametrize("mean", [0.02, 0.3, 0.95])
def test_westergaard_and_the_order(mean):
    errors = []
    for nodes in (200, 400, 800, 1600):
        state = classical_wave(nodes).solve(load=mean)
        errors.append(polygon_error(state.x, state.pressure, Wavy(1.0, 1.0, mean).pressure))
        assert errors[-1] <= 1.1 * state.error_estimate  # 150 seeded states: at most 1.001
    order = -np.polyfit(np.log([200, 400, 800, 1600]), np.log(errors), 1)[0]
    assert order == pytest.approx(1, abs=0.35)  # roots at edges, which fall on the cells anyhow
    half = Wavy(1.0, 1.0, mean).half_width
    assert state.zones["contact"] == [pytest.approx((-half, half), abs=1 / 1600)]


def test_westergaard_closes():
    for mean in (1.0, 1.7):
        state = classical_wave(256).solve(load=mean)
        exact = Wavy(1.0, 1.0, mean).pressure(state.x)
        assert state.pressure == pytest.approx(exact, abs=1e-8)  # linear then: the residual asked for
        assert state.approach == pytest.approx(AMPLITUDE, rel=1e-8)  # the mean level of the wave
    with pytest.raises(BadArgument, match="mean height"):
        classical_wave(256).solve(approach=1.01 * AMPLITUDE)  # no load presses deeper than the mean
    half = Wavy(1.0, 1.0, 0.5)
    # rectangles
    assert half.pressure(np.linspace(-0.5, 0.5, 100001)).mean() == pytest.approx(0.5, rel=1e-4)
    assert half.half_width == pytest.approx(0.25)


def test_microblocks_close_where_their_waves_say():
    """Closed gaps ask for u = d - D + D cos(k ell/2) cos(k x) and phi = D sin(k ell/2) sin(k x), D the
    amplitude."""
    problem = wave(mb.Microblock(), ell=0.2, nodes=512)
    k = 2 * np.pi
    (U,), (V,), (W,) = symbol(problem.solid, np.array([k]))
    p1, m1 = np.linalg.solve([[U, V], [V, W]], AMPLITUDE * np.array((np.cos(0.1 * k), np.sin(0.1 * k))))
    closure = float(np.hypot(p1, m1))  # corner pressures (p -+ m)/2 >= 0
    state = problem.solve(load=1.001 * closure)
    assert all(np.all(own > 0) for own in state.pressures.values())
    phase = 2 * np.pi * state.x
    # linear then, and the symbol exact on the grid: the residual asked for
    assert state.pressure == pytest.approx(1.001 * closure + p1 * np.cos(phase), abs=1e-7)
    assert state.micromoment == pytest.approx(0.1 * m1 * np.sin(phase), abs=1e-8)
    less = problem.solve(load=0.999 * closure)
    assert not all(np.all(own > 0) for own in less.pressures.values())


def test_agrees_with_fitted_panels():
    solid = mb.Cosserat(E=2 * (1 - 0.09), nu=0.3, ell=0.25, beta=1)
    for law in (mb.Microblock(0.02), mb.Microclamped()):
        fitted = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(1.0), law).solve(load=1.5, rtol=1e-6)
        state = fitted.problem.with_(method=mb.Cells(window=(-1.5, 1.5))).solve(load=1.5, rtol=2e-3)
        exact = fitted.pressure_at(state.x)
        assert np.linalg.norm(state.pressure - exact) <= state.error_estimate * np.linalg.norm(exact)
        assert state.error_estimate <= 2e-3
        moment = np.interp(fitted.x, state.x, state.micromoment)
        # roots at edges, pointwise
        assert np.abs(moment - fitted.micromoment).max() <= 0.03 * np.abs(moment).max()
        some = slice(None, None, 40)
        size = max(np.abs(state.psi).max(), 1e-9)
        assert state.psi[some] == pytest.approx(fitted.solution.rotation(state.x[some]), abs=1e-3 * size)
        assert state.energy == pytest.approx(fitted.energy, rel=1e-4)  # second order in the pressure


def test_far_images_do_not_matter():
    solid = mb.Cosserat(E=2 * (1 - 0.09), nu=0.3, ell=0.25, beta=1)
    parts, window = (mb.Cylinder(1.0), mb.Microblock()), (-1.5, 1.5)
    alone = mb.Contact(mb.HalfPlane(solid), *parts, mb.Cells(nodes=300, window=window)).solve(load=1.5)
    period = mb.Contact(mb.HalfPlane(solid, period=60.0), *parts, mb.Cells(nodes=6000)).solve(load=1.5)
    there = np.interp(alone.x, period.x, period.pressure)
    # images bend the surface by (pi a/L)^2 = 3e-3 of its curvature
    assert np.linalg.norm(there - alone.pressure) <= 1e-2 * np.linalg.norm(there)


def rotations(profile, size):
    """psi0(x) of a root mean square `size` (radians), with the waves of a Rough profile."""
    height = math.sqrt(np.sum(np.abs(profile.amplitudes) ** 2) / 2)
    return lambda x: size / height * profile.height(x)


def test_estimate_holds_on_rough_profiles():
    for seed in (1, 2, 3):
        law = mb.Microblock(rotations(mb.Rough(1.0, 1.0, 0.8, (4, 64), seed + 1), math.radians(1)))
        solid = mb.Cosserat(E=(1 - 0.3**2) / 0.1, nu=0.3, ell=0.01, beta=1.0)
        profile = mb.Rough(1.0, 0.1, 0.8, (4, 64), seed)
        problem = mb.Contact(mb.HalfPlane(solid, period=1.0), profile, law)
        state, best = (problem.with_(method=mb.Cells(nodes=nodes)).solve(load=0.05) for nodes in (1024, 4096))
        p, q = best.pressure, state.pressure
        error = np.linalg.norm(np.interp(best.x, state.x, q) - p) / np.linalg.norm(p)
        # 48 seeded states: errors 0.19 to 0.54 of the estimate
        assert error <= state.error_estimate <= 10 * error


def test_a_grid_is_refined_until_the_tolerance_holds():
    problem = classical_wave()
    for rtol in (3e-2, 3e-3):
        state = problem.solve(load=0.2, rtol=rtol)
        assert state.error_estimate <= rtol
        assert polygon_error(state.x, state.pressure, Wavy(1.0, 1.0, 0.2).pressure) <= rtol
    near = problem.with_(method=mb.Cells(nodes=len(state.x))).solve(load=0.21, initial=state)
    assert near.error_estimate <= 3e-3 and near.iterations < 60 and near.load == pytest.approx(0.21)
    # what is asked for holds, and so does what is usual
    assert problem.solve(load=0.21, rtol=3e-2, initial=state).error_estimate <= 3e-2
    assert problem.solve(load=0.21, initial=state).error_estimate <= 1e-2


def test_contact_beyond_the_window_is_said():
    method = mb.Cells(nodes=100, window=(-0.3, 0.3))
    with pytest.raises(NotConverged, match="window"):
        mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(1.0), mb.Unilateral(), method).solve(load=1.0)
    punch = mb.Contact(mb.HalfPlane(SOLID), mb.Punch(0.3), mb.Unilateral(), method)
    assert punch.solve(load=1.0).load == pytest.approx(1.0)  # there it ends


def test_rough_profile_is_what_it_says():
    profile = mb.Rough(2.0, slope=0.1, waves=(2, 50), seed=3)
    x = np.linspace(0, 2, 4001)
    assert profile.height(x + 2) == pytest.approx(profile.height(x), abs=1e-12)
    # differences
    assert np.sqrt(np.mean(np.gradient(profile.height(x), x) ** 2)) == pytest.approx(0.1, rel=1e-3)
    assert np.array_equal(mb.Rough(2.0, 0.1, waves=(2, 50), seed=3).height(x), profile.height(x))


# the tilted punch pressed on a part of its width, and on all of it
@pytest.mark.parametrize("load", [0.008, 0.03])
def test_estimate_holds_beside_edges_of_the_obstacle(load):
    """Without a weight the norm is infinite there: no number of cells met any rtol."""
    from microblock.model.closed_forms import tilted_punch
    from microblock.model.zones import distance_to_ends

    punch = mb.Punch(1.0, tilt=0.01)
    body = mb.HalfPlane(mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.3, beta=1e-10))
    state = mb.Contact(body, punch, mb.Unilateral(), mb.Cells(window=(-1.3, 1.3))).solve(load=load, rtol=0.05)
    weights = distance_to_ends(state.x, punch.ends, (0.0,))
    exact = tilted_punch(state.x, load, 1.0, 0.01, 1.0)[0]
    error = np.sqrt(weights @ (state.pressure - exact) ** 2 / (weights @ exact**2))
    assert error <= state.error_estimate <= 0.05 and len(state.x) < 2**17


def test_westergaards_approach():
    """Against the displacement of his pressure at x = 0 by quadrature, and full closure, where it is the
    mean level of the wave."""
    from scipy.integrate import quad

    for mean in (0.01, 0.3, 0.9):
        exact = Wavy(1.0, 1.0, mean)
        level = quad(
            lambda x: exact.pressure(x) * math.log(2 * math.sin(math.pi * x)), 0, exact.half_width, limit=200
        )[0]
        # quadrature; E* = 1, amplitude 1/pi
        assert exact.approach_over_amplitude == pytest.approx(-4 * level, rel=1e-8)
    assert Wavy(1.0, 1.0, 1.0).approach_over_amplitude == Wavy(1.0, 1.0, 1.4).approach_over_amplitude == 1.0
