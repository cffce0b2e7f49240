"""The bulk without contact: patch tests, Cosserat glide, rates, rigid motions, limits."""

import netgen.occ as occ
import ngsolve as ng
import numpy as np
import pytest
from conftest import dome, rectangle
from ngsolve import x, y
from ngsolve.meshes import MakeStructured2DMesh

from microblock import BadArgument, Body, Cosserat, NotConverged
from microblock.fem import meshes
from microblock.fem.body import Fields, Loads

SHAPES = pytest.mark.parametrize("quads", [False, True], ids=["triangles", "quadrilaterals"])
# Providas and Kattis (2002): mu = 1000, nu = 0.25, mu_c = 500, m = 4 mu ell^2 grad psi with ell = 0.1
PATCH = Cosserat(E=2500, nu=0.25, ell=0.1, mu_c=500, curvature=4)
PATCHES = {  # microrotation over 1e-3, loads, sigma_12 - 1.5, m
    1: (0.25 + 0 * x, Loads(), 0 * x, (0, 0)),
    2: (0.75 + 0 * x, Loads(couple=1), 0.5 + 0 * x, (0, 0)),
    3: (0.25 + (x - y), Loads(force=(1, 1), couple=2 * (x - y)), x - y, (0.04, -0.04)),
}


def patch(mesh, order, case, loads=None):
    psi, own, _, _ = PATCHES[case]
    values = {"u1": 1e-3 * (x + y / 2), "u2": 1e-3 * (x + y), "psi": 1e-3 * psi}
    body = Body(mesh, PATCH, order, prescribed={name: {".*": value} for name, value in values.items()})
    return body.solve(own if loads is None else loads)


def stress_error(fields, case):
    _, _, excess, m = PATCHES[case]
    expected = ng.CF((4, 1.5 + excess, 1.5 - excess, 4, *m))
    found = ng.CF((fields.stress, fields.couple_stress))
    return ng.sqrt(
        ng.Integrate(ng.InnerProduct(found - expected, found - expected), fields.body.mesh)
        / ng.Integrate(ng.InnerProduct(expected, expected), fields.body.mesh)
    )


def test_a_body_shows_its_size_supports_and_moduli():
    body = Body(rectangle(1, 1, 0.5), PATCH, 2, order_psi=1, fixed={"u1": "left|right", "u2": "bottom"})
    rows = {row.name: (row.value, row.unit) for row in body.summary().rows}
    assert rows["elements"] == (body.mesh.ne, "in 2D") and rows["order"][0] == "2, psi 1"
    assert rows["unknowns"][0] == sum(body.space.FreeDofs()) < body.space.ndof
    assert rows["u1 constrained"] == ("left, right", "boundaries") and rows["u2 constrained"][0] == "bottom"
    assert "psi constrained" not in rows and rows["Young's modulus"] == (2500, "stress")
    assert "stress" in body._repr_html_() and len(repr(body)) < 100
    assert "nowhere" in Body(body.mesh, PATCH)._repr_html_()


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("case", PATCHES)
def test_patch(quads, order, case):
    # the solution is linear, so any mesh is exact up to rounding
    assert stress_error(patch(rectangle(0.24, 0.12, 0.05, quads), order, case), case) < 1e-11


@pytest.mark.parametrize(
    "case, loads",
    [
        (2, Loads(couple=-1)),
        (3, Loads(force=(1, 1), couple=-2 * (x - y))),
        (3, Loads(force=(-1, -1), couple=2 * (x - y))),
    ],
)
def test_patch_with_the_sign_of_printed_19_misses(case, loads):
    # (19)_2 with the paper's own eps:A would have sigma_12 - sigma_21 = -l; negative control, eight decades
    # above rounding
    assert stress_error(patch(rectangle(0.24, 0.12, 0.05), 2, case, loads), case) > 1e-3


# MOOSE's cosserat_glide: mu = 2, mu_c = 3, curvature modulus 1.2, psi = sinh 2 y
GLIDE = Cosserat(E=5, nu=0.25, ell=1, mu_c=3, curvature=0.6)
GLIDE_FIELDS = {
    "u1": 0.6 * (1 - (ng.exp(2 * y) + ng.exp(-2 * y)) / 2),
    "u2": 0 * y,
    "psi": (ng.exp(2 * y) - ng.exp(-2 * y)) / 2,
}


def glide(order, maxh, quads):
    body = Body(
        rectangle(0.05, 1, maxh, quads),
        GLIDE,
        order,
        prescribed={name: {".*": value} for name, value in GLIDE_FIELDS.items()},
    )
    fields = body.solve()
    difference = fields.psi - GLIDE_FIELDS["psi"]
    return fields, ng.sqrt(ng.Integrate(difference**2, body.mesh, order=2 * order + 6))


