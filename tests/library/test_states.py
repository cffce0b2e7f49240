"""What states, paths and errors say is true, and problems given in another way have the same answers."""

import copy
import pickle
import re
from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from microblock.model.law import Law
from microblock.model.results import intervals
from tests.bodies import on_ground, quarter

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
GROUND, CYLINDER, LAW, LINE = mb.HalfPlane(SOLID), mb.Cylinder(R=10), mb.Microblock(), mb.Unilateral()
RUBBING = mb.Unilateral(friction=0.3)


BODY, SPACE = on_ground(SOLID, 1.0, 1), quarter(SOLID)
PROBLEMS = {
    "panels": mb.Contact(GROUND, CYLINDER, LAW),
    "cells": mb.Contact(GROUND, CYLINDER, LAW, mb.Cells(nodes=64, window=(-1, 1))),
    "fitted": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Fitted(order=2)),
    "uniform": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, LAW, mb.Uniform(h=0.2)),
    "condensed": mb.Contact(BODY, CYLINDER, LAW),
    "newton": mb.Contact(BODY, CYLINDER, LAW, mb.Newton()),
    "half-space": mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(1.0), LAW, mb.Cells(nodes=32)),
    "in space": mb.Contact(SPACE, mb.Sphere(10.0), LAW),
    "in space by Newton": mb.Contact(SPACE, mb.Sphere(10.0), LAW, mb.Newton()),
}
ASKED = {  # what shows its progress under which word
    **{
        kind: (lambda kind=kind, **more: PROBLEMS[kind].solve(load=0.1, **more), "solve by")
        for kind in PROBLEMS
    },
    **{
        f"path {kind}": (lambda kind=kind, **more: PROBLEMS[kind].path(0.1, **more).events, "load path:")
        for kind in ("panels", "fitted", "condensed")
    },
    **{
        f"history {body}": (
            lambda body=body, rtol=rtol, **more: mb.Contact(body, CYLINDER, RUBBING).history(
                [(1.0, 0.0), (1.0, 0.1)], rtol=rtol, **more
            ),
            "history:",
        )
        for body, rtol in ((GROUND, 0.2), (BODY, None))
    },
}


@pytest.mark.parametrize("name", ASKED)
def test_progress_is_shown_by_every_method_where_it_is_asked_for(name, capsys):
    ask, word = ASKED[name]
    ask()
    assert not capsys.readouterr().err
    ask(progress=True)
    assert word in capsys.readouterr().err


# warnings


@pytest.mark.parametrize("kind", [kind for kind in PROBLEMS if kind != "in space by Newton"])
def test_warnings_stand_in_what_a_state_says_of_itself(kind):
    """In the terminal and above the figure alike."""
    tilted = PROBLEMS[kind].with_(law=mb.Microblock(psi0=0.3))  # 17 degrees: beyond small angles
    state = tilted.solve(load=1.0 if kind == "fitted" else 1e-3)
    if kind == "half-space":  # which warns of nothing there
        state = mb.State(**{**vars(state), "warnings": ["cells are few"]})
    above = " ".join(state.plot().get_suptitle().split())
    assert state.warnings
    for text in state.warnings:
        assert text in str(state) and text in above


def test_warnings_of_a_history_are_those_of_its_states_once_each():
    history = mb.Contact(BODY, CYLINDER, RUBBING).history([(0.01, 0.0), (0.01, 0.001)])
    assert history.warnings == history.states[0].warnings == history.states[1].warnings
    assert history.warnings and all(text in str(history) for text in history.warnings)


