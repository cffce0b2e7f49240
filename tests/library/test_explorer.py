"""States, problems and pictures as an interactive session sees them; no times here."""

import asyncio
import builtins
import dataclasses
import io
from base64 import b64decode

import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock.model.summary import Row, Summary, html, intervals, number
from microblock.view import blocks, frames, widgets
from microblock.view.explorer import Choice, Explorer
from microblock.view.state_figure import StateFigure

R, LOAD = 10.0, 1.0


def solid(ell=0.085):
    return mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)


def problem(law=mb.Microblock(), ell=0.085, obstacle=mb.Cylinder(R), method=None):
    return mb.Contact(mb.HalfPlane(solid(ell)), obstacle, law, method)


def fitted(law, size=np.inf):
    return mb.Contact(mb.Block(solid(), size), mb.Cylinder(R), law)


def periodic(law, nodes=None):
    return mb.Contact(mb.HalfPlane(solid(), period=1.0), mb.Wave(0.01, 1.0), law, mb.Cells(nodes=nodes))


def rendered(drawing):
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(drawing._repr_png_())).convert("RGB")).astype(int)


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Microblock(0.01), mb.Unilateral(), mb.Microclamped()])
def test_surface_has_the_gaps_of_the_state_and_its_own_nodes(law):
    state = problem(law).solve(load=LOAD)
    surface = state.surface()
    for corner, name in enumerate(law.corners):
        # the same integrals, once by levers and once by displacement and rotation: rounding of gaps of some
        # 1e-2
        assert surface.gaps[corner] == pytest.approx(state.gap_at(name, surface.x), abs=1e-12)
        assert surface.pressures[corner, np.isin(surface.x, state.x)] == pytest.approx(state.pressures[name])
    assert not surface.pressures[:, ~np.isin(surface.x, state.x)].any()


def test_surfaces_of_panels_cells_and_meshes_agree():
    law = mb.Microblock(0.005)
    line = problem(law).solve(load=LOAD, rtol=1e-6)
    cells = problem(law, method=mb.Cells(nodes=2000, window=(-0.6, 0.6))).solve(load=LOAD)
    mesh = fitted(law).solve(load=LOAD, rtol=1e-3)
    x = np.linspace(-0.45, 0.45, 91)
    for other in (cells, mesh):
        for name in ("gaps", "rotation"):
            rows = [np.atleast_2d(getattr(state.surface((-0.6, 0.6)), name)) for state in (line, other)]
            places = [state.surface((-0.6, 0.6)).x for state in (line, other)]
            own, others = (
                [np.interp(x, place, row) for row in values] for place, values in zip(places, rows)
            )
            # polygons through points some 0.02 apart bend by 0.02^2/(8 R) = 5e-6 of gaps up to 4e-3, as the
            # cells' 1/n
            assert np.max(np.abs(np.subtract(own, others))) < 4e-3 * np.max(np.abs(own)), name


def test_a_corner_touches_in_the_picture_where_its_gap_is_closed():
    state = problem().solve(load=LOAD)
    surface = state.surface()
    shown = blocks.blocks(surface, state.zones["contact"])
    assert shown.closed.any(axis=0).all() and not shown.closed.all()
    for corner in (0, 1):
        tips, centres = shown.squares[:, corner], shown.squares[:, :2].mean(axis=1)
        over = shown.magnification * (tips[:, 0] ** 2 / (2 * R) - state.solution.approach) - tips[:, 1]
        # heights are interpolated between points of the surface: a thousandth of the side of a block is not
        # seen
        expected = shown.magnification * np.interp(centres[:, 0], surface.x, surface.gaps[corner])
        assert over == pytest.approx(expected, abs=1e-3 * surface.ell)
        assert np.all(over[shown.closed[:, corner]] < 1e-3 * surface.ell)
    outer = np.linalg.norm(shown.squares[:, 0] - shown.squares[:, 1], axis=1)
    inner = np.linalg.norm(shown.squares[:, 1] - shown.squares[:, 2], axis=1)
    assert inner == pytest.approx(np.full(len(inner), surface.ell)) and np.all(outer >= surface.ell)


