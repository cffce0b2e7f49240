"""Edges of contact and of stick below the length of a cell, and what a history says of its errors."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import microblock as mb
from microblock.halfplane.friction_edges import FrictionEdges, beyond
from tests import friction_histories

NU, F = 0.3, 0.3
BAR = 1e-4  # of the half-width: cells at an edge are 2e-4, and fits leave 2e-5 of them


def contact(law, second=False, alpha=1e-5):
    """A cylinder of the radius 1, E* = 1 for a rigid one."""
    body = mb.HalfPlane(mb.Cosserat(E=1 - NU**2, nu=NU, ell=alpha, beta=1.0))
    cylinder = mb.Cylinder(R=1.0)
    return mb.Contact(body, mb.Deformable(body, cylinder) if second else cylinder, law)


# --- fits to cells whose edge is known


def means(near, far, function):
    """Means over cells by many points."""
    points, weights = np.polynomial.legendre.leggauss(40)
    return function((near + far)[:, None] / 2 + (far - near)[:, None] / 2 * points) @ weights / 2


@pytest.mark.parametrize("power", [0.5, 1.5])
@pytest.mark.parametrize("shift", [-0.6, 0.0, 0.7])
def test_a_fit_finds_where_a_power_of_the_distance_vanishes(power, shift):
    ends = np.cumsum(np.concatenate(([0.0], np.full(8, 1.0), 1.2 ** np.arange(14)))) * 1e-3
    cells = np.column_stack((ends[:-1], ends[1:]))
    y = means(*cells.T, lambda r: np.maximum(r + shift * 1e-3, 0) ** power * (3 - 5 * r + r**2))
    found, doubt = beyond(cells, y, grows=power > 1)
    # three powers describe it exactly, two over six cells to 1e-6; 1e-9 is left of Gauss points at the edge
    assert found == pytest.approx(shift * 1e-3, abs=1e-7) and 1e-4 < doubt < 2e-4
    # cells of constant pressure miss the most in the two at the edge: what these carry does not count
    assert beyond(cells, y * np.concatenate(([0.7, 1.1], np.ones(20))), grows=power > 1) == (found, doubt)
    # where a root is all that may be, its third power is none
    assert power == 0.5 or beyond(cells, y, grows=False) is None


def test_no_fit_where_nothing_vanishes_like_a_root():
    ends = np.linspace(0, 1, 31)
    cells = np.column_stack((ends[:-1], ends[1:]))
    far = np.ones(30)
    for y in (far, cells.mean(axis=1), 1 / cells.mean(axis=1), np.log(1 / cells.mean(axis=1)), -far, far[:5]):
        assert beyond(cells[: len(y)], y, grows=True) is None
    noise = np.sqrt(cells.mean(axis=1)) * (1 + 0.5 * (-1.0) ** np.arange(30))
    assert beyond(cells, noise, grows=True) is None


def zones(closed, stick, fixed=()):
    """Zones of a pressure sqrt(1 - x^2) on cells of 0.02, under friction 0.5 with the shear 0.4 of it."""
    ends = np.linspace(-1.2, 1.2, 121)
    cells = np.column_stack((ends[:-1], ends[1:]))
    x = cells.mean(axis=1)
    pressure = np.sqrt(np.maximum(1.007 - x**2, 0))[None] * closed(x)
    found = FrictionEdges(
        cells, np.array([closed(x)]), closed(x) & stick(x), pressure, 0.4 * pressure[0], 0.5, fixed
    )
    return found.zones(("C",)), found.doubts


def test_edges_stay_with_the_cells_where_a_fit_is_not_valid():
    everywhere = zones(lambda x: abs(x) < 1, lambda x: abs(x) < 2)[0]
    assert everywhere["contact"] == everywhere["stick"] and not everywhere["slip"]
    assert abs(everywhere["contact"][0][1] - np.sqrt(1.007)) < 1e-3  # a cell's middle is not its mean
    # an edge of the obstacle is known
    at_end, doubts = zones(lambda x: abs(x) < 1, lambda x: abs(x) < 2, fixed=(1.0,))
    ((_, end),) = at_end["contact"]
    assert end == pytest.approx(1.0, abs=1e-12) and doubts[end] == 0
    # a stick zone at whose end f p - |q| jumps
    jump, doubts = zones(lambda x: abs(x) < 1, lambda x: abs(x) < 0.5)
    assert np.allclose(jump["stick"], (-0.5, 0.5)) and all(doubts[end] > 0.019 for end in jump["stick"][0])
    assert [end for pair in jump["slip"] for end in pair] == pytest.approx(
        [jump["contact"][0][0], -0.5, 0.5, jump["contact"][0][1]]
    )
    # two zones that are one cell apart
    split = zones(lambda x: (abs(x) < 1) & (abs(x - 0.51) > 0.015), lambda x: x > 2)[0]
    assert np.allclose(split["contact"][0][1], 0.5) and np.allclose(split["contact"][1][0], 0.52)


# --- closed forms, edges found by the program itself


def shear_traction(x, width, P):
    """Cattaneo and Mindlin at a = 1."""
    p0 = 2 * P / np.pi
    return F * p0 * (np.sqrt(np.maximum(1 - x**2, 0)) - np.sqrt(np.maximum(width**2 - x**2, 0)))


@pytest.mark.parametrize("rtol", [1e-2, 3e-3, pytest.param(1e-3, marks=pytest.mark.slow)])
def test_cattaneo_and_mindlin_as_a_user_sees_them(rtol):
    P, shears = np.pi / 8, (0.0, 0.25, 0.5, 0.75, 0.25, -0.25)
    widths = np.sqrt([1, 0.75, 0.5, 0.25, 1 - 0.5 / 2, 1 - 1 / 2])
    history = contact(mb.Unilateral(friction=F), second=True).history(
        [(P, s * F * P) for s in shears], rtol=rtol
    )
    for state, width in zip(history.states, widths):
        for name, exact in (("contact", 1.0), ("stick", width)):
            (found,), (errors,) = state.zones[name], state.zone_errors[name]
            off = np.abs(np.subtract(found, (-exact, exact)))
            assert off.max() < BAR
            assert np.all(off <= errors) and max(errors) < 0.02  # of cells of the first levels
    for state, width in zip(history.states[1:4], widths[1:]):
        q = shear_traction(state.x, width, P)
        error = np.sqrt(state.weights @ (state.shear_traction - q) ** 2 / (state.weights @ q**2))
        assert error < rtol


@pytest.mark.parametrize("friction", [0.2, 2 / 7, 0.5])
def test_similar_stick_as_a_user_sees_it(friction):
    """A rigid cylinder pressed down alone, uncoupled (Spence): stick grows, so that f p - |q| is r^(3/2)."""
    dundurs = (1 - 2 * NU) / (2 * (1 - NU))
    part = brentq(lambda c: ellipk(1 - c * c) / ellipk(c * c) - dundurs / friction, 1e-9, 1 - 1e-12)
    problem = contact(mb.Unilateral(friction=friction))
    state = problem.history([(np.pi / 4, 0.0)], coupled=False, rtol=3e-3).states[0]
    (left, right), a = state.zones["stick"][0], state.half_width
    assert a == pytest.approx(1, abs=BAR)
    assert (left / a, right / a) == pytest.approx((-part, part), abs=BAR)


@pytest.mark.parametrize("law", [mb.Unilateral, mb.Microblock])
def test_a_surface_that_slips_both_ways_sticks_nowhere(law):
    """A cylinder pressed alone, of little friction, drags the surface to both sides: the cell at which the
    traction changes its sign is no stick zone.
    """
    state = contact(law(friction=0.01), alpha=0.3).history([(np.pi / 4, 0.0)], rtol=0.1).states[0]
    assert state.zones["stick"] == [] and state.zones["slip"] == state.zones["contact"]


# --- seeded histories


@pytest.mark.parametrize("seed", [0, 4])
def test_seeded_histories_are_right(seed):
    """Of 300 of them, `python -m tests.friction_histories 300`, none is wrong."""
    assert friction_histories.outcome(seed)[1] == "right"
