"""Bodies on meshes without and with contact: moduli, patch tests, rates, balances, limits, refusals."""

import dataclasses
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import netgen.meshing as netgen
import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from conftest import dome, rectangle
from ngsolve import x, y
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh
from scipy.sparse import csr_matrix

import microblock as mb
from microblock import BadArgument, Body, Contact, Cosserat, Newton, Plane, Unilateral, cost
from microblock.fem import contact_term, factors, meshes, meshes3d
from microblock.fem.body_spaces import FIELDS3D as FIELDS
from microblock.fem.body_spaces import free_unknowns
from microblock.fem.loads import Loads
from tests import closed_forms

SHAPES = pytest.mark.parametrize("quads", [False, True], ids=["triangles", "quadrilaterals"])
SOLID = Cosserat(E=100, nu=0.3, ell=0.2, beta=0.7, curvature=1.5)
SMOOTH = Cosserat(E=2.6, nu=0.3, ell=0.3, beta=1)
TWISTED = Cosserat(E=100, nu=0.2, beta=0.6, ell=0.3, curvature=1.3, alpha_prime=0.4, beta_prime=-0.7)


# moduli


def test_measures_of_the_coupling_agree():
    for same in (Cosserat(100, 0.3, 0.2, eta=SOLID.eta), Cosserat(100, 0.3, 0.2, mu_c=SOLID.eta * SOLID.mu)):
        assert same.beta == pytest.approx(0.7, rel=1e-15)
    assert SOLID.eta == pytest.approx(0.7 / 1.3, rel=1e-15)
    # a difference of 1 and nearly 1 would lose the digits
    assert Cosserat(100, 0.3, 0.2, mu_c=1e12).mu_c == pytest.approx(1e12, rel=1e-14)
    assert dataclasses.replace(SOLID, nu=0.1).beta == pytest.approx(0.7, rel=1e-15)
    # gamma' = 2, which (44)-(49) need, not the 1 of (18)
    assert Cosserat(E=100, nu=0.3, ell=0.2, beta=0.64).layer_length == pytest.approx(0.25, rel=1e-15)
    assert Cosserat(100, 0.3, 0.2, beta=0).layer_length == math.inf


# patch tests of Providas and Kattis (2002): mu = 1000, nu = 0.25, mu_c = 500, m = 4 mu ell^2 grad psi

PATCH = Cosserat(E=2500, nu=0.25, ell=0.1, mu_c=500, curvature=4)
PATCHES = {  # microrotation over 1e-3, loads, sigma_12 - 1.5, m
    1: (0.25 + 0 * x, Loads(), 0 * x, (0, 0)),
    2: (0.75 + 0 * x, Loads(couple=1), 0.5 + 0 * x, (0, 0)),
    3: (0.25 + (x - y), Loads(force=(1, 1), couple=2 * (x - y)), x - y, (0.04, -0.04)),
}


def stress_error(case, loads=None, order=2, quads=False):
    """Relative L2 error of stresses and couple stresses."""
    psi, usual_loads, excess, m = PATCHES[case]
    values = {"u1": 1e-3 * (x + y / 2), "u2": 1e-3 * (x + y), "psi": 1e-3 * psi}
    body = Body(rectangle(0.24, 0.12, 0.05, quads), PATCH, order, prescribed=on_all_sides(values))
    fields = body.solve(loads or usual_loads)
    exact = ng.CF((4, 1.5 + excess, 1.5 - excess, 4, *m))
    off = ng.CF((fields.stress, fields.couple_stress)) - exact
    return math.sqrt(
        ng.Integrate(ng.InnerProduct(off, off), body.mesh)
        / ng.Integrate(ng.InnerProduct(exact, exact), body.mesh)
    )


def on_all_sides(values):
    return {name: {".*": value} for name, value in values.items()}


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 4])
@pytest.mark.parametrize("case", PATCHES)
def test_patch(quads, order, case):
    # the solution is linear, so any mesh is exact up to rounding
    assert stress_error(case, None, order, quads) < 1e-11


@pytest.mark.parametrize(
    "case, loads",
    [
        (2, Loads(couple=-1)),
        (3, Loads(force=(1, 1), couple=-2 * (x - y))),
        (3, Loads(force=(-1, -1), couple=2 * (x - y))),
    ],
)
def test_patch_with_the_sign_of_printed_19_misses(case, loads):
    """Negative control: (19)_2 with the paper's own eps:A would have sigma_12 - sigma_21 = -l."""
    assert stress_error(case, loads) > 1e-3  # eight decades above rounding


