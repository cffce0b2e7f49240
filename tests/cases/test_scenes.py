"""Rough contact: the estimate of cells, panels for aligned blocks, mirror images, and what seeds show."""

import dataclasses
import json
import math

import ngsolve as ng
import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh

import microblock as mb
from cases import (
    friction,
    friction3d,
    own_mesh,
    published,
    punch3d,
    roller,
    rough,
    rough3d,
    samples,
    sphere,
    two_bodies,
    wave,
)
from cases.__main__ import main
from cases.closed_forms import ThinLayer
from microblock.halfplane.kernels import plane_symbol


def change(coarse, fine):
    """Relative L2 distance of the pressure of cells from that of finer ones."""
    return np.linalg.norm(np.interp(fine.x, coarse.x, coarse.pressure) - fine.pressure) / np.linalg.norm(
        fine.pressure
    )


@pytest.mark.parametrize(
    "solve, nodes",
    [
        (lambda nodes: rough.profile(waves=(4, 128), nodes=nodes), 8192),
        (lambda nodes: rough.cylinder(0.5, seed=3, nodes=nodes), 4096),
    ],
)
def test_estimate_bounds_the_change_to_four_times_as_many_cells(solve, nodes):
    coarse = solve(nodes)
    assert change(coarse, solve(4 * nodes)) < coarse.error_estimate < 0.05


def test_the_contact_of_both_corners_goes_first_and_scatters():
    result = rough.solve(psi0=(0.01, 0.2), seeds=5, nodes=4096)
    any_corner, both = (result["lengths"][name] for name in ("one corner or both", "both corners"))
    assert any_corner[1].mean() > 0.95 * any_corner[0].mean()
    assert both[1].mean() < 0.6 * both[0].mean() and both[1].std() > 3 * both[0].std()
    zones = result["profile"].zones
    length = {name: np.ptp(zones[name], axis=1).sum() for name in ("contact", "full")}
    assert len(zones["contact"]) > 50 and length["full"] < length["contact"] / 2  # as the script says


# --- rough surface in three dimensions: the classical theories, and the order of the laws


def test_the_classical_surface_touches_as_the_theories_say_and_blocks_more():
    states = rough3d.solve(loads=(0.01, 0.1), cells=128)
    kappa = {name: [rough3d.fraction(one) / one.load for one in solved] for name, solved in states.items()}
    assert all(math.sqrt(8 / math.pi) < one < math.sqrt(2 * math.pi) for one in kappa["classical"])
    # 2.505 and 2.077 on 1024 cells of another program, tamaas
    assert kappa["classical"] == pytest.approx([2.505, 2.077], rel=0.02)
    for blocks, classical, alone in zip(*(kappa[name] for name in rough3d.LAWS)):
        assert blocks > classical > alone


# --- flat punch on a block in three dimensions, beside the half-space and the classical punch


def test_block_and_half_space_agree():
    near, far = (punch3d.solve(size=size, facets=4, cells=64) for size in (3.0, 6.0))
    block, half_space = far.values()
    # a small block is stiffer; its size counts like 1/size; facets of 1/4 and what follows leave 8 %
    assert near["block"].approach < block.approach < half_space.approach
    assert 2 * block.approach - near["block"].approach == pytest.approx(half_space.approach, rel=0.08)
    # corners of blocks up to half of a block, 0.25, beside the face touch; nodes and cells cut the rim
    assert 4 * block.contact_area == pytest.approx(2.5**2, rel=0.05)
    assert half_space.contact_area == pytest.approx(2.5**2, rel=0.02)


@pytest.mark.parametrize("face, approach", [("round", 0.5), ("square", math.sqrt(math.pi / 4) / 2.024)])
def test_small_blocks_are_the_classical_punch(face, approach):
    """For the square King, Int. J. Solids Struct. 23 (1987) 1657."""
    solid = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.01, beta=1)
    problem = mb.Contact(mb.HalfSpace(solid), mb.FlatPunch(1.0, face), mb.Unilateral(), mb.Cells(nodes=96))
    # cells cut the round rim into steps
    assert problem.solve(load=1.0).approach == pytest.approx(approach, rel=0.01)


# --- size effects beside published ones


@pytest.mark.parametrize(
    "shape, alpha, beta",
    [
        ("sphere", 1e3, 0.5),
        pytest.param("cone", 1e3, 1.5, marks=pytest.mark.nightly),
        pytest.param("sphere", 1e-3, 0.5, marks=pytest.mark.nightly),
        pytest.param("cone", 1e-3, 1.5, marks=pytest.mark.nightly),
    ],
)
def test_apparent_moduli_have_their_limits(shape, alpha, beta):
    """Of blocks that are far larger, and far smaller, than the contact; the rtol is 3e-3 of the load."""
    expected = 1 + (1 - 0.3) * beta if alpha > 1 else 1.0, {"sphere": 1.5, "cone": 2.0}[shape]
    assert published.modulus(alpha, mb.Unilateral(), 0.3, beta, shape) == pytest.approx(expected, rel=1e-2)


