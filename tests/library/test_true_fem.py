"""Bodies on meshes: states are true of the discrete problem, by any method, before and after copies."""

import copy
import dataclasses
import pickle

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from cases.benchmarks.verification import SEED
from microblock.fem import meshes3d
from microblock.fem.body import Loads
from microblock.fem.body3d import Loads3D

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


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()], ids=lambda law: type(law).__name__)
def test_micromoments_are_the_reaction_where_supports_hold_psi(law):
    """As a law that prescribes psi does: the couple that the surface exerts, all of it."""
    supports = {"u1": "bottom", "u2": "bottom", "psi": "bottom|top"}
    body = mb.Body(flat(), SOLID, order=2, fixed=supports, contact="top")
    states = [
        mb.Contact(body, mb.Cylinder(R=10), law, method).solve(load=0.5)
        for method in (mb.Condensed(), mb.Newton())
    ]
    largest = np.abs(states[1].micromoment).max()
    assert largest > 1e-3
    np.testing.assert_allclose(states[0].micromoment, states[1].micromoment, rtol=0, atol=1e-9 * largest)
    if law == mb.Unilateral():
        clamped = pressed(flat(), mb.Microclamped(), mb.Condensed(), order=2)
        np.testing.assert_allclose(states[0].micromoment, clamped.micromoment, rtol=0, atol=1e-9 * largest)


class OfTheLine:
    """The compliance of a half-plane at given nodes, as a body of one's own has it."""

    methods = (mb.model.methods.GivenCompliance,)

    def __init__(self, x):
        self.solid, self.x = SOLID, x

    def compliance(self, clamped=False):
        return mb.HalfPlane(self.solid).compliance(self.x, clamped)


def test_a_given_compliance_knows_the_reaction_to_psi():
    """The moments with which the nodes of a body that may rotate do not."""
    x = np.linspace(-0.5, 0.5, 81)
    state = mb.Contact(OfTheLine(x), mb.Cylinder(R=10), mb.Microclamped()).solve(load=0.5)
    free = OfTheLine(x).compliance().matrix
    loads = np.concatenate((-state.weights * state.pressure, state.weights * state.micromoment))
    assert np.abs(state.micromoment).max() > 1e-2
    # rotations of a solve, beside those of the pressures alone
    alone = np.abs(free[81:, :81] @ loads[:81]).max()
    assert np.abs(free[81:] @ loads).max() < 1e-9 * alone


def test_paths_of_blocks_name_what_one_mesh_alone_sees():
    wavy = mb.Obstacle(lambda x: x**2 / 20 + 0.0005 * np.cos(40 * x))
    path = mb.Contact(mb.Block(SOLID, 4.0), wavy, mb.Microblock(psi0=0.01)).path(load=1.0)
    seen = [set(one) for one in path._seen]
    assert len(path.events) == len(seen[0] & seen[1]) < len(seen[0] | seen[1])
    assert len(path.warnings) == len(seen[0] ^ seen[1])
    assert (
        all("at about load 0." in words for words in path.warnings) and path.warnings[0] in path._repr_html_()
    )


def beside_the_end(x):
    return (x + 0.645) ** 2 / 20


def test_a_contact_that_fits_on_a_block_is_found_there():
    """Beside the end of the surface, where the half-plane's zones and their margins do not fit."""
    solid = mb.Cosserat(E=50, nu=0.3, ell=0.1, beta=1)
    problem = mb.Contact(mb.Block(solid, 1.0), mb.Obstacle(beside_the_end), mb.Unilateral())
    state = problem.solve(load=0.5, rtol=1e-2)
    uniform = problem.with_(method=mb.Uniform(h=0.02, order=2, reach=0.98)).solve(load=0.5)
    # half a spacing of nodes at either end
    assert state.zones["contact"][0] == pytest.approx(uniform.zones["contact"][0], abs=5e-3)
    assert state.approach == pytest.approx(uniform.approach, rel=1e-3)
    with pytest.raises(mb.BadArgument, match=r"size = 1.0: must be larger: .* from -0.98.* to 0.1"):
        problem.with_(law=mb.Microblock()).solve(load=2.5)


def cube(order=1, solid=SOLID, **supports):
    x = np.linspace(-1, 1, 7)
    mesh = meshes3d.block(x, x, np.linspace(-1, 0, 4))
    return mb.Body3D(mesh, solid, order, fixed=supports or "bottom")


