"""Semismooth Newton: independence of rho, penalty rate, both controls, load stepping, typed failures."""

from dataclasses import replace
from types import SimpleNamespace

import ngsolve as ng
import numpy as np
import pytest
from conftest import dome

from microblock import (
    BadArgument,
    Body,
    Contact,
    Cosserat,
    Cylinder,
    Microblock,
    Microclamped,
    Newton,
    NotConverged,
    Plane,
    Punch,
    Unilateral,
)
from microblock.fem import meshes
from microblock.fem.body import Loads
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton
from microblock.fem.newton_path import load_path, next_event

SOLID = Cosserat(E=2.6, nu=0.3, ell=0.4, beta=1)
BOTTOM = {"u1": "bottom", "u2": "bottom"}
LAWS = pytest.mark.parametrize(
    "model",
    [
        Microblock(0.0),
        Microblock(0.05),
        Microblock(lambda x: 0.1 * x),
        Microblock(-0.05, psi0_in="levers"),
        Unilateral(),
        Microclamped(),
    ],
    ids=["aligned", "turned", "varying", "lever", "unilateral", "microclamped"],
)


def indented(block, model=Microblock(0.0), order=2, obstacle=Cylinder(1.0), **options):
    """A block pressed by a cylinder."""
    clamp = {"psi": "bottom|contact"} if model.clamps_rotation else {}
    body = Body(block, SOLID, order, fixed=BOTTOM | clamp)
    return MonolithicNewton(body, ContactFacets(body, model, obstacle), **options)


def check(newton, state):
    """Complementarity (26) at every node, and equilibrium of the whole body with its supports."""
    length, stress = np.abs(state.approach), max(np.abs(m).max() for m in state.multipliers.values())
    for corner in newton.facets.corners:
        gap, multiplier, closed = (getattr(state, name)[corner] for name in ("gaps", "multipliers", "closed"))
        reach = newton.facets.can_touch[corner]
        assert np.all(multiplier <= 1e-10 * stress) and np.all(gap[reach] >= -1e-10 * length)
        assert np.all(np.abs(gap[closed]) <= 1e-10 * length)
        assert np.all(np.abs(multiplier[~closed]) <= 1e-10 * stress)
    # virtual work of u2 = 1 + x2, which is 1 under the obstacle and 0 at the support, in every space
    internal = ng.Integrate(state.fields.stress[3], newton.body.mesh, order=10)
    assert -internal == pytest.approx(state.load, rel=1e-10)


@LAWS
@pytest.mark.parametrize("order", [1, 2, 4])
def test_indentation_satisfies_the_contact_conditions(block, model, order):
    newton = indented(block, model, order)
    state = newton.solve(0.1)
    check(newton, state)
    assert state.load > 0 and state.kkt <= 1e-11
    assert state.load == pytest.approx(-newton.facets.weights @ state.traction, rel=1e-14)
    if len(newton.facets.corners) == 1:
        assert np.all(state.micromoment == 0)


def test_a_state_shows_its_numbers(block):
    state = indented(block, order=2).solve(0.1)
    rows = {row.name: row.value for row in state.summary().rows}
    assert rows["load"] == state.load and rows["approach"] == 0.1
    assert rows["largest relative residual"] == state.kkt
    assert rows["largest nodal pressure"] == (-state.traction).max() > 0
    assert rows["corner A closed"] == f"{state.closed['A'].sum()} of {len(state.psi)}"
    both = (state.closed["A"] & state.closed["B"]).sum()
    assert rows["all corners closed"] == f"{both} of {len(state.psi)}"
    assert len(repr(state)) < 150 and "force per thickness" in state._repr_html_()
    assert rows["iterations"] == state.iterations


def test_stationarity_is_the_nodal_condition_at_high_order(block):
    """Multiplier unknowns are hierarchical; still each node is closed with g = 0 or open with lambda = 0."""
    state = indented(block, order=5).solve(0.1)
    closed = state.closed["A"]
    assert 0 < closed.sum() < len(closed)
    assert np.abs(state.gaps["A"][closed]).max() < 1e-15
    assert np.abs(state.multipliers["A"][~closed]).max() < 1e-13


