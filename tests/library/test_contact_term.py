"""The contact term: gaps (20)-(22) and forces (29) on paper, rule and nodes, potential structure."""

import ngsolve as ng
import numpy as np
import pytest
from conftest import dome
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from microblock import (
    Body,
    Cosserat,
    Cylinder,
    Microblock,
    Microclamped,
    NotConverged,
    Plane,
    Punch,
    Unilateral,
)
from microblock.fem import meshes, meshes3d
from microblock.fem.facets import ContactFacets
from microblock.fem.newton import MonolithicNewton
from microblock.model.corner_geometry import Blocks

SOLID = Cosserat(E=2.6, nu=0.3, ell=0.4, beta=1)


@pytest.mark.parametrize(
    "model, x, obstacle, normal, expected",
    [
        # N = (-0.02, 1), S = (1, 0.02): A at (-0.25, -0.005), B at (0.25, 0.005)
        (Microblock(0.02), 0.0, Plane(0.01), (0, 1), {"A": 0.015, "B": 0.005}),
        # corners at 0.75 and 1.25, heights 0.75^2/4 and 1.25^2/4; psi0 lifts A by 0.025 and lowers B by 0.025
        (Microblock(-0.1), 1.0, Cylinder(2.0), (0, 1), {"A": 0.140625 - 0.025, "B": 0.390625 + 0.025}),
        (Microblock(-0.1, psi0_in="levers"), 1.0, Cylinder(2.0), (0, 1), {"A": 0.140625, "B": 0.390625}),
        # psi0 = 0.06 at x = 3: 0.25*0.06 = 0.015
        (Microblock(lambda x: 0.02 * x), 3.0, Plane(1.0), (0, 1), {"A": 1.015, "B": 0.985}),
        # tangent s = n x e3 = (0.8, -0.6): A = (-0.2, 0.15), B = (0.2, -0.15); the gap along n is (1 - x2) n2
        (Microblock(), 0.0, Plane(1.0), (0.6, 0.8), {"A": 0.68, "B": 0.92}),
        (Unilateral(), 1.0, Cylinder(2.0), (0, 1), {"C": 0.25}),
        (Microclamped(), 1.0, Cylinder(2.0), (0, 1), {"C": 0.25}),
        (Unilateral(), 0.0, Plane(1.0), (0, -1), {"C": np.inf}),  # faces away
        (Unilateral(), 1.5, Punch(1.0), (0, 1), {"C": np.inf}),
    ],
)
def test_gaps_are_those_worked_out_on_paper(model, x, obstacle, normal, expected):
    points, normals = np.array([[x, 0.0]]), np.array([normal], float)
    gaps = Blocks(model, 0.5).under(obstacle, points, normals).initial_gaps
    assert dict(zip(model.corners, gaps[:, 0])) == pytest.approx(expected, abs=1e-15)


def test_micromoment_is_that_of_29():
    """M = -0.25 (1.02*(-3) + (-0.98)*(-5)) = -0.46; of equal forces M = psi0 ell lambda, where
    the text after fig. 6 has (1 - psi0) on both corners and none.
    """
    for psi0, ell, forces, micromoment in ((0.02, 0.5, (-3.0, -5.0), -0.46), (0.1, 1.0, (-1.0, -1.0), 0.1)):
        multipliers = {name: np.array([force]) for name, force in zip("AB", forces)}
        levers = Microblock(psi0).levers(np.zeros(1))
        moments = [lever * multipliers[name] for name, lever in levers.items()]
        assert -ell / 2 * sum(moments) == pytest.approx([micromoment])
    assert Microblock(-0.1, psi0_in="levers").levers(np.zeros(1)) == {"A": [0.9], "B": [-1.1]}
    assert Unilateral().levers(np.zeros(1)) == Microclamped().levers(np.zeros(1)) == {"C": [0.0]}


# energy, residual and tangent


def at_random(space, seed, size):
    state = ng.GridFunction(space)
    state.vec.FV().NumPy()[:] = size * np.random.default_rng(seed).normal(size=space.ndof)
    return state


# the term against the paper, by hand


RHO = 7.0


