"""Contact of tetrahedra: nodes at vertices for order 1, at the middles of sides for order 2."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from netgen.meshing import MeshingParameters

import microblock as mb
from microblock.fem import meshes3d
from microblock.fem.contact_nodes import ContactNodes
from microblock.fem.facet_rules import nodal_rule, rule_at, shapes

SOLID = mb.Cosserat(E=1.0, nu=0.3, ell=0.1, beta=1)


def quarter(length, pressed, size, smallest):
    """A cube of tetrahedra below x3 = 0 between planes of symmetry, a square of whose top is pressed."""
    cube = occ.Box((0, 0, -length), (length, length, 0))
    below = occ.Box((0, 0, -pressed / 2), (pressed, pressed, 0))
    shape = occ.Glue([below, cube - below]) if pressed < length else cube
    for face in shape.faces:
        x1, x2, x3 = (face.center.x, face.center.y, face.center.z)
        on = {"left": x1 < 1e-9, "front": x2 < 1e-9, "bottom": x3 < 1e-9 - length}
        on["contact"] = x3 > -1e-9 and max(x1, x2) < pressed
        face.name = next((name for name, there in on.items() if there), "free")
        if face.name == "contact":
            face.maxh = smallest
    return ng.Mesh(occ.OCCGeometry(shape).GenerateMesh(maxh=size, grading=0.4))


def flat(x1, x2):
    return 0 * x1 * x2


@pytest.mark.parametrize(
    ("law", "order"),
    [(mb.Unilateral(), 2), (mb.Microblock(), 1), (mb.Microblock(), 2), (mb.Microclamped(), 1)],
    ids=repr,
)
def test_a_plane_presses_a_column_evenly(law, order):
    """The patch test: the pressure is the same at all nodes and at places between them, by both methods."""
    mesh = quarter(1.0, 1.0, 0.5, 0.5)
    fixed = {"u3": "bottom", "u1": "left", "u2": "front", "psi1": "bottom|front", "psi2": "bottom|left"}
    body = mb.Body(mesh, SOLID, order, fixed=fixed | {"psi3": "bottom|left|front"})
    for method in (mb.Condensed(), mb.Newton()):
        state = mb.Contact(body, flat, law, method).solve(load=0.01)
        # both methods end at a residual of 1e-9
        assert state.pressure == pytest.approx(0.01, rel=1e-8)
        assert state.micromoment / SOLID.ell == pytest.approx(0, abs=1e-10)
        places = np.array([(0.5, 0.5), (0.001, 0.002), (0.3, 0.999)])
        assert state.pressure_at(places) == pytest.approx(0.01, rel=1e-8)


def test_triangles_of_order_2_have_no_weight_at_vertices():
    """The integrals of the functions of order 2 are those of the rule with the middles of the sides alone; a
    rule with positive weights at the vertices as well, that of the four halves, does not have them.
    """
    element = ng.fem.H1FE(ng.ET.TRIG, 2)
    gauss = ng.IntegrationRule(ng.ET.TRIG, 4)
    exact = shapes(element, gauss).T @ [point.weight for point in gauss]
    middles = nodal_rule(ng.ET.TRIG, 2)
    corners = rule_at([(1, 0), (0, 1), (0, 0), *(point.point[:2] for point in middles)])
    of_middles = shapes(element, middles).sum(axis=0) / 6
    of_halves = np.repeat((1 / 24, 1 / 8), 3) @ shapes(element, corners)
    assert of_middles == pytest.approx(exact, abs=1e-15)
    assert of_halves[3:] / exact[3:] == pytest.approx(0.75)  # of the functions of the sides


def test_hertz_on_tetrahedra_of_order_2():
    """A sphere with the contact radius 1 on a cube of 6: the peak is Hertz's within 1 % and the area within
    3 %, of which the size of the cube is worth 1 %; the pressure converges.
    """
    radius, modulus = 10.0, 1 / 0.91
    load = 4 / 3 * modulus / radius
    peak = 1.5 * load / np.pi
    solid = mb.Elastic(E=1.0, nu=0.3)
    errors = []
    for size in (0.3, 0.15):
        body = mb.Body(
            quarter(6.0, 1.5, 2.0, size), solid, 2, fixed=meshes3d.supports("bottom", x1="left", x2="front")
        )
        state = mb.Contact(body, mb.Sphere(R=radius), mb.Unilateral()).solve(load=load / 4)
        exact = peak * np.sqrt(np.clip(1 - state.x1**2 - state.x2**2, 0, None))
        norm = state.weights @ exact**2
        errors.append(np.sqrt(state.weights @ (state.pressure - exact) ** 2 / norm))
    assert state.pressure.max() == pytest.approx(peak, rel=0.01)
    assert 4 * state.contact_area / np.pi == pytest.approx(1, rel=0.03)
    assert errors[1] < 0.02 and errors[0] / errors[1] > 2  # order 1: the edge of the contact


def test_nodes_of_triangles_of_order_2_are_the_middles_of_the_sides():
    mesh = quarter(1.0, 1.0, 0.5, 0.5)
    nodes = ContactNodes(mb.Body(mesh, SOLID, 2, fixed="bottom"))
    sides = {
        tuple(sorted(vertex.nr for vertex in mesh[edge].vertices))
        for facet in mesh.Boundaries("contact").Elements()
        for edge in facet.edges
    }
    middles = [np.mean([mesh.vertices[number].point for number in side], axis=0) for side in sides]
    assert np.array(sorted(map(tuple, np.round(middles, 12)))) == pytest.approx(
        np.array(sorted(map(tuple, np.round(nodes.points, 12)))), abs=1e-12
    )
    assert nodes.weights.sum() == pytest.approx(1, abs=1e-13)
    # a linear function continues to the vertices, and triangles fill the boundary but for its rim
    values = nodes.points @ (2.0, -1.0, 0.0)
    vertices = np.array([mesh.vertices[number].point for number in nodes._beside_vertices])
    assert nodes.continued @ values == pytest.approx(vertices @ (2.0, -1.0, 0.0), abs=1e-12)
    drawn = nodes.points[nodes.triangles][..., :2]
    sides = np.diff(drawn, axis=1)
    area = np.abs(np.linalg.det(sides)).sum() / 2
    assert 0.8 < area < 1.0


def graded_box(near, radius, far):
    """A box whose whole top is pressed, with elements of a size `near` a circle on it, and `far` from it."""
    box = occ.Box((-2, -2, -2), (2, 2, 0))
    for face in box.faces:
        face.name = {0.0: "contact", -2.0: "bottom"}.get(round(face.center.z, 9), "side")
    sizes = MeshingParameters(maxh=far)
    for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False):
        for part in (0.6, 0.8, 1.0):
            sizes.RestrictH(x=part * radius * np.cos(angle), y=part * radius * np.sin(angle), z=0.0, h=near)
    return ng.Mesh(occ.OCCGeometry(box).GenerateMesh(mp=sizes))


def test_newton_takes_few_steps_on_facets_that_are_graded():
    """A step leaves an error in proportion to rho times the length of a facet, which differs tenfold here:
    with one rho for all facets, and multipliers that waited for equilibrium, it took 11.
    """
    body = mb.Body(graded_box(0.1, 0.2, 1.0), mb.Elastic(E=0.91, nu=0.3), order=2, fixed="bottom")
    state = mb.Contact(body, mb.Sphere(R=4.0), mb.Unilateral(), mb.Newton()).solve(load=0.0027)
    assert state.iterations <= 8
