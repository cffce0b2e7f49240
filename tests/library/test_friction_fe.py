"""Friction at the corners of bodies on meshes: tangent, columns and springs in closed form, reactions,
energy, a glued punch, errors beside estimates. Histories of both algorithms stand in test_agreement.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import dome

import microblock as mb
from microblock.corners.follower import Follower
from microblock.fem import meshes
from microblock.fem.friction import FrictionFacets

F = 0.3
SOLID, CYLINDER = mb.Cosserat(E=100, nu=0.2, ell=0.1, beta=1), mb.Cylinder(R=10.0)
BLOCKS = mb.Microblock(friction=F)
PAIRS = [(1.0, 0.0), (1.0, 0.2), (1.0, 0.29), (1.0, -0.15), (0.6, 0.1)]


def block(h=0.15, solid=SOLID, order=2):
    """A block of the half-width 2 whose contact region has squares of the side h."""
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-0.6, 0.6), half=False), h)
    return mb.Body(mesh, solid, order=order, fixed="bottom")


def followed(body, friction, control, pairs):
    facets = FrictionFacets(body, mb.Microblock(friction=friction), mb.Plane())
    follower = Follower(facets.contact(), by_motions=control == "approach")
    return [follower.to(*pair) for pair in pairs], follower.changes, facets


def test_a_column_follows_the_closed_form():
    """With psi = 0 at both ends, u1 = q/mu (H - beta L tanh(H/2L)) and the couple q/2 gamma' ell^2/L
    tanh(H/2L) at the top; corner B opens where that and the moment of q exceed (ell/2) P, at `tip`; beyond, A
    alone carries P. Dragged beyond f P it slips, and the work of the rest is lost.
    """
    solid, P, f = mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), 0.01, 0.2
    body = mb.Body(meshes.line(depth=1.0, elements=2), solid, order=6, fixed="middle")
    L, mu, ell = solid.layer_length, solid.mu, solid.ell
    softness = (1 - solid.beta * L * math.tanh(1 / (2 * L))) / mu
    tip = P / (1 + solid.curvature * ell / L * math.tanh(1 / (2 * L)))
    (both, one), changes, facets = followed(body, 0.6, "load", [(P, 0.9 * tip), (P, 0.5 * P)])
    assert both.offset == pytest.approx(0.9 * tip * softness, rel=1e-6)
    assert np.subtract(*both.normal) == pytest.approx(0.9 * P, rel=1e-6) and both.stick.all()
    opens = [change.share for change in changes if change.kind == "open"]
    assert opens == [pytest.approx(0.1 * tip / (0.5 * P - 0.9 * tip), rel=1e-5)]
    B = ell / 2 * 0.5 * P * L / (solid.curvature * ell**2 * mu)
    A = (P / (4 * mu) + B * math.sinh(1 / L)) / math.cosh(1 / L)
    turned = -P / (4 * mu) + A * L * math.sinh(1 / L) + B * L * (1 - math.cosh(1 / L))
    psi, u1 = A - P / (4 * mu), (P / 2 - 2 * solid.mu_c * turned) / (mu + solid.mu_c)
    _, found = facets.nodes.surface(np.concatenate((one.normal, one.tangential)), facets.onto)
    assert found[0] == pytest.approx(psi, rel=1e-5)
    assert one.offset == pytest.approx(u1 - ell / 2 * psi, rel=1e-5)
    d = P / (solid.lam + 2 * mu)
    limit = f * P * softness
    pairs = [(d, 0), (d, 0.5 * limit), (d, 3 * limit), (d, 0)]
    (_, stuck, dragged, back), _, _ = followed(body, f, "approach", pairs)
    assert (stuck.shear, stuck.dissipation) == pytest.approx((0.5 * f * P, 0), rel=1e-6, abs=1e-18)
    for moment, sign, way in ((dragged, 1, 2), (back, -1, 3)):  # back by 3, of which 2 are elastic
        assert moment.shear == pytest.approx(sign * f * P, rel=1e-9) and moment.slips.tolist() == [sign]
        assert moment.dissipation == pytest.approx(way * limit * f * P, rel=1e-6)


@pytest.mark.parametrize(
    "body, obstacle, far, coupled",
    [
        (block(), CYLINDER, "bottom", True),
        (block(), CYLINDER, "bottom", False),
        # there pressures and shear tractions both have parts along x1 and x2
        (mb.Body(dome(order=2), SOLID, order=2, fixed="base"), mb.Plane(level=1.0), "base", True),
    ],
    ids=["block", "uncoupled", "curved"],
)
def test_supports_carry_both_loads_and_work_is_energy_and_dissipation(body, obstacle, far, coupled):
    """Nothing is discretised in time: rounding. The energy is that of the fields."""
    states, last = mb.Contact(body, obstacle, BLOCKS, mb.Newton()).history(PAIRS, coupled=coupled).states, 0.0
    for state in states:
        force, moment = state.solution.fields.reaction(far)
        assert force == pytest.approx([-state.shear, state.load], abs=1e-9)
        if far == "bottom":
            arm = state.weights @ (state.pressure * state.x - state.micromoment)
            assert moment == pytest.approx(arm, abs=1e-9)
        assert state.work == pytest.approx(state.energy + state.dissipation, rel=1e-9)
        assert not coupled or state.energy == pytest.approx(state.fields.energy(), rel=1e-9)
        assert state.dissipation >= last - 1e-14 * state.energy
        last = state.dissipation
    assert last > 1e-3 * state.energy


def test_supports_that_move_are_refused():
    """Forces of contact are counted from a body at rest."""
    fixed, moved = {"u2": "bottom", "psi": "bottom"}, {"u1": {"bottom": 0.01}}
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-0.6, 0.6), half=False), 0.3)
    body = mb.Body(mesh, SOLID, order=1, fixed=fixed, prescribed=moved)
    with pytest.raises(mb.BadArgument, match="prescribed"):
        mb.Contact(body, CYLINDER, BLOCKS, mb.Newton()).history(PAIRS)


def test_a_block_has_its_history_to_a_tolerance():
    """Estimates bound the distance to squares four times shorter, by no more than they have to; what a
    refusal advises is met; contact that leaves the region is said.
    """
    pairs, method = PAIRS[:2], mb.Uniform(h=0.2, order=1, reach=0.6)
    problem = mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, BLOCKS, method)
    finest = problem.with_(method=replace(method, h=0.2 / 16)).history(pairs).states
    for state, other in zip(problem.history(pairs, rtol=0.25).states, finest):
        w, true = other.weights, 0.0
        for name, scale in (("pressure", 1.0), ("micromoment", SOLID.ell), ("shear_traction", F)):
            off = (np.interp(other.x, state.x, getattr(state, name)) - getattr(other, name)) / scale
            true = max(true, math.sqrt(w @ off**2 / (w @ other.pressure**2)))
        assert 0.1 * state.error_estimate < true < state.error_estimate <= 0.25
    with pytest.raises(mb.NotConverged, match="smallest error estimate") as failure:
        problem.history(pairs[:1], rtol=1e-3)
    assert problem.history(pairs[:1], rtol=failure.value.rtol_reached).states
    with pytest.raises(mb.NotConverged, match="leaves the region"):
        problem.with_(method=replace(method, reach=0.3)).history(pairs)