def term(lam, gap, reached=True):
    """The augmented Lagrangian's energy of a corner, (38)."""
    closed = reached and lam + RHO * gap <= 0
    return (lam + RHO / 2 * gap) * gap if closed else -(lam**2) / (2 * RHO)


def test_contact_term_is_that_of_the_paper_at_random_states(block):
    """(20)-(22) and (38) at all nodes, some of them out of reach, from fields where the nodes are."""
    approach = 0.3
    facets = ContactFacets(Body(block, SOLID, 3, fixed="bottom"), Microblock(lambda x: 0.1 * x), Punch(0.5))
    space = facets.body.space * facets.multipliers * facets.multipliers
    trial, form = space.TrialFunction(), ng.BilinearForm(space)
    form += ng.Variation(facets.contact(facets.g0, trial[:3], trial[3:], approach, RHO))
    state = at_random(space, 8, 0.1)
    values = state.vec.FV().NumPy()
    ranges = [space.Range(number) for number in (3, 4)]
    multipliers = [facets.multiplier(values[unknowns.start : unknowns.stop]) for unknowns in ranges]
    total = 0.0
    for number, (x, weight) in enumerate(zip(facets.points, facets.weights)):
        u1, u2, psi = (component(block(*x, ng.BND)) for component in state.components[:3])
        arms = SOLID.ell / 2 * np.array([(-1 - 0.1 * x[0], 1 - 0.1 * x[0]), (1 - 0.1 * x[0], 1 + 0.1 * x[0])])
        centre = x - SOLID.ell / 2 * np.array((-0.1 * x[0], 1.0))
        for arm, lam in zip(arms, multipliers):
            corner = centre + arm
            # the face of the punch is at 0, its normal e2
            gap = -corner[1] - approach - (u2 + psi * arm[0])
            total += weight * term(lam[number], gap, abs(corner[0]) <= 0.5)
    assert form.Energy(state.vec) == pytest.approx(total, rel=1e-12)  # rounding
    assert 0 < np.isfinite(facets.g0).sum() < 2 * len(facets.points)


def quadratic(tensor, spherical, symmetric, skew):
    """``spherical tr(T)^2 + symmetric |sym T|^2 + skew |skew T|^2``."""
    parts = ((tensor + tensor.T) / 2, (tensor - tensor.T) / 2)
    return (
        spherical * np.trace(tensor) ** 2 + symmetric * np.sum(parts[0] ** 2) + skew * np.sum(parts[1] ** 2)
    )


def at_place(names, components, place, dim):
    """Vector and gradient of each field at a place, {"u" or "psi": (vector (3,), gradient (3, 3))}."""
    fields = {kind: (np.zeros(3), np.zeros((3, 3))) for kind in ("u", "psi")}
    axes = {1: [1], 2: [0, 1], 3: [0, 1, 2]}[dim]  # x2 in one dimension
    for name, component in zip(names, components):
        row = int(name[-1]) - 1 if name[-1] != "i" else 2
        vector, gradient = fields[name.rstrip("123")]
        vector[row] = component(place)
        gradient[row, axes] = ng.grad(component)(place)
    return fields


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_energy_is_10_to_12_at_random_states(block, dim):
    solid = Cosserat(E=100, nu=0.2, beta=0.6, ell=0.3, curvature=1.3, alpha_prime=0.4, beta_prime=-0.7)
    ticks = np.linspace(0, 1, 3)
    mesh = {1: meshes.line(1.0, 2), 2: block, 3: meshes3d.block(ticks, ticks, ticks - 1)}[dim]
    body = Body(mesh, solid, 2)
    place = mesh(*{1: (-0.3,), 2: (0.3, -0.2), 3: (0.3, 0.6, -0.2)}[dim])
    state = at_random(body.space, 9, 1.0)
    fields = at_place(body.names, state.components, place, dim)
    gamma = fields["u"][1] - np.cross(np.eye(3), fields["psi"][0])  # (1): u_i,j + eps_ijk psi_k
    W = quadratic(gamma, solid.lam / 2, solid.mu, solid.mu_c)
    b, c = solid.beta_prime, solid.curvature
    W += solid.ell**2 * solid.mu / 2 * quadratic(fields["psi"][1], solid.alpha_prime, c + b, c - b)
    assert body.energy(*state.components)(place) == pytest.approx(W, rel=1e-12)  # rounding


