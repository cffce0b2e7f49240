"""The rough surface: what it says of itself, on whatever grid, and that contact on it converges."""

import numpy as np
import pytest

import microblock as mb

ROUGH = mb.RoughSurface(period=2.0, slope=0.1, hurst=0.7, waves=(3, 20), seed=5)


def on_grid(surface, n):
    """Heights on n x n places of a period."""
    x = surface.period / n * np.arange(n)
    return surface.height(*np.meshgrid(x, x, indexing="ij"))


def spectrum(surface, n):
    """(wavenumbers |m|, power of each wave) on n x n places, which resolve all waves."""
    m = np.fft.fftfreq(n, 1 / n)
    return np.hypot(m[:, None], m[None, :]), np.abs(np.fft.fft2(on_grid(surface, n)) / n**2) ** 2


def test_slope_is_its_root_mean_square():
    m, power = spectrum(ROUGH, 48)
    # Parseval: rounding
    assert np.sum((2 * np.pi / ROUGH.period * m) ** 2 * power) == pytest.approx(ROUGH.slope**2, rel=1e-12)
    x = ROUGH.period / 800 * np.arange(800)
    slopes = np.gradient(ROUGH.height(*np.meshgrid(x, x, indexing="ij")), x[1])
    # differences of 40 places to the shortest wave; the rims have one-sided ones
    assert np.mean(slopes[0] ** 2 + slopes[1] ** 2) == pytest.approx(ROUGH.slope**2, rel=0.02)


def test_spectrum_is_self_affine_between_its_waves():
    m, power = spectrum(ROUGH, 48)
    inside = (m >= 3) & (m <= 20)
    scaled = power[inside] * m[inside] ** (2 * ROUGH.hurst + 2)
    assert scaled == pytest.approx(np.full(inside.sum(), scaled.mean()), rel=1e-9)  # rounding of small powers
    assert power[~inside].max() < 1e-12 * power[inside].min()
    angles = np.angle(np.fft.fft2(on_grid(ROUGH, 48)))[inside]
    assert np.abs(np.exp(1j * angles).mean()) < 4 / np.sqrt(inside.sum())  # four deviations of random phases


def test_it_is_one_function_of_the_place():
    places = np.random.default_rng(0).uniform(-3, 3, (2, 50))
    found = ROUGH.height(*places)
    assert ROUGH.height(places[0] + 2, places[1] - 4) == pytest.approx(found, abs=1e-12)
    x1, x2 = np.meshgrid(places[0], places[1], indexing="ij")
    grid = ROUGH.height(x1, x2)  # by products of matrices, others place by place
    assert grid.ravel() == pytest.approx(ROUGH.height(x1.ravel(), x2.ravel()), abs=1e-13)
    assert np.diagonal(grid) == pytest.approx(found, abs=1e-13)
    assert ROUGH.height(0.3, 0.4).shape == ()


def test_shorter_waves_are_added_to_the_others():
    fewer = mb.RoughSurface(2.0, 0.1, 0.7, (3, 12), seed=5).amplitudes
    whole = ROUGH.amplitudes[:13, 8:33]
    both = fewer != 0
    ratios = whole[both] / fewer[both]
    assert ratios == pytest.approx(np.full(len(ratios), ratios[0]), rel=1e-12) and 0 < ratios[0].real < 1
    assert not np.array_equal(mb.RoughSurface(2.0, 0.1, 0.7, (3, 12), seed=6).amplitudes, fewer)


@pytest.mark.parametrize("law", [mb.Unilateral(), mb.Microblock()], ids=str)
def test_contact_on_it_converges(law):
    rough = mb.RoughSurface(1.0, 0.1, waves=(1, 6), seed=2)
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.02)
    problem = mb.Contact(mb.HalfSpace(solid, period=1.0), rough, law)
    *states, fine = (problem.with_(method=mb.Cells(nodes=n)).solve(load=1.0) for n in (32, 64, 256))
    errors = []
    for state in states:
        parts = 256 // len(state.x1)
        means = fine.pressure.reshape(len(state.x1), parts, -1, parts).mean(axis=(1, 3))
        errors.append(np.linalg.norm(means - state.pressure) / np.linalg.norm(fine.pressure) * parts)
    # edges of zones, which cells cut into steps, are of first order, smooth zones of second
    assert errors[0] > 1.5 * errors[1] and errors[1] < 0.1
    assert states[1].error_estimate > errors[1]
    assert fine.load == pytest.approx(1.0, rel=1e-12) and fine.residual <= 1e-9
