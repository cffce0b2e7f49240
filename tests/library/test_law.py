"""Corner gaps with numbers worked out on paper from (20)-(22) and (41), not with the code."""

import numpy as np
import pytest

from microblock import Cylinder, Microblock, Microclamped, Obstacle, Plane, Punch, Unilateral, Wedge
from microblock.model import law, obstacles

UP = np.array([[0.0, 1.0]])


def gaps(model, x, obstacle, ell=0.5, normal=UP):
    return {
        corner: gap[0]
        for corner, gap in model.initial_gaps(np.array([[x, 0.0]]), normal, ell, obstacle).items()
    }


def test_rotated_block_under_a_plane():
    # N = (-0.02, 1), S = (1, 0.02): A at (-0.25, -0.005), B at (0.25, 0.005); plane at height 0.01
    found = gaps(Microblock(0.02), 0.0, Plane(0.01))
    assert found == pytest.approx({"A": 0.015, "B": 0.005}, abs=1e-16)


def test_rotated_block_under_a_cylinder():
    # x = 1, ell = 0.5: corners at 0.75 and 1.25, heights 0.75^2/4 = 0.140625 and 1.25^2/4 = 0.390625;
    # psi0 = -0.1 lifts A by 0.025 and lowers B by 0.025
    found = gaps(Microblock(-0.1), 1.0, Cylinder(2.0))
    assert found == pytest.approx({"A": 0.140625 - 0.025, "B": 0.390625 + 0.025}, abs=1e-16)


def test_psi0_in_the_levers_leaves_the_gaps_alone():
    found = gaps(Microblock(-0.1, psi0_in="levers"), 1.0, Cylinder(2.0))
    assert found == pytest.approx({"A": 0.140625, "B": 0.390625}, abs=1e-16)
    assert Microblock(-0.1, psi0_in="levers").levers(np.zeros(1)) == {"A": [0.9], "B": [-1.1]}


def test_rotation_that_varies_along_the_surface():
    # psi0(x) = 0.02 x at x = 3: 0.06, so A moves by 0.25*0.06 = 0.015 away
    found = gaps(Microblock(lambda x: 0.02 * x), 3.0, Plane(1.0))
    assert found == pytest.approx({"A": 1.015, "B": 0.985}, abs=1e-15)


def test_inclined_surface():
    # n = (0.6, 0.8), tangent s = n x e3 = (0.8, -0.6), psi0 = 0: A = C - 0.25 s = (-0.2, 0.15), B = (0.2,
    # -0.15);
    # the plane at height 1 comes down along e2, its gap along n is (1 - x2) n2: 0.85*0.8 and 1.15*0.8
    found = gaps(Microblock(0.0), 0.0, Plane(1.0), normal=np.array([[0.6, 0.8]]))
    assert found == pytest.approx({"A": 0.68, "B": 0.92}, abs=1e-15)


def test_traction_and_micromoment():
    # (29) with ell = 0.5, psi0 = 0.02, lambda_A = -3, lambda_B = -5: t_n = -8,
    # M = -0.25 (1.02*(-3) + (-0.98)*(-5)) = -0.25*(-3.06 + 4.9) = -0.46
    multipliers = {"A": np.array([-3.0]), "B": np.array([-5.0])}
    assert law.traction(multipliers) == [-8.0]
    levers = Microblock(0.02).levers(np.zeros(1))
    assert law.micromoment(multipliers, levers, 0.5) == pytest.approx([-0.46])


def test_full_contact_micromoment_is_that_of_29_not_of_the_text_after_fig_6():
    # the text has M = ell/2 (t_B - t_A)(1 - psi0); (29) has (1 - psi0) on B and (1 + psi0) on A
    psi0, ell, multipliers = 0.1, 1.0, {"A": np.array([-1.0]), "B": np.array([-1.0])}
    levers = Microblock(psi0).levers(np.zeros(1))
    assert law.micromoment(multipliers, levers, ell) == pytest.approx([-psi0 * ell * -1])
    assert ell / 2 * (-1.0 - -1.0) * (1 - psi0) == 0  # the text's formula gives none


def test_classic_laws_have_one_corner_and_no_lever():
    for model in (Unilateral(), Microclamped()):
        assert gaps(model, 1.0, Cylinder(2.0)) == {"C": 0.25}
        assert model.levers(np.zeros(1)) == {"C": [0.0]}
    assert Microclamped().clamps_rotation and not Unilateral().clamps_rotation


@pytest.mark.parametrize(
    "obstacle, x, height",
    [
        (Wedge(0.1), -2.0, 0.2),
        (Punch(1.0, tilt=0.1), 0.5, 0.05),
        (Punch(1.0), 1.5, np.inf),
        (Obstacle.from_samples([0, 1, 3], [0, 2, 4]), 2.0, 3.0),
        (Obstacle.from_samples([0, 1], [0, 2]), 2.0, np.inf),
        (lambda x: x**4, 2.0, 16.0),
    ],
)
def test_heights(obstacle, x, height):
    assert obstacles.gap(obstacle, np.array([[x, 0.0]]), UP) == pytest.approx([height])


def test_surface_that_faces_away_never_touches():
    assert obstacles.gap(Plane(1.0), np.zeros((1, 2)), -UP) == [np.inf]
