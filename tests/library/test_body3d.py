"""Bodies in three dimensions: the energy, manufactured fields, equilibrium, and contact against the patch
test, the plane, the half-space and Hertz.
"""

import pickle

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured3DMesh
from scipy.interpolate import RegularGridInterpolator

import microblock as mb
from microblock.fem import energy3d, meshes, meshes3d
from microblock.fem.body3d import FIELDS, Loads3D, rigid_motions
from microblock.fem.nodes3d import ContactNodes3D

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
TWISTED = mb.Cosserat(E=100, nu=0.2, beta=0.6, ell=0.3, curvature=1.3, alpha_prime=0.4, beta_prime=-0.7)
R = 10.0
LAWS = [mb.Unilateral(), mb.Microblock(), mb.Microclamped()]


def hertz(load):
    """Radius, largest pressure and approach."""
    a = (3 * load * R / (4 * SOLID.E_star)) ** (1 / 3)
    return a, 3 * load / (2 * np.pi * a**2), a**2 / R


def box(n=2, solid=SOLID, order=1, fixed="bottom", height=1.0):
    """The unit square times [-height, 0]."""
    x = np.linspace(0, 1, n + 1)
    return mb.Body3D(meshes3d.block(x, x, height * (x - 1)), solid, order, fixed=fixed)


def sliding():
    """Supports of uniform compression: smooth sides, no rotation."""
    found = {"u1": "left|right", "u2": "front|back", "u3": "bottom"}
    return {**found, "psi1": "bottom", "psi2": "bottom", "psi3": "bottom"}


def quarter(a, step, far=10.0, reach=1.5, order=1, solid=SOLID):
    """A quarter of a block of depth and half-width far*a, facets of step*a up to reach*a."""
    x, depth = (
        meshes3d.graded(reach=one * a, step=step * a, far=far * a, growth=1.8) for one in (reach, 0.6)
    )
    mesh = meshes3d.block(x, x, -depth[::-1], reach=reach * a)
    return mb.Body3D(mesh, solid, order, fixed=meshes3d.supports("bottom", x1="left", x2="front"))


def at_nodes(reference, values, state):
    """Values of a half-space's state at the nodes of a body's."""
    table = RegularGridInterpolator((reference.x1, reference.x2), values, bounds_error=False, fill_value=0.0)
    return table(np.column_stack((state.x1, state.x2)))


# the energy


def test_plane_fields_have_the_plane_energy():
    """u1, u3 and psi2 of x1 and x3: the plane's psi turns about -e2; alpha' and beta' drop out."""
    mesh = box().mesh
    u1, u3, psi = ng.x**2 + 3 * ng.x * ng.z, ng.z**2 - ng.x * ng.z, 2 * ng.x - ng.z**2
    u, turn = (ng.GridFunction(ng.VectorH1(mesh, order=2)) for _ in range(2))
    u.Set(ng.CF((u1, 0, u3)))
    turn.Set(ng.CF((0, -psi, 0)))
    place = mesh(0.3, 0.4, -0.2)
    found = energy3d.energy(TWISTED, energy3d.relative_deformation(u, turn), ng.Grad(turn))(place)
    gradient = np.array([[part.Diff(x)(place) for x in (ng.x, ng.z)] for part in (u1, u3)])
    kappa = [psi.Diff(x)(place) for x in (ng.x, ng.z)]
    assert found == pytest.approx(TWISTED.energy(gradient, psi(place), kappa), rel=1e-12)  # rounding


def test_stresses_are_the_slope_of_the_energy():
    """In random directions: the energy is quadratic, so half the work of the stresses is all of it."""
    mesh, random = box().mesh, np.random.default_rng(0)
    for _ in range(3):
        gamma, kappa = (ng.CF(tuple(random.normal(size=9)), dims=(3, 3)) for _ in range(2))
        work = ng.InnerProduct(energy3d.stress(TWISTED, gamma), gamma) / 2
        work += ng.InnerProduct(energy3d.couple_stress(TWISTED, kappa), kappa) / 2
        place = mesh(0.5, 0.5, -0.5)
        assert energy3d.energy(TWISTED, gamma, kappa)(place) == pytest.approx(work(place), rel=1e-12)


