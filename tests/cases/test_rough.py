"""Rough contact: the estimate of cells, panels for aligned blocks, mirror images, and what seeds show."""

import numpy as np
import pytest

from cases import rough


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
