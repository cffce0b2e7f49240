"""What states, paths and obstacles of every kind are called by, what they say of themselves, and what leaves as CSV."""

import math
from dataclasses import replace

import numpy as np
import pytest

import microblock as mb
from microblock import meshes, surface_view
from microblock.display import call
from microblock.observables import contact_zones, lowest
from microblock.state_figure import BlocksFigure, StateFigure, unbounded
from microblock.study import read_records

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
HALF, HERTZ = mb.HalfPlane(SOLID), math.sqrt(4*10/(math.pi*SOLID.E_star))


def line(obstacle=mb.Cylinder(R=10), law=mb.Microblock()):
    return mb.Contact(HALF, obstacle, law)


def body(height=0.25):
    mesh = meshes.uniform(mb.Ground(far=2.0, reach=(-1.0, 1.0), half=False), height)
    return mb.Contact(mb.Body(mesh, SOLID, order=2, fixed="bottom"), mb.Cylinder(R=10), mb.Microblock())


def uniform(h):
    return mb.UniformContact(SOLID, mb.Cylinder(R=10), mb.Microblock(), domain=8.0, h=h, reach=0.8)


STATES = {"line": lambda: line().at(1.0), "cells": lambda: mb.GridContact(HALF, mb.Cylinder(R=10), mb.Microblock(),
                                                                         window=(-1, 1)).at(1.0, nodes=512),
          "fitted": lambda: mb.FittedContact(SOLID, mb.Cylinder(R=10), mb.Microblock(), domain=8.0).at(1.0, rtol=1e-2),
          "uniform": lambda: uniform(0.02).states([1.0])[0], "body": lambda: body(0.05).at(1.0)}


@pytest.mark.parametrize("kind", STATES)
def test_states_of_every_kind_go_by_the_same_names(kind):
    state = STATES[kind]()
    contact = state.named_zones["contact"]
    assert set(state.named_zones) == {"A", "B", "full", "contact"}
    assert all(type(edge) is float for zones in state.named_zones.values() for pair in zones for edge in pair)
    assert type(state.half_width) is float and state.half_width == (contact[-1][1] - contact[0][0])/2
    # one scene but for the body's finite size, 4 to 8 times the contact; a node stands for 0.025 at most
    assert state.half_width == pytest.approx(line().at(1.0).half_width, abs=0.03)
    assert (state.error_estimate is None) == (kind in ("uniform", "body"))
    assert state.named_zones["A"][0][0] > state.named_zones["B"][0][0]      # the left corner comes later on the left
    for name in ("half_width", "error_estimate", "named_zones"):
        assert name in surface_view.StateView.__doc__


def test_edges_are_plain_numbers():
    assert repr(contact_zones({0: np.array([(0.0, 1.0)]), 1: ()}, "AB")["A"]) == "[(0.0, 1.0)]"


def test_nothing_in_contact_has_no_width():
    state = mb.GridContact(HALF, mb.Cylinder(R=10), mb.Microblock(), window=(-1, 1)).at(approach=-1.0, nodes=64)
    assert state.half_width == 0.0 and state.named_zones["contact"] == []


@pytest.mark.parametrize("obstacle, law, places", [
    (mb.Cylinder(R=10), mb.Microblock(), {"A": 0.0425, "B": -0.0425}),
    (lambda x: (x - 0.1)**2/20, mb.Microblock(), {"A": 0.1425, "B": 0.0575}),
    (mb.Wedge(0.02), mb.Microblock(), {"A": 0.0425, "B": -0.0425}),
    (mb.Cylinder(R=10), mb.Unilateral(), {"contact": 0.0}),
    (mb.Punch(0.5, tilt=0.001), mb.Unilateral(), {"contact": -0.5}),
    (mb.Punch(0.5), mb.Unilateral(), {"contact": 0.0})], ids=["cylinder", "callable", "wedge", "unilateral", "tilted", "flat"])
