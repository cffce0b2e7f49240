"""The response of half-spaces: symbols against the field equations, kernels against the half-plane, rotated
blocks by vectors, a second body against a dense reference; conditions, balance and reciprocity.
"""

import numpy as np
import pytest
from scipy.linalg import schur
from scipy.special import j0

import microblock as mb
from microblock.contact_solvers.fft_compliance import Grid
from microblock.halfplane.kernels import normal_symbol, short_waves
from microblock.halfplane.kernels import symbol as plane_symbol
from microblock.halfspace.kernels import ORDERS, Radial, kernels
from microblock.halfspace.square_search import beyond
from microblock.halfspace.squares import Squares
from microblock.halfspace.symbol import along
from tests.states import on_cells

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
OTHER = mb.Cosserat(E=60, nu=0.2, ell=0.2, beta=0.7, alpha_prime=0.3, beta_prime=-0.2)
CLASSICAL = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=0)
SPHERE = mb.Sphere(R=10)
LAWS = [mb.Unilateral(), mb.Microclamped(), mb.Microblock(), mb.Microblock((0.01, -0.02))]
MODULI = {
    "usual": {},
    "weak": {"beta": 0.3, "alpha_prime": 0.4, "beta_prime": -0.7, "curvature": 1.1},
    "strong": {"beta": 1.8, "alpha_prime": 1.0, "beta_prime": 0.9},
    # W_par has a pole where its integrals run: near the branch points, beside their grading, below both
    "pole": {"alpha_prime": 0.5, "beta_prime": 1.1},
    "graded": {"beta_prime": 1.2},
    "below": {"alpha_prime": 2.0, "beta_prime": 1.9},
}


def problem(law, second=None, shape=SPHERE, period=None, solid=SOLID, **cells):
    obstacle = shape if second is None else mb.Deformable(mb.HalfSpace(second, period), shape)
    return mb.Contact(mb.HalfSpace(solid, period), obstacle, law, mb.Cells(**cells))


# --- symbols and kernels


def turned_by_modes(solid, k):
    """W_par from the field equations of u2, psi1, psi3 as a linear system in x3, by its Schur form."""
    mu, mu_c, stiffness = solid.mu, solid.mu_c, solid.ell**2 * solid.mu
    a, b, c = solid.alpha_prime, solid.beta_prime, solid.curvature
    A, B, C = (np.zeros((3, 3), complex) for _ in range(3))
    ik = 1j * k
    # twice the energy: |derivative . q' + value . q|^2 with these weights, q = (u2, psi1, psi3)
    for weight, derivative, value in (
        (mu, (0, 0, 0), (ik, 0, 0)),
        (mu, (1, 0, 0), (0, 0, 0)),
        (mu_c, (0, 0, 0), (ik, 0, -2)),
        (mu_c, (1, 0, 0), (0, 2, 0)),
        (stiffness * a, (0, 0, 1), (0, ik, 0)),
        (stiffness * (c + b), (0, 0, 0), (0, ik, 0)),
        (stiffness * (c + b), (0, 0, 1), (0, 0, 0)),
        (stiffness * (c + b) / 2, (0, 1, 0), (0, 0, ik)),
        (stiffness * (c - b) / 2, (0, 1, 0), (0, 0, -ik)),
    ):
        derivative, value = np.array(derivative, complex), np.array(value, complex)
        A += weight * np.outer(derivative.conj(), derivative)
        B += weight * np.outer(derivative.conj(), value)
        C += weight * np.outer(value.conj(), value)
    inverse = np.linalg.inv(A)
    system = np.block([[-inverse @ B, inverse], [C - B.conj().T @ inverse @ B, B.conj().T @ inverse]])
    _, vectors, _ = schur(system, output="complex", sort="rhp")  # what decays downwards
    return np.linalg.inv(vectors[3:, :3] @ np.linalg.inv(vectors[:3, :3]))[1, 1].real * solid.ell**2 / 4


