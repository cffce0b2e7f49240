"""Fields below the surface of half-planes and half-spaces: field equations, surface, closed forms."""

from functools import cache

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import fields_below, judging
from microblock.contact_solvers.fft_compliance import Grid
from microblock.halfplane.subsurface import HalfPlaneBelow
from microblock.halfplane.surface_loads import cell_loads
from microblock.halfspace.subsurface import HalfSpaceBelow, square_loads
from microblock.model.fields import PointFields, SpaceFields

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1, alpha_prime=0.1, beta_prime=0.2)
SECOND = mb.Cosserat(E=150, nu=0.2, beta=0.5, ell=0.05)
CLASSICAL = mb.Elastic(E=100, nu=0.3)
CYLINDER, SPHERE = mb.Cylinder(R=10), mb.Sphere(R=10)
ROLLER = mb.Deformable(mb.HalfPlane(SECOND), CYLINDER)
ALIKE = mb.Deformable(mb.HalfPlane(SOLID), CYLINDER)
BALL = mb.Deformable(mb.HalfSpace(SECOND), SPHERE)
FRICTION = {"friction": 0.3}
LINE, SPACE = mb.HalfPlane(SOLID), mb.HalfSpace(SOLID)
EPSILON = np.zeros((3, 3, 3))
for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    EPSILON[a, b, c], EPSILON[a, c, b] = 1, -1


def test_the_number_of_coordinates_is_that_of_the_body():
    """Two of three ended in a TypeError of Python, and three on a half-plane were an accuracy."""
    space = pressed(SPACE, SPHERE, mb.Unilateral(), 32)
    line = pressed(LINE, CYLINDER, mb.Unilateral(), 64)
    for state, places in ((space, (0.0, -0.1)), (line, (0.0, 0.0, -0.1))):
        with pytest.raises(mb.BadArgument, match="x3 = .*of a body in space, and there alone"):
            state.fields(*places)


def pressed(body, obstacle, law, nodes, load=1.0):
    return mb.Contact(body, obstacle, law, mb.Cells(nodes=nodes)).solve(load=load)


def rubbed(body, obstacle, law, pair, method=None, **options):
    return mb.Contact(body, obstacle, law, method).history([pair], **options).states[-1]


def bumps(x1, x2):
    return 0.01 * (2 - np.cos(np.pi * x1) - np.cos(np.pi * x2))


STATES = {
    "cells": lambda: pressed(LINE, CYLINDER, mb.Microblock(), 512),
    "clamped cells": lambda: pressed(LINE, CYLINDER, mb.Microclamped(), 512),
    "second body on cells": lambda: pressed(LINE, ROLLER, mb.Microblock(), 512),
    "second body on panels": lambda: mb.Contact(LINE, ROLLER, mb.Microblock()).solve(load=1.0, rtol=1e-4),
    "period": lambda: pressed(
        mb.HalfPlane(SOLID, period=2.0), mb.Wave(0.003, 1.0), mb.Microblock(), 512, 0.4
    ),
    "friction": lambda: rubbed(LINE, CYLINDER, mb.Microblock(**FRICTION), (1.0, 0.2), rtol=0.05),
    "clamped friction": lambda: rubbed(LINE, CYLINDER, mb.Microclamped(**FRICTION), (1.0, 0.2), rtol=0.05),
    "friction on panels": lambda: rubbed(
        LINE, ALIKE, mb.Unilateral(**FRICTION), (1.0, 0.2), mb.Panels(), rtol=1e-3
    ),
    "space": lambda: pressed(SPACE, SPHERE, mb.Microblock(), 32),
    "clamped space": lambda: pressed(SPACE, SPHERE, mb.Microclamped(), 32),
    "second half-space": lambda: pressed(SPACE, BALL, mb.Microblock(), 32),
    "period in space": lambda: pressed(mb.HalfSpace(SOLID, period=2.0), bumps, mb.Microblock(), 32),
    "friction in space": lambda: rubbed(
        SPACE, SPHERE, mb.Microblock(**FRICTION), (1.0, 0.1, 0.05), mb.Cells(nodes=32)
    ),
    "second with friction": lambda: rubbed(
        SPACE, BALL, mb.Unilateral(**FRICTION), (1.0, 0.1, 0.05), mb.Cells(nodes=32)
    ),
}


