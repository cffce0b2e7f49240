"""Blocks with elastic interfaces: assembly, long waves, strip and surface against closed forms and direct
sums; the contact of a cylinder beside the continuum; the case lattice.
"""

import json
from functools import cache

import numpy as np
import pytest
from scipy.sparse.linalg import splu, spsolve

import microblock as mb
from cases.__main__ import main
from cases.common.blocks import (
    BlockHalfPlane,
    Springs,
    assembly,
    identified,
    rotation_stiffness,
    surface_stiffness,
    symbol,
    wave_on_blocks,
)
from cases.scenes import lattice
from microblock.corners.compliance import Compliance

SPRINGS = Springs(1, 1), Springs(2, 1), Springs(1, 2)
EXACT = 1e-12  # rounding of sums over some hundred blocks


def centres(columns, rows, b):
    """x1 and x2 of the blocks' centres, flat."""
    j, i = np.divmod(np.arange(columns * rows), columns)
    return i * b, j * b


def interface_energy(first, second, across, springs, b):
    """Work of the springs of one interface, summed over Gauss points of the face: `across` is its normal."""
    place, weight = np.polynomial.legendre.leggauss(3)  # the integrand is quadratic
    along = 1 - across
    energy = 0.0
    for s, w in zip(place * b / 2, weight * b / 2):
        jump = np.zeros(2)
        for block, side in ((first, -1), (second, 1)):
            arm = np.zeros(2)  # from the centre to the place on the face
            arm[across], arm[along] = -side * b / 2, s
            jump += side * (block[:2] + block[2] * np.array([-arm[1], arm[0]]))
        energy += w / (2 * b) * (springs.normal * jump[across] ** 2 + springs.shear * jump[along] ** 2)
    return energy


@pytest.mark.parametrize("springs", SPRINGS)
@pytest.mark.parametrize("across", [0, 1])
def test_energy_is_the_integral_over_the_face(springs, across):
    b, motion = 0.7, np.random.default_rng(1).normal(size=6)
    shape = (2, 1) if across == 0 else (1, 2)
    stored = motion @ assembly(*shape, springs, b) @ motion / 2
    assert stored == pytest.approx(interface_energy(motion[:3], motion[3:], across, springs, b), rel=EXACT)


@pytest.mark.parametrize("springs", SPRINGS)
def test_rigid_motions_cost_nothing_and_nothing_else_is_free(springs):
    b = 0.5
    x1, x2 = centres(4, 3, b)
    one, zero = np.ones(12), np.zeros(12)
    stiffness = assembly(4, 3, springs, b)
    for motion in ((one, zero, zero), (zero, one, zero), (-x2, x1, one)):
        assert np.abs(stiffness @ np.column_stack(motion).ravel()).max() < EXACT
    assert np.sum(np.linalg.eigvalsh(stiffness.toarray()) < 1e-10) == 3


@pytest.mark.parametrize("springs", SPRINGS)
@pytest.mark.parametrize(
    "strain, modulus", [((1, 0, 0), "normal"), ((0, 1, 0), "normal"), ((0, 0, 1), "shear")], ids=str
)
def test_uniform_strain_is_in_balance_and_costs_its_modulus(springs, strain, modulus):
    b, columns, rows = 0.5, 6, 5
    x1, x2 = centres(columns, rows, b)
    stiffness = assembly(columns, rows, springs, b)
    motion = np.column_stack((strain[0] * x1 + strain[2] * x2, strain[1] * x2, 0 * x1))
    forces = (stiffness @ motion.ravel()).reshape(rows, columns, 3)
    amid = forces[1:-1, 1:-1]
    couple = springs.shear * b**2 * strain[2]  # of sigma_12 alone, as u2,1 = psi = 0
    assert np.abs(amid - [0, 0, couple]).max() < EXACT
    interfaces = (columns - 1) * rows if strain[0] else columns * (rows - 1)
    energy = motion.ravel() @ stiffness @ motion.ravel() / 2
    assert energy == pytest.approx(getattr(springs, modulus) * b**2 / 2 * interfaces, rel=EXACT)


@pytest.mark.parametrize("springs", SPRINGS)
def test_symmetric_shear_asks_for_no_couples(springs):
    x1, x2 = centres(6, 5, 0.5)
    motion = np.column_stack((x2 / 2, x1 / 2, 0 * x1)).ravel()
    forces = (assembly(6, 5, springs, 0.5) @ motion).reshape(5, 6, 3)
    assert np.abs(forces[1:-1, 1:-1]).max() < EXACT