def test_rigid_motions_cost_nothing():
    body = box(solid=TWISTED, order=2, fixed=())
    matrix = body.bulk().mat
    size = max(abs(np.array(matrix.CSR()[0])))
    for motion in rigid_motions(body):
        vector = matrix.CreateColVector()
        vector.FV().NumPy()[:] = motion
        # rounding of the sum over a row
        assert np.abs((matrix * vector).Evaluate().FV().NumPy()).max() < 1e-12 * size
        assert np.abs(motion).max() > 0.1


@pytest.mark.parametrize("order", [1, 2])
def test_manufactured_fields_converge_with_the_order_plus_one(order):
    waves = ng.sin(ng.x + 2 * ng.y), ng.cos(2 * ng.x - ng.z), ng.sin(ng.y * ng.z + ng.x)
    u = ng.CF(tuple((1 + ng.z) * wave for wave in waves))
    psi = ng.CF(tuple((1 + ng.z) * wave for wave in reversed(waves)))

    def gradient(vector):
        return ng.CF(tuple(vector[i].Diff(x) for i in range(3) for x in (ng.x, ng.y, ng.z)), dims=(3, 3))

    def divergence(tensor):
        return [sum(tensor[i, j].Diff(x) for j, x in enumerate((ng.x, ng.y, ng.z))) for i in range(3)]

    twist = ng.CF((0, psi[2], -psi[1], -psi[2], 0, psi[0], psi[1], -psi[0], 0), dims=(3, 3))
    sigma = energy3d.stress(TWISTED, gradient(u) + twist)
    m = energy3d.couple_stress(TWISTED, gradient(psi))
    # (19): div m - eps : sigma + l = 0, (eps : sigma)_i = eps_ijk sigma_kj
    axial = [sigma[2, 1] - sigma[1, 2], sigma[0, 2] - sigma[2, 0], sigma[1, 0] - sigma[0, 1]]
    couple = tuple(-part - own for part, own in zip(divergence(m), axial))
    n, sides = ng.specialcf.normal(3), "left|right|front|back|contact"
    loads = Loads3D(
        force=tuple(-part for part in divergence(sigma)),
        couple=couple,
        traction={sides: tuple((sigma * n)[i] for i in range(3))},
        micromoment={sides: tuple((m * n)[i] for i in range(3))},
    )
    errors = []
    for count in (2, 4):
        fields = box(count, TWISTED, order).solve(loads)
        off = ng.InnerProduct(fields.u - u, fields.u - u) + ng.InnerProduct(
            fields.psi - psi, fields.psi - psi
        )
        errors.append(np.sqrt(ng.Integrate(off, fields.body.mesh, order=2 * order + 4)))
    # two coarse meshes: the rate is not that of the limit yet
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=0.25)


# the nodes


@pytest.mark.parametrize("order", [1, 2, 3])
def test_nodes_have_the_values_and_the_areas_of_their_facets(order):
    body = box(3, order=order)
    nodes, field = ContactNodes3D(body), ng.GridFunction(ng.H1(body.mesh, order=order))
    field.Set(ng.x**order - 2 * ng.y**order + 1)
    x1, x2, x3 = nodes.points.T
    assert len(x1) == (3 * order + 1) ** 2 and not x3.any()
    exact = x1**order - 2 * x2**order + 1
    assert nodes.values @ field.vec.FV().NumPy() == pytest.approx(exact, abs=1e-11)  # rounding of Set
    # exact for degree 2 order - 1 in each direction
    assert nodes.weights @ (x1 * x2) == pytest.approx(1 / 4 if order > 1 else 1 / 4, rel=1e-12)
    assert nodes.weights.sum() == pytest.approx(1, rel=1e-12)
    places, between = nodes.between
    assert between @ exact == pytest.approx(places[:, 0] ** order - 2 * places[:, 1] ** order + 1, abs=1e-12)


