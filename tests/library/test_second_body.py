"""Second bodies on meshes: curved and tilted boundaries, in the plane and in space."""

import copy
import pickle

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock.fem import meshes3d, second_body
from microblock.fem.body import Loads
from microblock.fem.condensation import condensed
from microblock.fem.facet_rules import at_rules, rule_at
from microblock.fem.mesh_surface import MeshSurface
from microblock.fem.meshes import named
from microblock.fem.second_body import SecondBody
from microblock.model.corner_geometry import Blocks
from tests.parts import BLOCKS, UNILATERAL

CLASSICAL = mb.Cosserat(E=100, nu=0.3, beta=0, ell=0.1)
OTHER = mb.Cosserat(E=300, nu=0.2, beta=0, ell=0.1)
SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.4)


def off(state, pressure):
    """Relative L2 distance of a state's pressure from another one at its points."""
    return np.sqrt(state.weights @ (state.pressure - pressure) ** 2 / (state.weights @ pressure**2))


# --- lines and curved facets


def disc(radius, order):
    circle = occ.Circle((0, 0), radius).Face()
    circle.edges.name = "contact"
    mesh = ng.Mesh(occ.OCCGeometry(circle, dim=2).GenerateMesh(maxh=0.5 * radius))
    return mesh.Curve(order)


@pytest.mark.parametrize("order, least", [(1, 1e-3), (3, 1e-7)])
def test_lines_meet_facets_as_the_mesh_is_curved(order, least):
    """The circle is met from inside at its radius, but for what the mesh leaves of it: more than `least`, and
    up to (h/R)^(order + 1) of h = R/2. Where a line is said to meet a facet the mesh is.
    """
    mesh = disc(2.0, order)
    surface = MeshSurface(mesh.Boundaries("contact"))
    angles = np.linspace(0, 2 * np.pi, 101)
    lines = np.column_stack((np.cos(angles), np.sin(angles)))
    start = 0.3 * lines + 0.2 * lines[:, ::-1] * (-1, 1)
    assert repr(surface) == f"<surface of a mesh: {len(surface.facets)} facets in 2D>"  # as warnings name it
    hits = surface.met(start, lines)  # of the inside only what lies behind faces a line
    places = start + hits.distances[:, None] * lines
    exact = -0.3 - np.sqrt(2.0**2 - 0.2**2)
    assert least < np.abs(hits.distances - exact).max() < 2 * 0.5 ** (order + 1)
    facets = [surface.facets[number] for number in hits.facets]
    on_mesh, _, _ = at_rules(mesh, facets, [rule_at([place]) for place in hits.places])
    assert places == pytest.approx(on_mesh, abs=1e-12)
    x = np.linspace(-1.9, 1.9, 11)
    assert surface.height(x) == pytest.approx(-np.sqrt(4 - x**2), abs=2 * 0.5 ** (order + 1))
    assert np.isinf(surface.height(np.array([2.5]))).all()


def test_lines_meet_facets_in_space():
    """A level bottom of skew hexahedra at 1, along slanted lines; and beside it nothing."""
    x = np.array([0.0, 0.3, 1.0])
    surface = MeshSurface(meshes3d.block(x, x, x + 1).Boundaries("bottom"))
    starts = np.random.default_rng(1).uniform(0.2, 0.8, (50, 3))
    line = np.array((0.12, -0.16, 0.98))
    lines = np.tile(line / np.linalg.norm(line), (50, 1))
    assert surface.normal_gap(starts, lines) == pytest.approx((1 - starts[:, 2]) / lines[:, 2], abs=1e-14)
    assert np.isinf(surface.normal_gap(starts + (2, 0, 0), lines)).all()
    assert np.isinf(surface.normal_gap(starts, -lines)).all()  # they leave it


# --- patch tests: hydrostatic pressure in two bodies, each between rollers, pressed on a slanted face

