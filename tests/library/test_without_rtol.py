"""Without rtol every method answers with the best that about a second gives; an rtol that is asked for is
obtained or refused.
"""

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import judging, shapes
from microblock import cost
from microblock.fem.fitted import FittedSolver
from microblock.halfplane.line_solver import LineSolver
from microblock.halfplane.panel_solver import PanelSolver
from microblock.halfspace.surface_solver import SurfaceSolver
from microblock.model import refinement
from microblock.model.plan import Candidate, first_answer

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LINE, SPACE = mb.HalfPlane(SOLID), mb.HalfSpace(SOLID)
ROUND, BLOCKS, PLAIN = mb.Cylinder(R=10), mb.Microblock(), mb.Unilateral()
METHODS = {
    "panels": mb.Contact(LINE, ROUND, BLOCKS, mb.Panels()),
    "cells": mb.Contact(LINE, ROUND, BLOCKS, mb.Cells()),
    "period": mb.Contact(mb.HalfPlane(SOLID, 1.0), mb.Wave(0.01, 1.0), BLOCKS),
    "fitted": mb.Contact(mb.Block(SOLID, 4.0), mb.Wedge(slope=0.05), PLAIN),
    "space": mb.Contact(SPACE, mb.Sphere(R=10), PLAIN),
}
USUAL = {PanelSolver: 1e-12, LineSolver: 1e-12, FittedSolver: 1e-3, SurfaceSolver: 1e-12}


@pytest.fixture
def no_time(monkeypatch):
    """The usual rtol is out of reach, and each further level would take too long."""
    monkeypatch.setattr(refinement, "SECONDS", 0.0)
    for solver, rtol in USUAL.items():
        monkeypatch.setattr(solver, "usual_rtol", rtol)
        monkeypatch.setattr(solver, "usual_history_rtol", rtol)


@pytest.mark.parametrize("name", METHODS)
def test_the_best_state_is_returned(name, no_time):
    """With its estimate, which holds for the area, too: edges move by less than pressures change."""
    problem = METHODS[name]
    state, usual = problem.solve(load=0.5), problem.solver.usual_rtol
    (words,) = [words for words in state.warnings if f"the usual rtol of {usual:g} was not reached" in words]
    assert usual < state.error_estimate < 0.3 and "ask for" not in words
    better = problem.solve(load=0.5, rtol=state.error_estimate / 1.5)
    assert better.contact_area == pytest.approx(state.contact_area, rel=state.error_estimate)


def test_the_best_history_is_returned(no_time):
    for method in (mb.Panels(), mb.Cells()):
        problem = mb.Contact(LINE, mb.Deformable(LINE, ROUND), mb.Unilateral(friction=0.3), method)
        history = problem.history([(1.0, 0.0), (1.0, 0.2)])
        assert 1e-12 < history.error_estimate < 0.5
        assert any("the usual rtol of 1e-12 was not reached" in words for words in history.warnings)


@pytest.mark.parametrize("seconds, estimate", [(0.5, 0.1), (50.0, 0.2)])
def test_another_method_is_tried_if_it_is_cheap(seconds, estimate):
    """Of two answers that miss the usual rtol the one with the smaller estimate is returned."""
    problem = mb.Contact(LINE, ROUND, BLOCKS, mb.Cells(nodes=64))
    solution, estimates = problem.solve(load=0.5).solution, iter((0.2, 0.1))
    costs = cost.Cost(0.1, 1e6, 1e3), cost.Cost(seconds, 1e6, 1e3)
    best = first_answer(
        [Candidate(problem.solver, each) for each in costs],
        lambda candidate: mb.State(solution, error_estimate=next(estimates)),
        lambda state: "the usual rtol was not reached",
    )
    assert best.error_estimate == estimate and "the usual rtol was not reached" in best.warnings


