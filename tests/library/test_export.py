"""CSV and VTK: what comes back is what the state has."""

import sys
from xml.etree import ElementTree

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock.data import export
from microblock.data.records import column, read_records
from microblock.fem import meshes, meshes3d

meshio = pytest.importorskip("meshio", reason="VTK needs the extra `vtk`")

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
PARTS = mb.Cylinder(R=10), mb.Microblock(psi0=0.002)


def line():
    return mb.Contact(mb.HalfPlane(SOLID), *PARTS, mb.Panels(order=8)).solve(load=1.0)


def fitted():
    return mb.Contact(mb.Block(SOLID, 18.0), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0, rtol=1e-2)


def body():
    block = occ.Rectangle(4, 2).Face().Move((-2, -2, 0))
    block.edges.Max(occ.Y).name, block.edges.Min(occ.Y).name = "contact", "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(block, dim=2).GenerateMesh(maxh=0.8))
    return mb.Contact(mb.Body(mesh, SOLID, order=3, fixed="bottom"), *PARTS).solve(load=1.0)


def cells():
    return mb.Contact(mb.HalfPlane(SOLID), *PARTS, mb.Cells(nodes=128, window=(-1, 1))).solve(load=1.0)


STATES = {"line": line, "fitted": fitted, "body": body, "cells": cells}


@pytest.fixture(scope="module", params=STATES)
def state(request):
    return STATES[request.param]()


def test_csv_comes_back_digit_by_digit(state, tmp_path):
    mb.to_csv(state, tmp_path / "state.csv")
    rows = read_records(tmp_path / "state.csv")
    for name, values in (
        ("x1", state.x),
        ("psi", state.psi),
        ("micromoment", state.micromoment),
        ("weight", state.weights),
        ("pressure", state.pressure),
        ("pressure_A", state.pressures["A"]),
        ("pressure_B", state.pressures["B"]),
    ):
        assert column(rows, name) == list(values)
    assert {row["load"] for row in rows} == {state.load} and rows[0]["version_ngsolve"]
    # that of the solvers
    assert np.dot(column(rows, "weight"), column(rows, "pressure")) == pytest.approx(1.0, rel=1e-9)


GROUND, ROLLER = mb.HalfPlane(SOLID), mb.Deformable(mb.HalfPlane(SOLID), mb.Cylinder(R=10))
LAWS = mb.Microblock(psi0=0.002), mb.Unilateral(), mb.Microclamped()


def on_grid(law, obstacle=mb.Sphere(R=1.0), period=None):
    return mb.Contact(mb.HalfSpace(SOLID, period), obstacle, law, mb.Cells(nodes=32)).solve(load=0.1)


def in_space(law, method):
    x = meshes3d.graded(reach=0.6, step=0.3, far=3.0, growth=2.0)
    sides = meshes3d.supports("bottom", x1="left", x2="front")
    body = mb.Body3D(meshes3d.block(x, x, -x[::-1], reach=0.6), SOLID, fixed=sides)
    return mb.Contact(body, mb.Sphere(R=10), law, method).solve(load=0.1)


def column_of_depth():
    column = mb.Body(meshes.line(1.0, 4), SOLID, 2, fixed={"u2": "middle"})
    return mb.Contact(column, mb.Plane(), mb.Microblock()).solve(approach=0.01)


def rubbed(body, method, law=mb.Unilateral(friction=0.3), rtol=None, obstacle=mb.Cylinder(R=10)):
    return mb.Contact(body, obstacle, law, method).history([(1.0, 0.0), (1.0, 0.1)], rtol=rtol)


def small(law, method=None, obstacle=mb.Cylinder(R=10)):
    mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    return mb.Contact(mb.Body(mesh, SOLID, 2, fixed="bottom"), obstacle, law, method)


def history_of_a_body():
    problem = small(mb.Microblock(friction=0.3))
    return problem.history([(1.0, 0.0), (1.0, 0.1)])