SLOPE = 0.7
LOWER = [(0, 0), (1, 0), (0, SLOPE)], ["bottom", "contact", "left"]
UPPER = [(1, SLOPE), (0, SLOPE), (1, 0)], ["top", "contact", "right"]


def polygon(corners):
    ends = zip(corners, np.roll(corners, -1, axis=0))
    return occ.Face(occ.Wire([occ.Segment((*a, 0), (*b, 0)) for a, b in ends]))


def name_sides(sides, corners, names):
    middles = (np.array(corners) + np.roll(corners, -1, axis=0)) / 2
    for side in sides:
        across = np.array((side.center.x, side.center.y))
        side.name = names[int(np.argmin(np.linalg.norm(middles - across, axis=1)))]


def triangle(corners, names, h):
    face = polygon(corners)
    name_sides(face.edges, corners, names)
    return ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=h))


def prism(corners, names, h):
    """The triangle in the plane of x1 and x3, between rollers across x2."""
    solid = polygon(corners).Extrude(occ.Vec(0, 0, 1))
    solid.faces.name = "front"
    name_sides([side for side in solid.faces if 0.1 < side.center.z < 0.9], corners, names)
    solid = solid.Rotate(occ.Axis((0, 0, 0), occ.X), 90)
    return ng.Mesh(occ.OCCGeometry(solid).GenerateMesh(maxh=h))


def hydrostatic(shape, spacings, orders):
    """Relative errors of the pressure on bodies of this shape."""
    in_space = shape is prism
    up = "u3" if in_space else "u2"
    bodies = []
    for (corners, names), h, order, solid in zip((LOWER, UPPER), spacings, orders, (CLASSICAL, OTHER)):
        fixed = {"u1": names[2], up: names[0]} | ({"u2": "front"} if in_space else {})
        bodies.append(mb.Body(shape(corners, names, h), solid, order, order_psi=0, fixed=fixed))
    approach = 1e-3
    state = mb.Contact(bodies[0], mb.Deformable(bodies[1]), UNILATERAL).solve(approach=approach)
    # u = -e x below and -e' (x - X) - d e2 above, p = 2 (lam + mu) e, and u.n is the same on x.n = c
    n = np.array((SLOPE, 1)) / np.hypot(SLOPE, 1)
    c = n @ (1, 0)
    moduli = [2 * (solid.lam + solid.mu) for solid in (CLASSICAL, OTHER)]
    p = approach * n[1] / (c / moduli[0] + (n @ (1, SLOPE) - c) / moduli[1])
    return state.pressure / p - 1


@pytest.mark.parametrize(
    "spacings, orders",
    [((0.2, 0.13), (1, 1)), ((0.1, 0.23), (2, 1)), ((0.3, 0.07), (1, 2)), ((0.2, 0.1), (4, 3))],
)
def test_tilted_boundaries_in_the_plane_pass_the_patch_test(spacings, orders):
    """To rounding: facets are cut where vertices of the other body are met."""
    errors = hydrostatic(triangle, spacings, orders)
    assert np.abs(errors).max() < 1e-10


