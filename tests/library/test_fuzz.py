"""Anything admissible: a state or a typed error, never NaN, never a warning (the suite turns warnings into
errors)."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies

from microblock import (
    Contact,
    Cosserat,
    Cylinder,
    HalfPlane,
    Microblock,
    Microclamped,
    NotConverged,
    Panels,
    Punch,
    Unilateral,
    Wedge,
)

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