STEEP = mb.HalfPlane(mb.Cosserat(E=2, nu=0.3, beta=1, ell=0.1))
COARSE = mb.Contact(on_ground(SOLID, 0.25, 2), CYLINDER, LAW)
WARNED = {  # problem, load, words of its warnings
    "small strain": (PROBLEMS["panels"], 1.0, []),
    "steep": (mb.Contact(STEEP, mb.Cylinder(1.0), mb.Microblock(0.2)), 1.0, ["degrees", "slope"]),
    "large blocks": (mb.Contact(mb.HalfPlane(replace(SOLID, ell=3.0)), CYLINDER, LAW), 1.0, ["larger"]),
    # the obstacle touches between two nodes at most: no zone is wide enough to be seen
    "no node": (PROBLEMS["uniform"], 1e-3, ["only 0 nodes in contact"]),
    "few nodes": (COARSE, 1.0, [r"only \d nodes in contact and no error estimate.*ask for rtol="]),
    "few uniform nodes": (PROBLEMS["uniform"], 1.0, [r"only \d nodes in contact and no.*smaller h"]),
    "many nodes": (mb.Contact(on_ground(SOLID, 0.05, 2), CYLINDER, LAW), 1.0, []),
}


@pytest.mark.parametrize("name", WARNED)
def test_a_state_warns_of_what_it_cannot_see(name):
    problem, load, words = WARNED[name]
    told = problem.solve(load=load).warnings
    assert all(any(re.search(word, text) for text in told) for word in words) and bool(words) == bool(told)


# errors


@pytest.mark.parametrize(
    "failure",
    [
        mb.BadArgument("R", -1, "must be positive"),
        mb.NotConverged("no luck", reached=0.2, rtol_reached=0.1, iterations=3),
        mb.MissingExtra("explore()", "ipywidgets", "notebook"),
    ],
)
def test_errors_come_back_from_other_processes(failure):
    """Of BadArgument a raw TypeError came back: it was made anew of its message alone."""
    for back in (pickle.loads(pickle.dumps(failure)), copy.copy(failure)):
        assert type(back) is type(failure) and str(back) == str(failure) and vars(back) == vars(failure)


def test_unknown_zones_and_corners_are_refused_by_name():
    state = PROBLEMS["cells"].solve(load=0.1)
    for table, name in ((state.zones, "zone"), (state.pressures, "corner")):
        with pytest.raises(mb.BadArgument, match=f"^{name} = 'Z': must be one of"):
            table["Z"]
        assert table.get("Z") is None and pickle.loads(pickle.dumps(table)).keys() == table.keys()


# the same problem, given in another way


def pressed(obstacle=CYLINDER, law=LAW, method=None, body=GROUND, load=1.0, rtol=None):
    return mb.Contact(body, obstacle, law, method).solve(load=load, rtol=rtol)


def writes(x):
    x *= x
    return x / 20


def tilts(x):
    x *= 0.01
    return x


def circle(x):
    return np.where(np.abs(x) < 10, 10 - np.sqrt(np.maximum(100 - x**2, 0)), np.inf)


class Named(Law):
    """Microblocks with other names of corners."""

    arms, places = LAW.arms, LAW.places

    def __init__(self, corners):
        self.corners = corners


def waved(sign):
    return lambda x: 0.01 * (1 - sign * np.cos(2 * np.pi * x))