def test_first_touch_is_where_the_gap_is_least(obstacle, law, places):
    first = [event for event in line(obstacle, law).load(0.02).events if event.load == 0]
    for zone, x in places.items():
        born = [event.x for event in first if event.zone == zone]
        assert born == pytest.approx([x], abs=1e-7)      # root of rounding in a parabola's gap
    contact = sorted(event.x for event in first if event.zone == "contact")
    assert contact == pytest.approx(sorted(places.values()), abs=1e-7)


def test_events_are_plain_numbers():
    for scene, last in ((line(), 0.1), (body(), 1.0)):
        events = scene.load(last).events
        assert {type(value) for event in events for value in (event.load, event.load_error, event.x)} == {float}
        assert "np." not in repr(events) and (scene != line() or "merged" in repr(events))


def test_lowest_points_are_told_from_flat_bottoms_and_ties():
    x = np.linspace(-1, 1, 10)      # the minimum of the first lies between two samples, equally far from both
    assert lowest(lambda x: x**2, x) == pytest.approx((0, 0), abs=1e-8)      # root of rounding
    assert lowest(lambda x: np.where(x < 0.3, np.inf, x), np.unique([*x, 0.3])) == (0.3, 0.3)
    assert lowest(lambda x: 0*x + 2, x) == (2.0, None)
    assert lowest(lambda x: np.cos(2*np.pi*x), x)[1] is None      # -1/2 and 1/2
    assert lowest(lambda x: np.maximum(np.abs(x), 1/9 + 1e-9), x)[1] is None      # flat between two samples


def test_rows_and_paths_come_back_from_csv(tmp_path):
    rows = [{"radius": 5.0, "law": "microblock", "half_width": np.float64(0.1), "error": None},
            {"radius": 10.0, "law": "unilateral", "half_width": 1/3, "error": None}]
    mb.to_csv(rows, tmp_path/"rows.csv")
    back = read_records(tmp_path/"rows.csv")
    assert [{name: row[name] for name in rows[0]} for row in back] == rows and back[0]["version_microblock"]
    for scene, last in ((line(), 0.1), (body(), 1.0)):
        path = scene.load(last)
        mb.to_csv(path, tmp_path/"events.csv")
        back = read_records(tmp_path/"events.csv")
        names = ("load", "load_error", "kind", "zone", "x")
        assert [tuple(row[name] for name in names) for row in back] == [tuple(getattr(event, name) for name in names)
                                                                       for event in path.events]


@pytest.mark.parametrize("wrong", [None, 3.0, "rows", [], [1, 2], {"load": 1.0}, line(), np.ones((2, 3)),
                                   [{"a": 1}, {"b": 2}]], ids=str)
def test_what_makes_no_table_is_refused_in_a_line(wrong, tmp_path):
    with pytest.raises(mb.BadArgument, match="must be a state, a load path, or a list|must have the columns") as refused:
        mb.to_csv(wrong, tmp_path/"wrong.csv")
    assert "\n" not in str(refused.value) and not list(tmp_path.iterdir())


def texts(drawing):
    return [text.get_text() for text in (drawing.texts + [drawing._suptitle] if drawing._suptitle else drawing.texts)]


def test_pictures_drawn_for_themselves_say_what_they_show(tmp_path):
    state, other = (line(mb.Wedge(0.02), law).at(1.0) for law in (mb.Microblock(0.001), mb.Unilateral()))
    assert state.caption == f"Wedge(slope=0.02), Microblock(psi0=0.001), load 1, error {state.error_estimate:.1g}"
    assert state.caption != other.caption
    for drawing in (state.plot(), state.plot_blocks()):
        assert state.caption in texts(drawing)
    assert f"{state.caption}\ncontact in black" in texts(state.plot_below())
    assert texts(mb.Explorer(line(), 1.0).figure.drawing) == []      # frames are drawn again and again: its table says it
    labels = [text.get_text() for text in BlocksFigure(("A", "B")).panel.axis.get_legend().get_texts()]
    assert labels == ["A (left) closed", "B (right) closed"]


