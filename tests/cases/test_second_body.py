"""The case two_bodies: its options, its units, and what its picture says."""

import numpy as np
import pytest

from cases.scenes import hertz, two_bodies


def test_a_rigid_second_body_is_that_of_hertz():
    """The same problem in the same units, but for rounding."""
    (one,) = two_bodies.result(two_bodies.Parameters(second=("rigid",)))["states"]
    (other,) = hertz.result(hertz.Parameters())["states"]
    for name in ("half_width", "pressure_max", "micromoment_max"):
        assert one[name] == pytest.approx(other[name], rel=1e-9)
    assert one.keys() == other.keys()


def test_in_units_of_both_bodies_small_blocks_are_hertz():
    """The second body is classical, blocks are a hundredth of the contact: 1e-2 is left."""
    given = two_bodies.Parameters(second=("50", "0.2", "0", "0.1"), alpha=0.01)
    (state,) = two_bodies.result(given)["states"]
    assert state["half_width"] == pytest.approx(1, abs=1e-2)
    assert state["pressure_centre"] == pytest.approx(1, abs=1e-2)


def test_kinks_of_the_pressure_come_back_a_block_away():
    """The slope of the pressure jumps where full contact ends, and a block away on either side."""
    (state,) = two_bodies.solve(two_bodies.Parameters(rtol=1e-5))
    a = two_bodies.Parameters().a_Hz
    edge = state.zones["full"][0][1] / a

    def bend(x):
        p = state.pressure_at(a * (x + np.array((-3e-3, 0.0, 3e-3))))
        return abs(p[0] - 2 * p[1] + p[2])

    quiet = max(bend(x) for x in (edge - 0.12, edge + 0.1))
    assert all(bend(edge + way) > 10 * quiet for way in (0.0, 0.25, -0.25))
