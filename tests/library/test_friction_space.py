"""Friction on a half-space: shear, increments, and histories against closed forms and the plane."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import microblock as mb
from microblock.contact_solvers import friction_increments
from microblock.contact_solvers.discs import Discs
from microblock.contact_solvers.event_driven import EventDrivenContact
from microblock.contact_solvers.friction_increments import increments, legs, noted_state
from microblock.contact_solvers.frictional_contact import FrictionalContact
from microblock.data.records import read_records
from microblock.halfplane.kernels import at_rest, plane_symbol
from microblock.halfspace.friction_solver import SurfaceFrictionSolver
from microblock.halfspace.kernels import ShearKernels
from microblock.halfspace.symbol import shear_of_points

F = 0.3
N = 32  # cells along an axis
FEW = 16  # of those that suffice for what no grid changes
P = 4 / 3  # with E* = 1 and R = 1 the classical contact has the radius 1
SPHERE = mb.Sphere(R=1.0)
POINTS = mb.Unilateral(friction=F)
BLOCKS = mb.Microblock(friction=F)


def solid_of(nu=0.3, ell=0.3, E_star=1.0):
    return mb.Cosserat(E=E_star * (1 - nu**2), nu=nu, ell=ell, beta=1)


def problem(law=POINTS, shape=SPHERE, nodes=N, side=2.6, nu=0.3, ell=0.3):
    body = mb.HalfSpace(solid_of(nu, ell))
    return mb.Contact(body, shape, law, mb.Cells(nodes=nodes, window=(-side / 2, side / 2)))


@cache
def equal_bodies(*loads, nodes=32):
    """A history between equal bodies without nu and, as good as, without ell."""
    body = mb.HalfSpace(solid_of(0.0, 1e-6, 2.0))
    cells = mb.Cells(nodes=nodes, window=(-1.2, 1.2))
    return mb.Contact(body, mb.Deformable(body, SPHERE), POINTS, cells).history(P * np.array(loads))


def hertz(state, load):
    """Hertz' pressure under a load over P, at the cells."""
    r2 = state.points[:, 0] ** 2 + state.points[:, 1] ** 2
    return 2 / np.pi * np.sqrt(np.maximum(load ** (2 / 3) - r2, 0))


def relative(state, difference, size):
    return np.linalg.norm(difference) / np.linalg.norm(size)


# --- the response


def test_shear_displaces_as_cerruti_says():
    """For ell -> 0, to the spline: along and across the force, and along the normal."""
    nu = 0.3
    solid = mb.Cosserat(E=2 * (1 + nu), nu=nu, ell=1e-6, beta=1)  # mu = 1
    r = np.array([0.5, 1.0, 3.0])
    z, half_sum, half_difference, _, _ = ShearKernels(partial(shear_of_points, solid), solid.ell)(r)
    assert half_sum + half_difference == pytest.approx(2 / (4 * np.pi * r), rel=1e-9)
    assert half_sum - half_difference == pytest.approx(2 * (1 - nu) / (4 * np.pi * r), rel=1e-9)
    assert z == pytest.approx((1 - 2 * nu) / (4 * np.pi * r), rel=1e-9)