# a history of blocks in space takes 7 s
NAMES = [pytest.param(name, marks=[pytest.mark.nightly] * (name == "friction in space")) for name in STATES]


@cache
def state(name):
    return STATES[name]()


def in_space(fields, x):
    """u, psi, stress and couple stress at points, array (dim, n), with three components each."""
    at = fields(*x)
    if len(x) == 3:
        return at.u, at.psi, at.stress, at.couple_stress
    u, psi = np.zeros((2, 3, x.shape[1]))
    stress, couple = np.zeros((2, 3, 3, x.shape[1]))
    u[:2], psi[2], stress[:2, :2], couple[2, :2] = at.u, at.psi, at.stress, at.couple_stress
    stress[2, 2] = at.s33
    return u, psi, stress, couple


def equation_errors(fields, solid, x, h):
    """Largest relative violations of (16), (17) and of both equilibria at points, array (dim, n), by
    differences of fourth order over h.
    """
    dim, n = x.shape
    u, psi, stress, couple = in_space(fields, x)
    slopes = [np.zeros((*values.shape[:-1], 3, n)) for values in (u, psi, stress, couple)]
    for axis in range(dim):
        shift = np.zeros((dim, 4, 1))
        shift[axis] = h * np.array((-2, -1, 1, 2))[:, None]
        moved = in_space(fields, (x[:, None] + shift).reshape(dim, -1))
        for slope, values in zip(slopes, moved):
            beside = values.reshape(*values.shape[:-1], 4, n)
            slope[..., axis, :] = np.einsum("...si,s->...i", beside, (1, -8, 8, -1)) / (12 * h)
    grad_u, kappa, grad_stress, grad_couple = slopes
    gamma = grad_u + np.einsum("ijk,kn->ijn", EPSILON, psi)
    eye = np.eye(3)[..., None]
    direct, transposed = solid.mu + solid.mu_c, solid.mu - solid.mu_c
    expected = solid.lam * np.trace(gamma) * eye + direct * gamma + transposed * gamma.swapaxes(0, 1)
    bending = solid.alpha_prime * np.trace(kappa) * eye + solid.curvature * kappa
    bending = solid.mu * solid.ell**2 * (bending + solid.beta_prime * kappa.swapaxes(0, 1))
    if dim == 2:
        bending[:2] = 0  # m_13 and m_23 are beside the fields of the plane
    moment = np.einsum("ijjn->in", grad_couple) - np.einsum("ijk,jkn->in", EPSILON, stress)
    return {
        "stress": np.abs(stress - expected).max() / np.abs(stress).max(),
        "couple stress": np.abs(couple - bending).max() / np.abs(couple).max(),
        "forces": np.abs(np.einsum("ijjn->in", grad_stress)).max() / np.abs(grad_stress).max(),
        "moments": np.abs(moment).max() / np.abs(grad_couple).max(),
    }


@pytest.mark.parametrize("name", NAMES)
def test_fields_satisfy_the_field_equations(name):
    """Over h = 0.04 ell differences leave 1e-7, noise of cells that are cut otherwise 1e-5; a wrong sign of
    one amplitude leaves some tenths.
    """
    rng = np.random.default_rng(7)
    solved = state(name)
    dim = solved.points.shape[1]
    x = np.vstack((rng.uniform(-0.4, 0.4, (dim - 1, 4)), -rng.uniform(0.1, 0.5, 4)))
    errors = equation_errors(solved.fields, SOLID, x, 0.004)
    assert max(errors.values()) < 1e-4, errors
    second = solved.fields.second
    assert (second is None) == (solved.opposite is None)
    if second is not None:
        x[-1] *= -1
        errors = equation_errors(second, solved.obstacle.body.solid, x, 0.004)
        assert max(errors.values()) < 1e-4, errors


