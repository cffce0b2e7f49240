"""The contact term in forms of one's own: the answers of `Body`, in any units, and what is refused."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve import Grad, InnerProduct, Sym, Trace
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from cases import own_form, rubber
from microblock.fem import meshes, semismooth
from microblock.fem.contact_surface import ContactSurface

ELL = 0.1
SOLID = mb.Cosserat(E=100, nu=0.3, ell=ELL, beta=1)
CYLINDER = mb.Cylinder(R=10)
APPROACH = 0.008


def ground():
    return meshes.uniform(meshes.Ground(far=2.0, reach=(-0.5, 0.5), half=False), 0.1)


def energy(solid, u, psi):
    """(10)-(12) in the plane."""
    strain = Sym(Grad(u))
    spin = (Grad(u)[0, 1] - Grad(u)[1, 0]) / 2 + psi
    couple = solid.curvature / 2 * solid.mu * ELL**2 * InnerProduct(ng.grad(psi), ng.grad(psi))
    stretch = solid.lam / 2 * Trace(strain) ** 2 + solid.mu * InnerProduct(strain, strain)
    return stretch + 2 * solid.mu_c * spin**2 + couple


def by_hand(mesh, law, solid=SOLID, order=2, held="", rho=None):
    """Contact, corners, state and pressures of a form that is written by hand."""
    contact = ContactSurface(mesh, "contact", order=order)
    rotation = ng.H1(mesh, order=order, dirichlet=held)
    corners = contact.corners(law, CYLINDER, ELL, rotation)
    space = ng.VectorH1(mesh, order=order, dirichlet="bottom") * rotation
    for _ in corners.names:
        space = space * contact.multipliers
    (u, psi, *lam), (v, phi, *mu) = space.TnT()
    form = ng.BilinearForm(space)
    form += ng.Variation(energy(solid, u, psi) * ng.dx)
    rho = solid.E if rho is None else rho
    form += corners.virtual_work(u, psi, lam, v, phi, mu, rho=rho, approach=APPROACH)
    state = ng.GridFunction(space)
    semismooth.solve(form, state)
    return contact, corners, state, corners.pressures(state.components[2:])


@pytest.mark.parametrize("law", [mb.Microblock(0.01), mb.Unilateral()], ids=repr)
@pytest.mark.parametrize("units", [1.0, 1e9, 1e-9])
def test_a_form_by_hand_has_the_pressures_of_a_body(law, units):
    """Also where rho is so large that 1 is lost beside it: NGSolve takes mixed derivatives from sums."""
    mesh = ground()
    solid = mb.Cosserat(E=100 * units, nu=0.3, ell=ELL, beta=1)
    contact, corners, _, pressures = by_hand(mesh, law, solid)
    body = mb.Body(mesh, solid, 2, fixed={"u1": "bottom", "u2": "bottom"})
    state = mb.Contact(body, CYLINDER, law).solve(approach=APPROACH)
    expected = np.array([*state.pressures.values()])
    # rounding of a factorisation
    assert pressures == pytest.approx(expected, abs=1e-11 * expected.max())
    assert contact.weights @ pressures.sum(axis=0) == pytest.approx(state.load, rel=1e-12)
    assert corners.names == law.corners


def test_functional_and_virtual_work_have_one_answer():
    """Newton's method ends where the first derivatives vanish; beside a large rho second ones of the
    functional lose digits, so that the last step is larger than rounding.
    """
    mesh = ground()
    contact = ContactSurface(mesh, "contact", order=2)
    corners = contact.corners(mb.Microblock(), CYLINDER, ELL)
    space = ng.VectorH1(mesh, order=2, dirichlet="bottom") * ng.H1(mesh, order=2)
    space = space * contact.multipliers * contact.multipliers
    (u, psi, *lam), (v, phi, *mu) = space.TnT()
    rho = 1e8
    terms = (
        corners.virtual_work(u, psi, lam, v, phi, mu, rho=rho, approach=APPROACH),
        ng.Variation(corners.lagrangian(u, psi, lam, rho=rho, approach=APPROACH)),
    )
    changes, pressures = [], []
    for term in terms:
        form = ng.BilinearForm(space)
        form += ng.Variation(energy(SOLID, u, psi) * ng.dx)
        form += term
        state = ng.GridFunction(space)
        changes.append(semismooth.solve(form, state).change)
        pressures.append(corners.pressures(state.components[2:]))
    assert pressures[0] == pytest.approx(pressures[1], abs=1e-9 * pressures[0].max())
    assert 30 * changes[0] < changes[1]


def test_the_penalty_functional_is_that_of_newton():
    mesh = ground()
    contact = ContactSurface(mesh, "contact", order=1)
    corners = contact.corners(mb.Microblock(), CYLINDER, ELL)
    space = ng.VectorH1(mesh, order=1, dirichlet="bottom") * ng.H1(mesh, order=1)
    u, psi = space.TrialFunction()
    form = ng.BilinearForm(space)
    form += ng.Variation(energy(SOLID, u, psi) * ng.dx)
    form += ng.Variation(corners.penalty(u, psi, rho=1e6, approach=APPROACH))
    state = ng.GridFunction(space)
    semismooth.solve(form, state)
    pressures = corners.penalty_pressures(*state.components, rho=1e6, approach=APPROACH)
    body = mb.Body(mesh, SOLID, 1, fixed={"u1": "bottom", "u2": "bottom"})
    newton = mb.Contact(body, CYLINDER, mb.Microblock(), mb.Newton("penalty", rho=1e6)).solve(
        approach=APPROACH
    )
    expected = np.array([*newton.pressures.values()])
    assert pressures == pytest.approx(expected, abs=1e-9 * expected.max())  # of cond(K) eps


def test_the_load_may_be_given_and_the_approach_unknown():
    mesh = ground()
    contact = ContactSurface(mesh, "contact", order=2)
    corners = contact.corners(mb.Unilateral(), CYLINDER)
    fields = ng.VectorH1(mesh, order=2, dirichlet="bottom") * contact.multipliers
    space = fields * ng.NumberSpace(mesh, definedon=contact.region)
    (u, lam, d), (v, mu, e) = space.TnT()
    load = 0.5
    form = ng.BilinearForm(space)
    strain = Sym(Grad(u))
    form += ng.Variation(
        (SOLID.lam / 2 * Trace(strain) ** 2 + SOLID.mu * InnerProduct(strain, strain)) * ng.dx
    )
    form += corners.virtual_work(u, None, [lam], v, None, [mu], rho=100, approach=d, varied_approach=e)
    form += contact.integral(-load / contact.weights.sum() * e)
    state = ng.GridFunction(space)
    state.components[2].vec[0] = 1e-3  # where something touches
    semismooth.solve(form, state)
    (pressure,) = corners.pressures(state.components[1:2])
    body = mb.Body(mesh, mb.Elastic(E=100, nu=0.3), 2, fixed="bottom")
    expected = mb.Contact(body, CYLINDER, mb.Unilateral()).solve(load=load)
    assert contact.weights @ pressure == pytest.approx(load, rel=1e-10)
    assert state.components[2].vec[0] == pytest.approx(expected.approach, rel=1e-9)


def test_where_psi_is_held_the_nearest_corner_stands_alone():
    _, corners, _, pressures = by_hand(ground(), mb.Microblock(), held="contact|bottom")
    assert np.isinf(corners.initial_gaps).any(axis=0).all() and (pressures.sum(axis=0) > 0).any()


@pytest.mark.parametrize("dim", [2, 3])
def test_an_approach_is_vertical_on_a_tilted_boundary(dim):
    """Gaps fall by the approach times the upward component of n, which is 1/sqrt(1 + .3^2) (to rounding)."""
    if dim == 2:
        mesh = MakeStructured2DMesh(nx=2, ny=1, mapping=lambda x, y: (x, y + 0.3 * x))
        obstacle, u = (lambda x: 3 + 0 * x), ng.CF((0, 0))
    else:
        mesh = MakeStructured3DMesh(nx=2, ny=1, nz=1, mapping=lambda x, y, z: (x, y, z + 0.3 * x))
        obstacle, u = (lambda x1, x2: 3 + 0 * x1), ng.CF((0, 0, 0))
    boundary = ContactSurface(mesh, "top", order=1)
    corners = boundary.corners(mb.Unilateral(), obstacle)
    gaps = [boundary.at_nodes(corners.gaps(u, approach=approach)[0]) for approach in (0.0, 0.1)]
    assert gaps[0] - gaps[1] == pytest.approx(0.1 / np.hypot(1, 0.3), rel=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_a_form_in_space_has_the_pressures_of_a_body(order):
    mesh = MakeStructured3DMesh(hexes=False, nx=3, ny=3, nz=2, mapping=lambda x, y, z: (x, y, z - 1))
    contact = ContactSurface(mesh, "top", order=order)
    corners = contact.corners(mb.Unilateral(), mb.Sphere(R=2))
    space = ng.VectorH1(mesh, order=order, dirichlet="bottom") * contact.multipliers
    (u, lam), (v, mu) = space.TnT()
    solid = mb.Elastic(E=1, nu=0.3)
    strain = Sym(Grad(u))
    form = ng.BilinearForm(space)
    form += ng.Variation(
        (solid.lam / 2 * Trace(strain) ** 2 + solid.mu * InnerProduct(strain, strain)) * ng.dx
    )
    form += corners.virtual_work(u, None, [lam], v, None, [mu], rho=1, approach=0.1)
    state = ng.GridFunction(space)
    semismooth.solve(form, state)
    (pressure,) = corners.pressures(state.components[1:])
    body = mb.Body(mesh, solid, order, fixed="bottom", contact="top")
    expected = mb.Contact(body, mb.Sphere(R=2), mb.Unilateral()).solve(approach=0.1)
    # projected gradients end at a residual of 1e-9
    assert pressure == pytest.approx(expected.pressure, abs=1e-7 * expected.pressure.max())


def test_the_examples():
    """A graded layer carries less than one of the surface's moduli, and rubber begins as the linear solid."""
    x, pressures = own_form.solve(approaches=(0.05,))
    _, stiff = own_form.solve(softer=1.0, approaches=(0.05,))
    assert np.ptp(x) > 4 and pressures[0.05].max() < 0.95 * stiff[0.05].max()
    small = rubber.solve(size=0.4, approaches=(1e-5, 0.2))
    first, last = small["loads"]["neo-Hookean"] / small["loads"]["linear"]
    assert first == pytest.approx(1, abs=1e-4) and last > 1.1  # of second order in the strain, 1e-5