def test_tetrahedra_are_pressed_at_their_vertices():
    mesh = ng.Mesh(occ.OCCGeometry(_named_box()).GenerateMesh(maxh=0.7))  # tetrahedra
    nodes = ContactNodes3D(mb.Body3D(mesh, SOLID, fixed="bottom"))
    assert nodes.weights.sum() == pytest.approx(1, rel=1e-12)
    assert nodes.weights @ nodes.points[:, 0] == pytest.approx(0.5, rel=1e-12)  # exact for degree 1
    with pytest.raises(mb.BadArgument, match="triangles") as caught:
        ContactNodes3D(mb.Body3D(mesh, SOLID, 2, fixed="bottom"))
    assert caught.value.name == "order"


def _named_box():
    shape = occ.Box((0, 0, -1), (1, 1, 0))
    shape.faces.name = "side"
    shape.faces.Max(occ.Z).name = "contact"
    shape.faces.Min(occ.Z).name = "bottom"
    return shape


# contact


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("method", [mb.Condensed(), mb.Newton()], ids=str)
def test_uniform_compression(law, order, method):
    """The patch test: all nodes press alike, and of the four corners each with a quarter."""
    body = box(order=order, fixed=sliding(), height=2.0)
    state = mb.Contact(body, lambda x1, x2: 0 * x1, law, method).solve(approach=0.01)
    exact = (SOLID.lam + 2 * SOLID.mu) * 0.01 / 2.0
    for own in state.pressures.values():
        assert own == pytest.approx(exact / len(state.pressures), rel=1e-7)  # the residual of the conditions
    assert state.load == pytest.approx(exact, rel=1e-8)
    assert not state.closed.min() < len(state.pressures)
    assert np.abs(state.micromoment).max() < 1e-8 * exact * SOLID.ell
    assert float(state.fields.u[2](body.mesh(0.3, 0.7, -1.0))) == pytest.approx(-0.005, rel=1e-8)


@pytest.mark.parametrize("order", [1, 2])
def test_the_patch_test_on_facets_that_are_no_parallelograms(order):
    """On a surface at another height, pressed by a plane at that height."""

    def bent(x, y, z):
        return x + 0.6 * x * (1 - x) * y, y - 0.4 * y * (1 - y) * x, z - 0.3

    mesh = MakeStructured3DMesh(nx=2, mapping=bent)
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
    fixed = {"u1": "back|front", "u2": "left|right", **dict.fromkeys(("u3", *FIELDS[3:]), "bottom")}
    body = mb.Body3D(ng.Mesh(mesh.ngmesh), SOLID, order, fixed=fixed)
    state = mb.Contact(body, lambda x1, x2: 0.7 + 0 * x1, mb.Microblock()).solve(approach=0.01)
    assert np.ptp(np.sort(state.weights)[:4]) > 0.01 * state.weights.mean()  # its corners differ
    assert state.pressure == pytest.approx((SOLID.lam + 2 * SOLID.mu) * 0.01, rel=1e-7)