@SHAPES
def test_glide(quads):
    fields, error = glide(4, 0.025, quads)
    assert error < 1e-9
    # the published values at y = 1, and sigma_21 = -4.8 sinh 2 y, m = 2.4 cosh 2 y inside
    mesh = fields.body.mesh
    assert fields.psi(mesh(0.02, 1.0)) == pytest.approx(3.626860407847, rel=1e-9)
    assert fields.u1(mesh(0.02, 1.0)) == pytest.approx(-1.65731741465, rel=1e-9)
    inside = mesh(0.021, 0.513)
    # derivatives lose one order: h^4 with h = 1/40 and the small constant of sinh
    assert fields.stress(inside)[2] == pytest.approx(-4.8 * np.sinh(1.026), rel=1e-6)
    assert fields.stress(inside)[1] == pytest.approx(0, abs=1e-5)
    assert fields.couple_stress(inside)[1] == pytest.approx(2.4 * np.cosh(1.026), rel=1e-6)


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_glide_converges(quads, order):
    coarse, fine = glide(order, 0.05, quads)[1], glide(order, 0.0125, quads)[1]
    # two halvings of an irregular mesh: netgen's meshes scatter by a few tenths of an order
    assert np.log2(coarse / fine) / 2 == pytest.approx(order + 1, abs=0.5)


SMOOTH = Cosserat(E=2.6, nu=0.3, ell=0.3, beta=1)
SMOOTH_FIELDS = (ng.sin(2 * x + y), ng.cos(x - 2 * y), ng.sin(x) * ng.cos(3 * y))
SMOOTH_BOUNDARY = {name: {".*": value} for name, value in zip(("u1", "u2", "psi"), SMOOTH_FIELDS)}


def smooth_loads():
    """Loads that make SMOOTH_FIELDS an equilibrium: f = -div sigma, l = sigma_12 - sigma_21 - div m."""
    u1, u2, psi = SMOOTH_FIELDS
    gradient = ng.CF((u1.Diff(x), u1.Diff(y), u2.Diff(x), u2.Diff(y)), dims=(2, 2))
    (s11, s12), (s21, s22) = SMOOTH.stress(gradient, psi)
    m1, m2 = SMOOTH.couple_stress((psi.Diff(x), psi.Diff(y)))
    return Loads(
        force=(-s11.Diff(x) - s12.Diff(y), -s21.Diff(x) - s22.Diff(y)),
        couple=s12 - s21 - m1.Diff(x) - m2.Diff(y),
    )


def smooth_errors(order, cells, quads):
    """L2 error and H1 seminorm error of the manufactured solution on a sheared structured mesh."""
    mesh = MakeStructured2DMesh(
        quads=quads, nx=cells, ny=cells, mapping=lambda s, t: (s + 0.2 * t, t + 0.1 * s * t)
    )
    fields = Body(mesh, SMOOTH, order, prescribed=SMOOTH_BOUNDARY).solve(smooth_loads())
    l2 = h1 = 0
    for field, exact in zip(fields, SMOOTH_FIELDS):
        slope = ng.grad(field) - ng.CF((exact.Diff(x), exact.Diff(y)))
        l2 += ng.Integrate((field - exact) ** 2, mesh, order=2 * order + 6)
        h1 += ng.Integrate(ng.InnerProduct(slope, slope), mesh, order=2 * order + 6)
    return np.sqrt((l2, h1))


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_rates(quads, order):
    errors = np.array([smooth_errors(order, cells, quads) for cells in (4, 8)])
    rates = np.log2(errors[0] / errors[1])
    assert rates == pytest.approx([order + 1, order], abs=0.25)  # asymptotic to this much at h = 1/8


def test_curved_boundary_converges():
    def error(order):
        mesh = dome(order)
        fields = Body(mesh, SMOOTH, order, prescribed=SMOOTH_BOUNDARY).solve(smooth_loads())
        return ng.sqrt(ng.Integrate((fields.psi - SMOOTH_FIELDS[2]) ** 2, mesh, order=2 * order + 6))

    # a straight-sided mesh would stop near 1e-2; raising the order on the curved one gains a digit each time
    errors = [error(order) for order in (2, 4, 6)]
    assert errors[2] < 1e-5 and errors[0] > 10 * errors[1] > 100 * errors[2]