def test_a_plate_bends_with_its_couples():
    """The energy of a plate on a mesh, whose ends turn, for the closed form."""
    nu, ell_b, thickness = 0.3, 0.4, 0.5
    mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, y: (2 * x - 1, thickness * (y - 0.5)))
    solid = mb.Cosserat(E=1 - nu**2, nu=nu, ell=1.0, beta=0.7, curvature=4 * ell_b**2)
    # unit curvature: u = (-x1 x2, x1^2/2 + nu/(1 - nu) x2^2/2), psi = x1
    bent = {"u1": -ng.x * ng.y, "u2": ng.x**2 / 2 + nu / (1 - nu) * ng.y**2 / 2, "psi": ng.x}
    prescribed = {name: dict.fromkeys(("left", "right"), value) for name, value in bent.items()}
    body = mb.Body(mesh, solid, 2, prescribed=prescribed, contact="top")
    rigidity = body.solve().energy()  # of the length 2, half of it times the curvature squared
    assert rigidity == pytest.approx(published.bending(thickness, ell_b, nu) * thickness**3 / 12, rel=1e-9)


# --- a sphere with friction


@pytest.mark.nightly
def test_a_sphere_sticks_beside_the_middle_and_under_blocks_less():
    """Edges of stick zones move by whole cells, an eighth of their radius: shares of the contact to 0.1."""
    states = friction3d.solve(cells=32)
    shares = {name: state.weights @ state.stick / state.contact_area for name, state in states.items()}
    assert shares == {"unilateral": pytest.approx(0.54, abs=0.1), "microblock": pytest.approx(0.21, abs=0.1)}
    for state in states.values():
        assert state.points[state.stick, 0].mean() < -0.05  # in the middle it would be 0
        assert abs(state.points[state.stick, 1].mean()) < 1e-6
        assert state.tangential_approach[0] > 10 * abs(state.tangential_approach[1])


# --- samples: the polygon through them, the smooth curve, and the formula behind both


def test_a_curve_through_samples_is_the_formula_and_a_polygon_spikes():
    states = samples.solve()
    spline, polygon = states["spline"], states["polygon"]
    formula = spline.problem.with_(obstacle=lambda x: x**2 / 20 + 2e-4 * np.cos(40 * x)).solve(load=1.0)
    size = np.linalg.norm(formula.pressure)
    # cubic splines of 61 samples, eight to a ripple, are off by 1e-3 of it
    assert np.linalg.norm(spline.pressure - formula.pressure) < 3e-3 * size
    assert np.linalg.norm(polygon.pressure - formula.pressure) > 0.05 * size
    assert polygon.weights @ polygon.pressure == pytest.approx(1.0, rel=1e-9)
    # twice the samples: half the spacing, and slope discontinuities half as large
    x = np.linspace(-0.6, 0.6, 121)
    finer = mb.Obstacle.from_samples(x, x**2 / 20 + 2e-4 * np.cos(40 * x))
    closer = spline.problem.with_(obstacle=finer).solve(load=1.0)
    wrong = [np.linalg.norm(state.pressure - formula.pressure) for state in (closer, polygon)]
    assert wrong[0] < 0.6 * wrong[1]


# --- two bodies that deform: Hertz for small blocks, and kinks that come back a block away


def test_kinks_of_the_pressure_come_back_a_block_away():
    """The slope jumps where full contact ends; under a body that deforms also a block beside it."""
    states = two_bodies.solve(rtol=1e-5)
    edge = {words: state.zones["full"][0][1] for words, state in states.items()}
    assert edge == pytest.approx({"deforms": 0.5595, "rigid": 0.5107}, abs=1e-4)  # of the edition before

    def bend(words, x):
        p = states[words].pressure_at(edge[words] + x + np.array((-3e-3, 0.0, 3e-3)))
        return abs(p[0] - 2 * p[1] + p[2])

    smooth = {words: max(bend(words, -0.12), bend(words, 0.1)) for words in states}
    assert all(bend("deforms", x) > 10 * smooth["deforms"] for x in (0.0, 0.25, -0.25))
    assert all(bend("rigid", x) < 10 * smooth["rigid"] < bend("rigid", 0) for x in (0.25, -0.25))


