"""Periodic contact: Westergaard's closed form, and full closure of microblocks."""

import numpy as np
import pytest

from cases import wave
from microblock.halfplane.kernels import symbol


def test_all_corners_close_at_the_load_of_the_closed_form():
    """Closed gaps are cosines and sines: the waves p1 and m1 of p and m follow from the kernels, and corner
    pressures (p -+ m)/2 >= 0 ask for a mean of at least hypot(p1, m1).
    """
    state = wave.solve(loads=1)["microblocks"][0]
    k, half = 2 * np.pi, np.pi * state.solid.ell
    (U,), (V,), (W,) = symbol(state.solid, np.array([k]))
    waves = wave.AMPLITUDE * np.array((np.cos(half), np.sin(half)))
    closure = np.hypot(*np.linalg.solve([[U, V], [V, W]], waves))
    assert closure == pytest.approx(1.33, abs=0.005)  # as the script says
    for share, closed in ((0.998, False), (1.002, True)):
        states = wave.solve(last=share * closure, loads=1)["microblocks"]
        assert (wave.in_contact(states, np.min) == [1]) is closed