def test_result_does_not_depend_on_rho(block):
    stiffness = indented(block).rho
    states = [
        indented(block, Microblock(0.03), rho=stiffness * 10.0**power).solve(0.1) for power in range(-4, 5)
    ]
    reference = states[4]
    for state in states:
        for name in ("traction", "micromoment"):
            expected = getattr(reference, name)
            assert getattr(state, name) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_penalty_error_falls_like_one_over_rho(block):
    exact = indented(block).solve(0.1).load
    rho = indented(block).rho * 10.0 ** np.arange(3, 7)
    errors = [exact - indented(block, method="penalty", rho=value).solve(0.1).load for value in rho]
    slope = np.polyfit(np.log(rho), np.log(errors), 1)[0]
    assert slope == pytest.approx(-1, abs=0.02)  # the active set changes a little at the soft end


def test_penalty_leaves_the_multipliers_to_the_penetration(block):
    newton = indented(block, method="penalty", rho=1e4)
    state = newton.solve(0.1)
    for corner in "AB":
        assert state.multipliers[corner] == pytest.approx(1e4 * np.minimum(state.gaps[corner], 0))


@LAWS
def test_load_control_is_the_inverse_of_approach_control(block, model):
    pressed = indented(block, model).solve(0.1)
    loaded = indented(block, model, control="load").solve(pressed.load)
    assert loaded.approach == pytest.approx(0.1, rel=1e-9)  # conditioning of the approach: some 1e3
    assert loaded.traction == pytest.approx(pressed.traction, abs=1e-9 * np.abs(pressed.traction).max())


def test_the_load_is_the_derivative_of_the_energy(block):
    newton = indented(block)
    states = [newton.solve(approach) for approach in (0.1 - 1e-5, 0.1, 0.1 + 1e-5)]
    slope = (states[2].fields.energy() - states[0].fields.energy()) / 2e-5
    # piecewise quadratic between events: a central difference is exact up to rounding, 1e-15/1e-5
    assert slope == pytest.approx(states[1].load, rel=1e-8)


def dome_under_a_plane(model, **options):
    body = Body(dome(), SOLID, 3, fixed="base")
    return MonolithicNewton(body, ContactFacets(body, model, Plane(1.0)), **options)


@pytest.mark.parametrize(
    "model", [Microblock(0.0), Microblock(0.05), Unilateral()], ids=["aligned", "turned", "unilateral"]
)
def test_contact_of_a_curved_body(model):
    newton = dome_under_a_plane(model)
    states = [newton.solve(approach) for approach in (0.15 - 1e-6, 0.15, 0.15 + 1e-6)]
    # the derivative of the energy knows nothing of normals, corners and levers; on curved elements the energy
    # is integrated to a higher order than the form, which differs by some 1e-7
    slope = (states[2].fields.energy() - states[0].fields.energy()) / 2e-6
    assert slope == pytest.approx(states[1].load, rel=1e-6)
    loaded = dome_under_a_plane(model, control="load").solve(states[1].load)
    assert loaded.approach == pytest.approx(0.15, rel=1e-9)


def test_inclined_surface_carries_the_derivative_of_its_energy():
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(
        quads=True, nx=6, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1 + 0.5 * (2 * x - 1))
    )
    body = Body(mesh, SOLID, 2, fixed="bottom")
    newton = MonolithicNewton(body, ContactFacets(body, Microblock(0.05), lambda x: 0.5 * x + x**2, "top"))
    states = [newton.solve(approach) for approach in (0.1 - 1e-5, 0.1, 0.1 + 1e-5)]
    slope = (states[2].fields.energy() - states[0].fields.energy()) / 2e-5
    assert slope == pytest.approx(states[1].load, rel=1e-7)


def under_cylinder(body, model):
    return MonolithicNewton(body, ContactFacets(body, model, Cylinder(1.0)))