@pytest.mark.parametrize("name", NAMES)
def test_fields_at_the_surface_are_those_of_the_state(name):
    """Tractions, displacement, rotation and the second body, at centres of cells away from edges of zones:
    the solver has a constant traction in a cell and the fields a linear one, which differ by 1e-3; forgetting
    the moment of q, or its opposite on the second body, leaves 0.1.
    """
    solved = state(name)
    dim = solved.points.shape[1]
    inside = solved.closed == solved.closed.max()
    middle = solved.points[inside].mean(axis=0)
    near = np.argsort(np.abs(solved.points[inside] - middle).max(axis=1))
    numbers = np.flatnonzero(inside)[near[: inside.sum() // 3 : max(1, inside.sum() // 20)]]
    places = solved.points[numbers]
    at = solved.fields(*places.T)
    down = dim - 1
    close = 2e-3 * solved.pressure.max()
    assert -at.stress[down, down] == pytest.approx(solved.pressure[numbers], abs=close)
    shear = np.zeros((down, len(numbers)))
    if solved.shear is not None:
        shear = np.reshape(solved.shear_traction[numbers].T, (down, -1))
    assert at.stress[:down, down] == pytest.approx(shear, abs=close)
    lowered = at.u[down] + solved.displacement[numbers]
    assert np.ptp(lowered) < 2e-3 * np.ptp(solved.displacement)
    if solved.approach is not None:
        assert lowered == pytest.approx(0 * lowered, abs=2e-3 * np.abs(solved.displacement).max())
    moment = at.couple_stress[1] if dim == 2 else at.couple_stress[:2, 2]
    turned = at.psi if dim == 2 else at.psi[:2]
    for values, expected in ((moment, solved.micromoment), (turned, solved.psi)):
        assert values == pytest.approx(expected[numbers].T, abs=5e-3 * (np.abs(expected).max() or 1.0))
    if solved.opposite is not None:
        above = solved.fields.second(*places.T).u[down] - solved.opposite[numbers]
        assert np.ptp(above) < 3e-3 * np.ptp(solved.opposite)
    with pytest.raises(mb.BadArgument, match="must not be above the surface"):
        solved.fields(*[0.0] * down, 0.1)


@pytest.mark.parametrize("name", ["cells", "friction", "friction on panels"])
def test_forces_and_moments_on_a_half_circle_balance_the_loads(name):
    """Force (Q, -P), and the moment of pressures, of M and of couple stresses about the origin; forces of
    cells are at their centres but for their slopes.
    """
    solved = state(name)
    points, weights = np.polynomial.legendre.leggauss(40)
    angle = np.pi * (points - 1) / 2
    r = 1.2
    normal = np.array((np.cos(angle), np.sin(angle)))
    at = solved.fields(*(r * normal))
    traction = np.einsum("ijn,jn->in", at.stress, normal)
    length = r * weights * np.pi / 2
    shear = 0.0 if solved.shear is None else solved.shear
    assert traction @ length == pytest.approx((-shear, solved.load), abs=1e-6)
    moment = r * (normal[0] * traction[1] - normal[1] * traction[0])
    moment += np.einsum("jn,jn->n", at.couple_stress, normal)
    applied = solved.weights @ (solved.micromoment - solved.x * solved.pressure)
    assert moment @ length + applied == pytest.approx(0, abs=3e-4)


@pytest.mark.parametrize("name", ["space", *NAMES[-2:]])
def test_forces_and_moments_on_a_half_sphere_balance_the_loads(name):
    solved = state(name)
    points, weights = np.polynomial.legendre.leggauss(16)
    cosine = (points - 1) / 2
    turn = 2 * np.pi * np.arange(32) / 32
    c, phi = (part.ravel() for part in np.meshgrid(cosine, turn))
    normal = np.array((np.sqrt(1 - c**2) * np.cos(phi), np.sqrt(1 - c**2) * np.sin(phi), c))
    r = 1.0
    at = solved.fields(*(r * normal))
    area = r**2 * np.tile(weights / 2, 32) * 2 * np.pi / 32
    traction = np.einsum("ijn,jn->in", at.stress, normal)
    shear = np.zeros((len(solved.points), 2)) if solved.shear is None else solved.shear_traction
    assert traction @ area == pytest.approx((*-(solved.weights @ shear), solved.load), abs=1e-4)
    moment = np.cross(r * normal.T, traction.T).T + np.einsum("ijn,jn->in", at.couple_stress, normal)
    forces = np.column_stack((shear, -solved.pressure))
    moments = np.cross(solved.points, forces)
    moments[:, :2] += solved.micromoment
    assert moment @ area + solved.weights @ moments == pytest.approx(np.zeros(3), abs=1e-4)


def test_a_line_of_squares_is_a_half_plane():
    """Loads that vary along x1 alone on a period, p, q1 and M2, against the plane's; M = -M2."""
    count, period = 32, 2.0
    grid = Grid(count, period / count, (0.0, 0.0))
    x = grid.axes[0]
    p, q, M = np.exp(-4 * x**2), 0.3 * x * np.exp(-4 * x**2), 0.05 * np.exp(-3 * (x - 0.1) ** 2)
    edges = x - grid.width / 2, x + grid.width / 2
    plane = HalfPlaneBelow(
        SOLID, False, [cell_loads(*edges, np.array((p, -M, q)), np.ones(count, bool), period)], period
    )
    means = np.array((p, q, 0 * x, 0 * x, M))[:, :, None] * np.ones(count)
    space = HalfSpaceBelow(SOLID, False, square_loads(grid, means, True), period)
    x1, x3 = np.array((0.1, 0.4, 0.1, -0.7)), np.array((-0.1, -0.3, -0.8, -0.2))
    flat, solid = plane(x1, x3), space(x1, 0.3, x3)
    two = np.ix_((0, 2), (0, 2))
    close = dict(abs=3e-5)  # of the quadrature of cells
    assert solid.stress[two] == pytest.approx(flat.stress, **close)
    assert solid.stress[1, 1] == pytest.approx(flat.s33, **close)
    assert -solid.psi[1] == pytest.approx(flat.psi, **close)
    assert solid.u[[0, 2]] == pytest.approx(flat.u, **close)
    assert -solid.couple_stress[1, [0, 2]] == pytest.approx(flat.couple_stress, **close)


def rectangle(x1, x2, x3, a, nu):
    """Stresses s33, s13 and s11 + s22 of Love (Phil. Trans. A 228 (1929) 377) under the pressure 1 on |x1|,
    |x2| < a, sums over the corners.
    """
    total = np.zeros((3, *np.shape(x3)))
    for sign1 in (-1, 1):
        for sign2 in (-1, 1):
            m, n, z = a + sign1 * x1, a + sign2 * x2, -x3
            r = np.sqrt(m**2 + n**2 + z**2)
            cube = np.arctan(m * n / (z * r))
            s33 = cube + m * n * z / r * (1 / (m**2 + z**2) + 1 / (n**2 + z**2))
            s13 = -sign1 * z**2 * n / ((m**2 + z**2) * r)
            total += np.array((-s33, s13, -2 * (1 + nu) * cube + s33)) / (2 * np.pi)
    return total


def test_below_a_square_under_pressure_stresses_are_those_of_love():
    """Cells of 1/16, and beside an edge; the quadrature of cells leaves 2e-5."""
    grid = Grid(16, 0.1, (0.0, 0.0))
    means = np.zeros((5, 16, 16))
    means[0] = 1.0
    below = HalfSpaceBelow(CLASSICAL.with_length(0.3), False, square_loads(grid, means, False))
    x3 = -np.array((0.002, 0.05, 0.2, 1.0, 3.0))
    for x1, x2 in ((0.0, 0.0), (0.33, -0.51), (0.79, 0.2), (1.3, 0.9)):
        at = below(x1, x2, x3)
        expected = rectangle(x1, x2, x3, 0.8, CLASSICAL.nu)
        assert at.stress[2, 2] == pytest.approx(expected[0], abs=4e-5)
        assert at.stress[0, 2] == pytest.approx(expected[1], abs=4e-5)
        assert at.stress[0, 0] + at.stress[1, 1] == pytest.approx(expected[2], abs=4e-5)


def test_on_the_axis_below_a_sphere_stresses_are_those_of_hertz():
    """Johnson, Contact Mechanics, (3.45), on 64 cells a side, whose pressures are off by 1e-3."""
    solved = mb.Contact(mb.HalfSpace(CLASSICAL), SPHERE, mb.Unilateral(), mb.Cells(nodes=64)).solve(load=1.0)
    E_star = CLASSICAL.E_star
    a = (3 * 10 / (4 * E_star)) ** (1 / 3)
    p0 = 3 / (2 * np.pi * a**2)
    z = np.array((1e-6, 0.1, 0.25, 0.48, 0.7, 1.0, 2.0, 4.0))
    at = solved.fields(0.0, 0.0, -a * z)
    s33 = -1 / (1 + z**2)
    s11 = -(1 + CLASSICAL.nu) * (1 - z * np.arctan(1 / z)) - s33 / 2
    assert at.stress[2, 2] / p0 == pytest.approx(s33, abs=1e-3)
    assert at.stress[0, 0] / p0 == pytest.approx(s11, abs=1e-3)
    assert at.max_shear / p0 == pytest.approx(np.abs(s33 - s11) / 2, abs=1e-3)
    peak = solved.peak("max_shear")
    assert peak.value / p0 == pytest.approx(0.31, abs=1e-3)
    assert peak.place == pytest.approx((0, 0, -0.481 * a), abs=1e-3)


def mcewen(x1, x2, a, p0):
    """Stresses s11, s22 and s12 below a cylinder (Johnson, Contact Mechanics, (4.49))."""
    z = -x2
    sum_, product = a**2 - x1**2 + z**2, 4 * x1**2 * z**2
    root = np.sqrt(sum_**2 + product)
    m = np.sqrt((root + sum_) / 2)
    n = np.sign(x1) * np.sqrt((root - sum_) / 2)
    s11 = -p0 / a * (m * (1 + (z**2 + n**2) / (m**2 + n**2)) - 2 * z)
    s22 = -p0 / a * m * (1 - (z**2 + n**2) / (m**2 + n**2))
    return s11, s22, p0 / a * n * (m**2 - z**2) / (m**2 + n**2)


@pytest.mark.parametrize("method, close", [(mb.Panels(), 1e-6), (mb.Cells(nodes=2048), 1e-4)])
def test_below_a_cylinder_stresses_are_those_of_mcewen(method, close):
    """0.3003 p0 at 0.786 a is the largest shear stress, 3 digits of the textbooks."""
    solved = mb.Contact(mb.HalfPlane(CLASSICAL), CYLINDER, mb.Unilateral(), method).solve(load=1.0)
    a, p0 = mb.hertz_scales(CLASSICAL, R=10, P=1.0)
    x1, x2 = a * np.array((0.1, 0.5, 1.0, 2.0)), -a * np.array((0.2, 0.786, 0.4, 1.5))
    at = solved.fields(x1, x2)
    stresses = np.array((at.stress[0, 0], at.stress[1, 1], at.stress[0, 1]))
    assert stresses == pytest.approx(np.array(mcewen(x1, x2, a, p0)), abs=close * p0)
    peak = solved.peak("max_shear")
    assert peak.value / p0 == pytest.approx(0.30028, abs=2e-5)
    assert peak.place == pytest.approx((0, -0.7862 * a), abs=1e-3 * a) and peak.resolved
    assert solved.peak("pressure").value == pytest.approx(p0, rel=1e-4)


def test_full_sliding_has_the_tension_of_the_trailing_edge():
    """2 f p0 of q = f p at the edge of a classical contact between equal bodies (Johnson, 7.1); the search
    ends 1e-6 of the contact below a cusp, which is 3e-3 there.
    """
    equal = mb.Deformable(mb.HalfPlane(CLASSICAL), CYLINDER)
    slid = rubbed(mb.HalfPlane(CLASSICAL), equal, mb.Unilateral(friction=0.3), (1.0, 0.3), rtol=1e-4)
    pressure = slid.peak("pressure").value
    peak = slid.peak("tension")
    edge = -slid.half_width
    assert peak.value == pytest.approx(0.6 * pressure, rel=1e-2)
    assert peak.place == pytest.approx((edge, 0.0), abs=2e-3)


def test_a_peak_knows_no_unit_of_length():
    """In units in which cells are 1e7 long; an area taken for a length began the search far too deep."""
    values = []
    for unit in (1.0, 1e9):
        sphere = mb.Contact(
            mb.HalfSpace(CLASSICAL), mb.Sphere(R=10 * unit), mb.Unilateral(), mb.Cells(nodes=32)
        )
        peak = sphere.solve(load=unit**2).peak("von_mises")
        assert peak.resolved
        values.append(peak.value)
    assert values[1] == pytest.approx(values[0], rel=1e-6)  # a search ends within 1e-5 of a flat maximum


@pytest.mark.nightly
def test_a_peak_below_the_tip_of_a_cone_is_not_resolved_by_cells():
    """It has no bound, and cells round it off: twice as many find some 7 % more, a cell below the surface."""
    tip = mb.Obstacle(lambda x1, x2: 0.1 * np.hypot(x1, x2))
    cone = mb.Contact(mb.HalfSpace(CLASSICAL), tip, mb.Unilateral())
    peaks = [cone.with_(method=mb.Cells(nodes=n)).solve(load=1.0).peak("von_mises") for n in (32, 64)]
    assert peaks[1].value > 1.05 * peaks[0].value
    assert not any(peak.resolved for peak in peaks)


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()])
@pytest.mark.parametrize("nodes", [64, 65])
def test_cells_do_not_resolve_the_pressure_below_a_tip(law, nodes):
    """It has no bound, and cells, of which an edge or a centre lies below the tip, do not know its jump where
    nobody names its place. With blocks it acts at the corners. Below a cylinder they find the largest
    pressure.
    """
    tip = mb.Obstacle(lambda x: 0.1 * np.abs(x))
    assert not pressed(LINE, tip, law, nodes).peak("pressure").resolved
    with pytest.raises(mb.BadArgument, match="has no bound there"):
        pressed(LINE, mb.Obstacle(tip.height, kinks=(0.0,)), law, nodes).peak("pressure")
    assert pressed(LINE, CYLINDER, law, nodes).peak("pressure").resolved