def test_blocks_of_a_shifted_contact_are_shifted():
    states = [problem(obstacle=lambda x, c=c: (x - c) ** 2 / (2 * R)).solve(load=LOAD) for c in (0.0, 1.0)]
    first, shifted = (blocks.blocks(state.surface(), state.zones["contact"]).squares for state in states)
    assert shifted == pytest.approx(
        first + (1.0, 0.0), abs=1e-9
    )  # rounding of abscissae is magnified a little


def test_every_kind_of_state_shows_and_draws_itself(block, tmp_path):
    law = mb.Microblock(0.002)
    body = on_mesh(block, law, order=2)
    wave = periodic(mb.Unilateral(), nodes=256)
    punch = problem(mb.Unilateral(), obstacle=mb.Punch(0.3))
    states = [
        problem(law).solve(load=LOAD),
        punch.solve(load=LOAD),
        fitted(mb.Microclamped()).solve(load=LOAD, rtol=1e-2),
        body.solve(load=0.05),
        wave.solve(load=0.5),
    ]
    for state in states:
        assert len(repr(state)) < 150 and repr(state) == str(state)
        assert "force per thickness" in state._repr_html_() and "error estimate" in state._repr_html_()
        # lines and letters on white; nothing of it can be drawn from numbers that are none
        assert (rendered(state.plot()).min(axis=2) < 200).mean() > 0.01
    states[0].plot_blocks(tmp_path / "blocks.png")
    assert (tmp_path / "blocks.png").stat().st_size > 10_000
    for each in (body, wave, problem(), solid(), problem().path(load=LOAD), mb.HalfPlane(solid())):
        assert "<table" in each._repr_html_() and len(str(each)) < 250


def test_fields_below_are_drawn_and_unknown_ones_refused(tmp_path):
    state = problem().solve(load=LOAD)
    state.plot_below("psi", tmp_path / "psi.png")
    assert (tmp_path / "psi.png").stat().st_size > 10_000
    with pytest.raises(mb.BadArgument, match="field.*psi, s22"):
        state.plot_below("pressure")


@pytest.mark.parametrize("quantity", ["psi", "skew", "shear"])
def test_fields_of_bodies_are_drawn_below_as_well(block, quantity):
    state = on_mesh(block, mb.Microblock()).solve(load=0.05)
    # colours, and not an empty box
    assert (rendered(state.plot_below(quantity)).min(axis=2) < 200).mean() > 0.1
    cells = problem(method=mb.Cells(nodes=256, window=(-1.5, 1.5))).solve(load=LOAD)
    with pytest.raises(mb.BadArgument, match="cells.*has no fields"):
        cells.plot_below(quantity)


def filled(drawing):
    """(x1, x2) of all corners of the triangles of a picture of a field, and the ends of its colours."""
    contours = next(each for each in drawing.axes[0].collections if getattr(each, "filled", False))
    corners = np.concatenate([path.vertices for path in contours.get_paths() if len(path.vertices)])
    return corners, contours.levels[[0, -1]]


def test_a_field_is_drawn_in_all_of_a_body_on_a_mesh(block):
    state = on_mesh(block, mb.Microblock()).solve(load=0.05)
    corners, (low, high) = filled(state.plot_body("psi"))
    # the unit block is [-1, 1] x [-1, 0]; its corners are nodes
    assert corners.min(axis=0) == pytest.approx([-1, -1]) and corners.max(axis=0) == pytest.approx([1, 0])
    largest = np.degrees(np.abs(state.psi).max())
    # round numbers around the values, of which 0.4 % may lie beyond
    assert 0.5 * largest < high == -low < 2 * largest
    with pytest.raises(mb.BadArgument, match="field.*psi, s22"):
        state.plot_body("pressure")
    with pytest.raises(mb.BadArgument, match="panels.*has no mesh"):
        problem().solve(load=LOAD).plot_body()


