"""States, scenes and pictures as an interactive session sees them; no times here, `python -m cases frames` has those."""

import builtins
import dataclasses
import io

import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock import blocks, condensation, contact_line, refined, subsurface, widgets
from microblock.display import Row, Summary, html, intervals, number
from microblock.explorer import Explorer
from microblock.state_figure import StateFigure

R, LOAD = 10.0, 1.0


def solid(ell=0.085):
    return mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)


def scene(law=mb.Microblock(), ell=0.085, obstacle=mb.Cylinder(R)):
    return mb.Contact(mb.HalfPlane(solid(ell)), obstacle, law)


def rendered(drawing):
    from PIL import Image
    return np.asarray(Image.open(io.BytesIO(drawing._repr_png_())).convert("RGB")).astype(int)


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Microblock(0.01), mb.Unilateral(), mb.Microclamped()])
def test_surface_has_the_gaps_of_the_state_and_its_own_nodes(law):
    state = scene(law).at(LOAD)
    surface = state.surface()
    for corner in range(len(law.corners)):
        # the same integrals, once by levers and once by sinking and turning: rounding of gaps of some 1e-2
        assert surface.gaps[corner] == pytest.approx(state.gaps(corner, surface.x), abs=1e-12)
        assert surface.pressures[corner, np.isin(surface.x, state.x)] == pytest.approx(state.pressures[corner])
    assert not surface.pressures[:, ~np.isin(surface.x, state.x)].any()


def test_surfaces_of_panels_cells_and_meshes_agree():
    law = mb.Microblock(0.005)
    line = scene(law).at(LOAD, rtol=1e-6)
    cells = mb.GridContact(mb.HalfPlane(solid()), mb.Cylinder(R), law, window=(-0.6, 0.6)).at(LOAD, nodes=2000)
    mesh = mb.FittedContact(solid(), mb.Cylinder(R), law).at(LOAD, rtol=1e-3)
    x = np.linspace(-0.45, 0.45, 91)
    for other in (cells, mesh):
        for name in ("gaps", "turn"):
            rows = [np.atleast_2d(getattr(state.surface((-0.6, 0.6)), name)) for state in (line, other)]
            places = [state.surface((-0.6, 0.6)).x for state in (line, other)]
            own, others = ([np.interp(x, place, row) for row in values] for place, values in zip(places, rows))
            # polygons through points some 0.02 apart bend by 0.02^2/(8 R) = 5e-6 of gaps up to 4e-3, as the cells' 1/n
            assert np.max(np.abs(np.subtract(own, others))) < 4e-3*np.max(np.abs(own)), name


def test_a_corner_touches_in_the_picture_where_its_gap_is_closed():
    state = scene().at(LOAD)
    surface = state.surface()
    shown = blocks.blocks(surface, state.named_zones["contact"])
    assert shown.closed.any(axis=0).all() and not shown.closed.all()
    for corner in (0, 1):
        tips, centres = shown.squares[:, corner], shown.squares[:, :2].mean(axis=1)
        over = shown.magnification*(tips[:, 0]**2/(2*R) - state.approach) - tips[:, 1]
        # heights are interpolated between points of the surface: a thousandth of the side of a block is not seen
        expected = shown.magnification*np.interp(centres[:, 0], surface.x, surface.gaps[corner])
        assert over == pytest.approx(expected, abs=1e-3*surface.ell)
        assert np.all(over[shown.closed[:, corner]] < 1e-3*surface.ell)
    outer = np.linalg.norm(shown.squares[:, 0] - shown.squares[:, 1], axis=1)
    inner = np.linalg.norm(shown.squares[:, 1] - shown.squares[:, 2], axis=1)
    assert inner == pytest.approx(np.full(len(inner), surface.ell)) and np.all(outer >= surface.ell)