# manufactured fields


WAVES = dict(zip(("u1", "u2", "psi"), (ng.sin(2 * x + y), ng.cos(x - 2 * y), ng.sin(x) * ng.cos(3 * y))))


def waves(mesh, order):
    """L2 error and H1 seminorm error under loads that make WAVES an equilibrium: f = -div sigma, and
    l = sigma_12 - sigma_21 - div m.
    """
    u1, u2, psi = WAVES.values()
    gradient = ng.CF((u1.Diff(x), u1.Diff(y), u2.Diff(x), u2.Diff(y)), dims=(2, 2))
    (s11, s12), (s21, s22) = closed_forms.stress(SMOOTH, gradient, psi)
    m1, m2 = closed_forms.couple_stress(SMOOTH, (psi.Diff(x), psi.Diff(y)))
    force = -s11.Diff(x) - s12.Diff(y), -s21.Diff(x) - s22.Diff(y)
    loads = Loads(force=force, couple=s12 - s21 - m1.Diff(x) - m2.Diff(y))
    fields = Body(mesh, SMOOTH, order, prescribed=on_all_sides(WAVES)).solve(loads)
    offs = [field - exact for field, exact in zip(fields, WAVES.values())]
    slopes = [
        ng.grad(field) - ng.CF((exact.Diff(x), exact.Diff(y))) for field, exact in zip(fields, WAVES.values())
    ]
    squares = sum(off**2 for off in offs), sum(ng.InnerProduct(slope, slope) for slope in slopes)
    return np.sqrt([ng.Integrate(square, mesh, order=2 * order + 6) for square in squares])


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_rates(quads, order):
    def mapped(s, t):
        return s + 0.2 * t, t + 0.1 * s * t

    errors = [waves(MakeStructured2DMesh(quads, n, n, mapping=mapped), order) for n in (4, 8)]
    rates = np.log2(errors[0] / errors[1])
    assert rates == pytest.approx([order + 1, order], abs=0.25)  # asymptotic to this much at h = 1/8


def test_curved_boundary_converges():
    errors = [waves(dome(order), order)[0] for order in (2, 4, 6)]
    # a straight-sided mesh would stop near 1e-2; raising the order on the curved one gains a digit each time
    assert errors[2] < 1e-5 and errors[0] > 10 * errors[1] > 100 * errors[2]


def box(n=2, solid=TWISTED, order=1, fixed="bottom"):
    """The unit square times [-1, 0]."""
    ticks = np.linspace(0, 1, n + 1)
    return Body(meshes3d.block(ticks, ticks, ticks - 1), solid, order, fixed=fixed)


@pytest.mark.parametrize("order", [1, 2])
def test_manufactured_fields_in_space_converge_with_the_order_plus_one(order):
    wave = ng.sin(ng.x + 2 * ng.y), ng.cos(2 * ng.x - ng.z), ng.sin(ng.y * ng.z + ng.x)
    u, psi = (ng.CF(tuple((1 + ng.z) * component for component in waves)) for waves in (wave, wave[::-1]))
    axes = ng.x, ng.y, ng.z

    def gradient(vector):
        return ng.CF(tuple(vector[i].Diff(along) for i in range(3) for along in axes), dims=(3, 3))

    def divergence(tensor):
        return [sum(tensor[i, j].Diff(along) for j, along in enumerate(axes)) for i in range(3)]

    twist = ng.CF((0, psi[2], -psi[1], -psi[2], 0, psi[0], psi[1], -psi[0], 0), dims=(3, 3))
    sigma = contact_term.stress(TWISTED, gradient(u) + twist)
    m = contact_term.couple_stress(TWISTED, gradient(psi))
    # (19): div m - eps : sigma + l = 0, (eps : sigma)_i = eps_ijk sigma_kj
    axial = [sigma[2, 1] - sigma[1, 2], sigma[0, 2] - sigma[2, 0], sigma[1, 0] - sigma[0, 1]]
    n = ng.specialcf.normal(3)
    sides = "left|right|front|back|contact"
    loads = Loads(
        force=tuple(-part for part in divergence(sigma)),
        couple=tuple(-part - moment for part, moment in zip(divergence(m), axial)),
        traction={sides: tuple((sigma * n)[i] for i in range(3))},
        micromoment={sides: tuple((m * n)[i] for i in range(3))},
    )
    errors = []
    for count in (2, 4):
        fields = box(count, order=order).solve(loads)
        offs = fields.u - u, fields.psi - psi
        square = sum(ng.InnerProduct(off, off) for off in offs)
        errors.append(np.sqrt(ng.Integrate(square, fields.body.mesh, order=2 * order + 4)))
    # two coarse meshes: the rate is not that of the limit yet
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=0.25)