@pytest.mark.parametrize("wanted", [{"load": 1.0}, {"approach": 0.02}], ids=str)
def test_stiff_penalties_are_solved_whatever_was_solved_before(wanted):
    """The right-hand side grows with rho, and a residual beside it said nothing of the forces."""
    solid = mb.Cosserat(E=100, nu=0.3, ell=0.2, beta=1)
    exact = mb.Contact(cube(solid=solid), mb.Sphere(R=10), mb.Microblock()).solve(**wanted)
    body = cube(solid=solid)
    for rho in (1e5, 1e8):
        state = mb.Contact(body, mb.Sphere(R=10), mb.Microblock(), mb.Newton("penalty", rho)).solve(**wanted)
        # penetrations of some p/rho of the displacement, and the residual of the conditions
        assert state.load == pytest.approx(wanted.get("load", exact.load), rel=1e-6 + 2e2 / rho)
        np.testing.assert_allclose(
            state.pressure, exact.pressure, rtol=0, atol=(1e-5 + 1e3 / rho) * exact.pressure.max()
        )


def test_states_that_miss_what_was_asked_are_not_returned(monkeypatch):
    """Whatever a method returns: its load, its approach and its residual are looked at."""
    problem = mb.Contact(
        mb.Body(flat(), SOLID, fixed="bottom", contact="top"), mb.Cylinder(R=10), mb.Microblock()
    )
    state = problem.solve(load=0.5)
    monkeypatch.setattr(problem.solver, "solve", lambda *_: state.solution)
    for wanted, words in (
        ({"load": 0.5001}, "the load is off by 2.0e-04"),
        ({"approach": 0.01}, "the approach"),
    ):
        with pytest.raises(mb.NotConverged, match=words):
            problem.solve(**wanted)
    worse = dataclasses.replace(state.solution, residual=1e-3)
    monkeypatch.setattr(problem.solver, "solve", lambda *_: worse)
    with pytest.raises(mb.NotConverged, match="the residual is off by 1.0e-03"):
        problem.solve(load=0.5)


def test_penetrations_of_a_soft_penalty_are_said():
    soft, stiff = (
        pressed(flat(), mb.Unilateral(), mb.Newton("penalty", rho), order=2).warnings for rho in (1e3, 1e5)
    )
    assert any("inside the obstacle" in words for words in soft)
    assert not any("inside the obstacle" in words for words in stiff)


def test_a_translation_that_nothing_holds_is_said():
    """Newton's matrix is singular then, and the state has any translation along the surface."""
    held, free = (
        mb.Contact(
            mb.Body(flat(), SOLID, 1, fixed=fixed, contact="top"),
            mb.Cylinder(10.0),
            mb.Unilateral(),
            mb.Newton(),
        ).solve(load=1.0)
        for fixed in ("bottom", {"u2": "bottom"})
    )
    assert any("u1" in words for words in free.warnings)
    assert not any("u1" in words for words in held.warnings)


@pytest.mark.parametrize(
    "nu, order, locks", [(0.3, 1, False), (0.4999, 1, True), (0.4999, 2, True), (0.4999, 3, False)]
)
def test_locking_is_said(nu, order, locks):
    """Approaches of order 1 were off by 80 %, largest pressures of order 2 by 20 to 45 %, of 3 by 2 %."""
    solid = mb.Cosserat(E=100, nu=nu, ell=0.3, beta=1)
    for method in (mb.Condensed(), mb.Newton()):
        mesh = MakeStructured2DMesh(quads=True, nx=16, ny=8, mapping=lambda x, y: (2 * x - 1, y - 1))
        body = mb.Body(mesh, solid, order, fixed="bottom", contact="top")
        state = mb.Contact(body, mb.Cylinder(R=2), mb.Unilateral(), method).solve(load=8.0)
        assert any("lock where nu" in words for words in state.warnings) == locks
    if order < 3:
        state = mb.Contact(cube(order, solid), mb.Sphere(R=2), mb.Unilateral()).solve(load=8.0)
        assert any("lock where nu" in words for words in state.warnings) == locks


@pytest.mark.parametrize("order", [1, 2])
def test_patch_tests_have_no_penetration_to_warn_of(order):
    """The surface moves as one: what it differs by is rounding, and no measure of anything."""
    sides = {"u1": "left|right", "u2": "front|back", "u3": "bottom"}
    turned = dict.fromkeys(("psi1", "psi2", "psi3"), "bottom|left|right|front|back")
    for method in (mb.Condensed(), mb.Newton()):
        state = mb.Contact(cube(order, **sides, **turned), flat_height, mb.Unilateral(), method).solve(
            load=1.0
        )
        assert not any("into the surface" in words for words in state.warnings)