def test_flat_punches_in_space_have_an_rtol():
    """The estimate was .3 on every grid. The approach is 0.8679 of that of a round face as wide, P/(2 E* a),
    by the capacitance of a square plate, 0.366788 times 4 pi its side (Read 1997): to cells of a/200.
    """
    punch = mb.FlatPunch(0.5, face="square")
    state = mb.Contact(mb.HalfSpace(mb.Elastic(E=100, nu=0.3)), punch, PLAIN).solve(load=1.0, rtol=1e-2)
    assert state.error_estimate <= 1e-2 and not state.warnings
    approach = 1.0 / (2 * 100 / 0.91 * 0.5) * 2 / np.pi / (2 * 0.366788)
    assert state.approach == pytest.approx(approach, rel=3e-3)


@pytest.mark.parametrize("place", [(0.0, 0.0), (30.0, -2.0)])
def test_a_tilted_punch_is_answered(place):
    """Its lowest place is at its edge, about which no disc lies on the face: that did not end. In full
    contact the approach at the middle is that of a flat punch, P/(2 E* a).
    """

    def face(x1, x2):
        inside = np.hypot(x1 - place[0], x2 - place[1]) <= 0.5
        return np.where(inside, 1e-3 * (x1 - place[0]), np.inf)

    state = mb.Contact(mb.HalfSpace(mb.Elastic(E=100, nu=0.3)), face, PLAIN).solve(load=1.0)
    assert state.approach == pytest.approx(0.91 / 100, rel=2e-3) and state.error_estimate < 0.02


@pytest.mark.parametrize("name", ["panels", "cells"])
def test_states_of_a_path_aim_at_the_usual_rtol(name, no_time):
    assert METHODS[name].with_(law=PLAIN).path(load=0.5).at(0.4).error_estimate > 1e-12


@pytest.mark.nightly(100, 45, 72, 75)
def test_standard_shapes_are_answered(seeds):
    """Cones and paraboloids with flat tips, rounded and flat punches, powers, ellipsoids up to 100 : 1, in
    the plane and in space: each in about a second, the estimate at least the true error of 98 %. Half of
    those in space were refused.
    """
    rows = [judging.outcome(shapes.case(k)) for k in seeds]
    assert {row["class"] for row in rows} <= {"right", "wrong", "warned"}
    seconds = [row["seconds"] for row in rows]
    assert np.median(seconds) < 2 and max(seconds) < 20  # twice what is promised: machines differ
    assert sum(row["ratio"] > 1 for row in rows) <= 0.02 * len(rows)


@pytest.mark.parametrize("in_space", [False, True])
def test_judge_of_shapes(in_space):
    """Cylinder and sphere by Hertz, wedge and cone by Sneddon, blunt cone by Ejike; to the nodes of G."""
    load, places = 1.0, np.array((0.0, 0.5, 0.9))
    hertz = shapes.Symmetric(shapes.powers(0.5, 2), 2.0, load, in_space)
    a = (3 / 8) ** (1 / 3) if in_space else (2 / np.pi) ** 0.5
    peak = 1.5 / (np.pi * a**2) if in_space else 2 / (np.pi * a)
    assert hertz.contact == pytest.approx(a, rel=1e-5)
    assert hertz.pressure(a * places) == pytest.approx(peak * np.sqrt(1 - places**2), rel=1e-4)
    sharp = shapes.Symmetric(shapes.powers(0.1, 1), 2.0, load, in_space)
    mean = 0.1 / (1 if in_space else np.pi / 2)
    (pressure,) = sharp.pressure(np.array([0.3 * sharp.contact]))
    assert pressure == pytest.approx(mean * np.arccosh(1 / 0.3), rel=1e-9)
    if in_space:
        c = shapes.Symmetric(shapes.blunted(0.5, 0.1), 2.0, load, True).contact
        part = 0.5 / c
        assert 0.2 * c**2 * (np.arccos(part) + part * (1 - part**2) ** 0.5) == pytest.approx(load, rel=1e-5)
        ball, long = shapes.Elliptic(1.0, 1 + 1e-6, 2.0, load), shapes.Elliptic(2.0, 1.0, 2.0, load)
        assert ball.axes == pytest.approx((a, a), rel=1e-5) and long.axes[0] > long.axes[1]
