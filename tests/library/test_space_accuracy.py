"""Error estimates and refinement of bodies on meshes in space."""

from functools import lru_cache

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured3DMesh

import microblock as mb
from microblock.fem import mesh_cuts, meshes3d, recovery
from microblock.fem.space_boundary import SpaceBoundary
from tests.library.test_tetrahedra import quarter

R = 10.0
MODULUS = 1 / 0.91  # E* of E = 1 and nu = 0.3
CLASSICAL = mb.Elastic(E=1.0, nu=0.3)
BLOCKS = mb.Cosserat(E=1.0, nu=0.3, ell=0.1, beta=1)
SPHERE = mb.Sphere(R=R)
FIXED = meshes3d.supports("bottom", x1="left", x2="front")
RULES = {kind: ng.IntegrationRule(kind, 9) for kind in (ng.TRIG, ng.QUAD)}


@lru_cache
def meshed(size):
    """A quarter of a block of tetrahedra, 12 long: of a contact of radius 1 that is as a half-space within
    1e-3.
    """
    return quarter(12.0, 1.5, 4.0, size)


def tetrahedra(size, order, solid=CLASSICAL):
    return mb.Body(meshed(size), solid, order, fixed=FIXED)


def hexahedra(step, order):
    x = meshes3d.graded(reach=1.5, step=step, far=12.0, growth=1.8)
    return mb.Body(meshes3d.block(x, x, -x[::-1], reach=1.5), CLASSICAL, order, fixed=FIXED)


def hertz_load(radius):
    return 4 / 3 * MODULUS / R * radius**3


def hertz(radius):
    """The pressure of Hertz at places, (k, 3), and no couples."""
    peak = 1.5 * hertz_load(radius) / np.pi / radius**2

    def pressure(x):
        return peak * np.sqrt(np.clip(1 - np.sum(x[:, :2] ** 2, axis=1) / radius**2, 0, None))

    return lambda x: (pressure(x), np.zeros((2, len(x))))


def of_state(state):
    """The pressure and the couples over ell of a state on a half-space."""
    return lambda x: (state.pressure_at(x[:, :2]), state.micromoment_at(x[:, :2]).T / state.solid.ell)


def true_error(state, exact):
    """The larger error of p and M/ell in the norm of the estimate, between the nodes as well."""
    solution = state.solution
    rules = [RULES[facet.type] for facet in solution.nodes.region.Elements()]
    x, weights, _, basis = solution.nodes.at_points(rules)
    weights = weights * SpaceBoundary(solution).norm_weights(x)
    pressure, couples = exact(x)
    p = basis @ state.pressure
    moments = (basis @ state.micromoment).T / solution.solver.solid.ell
    errors = weights @ (p - pressure) ** 2, weights @ np.sum((moments - couples) ** 2, axis=0)
    return float(np.sqrt(max(errors) / (weights @ pressure**2)))


@pytest.mark.parametrize("order, size, radius", [(1, 0.4, 1.05), (1, 0.2, 0.7), (2, 0.4, 0.6), (2, 0.3, 1.0)])
def test_the_estimate_bounds_the_error_under_a_sphere(order, size, radius):
    """Three to nine nodes in contact, and more: 1.7 to 4 times the error, of order 2 1.4 to 1.6 times."""
    most = 6 if order == 1 else 2
    problem = mb.Contact(tetrahedra(size, order), SPHERE, mb.Unilateral())
    for part in (0.6, 1.0):
        state = problem.solve(load=hertz_load(part * radius) / 4)
        error = true_error(state, hertz(part * radius))
        assert error < state.error_estimate < most * error


@pytest.mark.parametrize("order, sizes", [(1, (0.4, 0.2)), (2, (0.4,))])
def test_the_estimate_bounds_the_error_of_blocks(order, sizes):
    load = 0.04 / 0.91
    exact = mb.Contact(mb.HalfSpace(BLOCKS), SPHERE, mb.Microblock()).solve(load=load, rtol=0.02)
    for size in sizes:
        state = mb.Contact(tetrahedra(size, order, BLOCKS), SPHERE, mb.Microblock()).solve(load=load / 4)
        error = true_error(state, of_state(exact))
        assert error < state.error_estimate < 6 * error


