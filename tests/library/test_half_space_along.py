"""Kernels of the half-space for moments along a line, which turn blocks about it: W_par without images."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import k0

import microblock as mb
from microblock.halfspace.kernels import _pole, kernels
from microblock.halfspace.symbol import along

MODULI = {  # alpha', beta', whether W_par has a pole where its integrals run
    "none": (0.0, 0.0, False),
    "beta' negative": (0.5, -1.2, False),
    "nearly a pole": (0.5, 1.0, False),
    "pole near the branch points": (0.5, 1.1, True),
    "pole beside the grading of a branch point": (0.0, 1.2, True),
    "both branch points below it": (2.0, 1.9, True),
}


@pytest.mark.parametrize("alpha_prime, beta_prime, pole", MODULI.values(), ids=MODULI)
def test_a_line_of_moments_along_itself(alpha_prime, beta_prime, pole):
    """Integrals of the kernels along a line are the cosine transform of W_par on the real axis."""
    solid = mb.Cosserat(E=2.4, nu=0.2, ell=1.0, beta=1, alpha_prime=alpha_prime, beta_prime=beta_prime)
    assert (_pole(solid) is not None) == pole
    x = np.array([0.05, 0.3, 1.0, 4.0])
    points, weights = np.polynomial.legendre.leggauss(400)
    x2 = x[:, None] * np.sinh(11 * points)
    lengths = x[:, None] * np.cosh(11 * points) * 11 * weights
    r = np.hypot(x[:, None], x2)
    _, _, w0, w2, *_ = kernels(0.2, 1.0, 2.0, alpha_prime, beta_prime)(r)
    found = np.sum((w0 - w2 * (2 * (x[:, None] / r) ** 2 - 1)) * lengths, axis=1)
    high = 1e5
    size = high * along(solid, np.array(high))  # W_par is size/k for short waves, whose transform is K0

    def rest(k):
        return float(along(solid, np.array(k)) - size / np.hypot(k, 1))

    exact = [
        (quad(rest, 0, 1000 / one, weight="cos", wvar=one, limit=5000)[0] + size * k0(one)) / np.pi
        for one in x
    ]
    # what lies beyond x2 = 3e4 x is left out; the accuracy of the transform
    assert found == pytest.approx(np.array(exact) * solid.mu / (1 - solid.nu), rel=1e-6, abs=1e-8)
