"""What states, paths and obstacles of every kind are called by, say of themselves, and give as CSV."""

from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from microblock.data.records import read_records
from microblock.errors import at_least
from microblock.fem import meshes
from microblock.fem.meshes import Ground
from microblock.model import state as model_state
from microblock.model.summary import call
from microblock.model.zones import contact_zones, lowest
from microblock.view.blocks import blocks, window
from microblock.view.explorer import Explorer
from microblock.view.state_figure import BlocksFigure, StateFigure, unbounded

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LEVERS = mb.Microblock(-0.001234, psi0_in="levers")
HALF = mb.HalfPlane(SOLID)


def line(obstacle=mb.Cylinder(R=10), law=mb.Microblock(), method=None):
    return mb.Contact(HALF, obstacle, law, method)


def body(height=0.25):
    mesh = meshes.uniform(Ground(far=2.0, reach=(-1.0, 1.0), half=False), height)
    return mb.Contact(mb.Body(mesh, SOLID, order=2, fixed="bottom"), mb.Cylinder(R=10), mb.Microblock())


def uniform(h):
    method = mb.Uniform(h=h, reach=0.8)
    return mb.Contact(mb.Block(SOLID, 8.0), mb.Cylinder(R=10), mb.Microblock(), method)


BLOCK = mb.Contact(mb.Block(SOLID, 8.0), mb.Cylinder(R=10), mb.Microblock())
STATES = {
    "line": lambda: line().solve(load=1.0),
    "cells": lambda: line(method=mb.Cells(nodes=512, window=(-1, 1))).solve(load=1.0),
    "fitted": lambda: BLOCK.solve(load=1.0, rtol=1e-2),
    "uniform": lambda: uniform(0.02).solve(load=1.0),
    "body": lambda: body(0.05).solve(load=1.0),
}


@pytest.mark.parametrize("kind", STATES)
def test_states_of_every_kind_go_by_the_same_names(kind):
    state = STATES[kind]()
    contact = state.zones["contact"]
    assert set(state.zones) == {"A", "B", "full", "contact"}
    assert all(type(edge) is float for zones in state.zones.values() for pair in zones for edge in pair)
    assert type(state.half_width) is float and state.half_width == (contact[-1][1] - contact[0][0]) / 2
    # one problem but for the body's finite size, 4 to 8 times the contact; a node stands for 0.025 at most
    assert state.half_width == pytest.approx(line().solve(load=1.0).half_width, abs=0.03)
    assert (state.error_estimate is None) == (kind in ("uniform", "body"))
    assert state.zones["A"][0][0] > state.zones["B"][0][0]  # the left corner comes later on the left
    for name in ("half_width", "error_estimate", "zones"):
        assert name in mb.State.__doc__


def test_edges_are_plain_numbers():
    assert repr(contact_zones({0: np.array([(0.0, 1.0)]), 1: ()}, "AB")["A"]) == "[(0.0, 1.0)]"


@pytest.mark.parametrize(
    "obstacle, law, places",
    [
        (mb.Cylinder(R=10), mb.Microblock(), {"A": 0.0425, "B": -0.0425}),
        (lambda x: (x - 0.1) ** 2 / 20, mb.Microblock(), {"A": 0.1425, "B": 0.0575}),
        (mb.Wedge(0.02), mb.Microblock(), {"A": 0.0425, "B": -0.0425}),
        (mb.Cylinder(R=10), mb.Unilateral(), {"contact": 0.0}),
        (mb.Punch(0.5, tilt=0.001), mb.Unilateral(), {"contact": -0.5}),
        (mb.Punch(0.5), mb.Unilateral(), {"contact": 0.0}),
    ],
    ids=["cylinder", "callable", "wedge", "unilateral", "tilted", "flat"],
)
def test_first_touch_is_where_the_gap_is_least(obstacle, law, places):
    first = [event for event in line(obstacle, law).path(load=0.02).events if event.load == 0]
    for zone, x in places.items():
        born = [event.x for event in first if event.zone == zone]
        assert born == pytest.approx([x], abs=1e-7)  # root of rounding in a parabola's gap
    contact = sorted(event.x for event in first if event.zone == "contact")
    assert contact == pytest.approx(sorted(places.values()), abs=1e-7)


