"""The closed form of the strip, itself verified: equilibrium, boundary conditions, continuity."""

import math
from dataclasses import replace

import numpy as np
import pytest

from microblock.model.closed_forms import Strip

CASES = [
    Strip(ell=ell, psi0=psi0, nu=nu, beta=beta, delta=0.0, curvature=curvature)
    for ell, psi0, nu, beta, curvature in (
        (0.5, 0.0175, 0.3, 1.0, 2.0),
        (0.05, -0.05, 0.49, 1.99, 2.0),
        (5.0, 0.01, 0.0, 0.01, 2.0),
        (0.2, 0.03, 0.3, 1.0, 1.0),
    )
]
BRANCHES = (0.3, 1.0, 1.7)  # delta over delta_fc


def branches():
    return [replace(case, delta=share * case.delta_fc) for case in CASES for share in BRANCHES]


def stresses(strip, x2):
    """sigma_12, sigma_21, sigma_22 over mu and m_2 over mu H by (16), (17) with central differences."""
    step = 1e-4 / max(1, strip.k)

    def slope(field):
        return (field(x2 + step) - field(x2 - step)) / (2 * step)

    eta = strip.beta / (2 - strip.beta)
    u1, psi = slope(strip.u1), strip.psi(x2)
    shear, skew = u1, 2 * eta * (u1 / 2 + psi)
    m2 = strip.curvature * strip.ell**2 * slope(strip.psi)
    return shear + skew, shear - skew, strip.oedometric * slope(strip.u2), m2


@pytest.mark.parametrize("strip", branches())
def test_equilibrium(strip):
    x2, step = np.linspace(0.1, 0.9, 9), 1e-3 / max(1, strip.k)
    (s12, s21, s22, _), above, below = (stresses(strip, x2 + shift) for shift in (0, step, -step))
    size = np.abs(s21).max()
    # central differences of step h leave (k h)^2 = 1e-6 and rounding of some 1e-16/(k h)^2
    assert s12 == pytest.approx(0, abs=1e-6 * size)
    assert s22 == pytest.approx(strip.traction, rel=1e-8)
    couple = (above[3] - below[3]) / (2 * step)
    assert couple - (s12 - s21) == pytest.approx(0, abs=1e-5 * size)


@pytest.mark.parametrize("strip", branches())
def test_boundary_conditions(strip):
    assert strip.u1(0.0) == 0 and strip.u2(0.0) == 0
    s12, _, s22, m2 = stresses(strip, 1.0)
    assert m2 == pytest.approx(strip.micromoment, rel=1e-6)  # (k h)^2 of the difference is 1e-8
    assert s22 == pytest.approx(strip.traction, rel=1e-8)
    # corner gaps (42), (43), written for the corner in touch ("near") and the lagging one, by mirror symmetry
    sign = math.copysign(1, strip.psi0)
    turn, tilt = sign * strip.psi(1.0), abs(strip.psi0)
    near = -strip.delta - (strip.u2(1.0) + strip.ell / 2 * (1 - tilt) * turn)
    far = strip.ell * tilt - strip.delta - (strip.u2(1.0) - strip.ell / 2 * (1 + tilt) * turn)
    assert near == pytest.approx(0, abs=1e-15)
    if strip.delta >= strip.delta_fc:
        assert far == pytest.approx(0, abs=1e-15)
        assert turn == pytest.approx(-tilt, rel=1e-15)
    else:
        assert far > 0
        # (45)
        assert sign * strip.micromoment == pytest.approx(
            strip.ell / 2 * (1 - tilt) * strip.traction, rel=1e-14
        )


@pytest.mark.parametrize("strip", CASES)
def test_continuous_at_full_contact(strip):
    below, above = (replace(strip, delta=strip.delta_fc * (1 + shift)) for shift in (-1e-13, 0))
    assert (below.state, above.state) == ("partial", "full")
    for name in ("rotation", "traction", "micromoment"):
        # the slope times 1e-13
        assert getattr(below, name) == pytest.approx(getattr(above, name), rel=1e-11)


@pytest.mark.parametrize("strip", CASES)
def test_unloaded(strip):
    assert strip.state == "separation"
    assert strip.psi(1.0) == strip.u1(1.0) == strip.u2(1.0) == strip.traction == strip.micromoment == 0


def test_mirror_image():
    strip = replace(CASES[0], delta=0.02)
    mirror = replace(strip, psi0=-strip.psi0)
    assert (mirror.psi(0.7), mirror.u1(0.7), mirror.u2(0.7)) == (
        -strip.psi(0.7),
        -strip.u1(0.7),
        strip.u2(0.7),
    )
    assert (mirror.delta_fc, mirror.micromoment) == (strip.delta_fc, -strip.micromoment)


def test_the_papers_formula_47():
    ell, psi0, beta, lam_2mu = 0.5, np.radians(1), 1.0, 3.5  # nu = 0.3: lambda = 1.5 mu
    tanh = math.tanh(math.sqrt(beta) / ell)
    printed = psi0 / 2 * (ell * (1 - psi0) + 8 * math.sqrt(beta) * tanh / (lam_2mu * (1 - psi0)))
    assert Strip(ell, psi0, 0.3, beta, 0.0).delta_fc == pytest.approx(printed, rel=1e-14)


def test_layer_lengths_are_field_over_slope():
    strip = replace(CASES[0], delta=0.02)
    step = 1e-5
    for name in ("psi", "u1"):
        field = getattr(strip, name)
        slope = (field(1 + step) - field(1 - step)) / (2 * step)
        length = strip.L_psi if name == "psi" else strip.L_u
        # positive, so that (49) contradicts the minus sign of (48) unless x2 is measured downwards
        assert field(1.0) / slope == pytest.approx(length, rel=1e-8)


def test_curvature_coefficient_moves_the_layer_by_sqrt_2():
    thin = replace(CASES[0], ell=0.05)
    assert thin.L_psi / replace(thin, curvature=1.0).L_psi == pytest.approx(math.sqrt(2), rel=1e-12)


def test_thin_layers_do_not_overflow():
    strip = Strip(ell=1e-6, psi0=0.01, nu=0.3, beta=1.0, delta=0.02)
    assert strip.psi(1.0) == pytest.approx(-0.01) and strip.psi(0.0) == 0 and strip.u1(0.5) == 0
