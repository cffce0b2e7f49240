"""CSV, VTK and plain data: what comes back is what the state has."""

import json
import pickle
import re
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from cases.__main__ import main
from microblock.data.records import read_records
from microblock.fem import meshes
from microblock.model.results import plain_data
from tests.bodies import on_ground, quarter

meshio = pytest.importorskip("meshio", reason="VTK needs the extra `vtk`")

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
GROUND = mb.HalfPlane(SOLID)
CYLINDER = mb.Cylinder(R=10)
TURNED = mb.Microblock(psi0=0.002)
ROLLER = mb.Deformable(GROUND, CYLINDER)
LAWS = TURNED, mb.Unilateral(), mb.Microclamped()
EVALUATED = "micromoment", "psi", "rotation", "displacement", "opposite", "slip", "energy", "work", "warnings"
ATTRIBUTES = *(entry.name for entry in fields(mb.State)), *EVALUATED, "caption"
CELLS = mb.Cells(nodes=64, window=(-1, 1))
FEW = mb.Cells(nodes=32)


def solved(body=GROUND, law=TURNED, method=None, obstacle=CYLINDER, load=1.0, rtol=None):
    return mb.Contact(body, obstacle, law, method).solve(load=load, rtol=rtol)


def on_grid(law=TURNED, obstacle=mb.Sphere(R=1.0), period=None):
    return solved(mb.HalfSpace(SOLID, period), law, FEW, obstacle, 0.1)


def in_space(law=TURNED, method=None):
    return solved(quarter(SOLID), law, method, mb.Sphere(R=10), 0.1)


def triangles():
    block = occ.Rectangle(4, 2).Face().Move((-2, -2, 0))
    block.edges.Max(occ.Y).name = "contact"
    block.edges.Min(occ.Y).name = "bottom"
    return mb.Body(ng.Mesh(occ.OCCGeometry(block, dim=2).GenerateMesh(maxh=0.8)), SOLID, 3, fixed="bottom")


def on_depth():
    line = mb.Body(meshes.line(1.0, 4), SOLID, 2, fixed={"u2": "middle"})
    return mb.Contact(line, mb.Plane(), mb.Microblock()).solve(approach=0.01)


def rubbed(body=GROUND, method=None, law=mb.Unilateral(friction=0.3), rtol=None, obstacle=CYLINDER):
    return mb.Contact(body, obstacle, law, method).history([(1.0, 0.0), (1.0, 0.1)], rtol=rtol)


BLOCK, SMALL = mb.Block(SOLID, 4.0), on_ground(SOLID, 0.5, 2)
KINDS = {
    **{f"panels {law}": lambda law=law: solved(law=law) for law in LAWS},
    "punch": lambda: solved(obstacle=mb.Punch(0.5)),
    "cells": lambda: solved(method=CELLS),
    "fitted": lambda: solved(mb.Block(SOLID, 18.0), mb.Microblock(), rtol=1e-2),
    "body": lambda: solved(triangles()),
    "two bodies on panels": lambda: solved(obstacle=ROLLER),
    "two bodies on cells": lambda: solved(law=LAWS[1], method=CELLS, obstacle=ROLLER),
    "period": lambda: solved(mb.HalfPlane(SOLID, 1.0), LAWS[2], mb.Cells(64), mb.Wave(0.01, 1.0), 0.1),
    "uniform": lambda: solved(BLOCK, method=mb.Uniform(h=0.2)),
    "depth": on_depth,
    "newton": lambda: solved(SMALL, LAWS[2], mb.Newton()),
    "friction on cells": lambda: rubbed(rtol=0.2),
    "friction on panels": lambda: rubbed(method=mb.Panels(), rtol=0.05, obstacle=ROLLER),
    "friction on a body": lambda: rubbed(SMALL, law=mb.Microblock(friction=0.3)),
    "friction by Newton": lambda: rubbed(BLOCK, mb.Uniform(h=0.2, newton=mb.Newton())),
    **{f"half-space {law}": lambda law=law: on_grid(law) for law in LAWS},
    **{f"half-space of a period {law}": lambda law=law: on_grid(law, period=2.0) for law in LAWS},
    "two half-spaces": lambda: on_grid(obstacle=mb.Deformable(mb.HalfSpace(SOLID), mb.Sphere(R=1.0))),
    **{f"in space {law}": lambda law=law: in_space(law, mb.Condensed()) for law in LAWS},
    "in space by Newton": lambda: in_space(method=mb.Newton()),
}


