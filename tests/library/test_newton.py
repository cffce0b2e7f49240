"""Semismooth Newton: conditions of contact, independence of rho, the slope of the energy, typed failures."""

import ngsolve as ng
import numpy as np
import pytest
from conftest import dome
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock import Body, Cylinder, Microblock, Microclamped, NotConverged, Plane, Unilateral
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton

SOLID = mb.Cosserat(E=2.6, nu=0.3, ell=0.4, beta=1)
BOTTOM = {"u1": "bottom", "u2": "bottom"}
LAWS = {
    "aligned": Microblock(),
    "turned": Microblock(0.05),
    "varying": Microblock(lambda x: 0.1 * x),
    "lever": Microblock(-0.05, psi0_in="levers"),
    "unilateral": Unilateral(),
    "microclamped": Microclamped(),
}


def indented(block, model=Microblock(), order=2, **options):
    """A block pressed by a cylinder."""
    clamp = {"psi": "bottom|contact"} if model.clamps_rotation else {}
    body = Body(block, SOLID, order, fixed=BOTTOM | clamp)
    return MonolithicNewton(body, ContactFacets(body, model, Cylinder(1.0)), **options)


@pytest.mark.parametrize("model", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("order", [1, 2, 5])
def test_nodes_satisfy_the_contact_conditions_and_the_body_is_in_equilibrium(block, model, order):
    """(26) at every node, at high orders too, where unknowns of multipliers are hierarchical."""
    newton = indented(block, model, order)
    state, facets = newton.solve(0.1), newton.facets
    stresses = state.forces / facets.weights
    for gap, stress, closed, reachable in zip(state.gaps, stresses, state.closed, np.isfinite(facets.g0)):
        assert np.all(stress >= -1e-10 * stresses.max()) and 0 < closed.sum() < len(closed)
        assert np.all(gap[reachable] >= -1e-11)  # the approach is 0.1
        assert np.abs(gap[closed]).max() <= 1e-11 and np.abs(stress[~closed]).max() <= 1e-10 * stresses.max()
    assert state.load > 0 and state.kkt <= 1e-11
    # virtual work of u2 = 1 + x2, which is 1 under the obstacle and 0 at the support, in every space
    internal = ng.Integrate(state.fields.stress[3], newton.body.mesh, order=10)
    assert -internal == pytest.approx(state.load, rel=1e-10)
    assert state.load == pytest.approx(state.forces.sum(), rel=1e-14)


def test_result_does_not_depend_on_rho(block):
    stiffness = indented(block).rho
    states = [indented(block, LAWS["turned"], rho=stiffness * 10.0**k).solve(0.1) for k in (-4, -2, 2, 4, 0)]
    *others, wanted = (state.forces for state in states)
    # rounding by the conditioning of the extreme rho
    assert others == pytest.approx(np.array(4 * [wanted]), abs=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("model", [Microblock(), Microblock(0.05), Unilateral()], ids=str)
def test_the_load_on_curved_and_inclined_surfaces_is_the_slope_of_the_energy(model):
    """Which knows nothing of normals, corners and levers."""
    inclined = MakeStructured2DMesh(nx=6, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1.5 + x))
    for body, obstacle, boundary, approach in (
        (Body(dome(), SOLID, 3, fixed="base"), Plane(1.0), "contact", 0.15),
        (Body(inclined, SOLID, 2, fixed="bottom"), lambda x: 0.5 * x + x**2, "top", 0.1),
    ):
        newton = MonolithicNewton(body, ContactFacets(body, model, obstacle, boundary))
        low, state, high = (newton.solve(approach + step) for step in (-1e-6, 0, 1e-6))
        slope = (high.fields.energy() - low.fields.energy()) / 2e-6
        # on curved elements the energy is integrated to a higher order than the form, which differs by 1e-7
        assert slope == pytest.approx(state.load, rel=1e-6)


@pytest.mark.parametrize("method", ["al", "penalty"])
def test_rounding_of_a_high_rho_is_an_error_not_a_result(block, method):
    with pytest.raises(NotConverged):
        indented(block, method=method, rho=1e16).solve(0.1)


def test_a_residual_that_falls_slowly_does_not_stall(block):
    """Rounding of a large rho leaves a step that halves the residual again and again."""
    body = Body(block, mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085), 1, fixed="bottom")
    usual, large = (
        mb.Contact(body, Cylinder(R=10), Microblock(), mb.Newton("al", rho=rho)).solve(load=1.0).pressure
        for rho in (None, 1e12)
    )
    assert large == pytest.approx(usual, abs=1e-3 * usual.max())  # the rounding of rho