def test_every_kind_of_state_shows_and_draws_itself(block, tmp_path):
    law = mb.Microblock(0.002)
    body = mb.Contact(mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=2, fixed="bottom"), mb.Cylinder(2.0), law)
    periodic = mb.GridContact(mb.PeriodicHalfPlane(solid(), period=1.0), mb.Wave(0.01, 1.0), mb.Unilateral())
    states = [scene(law).at(LOAD), scene(mb.Unilateral(), obstacle=mb.Punch(0.3)).at(LOAD),
              mb.FittedContact(solid(), mb.Cylinder(R), mb.Microclamped()).at(LOAD, rtol=1e-2), body.at(0.05),
              periodic.at(0.5, nodes=256)]
    for state in states:
        assert len(repr(state)) < 150 and repr(state) == str(state)
        assert "force per thickness" in state._repr_html_() and "error estimate" in state._repr_html_()
        # lines and letters on white; nothing of it can be drawn from numbers that are none
        assert (rendered(state.plot()).min(axis=2) < 200).mean() > 0.01
    states[0].plot_blocks(tmp_path/"blocks.png")
    assert (tmp_path/"blocks.png").stat().st_size > 10_000
    for each in (body, periodic, scene(), solid(), scene().load(LOAD), mb.HalfPlane(solid())):
        assert "<table" in each._repr_html_() and len(str(each)) < 250


def test_fields_below_are_drawn_and_unknown_ones_refused(tmp_path):
    state = scene().at(LOAD)
    state.plot_below("psi", tmp_path/"psi.png")
    assert (tmp_path/"psi.png").stat().st_size > 10_000
    with pytest.raises(mb.BadArgument, match="quantity.*psi, s22"):
        state.plot_below("pressure")


@pytest.mark.parametrize("quantity", ["psi", "skew", "shear"])
def test_fields_of_bodies_are_drawn_below_as_well(block, quantity):
    state = on_mesh(block, mb.Microblock()).at(0.05)
    assert (rendered(state.plot_below(quantity)).min(axis=2) < 200).mean() > 0.1      # colours, and not an empty box
    cells = others(block, mb.Microblock())["cells"][0].at(LOAD, nodes=256)
    with pytest.raises(mb.BadArgument, match="cells have no fields"):
        cells.plot_below(quantity)


def test_pictures_do_not_magnify_rounding_nor_name_corners_that_a_law_has_not():
    figure = StateFigure(mb.Unilateral().corners).update(scene(mb.Unilateral(), obstacle=mb.Punch(0.3)).at(LOAD))
    assert figure.axes["gap"].get_ylim()[1] == 1.0 and figure.axes["blocks"].get_legend() is None      # closed gaps: 1e-17
    assert StateFigure(mb.Microblock().corners).axes["blocks"].get_legend() is not None


def test_warnings_where_small_strain_ends():
    assert scene().at(LOAD).warnings == []
    steep = mb.Contact(mb.HalfPlane(mb.Cosserat(E=2, nu=0.3, beta=1, ell=0.1)), mb.Cylinder(1.0), mb.Microblock(0.2)).at(1.0)
    assert [word for word in ("degrees", "slope") if any(word in text for text in steep.warnings)] == ["degrees", "slope"]
    assert "&#9888;" in steep._repr_html_()
    assert any("larger" in text for text in scene(ell=3.0).at(LOAD).warnings)


def test_tables_take_text_as_text():
    summary = Summary("<b>", "a & b", (Row("<i>", "&ell;", 1/3, "m<sup>"),), ("<script>",))
    assert "<script>" not in html(summary) and "&lt;b&gt;" in html(summary) and "0.3333" in html(summary)
    assert number(None) == "-" and number(3) == "3" and intervals([]) == "none"
    assert intervals([(k, k + 0.5) for k in range(6)]) == "6 intervals, 3 together"


SWEEPS = [("load", np.linspace(0.5, 1.5, 5)), ("psi0", np.linspace(-0.02, 0.02, 6)), ("radius", (10.0, 9.0, 30.0)),
          ("alpha", (0.25, 0.3, 1.2, 0.1)), ("law", ("unilateral", "microclamped", "microblock"))]


@pytest.mark.parametrize("name, values", SWEEPS, ids=[name for name, _ in SWEEPS])
def test_states_of_sliders_are_those_of_scenes_asked_afresh(name, values):
    session = Explorer(scene(mb.Microblock(0.001)), LOAD)
    for value in values:
        state = session.update(**{name: value})
        fresh = session.scene.at(session.choice.load)
        assert getattr(session.choice, name) == value
        for zone, own in fresh.named_zones.items():
            # an edge is wrong by about the square of the pressure's relative error, 1e-3, and what that is next to a birth
            assert np.ravel(state.named_zones[zone]) == pytest.approx(np.ravel(own), abs=2e-3*fresh.x[-1]), zone
        assert state.error_estimate <= 1e-3


