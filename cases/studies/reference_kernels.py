"""Kernels of the half-plane's contact line by a way of their own, for the reference that verifies the solver.

The cosine and sine transforms of the symbol are taken along the ray k = r exp(i ANGLE), where exp(i k x)
decays and the symbol has neither pole nor branch point: by k D s rationalised, k^2 at a zero of D solves
(2 G + b G^2) k^4 + (1 + 2 b G) k^2 + b = 0, b = 2 beta/gamma', G = gamma' (1 - nu), so that arg k >= 75
degrees. In log r the trapezoidal rule then converges exponentially. Values are kept as polynomials on pieces
of x. Lengths are over ell, kernels over c = (1 - nu)/mu.
"""

from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

ANGLE = 0.65  # radians, half-way to the nearest zero of D
STEP = 0.07  # in log r: exp(-2 pi ANGLE/STEP) is below rounding
RADII = 1e-22, 1e19  # of the ray
FIRST_OCTAVE, OCTAVES = -54, 68  # the table runs from 2^-54 to 2^14
PER_OCTAVE, DEGREE = 4, 10  # pieces, and their degree: 23^-11 is rounding
NAMES = "U", "V", "W", "clamped", "reaction"
ODD = "V", "reaction"


def symbols(nu, beta, curvature, k):
    """{name: symbol} at complex wavenumbers in the first quadrant, ell = c = 1: U, V, W and those with psi =
    0 prescribed.
    """
    b, G = 2 * beta / curvature, curvature * (1 - nu)
    s = np.sqrt(k * k + b)
    fall = b / (s + k)  # s - k
    D = 1 + G * k * k * fall / s
    U, V, W = 1 / (k * D), fall / (2 * s * D), (1 / G + k * fall) / (4 * s * D)
    return {"U": U, "V": V, "W": W, "clamped": U - V * V / W, "reaction": V / W}


def logarithms(nu, beta, curvature):
    """{name: factor of -log(x)/pi for x -> 0}: the limits of k times the symbols for k -> infinity."""
    D = 1 + (1 - nu) * beta
    # of W: (1/G + b/2)/(4 D) = 1/(4 G), for b G = 2 beta (1 - nu)
    U, V, W = 1 / D, 0.0, 1 / (4 * curvature * (1 - nu))
    return {"U": U, "V": V, "W": W, "clamped": U, "reaction": 0.0}


def remainders(nu, beta, curvature, x, near):
    """{name: kernel at x > 0, array (n,), plus its log(x)/pi of `logarithms` if `near`}.

    U and clamped have the level at which U -> -log(x)/pi for large x.
    """
    grid = np.arange(np.log(RADII[0]), np.log(RADII[1]), STEP)
    k = np.exp(grid + 1j * ANGLE)
    waves, fall = np.exp(1j * np.outer(x, k)), np.sum(np.exp(-k))
    factors = logarithms(nu, beta, curvature)
    found = {}
    for name, symbol in symbols(nu, beta, curvature, k).items():
        # the integral of (cos(k x) - exp(-k))/k is -log(x); at k = 0 only U and clamped need exp(-k)
        log = factors[name] * near
        level = (name in ("U", "clamped")) - log
        total = STEP / np.pi * (waves @ (symbol * k - log) - level * fall)
        found[name] = total.imag if name in ODD else total.real
    return found


class Table:
    """A combination of the kernels, ``even(x) + odd(x)``, as polynomials on pieces of |x|, for both signs of
    x.
    """

    def __init__(self, coefficients, log):
        """`coefficients` : array (2, pieces, DEGREE + 1) for x > 0 and x < 0; `log` : factor of -log|x|/pi
        for |x| < 1.
        """
        self._log = np.where(_pieces()[0] < 1, -log / np.pi, 0.0)
        self._rows = np.ascontiguousarray(coefficients.reshape(-1, DEGREE + 1).T)
        self._pieces = coefficients.shape[1]

    def __call__(self, x):
        size = np.abs(x)
        size = np.clip(size, 2.0**FIRST_OCTAVE, 2.0 ** (FIRST_OCTAVE + OCTAVES) * (1 - 1e-15))
        left, half = _pieces()
        piece = np.clip((PER_OCTAVE * (np.log2(size) - FIRST_OCTAVE)).astype(np.intp), 0, self._pieces - 1)
        t, logs = (size - left[piece]) / half[piece] - 1, self._log[piece] * np.log(size)
        piece += np.where(x < 0, self._pieces, 0)
        total = self._rows[DEGREE][piece]
        for row in self._rows[DEGREE - 1 :: -1]:
            total = total * t + row[piece]
        return total + logs


def _pieces():
    """Left ends and half-lengths of all pieces."""
    ends = 2.0 ** (FIRST_OCTAVE + np.arange(OCTAVES * PER_OCTAVE + 1) / PER_OCTAVE)
    return ends[:-1], np.diff(ends) / 2


@lru_cache(maxsize=4)
def fitted(nu, beta, curvature):
    """{name: array (pieces, DEGREE + 1)} of power coefficients of all kernels, without their logarithms for x
    < 1.
    """
    left, half = _pieces()
    t = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    x = left[:, None] + half[:, None] * (t + 1)
    fit = _powers().T @ np.linalg.inv(chebyshev.chebvander(t, DEGREE))
    first = np.searchsorted(left, 1.0)  # the piece that begins at 1
    parts = [
        remainders(nu, beta, curvature, part, near)
        for block, near in ((x[:first], True), (x[first:], False))
        for part in np.array_split(block.ravel(), 8)
    ]
    found = {}
    for name in NAMES:
        samples = np.concatenate([part[name] for part in parts]).reshape(x.shape)
        middle = samples[:, DEGREE // 2]  # taken off: high powers would amplify its rounding
        found[name] = (samples - middle[:, None]) @ fit.T
        found[name][:, 0] += middle
    return found


def _powers():
    """Power coefficients of the Chebyshev polynomials, a row each."""
    rows = np.zeros((DEGREE + 1, DEGREE + 1))
    for n in range(DEGREE + 1):
        rows[n, : n + 1] = chebyshev.cheb2poly(np.eye(DEGREE + 1)[n, : n + 1])
    return rows


def table(solid, even, odd):
    """`Table` of the sum of kernels {name: factor}, even ones and odd ones, of a solid."""
    material = solid.nu, solid.beta, solid.curvature
    known, factors = fitted(*material), logarithms(*material)
    zero = np.zeros_like(known["U"])
    symmetric = sum((factor * known[name] for name, factor in even.items()), zero)
    turning = sum((factor * known[name] for name, factor in odd.items()), zero)
    log = sum(factor * factors[name] for name, factor in even.items())
    return Table(np.array((symmetric + turning, symmetric - turning)), log)