def test_events_are_plain_numbers():
    for problem, last in ((line(), 0.1), (body(), 1.0)):
        events = problem.path(load=last).events
        numbers = [(event.load, event.load_error, event.x) for event in events]
        assert {type(value) for event in numbers for value in event} == {float}
        assert "np." not in repr(events) and (problem != line() or "merged" in repr(events))


def test_lowest_points_are_told_from_flat_bottoms_and_ties():
    x = np.linspace(-1, 1, 10)  # the minimum of the first lies between two samples, equally far from both
    assert lowest(lambda x: x**2, x) == pytest.approx((0, 0), abs=1e-8)  # root of rounding
    assert lowest(lambda x: np.where(x < 0.3, np.inf, x), np.unique([*x, 0.3])) == (0.3, 0.3)
    assert lowest(lambda x: 0 * x + 2, x) == (2.0, None)
    assert lowest(lambda x: np.cos(2 * np.pi * x), x)[1] is None  # -1/2 and 1/2
    assert lowest(lambda x: np.maximum(np.abs(x), 1 / 9 + 1e-9), x)[1] is None  # flat between two samples


def test_rows_and_paths_come_back_from_csv(tmp_path):
    rows = [
        {"radius": 5.0, "law": "microblock", "half_width": np.float64(0.1), "error": None},
        {"radius": 10.0, "law": "unilateral", "half_width": 1 / 3, "error": None},
    ]
    mb.to_csv(rows, tmp_path / "rows.csv")
    back = read_records(tmp_path / "rows.csv")
    assert [{name: row[name] for name in rows[0]} for row in back] == rows and back[0]["version_microblock"]
    for problem, last in ((line(), 0.1), (body(), 1.0)):
        path = problem.path(load=last)
        mb.to_csv(path, tmp_path / "events.csv")
        back = read_records(tmp_path / "events.csv")
        names = ("load", "load_error", "kind", "zone", "x")
        events = [tuple(getattr(event, name) for name in names) for event in path.events]
        assert [tuple(row[name] for name in names) for row in back] == events


def texts(drawing):
    title = [drawing._suptitle] if drawing._suptitle else []
    return [text.get_text() for text in drawing.texts + title]


def test_pictures_drawn_for_themselves_say_what_they_show(tmp_path):
    laws = mb.Microblock(0.001), mb.Unilateral()
    state, other = (line(mb.Wedge(0.02), law).solve(load=1.0) for law in laws)
    error = f"error {at_least(state.error_estimate)}"  # no smaller than it is
    assert state.caption == f"Wedge(slope=0.02), Microblock(psi0=0.001), load 1, {error}"
    assert state.caption != other.caption
    for drawing in (state.plot(), state.plot_blocks()):
        assert state.caption in texts(drawing)
    assert f"{state.caption}\ncontact in black" in texts(state.plot_below())
    # frames are drawn again and again: its table says it
    assert texts(Explorer(line(), 1.0).figure.drawing) == []
    labels = [text.get_text() for text in BlocksFigure(("A", "B")).panel.axis.get_legend().get_texts()]
    assert labels == ["A (left)", "B (right)", "both closed"]


def test_numbers_beside_the_colours_keep_apart():
    """Those beyond the colours would be drawn at their end, on the number that belongs there."""
    state = body().solve(load=0.5)
    for quantity in ("s22", "s11", "psi"):
        drawing = state.plot_below(quantity)
        drawing.draw_without_rendering()
        bar = drawing.axes[-1]
        places = np.sort([label.get_window_extent().y0 for label in bar.get_yticklabels()])
        assert len(places) >= 3 and np.diff(places).min() > 8, quantity  # pixels: a letter is as high
        low, high = bar.get_ylim()
        assert all(low - 1e-9 <= tick <= high + 1e-9 for tick in bar.get_yticks()), quantity


def test_captions_stay_within_their_figures():
    x = np.linspace(-1, 1, 5)
    state = line(mb.Obstacle.from_samples(x, x**2 / 20), LEVERS).solve(load=0.1234, rtol=1e-2)
    drawing = state.plot_below()
    drawing.draw_without_rendering()
    box = drawing._suptitle.get_window_extent()
    assert len(state.caption) > 80 and box.x0 >= 0 and box.x1 <= drawing.bbox.width


