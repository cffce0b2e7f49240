"""Bodies on meshes as users bring them: roller supports, coarse meshes, obstacles with steps."""

import numpy as np
import pytest

import microblock as mb
from microblock.fem import meshes, meshes3d
from microblock.fem.body import Loads

ELASTIC = mb.Elastic(E=100, nu=0.3)
UNCOUPLED = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=0)
ROLLERS = {"u1": "left|right", "u2": "bottom"}
NAMES = "bottom", "right", "contact", "left"


def slab(squares, quads=True):
    """[-2, 2] x [-2, 0] with this many squares along its surface."""
    across, up = np.linspace(-2, 2, squares + 1), np.linspace(-2, 0, squares // 2 + 1)
    return meshes.rectangles(across, up, quads, NAMES)


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microclamped()], ids=str)
@pytest.mark.parametrize("method", [None, mb.Newton()], ids=str)
def test_a_classical_solid_on_rollers_needs_no_support_of_a_rotation(law, method):
    """The stiffness matrix was said to be singular: "psi where beta = 0?"."""
    for solid in (ELASTIC, UNCOUPLED)[law.clamps_rotation :]:
        state = mb.Contact(mb.Body(slab(4), solid, fixed=ROLLERS), mb.Plane(), law, method).solve(load=1.0)
        # nothing moves sideways: P over the width is (lambda + 2 mu) times the approach over the depth
        assert state.approach == pytest.approx(0.5 / (solid.lam + 2 * solid.mu), rel=1e-10)  # rounding
        assert not state.psi.any() and not state.micromoment.any()
        # u1 at 9*5 places but on two sides, u2 but below; Newton adds multipliers and the approach
        assert state.unknowns == 35 + 36 + (10 if method else 0)


def test_friction_on_a_classical_column():
    for solid in (ELASTIC, UNCOUPLED):
        fixed = {"u1": "middle", "u2": "middle"}
        body = mb.Body(meshes.column(1.0, 4), solid, fixed=fixed, periodic=True)
        problem = mb.Contact(body, mb.Plane(), mb.Unilateral(friction=0.3))
        state = problem.history([(1, 0), (1, 0.1)]).states[-1]
        # of a width of 1/4
        assert state.approach == pytest.approx(4 / (solid.lam + 2 * solid.mu), rel=1e-10)
        assert state.tangential_approach == pytest.approx(0.4 / solid.mu, rel=1e-10)


def test_a_classical_solid_on_rollers_takes_an_rtol_and_a_path():
    body = mb.Body(slab(8), ELASTIC, order=3, fixed={"u1": "left", "u2": "bottom"})
    problem = mb.Contact(body, mb.Cylinder(R=10), mb.Unilateral())
    state = problem.solve(load=1.0, rtol=0.05)
    fixed = body.fixed | {"psi": "bottom"}
    nearly = problem.with_(body=mb.Body(slab(8), mb.Cosserat(100, 0.3, 1.0, beta=1e-9), 3, fixed=fixed))
    # the same mesh, with a psi that is all but uncoupled
    other = nearly.solve(load=1.0, rtol=0.05)
    assert state.half_width == pytest.approx(other.half_width, rel=1e-6)
    assert state.error_estimate == pytest.approx(other.error_estimate, rel=1e-6)
    assert state.unknowns < 0.7 * other.unknowns
    assert [event.kind for event in problem.path(load=1.0).events] == ["born"]


@pytest.mark.parametrize("method", [None, mb.Newton()], ids=str)
def test_rollers_in_space(method):
    x = np.linspace(0, 1, 3)
    fixed = {"u1": "left", "u2": "front", "u3": "bottom"}
    for solid in (ELASTIC, UNCOUPLED):
        body = mb.Body(meshes3d.block(x, x, x - 1), solid, order=2, fixed=fixed)
        state = mb.Contact(body, lambda x1, x2: 0 * x1, mb.Unilateral(), method).solve(load=0.1)
        assert state.approach == pytest.approx(0.1 / solid.E, rel=1e-8)  # the iterations' residual
        assert not state.psi.any() and not state.micromoment.any()


def test_what_turns_nothing_is_refused_and_what_holds_nothing_passed_over():
    body = mb.Body(slab(4), ELASTIC, fixed=ROLLERS | {"psi": "bottom"})
    assert list(body.fixed) == ["u1", "u2"] and body.unknowns == 71
    assert body.of(UNCOUPLED).fixed["psi"] == "bottom"
    pulled = Loads(traction={"contact": (0, -1)})
    for other in (body, mb.Body(slab(4), UNCOUPLED, order_psi=0, fixed=ROLLERS)):
        point = other.solve(pulled)(0.3, -1.0)
        assert point.u[1] == pytest.approx(-1 / (ELASTIC.lam + 2 * ELASTIC.mu), rel=1e-10)  # rounding
        assert point.psi == 0 and not point.couple_stress.any()
    for load in (Loads(couple=0.1), Loads(micromoment={"contact": 0.1})):
        with pytest.raises(mb.BadArgument, match="(couple|micromoment) = 0.1: turns nothing"):
            body.solve(load)
    with pytest.raises(mb.BadArgument, match="field = 'psi': fields are u1, u2$"):
        mb.Body(slab(4), ELASTIC, fixed="bottom", prescribed={"psi": {"left": 0.1}})
    with pytest.raises(mb.BadArgument, match="order_psi = 0: must be a whole number, at least 1"):
        mb.Body(slab(4), mb.Cosserat(100, 0.3, 0.2, beta=1), order_psi=0, fixed="bottom")