def on_mesh(block, law):
    return mb.Contact(mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom"), mb.Cylinder(2.0), law)


def others(block, law):
    """{kind: (scene, load)} that are not half-planes on panels."""
    cells = mb.GridContact(mb.HalfPlane(solid()), mb.Cylinder(R), law, window=(-1.5, 1.5))
    periodic = mb.GridContact(mb.PeriodicHalfPlane(solid(), period=1.0), mb.Wave(0.01, 1.0), law)
    return {"body": (on_mesh(block, law), 0.05), "cells": (cells, LOAD), "periodic": (periodic, LOAD)}


@pytest.mark.parametrize("kind", ["body", "cells", "periodic"])
def test_sessions_on_meshes_and_cells_answer_as_their_scenes_do(block, kind):
    start, load = others(block, mb.Microblock(0.001))[kind]
    session = Explorer(start, load)
    for changes in ({"load": 1.1*load}, {"psi0": -0.002}, {"radius": 11.0}, {"alpha": 0.5}, {"law": "unilateral"},
                    {"law": "microclamped"}, {"load": load}, {"law": "microblock"}):
        if session.choice.radius is None and "radius" in changes:
            continue
        state = session.update(**changes)
        fresh = session.scene.at(session.choice.load)
        # on a mesh or on equal cells both solve the same finite problem, cells to a residual of 2e-5; else both are good to 1e-2
        tolerance = 1e-9 if kind == "body" else 1e-4 if len(fresh.x) == len(state.x) else 1e-2
        assert state.approach == pytest.approx(fresh.approach, rel=tolerance), changes
        assert state.solid.ell == pytest.approx(session.choice.alpha*session.reference)
        assert state.load == pytest.approx(session.choice.load, rel=1e-12)      # of cells it is the sum of their forces
        if kind != "body":
            assert state.error_estimate <= 1e-2
    assert session.png().startswith(b"\x89PNG")


def test_a_body_is_condensed_once_for_all_loads_obstacles_angles_and_laws(block, monkeypatch):
    made, init = [], condensation.Condensed.__init__
    monkeypatch.setattr(condensation.Condensed, "__init__", lambda self, *given: made.append(given) or init(self, *given))
    scene = on_mesh(block, mb.Microblock())
    session = Explorer(scene, 0.05)
    for changes in ({"load": 0.06}, {"psi0": 0.01}, {"radius": 3.0}, {"law": "unilateral"}, {"law": "microblock"}, {"load": 0.04}):
        session.solve(**changes)
    mb.Contact(scene.body, mb.Wedge(0.02), mb.Unilateral()).at(0.03)
    assert len(made) == 1
    session.solve(law="microclamped")      # psi held: another matrix
    session.solve(alpha=0.7)
    session.solve(load=0.05)
    assert len(made) == 3


def test_a_session_on_a_body_refines_for_its_first_state_and_stays_on_that_mesh(block):
    session = Explorer(on_mesh(block, mb.Unilateral()), 0.05, rtol=0.1)
    assert session.state.error_estimate <= 0.1 and session.scene.body.mesh.ne > block.ne
    assert session.solve(load=0.06).unknowns == session.scene.at(0.05).unknowns


def test_sessions_on_fitted_meshes_start_from_the_last_zones():
    session = Explorer(mb.FittedContact(solid(), mb.Cylinder(R), mb.Microblock(), domain=18.0), LOAD, rtol=1e-2)
    for changes in ({"load": 1.05}, {"psi0": 0.002}, {"law": "unilateral"}):      # the second is not symmetric any more
        assert session.solve(**changes).error_estimate <= 1e-2


def rectangle_below():
    """Quadrilaterals of [-8, 8] x [-8, 0], finer towards the origin."""
    from ngsolve.meshes import MakeStructured2DMesh
    mesh = MakeStructured2DMesh(quads=True, nx=24, ny=12, mapping=lambda x, y: (8*(2*x - 1)**3, -8*(1 - y)**3))
    for index, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(index, {"top": "contact"}.get(name, name))
    return ng.Mesh(mesh.ngmesh)


@pytest.mark.parametrize("quads", [False, True])
def test_fields_below_a_contact_on_a_mesh_are_those_of_the_half_plane(quads):
    law = mb.Microblock()
    if quads:
        body = mb.Body(rectangle_below(), solid(), order=4, fixed="bottom")
        state = mb.Contact(body, mb.Cylinder(R), law).at(LOAD)
    else:
        state = mb.FittedContact(solid(), mb.Cylinder(R), law).at(LOAD)
    x1, x2, triangles, psi, stress = state.fields_below(((-0.4, 0.6), 0.5))
    corners = np.column_stack((x1, x2))[triangles]
    areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))/2
    # every place of the box of area 0.5: the mirrored half as well, and small triangles across the sides of the box
    assert 0.5 <= areas.sum() < 0.8
    deep = (x2 < -0.1) & (x2 > -0.5)
    half = subsurface.fields(scene(law).at(LOAD, rtol=1e-5), x1[deep], x2[deep])
    # the fitted state is good to 1e-3, its stresses inside elements of low order to some 1e-2 of the largest
    assert psi[deep] == pytest.approx(half.psi, abs=0.02*np.abs(half.psi).max())
    assert stress[..., deep] == pytest.approx(half.stress, abs=0.05*np.abs(half.stress).max())