def test_the_colours_of_a_body_reach_from_the_least_to_the_largest_shear_over_all_planes(block):
    state = on_mesh(block, mb.Microblock()).solve(load=0.05)
    fields, angles = state.fields, np.radians(np.arange(0.0, 180.0))
    places = np.stack(np.meshgrid(np.linspace(-0.97, 0.97, 20), np.linspace(-0.97, -0.02, 20)), -1).reshape(
        -1, 2
    )
    stress = np.array([fields.stress(fields.body.mesh(*place)) for place in places]).reshape(-1, 2, 2)
    normal, along = np.array((np.cos(angles), np.sin(angles))), np.array((-np.sin(angles), np.cos(angles)))
    shear = np.abs(np.einsum("ik,pij,jk->pk", along, stress, normal)).max(axis=1)
    _, (low, high) = filled(state.plot_body("shear"))
    # ends are round numbers; next to the edges of the contact, between these places, it is larger
    assert low == 0 and np.quantile(shear, 0.99) < high < 2 * shear.max()


def test_fields_below_fill_their_box_where_elements_are_larger_than_it(block):
    state = on_mesh(block, mb.Microblock()).solve(load=0.05)
    box = (0.01, 0.07), 0.07  # between points, which are 1/12 apart: a quarter of an element
    x1, x2, triangles, _, _ = state.solution.fields_below(box)
    first, *others = np.column_stack((x1, x2))[triangles].swapaxes(0, 1)
    sides = np.stack([other - first for other in others], axis=-1)
    for place in np.array(np.meshgrid(np.linspace(*box[0], 7), np.linspace(-box[1], 0, 7))).reshape(2, -1).T:
        # a point is in a triangle if its shares of the two sides are positive, 1 together; up to rounding
        shares = np.linalg.solve(sides, (place - first)[..., None])[..., 0]
        assert ((shares > -1e-9).all(axis=1) & (shares.sum(axis=1) < 1 + 1e-9)).any(), place


def test_pictures_do_not_magnify_rounding_nor_name_corners_that_a_law_has_not():
    state = problem(mb.Unilateral(), obstacle=mb.Punch(0.3)).solve(load=LOAD)
    figure = StateFigure(mb.Unilateral().corners).update(state)
    # closed gaps: 1e-17
    assert figure.axes["gap"].get_ylim()[1] == 1.0 and figure.axes["blocks"].get_legend() is None
    assert StateFigure(mb.Microblock().corners).axes["blocks"].get_legend() is not None


def test_warnings_where_small_strain_ends():
    assert problem().solve(load=LOAD).warnings == []
    body = mb.HalfPlane(mb.Cosserat(E=2, nu=0.3, beta=1, ell=0.1))
    steep = mb.Contact(body, mb.Cylinder(1.0), mb.Microblock(0.2)).solve(load=1.0)
    for word in ("degrees", "slope"):
        assert any(word in text for text in steep.warnings)
    assert "&#9888;" in steep._repr_html_()
    assert any("larger" in text for text in problem(ell=3.0).solve(load=LOAD).warnings)


def test_tables_take_text_as_text():
    summary = Summary("<b>", "a & b", (Row("<i>", "&ell;", 1 / 3, "m<sup>"),), ("<script>",))
    assert "<script>" not in html(summary) and "&lt;b&gt;" in html(summary) and "0.3333" in html(summary)
    assert number(None) == "-" and number(3) == "3" and intervals([]) == "none"
    assert intervals([(k, k + 0.5) for k in range(6)]) == "6 intervals, 3 together"


SWEEPS = [
    ("load", np.linspace(0.5, 1.5, 5)),
    ("psi0", np.linspace(-0.02, 0.02, 6)),
    ("radius", (10.0, 9.0, 30.0)),
    ("alpha", (0.25, 0.3, 1.2, 0.1)),
    ("law", ("unilateral", "microclamped", "microblock")),
]


