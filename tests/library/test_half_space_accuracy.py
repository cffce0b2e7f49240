"""Estimates of depth, load and stiffness on half-spaces: beside references on far finer cells."""

from functools import lru_cache

import numpy as np
import pytest

import microblock as mb

LAWS = mb.Unilateral(), mb.Microblock(), mb.Microblock((0.004, -0.002))
# approach, extrapolated from 256 and 512 cells an axis by the factor 4 of their errors, and stiffness on 512,
# of the drawn problems 0, 1, ...
REFERENCES = [
    (3.62458635e-04, 1.34604e01),
    (1.32796675e-03, 2.97994e01),
    (3.85255954e-04, 1.34108e01),
    (1.09359434e-03, 1.63826e01),
    (1.82632164e-04, 2.83758e01),
    (1.75637548e-04, 1.72090e01),
    (1.58067014e-03, 8.85246e00),
    (6.19759277e-04, 1.37129e01),
    (2.42101613e-03, 1.44242e01),
    (-5.09646070e-03, 2.98095e02),
    (-1.03083151e-02, 2.33814e02),
    (-5.17492423e-03, 4.25021e01),
    (3.96579320e-04, 2.84137e01),
    (3.28439883e-04, 3.62878e01),
    (6.27660467e-04, 4.24256e01),
    (3.15853287e-04, 1.61304e01),
    (4.98603479e-04, 1.86375e01),
    (6.90563783e-05, 2.17284e01),
    (3.84678812e-04, 1.44179e01),
    (3.56269589e-04, 1.37589e01),
    (8.74488152e-04, 1.71932e01),
    (8.10678055e-04, 9.10800e00),
    (1.75591049e-03, 1.42069e01),
    (6.53657429e-04, 1.00641e01),
    (-2.65022725e-03, 4.17180e02),
    (-1.67112698e-05, 2.62536e04),
    (-7.97715272e-03, 1.47753e02),
    (5.99092117e-04, 2.63682e01),
    (2.42056260e-04, 2.61905e01),
    (6.05993461e-04, 2.13094e01),
    (9.12989380e-04, 2.01035e01),
    (3.55257606e-04, 3.45041e01),
    (5.78577370e-04, 1.64798e01),
    (5.12738448e-04, 1.54657e01),
    (1.01622926e-03, 2.08380e01),
    (1.79508113e-03, 2.22182e01),
    (1.58329884e-03, 9.52766e00),
    (1.25971055e-03, 2.07868e01),
    (1.83450777e-03, 1.12245e01),
    (-1.18590862e-02, 3.07193e01),
    (-1.22997846e-02, 1.05557e02),
    (-1.57598989e-02, 1.13173e02),
    (7.57948920e-04, 4.16764e01),
    (7.47374470e-04, 4.26862e01),
    (1.33474334e-03, 4.13311e01),
]
QUICK = 0, 3, 6, 9, 10, 12  # of a second together; a nightly run has all


@lru_cache
def drawn(seed):
    """A contact under a sphere, an ellipsoid, a cone, a rough surface or four hills, and a load."""
    rng = np.random.default_rng(seed)
    ell = 0.1 * float(10 ** rng.uniform(-1.3, 0.5))  # of a contact of some 0.1
    solid = mb.Cosserat(E=100, nu=float(rng.uniform(0, 0.45)), ell=ell, beta=float(rng.uniform(0.1, 1.9)))
    load = 0.01 * float(10 ** rng.uniform(-0.5, 0.5))
    period = None
    kind = seed // 3 % 5
    if kind == 0:
        obstacle = mb.Sphere(R=10)
    elif kind == 1:
        obstacle = mb.Ellipsoid(R1=10, R2=10 * float(rng.uniform(0.25, 0.9)))
    elif kind == 2:
        obstacle = mb.Cone(float(rng.uniform(0.005, 0.03)))
    elif kind == 3:
        period = 1.0
        slope = float(rng.uniform(0.02, 0.1))
        waves = (1, int(rng.integers(3, 8)))
        obstacle = mb.RoughSurface(period=1.0, slope=slope, waves=waves, seed=seed)
        load = float(10 ** rng.uniform(-1.5, 0.3))
    else:
        places = rng.uniform(-0.3, 0.3, (4, 2))
        heights = rng.uniform(0, 0.0006, 4)
        radii = rng.uniform(3, 10, 4)

        def hills(x1, x2):
            summits = zip(places, radii, heights)
            return np.min([((x1 - a) ** 2 + (x2 - b) ** 2) / (2 * R) + z for (a, b), R, z in summits], axis=0)

        obstacle = mb.Obstacle(hills)
    return mb.Contact(mb.HalfSpace(solid, period=period), obstacle, LAWS[seed % 3]), load