def test_orders_of_u_and_psi_are_independent():
    body = Body(
        rectangle(1, 1, 0.3),
        SMOOTH,
        3,
        order_psi=2,
        fixed={"u2": ".*"},
        prescribed={"u1": {".*": x**3}, "psi": {".*": x * y}},
    )
    assert body.spaces[0].ndof > body.spaces[2].ndof
    fields = body.solve()
    assert fields.psi(body.mesh(1.0, 0.5)) == pytest.approx(0.5, abs=1e-12)  # a value of the boundary


@SHAPES
def test_rigid_motion_carries_no_energy(quads):
    def moved(psi):
        mesh = rectangle(1, 0.5, 0.2, quads)
        values = {"u1": 0.3 - 0.1 * y, "u2": 0.1 * x, "psi": psi}
        return Body(
            mesh, SMOOTH, 2, prescribed={name: {".*": value} for name, value in values.items()}
        ).solve()

    assert abs(moved(0.1).energy()) < 1e-25  # squares of rounding
    assert moved(0.0).energy() > 1e-3  # blocks that are held do not turn along


def test_no_coupling_is_classical_elasticity():
    # uniaxial compression of a block free to widen: sigma_22 = t only, psi stays 0
    solid = Cosserat(E=2.0, nu=0.3, ell=0.1, beta=0)
    body = Body(rectangle(1, 1, 0.4), solid, 2, fixed={"u1": "left", "u2": "bottom", "psi": "bottom"})
    fields = body.solve(Loads(traction={"top": (0, -0.1)}))
    assert fields.stress(body.mesh(0.3, 0.4)) == pytest.approx((0, 0, 0, -0.1), abs=1e-13)
    assert fields.u2(body.mesh(0.5, 1.0)) == pytest.approx(-0.1 / solid.E_star, rel=1e-12)  # plane strain
    assert fields.psi(body.mesh(0.5, 1.0)) == pytest.approx(0, abs=1e-14)


def test_traction_and_micromoment_on_their_own_boundaries():
    # one-dimensional in y: sigma_22 = -0.2 throughout, and m_2 = 0.3 on top decays downwards like the layer
    solid = Cosserat(E=2.6, nu=0.3, ell=0.05, beta=1)
    body = Body(meshes.line(1.0, 20), solid, 8, fixed={"u1": "middle", "u2": "middle"})
    fields = body.solve(Loads(traction={"contact": (0, -0.2)}, micromoment={"contact": 0.3}))
    top, down = body.mesh(0.0), body.mesh(-0.05)
    assert fields.stress(top)[3] == pytest.approx(-0.2, rel=1e-12)
    # a slope, of order 8 with h = ell
    assert fields.couple_stress(top)[1] == pytest.approx(0.3, rel=1e-8)
    # the other end of the strip is felt by exp(-40)
    assert fields.psi(down) / fields.psi(top) == pytest.approx(np.exp(-1), rel=1e-10)


def test_energy_is_half_the_work_of_the_loads():
    body = Body(rectangle(1, 0.5, 0.2), SMOOTH, 3, fixed="bottom")
    fields = body.solve(
        Loads(force=(0.1, -0.2), couple=0.3, traction={"top": (0.2, -0.1)}, micromoment={"top": 0.1})
    )
    work = ng.Integrate(0.1 * fields.u1 - 0.2 * fields.u2 + 0.3 * fields.psi, body.mesh)
    work += ng.Integrate(
        0.2 * fields.u1 - 0.1 * fields.u2 + 0.1 * fields.psi, body.mesh.Boundaries("top"), order=8
    )
    assert fields.energy() == pytest.approx(work / 2, rel=1e-12)


LOADS = Loads(force=(0.1, -0.2), couple=0.3, traction={"top": (0.5, -0.1)}, micromoment={"top": 0.7})


@SHAPES
@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize("fixed", ["bottom", {"u1": "left", "u2": "bottom|right", "psi": "bottom"}])
def test_reactions_balance_the_loads(quads, order, fixed):
    """A block [0, 1] x [0, 0.5]: body forces act at (1/2, 1/4), tractions at (1/2, 1/2); to rounding."""
    fields = Body(rectangle(1, 0.5, 0.3, quads), SMOOTH, order, fixed=fixed).solve(LOADS)
    named = fixed if isinstance(fixed, str) else "left|bottom|right"
    force, moment = fields.reaction(named)
    assert force == pytest.approx([-0.05 - 0.5, 0.1 + 0.1], abs=1e-12)
    turning = (0.5 * -0.1 - 0.25 * 0.05) + 0.5 * 0.3 + (0.5 * -0.1 - 0.5 * 0.5) + 0.7
    assert moment == pytest.approx(-turning, abs=1e-12)
    if not isinstance(fixed, str):  # u1 is held on the left alone
        assert fields.reaction("left").force == pytest.approx([-0.55, 0], abs=1e-12)
        assert fields.reaction("right").force[0] == 0


