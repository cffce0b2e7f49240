"""What is below contact on meshes: Cholesky factors of both libraries, and contact beside a region of equal
squares.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)


def answers():
    """Numbers of bodies in the plane and in space, and whether a body that can move is refused."""
    flat = mb.Contact(mb.Block(SOLID, 6.0), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured3DMesh(nx=3, ny=3, nz=3, mapping=lambda x, y, z: (x, y, z - 1))
    cube = mb.Body(mesh, SOLID, 2, fixed="bottom", contact="top")
    deep = mb.Contact(cube, mb.Sphere(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured2DMesh(nx=8, ny=4, mapping=lambda x, y: (2 * x - 1, y - 1))
    loose = mb.Body(mesh, SOLID, 2, fixed={"u1": "bottom", "u2": "left"}, contact="top")  # a hinge
    with pytest.raises(mb.NotConverged, match="rigid motions"):
        mb.Contact(loose, mb.Cylinder(10.0), mb.Microblock(), mb.Condensed()).solve(load=1.0)
    below = [flat.fields(0.1, -0.2).psi, *flat.reaction("bottom").force, deep.fields.energy()]
    return [list(flat.pressure), list(deep.pressure), [float(value) for value in below]]


def test_without_cvxopt_states_fields_and_refusals_are_the_same():
    """To rounding of factors whose condition is 1e6 or so; in space the residual of the conditions, 1e-7."""
    code = (
        "import sys, json; sys.modules['cvxopt'] = None\n"
        "from tests.library.test_factors import answers; print(json.dumps(answers()))"
    )
    root = Path(__file__).parents[2]
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    for with_it, without, tolerance in zip(answers(), json.loads(ran.stdout), (1e-9, 1e-6, 1e-8)):
        assert without == pytest.approx(with_it, abs=tolerance * max(with_it))
        assert without != with_it  # another library did it


@pytest.mark.parametrize("newton", [None, mb.Newton()], ids=["condensed", "newton"])
def test_contact_beside_the_region_of_equal_squares_is_said(newton):
    """A bump beside the region touches before the rest does: its nodes count, too."""

    def height(x):
        return np.minimum(x**2 / 20, 2 * (x - 1.5) ** 2 - 0.005)

    solid, method = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), mb.Uniform(0.1, reach=0.6, newton=newton)
    problem = mb.Contact(mb.Block(solid, 4.0), mb.Obstacle(height, kinks=(1.3,)), mb.Unilateral(), method)
    with pytest.raises(mb.NotConverged, match="leaves the region of equal squares"):
        problem.solve(load=0.3)