KINDS = {
    **{
        f"panels {law}": lambda law=law: mb.Contact(GROUND, mb.Cylinder(R=10), law).solve(load=1.0)
        for law in LAWS
    },
    "two bodies on panels": lambda: mb.Contact(GROUND, ROLLER, LAWS[0]).solve(load=1.0),
    "two bodies on cells": lambda: mb.Contact(
        GROUND, ROLLER, LAWS[1], mb.Cells(nodes=64, window=(-1, 1))
    ).solve(load=1.0),
    "period": lambda: mb.Contact(
        mb.HalfPlane(SOLID, 1.0), mb.Wave(0.01, 1.0), LAWS[2], mb.Cells(nodes=64)
    ).solve(load=0.1),
    "uniform": lambda: mb.Contact(mb.Block(SOLID, 4.0), *PARTS, mb.Uniform(h=0.2)).solve(load=1.0),
    "depth": column_of_depth,
    "newton": lambda: small(LAWS[2], mb.Newton()).solve(load=1.0),
    "friction on cells": lambda: rubbed(GROUND, mb.Cells(), rtol=0.2),
    "friction on panels": lambda: rubbed(GROUND, mb.Panels(), rtol=0.05, obstacle=ROLLER),
    "friction on a body": history_of_a_body,
    "friction by Newton": lambda: rubbed(mb.Block(SOLID, 4.0), mb.Uniform(h=0.2, newton=mb.Newton())),
    **{f"half-space {law}": lambda law=law: on_grid(law) for law in LAWS},
    **{f"half-space of a period {law}": lambda law=law: on_grid(law, period=2.0) for law in LAWS},
    "two half-spaces": lambda: on_grid(LAWS[0], mb.Deformable(mb.HalfSpace(SOLID), mb.Sphere(R=1.0))),
    **{f"in space {law}": lambda law=law: in_space(law, mb.Condensed()) for law in LAWS},
    "in space by Newton": lambda: in_space(LAWS[0], mb.Newton()),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_state_comes_back_whole(kind, tmp_path):
    """All arrays and numbers that a state has, to the last digit, from the table and from the surface."""
    made = KINDS[kind]()
    states = made.states if isinstance(made, mb.History) else [made]
    mb.to_csv(made, tmp_path / "state.csv")
    rows = read_records(tmp_path / "state.csv")
    written = mb.to_vtk(made, tmp_path / "state.vtu")
    assert all(len(meshio.read(file).points) for file in written if file.suffix == ".vtu")
    files = [file for file in written if "surface" in file.name]
    assert len(files) == len(states)
    for number, (state, file) in enumerate(zip(states, files)):
        own = [row for row in rows if row.get("state", 0) == number]
        surface = meshio.read(file)
        expected = {f"pressure_{name}": values for name, values in state.pressures.items()}
        if isinstance(state, mb.State):
            x1, x2 = state.x, state.solution.points[:, 1]
            expected |= {"micromoment": state.micromoment, "psi": state.psi}
            expected |= {"displacement": state.solution.displacement}
        else:
            x1, x2 = (
                np.meshgrid(state.x1, state.x2, indexing="ij")
                if state.pressure.ndim == 2
                else (state.x1, state.x2)
            )
            expected |= dict(zip(("m1", "m2", "psi1", "psi2"), (*state.micromoment, *state.psi)))
            expected |= {"displacement": state.displacement, "closed": state.closed}
        if "friction" in kind:
            expected |= {"shear_traction": state.shear_traction, "slip": state.slip}
        if "two" in kind or kind == "friction on panels":
            plane = isinstance(state, mb.State)
            above = state.counter_displacement(state.x) if plane else state.counter_displacement
            expected |= {"counter_displacement": above}
        for name, values in {"x1": x1, "x2": x2, **expected}.items():
            assert np.array_equal(column(own, name), np.ravel(values)), name
        for name, values in {"weight": state.weights, "pressure": state.pressure, **expected}.items():
            assert np.array_equal(surface.point_data[name].ravel(), np.ravel(values)), name
        assert np.array_equal(surface.points[:, 0], np.ravel(x1))
        assert np.array_equal(surface.points[:, 1], np.ravel(x2))
        assert all(len(block.data) for block in surface.cells)
        names = ["load", "approach", "error_estimate", "energy", "residual", "method"]
        names += ["shear", "tangential_approach", "dissipation", "work"] * ("friction" in kind)
        assert {name: own[0][name] for name in names} == {name: getattr(state, name) for name in names}
        assert (own[0]["warnings"] or "") == "; ".join(state.warnings)


def test_a_history_is_a_series_in_time(tmp_path):
    history = history_of_a_body()
    series, *files = mb.to_vtk(history, tmp_path / "loop")
    sets = ElementTree.parse(series).getroot().iter("DataSet")
    listed = [(float(one.get("timestep")), int(one.get("part")), one.get("file")) for one in sets]
    assert listed == [(i // 2, i % 2, file.name) for i, file in enumerate(files)] and len(files) == 4
    # the file of the body
    stress = meshio.read(files[3]).point_data["stress"]
    assert stress.shape[1] == 4 and np.abs(stress).max() > 1.0


def test_events_are_a_table(tmp_path):
    history = rubbed(GROUND, mb.Cells(), rtol=0.2)
    mb.to_csv(history.events, tmp_path / "events.csv")
    rows = read_records(tmp_path / "events.csv")
    assert [row["kind"] for row in rows] == [event.kind for event in history.events]


def test_fields_in_space_come_back(tmp_path):
    state = in_space(LAWS[0], mb.Condensed())
    back = meshio.read(mb.to_vtk(state, tmp_path / "state")[1])
    mesh = state.fields.body.mesh
    number = int(np.argmin(np.linalg.norm(back.points - (0.1, 0.1, -0.1), axis=1)))
    there = state.fields.u(mesh(*back.points[number]))
    # continuous, so that it does not matter of which element the point is: rounding
    assert back.point_data["u"][number] == pytest.approx(there, rel=1e-9)
    assert back.point_data["stress"].shape[1] == back.point_data["couple_stress"].shape[1] == 9


def test_no_line_crosses_a_gap_between_parts_of_a_body(tmp_path):
    state = small(LAWS[1]).solve(load=1.0)
    state.solution.nodes.apart[3] = True
    lines = meshio.read(mb.to_vtk(state, tmp_path / "state")[0]).cells_dict["line"].tolist()
    assert [3, 4] not in lines and len(lines) == len(state.x) - 2


def test_surface_comes_back(state, tmp_path):
    surface = meshio.read(mb.to_vtk(state, tmp_path / "state")[0])
    for name, values in export.profile(state).items():
        back = surface.points[:, 1] if name == "x2" else surface.point_data[name].ravel()
        assert np.array_equal(back, values), name
    ends = surface.points[surface.cells_dict["line"], 0]
    assert (ends[:, 1] > ends[:, 0]).all()


def test_no_line_crosses_a_gap(tmp_path):
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.5)
    state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10), mb.Microblock()).solve(load=1.0)
    gap = state.zones["A"][0][1], state.zones["B"][0][0]  # A is on the left alone, B on the right
    surface = meshio.read(mb.to_vtk(state, tmp_path / "state", x1=[0.0, 1.0], x2=[-1.0, 0.0])[0])
    ends = surface.points[surface.cells_dict["line"], 0]
    left, right = sorted(gap)
    assert right - left > 0.05 and not np.any((ends[:, 0] <= left) & (ends[:, 1] >= right))