@pytest.mark.parametrize("name, values", SWEEPS, ids=[name for name, _ in SWEEPS])
def test_states_of_sliders_are_those_of_problems_asked_afresh(name, values):
    session = Explorer(problem(mb.Microblock(0.001)), LOAD)
    for value in values:
        state = session.update(**{name: value})
        fresh = session.problem.solve(load=session.choice.load)
        assert getattr(session.choice, name) == value
        for zone, own in fresh.zones.items():
            # an edge is wrong by about the square of the pressure's relative error, 1e-3, and what that is
            # next to a birth
            assert np.ravel(state.zones[zone]) == pytest.approx(np.ravel(own), abs=2e-3 * fresh.x[-1]), zone
        assert state.error_estimate <= 1e-3


def on_mesh(block, law, order=3):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=order, fixed="bottom")
    return mb.Contact(body, mb.Cylinder(2.0), law)


def others(block, law):
    """{kind: (problem, load)} that are not half-planes on panels."""
    cells = problem(law, method=mb.Cells(window=(-1.5, 1.5)))
    return {"body": (on_mesh(block, law), 0.05), "cells": (cells, LOAD), "periodic": (periodic(law), LOAD)}


@pytest.mark.parametrize("kind", ["body", "cells", "periodic"])
def test_sessions_on_meshes_and_cells_answer_as_their_problems_do(block, kind):
    start, load = others(block, mb.Microblock(0.001))[kind]
    session = Explorer(start, load)
    for changes in (
        {"load": 1.1 * load},
        {"psi0": -0.002},
        {"radius": 11.0},
        {"alpha": 0.5},
        {"law": "unilateral"},
        {"law": "microclamped"},
        {"load": load},
        {"law": "microblock"},
    ):
        if session.choice.radius is None and "radius" in changes:
            continue
        state = session.update(**changes)
        fresh = session.problem.solve(load=session.choice.load)
        # on a mesh or on equal cells both solve the same finite problem, cells to a residual of 2e-5; else
        # both are good to 1e-2
        tolerance = 1e-9 if kind == "body" else 1e-4 if len(fresh.x) == len(state.x) else 1e-2
        assert state.solution.approach == pytest.approx(fresh.solution.approach, rel=tolerance), changes
        assert state.solid.ell == pytest.approx(session.choice.alpha * session.reference)
        # of cells it is the sum of their forces
        assert state.load == pytest.approx(session.choice.load, rel=1e-12)
        if kind != "body":
            assert state.error_estimate <= 1e-2
    assert session.png().startswith(b"\x89PNG")


def test_a_body_is_condensed_once_for_all_loads_obstacles_angles_and_laws(block, forms):
    start = on_mesh(block, mb.Microblock())
    session = Explorer(start, 0.05)
    for changes in (
        {"load": 0.06},
        {"psi0": 0.01},
        {"radius": 3.0},
        {"law": "unilateral"},
        {"law": "microblock"},
        {"load": 0.04},
    ):
        session.solve(**changes)
    mb.Contact(start.body, mb.Wedge(0.02), mb.Unilateral()).solve(load=0.03)
    assert len(forms) == 1
    session.solve(law="microclamped")  # psi constrained: another matrix
    session.solve(alpha=0.7)
    session.solve(load=0.05)
    assert len(forms) == 3


def test_a_session_on_a_body_refines_for_its_first_state_and_stays_on_that_mesh(block):
    session = Explorer(on_mesh(block, mb.Unilateral()), 0.05, rtol=0.1)
    assert session.state.error_estimate <= 0.1 and session.problem.body.mesh.ne > block.ne
    assert session.solve(load=0.06).unknowns == session.problem.solve(load=0.05).unknowns


@pytest.mark.parametrize(
    "method", [mb.Cells(nodes=256, window=(-1.5, 1.5)), mb.Panels(order=8)], ids=["cells", "panels"]
)
def test_sessions_keep_a_discretisation_that_is_prescribed(method):
    session = Explorer(problem(method=method), LOAD)
    for load in (1.1, 1.2):
        state = session.solve(load=load)
        fresh = session.problem.solve(load=load)
        assert state.unknowns == fresh.unknowns
        assert (state.error_estimate is None) == (session.state.method == "panels")
        assert state.half_width == pytest.approx(fresh.half_width, rel=1e-6)