@cache
def made(name):
    """The result of a name, for all tests that read it."""
    return RESULTS[name]()


def arrays(state, kind):
    """{name in the files: values} of a state."""
    columns = dict(zip(("x1", "x2"), state.points.T)) | {"displacement": state.displacement}
    if state.zones is not None:
        columns |= {name: getattr(state, name) for name in ("micromoment", "psi")}
    else:
        columns |= {"closed": state.closed}
        columns |= dict(zip(("m1", "m2", "psi1", "psi2"), (*state.micromoment.T, *state.psi.T)))
    columns |= {"weight": state.weights, "pressure": state.pressure}
    columns |= {f"pressure_{name}": values for name, values in state.pressures.items()}
    if "friction" in kind:
        columns |= {"shear_traction": state.shear_traction, "slip": state.slip}
    if "two" in kind or kind == "friction on panels":
        columns |= {"counter_displacement": state.opposite}
    return columns


ALIKE = [f"half-space{period} {law}" for period in ("", " of a period") for law in LAWS[1:]]


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.nightly] * (kind in ALIKE)) for kind in KINDS]
)
def test_every_kind_of_state_comes_back_whole(kind, tmp_path):
    """All arrays and numbers that a state has, to the last digit, from the table, the surface and JSON."""
    result = made(kind)
    states = result.states if isinstance(result, mb.History) else [result]
    mb.to_csv(result, tmp_path / "state.csv")
    rows = read_records(tmp_path / "state.csv")
    written = mb.to_vtk(result, tmp_path / "state.vtu")
    files = [file for file in written if "surface" in file.name]
    assert rows[0]["version_ngsolve"] and len(files) == len(states)
    data = result.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data  # digit by digit, and no tuples
    for number, (state, file) in enumerate(zip(states, files)):
        table = [row for row in rows if row.get("state", 0) == number]
        surface = meshio.read(file)
        plain = data["states"][number] if "friction" in kind else data
        for name, values in arrays(state, kind).items():
            assert np.array_equal([row[name] for row in table], np.ravel(values)), name
            place = {"x1": surface.points[:, 0], "x2": surface.points[:, 1]}.get(name)
            back = surface.point_data[name].ravel() if place is None else place
            assert np.array_equal(back, np.ravel(values)), name
        for name in ("weights", "pressure", "micromoment", "psi"):
            assert np.array_equal(np.array(plain[name], float), getattr(state, name)), name
        assert all(len(block.data) for block in surface.cells)
        where = state.x if state.zones is not None else state.points
        ell = state.solid.ell
        off = np.abs(state.micromoment_at(where) - state.micromoment).max() / ell
        beside = np.abs(state.pressure_at(where) - state.pressure).max()  # of panels: loads as asked for
        assert off <= beside + 1e-12 * state.pressure.max()  # rounding
        names = ["load", "approach", "error_estimate", "energy", "residual", "method"]
        names += ["shear", "tangential_approach", "dissipation", "work"] * ("friction" in kind)
        expected = {name: getattr(state, name) for name in names}
        assert {name: table[0][name] for name in names} == expected
        assert {name: plain[name] for name in names} == expected
        assert (table[0]["warnings"] or "") == "; ".join(state.warnings)


