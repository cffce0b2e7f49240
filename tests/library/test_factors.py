"""Cholesky factors of both libraries: the same Schur complement and solutions, and refusals."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags, random

import microblock as mb
from microblock.errors import NotConverged
from microblock.fem import condensation, factors, meshes

KINDS = (factors.SuperLU, factors.Cholmod)


def spd(count, seed):
    """A sparse matrix that is positive definite, with an unknown that is neither inner nor contact."""
    rows = random(count, count, density=3 / count, random_state=seed)
    return csr_matrix(rows @ rows.T + diags(np.linspace(0.5, 2, count)))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count, held", [(40, 1), (400, 30), (12, 11)])
def test_the_block_is_the_factor_of_the_schur_complement(kind, count, held):
    numbers = np.random.default_rng(count).permutation(count)
    contact, inner = np.sort(numbers[:held]), np.sort(numbers[held:-1])
    matrix = spd(count, held)
    found = kind(matrix, inner, contact)
    dense = matrix.toarray()
    schur = dense[np.ix_(found.contact, found.contact)]
    if len(inner):
        to_inner = dense[np.ix_(inner, found.contact)]
        schur = schur - to_inner.T @ np.linalg.solve(dense[np.ix_(inner, inner)], to_inner)
    assert sorted(found.contact) == list(contact)
    assert np.all(np.triu(found.block, 1) == 0)
    assert found.block @ found.block.T == pytest.approx(schur, abs=1e-13)  # entries up to 2
    used = np.sort(np.concatenate((inner, contact)))
    right = np.random.default_rng(1).normal(size=count)
    solution = found.solve(right)
    assert solution[used] == pytest.approx(np.linalg.solve(dense[np.ix_(used, used)], right[used]), abs=1e-12)
    assert solution[numbers[-1]] == 0 and 0 < found.least <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_an_indefinite_matrix_is_refused(kind):
    with pytest.raises(factors.Singular):
        kind(
            csr_matrix(np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
            np.arange(2),
            np.array([2]),
        )


@pytest.mark.parametrize("kind", KINDS)
def test_a_body_that_can_move_is_refused(kind, monkeypatch):
    monkeypatch.setattr(factors, "usual", lambda: kind)
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed={"u2": "bottom"})
    with pytest.raises(NotConverged, match="rigid motions"):
        condensation.Condensed(body)


def test_both_give_the_same_state_and_fields(monkeypatch):
    states = []
    for kind in KINDS:
        monkeypatch.setattr(factors, "usual", lambda: kind)
        block = mb.Block(mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), 6.0)
        states.append(mb.Contact(block, mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0))
    one, other = states
    # rounding of factors whose condition is 1e6 or so
    assert one.pressure == pytest.approx(other.pressure, abs=1e-9 * one.pressure.max())
    assert one.fields(0.1, -0.2).psi == pytest.approx(other.fields(0.1, -0.2).psi, rel=1e-9)
    assert one.reaction("bottom").force == pytest.approx(other.reaction("bottom").force, abs=1e-10)


def test_options_of_cholmod_stay_as_they_were():
    from cvxopt import cholmod

    before = dict(cholmod.options)
    factors.Cholmod(spd(20, 0), np.arange(15), np.arange(15, 20))
    assert dict(cholmod.options) == before
