"""Slope discontinuities, edges of the obstacle and wrong first guesses: what the topology of the zones and
the panels there must bear."""

from dataclasses import replace

import numpy as np
import pytest

from microblock import (
    BadArgument,
    Contact,
    Cosserat,
    Cylinder,
    HalfPlane,
    Microblock,
    Obstacle,
    Panels,
    Punch,
    Unilateral,
    Wedge,
)
from microblock.halfplane import contact_line, panel_solution, topology
from microblock.halfplane.survey import survey
from tests.states import apart

LOAD = np.pi / 2
SAMPLES = Obstacle.from_samples(np.linspace(-3, 3, 31), np.linspace(-3, 3, 31) ** 2 / 2)


def problem(alpha, law, obstacle, beta=1.0):
    return Contact(HalfPlane(Cosserat(E=1.82, nu=0.3, ell=alpha, beta=beta)), obstacle, law)


def of_order(here, order, initial=None):
    """The state of a problem on panels of a fixed order."""
    return here.with_(method=Panels(order=order)).solve(load=LOAD, initial=initial)


@pytest.mark.parametrize(
    "law", [Unilateral(), Microblock(), Microblock(0.05)], ids=["unilateral", "microblock", "rotated"]
)
def test_wedges_converge_like_smooth_obstacles(law):
    here = problem(0.25, law, Wedge(0.8))
    fine = here.with_(method=Panels(order=24)).solve(load=LOAD)
    errors = [apart(of_order(here, order, fine), fine) for order in (6, 10, 14)]
    # x log x is what is left: about order^-8
    assert errors[0] < 1e-2 and errors[1] < errors[0] / 30 and errors[2] < 1e-6


def test_size_of_the_logarithm_is_the_classical_one():
    """A classical wedge presses with p = (E*/2) slope acosh(a/x)/pi*2: K = E* slope/pi for E* = 2 c."""
    here = problem(1.0, Unilateral(), Wedge(0.1), beta=1e-10)
    state = here.solve(load=0.05, rtol=1e-6)
    x = np.array([1e-8, 1e-10]) * state.half_width
    observed = np.diff(state.pressure_at(x))[0] / np.log(x[0] / x[1])
    # rounding of the steps in log x
    assert observed == pytest.approx(here.body.solid.E_star * 0.1 / np.pi, rel=1e-6)


def test_pressure_has_no_holes():
    """Where panels meet, and at the other corner's edges, the pressure is that of the neighbourhood."""
    state = problem(0.25, Microblock(0.1), Cylinder(1.0)).solve(load=LOAD, rtol=1e-6)
    ((left, right),) = state.zones["A"]
    own = state.solution.panels
    ends = np.unique(np.concatenate((own.e, own.e + own.h)))
    inside = ends[(ends > left + 1e-3) & (ends < right - 1e-3)]
    assert len(inside) > 4
    here, beside = state.pressure_at(inside, "A"), state.pressure_at(inside + 1e-9, "A")
    # a square root of 1e-9 on one side of the other corner's edges
    assert here == pytest.approx(beside, rel=1e-3)


@pytest.mark.parametrize(
    "ell, obstacle, law, load",
    [
        (0.1, Punch(3.0, 0.13), Unilateral(), 0.01),
        (3.4, Punch(4.35, 0.23), Microblock(), 0.03),
        (0.25, Punch(5.0), Microblock(), 1.5),
        (0.25, Punch(1.0, 0.01), Microblock(), 0.7),
        (0.25, lambda x: x**2 / 2 + 0.02 * np.cos(9 * x), Microblock(), LOAD),
        (0.25, SAMPLES, Unilateral(), LOAD),
    ],
    ids=["one edge", "one edge of wide blocks", "wide", "tilted", "waves", "samples"],
)
def test_zones_of_other_obstacles(ell, obstacle, law, load):
    state = problem(ell, law, obstacle).solve(load=load)
    assert state.error_estimate <= 1e-3
    assert state.residual < 1e-4  # what panels of order 10 may leave
    assert state.weights @ state.pressure == pytest.approx(load, rel=1e-12)


def test_wrong_zones_are_amended():
    """A gap that the first guess does not have, and a zone too many."""
    here = problem(0.05, Microblock(), Wedge(0.8))
    right = of_order(here, 10).solution
    assert len(right.zones[0]) == 2
    (first, _), (_, last) = right.zones[0]
    wrong = contact_line.fit(right.problem, LOAD, {0: ((first, last),)}, order=10, tolerance=1e-9)
    better = topology.amended(wrong, survey(wrong), 1e-9)
    assert len(better[0]) == 2
    again = contact_line.fit(right.problem, LOAD, better, order=10, tolerance=1e-9)
    assert topology.amended(again, survey(again), 1e-9) is None
    assert np.allclose(again.zones[0], right.zones[0], atol=1e-8)


def test_estimate_is_the_sum_of_its_parts():
    state = problem(0.25, Microblock(), Cylinder(1.0)).solve(load=LOAD, rtol=1e-4)
    parts = state.error_parts
    assert min(parts.discretisation, parts.edges, parts.kernel) > 0 <= parts.conditions
    total = parts.discretisation + parts.edges + parts.kernel + parts.conditions
    assert state.error_estimate == parts.total == total <= 1e-4
    assert of_order(state.problem, 8).error_estimate is None