def test_few_of_many_nodes_in_contact_have_a_number():
    """Nine nodes of hundreds."""
    state = mb.Contact(tetrahedra(0.1, 1), SPHERE, mb.Unilateral()).solve(load=hertz_load(0.27) / 4)
    count = np.count_nonzero(state.closed)
    assert count < 12 < 250 < len(state.weights)
    assert true_error(state, hertz(0.27)) < state.error_estimate < 1
    warnings = "; ".join(state.warnings)
    assert f"the error estimate is {state.error_estimate:.1e}" in warnings
    assert f"only {count} nodes in contact: take a finer mesh, or ask for rtol=" in warnings


def test_without_the_part_of_the_edge_the_estimate_is_below_the_error(monkeypatch):
    """A control: averages of cubes are as good as their nodal values, and see no edge between the nodes."""
    state = mb.Contact(hexahedra(0.4, 1), SPHERE, mb.Unilateral()).solve(load=hertz_load(0.5) / 4)
    error = true_error(state, hertz(0.5))
    assert error < state.error_estimate < 6 * error
    nothing = (np.zeros(0, int), np.zeros(0))
    monkeypatch.setattr(SpaceBoundary, "edges", lambda boundary: nothing)
    assert recovery.estimate(state.solution).total < 0.9 * error


def test_a_tolerance_is_delivered_under_a_sphere():
    problem = mb.Contact(tetrahedra(0.4, 2), SPHERE, mb.Unilateral())
    state = problem.solve(load=hertz_load(1.0) / 4, rtol=0.1)
    assert true_error(state, hertz(1.0)) < state.error_estimate <= 0.1
    assert 4 * state.contact_area / np.pi == pytest.approx(1, rel=0.05)
    assert state.warnings == []
    # supports are those of the mesh that was given
    mesh = state.solution.nodes.body.mesh
    assert mesh.ne > problem.body.mesh.ne and mesh.GetBoundaries() == problem.body.mesh.GetBoundaries()
    on_axis = state.points[:, 0] == 0
    assert on_axis.sum() > 3 and state.fields.reaction("bottom|left|front").force[2] == pytest.approx(
        state.load
    )


def slab(thickness):
    """Half of a slab of tetrahedra between planes of symmetry, on which it is as in the plane."""
    box = occ.Box((0, 0, -2), (2, thickness, 0))
    for face in box.faces:
        x1, x2, x3 = (face.center.x, face.center.y, face.center.z)
        sides = {"left": x1 < 1e-9, "front": x2 < 1e-9, "back": x2 > thickness - 1e-9}
        sides |= {"bottom": x3 < -2 + 1e-9, "contact": x3 > -1e-9}
        face.name = next((name for name, here in sides.items() if here), "right")
    return ng.Mesh(occ.OCCGeometry(box).GenerateMesh(maxh=0.4))


def test_a_tolerance_is_delivered_where_the_plane_has_the_answer():
    """A cylinder on a slab between planes: the plane strain of the same block, solved to 1e-3."""
    thickness, load = 0.2, 0.1
    fixed = meshes3d.supports("bottom", x1="left", x2="front|back")
    problem = mb.Contact(
        mb.Body(slab(thickness), CLASSICAL, 2, fixed=fixed),
        lambda x1, x2: x1**2 / 4 + 0 * x2,
        mb.Unilateral(),
    )
    state = problem.solve(load=load / 2 * thickness, rtol=0.03)
    ground = occ.WorkPlane().MoveTo(0, -2).Rectangle(2, 2).Face()
    for edge in ground.edges:
        x1, x2 = (edge.center.x, edge.center.y)
        sides = {"left": x1 < 1e-9, "bottom": x2 < -2 + 1e-9, "contact": x2 > -1e-9}
        edge.name = next((name for name, here in sides.items() if here), "right")
    mesh = ng.Mesh(occ.OCCGeometry(ground, dim=2).GenerateMesh(maxh=0.4))
    plane = mb.Body(mesh, CLASSICAL, 4, fixed={"u1": "bottom|left", "u2": "bottom"})
    exact = mb.Contact(plane, mb.Cylinder(R=2.0), mb.Unilateral()).solve(load=load / 2, rtol=1e-3)
    error = true_error(state, lambda x: (exact.pressure_at(x[:, 0]), np.zeros((2, len(x)))))
    assert error < state.error_estimate <= 0.03