def seeds():
    slow = pytest.mark.nightly
    return [seed if seed in QUICK else pytest.param(seed, marks=slow) for seed in range(len(REFERENCES))]


def first_touch(problem):
    """The lowest place of an obstacle, over which its corners come by as much as blocks are tilted."""
    return problem.solver.candidates(1.0, None, problem.solver.given_window()).lowest[2]


@pytest.mark.parametrize("seed", seeds())
def test_estimates_hold(seed):
    """The largest error over estimate of the 45 problems is 0.82 of depths and loads."""
    problem, load = drawn(seed)
    approach, stiffness = REFERENCES[seed]
    depth = approach - first_touch(problem)
    state = problem.solve(load=load, accuracy="depth", rtol=1e-3)
    assert abs(state.approach - approach) <= state.error_estimate * depth
    assert state.error_estimate <= 1e-3 and state.accuracy == "depth"
    state = problem.solve(approach=approach, accuracy="load", rtol=1e-2)
    assert abs(state.load / load - 1) <= state.error_estimate <= 1e-2
    state = problem.solve(load=load, accuracy="stiffness", rtol=3e-2)
    assert abs(state.stiffness / stiffness - 1) <= state.error_estimate <= 3e-2


def test_depths_of_loading_and_unloading():
    """Hertz, d ~ P^(2/3), to the estimate of 1e-3; without friction the way back is the same."""
    solid = mb.Elastic(E=100, nu=0.3)
    path = mb.Contact(mb.HalfSpace(solid), mb.Sphere(R=10), mb.Unilateral()).path(load=1.0, rtol=1e-3)
    loads = np.array([0.1, 1.0, 0.1])
    hertz = (9 * loads**2 / (16 * 10 * (100 / 0.91) ** 2)) ** (1 / 3)
    assert path.depths(loads) == pytest.approx(hertz, rel=1e-3)
    flat = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Unilateral()).path(load=1.0)
    with pytest.raises(mb.BadArgument, match="body = .*has no approach"):
        flat.depths(loads)


@pytest.mark.nightly
def test_the_depth_is_far_cheaper_than_the_pressure():
    """And plan, state, file and refusals say what an estimate is of."""
    problem = mb.Contact(mb.HalfSpace(mb.Elastic(E=100, nu=0.3)), mb.Sphere(R=10), mb.Unilateral())
    state = problem.solve(load=1.0, rtol=1e-4, accuracy="depth")
    with pytest.raises(mb.NotConverged):
        problem.with_(method=mb.Cells(window=(-1, 1))).solve(load=1.0, rtol=1e-4)
    assert state.unknowns <= 256**2 and "of the depth" in repr(state) and "of the depth" in state.caption
    costs = [problem.plan(load=1.0, rtol=1e-2, accuracy=name) for name in ("depth", "pressure")]
    assert costs[0].candidates[0].cost.seconds < costs[1].candidates[0].cost.seconds
    assert costs[0].candidates[0].solver.accuracy == "depth"
    fixed = problem.with_(method=mb.Cells(nodes=64))
    assert fixed.solve(load=1.0, accuracy="load").error_estimate < fixed.solve(load=1.0).error_estimate / 10
    flat = mb.Contact(mb.HalfPlane(problem.solid), mb.Cylinder(R=10), mb.Unilateral())
    with pytest.raises(
        mb.BadArgument, match="accuracy = 'load': is estimated by Cells.. on a HalfSpace alone"
    ):
        flat.solve(load=1.0, accuracy="load")


def test_a_file_keeps_what_the_estimate_is_of(tmp_path):
    problem = mb.Contact(mb.HalfSpace(mb.Elastic(E=100, nu=0.3)), mb.Sphere(R=10), mb.Unilateral())
    state = problem.with_(method=mb.Cells(nodes=32)).solve(load=1.0, accuracy="stiffness")
    state.save(tmp_path / "state.npz")
    assert mb.load(tmp_path / "state.npz").to_dict()["accuracy"] == state.accuracy == "stiffness"
