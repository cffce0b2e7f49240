"""What states, paths and pictures say is true, and problems given in another way have the same answers."""

import copy
import pickle
import re
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

import microblock as mb
from microblock import errors
from microblock.fem import meshes
from microblock.fem.meshes import Ground
from microblock.model.law import Law
from microblock.model.results import intervals
from microblock.view import blocks
from tests.bodies import on_ground, quarter
from tests.parts import BLOCKS, CYLINDER, SOLID, UNILATERAL

GROUND = mb.HalfPlane(SOLID)
RUBBING = mb.Unilateral(friction=0.3)


BODY, SPACE = on_ground(SOLID, 1.0, 1), quarter(SOLID)
PROBLEMS = {
    "panels": mb.Contact(GROUND, CYLINDER, BLOCKS),
    "cells": mb.Contact(GROUND, CYLINDER, BLOCKS, mb.Cells(nodes=64, window=(-1, 1))),
    "fitted": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, BLOCKS, mb.Fitted(order=2)),
    "uniform": mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, BLOCKS, mb.Uniform(h=0.2)),
    "condensed": mb.Contact(BODY, CYLINDER, BLOCKS),
    "newton": mb.Contact(BODY, CYLINDER, BLOCKS, mb.Newton()),
    "half-space": mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(1.0), BLOCKS, mb.Cells(nodes=32)),
    "in space": mb.Contact(SPACE, mb.Sphere(10.0), BLOCKS),
    "in space by Newton": mb.Contact(SPACE, mb.Sphere(10.0), BLOCKS, mb.Newton()),
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
        state = replace(state, notes=("cells are few",))
    above = " ".join(state.plot().get_suptitle().split())
    assert state.warnings
    for text in state.warnings:
        assert text in str(state) and text in above


def test_warnings_of_a_history_are_those_of_its_states_once_each():
    history = mb.Contact(BODY, CYLINDER, RUBBING).history([(0.01, 0.0), (0.01, 0.001)])
    assert history.warnings == history.states[0].warnings == history.states[1].warnings
    assert history.warnings and all(text in str(history) for text in history.warnings)


STEEP = mb.HalfPlane(mb.Cosserat(E=2, nu=0.3, beta=1, ell=0.1))
COARSE = mb.Contact(on_ground(SOLID, 0.25, 2), CYLINDER, BLOCKS)
WARNED = {  # problem, load, words of its warnings
    "small strain": (PROBLEMS["panels"], 1.0, []),
    "steep": (mb.Contact(STEEP, mb.Cylinder(1.0), mb.Microblock(0.2)), 1.0, ["degrees", "slope"]),
    "large blocks": (mb.Contact(mb.HalfPlane(replace(SOLID, ell=3.0)), CYLINDER, BLOCKS), 1.0, ["larger"]),
    # the obstacle touches between two nodes at most: no zone is wide enough to be seen
    "no node": (PROBLEMS["uniform"], 1e-3, ["only 0 nodes in contact"]),
    "few nodes": (COARSE, 1.0, [r"only \d nodes in contact and no error estimate.*ask for rtol="]),
    "few uniform nodes": (PROBLEMS["uniform"], 1.0, [r"only \d nodes in contact and no.*smaller h"]),
    "many nodes": (mb.Contact(on_ground(SOLID, 0.05, 2), CYLINDER, BLOCKS), 1.0, []),
}


@pytest.mark.parametrize("name", WARNED)
def test_a_state_warns_of_what_it_cannot_see(name):
    problem, load, words = WARNED[name]
    warnings = problem.solve(load=load).warnings
    assert all(any(re.search(word, text) for text in warnings) for word in words) and bool(words) == bool(
        warnings
    )


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


def test_a_state_is_taken_apart_by_dataclasses():
    """Its mappings could not be copied: a TypeError."""
    state = PROBLEMS["panels"].solve(load=0.1)
    parts = asdict(state)
    assert parts["pressures"]["A"].tolist() == state.pressures["A"].tolist()
    assert parts["zones"] == state.zones
    assert errors.Named([("A", 1)], "corner") == errors.Named({"A": 1}, "corner") == {"A": 1}