def test_cells_do_not_resolve_the_pressure_below_a_cone():
    tip = mb.Obstacle(lambda x1, x2: 0.1 * np.hypot(x1, x2))
    assert not pressed(SPACE, tip, mb.Unilateral(), 32).peak("pressure").resolved
    assert pressed(SPACE, mb.Sphere(R=10), mb.Unilateral(), 32).peak("pressure").resolved


def test_a_peak_at_the_surface_of_cells_is_not_resolved():
    """The tension beside the contact of blocks is at the surface: panels find twice that below cells."""
    on_cells = pressed(LINE, CYLINDER, mb.Microblock(), 256).peak("tension")
    on_panels = mb.Contact(LINE, CYLINDER, mb.Microblock()).solve(load=1.0).peak("tension")
    assert not on_cells.resolved and on_panels.resolved
    assert on_panels.value > 1.5 * on_cells.value


def test_equivalent_stresses_of_the_symmetric_part():
    """Principal stresses of a rotated diagonal tensor, and of it with a skew part, which changes nothing."""
    rng = np.random.default_rng(3)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    stress = rotation @ np.diag((3.0, -1.0, -4.0)) @ rotation.T
    skew = rng.normal(size=(3, 3))
    one = np.zeros((3, 1))
    for tensor in (stress, stress + skew - skew.T):
        at = SpaceFields(*one, one, one, tensor[..., None], tensor[..., None])
        assert at.principal[:, 0] == pytest.approx((3, -1, -4))
        assert (at.max_shear[0], at.von_mises[0]) == pytest.approx((3.5, np.sqrt((16 + 9 + 49) / 2)))
    plane = np.array(((1.0, 2.0), (0.0, -1.0)))[..., None]
    at = PointFields(*np.zeros((3, 1)), one[:2], plane, one[:2], np.array([-5.0]))
    root = np.sqrt(2)  # of ((1, 1), (1, -1))
    assert at.principal[:, 0] == pytest.approx((root, -root, -5))
    assert at.max_shear[0] == pytest.approx((root + 5) / 2)
    assert at.shear[0] == pytest.approx(root + 1)


