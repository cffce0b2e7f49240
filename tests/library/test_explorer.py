"""A session of sliders as its user sees it: states, pictures, what is offered, and what is refused."""

import numpy as np
import pytest

import microblock as mb
from microblock.view.explorer import Explorer, Panel

R, LOAD = 10.0, 1.0
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW, WINDOW = mb.Microblock(0.001), (-1.5, 1.5)


def problem(law=LAW, obstacle=mb.Cylinder(R), method=None, body=mb.HalfPlane(SOLID)):
    return mb.Contact(body, obstacle, law, method)


def on_mesh(block, law=LAW):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom")
    return mb.Contact(body, mb.Cylinder(2.0), law)


def periodic(obstacle=mb.Wave(0.01, 1.0), nodes=None):
    return problem(obstacle=obstacle, method=mb.Cells(nodes=nodes), body=mb.HalfPlane(SOLID, period=1.0))


# steps of the sliders, load over the first, and what both states may differ by
STEPS = [
    {"load": 1.1}, {"psi0": -0.002}, {"R": 1.1}, {"ell": 1.5}, {"law": "unilateral"},
    {"law": "microclamped"}, {"load": 1.0}, {"law": "microblock"}, {"psi0": 0.004},
]  # fmt: skip
SESSIONS = {  # problem of a mesh, load, rtol, what both states may differ by in half-width or approach
    # an edge is wrong by about the square of the pressure's relative error, and what that is next to a birth
    "panels": (lambda block: problem(), LOAD, None, 2e-3),
    "panels of an order": (lambda block: problem(method=mb.Panels(order=8)), LOAD, None, 1e-6),
    "fitted": (lambda block: problem(body=mb.Block(SOLID, 18.0)), LOAD, 1e-2, 5e-3),
    # on a mesh both solve the same finite problem, cells to a residual or to 1e-2
    "body": (on_mesh, 0.05, None, 1e-9),
    "cells": (lambda block: problem(method=mb.Cells(window=WINDOW)), LOAD, None, 1e-2),
    "cells of a number": (lambda block: problem(method=mb.Cells(256, WINDOW)), LOAD, None, 1e-6),
    "periodic": (lambda block: periodic(), LOAD, None, 1e-2),
    "rough": (lambda block: periodic(mb.Rough(period=1.0, slope=0.1), 512), LOAD, None, 1e-6),
}


@pytest.mark.parametrize("kind", SESSIONS)
def test_states_of_sliders_are_those_of_problems_asked_afresh(block, kind):
    make, load, rtol, close = SESSIONS[kind]
    session = Explorer(make(block), load, **({"rtol": rtol} if rtol else {}))
    first = dict(session.choice)
    for changes in STEPS:
        (name, value), choice = *changes.items(), session.choice
        if name not in choice:  # no R
            continue
        value = value * {"psi0": 1.0}.get(name, first.get(name)) if name != "law" else value
        state = session.update(**{name: value})
        fresh = session.problem.solve(load=session.choice["load"], rtol=rtol)
        assert session.choice[name] == value
        assert state.load == pytest.approx(
            session.choice["load"], rel=1e-12
        )  # of cells the sum of their forces
        assert state.solid.ell == session.choice["ell"]
        assert state.half_width == pytest.approx(fresh.half_width, rel=close)
        assert (state.error_estimate is None) == (kind in ("body", "panels of an order"))
        assert kind not in ("panels", "fitted", "cells", "periodic") or state.error_estimate <= 1e-2
    assert session.png().startswith(b"\x89PNG")


def test_an_rtol_refines_a_mesh_for_the_first_state(block):
    """Afterwards states are those of that mesh, without an estimate."""
    session = Explorer(on_mesh(block), 0.05, 1e-2)
    assert session.state.error_estimate <= 1e-2
    assert session.update(load=0.06).unknowns == session.state.unknowns > on_mesh(block).solve(0.05).unknowns


def test_refused_parameters_leave_the_session_as_it_was():
    session = Explorer(problem(), LOAD)
    before = session.choice, session.state
    for wrong in ({"load": -1.0}, {"law": "glue"}, {"ell": float("nan")}, {"psi0": 1.5}):
        with pytest.raises(mb.BadArgument, match=f"^{[*wrong][0]}"):
            session.update(**wrong)
    assert (session.choice, session.state) == before
    with pytest.raises(mb.BadArgument, match="R .*it has ell, law, load, psi0"):
        Explorer(problem(obstacle=mb.Wedge(0.02)), LOAD).update(R=2.0)
    with pytest.raises(mb.BadArgument, match="^friction .*history"):
        Explorer(problem(mb.Unilateral(friction=0.3)), LOAD)


def test_pictures_of_a_session_show_what_a_state_shows_afresh():
    """Their figure is kept: nothing of earlier states may be left in it, and numbers stay inside."""
    session = Explorer(problem(), LOAD)
    for changes in ({}, {"load": 0.05}, {"psi0": 0.05}, {"law": "unilateral"}, {"law": "microblock"}):
        state = session.update(**changes)
        session.png()
        (drawing, _), fresh = session._drawings[type(state.law)], state.plot()
        fresh._repr_png_()
        assert drawing.get_suptitle() == fresh.get_suptitle()
        for now, then in zip(drawing.axes, fresh.axes, strict=True):
            for ends in ("get_xlim", "get_ylim"):  # to rounding of the margins
                assert getattr(now, ends)() == pytest.approx(getattr(then, ends)(), rel=1e-12)
            for kind in ("lines", "collections", "texts"):
                assert len(getattr(now, kind)) == len(getattr(then, kind))
            for one, other in zip(now.lines, then.lines, strict=True):
                np.testing.assert_array_equal(one.get_xydata(), other.get_xydata())
            assert bool(now.get_legend()) == bool(then.get_legend())
        inches = drawing.get_tightbbox()
        assert inches.x0 >= 0 and inches.x1 <= drawing.get_figwidth() + 0.05  # a letter is as wide


def panel_of(start, load=LOAD):
    return Panel(Explorer(start, load), pytest.importorskip("ipywidgets"))


def test_sliders_move_the_session_and_its_pictures():
    panel = panel_of(problem())
    picture, table = panel.picture.value, panel.table.value
    panel.controls["load"].value = 1.3
    assert panel.explorer.state.load == pytest.approx(1.3)
    assert panel.picture.value != picture and panel.table.value != table
    panel.controls["psi0"].value = 0.01
    assert panel.explorer.state.law.psi0 == 0.01
    panel.controls["law"].value = "unilateral"
    assert panel.explorer.state.law == mb.Unilateral()


def test_a_state_that_is_not_found_is_told_and_the_picture_stays():
    small = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-8))
    panel = panel_of(problem(mb.Unilateral(), body=small))
    picture, state = panel.picture.value, panel.explorer.state
    panel.controls["law"].value = "microblock"  # whose blocks are too many
    assert "take a larger ell" in panel.told.value
    assert panel.picture.value == picture and panel.explorer.state is state


def test_a_solid_without_blocks_offers_neither_their_side_nor_another_law():
    explorer = Explorer(
        mb.Contact(mb.HalfPlane(mb.Elastic(100, 0.3)), mb.Cylinder(10.0), mb.Unilateral()), 1.0
    )
    assert set(explorer.choice) == {"load", "R"}
    first = explorer.state.half_width
    assert explorer.update(R=5.0).half_width < first


def test_sliders_of_small_loads_move():
    panel = panel_of(problem(mb.Unilateral()), 1e-9)
    panel.controls["load"].value = 2e-9
    assert panel.explorer.state.load == pytest.approx(2e-9)
