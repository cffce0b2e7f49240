"""Contact terms on the nodal rule: rule, nodes, potential structure (36), energy - residual - tangent."""

import ngsolve as ng
import numpy as np
import pytest
from conftest import dome

from microblock import (
    BadArgument,
    Body,
    Cosserat,
    Cylinder,
    Microblock,
    Microclamped,
    Obstacle,
    Plane,
    Punch,
    Unilateral,
)
from microblock.fem import meshes
from microblock.fem.facets import ContactFacets, lobatto

SOLID = Cosserat(E=2.6, nu=0.3, ell=0.4, beta=1)


@pytest.mark.parametrize("order", range(1, 13))
def test_lobatto_is_exact_to_degree_2p_minus_1(order):
    points, weights = lobatto(order)
    for degree in range(2 * order):
        assert weights @ points**degree == pytest.approx(1 / (degree + 1), rel=1e-13)
    if order <= 6:  # beyond, the first error sinks into rounding
        assert weights @ points ** (2 * order) != pytest.approx(1 / (2 * order + 1), rel=1e-8)
    assert (points[0], points[-1]) == (0, 1)


def block_facets(block, order, model=Microblock(0.02), obstacle=Cylinder(1.0), **options):
    body = Body(block, SOLID, order, fixed=options.pop("fixed", "bottom"), **options)
    return ContactFacets(body, model, obstacle)


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_nodes_are_shared_and_weigh_the_length(block, order):
    facets = block_facets(block, order)
    assert len(facets.points) == 6 * order + 1 == facets.multipliers.ndof
    assert facets.weights.sum() == pytest.approx(2.0, rel=1e-14)
    assert np.all(np.diff(facets.points[:, 0]) > 0)
    assert facets.normals == pytest.approx(np.tile([0.0, 1.0], (len(facets.points), 1)))


@pytest.mark.parametrize("order", [1, 2, 5])
def test_values_at_nodes_and_back(block, order):
    facets = block_facets(block, order)
    values = np.random.default_rng(2).normal(size=len(facets.points))
    assert facets.at_nodes("multiplier", facets.interpolate(values)) == pytest.approx(values, rel=1e-12)
    field = ng.GridFunction(facets.body.spaces[1])
    field.Set(1 + 2 * ng.x)
    assert facets.at_nodes("u2", field) == pytest.approx(1 + 2 * facets.points[:, 0], rel=1e-12)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_nodal_gaps_are_the_expression_at_the_nodes(slope):
    """The gap as a form sees it, integrated by the nodal rule, is the weighted sum of the nodal gaps."""
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(quads=True, nx=4, ny=2, mapping=lambda x, y: (x, y - 1 + slope * x * y))
    body = Body(mesh, SOLID, 4, fixed="bottom")
    facets = ContactFacets(body, Microblock(lambda x: 0.1 * x), Cylinder(1.0), "top")
    assert np.abs(facets.normals[:, 0]).max() == pytest.approx(slope / np.hypot(1, slope), abs=1e-12)
    state = random_state(facets.body.space, 3, 0.1)
    nodal = facets.nodal_gaps(*state.components, 0.05)
    for corner in "AB":
        gap = facets.gap(corner, *state.components, 0.05)
        rule = {ng.SEGM: facets.rule}
        total = ng.Integrate(gap**2 * ng.ds(definedon=facets.region, intrules=rule), facets.body.mesh)
        assert total == pytest.approx(facets.weights @ nodal[corner] ** 2, rel=1e-12)


def test_curved_contact_boundary():
    facets = ContactFacets(Body(dome(4), SOLID, 4, fixed="base"), Unilateral(), Plane(1.0))
    radius = np.linalg.norm(facets.points, axis=1)
    assert radius == pytest.approx(np.ones_like(radius), abs=1e-4)  # a curved mesh of order 4
    # its normals lose an order
    assert facets.normals == pytest.approx(facets.points / radius[:, None], abs=1e-2)
    assert facets.weights.sum() == pytest.approx(np.pi, rel=1e-5)
    # what is steeper than 60 degrees cannot touch
    assert np.array_equal(facets.can_touch["C"], facets.normals[:, 1] > 0.5)