def test_neighbours_cost_fewer_solutions_than_fresh_states(monkeypatch):
    session, count, solve = Explorer(scene(mb.Microblock(0.005)), LOAD), [], contact_line.solve_zones
    monkeypatch.setattr(contact_line, "solve_zones", lambda *given: count.append(given) or solve(*given))
    for load in (1.02, 1.04, 1.06):
        count.clear()
        session.solve(load=load)
    moved = len(count)
    count.clear()
    session.scene.at(1.06)
    assert moved <= 3 < len(count)      # two orders, one of them twice; afresh each starts from the edges of cells


def test_refused_parameters_leave_the_session_as_it_was():
    session = Explorer(scene(), LOAD)
    before = session.choice, session.state
    for wrong in ({"load": -1.0}, {"law": "glue"}, {"colour": 1.0}, {"alpha": float("nan")}):
        with pytest.raises(mb.BadArgument):
            session.update(**wrong)
    with pytest.raises(mb.BadArgument, match="psi0"):
        session.update(psi0=1.5)
    assert (session.choice, session.state) == before
    with pytest.raises(mb.BadArgument, match="radius.*it has alpha, law, load, psi0"):
        Explorer(scene(obstacle=mb.Wedge(0.02)), LOAD).update(radius=2.0)


def test_frames_are_what_drawing_everything_gives():
    session = Explorer(scene(), LOAD)
    for changes in ({}, {"load": 1.1}, {"load": 0.1}, {"psi0": 0.01}, {"law": "unilateral"}):
        session.update(**changes)
        session.png()
        canvas = session.frames.canvas
        kept = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
        canvas.draw()
        whole = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
        # lines drawn over axes instead of under them differ in single pixels at the ends of axes
        assert (np.abs(kept - whole).max(axis=2) > 60).mean() < 3e-3, changes


def test_sliders_move_the_session():
    ipywidgets = pytest.importorskip("ipywidgets")
    panel = widgets.Panel(Explorer(scene(), LOAD), ipywidgets)
    picture, table = panel.picture.value, panel.table.value
    panel.controls["load"].value = 1.3
    assert panel.explorer.state.load == pytest.approx(1.3) and panel.picture.value != picture and panel.table.value != table
    panel.controls["psi0"].value = 1.0
    assert panel.explorer.choice.psi0 == pytest.approx(np.pi/180)
    panel.controls["law"].value = "unilateral"
    assert panel.explorer.state.line.law == mb.Unilateral()
    panel.button.click()
    assert bytes(panel.below.value).startswith(b"\x89PNG") and panel.below.layout.display == ""
    assert isinstance(scene().explore(LOAD), ipywidgets.Box)


def test_sliders_of_slow_scenes_wait_until_they_are_let_go(block):
    ipywidgets = pytest.importorskip("ipywidgets")
    for kind, (start, load) in others(block, mb.Microblock()).items():
        session = Explorer(start, load)
        session.seconds = 0.01
        panel = widgets.Panel(session, ipywidgets)
        assert panel.controls["load"].continuous_update and (panel.below in panel.aside) == (kind == "body")
        session.seconds = 1.0
        assert not widgets.Panel(session, ipywidgets).controls["load"].continuous_update