def test_reaction_of_curved_and_one_dimensional_bodies_and_of_prescribed_values():
    curved = Body(dome(3), SMOOTH, 4, fixed="base").solve(Loads(traction={"contact": (0.1, -0.2)}))
    length = ng.Integrate(
        ng.CF((1, x, y)), curved.body.mesh, definedon=curved.body.mesh.Boundaries("contact")
    )
    force, moment = curved.reaction("base")
    # another rule has arcs 2e-7 longer
    assert force == pytest.approx(np.array((-0.1, 0.2)) * length[0], rel=1e-6)
    assert moment == pytest.approx(-(-0.2 * length[1] - 0.1 * length[2]), rel=1e-6)
    for mesh, width in ((meshes.line(1.0, 4), 1), (meshes.column(1.0, 4), 0.25)):
        body = Body(
            mesh,
            SMOOTH,
            4,
            fixed={"u1": "middle", "u2": "middle"},
            prescribed={"psi": {"middle": 0.02}},
            periodic=mesh.dim == 2,
        )
        fields = body.solve(Loads(traction={"contact": (0.3, -0.2)}))
        force, moment = fields.reaction("middle")
        assert force / width == pytest.approx([-0.3, 0.2], abs=1e-12)
        # of the couple stress, and of the force at x2 = -1; u2 has no arm where all columns are alike
        point = fields.couple_stress(mesh(-1.0) if mesh.dim == 1 else mesh(0.1, -1.0))
        # a slope at the end of elements of order 4
        assert moment / width == pytest.approx(-point[1] - 0.3, abs=1e-4)


def test_stress_is_read_on_a_boundary_as_it_is_beside_it():
    """It was 0 there: the gradient that NGSolve gives on a boundary is another one."""
    body = Body(rectangle(1, 0.5, 0.1), SMOOTH, 4, fixed="bottom")
    fields = body.solve(LOADS)
    mesh = body.mesh
    top, bottom = mesh.Boundaries("top"), mesh.Boundaries("bottom")
    # along the loaded side the stress is that of the load; at the ends of the held one it is singular
    assert ng.Integrate(fields.stress[1, 1], mesh, definedon=top) == pytest.approx(-0.1, abs=1e-3)
    assert ng.Integrate(fields.couple_stress[1], mesh, definedon=top) == pytest.approx(0.7, abs=1e-3)
    force, _ = fields.reaction("bottom")
    assert -ng.Integrate(fields.stress[1, 1], mesh, definedon=bottom) == pytest.approx(force[1], rel=0.05)
    plain = ng.BoundaryFromVolumeCF(fields.stress[1, 1])
    own = ng.Integrate(fields.stress[1, 1], mesh, definedon=bottom)
    assert ng.Integrate(plain, mesh, definedon=bottom) == own


def test_a_boundary_without_support_has_no_reaction():
    body = Body(rectangle(1, 1, 0.5), SMOOTH, 1, fixed={"u1": "left", "u2": "bottom", "psi": "left"})
    for boundary, word in (
        ("top", "supported in no field"),
        ("nowhere", "none of"),
        ("(", "regular"),
        (3, "pattern"),
    ):
        with pytest.raises(BadArgument, match=word) as caught:
            body.solve().reaction(boundary)
        assert caught.value.name == "boundary"
    with pytest.raises(BadArgument, match="fields of a state"):
        Fields(body, ng.GridFunction(body.space).components).reaction("left")


def test_free_body_is_reported():
    with pytest.raises(NotConverged, match="rigid"):
        Body(rectangle(1, 1, 0.5), SMOOTH, 1).solve(Loads(force=(1, 0)))


def columns(count, quads=True, value=0.01, order=2, **more):
    """A periodic body of unit depth, `count` elements wide, in which psi is prescribed in the middle."""
    mesh = MakeStructured2DMesh(
        quads=quads, nx=count, ny=4, periodic_x=True, mapping=lambda s, t: (0.25 * count * s, t - 1)
    )
    return Body(
        mesh,
        SMOOTH,
        order,
        fixed={"u1": "bottom", "u2": "bottom"},
        prescribed={"psi": {"bottom": value}},
        periodic=True,
        **more,
    )


