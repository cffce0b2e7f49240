"""Histories of friction between equal bodies on panels: sums of states without friction."""

import numpy as np
import pytest

import microblock as mb
from microblock.halfplane import friction_panels
from microblock.halfplane.friction_memory import Memory

NU, F, P = 0.3, 0.3, np.pi / 8
RTOL = 1e-7


def contact(obstacle=None, alpha=0.2, law=None, second=None, beta=1.0, method=None):
    """Two half-planes with a modulus of 1 both together, R = 1."""
    body = mb.HalfPlane(mb.Cosserat(E=1 - NU**2, nu=NU, ell=alpha, beta=beta))
    shape = mb.Deformable(second or body, obstacle or mb.Cylinder(R=1.0))
    return mb.Contact(body, shape, law or mb.Unilateral(friction=F), method or mb.Panels())


# --- the memory


def seeded(seed, count=5):
    """Pairs that panels follow: first pressed, then with normal force that falls, is held, or grows."""
    draw, found, last = np.random.default_rng(seed), [], (0.0, 0.0)
    for number in range(count):
        load = draw.uniform(0.3, 1.0) if not number else last[0] * draw.choice([1.0, 1.0, 0.7, 0.9, 1.3])
        shear = F * load * np.clip(draw.uniform(-1.2, 1.2), -1, 1)
        if load > last[0]:
            shear = last[1] + F * (load - last[0]) * draw.uniform(-1, 1)
        found.append((load, shear))
        last = found[-1]
    return found


@pytest.mark.nightly(20, 2, 12, 13)  # those see layers lost below a smaller load
def test_pairs_between_change_no_memory(seed):
    once = often = Memory()
    last = (0.0, 0.0)
    for pair in seeded(seed):
        once = once.to(*pair, F)
        for share in np.linspace(0, 1, 8)[1:]:
            often = often.to(*(np.array(last) + share * np.subtract(pair, last)), F)
        for memory in (once, often):
            assert memory.shear == pytest.approx(pair[1], abs=1e-12) and memory.load == pair[0]
            assert np.all(np.abs(memory.shares) <= F) and np.all(np.diff(memory.bounds) > 0)
        x = np.linspace(0, pair[0], 1001)[1:-1]
        shares = [np.array(one.shares)[np.searchsorted(one.bounds, x) - 1] for one in (once, often)]
        # a sample may lie on either side of a bound
        assert np.count_nonzero(np.abs(shares[0] - shares[1]) > 1e-9) <= 3
        last = pair


def test_shear_that_grows_faster_than_friction_while_pressed_on_is_refused():
    with pytest.raises(mb.BadArgument, match=r"Cells\(\)"):
        Memory().to(1.0, 0.0, F).to(1.1, 0.2, F)
    with pytest.raises(mb.BadArgument, match=r"Cells\(\)"):
        contact().history([(1.0, 0.0), (1.1, 0.2)])


# --- closed forms


def gap_beside(x, c):
    """Beside a cylinder's contact of the half-width c (Hertz)."""
    ratio = np.maximum(np.abs(x) / c, 1.0)
    return c**2 / 2 * (ratio * np.sqrt(ratio**2 - 1) - np.arccosh(ratio))


def test_cattaneo_and_mindlin_with_many_digits():
    problem = contact(beta=1e-8)  # classical but for 1e-8
    shears = (0.0, 0.25, 0.5, 0.75, 0.25, -0.25)
    widths = np.sqrt([1, 0.75, 0.5, 0.25, 1 - 0.5 / 2, 1 - 1 / 2])
    history = problem.history([(P, s * F * P) for s in shears], rtol=RTOL)
    p0 = 2 * P / np.pi
    for state, width in zip(history.states, widths):
        np.testing.assert_allclose(state.zones["contact"], [(-1, 1)], atol=RTOL)
        np.testing.assert_allclose(state.zones["stick"], [(-width, width)], atol=RTOL)
        assert state.error_estimate <= RTOL and state.solution.method == "panels"
        assert state.weights @ state.pressure == pytest.approx(P, rel=1e-9)
        assert state.weights @ state.shear_traction == pytest.approx(state.shear, abs=1e-9)
    for state, width in zip(history.states[1:4], widths[1:]):
        x = state.x
        q = F * p0 * (np.sqrt(np.maximum(1 - x**2, 0)) - np.sqrt(np.maximum(width**2 - x**2, 0)))
        off = np.sqrt(
            state.weights @ (state.shear_traction - q) ** 2 / (state.weights @ (F * state.pressure) ** 2)
        )
        assert off < 1e-6  # the edge of stick is off by some 1e-8, and q is a root there
        np.testing.assert_allclose(state.slip, F * gap_beside(x, width), atol=1e-7)
        lost = F * (state.weights @ (state.pressure * F * gap_beside(x, width)))
        assert state.dissipation == pytest.approx(lost, rel=1e-5)  # a part in 1e4 of the work, which has 1e-9