# rigid motions, work, balances


LOADS = Loads(force=(0.1, -0.2), couple=0.3, traction={"top": (0.5, -0.1)}, micromoment={"top": 0.7})


@SHAPES
@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("fixed", ["bottom", {"u1": "left", "u2": "bottom|right", "psi": "bottom"}])
def test_energy_is_half_the_work_of_the_loads_and_reactions_balance_them(quads, order, fixed):
    """A block [0, 1] x [0, 0.5]: body forces act at (1/2, 1/4), tractions at (1/2, 1/2); to rounding."""
    fields = Body(rectangle(1, 0.5, 0.3, quads), SMOOTH, order, fixed=fixed).solve(LOADS)
    mesh = fields.body.mesh
    work = ng.Integrate(0.1 * fields.u1 - 0.2 * fields.u2 + 0.3 * fields.psi, mesh)
    along = 0.5 * fields.u1 - 0.1 * fields.u2 + 0.7 * fields.psi
    work += ng.Integrate(along, mesh, definedon=mesh.Boundaries("top"), order=8)
    assert fields.energy() == pytest.approx(work / 2, rel=1e-12)
    force, moment = fields.reaction(fixed if isinstance(fixed, str) else "left|bottom|right")
    assert force == pytest.approx([-0.05 - 0.5, 0.1 + 0.1], abs=1e-12)
    turning = (0.5 * -0.1 - 0.25 * 0.05) + 0.5 * 0.3 + (0.5 * -0.1 - 0.5 * 0.5) + 0.7
    assert moment == pytest.approx(-turning, abs=1e-12)
    if not isinstance(fixed, str):  # u1 is held on the left alone
        assert fields.reaction("left").force == pytest.approx([-0.55, 0], abs=1e-12)
        assert fields.reaction("right").force[0] == 0


def test_stress_is_read_on_a_boundary_as_it_is_beside_it():
    """It was 0 there: the gradient that NGSolve gives on a boundary is another one."""
    fields = Body(rectangle(1, 0.5, 0.1), SMOOTH, 4, fixed="bottom").solve(LOADS)
    mesh = fields.body.mesh
    top, bottom = mesh.Boundaries("top"), mesh.Boundaries("bottom")
    # along the loaded side the stress is that of the load; at the ends of the held one it is singular
    assert ng.Integrate(fields.stress[1, 1], mesh, definedon=top) == pytest.approx(-0.1, abs=1e-3)
    assert ng.Integrate(fields.couple_stress[1], mesh, definedon=top) == pytest.approx(0.7, abs=1e-3)
    below = ng.Integrate(fields.stress[1, 1], mesh, definedon=bottom)
    assert -below == pytest.approx(fields.reaction("bottom").force[1], rel=0.05)


def test_loads_of_the_users_are_integrated_as_fields_are():
    """A traction that is no polynomial does the work that it has: the reaction balances its integral."""
    body = Body(MakeStructured2DMesh(nx=6, ny=4, mapping=lambda s, t: (2 * s, t)), SMOOTH, 1, fixed="bottom")
    wave = ng.sin(4 * x) ** 2
    force, _ = body.solve(Loads(traction={"top": (0, wave)})).reaction("bottom")
    total = ng.Integrate(wave, body.mesh, definedon=body.mesh.Boundaries("top"), order=40)
    # elements of order 1 and bonus orders integrate degree 7 exactly: 8/3 of a radian on a facet leave 2e-7
    assert force[1] == pytest.approx(-total, rel=1e-6)


# limits in closed form


# periods, and meshes that are none


def spoilt(quads, place):
    """Nine squares, or eighteen triangles, of which a corner has moved."""
    mesh = MakeStructured2DMesh(quads=quads, nx=3, ny=3)
    mesh.ngmesh.Coordinates()[5] = place
    return ng.Mesh(mesh.ngmesh)


