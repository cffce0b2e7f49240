"""The second codes of `tests/judges` against closed forms, and a handful of the scenes that they judge."""

from math import inf, pi, sqrt

import numpy as np
import pytest

import microblock as mb
from tests.judges import fresh, friction, invariance, plane, space, space_scenes

E, NU = 0.91, 0.3  # E* = 1
BLUNT = 1e-7  # ell of a solid that is classical at the scale of the contact


def paraboloid(x, y):
    return (x * x + y * y) / 2


def coarse(*arguments, **more):
    return space.answer(*arguments, n=32, **more)


def test_symbols_do_not_change_with_the_degree_in_depth():
    hessian = space._plane(0.7, 1.5, 1.0)
    low, high = (space.compliance(hessian, 0.7, [1, 2], degree) for degree in (space.DEGREE, 16))
    assert abs(low - high).max() < 1e-9 * abs(high).max()  # exponential convergence, both at their end


def test_symbols_of_long_waves_are_classical():
    u = space.symbol(1e-4, NU, 1.0)[0]
    assert u * 1e-4 == pytest.approx(
        2 * (1 - NU) / 2, rel=1e-3
    )  # 2/E* at mu = 1; the next term is of order k ell


def test_cells_far_away_act_as_points():
    table = space.kernels(NU, 1.0)
    cells = space.cell_kernels(table, (8, 8), (0.3, 0.2), True)[:, :, 13, 10]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    points = sum(
        v * w * space.point_kernels(table, 1.5 + 0.15 * a, 0.4 + 0.1 * b, True) * 0.015
        for a, v in zip(nodes, weights)
        for b, w in zip(nodes, weights)
    )
    assert abs(cells / points - 1).max() < 1e-5  # derivatives of a spline with 16 nodes a decade


def test_sphere_of_hertz():
    a, p0, approach = space.hertz(E, NU, 1.0, 0.01)
    got = coarse(paraboloid, [(0, 0, 1.5 * a, 1.5 * a)], 0.01, (E, NU, 1.0, BLUNT), "unilateral")
    assert got.approach == pytest.approx(approach, rel=1e-3)  # 16 cells along a radius
    assert got.peak == pytest.approx(p0, rel=5e-3)


def test_flat_punch():
    height = lambda x, y: np.where(np.hypot(x, y) < 1, 0.0, inf)  # noqa: E731
    got = coarse(height, [(0, 0, 1, 1)], 1.0, (E, NU, 1.0, BLUNT), "unilateral", fixed=True)
    assert got.approach == pytest.approx(0.5, rel=1e-2)  # P/(2 E* a); cells cut the circle


def test_far_summits_are_hertz_contacts_coupled_by_point_loads():
    places, radii, levels = [(0, 0), (1, 0.2), (-0.7, 0.9)], [1, 0.3, 0.05], [0, 1e-4, 2e-4]
    height = space_scenes.paraboloids(places, radii, levels)
    boxes = [(x, y, sqrt(4e-3 * r), sqrt(4e-3 * r)) for (x, y), r in zip(places, radii)]
    got = coarse(height, boxes, 1e-4, (E, NU, 1.0, BLUNT), "unilateral", owner=space_scenes.Owner(places))
    approach, loads = space.coupled_hertz(E, NU, radii, levels, places, 1e-4)
    assert got.approach == pytest.approx(approach, rel=1e-3)  # as the sphere of Hertz
    assert got.loads == pytest.approx(loads, rel=2e-3)


def test_full_contact_of_a_wave_in_two_directions():
    sheet = space.Sheet(1.0, 32, NU, 1.0, "unilateral")
    x = np.meshgrid(sheet.x, sheet.y, indexing="ij")
    wave = np.cos(2 * pi * x[0]) * np.cos(2 * pi * x[1])
    k = 2 * pi * sqrt(2)
    assert sheet.own(wave[None])[0] == pytest.approx(
        space.symbol(k, NU, 1.0)[0] * wave, rel=1e-2
    )  # sinc of cells


