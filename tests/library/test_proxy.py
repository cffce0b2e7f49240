"""Functions known by their values: singular points are found where they are, and no others."""

import numpy as np
import pytest

from microblock.model.proxy import TooRough, proxy

FIRST = np.linspace(-0.5, 0.51, 76)
INF, NAN = np.inf, np.nan
FUNCTIONS = {  # height, places of singular points, jumps of the slope there, pieces at most
    "parabola": (lambda x: x**2, [], [], 1),
    "flat bottom": (lambda x: x**4, [], [], 75),
    "level": (lambda x: np.full(np.shape(x), 3.0), [], [], 1),
    "waves": (lambda x: 1 - np.cos(60 * x), [], [], 30),  # ten waves, three pieces each at most
    "hyperbola": (lambda x: np.sqrt(1e-4 + x**2), [], [], 75),
    **{
        f"tip {p} at {a:.4f}": (lambda x, p=p, a=a: np.abs(x - a) ** p, [a], [0], 99)
        for p in (1.2, 1.5, 2.5, 3.0)
        for a in (0.0, 0.0123)
    },
    # at edges of the first intervals both sides are polynomials, and no interval has the point inside
    **{
        f"edge {p} at {a:.4f}": (lambda x, p=p, a=a: 0.1 * np.abs(x - a) ** p, [a], [0.2 * (p == 1)], 99)
        for p in (1, 3)
        for a in FIRST[[1, len(FIRST) // 2, -2]]
    },
    "corner": (lambda x: 0.1 * np.abs(x - 0.0123) + x**2, [0.0123], [0.2], 99),
    "trough": (lambda x: np.maximum(x**2, 0.01) + 5, [-0.1, 0.1], [0.2, 0.2], 99),
    # terms are larger than the function is: no noise
    "exponential": (lambda x: 0.1 * (np.exp(np.abs(x)) - 1), [0.0], [0.2], 99),
    "ends": (lambda x: np.where(np.abs(x) < 0.3, np.abs(x) ** 3, INF), [-0.3, 0, 0.3], [NAN, 0, NAN], 99),
    "step": (lambda x: np.where(x < 0.1, x**2, x**2 + 0.01), [0.1], [NAN], 99),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_singular_points_are_found_where_they_are(name):
    height, places, jumps, pieces = FUNCTIONS[name]
    found = proxy(height, FIRST)
    # what |x|^p changes over d is rounding beside the rest of an interval of some d: 1e-8 of it for p = 3
    assert found.singular == pytest.approx(places, abs=1e-7) and len(found.lengths) <= pieces
    # differences of 1e-6
    assert found.jumps == pytest.approx(jumps, rel=1e-6, abs=1e-9, nan_ok=True)


def test_a_pit_narrower_than_the_first_intervals_has_pieces_of_its_width():
    found = proxy(lambda x: x**2 + 1e-4 * np.exp(-(((x - 0.1) / 0.002) ** 2)), FIRST)
    near = np.abs((found.edges[1:] + found.edges[:-1]) / 2 - 0.1) < 0.004
    # 14 points on a few widths of a Gaussian
    assert found.lengths[near].max() < 0.01 < found.lengths[~near].max() and len(found.singular) == 0


def test_noise_is_told_from_a_function():
    with pytest.raises(TooRough, match="quickly"):
        proxy(lambda x: x**2 + 1e-6 * np.sin(1e9 * x), FIRST)