def test_a_peak_without_a_bound_or_of_another_name_is_refused():
    wedge = mb.Contact(LINE, mb.Wedge(0.05), mb.Microblock()).solve(load=1.0)
    punch = mb.Contact(LINE, mb.Punch(0.3), mb.Unilateral()).solve(load=1.0)
    flat = pressed(SPACE, mb.FlatPunch(0.3), mb.Unilateral(), 32)
    for solved, quantity in (
        (wedge, "pressure"),
        (wedge, "max_shear"),
        (punch, "tension"),
        (flat, "pressure"),
    ):
        with pytest.raises(mb.BadArgument, match="has no bound"):
            solved.peak(quantity)
    with pytest.raises(mb.BadArgument, match="must be one of pressure, von_mises"):
        wedge.peak("stress")


def test_the_peak_below_two_rollers_is_that_of_the_stiffer_one():
    """No point of a fine grid has more; the softer roller carries more, but with a smaller pressure."""

    def height(x):
        return np.minimum((x + 0.6) ** 2 / 20, (x - 0.7) ** 2 / 2 + 0.004)

    obstacle = mb.Obstacle(height, kinks=(0.1,))
    solved = mb.Contact(mb.HalfPlane(CLASSICAL), obstacle, mb.Unilateral(), mb.Cells(nodes=1024)).solve(
        load=1.5
    )
    assert len(solved.zones["contact"]) == 2
    peak = solved.peak("von_mises")
    x1, x2 = np.linspace(-1.1, 0.9, 101), -np.linspace(0.02, 0.5, 49)[:, None]
    grid = solved.fields(x1, x2).von_mises
    assert peak.value > grid.max()
    place = np.unravel_index(grid.argmax(), grid.shape)
    assert peak.place == pytest.approx((x1[place[1]], x2[place[0], 0]), abs=0.02)
    assert peak.place[0] > 0.6


