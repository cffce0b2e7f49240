"""Histories with friction say what is true: estimates, residuals, advice, and the method that was taken."""

import numpy as np
import pytest

import microblock as mb
from microblock.errors import at_least, out_of_reach


def test_figures_of_messages_are_not_below_what_they_stand_for():
    """A figure rounded down, .010107 to "1.0e-02", would be refused again when it is asked for."""
    values = np.exp(np.random.default_rng(27).uniform(-35, 5, 200))
    for value in (0.010107, 0.01, 0.0999, 1e-13, *values):
        assert value <= float(at_least(value)) <= 1.1 * value  # two digits
    assert at_least(0.01) == "1.0e-02"
    failure = out_of_reach(1e-3, 0.010107)
    assert failure.rtol_reached == 0.011 and "ask for rtol=1.1e-02" in str(failure)
    failure = out_of_reach(1e-3, 1.7)  # no rtol is that large
    assert failure.rtol_reached is None and "ask for" not in str(failure)