def test_histories_paths_and_rows_list_what_they_have(tmp_path):
    history = rubbed(rtol=0.2)
    path = mb.Contact(GROUND, CYLINDER, mb.Microblock()).path(load=0.1)
    for result, events in ((history.events, history.events), (path, path.events)):
        mb.to_csv(result, tmp_path / "events.csv")
        for row, event in zip(read_records(tmp_path / "events.csv"), events, strict=True):
            assert all(row[name] == value for name, value in asdict(event).items())
    for result in (history, path):
        kinds = [(event.kind, event.zone) for event in result.events]
        assert [(event["kind"], event["zone"]) for event in result.to_dict()["events"]] == kinds
    rows = [{"radius": 5.0, "law": "microblock", "half_width": np.float64(0.1), "error": None}]
    mb.to_csv(rows, tmp_path / "rows.csv")
    (back,) = read_records(tmp_path / "rows.csv")
    assert {name: back[name] for name in rows[0]} == rows[0]
    assert back["version_microblock"] == mb.__version__
    mb.to_csv([{"a": 1}, {"b": 2}], tmp_path / "rows.csv")
    assert [(row["a"], row["b"]) for row in read_records(tmp_path / "rows.csv")] == [(1, None), (None, 2)]


def test_numbers_that_do_not_exist_are_none():
    values = {"a": np.array([1.5, np.nan]), 2: (np.inf, np.float64("nan"), np.int64(3), True, None, "word")}
    assert plain_data(values) == {"a": [1.5, None], "2": [None, None, 3, True, None, "word"]}


def test_no_line_crosses_a_gap_between_zones(tmp_path):
    """Corner A is on the left alone, B on the right."""
    state = solved(mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.5)), mb.Microblock())
    left, right = sorted((state.zones["A"][0][1], state.zones["B"][0][0]))
    surface, grid = map(meshio.read, mb.to_vtk(state, tmp_path / "state"))
    ends = surface.points[surface.cells_dict["line"], 0]
    assert len(ends) > 0.8 * len(state.x) and right - left > 0.05
    assert not np.any((ends[:, 0] <= left) & (ends[:, 1] >= right))
    # the grid below is around both zones, and 1.5 times as wide
    outer = np.array(state.zones["contact"])[[0, -1], [0, 1]]
    assert [grid.points[:, 0].min(), grid.points[:, 0].max()] == pytest.approx(list(1.5 * outer), rel=1e-6)


def test_fields_below_a_half_plane_come_back_and_the_usual_grid_holds_the_contact(tmp_path):
    state = solved(method=mb.Panels(order=8))
    grid = meshio.read(mb.to_vtk(state, tmp_path / "state")[1])
    assert [len(block.data) for block in grid.cells] == [2 * 80 * 40]
    numbers = np.arange(0, len(grid.points), 1000)
    places = grid.points[numbers]
    below = state.fields(places[:, 0], places[:, 1])
    expected = {
        "u": np.vstack((below.u, 0 * below.psi)),
        "psi": below.psi,
        "stress": below.stress.reshape(4, -1),
        "couple_stress": below.couple_stress,
    }
    # the sums over sources are taken together, so that rounding of their terms differs
    rounding = 1e-9 * np.abs(grid.point_data["stress"]).max()
    for name, values in expected.items():
        written = grid.point_data[name][numbers].reshape(len(numbers), -1)
        assert np.abs(written - np.atleast_2d(values).T).max() < rounding, name
    contact = np.ravel(state.zones["contact"])
    x1, x2, _ = grid.points.T
    assert x1.min() < contact.min() and x1.max() > contact.max()
    assert x2.max() == 0 and x2.min() < -np.ptp(contact)


def inner_points(points, dim):
    """Numbers of the points inside the box of a mesh; in the plane within one element: others have stresses
    of each neighbour.
    """
    box = points[:, :dim]
    _, first, copies = np.unique(points.round(9), axis=0, return_index=True, return_counts=True)
    inside = np.all((box > box.min(axis=0) + 1e-9) & (box < box.max(axis=0) - 1e-9), axis=1)
    return first[inside[first] & ((copies == 1) | (dim == 3))]


@pytest.mark.parametrize("kind", ["body", "fitted", "in space Microblock(psi0=0.002)"])
def test_fields_of_meshes_come_back(kind, tmp_path):
    state = KINDS[kind]()
    fields = state.fields
    mesh = fields.body.mesh
    back = meshio.read(mb.to_vtk(state, tmp_path / "state")[1])
    inner = inner_points(back.points, mesh.dim)
    names = ("psi", "stress", "couple_stress") if mesh.dim == 2 else ()
    expected = {name: getattr(fields, name) for name in names}
    expected["u"] = ng.CF((fields.u1, fields.u2, 0)) if mesh.dim == 2 else fields.u
    assert len(inner) > (mesh.ne if mesh.dim == 2 else 10)
    for name, field in expected.items():
        values = field(mesh(*back.points[inner, : mesh.dim].T)).reshape(len(inner), -1)
        written = back.point_data[name].reshape(len(back.points), -1)[inner]
        assert np.abs(written - values).max() < 1e-9 * np.abs(values).max(), name  # rounding
    assert back.point_data["stress"].shape[1] == mesh.dim**2