@pytest.mark.parametrize("orders", [(1, 1), pytest.param((2, 2), marks=pytest.mark.nightly)])
def test_tilted_boundaries_in_space_pass_the_patch_test(orders, monkeypatch):
    """But for the integrals over pieces of facets, 4e-4 at most, of the second order in their size."""
    errors = hydrostatic(prism, (0.6, 0.45), orders)
    assert np.abs(errors).max() < 1e-3
    monkeypatch.setattr(second_body, "PIECES", second_body.PIECES // 2)
    coarse = hydrostatic(prism, (0.6, 0.45), orders)
    assert np.linalg.norm(errors) < 0.5 * np.linalg.norm(coarse)


def arched(sign, h, order):
    """A body below (-1) or above (1) an arc of the radius 2 over x1 from -1 to 1, held on the other side."""
    low = np.sqrt(3) - 2
    corners = [occ.Pnt(-1, low, 0), occ.Pnt(1, low, 0), occ.Pnt(1, 1.5 * sign, 0), occ.Pnt(-1, 1.5 * sign, 0)]
    sides = [occ.Segment(a, b) for a, b in zip(corners[1:], [*corners[2:], corners[0]])]
    face = occ.Face(occ.Wire([occ.ArcOfCircle(corners[0], occ.Pnt(0, 0, 0), corners[1]), *sides]))
    face.edges.name = "contact"
    for edge in face.edges:
        if abs(edge.center.y) > 1 or abs(abs(edge.center.x) - 1) < 1e-6:
            edge.name = "back" if abs(edge.center.x) < 0.5 else "side"
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=h)).Curve(order)
    return mb.Body(mesh, CLASSICAL, order, order_psi=0, fixed="back")


@pytest.mark.parametrize("order, least, rate", [(1, 2e-2, 1.7), (2, 1e-4, 3.0), (3, 1e-5, 3.5)])
def test_a_constant_pressure_goes_through_a_curved_boundary(order, least, rate):
    """The second body moves as under the same pressure on its own facets; what is left, of the order 2 of
    straight facets and more of curved ones, falls with the meshes. Forces balance to rounding.
    """
    errors = []
    for h in (0.4, 0.2):
        first, second = arched(-1, h, order), arched(1, 0.77 * h, order)
        nodes = condensed(first)
        pressed = SecondBody(mb.Deformable(second), nodes, Blocks(UNILATERAL, 0.1)).fields(
            nodes.weights[None]
        )
        n = ng.specialcf.normal(2)
        itself = second.solve(Loads(traction={"contact": (-n[0], -n[1])}))
        apart, size = (
            sum(ng.Integrate(part**2, second.mesh) for part in fields)
            for fields in ([a - b for a, b in zip(pressed, itself)], itself)
        )
        errors.append(np.sqrt(apart / size))
        force = pressed.reaction("back").force + nodes.weights @ nodes.normals
        assert np.abs(force).max() < 1e-12
    assert errors[0] < least
    assert np.log2(errors[0] / errors[1]) > rate


# --- closed forms, and problems with the same answer


def cylinder(sign, spacing, solid, radius=np.inf):
    """A square of 120 below (-1) or above (1) an arc with this radius, in contact over 1.2 or 1.4."""
    reach, size = 1.3 + 0.1 * sign, 60.0
    level = sign * (0.0 if radius == np.inf else radius - np.sqrt(radius**2 - reach**2))
    places = [
        (size, level),
        (size, sign * size),
        (-size, sign * size),
        (-size, level),
        (-reach, level),
        (reach, level),
    ]
    points = [occ.Pnt(*place, 0) for place in places]
    sides = [occ.Segment(a, b) for a, b in zip(points, points[1:] + points[:1])]
    if radius < np.inf:
        sides[4] = occ.ArcOfCircle(points[4], occ.Pnt(0, 0, 0), points[5])
    face = occ.Face(occ.Wire(sides))
    for edge in face.edges:
        x, y = edge.center.x, edge.center.y
        edge.name = "back" if abs(y - sign * size) < 1e-6 else "free"
        if abs(x) < reach and abs(y) < 1:
            edge.name = "contact"
            edge.maxh = spacing
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=size / 2, grading=0.5)).Curve(2)
    return mb.Body(mesh, solid, 2, order_psi=0, fixed="back")


A = 0.7  # half-width
PAIR = 1 / ((1 - 0.3**2) / 100 + (1 - 0.2**2) / 300)  # E* of both solids


