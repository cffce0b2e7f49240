"""Bodies of several solids and of graded ones: where each is, closed forms, layers, estimates, refusals."""

import math
import pickle

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh
from scipy.integrate import quad
from scipy.linalg import expm, schur

import microblock as mb
from microblock.fem import meshes, meshes3d
from microblock.fem.body import Body
from microblock.fem.loads import Loads
from microblock.halfplane.kernels import plane_symbol
from tests.parts import BLOCKS, CYLINDER, SOLID, UNILATERAL

SOFT = mb.Cosserat(E=40, nu=0.2, ell=0.1, beta=0.6)
STEEL = mb.Elastic(E=200, nu=0.3)
RUBBER = mb.Elastic(E=20, nu=0.2)


def parted(mesh, is_coating):
    """The mesh with the material "coating" where a function of the middles says so, else "bulk"."""
    mesh = mesh.ngmesh
    mesh.SetMaterial(1, "bulk")
    coating = mesh.AddRegion("coating", dim=2)
    points = mesh.Coordinates()
    cells = mesh.Elements2D()
    for number in range(len(cells)):
        corners = list(cells[number].vertices)
        if is_coating(*points[[corner.nr - 1 for corner in corners], :2].mean(axis=0)):
            cells[number] = netgen.Element2D(coating, corners)
    return ng.Mesh(mesh)


def layered(across, up, thickness, quads=True, names=("bottom", "side", "contact", "side")):
    """Rectangles between lines, of the material "coating" above -thickness, else "bulk"."""
    mesh = meshes.rectangles(np.asarray(across), np.asarray(up), quads, names)
    return parted(mesh, lambda x1, x2: x2 > -thickness)


SLAB = layered(np.linspace(-1, 1, 11), np.linspace(-1, 0, 6), 0.4)


def line(elements):
    """A 1D mesh of [-1, 0], its upper half of the material "coating"."""
    mesh = netgen.Mesh(dim=1)
    points = [mesh.Add(netgen.MeshPoint(netgen.Pnt(x, 0, 0))) for x in np.linspace(-1, 0, elements + 1)]
    for number, (left, right) in enumerate(zip(points, points[1:])):
        mesh.Add(netgen.Element1D([left, right], index=1 + (2 * number >= elements)))
    for number, (material, name) in enumerate((("bulk", "middle"), ("coating", "contact"))):
        mesh.SetMaterial(number + 1, material)
        mesh.Add(netgen.Element0D(points[-number], index=number + 1))
        mesh.SetBCName(number, name)
    return ng.Mesh(mesh)


def pressed(solid, method=None, mesh=SLAB, law=BLOCKS, rtol=None, **options):
    """The state of a body of order 3 under a cylinder."""
    body = mb.Body(mesh, solid, options.pop("order", 3), **{"fixed": "bottom"} | options)
    return mb.Contact(body, CYLINDER, law, method).solve(load=1.0, rtol=rtol)


def compression(solid):
    """The modulus of uniaxial strain."""
    return solid.lam + 2 * solid.mu


@pytest.mark.parametrize("method", (mb.Condensed(), mb.Newton()))
def test_regions_of_one_solid_are_a_homogeneous_body(method):
    plain = pressed(SOLID, method)
    twin = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    functions = mb.Cosserat(E=ng.CF(100), nu=ng.CF(0.3), ell=ng.CF(0.1), mu_c=SOLID.mu_c)
    for solid in ({"coating": SOLID, "bulk": twin}, functions, {"b.*": functions, "coating": SOLID}):
        state = pressed(solid, method)
        assert np.abs(state.pressures["A"] - plain.pressures["A"]).max() < 1e-10 * plain.pressure.max()
        assert np.abs(state.micromoment - plain.micromoment).max() < 1e-10 * np.abs(plain.micromoment).max()
        assert state.energy == pytest.approx(plain.energy, rel=1e-10)
        assert state.approach == pytest.approx(plain.approach, rel=1e-10)
        assert state.reaction("bottom").force[1] == pytest.approx(1.0, rel=1e-9)


