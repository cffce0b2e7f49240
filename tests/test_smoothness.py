"""Singular points of heights that come as mere functions: found where they are, and none where there are none."""

import numpy as np
import pytest

from microblock.smoothness import kinks

SMOOTH = {"parabola": lambda x: x**2, "flat bottom": lambda x: x**4, "waves": lambda x: 1 - np.cos(60*x),
          "hyperbola": lambda x: np.sqrt(1e-4 + x**2), "level": lambda x: np.full(np.shape(x), 3.0)}


@pytest.mark.parametrize("height", SMOOTH.values(), ids=SMOOTH)
def test_smooth_heights_have_none(height):
    assert kinks(height, -0.5, 0.51) == ((), ())


@pytest.mark.parametrize("power", [1.2, 1.5, 2.5, 3.0])
@pytest.mark.parametrize("place", [0.0, 0.0123])
def test_tips_are_found_where_they_are_and_have_no_jump(power, place):
    (found,), (jump,) = kinks(lambda x: np.abs(x - place)**power, -0.5, 0.51)
    # what |x|^p changes over d is rounding beside the rest of an interval of some d: 1e-8 of the interval for p = 3
    assert found == pytest.approx(place, abs=1e-7) and jump == 0


def test_jumps_of_the_slope_are_measured():
    (found,), (jump,) = kinks(lambda x: 0.1*np.abs(x - 0.0123) + x**2, -0.5, 0.51)
    assert found == pytest.approx(0.0123, abs=1e-9) and jump == pytest.approx(0.2, rel=1e-6)      # differences of 1e-6
    places, jumps = kinks(lambda x: np.maximum(x**2, 0.01) + 5, -0.5, 0.51)
    assert places == pytest.approx((-0.1, 0.1), abs=1e-9) and jumps == pytest.approx((0.2, 0.2), rel=1e-6)


def test_rough_heights_have_too_many_to_name():
    assert kinks(lambda x: np.interp(x, np.linspace(-1, 1, 81), np.linspace(-1, 1, 81)**2), -0.5, 0.51) == ((), ())


def test_obstacles_that_end_are_looked_at_where_they_are():
    assert kinks(lambda x: np.where(np.abs(x) < 0.3, np.abs(x)**3, np.inf), -0.5, 0.51)[1] == (0.0,)