# --- periodic contact: Westergaard's closed form, and full closure of microblocks


def test_all_corners_close_at_the_load_of_the_closed_form():
    """Closed gaps are cosines and sines: the waves p1 and m1 of p and m follow from the kernels, and corner
    pressures (p -+ m)/2 >= 0 ask for a mean of at least hypot(p1, m1).
    """
    state = wave.solve(loads=1)["microblocks"][0]
    k, half = 2 * np.pi, np.pi * state.solid.ell
    (U,), (V,), (W,) = plane_symbol(state.solid, np.array([k]))
    waves = wave.AMPLITUDE * np.array((np.cos(half), np.sin(half)))
    closure = np.hypot(*np.linalg.solve([[U, V], [V, W]], waves))
    assert closure == pytest.approx(1.33, abs=0.005)  # as the script says
    for share, closed in ((0.998, False), (1.002, True)):
        states = wave.solve(last=share * closure, loads=1)["microblocks"]
        assert (wave.in_contact(states, np.min) == [1]) is closed


# --- the sphere beside the closed forms of small and of large blocks, and what its command returns


KEYS = (
    "load pressure_centre pressure_max radius radius_x radius_diagonal approach closed iterations residual "
    "error_estimate profile"
)


def test_larger_blocks_are_stiffer_under_every_law_and_less_hard_under_microblocks_alone():
    result = sphere.solve(alphas=(0.3, 3.0, 6.0), cells=64)
    for contact, states in result["sizes"].items():
        small, large, largest = (state.approach / sphere.a_Hz**2 for state in states)
        end, hardness = sphere.large_blocks(states[0].problem.solid, contact)
        # contacts of corners, ell apart, push each other down like 1/ell
        assert 1 > small > large > largest > end and largest - end < 0.65 * (large - end)
        # steps of the rim: a cell is 0.04 of the radius
        area = states[-1].contact_area / (math.pi * sphere.a_Hz**2)
        assert states[-1].load / area == pytest.approx(hardness, rel=0.06)
        assert (hardness < 1) == (contact == "microblock")


def test_the_command_returns_what_other_programs_rely_on(capsys):
    words = ["sphere", "--cells", "32", "--loads", "0.5", "1", "--json", "-"]
    assert main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    state = answer["states"][1]
    assert state.keys() >= set(KEYS.split()) and [one["load"] for one in answer["states"]] == [0.5, 1.0]
    for cut in state["profile"].values():
        assert cut.keys() == {"x1", "pressure", "m1", "m2", "psi1", "psi2"} and len(cut["x1"]) == 32
    # all of the area is that with one to four corners closed
    assert sum(state["closed"]) == pytest.approx(state["radius"] ** 2, rel=1e-9)
    assert main([*words, "--rtol", "0.1"]) == 2 and "--rtol" in capsys.readouterr().err


# --- bodies on meshes of a user: equilibrium, and layers between the Winkler foundation and the half-plane


LAYER = ThinLayer(normal=3.0, rotational=0.4, ell=0.6)


def test_the_winkler_foundation_under_a_cylinder():
    """Half-width (3 P R h/(2 K))^(1/3), Johnson, Contact Mechanics, 5.8; no moment where psi is free."""
    x = np.linspace(-2, 2, 40001)
    gaps, weights = np.array([x**2 / 2] * 2), np.full(len(x), x[1] - x[0])
    exact = (3 * 1.7 / (2 * LAYER.normal)) ** (2 / 3) / 2
    assert LAYER.approach(1.7, gaps, weights) == pytest.approx(exact, rel=1e-6)  # trapezoidal rule
    free = dataclasses.replace(LAYER, rotational=0.0).pressures(np.array((0.3 - gaps[0], 0.25 - gaps[0])))
    assert free[0] == pytest.approx(free[1], abs=1e-15)


@pytest.fixture(scope="module")
def states():
    return own_mesh.solve(thicknesses=(0.05, 0.2, 1.5, 4.0), rtol=1e-2)


def test_equilibrium(states):
    for name, state in states.items():
        assert state.error_estimate <= 1e-2
        if name != "half-plane":  # energy of the fields, work of the corners; force of the base
            assert state.fields.energy() == pytest.approx(state.energy, rel=1e-8)
            assert state.reaction("base").force == pytest.approx((0, own_mesh.LOAD), abs=1e-8)


def test_a_hole_widens_the_contact_and_moves_the_load_away(states):
    solid, hole = states["solid block"], states["block with a hole"]
    assert hole.half_width > 1.2 * solid.half_width
    assert hole.weights @ (hole.x * hole.pressure) < -0.1 * hole.load
    assert abs(solid.weights @ (solid.x * solid.pressure)) < 5e-3 * solid.load  # an asymmetric mesh


