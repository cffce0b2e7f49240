"""Cholesky factors of both libraries: the same Schur complement and solutions, and refusals."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh
from scipy.sparse import csr_matrix, diags, random

import microblock as mb
from microblock import NotConverged
from microblock.fem import factors

ROOT = Path(__file__).parents[2]
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


def answers():
    """Numbers of bodies in the plane and in space, and whether a body that can move is refused."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    flat = mb.Contact(mb.Block(solid, 6.0), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured3DMesh(nx=3, ny=3, nz=3, mapping=lambda x, y, z: (x, y, z - 1))
    cube = mb.Body3D(mesh, solid, 2, fixed="bottom", contact="top")
    deep = mb.Contact(cube, mb.Sphere(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured2DMesh(nx=8, ny=4, mapping=lambda x, y: (2 * x - 1, y - 1))
    loose = mb.Body(mesh, solid, 2, fixed={"u2": "bottom"}, contact="top")
    with pytest.raises(NotConverged, match="rigid motions"):
        mb.Contact(loose, mb.Cylinder(10.0), mb.Microblock(), mb.Condensed()).solve(load=1.0)
    below = [flat.fields(0.1, -0.2).psi, *flat.reaction("bottom").force, deep.fields.energy()]
    return [list(flat.pressure), list(deep.pressure), [float(value) for value in below]]


def test_without_cvxopt_states_fields_and_refusals_are_the_same():
    code = (
        "import sys, json; sys.modules['cvxopt'] = None\n"
        "from tests.library.test_factors import answers; print(json.dumps(answers()))"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert not ran.returncode, ran.stderr
    # rounding of factors whose condition is 1e6 or so; in space the residual of the conditions, 1e-7
    for with_it, without, tolerance in zip(answers(), json.loads(ran.stdout), (1e-9, 1e-6, 1e-8)):
        assert without == pytest.approx(with_it, abs=tolerance * max(with_it))
        assert without != with_it  # another library did it


def test_options_of_cholmod_stay_as_they_were():
    from cvxopt import cholmod

    before = dict(cholmod.options)
    factors.Cholmod(spd(20, 0), np.arange(15), np.arange(15, 20))
    assert dict(cholmod.options) == before
