"""Limits and symmetries on the contact line, by the numbers of the report's table; what other tests hold
already is not repeated.
"""

import numpy as np
import pytest

import microblock as mb
from cases.report.report import TABLES
from cases.studies import limits_table


@pytest.mark.parametrize("law", [mb.Microblock(), mb.Unilateral()])
def test_pressure_tends_to_the_hertz_ellipse(law):
    pressures, edges = limits_table.hertz_distances(law)
    # first order in alpha, next terms alpha^2 log(alpha) or so: 1 % at these alphas
    assert limits_table.rate(pressures) == pytest.approx(1, abs=0.02) and limits_table.rate(
        edges
    ) == pytest.approx(1, abs=0.02)
    assert pressures[-1] < 0.005


def test_units_at_fixed_radius_over_width():
    assert limits_table.units() < 1e-9  # exact but for edges found to 1e-9 of the pressure


def test_product_of_psi0_and_radius_alone_is_not_enough():
    """The levers 1 +- psi0 carry psi0 itself: what is left falls like psi0."""
    changes = limits_table.lever_changes()
    assert limits_table.rate(changes) == pytest.approx(1, abs=0.05)  # psi0^2 next, at psi0 = 0.025
    assert changes[0] > 1e-3  # and it is there


def test_mirrored_blocks_mirror_the_state_to_the_edges_tolerance():
    assert limits_table.mirrored() < 1e-9  # the tolerance of the edges


def test_loads_up_and_down_give_one_state():
    # edges stop at a step of 1e-9, next to which the pressure is a square root: a few 1e-9 in L2
    assert limits_table.up_and_down() < 5e-8


def test_energy_between_two_loads_is_the_work():
    assert abs(limits_table.work()) < 1e-12  # Gauss rule on analytic d(P): rounding of the panels' system


def test_table_is_in_the_report():
    rows = TABLES["limits_table"]()
    assert len(rows) == 12 and all(np.isfinite(row["value"]) and row["because"] for row in rows)
