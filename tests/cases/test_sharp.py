"""Wedge and punch: closed forms, scaling laws, and fitted elements and cells beside the panels."""

import math

import numpy as np
import pytest

import microblock as mb
from cases import sharp
from microblock.halfplane.kernels import short_waves
from microblock.model.intervals import distance_to_ends
from tests import closed_forms

FINE = np.linspace(-1.2, 1.2, 40001) + 1e-6  # between the nodes of all, and not where pressures are infinite


def apart(state, other, x=FINE):
    """Relative L2 distance of two pressures, the largest of the corners; near the ends of the obstacle with
    the distance from them as weight.
    """
    ends, law = getattr(state.obstacle, "ends", ()), state.law
    weights = np.sqrt(distance_to_ends(x, ends, state.problem.blocks.shifts))
    wrong = [state.pressure_at(x, corner) - other(x, corner) for corner in law.corners]
    return max(map(np.linalg.norm, weights * wrong)) / np.linalg.norm(weights * state.pressure_at(x))


def test_the_forms_of_the_script_are_those_of_the_limits():
    x = np.linspace(-0.99, 0.99, 100)
    punches = {math.inf: closed_forms.punch(x, 2.0, 1.0)}
    for load in (0.5, 0.9, 1.9):  # over that which presses all of the width: leaning, nearly on it, beyond
        size = math.pi / 2 * 0.01 * load
        punches[load] = closed_forms.tilted_punch(x, size, 1, 0.01, 1)[0] / (size / 2)
    for load, exact in punches.items():
        assert sharp.classical_punch(x, load) == pytest.approx(exact, rel=1e-12)
    assert sharp.classical_wedge(x, 1.0) == pytest.approx(closed_forms.wedge(x, 1.0, 1.0), rel=1e-12)


@pytest.mark.parametrize(
    "obstacle, load, exact, order",
    [
        (mb.Cylinder(1.0), math.pi / 4, closed_forms.hertz, 1),
        (mb.Wedge(0.01), 0.01, closed_forms.wedge, 1 / 2),
        (mb.Punch(1.0), 1.0, closed_forms.punch, 1 / 4),
    ],
)
def test_orders_of_uniform_cells(obstacle, load, exact, order):
    """They follow from what a cell misses: a root, a logarithm, and an inverse root in the weighted norm."""
    body, errors = mb.HalfPlane(mb.Cosserat(E=0.91, nu=0.3, ell=1.0, beta=1e-10)), []
    for nodes in (1000, 4000):
        cells = mb.Cells(nodes=nodes, window=(-1.25, 1.25))
        state = mb.Contact(body, obstacle, mb.Unilateral(), cells).solve(load=load)
        form = exact(state.x, load, 1.0)
        weights = np.sqrt(np.maximum(1 - state.x**2, 0)) ** (order == 1 / 4)
        errors.append(math.sqrt(weights @ (state.pressure - form) ** 2 / (weights @ form**2)))
    assert math.log(errors[0] / errors[1], 4) == pytest.approx(order, abs=0.03)


def wedge(load, rtol=1e-5, nu=0.3, beta=1.0):
    problem = mb.Contact(sharp.body(1.0, nu, beta), mb.Wedge(0.01), mb.Microblock())
    return problem.solve(load=0.01 * load, rtol=rtol)


def test_zones_under_the_wedge_meet_at_one_load():
    meeting = sharp.solve(loads=(1.0,), rtol=1e-2)["zones meet at load"]
    # 3.843819(04): by the search for the load of a vanishing gap, and by cells on either side
    assert meeting == pytest.approx(3.84381904, rel=1e-6)
    assert [len(wedge(share * meeting).zones["contact"]) for share in (0.99, 1.01)] == [2, 1]


