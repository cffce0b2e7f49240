"""Where friction is so large that contact has more than one answer: systems by hand, meshes, cells."""

import contextlib
import itertools
import math
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import dome

import microblock as mb
from microblock.contact_solvers import event_driven
from microblock.contact_solvers.event_driven import EventDrivenContact, FrictionalContact
from microblock.fem import friction, meshes
from microblock.fem.friction import FrictionFacets
from tests.bodies import on_ground

C = 0.8  # of the shear force of a node, by which its gap falls: its displacement is C times its pressure

NEWTON = mb.Newton()
RTOL = {NEWTON: None, None: 0.3}


def test_events_without_end_are_named(monkeypatch):
    """No input is known that has so many."""
    monkeypatch.setattr(event_driven, "range", lambda most: range(1), raising=False)
    with pytest.raises(mb.NotConverged, match="to and fro without end") as failure:
        contact = FrictionalContact(np.eye(2), np.diag([-C, 0.0]), np.eye(2), np.array([1.0, 0.0]), 0.3)
        EventDrivenContact(contact).to(2.0, 0.0)
    assert failure.value.reached == pytest.approx((1.0, 0.0))  # the other node touches


def drawn(seed, least=-0.5):
    """A FrictionalContact by chance, of two to four nodes, with a friction of 10^least or more."""
    random = np.random.default_rng(seed)
    n, f = int(random.integers(2, 5)), 10 ** random.uniform(least, least + 1.2)
    root = random.normal(size=(2 * n, 2 * n))
    response, gaps = root @ root.T / (2 * n) + 0.05 * np.eye(2 * n), random.uniform(0, 1, n)
    return FrictionalContact(
        response[:n, :n], response[n:, :n], response[n:, n:], gaps - gaps.min(), float(f)
    )


@pytest.mark.parametrize("seed", range(8))
def test_nodes_at_one_place_share_what_one_carries(seed):
    """Half of their pivots are singular, and are left out."""
    single = drawn(seed, -1.5)
    n = single.nodes
    both = np.tile(np.arange(n), 2)
    whole = np.ix_(both, both)
    double = replace(
        single,
        normal=single.normal[whole],
        cross=single.cross[whole],
        tangential=single.tangential[whole],
        gaps=single.gaps[both],
    )
    for shear in (0.0, 0.8 * single.friction):
        alone, shared = (EventDrivenContact(contact).to(5.0, 5.0 * shear) for contact in (single, double))
        for name in ("normal", "tangential"):
            forces = getattr(shared, name).reshape(2, n).sum(axis=0)
            assert forces == pytest.approx(getattr(alone, name), abs=1e-12)
        assert shared.residual < 1e-12


def all_rates(contact, now, way):
    """All rates of (n, t) at a Moment while the loads go on by `way`: each node that may is open, sticks or
    slips either way, from the compliances alone.
    """
    n, f, found = contact.nodes, contact.friction, []
    whole = np.block([[contact.normal, contact.cross.T], [contact.cross, contact.tangential]])
    p, g, t, size = now.normal, now.gaps, now.tangential, 1e-9 * now.normal.max()
    allowed = []
    for k in range(n):
        if p[k] > size:
            limit = abs(t[k]) >= f * (p[k] - size)
            allowed.append(("stick", int(np.sign(t[k]))) if limit else ("stick",))
        else:
            allowed.append(("open",) if g[k] > 1e-9 * g.max() else ("open", "stick", 1, -1))
    for kinds in itertools.product(*allowed):
        rows, right = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros(2 * n + 2)
        rows[:-2, :-2], rows[:n, -2], rows[n:-2, -1] = whole, -1, -1
        for k, kind in enumerate(kinds):
            if kind == "open":
                rows[k] = np.eye(2 * n + 2)[k]
            if kind != "stick":
                rows[n + k] = np.eye(2 * n + 2)[n + k]
                rows[n + k, k] = 0 if kind == "open" else -f * kind
        rows[-2:] = np.repeat(np.eye(2), n, axis=1) @ np.eye(2 * n, 2 * n + 2)
        right[-2:] = way
        if abs(np.linalg.det(rows)) < 1e-12:
            continue
        values = np.linalg.solve(rows, right)
        dp, dt = values[:n], values[n:-2]
        gaps, slips = np.split(whole @ values[:-2] - np.repeat(values[-2:], n), [n])
        least = []
        for k, kind in enumerate(kinds):
            at_zero = p[k] <= size
            least += [gaps[k]] if kind == "open" and at_zero and "stick" in allowed[k] else []
            least += [dp[k]] if kind != "open" and at_zero else []
            least += [-kind * slips[k]] if kind in (1, -1) else []
            sides = (1, -1) if at_zero else allowed[k][1:]
            least += [f * dp[k] - side * dt[k] for side in sides] if kind == "stick" else []
        if min(least, default=0) > -1e-9 * np.abs(values[:-2]).max():
            found.append(values[:-2])
    return found


@pytest.mark.nightly(200)
def test_no_way_on_is_one_of_several_without_a_word(seeds, monkeypatch):
    """Wherever a history goes on, enumeration finds one way; where it is refused, none or two."""
    seen, settled = Counter(), EventDrivenContact._settled

    def compared(event_driven, way, remaining):
        ways = len(all_rates(event_driven.contact, event_driven.moment(), way))
        try:
            found = settled(event_driven, way, remaining)
        except mb.NotConverged:
            seen[ways, "refused"] += 1
            raise
        seen[ways, "goes on"] += 1
        return found

    monkeypatch.setattr(EventDrivenContact, "_settled", compared)
    for seed in seeds:
        contact = drawn(seed, -0.3)
        event_driven = EventDrivenContact(contact)
        with contextlib.suppress(mb.NotConverged):
            for shear in (0.0, 0.9, -0.9):
                event_driven.to(1.0, shear * contact.friction)
    assert seen[1, "goes on"] > 5 * len(seeds) and sum(seen[key] for key in seen if key[1] == "refused") > 0
    assert not [key for key in seen if (key[0] == 1) != (key[1] == "goes on")], seen