@pytest.mark.parametrize("order", [1, 2])
def test_contact_term_in_space_with_given_multipliers(order):
    """The same on facets that are no parallelograms, where areas of nodes are not the rule's weights."""
    mesh = MakeStructured3DMesh(
        nx=2, mapping=lambda x, y, z: (x + 0.6 * x * (1 - x) * y, y - 0.4 * y * (1 - y) * x, z - 1)
    )
    body, psi0 = Body(mesh, SOLID, order, fixed="bottom", contact="top"), np.array((0.05, -0.03, 0.0))
    nodes = ContactFacets(body, Microblock(tuple(psi0[:2])), lambda x1, x2: 0 * x1)
    random = np.random.default_rng(3)
    g0, lams = random.normal(size=(2, 4, len(nodes.weights)))
    g0[random.random(g0.shape) < 0.2] = np.inf  # out of reach
    space = body.space * ng.NumberSpace(mesh, definedon=nodes.region)
    *trial, approach = space.TrialFunction()
    form = ng.BilinearForm(space)
    form += ng.Variation(nodes.contact(g0, trial, [nodes.field(lam) for lam in lams], approach, RHO))
    state = at_random(space, 8, 0.1)
    sides = np.array(((-1, -1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, 1)))
    arms = SOLID.ell / 2 * sides @ (np.eye(3) + np.cross(psi0, np.eye(3)))
    # a point of a bilinear facet is located by NGSolve to some digits alone
    values = state.vec.FV().NumPy()[: body.space.ndof]
    u, psi = np.array([nodes.traces[name] @ values for name in body.names]).reshape(2, 3, -1)
    gaps = g0 - state.components[-1].vec[0] - u[2] - np.array([np.cross(psi.T, arm)[:, 2] for arm in arms])
    total = sum(nodes.weights @ [*map(term, *corner)] for corner in zip(lams, gaps))
    assert form.Energy(state.vec) == pytest.approx(total, rel=1e-12)  # rounding
    assert np.ptp(nodes.weights / nodes.shares) > (1e-3 if order == 1 else -1)


# --- semismooth Newton: conditions of contact, independence of rho, the slope of the energy, typed failures


def indented(block, model=Microblock(), order=2, **options):
    """A block pressed by a cylinder."""
    body = Body(block, SOLID, order, fixed={"u1": "bottom", "u2": "bottom"})
    return MonolithicNewton(ContactFacets(body, model, Cylinder(1.0)), **options)


def test_result_does_not_depend_on_rho(block):
    stiffness = indented(block).rho
    law, powers = Microblock(0.05), (-4, -2, 2, 4, 0)
    states = [indented(block, law, rho=stiffness * 10.0**k).solve(0.1) for k in powers]
    *forces, wanted = (state.forces for state in states)
    # rounding by the conditioning of the extreme rho
    assert forces == pytest.approx(np.array(4 * [wanted]), abs=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("model", [Microblock(), Microblock(0.05), Unilateral()], ids=str)
def test_the_load_on_curved_and_inclined_surfaces_is_the_slope_of_the_energy(model):
    """Which knows nothing of normals, corners and levers."""
    inclined = MakeStructured2DMesh(nx=6, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1.5 + x))
    for body, obstacle, approach in (
        (Body(dome(), SOLID, 3, fixed="base"), Plane(1.0), 0.15),
        (Body(inclined, SOLID, 2, fixed="bottom", contact="top"), lambda x: 0.5 * x + x**2, 0.1),
    ):
        newton = MonolithicNewton(ContactFacets(body, model, obstacle))
        low, state, high = (newton.solve(approach + step) for step in (-1e-6, 0, 1e-6))
        slope = (high.fields.energy() - low.fields.energy()) / 2e-6
        # on curved elements the energy is integrated to a higher order than the form, which differs by 1e-7
        assert slope == pytest.approx(state.load, rel=1e-6)