def test_lattice_of_charges():
    assert space.lattice(np.array(0.0), np.array(0.0)) == pytest.approx(
        -3.900264920, abs=1e-8
    )  # square lattice


def test_plane_in_full_contact():
    solid, load = (100.0, NU, 1.0, 0.05), 9.0
    line = plane.Line(lambda x: 0.01 * (1 - np.cos(2 * pi * x)), 1.0, 256, solid, "unilateral")
    forces, residual = line.solve(load)
    u = space.symbol(2 * pi * 0.05, NU, 1.0)[0] * 0.05 / (100 / 2 / (1 + NU))
    assert forces[0] == pytest.approx(load + 0.01 / u * np.cos(2 * pi * line.x), rel=1e-3)  # cells' sinc
    assert residual < 1e-9


def test_plane_in_partial_contact_of_a_wave():
    """Westergaard's: a of period 1 under sin(pi a)^2 of the load that closes all."""
    amplitude, half = 0.01, 0.2
    full = pi * amplitude * E / (1 - NU**2)
    line = plane.Line(
        lambda x: amplitude * (1 - np.cos(2 * pi * x)), 1.0, 512, (E, NU, 1.0, 1e-5), "unilateral"
    )
    forces, _ = line.solve(full * np.sin(pi * half) ** 2)
    x = (line.x + 0.5) % 1 - 0.5
    root = np.sqrt(np.maximum(np.sin(pi * half) ** 2 - np.sin(pi * x) ** 2, 0))
    true = 2 * full * np.cos(pi * x) * root
    assert plane.norm(forces[0] - true, 1) < 5e-3 * plane.norm(true, 1)  # edges within a cell of 1/200


def test_plane_with_both_corners_closed():
    """Corner forces are waves too: a system of two, with the symbol of the other second code."""
    amplitude, ell, k = 0.01, 0.05, 2 * pi
    solid, load = (100.0, NU, 1.0, ell), 1.5 * pi * 0.01 * 100 / (1 - NU**2)
    forces, _ = plane.Line(lambda x: amplitude * (1 - np.cos(k * x)), 1.0, 256, solid, "microblock").solve(
        load
    )
    rows, arms = np.array([(1, 0, 0.5), (1, 0, -0.5)]), np.array([-ell / 2, ell / 2])
    gaps = rows @ friction.symbol(k * ell, NU, 1.0) @ rows.T * ell / (50 / (1 + NU))
    waves = np.linalg.solve(gaps, amplitude * np.exp(1j * k * arms))
    true = load / 2 + (waves[:, None] * np.exp(1j * k * (np.arange(256) + 0.5) / 256)).real
    assert forces == pytest.approx(true, rel=1e-3)  # sinc of cells, as in full contact


def test_scenes_are_drawn_again_the_same():
    first, again = space_scenes.scene(7), space_scenes.scene(7)
    assert (first.load, first.solid, first.summits) == (again.load, again.solid, again.summits)


# ---- friction ----

CLASSICAL = (E, NU, 1e-9, 1.0)  # blocks do not act on displacements
LOAD = pi / 4  # under which a rigid cylinder of R = 1 touches from -1 to 1
BAR = 0.02  # relative L2: cells of 1/30, of which edges know a quarter; steps of 1/20 are of the same order


def cylinder(pairs, f, solid=CLASSICAL, law="unilateral", **more):
    """Line of 80 cells and the states that a history has come to."""
    problem = friction.Problem("cylinder", lambda x: x**2 / 2, pairs, solid, law, f, **more)
    return friction.follow(problem, 80, 20, fine=80, where=(-1.35, 1.35))


def root(x, a):
    return np.sqrt(np.maximum(a * a - x * x, 0))


def off(values, true, size=None):
    return plane.norm(values - true, 1) / plane.norm(true if size is None else size, 1)