@SHAPES
@pytest.mark.parametrize("place", [(np.nan, 0.3), (np.inf, 0.3), (0.9, 0.3), (0.7, 0.7), (2 / 3, 1 / 3)])
def test_meshes_that_are_none_are_refused(quads, place):
    """NaN, infinite, inverted, folded, without an area."""
    with pytest.raises(BadArgument, match="^mesh.*of its .* elements"):
        Body(spoilt(quads, place), SMOOTH)


def test_a_contact_facet_beside_no_element_is_refused():
    """It was a bare IndexError."""
    mesh = meshes.rectangles(
        np.linspace(0, 1, 4), np.linspace(0, 1, 4), names=("b", "r", "contact", "l")
    ).ngmesh
    loose = [mesh.Add(netgen.MeshPoint(netgen.Pnt(x, 1, 0))) for x in (1.3, 1.6)]
    mesh.Add(netgen.Element1D(loose, index=3))
    with pytest.raises(BadArgument, match="on one side, not on both or none"):
        Contact(Body(ng.Mesh(mesh), SOLID, 2, fixed="b"), Plane(), Unilateral()).solve(load=0.1)


@SHAPES
def test_sound_meshes_are_taken_and_curved_elements_that_fold_are_not(quads):
    """Parabolas for the sides of a narrow ring, in which coarse elements with straight sides are sound."""
    face = occ.Circle((0, 0), 1).Face() - occ.Circle((0, 0), 0.93).Face()
    ring = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=2.0, quad_dominated=quads))
    inverted, thin = (
        MakeStructured2DMesh(nx=3, ny=2, quads=quads, mapping=mapping)
        for mapping in (lambda s, t: (-s, t), lambda s, t: (s, 1e-8 * t))
    )
    for mesh in (ring, spoilt(quads, (0.4, 0.3)), inverted, thin, rectangle(1, 1, 0.2, quads), dome(4)):
        assert Body(mesh, SMOOTH, 1).mesh is mesh
    with pytest.raises(BadArgument, match="inverted"):
        Body(ring.Curve(2), SMOOTH)


# what a body in space has as one in the plane


def test_fields_can_be_prescribed_in_space():
    """Patch test: u linear, psi the rotation that leaves gamma symmetric; orders of u and psi may differ."""
    slope = 1e-3 * np.array(((1.0, 0.4, -0.2), (0.1, -0.7, 0.3), (0.5, -0.6, 0.8)))
    place = ng.x, ng.y, ng.z
    turn = [(slope[(i + 2) % 3, (i + 1) % 3] - slope[(i + 1) % 3, (i + 2) % 3]) / 2 for i in range(3)]
    values = {f"u{i + 1}": sum(s * x for s, x in zip(slope[i], place)) for i in range(3)}
    values |= {f"psi{i + 1}": turn[i] for i in range(3)}
    ticks = np.linspace(0, 1, 3)
    for order, order_psi in ((1, 1), (2, 1), (2, 2)):
        mesh = meshes3d.block(ticks, ticks, ticks - 1)
        body = Body(mesh, TWISTED, order, order_psi=order_psi, prescribed=on_all_sides(values))
        fields, strain = body.solve(), (slope + slope.T) / 2
        sigma = TWISTED.lam * np.trace(strain) * np.eye(3) + 2 * TWISTED.mu * strain
        assert np.reshape(fields.stress(mesh(0.3, 0.6, -0.2)), (3, 3)) == pytest.approx(sigma, abs=1e-11)
        assert fields.energy() == pytest.approx(np.sum(sigma * strain) / 2, rel=1e-11)  # of a unit volume


@pytest.mark.parametrize("dim", [2, 3])
def test_supports_that_move_press_a_body_on_an_obstacle(dim):
    """As an obstacle that approaches: by the method that the program takes, since Condensed() cannot."""
    if dim == 2:
        mesh = MakeStructured2DMesh(nx=6, ny=3, mapping=lambda x, y: (2 * x - 1, y - 1))
    else:
        mesh = MakeStructured3DMesh(
            nx=4, ny=4, nz=2, mapping=lambda *x: (*(2 * np.array(x[:2]) - 1), x[2] - 1)
        )

    def bowl(*x):
        return sum(along**2 for along in x) / 10

    def pressed(approach, obstacle=bowl, **prescribed):
        body = mb.Body(mesh, SMOOTH, 2, fixed="bottom", contact="top", prescribed=prescribed)
        return mb.Contact(body, obstacle, mb.Microblock()).solve(approach=approach)

    def require_same(state, expected):
        # Newton's method ends at a residual of 1e-9
        close = 1e-7 * expected.pressure.max()
        assert state.pressure == pytest.approx(expected.pressure, abs=close)
        assert state.energy == pytest.approx(expected.energy, rel=1e-7)
        assert (state.method, expected.method) == ("newton", "condensed")

    require_same(pressed(0.01, **{f"u{dim}": {"bottom": 0.02}}), pressed(0.03))
    turn = 1e-3  # of body, or of obstacle the other way: supports along x1, and blocks
    height = (ng.x, ng.y, ng.z)[dim - 1]
    psi = {2: {"psi": {"bottom": -turn}}, 3: {"psi2": {"bottom": turn}}}[dim]
    turned = {f"u{dim}": {"bottom": -turn * ng.x}, "u1": {"bottom": turn * height}} | psi
    require_same(pressed(0.03, **turned), pressed(0.03, lambda *x: bowl(*x) + turn * x[0]))