def test_estimate_of_the_edges_is_what_they_miss():
    """Edges off by 1e-4 of the zone, on purpose, against the fitted ones."""
    here = problem(0.25, Microblock(), Cylinder(1.0))
    fitted = of_order(here, 14).solution
    moved = {0: tuple((left, right * (1 + 1e-4)) for left, right in fitted.zones[0])}
    off = contact_line.fit(here.solver.problem, LOAD, moved, order=14, tolerance=1.0)
    missed = panel_solution.difference(replace(off, zones=fitted.zones), fitted)
    assert 0.1 < missed / off.estimate.edges < 1.5  # K0/sqrt(r), cut off somewhere: right but for a factor


def test_path_of_a_symmetric_problem():
    here = problem(0.25, Microblock(), Cylinder(1.0))
    path = here.path(load=LOAD)
    met = [event for event in path.events if event.kind == "merged"]
    load, error = here.solver.coalescence()
    assert len(met) == 1 and met[0].load == pytest.approx(load, abs=error + met[0].load_error)
    assert [event.load for event in path.events] == sorted(event.load for event in path.events)
    direct = here.solve(load=0.5 * LOAD, rtol=1e-3)
    assert apart(path.at(0.5 * LOAD), direct) < 2e-3  # both below rtol
    with pytest.raises(BadArgument):
        here.path(load=-1.0)


@pytest.mark.slow
def test_events_under_a_wedge():
    """Zones meet on the axis, then a second pair of partial zones is closed from within; on both sides as
    symmetry asks."""
    found = problem(0.25, Microblock(), Wedge(np.tan(np.radians(1)) * 10)).path(load=LOAD).events
    kinds = [(event.kind, event.zone) for event in found if event.load > 0]
    assert kinds[:2] == [("born", "full"), ("merged", "contact")]
    assert kinds.count(("born", "A")) == kinds.count(("born", "B")) == 1
    assert all(event.load_error < 1e-3 * event.load for event in found if event.load > 0)


def test_two_edges_drift_together():
    """Close to coalescence A's and B's inner edges are 1e-5 of the width apart, and have to move by a
    hundred times that."""
    body = HalfPlane(Cosserat(E=1.0, nu=-0.5, ell=10**-1.3125, beta=0.1))
    here = Contact(body, Cylinder(1.0), Microblock(0.03125))
    state = here.solve(load=10**-2.125)
    ((inner, _),) = state.zones["A"]
    ((_, other),) = state.zones["B"]
    assert state.error_estimate <= 1e-3 and abs(inner - other) < 1e-3 * (state.x[-1] - state.x[0])


def test_zones_of_unsymmetric_problems_meet_once():
    """Rotated blocks: A's zone and B's meet where those of straight blocks do, and said to do so once."""
    straight, _ = problem(0.3, Microblock(), Cylinder(1.0)).solver.coalescence()
    # what psi0 shifts is of its second power; the error that is said
    for psi0, near in ((1e-6, 1e-5), (0.03, None)):
        events = problem(0.3, Microblock(psi0), Cylinder(1.0)).path(load=0.7).events
        meeting = [
            event
            for event in events
            if event.kind == "merged" or (event.kind, event.zone) == ("born", "full")
        ]
        assert [(event.kind, event.zone) for event in meeting] == [("born", "full"), ("merged", "contact")]
        assert meeting[0].load == meeting[1].load and meeting[0].load_error < 1e-5 * meeting[0].load
        assert [event for event in events if event.kind in ("vanished", "split")] == []
        if near:
            assert abs(meeting[0].load - straight) < meeting[0].load_error < near * straight
            late = [
                event for event in events if event.x > 0 and event.kind == "born" and event.zone == "contact"
            ]
            assert late[0].load_error > 0  # touches after B does, earlier than the scan begins


def test_a_corner_that_hardly_touches_is_seen():
    """Just beyond the load of first touch the second corner's zone is narrow, and far from all edges."""
    here = problem(1.55, Microblock(0.9), Cylinder(1.0))
    event = next(event for event in here.path(load=12.0).events if event.zone == "A" and event.load > 0)
    for beyond in (1e-2, 1e-4):
        state = here.solve(load=(1 + beyond) * event.load)
        ((left, right),) = state.zones["A"]
        # the gap closes as the square of the width does, up to its logarithm
        assert 0.6 < (right - left) / np.sqrt(beyond) < 1.1 and left < event.x < right + 0.05


def test_a_cylinder_takes_few_solutions():
    """From cells' edges two on order 6, then one or two on each order that is needed; edges driven to the
    accuracy asked for on all orders would take 4, 8 and 13.
    """

    class Counting(Cylinder):
        asked = 0

        def height(self, x):
            Counting.asked += 1  # twice a solution, beside what the search for zones takes
            return super().height(x)

    asked, widths = [], []
    for rtol in (1e-3, 1e-6, 1e-9, 1e-10):
        Counting.asked, here = 0, problem(0.25, Microblock(), Counting(1.0))
        state = here.solve(load=LOAD, rtol=rtol)
        asked.append(Counting.asked)
        widths.append(state.half_width)
        assert state.error_estimate <= rtol
    assert asked[1] - asked[0] <= 4 and asked[2] - asked[0] <= 6
    assert widths[:3] == [pytest.approx(widths[3], rel=rtol) for rtol in (1e-3, 1e-6, 1e-9)]
