"""The layers: the fit (51) and where it is not determined, the micropolar mode, meshes beside modes."""

import numpy as np
import pytest

from cases import layers as script
from cases.commands import layers

FITTED = "L_bl_over_ell", "L_bl_error", "L_sol", "A_bl", "A_sol"


@pytest.fixture(scope="module")
def result():
    return layers.solve()


def test_number_or_null_with_its_reason(result):
    for row in result["layers"]:
        lost = {name for name in FITTED if row[name] is None}
        assert lost in (set(), {"L_sol", "A_sol"}, set(FITTED)) and (row["reason"] is None) == (not lost)
        assert (
            len(lost) == 5 or row["L_bl_error"] <= 0.1 * row["L_bl_over_ell"] and row["fit_residual"] <= 0.02
        )


def test_layers_are_as_thick_as_ell(result):
    """Fig. 13: L_bl/ell is close to 1 below full contact, the closer the smaller alpha."""
    for alpha, within in ((0.01, 0.005), (0.02, 0.02), (0.05, 0.05)):
        rows = [row for row in result["layers"] if row["alpha"] == alpha and row["x1"] <= 0.8 - alpha]
        assert [row["L_bl_over_ell"] for row in rows] == pytest.approx([1.0] * len(rows), abs=within)


@pytest.mark.parametrize("beta", [0.5, 1.5])
def test_mode_length_tends_to_that_of_the_thick_strip(beta):
    """ell/sqrt(beta) of (49); the difference is of the order of alpha^2 times the change along x1."""
    thick, thin = (
        script.profiles(alpha, (0.2, 0.5), beta=beta, x2=[0.0])[3] / alpha - beta**-0.5
        for alpha in (0.04, 0.01)
    )
    assert np.all(np.abs(thin) < 1e-3) and np.all(np.abs(thin) < 0.25 * np.abs(thick))


@pytest.mark.parametrize("L_bl, L_sol, A_bl, A_sol", [(1.1, 0.4, -0.03, 0.01), (1.2, 1.5, 1e-3, 1e-6)])
def test_fit_recovers_bi_exponentials(L_bl, L_sol, A_bl, A_sol):
    x2 = script.depths(0.05)
    row = script.layer(x2, A_bl * np.exp(x2 / (L_bl * 0.05)) + A_sol * np.exp(x2 / L_sol), 0.05)
    # an amplitude of 1e-3 of the other has a length with a thousand times the tolerance of the search
    assert [row[name] for name in FITTED if "error" not in name] == pytest.approx(
        [L_bl, L_sol, A_bl, A_sol], rel=1e-4
    )


@pytest.mark.parametrize(
    "shape, reason, lost",
    [
        (lambda y: np.exp(y), "L_sol and A_sol move", ("L_sol", "A_sol")),
        (lambda y: (1 + y) * np.exp(y), "cannot be distinguished", FITTED),  # a double root
        (lambda y: np.cos(3 * y) * np.exp(y / 3), "residual", FITTED),  # no decay
        (lambda y: np.exp(y) + 0.3 * np.exp(-((y + 8) ** 2)), "", FITTED),  # a bump at 8 ell
    ],
)
def test_null_where_the_fit_is_not_determined(shape, reason, lost):
    x2 = script.depths(0.1)
    row = script.layer(x2, shape(x2 / 0.1), 0.1)
    assert reason in row["reason"] and tuple(name for name in FITTED if row[name] is None) == lost


@pytest.mark.parametrize("alpha, x1, nu, beta", [
    (0.2, 0.9, 0.3, 1.0), (0.5, 0.1, 0.3, 1.0), (0.5, 0.5, 0.3, 1.0), (0.02, 0.95, 0.3, 0.5),
])  # fmt: skip
def test_a_length_that_depends_on_the_depths_is_null(alpha, x1, nu, beta):
    """In some of the windows the best fit has a weak part with a fraction of the length of the other one."""
    x2, microblock, unilateral, _ = script.profiles(alpha, (x1,), nu, beta)
    row = script.layer(x2, (microblock - unilateral)[0], alpha)
    assert row["L_bl_over_ell"] is None and row["reason"].startswith("L_bl moves")


def test_meshes_agree_with_the_modes(monkeypatch):
    """Finite elements know of no modes; coarser ones than those of the command."""
    monkeypatch.setattr(layers, "RTOLS", (1e-3, 1e-4))
    (row,), (exact,) = (layers.solve((0.05,), (0.3,), model=model)["layers"] for model in ("fe", "halfplane"))
    assert abs(row["mode_length_over_ell"] - exact["mode_length_over_ell"]) <= row["mode_length_error"] < 0.01
    # nearly all of the error of the fit is common to both
    assert abs(row["L_bl_over_ell"] - exact["L_bl_over_ell"]) <= row["L_bl_error"] - 0.9 * exact["L_bl_error"]