def test_a_period_in_space_leaves_a_column():
    """Pressed all over, a body that repeats along x1 and x2 has the strain of its depth alone."""
    mesh = MakeStructured3DMesh(
        nx=2, ny=2, nz=2, periodic_x=True, periodic_y=True, mapping=lambda s, t, r: (s, t, r - 1)
    )
    body = Body(mesh, SMOOTH, 2, fixed="bottom", periodic=True)
    fields = body.solve(Loads(traction={"top": (0, 0, -1)}))
    modulus = SMOOTH.lam + 2 * SMOOTH.mu
    for place in ((0.1, 0.9, -0.4), (1.0, 0.5, 0.0)):
        assert fields.u(mesh(*place)) == pytest.approx((0, 0, -(place[2] + 1) / modulus), abs=1e-12)
    assert fields.reaction("bottom").force == pytest.approx([0, 0, 1], abs=1e-12)


def test_the_name_of_before_says_the_name_of_today():
    import microblock

    with pytest.raises(BadArgument, match=r"mb\.Body\("):
        microblock.Body3D
    with pytest.raises(BadArgument, match="3 components"):
        box().solve(Loads(force=(1.0, 0.0)))


def test_no_support_along_x1_leaves_the_translation_alone():
    """On a flat surface nothing else holds it: one unknown does, whatever rounding makes of the matrix."""
    for fixed in ({"u2": "middle"}, {"u2": "middle", "psi": "middle"}, {"u1": "middle", "u2": "middle"}):
        for mesh in (meshes.line(1.0, 4), meshes.column(1.0, 4)):
            body = Body(mesh, SMOOTH, 2, fixed=fixed, periodic=mesh.dim == 2)
            state = Contact(body, Plane(), Unilateral(), Newton()).solve(approach=0.01)
            assert state.pressure == pytest.approx((SMOOTH.lam + 2 * SMOOTH.mu) * 0.01, rel=1e-9)


# --- contact of bodies in three dimensions: patch test, conditions and balances, warnings


BLOCKY = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
LAWS = pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock(), mb.Microclamped()], ids=str)
SPHERE = mb.Sphere(10.0)
MODULUS = BLOCKY.lam + 2 * BLOCKY.mu  # of uniform compression


def cube(n=2, order=1, fixed="bottom", height=1.0):
    """The unit square times [-height, 0]."""
    x = np.linspace(0, 1, n + 1)
    return mb.Body(meshes3d.block(x, x, height * (x - 1)), BLOCKY, order, fixed=fixed)


def quarter(x, depth, order=1, reach=0.6, ell=0.1):
    """A quarter of a block between planes of symmetry."""
    fixed = meshes3d.supports("bottom", x1="left", x2="front")
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell)
    return mb.Body(meshes3d.block(x, x, np.array(depth), reach=reach), solid, order, fixed=fixed)


@pytest.mark.parametrize("order", [1, 2])
def test_the_patch_test_on_facets_that_are_no_parallelograms(order):
    """On a surface at another height, pressed by a plane at that height."""
    mesh = MakeStructured3DMesh(
        nx=2, mapping=lambda x, y, z: (x + 0.6 * x * (1 - x) * y, y - 0.4 * y * (1 - y) * x, z - 0.3)
    )
    fixed = {"u1": "back|front", "u2": "left|right", **dict.fromkeys(("u3", *FIELDS[3:]), "bottom")}
    body = mb.Body(mesh, BLOCKY, order, fixed=fixed, contact="top")
    state = mb.Contact(body, lambda x1, x2: 0.7 + 0 * x1, mb.Microblock()).solve(approach=0.01)
    assert np.ptp(np.sort(state.weights)[:4]) > 0.01 * state.weights.mean()  # its corners differ
    assert state.pressure == pytest.approx(MODULUS * 0.01, rel=1e-7)  # the residual of the conditions