@pytest.mark.parametrize("springs", SPRINGS)
def test_every_block_is_in_equilibrium_under_loads(springs):
    columns, rows, b = 9, 7, 0.25
    stiffness, loads = assembly(columns, rows, springs, b), np.zeros(3 * columns * rows)
    loads[-3 * columns :] = np.random.default_rng(2).normal(size=3 * columns)
    free = np.arange(3 * columns, len(loads))  # the lowest row stands still
    motion = np.zeros(len(loads))
    motion[free] = spsolve(stiffness[free][:, free].tocsc(), loads[free])
    reactions = stiffness @ motion - loads
    assert np.abs(reactions[free]).max() < EXACT * np.abs(loads).max() * 100  # motions are of the order 100
    assert reactions[: 3 * columns].reshape(-1, 3)[:, :2].sum(axis=0) == pytest.approx(
        -loads.reshape(-1, 3)[:, :2].sum(axis=0), abs=1e-10
    )


@pytest.mark.parametrize("springs", SPRINGS)
def test_symbol_is_what_waves_on_blocks_feel(springs):
    for theta in ((0.3, 0.7), (3.0, -1.2), (np.pi, np.pi)):
        assert np.abs(symbol(*theta, springs, 0.5) - wave_on_blocks(*theta, springs, 0.5)).max() < EXACT


@pytest.mark.parametrize("springs", [*SPRINGS, Springs(100, 1), Springs(1, 100)])
def test_moduli_of_long_waves(springs):
    found, ratio = identified(springs), max(springs.normal / springs.shear, springs.shear / springs.normal)
    for name, exact in springs.moduli.items():
        value, residual = found[name]
        slack = 1e-8 * ratio * max(1, springs.normal)  # rounding over k^2, k = 0.02
        assert abs(value - exact) < slack and residual < slack, name
    one = Springs()
    assert one.moduli == {"E": 1, "nu": 0, "beta": 1, "gamma'": pytest.approx(1 / 6), "anisotropy": 1}


def test_the_solid_of_blocks_is_the_one_identified():
    solid, couples = (mb.Cosserat.of_blocks(side=0.5, stiffness=3.0, couples=each) for each in (False, True))
    for name, value in {
        "E": solid.E / 1.5,
        "nu": solid.nu,
        "beta": solid.beta,
        "gamma'": solid.curvature,
    }.items():
        assert value == pytest.approx(identified(Springs())[name][0], abs=1e-8)
    assert couples.curvature == pytest.approx(Springs().full_contact_couple, rel=1e-12)
    with pytest.raises(mb.BadArgument, match="side = 0"):
        mb.Cosserat.of_blocks(side=0, stiffness=1.0)


def test_the_curvature_of_waves_is_that_of_rows_alone():
    """In closed form the couple stiffness is E b^2 (1 + k^2 (1/12 - sin(2 angle)^2/8)), equal springs."""
    k = 0.01
    for angle in (0.0, np.pi / 8, np.pi / 4):
        bend = (rotation_stiffness(k, angle, Springs()) - 1) / k**2
        assert bend == pytest.approx(1 / 12 - np.sin(2 * angle) ** 2 / 8, abs=1e-4)  # the next term, k^2


def test_waves_of_displacement_ask_for_another_curvature():
    """Transverse waves along a row without couples: E k^2/2 (1 + k^2/12), there (1 + gamma' k^2/4)."""
    k = 0.05
    wave = symbol(k, 0, Springs())
    stiffness = (wave[1, 1] - wave[1, 2] * wave[2, 1] / wave[2, 2]).real
    assert (2 * stiffness / k**2 - 1) * 4 / k**2 == pytest.approx(1 / 3, abs=1e-3)  # the next term, k^2/4


@cache
def strip(springs, rows=30):
    """Rotations over the depth of a column under a couple 1 on the upper block, upper block first."""
    stiffness = assembly(1, rows, springs, periodic=True)
    loads, free = np.zeros(3 * rows), np.arange(3, 3 * rows)
    loads[-1] = 1
    motion = np.zeros(3 * rows)
    motion[free] = spsolve(stiffness[free][:, free].tocsc(), loads[free])
    return motion[2::3][::-1]