def test_a_note_leaves_what_was_evaluated():
    """Fields and energy were evaluated again for each note."""
    state = PROBLEMS["panels"].solve(load=0.1)
    psi = state.psi
    energy = state.energy
    noted = state.noting("a note")
    assert noted.psi is psi and vars(noted)["energy"] == energy
    assert noted.warnings == [*state.warnings, "a note"]


def test_unknown_zones_and_corners_are_refused_by_name():
    state = PROBLEMS["cells"].solve(load=0.1)
    for table, name in ((state.zones, "zone"), (state.pressures, "corner")):
        with pytest.raises(mb.BadArgument, match=f"^{name} = 'Z': must be one of"):
            table["Z"]
        assert table.get("Z") is None and pickle.loads(pickle.dumps(table)).keys() == table.keys()


# the same problem, given in another way


def pressed(obstacle=CYLINDER, law=BLOCKS, method=None, body=GROUND, load=1.0, rtol=None):
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

    arms, places = BLOCKS.arms, BLOCKS.places

    def __init__(self, corners):
        self.corners = corners


def waved(sign):
    return lambda x: 0.01 * (1 - sign * np.cos(2 * np.pi * x))


LEVEL = mb.Obstacle.from_samples([-1, 1], [0, 0])
CELLS = mb.Cells(nodes=np.int16(64))
PERIOD = mb.HalfPlane(SOLID, period=1.0)
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
        lambda: pressed(waved(1), BLOCKS, mb.Cells(1024), PERIOD, 0.5),
        lambda: pressed(waved(-1), BLOCKS, mb.Cells(1024), PERIOD, 0.5),
        5e-3,
    ),
    "corners of other names": (
        lambda: pressed(law=Named(("heel", "toe")), body=BODY),
        lambda: pressed(body=BODY), 0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SAME)
def test_a_problem_given_in_another_way_has_the_same_answer(name):
    state, expected, close = SAME[name]
    state, expected = state(), expected()
    assert state.half_width == pytest.approx(expected.half_width, rel=close, abs=0)
    assert len(state.zones["contact"]) == len(expected.zones["contact"])
    assert name != "corners of other names" or state.zones["toe"] == expected.zones["B"]


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
        (CYLINDER, BLOCKS, {"A": 0.05, "B": -0.05}),
        (lambda x: (x - 0.1) ** 2 / 20, BLOCKS, {"A": 0.15, "B": 0.05}),
        (mb.Wedge(0.02), BLOCKS, {"A": 0.05, "B": -0.05}),
        (CYLINDER, UNILATERAL, {"contact": 0.0}),
        (mb.Punch(0.5, tilt=0.001), UNILATERAL, {"contact": -0.5}),
        (mb.Punch(0.5), UNILATERAL, {"contact": 0.0}),
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
    texts = [intervals([(2 * i, 2 * i + 0.5) for i in range(count)]) for count in (0, 4, 5)]
    assert texts == ["none", "[0, 0.5], [2, 2.5], [4, 4.5], [6, 6.5]", "5 intervals, 2.5 together"]


def test_corners_that_touch_are_those_with_a_force():
    """Of a plane state: at its edges one of two, in its middle both."""
    state = pressed(CYLINDER, load=1.0)
    assert np.array_equal(state.closed, sum(1 * (forces > 0) for forces in state.pressures.values()))
    assert set(state.closed) == {1, 2}


# --- one Contact and one State for all bodies and methods in the plane: what every state has


LAWS = {
    "microblock": mb.Microblock(),
    "rotated": mb.Microblock(0.005),
    "unilateral": mb.Unilateral(),
    "microclamped": mb.Microclamped(),
}
DEPTH = CYLINDER.height(np.array([0.35]))[0]  # of the obstacle over the half-width: the size of the gaps


@cache
def body_of(kind):
    middle = {"u1": "middle", "u2": "middle"}
    if kind == "column":
        return mb.Body(meshes.column(depth=1.0, elements=4), SOLID, 4, fixed=middle, periodic=True)
    if kind == "line":
        return mb.Body(meshes.line(1.0, 4), SOLID, 4, fixed=middle)
    mesh = meshes.uniform(Ground(far=4.0, reach=(-0.6, 0.6), half=False), 0.12)
    return mb.Body(mesh, SOLID, 2, fixed="bottom")


def on_block(kind=None):
    return mb.Block(SOLID, 4.0), mb.Uniform(h=0.1, order=2, newton=kind and mb.Newton(kind))