@pytest.mark.parametrize("order", [1, 2])
@LAWS
def test_conditions_and_balances(law, order):
    """Gaps from the fields in the body; forces and moments about the origin; energies."""

    def height(x1, x2):
        return (x1 - 0.4) ** 2 + (x2 - 0.55) ** 2

    state = mb.Contact(cube(4 // order, order), height, law).solve(load=2.0)
    fields = state.fields
    half = BLOCKY.ell / 2
    moment = np.zeros(2)
    places = [fields.body.mesh(x1, x2, 0.0) for x1, x2 in zip(state.x1, state.x2)]
    u3, psi1, psi2 = (np.array([part(place) for place in places]) for part in (fields.u[2], *fields.psi[:2]))
    assert pytest.approx(np.array((psi1, psi2)), abs=1e-8 * np.abs(u3).max() / half) == state.psi.T
    for (a, b), forces in zip(state.problem.blocks.offsets, state.pressures.values()):
        x1, x2 = state.x1 + half * a, state.x2 + half * b
        # (21): the corner goes with the block
        gap = height(x1, x2) - state.approach - u3 - half * (b * psi1 - a * psi2)
        assert forces.min() >= 0 and gap.min() > -1e-7 * state.approach  # the residual of the conditions
        assert np.abs(gap[forces > 0]).max() < 1e-7 * state.approach
        moment += np.array((-x2, x1)) @ (state.weights * forces)
    moment += state.weights @ state.micromoment * law.clamps_rotation
    corners = np.column_stack((state.x1, state.x2))[state.triangles]
    areas = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 2
    assert areas.sum() == pytest.approx(1.0) and areas.min() > 0  # the surface as files have it
    force, turning = fields.reaction("bottom")
    assert force == pytest.approx([0, 0, 2.0], abs=1e-9)  # rounding of the factorisation
    assert turning == pytest.approx([-moment[0], -moment[1], 0], abs=1e-8)
    assert fields.energy() == pytest.approx(state.energy, rel=1e-8)


def test_steps_that_do_not_grow_are_equal():
    """Ten tenths are less than 1 by rounding, and no step more."""
    steps = meshes3d.graded(reach=1.0, step=0.1, far=2.0, growth=1.0)
    assert steps == pytest.approx(np.linspace(0, 2, 21))


def test_a_flat_punch_ends_at_its_nodes():
    """Coordinates of nodes are those of the mesh to the last digit, so that its edge is a row of nodes."""
    x = meshes3d.graded(reach=0.5, step=0.1, far=2.0, growth=3.0)
    body = quarter(x, [-2.0, -0.6, -0.2, 0.0], order=2, reach=0.5)
    at, beside = (
        mb.Contact(body, mb.FlatPunch(edge, face="square"), mb.Unilateral()).solve(load=0.25)
        for edge in (x[3], x[3] + 0.03)
    )
    below = (at.x1 <= x[3]) & (at.x2 <= x[3])
    assert np.count_nonzero(below) == 49 and np.array_equal(at.pressure > 0, below)
    warned = [any("between nodes" in words for words in state.warnings) for state in (at, beside)]
    assert warned == [False, True]


@pytest.mark.parametrize(
    "reach, step, ell, words",
    [
        (0.6, 0.06, 0.3, ""),
        (0.6, 0.2, 0.3, "nodes in contact"),
        (0.24, 0.06, 0.3, "beside the contact boundary"),
        (0.6, 0.06, 0.02, "resolve the layer"),
    ],
)
def test_states_say_what_they_cannot_estimate(reach, step, ell, words):
    x = meshes3d.graded(reach=0.6, step=step, far=2.0, growth=3.0)
    body = quarter(x, [-2.0, -0.5, -0.2, 0.0], reach=reach, ell=ell)
    said = mb.Contact(body, SPHERE, mb.Unilateral()).solve(load=0.25).warnings
    warnings = [text for text in said if "the error estimate is" not in text]
    assert words in " ".join(warnings) and bool(words) == bool(warnings)


def tetrahedra(n):
    """The same box as `box(n)`."""
    mesh = MakeStructured3DMesh(hexes=False, nx=n, ny=n, nz=n, mapping=lambda x, y, z: (x, y, z - 1))
    return mb.Body(mesh, BLOCKY, 1, fixed="bottom", contact="top")


@pytest.mark.parametrize(
    "body, law",
    [
        (lambda: cube(3), mb.Unilateral()),
        (lambda: cube(3), mb.Microblock((0.01, -0.02))),
        (lambda: cube(2, order=2), mb.Microclamped()),
        (lambda: tetrahedra(3), mb.Microblock()),
        (lambda: quarter(np.array((0.0, 0.1, 0.2, 1.0)), [-1.0, -0.4, 0.0], reach=1.0), mb.Unilateral()),
    ],
    ids=["hexahedra", "rotated blocks", "order 2", "tetrahedra", "graded"],
)
def test_a_spike_between_nodes_is_named(body, law):
    """1/400 of the surface wide, and deeper than the apex: it carried nothing, without a word."""

    def height(x1, x2):
        spike = np.hypot(x1 - 0.83, x2 - 0.58) < 1 / 800
        return np.where(spike, -0.01, (x1**2 + x2**2) / 20)

    said = " ".join(mb.Contact(body(), height, law).solve(load=0.01).warnings)
    (place,) = re.findall(r"between nodes, at x1 = ([\d.]+) and x2 = ([\d.]+), the obstacle reaches", said)
    assert [float(x) for x in place] == pytest.approx((0.83, 0.58), abs=1 / 800)


def test_a_surface_of_two_levels_is_read_between_its_nodes():
    """Nodes of a step lie one above the other: a triangulation of both levels was invalid."""
    low = occ.Box((-1, -1, -1), (0, 1, 0))
    high = occ.Box((0, -1, -1), (1, 1, 0.25))
    for face in low.faces + high.faces:
        face.name = "side"
    low.faces.Max(occ.Z).name = high.faces.Max(occ.Z).name = "contact"
    low.faces.Min(occ.Z).name = high.faces.Min(occ.Z).name = "bottom"
    mesh = ng.Mesh(occ.OCCGeometry(occ.Glue([low, high])).GenerateMesh(maxh=0.7))
    state = mb.Contact(mb.Body(mesh, BLOCKY, 1, fixed="bottom"), step, mb.Unilateral()).solve(load=1.0)
    middles = state.points[state.triangles].mean(axis=1)
    expected = state.pressure[state.triangles].mean(axis=1)
    assert state.pressure_at(middles) == pytest.approx(expected, abs=1e-9 * expected.max())
    assert expected.any() and set(state.points[:, 2]) == {0.0, 0.25}


def step(x1, x2):
    """As high as the surface of two levels, and curved."""
    return np.where(x1 > 0, 0.25, 0.0) + (x1**2 + x2**2) / 20


@pytest.mark.parametrize(
    "rate, measured",
    [
        # hexahedra of order 1 and 2, tetrahedra; hexahedra alone by Newton's method:
        # unknowns, seconds of a busy core, bytes over those before
        (
            "condensed in space",
            [(3888, 0.3, 87e6), (12168, 2.1, 515e6), (27744, 4.9, 1.45e9), (27744, 4.4, 1.05e9)],
        ),
        (
            "condensed in space by SuperLU",
            [(3888, 0.5, 110e6), (6610, 1.8, 251e6), (12168, 6.1, 621e6), (12168, 5.2, 496e6)],
        ),
        (
            "newton in space",
            [(3888, 1.6, 25e6), (12168, 5.0, 86e6), (27744, 15.8, 300e6), (90000, 104.0, 1.39e9)],
        ),
    ],
)
def test_what_bodies_in_space_are_expected_to_take(rate, measured):
    """Within twice of the seconds and half as much of the memory: 0.8 GB were expected for 1.4 and 2.1."""
    for unknowns, seconds, memory in measured:
        expected = cost.predict(rate, unknowns)
        assert 1 / 2 < expected.seconds / seconds < 2 and 1 / 1.5 < expected.memory / memory < 1.75


@pytest.mark.parametrize("kind", [factors.Cholmod, factors.SuperLU])
def test_factors_are_those_of_dense_algebra(kind):
    """Unknowns of the contact lie between inner ones, and some belong to neither."""
    if kind is factors.Cholmod and not factors.cholmod:
        pytest.skip("CHOLMOD comes with cvxopt")
    dense = np.random.default_rng(0).random((12, 12))
    K = dense @ dense.T + np.eye(12)
    contact, inner = np.array([0, 4, 9]), np.array([1, 2, 5, 7, 8, 11])
    made = kind(csr_matrix(K), inner, contact)
    K_ci = K[np.ix_(contact, inner)]
    schur = K[np.ix_(contact, contact)] - K_ci @ np.linalg.solve(K[np.ix_(inner, inner)], K_ci.T)
    np.testing.assert_allclose(np.tril(made.block), np.linalg.cholesky(schur), rtol=1e-12)
    free = np.union1d(contact, inner)
    right = np.arange(12.0)
    solution = np.zeros(12)
    solution[free] = np.linalg.solve(K[np.ix_(free, free)], right[free])
    np.testing.assert_allclose(made.solve(right), solution, rtol=1e-11)  # of a condition of some 40


@pytest.mark.parametrize("condense", [False, True])
def test_free_unknowns_are_those_of_ngsolve(condense, block):
    space = ng.H1(block, order=3, dirichlet="bottom")
    assert free_unknowns(space, condense).tolist() == list(space.FreeDofs(condense))


@pytest.mark.parametrize("usual, taken", [(factors.Cholmod, "condensed"), (factors.SuperLU, "newton")])
def test_the_better_method_of_a_body_in_space_is_taken(monkeypatch, memory, usual, taken):
    """SuperLU takes 33 s where Newton's method takes 16 and CHOLMOD 5; without memory none is begun."""
    monkeypatch.setattr(factors, "usual", usual)
    problem = mb.Contact(cube(16), SPHERE, mb.Unilateral())
    assert problem.plan(load=1.0).candidates[0].name == taken
    memory(1.4e9)
    with pytest.raises(mb.NotConverged, match="GB of memory"):
        problem.with_(method=mb.Condensed()).solve(load=1.0)


# --- Cholesky factors of both libraries, contact beside a region of equal squares


def answers():
    """Numbers of bodies in the plane and in space, and whether a body that can move is refused."""
    flat = mb.Contact(mb.Block(BLOCKY, 6.0), mb.Cylinder(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured3DMesh(nx=3, ny=3, nz=3, mapping=lambda x, y, z: (x, y, z - 1))
    cube = mb.Body(mesh, BLOCKY, 2, fixed="bottom", contact="top")
    deep = mb.Contact(cube, mb.Sphere(10.0), mb.Microblock()).solve(load=1.0)
    mesh = MakeStructured2DMesh(nx=8, ny=4, mapping=lambda x, y: (2 * x - 1, y - 1))
    loose = mb.Body(mesh, BLOCKY, 2, fixed={"u1": "bottom", "u2": "left"}, contact="top")  # a hinge
    with pytest.raises(mb.NotConverged, match="supports leave a rotation about x3 free"):
        mb.Contact(loose, mb.Cylinder(10.0), mb.Microblock(), mb.Condensed()).solve(load=1.0)
    below = [flat.fields(0.1, -0.2).psi, *flat.reaction("bottom").force, deep.fields.energy()]
    return [list(flat.pressure), list(deep.pressure), [float(value) for value in below]]


def test_without_cvxopt_states_fields_and_refusals_are_the_same():
    """To rounding of factors whose condition is 1e6 or so; in space the residual of the conditions, 1e-7."""
    code = (
        "import sys, json; sys.modules['cvxopt'] = None; sys.path.insert(0, 'tests')\n"
        "from tests.library.test_body import answers; print(json.dumps(answers()))"
    )
    root = Path(__file__).parents[2]
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    for with_it, without, tolerance in zip(answers(), json.loads(ran.stdout), (1e-9, 1e-6, 1e-8)):
        assert without == pytest.approx(with_it, abs=tolerance * max(with_it))
        assert without != with_it  # another library did it


@pytest.mark.parametrize("newton", [None, mb.Newton()], ids=["condensed", "newton"])
def test_contact_beside_the_region_of_equal_squares_is_said(newton):
    """A bump beside the region touches before the rest does: its nodes count, too."""

    def height(x):
        return np.minimum(x**2 / 20, 2 * (x - 1.5) ** 2 - 0.005)

    solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    method = mb.Uniform(0.1, reach=0.6, newton=newton)
    problem = mb.Contact(mb.Block(solid, 4.0), mb.Obstacle(height, kinks=(1.3,)), mb.Unilateral(), method)
    with pytest.raises(mb.NotConverged, match="leaves the region of equal squares"):
        problem.solve(load=0.3)