def test_layers_follow_a_rigid_translation_without_stress():
    solid = {"coating": mb.Cosserat(E=100 * ng.exp(ng.x), nu=0.3, ell=0.1, beta=1), "bulk": STEEL}
    prescribed = {"u1": {"bottom": 0.1}, "u2": {"bottom": 0.3}}
    fields = mb.Body(SLAB, solid, 2, prescribed=prescribed).solve()
    at = fields(np.array((0.1, -0.7)), np.array((-0.1, -0.9)))
    assert np.abs(at.u - [[0.1], [0.3]]).max() < 1e-12
    assert np.abs(at.stress).max() < 1e-9
    assert abs(fields.energy()) < 1e-20


GRADED = mb.Cosserat(E=100 * (2 + ng.y), nu=0.3, ell=0.1, beta=1)
LAYERS = {"coating": SOLID, "bulk": RUBBER}


@pytest.mark.parametrize("dim", (1, 2, 3))
def test_columns_in_uniaxial_strain_give_way_as_the_integral_of_their_compliance(dim):
    """Under a unit pressure u2 = -integral dy/(lambda + 2 mu)."""
    depth = (ng.x, ng.y, ng.z)[dim - 1]
    if dim == 3:
        mesh = meshes3d.block([0, 1], [0, 1], [-1.0, -0.5, 0.0], reach=1.0)
        held = {"u1": ".*", "u2": ".*", "u3": "bottom", "psi1": ".*", "psi2": ".*", "psi3": ".*"}
    elif dim == 2:
        mesh = SLAB
        held = {"u1": "bottom|side", "u2": "bottom", "psi": "bottom"}
    else:
        mesh = line(4)
        held = "middle"
    traction = [0.0] * max(dim, 2)
    traction[-1] = -1.0
    solids = [mb.Cosserat(E=100 * (2 + depth), nu=0.3, ell=0.1, beta=1)]
    rises = [quad(lambda y: 1 / compression(mb.Elastic(100 * (2 + y), 0.3)), -1, 0)[0]]
    if dim < 3:
        thickness = 0.4 if dim == 2 else 0.5
        solids.append(LAYERS)
        rises.append(thickness / compression(SOLID) + (1 - thickness) / compression(RUBBER))
    for solid, rise in zip(solids, rises):
        body = mb.Body(mesh, solid, 4 if dim == 3 else 6, fixed=held)
        fields = body.solve(Loads(traction={"contact": tuple(traction)}))
        u = fields.u3 if dim == 3 else fields.u2
        assert u(mesh(*[0.0] * dim)) == pytest.approx(-rise, rel=1e-6)
        assert fields.energy() == pytest.approx(rise / 2 * (2 if dim == 2 else 1), rel=1e-6)


def test_functions_are_integrated_beyond_the_order_of_the_fields():
    """A linear element has the mean of its moduli, here of an E of the fourth degree whose mean is 200."""
    solid = mb.Elastic(E=100 * (1 + 5 * ng.x**4), nu=0.3)
    mesh = meshes.line(depth=1.0, elements=1)
    fields = mb.Body(mesh, solid, 1, fixed="middle").solve(Loads(traction={"contact": (0, -1)}))
    assert fields.u2(mesh(0.0)) == pytest.approx(-1 / compression(mb.Elastic(E=200, nu=0.3)), rel=1e-12)


# --- layers on a half-plane: waves of pressure, by transfer matrices


