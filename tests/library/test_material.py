import dataclasses
import math

import numpy as np
import pytest

from microblock import Cosserat
from microblock.errors import Inadmissible

SOLID = Cosserat(E=100, nu=0.3, ell=0.2, beta=0.7, curvature=1.5)


def test_the_three_measures_of_the_coupling_agree():
    eta = SOLID.eta
    for other in (Cosserat(100, 0.3, 0.2, eta=eta), Cosserat(100, 0.3, 0.2, mu_c=eta * SOLID.mu)):
        assert other.beta == pytest.approx(0.7, rel=1e-15)
    assert eta == pytest.approx(0.7 / 1.3, rel=1e-15)
    assert SOLID.layer_length == pytest.approx(0.2 * math.sqrt(1.5 / 1.4), rel=1e-15)


def test_couple_stress_limit_keeps_digits_of_mu_c():
    assert Cosserat(100, 0.3, 0.2, mu_c=1e12).mu_c == pytest.approx(1e12, rel=1e-14)  # rounding only


def test_replace_keeps_the_coupling():
    assert dataclasses.replace(SOLID, nu=0.1).beta == pytest.approx(SOLID.beta, rel=1e-15)


def test_violations_of_ellipticity_have_their_own_type():
    with pytest.raises(Inadmissible):
        Cosserat(100, 0.5, 0.2, beta=1)


def test_stresses_are_the_derivatives_of_the_energy():
    rng = np.random.default_rng(1)
    gradient, psi, kappa = rng.normal(size=(2, 2)), 0.3, rng.normal(size=2)
    step = 1e-6  # central differences of a quadratic are exact up to rounding: 1e-16/1e-6

    def slope(along, what):
        shifted = [
            SOLID.energy(
                gradient + s * along * (what == "u"),
                psi + s * (what == "psi"),
                kappa + s * along * (what == "k"),
            )
            for s in (step, -step)
        ]
        return (shifted[0] - shifted[1]) / (2 * step)

    stress = np.array(SOLID.stress(gradient, psi))
    for i, j in np.ndindex(2, 2):
        unit = np.zeros((2, 2))
        unit[i, j] = 1
        assert slope(unit, "u") == pytest.approx(stress[i, j], rel=1e-7, abs=1e-6)
    # dW/dpsi is the moment sigma_12 - sigma_21 of the stress: (14) and (44), not the printed (19)_2
    assert slope(np.zeros(2), "psi") == pytest.approx(stress[0, 1] - stress[1, 0], rel=1e-7)
    for i, unit in enumerate(np.eye(2)):
        assert slope(unit, "k") == pytest.approx(SOLID.couple_stress(kappa)[i], rel=1e-7)


def test_rigid_motion_carries_no_energy_if_the_blocks_turn_along():
    turn = 0.1
    gradient = np.array([[0, -turn], [turn, 0]])
    assert SOLID.energy(gradient, turn, np.zeros(2)) == 0
    assert SOLID.energy(gradient, 0.0, np.zeros(2)) == pytest.approx(2 * SOLID.mu_c * turn**2)  # they must


def test_no_coupling_gives_the_classical_symmetric_stress():
    classical = Cosserat(100, 0.3, 0.2, beta=0)
    gradient = np.array([[0.1, 0.4], [-0.2, 0.3]])
    strain = (gradient + gradient.T) / 2
    expected = classical.lam * np.trace(strain) * np.eye(2) + 2 * classical.mu * strain
    assert np.array(classical.stress(gradient, 0.7)) == pytest.approx(expected, rel=1e-14)
    assert classical.layer_length == math.inf


def test_curvature_is_that_of_the_closed_form_unless_told():
    """gamma' = 2, which (44)-(49) need, not the 1 of (18): the layer of the thick strip is ell/sqrt(beta),
    (49).
    """
    solid = Cosserat(E=100, nu=0.3, ell=0.2, beta=0.64)
    assert solid.curvature == 2 and solid.layer_length == pytest.approx(0.2 / 0.8, rel=1e-15)