def test_a_state_that_is_not_found_is_told_and_the_picture_stays(monkeypatch):
    panel = widgets.Panel(Explorer(scene(), LOAD), pytest.importorskip("ipywidgets"))
    picture, state = panel.picture.value, panel.explorer.state

    def fail(*given, **named):
        raise mb.NotConverged("no zones fit")

    monkeypatch.setattr(mb.Contact, "at", fail)
    panel.controls["load"].value = 1.3
    assert "no zones fit" in panel.told.value and panel.picture.value == picture and panel.explorer.state is state


def test_without_ipywidgets_the_error_names_the_extra(monkeypatch):
    plain = builtins.__import__

    def without(name, *rest):
        if name == "ipywidgets":
            raise ModuleNotFoundError(name)
        return plain(name, *rest)

    session = Explorer(scene(), LOAD)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(mb.MicroblockError, match=r"ipywidgets.*pip install 'microblock\[notebook\]'"):
        widgets.explore(session)


def test_an_interrupted_path_keeps_its_states(monkeypatch):
    whole = scene().load(LOAD)
    whole.events
    path, done, at = scene().load(LOAD), [], mb.Contact.at

    def interrupted(self, load, *rest, **named):
        if len(done) == 4:
            raise KeyboardInterrupt
        done.append(load)
        return at(self, load, *rest, **named)

    monkeypatch.setattr(mb.Contact, "at", interrupted)
    with pytest.raises(KeyboardInterrupt):
        path.events
    first = list(done)

    def counted(self, load, *rest, **named):
        done.append(load)
        return at(self, load, *rest, **named)

    monkeypatch.setattr(mb.Contact, "at", counted)
    assert path.events == whole.events
    assert len(first) == 4 and len(done) == len(set(done)) and f"{len(path.events)}" in repr(path)      # none was solved twice


def test_choice_names_are_the_sliders():
    assert [entry.name for entry in dataclasses.fields(mb.Choice)] == ["load", "psi0", "radius", "alpha", "law"]


def stopped(at, works):
    """A method that is interrupted at its call number `at`, the calls in `works`."""
    def method(whole):
        def counted(*given, **named):
            works.append(given)
            if len(works) == at:
                raise KeyboardInterrupt
            return whole(*given, **named)
        return counted
    return method


def test_interrupted_cells_go_on_with_the_next_grid(monkeypatch):
    scene, works = mb.GridContact(mb.HalfPlane(solid()), mb.Cylinder(R), mb.Microblock(), window=(-1, 1)), []
    whole = scene.at(LOAD, nodes=1024)
    monkeypatch.setattr(mb.GridContact, "_solve", stopped(3, works)(mb.GridContact._solve))
    with pytest.raises(KeyboardInterrupt):
        scene.at(LOAD, nodes=1024)
    state = scene.at(LOAD, nodes=1024, progress=True)
    assert [given[1] for given in works] == [256, 512, 1024, 1024]      # none of those done twice
    assert np.array_equal(state.pressures, whole.pressures) and state.error_estimate == whole.error_estimate
    scene.at(LOAD, nodes=1024)
    assert len(works) == 7      # what was asked for is there: nothing is kept


def test_an_interrupted_refinement_goes_on_from_its_mesh(block, monkeypatch, capsys):
    whole, works = on_mesh(block, mb.Unilateral()).at(0.05, rtol=0.03), []
    scene = on_mesh(block, mb.Unilateral())
    monkeypatch.setattr(refined, "estimate", stopped(3, works)(refined.estimate))
    with pytest.raises(KeyboardInterrupt):
        scene.at(0.05, rtol=0.03)
    state = scene.at(0.05, rtol=0.03, progress=True)
    meshes = [given[0].nodes.body.mesh.ne for given in works]
    assert meshes[2] == meshes[3] and len(set(meshes)) == len(meshes) - 1 and "passes" in capsys.readouterr().err
    assert state.error_estimate == pytest.approx(whole.error_estimate, rel=1e-6)      # the same meshes
