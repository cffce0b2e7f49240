"""Bodies on meshes: states are true of the discrete problem, by any method, before and after copies."""

import copy
import pickle

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from microblock.fem.body import Loads

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
COPIES = pytest.mark.parametrize("copied", [lambda one: pickle.loads(pickle.dumps(one)), copy.deepcopy])


def flat(skew=0.0, quads=True):
    """A rectangle of 6 x 4 quadrilaterals, inside which vertices are moved by `skew`, or of triangles."""

    def mapped(x, y):
        bulge = skew * y * (1 - y)
        return 2 * x - 1 + 8 * bulge * np.sin(3 * y + x) * x * (1 - x), y - 1 + 2 * bulge * np.sin(5 * x)

    return MakeStructured2DMesh(quads=quads, nx=6, ny=4, mapping=mapped)


def dome(order, refined=True):
    """A half disc of triangles, cut once near the top, with curved sides."""
    face = occ.WorkPlane().MoveTo(-1, 0).Line(2).Rotate(90).Arc(1, 180).Close().Face()
    face.edges.name = "top"
    face.edges.Min(occ.Y).name = "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=0.6))
    if refined:
        mesh.SetRefinementFlags([mesh[own.vertices[0]].point[1] > 0.5 for own in mesh.Elements()])
        mesh.Refine()
    return mesh.Curve(order)


def drum():
    """A cylinder of tetrahedra, cut once near the top, with curved sides."""
    solid = occ.Cylinder(occ.Pnt(0, 0, -1), occ.Z, r=1, h=1)
    solid.faces.Max(occ.Z).name, solid.faces.Min(occ.Z).name = "contact", "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(solid).GenerateMesh(maxh=0.7))
    mesh.SetRefinementFlags([mesh[own.vertices[0]].point[2] > -0.3 for own in mesh.Elements()])
    mesh.Refine()
    return mesh.Curve(2)


def pressed(mesh, law, method, **options):
    """A state of a body on a mesh under a cylinder."""
    body = mb.Body(mesh, SOLID, fixed="bottom", contact="top", **options)
    obstacle = mb.Cylinder(R=10) if np.ptp([v.point[0] for v in mesh.vertices]) > 2.1 else mb.Obstacle(square)
    return mb.Contact(body, obstacle, law, method).solve(load=0.5)


def square(x):
    return x**2 / 20


@pytest.mark.parametrize("orders", [(2, 3), (3, 2), (2, 1), (1, 2)])
@pytest.mark.parametrize(
    "law", [mb.Microblock(), mb.Unilateral(), mb.Microclamped()], ids=lambda law: type(law).__name__
)
def test_condensed_bodies_of_two_orders_are_those_of_newton(orders, law):
    order, order_psi = orders
    one, other = (
        pressed(flat(), law, method, order=order, order_psi=order_psi)
        for method in (mb.Condensed(), mb.Newton())
    )
    # the same discrete problem, solved to rounding
    assert one.approach == pytest.approx(other.approach, rel=1e-9)
    assert one.zones == other.zones
    for name in ("pressure", "micromoment", "psi"):
        own, known = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(own, known, rtol=0, atol=1e-9 * np.abs(other.pressure).max())


def test_reactions_to_psi_of_a_higher_order_balance():
    """The couples that hold psi = 0 on the surface do the work of a constant rotation."""
    for method in (mb.Condensed(), mb.Newton()):
        state = pressed(flat(quads=False), mb.Microclamped(), method, order=2, order_psi=4)
        couples = state.weights @ state.micromoment
        assert couples == pytest.approx(state.fields.reaction("top").moment, abs=1e-9 * state.load)


SKEW = flat(0.3)


@pytest.mark.parametrize("order", [1, 3, 6])
@pytest.mark.parametrize("mesh", [flat(), SKEW, dome(3)], ids=["rectangles", "skew", "curved"])
def test_energies_are_the_work_of_the_load(order, mesh):
    """Half the work of the obstacle, the energy of the fields, and that of a rule of far higher order."""
    for method in (mb.Condensed(), mb.Newton()):
        state = pressed(mesh, mb.Microblock(), method, order=order)
        gaps = mb.model.law.Microblock().initial_gaps(
            np.column_stack((state.x, state.solution.points[:, 1])),
            state.solution.normals,
            0.1,
            state.obstacle,
        )
        depth = state.approach * state.solution.normals[:, 1] - np.array(list(gaps.values()))
        forces = state.solution.pressures * state.weights
        work = np.sum(forces * np.where(forces > 0, depth, 0)) / 2
        assert state.energy == pytest.approx(work, rel=1e-9)
        body, fields = state.fields.body, state.fields
        assert fields.energy() == pytest.approx(state.energy, rel=1e-9)  # one rule for matrix and energy
        # what four more orders leave of functions that are no polynomials; on skew quadrilaterals the rule is
        # part of the discretisation, whose error is a thousand times as large
        exact = ng.Integrate(body.energy(*fields), body.mesh, order=40)
        assert state.energy == pytest.approx(exact, rel=1e-3 if mesh is SKEW else 2e-8)


def test_loads_of_the_users_are_integrated_as_fields_are():
    """A traction that is no polynomial does the work that it has: the reaction balances its integral."""
    body = mb.Body(flat(), SOLID, order=1, fixed="bottom")
    traction = ng.CF((0, ng.sin(4 * ng.x) ** 2))
    found = body.solve(Loads(traction={"top": (0, ng.sin(4 * ng.x) ** 2)})).reaction("bottom")
    whole = ng.Integrate(traction[1], body.mesh, definedon=body.mesh.Boundaries("top"), order=40)
    # elements of order 1 and bonus orders integrate degree 7 exactly: 8/3 of a radian on a facet leave 2e-7
    assert found.force[1] == pytest.approx(-whole, rel=1e-6)


@COPIES
@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("law", [mb.Microblock(), mb.Microclamped()], ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("method", [mb.Condensed(), mb.Newton()], ids=lambda method: type(method).__name__)
def test_copies_of_states_on_refined_curved_meshes_are_the_same(copied, order, law, method):
    """NGSolve numbers the edges of a refined mesh anew in a copy, and mixes up its curves."""
    state = pressed(dome(3), law, method, order=order)
    other = copied(state)
    for name in ("x", "weights", "pressure", "micromoment", "psi", "energy", "approach"):
        own, known = getattr(other, name), getattr(state, name)
        np.testing.assert_allclose(own, known, rtol=0, atol=1e-9 * np.abs(known).max(), err_msg=name)
    for boundary in ("bottom", ".*"):
        one, two = state.reaction(boundary), other.reaction(boundary)
        np.testing.assert_allclose([*one.force, one.moment], [*two.force, two.moment], rtol=0, atol=1e-9)
    again = other.problem.solve(load=0.5, initial=other)
    np.testing.assert_allclose(again.pressure, state.pressure, rtol=0, atol=1e-9 * state.pressure.max())


@COPIES
def test_copies_of_states_in_space_are_the_same(copied):
    body = mb.Body3D(drum(), SOLID, fixed="bottom")
    state = mb.Contact(body, mb.Sphere(R=10), mb.Microblock()).solve(load=0.5)
    other = copied(state)
    for name in ("weights", "pressure", "micromoment", "psi", "energy"):
        own, known = getattr(other, name), getattr(state, name)
        np.testing.assert_allclose(own, known, rtol=0, atol=1e-8 * np.abs(known).max(), err_msg=name)
    np.testing.assert_allclose(
        other.fields.reaction("bottom").moment, state.fields.reaction("bottom").moment, rtol=0, atol=1e-8
    )
