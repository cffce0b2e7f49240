"""The second codes of `tests/judges` against closed forms, and a handful of the scenes that they judge."""

from math import inf, pi, sqrt

import numpy as np
import pytest

import microblock as mb
from tests.judges import fresh, invariance, plane, space, space_scenes

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


def test_scenes_are_drawn_again_the_same():
    first, again = space_scenes.scene(7), space_scenes.scene(7)
    assert (first.load, first.solid, first.summits) == (again.load, again.solid, again.summits)


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