def test_microclamped_surface_may_be_rotated(block):
    """psi prescribed other than zero on the surface, and a displaced support, take part in contact."""
    turned = {"psi": {"contact": 0.02}}
    body = Body(block, SOLID, 2, fixed={"u1": "bottom"}, prescribed={"u2": {"bottom": 0.05}} | turned)
    pushed = under_cylinder(body, Microclamped()).solve(0.05)
    assert pushed.psi == pytest.approx(np.full(13, 0.02), abs=1e-14)
    level = Body(block, SOLID, 2, fixed=BOTTOM, prescribed=turned)
    same = under_cylinder(level, Microclamped()).solve(0.1)
    assert pushed.traction == pytest.approx(same.traction, abs=1e-11)  # a rigid translation apart


def test_microblocks_on_a_clamped_surface(block):
    body = Body(block, SOLID, 2, fixed=BOTTOM | {"psi": "contact"})
    state = under_cylinder(body, Microblock(0.0)).solve(0.1)
    # the block's nearer corner is half a block closer to the vertex
    free = under_cylinder(body, Unilateral()).solve(0.1)
    assert state.kkt < 1e-11 and state.load > free.load


def test_no_load_is_first_touch(block):
    newton = indented(block, Microblock(0.05), control="load")
    touch = newton.solve(0.0)
    assert touch.load == 0 and min(gap.min() for gap in touch.gaps.values()) == pytest.approx(0, abs=1e-15)
    path = list(load_path(newton, [0.0, 0.1, 0.05, 0.0]))
    assert [state.load for state in path] == pytest.approx([0.0, 0.1, 0.05, 0.0], abs=1e-11)
    with pytest.raises(BadArgument, match="cannot pull"):
        newton.solve(-0.1)


@pytest.mark.parametrize("method", ["al", "penalty"])
def test_rounding_of_a_high_rho_is_an_error_not_a_result(block, method):
    with pytest.raises(NotConverged):
        indented(block, method=method, rho=1e16).solve(0.1)


def test_mirrored_blocks_mirror_the_result(block):
    left, right = (indented(block, Microblock(turn)).solve(0.1) for turn in (0.05, -0.05))
    assert left.traction[::-1] == pytest.approx(right.traction, abs=1e-11)
    assert left.micromoment[::-1] == pytest.approx(-right.micromoment, abs=1e-11)
    assert np.abs(left.traction[::-1] - left.traction).max() > 1e-2  # and it is not symmetric by itself


def test_symmetric_half_is_half_of_the_whole():
    """psi = 0 on the axis makes the corners' gaps one function there: one multiplier is dropped, M is 0."""
    from ngsolve.meshes import MakeStructured2DMesh

    def solved(cells, left, fixed):
        mesh = MakeStructured2DMesh(
            quads=True, nx=cells, ny=3, mapping=lambda x, y: (left + (1 - left) * x, y - 1)
        )
        for number, name in enumerate(mesh.GetBoundaries()):
            mesh.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
        body = Body(ng.Mesh(mesh.ngmesh), SOLID, 2, fixed=fixed)
        return under_cylinder(body, Microblock()).solve(0.1)

    whole = solved(6, -1.0, BOTTOM)
    half = solved(3, 0.0, {"u1": "bottom|left", "u2": "bottom", "psi": "left"})
    assert 2 * half.load == pytest.approx(whole.load, rel=1e-12)
    assert half.traction == pytest.approx(whole.traction[6:], abs=1e-11)
    assert half.micromoment == pytest.approx(whole.micromoment[6:], abs=1e-11)  # 0 on the axis


def test_punch_presses_only_where_it_is(block):
    newton = indented(block, Unilateral(), 2, Punch(0.4))
    state = newton.solve(0.05)
    outside = np.abs(newton.facets.points[:, 0]) > 0.4
    assert np.all(np.abs(state.traction[outside]) < 1e-15) and np.all(state.traction[~outside] < 0)


def test_other_loads_act_as_well(block):
    body = Body(block, SOLID, 2, fixed=BOTTOM)
    facets = ContactFacets(body, Unilateral(), Plane(0.5))
    hanging = MonolithicNewton(body, facets, loads=Loads(traction={"contact": (0, 0.2)})).solve(0.0)
    assert hanging.load == 0 and hanging.fields.u2(body.mesh(0.0, 0.0)) > 0


def test_no_contact_is_a_state_of_its_own(block):
    state = indented(block).solve(-0.1)
    assert (state.load, state.iterations, state.kkt) == (0, 0, 0)
    assert not any(closed.any() for closed in state.closed.values())


