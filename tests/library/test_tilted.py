"""Tilted and curved contact boundaries in space, and obstacles that overlap a body before they move."""

import re

import netgen.meshing as netgen
import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from microblock.fem import meshes3d
from microblock.fem.bore import Bore
from microblock.fem.contact_nodes import ContactNodes
from microblock.model.corner_geometry import Blocks
from microblock.model.law import side_directions
from tests.parts import SOLID, UNILATERAL

METHODS = pytest.mark.parametrize("method", [mb.Condensed(), mb.Newton()], ids=["condensed", "newton"])
CUBE = np.array(list(np.ndindex(2, 2, 2)))[[0, 4, 6, 2, 1, 5, 7, 3]]  # in netgen's order
SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])


# --- corners of blocks


def test_sides_of_blocks_are_those_of_the_docstring():
    """e1 and e2 to the last digit on a level surface, orthonormal with n everywhere, also along e1."""
    assert np.array_equal(side_directions(np.array([[0.0, 0.0, 1.0]])), np.eye(3)[:2, None])
    normals = np.array([(0.3, -0.4, 0.8), (0.6, 0.0, 0.8), (1.0, 0.0, 0.0), (-0.999, 0.01, 0.1), (0, 1.0, 0)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    t1, t2 = side_directions(normals)
    frames = np.stack((t1, t2, normals), axis=1)
    assert frames @ np.swapaxes(frames, 1, 2) == pytest.approx(np.tile(np.eye(3), (5, 1, 1)), abs=1e-15)
    assert np.linalg.det(frames) == pytest.approx(1.0)
    assert t1[1] == pytest.approx((0.8, 0.0, -0.6), abs=1e-15)  # x1 in the tangent plane
    assert t1[2] == pytest.approx((0, 0, -1), abs=1e-15) and t2[2] == pytest.approx((0, 1, 0), abs=1e-15)
    quarter = np.array([(0, -1, 0), (1, 0, 0), (0, 0, 1)])
    assert side_directions(normals @ quarter.T)[1] == pytest.approx(t1 @ quarter.T, abs=1e-15)
    assert np.isfinite(side_directions(np.array([[0.0, 0.0, -1.0]]))).all()


@pytest.mark.parametrize("psi0", [0.0, 0.1])
def test_blocks_tilted_about_x2_are_those_of_the_plane(psi0):
    """With the tangent (0.8, -0.6): corners, levers and gaps of "--" and "-+" are A's, of the others B's."""
    in_space = Blocks(mb.Microblock(psi0), 0.5, in_space=True)
    normals = np.array([(0.6, 0.0, 0.8)])
    geometry = in_space.under(lambda x1, x2: 1 + x1**2, np.array([(0.2, 0.7, 0.1)]), normals)
    plane = Blocks(mb.Microblock(psi0), 0.5).under(
        lambda x: 1 + x**2, np.array([(0.2, 0.1)]), normals[:, [0, 2]]
    )
    assert geometry.initial_gaps[[0, 1, 2, 3], 0] == pytest.approx(plane.initial_gaps[[0, 0, 1, 1], 0])
    arms = geometry.offsets_from_centre[:, 0]
    assert arms[:, [0, 2]] == pytest.approx(plane.offsets_from_centre[[0, 0, 1, 1], 0])
    assert arms[:, 1] == pytest.approx([-0.25, 0.25, -0.25, 0.25])
    # a rotation about -e2 is that of the plane
    turned = geometry.rotated(np.array([[0.0], [-0.02]]))[:, 0]
    assert turned == pytest.approx(plane.rotated(np.array([0.02]))[[0, 0, 1, 1], 0])
    # (21): a corner moves by psi x arm, about all axes of the block
    psi = np.array([(0.01, -0.02, 0.03)])
    sides = np.array(side_directions(normals))[:, 0]
    moved = np.cross(psi, arms) @ normals[0]
    assert geometry.rotated(sides @ psi.T)[:, 0] == pytest.approx(-moved)


# --- patch tests: hydrostatic pressure


def under_a_plane(sides, pieces):
    """The corner of a cube below a plane with these intercepts: hexahedra, four at its vertices, each cut in
    pieces**3, or for pieces = 0 tetrahedra. Boundaries are "contact", "x1", "x2" and "x3".
    """
    mesh = netgen.Mesh(dim=3)
    for number, name in enumerate(("contact", "x1", "x2", "x3"), start=1):
        mesh.Add(netgen.FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
    vertices = np.vstack((np.zeros(3), np.diag(sides)))
    numbers = {}

    def point(place):
        key = tuple(np.round(place, 9))
        if key not in numbers:
            numbers[key] = mesh.Add(netgen.MeshPoint(netgen.Pnt(*place)))
        return numbers[key]

    if not pieces:
        mesh.Add(netgen.Element3D(1, [point(vertices[i]) for i in (0, 1, 3, 2)]))
        for opposite in range(4):
            mesh.Add(netgen.Element2D(opposite + 1, [point(vertices[i]) for i in range(4) if i != opposite]))
        refined = ng.Mesh(mesh)
        refined.Refine()
        refined.Refine()
        return refined
    for vertex, others in ((0, (1, 2, 3)), (1, (0, 3, 2)), (2, (0, 1, 3)), (3, (0, 2, 1))):
        corners = [vertices[[vertex, *np.array(others)[flags > 0]]].mean(axis=0) for flags in CUBE]

        def at(place, corners=np.array(corners)):
            return point(np.prod(np.where(CUBE, place, 1 - place), axis=1) @ corners)

        for cell in np.ndindex(pieces, pieces, pieces):
            mesh.Add(netgen.Element3D(1, [at((cell + corner) / pieces) for corner in CUBE]))
        for axis, opposite in enumerate(others):
            for cell in np.ndindex(pieces, pieces):
                square = np.insert((cell + SQUARE) / pieces, axis, 0.0, axis=1)
                mesh.Add(netgen.Element2D(opposite + 1, [at(place) for place in square]))
    return ng.Mesh(mesh)


STRAIN = 1e-3
PRESSURE = (3 * SOLID.lam + 2 * SOLID.mu) * STRAIN


@METHODS
@pytest.mark.parametrize(
    "pieces, order", [(2, 1), (1, 2), (0, 1)], ids=["hexahedra", "order 2", "tetrahedra"]
)
def test_a_tilted_facet_passes_the_patch_test(pieces, order, method):
    """u = -strain x between rollers, under the same plane a little higher; facets are no parallelograms."""
    fixed = {"u1": "x1", "u2": "x2", "u3": "x3", "psi1": "x2|x3", "psi2": "x1|x3", "psi3": "x1|x2"}
    body = mb.Body(under_a_plane((2.0, 3.0, 1.0), pieces), SOLID, order, fixed=fixed)

    def height(x1, x2):
        return 1 - x1 / 2 - x2 / 3 + 0.01 - STRAIN  # (d - strain) n3 = d n3 - u.n

    state = mb.Contact(body, height, mb.Microblock(), method).solve(approach=0.01)
    assert state.normals == pytest.approx(np.tile(np.array((3, 2, 6)) / 7, (len(state.weights), 1)))
    assert state.pressure == pytest.approx(PRESSURE, rel=1e-7)  # the residual of the conditions
    assert state.load == pytest.approx(3 * PRESSURE, rel=1e-8)  # 3 is the area seen from above
    assert state.energy == pytest.approx(1.5 * PRESSURE * STRAIN, rel=1e-7)  # of a unit volume
    assert state.pressure_at([(0.3, 0.3), (1.9, 2.9)]) == pytest.approx([PRESSURE, 0.0], rel=1e-7)
    loaded = mb.Contact(body, height, UNILATERAL, method).solve(load=state.load)
    assert loaded.approach == pytest.approx(0.01, rel=1e-7)
    assert loaded.reaction(".*").force == pytest.approx(PRESSURE * np.array((1.5, 1.0, 3.0)), rel=1e-7)


@METHODS
def test_the_patch_test_passes_over_an_edge_between_facets(method):
    """One node on the edge, with the mean normal and the length of the sum of area vectors as its weight."""
    outline = np.array([(0, 0), (2, 0), (1.2, 0.7), (0, 1)])
    sketch = occ.WorkPlane(occ.Axes((0, 0, 0), n=-occ.Y, h=occ.X)).MoveTo(0, 0)
    for corner in outline[1:]:
        sketch = sketch.LineTo(*corner)
    prism = sketch.Close().Face().Extrude(0.4 * occ.Y)
    for face, name in ((occ.X, "x1"), (occ.Z, "x3")):
        prism.faces.Min(face).name = name
    prism.faces.Min(occ.Y).name = prism.faces.Max(occ.Y).name = "x2"
    for face in prism.faces:
        if face.name not in ("x1", "x2", "x3"):
            face.name = "steep" if face.center.x > 1.2 else "gentle"
    mesh = ng.Mesh(occ.OCCGeometry(prism).GenerateMesh(maxh=0.5))
    fixed = {"u1": "x1", "u2": "x2", "u3": "x3", "psi1": "x2|x3", "psi2": "x1|x3", "psi3": "x1|x2"}
    body = mb.Body(mesh, SOLID, 1, fixed=fixed, contact="gentle|steep")
    nodes = ContactNodes(body)
    lifts = 0.01 - STRAIN * np.sum(nodes.normals * nodes.points, axis=1) / nodes.normals[:, 2]
    on_edge = np.abs(nodes.points[:, 0] - 1.2) < 1e-9

    def height(x1, x2):
        """Higher than the surface by d - strain n.x/n3, on the edge of the mean normals of its nodes."""
        surface = np.interp(x1, outline[[3, 2, 1], 0], outline[[3, 2, 1], 1])
        order = np.argsort(nodes.points[on_edge, 1])
        edge = np.interp(x2, nodes.points[on_edge, 1][order], lifts[on_edge][order])
        beside = np.where(
            x1 < 1.2, lifts[np.argmin(nodes.points[:, 0])], lifts[np.argmax(nodes.points[:, 0])]
        )
        return surface + np.where(np.abs(x1 - 1.2) < 1e-9, edge, beside)

    state = mb.Contact(body, height, UNILATERAL, method).solve(approach=0.01)
    pressure = 2 * (SOLID.lam + SOLID.mu) * STRAIN  # with no strain along x2
    assert on_edge.sum() >= 2 and np.ptp(lifts) > 1e-4
    assert state.load == pytest.approx(pressure * 2 * 0.4, rel=1e-6)
    assert state.pressure == pytest.approx(pressure, rel=1e-6)


# --- what a scene does not depend upon


def curved(x1, x2):
    return 1 - 0.2 * x1**2 - 0.1 * x2**2 + 0.1 * x1 * x2 + 0.15 * x1


def domed(move, n=4):
    """A block with a curved top, whose vertices are moved."""

    def mapped(x, y, z):
        x1 = 2 * x - 1
        x2 = 2 * y - 1
        return tuple(move(np.array((x1, x2, z * curved(x1, x2)))))

    return MakeStructured3DMesh(nx=n, ny=n, nz=2, mapping=mapped)


def lifted(x1, x2):
    """As curved as the surface, about."""
    return curved(x1, x2) + 0.02 * (x1 - 0.2) ** 2 + 0.03 * (x2 + 0.1) ** 2


def rotation(degrees):
    cos = np.cos(np.radians(degrees))
    sin = np.sin(np.radians(degrees))
    return np.array([(cos, -sin, 0), (sin, cos, 0), (0, 0, 1)])


MOTIONS = {
    "17 degrees": rotation(17),
    "45 degrees": rotation(45),
    "90 degrees": rotation(90),
    "mirror": np.diag((-1.0, 1.0, 1.0)),
    "other mirror": np.array([(0.0, 1, 0), (1, 0, 0), (0, 0, 1)]),
    "millimetres": 1000 * np.eye(3),
}


def pressed(law, motion=np.eye(3)):
    """Approach over length, and pressures in the order of the places before the motion."""
    scale = motion[2, 2]
    back = np.linalg.inv(motion)

    def height(x1, x2):
        place = np.tensordot(back[:2, :2], np.array((x1, x2)), axes=1)
        return scale * lifted(*place)

    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1 * scale)
    body = mb.Body(domed(lambda place: motion @ place), solid, 1, fixed="bottom", contact="top")
    state = mb.Contact(body, height, law).solve(load=6.0 * scale**2)
    order = np.lexsort(np.round(state.points @ back.T, 6).T)
    assert state.normals[:, 2].min() < 0.97
    return np.append(state.pressure[order], state.approach / scale)


@pytest.mark.parametrize("name", MOTIONS)
def test_a_scene_is_the_same_wherever_it_is_seen_from(name):
    """Rotated about the direction of the load, mirrored, in other units; rounding of the factors is left."""
    for law in (UNILATERAL, mb.Microclamped()):
        expected = pressed(law)
        assert np.count_nonzero(expected) > 5
        assert pressed(law, MOTIONS[name]) == pytest.approx(expected, abs=1e-9 * expected.max())


@pytest.mark.parametrize("name", ["mirror", "other mirror", "90 degrees", "millimetres"])
def test_square_blocks_are_the_same_from_all_four_sides(name):
    """With the direction of x1 in the tangent plane as t1, and t2 = n x t1, a quarter turn cost 6e-3."""
    expected = pressed(mb.Microblock())
    assert pressed(mb.Microblock(), MOTIONS[name]) == pytest.approx(expected, abs=1e-8 * expected.max())


def test_square_blocks_are_not_round():
    """On the diagonal they have other arms: what is turned by 45 degrees differs by a twentieth."""
    expected = pressed(mb.Microblock())
    difference = np.abs(pressed(mb.Microblock(), MOTIONS["45 degrees"]) - expected).max()
    assert 0.01 < difference / expected.max() < 0.1


# --- against the plane, and against Hertz


def arch(x, z):
    place = 1.6 * x - 0.8
    return place, z * np.sqrt(1 - place**2)


@METHODS
@pytest.mark.parametrize("law", [UNILATERAL, mb.Microblock(0.02), mb.Microclamped()], ids=str)
def test_an_arch_in_space_is_that_of_the_plane(law, method):
    """Load, psi and displacement are those per length; pressures are forces over areas, which are lengths of
    sums of vectors in space, and sums of lengths in the plane.
    """
    flat = MakeStructured2DMesh(nx=8, ny=3, mapping=arch)
    deep = MakeStructured3DMesh(
        nx=8, ny=1, nz=3, mapping=lambda x, y, z: (arch(x, z)[0], 0.5 * y, arch(x, z)[1])
    )
    in_plane = mb.Body(flat, SOLID, 1, fixed="bottom", contact="top")
    planes = "left|right|bottom"
    fixed = {"u1": "bottom", "u2": planes, "u3": "bottom", "psi1": planes, "psi2": "bottom", "psi3": planes}
    in_space = mb.Body(deep, SOLID, 1, fixed=fixed, contact="top")
    expected = mb.Contact(in_plane, mb.Plane(1.0), law).solve(approach=0.06)
    state = mb.Contact(in_space, lambda x1, x2: 1.0 + 0 * x1, law, method).solve(approach=0.06)
    assert state.load == pytest.approx(0.5 * expected.load, rel=1e-7)  # the residual of the conditions
    nodes = np.argmin(np.abs(state.x1[:, None] - expected.x), axis=1)
    moved = np.abs(expected.displacement).max()
    assert state.displacement == pytest.approx(expected.displacement[nodes], abs=1e-7 * moved)
    assert -state.psi[:, 1] == pytest.approx(expected.psi[nodes], abs=1e-6 * moved / SOLID.ell)
    ratio = (state.weights / 0.25) / expected.weights[nodes]
    assert ratio.min() > 0.98
    assert ratio * state.pressure == pytest.approx(
        expected.pressure[nodes], abs=1e-6 * expected.pressure.max()
    )
    moment = np.abs(expected.micromoment).max(initial=1e-9)
    assert -ratio * state.micromoment[:, 1] == pytest.approx(expected.micromoment[nodes], abs=1e-6 * moment)


def test_a_ball_of_curved_elements_on_a_rigid_plane_is_that_of_hertz():
    """A quarter, with 3 elements of order 2 along the radius of contact: the error is that of the mesh."""
    ball = occ.Sphere(occ.Pnt(0, 0, -1), 1.0) * occ.Box(occ.Pnt(0, 0, -0.6), occ.Pnt(2, 2, 1))
    for face in ball.faces:
        face.name = "contact"
    for axis, name in ((occ.X, "x1"), (occ.Y, "x2"), (occ.Z, "bottom")):
        ball.faces.Min(axis).name = name
    sizes = netgen.MeshingParameters(maxh=0.4, grading=0.5)
    for x, y in np.ndindex(6, 6):
        sizes.RestrictH(0.05 * x, 0.05 * y, -0.01, 0.07)
    mesh = ng.Mesh(occ.OCCGeometry(ball).GenerateMesh(mp=sizes)).Curve(2)
    solid = mb.Elastic(E=100, nu=0.3)
    body = mb.Body(mesh, solid, 2, fixed=meshes3d.supports("bottom", x1="x1", x2="x2"))
    state = mb.Contact(body, lambda x1, x2: 0 * x1, UNILATERAL).solve(load=0.25)
    radius = (3 / (4 * solid.E_star)) ** (1 / 3)
    r = np.hypot(state.x1, state.x2)
    hertz = 1.5 / (np.pi * radius**2) * np.sqrt(np.maximum(1 - (r / radius) ** 2, 0))
    missed = np.sqrt(state.weights @ (state.pressure - hertz) ** 2 / (state.weights @ hertz**2))
    assert missed < 0.1
    assert 4 * state.contact_area == pytest.approx(np.pi * radius**2, rel=0.05)
    assert state.reaction("bottom").force[2] == pytest.approx(0.25, rel=1e-8)


# --- several pieces of a boundary, and what lies between nodes and beside them


@pytest.mark.parametrize("law", [UNILATERAL, mb.Microblock(0.05)], ids=str)
def test_sides_that_nothing_can_press_change_nothing(law):
    """At an edge of more than 60 degrees the upper facets alone give normal and weight of a node."""
    x = np.linspace(0, 1, 5)
    mesh = meshes3d.block(x, x, x[::2] - 1)

    def height(x1, x2):
        return 0.5 * (x1 - 0.1) ** 2 + 0.3 * (x2 - 0.5) ** 2  # it presses the edge x1 = 0

    top, walls = (
        mb.Contact(mb.Body(mesh, SOLID, 1, fixed="bottom", contact=contact), height, law).solve(load=2.0)
        for contact in ("contact", "contact|left|right")
    )
    assert walls.approach == pytest.approx(top.approach, rel=1e-9)
    assert len(walls.weights) > len(top.weights)
    assert np.sort(walls.pressure)[-25:] == pytest.approx(
        np.sort(top.pressure), abs=1e-7 * top.pressure.max()
    )
    places = [(0.0, 0.5), (0.13, 0.41)]
    assert walls.pressure_at(places) == pytest.approx(top.pressure_at(places), rel=1e-7)
    assert walls.pressure_at(places).min() > 0


@pytest.mark.parametrize("law", [UNILATERAL, mb.Microblock((0.01, -0.02))], ids=str)
def test_a_spike_between_the_nodes_of_a_slope_is_named(law):
    """1/400 of the surface wide: where a corner of a tilted block meets it."""
    mesh = MakeStructured3DMesh(nx=4, ny=4, nz=2, mapping=lambda x, y, z: (x, y, z * (1 + 0.5 * x - 0.3 * y)))

    def height(x1, x2):
        spike = np.hypot(x1 - 0.83, x2 - 0.58) < 1 / 800
        surface = 1 + 0.5 * x1 - 0.3 * x2
        return surface + np.where(spike, -0.01, (x1**2 + x2**2) / 20)

    body = mb.Body(mesh, SOLID, 1, fixed="bottom", contact="top")
    said = " ".join(mb.Contact(body, height, law).solve(load=0.01).warnings)
    (place,) = re.findall(r"between nodes, at x1 = ([\d.]+) and x2 = ([\d.]+), the obstacle reaches", said)
    assert [float(x) for x in place] == pytest.approx((0.83, 0.58), abs=1 / 800)


def test_a_slope_beside_the_contact_boundary_is_looked_at():
    """Half of the slope is named: the obstacle meets the other half as well."""
    mesh = MakeStructured3DMesh(nx=6, ny=2, nz=2, mapping=lambda x, y, z: (x, y, z * (1 + 0.5 * x)))
    wanted = mesh.ngmesh.AddRegion("named", dim=2)
    for facet in mesh.ngmesh.Elements2D():
        vertices = np.array([mesh.ngmesh[vertex].p for vertex in facet.vertices])
        if np.ptp(vertices[:, 0]) > 0.1 and vertices[:, 2].min() > 0.9 and vertices[:, 0].max() < 0.6:
            facet.index = wanted
    named = ng.Mesh(mesh.ngmesh)
    for gap, warned in ((0.0, True), (0.1, False)):
        body = mb.Body(named, SOLID, 1, fixed="bottom", contact="named")
        problem = mb.Contact(body, lambda x1, x2, gap=gap: 1 + 0.5 * x1 + gap * (x1 > 0.5 + 1e-9), UNILATERAL)
        said = " ".join(problem.solve(load=1.0).warnings)
        assert ("beside the contact boundary" in said) == warned


def test_boundaries_that_no_height_can_press_are_refused():
    x = np.linspace(0, 1, 3)
    for contact in ("left", "bottom"):
        body = mb.Body(meshes3d.block(x, x, x - 1), SOLID, 1, fixed="contact", contact=contact)
        with pytest.raises(mb.BadArgument, match="^contact.*must face upwards"):
            mb.Contact(body, mb.Sphere(1.0), UNILATERAL).solve(load=1.0)


# --- interference: an obstacle that overlaps the body before it moves


@METHODS
@pytest.mark.parametrize(
    "dim, law",
    [
        (2, mb.Microblock(0.02)),
        (2, mb.Microclamped()),
        (3, mb.Microclamped()),
        pytest.param(3, mb.Microblock(0.02), marks=pytest.mark.nightly),
    ],
    ids=str,
)
def test_an_overlap_is_an_initial_gap_below_0(dim, law, method):
    """On tilted surfaces, at no approach and at one away from the body: as from an obstacle farther away."""

    def arched(x, height):
        return height * (1 + 0.3 * x)

    if dim == 2:
        mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, z: (x, arched(x, z)))
    else:
        mesh = MakeStructured3DMesh(nx=2, ny=2, nz=1, mapping=lambda x, y, z: (x, y, arched(x, z)))
    body = mb.Body(mesh, SOLID, 1, fixed="bottom", contact="top")

    def overlapping(lift):
        def height(*x):
            return lift - 0.02 + arched(x[0], 1.0) + sum((along - 0.4) ** 2 for along in x) / 20

        return mb.Contact(body, height, law, method)

    for approach in (0.0, -0.01)[3 - dim :]:  # in space, which takes longer, the second alone
        state = overlapping(0.0).solve(approach=approach)
        expected = overlapping(0.5).solve(approach=approach + 0.5)
        assert state.load > 0.1
        assert state.load == pytest.approx(expected.load, rel=1e-9)
        assert state.pressure == pytest.approx(expected.pressure, abs=1e-8 * expected.pressure.max())
    again = overlapping(0.0).solve(load=state.load)
    assert again.approach == pytest.approx(-0.01, abs=1e-9)
    with pytest.raises(mb.BadArgument, match="^approach.*touches no node"):
        overlapping(0.0).solve(approach=-0.03)


# --- gaps by a rule of the obstacle: a pin in a hole


def pin(maxh=0.15, order=4):
    """A ring of radius 1 around a rigid core, whose upper half may touch."""
    ring = occ.Circle((0, 0), 1.0).Face() - occ.Circle((0, 0), 0.3).Face()
    upper = ring * occ.WorkPlane().MoveTo(-2, 0).Rectangle(4, 2).Face()
    lower = ring * occ.WorkPlane().MoveTo(-2, -2).Rectangle(4, 2).Face()
    for half, name in ((upper, "contact"), (lower, "lower")):
        for edge in half.edges:
            r = np.hypot(edge.center.x, edge.center.y)
            edge.name = "cut"
            if abs(edge.center.y) > 0.01:
                edge.name = name if r > 0.4 else "core"
    mesh = occ.OCCGeometry(occ.Glue([upper, lower]), dim=2).GenerateMesh(maxh=maxh)
    return mb.Body(ng.Mesh(mesh).Curve(order), mb.Elastic(E=100, nu=0.3), order, fixed="core")


def test_a_pin_in_a_wide_hole_is_hertz():
    """On a refined mesh, whose nodes leave 5 % of the edge; a disc differs by a few from a half-plane."""
    state = mb.Contact(pin(), Bore(2.0, (0.0, -1.0)), UNILATERAL).solve(load=1.0, rtol=0.01)
    half_width = np.sqrt(4 * 2.0 / (np.pi * 100 / (1 - 0.3**2)))
    assert state.half_width == pytest.approx(half_width, rel=0.05)
    assert state.pressure.max() == pytest.approx(2 / (np.pi * half_width), rel=0.05)


def test_a_pin_in_a_narrow_hole_is_pressed_up_to_its_sides():
    """Load and reaction balance; the load is the slope of the energy, which knows nothing of gaps."""
    body = pin()
    problem = mb.Contact(body, Bore(1.001, (0.0, -0.001)), UNILATERAL)
    low, state, high = (problem.solve(approach=0.02 + step) for step in (-1e-5, 0.0, 1e-5))
    assert (high.fields.energy() - low.fields.energy()) / 2e-5 == pytest.approx(state.load, rel=1e-7)
    assert state.reaction("core").force[1] == pytest.approx(state.load, rel=1e-9)
    assert state.half_width > np.sin(np.radians(75))  # heights end at 60 degrees
    assert not any("slope" in words for words in state.warnings)
    newton = problem.with_(method=mb.Newton()).solve(load=state.load)
    assert newton.pressure == pytest.approx(state.pressure, abs=1e-8 * state.pressure.max())


def test_without_clearance_pressures_grow_with_the_load():
    """Nothing has a length then but the pin: one place stays in contact, and all is linear."""
    problem = mb.Contact(pin(0.3), Bore(1.0), UNILATERAL)
    one, two = (problem.solve(load=load) for load in (1.0, 2.0))
    closed = one.pressure > 1e-6 * one.pressure.max()
    assert 5 < np.count_nonzero(closed) < len(closed)
    assert two.pressure == pytest.approx(2 * one.pressure, abs=1e-3 * two.pressure.max())  # of curves


def test_gaps_of_ones_own_are_taken_and_checked():
    """A horizontal wall has the gap of heights; what overlaps a side or returns nothing is refused."""

    class Wall(mb.Plane):
        def normal_gap(self, points, normals):
            return (self.level - points[:, 1]) * normals[:, 1]

    class Nothing(mb.Plane):
        def normal_gap(self, points, normals):
            return None

    mesh = MakeStructured2DMesh(nx=6, ny=3, mapping=arch)
    body = mb.Body(mesh, SOLID, 1, fixed="bottom", contact="top")
    expected, state = (
        mb.Contact(body, wall(1.0), mb.Microblock(0.02)).solve(load=1.0) for wall in (mb.Plane, Wall)
    )
    assert state.pressure == pytest.approx(expected.pressure, abs=1e-12 * expected.pressure.max())
    with pytest.raises(mb.BadArgument, match="^obstacle.*normal_gap"):
        mb.Contact(body, Nothing(1.0), UNILATERAL).solve(load=1.0)
    with pytest.raises(mb.BadArgument, match="^obstacle.*sideways"):
        mb.Contact(pin(0.3, 2), Bore(0.99), UNILATERAL).solve(approach=0.0)
    with pytest.raises(mb.BadArgument, match="^centre"):
        Bore(1.0, (0.0, 1.0, 2.0))
