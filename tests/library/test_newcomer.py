"""What someone who works with the library for the first time ran into."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest

import microblock as mb
from microblock import BadArgument
from microblock.data.records import read_records
from microblock.model.law import Law
from microblock.view import blocks

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW = mb.Microblock()


def rectangle(left, low, width, height, size):
    face = occ.MoveTo(left, low).Rectangle(width, height).Face()
    face.edges.Min(occ.Y).name = "bottom"
    face.edges.Max(occ.Y).name = "contact"
    face.edges.Max(occ.Y).maxh = size
    return ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=height / 4))


@pytest.fixture(scope="module")
def posts():
    """A body whose contact boundary has two pieces, [-1.5, -0.5] and [0.5, 1.5]."""
    face = (
        occ.MoveTo(-2, -2).Rectangle(4, 1).Face()
        + occ.MoveTo(-1.5, -1).Rectangle(1, 1).Face()
        + occ.MoveTo(0.5, -1).Rectangle(1, 1).Face()
    )
    face.edges.Min(occ.Y).name = "bottom"
    for edge in face.edges:
        if abs(edge.center.y) < 1e-9:
            edge.name, edge.maxh = "contact", 0.1
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.4))
    return mb.Body(mesh, SOLID, order=3, fixed="bottom")


@pytest.fixture(scope="module")
def block():
    return mb.Body(rectangle(-1, -1, 2, 1, 0.05), SOLID, order=2, fixed="bottom")


@pytest.mark.parametrize("method", [None, mb.Newton("al")])
def test_zones_end_where_the_contact_boundary_is_interrupted(posts, method):
    state = mb.Contact(posts, mb.Plane(), LAW, method).solve(load=1.0)
    assert state.zones["contact"] == [
        pytest.approx((-1.5, -0.5), abs=1e-12),
        pytest.approx((0.5, 1.5), abs=1e-12),
    ]
    assert state.pressure_at([0.0, 0.3]) == pytest.approx(0.0, abs=0)
    with pytest.raises(BadArgument, match="without its interruptions"):
        state.gap_at("A", 0.0)


def test_a_mesh_with_interruptions_is_refined(posts):
    state = mb.Contact(posts, mb.Cylinder(10.0), mb.Unilateral()).solve(load=1.0, rtol=0.05)
    assert state.error_estimate <= 0.05 and len(state.zones["contact"]) == 2


def test_events_on_a_mesh_have_an_error_that_holds():
    """The half-plane has the reference: its full zone is born at 0.08958; a body of 6 changes 1 %."""
    reference = next(
        event.load
        for event in mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), LAW).path(0.2).events
        if event.zone == "full"
    )
    body = mb.Body(rectangle(-3, -6, 6, 6, 0.1), SOLID, order=3, fixed="bottom")
    for rtol in (None, 0.02):
        events = mb.Contact(body, mb.Cylinder(10.0), LAW).path(0.2, rtol=rtol).events
        full = next(event for event in events if event.zone == "full")
        # nodes are a third of the contact's half-width apart: such a mesh says little, and says so
        assert abs(full.load - reference) < full.load_error + 0.01 * reference < 0.85 * reference


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
def test_narrow_numbers_of_numpy_are_plain_ones(kind):
    """200^2 is 64 as an unsigned number of eight bits."""
    states = [
        mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(R=number(200)), LAW).solve(load=number(100))
        for number in (kind, float)
    ]
    assert states[0].half_width == states[1].half_width
    cells = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10), LAW, mb.Cells(nodes=np.int16(64)))
    assert cells.solve(load=np.int8(100)).half_width == cells.solve(load=np.array(100.0)).half_width
    assert isinstance(mb.Sphere(R=kind(200)).R, int | float)


@pytest.mark.parametrize("body", [mb.HalfPlane(SOLID), mb.Block(SOLID, 6.0)])
def test_fields_take_points_of_any_shape(body):
    fields = mb.Contact(body, mb.Cylinder(10.0), LAW).solve(load=1.0).fields
    x1, x2 = np.meshgrid(np.linspace(-0.2, 0.2, 4), [-0.1, -0.2, -0.3])
    grid, flat = fields(x1, x2), fields(x1.ravel(), x2.ravel())
    assert grid.psi.shape == grid.shear.shape == (3, 4) and grid.stress.shape == (2, 2, 3, 4)
    assert np.array_equal(grid.stress.reshape(2, 2, -1), flat.stress)
    with pytest.raises(BadArgument, match="broadcast"):
        fields([1, 2], [-1, -2, -3])


def test_files_get_an_ending_and_a_folder_that_exists(tmp_path):
    state = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), LAW).solve(load=1.0)
    state.plot(tmp_path / "load_0.5")
    assert [each.name for each in tmp_path.iterdir()] == ["load_0.5.png"]
    for write in (
        lambda: state.plot(tmp_path),
        lambda: state.plot(tmp_path / "no" / "x.png"),
        lambda: mb.to_csv(state, tmp_path / "no" / "x.csv"),
        lambda: mb.to_vtk(state, tmp_path / "no" / "x"),
    ):
        with pytest.raises(BadArgument, match="^path"):
            write()
    with pytest.raises(BadArgument, match="^state"):
        mb.to_vtk("x", state)
    assert len(list(tmp_path.iterdir())) == 1


def test_a_state_of_a_half_space_is_exported(tmp_path):
    meshio = pytest.importorskip("meshio", reason="files for ParaView need the extra vtk")
    state = mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), LAW, mb.Cells(nodes=32)).solve(load=1.0)
    mb.to_csv(state, tmp_path / "cells.csv")
    rows = read_records(tmp_path / "cells.csv")
    assert len(rows) == 32**2
    assert sum(row["weight"] * row["pressure"] for row in rows) == pytest.approx(1.0, rel=1e-12)
    (surface,) = mb.to_vtk(state, tmp_path / "cells.vtu")
    assert surface.name == "cells_surface.vtu"
    assert meshio.read(surface).point_data["pressure"].max() == pytest.approx(state.pressure.max(), rel=1e-12)


def test_functions_of_a_user_may_be_vectorized_or_write_into_their_argument():
    def writes(x):
        x *= x
        return x / 20

    def tilts(x):
        x *= 0.01
        return x

    body = mb.HalfPlane(SOLID)
    kinked = np.vectorize(lambda x: x**2 / 20 if x > 0 else x**2 / 10)  # no otypes: fails for no points
    assert mb.Contact(body, kinked, LAW).solve(load=1.0).error_estimate <= 1e-3
    alike = (
        (mb.Contact(body, writes, LAW), mb.Contact(body, lambda x: x**2 / 20, LAW)),
        (
            mb.Contact(body, mb.Cylinder(10.0), mb.Microblock(tilts)),
            mb.Contact(body, mb.Cylinder(10.0), mb.Microblock(lambda x: 0.01 * x)),
        ),
    )
    for one, other in alike:
        assert one.solve(load=1.0).half_width == pytest.approx(other.solve(load=1.0).half_width, rel=1e-12)


def test_an_obstacle_that_begins_inside_the_body_warns():
    body = mb.Body(rectangle(-1, 3, 2, 2, 0.2), SOLID, fixed="bottom")
    state = mb.Contact(body, mb.Cylinder(10.0), LAW).solve(approach=0.02)
    assert any("deep into a body" in words for words in state.warnings)


def test_values_of_a_state_are_to_read():
    state = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), LAW).solve(load=1.0)
    for values in (
        state.x,
        state.weights,
        state.pressure,
        state.pressures["A"],
        state.psi,
        state.micromoment,
    ):
        with pytest.raises(ValueError, match="read-only"):
            values[:] = 7.0


def test_pictures_of_full_contact_show_no_rounding(block, posts):
    """Gaps and rotations of 1e-17 are nothing: all corners are marked, nothing is magnified."""
    state = mb.Contact(block, mb.Plane(), LAW).solve(load=1.0)
    shown = blocks.blocks(state.surface(), state.zones["contact"])
    assert shown.closed.all() and shown.magnification == 1.0
    apart = mb.Contact(posts, mb.Plane(), LAW).solve(load=1.0)
    shown = blocks.blocks(apart.surface(), apart.zones["contact"], (-1.0, 1.0))
    middles = shown.squares[:, :2, 0].mean(axis=1)
    assert len(middles) and np.all(np.abs(middles) >= 0.5) and np.isnan(shown.surface).any()
    (line,) = {id(line): line for line in apart.plot().axes[1].lines if len(line.get_xdata()) > 5}.values()
    assert np.isnan(line.get_ydata()).sum() == 1  # a line that breaks once


class Reversed(Law):
    """The law of microblocks, with its gaps in another order."""

    corners, shifts = ("A", "B"), mb.Microblock().shifts

    def levers(self, x):
        return mb.Microblock().levers(x)

    def initial_gaps(self, points, normals, ell, obstacle):
        return dict(reversed(mb.Microblock().initial_gaps(points, normals, ell, obstacle).items()))


class Heel(Reversed):
    corners = ("heel", "toe")

    def levers(self, x):
        return dict(zip(self.corners, mb.Microblock().levers(x).values()))

    def initial_gaps(self, points, normals, ell, obstacle):
        return dict(zip(self.corners, mb.Microblock().initial_gaps(points, normals, ell, obstacle).values()))


class Bounded:
    """A parabola that ends, although its height goes on."""

    ends = (-0.3, 0.3)
    R = "no radius"

    def height(self, x):
        return x**2


def test_a_law_with_corners_in_another_order_is_refused():
    with pytest.raises(BadArgument, match="initial_gaps.*in the order A, B"):
        mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), Reversed())


def test_corners_of_other_names_are_shown(block):
    state = mb.Contact(block, mb.Cylinder(10.0), Heel()).solve(load=0.5)
    usual = mb.Contact(block, mb.Cylinder(10.0), LAW).solve(load=0.5)
    assert state.zones["toe"] == usual.zones["B"] and "corner toe closed" in state._repr_html_()


def test_an_obstacle_ends_where_it_says():
    """Corners touch it up to its ends: contact points lie half a block further."""
    state = mb.Contact(mb.HalfPlane(SOLID), Bounded(), LAW).solve(load=100.0)
    half = 0.3 + SOLID.ell / 2
    contact = state.zones["contact"]
    assert (contact[0][0], contact[-1][1]) == pytest.approx((-half, half), rel=1e-9)
    assert "Hertz" not in state._repr_html_()  # an attribute R makes no cylinder


def test_a_zone_over_the_end_of_a_period_is_one():
    """The same waves, begun at a valley and at a peak: the zones differ by half a period and nothing else."""
    body = mb.HalfPlane(SOLID, period=1.0)
    shifted = mb.Contact(body, lambda x: 0.01 * (1 + np.cos(2 * np.pi * x)), mb.Microblock(), mb.Cells(1024))
    state = shifted.solve(load=0.5)
    other = shifted.with_(obstacle=lambda x: 0.01 * (1 - np.cos(2 * np.pi * x))).solve(load=0.5)
    assert [len(state.zones[name]) for name in ("A", "B", "full", "contact")] == [1, 1, 1, 1]
    # a cell, by which the same rounding may fall
    assert state.half_width == pytest.approx(other.half_width, abs=1 / 1024)
    ((left, right),) = state.zones["contact"]
    assert left < 0.5 < right and (left + right) / 2 == pytest.approx(0.5, abs=1 / 1024)
    state.plot()


@pytest.mark.parametrize("order, top", [(3, 0.15), (4, 0.08), (2, 0.02)])
def test_errors_of_events_on_a_mesh_hold_where_edges_of_two_corners_cross(order, top):
    """That load converges like the distance of the nodes to the power 0.64, not like the distance."""
    from netgen.occ import OCCGeometry, Rectangle, Y

    face = Rectangle(6, 3).Face().Move((-3, -3, 0))
    face.edges.Max(Y).name, face.edges.Min(Y).name, face.edges.Max(Y).maxh = "contact", "bottom", top
    mesh = ng.Mesh(OCCGeometry(face, dim=2).GenerateMesh(maxh=0.5))
    body = mb.Body(mesh, SOLID, order=order, fixed="bottom")
    (event,) = [
        event
        for event in mb.Contact(body, mb.Cylinder(10.0), mb.Microblock()).path(load=0.3).events
        if (event.zone, event.kind) == ("full", "born")
    ]
    # of the fitted elements of a block of this size, which has an error of 0.003
    assert abs(event.load - 0.0893) <= event.load_error + 0.003


def test_one_place_gives_one_number():
    state = mb.Contact(mb.HalfPlane(SOLID), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0)
    assert f"{state.pressure_at(0.0):.3f} {state.gap_at('A', 1.0):.3f} {state.fields(0.0, -0.5).psi:.3f}"
    assert np.shape(state.pressure_at(0.0)) == () and np.shape(state.pressure_at([0.0])) == (1,)