def test_event_between_states_is_where_the_set_changes():
    body = Body(meshes.line(1.0, 1), SOLID, 8, fixed={"u1": "middle", "u2": "middle"})
    newton = MonolithicNewton(body, ContactFacets(body, Microblock(0.02), Plane(0.004)))
    first, second = newton.solve(0.001), newton.solve(0.002)
    event = next_event(first, second)
    assert (event.corner, event.kind) == ("A", "closes")
    below, above = newton.solve(event.level * (1 - 1e-9)), newton.solve(event.level * (1 + 1e-9))
    assert not below.closed["A"][0] and above.closed["A"][0]
    with pytest.raises(BadArgument, match="same active set"):
        next_event(second, above)
    assert next_event(above, newton.solve(2 * event.level)) is None


def test_load_path_returns_the_states_asked_for(block):
    newton = indented(block, control="load")
    levels = [0.01, 0.05, 0.2]
    states = list(load_path(newton, levels))
    assert [state.load for state in states] == pytest.approx(levels, rel=1e-11)
    direct = newton.solve(0.2)
    assert states[-1].traction == pytest.approx(direct.traction, abs=1e-10)


class Reluctant:
    """A Newton that fails on steps longer than `reach`, or everywhere beyond `wall`."""

    control = "load"

    def __init__(self, reach, wall=np.inf):
        self.reach, self.wall, self.levels, self.tries = reach, wall, [], 0

    def solve(self, level, start):
        self.tries += 1
        if level - (start.level if start else 0.0) > self.reach or level > self.wall:
            raise NotConverged("no", iterations=3)
        self.levels.append(level)
        return SimpleNamespace(level=level)


def test_load_path_cuts_the_step_and_arrives():
    newton = Reluctant(0.3)
    assert [state.level for state in load_path(newton, [0.2, 1.0])] == [0.2, 1.0]
    assert newton.levels[0] == 0.2 and max(np.diff(newton.levels)) <= 0.3
    assert newton.tries == 1 + 2 + 4  # 0.2; then 0.8 and 0.4 fail and four steps of 0.2 arrive


def test_load_path_goes_on_from_its_start():
    newton = Reluctant(0.05)
    list(load_path(newton, [1.0], start=SimpleNamespace(level=0.9)))
    assert min(newton.levels) > 0.9


def test_load_path_says_where_it_stopped():
    with pytest.raises(NotConverged, match="on the way to 1") as caught:
        list(load_path(Reluctant(0.3, wall=0.7), [1.0]))
    assert caught.value.reached == pytest.approx(0.7, abs=1e-3) and caught.value.iterations == 3


def test_cycling_is_named(block, monkeypatch):
    newton = indented(block)
    look, flips = newton._look, iter(range(1000))

    def flip(unknowns, level):
        return replace(look(unknowns, level), active=bytes([next(flips) % 2]), kkt=1.0)

    monkeypatch.setattr(newton, "_look", flip)
    with pytest.raises(NotConverged, match="cycles with period 2"):
        newton.solve(0.1)


def test_unsupported_body_is_named(block):
    body = Body(block, SOLID, 1, fixed={"u1": "bottom"})
    newton = MonolithicNewton(
        body, ContactFacets(body, Unilateral(), Plane(0.1)), loads=Loads(traction={"contact": (0, -0.1)})
    )
    with pytest.raises(NotConverged, match="supported"):
        newton.solve(0.05)


def test_level_must_be_a_number(block):
    with pytest.raises(BadArgument, match="level"):
        indented(block).solve(np.nan)


def test_a_residual_that_falls_slowly_does_not_stall(block):
    """Rounding of a large rho leaves a step that halves the residual again and again."""
    body = Body(block, Cosserat(E=100, nu=0.3, beta=1, ell=0.085), 1, fixed="bottom")
    usual, large = (
        Contact(body, Cylinder(R=10), Microblock(), Newton("al", rho=one)).solve(load=1.0)
        for one in (None, 1e12)
    )
    assert large.pressure == pytest.approx(usual.pressure, abs=1e-3 * usual.pressure.max())
