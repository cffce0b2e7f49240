"""Fields below the surface: the field equations by finite differences, the surface, Hertz, far away."""

import numpy as np
import pytest

import microblock as mb
from tests import closed_forms

LOAD = np.pi / 2  # in units a_Hz = p_Hz = R = 1


def state(law, alpha=0.2, nu=0.3, beta=1.0, curvature=2.0, rtol=1e-7):
    solid = mb.Cosserat(E=2 * (1 - nu**2), nu=nu, ell=alpha, beta=beta, curvature=curvature)
    return mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=1.0), law).solve(load=LOAD, rtol=rtol)


@pytest.fixture(
    scope="module",
    params=[
        dict(law=mb.Microblock()),
        dict(law=mb.Unilateral(), alpha=0.05),
        dict(law=mb.Microclamped(), beta=1.7),
        dict(law=mb.Microblock(psi0=0.02), alpha=0.3, nu=0.1, beta=0.5, curvature=1.3),
    ],
    ids=["microblock", "unilateral", "clamped", "rotated"],
)
def solved(request):
    return state(**request.param)


def test_field_equations_by_finite_differences(solved):
    """Strains to stresses by the material's own law, and equilibrium, at seeded points inside: (h/L)^4/30 =
    1e-8 of the fifth derivative, and noise of 1e-10 over h.
    """
    solid, rng, close = solved.solid, np.random.default_rng(7), dict(rel=1e-5, abs=1e-5)
    x1, x2 = rng.uniform(-1.5, 1.5, 12), -rng.uniform(0.1, 1.5, 12)
    h, centre = 0.02 * solid.ell, solved.fields(x1, x2)
    steps = np.array((-2, -1, 1, 2))[:, None] * h
    moved = [solved.fields((x1 + a * steps).ravel(), (x2 + b * steps).ravel()) for a, b in ((1, 0), (0, 1))]

    def slopes(name):  # along x1 and x2, of fourth order
        values = (getattr(one, name).reshape(*getattr(one, name).shape[:-1], 4, 12) for one in moved)
        return [np.einsum("...si,s->...i", each, (1, -8, 8, -1)) / (12 * h) for each in values]

    gradient, (s1, s2), (m1, m2) = (slopes(name) for name in ("u", "stress", "couple_stress"))
    stress = np.array(closed_forms.stress(solid, np.stack(gradient, axis=1), centre.psi))
    assert centre.stress == pytest.approx(stress, **close)
    assert centre.couple_stress == pytest.approx(
        np.array(closed_forms.couple_stress(solid, np.stack(slopes("psi")))), **close
    )
    assert s1[:, 0] + s2[:, 1] == pytest.approx(np.zeros((2, 12)), abs=1e-5)
    assert m1[0] + m2[1] == pytest.approx(centre.stress[0, 1] - centre.stress[1, 0], **close)
    assert slopes("theta")[1] == pytest.approx(centre.theta_slope, **close)


def test_the_surface_is_that_of_the_state_with_twice_the_points_as_well(solved):
    """Off the edges of all zones by 0.01: pressure, no shear, rotation and moment; 1e-8 is promised of the
    integrals, and it is the points that do it.
    """
    x = np.linspace(-1.6, 1.6, 23) + 0.004
    edges = np.array([edge for intervals in solved.zones.values() for pair in intervals for edge in pair])
    x = x[np.abs(x[:, None] - edges).min(axis=1) > 0.01]
    at, levers = solved.fields(x, 0.0), solved.law.levers(x)
    assert at.stress[1, 1] == pytest.approx(-solved.pressure_at(x), abs=1e-6)
    assert at.stress[0, 1] == pytest.approx(np.zeros_like(x), abs=1e-7)
    assert at.psi == pytest.approx(solved.solution.rotation(x), abs=1e-7)
    if solved.law.clamps_rotation:  # at the very edge skin and node differ by a square root
        inside = solved.x[np.abs(solved.x) < 0.98 * solved.x.max()]
        moment = np.interp(inside, solved.x, solved.micromoment)
        assert solved.fields(inside, 0.0).couple_stress[1] == pytest.approx(moment, abs=1e-6)
    else:
        moment = (
            sum(lever * solved.pressure_at(x, name) for name, lever in levers.items()) * solved.solid.ell / 2
        )
        assert at.couple_stress[1] == pytest.approx(moment, abs=1e-7)
    for depth in (0.0, 1e-3, 0.3):
        coarse, standard, double = (solved.fields(x, -depth, accuracy=points) for points in (4, 10, 20))
        for name in ("psi", "theta", "u", "stress", "couple_stress"):
            exact = getattr(double, name)
            assert np.abs(getattr(standard, name) - exact).max() <= 2e-8 * np.abs(exact).max() + 1e-14, name
        assert np.abs(coarse.stress - double.stress).max() > 1e-7


def test_the_shear_is_over_all_planes_and_the_far_field_is_flamants():
    """Cosserat stresses are not symmetric. A line load P: sigma_rr = -2 P cos(angle)/(pi r), u1 = -(1 - 2 nu)
    P/(4 mu) on the surface; the next terms are of (a/r)^2.
    """
    solved, r, angle = state(mb.Microblock()), 1000.0, np.linspace(0, np.pi, 20001)
    at, solid = solved.fields(0.7, -0.1), solved.solid
    normal, tangent = np.array((np.cos(angle), np.sin(angle))), np.array((-np.sin(angle), np.cos(angle)))
    assert at.shear == pytest.approx(
        np.abs(np.einsum("in,ij,jn->n", tangent, at.stress, normal)).max(), rel=1e-7
    )
    angle = np.radians((0.0, 30.0, -60.0, 80.0))
    direction = np.array((np.sin(angle), -np.cos(angle)))
    expected = -2 * LOAD / (np.pi * r) * np.cos(angle) * direction[:, None] * direction
    assert solved.fields(*(r * direction)).stress == pytest.approx(expected, abs=1e-5 * LOAD / r)
    beside, shift = solved.fields([-300.0, 300.0], 0.0), (1 - 2 * solid.nu) * LOAD / (4 * solid.mu)
    sunk = LOAD * (1 - solid.nu) / solid.mu * np.log(300 / solid.ell) / np.pi  # the level of `Kernels`
    assert beside.u == pytest.approx(np.array([[shift, -shift], [sunk, sunk]]), rel=1e-4)