def test_cells_have_the_fields_of_panels_down_to_their_width():
    """Under blocks, at depths of half a cell and more; pressures of 1024 cells are off by 1e-5 to 1e-4."""
    on_panels = mb.Contact(LINE, CYLINDER, mb.Microblock()).solve(load=1.0, rtol=1e-6)
    on_cells = pressed(LINE, CYLINDER, mb.Microblock(), 1024)
    x1 = np.linspace(-0.5, 0.5, 7)
    for depth, close in ((on_cells.weights[0] / 2, 2e-3), (0.01, 2e-4), (0.2, 1e-5)):
        expected, at = (solved.fields(x1, -depth) for solved in (on_panels, on_cells))
        for name in ("psi", "stress", "couple_stress"):
            exact = getattr(expected, name)
            assert getattr(at, name) == pytest.approx(exact, abs=close * np.abs(exact).max()), (depth, name)


@pytest.mark.parametrize("k", [0, 1, *(pytest.param(k, marks=pytest.mark.nightly) for k in range(2, 20))])
def test_fields_are_those_of_finite_elements(k):
    """200 points in 20 states: 2e-3 on a line, 3e-2 in space; panels and cells here, those in space take
    half a minute.
    """
    row = judging.outcome(fields_below.case(k), seconds=200)
    assert row["class"] == "right", row


@pytest.mark.parametrize("name", ["period", "friction on panels", "second half-space"])
@pytest.mark.parametrize("field", ["von_mises", "psi"])
def test_pictures_begin_at_the_surface(name, field):
    solved = state(name)
    axis = solved.plot_below(field).axes[0]
    low, high = axis.get_ylim()
    assert low < -0.3 and high > 0
    if not solved.flat:
        assert axis.get_ylabel() == "$x_3$ (length)"
        with pytest.raises(mb.BadArgument, match="is the plane of a cut"):
            state("cells").plot_below(x2=0.0)