def test_a_flat_punch_has_the_weight_of_its_edge():
    """Its pressure has no L2 norm; with the squared distance from the edge it converges."""

    def punch(x1, x2):
        return np.where(x1**2 + x2**2 <= 0.64, 0.0, np.inf)

    def exact(x):
        inside = 0.64 - np.sum(x[:, :2] ** 2, axis=1)
        pressure = np.where(inside > 0, 0.1 / (1.6 * np.pi * np.sqrt(np.maximum(inside, 1e-12))), 0.0)
        return pressure, np.zeros((2, len(x)))

    estimates = []
    for size in (0.4, 0.2):
        state = mb.Contact(tetrahedra(size, 1), punch, mb.Unilateral()).solve(load=0.1 / 4)
        estimates.append(state.error_estimate)
        assert true_error(state, exact) < state.error_estimate
    boundary = SpaceBoundary(state.solution)
    weights = boundary.norm_weights(np.array([(0.0, 0, 0), (0.4, 0, 0), (0.79, 0, 0)]))
    assert weights == pytest.approx([1, 0.25, 0], abs=0.02)
    assert estimates[1] < estimates[0]


def test_what_lies_between_the_nodes_counts():
    """A needle that no node sees, worth the modulus times its length."""
    body = tetrahedra(0.4, 1)
    middle = np.array((0.61, 0.57))

    def with_needle(x1, x2):
        needle = 0.02 * np.exp(-((x1 - middle[0]) ** 2 + (x2 - middle[1]) ** 2) / 0.02**2)
        return (x1**2 + x2**2) / (2 * R) - needle

    smooth, rough = (
        mb.Contact(body, obstacle, mb.Unilateral()).solve(load=hertz_load(1.3) / 4)
        for obstacle in (SPHERE, with_needle)
    )
    apart = np.hypot(*(rough.points[:, :2] - middle).T)
    assert apart.min() > 0.06
    assert smooth.pressure == pytest.approx(rough.pressure)
    assert SpaceBoundary(smooth.solution).missed().sum() < 1e-20
    missed = np.sqrt(SpaceBoundary(rough.solution).missed().sum())
    assert missed == pytest.approx(MODULUS * 0.02, rel=0.3)
    assert rough.error_estimate > smooth.error_estimate


def test_a_tolerance_out_of_reach_names_one_that_is_delivered(monkeypatch):
    monkeypatch.setattr(SpaceBoundary, "most_unknowns", 2000)
    problem = mb.Contact(tetrahedra(0.4, 1), SPHERE, mb.Unilateral())
    load = hertz_load(1.0) / 4
    with pytest.raises(mb.NotConverged) as refused:
        problem.solve(load=load, rtol=1e-3)
    reached = refused.value.rtol_reached
    assert 0.05 < reached < 0.6
    assert problem.solve(load=load, rtol=reached).error_estimate <= reached


def test_a_mesh_that_is_taken_as_it_is_says_why():
    mesh = MakeStructured3DMesh(nx=4, ny=4, nz=2, mapping=lambda x, y, z: (x + 0.2 * y - 0.6, y - 0.5, z - 1))
    skew = mb.Body(mesh, CLASSICAL, 1, fixed="bottom", contact="top")
    problem = mb.Contact(skew, SPHERE, mb.Unilateral())
    with pytest.raises(mb.BadArgument, match="rtol = 0.1: needs a mesh of tetrahedra, or of hexahedra"):
        problem.solve(load=0.1, rtol=0.1)
    assert problem.solve(load=0.01).error_estimate > 0.1