def flat_height(x1, x2):
    return 0 * x1


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_loads_are_finite_numbers(value):
    for made in (
        lambda: Loads(force=(0, value)),
        lambda: Loads(traction={"top": (0, value)}),
        lambda: Loads(couple=value),
        lambda: Loads3D(micromoment={"contact": (value, 0, 0)}),
        lambda: mb.Body(flat(), SOLID, prescribed={"u1": {"bottom": value}}),
    ):
        with pytest.raises(mb.BadArgument, match="must be a finite number"):
            made()


def block(method):
    return lambda: mb.Contact(mb.Block(SOLID, 3.0), mb.Cylinder(R=10), mb.Microblock(), method)


def on(make, method, law=None, **options):
    """A problem on a body with a boundary "top" or a contact boundary in space."""

    def problem():
        mesh = make()
        if mesh.dim == 3:
            body, obstacle = mb.Body3D(mesh, SOLID, fixed="bottom", **options), mb.Sphere(R=10)
        else:
            body = mb.Body(mesh, SOLID, fixed="bottom", contact="top", **options)
            obstacle = mb.Obstacle(square)
        return mb.Contact(body, obstacle, law or mb.Microblock(), method)

    return problem


def hexahedra():
    x = np.linspace(-1, 1, 5)
    return meshes3d.block(x, x, np.linspace(-1, 0, 3))


PROBLEMS = {
    "fitted": block(mb.Fitted(order=4)),
    "uniform": block(mb.Uniform(h=0.1)),
    "uniform al": block(mb.Uniform(h=0.1, newton=mb.Newton())),
    "condensed": on(flat, mb.Condensed(), order=3, order_psi=2),
    "al": on(flat, mb.Newton(), order=2),
    "penalty": on(flat, mb.Newton("penalty"), order=2),
    "prescribed psi": on(flat, mb.Newton(), mb.Microclamped(), order=2, order_psi=3),
    "prescribed psi condensed": on(flat, mb.Condensed(), mb.Microclamped(), order=2),
    "curved": on(lambda: dome(2), mb.Condensed(), order=2),
    "curved al": on(lambda: dome(2), mb.Newton(), order=2),
    "space": on(hexahedra, mb.Condensed()),
    "space al": on(hexahedra, mb.Newton()),
    "space penalty": on(hexahedra, mb.Newton("penalty")),
    "space prescribed psi": on(hexahedra, mb.Condensed(), mb.Microclamped()),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_what_was_asked_before_changes_nothing(name):
    """One problem asked in a shuffled order, by other methods on the same body, from other states, and of its
    copies, answers as a fresh one does.
    """
    rng = np.random.default_rng([SEED, 27, sorted(PROBLEMS).index(name)])
    used, loads = PROBLEMS[name](), (0.2, 0.35, 0.5)
    fresh = {load: PROBLEMS[name]().solve(load=load) for load in loads}
    # the residual that iterations of each method leave, in pressures and what follows from them
    close = 1e-6 if name in ("space al", "space penalty") else 1e-8
    others = [method for method in (mb.Condensed(), mb.Newton(), mb.Newton("penalty", 1e6))]
    if isinstance(used.body, mb.Block):
        others = [mb.Uniform(h=0.15)]
    asked = [(load, how) for load in loads for how in ("plain", "initial", "pickle", "deepcopy", "other")]
    last = None
    for number in rng.permutation(len(asked))[:6]:
        load, how = asked[number]
        if how == "other":
            used.with_(method=others[rng.integers(len(others))]).solve(load=1.3 * load)
        problem = {"pickle": lambda one: pickle.loads(pickle.dumps(one)), "deepcopy": copy.deepcopy}.get(
            how, lambda one: one
        )(used)
        last = problem.solve(load=load, initial=last if how == "initial" else None)
        _require_same(last, fresh[load], close)
        _require_same(pickle.loads(pickle.dumps(last)), fresh[load], close)


def _require_same(one, other, close):
    for name in ("load", "approach", "energy", "pressure", "micromoment", "psi", "weights"):
        own, known = getattr(one, name), getattr(other, name)
        # a moment that symmetry makes 0 is what iterations leave of the contact's conditions, 1e-9
        zero = 1e-9 * SOLID.ell * other.pressure.max() if name == "micromoment" else 0.0
        close_to = max(close * np.abs(known).max(), zero)
        np.testing.assert_allclose(own, known, rtol=0, atol=close_to, err_msg=name)
    assert (one.warnings, one.method) == (other.warnings, other.method)
    found, known = (state.fields.reaction("bottom") for state in (one, other))
    np.testing.assert_allclose(found.force, known.force, rtol=0, atol=close * other.load)
    np.testing.assert_allclose(found.moment, known.moment, rtol=0, atol=close * other.load)