def test_prescribed_load_gives_the_same_state_as_its_approach():
    problem = mb.Contact(quarter(hertz(1.0)[0], 0.5), mb.Sphere(R), mb.Microblock())
    state = problem.solve(load=0.25)
    assert problem.solve(approach=state.approach).load == pytest.approx(0.25, rel=1e-6)  # residual of both


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_conditions_and_balances(law, order):
    """Gaps from the fields in the body; forces and moments about the origin; energies."""
    body = box(4 // order, order=order, height=1.0)
    state = mb.Contact(body, lambda x1, x2: (x1 - 0.4) ** 2 + (x2 - 0.55) ** 2, law).solve(load=2.0)
    fields, half = state.fields, SOLID.ell / 2
    assert np.sum(state.weights * state.pressure) == pytest.approx(2.0, rel=1e-12)
    u3, psi1, psi2 = (
        np.array([part(body.mesh(x1, x2, 0.0)) for x1, x2 in zip(state.x1, state.x2)])
        for part in (fields.u[2], fields.psi[0], fields.psi[1])
    )
    assert state.psi == pytest.approx(np.array((psi1, psi2)), abs=1e-8 * np.abs(u3).max() / half)
    moment = np.zeros(2)
    offsets = state.problem.solver.surface_law.offsets
    for (a, b), own in zip(offsets, state.pressures.values()):
        x1, x2 = state.x1 + half * a, state.x2 + half * b
        # (21): the corner goes with the block
        lowered = u3 + half * (b * psi1 - a * psi2)
        gap = (x1 - 0.4) ** 2 + (x2 - 0.55) ** 2 - state.approach - lowered
        assert own.min() >= 0 and gap.min() > -1e-7 * state.approach  # the residual of the conditions
        assert np.abs(gap[own > 0]).max() < 1e-7 * state.approach
        force = state.weights * own
        moment += np.array((-x2, x1)) @ force
    if law.clamps_rotation:
        moment += state.micromoment @ state.weights
    reaction = fields.reaction("bottom")
    assert reaction.force == pytest.approx([0, 0, 2.0], abs=1e-9)  # rounding of the factorisation
    assert reaction.moment == pytest.approx([-moment[0], -moment[1], 0], abs=1e-8)
    assert fields.energy() == pytest.approx(state.energy, rel=1e-8)


def test_load_is_the_slope_of_the_energy():
    problem = mb.Contact(quarter(hertz(1.0)[0], 0.5), mb.Sphere(R), mb.Microblock())
    low, state, high = (problem.solve(approach=d) for d in (0.0139, 0.014, 0.0141))
    # differences of (1/140)^2, and nodes that open or close meanwhile
    assert (high.energy - low.energy) / 2e-4 == pytest.approx(state.load, rel=2e-4)


def test_a_slab_in_plane_strain_is_the_plane_body():
    """One layer of hexahedra with the fields of the plane, against the plane's own elements and contact."""
    x, depth = np.linspace(-1, 1, 17), np.linspace(-1, 0, 9)
    plane = {"u2": "front|back", "psi1": "front|back", "psi3": "front|back"}
    slab = meshes3d.block(x, np.array([0.0, 0.5]), depth)
    fixed = {name: "|".join(filter(None, ("bottom", plane.get(name)))) for name in FIELDS}
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.2, alpha_prime=0.3, beta_prime=0.5)
    flat = meshes.ng.Mesh(_plane_mesh(x, depth))
    for order in (1, 2):
        for law in (mb.Microblock(), mb.Microblock(0.02), mb.Unilateral()):
            line = mb.Contact(mb.Body(flat, solid, order, fixed="bottom"), mb.Cylinder(2.0), law)
            surface = mb.Contact(
                mb.Body3D(slab, solid, order, fixed=fixed), lambda x1, x2: x1**2 / 4 + 0 * x2, law
            )
            wanted, found = line.solve(load=8.0), surface.solve(load=4.0)
            row = np.flatnonzero(found.x2 == 0)
            # the residual of the conditions
            close = {"abs": 1e-7 * wanted.pressure.max()}
            assert found.x1[row] == pytest.approx(wanted.x)
            assert found.pressure[row] == pytest.approx(wanted.pressure, **close)
            assert -found.micromoment[1][row] == pytest.approx(wanted.micromoment, **close)
            assert -found.psi[1][row] == pytest.approx(wanted.psi, abs=1e-7)
            assert found.approach == pytest.approx(wanted.approach, rel=1e-8)


def _plane_mesh(x, depth):
    """Quadrilaterals with vertices at given coordinates."""
    from ngsolve.meshes import MakeStructured2DMesh

    columns, layers = len(x) - 1, len(depth) - 1
    mesh = MakeStructured2DMesh(
        quads=True,
        nx=columns,
        ny=layers,
        mapping=lambda s, t: (x[round(s * columns)], depth[round(t * layers)]),
    )
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, {"top": "contact"}.get(name, name))
    return mesh.ngmesh


