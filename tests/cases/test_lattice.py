"""Blocks with elastic interfaces against closed forms and direct sums; the contact of a cylinder on them."""

import json
from math import pi

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from cases import lattice
from cases.__main__ import main
from cases.lattice_blocks import Springs, assembly, identified, rotation_stiffness, surface_stiffness

SPRINGS = Springs(1, 1), Springs(2, 1), Springs(1, 2)


@pytest.mark.parametrize("springs", SPRINGS)
@pytest.mark.parametrize("columns, rows", [(2, 1), (1, 2)])
def test_energy_is_the_integral_over_the_interface(springs, columns, rows):
    b, motion = 0.7, np.random.default_rng(1).normal(size=6)
    gauss, weights = np.polynomial.legendre.leggauss(3)  # the integrand is quadratic
    normal = np.array([1, 0] if columns == 2 else [0, 1])
    jump = np.zeros((3, 2))
    for (u1, u2, psi), side in zip(motion.reshape(2, 3), (-1, 1)):
        arms = np.outer(gauss, normal[::-1]) * b / 2 - side * b / 2 * normal
        jump += side * (np.array([u1, u2]) + psi * np.column_stack((-arms[:, 1], arms[:, 0])))
    density = springs.normal * (jump @ normal) ** 2 + springs.shear * (jump @ normal[::-1]) ** 2
    assert motion @ assembly(columns, rows, springs, b) @ motion == pytest.approx(weights @ density / 2)


@pytest.mark.parametrize("springs", [*SPRINGS, Springs(100, 1)])
def test_moduli_of_long_waves(springs):
    for name, (value, residual) in identified(springs).items():
        # rounding over k^2, k = 0.02
        assert max(abs(value - springs.moduli[name]), residual) < 1e-8 * springs.normal**2, name


def test_the_curvature_of_waves_is_that_of_rows_alone():
    """In closed form the couple stiffness is E b^2 (1 + k^2 (1/12 - sin(2 angle)^2/8)), equal springs."""
    for angle in (0.0, pi / 8, pi / 4):
        bend = (rotation_stiffness(np.array([0.01]), angle, Springs())[0] - 1) / 0.01**2
        assert bend == pytest.approx(1 / 12 - np.sin(2 * angle) ** 2 / 8, abs=1e-4)  # the next term, k^2


def motion_of_the_surface(springs, columns, rows, load):
    """Motion of block 0 in each row, from above, under a load (3 columns,) on a deep periodic assembly."""
    inner = np.arange(3 * columns, 3 * columns * rows)  # the lowest row is fixed
    loads = np.concatenate((np.zeros(len(inner) - 3 * columns), load))
    stiffness = assembly(columns, rows, springs, periodic=True).tocsc()[inner][:, inner]
    return spsolve(stiffness, loads).reshape(rows - 1, columns, 3)[::-1, 0]


@pytest.mark.parametrize("springs", SPRINGS)
def test_layer_of_a_strip_and_waves_of_the_surface_are_those_of_assembled_blocks(springs):
    psi = motion_of_the_surface(springs, 1, 30, [0, 0, 1])[:, 2]
    assert psi[1:4] / psi[:3] == pytest.approx(springs.decay, rel=1e-8)  # the base is far, rounding grows
    assert 1 / psi[0] == pytest.approx(springs.surface_couple, rel=1e-10)
    wave = np.outer(np.exp(2j * pi * np.arange(8) / 8), [0, 0, 1]).ravel()
    deep = motion_of_the_surface(springs, 8, 40, wave)[0]  # falls by exp(-30) to the base
    assert deep == pytest.approx(np.linalg.inv(surface_stiffness([pi / 4], springs))[0, :, 2], abs=1e-10)


@pytest.mark.parametrize("springs", SPRINGS)
def test_couple_in_full_contact(springs):
    theta = 1e-4
    flexible = np.linalg.inv(surface_stiffness([theta], springs))[0, 1:, 1:]
    # displacement and rotation of blocks with both corners on a height exp(i theta x)
    force, couple = np.linalg.solve(flexible, [np.cos(theta / 2), 2j * np.sin(theta / 2)])
    assert couple / (1j * theta * force) == pytest.approx(springs.full_contact_couple, abs=2 * theta)


def test_forces_are_those_of_the_law_and_couples_are_not():
    states = lattice.solve(blocks_per_a=32)[0]
    names = "blocks", "microblock", lattice.DERIVED
    exact, law, derived = (lattice.on_blocks(states[name], states["blocks"]) for name in names)
    assert np.linalg.norm(law[0] - exact[0]) < 0.013 * np.linalg.norm(exact[0])  # of the order b/a
    middle = np.abs(states["blocks"].x) < 0.5  # nearly full contact, where (1/6)/(5/12 + sqrt(3)/6) = 0.236
    assert np.linalg.norm(law[1][middle]) == pytest.approx(0.236 * np.linalg.norm(exact[1][middle]), rel=0.01)
    assert derived[1][middle] == pytest.approx(exact[1][middle], abs=0.01 * exact[1].max())


def test_statics_do_not_see_the_period():
    near, far = (lattice.solve(spring=(2.0, 1.0), far=far)[0]["blocks"] for far in (9.0, 72.0))
    # the images leave the fourth power of 13 blocks over 144
    assert near.pressures["A"] == pytest.approx(far.pressures["A"], abs=1e-5 * far.pressure.max())


def test_the_command_returns_what_other_programs_rely_on(capsys):
    assert main(["lattice", "--blocks-per-a", "4", "--loads", "0.5", "1", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["moduli"].keys() == {"E", "nu", "beta", "gamma'", "anisotropy"}
    assert [state["load"] for state in answer["states"]] == pytest.approx([0.5, 1.0], rel=1e-12)
    # P/(p_Hz b)
    assert [sum(answer["forces"][name]) for name in ("blocks", "continuum")] == pytest.approx(
        [2 * pi] * 2, rel=1e-5
    )
    assert main(["lattice", "--spring", "2", "1", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["forces"]["continuum"] is None and "not isotropic" in answer["reason"]
    assert main(["lattice", "--far", "1"]) == 2 and "--far" in capsys.readouterr().err