def test_fields_of_a_line_come_back_at_depths_x2(tmp_path):
    """NGSolve wrote the depth as x1, and as the other coordinates whatever the memory held."""
    layers = mb.Body(
        meshes.line(depth=1.0, elements=3), SOLID, 4, fixed={"u1": "middle", "u2": "middle", "psi": "middle"}
    )
    problem = mb.Contact(layers, mb.Plane(), mb.Microblock(psi0=0.01), mb.Newton())
    state = problem.solve(load=0.5)
    surface, back = map(meshio.read, mb.to_vtk(state, tmp_path / "state"))
    assert np.array_equal(back.points[:, [0, 2]], np.zeros((len(back.points), 2)))
    ends = back.points[back.cells_dict["line"], 1]
    assert np.diff(ends) == pytest.approx(1 / 12)  # three elements, cut for order 4
    assert (ends.min(), ends.max()) == (-1.0, surface.points[0, 1])
    mesh = layers.mesh
    fields = state.fields
    inside = np.flatnonzero(np.abs(3 * back.points[:, 1] % 1 - 0.5) < 0.3)  # of an element
    expected = {"u": ng.CF((fields.u1, fields.u2, 0)), "psi": fields.psi, "stress": fields.stress}
    for name, field in expected.items():
        values = np.reshape(field(mesh(back.points[inside, 1])), (len(inside), -1))
        assert np.ptp(values) > 0
        written = back.point_data[name].reshape(len(back.points), -1)[inside]
        assert np.abs(written - values).max() < 1e-9 * np.abs(values).max(), name  # rounding


def test_elements_are_cut_for_the_finer_of_displacement_and_rotation(tmp_path):
    mesh = SMALL.mesh
    counts = []
    for order, order_psi in ((1, 3), (3, 2)):  # twice; an order less, once
        body = mb.Body(mesh, SOLID, order, order_psi=order_psi, fixed="bottom")
        counts.append(len(meshio.read(mb.to_vtk(solved(body), tmp_path / "state")[1]).points))
    assert counts[0] == counts[1] and counts[0] > 3 * mesh.nv


# --- the page of columns and keys names what tables and JSON objects have, and nothing else


PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "columns.md").read_text()
PROBLEM = mb.Contact(GROUND, CYLINDER, mb.Microblock())


def told(heading):
    """Names in the first column of the table under a heading."""
    section = PAGE.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    first = re.findall(r"^\| (`.*?) \|", section, re.M)
    return {name for cell in first for name in re.findall(r"`(.+?)`", cell)}


def written(what, folder):
    mb.to_csv(what, folder / "table.csv")
    return {name for name in read_records(folder / "table.csv")[0] if not name.startswith("version_")}


def test_columns_of_states(tmp_path):
    plane = written(PROBLEM.solve(load=1.0, rtol=1e-2), tmp_path)
    assert plane == told("States in the plane")
    point = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), mb.Microblock(), mb.Cells(nodes=32))
    surface = written(point.solve(load=1.0), tmp_path)
    common = plane - {"pressure_A", "pressure_B", "micromoment", "psi"}
    assert surface == told("States on a half-space") | common


def test_columns_of_histories_and_events(tmp_path):
    history = PROBLEM.with_(law=mb.Microblock(friction=0.3)).history([(1.0, 0.1)], rtol=0.1)
    assert written(history, tmp_path) == told("States in the plane") | told("Histories with friction")
    assert set(asdict(history.events[0])) == told("Events")
    path = PROBLEM.path(load=0.05, rtol=1e-2)
    assert written(path, tmp_path) == told("Events") | {"warnings"}


