"""Fields below the surface: the field equations by finite differences, the surface, far away, symmetry."""

import numpy as np
import pytest

import microblock as mb

LOAD = np.pi / 2  # in units a_Hz = p_Hz = R = 1


def state(law, alpha=0.2, nu=0.3, beta=1.0, curvature=2.0, rtol=1e-7):
    solid = mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta, curvature=curvature)
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=1.0), law).solve(load=LOAD, rtol=rtol)


STATES = {
    "microblock": lambda: state(mb.Microblock()),
    "unilateral": lambda: state(mb.Unilateral(), alpha=0.05),
    "clamped": lambda: state(mb.Microclamped(), beta=1.7),
    "rotated": lambda: state(mb.Microblock(psi0=0.02), alpha=0.3, nu=0.1, beta=0.5, curvature=1.3),
}


@pytest.fixture(scope="module", params=STATES)
def solved(request):
    return STATES[request.param]()


def surface_points(solved):
    """Points of the surface inside and outside the contact, off the edges of all zones by 0.01 or more."""
    x = np.linspace(-1.6, 1.6, 23) + 0.004
    edges = np.array([edge for intervals in solved.zones.values() for pair in intervals for edge in pair])
    return x[np.abs(x[:, None] - edges).min(axis=1) > 0.01]


def micromoment(solved, x):
    levers = solved.law.levers(x)
    return (
        solved.solid.ell / 2 * sum(lever * solved.pressure_at(x, corner) for corner, lever in levers.items())
    )


def test_field_equations_by_finite_differences(solved):
    """Strains to stresses by the material's own law, and equilibrium, at seeded points inside."""
    solid, rng = solved.solid, np.random.default_rng(7)
    x1, x2 = rng.uniform(-1.5, 1.5, 12), -rng.uniform(0.1, 1.5, 12)
    h = 0.02 * solid.ell
    steps = np.array((-2, -1, 1, 2)) * h
    centre = solved.fields(x1, x2)
    sideways = solved.fields((x1 + steps[:, None]).ravel(), np.tile(x2, 4))
    updown = solved.fields(np.tile(x1, 4), (x2 + steps[:, None]).ravel())

    def derivative(moved, name):  # of fourth order
        values = getattr(moved, name)
        values = values.reshape(*values.shape[:-1], 4, 12)
        return (values[..., 0, :] - 8 * values[..., 1, :] + 8 * values[..., 2, :] - values[..., 3, :]) / (
            12 * h
        )

    gradient = np.stack((derivative(sideways, "u"), derivative(updown, "u")), axis=1)
    kappa = np.stack((derivative(sideways, "psi"), derivative(updown, "psi")))
    # (h/L)^4/30 = 1e-8 of the fifth derivative, and noise of 1e-10 over h
    close = dict(rel=1e-5, abs=3e-6)
    assert centre.stress == pytest.approx(np.array(solid.stress(gradient, centre.psi)), **close)
    assert centre.couple_stress == pytest.approx(np.array(solid.couple_stress(kappa)), **close)
    sigma = derivative(sideways, "stress")[:, 0], derivative(updown, "stress")[:, 1]
    assert sum(sigma) == pytest.approx(np.zeros((2, 12)), abs=1e-5)
    divergence = derivative(sideways, "couple_stress")[0] + derivative(updown, "couple_stress")[1]
    assert divergence == pytest.approx(centre.stress[0, 1] - centre.stress[1, 0], **close)
    # the micropolar mode alone: theta = L^2 times its Laplacian shows in its slope; u of it is half its
    # rotated gradient
    assert derivative(updown, "theta") == pytest.approx(centre.theta_slope, **close)


def test_surface_conditions(solved):
    x = surface_points(solved)
    at = solved.fields(x, 0.0)
    # the state's pressure leaves out what remains at the edges: rtol
    assert at.stress[1, 1] == pytest.approx(-solved.pressure_at(x), abs=1e-6)
    assert at.stress[0, 1] == pytest.approx(np.zeros_like(x), abs=1e-7)
    assert at.psi == pytest.approx(solved.solution.rotation(x), abs=1e-7)
    assert at.x1 == pytest.approx(x)
    if not solved.law.clamps_rotation:
        assert at.couple_stress[1] == pytest.approx(micromoment(solved, x), abs=1e-7)


def test_clamped_reaction():
    solved = STATES["clamped"]()
    at = solved.fields(solved.x, 0.0)
    off = np.abs(solved.x) < 0.98 * solved.x.max()  # at the very edge skin and node differ by a square root
    assert at.couple_stress[1][off] == pytest.approx(solved.micromoment[off], abs=1e-6)


def test_displacement_is_that_of_the_obstacle_at_the_state_s_own_level():
    solved = STATES["unilateral"]()
    x = np.linspace(-0.9, 0.9, 7)
    assert solved.fields(x, 0.0).u[1] == pytest.approx(x**2 / 2 - solved.solution.approach, abs=1e-7)


def test_psi_is_x_over_R_in_full_contact_as_the_depth_goes_to_0():
    solved = state(mb.Microblock(), alpha=0.05)
    x = np.linspace(0.05, 0.85, 9)  # full contact to 0.89
    depth = 10.0 ** -np.arange(3, 8)
    misses = np.array([np.abs(solved.fields(x, -d).psi - x).max() for d in depth])
    assert np.all(misses < 3 * depth + 1e-8)  # psi,2 is about 1/R there
    assert np.all(np.diff(np.log(misses[:3])) < -2)  # linear in depth until rtol is left


