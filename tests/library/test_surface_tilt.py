"""Initial rotations on a half-space: numbers, pairs, functions of the place; against the plane, by symmetry,
and by vectors of each corner.
"""

import numpy as np
import pytest

import microblock as mb
from microblock.halfspace.cells import flexibility

PERIOD = 3.0
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2, alpha_prime=0.3, beta_prime=-0.2)
CELLS = mb.Cells(nodes=32, residual=1e-11)


def height(x):
    return 0.05 * (1 - np.cos(2 * np.pi * x / PERIOD)) + 0.01 * np.sin(2 * np.pi * x / PERIOD)


def angle(x):
    return 0.03 * np.sin(4 * np.pi * x / PERIOD + 0.4) + 0.01


def pressed(psi0, obstacle=None, where="gaps and levers"):
    return mb.Contact(
        mb.HalfSpace(SOLID, PERIOD), obstacle or both_ways, mb.Microblock(psi0, where), CELLS
    ).solve(load=0.6 * PERIOD)


def both_ways(x1, x2):
    return height(x1) + 0.7 * height(x2 + 0.3)


@pytest.mark.parametrize("where", ["gaps and levers", "levers"])
@pytest.mark.parametrize("across", [False, True])
def test_a_function_of_one_direction_is_that_of_the_half_plane(where, across):
    """Levers that vary from cell to cell: the cells of the half-plane have them by another program."""
    line = mb.Contact(mb.HalfPlane(SOLID, PERIOD), height, mb.Microblock(angle, where), CELLS).solve(load=0.6)
    # the plane's psi0 is about -e2; swapping x1 and x2 is a mirror, which turns rotations into their opposite
    psi0 = (lambda x1, x2: angle(x2), 0.0) if across else (0.0, lambda x1, x2: -angle(x1))
    surface = pressed(psi0, lambda x1, x2: height(x2 if across else x1), where)
    rows = surface.pressure.T if across else surface.pressure
    # the residual of both
    assert rows == pytest.approx(np.tile(line.pressure[:, None], 32), abs=1e-8 * line.pressure.max())
    moment = surface.micromoment[0].T if across else -surface.micromoment[1]
    assert moment == pytest.approx(np.tile(line.micromoment[:, None], 32), abs=1e-8 * line.pressure.max())
    assert surface.approach == pytest.approx(line.approach, rel=1e-9)
    # and psi0 is seen: without it the pressure is another
    without = pressed(0.0, lambda x1, x2: height(x2 if across else x1))
    assert (
        np.abs(without.pressure - surface.pressure).max() > 0.05 * surface.pressure.max() or where == "levers"
    )


def test_a_function_that_is_constant_is_the_number():
    number = pressed(0.02)
    for psi0 in (
        (0.0, -0.02),
        (lambda x1, x2: 0 * x1, lambda x1, x2: -0.02 + 0 * x2),
        (0, lambda x1, x2: -0.02),
    ):
        assert pressed(psi0).pressure == pytest.approx(number.pressure, rel=1e-12)


def tilts(x1, x2):
    """psi0 about both axes, of both coordinates."""
    k = 2 * np.pi / PERIOD
    return 0.02 * np.sin(k * x1 + 2 * k * x2), 0.015 * np.cos(k * x1 - k * x2 + 0.5)


def functions(sign=(1, 1), swapped=False):
    """tilts as a pair of functions; of places with x1 and x2 swapped."""
    if swapped:
        return lambda x1, x2: sign[0] * tilts(x2, x1)[1], lambda x1, x2: sign[1] * tilts(x2, x1)[0]
    return lambda x1, x2: sign[0] * tilts(x1, x2)[0], lambda x1, x2: sign[1] * tilts(x1, x2)[1]


def test_a_mirror_turns_rotations():
    """Rotations are axial: the mirror x1 <-> x2 takes (psi1, psi2) to -(psi2, psi1), that of x1 to
    (psi1, -psi2).
    """
    state = pressed(functions())
    most = state.pressure.max()
    swapped = pressed(functions((-1, -1), swapped=True), lambda x1, x2: both_ways(x2, x1))
    moments = -swapped.micromoment[::-1].transpose(0, 2, 1)
    # the residual: forces differ by rounding only
    assert pytest.approx(state.pressure, abs=1e-8 * most) == swapped.pressure.T
    assert moments == pytest.approx(state.micromoment, abs=1e-8 * most)
    first, second = functions()
    mirrored = pressed(
        (lambda x1, x2: first(-x1, x2), lambda x1, x2: -second(-x1, x2)), lambda x1, x2: both_ways(-x1, x2)
    )
    signs = np.array((1, -1))[:, None, None]
    assert mirrored.pressure[::-1] == pytest.approx(state.pressure, abs=1e-8 * most)
    assert mirrored.micromoment[:, ::-1] == pytest.approx(state.micromoment * signs, abs=1e-8 * most)