KINDS = {  # body, method, rtol, residual that its iteration leaves, error of gaps over DEPTH, name
    "panels": (mb.HalfPlane(SOLID), None, 1e-4, 1e-5, 1e-5, "panels"),
    "cells": (mb.HalfPlane(SOLID), mb.Cells(nodes=512), None, 1e-8, 0.02, "cells"),
    "period": (mb.HalfPlane(SOLID, period=2.0), mb.Cells(nodes=512), None, 1e-8, 0.02, "cells"),
    "fitted": (mb.Block(SOLID, 4.0), None, 1e-2, 1e-11, 0.01, "fitted"),
    "unbounded": (mb.Block(SOLID), None, 1e-2, 1e-11, 0.01, "fitted"),
    "uniform": (*on_block(), None, 1e-11, 0.05, "uniform"),
    "uniform_al": (*on_block("al"), None, 1e-11, 0.05, "uniform"),
    "uniform_penalty": (*on_block("penalty"), None, 1e-11, 0.05, "uniform"),
    "condensed": ("body", None, None, 1e-11, 0.05, "condensed"),
    "newton_al": ("body", mb.Newton("al"), None, 1e-11, 0.05, "newton"),
    "newton_penalty": ("body", mb.Newton("penalty"), None, 1e-11, 0.05, "newton"),
    "column": ("column", None, None, 1e-11, 1e-9, "newton"),
    "line": ("line", None, None, 1e-11, 1e-9, "newton"),
}
NO_LEVEL = {"panels", "cells", "unbounded"}  # no approach
ONE_DIMENSIONAL = {"column", "line"}  # a plane presses them, all of the surface at once
EVERY = pytest.mark.parametrize("kind", KINDS)
EVERY_LAW = pytest.mark.parametrize("law", LAWS)


@cache
def problem_of(kind, law="microblock"):
    body, method, *_ = KINDS[kind]
    obstacle = mb.Plane() if kind in ONE_DIMENSIONAL else CYLINDER
    return mb.Contact(body_of(body) if isinstance(body, str) else body, obstacle, LAWS[law], method)


@cache
def state_of(kind, law="microblock"):
    load = 0.1 if kind in ONE_DIMENSIONAL else 1.0
    return problem_of(kind, law).solve(load=load, rtol=KINDS[kind][2])


def contains(intervals, x, margin=0.0):
    """Whether x, array (n,), lies in one of the intervals, by a margin."""
    inside = [(x >= a + margin) & (x <= b - margin) for a, b in intervals]
    return np.any([np.zeros(len(x), bool), *inside], axis=0)


@EVERY
@EVERY_LAW
def test_every_state_has_all_of_it(kind, law):
    state = state_of(kind, law)
    (_, _, rtol, residual, _, method) = KINDS[kind]
    assert state.law is LAWS[law] and state.solid == SOLID and state.method == method
    for values in (state.weights, state.pressure, state.micromoment, state.psi):
        assert values.shape == state.x.shape and np.all(np.isfinite(values))
        with pytest.raises(ValueError, match="read-only"):
            values[:] = 7.0
    assert state.rotation.shape == state.x.shape
    assert tuple(state.pressures) == (("A", "B") if "A" in state.law.corners else ("C",))
    assert sum(state.pressures.values()) == pytest.approx(state.pressure)
    assert state.weights @ state.pressure == pytest.approx(state.load, rel=1e-11)  # Newton's residual
    assert 0 <= state.residual <= residual and state.iterations >= 1 and state.unknowns > 20
    assert isinstance(state.energy, float) and (state.approach is None) == (kind in NO_LEVEL)
    estimated = rtol is not None or state.method == "cells"
    assert (state.error_estimate is not None) == estimated
    assert not estimated or 0 < state.error_estimate < (rtol or 0.1)
    assert state.error_parts is None or state.error_parts.total == state.error_estimate
    assert state.surface().gaps.shape[0] == len(state.pressures)
    assert f"load {state.load:g}" in repr(state) and state.caption
    assert np.all(np.diff(state.x) > 0) and (law != "unilateral" or np.all(state.micromoment == 0))