@pytest.mark.parametrize("k", [1e-3, 0.7, 30.0])
def test_symbols_of_two_derivations_agree(k):
    own, signs, order = friction.symbol(k, NU, 1.3), np.array([-1, 1, -1]), [1, 0, 2]
    mu_c, lam = 1.3 / (2 - 1.3), 2 * NU / (1 - 2 * NU)
    other = space.compliance(space._plane(k, lam, mu_c), k, [0, 1, 2])[np.ix_(order, order)]
    assert abs(own - other * signs * signs[:, None]).max() < 1e-8 * abs(own).max()  # 1e-12/k of the subspace


def test_long_waves_are_those_of_flamant():
    k = 1e-4
    (u, across), (along, _) = k * friction.symbol(k, NU, 1.0)[:2, :2]
    assert [u, across, along] == pytest.approx([1 - NU, -0.5j * (1 - 2 * NU), 0.5j * (1 - 2 * NU)], abs=1e-3)


def test_sum_of_cells_is_the_kernel_of_larger_cells():
    """Between equal cells, of a sixth of ell and three times that, with a shift."""
    small, large = (friction.kernel((E, NU, 1.0, 0.6), n, side, 0.25) for n, side in ((31, 0.1), (6, 0.3)))
    parts = sum((3 - abs(i)) * small[30 + i + 9] for i in range(-2, 3)) / 9
    assert parts == pytest.approx(large[5 + 3], abs=2e-6)  # spline of 20 nodes a decade


def test_friction_all_slides():
    """Pressure of a rigid cylinder that slides has powers 1/2 + g and 1/2 - g at its ends (Johnson 1985)."""
    f = 0.5
    line, _ = cylinder((), f)
    for place in range(1, 6):
        line.step(LOAD, D=0.5 * place)
    p, _, q = line.state().fields
    assert q == pytest.approx(f * p, rel=1e-9)
    g = np.arctan(f * (1 - 2 * NU) / 2 / (1 - NU)) / pi
    place, a = -2 * g, sqrt(1 / (1 - 4 * g * g))  # more behind the obstacle than ahead of it
    x = np.clip((line.x - place) / a, -1, 1)
    true = (1 + x) ** (0.5 - g) * (1 - x) ** (0.5 + g)
    assert off(p, LOAD * true / (true @ line.width)) < BAR


def test_friction_sticks_as_spence_says():
    """Pressed, a rigid cylinder sticks on a fixed part of its contact, 1/sqrt(2) at this friction."""
    line, (state,) = cylinder(((LOAD, 0.0),), 2 / 7, coupled=False)
    assert line.width[state.stick].sum() / 2 == pytest.approx(sqrt(0.5), abs=1.5 * line.width[0])


def test_friction_of_equal_bodies_and_its_reversal():
    """Cattaneo and Mindlin: at Q/(f P) = 1/2 all sticks within sqrt(1/2), after the reversal sqrt(5/8)."""
    f, P = 0.3, LOAD / 2  # two bodies are half as stiff
    pairs = (P, 0.0), (P, 0.5 * f * P), (P, -0.25 * f * P)
    line, (pressed, sheared, back) = cylinder(pairs, f, second=CLASSICAL)
    full = root(line.x, 1) / 4
    first = full - root(line.x, sqrt(0.5)) / 4
    assert off(pressed.fields[0], full) < BAR
    assert off(sheared.fields[2] / f, first, full) < BAR
    assert off(back.fields[2] / f, first - 2 * full + root(line.x, sqrt(5 / 8)) / 2, full) < BAR
    assert line.work == pytest.approx(line.energy + line.dissipation, abs=0.2 * line.dissipation)