def transfer(solid, k):
    """d/dx2 of (u1, u2, psi, sigma12, sigma22, m2) exp(i k x1), array (6, 6), from (1), (16), (17) and the
    equilibrium sigma_ij,j = 0, m_j,j = sigma12 - sigma21. A classical solid has no psi: its rows are 0.
    """
    mu_c = 0.0 if isinstance(solid, mb.Elastic) else solid.mu_c
    u1, u2, psi, shear, normal, m = np.eye(6)
    rotation = 1j * k * u2 - psi  # gamma21
    gamma12 = (shear - (solid.mu - mu_c) * rotation) / (solid.mu + mu_c)
    slope2 = (normal - solid.lam * 1j * k * u1) / (solid.lam + 2 * solid.mu)
    sigma21 = (solid.mu + mu_c) * rotation + (solid.mu - mu_c) * gamma12
    sigma11 = solid.lam * (1j * k * u1 + slope2) + 2 * solid.mu * 1j * k * u1
    stiffness = solid.curvature * solid.ell**2 * solid.mu
    rows = np.array(
        (
            gamma12 - psi,
            slope2,
            m / stiffness,
            -1j * k * sigma11,
            -1j * k * sigma21,
            shear - sigma21 + k**2 * stiffness * psi,
        )
    )
    if isinstance(solid, mb.Elastic):
        rows[[2, 5]] = 0.0
        rows[:, [2, 5]] = 0.0
    return rows


def decaying(solid, k):
    """Fields that fall off with depth, columns (6, modes): the invariant subspace of growth upwards."""
    _, vectors, count = schur(transfer(solid, k), output="complex", sort=lambda root: root.real > k / 2)
    return vectors[:, :count]


def wave_response(k, coating, thickness, bulk):
    """-u2 of the surface over the amplitude of a pressure cos(k x1)."""
    fields = decaying(bulk, k)
    classical = isinstance(coating, mb.Elastic)
    if isinstance(bulk, mb.Elastic) and not classical:  # psi is free, and no couple acts upon it there
        fields = np.column_stack((fields, np.eye(6)[2]))
    steps = 200
    for _ in range(steps):  # of modes that grow differently none is lost
        fields, _ = np.linalg.qr(expm(transfer(coating, k) * thickness / steps) @ fields)
    tractions = fields[3 : 5 if classical else 6]
    weights = np.linalg.solve(tractions, np.eye(len(tractions))[1])
    return (fields[1] @ weights).real


@pytest.mark.parametrize("k", (0.3, 2.0, 15.0))
def test_the_transfer_matrix_knows_half_planes(k):
    for solid in (SOLID, RUBBER):
        half_plane = plane_symbol(solid, np.array([k]))[0, 0]
        assert wave_response(k, solid, 1.0 / k, solid) == pytest.approx(half_plane, rel=1e-8)
        bulk = SOFT if solid is SOLID else STEEL
        assert wave_response(k, solid, 9.0 / k, bulk) == pytest.approx(half_plane, rel=1e-5)
        other = plane_symbol(bulk, np.array([k]))[0, 0]
        assert wave_response(k, solid, 1e-7 / k, bulk) == pytest.approx(other, rel=1e-5)


@pytest.mark.parametrize(
    "coating, bulk", ((STEEL, RUBBER), (RUBBER, STEEL), (SOLID, SOFT), (SOFT, SOLID), (SOLID, RUBBER))
)
def test_waves_of_pressure_on_a_layered_half_plane(coating, bulk):
    """Half a wavelength between planes of symmetry, three wavelengths deep."""
    k = 2.0
    thickness = 0.3
    across = np.linspace(0, math.pi / k, 6)
    up = np.concatenate((-np.geomspace(6 * math.pi / k, thickness, 9), np.linspace(-thickness, 0, 4)[1:]))
    mesh = layered(across, up, thickness)
    held = {"u1": "bottom|side", "u2": "bottom", "psi": "bottom|side"}
    body = mb.Body(mesh, {"coating": coating, "bulk": bulk}, 6, fixed=held)
    fields = body.solve(Loads(traction={"contact": (0, -ng.cos(k * ng.x))}))
    response = wave_response(k, coating, thickness, bulk)
    assert -fields.u2(mesh(0.0, 0.0)) == pytest.approx(response, rel=1e-5)
    assert -fields.u2(mesh(0.9, 0.0)) == pytest.approx(response * math.cos(k * 0.9), rel=1e-4)