def test_steps_that_do_not_grow_are_equal():
    assert meshes3d.graded(reach=1.0, step=0.5, far=2.5, growth=1.0) == pytest.approx(
        [0, 0.5, 1, 1.5, 2, 2.5]
    )


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_quarter_is_a_part_of_the_whole(law):
    x, a = meshes3d.graded(reach=0.6, step=0.15, far=2.0, growth=2.0), hertz(1.0)[0]
    both = np.concatenate((-x[:0:-1], x))
    part = mb.Body3D(
        meshes3d.block(x, x, -x[::-1], reach=0.6),
        SOLID,
        fixed=meshes3d.supports("bottom", x1="left", x2="front"),
    )
    whole = mb.Body3D(meshes3d.block(both, both, -x[::-1], reach=0.6), SOLID, fixed="bottom")
    found = mb.Contact(part, mb.Sphere(R), law).solve(load=0.25)
    wanted = mb.Contact(whole, mb.Sphere(R), law).solve(load=1.0)
    here = (wanted.x1 >= 0) & (wanted.x2 >= 0)
    size = wanted.pressure.max()
    assert found.approach == pytest.approx(wanted.approach, rel=1e-8) and a > 0.3
    for name, own in wanted.pressures.items():
        # the residual of the conditions, and corners that are not unique
        assert found.pressures[name] == pytest.approx(own[here], abs=1e-6 * size)
    assert found.micromoment == pytest.approx(wanted.micromoment[:, here], abs=1e-6 * size * SOLID.ell)


def test_corners_that_a_plane_of_symmetry_makes_equal_share_their_force():
    """Whatever the solver has found: on x1 = 0 those at either side, on x2 = 0 as well, in the corner all."""
    solver = mb.Contact(quarter(0.4, 0.5), mb.Sphere(R), mb.Microblock()).solver
    nodes, random = solver.nodes, np.random.default_rng(0)
    forces = random.exponential(size=(4, len(nodes.weights)))
    least = solver.of_least_norm(forces, np.ones(forces.shape, bool))
    assert least.sum(axis=0) == pytest.approx(forces.sum(axis=0), rel=1e-12)
    names = dict(zip(solver.surface_law.names, least))
    x1, x2, _ = nodes.points.T
    assert names["--"][x1 == 0] == pytest.approx(names["+-"][x1 == 0], rel=1e-12)
    assert names["--"][x2 == 0] == pytest.approx(names["-+"][x2 == 0], rel=1e-12)
    inside = (x1 > 0) & (x2 > 0)
    levers = -solver.surface_law.offsets.T  # elsewhere moments are as they were
    assert (levers @ least)[:, inside] == pytest.approx((levers @ forces)[:, inside], rel=1e-12)
    some = np.zeros(forces.shape, bool)
    assert np.array_equal(solver.of_least_norm(forces, some), forces)


@pytest.mark.parametrize(
    "law, order",
    [
        *(pytest.param(law, 1, marks=[pytest.mark.nightly] * (law == mb.Microclamped())) for law in LAWS),
        (mb.Microblock((0.01, lambda x1, x2: 0.02 * x1)), 2),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, mb.Microblock) else str(value),
)
def test_newton_finds_the_condensed_state(law, order):
    """Conjugate gradients on all unknowns, and Cholesky factors with those of the surface alone."""
    body = box(5 if order == 1 else 2, order=order)

    def height(x1, x2):
        return ((x1 - 0.4) ** 2 + (x2 - 0.55) ** 2) / 20

    wanted = mb.Contact(body, height, law).solve(load=0.25)
    problem = mb.Contact(body, height, law, mb.Newton())
    size = wanted.pressure.max()
    for found in (problem.solve(load=0.25), problem.solve(approach=wanted.approach))[: 3 - order]:
        # the residual of the gaps, 1e-9, in the pressures that nodes beside each other exchange
        assert found.approach == pytest.approx(wanted.approach, rel=1e-7)
        assert found.load == pytest.approx(0.25, rel=1e-6)
        assert found.pressure == pytest.approx(wanted.pressure, abs=1e-6 * size)
        assert found.micromoment == pytest.approx(wanted.micromoment, abs=1e-6 * size * SOLID.ell)
        assert found.fields.energy() == pytest.approx(wanted.fields.energy(), rel=1e-6)
        assert found.fields.reaction("bottom").force[2] == pytest.approx(0.25, rel=1e-6)