@EVERY
@EVERY_LAW
def test_zones_are_those_of_the_whole_line(kind, law):
    state = state_of(kind, law)
    zones, contact = state.zones, state.zones["contact"]
    assert set(zones) == {"A", "B", "full", "contact"} and contact
    for intervals_of_zone in zones.values():
        edges = [edge for interval in intervals_of_zone for edge in interval]
        assert edges == sorted(edges) and {type(edge) for edge in edges} <= {float}
    assert state.half_width == (contact[-1][1] - contact[0][0]) / 2
    if len(state.pressures) == 1:
        assert not zones["A"] and not zones["B"] and not zones["full"]
    else:
        A, B, full, touching = (contains(zones[name], state.x) for name in ("A", "B", "full", "contact"))
        assert np.array_equal(touching, A | B) and np.array_equal(full, A & B)
    if LAWS[law].even and kind not in ONE_DIMENSIONAL:
        assert contact[0][0] == pytest.approx(-contact[-1][1], rel=1e-9)  # rounding
        assert 0.25 < state.half_width < 0.43
        # the left corner comes later on the left
        assert not zones["A"] or zones["A"][0][0] > zones["B"][0][0]
    if kind == "column":
        assert contact == [(0.0, pytest.approx(float(state.weights.sum())))]  # all of the period


@EVERY
@EVERY_LAW
def test_complementarity(kind, law):
    """Gaps are closed where a corner presses, open elsewhere; pressures at points are those at the nodes."""
    state, tolerance = state_of(kind, law), KINDS[kind][4] * DEPTH
    spacing = np.diff(state.x).max(initial=0.0)
    reach = min(1.2 * state.half_width, state.x[-1])
    x = state.x if kind in ONE_DIMENSIONAL else np.linspace(-reach, reach, 41) + 1e-6
    for corner, p in state.pressures.items():
        gap = state.gap_at(corner, x)
        closed_zones = state.zones["contact" if corner == "C" else corner]
        inside = contains(closed_zones, x, 0.0 if kind in ONE_DIMENSIONAL else 0.51 * spacing)
        assert gap.min() > -tolerance and np.abs(gap[inside]).max(initial=0.0) < tolerance
        beyond = ~contains(closed_zones, x, -1.01 * spacing)
        assert not state.pressure_at(x, corner)[beyond].any() and np.all(gap[beyond] > -tolerance / 10)
        middle = contains(closed_zones, state.x, 0.2 * state.half_width) if kind == "panels" else slice(None)
        at_nodes = state.pressure_at(state.x[middle], corner)
        assert at_nodes == pytest.approx(p[middle], abs=1e-4 * p.max() + 1e-12)
        moments = state.micromoment_at(state.x[middle]) / SOLID.ell  # at an edge between nodes it jumps
        assert moments == pytest.approx(
            state.micromoment[middle] / SOLID.ell, abs=0.01 * state.pressure.max()
        )
    total = sum(state.pressure_at(x, corner) for corner in state.pressures)
    assert state.pressure_at(x) == pytest.approx(total)


# --- pictures of states: corners that touch, rounding, captions (tests/frozen has curves, ticks and texts)


def on_mesh(block, law=BLOCKS):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom")
    return pressed(mb.Cylinder(2.0), law, body=body, load=0.05)


def panel(drawing, name):
    """The axes of a figure of a state that are called so."""
    names = "pressure", "micromoment", "gap", "turn", "zones", "blocks"
    return drawing.axes[names.index(name)]


def told(drawing):
    return " ".join(drawing.get_suptitle().split())


# states


@pytest.mark.parametrize("psi0_in", ["gaps and levers", "levers"])
def test_blocks_of_a_half_space_touch_the_sphere_in_the_row_that_is_shown(psi0_in):
    """Left corners alone, right ones, both and none; the height is that half a block beside the row."""
    state = pressed(
        mb.Sphere(10.0), mb.Microblock((0.0, -0.004), psi0_in), mb.Cells(128), mb.HalfSpace(SOLID)
    )
    surface, contact, where = blocks.section(state)
    shown = blocks.blocks(surface, blocks.window(SOLID.ell, contact))
    pressed_at = {name: surface.x[p > 0] for name, p in zip(surface.corners, surface.pressures)}
    assert pressed_at["A"].max() > pressed_at["B"].max() and pressed_at["A"].min() > pressed_at["B"].min()
    x2 = float(where.split()[-1])
    assert {*map(tuple, shown.closed.tolist())} == {(a, b) for a in (False, True) for b in (False, True)}
    for corner in (0, 1):
        x, height = shown.squares[:, corner].T
        nearest = ((abs(x2) - SOLID.ell / 2) ** 2 + x**2) / 20  # of the two corners that one stands for
        over = shown.magnification * (nearest - state.approach) - height
        # heights are interpolated between rows of cells that are a ninth of a block wide
        assert np.all(np.abs(over[shown.closed[:, corner]]) < 0.02 * SOLID.ell)
        assert np.all(over[~shown.closed[:, corner]] > -0.02 * SOLID.ell)


