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
    monkeypatch.setattr(strip, "errors", lambda state: errors)
    np.testing.assert_equal(solved(psi0_deg=-1.5), full)