def test_the_error_of_the_penalty_falls_like_one_over_rho():
    body = box(3)
    exact = mb.Contact(body, mb.Sphere(R), mb.Microblock()).solve(load=0.25)
    off = [
        mb.Contact(body, mb.Sphere(R), mb.Microblock(), mb.Newton("penalty", rho)).solve(load=0.25).approach
        - exact.approach
        for rho in (1e4, 1e5)
    ]
    assert 0 < off[1] < off[0] and off[0] / off[1] == pytest.approx(10, rel=0.1)  # the next order in 1/rho


def test_conjugate_gradients_that_stop_are_an_error(monkeypatch):
    monkeypatch.setattr("microblock.fem.newton3d.LINEAR_STEPS", 3)
    with pytest.raises(mb.NotConverged, match="conjugate gradients"):
        mb.Contact(box(), mb.Sphere(R), mb.Unilateral(), mb.Newton()).solve(load=1.0)


@pytest.mark.parametrize("alpha", [0.25, 1.0])
def test_a_large_block_is_a_half_space(alpha):
    """Under a sphere; what differs is the finite size, 1/far of the approach, and the elements' length."""
    a = hertz(1.0)[0]
    more = {"alpha_prime": 0.5, "beta_prime": 1.2} if alpha == 1 else {}
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=alpha * a, **more)
    bodies = [quarter(a, 0.2, far, 2.0 if alpha == 1 else 1.6, solid=solid) for far in (5.0, 10.0)]
    for law in LAWS:
        half = mb.Contact(mb.HalfSpace(solid), mb.Sphere(R), law, mb.Cells(nodes=96)).solve(load=1.0)
        near, state = (mb.Contact(body, mb.Sphere(R), law).solve(load=0.25) for body in bodies)
        assert state.iterations < 90  # of 13 to 78; without the preconditioner some hundred
        w, p = state.weights, at_nodes(half, half.pressure, state)
        off = np.sqrt(w @ (state.pressure - p) ** 2 / (w @ p**2))
        # elements of a/5 of order 1: 3 to 6 %, under blocks of the contact's size 13 %; at a/8 2 and 5 %
        assert off < (0.14 if alpha == 1 else 0.07)
        inside = np.hypot(state.x1, state.x2) < half.x1[-1]
        for own, exact in zip(state.micromoment, half.micromoment):
            apart = (own - at_nodes(half, exact, state))[inside]
            assert np.sqrt(w[inside] @ apart**2 / (w @ p**2)) < 0.06 * solid.ell
        # the fixed bottom takes 1/far of the approach, so that twice the size leaves half of it; long
        # elements far away take 2 %
        far = 2 * state.approach - near.approach
        assert far == pytest.approx(half.approach, rel=0.03)
        assert abs(state.approach - far) > 0.04 * far


def test_hertz_where_blocks_are_small():
    a, p, _ = hertz(1.0)
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-3 * a)
    state = mb.Contact(quarter(a, 1 / 6, 8.0, solid=solid), mb.Sphere(R), mb.Unilateral()).solve(load=0.25)
    exact = p * np.sqrt(np.maximum(1 - (state.x1**2 + state.x2**2) / a**2, 0))
    w = state.weights
    # elements of a/6: the edge of the contact lies within one
    assert np.sqrt(w @ (state.pressure - exact) ** 2 / (w @ exact**2)) < 0.05
    assert state.pressure[0] == pytest.approx(p, rel=0.02)