def test_a_tolerance_is_delivered_on_a_grid_of_boxes():
    problem = mb.Contact(hexahedra(0.5, 1), SPHERE, mb.Unilateral())
    state = problem.solve(load=hertz_load(1.0) / 4, rtol=0.5)
    assert true_error(state, hertz(1.0)) < state.error_estimate <= 0.5
    body = state.solution.nodes.body
    assert body.unknowns > problem.body.unknowns
    for name in problem.body.mesh.GetBoundaries():  # supports are those of the mesh that was given
        first, last = (
            ng.Integrate(ng.specialcf.normal(3), mesh, definedon=mesh.Boundaries(name))
            for mesh in (problem.body.mesh, body.mesh)
        )
        assert np.array(last) == pytest.approx(np.array(first), abs=1e-9)


def test_rows_of_boxes_are_halved_where_one_of_them_is_chosen():
    x = np.array([0.0, 1.0, 3.0])
    mesh = meshes3d.block(x, x, x)
    chosen = np.zeros(mesh.ne, bool)
    chosen[0] = True
    finer = mesh_cuts.with_rows_halved(mesh, mesh_cuts.grid_lines(mesh), chosen)
    first = mesh.ngmesh.Elements3D().NumPy()["nodes"][0, :8] - 1
    low = mesh.ngmesh.Coordinates()[first].min(axis=0)
    expected = [[0.0, 0.5, 1.0, 3.0] if start == 0 else [0.0, 1.0, 2.0, 3.0] for start in low]
    assert np.array_equal(mesh_cuts.grid_lines(finer), expected)
    assert finer.ne == 27 and ng.Integrate(1, finer) == pytest.approx(27)


def test_both_methods_refine_alike():
    """As many unknowns, since the pressures differ by the residual, 1e-9, alone."""
    problem = mb.Contact(tetrahedra(0.4, 1), SPHERE, mb.Unilateral())
    by_newton, condensed = (
        problem.with_(method=method).solve(load=0.1, rtol=0.3) for method in (mb.Newton(), mb.Condensed())
    )
    assert by_newton.method == "newton" and by_newton.unknowns == condensed.unknowns
    assert by_newton.error_estimate == pytest.approx(condensed.error_estimate, rel=1e-5)
    assert by_newton.error_estimate <= 0.3


def test_the_forecast_grows_with_the_accuracy():
    problem = mb.Contact(tetrahedra(0.4, 2), SPHERE, mb.Unilateral())
    coarse, fine = (problem.plan(load=0.1, rtol=rtol).candidates[0].cost for rtol in (0.1, 0.03))
    assert fine.seconds > 2 * coarse.seconds and 2e4 < fine.unknowns < 2e5


def test_a_finer_mesh_begins_with_the_contact_of_the_coarser_one():
    """From no contact Newton's method takes 11 steps on the finer mesh, and from the coarser one 7; the
    pressures differ by 1e-6, the residual at which refinements end.
    """
    problem = mb.Contact(tetrahedra(0.3, 1), SPHERE, mb.Unilateral(), mb.Newton())
    load = hertz_load(1.0) / 4
    coarse = problem.solve(load=load).solution
    mesh = SpaceBoundary(coarse).finer(recovery.marked(recovery.estimate(coarse), 0.1))
    anew = coarse.solver.on(mesh).solution_at(load, None)
    refined = coarse.solver.on(mesh).refined_at(load, None, coarse)
    assert np.count_nonzero(refined.closed) > 2 * np.count_nonzero(coarse.closed)
    assert refined.iterations <= anew.iterations - 3
    assert refined.pressures == pytest.approx(anew.pressures, abs=1e-6 * anew.pressures.max())