LEVEL = mb.Obstacle.from_samples([-1, 1], [0, 0])
CELLS, PERIOD = mb.Cells(nodes=np.int16(64)), mb.HalfPlane(SOLID, period=1.0)
SAME = {  # one, other, relative difference of half-widths
    # (x/R)^2 = 0.0013 at the edge of the contact, a quarter of it in height, and two estimates below 1e-3
    "a circle": (lambda: pressed(circle), lambda: pressed(), 3e-3),
    # both to 1e-6, where zones differ by its square root next to the ends at most
    "level samples": (lambda: pressed(LEVEL, rtol=1e-6), lambda: pressed(mb.Punch(1.0), rtol=1e-6), 1e-6),
    "functions that write": (lambda: pressed(writes), lambda: pressed(lambda x: x**2 / 20), 1e-12),
    "rotations that write": (
        lambda: pressed(law=mb.Microblock(tilts)),
        lambda: pressed(law=mb.Microblock(lambda x: 0.01 * x)),
        1e-12,
    ),
    # 200^2 is 64 as an unsigned number of eight bits
    **{
        kind.__name__: (
            lambda kind=kind: pressed(mb.Cylinder(kind(200)), load=kind(100)),
            lambda: pressed(mb.Cylinder(200.0), load=100.0),
            0,
        )
        for kind in (np.uint8, np.int16, np.float32)
    },
    "numbers of cells": (
        lambda: pressed(method=CELLS, load=np.int8(100)), lambda: pressed(method=CELLS, load=100.0), 0,
    ),
    # one begins at a valley, one at a peak: a zone over the end of a period is one, to a cell
    "begun elsewhere": (
        lambda: pressed(waved(1), LAW, mb.Cells(1024), PERIOD, 0.5),
        lambda: pressed(waved(-1), LAW, mb.Cells(1024), PERIOD, 0.5),
        5e-3,
    ),
    "corners of other names": (
        lambda: pressed(law=Named(("heel", "toe")), body=BODY),
        lambda: pressed(body=BODY), 0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SAME)
def test_a_problem_given_in_another_way_has_the_same_answer(name):
    one, other, close = SAME[name]
    one, other = one(), other()
    assert one.half_width == pytest.approx(other.half_width, rel=close, abs=0)
    assert len(one.zones["contact"]) == len(other.zones["contact"])
    assert name != "corners of other names" or one.zones["toe"] == other.zones["B"]


def test_what_a_user_gives_is_taken_as_it_is():
    kinked = np.vectorize(lambda x: x**2 / 20 if x > 0 else x**2 / 10)  # no otypes: fails for no points
    assert pressed(kinked).error_estimate <= 1e-3
    # an obstacle that ends, although its height goes on: contact points lie half a block further
    bounded = type("Bounded", (), {"ends": (-0.3, 0.3), "height": lambda self, x: x**2})()
    state = pressed(bounded, load=100.0)
    assert np.ravel(state.zones["contact"])[[0, -1]] == pytest.approx([-0.35, 0.35], rel=1e-9)


# first touch


@pytest.mark.parametrize(
    "obstacle, law, places",
    [
        (CYLINDER, LAW, {"A": 0.05, "B": -0.05}),
        (lambda x: (x - 0.1) ** 2 / 20, LAW, {"A": 0.15, "B": 0.05}),
        (mb.Wedge(0.02), LAW, {"A": 0.05, "B": -0.05}),
        (CYLINDER, LINE, {"contact": 0.0}),
        (mb.Punch(0.5, tilt=0.001), LINE, {"contact": -0.5}),
        (mb.Punch(0.5), LINE, {"contact": 0.0}),
    ],
    ids=["cylinder", "callable", "wedge", "unilateral", "tilted", "flat"],
)
def test_first_touch_is_where_the_gap_is_least(obstacle, law, places):
    events = mb.Contact(GROUND, obstacle, law).path(load=0.02).events
    born = [(event.zone, event.x) for event in events if event.load == 0]
    for zone, x in places.items():
        # root of rounding in a parabola's gap
        assert [place for name, place in born if name == zone] == pytest.approx([x], abs=1e-7)
    contact = sorted(x for zone, x in born if zone == "contact")
    assert contact == pytest.approx(sorted(places.values()), abs=1e-7)


def test_up_to_four_zones_are_told_one_by_one():
    told = [intervals([(2 * i, 2 * i + 0.5) for i in range(count)]) for count in (0, 4, 5)]
    assert told == ["none", "[0, 0.5], [2, 2.5], [4, 4.5], [6, 6.5]", "5 intervals, 2.5 together"]


def test_corners_that_touch_are_those_with_a_force():
    """Of a plane state: at its edges one of two, in its middle both."""
    state = pressed(CYLINDER, load=1.0)
    assert np.array_equal(state.closed, sum(1 * (own > 0) for own in state.pressures.values()))
    assert set(state.closed) == {1, 2}