@pytest.mark.parametrize("springs", SPRINGS)
def test_layer_of_a_strip_block_by_block(springs):
    psi = strip(springs)
    # the base is 30 blocks away; four blocks down psi is 2e-6 of its first value, and rounding 1e-10 of it
    assert psi[1:5] / psi[:4] == pytest.approx(springs.decay, rel=1e-8)
    assert psi[1] / psi[0] == pytest.approx(springs.decay, rel=1e-10)
    assert 1 / psi[0] == pytest.approx(springs.surface_couple, rel=1e-10)


def test_layer_of_equal_springs_beside_the_continuum():
    psi, solid = strip(Springs()), mb.Cosserat(E=1, nu=0, ell=1, beta=1, curvature=1 / 6)
    assert psi[1] / psi[0] == pytest.approx(7 - 4 * 3**0.5, rel=1e-10)
    assert np.exp(-1 / solid.layer_length) == pytest.approx(np.exp(-(12**0.5)), rel=EXACT)
    couple = solid.curvature * solid.mu * solid.ell**2 / solid.layer_length  # M over psi of the continuum
    assert 1 / psi[0] / couple == pytest.approx(2 + 3**0.5, rel=1e-10)


@pytest.mark.parametrize("springs", SPRINGS)
def test_surface_of_a_half_plane_is_that_of_a_deep_assembly(springs):
    columns, rows, b = 8, 40, 0.5  # waves of 8 blocks fall by exp(-60) to the base and back
    stiffness = assembly(columns, rows, springs, b, periodic=True)
    wave = np.exp(2j * np.pi * np.arange(columns) / columns)
    free, top = np.arange(3 * columns, 3 * columns * rows), np.zeros((3 * columns * rows, 3), complex)
    for freedom in range(3):
        top[-3 * columns + freedom :: 3, freedom] = wave
    motion = spsolve(stiffness[free][:, free].tocsc(), top[free])
    deep = motion[-3 * columns : -3 * columns + 3]  # of the block at 0, where the wave is 1
    flexible = np.linalg.inv(surface_stiffness([2 * np.pi / columns], springs, b))[0]
    assert np.abs(flexible - deep).max() < 1e-10 * np.abs(deep).max()


@pytest.mark.parametrize("springs", SPRINGS)
def test_long_waves_of_the_surface(springs):
    theta = 1e-3
    flexible = np.linalg.inv(surface_stiffness([theta], springs))[0, 1:, 1:]
    # centres of the upper blocks are half a block below the surface that is pressed
    exact = 2 / (springs.E_star * theta) - 1 / (2 * springs.normal)
    assert flexible[0, 0] == pytest.approx(exact, abs=2 * theta)
    assert flexible[1, 0] == pytest.approx(2j / springs.E_star, rel=2 * theta)
    assert flexible[1, 1] == pytest.approx(1 / springs.surface_couple, abs=4 * theta)


@pytest.mark.parametrize("springs", SPRINGS)
def test_couple_in_full_contact(springs):
    theta = 1e-4
    flexible = np.linalg.inv(surface_stiffness([theta], springs))[0, 1:, 1:]
    on_corners = np.array([np.cos(theta / 2), 2j * np.sin(theta / 2)])  # of a height exp(i theta x)
    force, couple = np.linalg.solve(flexible, on_corners)
    # the minus of M = -c dp/dx1: forces here are along x2
    assert couple / (1j * theta * force) == pytest.approx(springs.full_contact_couple, abs=2 * theta)
    if springs == Springs():
        assert springs.full_contact_couple == pytest.approx(5 / 12 + 3**0.5 / 6, rel=EXACT)


def test_couple_of_the_continuum_in_full_contact():
    """gamma' (1 - nu), to which the blocks are compared, on the symbol of the half-plane."""
    from microblock.halfplane.kernels import symbol as halfplane

    k, solid = 1e-4, mb.Cosserat(E=1, nu=0.3, ell=1, beta=1, curvature=0.7)
    U, V, W = halfplane(solid, [k])[:, 0]
    q_over_p = 1j * (V - k / 2 * U) / (W - k / 2 * V)  # phi = -i k ell u/2
    assert q_over_p / 2 == pytest.approx(-1j * 0.7 * (1 - 0.3) * k, rel=1e-3)  # the next term is k ell


def blocks(**changes):
    """The state of the blocks alone at the load 1."""
    parameters = lattice.Parameters(**changes)
    return parameters, lattice.problems(parameters)["blocks"].solve(load=parameters.P)