LOAD = np.pi / 2  # a_Hz = 1
TALL = mb.Cosserat(E=2 * (1 - 0.3**2), nu=0.3, ell=3.0, beta=1.0)


def cylinder(f, body, method=None, coupled=True):
    """Pressed, and sheared to full slip one way and half of it the other way."""
    pairs = [(LOAD, 0.0), (LOAD, 0.999 * f * LOAD), (LOAD, -0.999 * f * LOAD)]
    law = mb.Microblock(friction=f)
    return mb.Contact(body, mb.Cylinder(1.0), law, method).history(pairs, coupled=coupled, rtol=RTOL[method])


def test_a_mesh_on_which_no_way_goes_on_says_so():
    """Blocks three times as long as the contact: from a friction of 5 on no rates hold somewhere."""
    tall = on_ground(TALL, 0.4, 1, far=4.0, reach=1.6)
    with pytest.raises(mb.NotConverged, match="no rates"):
        cylinder(6.0, tall, NEWTON)
    for f, coupled in ((3.0, True), (6.0, False)):  # what it advises
        state = cylinder(f, tall, NEWTON, coupled).states[-1]
        assert state.work == pytest.approx(state.energy + state.dissipation, rel=1e-9)


# --- friction at the corners of bodies on meshes: tangent, columns and springs in closed form, reactions,


F = 0.3
SOLID, CYLINDER = mb.Cosserat(E=100, nu=0.2, ell=0.1, beta=1), mb.Cylinder(R=10.0)
BLOCKS = mb.Microblock(friction=F)
PAIRS = [(1.0, 0.0), (1.0, 0.2), (1.0, 0.29), (1.0, -0.15), (0.6, 0.1)]


def followed(body, friction, pairs):
    facets = FrictionFacets(body, mb.Microblock(friction=friction), mb.Plane())
    event_driven = EventDrivenContact(facets.contact())
    return [event_driven.to(*pair) for pair in pairs], event_driven.changes, facets


def test_a_column_follows_the_closed_form():
    """With psi = 0 at both ends, u1 = q/mu (H - beta L tanh(H/2L)) and the couple q/2 gamma' ell^2/L
    tanh(H/2L) at the top; corner B opens where that and the moment of q exceed (ell/2) P, at `tip`; beyond, A
    alone carries P.
    """
    solid, P = mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1), 0.01
    body = mb.Body(meshes.line(depth=1.0, elements=2), solid, order=6, fixed="middle")
    L, mu, ell = solid.layer_length, solid.mu, solid.ell
    softness = (1 - solid.beta * L * math.tanh(1 / (2 * L))) / mu
    tip = P / (1 + solid.curvature * ell / L * math.tanh(1 / (2 * L)))
    (both, one), changes, facets = followed(body, 0.6, [(P, 0.9 * tip), (P, 0.5 * P)])
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


@pytest.mark.parametrize(
    "body, obstacle, far, coupled",
    [
        (on_ground(SOLID, 0.15, 2, reach=0.6), CYLINDER, "bottom", True),
        (on_ground(SOLID, 0.15, 2, reach=0.6), CYLINDER, "bottom", False),
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


def test_levels_that_agree_by_chance_are_not_believed(monkeypatch):
    """The second state hardly changes at last: its error is half of its change before, by the order 1 of the
    first one.
    """
    method, changes = mb.Uniform(h=0.2, order=1, reach=0.6), iter((0.4, 0.4, 0.2, 1e-6))
    history = mb.Contact(mb.Block(SOLID, 2.0), CYLINDER, BLOCKS, method).history(PAIRS[:2])
    monkeypatch.setattr(friction, "change", lambda *_: next(changes))
    levels = [SimpleNamespace(history=lambda *_: history)] * 3
    states = friction.history_to(0.25, levels, PAIRS[:2], True).states
    assert [state.error_estimate for state in states] == pytest.approx([0.2, 0.2])


def test_corners_that_share_their_gap_leave_no_moment():
    """psi is held by the sides, at the ends of the contact: M was 16 times its largest value there."""
    sides = {"u1": "bottom", "u2": "bottom", "psi": "left|right|bottom"}
    mesh = meshes.rectangles(np.linspace(-1, 1, 9), np.linspace(-1, 0, 5))
    body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), 2, fixed=sides, contact="top")
    state = mb.Contact(body, mb.Plane(), mb.Microblock()).solve(load=0.1)
    rough = mb.Contact(body, mb.Plane(), mb.Microblock(friction=1e-3)).history([(0.1, 0.0)]).states[-1]
    # shear of a thousandth of the pressure has a lever of half a block; 0.03 at the nodes beside the ends
    np.testing.assert_allclose(
        rough.micromoment, state.micromoment, rtol=0, atol=0.1 * state.micromoment.max()
    )


def test_supports_that_move_are_refused():
    """Forces of contact are counted from a body at rest."""
    fixed, moved = {"u2": "bottom", "psi": "bottom"}, {"u1": {"bottom": 0.01}}
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-0.6, 0.6), half=False), 0.3)
    body = mb.Body(mesh, SOLID, order=1, fixed=fixed, prescribed=moved)
    with pytest.raises(mb.BadArgument, match="prescribed"):
        mb.Contact(body, CYLINDER, BLOCKS, mb.Newton()).history(PAIRS)
