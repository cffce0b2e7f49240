"""Obstacles as users hand them over, drawn by program, beside a judge of its own; and the judge itself."""

import numpy as np
import pytest

from cases.benchmarks.verification import doors, judging


def test_the_judge_knows_hertz_a_punch_and_westergaard():
    edges = np.linspace(-1.5, 1.5, 301)
    middles = (edges[1:] + edges[:-1]) / 2
    # R = 1/2, E* = 1: P = pi/2 for a = 1
    p = doors.pressed(lambda x: x**2, edges, np.pi / 2, 1.0)
    assert p == pytest.approx(np.sqrt(np.maximum(1 - middles**2, 0)), abs=0.02)  # cells of .01 at the edge
    p = doors.pressed(lambda x: np.where(abs(x) < 1, 0.0, np.inf), edges, np.pi, 1.0)
    inside = abs(middles) < 0.9
    assert p[inside] == pytest.approx(1 / np.sqrt(1 - middles[inside] ** 2), rel=0.01)
    edges = np.linspace(0, 1, 257)
    middles = (edges[1:] + edges[:-1]) / 2
    p = doors.pressed(lambda x: 1 - np.cos(2 * np.pi * x), edges, 1.5 * np.pi, 1.0, period=1.0)
    # under more than the load pi that closes a wave of the amplitude 1
    assert p == pytest.approx(np.pi * (1.5 + np.cos(2 * np.pi * middles)), rel=1e-3)


# known: a height that writes into its argument beside its own ends; a piece at 1e5 whose ends are named
@pytest.mark.nightly(300, 36, 56)
def test_what_users_hand_over_is_answered_or_refused_truly(seed):
    row = judging.outcome(doors.case(seed))
    assert row["class"] in ("right", "slow"), row