def test_layers_between_their_limits(states):
    """Differences fall like (h/a)^(3/2) to the foundation, by its edges; like (a/h)^2 to the half-plane."""
    x, half_plane = np.linspace(-1.4, 1.4, 4001), states["half-plane"]

    def off(h, limit):
        return np.linalg.norm(states[f"h = {h:g}"].pressure_at(x) - limit) / np.linalg.norm(limit)

    thin, thinner = (off(h, own_mesh.foundation(x, h, half_plane.solid)) for h in (0.2, 0.05))
    thick, thicker = (off(h, half_plane.pressure_at(x)) for h in (1.5, 4.0))
    assert thinner < 0.4 * thin < 0.02 and thicker < thick / 5 + 1e-2


# --- friction: Cattaneo and Mindlin, finite elements, and what the command tangential returns


OF_TANGENTIAL = "normal shear stick slip half_width dissipation energy work error_estimate profile"


def test_the_first_shear_makes_one_side_of_microblocks_stick():
    *touching, slid = friction.history((0.05, 0.25, 0.5, 1.0)).states
    lengths = [sum(right - left for left, right in state.zones["stick"]) for state in touching]
    # 0.43, 1.14, 0.94, 0.78 at rtol 0.01
    assert 2 * lengths[0] < lengths[1] > lengths[2] > lengths[3] and not slid.zones["stick"]


def test_a_cycle_dissipates_what_finite_elements_say():
    """Friction on the nodes of squares of a tenth of the contact, which share neither mesh nor response with
    the cells; from squares of 0.2 to 0.1 they change by 1 %, and 3 % are allowed.
    """
    solid, law = mb.Cosserat(E=1 - 0.3**2, nu=0.3, ell=0.4, beta=1), mb.Microblock(friction=0.3)
    problem = mb.Contact(mb.Block(solid, 20.0), mb.Cylinder(R=1.0), law, mb.Uniform(h=0.1))
    first, _, last = problem.history([(friction.P, share * 0.3 * friction.P) for share in (1, -1, 1)]).states
    dissipated = friction.P * friction.dissipation(0.4, "microblock")
    assert dissipated == pytest.approx(last.dissipation - first.dissipation, rel=0.03)


def test_blocks_of_a_third_of_the_half_width_dissipate_least():
    small, least, large = (friction.dissipation(alpha, "microblock") for alpha in (0.1, 0.3, 0.8))
    assert least < 0.7 * min(small, large)


@pytest.mark.parametrize("second", ["same", "1 0.3 0 0.01"])
def test_the_command_is_cattaneo_and_mindlin_for_small_blocks_and_equal_bodies(second, capsys):
    words = f"--alpha 1e-3 --contact unilateral --second {second} --shear 0.5 1 -1 1 --rtol 0.01 --json -"
    assert main(["tangential", *words.split()]) == 0
    answer = json.loads(capsys.readouterr().out)
    (pressed,), (sheared, full, _, last) = answer["pressed"], answer["states"]
    assert sheared.keys() >= set(OF_TANGENTIAL.split()) and len(sheared["profile"]) == 7
    # edges of cells of this rtol are known to 1e-3
    assert pressed["half_width"] == pytest.approx(1, abs=2e-3)
    assert sheared["stick"] == [pytest.approx([-math.sqrt(0.5), math.sqrt(0.5)], abs=2e-3)]
    # in closed form f^2/2 of P a_Hz^2/R
    assert last["dissipation"] - full["dissipation"] == pytest.approx(0.3**2 / 2, rel=5e-3)
    assert main(["tangential", "--second", "soft"]) == 2 and "--second" in capsys.readouterr().err


# --- a roller with ends


def test_lundbergs_profile_makes_the_line_load_even():
    result = roller.solve(cells=96)
    x2, straight = roller.line_load(result["straight"])
    _, even = roller.line_load(result["Lundberg"])
    inside = np.abs(x2) < 0.9 * 6
    # the profile is that of a long roller, whose length is 12 half-widths here: it leaves 3 %
    assert even[inside] == pytest.approx(1.0, abs=0.04)
    assert straight.max() > 2.5 and straight[inside].min() < 0.9
    _, blocks = roller.line_load(result["straight, microblocks"])
    # a side of a block lies between the two peaks; the first one is half a block beyond the end
    peaks = x2[1:-1][(np.diff(blocks)[:-1] > 0) & (np.diff(blocks)[1:] < 0) & (x2[1:-1] > 5)]
    assert peaks == pytest.approx([5.75, 6.25], abs=0.15)  # one cell