@SHAPES
@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_columns_of_any_width_have_the_prescribed_value(quads, order):
    # what depends on the depth alone is the same in one, two and three columns, up to rounding
    depths = [-1.0, -0.9, -0.6, -0.1]
    found = []
    for count in (1, 2, 3):
        body = columns(count, quads, order=order)
        fields = body.solve(Loads(traction={"top": (0.1, 0)}))
        found.append(
            [[field(body.mesh(x, depth)) for depth in depths for x in (0.0, 0.11)] for field in fields]
        )
        assert found[-1][2][:2] == pytest.approx([0.01, 0.01], rel=1e-12)
    if quads:  # on triangles the cut lets fields depend on x1 a little
        for other in found[1:]:
            assert found[0] == pytest.approx(np.array(other), abs=1e-13)


def test_column_of_the_strip_has_the_value_in_the_middle():
    mesh = meshes.column(depth=1.0, elements=4)
    for order, order_psi in ((1, 1), (3, 2), (2, 4)):
        body = Body(
            mesh,
            SMOOTH,
            order,
            order_psi=order_psi,
            fixed={"u1": "middle", "u2": "middle"},
            prescribed={"psi": {"middle": 0.01}},
            periodic=True,
        )
        assert body.solve().psi(mesh(0.1, -1.0)) == pytest.approx(0.01, rel=1e-12)  # rounding


def test_prescribed_values_are_periodic_where_the_body_is():
    wave = ng.cos(8 * np.pi * x)  # of period 0.25
    body = columns(2, value=wave, order=9)
    # a polynomial of order 9 for one wave
    assert body.solve().psi(body.mesh(0.5, -1.0)) == pytest.approx(1, rel=1e-2)
    for count in (1, 2, 3):
        with pytest.raises(BadArgument, match="identifies") as caught:
            columns(count, value=x)
        assert caught.value.name == "prescribed"


@pytest.mark.parametrize("fixed", [None, 5, ["left"], ("left",)])
def test_supports_are_a_pattern_or_a_mapping(fixed):
    with pytest.raises(BadArgument) as caught:
        Body(rectangle(1, 1, 0.5), SMOOTH, fixed=fixed)
    assert caught.value.name == "fixed"


def spoilt(quads, place):
    """Nine squares, or eighteen triangles, of which a corner has moved."""
    mesh = MakeStructured2DMesh(quads=quads, nx=3, ny=3)
    mesh.ngmesh.Coordinates()[5] = place
    return ng.Mesh(mesh.ngmesh)


@SHAPES
@pytest.mark.parametrize(
    "place",
    [(np.nan, 0.3), (np.inf, 0.3), (0.9, 0.3), (0.7, 0.7), (2 / 3, 1 / 3)],
    ids=["nan", "inf", "inverted", "folded", "no_area"],
)
def test_meshes_that_are_none_are_refused(quads, place):
    with pytest.raises(BadArgument, match="of its .* elements") as caught:
        Body(spoilt(quads, place), SMOOTH)
    assert caught.value.name == "mesh"


def test_sound_meshes_are_taken():
    """Moved a little, inverted as a whole, curved, thin and of two kinds; anything else is no mesh."""
    inverted = MakeStructured2DMesh(nx=3, ny=2, mapping=lambda s, t: (-s, t))
    thin = MakeStructured2DMesh(nx=3, ny=2, quads=False, mapping=lambda s, t: (s, 1e-8 * t))
    mixed = rectangle(1, 1, 0.2, quads=True)
    for mesh in (spoilt(True, (0.4, 0.3)), inverted, dome(4), thin, mixed, meshes.line(1.0, 3)):
        assert Body(mesh, SMOOTH, 1).mesh is mesh
    for mesh in (None, 3, "mesh"):
        with pytest.raises(BadArgument, match="must be an ngsolve.Mesh"):
            Body(mesh, SMOOTH)


@SHAPES
def test_curved_elements_that_fold_are_refused(quads):
    """Parabolas for the sides of a narrow ring, in which coarse elements with straight sides are sound."""
    face = occ.Circle((0, 0), 1).Face() - occ.Circle((0, 0), 0.93).Face()
    mesh = ng.Mesh(occ.OCCGeometry(face, dim=2).GenerateMesh(maxh=2.0, quad_dominated=quads))
    Body(mesh, SMOOTH, 1)
    with pytest.raises(BadArgument, match="inverted"):
        Body(mesh.Curve(2), SMOOTH)


def test_fields_are_iterable():
    body = Body(rectangle(1, 1, 0.5), SMOOTH, 1, fixed="left")
    assert len(list(Fields(body, ng.GridFunction(body.space).components))) == 3
