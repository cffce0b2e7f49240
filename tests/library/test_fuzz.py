"""Anything admissible: a state or a typed error, never NaN, never a warning (the suite turns warnings into
errors)."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies

from microblock import (
    BadArgument,
    Contact,
    Cosserat,
    Cylinder,
    HalfPlane,
    Microblock,
    MicroblockError,
    Microclamped,
    NotConverged,
    Panels,
    Punch,
    Unilateral,
    Wedge,
)
from microblock.corners.active_set import solve

fuzzed = settings(derandomize=True, deadline=None, database=None)  # the same examples on every machine


def decades(low, high):
    return strategies.floats(low, high).map(lambda power: 10**power)


rotations = strategies.one_of(strategies.just(0.0), strategies.floats(-0.5, 0.5), decades(-6, -1))
acts_in = strategies.sampled_from(["gaps and levers", "levers"])
laws = strategies.one_of(
    strategies.builds(Microblock, rotations, acts_in),
    strategies.just(Unilateral()),
    strategies.just(Microclamped()),
)
solids = strategies.builds(
    lambda E, nu, ell, beta: Cosserat(E=E, nu=nu, ell=ell, beta=beta),
    decades(-3, 3),
    strategies.floats(-0.9, 0.499),
    decades(-2, 0.7),
    decades(-4, 0.3),
)


def is_a_state(state, load):
    assert state.weights @ state.pressure == pytest.approx(load, rel=1e-12)
    for values in (
        *state.pressures.values(),
        state.micromoment,
        state.psi,
        state.energy,
        state.solution.approach,
    ):
        assert np.all(np.isfinite(values))
    # the norm of the check that refuses a topology
    assert state.residual < 1e-3


@settings(fuzzed, max_examples=60)
@given(solids, laws, decades(-3, 1))
def test_a_cylinder_always_has_a_state(solid, law, load):
    state = Contact(HalfPlane(solid), Cylinder(1.0), law).solve(load=load * solid.E)
    assert 0 <= state.error_estimate <= 1e-3
    is_a_state(state, load * solid.E)


@settings(fuzzed, max_examples=15)
@given(
    solids,
    laws,
    decades(-2, 0),
    strategies.one_of(strategies.builds(Wedge, decades(-2, 0)), strategies.builds(Punch, decades(-1, 1))),
)
def test_slope_discontinuities_and_edges_give_a_state_or_say_why_not(solid, law, load, obstacle):
    try:
        state = Contact(HalfPlane(solid), obstacle, law, Panels(order=8)).solve(load=load * solid.E)
    except NotConverged as failure:
        assert "load" in str(failure)
    else:
        is_a_state(state, load * solid.E)


# nothing, or within a dozen decades as products: a flexibility of 1e-16 of another one is lost in rounding
entries = strategies.floats(-1, 1, allow_subnormal=False).map(
    lambda entry: entry if abs(entry) > 1e-6 else 0.0
)


@strategies.composite
def problems(draw):
    """Flexibility F F^T of any rank, gaps with ties and corners that cannot touch, weights over four
    decades."""
    count = draw(strategies.integers(1, 8))
    rank = draw(strategies.integers(1, count))
    factors = draw(strategies.lists(entries, min_size=count * rank, max_size=count * rank))
    factors = np.array(factors).reshape(count, rank)
    some = strategies.one_of(entries, strategies.sampled_from([0.0, 1.0, np.inf]))
    gaps = np.array(draw(strategies.lists(some, min_size=count, max_size=count)))
    weights = np.array(draw(strategies.lists(decades(-2, 2), min_size=count, max_size=count)))
    return factors @ factors.T * draw(decades(-6, 6)), gaps, weights


@settings(fuzzed, max_examples=200)
@given(problems(), strategies.one_of(strategies.just(0.0), decades(-4, 4)), strategies.booleans())
def test_active_set_gives_a_state_or_says_why_not(problem, given_level, by_load):
    H, gaps, weights = problem
    try:
        state = solve(H, gaps, c=weights, **({"load": given_level} if by_load else {"approach": given_level}))
    except BadArgument:
        assert not np.any(np.isfinite(gaps))  # the only thing wrong with these
        return
    except MicroblockError as failure:
        # a rank below the number of corners cannot take every approach
        assert not by_load, failure
        return
    assert np.all(np.isfinite(state.forces)) and np.all(state.forces >= 0) and np.isfinite(state.approach)
    assert np.all(state.forces[~np.isfinite(gaps)] == 0)
    touch = np.isfinite(gaps)
    sunk, level = H[np.ix_(touch, touch)], weights[touch] * state.approach
    left = gaps[touch] - level + sunk @ state.forces[touch]
    terms = (np.abs(gaps[touch]) + np.abs(level) + np.abs(sunk) @ state.forces[touch]).max()
    # solved to 1e-11 of each corner's own terms, over weights of four decades; where rigid corners take all
    # of the load, to rounding of what the others would sink under it
    shares = sunk / np.outer(weights[touch], weights[touch])
    terms = max(terms, 1e-4 * np.abs(shares).max() * weights.max() * (given_level if by_load else 0.0))
    assert left.min() >= -1e-9 * terms
    if by_load:
        assert weights @ state.forces == pytest.approx(given_level, rel=1e-9)