def test_sessions_on_fitted_meshes_start_from_the_last_zones():
    session = Explorer(fitted(mb.Microblock(), 18.0), LOAD, rtol=1e-2)
    # the second is not symmetric any more
    for changes in ({"load": 1.05}, {"psi0": 0.002}, {"law": "unilateral"}):
        assert session.solve(**changes).error_estimate <= 1e-2


def test_steps_of_a_slider_on_fitted_meshes_take_two_meshes():
    """The zones of two steps tell those of the next: no mesh is needed to find them, and none to refine."""
    session = Explorer(fitted(mb.Microblock(), 18.0), LOAD, rtol=1e-3)
    first, second, third = (session.solve(load=load) for load in (1.02, 1.04, 1.06))
    assert first.iterations > 2 and second.iterations == third.iterations == 2
    afresh = session.problem.solve(load=1.06, rtol=1e-4)
    # both errors together, edges within the distance at which a root of it is worth that
    assert third.half_width == pytest.approx(afresh.half_width, rel=1e-3)
    assert third.error_estimate <= 1e-3


def rectangle_below():
    """Quadrilaterals of [-8, 8] x [-8, 0], finer towards the origin."""
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(
        quads=True, nx=24, ny=12, mapping=lambda x, y: (8 * (2 * x - 1) ** 3, -8 * (1 - y) ** 3)
    )
    for index, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(index, {"top": "contact"}.get(name, name))
    return ng.Mesh(mesh.ngmesh)


@pytest.mark.parametrize("quads", [False, True])
def test_fields_below_a_contact_on_a_mesh_are_those_of_the_half_plane(quads):
    law = mb.Microblock()
    if quads:
        body = mb.Body(rectangle_below(), solid(), order=4, fixed="bottom")
        state = mb.Contact(body, mb.Cylinder(R), law).solve(load=LOAD)
    else:
        state = fitted(law).solve(load=LOAD)
    x1, x2, triangles, psi, stress = state.solution.fields_below(((-0.4, 0.6), 0.5))
    corners = np.column_stack((x1, x2))[triangles]
    areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 2
    # every place of the box of area 0.5: the mirrored half as well, and small triangles across the sides of
    # the box
    assert 0.5 <= areas.sum() < 0.8
    deep = (x2 < -0.1) & (x2 > -0.5)
    half = problem(law).solve(load=LOAD, rtol=1e-5).fields(x1[deep], x2[deep])
    # the fitted state is good to 1e-3, its stresses inside elements of low order to some 1e-2 of the largest
    assert psi[deep] == pytest.approx(half.psi, abs=0.02 * np.abs(half.psi).max())
    assert stress[..., deep] == pytest.approx(half.stress, abs=0.05 * np.abs(half.stress).max())


def test_neighbours_cost_fewer_solutions_than_fresh_states():
    class Counting(mb.Cylinder):
        asked = 0

        def height(self, x):
            Counting.asked += 1
            return super().height(x)

    session, asked = Explorer(problem(mb.Microblock(0.005), obstacle=Counting(R)), LOAD), []
    for solve in (*3 * [session.solve], session.problem.solve):
        before = Counting.asked
        solve(load=1 + 0.02 * min(len(asked) + 1, 3))
        asked.append(Counting.asked - before)
    # two orders once each; afresh the first one twice, from the edges of cells, which are looked for
    assert asked[2] < asked[3]


def test_refused_parameters_leave_the_session_as_it_was():
    session = Explorer(problem(), LOAD)
    before = session.choice, session.state
    for wrong in ({"load": -1.0}, {"law": "glue"}, {"colour": 1.0}, {"alpha": float("nan")}):
        with pytest.raises(mb.BadArgument):
            session.update(**wrong)
    with pytest.raises(mb.BadArgument, match="psi0"):
        session.update(psi0=1.5)
    assert (session.choice, session.state) == before
    with pytest.raises(mb.BadArgument, match="radius.*it has alpha, law, load, psi0"):
        Explorer(problem(obstacle=mb.Wedge(0.02)), LOAD).update(radius=2.0)