def test_fields_below_a_half_plane_come_back(tmp_path):
    state, x1, x2 = line(), np.array([-0.3, 0.0, 0.2]), np.array([-1.0, -0.1, 0.0])
    grid = meshio.read(mb.to_vtk(state, tmp_path / "state", x1=x1, x2=x2)[1])
    assert [len(block.data) for block in grid.cells] == [4]
    data = [grid.point_data[name] for name in ("u", "psi", "stress", "couple_stress")]
    for point, *values in zip(grid.points, *data):
        found = state.fields(point[:1], point[1])
        own = (*found.u[:, 0], 0), found.psi, found.stress[:, :, 0].ravel(), found.couple_stress[:, 0]
        for back, value in zip(values, own):
            size = np.abs(found.stress).max()
            assert np.ravel(back) == pytest.approx(np.ravel(value), rel=1e-9, abs=1e-9 * size)
            # the sums over sources are taken together, so that rounding differs


def test_the_usual_grid_holds_the_contact(tmp_path):
    state = line()
    points = meshio.read(mb.to_vtk(state, tmp_path / "state")[1]).points
    edges = [edge for zones in state.zones.values() for zone in zones for edge in zone]
    assert points[:, 0].min() < min(edges) and points[:, 0].max() > max(edges)
    assert points[:, 1].max() == 0 and points[:, 1].min() < min(edges) - max(edges)


@pytest.mark.parametrize("made", [body, fitted])
def test_fields_of_meshes_come_back(made, tmp_path):
    fields = made().fields
    mesh = fields.body.mesh
    back = meshio.read(mb.to_vtk(made(), tmp_path / "state")[1])
    x1, x2, _ = back.points.T
    _, first, copies = np.unique(back.points.round(9), axis=0, return_index=True, return_counts=True)
    inner = first[copies == 1]  # within one element: elsewhere a point has the stresses of its neighbours
    inner = inner[(x2[inner] < -1e-9) & (x2[inner] > x2.min())]
    inner = inner[(x1[inner] > x1.min()) & (x1[inner] < x1.max())]
    assert len(inner) > mesh.ne
    for name, field in (
        ("psi", fields.psi),
        ("u", ng.CF((fields.u1, fields.u2, 0))),
        ("stress", fields.stress),
        ("couple_stress", fields.couple_stress),
    ):
        there = field(mesh(x1[inner], x2[inner])).reshape(len(inner), -1)
        size = np.abs(there).max()
        # rounding
        assert np.abs(back.point_data[name].reshape(len(x1), -1)[inner] - there).max() < 1e-9 * size, name
    area = sum(area_of(back.points[own.data, :2]) for own in back.cells)
    assert area == pytest.approx(ng.Integrate(1, mesh), rel=1e-9)  # straight sides: rounding


def area_of(polygons):
    """Sum of the areas of polygons, array (n, corners, 2)."""
    after = np.roll(polygons, -1, axis=1)
    return (
        np.abs(np.sum(polygons[..., 0] * after[..., 1] - polygons[..., 1] * after[..., 0], axis=1)).sum() / 2
    )


def test_without_meshio_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)  # as if it were not installed
    with pytest.raises(mb.MissingExtra, match="vtk"):
        mb.to_vtk(cells(), tmp_path / "state")


def test_a_grid_is_of_a_half_plane_alone(tmp_path):
    with pytest.raises(mb.BadArgument, match="own nodes"):
        mb.to_vtk(cells(), tmp_path / "state", x1=[0.0])
    with pytest.raises(mb.BadArgument, match="above the surface"):
        mb.to_vtk(line(), tmp_path / "state", x2=[-1.0, 0.1])
