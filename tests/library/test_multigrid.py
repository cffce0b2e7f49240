"""Large bodies in space: Newton's systems by multigrid, beside Cholesky factors of the fields."""

import pytest
from ngsolve.meshes import MakeStructured3DMesh

import microblock as mb
from microblock.fem import meshes, newton_systems
from tests.parts import ELASTIC, SOLID


def block(hexahedra):
    def mapped(x, y, z):
        return 2 * x - 1, 2 * y - 1, z - 1

    return MakeStructured3DMesh(hexes=hexahedra, nx=4, ny=4, nz=2, mapping=mapped)


@pytest.mark.parametrize(
    "hexahedra, order, solid, law, method",
    [
        (True, 1, SOLID, mb.Microblock(0.02), mb.Newton()),
        pytest.param(True, 3, ELASTIC, mb.Unilateral(), mb.Newton(), marks=pytest.mark.nightly),
        (True, 2, SOLID, mb.Microclamped(), mb.Newton("penalty")),
        (False, 1, ELASTIC, mb.Unilateral(), mb.Newton("penalty")),
        (False, 2, SOLID, mb.Microblock(), mb.Newton()),
    ],
)
def test_multigrid_has_the_state_of_factors(hexahedra, order, solid, law, method, monkeypatch):
    body = mb.Body(block(hexahedra), solid, order, fixed="bottom", contact="top")
    expected = mb.Contact(body, mb.Sphere(R=5.0), law, method).solve(load=0.5)
    monkeypatch.setattr(newton_systems, "MOST_FACTORISED", 0)
    body = mb.Body(block(hexahedra), solid, order, fixed="bottom", contact="top")
    state = mb.Contact(body, mb.Sphere(R=5.0), law, method).solve(load=0.5)
    # both iterations end at a residual of 1e-9, of forces that may differ 100 times as much
    assert state.pressure == pytest.approx(expected.pressure, abs=1e-7 * expected.pressure.max())
    assert state.approach == pytest.approx(expected.approach, rel=1e-7)


def test_newton_begins_with_the_corners_that_a_contact_closes():
    body = mb.Body(block(False), ELASTIC, 2, fixed="bottom", contact="top")
    state = mb.Contact(body, mb.Sphere(R=2.0), mb.Unilateral(), mb.Newton()).solve(load=20.0)
    ground = meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False)
    body = mb.Body(meshes.uniform(ground, 0.05), ELASTIC, 1, fixed="bottom")
    plane = mb.Contact(body, mb.Cylinder(R=2.0), mb.Unilateral(), mb.Newton()).solve(load=5.0)
    # from the nearest corner alone, which is pressed in deeply and then shed ring by ring, they were 11 and 6
    assert state.iterations <= 8
    assert state.problem.solve(load=20.0, initial=state).iterations <= 1  # from the answer itself
    assert plane.iterations <= 3
