"""Samples: the polygon through them, the smooth curve, and the formula behind both."""

import numpy as np
import pytest

import microblock as mb
from cases import samples


def test_a_curve_through_samples_is_the_formula_and_a_polygon_spikes():
    states = samples.solve()
    spline, polygon = states["spline"], states["polygon"]
    formula = spline.problem.with_(obstacle=lambda x: x**2 / 20 + 2e-4 * np.cos(40 * x)).solve(load=1.0)
    size = np.linalg.norm(formula.pressure)
    # cubic splines of 61 samples, eight to a ripple, are off by 1e-3 of it
    assert np.linalg.norm(spline.pressure - formula.pressure) < 3e-3 * size
    assert np.linalg.norm(polygon.pressure - formula.pressure) > 0.05 * size
    assert polygon.weights @ polygon.pressure == pytest.approx(1.0, rel=1e-9)
    # twice the samples: half the spacing, and slope discontinuities half as large
    x = np.linspace(-0.6, 0.6, 121)
    finer = mb.Obstacle.from_samples(x, x**2 / 20 + 2e-4 * np.cos(40 * x))
    closer = spline.problem.with_(obstacle=finer).solve(load=1.0)
    wrong = [np.linalg.norm(state.pressure - formula.pressure) for state in (closer, polygon)]
    assert wrong[0] < 0.6 * wrong[1]