def test_a_flat_punch_ends_at_its_nodes():
    """Coordinates of nodes are those of the mesh to the last digit, so that its edge is a row of nodes."""
    x = meshes3d.graded(reach=0.5, step=0.1, far=2.0, growth=3.0)
    body = mb.Body3D(
        meshes3d.block(x, x, np.array([-2.0, -0.6, -0.2, 0.0]), reach=0.5),
        SOLID,
        2,
        fixed=meshes3d.supports("bottom", x1="left", x2="front"),
    )
    punch = mb.FlatPunch(x[3], face="square")
    state = mb.Contact(body, punch, mb.Unilateral()).solve(load=0.25)
    below = (state.x1 <= x[3]) & (state.x2 <= x[3])
    assert np.count_nonzero(below) == 49 and np.array_equal(state.pressure > 0, below)
    assert not any("between nodes" in words for words in state.warnings)
    beside = mb.Contact(body, mb.FlatPunch(x[3] + 0.03, face="square"), mb.Unilateral()).solve(load=0.25)
    assert any("between nodes" in words for words in beside.warnings)


def test_states_say_what_they_cannot_estimate():
    def state(reach, step, ell=0.3):
        x = meshes3d.graded(reach=0.6, step=step, far=2.0, growth=3.0)
        body = mb.Body3D(
            meshes3d.block(x, x, np.array([-2.0, -0.5, -0.2, 0.0]), reach=reach),
            mb.Cosserat(E=100, nu=0.3, beta=1, ell=ell),
            fixed=meshes3d.supports("bottom", x1="left", x2="front"),
        )
        return mb.Contact(body, mb.Sphere(R), mb.Unilateral()).solve(load=0.25)

    assert state(0.6, 0.06).warnings == ()
    assert "nodes in contact" in " ".join(state(0.6, 0.2).warnings)
    assert "beside the contact boundary" in " ".join(state(0.24, 0.06).warnings)
    assert "resolve the layer" in " ".join(state(0.6, 0.06, ell=0.02).warnings)


def test_moduli_that_leave_a_surface_unstable_are_an_error():
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1, alpha_prime=9.0, beta_prime=-6.0)
    with pytest.raises(mb.BadArgument, match="unstable"):  # a coarse mesh would not see it
        box(solid=solid)


def test_a_classical_solid_has_rotations_that_do_nothing():
    classical = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=0)
    near = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1e-8)
    found, wanted = (
        mb.Contact(box(4, solid), mb.Sphere(0.5), mb.Unilateral()).solve(load=1.0)
        for solid in (classical, near)
    )
    assert found.pressure == pytest.approx(wanted.pressure, abs=1e-6 * found.pressure.max())  # beta


def test_a_body_without_room_is_refused_before_it_is_factorised(memory):
    memory(1e6)
    for method in (mb.Condensed(), mb.Newton()):
        with pytest.raises(mb.NotConverged, match="memory"):
            mb.Contact(box(6), mb.Sphere(R), mb.Unilateral(), method).solve(load=1.0)


def test_free_rigid_motions_are_an_error():
    with pytest.raises(mb.NotConverged, match="rigid motions"):
        mb.Contact(box(fixed=()), mb.Sphere(R), mb.Unilateral()).solve(load=1.0)
    with pytest.raises(mb.NotConverged, match="rigid motions"):
        box(fixed={"u3": "bottom"}).solve(Loads3D(traction={"contact": (1, 0, 0)}))


@pytest.mark.parametrize("method", [mb.Condensed(), mb.Newton()], ids=str)
def test_a_state_shows_itself_and_travels(method, tmp_path):
    problem = mb.Contact(box(3, order=2), mb.Sphere(R), mb.Microblock(), method)
    state = problem.solve(load=0.25)
    assert "approach" in repr(state) and "<table" in state._repr_html_()
    state.plot(tmp_path / "state.png")
    assert (tmp_path / "state.png").stat().st_size > 10_000
    again = pickle.loads(pickle.dumps(state))
    assert np.array_equal(again.pressure, state.pressure)
    assert again.fields.energy() == pytest.approx(state.fields.energy(), rel=1e-10)