@pytest.mark.parametrize("radii", [(np.inf, 400.0), (400.0, np.inf), (300.0, 400.0)])
def test_cylinders_of_two_solids_are_those_of_hertz(radii):
    """Nodes at a seventh of the half-width are off by 2e-2, and nearer ones by less: edges lie between."""
    load = np.pi * PAIR * A**2 / 4 * sum(1 / radius for radius in radii)
    errors = []
    for spacing in (0.1, 0.05):
        below, above = cylinder(-1, spacing, CLASSICAL, radii[0]), cylinder(1, 1.2 * spacing, OTHER, radii[1])
        state = mb.Contact(below, mb.Deformable(above), UNILATERAL).solve(load=load)
        errors.append(off(state, 2 * load / np.pi / A * np.sqrt(np.maximum(1 - (state.x / A) ** 2, 0))))
    assert errors[0] < 2e-2 and errors[1] < 0.8 * errors[0]


def quarter(step, solid, up=False, curvature=0.0, far=4.0, reach=0.8):
    """A quarter of a block below, or above, x3 = curvature r^2/2, between planes of symmetry."""
    x = meshes3d.graded(reach=reach, step=step, far=far, growth=2.0)
    mesh = meshes3d.block(x, x, x if up else -x[::-1])
    fixed = meshes3d.supports("far", x1="left", x2="front")
    order_psi = None if solid.beta else 0
    bent = bend(mesh, curvature, far, reach, up)
    return mb.Body(bent, solid, 1, order_psi=order_psi, fixed=fixed, contact="touched")


def bend(mesh, curvature, far, reach, up):
    """The mesh with its surface bent, as far as twice the reach, and the facets within reach named."""
    netgen_mesh = mesh.ngmesh
    for point in netgen_mesh.Points():
        x1, x2, x3 = point.p
        square = min(x1**2, 4 * reach**2) + min(x2**2, 4 * reach**2)
        point[2] = x3 + curvature * square / 2 * (1 - abs(x3) / far)
    touched = netgen_mesh.AddRegion("touched", dim=2)
    places = netgen_mesh.Coordinates()
    near, across = ("bottom", "contact") if up else ("contact", "bottom")
    names = mesh.GetBoundaries()
    for facet in netgen_mesh.Elements2D():
        middle = np.mean([places[vertex.nr - 1] for vertex in facet.vertices], axis=0)
        if names[facet.index - 1] == near and np.abs(middle[:2]).max() < reach:
            facet.index = touched
    netgen_mesh.SetBCName(names.index(across), "far")
    return ng.Mesh(netgen_mesh)


@pytest.mark.nightly  # the estimate and both bodies by `test_a_coarse_second_body_is_seen`
def test_spheres_of_two_solids_are_those_of_hertz():
    """Facets of a fifth of the radius leave a tenth, below the estimate. Force and energy are those of both
    bodies, to rounding.
    """
    radii = 10.0, 15.0
    R = 1 / (1 / radii[0] + 1 / radii[1])
    a = 0.5
    load = 4 * PAIR * a**3 / (3 * R)
    p0 = 3 * load / (2 * np.pi * a**2)
    below = quarter(0.1, CLASSICAL, curvature=-1 / radii[0])
    above = quarter(0.11, OTHER, True, 1 / radii[1], reach=0.9)
    state = mb.Contact(below, mb.Deformable(above), UNILATERAL).solve(load=load / 4)
    r = np.hypot(*state.points[:, :2].T)
    error = off(state, p0 * np.sqrt(np.maximum(1 - (r / a) ** 2, 0)))
    assert error < 0.12 and error < state.error_estimate < 0.5
    fields = state.fields
    reactions = [fields.reaction("far").force[2], fields.second.reaction("far").force[2]]
    assert reactions == pytest.approx([load / 4, -load / 4], rel=1e-10)
    assert fields.energy() + fields.second.energy() == pytest.approx(state.energy, rel=1e-9)