# --- what holds of all


@pytest.mark.parametrize("seed", range(4))
def test_dissipation_is_what_friction_does_while_points_slip(seed):
    """Under a constant normal force: f p times the slip, by the states' own fields."""
    draw = np.random.default_rng(seed)
    obstacle = (mb.Cylinder(R=1.0), mb.Wedge(0.3), lambda x: np.abs(x) ** 3 / 2, mb.Punch(1.0, 0.05))[seed]
    shears = np.clip(draw.uniform(-1.2, 1.2, 4), -1, 1)
    states = (
        contact(obstacle, alpha=float(draw.uniform(0.05, 1.0)))
        .history([(P, 0.0), *((P, s * F * P) for s in shears)], rtol=1e-4)
        .states
    )
    for before, after in zip(states[:-1], states[1:]):
        x = after.x
        slipped = np.abs(after.slip - np.interp(x, before.x, before.slip))
        lost = F * (after.weights @ (after.pressure * slipped))
        # polygons between points of a rule; of rtol times f P and a slip of 0.1
        assert after.dissipation - before.dissipation == pytest.approx(lost, rel=5e-3, abs=3e-6)
        assert np.all(np.abs(after.shear_traction) <= F * after.pressure * (1 + 1e-5) + 1e-5)


def uneven(x):
    return np.where(x > 0, 0.3, 0.8) * x**2


@pytest.mark.parametrize("seed", range(6))
def test_cells_find_the_same(seed):
    """Another discretisation, that knows nothing of sums: forces, slip, energies, zones."""
    draw = np.random.default_rng(seed)
    obstacle = (None, mb.Wedge(0.3), lambda x: np.abs(x) ** 2.6 / 2, None, uneven, None)[seed]
    problem, given = contact(obstacle, float(draw.uniform(0.02, 1.0))), seeded(seed, 4)
    rtol = 2e-2
    exact = problem.history(given, rtol=1e-4).states
    cells = problem.with_(method=mb.Cells()).history(given, rtol=rtol).states
    for one, other in zip(exact, cells):
        inside = other.pressure > 0
        x, weights = other.x[inside], other.weights[inside]
        size = np.sqrt(weights @ other.pressure[inside] ** 2)
        for name, scale in (("pressure", 1.0), ("shear_traction", F)):
            off = np.interp(x, one.x, getattr(one, name)) - getattr(other, name)[inside]
            assert np.sqrt(weights @ off**2) < rtol * size * scale, name
        for name in ("slip", "psi", "displacement"):
            values = np.interp(x, one.x, getattr(one.solution, name))
            off = values - getattr(other.solution, name)[inside]
            largest = max(np.abs(values).max(), np.abs(other.slip).max())
            assert (
                np.abs(off - (off.mean() if name == "displacement" else 0)).max() < 0.02 * largest + 1e-9
            ), name
        assert one.dissipation == pytest.approx(other.dissipation, rel=5e-3, abs=1e-6)
        assert one.work == pytest.approx(other.work, rel=1e-3)  # constants of the half-planes are the same
        for name in ("contact", "stick"):
            assert len(one.zones[name]) == len(other.zones[name])
            np.testing.assert_allclose(one.zones[name], other.zones[name], atol=5e-3)


def test_a_state_on_panels_has_all_that_a_state_has():
    history = contact().history([(P, 0.0), (P, 0.5 * F * P), (P, F * P), (P, 0.0)], rtol=1e-5)
    kinds = [event.kind for event in history.events]
    assert kinds == ["born", "first slip", "full slip", "reversal"]
    for state in history.states:
        assert "Q" in str(state.summary().rows)
        assert all(0 < error < 1e-4 for pair in state.zone_errors["contact"] for error in pair)
        assert np.isfinite([state.psi, state.micromoment, state.slip, state.x]).all()
        assert abs(state.work - state.energy - state.dissipation) < 1e-15
        assert state.gap_at("C", 1.2) > 0
    assert not history.states[2].zones["stick"]
    history.plot()
    with pytest.raises(mb.BadArgument, match="panels without friction"):
        history.states[0].fields(0.0, -0.1)


def test_contacts_that_do_not_grow_with_the_load_are_an_error():
    """No such problem is known: the states of two loads are exchanged."""
    solver = friction_panels.FrictionPanels(contact().solver, np.array([(0.5, 0.0), (1.0, 0.0)]))
    memories = [Memory(), Memory().to(0.5, 0.0, F), Memory().to(1.0, 0.0, F)]
    _, plain = solver._solutions(memories, 1e-3)
    plain.require_growing()
    plain._known = {0.5: plain.at(1.0), 1.0: plain.at(0.5)}
    with pytest.raises(mb.NotConverged, match="load 0.5 is not within"):
        plain.require_growing()
