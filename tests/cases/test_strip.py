"""The strip against its closed form over the whole range of the command, and the command itself."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from cases import strip as script
from cases.closed_forms import Strip
from cases.commands import strip


def sample():
    """Closed form and options, each once in each of 12 slices of its range, below, at and above delta_fc."""
    rng = np.random.default_rng(3)
    slices = (np.array([rng.permutation(12) for _ in range(4)]) + rng.random((4, 12))) / 12
    for (a, b, c, d), share in zip(slices.T, 2 * (0.0, 0.5, 1 - 1e-9, 1.0, 1.0, 2.0)):
        ell, psi0_deg, nu, beta = 0.05 * 100**a, 6 * b - 3, 0.49 * c, 0.01 + 1.98 * d
        exact = Strip(ell, math.radians(psi0_deg), nu, beta, 0.0)
        delta = share * exact.delta_fc
        yield (
            replace(exact, delta=delta),
            {"ell_over_H": ell, "psi0_deg": psi0_deg, "nu": nu, "beta": beta, "delta_over_H": delta},
        )


def solved(**options):
    """The JSON object of the command."""
    return strip.to_dict(strip.solve(**options))


@pytest.mark.parametrize("model", ["line", "column"])
@pytest.mark.parametrize("exact, options", list(sample()))
def test_closed_form(exact, options, model):
    entries = solved(**options, model=model)
    lengths = () if exact.state == "separation" else ("L_psi", "L_u")
    assert (entries["state"], entries["L_psi"] is None) == (exact.state, not lengths)
    # the default is rtol = 1e-9; surface values and forces carry ten times that
    expected = {
        **{name: getattr(exact, name) for name in ("traction", "micromoment", "delta_fc", *lengths)},
        **{f"{name}_surface": float(getattr(exact, name)(1.0)) for name in ("psi", "u1", "u2")},
    }
    assert {name: entries[name] for name in expected} == pytest.approx(expected, rel=1e-8, abs=1e-16)
    assert max(entries["error_psi"], entries["error_u"]) <= 1e-9


@pytest.mark.parametrize("thickness", [0.1, 3.0, 20.0])
@pytest.mark.parametrize("beta", [0.1, 1.9])
def test_layer_lengths_49(thickness, beta):
    entries = solved(ell_over_H=math.sqrt(beta) / thickness, beta=beta, rtol=1e-9)
    lengths = np.array([entries["L_psi"], entries["L_u"]]) * thickness  # over ell/sqrt(beta)
    assert lengths == pytest.approx([1 / math.tanh(thickness), math.tanh(thickness)], rel=1e-9)


def test_penalty_error_falls_like_one_over_rho():
    entries = [solved(method="penalty", rho=rho) for rho in (1e3, 1e5)]
    assert entries[0]["error_psi"] / entries[1]["error_psi"] == pytest.approx(100, rel=0.05)  # up to 1/rho^2
    assert all(max(one["error_psi"], one["error_u"]) <= one["error_estimate"] for one in entries)


def test_blocks_that_are_aligned_or_nearly():
    """Corner gaps are differences of lengths as large as delta: their rounding is part of the estimate."""
    aligned, nearly = (solved(psi0_deg=angle, ell_over_H=0.05, delta_over_H=0.1) for angle in (0.0, -1e-8))
    assert (aligned["state"], aligned["delta_fc"], aligned["L_psi"]) == ("full", 0.0, None)
    assert nearly["error_psi"] <= nearly["error_estimate"] and "1e-09 was not" in nearly["warnings"][0]


def test_script_finds_layers_and_full_contact():
    states = script.solve(order=12)
    exact = script.closed_form(states[0])
    # order 12 on four elements has all digits but those of rounding
    assert (*script.lengths(states[0]), script.full_contact(states[0].problem)) == pytest.approx(
        (exact.L_psi, exact.L_u, exact.delta_fc), rel=1e-9
    )


def test_the_closed_form_is_nowhere_in_the_computation(monkeypatch):
    """The same numbers without the module, but for the errors against it."""
    full = solved(psi0_deg=-1.5)
    errors = {name: full[name] for name in ("error_psi", "error_u", "error_psi_paper")}
    monkeypatch.setitem(sys.modules, "cases.closed_forms", None)
    monkeypatch.setattr("cases.strip.errors", lambda state: errors)
    np.testing.assert_equal(solved(psi0_deg=-1.5), full)


# --- the closed form of the strip, itself verified: equilibrium, boundary conditions, continuity, lengths


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
