"""Contact states on a compliance: seeded problems, an independent solver, where pivots make no progress."""

import numpy as np
import pytest

from microblock import NotConverged
from microblock.contact_solvers import active_set
from microblock.contact_solvers.active_set import path, solve
from microblock.contact_solvers.projected_gradients import MatrixFree, solve_matrix_free

KINDS = ("plain", "indefinite", "inf", "weights", "duplicates", "ties", "pairs", "singular", "rigid", "tiny")
KKT = 1e-10  # what is promised; the solver aims at 1e-15


def spd(rng, m, rank=None):
    factors = rng.normal(size=(m, rank or m))
    return factors @ factors.T


def problem(seed):
    """(kind, H, g0, c, options) of one seeded small problem; from "duplicates" on degenerate by
    construction.
    """
    rng = np.random.default_rng(seed)
    kind, m = KINDS[seed % len(KINDS)], int(rng.integers(1, 13))
    H = spd(rng, m)
    g0 = rng.normal(size=m)
    c = np.ones(m)
    if kind == "indefinite":
        H -= 10.0 ** rng.uniform(0, 3)
    elif kind == "inf":
        g0[rng.random(m) < 0.4] = np.inf
        g0[rng.integers(m)] = 0.0
    elif kind == "weights":
        c = 10.0 ** rng.uniform(-2, 2, m)
    elif kind == "duplicates":
        copy = rng.integers(0, m, m)
        H = H[np.ix_(copy, copy)]
        g0 = g0[copy] + rng.choice([0, 0, 1e-15, 0.1], m)
    elif kind == "ties":  # a circulant of integers on integer gaps
        row = rng.integers(-2, 3, m)
        row = row + np.roll(row[::-1], 1)
        H = row[(np.arange(m)[:, None] - np.arange(m)) % m] + 0.0
        H += np.eye(m) * (1 - min(np.linalg.eigvalsh(H).min().round(), 0))
        g0 = rng.integers(0, 2, m) + 0.0
    elif kind == "pairs":  # two corners at each node, mirrored
        half = spd(rng, m)
        coupling = 0.3 * (half + half[::-1, ::-1])
        H = np.block([[half + half[::-1, ::-1], coupling], [coupling, half + half[::-1, ::-1]]])
        g0 = np.abs(g0 + g0[::-1])
        g0, c = np.tile(g0, 2), np.ones(2 * m)
    elif kind == "singular":
        H = spd(rng, m, rank=max(1, m // 2)) + 10.0 ** rng.uniform(-16, -10) * np.eye(m)
    elif kind == "rigid":
        stiff = rng.random(m) < 0.5
        H[stiff], H[:, stiff] = 0, 0
        g0[stiff] = rng.integers(0, 2, stiff.sum())
    elif kind == "tiny":  # weights of a graded mesh in rows, columns and gaps
        c = 10.0 ** rng.uniform(-12, 0, m)
        H, g0 = H * c[:, None] * c, g0 * c
    approach = kind not in ("indefinite", "rigid") and rng.random() < 0.3
    scale = 10.0 ** rng.uniform(-4, 3)
    level = {"approach": (g0 / c).min() + scale} if approach else {"load": scale}
    return kind, H, g0, c, level


def residual(H, g0, c, state, load=None):
    """Largest relative residual of (a), in shares of the load and from the data alone."""
    touch = np.isfinite(g0)
    share = c * state.forces
    assert np.all(share >= 0) and np.all(share[~touch] == 0)
    H = H[np.ix_(touch, touch)] / c[touch, None] / c[touch]
    g0 = g0[touch] / c[touch]
    gaps = g0 - state.approach + H @ share[touch]
    share = share[touch]
    length = (np.abs(g0) + abs(state.approach) + np.abs(H) @ share)[state.closed[touch]].max(initial=0) or 1.0
    if share.sum() == 0:
        return max(0, -gaps.min())
    residuals = [max(0, -gaps.min()) / length, np.abs(share * gaps).sum() / (share.sum() * length)]
    return max(residuals + ([] if load is None else [abs(share.sum() - load) / load]))


@pytest.mark.nightly(10_000)
def test_ten_thousand_small_problems(seeds):
    """All are solved to KKT from the data alone, but where an approach asks for forces beyond 1e13 of the
    load of a well-posed one.
    """
    for seed in seeds:
        kind, H, g0, c, level = problem(seed)
        try:
            state = solve(H, g0, c=c, **level)
        except NotConverged:
            spectrum = np.linalg.eigvalsh(H)  # rigid corners within rounding
            assert kind == "singular" and "approach" in level and spectrum[0] < 1e-13 * spectrum[-1], seed
            continue
        assert max(residual(H, g0, c, state, level.get("load")), state.kkt) < KKT, (seed, kind)


@pytest.mark.parametrize("seed", [1727, 3297, 3607])
def test_without_the_safeguard_the_exchanges_cycle(seed, monkeypatch):
    """Negative control: of at most 2^7 sets none is right, and the safeguard finds the right set."""
    kind, H, g0, _, level = problem(seed)
    assert kind == "singular" and len(g0) <= 7
    regular = H + active_set.rigid_constant(H) + 1e-9 * np.diag(np.diag(H))
    nothing = np.zeros(len(g0), bool)
    forces, closed, _ = active_set.block_pivoting(regular, g0, nothing, level["load"])
    gaps = g0 + regular @ forces
    assert forces[closed].min() >= 0 and not forces[~closed].any()
    assert gaps.min() == pytest.approx(gaps[closed].max(), rel=1e-9)  # the regularisation
    monkeypatch.setattr(active_set, "PATIENCE", np.inf)
    monkeypatch.setattr(active_set, "MOST_SETS", 200)
    with pytest.raises(NotConverged, match="still changing after 200 sets"):
        active_set.block_pivoting(regular, g0, nothing, level["load"])


def test_an_approach_that_rigid_corners_cannot_take_is_refused():
    """The two corners move against each other alone: 1e8 of force on both changes no sum of their gaps, and
    beside H f a missing gap of 1 is small."""
    H = np.zeros((6, 6))
    H[np.ix_([3, 5], [3, 5])] = [[1.0, -1.0], [-1.0, 1.0]]
    with pytest.raises(NotConverged, match="rigid corners"):
        solve(H, np.array([0.0, 0, 0, 0, 0, -1]), approach=0.0, c=np.array([1.0, 1, 1, 100, 1, 0.01]))


def test_the_path_is_followed_where_pivots_make_no_progress(monkeypatch):
    """A matrix of a tenth of the full rank can take thousands of pivots; the path takes an event a corner."""
    followed = []
    monkeypatch.setattr(
        active_set, "path", lambda *given, **c: followed.append(path(*given, **c)) or followed[0]
    )
    factors = np.random.default_rng(0).normal(size=(200, 20))
    H = factors @ factors.T
    g0 = np.abs(np.random.default_rng(100).normal(size=200))
    state = solve(H, g0, load=1.0)
    assert followed and residual(H, g0, np.ones(200), state, 1.0) < KKT


def test_rigid_corners_without_gaps_take_the_load_from_a_compliant_one():
    """Each gap and force of the compliant corner vanishes: no length is left to which a residual could be
    relative.
    """
    flexibility = np.diag([0.0, 0.0, 0.5625])
    state = solve(flexibility, np.zeros(3), load=10.0)
    assert state.forces.sum() == pytest.approx(10.0, rel=1e-12)  # rounding of a sum
    assert abs(state.approach) <= 1e-14 and state.forces[2] <= 1e-14  # of 0.5625*10 and 10, rounding
    # two that share one spring: what rounding leaves in their gap is nothing beside spring and load
    flexibility = np.zeros((5, 5))
    flexibility[np.ix_((2, 4), (2, 4))] = 1.0
    state = solve(flexibility, np.zeros(5), load=1.0)
    assert state.forces[[0, 1, 3]].sum() == pytest.approx(1.0, rel=1e-12) and state.kkt <= 1e-11


def test_levels_units_and_starts_do_not_matter():
    """A level of H moves the approach alone, by tau P; units by rounding; any start has the same set."""
    rng = np.random.default_rng(1)
    H = spd(rng, 40)
    g0 = rng.normal(size=40)
    c = np.linspace(0.5, 2, 40)
    plain = solve(H, g0, load=1.5, c=c)
    scaled = solve(H * 1e-20, g0 * 1e-9, load=1.5e11, c=c)
    assert np.array_equal(solve(H, g0, load=1.5, c=c, start=~plain.closed).closed, plain.closed)
    assert scaled.forces == pytest.approx(1e11 * plain.forces, rel=1e-9)
    raised = solve(H + 10 * np.outer(c, c), g0, load=1.5, c=c)
    assert raised.forces == pytest.approx(plain.forces, abs=1e-11)
    assert raised.approach - plain.approach == pytest.approx(15, rel=1e-11)


def test_the_residual_sees_the_load_and_the_gaps():
    """Two corners of compliance 1 under half of the load each, by hand: with a load that is off by 0.01, an
    approach that is off by 0.01, and one of them left open.
    """
    H = np.eye(2)
    gaps = np.zeros(2)
    halves = np.full(2, 0.5)
    closed = np.ones(2, bool)
    assert active_set.relative_residual(H, gaps, halves, closed, 0.5, 1.0) == 0
    assert active_set.relative_residual(H, gaps, 1.01 * halves, closed, 0.505, 1.0) == pytest.approx(0.01)
    assert active_set.relative_residual(H, gaps, halves, closed, 0.51, 1.0) == pytest.approx(0.01 / 1.01)
    assert active_set.relative_residual(H, gaps, halves * (1, 0), closed & (True, False), 0.5, 0.5) == 0.5


class OfThreeEigenvalues(MatrixFree):
    """A flexibility with eigenvalues of 1, 30 and 900, without a preconditioner."""

    def __init__(self, count, random):
        vectors = np.linalg.qr(random.normal(size=(count, count)))[0]
        self.matrix = vectors @ np.diag(np.resize([1.0, 30.0, 900.0], count)) @ vectors.T

    def __matmul__(self, forces):
        return (self.matrix @ forces.ravel()).reshape(forces.shape)

    def on_face(self, face):
        return lambda gaps: gaps * face


def test_conjugate_gradients_end_after_as_many_steps_as_there_are_eigenvalues():
    """Three on each face, of which there are a few: 22 products; 2000 where steps are half as conjugate."""
    random = np.random.default_rng(1)
    flexibility = OfThreeEigenvalues(30, random)
    expected = random.uniform(1.0, 2.0, 30)
    gaps = (1000.0 - flexibility.matrix @ expected)[None]
    state = solve_matrix_free(flexibility, gaps, approach=1000.0, rtol=1e-9)
    assert state.forces[0] == pytest.approx(expected, abs=1e-7)
    assert state.iterations < 60


def test_the_residual_of_products_is_the_largest_penetration_or_gap_under_a_force():
    """Of states that are solved poorly: both kinds decide, over the range of H f."""
    random = np.random.default_rng(3)
    flexibility = OfThreeEigenvalues(30, random)
    gaps = random.normal(size=(1, 30))
    decides = set()
    for load in np.geomspace(1e-3, 1e-2, 20):
        state = solve_matrix_free(flexibility, gaps, load=load, rtol=0.3)
        violations = -state.gaps.min(), state.gaps[state.forces > 0].max()
        assert state.kkt == pytest.approx(max(violations) / np.ptp(flexibility @ state.forces))
        decides.add(np.argmax(violations))
    assert decides == {0, 1}


class Neighbours(OfThreeEigenvalues):
    """A flexibility of corners whose response falls by a factor of e^(1/reach) from one to the next."""

    def __init__(self, count, reach):
        distances = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        self.matrix = np.exp(-distances / reach)


@pytest.mark.parametrize("reach", [0.3, 1.0])
def test_a_start_that_is_the_solution_but_for_rounding_is_the_solution(reach):
    """Forces that differ by rounding alone change the energy by any sign, whatever the length of the step."""
    flexibility = Neighbours(4, reach)
    gaps = np.zeros((1, 4))
    forces = solve_matrix_free(flexibility, gaps, load=1.0, rtol=1e-12).forces
    for load in np.geomspace(1.0, 1e-6, 200):
        state = solve_matrix_free(flexibility, gaps, load=load, start=forces)
        assert state.forces == pytest.approx(load * forces, rel=1e-9)
