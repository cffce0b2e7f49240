"""Kinks, ends and wrong first guesses: what the topology of the zones and the panels at a kink must bear."""

from dataclasses import replace

import numpy as np
import pytest

from microblock import contact_line, line_state, obstacles, panels, topology
from microblock.errors import BadArgument, NotConverged
from microblock.halfplane import HalfPlane
from microblock.law import Microblock, Unilateral
from microblock.material import Cosserat
from microblock.scene import Contact
from microblock.survey import survey

LOAD = np.pi/2


def scene(alpha, law, obstacle, beta=1.0):
    return Contact(HalfPlane(Cosserat(E=1.82, nu=0.3, ell=alpha, beta=beta)), obstacle, law)


@pytest.mark.parametrize("law", [Unilateral(), Microblock(), Microblock(0.05)], ids=["unilateral", "microblock", "turned"])
def test_wedges_converge_like_smooth_obstacles(law):
    here = scene(0.25, law, obstacles.Wedge(0.8))
    fine = here.at(LOAD, order=24)
    errors = [line_state.difference(here.at(LOAD, order=order, near=fine), fine) for order in (6, 10, 14)]
    assert errors[0] < 1e-2 and errors[1] < errors[0]/30 and errors[2] < 1e-6      # x log x is what is left: about order^-8


def test_without_the_logarithm_a_wedge_does_not(monkeypatch):
    here = scene(0.25, Unilateral(), obstacles.Wedge(0.8))
    fine = here.at(LOAD, order=24)
    monkeypatch.setattr(panels, "log_sizes", lambda *_: {})
    assert line_state.difference(here.at(LOAD, order=14, near=fine), fine) > 1e-4      # against 1e-8


def test_size_of_the_logarithm_is_the_classical_one():
    """A classical wedge presses with p = (E*/2) slope acosh(a/x)/pi*2: K = E* slope/pi for E* = 2 c."""
    here = scene(1.0, Unilateral(), obstacles.Wedge(0.1), beta=1e-10)
    state = here.at(0.05, rtol=1e-6)
    x = np.array([1e-8, 1e-10])*state.zones[0][0][1]
    observed = np.diff(state.pressure(0, x))[0]/np.log(x[0]/x[1])
    assert observed == pytest.approx(here.body.solid.E_star*0.1/np.pi, rel=1e-6)      # rounding of the steps in log x


def test_pressure_has_no_holes():
    """Where panels meet, and at the other corner's edges, the pressure is that of the neighbourhood."""
    state = scene(0.25, Microblock(0.1), obstacles.Cylinder(1.0)).at(LOAD, rtol=1e-6)
    (left, right), = state.zones[0]
    ends = np.unique(np.concatenate((state.panels.e, state.panels.e + state.panels.h)))
    inside = ends[(ends > left + 1e-3) & (ends < right - 1e-3)]
    assert len(inside) > 4
    here, beside = state.pressure(0, inside), state.pressure(0, inside + 1e-9)
    assert here == pytest.approx(beside, rel=1e-3)      # a square root of 1e-9 on one side of the other corner's edges


@pytest.mark.parametrize("ell, obstacle, law, load", [
    (0.1, obstacles.Punch(3.0, 0.13), Unilateral(), 0.01), (3.4, obstacles.Punch(4.35, 0.23), Microblock(), 0.03),
    (0.25, obstacles.Punch(5.0), Microblock(), 1.5), (0.25, obstacles.Punch(1.0, 0.01), Microblock(), 0.7),
    (0.25, lambda x: x**2/2 + 0.02*np.cos(9*x), Microblock(), LOAD),
    (0.25, obstacles.Profile(np.linspace(-3, 3, 31), np.linspace(-3, 3, 31)**2/2), Unilateral(), LOAD)],
    ids=["one end", "one end of wide blocks", "wide", "tilted", "waves", "profile"])
def test_zones_of_other_obstacles(ell, obstacle, law, load):
    state = scene(ell, law, obstacle).at(load)
    assert state.error_estimate <= 1e-3
    assert line_state.violation(state) < 1e-4      # what panels of order 10 may leave
    assert state.weights @ state.pressures.sum(axis=0) == pytest.approx(load, rel=1e-12)


def test_wrong_zones_are_amended():
    """A gap that the first guess does not have, and a zone too many."""
    here = scene(0.05, Microblock(), obstacles.Wedge(0.8))
    right = here.at(LOAD, order=10)
    assert len(right.zones[0]) == 2
    (first, _), (_, last) = right.zones[0]
    wrong = contact_line.fit(right.line, LOAD, {0: ((first, last),)}, order=10, tolerance=1e-9)
    better = topology.amended(wrong, survey(wrong), 1e-9)
    assert len(better[0]) == 2
    again = contact_line.fit(right.line, LOAD, better, order=10, tolerance=1e-9)
    assert topology.amended(again, survey(again), 1e-9) is None and np.allclose(again.zones[0], right.zones[0], atol=1e-8)


