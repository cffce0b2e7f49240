"""What the maps of the monolithic methods found, kept: first contact from a distance, first guesses, linear
solvers.
"""

from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from microblock import NotConverged
from microblock.fem.body import Loads
from microblock.fem.condensation import Condensed
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton

SOLID = mb.Cosserat(E=2.6, nu=0.3, ell=0.4, beta=1)
BOTTOM = {"u1": "bottom", "u2": "bottom"}


class Waiting(mb.Cylinder):
    """A cylinder that waits at a height of 1000 above the block."""

    def height(self, x):
        return super().height(x) + 1000.0


def newton(body, method="al", obstacle=mb.Cylinder(1.0), control="load"):
    return MonolithicNewton(
        body, ContactFacets(body, mb.Microblock(0.05), obstacle), method=method, control=control
    )


@pytest.mark.parametrize("load", [1e-12, 1e-6, 1e-2])
@pytest.mark.parametrize("method", ["al", "penalty"])
def test_small_loads_are_found_from_a_distance(block, method, load):
    body = mb.Body(block, SOLID, 2, fixed=BOTTOM)
    solver = newton(body, method, Waiting(1.0))
    state, true = solver.solve(load), mb.Contact(body, mb.Cylinder(1.0), mb.Microblock(0.05)).solve(load=load)
    found = -np.array(list(state.multipliers.values()))
    largest = true.solution.pressures.max()
    # loads this small rest on one corner, so that they alone say its pressure: residuals of 1e-11
    assert np.abs(found - true.solution.pressures).max() <= 1e-10 * largest
    spring = largest / solver.rho if method == "penalty" else 0.0  # by which that corner sinks in
    # rounding of 1000: 1e-13
    assert state.approach - 1000 == pytest.approx(true.approach + spring, rel=0, abs=1e-11)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("method", ["al", "penalty"])
def test_an_absurd_first_guess_arrives_at_the_same_state(block, method, size):
    solver = newton(mb.Body(block, SOLID, 2, fixed=BOTTOM), method)
    state, first = solver.solve(0.1), solver.solve(0.01)
    vector = first.vector.CreateVector()
    # on supports too: they keep the values of the body, not those of the guess
    vector.FV().NumPy()[:] = size * np.random.default_rng(1).standard_normal(len(vector))
    again = solver.solve(0.1, replace(first, vector=vector))
    for corner in state.multipliers:  # to what residuals of 1e-11 leave
        assert again.multipliers[corner] == pytest.approx(
            state.multipliers[corner], abs=1e-8 * abs(state.traction).max()
        )


def test_a_guess_without_contact_is_brought_into_touch(block, capfd):
    solver = newton(mb.Body(block, SOLID, 2, fixed=BOTTOM))
    first = solver.solve(0.01)
    away = solver.solve(0.1, replace(first, approach=-5.0))
    assert away.approach == pytest.approx(solver.solve(0.1).approach, rel=1e-10)  # residuals of 1e-11
    assert "singular" not in capfd.readouterr().out  # UMFPACK would say so


def test_rounding_is_seen_before_the_iterations_run_out(block):
    body = mb.Body(block, SOLID, 2, fixed=BOTTOM)
    facets = ContactFacets(body, mb.Microblock(0.05), mb.Cylinder(1.0))
    with pytest.raises(NotConverged, match="residual stalls") as failure:
        MonolithicNewton(body, facets, method="penalty", rho=1e13, control="load").solve(0.1)
    assert failure.value.iterations < 30  # of 60; some sets are tried first


@pytest.mark.parametrize(
    "fixed, beta",
    [
        ({"u1": "bottom", "psi": "bottom"}, 1),
        ({"u2": "bottom", "psi": "bottom"}, 1),
        ({}, 1),
        (BOTTOM, 0),
        (BOTTOM, 1e-15),
        ({"u1": "bottom"}, 1.999999),
    ],
)
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_a_body_that_is_not_constrained_is_no_compliance(block, fixed, beta, order):
    with pytest.raises(NotConverged, match="rigid motions fixed, and psi where beta = 0"):
        Condensed(mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, ell=0.1, beta=beta), order, fixed=fixed))


@pytest.mark.parametrize("beta", [0, 1e-12, 1, 1.999999])
def test_a_body_that_is_constrained_is_one(block, beta):
    fixed = BOTTOM if beta else {**BOTTOM, "psi": "bottom"}
    solid = mb.Cosserat(E=2.6, nu=0.4999, ell=0.1, beta=beta)
    state = mb.Contact(mb.Body(block, solid, 2, fixed=fixed), mb.Cylinder(1.0), mb.Microblock()).solve(
        load=0.1
    )
    # Clapeyron: to what a matrix with entries of 1 and of beta, or of its distance from 2, leaves
    assert state.fields.energy() == pytest.approx(state.energy, rel=1e-6)


def test_sparsecholesky_gives_nan_where_the_library_has_an_answer_or_an_error(block):
    body = mb.Body(block, SOLID, 2, fixed=BOTTOM)
    solver = newton(body)
    solver.solve(0.1)
    # the saddle point, which is solved by UMFPACK
    assert not np.isfinite(_bare(solver.matrix, solver.free)).all()
    free = mb.Body(block, SOLID, 2)  # a body without supports is an error by each way, never a NaN
    with pytest.raises(NotConverged, match="rigid motions"):
        free.solve(Loads(traction={"contact": (0, -1)}))
    with pytest.raises(NotConverged, match="rigid motions"):
        mb.Contact(free, mb.Cylinder(1.0), mb.Microblock()).solve(load=0.1)
    for method in ("al", "penalty"):
        with pytest.raises(NotConverged, match="supported"):
            newton(free, method).solve(0.1)


def _bare(matrix, free):
    """What NGSolve's sparsecholesky makes of a matrix, with a right-hand side of ones."""
    right = matrix.CreateColVector()
    right.FV().NumPy()[:] = 1.0
    return (matrix.Inverse(free, "sparsecholesky") * right).Evaluate().FV().NumPy()