def test_waves_of_pressure_on_a_periodic_layered_body():
    k = 2.0
    thickness = 0.3
    up = np.concatenate((np.linspace(-3 * math.pi, -thickness, 9), [0.0]))

    def place(x, y):
        return 2 * math.pi / k * x, np.interp(y, np.linspace(0, 1, len(up)), up)

    mesh = MakeStructured2DMesh(nx=6, ny=len(up) - 1, periodic_x=True, mapping=place)
    mesh = parted(meshes.named(mesh, "bottom", "right", "contact", "left"), lambda x1, x2: x2 > -thickness)
    solids = {"coating": SOLID, "bulk": RUBBER}
    body = mb.Body(mesh, solids, 6, fixed="bottom", periodic=True)
    fields = body.solve(Loads(traction={"contact": (0, -ng.cos(k * ng.x))}))
    response = wave_response(k, SOLID, thickness, RUBBER)
    assert -fields.u2(mesh(0.0, 0.0)) == pytest.approx(response, rel=1e-4)


# --- thin layers, second bodies, estimates


def thin_layer(a):
    """Half-width of a layer of thickness 1, bonded to a base 1e5 times stiffer, under a cylinder that presses
    with what makes Winkler's half-width `a`: p = (lambda + 2 mu) (a^2 - x^2)/(2 R), so that
    P = 2 (lambda + 2 mu) a^3/(3 R).
    """
    across = np.concatenate((np.linspace(0, 0.9 * a, 12), np.linspace(0.9 * a, 1.2 * a, 25)[1:]))
    across = np.concatenate((across, 1.2 * a + np.array([1.0, 3.0, 6.0])))
    mesh = layered(across, [-2.0, -1.0, -0.5, 0.0], 1.0, names=("bottom", "side", "contact", "axis"))
    base = mb.Elastic(E=1e5 * RUBBER.E, nu=0.2)
    held = {"u1": "bottom|axis", "u2": "bottom"}
    body = mb.Body(mesh, {"coating": RUBBER, "bulk": base}, 4, fixed=held)
    radius = 100 * a
    half_of_load = compression(RUBBER) * a**3 / (3 * radius)
    state = mb.Contact(body, mb.Cylinder(R=radius), UNILATERAL, mb.Condensed()).solve(load=half_of_load)
    return float(state.x[state.pressure > 0].max()), state.pressure.max() * 2 * radius / a**2


def test_thin_compressible_layers_are_winklers_to_their_own_order():
    """Pressures are those of uniaxial strain but within a thickness or so of the edges."""
    halves = np.array((5.0, 10.0, 20.0))
    widths, pressures = np.transpose([thin_layer(a) for a in halves])
    assert np.all(np.abs(widths - halves) < 0.5)
    assert np.all(np.abs(pressures / compression(RUBBER) - 1) < 1 / halves**2)


def test_a_coated_second_body_is_the_coated_body_in_a_mirror():
    """What presses the coating from above and does not give way, and a rigid cylinder on the coating."""
    across = np.linspace(-1, 1, 21)
    up = np.linspace(-1, 0, 6)
    rigid = mb.Body(layered(across, up, 0.4), mb.Elastic(E=1e9, nu=0.3), 3, fixed="bottom")
    below = mb.Body(layered(across, up, 0.4), {"coating": RUBBER, "bulk": STEEL}, 3, fixed="bottom")
    lower = layered(across, up + 1, -0.4, names=("contact", "side", "top", "side"))
    above = mb.Body(lower, {"bulk": RUBBER, "coating": STEEL}, 3, fixed="top")
    coated = mb.Contact(below, CYLINDER, UNILATERAL).solve(load=0.2)
    mirrored = mb.Contact(rigid, mb.Deformable(above, CYLINDER), UNILATERAL).solve(load=0.2)
    # forces of corners are pressures, of which the second body takes the means
    assert mirrored.approach == pytest.approx(coated.approach, rel=1e-3)
    assert mirrored.pressure.max() == pytest.approx(coated.pressure.max(), rel=1e-2)