MESH = MakeStructured2DMesh(nx=2, ny=2)


def glued():
    """Two rectangles with a boundary between them."""
    lower = occ.MoveTo(0, 0).Rectangle(1, 1).Face()
    upper = occ.MoveTo(0, 1).Rectangle(1, 1).Face()
    both = occ.Glue([lower, upper])
    for edge in both.edges:
        edge.name = "inner" if abs(edge.center.y - 1) < 1e-9 else "outer"
    return ng.Mesh(occ.OCCGeometry(both, dim=2).GenerateMesh(maxh=1.0))


def of_order(surface, displacement):
    """The term on a surface of one order, of a displacement of another: an even pressure would not pass."""
    contact = ContactSurface(MESH, "top", order=surface)
    space = ng.VectorH1(MESH, order=displacement) * contact.multipliers
    u, lam = space.TrialFunction()
    return contact.corners(mb.Unilateral(), mb.Plane(0.9)).lagrangian(u, None, [lam], rho=1)


def solved(**options):
    space = ng.VectorH1(MESH, order=1)
    form = ng.BilinearForm(space)
    form += ng.Variation(InnerProduct(space.TrialFunction(), space.TrialFunction()) * ng.dx)
    return semismooth.solve(form, ng.GridFunction(space), **options)


@pytest.mark.parametrize(
    "build, message",
    [
        (
            lambda: ContactSurface(MESH, "lid"),
            "boundary = 'lid': is none of the mesh's boundaries, bottom, left, right, top",
        ),
        (lambda: ContactSurface(MESH, "top", order=0), "order = 0"),
        (lambda: ContactSurface("mesh", "top"), "mesh = 'mesh': must be an ngsolve.Mesh"),
        (lambda: ContactSurface(MESH, "top").corners(mb.Microblock(), CYLINDER), "ell = None: must be given"),
        (lambda: ContactSurface(MESH, "top").corners(mb.Microblock(), CYLINDER, -1.0), "ell = -1.0"),
        (
            lambda: ContactSurface(MESH, "top").corners(mb.Microblock(friction=0.3), CYLINDER, 0.1),
            "friction = 0.3: must be 0",
        ),
        (
            lambda: ContactSurface(MESH, "top").corners(mb.Microblock(), CYLINDER, 0.1).gaps(ng.CF((0, 0))),
            "psi = None: must be given",
        ),
        (
            lambda: ContactSurface(MESH, "top").corners(mb.Unilateral(), CYLINDER).gaps(ng.CF((0, 0, 0))),
            "must have 2 components",
        ),
        (
            lambda: (
                ContactSurface(MESH, "top")
                .corners(mb.Microblock(), CYLINDER, 0.1)
                .lagrangian(ng.CF((0, 0)), ng.CF(0), [ng.CF(0)], rho=1)
            ),
            "must be 2, one for each of the corners A, B",
        ),
        (lambda: semismooth.solve(None, None), "form = None"),
        (lambda: ContactSurface(MESH, "t(op"), "boundary = 't(op': is no regular expression"),
        (
            lambda: ContactSurface(MESH, "top|lid"),
            "boundary = 'top|lid': lid is none of the mesh's boundaries",
        ),
        (
            lambda: ContactSurface(MESH, 3),
            "boundary = 3: must be a name or pattern of bottom, left, right, top",
        ),
        (
            lambda: ContactSurface(MakeStructured3DMesh(hexes=False, nx=1, ny=1, nz=1), "top", order=3),
            "order = 3: must be 1 or 2 where triangles are in contact",
        ),
        (lambda: ContactSurface(glued(), "inner"), "boundary = 'inner': must have the mesh on one side"),
        (lambda: of_order(1, 2), "order = 1: must be the order of u, 2"),
        (lambda: of_order(2, 1), "order = 2: must be the order of u, 1"),
        (
            lambda: ContactSurface(MESH, "top").corners(mb.Unilateral(), ng.x * ng.x),
            "must be a function of arrays",
        ),
        (
            lambda: mb.Contact(mb.HalfPlane(SOLID), ng.x * ng.x, mb.Unilateral()),
            "must be a function of arrays",
        ),
        (lambda: solved(rtol=1.0), "rtol = 1.0"),
        (lambda: solved(rtol=1e-30), "rtol = 1e-30"),
        (lambda: solved(inverse="sparsecholesky"), "inverse = 'sparsecholesky'"),
        (lambda: solved(free=ng.BitArray(3)), "must have"),
    ],
)
def test_bad_arguments_are_named(build, message):
    with pytest.raises(mb.BadArgument) as raised:
        build()
    assert message in str(raised.value)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("height", [0.9, 1.0, 1.5])  # of the obstacle over the top at 1
def test_an_unsupported_body_is_said(order, height):
    contact = ContactSurface(MESH, "top", order=order)
    corners = contact.corners(mb.Unilateral(), mb.Plane(height))
    space = ng.VectorH1(MESH, order=order) * contact.multipliers
    (u, lam), (v, mu) = space.TnT()
    form = ng.BilinearForm(space)
    form += ng.Variation(InnerProduct(Sym(Grad(u)), Sym(Grad(u))) * ng.dx)
    form += corners.virtual_work(u, None, [lam], v, None, [mu], rho=1)
    with pytest.raises(mb.NotConverged, match="rigid motions of the body|still changes"):
        semismooth.solve(form, ng.GridFunction(space))