@pytest.mark.parametrize(
    "words", ["strip --elements 4 --order 2", "hertz", "size_effect --alphas 0.5", "lattice --blocks-per-a 2"]
)
def test_keys_of_json(words, capsys):
    assert main([*words.split(), "--json", "-"]) == 0
    keys = set(re.findall(r"\"([\w']+)\":", capsys.readouterr().out))  # at any depth
    rows = re.findall(rf"^\| {words.split()[0]} \| (.*?) \| (.*?) \|$", PAGE, re.M)
    for names, meaning in rows:
        assert set(re.findall(r"([\w']+)`", names + meaning * meaning.startswith("list of"))) <= keys
    assert len(rows) > 1


# --- what comes with every result: data, labelled data sets, files and back, pictures; one class of states


RESULTS = {
    **KINDS,
    "path": lambda: PROBLEM.path(load=1.0),
    "functions": lambda: mb.Contact(
        GROUND, lambda x: x**2 / 20, mb.Microblock(psi0=lambda x: 0.01 + 0 * x)
    ).solve(load=1.0),
}


# whose pictures are written: figures of a state in the plane, in space, of a history and of a path
WRITTEN = ("fitted", "two half-spaces", "in space by Newton", "friction on panels", "path")


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_comes_back_from_its_file_digit_by_digit(name, tmp_path):
    """Every attribute; what lies between the points is refused by name, never another number."""
    result = made(name)
    states = (
        result.states if isinstance(result, mb.History) else [result] * (not isinstance(result, mb.LoadPath))
    )
    assert all(type(state) is mb.State for state in states)
    result.save(tmp_path / "result")
    back = mb.load(tmp_path / "result")
    assert back.to_dict() == result.to_dict() and str(back) == str(result)
    assert back.to_xarray().identical(result.to_xarray())
    back.to_xarray().to_netcdf(tmp_path / "result.nc", engine="scipy")
    for state, loaded in zip(states, back.states if isinstance(result, mb.History) else [back]):
        for key in {*ATTRIBUTES} - {"solution", "problem", "obstacle", "law"}:
            assert_same(getattr(loaded, key), getattr(state, key))
        where = 0.0 if state.zones else np.zeros((1, 2))
        for asked in (
            lambda: loaded.pressure_at(where),
            lambda: loaded.fields,
            lambda: loaded.solution.solver,
        ):
            with pytest.raises(mb.BadArgument, match="^file = .what lies between the points"):
                asked()
        assert_same(pickle.loads(pickle.dumps(loaded)).pressure, state.pressure)
    if name != "depth":  # whose surface is one point
        # layout and image, a second each, are those of any figure of its kind
        back.plot(tmp_path / "result.png" if name in WRITTEN else None)
    plt.close("all")


def assert_same(result, expected):
    if isinstance(result, np.ndarray):
        assert result.dtype == expected.dtype and np.array_equal(result, expected)
    elif isinstance(result, dict):
        assert result.keys() == expected.keys() and type(result) is type(expected)
        for name, value in result.items():
            assert_same(value, expected[name])
    else:
        assert result == expected and type(result) is type(expected)


def test_of_what_is_no_data_a_file_has_the_name(tmp_path):
    made("functions").save(tmp_path / "state.npz")
    back = mb.load(tmp_path / "state.npz")
    assert back.solid == SOLID and "lambda" in repr(back.obstacle)
    with pytest.raises(mb.BadArgument, match="has no solve: solve the problem again"):
        back.problem.solve(load=1.0)
    assert PROBLEM.solve(load=0.5, initial=back).load == 0.5  # passed over, as every other kind


def test_a_file_of_another_version_is_read_or_refused_by_its_version(tmp_path):
    """Of known parts it is read; a class or a part that this version has not is refused, both named."""
    result, file = PROBLEM.path(load=0.1), tmp_path / "path.npz"
    result.save(file)
    with np.load(file) as columns:
        written = dict(columns)
    assert written["version"] == mb.__version__
    old = {**written, "version": "0.2.7"}
    np.savez(file, **old)
    assert mb.load(file).to_dict() == result.to_dict()
    text = old["text"].item()
    for word, earlier in (("Microblock", "Miniblock"), ('"psi0_in"', '"reading"')):
        assert word in text
        np.savez(file, **{**old, "text": text.replace(word, earlier)})
        with pytest.raises(mb.BadArgument, match=rf"^file = .* version 0\.2\.7, this is {mb.__version__}"):
            mb.load(file)