@pytest.mark.parametrize("springs", SPRINGS)
def test_images_leave_the_fourth_power_of_the_period(springs):
    solid = mb.Cosserat(E=1, nu=0, ell=0.5, beta=1, curvature=1 / 6)
    near, middle, far = (
        BlockHalfPlane(solid, springs, np.arange(4.0), period).responses[..., :6] for period in (24, 48, 1536)
    )
    for response in (near, middle, far):
        response[0, 0] -= response[0, 0, 0]  # displacements are known up to a constant
    left = [np.abs(one - far).max(axis=2) for one in (near, middle)]
    # 16, but for what follows in the period: 24 blocks are not many; without images the ratio is 4
    assert (left[0] / left[1] > 12).all() and left[1].max() < 1e-4


def test_statics_do_not_see_the_period():
    (_, near), (_, far) = blocks(far=9.0), blocks(far=72.0)
    # the images leave the fourth power of 13 blocks over 144
    for name in ("pressure", "micromoment"):
        assert getattr(near, name) == pytest.approx(getattr(far, name), abs=1e-5 * far.pressure.max())


class Square(BlockHalfPlane):
    """The same surface blocks on a finite assembly with fixed sides and base, solved directly."""

    def compliance(self, clamped=False):
        n, rows, b = len(self.x), self.period // 2, self.solid.ell
        columns = n + 2 * rows
        number = np.arange(columns * rows).reshape(rows, columns)
        free = (3 * number[1:, 1:-1, None] + np.arange(3)).ravel()
        touched = number[-1, rows : rows + n]
        loads = np.zeros((3 * columns * rows, 2 * n))
        places = np.concatenate((3 * touched + 1, 3 * touched + 2))
        loads[places, np.arange(2 * n)] = 1
        stiffness = assembly(columns, rows, self.springs, b)[free][:, free].tocsc()
        motion = np.zeros_like(loads)
        motion[free] = splu(stiffness).solve(loads[free])
        matrix = motion[places]
        known = super().compliance()
        return Compliance(known.points, known.normals, known.weights, (matrix + matrix.T) / 2, b)


@pytest.mark.parametrize("spring", [(1, 1), (2, 1)])
def test_contact_is_that_on_ever_larger_squares_of_blocks(spring):
    left = []
    for far in (9.0, 18.0):
        parameters, half_plane = blocks(spring=spring, blocks_per_a=3, shift=0.2, far=far)
        body = parameters.body()
        square = Square(body.solid, body.springs, body.x, body.period)
        state = mb.Contact(square, mb.Cylinder(R=1.0), mb.Microblock()).solve(load=parameters.P)
        pairs = [(state.pressure, half_plane.pressure), (state.micromoment, half_plane.micromoment)]
        left.append([np.linalg.norm(own - other) / np.linalg.norm(other) for own, other in pairs])
    # a fixed base changes the statics like the inverse square of its distance, by about (a/far)^2 = 3e-3
    assert max(left[1]) < 6e-3
    assert np.divide(*left) == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("spring", [(1, 1), (3, 1)])
def test_corners_of_blocks_meet_the_conditions(spring):
    parameters, state = blocks(spring=spring, shift=0.3)
    assert state.weights @ state.pressure == pytest.approx(parameters.P, rel=1e-9)
    b, scale = parameters.b, np.ptp(state.x**2) / 2
    for corner, side in (("A", -1), ("B", 1)):
        compliance = state.solution.compliance.matrix
        motion = compliance @ np.concatenate((-state.pressure * b, state.micromoment * b))
        u2, psi = np.split(motion, 2)
        gap = (state.x + side * b / 2) ** 2 / 2 - state.approach - u2 - side * b / 2 * psi
        pressed = state.pressures[corner] > 0
        assert np.abs(gap[pressed]).max() < 1e-9 * scale and gap.min() > -1e-9 * scale
        assert (state.pressures[corner] >= 0).all()


@cache
def study(core=None):
    return lattice.convergence((4, 8, 16, 32), core=core)


def test_forces_converge_to_those_of_the_law():
    order, error = lattice.order((4, 8, 16, 32), study()["microblock", "forces"])
    assert 0.6 < order < 1 and error < 0.1  # 0.8 +- 0.03 from 4 to 64; b/a is what is neglected
    assert study()["microblock", "forces"][-1].max() < 0.013