def test_equal_bodies_meet_halfway_and_a_stiff_one_is_rigid():
    """Their common face stays level: one of them on a rigid plane at half of the approach. Equal meshes leave
    1e-2 of the curvature, and others the edge between nodes, 4e-2.
    """
    below = quarter(0.15, CLASSICAL, curvature=-0.1, far=1.6)
    plane = mb.Contact(below, lambda x1, x2: 0 * x1, UNILATERAL).solve(load=0.5)
    for step, least in ((0.15, 0.01), (0.18, 0.06)):
        above = quarter(step, CLASSICAL, True, 0.1, far=1.6)
        twins = mb.Contact(below, mb.Deformable(above), UNILATERAL).solve(load=0.5)
        assert off(twins, plane.pressure) < least
        assert twins.approach == pytest.approx(2 * plane.approach, rel=0.01)
    stiff = above.of(mb.Cosserat(E=1e8, nu=0.3, beta=0, ell=0.1))
    pressed = mb.Contact(below, mb.Deformable(stiff), UNILATERAL).solve(load=0.5)
    rigid = mb.Contact(below, stiff.surface(), UNILATERAL).solve(load=0.5)
    assert off(pressed, rigid.pressure) < 1e-4  # 1e-6 of the stiffness
    assert pressed.approach == pytest.approx(rigid.approach, rel=1e-5)


def test_corners_press_a_second_body_where_they_stand():
    """As half-spaces of the same solids: facets of a third of the blocks are off by 0.2, and by 0.5
    where corners beyond the planes of symmetry were left out. The four corners at the axis are one.
    """
    solid = mb.Cosserat(E=50, nu=0.2, beta=0, ell=0.4)
    sphere = mb.Sphere(R=5.0)
    pair = mb.HalfSpace(SOLID), mb.Deformable(mb.HalfSpace(solid), sphere), BLOCKS, mb.Cells(nodes=40)
    exact = mb.Contact(*pair).solve(load=1.0)
    below = quarter(0.15, SOLID, reach=0.9)
    above = quarter(0.12, solid, True, reach=1.3)
    state = mb.Contact(below, mb.Deformable(above, sphere), BLOCKS).solve(load=0.25)
    assert off(state, exact.pressure_at(state.points[:, :2])) < 0.25
    assert [pressure[0] for pressure in state.pressures.values()] == pytest.approx(
        4 * [state.pressure[0] / 4]
    )


@pytest.mark.parametrize("law", [UNILATERAL, BLOCKS])
def test_halves_of_a_symmetric_scene_are_the_whole(law):
    """Corners beyond the plane of symmetry press the mirror image, and those on it both halves; to the
    residual of both.
    """

    def body(left, columns, sign, bend=0.0):
        def mapped(s, t):
            x = left + (1.2 - left) * s
            # facets at x1 = 0 are level: there a half has the normal of its own facet
            return x, sign * t - bend * max(abs(x) - 0.12, 0) ** 2 * (1 - t)

        mesh = MakeStructured2DMesh(nx=columns, ny=4, mapping=mapped)
        names = ("contact", "right", "far", "left")
        mesh = named(mesh, *names)
        fixed = {"u1": "far", "u2": "far", "psi": "far"}
        if left == 0:
            fixed |= {"u1": "far|left", "psi": "far|left"}
        return mb.Body(mesh, SOLID, 2, fixed=fixed)

    def arc(x):
        return np.where(np.abs(x) <= 1, x**2 / 16, np.inf)

    halves = [body(0.0, 10, -1), body(0.0, 7, 1)]
    wholes = [body(-1.2, 20, -1), body(-1.2, 14, 1)]
    half, whole = (
        mb.Contact(below, mb.Deformable(above, mb.Obstacle(arc)), law).solve(load=load)
        for (below, above), load in ((halves, 0.75), (wholes, 1.5))
    )
    assert half.pressure == pytest.approx(whole.pressure[whole.x > -1e-9], abs=1e-8 * whole.pressure.max())
    bent = [
        [body(left, count, -1, 0.15), body(left, more, 1, 0.08)]
        for left, count, more in ((0, 10, 7), (-1.2, 20, 14))
    ]
    half, whole = (
        mb.Contact(below, mb.Deformable(above), law).solve(load=load)
        for (below, above), load in zip(bent, (0.75, 1.5))
    )
    assert half.pressure == pytest.approx(whole.pressure[whole.x > -1e-9], abs=1e-8 * whole.pressure.max())
    with pytest.raises(mb.BadArgument, match="mesh the same part of both"):
        mb.Contact(wholes[0], mb.Deformable(halves[1], mb.Obstacle(arc)), law).solve(load=1.0)