def test_frames_are_what_drawing_everything_gives():
    session = Explorer(problem(), LOAD)
    for changes in ({}, {"load": 1.1}, {"load": 0.1}, {"psi0": 0.01}, {"law": "unilateral"}):
        session.update(**changes)
        session.png()
        canvas = session.frames.canvas
        kept = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
        canvas.draw()
        whole = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
        # lines drawn over axes instead of under them differ in single pixels at the ends of axes
        assert (np.abs(kept - whole).max(axis=2) > 60).mean() < 3e-3, changes


def panel_of(start, load=LOAD):
    return widgets.Panel(Explorer(start, load), pytest.importorskip("ipywidgets"))


def pixels(png):
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def test_a_picture_is_written_as_it_was_drawn():
    drawn = np.random.default_rng(1).integers(0, 256, (7, 5, 3), np.uint8)
    assert (pixels(frames.png(drawn)) == drawn).all()


def test_panels_are_drawn_anew_only_where_their_axes_change(monkeypatch):
    drawn, draw = [], frames.Frames._draw_panels
    monkeypatch.setattr(
        frames.Frames, "_draw_panels", lambda self, names: drawn.append(names) or draw(self, names)
    )
    # the mesh below a block ends elsewhere in each state
    for start in (problem(mb.Microblock(0.01)), fitted(mb.Microblock(), 6.0)):
        session = Explorer(start, LOAD, rtol=1e-2)
        session.png()
        for step in range(6):
            session.update(load=LOAD * 1.01**step)
            session.png()
        # the first axes fit the first state closely: once they get room, all together, which lasts for 20 %
        assert sum(len(names) for names in drawn) <= len(session.figure.axes), drawn
        drawn.clear()


def test_hertz_is_shown_beside_a_cylinder_and_nothing_else():
    session = Explorer(problem(), LOAD)
    without, unchanged = session.png(), session.state
    session.compare(True)
    assert session.state is unchanged and (pixels(session.png()) != pixels(without)).any()
    for changes in ({}, {"load": 1.3}, {"law": "unilateral"}):
        session.update(**changes)
        x, p = session.figure._hertz.get_data()
        half = np.sqrt(4 * session.state.load * R / (np.pi * solid().E_star))
        assert session.figure.compared and x[[0, -1]] == pytest.approx([-half, half])
        assert p.max() == pytest.approx(2 * session.state.load / (np.pi * half)) == pytest.approx(p[50])
        assert session.figure.axes["pressure"].get_ylim()[1] >= p.max()
        word = session.figure.axes["pressure"].get_legend().get_texts()[-1]
        picture, box = pixels(session.png()), word.get_window_extent()
        left, low, right, high = (round(float(end)) for end in box.extents)
        assert word.get_text() == "Hertz"
        assert picture[len(picture) - high : len(picture) - low, left:right].min() < 100
    session.compare(False)
    session.update(law="microblock", load=LOAD)
    assert not session.figure.compared
    with pytest.raises(mb.BadArgument, match="cylinder"):
        Explorer(problem(obstacle=mb.Wedge(0.02)), LOAD).compare(True)


@pytest.mark.parametrize("law", [mb.Microblock(0.01), mb.Unilateral()])
@pytest.mark.parametrize("obstacle", [mb.Cylinder(R), mb.Punch(0.3)])
def test_what_is_written_in_the_figure_beside_sliders_is_whole_and_apart(law, obstacle):
    session = Explorer(problem(law, obstacle=obstacle), LOAD)
    if session.choice.radius:
        session.compare(True)
    session.png()
    canvas, drawing = session.frames.canvas, session.figure.drawing
    canvas.draw()
    boxes = {}
    for name, axis in session.figure.axes.items():
        texts = [axis.xaxis.label, axis.yaxis.label, *axis.texts]
        texts += [axis.get_legend()] if axis.get_legend() and axis.get_legend().get_texts() else []
        for place, text in enumerate(texts):
            if getattr(text, "get_text", lambda: "legend")() and text.get_visible():
                boxes[name, place] = text.get_window_extent()
    for name, box in boxes.items():
        assert drawing.bbox.x0 <= box.x0 and box.x1 <= drawing.bbox.x1, name
        assert drawing.bbox.y0 <= box.y0 and box.y1 <= drawing.bbox.y1, name
    names = list(boxes)
    for place, name in enumerate(names):
        for other in names[:place]:
            assert not boxes[name].overlaps(boxes[other]), (name, other)


