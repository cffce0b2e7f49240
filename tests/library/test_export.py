"""CSV and VTK: what comes back is what the state has."""

import sys

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock.data import export
from microblock.data.records import column, read_records

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
    _, first, copies = np.unique(back.points.round(12), axis=0, return_index=True, return_counts=True)
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