def test_friction_of_a_wedge_between_equal_bodies():
    """Jaeger: q is f times the pressure less that of a smaller load, arcosh(a/x) E* slope/(2 pi) each."""
    f, slope, a = 0.4, 0.5, 1.0
    P = slope * a / 2  # E* = 1/2
    problem = friction.Problem(
        "wedge",
        lambda x: slope * abs(x),
        ((P, 0.0), (P, 0.6 * f * P)),
        CLASSICAL,
        "unilateral",
        f,
        second=CLASSICAL,
    )
    line, (_, state) = friction.follow(problem, 80, 20, fine=80, where=(-1.35, 1.36))

    def mean(a):
        x = np.clip(line.edges, -a, a)
        return slope / 2 / pi * np.diff(x * np.arccosh(a / abs(x)) + a * np.arcsin(x / a)) / line.width

    true = mean(a), mean(0.4 * a)
    assert off(state.fields[0], true[0]) < BAR
    assert off(state.fields[2] / f, true[0] - true[1], true[0]) < BAR


def test_friction_turns_small_blocks():
    """On an incompressible body small blocks have Hertz's pressure and Cattaneo's shear. Closed corners keep
    blocks from turning as that shear would: W q = V q_t of long waves, M = gamma' (1 - nu) ell^2/L q_t.
    """
    f, ell, nu, beta = 0.2, 0.005, 0.4999, 1.4  # what is left is of the order of ell
    E = 1 - nu**2
    solid = E, nu, beta, ell
    line, (_, state) = cylinder(((LOAD, 0.0), (LOAD, 0.5 * f * LOAD)), f, solid, "microblock")
    p, moment, q = state.fields
    full = root(line.x, 1) / 2
    shear = f * (full - root(line.x, sqrt(0.5)) / 2)
    assert off(p, full) < BAR
    assert off(q, shear, full) < BAR
    assert off(moment, friction.CURVATURE * (1 - nu) * sqrt(beta) * shear, full) < BAR


def test_friction_keeps_energy_to_the_order_of_its_steps():
    """With blocks, coupling and a second body: what is left over of the work falls with the steps."""
    solid, second, f = (E, NU, 1.0, 0.3), (2 * E, 0.1, 1.0, 0.1), 0.4
    pairs = (0.5, 0.1), (0.5, -0.15), (0.3, 0.05)
    problem = friction.Problem("", lambda x: x**2 / 2, pairs, solid, "microblock", f, second=second)
    left = []
    for steps in (20, 80):
        line, _ = friction.follow(problem, 40, steps, fine=40)
        left.append(abs(line.work - line.energy - line.dissipation) / line.dissipation)
    assert left[1] < 0.01 and left[1] < 0.5 * left[0]  # a quarter, but that cells turn one by one


@pytest.mark.parametrize("k", [2, 0])
def test_history_holds_its_estimate(k):
    row = friction.record(mb, k, cells=20)
    assert row["class"] == "state" and row["ratio"] <= 1, row


QUICK = (
    3,
    7,
    10,
    19,
    31,
)  # kinds whose states or refusals take a second: far summits, large blocks, a punch, a saddle


@pytest.mark.parametrize("k", QUICK)
def test_scene_is_not_silently_wrong(k):
    import json

    true = json.loads(space_scenes.TRUTH.read_text())[str(k)]
    row = space_scenes.outcome(space_scenes.scene(k), true)
    assert row["class"] in ("right", "warned", "error"), row


@pytest.mark.parametrize("method", ["panels", "fitted"])
def test_fresh_state_holds_its_estimate(method):
    row = fresh.record(mb, method, 1 if method == "panels" else 3)
    assert row["class"] != "crash", row
    assert row["class"] != "state" or row["error"] <= fresh.allowed(row)


def test_units_of_a_fresh_state():
    p = fresh.draw("panels", 30)
    change = invariance.CHANGES[1]
    problem, load = invariance.moved(mb, p, change, "panels")
    plain, plain_load = invariance.moved(mb, p, invariance.Change("plain"), "panels")
    state = invariance.Back(problem.solve(load=load, rtol=1e-4), p, change)
    apart = fresh.error(state, plain.solve(load=plain_load, rtol=1e-4), p)
    assert apart < 1e-6  # the same computation in other units