@pytest.mark.parametrize("nu, beta", [(0.3, 1.0), (0.45, 0.2)])
def test_light_loads_leave_each_corner_alone(nu, beta):
    """Over distances far below ell a corner has the compliance c_u + c_phi instead of 2/E*; the other one
    tilts its surface by load/ell, so that the width is off like load^2.
    """
    off = []
    for load in (0.04, 0.02):
        state = wedge(load, 1e-6, nu, beta)
        ((left, right),) = state.zones["A"]
        assert (left + right) / 2 == pytest.approx(0.5, abs=load / 50)  # half a block beside the wedge's edge
        off.append((right - left) / 2 / (load / 4 * sum(short_waves(state.solid))) - 1)
    assert abs(off[1]) < 0.3 * abs(off[0]) < 3e-3


def test_heavy_loads_are_classical():
    """The half-width exceeds the classical one by a share of ell that settles like ell/a: 0.193, 0.201."""
    beyond = [wedge(load).half_width - load for load in (30.0, 60.0)]
    assert 0.1 < beyond[1] < 0.3 and beyond[1] == pytest.approx(beyond[0], rel=0.08)


@pytest.mark.parametrize(
    "law, beta, ell, tilt, load, rtol",
    [
        (mb.Unilateral(), 1e-10, 0.3, 0.0, 0.02, 3e-3),
        # an edge just reaches an end: the search settles late, at 50 000 unknowns whatever rtol is
        pytest.param(mb.Unilateral(), 1e-10, 0.3, 0.01, math.pi / 2 * 0.01, 1e-2, marks=pytest.mark.nightly),
        (mb.Unilateral(), 1.0, 0.3, 0.01, math.pi / 4 * 0.01, 3e-3),
        (mb.Microblock(), 1.0, 0.3, 0.0, 0.02, 3e-3),
        (mb.Microblock(1.2e-6), 1.0, 1.0862, 1.9e-5, 1.0, 3e-3),
    ],
)
def test_elements_keep_their_promise_under_punches(law, beta, ell, tilt, load, rtol):
    """On refinement levels of equal depth the error next to an end was up to 12 times the estimate."""
    solid = mb.Cosserat(E=(0.91 if load < 1 else 1.82), nu=0.3, ell=ell, beta=beta)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Punch(1.0, tilt), law)
    state, elements = problem.solve(load=load, rtol=1e-4), problem.with_(body=mb.Block(solid))
    elements = elements.solve(load=load, rtol=rtol)
    assert apart(state, elements.pressure_at) <= elements.error_estimate + 1e-4 <= rtol + 1e-4


@pytest.mark.parametrize("alpha", [0.1, 0.07, 0.0125])
def test_rims_of_a_flat_punch_are_as_wide_as_blocks(alpha):
    """A rim of one corner, 0.16 ell wide, at any size; cells beside it, which resolve 1/sqrt(r) slowly."""
    state = mb.Contact(sharp.body(alpha), mb.Punch(1.0), mb.Microblock()).solve(load=0.01, rtol=1e-4)
    (left, _), (rim, right) = state.zones["A"]
    assert (left, right) == pytest.approx((alpha / 2 - 1, alpha / 2 + 1))
    assert rim - (1 - alpha / 2) == pytest.approx(0.16 * alpha, rel=0.05)  # 0.155 to 0.168
    cells = state.problem.with_(method=mb.Cells(nodes=8000, window=(-1.2, 1.2))).solve(load=0.01)
    pressures = {corner: iter([values]) for corner, values in cells.pressures.items()}
    assert apart(state, lambda x, corner: next(pressures[corner]), cells.x) <= cells.error_estimate < 0.2


@pytest.mark.parametrize("tilt, psi0, alpha", [(5.9e-4, -7.6e-5, 0.0312), (0.9, 0.011, 0.01435)])
def test_two_edges_at_ends_of_the_punch_stay_there(tilt, psi0, alpha):
    """Both were within a cell of each other; one was moved inwards, and no zones fitted."""
    solid = mb.Cosserat(E=1.82, nu=0.3, ell=alpha, beta=1.0)
    problem = mb.Contact(mb.HalfPlane(solid), mb.Punch(1.0, tilt), mb.Microblock(psi0))
    zones = problem.solve(load=1.0, rtol=1e-3).zones
    edges = zones["A"][0][0], zones["B"][0][0]
    assert edges == pytest.approx((alpha / 2 - 1, -alpha / 2 - 1), abs=1e-12)