def test_units_and_a_turn_about_x3_change_nothing():
    """Lengths in units of 1e9 and 1e-9, and planes x1 = 0 and x2 = 0 exchanged, to the residual."""
    pressures = []
    for unit in (1.0, 1e9, 1e-9):
        solid = CLASSICAL.with_length(0.1 * unit)
        lengths = {"far": 1.6 * unit, "reach": 0.8 * unit}
        below = quarter(0.2 * unit, solid, curvature=-0.1 / unit, **lengths)
        above = quarter(0.2 * unit, solid, True, 0.1 / unit, **lengths)
        state = mb.Contact(below, mb.Deformable(above), UNILATERAL).solve(load=0.4 * unit**2)
        pressures.append(state.pressure)
    assert pressures[1] == pytest.approx(pressures[0], rel=1e-6)
    assert pressures[2] == pytest.approx(pressures[0], rel=1e-6)
    order, exchanged = (np.lexsort(np.round(state.points.T[axes] / unit, 6)) for axes in ([0, 1], [1, 0]))
    pressure = pressures[0]
    assert pressure[order] == pytest.approx(pressure[exchanged], abs=1e-6 * pressure.max())


# --- errors, and what is out of scope


def test_a_coarse_second_body_is_seen():
    """By the estimate in space: it grows with the second body's facets, and holds."""
    below = quarter(0.15, CLASSICAL)
    fine, coarse = (
        mb.Contact(below, mb.Deformable(quarter(step, CLASSICAL, True, 0.2, reach=0.9)), UNILATERAL).solve(
            load=0.3
        )
        for step in (0.1, 0.45)
    )
    error = off(coarse, fine.pressure)
    fields = coarse.fields
    assert fields.energy() + fields.second.energy() == pytest.approx(coarse.energy, rel=1e-9)
    reactions = [fields.reaction("far").force[2], fields.second.reaction("far").force[2]]
    assert reactions == pytest.approx([0.3, -0.3], rel=1e-10)
    assert 1.5 * fine.error_estimate < coarse.error_estimate > error > 0.05  # 0.49 and 0.86


def test_what_a_second_body_cannot_do_is_refused():
    below = quarter(0.4, CLASSICAL)
    above = quarter(0.4, CLASSICAL, True, 0.1)
    roller = mb.Deformable(above)
    with pytest.raises(mb.BadArgument, match="shape = None: must be given: a HalfSpace has no mesh"):
        mb.Deformable(mb.HalfSpace(CLASSICAL))
    with pytest.raises(mb.BadArgument, match="without a shape the surface of the mesh is the shape"):
        mb.Contact(below, mb.Deformable(above, mb.Sphere(R=10)), UNILATERAL).solve(load=0.1)
    with pytest.raises(mb.BadArgument, match="refines the mesh of the first body alone"):
        mb.Contact(below, roller, UNILATERAL).solve(load=0.1, rtol=0.1)
    with pytest.raises(mb.BadArgument, match="takes rigid obstacles alone"):
        mb.Contact(below, roller, UNILATERAL, mb.Newton()).solve(load=0.1)
    with pytest.raises(mb.BadArgument):
        mb.Contact(below, roller, mb.Unilateral(friction=0.3)).history([(0.1, 0.01)])
    moved = {"prescribed": {"u3": {"far": 0.01}}}
    for supports, words in (({"fixed": {}}, "must hold the body"), (moved, "must be empty with")):
        second = mb.Body(above.mesh, CLASSICAL, 1, contact=above.contact, **{"fixed": above.fixed} | supports)
        with pytest.raises(mb.BadArgument, match=words):
            mb.Contact(below, mb.Deformable(second), UNILATERAL).solve(load=0.1)
    with pytest.raises(mb.BadArgument, match="HalfSpace that meets obstacles over a surface|takes a"):
        mb.Contact(mb.HalfSpace(CLASSICAL), roller, UNILATERAL).solve(load=0.1)