@pytest.mark.parametrize("depth", [0.0, 1e-3, 0.3])
def test_twice_the_points_change_nothing(solved, depth):
    x = surface_points(solved)
    standard, double = (solved.fields(x, -depth, accuracy=points) for points in (10, 20))
    coarse = solved.fields(x, -depth, accuracy=4)
    for name in ("psi", "theta", "u", "stress", "couple_stress"):
        scale = np.abs(getattr(double, name)).max()
        # about 1e-8 is promised
        assert np.abs(getattr(standard, name) - getattr(double, name)).max() <= 2e-8 * scale + 1e-14, name
    # next to the surface the highest wavenumbers, of the order of 1/SKIN, carry rounding into the derivative
    size = np.abs(double.theta_slope).max()
    assert standard.theta_slope == pytest.approx(double.theta_slope, abs=1e-7 * size + 1e-12)
    # negative control: it is the points that do it
    assert np.abs(coarse.stress - double.stress).max() > 1e-7


@pytest.mark.parametrize(
    "alpha, beta, close",
    [
        (0.3, 1e-9, 1e-8),  # hardly any coupling: classical but for beta
        (0.01, 1.0, 5e-4),
    ],
)  # alpha -> 0: the size effect is of the order of alpha^2
def test_hertz_below_the_centre(alpha, beta, close):
    solved, depth = state(mb.Unilateral(), alpha=alpha, beta=beta, rtol=1e-8), np.linspace(0.05, 3, 20)
    below = solved.fields(0.0, -depth)
    root = np.sqrt(1 + depth**2)
    assert below.stress[1, 1] == pytest.approx(-1 / root, abs=close)
    assert below.stress[0, 0] == pytest.approx(-((1 + 2 * depth**2) / root - 2 * depth), abs=close)
    # a maximum is flat: its place is known to the root of what its value is
    value, x1, x2 = solved.fields.largest_shear()
    assert value == pytest.approx(0.3002831, abs=max(1e-7, close))
    assert (x1, x2) == pytest.approx((0, -0.78615), abs=1e-3)


def test_largest_shear_of_cosserat_stresses_is_over_all_planes():
    solved = STATES["microblock"]()
    at = solved.fields(0.7, -0.1)
    angle = np.linspace(0, np.pi, 20001)
    normal, tangent = np.array((np.cos(angle), np.sin(angle))), np.array((-np.sin(angle), np.cos(angle)))
    shear = np.einsum("in,ij,jn->n", tangent, at.stress, normal)
    assert at.shear == pytest.approx(np.abs(shear).max(), rel=1e-7)
    value, x1, x2 = solved.fields.largest_shear(rtol=1e-2)
    rng = np.random.default_rng(1)
    some = solved.fields(rng.uniform(-1.3, 1.3, 100), -(rng.uniform(0, 1.5, 100) ** 2))
    assert some.shear.max() <= value
    assert solved.fields(x1, x2).shear == pytest.approx(value, rel=1e-12)


def test_far_field_is_flamant_s():
    """A line load P: sigma_rr = -2 P cos(angle)/(pi r), u1 = -(1 - 2 nu) P/(4 mu) on the surface; the next
    terms are of (a/r)^2."""
    solved, r = STATES["microblock"](), 1000.0
    angle = np.radians((0.0, 30.0, -60.0, 80.0))
    direction = np.array((np.sin(angle), -np.cos(angle)))
    far = solved.fields(*(r * direction))
    expected = -2 * LOAD / (np.pi * r) * np.cos(angle) * direction[:, None] * direction
    assert far.stress == pytest.approx(expected, abs=1e-5 * LOAD / r)
    solid = solved.solid
    beside = solved.fields([-300.0, 300.0], 0.0)
    shift = (1 - 2 * solid.nu) * LOAD / (4 * solid.mu)
    assert beside.u[0] == pytest.approx([shift, -shift], rel=1e-4)
    sunk = -LOAD * (1 - solid.nu) / solid.mu * (-np.log(300 / solid.ell) / np.pi)  # the level of `Kernels`
    assert beside.u[1] == pytest.approx([sunk, sunk], abs=1e-4)


def test_symmetry():
    solved = state(mb.Microblock())
    x, depth = np.array((0.1, 0.6, 0.95, 1.2)), -np.array((0.2, 0.01, 0.05, 0.5))
    right, left = (solved.fields(sign * x, depth) for sign in (1, -1))
    rotated = [state(mb.Microblock(psi0=sign * 0.02)).fields(sign * x, depth) for sign in (1, -1)]
    for one, other in ((right, left), rotated):
        # the second pair are two solutions of their own, each to rtol = 1e-7
        assert other.psi == pytest.approx(-one.psi, abs=1e-6)
        assert other.u == pytest.approx(one.u * [[-1], [1]], abs=1e-6)
        assert other.stress == pytest.approx(one.stress * [[[1], [-1]], [[-1], [1]]], abs=1e-6)
        assert other.couple_stress == pytest.approx(one.couple_stress * [[1], [-1]], abs=1e-6)
