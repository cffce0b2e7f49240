"""Functions known by their values: pieces, singular points and edges are found where they are, and none
where there are none."""

import numpy as np
import pytest

from microblock.model.proxy import TooRough, proxy

FIRST = np.linspace(-0.5, 0.51, 76)
SMOOTH = {
    "parabola": lambda x: x**2,
    "flat bottom": lambda x: x**4,
    "waves": lambda x: 1 - np.cos(60 * x),
    "hyperbola": lambda x: np.sqrt(1e-4 + x**2),
    "level": lambda x: np.full(np.shape(x), 3.0),
}


@pytest.mark.parametrize("height", SMOOTH.values(), ids=SMOOTH)
def test_smooth_heights_have_no_singular_points(height):
    assert len(proxy(height, FIRST).singular) == 0


@pytest.mark.parametrize("name, pieces", [("parabola", 1), ("level", 1), ("waves", 30)])
def test_pieces_are_as_many_as_a_function_needs(name, pieces):
    found = proxy(SMOOTH[name], FIRST)
    assert len(found.lengths) <= pieces  # of 75 at first; ten waves, three pieces each at most


def test_a_pit_narrower_than_the_first_intervals_has_pieces_of_its_width():
    found = proxy(lambda x: x**2 + 1e-4 * np.exp(-(((x - 0.1) / 0.002) ** 2)), FIRST)
    near = np.abs((found.edges[1:] + found.edges[:-1]) / 2 - 0.1) < 0.004
    # 14 points on a few widths of a Gaussian
    assert found.lengths[near].max() < 0.01 < found.lengths[~near].max()
    assert len(found.singular) == 0


@pytest.mark.parametrize("power", [1.2, 1.5, 2.5, 3.0])
@pytest.mark.parametrize("place", [0.0, 0.0123])
def test_tips_are_found_where_they_are_and_have_no_jump(power, place):
    found = proxy(lambda x: np.abs(x - place) ** power, FIRST)
    # what |x|^p changes over d is rounding beside the rest of an interval of some d: 1e-8 of the interval
    # for p = 3
    assert found.singular == pytest.approx([place], abs=1e-7) and found.jumps.tolist() == [0]


def test_jumps_of_the_slope_are_measured():
    found = proxy(lambda x: 0.1 * np.abs(x - 0.0123) + x**2, FIRST)
    # differences of 1e-6
    assert found.singular == pytest.approx([0.0123], abs=1e-9)
    assert found.jumps == pytest.approx([0.2], rel=1e-6)
    found = proxy(lambda x: np.maximum(x**2, 0.01) + 5, FIRST)
    assert found.singular == pytest.approx([-0.1, 0.1], abs=1e-9)
    assert found.jumps == pytest.approx([0.2, 0.2], rel=1e-6)


@pytest.mark.parametrize("power, jump", [(1, 0.2), (3, 0.0)])
@pytest.mark.parametrize("place", FIRST[[1, len(FIRST) // 2, -2]])
def test_singular_points_at_edges_of_the_first_intervals_are_found(power, jump, place):
    """Both sides are polynomials, and no interval has the point inside."""
    found = proxy(lambda x: 0.1 * np.abs(x - place) ** power, FIRST)
    assert found.singular == pytest.approx([place], abs=1e-7)  # as above
    assert found.jumps == pytest.approx([jump], rel=1e-6)


def test_functions_whose_terms_are_larger_than_they_are_have_no_noise():
    found = proxy(lambda x: 0.1 * (np.exp(np.abs(x)) - 1), FIRST)
    assert found.singular == pytest.approx([0.0], abs=1e-9) and found.jumps == pytest.approx([0.2], rel=1e-6)


def test_edges_and_steps_have_no_slope():
    found = proxy(lambda x: np.where(np.abs(x) < 0.3, np.abs(x) ** 3, np.inf), FIRST)
    assert found.singular == pytest.approx([-0.3, 0, 0.3], abs=1e-7)
    assert np.isnan(found.jumps).tolist() == [True, False, True]
    found = proxy(lambda x: np.where(x < 0.1, x**2, x**2 + 0.01), FIRST)
    assert found.singular == pytest.approx([0.1], abs=1e-9) and np.isnan(found.jumps).all()


def test_noise_is_told_from_a_function():
    with pytest.raises(TooRough, match="quickly"):
        proxy(lambda x: x**2 + 1e-6 * np.sin(1e9 * x), FIRST)
