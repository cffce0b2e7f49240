"""The closed form of the strip, itself verified: equilibrium, boundary conditions, continuity, lengths."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cases.closed_forms import Strip

CASES = [
    Strip(ell=ell, psi0=psi0, nu=nu, beta=beta, delta=0.0, curvature=curvature)
    for ell, psi0, nu, beta, curvature in (
        (0.5, 0.0175, 0.3, 1.0, 2.0),
        (0.05, -0.05, 0.49, 1.99, 2.0),
        (5.0, 0.01, 0.0, 0.01, 2.0),
        (0.2, 0.03, 0.3, 1.0, 1.0),
    )
]


@pytest.mark.parametrize(
    "strip", [replace(case, delta=share * case.delta_fc) for case in CASES for share in (0.3, 1.7)]
)
def test_the_strip_is_in_equilibrium_and_keeps_its_boundary_conditions(strip):
    """(16) and (17) over mu by central differences: a step h leaves (k h)^2 = 1e-8, a second one h' 1e-6 and
    rounding of some 1e-16/(k h')^2. Gaps (42), (43) are of the corner in touch and of the lagging one.
    """

    def slope(field, x2, step=1e-4 / max(1, strip.k)):
        return (field(x2 + step) - field(x2 - step)) / (2 * step)

    def m2(x2):
        return strip.curvature * strip.ell**2 * slope(strip.psi, x2)

    x2, eta = np.linspace(0.1, 0.9, 9), strip.beta / (2 - strip.beta)
    shear, spin = slope(strip.u1, x2), strip.psi(x2) + slope(strip.u1, x2) / 2
    size = np.abs(shear - 2 * eta * spin).max()
    assert shear + 2 * eta * spin == pytest.approx(0, abs=1e-6 * size)
    assert strip.oedometric * slope(strip.u2, x2) == pytest.approx(strip.traction, rel=1e-8)
    assert slope(m2, x2, 1e-3 / max(1, strip.k)) - 4 * eta * spin == pytest.approx(0, abs=1e-5 * size)
    assert strip.u1(0.0) == strip.u2(0.0) == 0
    assert m2(1.0) == pytest.approx(strip.micromoment, rel=1e-6)
    sign, tilt = math.copysign(1, strip.psi0), abs(strip.psi0)
    turn, half = sign * strip.psi(1.0), strip.ell / 2
    near = -strip.delta - (strip.u2(1.0) + half * (1 - tilt) * turn)
    far = strip.ell * tilt - strip.delta - (strip.u2(1.0) - half * (1 + tilt) * turn)
    alone = sign * strip.micromoment - half * (1 - tilt) * strip.traction  # (45)
    assert near == pytest.approx(0, abs=1e-15)
    if strip.delta >= strip.delta_fc:
        assert (far, turn) == pytest.approx((0, -tilt), abs=1e-15)
    else:
        assert far > 0 and alone == pytest.approx(0, abs=1e-13 * abs(strip.micromoment))


@pytest.mark.parametrize("strip", CASES)
def test_the_strip_is_continuous_at_full_contact_and_at_rest_before(strip):
    """A step of 1e-13 changes fields by their slope times that; layer lengths are field over slope, positive,
    so that (49) contradicts the minus sign of (48) unless x2 is measured downwards.
    """
    below, above = (replace(strip, delta=strip.delta_fc * (1 + shift)) for shift in (-1e-13, 0))
    assert (strip.state, below.state, above.state) == ("separation", "partial", "full")
    assert strip.psi(1.0) == strip.u1(1.0) == strip.traction == strip.micromoment == 0
    for name in ("rotation", "traction", "micromoment"):
        assert getattr(below, name) == pytest.approx(getattr(above, name), rel=1e-11)
    step = 1e-5 * min(1, above.L_psi)
    for field, length in ((above.psi, above.L_psi), (above.u1, above.L_u)):
        slope = (field(1 + step) - field(1 - step)) / (2 * step)
        assert field(1.0) / slope == pytest.approx(length, rel=1e-6)


def test_the_papers_formula_47():
    """Of nu = 0.3, lambda = 1.5 mu."""
    ell, psi0, beta, lam_2mu = 0.5, np.radians(1), 1.0, 3.5
    tanh = math.tanh(math.sqrt(beta) / ell)
    printed = psi0 / 2 * (ell * (1 - psi0) + 8 * math.sqrt(beta) * tanh / (lam_2mu * (1 - psi0)))
    assert Strip(ell, psi0, 0.3, beta, 0.0).delta_fc == pytest.approx(printed, rel=1e-14)