def test_sliders_move_the_session():
    panel = panel_of(problem())
    picture, table = panel.picture.value, panel.table.value
    panel.controls["load"].value = 1.3
    assert panel.explorer.state.load == pytest.approx(1.3)
    assert panel.picture.value != picture and panel.table.value != table
    panel.controls["psi0"].value = 1.0
    assert panel.explorer.choice.psi0 == pytest.approx(np.pi / 180)
    panel.controls["law"].value = "unilateral"
    assert panel.explorer.state.law == mb.Unilateral()
    picture = panel.picture.value
    panel.hertz.value = True
    assert panel.explorer.figure.compared and panel.picture.value != picture
    panel.hertz.value = False
    assert panel.picture.value == picture


def test_the_field_below_follows_as_long_as_it_is_shown():
    panel = panel_of(problem())
    assert panel.below.layout.display == "none"
    panel.beneath.value = True
    first = panel.below.value
    assert bytes(first).startswith(b"\x89PNG") and panel.below.layout.display == ""
    # without a running loop there is nothing to wait for
    panel.controls["load"].value = 1.3
    second = panel.below.value
    panel.quantity.value = "shear"
    assert len({bytes(each) for each in (first, second, panel.below.value)}) == 3
    panel.beneath.value = False
    panel.controls["load"].value = 1.2
    assert panel.below.layout.display == "none"


def test_the_field_below_waits_until_a_slider_rests():
    panel, drawn = panel_of(problem()), []
    panel.beneath.value = True
    panel.below.observe(lambda _: drawn.append(panel.explorer.state.load), "value")

    async def moved():
        for load in (1.1, 1.2, 1.3):
            panel.controls["load"].value = load
            await asyncio.sleep(0.1)  # of a quarter of a second; whatever is due later comes later
        while not drawn:
            await asyncio.sleep(0.1)

    asyncio.run(asyncio.wait_for(moved(), 60))
    assert drawn == pytest.approx([1.3])


def test_only_what_can_be_shown_is_offered(block):
    def panel(start, load):
        found = panel_of(start, load)
        queue, known = [found.box], []
        while queue:
            known.append(queue.pop())
            queue += getattr(known[-1], "children", ())
        return {each.description for each in known if getattr(each, "description", "")}

    common = {"load P", "ψ₀ (°)", "α = ℓ/a", "law"}
    assert panel(problem(), LOAD) == common | {"radius R", "Hertz", "field below"}
    assert panel(problem(obstacle=mb.Wedge(0.02)), LOAD) == common | {"field below"}
    kinds = others(block, mb.Microblock())
    assert panel(*kinds["body"]) == common | {"radius R", "Hertz", "field below"}
    assert panel(*kinds["cells"]) == common | {"radius R", "Hertz"}
    assert panel(*kinds["periodic"]) == common


def test_a_slider_is_followed_while_its_last_pictures_come_soon():
    quick, slow = 0.5 * widgets.SLOW, 2 * widgets.SLOW
    pace = widgets.Pace(True)
    # the first one sets up what the others use, and says nothing
    assert pace.took(slow) and pace.took(quick)
    # one of three may be slow: its axes are drawn anew
    assert pace.took(quick) and pace.took(slow) and not pace.took(slow)
    assert not pace.took(quick) and pace.took(quick)


