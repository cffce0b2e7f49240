"""Bodies of several solids and of graded ones: where each is, closed forms, layers, estimates, refusals."""

import math

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm, schur

import microblock as mb
from microblock.fem import meshes, meshes3d
from microblock.fem.loads import Loads
from microblock.halfplane.kernels import plane_symbol

SOLID = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
SOFT = mb.Cosserat(E=40, nu=0.2, ell=0.1, beta=0.6)
STEEL = mb.Elastic(E=200, nu=0.3)
RUBBER = mb.Elastic(E=20, nu=0.2)
CYLINDER = mb.Cylinder(R=10)
BLOCKS = mb.Microblock()
LINE = mb.Unilateral()


def layered(across, up, thickness, quads=True, names=("bottom", "side", "contact", "side")):
    """Rectangles between lines, of the material "coating" above -thickness, else "bulk"."""
    mesh = meshes.rectangles(np.asarray(across), np.asarray(up), quads, names).ngmesh
    mesh.SetMaterial(1, "bulk")
    coating = mesh.AddRegion("coating", dim=2)
    points = mesh.Coordinates()
    cells = mesh.Elements2D()
    for number in range(len(cells)):
        corners = list(cells[number].vertices)
        if points[[corner.nr - 1 for corner in corners], 1].mean() > -thickness:
            cells[number] = netgen.Element2D(coating, corners)
    return ng.Mesh(mesh)


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