def test_a_coarse_second_body_in_the_plane_is_warned_of():
    below = cylinder(-1, 0.05, CLASSICAL)
    few, many = (
        mb.Contact(below, mb.Deformable(cylinder(1, spacing, OTHER, 400.0)), UNILATERAL).solve(load=0.04)
        for spacing in (0.8, 0.06)
    )
    assert any("nodes of the second body over a zone" in words for words in few.warnings)
    assert not many.warnings


def test_files_have_the_second_body(tmp_path):
    meshio = pytest.importorskip("meshio", reason="VTK needs the extra `vtk`")
    problem = mb.Contact(quarter(0.4, CLASSICAL), mb.Deformable(quarter(0.4, OTHER, True, 0.1)), UNILATERAL)
    state = problem.solve(load=0.1)
    *_, second = mb.to_vtk(state, tmp_path / "pair")
    assert second.name == "pair_second_body.vtu"
    read = meshio.read(second)
    assert read.points[:, 2].min() >= 0.0
    top = np.abs(read.points[:, 2] - read.points[:, 2].max()) < 1e-9
    assert np.abs(read.point_data["u"][top]).max() < 1e-12 < np.abs(read.point_data["u"]).max()
    state.plot(tmp_path / "pair.png")
    assert state.opposite.shape == state.pressure.shape and np.isfinite(state.opposite).any()


def test_where_the_second_boundary_ends_and_its_surface_goes_on_is_said():
    """A wide contact on a narrow boundary; a punch, whose surface ends there, may press up to its edges."""
    below = quarter(0.2, CLASSICAL, far=1.6, reach=1.2)
    goes_on = quarter(0.2, OTHER, True, 0.01, far=1.6, reach=0.4)
    x = np.linspace(0, 0.4, 3)
    fixed = meshes3d.supports("contact", x1="left", x2="front")
    punch = mb.Body(meshes3d.block(x, x, x), OTHER, 1, order_psi=0, fixed=fixed, contact="bottom")
    narrow, whole = (
        mb.Contact(below, mb.Deformable(body), UNILATERAL).solve(load=1.0) for body in (goes_on, punch)
    )
    words = "the contact reaches an end of the second body's contact boundary"
    assert any(words in warning for warning in narrow.warnings)
    assert not any(words in warning for warning in whole.warnings)