def test_a_row_of_blocks_lies_in_one_square():
    """Between squares there are no cells, and what would be drawn there is neither surface nor obstacle."""
    hills = lambda x1, x2: (np.minimum((x1 - 1) ** 2, (x1 + 1) ** 2) + x2**2) / 20  # noqa: E731
    state = pressed(hills, BLOCKS, mb.Cells(64), mb.HalfSpace(SOLID), load=0.1)
    row, *_ = blocks.section(state)
    assert len(state.squares) == 2 and any(np.allclose(row.x, square.axes[0]) for square in state.squares)


def test_pictures_do_not_magnify_rounding(block):
    """Gaps of 1e-17 are nothing: all corners are marked; a law of one corner has no legend of two."""
    state = mb.Contact(on_mesh(block).problem.body, mb.Plane(), BLOCKS).solve(load=0.05)
    shown = blocks.blocks(state.surface(), blocks.window(state.solid.ell, state.zones["contact"]))
    assert shown.closed.all() and shown.magnification == 1.0
    figure = pressed(mb.Punch(0.3), UNILATERAL).plot()
    assert not panel(figure, "blocks").get_legend()
    shown = panel(figure, "gap").lines[1].get_ydata()
    assert not shown[np.isfinite(shown)].any()


# what stands in pictures and tables


def test_captions_say_what_is_shown_and_stay_within_their_figures():
    x = np.linspace(-1, 1, 5)
    levers = mb.Microblock(-0.001234, psi0_in="levers")
    state = pressed(mb.Obstacle.from_samples(x, x**2 / 20), levers, load=0.1234, rtol=1e-2)
    assert state.caption.startswith("Samples(5 points), Microblock(psi0=-0.001234, psi0_in=")
    assert "load 0.1234, error " in state.caption and told(state.plot()).startswith(state.caption)
    assert "no error estimate" in pressed(method=mb.Panels(order=8)).caption
    drawing = state.plot_below()
    drawing.draw_without_rendering()
    box = drawing._suptitle.get_window_extent()
    assert len(state.caption) > 80 and box.x0 >= 0 and box.x1 <= drawing.bbox.width
    samples = mb.Obstacle.from_samples([-1.0, -0.4, 0.4, 1.0], [0.03, 0.0, 0.0, 0.03])
    drawing = pressed(samples, UNILATERAL).plot_blocks()
    drawing.draw_without_rendering()  # matplotlib breaks no line itself, which the layout would not know of
    assert drawing._suptitle._get_wrapped_text() == drawing.get_suptitle()


def test_a_picture_says_why_blocks_overlap():
    """Those beside a contact turn towards each other; below a flat face away from each other."""
    for obstacle, law, overlap in ((CYLINDER, BLOCKS, True), (mb.Punch(0.5), UNILATERAL, False)):
        (axis,) = pressed(obstacle, law).plot_blocks().axes
        assert ("sides overlap" in axis.get_title(loc="left")) == overlap


def test_blocks_of_two_bodies_touch_where_they_are_pressed():
    """The obstacle is drawn with what the second body moves, on the surface of the first: to what a sphere
    rises below half a block, 5e-6, and to rounding of gaps; the approach is 0.03.
    """
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.02)
    ball = mb.Deformable(mb.HalfSpace(solid), mb.Sphere(10.0))
    state = pressed(ball, body=mb.HalfSpace(solid), method=mb.Cells(nodes=32))
    surface, _, _ = blocks.section(state)
    both_press = surface.pressures.min(axis=0) > 0
    assert both_press.sum() > 10
    np.testing.assert_allclose((surface.obstacle + surface.displacement)[both_press], 0, atol=2e-5)