def test_each_slider_waits_or_follows_by_its_own_pictures(monkeypatch):
    panel = panel_of(problem())
    assert all(panel.controls[name].continuous_update for name in ("load", "psi0", "radius", "alpha"))
    now, solve = [0.0], panel.explorer.solve

    def timed(**changes):
        now[0] += 2 * widgets.SLOW if "alpha" in changes else 0.5 * widgets.SLOW
        return solve(**changes)

    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    monkeypatch.setattr(panel.explorer, "solve", timed)
    for factor in (1.01, 1.02):
        for name, start in (("load", LOAD), ("alpha", 0.25)):
            panel.controls[name].value = factor * start
    follows = {name: panel.controls[name].continuous_update for name in ("load", "psi0", "radius", "alpha")}
    assert follows == {"load": True, "psi0": True, "radius": True, "alpha": False}


def test_sliders_of_very_slow_problems_begin_by_waiting():
    session = Explorer(problem(), LOAD)
    session.seconds = 1.1 * widgets.TOO_SLOW
    panel = widgets.Panel(session, pytest.importorskip("ipywidgets"))
    assert not panel.controls["load"].continuous_update


def test_a_browser_that_only_rounds_moves_nothing():
    panel = panel_of(problem(mb.Microblock(0.01)))
    state = panel.explorer.state
    panel.controls["load"].value *= 1 + 1e-12
    panel.controls["psi0"].value += 1e-9
    assert panel.explorer.state is state
    # values of sliders are whole steps from their lower end: the browser would send the nearest of them
    for psi0 in (0.01, -0.07, 0.0):
        slider = panel_of(problem(mb.Microblock(psi0))).controls["psi0"]
        steps = np.array((slider.value - slider.min, slider.max - slider.value)) / slider.step
        assert steps == pytest.approx(np.rint(steps), abs=1e-6)
        assert slider.min <= min(-3.0, slider.value) and slider.max >= max(3.0, slider.value)


def test_a_still_picture_lies_beside_the_sliders(monkeypatch):
    shown = []
    monkeypatch.setattr("IPython.display.display", lambda bundle, raw: shown.append(bundle))
    panel = panel_of(problem())
    panel.controls["load"].value = 1.3
    panel.box._ipython_display_()
    live, still = shown
    assert "application/vnd.jupyter.widget-view+json" in live and "image/png" not in live
    assert b64decode(still["image/png"]) == panel.picture.value
    # it hides itself where the element of the sliders is
    own = next(name for name in panel.box._dom_classes if name.endswith(panel.box.model_id))
    assert f"body:has(.{own})" in still["text/html"] and still["image/png"] in still["text/html"]
    assert isinstance(mb.explore(problem(), LOAD), type(panel.box).__mro__[1])


def test_a_state_that_is_not_found_is_told_and_the_picture_stays():
    panel = panel_of(problem(mb.Unilateral(), ell=1e-8))
    picture, state = panel.picture.value, panel.explorer.state
    panel.controls["law"].value = "microblock"  # whose blocks are too many
    assert "take a larger ell" in panel.told.value
    assert panel.picture.value == picture and panel.explorer.state is state


def test_without_ipywidgets_the_error_names_the_extra(monkeypatch):
    plain = builtins.__import__

    def without(name, *rest):
        if name == "ipywidgets":
            raise ModuleNotFoundError(name)
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(mb.MicroblockError, match=r"ipywidgets.*pip install 'microblock\[notebook\]'"):
        mb.explore(problem(), LOAD)


def test_choice_names_are_the_sliders():
    assert [entry.name for entry in dataclasses.fields(Choice)] == ["load", "psi0", "radius", "alpha", "law"]


def test_a_rough_surface_with_a_period_has_sliders():
    body = mb.HalfPlane(solid(), period=1.0)
    rough = mb.Contact(body, mb.Rough(period=1.0, slope=0.1), mb.Microblock(), mb.Cells(nodes=512))
    explorer = Explorer(rough, LOAD)
    assert explorer.update(load=2 * LOAD).load == pytest.approx(2 * LOAD, rel=1e-12)  # a sum over the cells
    assert explorer.choice.alpha == 1.0  # of ell: no classical width says how large the contact is
