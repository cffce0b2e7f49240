"""Contact that nobody looked at: grooves and lands, and teeth between the unknowns of every method."""

import numpy as np
import pytest

import microblock as mb
from cases.benchmarks.verification import named
from microblock.halfplane.line_solver import LineSolver

SOLID = mb.Elastic(E=100, nu=0.3)
HALF_PLANE = mb.HalfPlane(SOLID)
EDGE = 0.2 / (0.5 + np.sqrt(0.25 + 0.02))  # |x| at which the two surfaces below meet, .19615


def groove(x):
    return np.maximum(x**2 / 20, 0.1 - 0.5 * np.abs(x))


LANDS = mb.Obstacle.from_samples([-4, -1, -0.999, 0.999, 1, 4], [0, 0, 0.1, 0.1, 0, 0])


def two_flat_punches(x, load):
    """Pressure of two rigid flat punches 1 < abs(x) < 4 that come down together."""
    return load * np.abs(x) / (np.pi * np.sqrt((x**2 - 1) * (16 - x**2)))


# ---- a groove


@pytest.mark.parametrize("method", [mb.Panels(order=8), mb.Panels(), None])
def test_a_groove_parts_the_contact(method):
    """A single zone of half-width .582 has p(.25) = 11.05 and pulls at the groove."""
    state = mb.Contact(HALF_PLANE, groove, mb.Unilateral(), method).solve(load=1.0)
    assert len(state.zones["contact"]) == 2 and state.residual < 1e-3
    assert state.pressure_at(0.25) == pytest.approx(2.676, abs=1e-3)  # all digits of the reference


@pytest.mark.parametrize("order", [6, 8, 12])
def test_loads_of_a_groove_by_a_named_order_and_one_after_the_other_agree(order):
    problem = mb.Contact(HALF_PLANE, groove, mb.Unilateral(), mb.Panels(order=order))
    loads = [5.0, 3.0, 1.0, 0.2]
    for alone, state in zip(map(problem.solve, loads), problem.states(loads)):
        # edges are fitted to 1e-9 of the pressure, and rounding leaves some more at the tips
        assert np.ravel(alone.zones["contact"]) == pytest.approx(np.ravel(state.zones["contact"]), abs=1e-7)


def test_a_groove_with_named_kinks():
    """It took 25 s to be refused."""
    named = mb.Obstacle(groove, kinks=(-EDGE, 0.0, EDGE))
    state = mb.Contact(HALF_PLANE, named, mb.Unilateral()).solve(load=0.2)
    alone = mb.Contact(HALF_PLANE, groove, mb.Unilateral()).solve(load=0.2)
    assert state.method == "panels" and state.error_estimate < 1e-3
    # places of kinks that are not named are found to some 1e-12, which a tip magnifies
    assert np.ravel(state.zones["contact"]) == pytest.approx(np.ravel(alone.zones["contact"]), abs=1e-6)


# ---- lands


@pytest.mark.parametrize("method", [None, mb.Panels(order=8)])
@pytest.mark.parametrize("load", [1e-4, 1e-2, 1.0])
def test_two_flat_lands(load, method):
    """The flanks are so steep that the contact ends at the edges of the lands, as far as numbers tell."""
    state = mb.Contact(HALF_PLANE, LANDS, mb.Unilateral(), method).solve(load=load)
    assert state.zones["contact"] == [(-4.0, -1.0), (1.0, 4.0)]
    x = np.array([-3.99, -3.0, -1.01, 1.2, 2.5])
    tolerance = 1e-6 if method is None else 1e-3  # of order 14 and 8, where panels are a third of a land
    assert state.pressure_at(x) == pytest.approx(two_flat_punches(x, load), rel=tolerance)


def test_lands_whose_flanks_are_touched():
    """The contact goes on by (K0/(2 K))^2 over the edge, K0 of the punch and K of the kink of slope 1."""
    obstacle = mb.Obstacle.from_samples([-4, -1, -0.9, 0.9, 1, 4], [0, 0, 0.1, 0.1, 0, 0])
    state = mb.Contact(HALF_PLANE, obstacle, mb.Unilateral()).solve(load=0.3)
    punch = 0.3 / (np.pi * np.sqrt(2 * 15))
    beyond = (punch / (2 * SOLID.E_star / (2 * np.pi))) ** 2
    assert 1 - state.zones["contact"][1][0] == pytest.approx(beyond, rel=1e-3)


def test_two_flats_with_a_notch():
    """11 samples took 24 s, and then cells that had no estimate to speak of."""
    notch = mb.Obstacle.from_samples(np.arange(11.0), np.where(np.arange(11) == 5, 4.5, 0.0))
    state = mb.Contact(HALF_PLANE, notch, mb.Unilateral()).solve(load=1.0)
    assert state.method == "panels" and state.error_estimate < 1e-3 and state.unknowns < 1000
    left, right = state.zones["contact"]
    assert left == pytest.approx((0.0, 4.0), abs=1e-6) and right == pytest.approx((6.0, 10.0), abs=1e-6)


# ---- a tooth between cells


def tooth(x):
    """A tooth of radius 1e-3 beside a cylinder, both as low: it carries a quarter of the load."""
    return np.minimum((x + 3) ** 2 / 200, 500 * (x - 3.0123) ** 2)


def test_cells_do_not_hold_an_rtol_that_misses_a_tooth(monkeypatch):
    """On 512 cells the tooth carried nothing at an estimate of .019; some 1e6 see it, in a minute."""
    monkeypatch.setattr(LineSolver, "most", 2**13)
    sharp = lambda x: np.minimum((x + 3) ** 2 / 200, 20 * np.abs(x - 3.0123))  # noqa: E731
    ground = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1))
    with pytest.raises(mb.NotConverged):
        mb.Contact(ground, sharp, mb.Unilateral(), mb.Cells()).solve(load=1.0, rtol=5e-2)


@pytest.mark.parametrize("cells", [mb.Cells(nodes=700, window=(-12, 6)), mb.Cells(nodes=600)])
def test_a_number_of_cells_that_misses_a_tooth_says_so(cells):
    state = mb.Contact(HALF_PLANE, tooth, mb.Unilateral(), cells).solve(load=1.0)
    (words,) = [words for words in state.warnings if "between cells" in words]
    assert "x = 3.012" in words and state.pressure_at(3.0123) == 0


def test_cells_without_a_tooth_do_not_speak_of_one():
    state = mb.Contact(HALF_PLANE, mb.Cylinder(R=100), mb.Unilateral(), mb.Cells(nodes=700)).solve(load=1.0)
    assert not [words for words in state.warnings if "between" in words]


# ---- named discretisations


@pytest.mark.nightly(200)
def test_a_named_discretisation_is_verified(seed):
    """Load, complementarity between the unknowns and equilibrium hold, or a warning or an error says so."""
    name, words, off = named.outcome(seed)
    assert name in ("right", "warned", "error"), (words, off)