def test_captions_are_short():
    x = np.linspace(-1, 1, 100)
    assert call(mb.Obstacle.from_samples(x, x**2)) == "Samples(x=100 numbers, z=100 numbers)"
    assert len(call(mb.Rough(period=1.0, slope=0.1))) <= 48 and call(LEVERS).endswith("psi0_in='levers')")
    assert call(np.cos) == "cos"
    assert "no error estimate" in line(method=mb.Panels(order=8)).solve(load=1.0).caption
    half = mb.HalfPlane(SOLID, period=1.0)
    wave = mb.Contact(half, mb.Wave(0.01, 1.0), mb.Unilateral(), mb.Cells(nodes=128)).solve(load=0.5)
    assert wave.caption.startswith("Wave(amplitude=0.01, wavelength=1), Unilateral(), load 0.5, error ")


def test_blocks_have_the_fill_of_what_touches():
    """A alone, B alone, both and none are four fills, whatever the load."""
    state = line(mb.Cylinder(R=10), mb.Microblock(0.002)).solve(load=2.0)
    panel = StateFigure(("A", "B")).update(state).blocks
    shown = blocks(state.surface(window(state.solid.ell, state.zones["contact"])), state.zones["contact"])
    fills = [tuple(colour) for colour in panel._squares.get_facecolor()]
    assert len(fills) == len(shown.closed)
    found = {tuple(map(bool, closed)): fill for closed, fill in zip(shown.closed, fills)}
    assert len(found) == len({*found.values()}) == 4
    assert all(found[tuple(map(bool, closed))] == fill for closed, fill in zip(shown.closed, fills))


def test_a_micromoment_without_a_bound_is_told_as_the_pressure_is():
    """Also where the curve, which ends at its last point, fits the axis."""
    rotated = StateFigure(("A", "B")).update(line(mb.Wedge(0.02), mb.Microblock()).solve(load=1.0))
    assert rotated._cut["micromoment"].get_text().endswith("unbounded at ±0.0425")
    plain = StateFigure(mb.Unilateral().corners)
    plain.update(line(mb.Punch(0.5), mb.Unilateral()).solve(load=1.0))
    assert plain._cut["micromoment"].get_text() == ""  # there is none


def test_axes_that_are_cut_say_so_and_where():
    def told(obstacle, law):
        figure = StateFigure(law.corners).update(line(obstacle, law).solve(load=1.0))
        return figure._cut["pressure"].get_text()

    assert told(mb.Punch(0.5), mb.Unilateral()) == "cut: unbounded at ±0.5"
    assert told(mb.Punch(0.5), mb.Microblock()) == "cut: unbounded at ±0.542, ±0.458"
    assert told(mb.Wedge(0.02), mb.Microblock()) == "cut: unbounded at ±0.0425"
    assert told(mb.Cylinder(R=10), mb.Microblock()) == ""
    samples = mb.Obstacle.from_samples([-2.0, -0.5, 0.5, 2.0], [0.05, 0.02, 0.0, 0.1])
    state = line(samples, mb.Unilateral()).solve(load=0.1)
    # a corner out of contact counts for nothing
    assert state.half_width < 0.5 and unbounded(state) == [0.5]
    # nor a jump of the curvature
    assert unbounded(line(mb.Obstacle(lambda x: np.abs(x) ** 3, kinks=(0.0,))).solve(load=1.0)) == []


@pytest.mark.parametrize(
    "coarse, fine, advice",
    [(body(), body(0.05), "ask for rtol="), (uniform(0.1), uniform(0.02), "smaller h")],
    ids=["body", "uniform"],
)
def test_few_nodes_without_an_estimate_are_warned_of(coarse, fine, advice):
    state = coarse.solve(load=1.0)
    left, right = state.zones["contact"][0]
    number = np.count_nonzero((state.x >= left) & (state.x <= right))
    assert number < model_state.FEWEST
    told = [text for text in state.warnings if "nodes in contact" in text]
    assert len(told) == 1 and told[0].startswith(f"only {number} nodes in contact and no error estimate")
    assert advice in told[0]
    assert not any("nodes in" in text for text in fine.solve(load=1.0).warnings)


def test_an_estimate_speaks_for_itself():
    state = body().solve(load=1.0)
    assert any("nodes in" in text for text in state.warnings)
    assert not any(
        "nodes in" in text for text in mb.State(replace(state.solution, error_estimate=0.1)).warnings
    )


def test_help_tells_what_an_obstacle_may_have():
    for name in ("kinks", "jumps", "ends"):
        assert f"`{name}`" in mb.Contact.__doc__
    assert "radians" not in mb.Wedge.__doc__ and mb.Wedge(0.5).height(np.array([2.0])) == 1.0