def test_above_a_joint_the_unilateral_law_is_nearer():
    """The second column of the study: no law is nearest everywhere."""
    forces = {law: study()[law, "forces"] for law in lattice.LAWS}
    assert (forces["microblock"][:3, 0] < forces["unilateral"][:3, 0]).all()
    assert (forces["unilateral"][:3, 1] < forces["microblock"][:3, 1]).all()


def test_couples_do_not_and_by_how_much():
    couples = study()["microblock", "couples"]
    # 1 - (1/6)/(5/12 + sqrt(3)/6) = 0.764 in full contact; blocks at the ends differ less
    assert couples.min() > 0.65 and couples.max() < 0.77
    assert study(0.5)["microblock", "couples"][-1] == pytest.approx(0.764, abs=2e-3)


def test_the_derived_couple_is_right_in_full_contact_and_not_at_the_ends():
    amid, all_of_them = (study(core)[lattice.DERIVED, "couples"] for core in (0.5, None))
    assert (amid[1:] < 0.04).all() and (amid[2:] < 5e-3).all()
    assert (all_of_them < 0.25).all() and (all_of_them[-1] > 0.1).all()


@pytest.mark.parametrize("blocks_per_a", [1, 2, 4])
def test_surface_statements(blocks_per_a):
    """Softer than Hertz by blocks in contact; never an open block between closed ones; the sign of M."""
    shifts, widths = (np.arange(8) + 0.5) / 16, []
    for shift in shifts:
        parameters, state = blocks(blocks_per_a=blocks_per_a, shift=shift)
        assert len(state.zones["contact"]) == 1
        widths.append(state.half_width)
        # the corner towards the apex carries more, as in the continuum
        assert (state.micromoment * state.x >= -1e-12).all()
    law = mb.Contact(mb.HalfPlane(parameters.solid()), mb.Cylinder(R=1.0), mb.Microblock())
    # shifts are a sample of 8 and a block counts in full
    assert np.mean(widths) == pytest.approx(law.solve(load=parameters.P).half_width, rel=0.03)
    assert np.mean(widths) > 1.1


def test_the_command_returns_what_other_programs_rely_on(capsys):
    assert main(["lattice", "--blocks-per-a", "4", "--loads", "0.5", "1", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["moduli"].keys() == {"E", "nu", "beta", "gamma'", "anisotropy"}
    for entry in answer["moduli"].values():
        assert entry["value"] == pytest.approx(entry["closed_form"], abs=1e-8) and entry["residual"] < 1e-8
    assert [state["load"] for state in answer["states"]] == [0.5, 1.0]
    last = answer["states"][-1]
    assert answer["forces"] == last["forces"] and answer["couples"] == last["couples"]
    for values in (last["forces"], last["couples"]):
        assert len(values["blocks"]) == len(values["continuum"]) == len(last["x"])
        assert 0 < values["difference"] == values["differences"]["microblock"]
    # all of the load, over p_Hz b: P/(p_Hz b) = (pi/2)/b
    assert sum(last["forces"]["blocks"]) == pytest.approx(np.pi / 2 * 4, rel=1e-9)
    assert sum(last["forces"]["continuum"]) == pytest.approx(np.pi / 2 * 4, rel=1e-6)


def test_unequal_springs_have_no_isotropic_continuum(capsys):
    assert main(["lattice", "--spring", "2", "1", "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["forces"]["continuum"] is None and answer["couples"]["difference"] is None
    assert "not isotropic" in answer["reason"]


def test_picture_of_the_case(tmp_path):
    parameters = lattice.Parameters(blocks_per_a=4)
    figure = lattice.figure(lattice.rows(parameters, lattice.result(parameters)))
    figure.savefig(tmp_path / "lattice.png")
    assert (tmp_path / "lattice.png").stat().st_size > 10_000


def test_the_figure_of_convergence_says_orders_and_leaves_unequal_springs_out(monkeypatch):
    assert lattice.convergence_rows(lattice.Parameters(spring=(1.0, 2.0)), None) == []
    monkeypatch.setattr(lattice, "SIZES", (4, 8, 16))
    found = lattice.convergence_rows(lattice.Parameters(), None)
    assert len(found) == 6 * 3 * 3 and {row["blocks_per_a"] for row in found} == {4, 8, 16}
    told = [text.get_text() for text in lattice.convergence_figure(found).legends[0].get_texts()]
    # couples have no order, and forces with the derived couple no curve
    assert len(told) == 5 and sum("order" in words for words in told) == 3