def plane_contact(law, solid, gaps, period, coupled):
    """The contact of a half-plane on cells of a period, by Fourier series of the plane's response."""
    n = gaps.shape[1]
    h = period / n
    k = 2 * np.pi * np.fft.rfftfreq(n, h)
    k[0] = 1.0
    U, V, W = plane_symbol(solid, k)
    Z = U - 1 / (2 * solid.mu * k)
    if law.clamps_rotation:
        Z, U = Z - V**2 / W, U - V**2 / W
    U[0] = 0
    W[0] = at_rest(solid)
    odd = (np.arange(len(k)) % (n // 2) > 0).astype(float)  # neither the mean nor the shortest wave
    even_V = V.copy()
    even_V[0] = solid.ell / (4 * solid.mu)  # rotation of a mean shear

    def circulant(spectrum):
        column = np.fft.irfft(spectrum, n) / h
        return np.array([np.roll(column, j) for j in range(n)]).T

    pressure = [circulant(values) for values in (U, -1j * V * odd, 1j * Z * odd)]  # u, phi, u1
    moment = [circulant(values) for values in (1j * V * odd, W, -even_V)]
    shear = [circulant(values) for values in (-1j * Z * odd, -even_V, U)]
    if len(gaps) == 1:
        return FrictionalContact(pressure[0], pressure[2], shear[2], gaps.ravel(), F, coupled)
    by_corner = [[p + sign * m for p, m in zip(pressure, moment)] for sign in (1, -1)]
    on_face = [q - m for q, m in zip(shear, moment)]
    normal = np.block([[u + sign * phi for u, phi, _ in by_corner] for sign in (1, -1)])
    cross = np.hstack([u1 - phi for _, phi, u1 in by_corner])
    return FrictionalContact(normal, cross, on_face[2] - on_face[1], gaps.ravel(), F, coupled)


@pytest.mark.parametrize("law", [POINTS, mb.Microclamped(friction=F), BLOCKS], ids=str)
@pytest.mark.parametrize("coupled", [True, pytest.param(False, marks=pytest.mark.nightly)])
def test_cylinders_on_a_period_are_those_of_the_plane(law, coupled):
    """The plane's events are exact on its cells. Increments, of the order of one cell of contact each, leave
    some thousandths, of the dissipation a few hundredths; half if there are twice as many."""
    period, n, ell = 6.0, 32, 0.4
    solid = solid_of(0.3, ell)
    x = (np.arange(n) - (n - 1) / 2) * period / n
    shifts = [0.0] if len(law.corners) == 1 else [-ell / 2, ell / 2]
    path = EventDrivenContact(
        plane_contact(law, solid, np.array([(x + shift) ** 2 / 2 for shift in shifts]), period, coupled)
    )
    loads = [(0.6, 0.0), (0.6, 0.6 * F * 0.6), (0.5, -0.3 * F * 0.5)]
    states = [path.follow(*pair) for pair in loads]

    def cylinder(x1, x2):
        return (x1 - period * np.rint(x1 / period)) ** 2 / 2 + 0 * x2

    in_space = mb.Contact(mb.HalfSpace(solid, period=period), cylinder, law, mb.Cells(nodes=n))
    triples = period * np.array([(*pair, 0.0) for pair in loads])
    solver = in_space.solver
    solutions = SurfaceFrictionSolver(solver, triples, coupled)._on_grid(solver.given_window(), n, None)
    for state, solution in zip(states, solutions):
        row = solution.increment
        pressing = state.normal.reshape(len(shifts), -1).sum(axis=0) * period / n
        size = np.linalg.norm(pressing)
        assert np.linalg.norm(row.pressing[:, 3] - pressing) < 2e-3 * size
        assert np.linalg.norm(row.tangential[0, :, 3] - state.tangential * period / n) < 0.02 * F * size
        assert np.abs(row.tangential[1]).max() < 1e-6 * pressing.max()
        assert row.dissipation / period == pytest.approx(state.dissipation, rel=0.05, abs=1e-6)
        assert row.approach == pytest.approx(state.approach, rel=1e-3)


# --- increments


def test_projections_onto_discs_have_the_resultant():
    """Values, radii and resultants by chance; nearest: no other forces of the set are closer, to rounding."""
    random = np.random.default_rng(3)
    radii = random.uniform(0.1, 1.0, 50)
    for share in (0.0, 0.5, 0.999):
        discs = Discs(radii, share * radii.sum() * np.array((0.6, 0.8)))
        values = random.normal(size=(2, 50))
        forces = discs.project(values)
        assert np.hypot(*forces).max() <= 1 + 1e-12 and np.all(np.hypot(*forces) <= radii * (1 + 1e-9))
        assert forces.sum(axis=1) == pytest.approx(discs.resultant, abs=1e-9)
        for _ in range(20):
            other = discs.project(random.normal(size=(2, 50)))
            assert np.sum((values - forces) * (other - forces)) < 1e-7


def test_few_discs_have_their_resultant():
    """Of one to four discs all but one, or all, are soon at their rims: Newton's method then knows no way."""
    random = np.random.default_rng(0)
    for _ in range(300):
        radii = random.uniform(0.2, 1.0, random.integers(1, 5))
        resultant = random.choice((0, 0.5, 0.99)) * radii.sum() * np.array((0.6, -0.8))
        values = random.normal(size=(2, len(radii))) * 10 ** random.uniform(-1, 3)
        forces = Discs(radii, resultant).project(values)
        assert forces.sum(axis=1) == pytest.approx(resultant, abs=1e-9 * radii.sum())
        assert np.all(np.hypot(*forces) <= radii * (1 + 1e-9))


def test_increments_grow_by_equal_radii_and_halve_with_the_cells():
    """By hand: cube roots of P; an eighth of the cells at one P; the last is the end itself."""
    leg = increments(np.zeros(3), np.array((8.0, 1.0, 2.0)), 8.0, 16)
    assert np.cbrt(leg[:, 0]) == pytest.approx(2 * np.arange(1, 17) / 16)
    assert leg[:, 1:] == pytest.approx(leg[:, :1] / 8 * (1.0, 2.0)) and leg[-1].tolist() == [8, 1, 2]
    assert len(increments(leg[-1], np.array((8.0, 0.0, 0.0)), 8.0, 16)) == 2
    assert len(increments(leg[-1], np.array((1.0, 0.0, 0.0)), 8.0, 32)) == 16


@pytest.mark.parametrize("law", [POINTS, BLOCKS], ids=str)
@pytest.mark.nightly(6)
def test_seeded_histories_keep_all_conditions(law, seeds):
    """Gaps, signs, limits, resultants, and slip along the shear at the limit alone, from the responses alone:
    to the residual 1e-7 of an increment, ten times that where alternations end.
    """
    for seed in seeds:
        random = np.random.default_rng(seed)
        loads = P * random.uniform(0.2, 1.0, 3)
        angles = random.uniform(0, 2 * np.pi, 3)
        sizes = F * loads * random.uniform(0, 0.98, 3)
        triples = np.column_stack((loads, sizes * np.cos(angles), sizes * np.sin(angles)))
        solver = problem(law).solver
        history = SurfaceFrictionSolver(solver, triples, coupled=True)
        cells = history._shear_cells(solver.given_window().with_count(16))
        grid = history._friction_increments(cells)
        before = grid.at_rest()
        for leg in legs(triples, 16):
            for load, *shear in leg.tolist():
                after = grid.advanced(before, load, np.array(shear))
                gaps = grid.g0 - after.approach + grid.H @ after.forces + grid.faces.raised(after.tangential)
                size = np.ptp(gaps - grid.g0)
                slip = after.slip - before.slip
                limits = F * after.pressing
                assert min(gaps.min(), -np.abs(gaps * (after.forces > 0)).max()) > -2e-6 * size
                assert np.all(np.hypot(*after.tangential) <= limits * (1 + 1e-9))
                assert after.pressing.sum() == pytest.approx(load)
                assert after.tangential.sum(axis=(1, 2)) == pytest.approx(shear, abs=1e-9)
                assert np.hypot(*slip)[after.stick].max(initial=0.0) < 2e-6 * size
                along = (slip * after.tangential).sum(axis=0) / np.maximum(limits, 1e-300)
                off = slip - np.maximum(along, 0) * after.tangential / np.maximum(limits, 1e-300)
                assert np.hypot(*off)[(after.pressing > 0) & ~after.stick].max(initial=0.0) < 2e-6 * size
                assert after.dissipation >= before.dissipation
                before = after


# --- closed forms


def test_equal_spheres_are_cattaneos_and_mindlins():
    """nu = 0: traction within the estimate, stick radius to half a cell, displacement to 1e-3."""
    pressed, sheared = equal_bodies((1, 0, 0), (1, 0.5 * F, 0)).states
    expected = F * (hertz(sheared, 1.0) - hertz(sheared, 0.5))
    off = sheared.shear_traction - np.column_stack((expected, 0 * expected))
    assert relative(sheared, off, F * hertz(sheared, 1.0)) < sheared.error_estimate < 0.2
    assert np.abs(pressed.shear_traction).max() < 1e-6
    touching = sheared.closed > 0
    parted = (
        sheared.displacement + sheared.opposite - sheared.approach + np.sum(sheared.points**2, axis=1) / 2
    )
    assert np.abs(parted[touching]).max() < 1e-5  # of both surfaces and the sphere
    assert np.abs(sheared.opposite - sheared.displacement)[touching].max() > 0.01  # which shear bends apart
    radius = np.sqrt(sheared.weights @ sheared.stick / np.pi)
    assert radius == pytest.approx(0.5 ** (1 / 3), abs=0.04)
    # 3 (2 - nu) f P/(16 G a) [1 - (1 - Q/(f P))^(2/3)] of each body
    mu = solid_of(0.0, 1e-6, 2.0).mu
    displacement = 2 * 3 * 2 * F * P / (16 * mu) * (1 - 0.5 ** (2 / 3))
    assert sheared.tangential_approach == pytest.approx((displacement, 0), rel=1e-3, abs=1e-6)


def test_equal_spheres_are_unloaded_as_sums_of_states_say():
    """P and Q fall together, faster than friction allows without slip: f [2 p(0.6) - p(0.5) - p(0.7)]."""
    unloaded = equal_bodies((1, 0, 0), (1, 0.5 * F, 0), (0.7, 0, 0)).states[-1]
    expected = F * (2 * hertz(unloaded, 0.6) - hertz(unloaded, 0.5) - hertz(unloaded, 0.7))
    off = unloaded.shear_traction[:, 0] - expected
    assert relative(unloaded, off, F * hertz(unloaded, 0.7)) < unloaded.error_estimate < 0.4


def test_proportional_loads_stick_everywhere():
    """Q/P = 2 f/3: q = (Q/P) p, as each part of the contact sticks from its first touch; less slip with the
    increments."""
    state = equal_bodies((1, 0.4 * F, 0.4 * F)).states[0]
    off = state.shear_traction - 0.4 * F * hertz(state, 1.0)[:, None]
    assert relative(state, off, F * hertz(state, 1.0)) < state.error_estimate < 0.2


def test_a_sphere_that_is_pressed_sticks_as_spence_says():
    """Uncoupled: log((1 + c)/(1 - c))/(2 c) = (f/beta_D) K'(c) (Spence, J. Elasticity 5 (1975) 297), to a
    cell: half of one, and increments of half a cell."""
    nu, friction = 0.3, 0.2
    case = problem(mb.Unilateral(friction=friction), nodes=32, nu=nu, ell=1e-6)
    state = case.history([(P, 0, 0)], coupled=False).states[0]
    dundurs = (1 - 2 * nu) / (2 * (1 - nu))
    radius = brentq(
        lambda c: np.log((1 + c) / (1 - c)) / (2 * c) - friction / dundurs * ellipk(1 - c * c), 0.01, 0.99
    )
    assert np.sqrt(state.weights @ state.stick / np.pi) == pytest.approx(radius, abs=0.06)
    radial = state.points[:, 0] * state.shear_traction[:, 0] + state.points[:, 1] * state.shear_traction[:, 1]
    assert radial.min() > -1e-3 * radial.max()  # the surface is dragged outwards


# --- histories


def states_of(case, *loads):
    """States at loads on 16 cells a side, without an estimate."""
    solver = case.solver
    history = SurfaceFrictionSolver(solver, P * np.array(loads), coupled=True)
    return [solution.state() for solution in history._on_grid(solver.given_window(), FEW, None)]


@cache
def sheared(law, *loads):
    return states_of(problem(law), *loads)


@pytest.mark.parametrize("law", [POINTS, pytest.param(BLOCKS, marks=pytest.mark.nightly)], ids=str)
def test_directions_are_alike(law):
    """x1 and x2 exchanged, and a mirror image: to the residual of increments."""
    along_1 = sheared(law, (1, 0.2, 0))[-1]
    along_2 = sheared(law, (1, 0, 0.2))[-1]
    back = sheared(law, (1, -0.2, 0))[-1]
    q = along_1.shear_traction.reshape(FEW, FEW, 2)
    size = np.abs(q).max()
    exchanged = along_2.shear_traction.reshape(FEW, FEW, 2).swapaxes(0, 1)[..., ::-1]
    assert exchanged == pytest.approx(q, abs=1e-4 * size)
    mirrored = back.shear_traction.reshape(FEW, FEW, 2)[::-1] * (-1, 1)
    assert mirrored == pytest.approx(q, abs=1e-4 * size)
    p = along_1.pressure.reshape(FEW, FEW)
    assert back.pressure.reshape(FEW, FEW)[::-1] == pytest.approx(p, abs=1e-4 * p.max())


def test_a_diagonal_shear_is_as_stiff():
    """To the cells of the contact's edge."""
    along = sheared(POINTS, (1, 0.2, 0))[-1]
    diagonal = sheared(POINTS, (1, 0.2 / 2**0.5, 0.2 / 2**0.5))[-1]
    size = np.hypot(*diagonal.tangential_approach)
    assert size == pytest.approx(along.tangential_approach[0], rel=0.01)
    assert diagonal.tangential_approach == pytest.approx(size / 2**0.5 * np.ones(2), rel=1e-3)


def test_friction_beyond_what_sticks_changes_nothing():
    """All sticks. A residual over the displacement of sliding left q at 0.8 of its size, without a word; of
    1e-7 of what is there the shortest waves, of 32 cells, make 1e-4.
    """
    sticking, rough = (
        problem(mb.Unilateral(friction=friction)).history([(P, 0.1, 0)], coupled=False).states[0]
        for friction in (20.0, 1e6)
    )
    change = rough.shear_traction - sticking.shear_traction
    assert relative(sticking, change, sticking.shear_traction) < 1e-3


def test_units_change_no_digits():
    """Lengths in thousandths, stresses in millions: forces are as they were."""
    solid = solid_of()
    small = mb.HalfSpace(mb.Cosserat(E=solid.E * 1e6, nu=0.3, ell=0.3e-3, beta=1))
    cells = mb.Cells(nodes=N, window=(-1.3e-3, 1.3e-3))
    (state,) = states_of(mb.Contact(small, mb.Sphere(R=1e-3), POINTS, cells), (1, 0.2, 0))
    (usual,) = sheared(POINTS, (1, 0.2, 0))
    assert state.tangential_approach * 1e3 == pytest.approx(usual.tangential_approach, abs=1e-9)
    assert state.shear_traction / 1e6 == pytest.approx(usual.shear_traction, abs=1e-7)
    assert state.dissipation * 1e3 == pytest.approx(usual.dissipation, rel=1e-6)


@pytest.mark.nightly
def test_without_nodes_the_estimate_meets_rtol():
    case = problem().with_(method=mb.Cells())
    (state,) = case.history([(P, 0.2 * P, 0)], rtol=0.1).states
    assert 0 < state.error_estimate <= 0.1 and not state.warnings


@pytest.mark.nightly
def test_an_rtol_that_no_grid_reaches_is_refused_before_the_last_ones():
    """After the first estimate, on 64 cells, as errors are at most divided by 2.5 from grid to grid."""
    case = problem(mb.Unilateral(friction=0.01)).with_(method=mb.Cells(window=(-1.3, 1.3)))
    with pytest.raises(mb.NotConverged, match="ask for rtol") as caught:
        case.history([(P, 0, 0)], coupled=False, rtol=1e-4)
    assert 0.01 < caught.value.rtol_reached < 0.1


def test_a_flat_punch_settles():
    """Gaps do not change under its face, so that residuals are over the displacement itself; it slips at the
    rim, where the surface is dragged most, and sticks in the middle."""
    (state,) = states_of(problem(shape=mb.FlatPunch(half_width=1.0)), (1, 0.15, 0))
    assert state.residual < 2e-6 and 0.2 < state.stick.sum() / (state.closed > 0).sum() < 0.9


def test_results_go_where_others_go(tmp_path):
    history = problem().history([(P, 0.2 * P, 0)])
    (state,) = history.states
    history.save(tmp_path / "history.npz")
    assert mb.load(tmp_path / "history.npz").to_dict() == history.to_dict()
    data = state.to_dict()
    assert np.shape(data["shear_traction"]) == np.shape(data["slip"]) == (N * N, 2) and data["shear"][1] == 0
    mb.to_csv(history, tmp_path / "history.csv")
    rows = read_records(tmp_path / "history.csv")
    assert sum(row["weight"] * row["shear_traction1"] for row in rows) == pytest.approx(0.2 * P)
    assert rows[0]["shear1"] == pytest.approx(0.2 * P)
    assert history.to_xarray().shear_traction.dims == ("state", "x1", "x2", "component")
    assert history.plot(tmp_path / "history.png") and state.plot(tmp_path / "state.png")
    q = state.shear_traction_at([(0.0, 0.0), (5.0, 0.0)])
    assert q.shape == (2, 2) and not q[1].any() and 0 < np.hypot(*q[0]) <= F * state.pressure_at([(0, 0)])[0]


def test_a_dissipation_that_cells_and_increments_leave_open_is_said():
    """Half as many have 14 % less of it where few cells slip, and 1 % where most do."""
    case = problem()
    followed = SurfaceFrictionSolver(
        case.solver, P * np.array([(1, 0, 0), (1, 0.5 * F, 0), (1, 0.9 * F, 0)]), coupled=True
    )
    coarse, fine = (followed._on_grid(case.solver.given_window(), count, None) for count in (FEW // 2, FEW))
    states = [noted_state(solution, before.increment) for before, solution in zip(coarse, fine)]
    said = [any("dissipation changes by 0.1" in words for words in state.warnings) for state in states]
    assert said == [False, True, False]
    without = replace(fine[1], increment=replace(fine[1].increment, dissipation=0.0))
    assert any(
        "dissipation changes by 1 of" in words for words in noted_state(without, coarse[1].increment).warnings
    )


def test_a_history_has_no_stiffness():
    """That of the same cells without friction is 3 % too small, as sticking shear lifts the face."""
    state, closer = problem(nodes=32, nu=0.1).history([(P, 0, 0), (1.002 * P, 0, 0)]).states
    free = mb.Contact(mb.HalfSpace(solid_of(0.1)), SPHERE, mb.Unilateral(), mb.Cells(nodes=128)).solve(load=P)
    slope = (closer.load - state.load) / (closer.approach - state.approach)
    assert slope > 1.02 * free.stiffness and state.stiffness is None


def test_what_is_out_of_scope_is_said():
    body = mb.HalfSpace(solid_of())
    blocks = mb.Contact(body, mb.Deformable(body, SPHERE), BLOCKS)
    with pytest.raises(mb.BadArgument, match="laws without blocks"):
        blocks.history([(1, 0, 0)])
    with pytest.raises(mb.BadArgument, match=r"triples \(P, Q1, Q2\)"):
        problem().history([(1, 0)])
    with pytest.raises(mb.BadArgument, match="beyond it the obstacle slides on"):
        problem().history([(1, 0.25, 0.25)])
    with pytest.raises(mb.BadArgument, match="chooses the nodes"):
        problem().history([(1, 0, 0)], rtol=0.1)


def test_a_history_of_hours_is_refused_at_once():
    with pytest.raises(mb.NotConverged, match="512 x 512 cells would take some .* minutes"):
        problem(BLOCKS, nodes=512).history([(P, 0, 0)])


def test_alternations_that_do_not_settle_are_said(monkeypatch):
    monkeypatch.setattr(friction_increments, "ALTERNATIONS", 1)
    with pytest.raises(mb.NotConverged, match="coupled=False"):
        problem().history([(P, 0.1 * P, 0)])