def test_files_that_are_none_of_ours_are_refused(tmp_path):
    names = "os.system", "microblock.model.archive.import_module", "microblock.no.Thing"
    for number, name in enumerate(names):
        kind = list(name.rpartition(".")[::2])
        text = json.dumps({"class": kind, "parts": {"name": "antigravity"}})
        np.savez(tmp_path / f"{number}.npz", text=text)
    (tmp_path / "words").write_text("words")
    for name in ("0.npz", "1.npz", "2.npz", "words", "none"):
        with pytest.raises(mb.BadArgument, match="^file = "):
            mb.load(tmp_path / name)
    with pytest.raises(mb.BadArgument, match="^file = "):
        PROBLEM.path(load=1.0).save(tmp_path / "no" / "folder")


def test_a_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(mb.MissingExtra, match=r"microblock\[xarray\]"):
        PROBLEM.solve(load=1.0).to_xarray()


def test_pictures_are_drawn_into_an_axis_that_is_given(tmp_path):
    state, path = PROBLEM.solve(load=1.0), PROBLEM.path(load=1.0)
    history = made("friction on cells")
    for plot in (state.plot, state.plot_blocks, state.plot_below, path.plot, history.plot):
        figure, axis = plt.subplots()
        assert plot(file=tmp_path / "drawn.png", ax=axis) is figure
        assert axis.has_data() and (tmp_path / "drawn.png").stat().st_size
        plt.close("all")
    assert isinstance(state.plot(), matplotlib.figure.Figure)


@pytest.mark.parametrize("kind", ["half-space", "mesh"])
def test_pressures_of_three_dimensions_are_known_between_the_points(kind):
    """They are those of the points there, to rounding, the mean of neighbours half way, and 0 far away; what
    only a state of the plane has is refused by name.
    """
    state = on_grid() if kind == "half-space" else in_space()
    close = 1e-12 * state.pressure.max()
    assert state.pressure_at(state.points) == pytest.approx(state.pressure, abs=close)
    for name, nodal in state.pressures.items():
        assert state.pressure_at(state.points[:, :2], name) == pytest.approx(nodal, abs=close)
    middle = np.argmax(state.pressure)
    neighbour = np.argsort(np.linalg.norm(state.points - state.points[middle], axis=1))[1]
    half_way = state.points[[middle, neighbour]].mean(axis=0)
    mean = state.pressure[[middle, neighbour]].mean()
    assert state.pressure_at([half_way])[0] == pytest.approx(mean, abs=close)
    assert state.pressure_at([(1e3, 0.0)])[0] == 0 and state.zones is None and state.half_width is None
    for asked in (
        lambda: state.gap_at(next(iter(state.pressures)), 0.0),
        lambda: state.surface(),
        lambda: state.pressure_at([0.0]),
    ):
        with pytest.raises(mb.BadArgument):
            asked()


def test_a_material_near_the_largest_coupling_is_written_so_that_it_can_be_read():
    """beta = 2 is excluded, and 1.99999999 in six digits is 2."""
    near = mb.Cosserat(E=1, nu=0.3, ell=1, beta=2 - 1e-8)
    assert "eta=" in repr(near) and "beta=" not in repr(near)
    assert "beta=1.9," in repr(mb.Cosserat(E=1, nu=0.3, ell=1, beta=1.9))


def test_a_loaded_path_asks_for_no_rtol_that_nobody_has_asked_for(tmp_path):
    """The usual one came back as a number, which is obtained or refused."""
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock())
    for rtol in (None, 1e-5):
        path = problem.path(load=0.1, rtol=rtol)
        path.save(tmp_path / "path.npz")
        loaded = mb.load(tmp_path / "path.npz")
        assert (loaded.rtol, type(loaded.rtol)) == (path.rtol, type(path.rtol))
        assert loaded.events == path.events