def difference(coarse, fine):
    """Relative L2 difference of pressures and micromoments over ell, of two states."""
    x = fine.x
    p = np.sqrt(fine.weights @ (coarse.pressure_at(x) - fine.pressure) ** 2)
    M = np.sqrt(fine.weights @ (coarse.micromoment_at(x) - fine.micromoment) ** 2) / fine.solid.ell
    return max(p, M) / np.sqrt(fine.weights @ fine.pressure**2)


COARSE = layered(np.linspace(-1, 1, 7), np.linspace(-1, 0, 6), 0.2, quads=False)


@pytest.mark.parametrize("law, coating", ((UNILATERAL, STEEL), (BLOCKS, SOLID)))
def test_estimates_hold_over_layers(law, coating):
    state = pressed({"coating": coating, "bulk": RUBBER}, None, COARSE, law, rtol=0.05)
    finer = ng.Mesh(state.problem.body.mesh.ngmesh.Copy())
    finer.Refine()
    fine = mb.Contact(state.problem.body.on(finer.Curve(3)), CYLINDER, law).solve(load=1.0)
    assert difference(state, fine) < state.error_estimate <= 0.05


def test_interfaces_are_no_error(monkeypatch):
    """Averages across the interface, the control, take its jumps for errors and cut the elements there."""
    solid = {"coating": STEEL, "bulk": RUBBER}
    state = pressed(solid, None, COARSE, UNILATERAL, rtol=0.05)
    monkeypatch.setattr(Body, "by_region", lambda body, make: make(body.mesh.Materials(".*")))
    smeared = pressed(solid, None, COARSE, UNILATERAL, rtol=0.05)
    assert smeared.unknowns > 1.5 * state.unknowns


# --- refusals and what goes on with a body


@pytest.mark.parametrize(
    "moduli, name, place",
    (
        ({"E": 0.5 + ng.x}, "E", "at (-0.9"),
        ({"nu": 0.4 + 0.2 * ng.x}, "nu", "at (0.9"),
        ({"ell": ng.x**2 - 0.5}, "ell", ""),
        ({"ell": 0.2 + 0.1 * ng.x}, "ell", "one number"),
        ({"beta": 2 + 0 * ng.x}, "beta", "2 is the couple-stress limit"),
        ({"mu_c": ng.y}, "mu_c", "negative; it is so at"),
        ({"curvature": ng.y**2 - 0.1}, "curvature", "gamma'"),
        ({"alpha_prime": 4 * ng.y}, "alpha_prime", "alpha' + beta' + gamma'"),
        ({"beta_prime": ng.log(ng.y)}, "beta_prime", "finite"),
        ({"E": ng.CF((1.0, 2.0))}, "E", "one component"),
        ({"E": ng.CF(1j)}, "E", "real"),
        ({"E": 1 + ng.x**2, "nu": 0.6}, "nu", "1/2"),
    ),
)
def test_functions_are_refused_by_argument_value_and_place(moduli, name, place):
    arguments = {"E": 100.0, "nu": 0.3, "ell": 0.1} | moduli
    if "mu_c" not in moduli:
        arguments.setdefault("beta", 1.0)
    solid = mb.Cosserat(**arguments)
    with pytest.raises(mb.BadArgument) as refusal:
        mb.Body(SLAB, solid, 2, fixed="bottom")
    assert refusal.value.name == name and place in str(refusal.value)