def test_captions_stay_within_their_figures():
    x = np.linspace(-1, 1, 5)
    state = line(mb.Profile(x, x**2/20), mb.Microblock(-0.001234, "lever")).at(0.1234, rtol=1e-2)
    drawing = state.plot_below()
    drawing.draw_without_rendering()
    box = drawing._suptitle.get_window_extent()
    assert len(state.caption) > 80 and 0 <= box.x0 and box.x1 <= drawing.bbox.width


def test_captions_are_short():
    x = np.linspace(-1, 1, 100)
    assert call(mb.Profile(x, x**2)) == "Profile(x=100 numbers, z=100 numbers)"
    assert len(call(mb.Rough(period=1.0, slope=0.1))) <= 48 and call(mb.Microblock(-0.001234, "lever")).endswith("reading='lever')")
    assert call(np.cos) == "cos" and "no error estimate" in line().at(1.0, order=8).caption
    periodic = mb.GridContact(mb.PeriodicHalfPlane(SOLID, period=1.0), mb.Wave(0.01, 1.0), mb.Unilateral()).at(0.5, nodes=128)
    assert periodic.caption.startswith("Wave(amplitude=0.01, wavelength=1), Unilateral(), load 0.5, error ")


def test_axes_that_are_cut_say_so_and_where():
    def told(obstacle, law):
        return StateFigure(law.corners).update(line(obstacle, law).at(1.0))._cut["pressure"].get_text()

    assert told(mb.Punch(0.5), mb.Unilateral()) == "cut: unbounded at ±0.5"
    assert told(mb.Punch(0.5), mb.Microblock()) == "cut: unbounded at ±0.542, ±0.458"
    assert told(mb.Wedge(0.02), mb.Microblock()) == "cut: unbounded at ±0.0425"
    assert told(mb.Cylinder(R=10), mb.Microblock()) == ""
    state = line(mb.Profile(np.array([-2.0, -0.5, 0.5, 2.0]), np.array([0.05, 0.02, 0.0, 0.1])), mb.Unilateral()).at(0.1)
    assert state.half_width < 0.5 and unbounded(state) == [0.5]      # a kink out of contact counts for nothing
    assert unbounded(line(mb.Shape(lambda x: np.abs(x)**3, kinks=(0.0,))).at(1.0)) == []      # nor one of the curvature


@pytest.mark.parametrize("coarse, fine, advice", [(lambda: body().at(1.0), lambda: body(0.05).at(1.0), "ask for rtol="),
                                                  (lambda: uniform(0.1).states([1.0])[0], lambda: uniform(0.02).states([1.0])[0],
                                                   "smaller h")], ids=["body", "uniform"])
def test_few_nodes_without_an_estimate_are_warned_of(coarse, fine, advice):
    state = coarse()
    left, right = state.named_zones["contact"][0]
    number = np.count_nonzero((state.x >= left) & (state.x <= right))
    assert number < surface_view.FEWEST
    told = [text for text in state.warnings if "nodes in contact" in text]
    assert len(told) == 1 and told[0].startswith(f"only {number} nodes in contact and no error estimate") and advice in told[0]
    assert not any("nodes in" in text for text in fine().warnings)


def test_an_estimate_speaks_for_itself():
    state = body().at(1.0)
    assert any("nodes in" in text for text in state.warnings)
    assert not any("nodes in" in text for text in replace(state, error_estimate=0.1).warnings)


def test_help_tells_what_an_obstacle_may_have():
    for name in ("kinks", "jumps", "ends"):
        assert f"`{name}`" in mb.Contact.__doc__
    assert "radians" not in mb.Wedge.__doc__ and mb.Wedge(0.5).height(np.array([2.0])) == 1.0