def test_gap_22_on_an_inclined_surface_by_hand():
    """n = (-0.6, 0.8), s = n x e3 = (0.8, 0.6), psi0 = 0.1, ell = 0.4, u = (0.03, -0.02), psi = 0.05.

    The approach is 0.01.
    At C = (0, 0): corners -+0.2 (s + 0.1 n), so A = (-0.148, -0.136) and B = (0.148, 0.136). Plane at height
    0.5: g0_A = (0.5 + 0.136) 0.8 = 0.5088, g0_B = 0.2912. Then -u.n = 0.018 + 0.016 = 0.034, the approach
    takes 0.01*0.8 = 0.008, and ell/2 psi times 1.1 and -0.9 is 0.011 and -0.009.
    """
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(
        quads=True, nx=2, ny=1, mapping=lambda x, y: (1.6 * x - 0.8, y - 1 + 0.75 * (1.6 * x - 0.8))
    )
    body = Body(mesh, SOLID, 1, fixed="bottom")
    facets = ContactFacets(body, Microblock(0.1), Plane(0.5), "top")
    state = ng.GridFunction(body.space)
    for component, value in zip(state.components, (0.03, -0.02, 0.05)):
        component.vec[:] = value
    gaps = facets.nodal_gaps(*state.components, 0.01)
    middle = np.argmin(np.abs(facets.points[:, 0]))
    assert facets.normals[middle] == pytest.approx([-0.6, 0.8])
    assert gaps["A"][middle] == pytest.approx(0.5088 + 0.034 - 0.008 + 0.011, abs=1e-14)
    assert gaps["B"][middle] == pytest.approx(0.2912 + 0.034 - 0.008 - 0.009, abs=1e-14)


def test_corners_without_obstacle_or_with_a_twin_cannot_touch(block):
    facets = block_facets(block, 2, obstacle=Punch(0.5))
    x = facets.points[:, 0]
    assert np.array_equal(facets.can_touch["A"], np.abs(x - 0.2) <= 0.5)
    assert np.array_equal(facets.can_touch["B"], np.abs(x + 0.2) <= 0.5)
    # where psi is prescribed only the nearer corner can ever touch: B on the left of the vertex of a
    # cylinder, A on the right
    clamped = block_facets(block, 2, fixed={"u1": "bottom", "u2": "bottom", "psi": "contact"})
    aside = np.abs(x) > 1e-9
    assert np.array_equal(clamped.can_touch["A"][aside], x[aside] > 0)
    assert np.array_equal(clamped.can_touch["B"][aside], x[aside] < 0)
    turned = Body(
        block, SOLID, 2, fixed={"u1": "bottom", "u2": "bottom"}, prescribed={"psi": {"contact": -0.1}}
    )
    # psi < 0 lowers A
    assert ContactFacets(turned, Microblock(), Plane()).can_touch["A"].all()
    # on an axis of symmetry psi = 0 makes the gaps of A and B one function: one multiplier is dropped
    half = Body(block, SOLID, 2, fixed={"u1": "left", "u2": "bottom", "psi": "left"})
    facets = ContactFacets(half, Microblock(), Plane())
    assert facets.can_touch["A"].all() and np.array_equal(facets.can_touch["B"], facets.points[:, 0] > -1)


def test_microclamped_needs_a_clamped_body(block):
    with pytest.raises(BadArgument, match="prescribes psi"):
        block_facets(block, 1, Microclamped())
    block_facets(block, 1, Microclamped(), fixed={"u1": "bottom", "u2": "bottom", "psi": "bottom|contact"})


ASIDE = Obstacle.from_samples([5, 6], [0, 0])


@pytest.mark.parametrize(
    "make",
    [
        lambda block: ContactFacets(Body(block, SOLID), Unilateral(), Plane(), "hole"),
        lambda block: block_facets(block, 1, obstacle=ASIDE),
    ],
)
def test_contact_that_cannot_be_is_named(block, make):
    with pytest.raises(BadArgument):
        make(block)


def random_state(space, seed, size):
    state = ng.GridFunction(space)
    state.vec.FV().NumPy()[:] = size * np.random.default_rng(seed).normal(size=space.ndof)
    return state


def contact_form(facets, method):
    """The contact functional alone, on (u, psi) and for the augmented Lagrangian the multipliers."""
    space = facets.body.space
    if method == "al":
        for _ in facets.corners:
            space = space * facets.multipliers
    trial = space.TrialFunction()
    form = ng.BilinearForm(space)
    term = (
        facets.penalty(7.0, *trial, 0.3)
        if method == "penalty"
        else facets.augmented_lagrangian(7.0, *trial[:3], trial[3:], 0.3)
    )
    form += ng.Variation(term)
    return form