@pytest.mark.parametrize("method", ["al", "penalty"])
def test_rounding_of_a_high_rho_is_an_error_not_a_result(block, method):
    with pytest.raises(NotConverged):
        indented(block, method=method, rho=1e16).solve(0.1)


def test_a_residual_that_falls_slowly_does_not_stall(block):
    """Rounding of a large rho leaves a step that halves the residual again and again."""
    body = Body(block, mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085), 1, fixed="bottom")
    usual, large = (
        mb.Contact(body, Cylinder(R=10), Microblock(), mb.Newton("al", rho=rho)).solve(load=1.0).pressure
        for rho in (None, 1e12)
    )
    assert large == pytest.approx(usual, abs=1e-3 * usual.max())  # the rounding of rho


def pressed_by_multipliers(facets, load, steps=10):
    """The multipliers of both corners at the nodes, under (37) by Newton's method from a start where corners
    touch.
    """
    body = facets.body
    space = body.space * facets.multipliers * facets.multipliers
    space = space * ng.NumberSpace(body.mesh, definedon=facets.region)
    *fields, lam_A, lam_B, approach = space.TrialFunction()
    contact_boundary = ng.ds(definedon=facets.region)
    form = ng.BilinearForm(space)
    form += ng.Variation(body.energy(*fields) * ng.dx)
    form += ng.Variation(facets.contact(facets.g0, fields, (lam_A, lam_B), approach, 1e4))
    form += ng.Variation(-load / facets.weights.sum() * approach * contact_boundary)
    state = ng.GridFunction(space)
    state.vec[space.ndof - 1] = 0.02
    for _ in range(steps):
        form.AssembleLinearization(state.vec)
        residual = state.vec.CreateVector()
        form.Apply(state.vec, residual)
        step = (form.mat.Inverse(space.FreeDofs(), "umfpack") * residual).Evaluate()
        state.vec.data -= step
    assert step.Norm() < 1e-9 * state.vec.Norm()  # rounding
    return np.array([facets.multiplier(lam.vec.FV().NumPy()) for lam in state.components[3:5]])


def test_at_gauss_points_multipliers_would_pull():
    """The control of the nodal rule: at Gauss points (40) holds in the mean over a facet alone, and leaves
    tension of 13 % of the largest pressure beside the edges; at the nodes there is none but rounding.
    """
    mesh = meshes.uniform(meshes.Ground(far=1.0, reach=(-0.5, 0.5), half=False), 0.1)
    body = Body(mesh, mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085), 1, fixed="bottom")
    nodal, gauss = (ContactFacets(body, Microblock(), Cylinder(R=10)) for _ in range(2))
    gauss.rules = {ng.SEGM: ng.IntegrationRule(ng.SEGM, 3)}
    tension = {}
    for name, facets in {"nodal": nodal, "gauss": gauss}.items():
        multipliers = pressed_by_multipliers(facets, load=1.0)
        tension[name] = np.max(multipliers) / -np.min(multipliers)
    assert tension["nodal"] < 1e-12
    assert tension["gauss"] > 0.1


@pytest.mark.parametrize("orders", [(2, 2), (3, 2), (5, 3), (2, 3), (2, 1), (3, 1), (4, 2)])
def test_an_even_pressure_passes_whatever_the_order_of_psi_or_it_is_refused(orders):
    """Uniaxial strain of a block: M = lambda + 2 mu = 120, the strain 0.01. The nodes are those of the lower
    order, whose rule is exact up to twice this order less one: with orders 2 and 1 the force was 4 % low.
    """
    order, order_psi = orders
    mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, y: (x, y - 1))
    solid = Cosserat(E=100, nu=0.25, ell=0.1, beta=1)
    fixed = {"u1": "left|right", "u2": "bottom", "psi": "left|right|bottom"}
    body = Body(mesh, solid, order, order_psi=order_psi, fixed=fixed, contact="top")
    problem = mb.Contact(body, lambda x: 0 * x, Microblock())
    if order > 2 * order_psi - 1:
        with pytest.raises(mb.BadArgument, match="order_psi = .*must be at least"):
            problem.solve(approach=0.01)
    else:
        state = problem.solve(approach=0.01)
        assert state.pressure == pytest.approx(1.2, rel=1e-9)  # rounding of the condensation
