"""Large bodies in space: Newton's systems by multigrid, beside Cholesky factors of the fields."""

import pytest
from ngsolve.meshes import MakeStructured3DMesh

import microblock as mb
from microblock.fem import newton_systems

SOLID = mb.Cosserat(E=100.0, nu=0.3, ell=0.1, beta=1)
ELASTIC = mb.Elastic(E=100.0, nu=0.3)


def block(hexahedra):
    def mapped(x, y, z):
        return 2 * x - 1, 2 * y - 1, z - 1

    return MakeStructured3DMesh(hexes=hexahedra, nx=4, ny=4, nz=2, mapping=mapped)


@pytest.mark.parametrize(
    "hexahedra, order, solid, law, method",
    [
        (True, 1, SOLID, mb.Microblock(0.02), mb.Newton()),
        (True, 3, ELASTIC, mb.Unilateral(), mb.Newton()),
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