@pytest.mark.parametrize("where", ["gaps and levers", "levers"])
def test_gaps_and_moments_by_vectors(where):
    """Corners at x_O + (ell/2)(N + a S1 + b S2), their displacement u + psi x r, their moment r x f."""
    state = pressed(functions(), where=where)
    x1, x2 = np.meshgrid(state.x1, state.x2, indexing="ij")
    zero, one = np.zeros_like(x1), np.ones_like(x1)
    e1, e2, e3 = (
        np.stack(each, axis=-1) for each in ((one, zero, zero), (zero, one, zero), (zero, zero, one))
    )
    psi0 = np.stack((*tilts(x1, x2), zero), axis=-1)
    psi = np.stack((*state.psi, zero), axis=-1)
    N, S1, S2 = (e + np.cross(psi0, e) for e in (e3, e1, e2))
    half, moment = SOLID.ell / 2, np.zeros_like(psi)
    for (a, b), force in zip([(-1, -1), (-1, 1), (1, -1), (1, 1)], state.pressures.values()):
        r = half * (N + a * S1 + b * S2)
        raised = half * (a * S1 + b * S2)[..., 2] * (where != "levers")
        lifted = np.cross(psi, r)[..., 2]
        gap = both_ways(x1 + half * a, x2 + half * b) - raised - state.approach + state.displacement - lifted
        # the residual of the conditions, over the range of the displacement
        assert gap.min() > -1e-9 and np.abs(gap[force > 0]).max() < 1e-9
        moment += np.cross(r, -force[..., None] * e3)
    # r lies on x_O + ..., whose part along N turns it as much as the law's levers say; rounding
    assert moment[..., :2].transpose(2, 0, 1) == pytest.approx(state.micromoment, abs=1e-12)


@pytest.mark.parametrize("periodic", [True, False])
def test_products_are_symmetric_and_their_preconditioners_positive(periodic):
    """Also where levers differ from cell to cell, on all corners and on some of them."""
    n, draw = 6, np.random.default_rng(3)
    offsets = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)], float)
    H = flexibility(SOLID, offsets, draw.uniform(-0.3, 0.3, (2, n, n)), 0.1, periodic, clamped=False)
    unit = np.eye(4 * n * n).reshape(-1, 4, n, n)
    matrix = np.array([(H @ one).ravel() for one in unit])
    sizes = np.linalg.eigvalsh(matrix)
    assert (
        matrix == pytest.approx(matrix.T, abs=1e-14 * sizes[-1]) and sizes[0] > -1e-14 * sizes[-1]
    )  # rounding
    there = draw.random((4, n, n)) < 0.6
    inside = there.ravel()
    inverse = np.array([H.on_face(there)(one).ravel()[inside] for one in unit[inside]])
    sizes = np.linalg.eigvalsh(inverse)
    assert inverse == pytest.approx(inverse.T, abs=1e-13 * sizes[-1]) and sizes[0] > -1e-13 * sizes[-1]


def test_with_three_corners_the_preconditioner_is_the_inverse():
    """On a period, but for means and for the shortest wave of an even number of cells."""
    three = np.ones((4, 7, 7), bool)
    three[1] = False
    tilt = np.full((2, 7, 7), 0.2) * np.array((1, -0.5))[:, None, None]
    H = flexibility(
        SOLID, np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)], float), tilt, 0.1, True, clamped=False
    )
    forces = np.where(three, np.random.default_rng(5).normal(size=(4, 7, 7)), 0.0)
    forces[three[:, 0, 0]] -= forces[three[:, 0, 0]].mean(axis=(1, 2), keepdims=True)
    assert H.on_face(three)(np.where(three, H @ forces, 0.0)) == pytest.approx(forces, abs=1e-12)


def test_forces_that_do_nothing_are_settled():
    draw = np.random.default_rng(4)
    forces, g0 = draw.random((4, 5, 5)), draw.normal(size=(4, 5, 5))
    g0[3, 0, 0], g0[:, 1, 1] = np.inf, 0.2
    offsets = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)], float)
    H = flexibility(SOLID, offsets, np.zeros((2, 5, 5)), 0.1, True, clamped=False)
    found = H.settled(forces, g0)
    assert H.resultants(found) == pytest.approx(H.resultants(forces), abs=1e-14) and found.min() >= 0
    known = np.isfinite(g0).all(axis=0)
    assert np.all((g0 * found).sum(axis=0)[known] <= (g0 * forces).sum(axis=0)[known] + 1e-14)
    assert np.array_equal(found[:, 0, 0], forces[:, 0, 0])  # there one cannot touch
    settled = known.copy()
    settled[1, 1] = False  # no work there: of least norm
    assert np.all(found.min(axis=0)[settled] < 1e-15) and found[:, 1, 1].min() > 0


def test_sphere_on_rotated_blocks_leans_as_they_do():
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    problem = mb.Contact(
        mb.HalfSpace(solid), mb.Sphere(10.0), mb.Microblock((0.0, -0.01)), mb.Cells(nodes=32)
    )
    about2 = problem.solve(load=1.0)
    about1 = problem.with_(law=mb.Microblock((0.01, 0.0))).solve(load=1.0)
    # windows are found alike
    turned = about1.pressure.T
    assert turned == pytest.approx(about2.pressure, abs=1e-6 * about2.pressure.max())
    # right corners are raised: blocks on the left of the lowest place press with them
    assert np.sum(about2.pressure * about2.x1[:, None]) * about2.width**2 < -0.01  # P = 1, a = 0.44