@pytest.mark.nightly  # the shares in space are those of `test_tilted_boundaries_in_space_pass_the_patch_test`
@pytest.mark.parametrize("law", [UNILATERAL, BLOCKS], ids=str)
def test_slabs_between_rollers_are_bodies_in_the_plane(law):
    """Hexahedra that nothing bends across x2 have the fields of quadrilaterals. In space integrals are cut in
    pieces, 3e-3. Corners beyond front and back press the mirror images there.
    """
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2)
    x = np.linspace(-1, 1, 17)

    def slab(columns, up):
        along = np.linspace(-1.3, 1.3, columns) if up else x
        depth = np.linspace(0, 1, 6)
        mesh = meshes3d.block(along, np.array([0.0, 0.1]), depth if up else -depth[::-1])
        far, near = ("contact", "bottom") if up else ("bottom", "contact")
        held = {name: far for name in ("u1", "u3", "psi2")}
        sides = {name: f"front|back|{far}" for name in ("u2", "psi1", "psi3")}
        return mb.Body(mesh, solid, 1, fixed=held | sides, contact=near)

    def plane(columns, up):
        along = (-1.3, 2.6) if up else (-1.0, 2.0)
        mapped = lambda s, t: (along[0] + along[1] * s, t if up else t - 1)  # noqa: E731
        mesh = named(
            MakeStructured2DMesh(nx=columns - 1, ny=5, mapping=mapped), "low", "right", "high", "left"
        )
        far, near = ("high", "low") if up else ("low", "high")
        return mb.Body(mesh, solid, 1, fixed=far, contact=near)

    flat = mb.Contact(plane(17, False), mb.Deformable(plane(15, True), mb.Cylinder(R=4.0)), law).solve(
        load=3.0
    )
    rolled = mb.Deformable(slab(15, True), lambda x1, x2: x1**2 / 8 + 0 * x2)
    state = mb.Contact(slab(17, False), rolled, law).solve(load=0.3)
    front = state.points[:, 1] == 0
    assert state.pressure[front] == pytest.approx(flat.pressure, abs=3e-3 * flat.pressure.max())


def test_held_blocks_below_a_second_body_are_warned_of():
    """Both corners of a block that cannot turn would press it, at two places."""
    mesh = named(MakeStructured2DMesh(nx=12, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1)), *"abcd")
    fixed = {"u1": "a", "u2": "a", "psi": "a|c"}
    above = cylinder(1, 0.1, OTHER)
    for held, fields in ((True, fixed), (False, "a")):
        below = mb.Body(mesh, SOLID, 2, fixed=fields, contact="c")
        state = mb.Contact(below, mb.Deformable(above, mb.Cylinder(R=10.0)), BLOCKS).solve(load=0.2)
        assert any("supports hold psi" in warning for warning in state.warnings) == held


def test_twists_of_closed_blocks_press_the_second_body():
    """Forces 1, -1, -1, 1 do nothing to the first body, and something to the second one: without them its
    energy was 1e-4 off. Of all four corners closed, to the residual.
    """
    below = quarter(0.2, SOLID, far=1.6, reach=1.0)
    x = meshes3d.graded(reach=1.0, step=0.17, far=1.6, growth=2.0)
    fixed = meshes3d.supports("contact", x1="left", x2="front")
    above = mb.Body(meshes3d.block(x, x, x), OTHER, 1, order_psi=0, fixed=fixed, contact="bottom")
    bowl = mb.Deformable(above, lambda x1, x2: 0.001 * (x1**2 + x2**2))
    state = mb.Contact(below, bowl, BLOCKS).solve(load=2.0)
    assert (state.closed == 4).all()
    energies = state.fields.energy() + state.fields.second.energy()
    assert energies == pytest.approx(state.energy, rel=1e-8)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda state: pickle.loads(pickle.dumps(state))])
@pytest.mark.parametrize("in_space", [False, True])
def test_copies_have_both_bodies(in_space, again):
    """Also of curved and mirrored surfaces, to the rounding of factors made anew."""
    if in_space:
        bodies = quarter(0.3, CLASSICAL), quarter(0.3, OTHER, up=True, curvature=0.1)
    else:
        bodies = arched(-1, 0.4, 2), arched(1, 0.3, 2)
    state = mb.Contact(bodies[0], mb.Deformable(bodies[1]), UNILATERAL).solve(approach=0.01)
    twin = again(state)
    assert twin.stiffness == pytest.approx(state.stiffness, rel=1e-10)
    assert twin.fields.second.energy() == pytest.approx(state.fields.second.energy(), rel=1e-10)
    if not in_space:  # gaps between nodes are those of bodies in the plane
        x = np.linspace(-0.3, 0.3, 7)
        assert twin.gap_at("C", x) == pytest.approx(state.gap_at("C", x), abs=1e-12)