@pytest.mark.parametrize("method", ["al", "penalty"])
@pytest.mark.parametrize(
    "model", [Microblock(lambda x: 0.1 * x), Unilateral()], ids=["microblock", "unilateral"]
)
@pytest.mark.parametrize("order", [1, 3])
def test_energy_residual_and_tangent_belong_together(block, method, model, order):
    facets = block_facets(block, order, model, Plane(0.2))
    form = contact_form(facets, method)
    space = form.space
    state, along = random_state(space, 4, 0.1), random_state(space, 5, 1.0).vec
    residual, ahead, back = (state.vec.CreateVector() for _ in range(3))
    form.Apply(state.vec, residual)
    # small enough that no node changes its state, so that the functional is quadratic: rounding only
    step = 1e-6
    shifted = [(state.vec + sign * step * along).Evaluate() for sign in (1, -1)]
    slope = (form.Energy(shifted[0]) - form.Energy(shifted[1])) / (2 * step)
    assert slope == pytest.approx(ng.InnerProduct(residual, along), rel=1e-6)
    form.Apply(shifted[0], ahead)
    form.Apply(shifted[1], back)
    form.AssembleLinearization(state.vec)
    tangent = (form.mat * along).Evaluate()
    difference = ((1 / (2 * step)) * (ahead - back) - tangent).Evaluate()
    assert difference.Norm() < 1e-7 * tangent.Norm()
    other = random_state(space, 6, 1.0).vec
    assert ng.InnerProduct(other, tangent) == pytest.approx(
        ng.InnerProduct(along, form.mat * other), rel=1e-12
    )


@pytest.mark.parametrize(
    "multiplier, gap, energy",
    [
        # (38) with rho = 7: (lambda + rho/2 g) g where lambda + rho g <= 0, else -lambda^2/(2 rho)
        (-0.5, -0.1, 0.085),
        (-0.5, 0.05, -0.01625),
        (-0.5, 0.1, -0.25 / 14),
        (0.2, -0.01, -0.04 / 14),
        (0.2, -0.1, 0.015),
    ],
)
def test_augmented_lagrangian_38(multiplier, gap, energy):
    """Numbers worked out by hand for one corner on the depth alone."""
    body = Body(meshes.line(1.0, 1), SOLID, 1)
    form = contact_form(ContactFacets(body, Unilateral(), Plane(gap + 0.3)), "al")
    state = ng.GridFunction(form.space)
    state.components[3].vec[:] = multiplier
    assert form.Energy(state.vec) == pytest.approx(energy, rel=1e-12)  # the approach is 0.3


def penalty_law(gap_at_point, psi, ell=0.4, rho=7.0):
    """t_n and M of (33) at psi0 = 0, from gaps (30), written out once more."""
    gaps = gap_at_point + ell / 2 * psi, gap_at_point - ell / 2 * psi
    closed = [rho * min(gap, 0) for gap in gaps]
    return sum(closed), ell / 2 * (closed[1] - closed[0])


@pytest.mark.parametrize(
    "u2, psi",
    [(0.5, 0.1), (0.1, -1.0), (0.1, 1.0), (-0.5, 0.0)],
    ids=["full", "A only", "B only", "separation"],
)
def test_potential_structure_36(u2, psi):
    """On the depth alone: residual = (-t_n, -M) of (33) and d t_n/d psi = d M/d u2 by finite differences."""
    body = Body(meshes.line(1.0, 1), SOLID, 1)
    facets = ContactFacets(body, Microblock(0.0), Plane(0.0))
    form = contact_form(facets, "penalty")

    def forces(u2, psi):
        state = ng.GridFunction(body.space)
        state.components[1].vec[:], state.components[2].vec[:] = u2 - 0.3, psi
        residual = state.vec.CreateVector()
        form.Apply(state.vec, residual)
        parts = [sum(residual[body.space.Range(i)]) for i in (1, 2)]
        return -parts[0], -parts[1]

    assert forces(u2, psi) == pytest.approx(penalty_law(-u2, psi), abs=1e-13)
    step = 1e-5
    coupling = (forces(u2, psi + step)[0] - forces(u2, psi - step)[0]) / (2 * step)
    assert coupling == pytest.approx(
        (forces(u2 + step, psi)[1] - forces(u2 - step, psi)[1]) / (2 * step), abs=1e-9
    )
    # (36): rho ell/2 with one corner closed (+ for A, - for B), nothing with both or none
    closed = [-u2 + 0.2 * psi < 0, -u2 - 0.2 * psi < 0]
    assert coupling == pytest.approx(7.0 * 0.2 * (closed[0] - closed[1]), abs=1e-9)