@pytest.mark.parametrize(
    "solid, words",
    (
        ({"coating": SOLID}, "missing: bulk"),
        ({"coating": SOLID, ".*": SOFT}, "named twice: coating"),
        ({"coating": SOLID, "bulk": SOFT, "steel": STEEL}, "none of the mesh's materials, bulk, coating"),
        ({"(": SOLID}, "no regular expression"),
        ({1: SOLID}, "name or pattern of bulk, coating"),
        ({}, "missing: bulk, coating"),
    ),
)
def test_each_material_has_one_solid(solid, words):
    with pytest.raises(mb.BadArgument, match="solid = ") as refusal:
        mb.Body(SLAB, solid)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    "call",
    (
        mb.HalfPlane,
        mb.HalfSpace,
        mb.Block,
        lambda solid: mb.hertz_scales(solid, 1.0, 1.0),
        lambda solid: mb.Contact(mb.HalfPlane(SOLID), CYLINDER, UNILATERAL).with_(solid=solid),
    ),
)
def test_functions_are_for_bodies_on_a_mesh(call):
    with pytest.raises(mb.BadArgument, match="E = .* must be a number: a function"):
        call(GRADED)


def test_other_solids_of_a_layered_body_are_refused_by_words():
    body = mb.Body(SLAB, LAYERS, 2, fixed="bottom")
    assert body.of(SOLID) is body
    with pytest.raises(mb.BadArgument, match="another one elsewhere"):
        mb.Contact(body, CYLINDER, BLOCKS).with_(solid=SOFT)
    with pytest.raises(mb.BadArgument, match="Unilateral"):
        mb.Contact(mb.Body(SLAB, {"coating": STEEL, "bulk": SOLID}, fixed="bottom"), CYLINDER, BLOCKS)


@pytest.mark.parametrize("mesh", (SLAB, line(4)))
def test_psi_and_couples_end_where_the_solid_is_elastic(mesh):
    body = mb.Body(mesh, {"coating": SOLID, "bulk": STEEL}, 3, fixed=mesh.GetBoundaries()[0])
    fields = body.solve(Loads(micromoment={"contact": 0.1}))
    inside = (0.1, -0.9)[2 - mesh.dim :]
    assert fields.psi(mesh(*inside)) == 0
    for argument in ({"couple": 1.0}, {"micromoment": {mesh.GetBoundaries()[0]: 1.0}}):
        with pytest.raises(mb.BadArgument, match="acts where the solid is Elastic"):
            body.solve(Loads(**argument))
    with pytest.raises(mb.BadArgument, match="acts where the solid is Elastic"):
        body.on(mesh, prescribed={"psi": {mesh.GetBoundaries()[0]: 1.0}})


def test_the_surface_has_the_stiffest_solid_and_no_blocks_on_elastic_parts():
    names = ("bottom", "side", "contact", "side")
    plain = meshes.rectangles(np.linspace(-1, 1, 5), np.linspace(-1, 0, 3), True, names)
    beside = parted(plain, lambda x1, x2: x1 < 0)

    def surface(left, right):
        return mb.Body(beside, {"coating": left, "bulk": right}).solid

    assert surface(SOLID, SOFT) == surface(SOFT, SOLID) == SOLID
    assert surface(SOLID, STEEL) == STEEL
    assert surface(RUBBER, SOLID) == mb.Elastic(E=100, nu=0.3)
    assert abs(surface(GRADED, SOFT).E - 200.0) < 1e-9
    with pytest.raises(
        mb.BadArgument, match=r"ell = \(0.1, 0.2\): must be one number on the boundary contact"
    ):
        surface(SOLID, SOFT.with_length(0.2))


def test_layered_states_are_copied_and_kept(tmp_path):
    state = pressed({"coating": GRADED, "bulk": RUBBER}, mb.Condensed())
    twin = pickle.loads(pickle.dumps(state))
    for field in ("psi", "stress"):
        assert np.array_equal(getattr(twin.fields(0.1, -0.3), field), getattr(state.fields(0.1, -0.3), field))
    state.save(tmp_path / "state")
    assert mb.load(tmp_path / "state").solid == state.solid
    assert "2 solids" in repr(state.problem.body) and "E=function" in repr(GRADED)
    assert state.problem.plan(load=1.0)


def test_a_body_of_one_material_at_the_surface_has_its_very_solid():
    assert mb.Body(SLAB, LAYERS).solid is SOLID
    assert mb.Body(SLAB, {".*": RUBBER}).solid.ell == 2.0  # of the mesh: a classical solid has no length
