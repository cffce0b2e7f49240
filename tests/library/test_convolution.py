"""Products of cells by transforms of both kinds, and the exchange of few corners, against dense matrices."""

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import microblock as mb
from microblock.corners import active_set, exchange, projected_gradients
from microblock.halfplane.cells import CellGrid
from microblock.halfplane.convolution import (
    LARGER,
    LONG,
    Halves,
    Waves,
    convolution,
    free_period,
    toeplitz_of,
)
from microblock.threads import MANY, bounded, workers

SOLID = mb.Cosserat(E=2.0, nu=0.3, ell=0.2, beta=1.0)
ROUNDING = 1e-13  # of transforms, relative to the largest value; it grows like log n


def random_spectrum(length, seed=0):
    """U, iV, W of a period, of kernels that are real."""
    U, V, W = np.random.default_rng(seed).standard_normal((3, length // 2 + 1))
    V[0] = 0
    if length % 2 == 0:
        V[-1] = 0
    return U, 1j * V, W


# 97: a prime has one row; 36 and 144: as many rows as columns, with a row and a column that are their own
# opposites; 35 and 105: none in the middle
@pytest.mark.parametrize("half", [1, 2, 35, 36, 97, 105, 128, 144])
@pytest.mark.parametrize("parts", [1, 2])
def test_halves_are_the_dense_product(half, parts):
    length = parts * half
    spectrum, fields = random_spectrum(length), np.random.default_rng(1).standard_normal((2, half))
    u, v, w = (toeplitz_of(one, length, half) for one in spectrum)
    p, m = fields
    expected = np.array((u @ p + v @ m, w @ m - v @ p))
    for product in (Waves(spectrum, length), Halves.of(spectrum, length, parts)):
        assert np.abs(product(fields) - expected).max() <= ROUNDING * np.abs(expected).max()


def test_a_matrix_has_the_kernel_in_its_columns():
    """The kernel of a period of 8 cells, by its definition as a sum of waves."""
    spectrum = random_spectrum(8)[1]
    waves = np.concatenate((spectrum, -spectrum[-2:0:-1]))
    k = np.arange(8)
    kernel = np.array([(waves * np.exp(2j * np.pi * k * place / 8)).sum().real / 8 for place in range(8)])
    away = np.arange(4)[:, None] - np.arange(4)
    assert np.abs(toeplitz_of(spectrum, 8, 4) - kernel[away % 8]).max() <= 1e-15 * 8  # rounding of 8 terms


@pytest.mark.parametrize("count", [LONG // 2, LONG // 2 + 1, 40_000])
def test_long_products_are_those_of_short_ones(count):
    """On a period with room for all fields, with a last row that is not full."""
    length = free_period(count)
    assert length >= 2 * count
    spectrum, fields = random_spectrum(length), np.random.default_rng(2).standard_normal((2, count))
    product, expected = convolution(spectrum, length, True), Waves(spectrum, length)(fields)
    assert isinstance(product, Halves)
    assert np.abs(product(fields) - expected).max() <= ROUNDING * np.abs(expected).max()


def test_long_products_are_the_same_with_either_number_of_threads():
    half, found = MANY * LARGER, []
    product = convolution(random_spectrum(2 * half), 2 * half, True)
    fields = np.random.default_rng(3).standard_normal((2, half))
    for number in (1, 2):
        with threadpool_limits(number):
            assert bounded(workers)(half // LARGER) == number
            found.append(bounded(product)(fields))
    assert np.array_equal(*found)  # every line has the same sums


LAWS = {
    "unilateral": mb.Unilateral(),
    "microclamped": mb.Microclamped(),
    "microblock": mb.Microblock(psi0=0.05),
}


@pytest.mark.parametrize("period", [None, 2.3])
@pytest.mark.parametrize("counter", [None, SOLID])
@pytest.mark.parametrize("name", LAWS)
def test_the_matrix_is_that_of_the_products(name, counter, period):
    flexibility = CellGrid(mb.HalfPlane(SOLID, period), -1.0, 1.3, 36).flexibility(LAWS[name], counter)
    unit = np.eye(flexibility.levers.size).reshape(-1, *flexibility.shape)
    H = np.array([(flexibility @ one).ravel() for one in unit]).T
    assert np.abs(flexibility.matrix - H).max() <= ROUNDING * np.abs(H).max()


def rough_problem(seed, corners=60):
    """A positive definite flexibility and initial gaps of some contacts."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-1, 1, corners)
    H = -np.log(np.abs(x[:, None] - x) + 0.5 / corners)  # indefinite with its level: negative far away
    return H - 1.0, 2 * x**2 + rng.uniform(0, 0.3, corners)


@pytest.mark.parametrize("seed", range(8))
def test_exchanged_corners_are_those_of_pivoting(seed):
    H, g0 = rough_problem(seed)
    for load in (0.02, 0.5):
        expected = active_set.solve(H, g0, load=load)
        for face in (np.ones(len(g0), bool), np.arange(len(g0)) == 3):
            forces, faces = exchange.exchange(H, g0, face, load)
            assert faces <= 12  # 2 to 9 are met
            assert np.abs(forces - expected.forces).max() <= 1e-11 * forces.max()  # rounding, condition 1e3
    approach = g0.min() + 0.3
    lifted = H + 4.0  # definite: the approach is given
    expected = active_set.solve(lifted, g0, approach=approach)
    forces, _ = exchange.exchange(lifted, g0 - approach, np.zeros(len(g0), bool), None)
    assert np.abs(forces - expected.forces).max() <= 1e-11 * forces.max()


def test_exchange_leaves_what_is_not_definite_to_others():
    H, g0 = rough_problem(0)
    assert exchange.exchange(H, g0 - 1, np.ones(len(g0), bool), None) is None  # with its level
    twice = np.kron(H + 4.0, np.ones((2, 2)))  # two corners that are one: singular to rounding
    assert exchange.exchange(twice, np.repeat(g0, 2), np.ones(2 * len(g0), bool), 0.5) is None
    soft = np.diag([1.0, 1.0, 1e-9])  # its factors exist; a cell's response to itself is never so small
    assert exchange.exchange(soft, np.zeros(3) - 1, np.ones(3, bool), None) is None


def many_cells(count=4000):
    """Flexibility and initial gaps of a cylinder; more than 256 corners are not exchanged."""
    cells = CellGrid(mb.HalfPlane(SOLID), -1.0, 1.3, count)
    return cells.flexibility(mb.Unilateral()), cells.x[None] ** 2 / 2


@pytest.mark.parametrize("lost", [0.0, 1e-15, -1e-15])
def test_open_corners_stay_open_where_the_load_is_lost_in_rounding(lost):
    problem = projected_gradients._problem(*many_cells(400), 0.3, None)
    forces = np.maximum(np.linspace(-1, 1, 400), 0)
    forces *= 0.3 * (1 - lost) / forces.sum()
    found = problem.project(forces)
    assert np.array_equal(found > 0, forces > 0)
    assert found.sum() == pytest.approx(0.3, rel=1e-15)


def test_a_step_that_is_refused_says_how_long_the_next_one_is():
    """The first one is as long as a single corner allows; a rough change needs one 1e-3 times as long, ten
    halvings.
    """
    flexibility, gaps = many_cells()
    state = projected_gradients.solve(flexibility, gaps, load=0.3, rtol=1e-8)
    start = state.forces * (1 + 0.01 * (-1) ** np.arange(gaps.size))
    again = projected_gradients.solve(flexibility, gaps, load=0.3, start=start, rtol=1e-8)
    assert np.array_equal(again.forces > 0, state.forces > 0)
    assert again.products <= 12  # 10 are met; 17 by halves