def test_estimate_is_the_sum_of_its_parts():
    state = scene(0.25, Microblock(), obstacles.Cylinder(1.0)).at(LOAD, rtol=1e-4)
    parts = state.estimate
    assert min(parts.discretisation, parts.edges, parts.kernel) > 0 <= parts.conditions
    assert state.error_estimate == parts.discretisation + parts.edges + parts.kernel + parts.conditions <= 1e-4
    assert scene(0.25, Microblock(), obstacles.Cylinder(1.0)).at(LOAD, order=8).error_estimate is None


def test_estimate_of_the_edges_is_what_they_miss():
    """Edges off by 1e-4 of the zone, on purpose, against the fitted ones."""
    here = scene(0.25, Microblock(), obstacles.Cylinder(1.0))
    fitted = here.at(LOAD, order=14)
    moved = {0: tuple((left, right*(1 + 1e-4)) for left, right in fitted.zones[0])}
    off = contact_line.fit(here.line, LOAD, moved, order=14, tolerance=1.0)
    missed = line_state.difference(replace(off, zones=fitted.zones), fitted)
    assert 0.1 < missed/off.estimate.edges < 1.5      # K0/sqrt(r), cut off somewhere: right but for a factor


def test_path_of_a_symmetric_scene():
    here = scene(0.25, Microblock(), obstacles.Cylinder(1.0))
    path = here.load(LOAD)
    met = [event for event in path.events if event.kind == "merged"]
    load, error = here.coalescence()
    assert len(met) == 1 and met[0].load == pytest.approx(load, abs=error + met[0].load_error)
    assert [event.load for event in path.events] == sorted(event.load for event in path.events)
    direct = here.at(0.5*LOAD, rtol=1e-3)
    assert line_state.difference(path.at(0.5*LOAD), direct) < 2e-3      # both below rtol
    with pytest.raises(BadArgument):
        here.load(-1.0)


@pytest.mark.slow
def test_events_under_a_wedge():
    """Zones meet on the axis, then a second pair of partial zones is closed from within; on both sides as symmetry asks."""
    found = scene(0.25, Microblock(), obstacles.Wedge(np.tan(np.radians(1))*10)).load(LOAD).events
    kinds = [(event.kind, event.zone) for event in found if event.load > 0]
    assert kinds[:2] == [("born", "full"), ("merged", "contact")]
    assert kinds.count(("born", "A")) == kinds.count(("born", "B")) == 1
    assert all(event.load_error < 1e-3*event.load for event in found if event.load > 0)


def test_two_edges_drift_together():
    """Close to coalescence A's and B's inner edges are 1e-5 of the width apart, and have to move by a hundred times that."""
    here = Contact(HalfPlane(Cosserat(E=1.0, nu=-0.5, ell=10**-1.3125, beta=0.1)), obstacles.Cylinder(1.0), Microblock(0.03125))
    state = here.at(10**-2.125)
    (inner, _), = state.zones[0]
    (_, other), = state.zones[1]
    assert state.error_estimate <= 1e-3 and abs(inner - other) < 1e-3*(state.x[-1] - state.x[0])


def test_zones_of_unsymmetric_scenes_meet_once():
    """Turned blocks: A's zone and B's meet where those of straight blocks do, and said to do so once."""
    straight, _ = scene(0.3, Microblock(), obstacles.Cylinder(1.0)).coalescence()
    for psi0, near in ((1e-6, 1e-5), (0.03, None)):      # what psi0 shifts is of its second power; the error that is said
        events = scene(0.3, Microblock(psi0), obstacles.Cylinder(1.0)).load(0.7).events
        meeting = [event for event in events if event.kind == "merged" or (event.kind, event.zone) == ("born", "full")]
        assert [(event.kind, event.zone) for event in meeting] == [("born", "full"), ("merged", "contact")]
        assert meeting[0].load == meeting[1].load and meeting[0].load_error < 1e-5*meeting[0].load
        assert [event for event in events if event.kind in ("vanished", "split")] == []
        if near:
            assert abs(meeting[0].load - straight) < meeting[0].load_error < near*straight
            late = [event for event in events if event.x > 0 and event.kind == "born" and event.zone == "contact"]
            assert late[0].load_error > 0      # touches after B does, earlier than the scan begins


def test_a_corner_that_hardly_touches_is_seen():
    """Just beyond the load of first touch the second corner's zone is narrow, and far from all edges."""
    here = scene(1.55, Microblock(0.9), obstacles.Cylinder(1.0))
    event = next(event for event in here.load(12.0).events if event.zone == "A" and event.load > 0)
    for beyond in (1e-2, 1e-4):
        state = here.at((1 + beyond)*event.load)
        (left, right), = state.zones[0]
        # the gap closes as the square of the width does, up to its logarithm
        assert 0.6 < (right - left)/np.sqrt(beyond) < 1.1 and left < event.x < right + 0.05


def test_crossed_edges_are_another_topology():
    line = scene(0.05, Microblock(-0.04), obstacles.Punch(1.0, 1e-6)).line
    with pytest.raises(NotConverged, match="cross"):
        contact_line.fit(line, 1.0, {0: ((-0.9, 0.95), (0.94, 1.02)), 1: ((-1.0, 0.9),)}, order=6, tolerance=1e-3)