@pytest.mark.parametrize("name", MODULI)
def test_moments_along_the_wave_turn_as_the_field_equations_say(name):
    """To the Schur form's own rounding, which grows with k ell."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=0.2, **{"beta": 1, **MODULI[name]})
    for k in (0.05, 1.0, 40.0, 300.0):
        assert along(solid, np.array(k)) == pytest.approx(turned_by_modes(solid, k), rel=1e-11)


def test_fast_transforms_are_those_in_closed_form():
    """Of (1 + exp(-2 k))/k, over 13 decades: 1e-11 of the spline, over what 1/k alone has."""
    table, r = Radial(lambda k: np.tile((1 + np.exp(-2 * k)) / k, (6, 1)), 0.3), np.geomspace(1e-7, 1e6, 1000)
    root, signs = np.hypot(r, 2), np.array([[1], [1], [1], [-1], [1], [1]])  # J2 has a minus
    turned = ((root - 2) / r) ** ORDERS[:, None]
    assert signs * table(r) * 2 * np.pi * r == pytest.approx(1 + r / root * turned, abs=1e-11)


@pytest.mark.parametrize("beta", [1e-16, 1e-8, 1.999])
def test_kernels_are_right_where_the_layer_is_thin_or_thick(beta):
    """Next to a load the parts of rotations that depend on its direction vanish beside the others, far away
    the body is classical: to the squares of r and 1/r over the layer.
    """
    table = kernels(mb.Cosserat(E=2, nu=0.0, ell=1.0, beta=beta))
    near, far = table(np.array([1e-6, 1e10])).T
    assert abs(near[3]) < 1e-5 * near[2] and near[2] * 1e-6 == pytest.approx(1 / 16 / np.pi, rel=1e-4)
    assert far[0] * 1e10 == pytest.approx(1 / 2 / np.pi, rel=1e-3)


# --- rotated blocks


def tilts(x1, x2):
    """psi0 about both axes, of both coordinates, of a period 3."""
    k = 2 * np.pi / 3
    return 0.02 * np.sin(k * x1 + 2 * k * x2), 0.015 * np.cos(k * x1 - k * x2 + 0.5)


def hilly(x1, x2):
    k = 2 * np.pi / 3
    one, two = (0.05 * (1 - np.cos(k * x)) + 0.01 * np.sin(k * x) for x in (x1, x2 + 0.3))
    return one + 0.7 * two


@pytest.mark.parametrize("where", ["gaps and levers", "levers"])
def test_gaps_and_moments_are_those_of_vectors(where):
    """Corners at x_O + (ell/2)(N + a S1 + b S2), their displacement u + psi x r, their moment r x f."""
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2, alpha_prime=0.3, beta_prime=-0.2)
    law = mb.Microblock((lambda *x: tilts(*x)[0], lambda *x: tilts(*x)[1]), where)
    state = on_cells(problem(law, None, hilly, 3.0, solid, nodes=32, residual=1e-11).solve(load=1.8))
    x1, x2 = np.meshgrid(state.x1, state.x2, indexing="ij")
    zero, one = np.zeros_like(x1), np.ones_like(x1)
    e1, e2, e3 = (
        np.stack(each, axis=-1) for each in ((one, zero, zero), (zero, one, zero), (zero, zero, one))
    )
    psi0, psi = (np.stack((*each, zero), axis=-1) for each in (tilts(x1, x2), state.psi))
    N, S1, S2 = (e + np.cross(psi0, e) for e in (e3, e1, e2))
    half, moment = state.problem.solid.ell / 2, np.zeros_like(psi)
    for (a, b), force in zip([(-1, -1), (-1, 1), (1, -1), (1, 1)], state.pressures.values()):
        r = half * (N + a * S1 + b * S2)
        raised = half * (a * S1 + b * S2)[..., 2] * (where != "levers") + np.cross(psi, r)[..., 2]
        gap = hilly(x1 + half * a, x2 + half * b) - raised - state.approach + state.displacement
        # the residual of the conditions, over the range of the displacement
        assert gap.min() > -1e-9 and np.abs(gap[force > 0]).max() < 1e-9
        moment += np.cross(r, -force[..., None] * e3)
    assert moment[..., :2].transpose(2, 0, 1) == pytest.approx(state.micromoment, abs=1e-12)


def test_forces_of_blocks_that_are_not_unique_have_the_least_norm():
    """The state is as symmetric as the problem; cells at an edge may fall on either
    side by rounding.
    """
    state = on_cells(problem(mb.Microblock(), nodes=48).solve(load=1.0))
    for same in (state.closed[::-1], state.closed[:, ::-1], state.closed.T):
        assert np.any(state.closed == 4) and np.count_nonzero(same != state.closed) <= 4
    forces = np.array(list(state.pressures.values()))
    alternating = (forces[0] - forces[1] - forces[2] + forces[3])[(forces > 0).all(axis=0)]
    assert np.abs(alternating).max() < 1e-12 * forces.max()


# --- conditions, closed forms


@pytest.mark.parametrize("second", [None, OTHER], ids=["rigid", "two bodies"])
def test_two_crossed_waves_in_full_contact_are_those_of_the_half_plane(second):
    """Corner by corner, added; the polynomial through five cells leaves (k width)^6/100 of u2."""
    k, depth, ell = 2 * np.pi, 1e-4, 0.13
    one = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    (U,), (V,), (W,) = plane_symbol(one, np.array([k]))
    U2 = normal_symbol(OTHER, np.array([k]))[0] if second else 0.0
    c, s = np.cos(k * ell / 2), np.sin(k * ell / 2)
    matrix = [[U + U2 * c * c, V + U2 * c * s], [V + U2 * c * s, W + U2 * s * s]]
    p, m = np.linalg.solve(matrix, depth * np.array((c, s)))

    def height(x1, x2):
        return -depth * (np.cos(k * x1) + np.cos(k * x2))

    solved = problem(mb.Microblock(), second, height, 1.0, one, nodes=64, residual=1e-11).solve(load=1.0)
    state = on_cells(solved)
    x1, x2 = np.meshgrid(state.x1, state.x2, indexing="ij")
    assert state.pressure == pytest.approx(1.0 + p * (np.cos(k * x1) + np.cos(k * x2)), abs=1e-7)
    assert -state.micromoment[1] == pytest.approx(ell / 2 * m * np.sin(k * x1), abs=1e-7)


# --- the second body


def point_load(solid, r):
    """u2 at distances r under a unit force: the Hankel transform of U2 along real wavenumbers; beyond the
    last one U2 is that of short waves.
    """
    short, last = short_waves(solid)[0], 3000 / solid.ell
    k = np.concatenate((np.linspace(0, last / 100, 20001), np.linspace(last / 100, last, 100001)[1:]))
    middle, step = (k[1:] + k[:-1]) / 2, np.diff(k)
    rest = (middle * normal_symbol(solid, middle) - short) * step
    return np.array([short / each + rest @ j0(middle * each) for each in r]) / (2 * np.pi)


def test_far_away_a_contact_displaces_as_a_point_load():
    """Both bodies, by the Hankel transform of their symbols; beside it the contact is as wide as 1/100 of the
    distance: 1e-4 and what the transform leaves out, which falls with the square of the last wavenumber.
    """
    places = np.array([[2.0, 0.5], [0.3, -5.0], [20.0, 30.0]])
    for second in (OTHER, CLASSICAL):
        touching = problem(mb.Unilateral(), second, mb.Sphere(R=0.1), nodes=32)
        state = touching.solve(load=0.01)
        added = beyond(state.solution, places)[0] / state.load
        r = np.hypot(*places.T)
        assert added == pytest.approx(point_load(SOLID, r) + point_load(second, r), rel=1e-3)


@pytest.mark.parametrize("period", [None, 4.0])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_squares_displace_each_other_as_cells_of_one_grid(law, period):
    """Gaps, rotations or moments, and a second body: to the interpolation between nodes, 4e-4 of what others
    add; on a period, where one grid has waves instead of cells, to the square of cells over the load's width.
    One square is across its end.
    """
    for second in (OTHER, CLASSICAL):
        solver = problem(law, second, lambda x1, x2: 0 * x1 * x2, period).solver
        single, count = Grid(128, 4 / 128), np.arange(32)
        rows = [(8, 12), (80, 40), (112 if period else 90, 90)]
        middles = [tuple((np.array(first) + 16) / 32 - 2) for first in rows]
        squares = Squares(tuple(Grid(32, 4 / 128, middle) for middle in middles), period)
        bump = np.sin(np.pi * (count + 0.5) / 32) ** 3
        f = np.arange(1, 1 + 3 * len(solver.offsets)).reshape(-1, 3, 1, 1) * np.multiply.outer(bump, bump)
        cells = [np.ix_((count + i) % 128, (count + j) % 128) for i, j in rows]
        H, together, whole = (
            solver.flexibility(single),
            solver.flexibility(squares),
            np.zeros((len(f), 128, 128)),
        )
        for own, there in zip(f.swapaxes(0, 1), cells):
            whole[(slice(None), *there)] = own
        turned = [own.turned(forces, own.surface(forces)) for own, forces in ((H, whole), (together, f))]
        pairs = [
            (H @ whole, together @ f),
            *zip(*turned),
            (H.counter.above(whole)[None], together.counter.above(f)[None]),
        ]
        for one, other in pairs:
            read = np.stack([one[(slice(None), *there)] for there in cells], axis=1)
            assert other == pytest.approx(read, abs=(1e-2 if period else 1e-4) * np.abs(read).max())


@pytest.mark.parametrize("period", [None, 1.0])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_work_of_one_load_on_the_displacement_of_another_is_mutual(law, period):
    """Rounding, 1e-12; and forces of the sum 0 do work."""
    rng = np.random.default_rng(7)
    for second in (OTHER, CLASSICAL):
        solver = problem(law, second, lambda x1, x2: 0 * x1 + 0 * x2, period).solver
        H = solver.flexibility(Grid(16, 1 / 16))
        f, g = rng.random((2, len(H.offsets), 16, 16))
        for matrix in (H, H.counter):
            assert np.sum(f * (matrix @ g)) == pytest.approx(np.sum(g * (matrix @ f)), rel=1e-12)
            assert np.sum((f - f.mean()) * (matrix @ (f - f.mean()))) > 0
