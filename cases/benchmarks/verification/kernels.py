"""Kernels of the half-plane's contact line, derived apart from the library.

The cosine and sine transforms of the symbol are taken along the ray k = r exp(i ANGLE), where exp(i k x)
decays and the symbol has neither pole nor branch point: by k D s rationalised, k^2 at a zero of D solves
(2 G + b G^2) k^4 + (1 + 2 b G) k^2 + b = 0, b = 2 beta/gamma', G = gamma' (1 - nu), so that arg k >= 75
degrees. In log r the trapezoidal rule then converges exponentially. Values
become polynomials on pieces of x. Lengths are over ell, kernels over c = (1 - nu)/mu.
"""

from functools import lru_cache

import numpy as np

ANGLE = 0.65  # radians, half-way to the nearest zero of D
STEP = 0.07  # in log r: exp(-2 pi ANGLE/STEP) is below rounding
GRID = np.arange(np.log(1e-22), np.log(1e19), STEP)
FIRST, OCTAVES = -54, 68  # pieces from 2^-54 to 2^14
PER_OCTAVE, DEGREE = 4, 10  # pieces, and their degree: 23^-11 is rounding
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


def logarithm(name, nu, beta, curvature):
    """Factor of -log(x)/pi of a kernel for x -> 0: the limit of k times its symbol for k -> infinity."""
    U = 1 / (1 + (1 - nu) * beta)
    return {"U": U, "clamped": U, "W": 1 / (4 * curvature * (1 - nu))}.get(name, 0.0)


def transform(name, material, x, log):
    """Kernel at x > 0 (n,), with `log` times log(x)/pi added.

    U and clamped have the constant with which U -> -log(x)/pi for large x.
    """
    k = np.exp(GRID + 1j * ANGLE)
    waves = np.exp(1j * np.outer(x, k))
    # the integral of (cos(k x) - exp(-k))/k is -log(x); at k = 0 only U and clamped need exp(-k)
    constant = (name in ("U", "clamped")) - log
    total = STEP / np.pi * (waves @ (symbols(*material, k)[name] * k - log) - constant * np.exp(-k).sum())
    return total.imag if name in ODD else total.real


@lru_cache(maxsize=24)
def coefficients(name, material):
    """Power coefficients (DEGREE + 1, pieces) of a kernel without its logarithm for x < 1, and the factor of
    that.
    """
    left, half = pieces()
    t = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    x = left[:, None] + half[:, None] * (t + 1)
    log = logarithm(name, *material)
    values = np.concatenate(
        [
            transform(name, material, part.ravel(), factor).reshape(part.shape)
            for block, factor in ((x[left < 1], log), (x[left >= 1], 0.0))
            for part in np.array_split(block, 8)
        ]
    )
    middle = values[:, DEGREE // 2].copy()  # taken off: high powers would amplify its rounding
    rows = np.linalg.solve(np.vander(t, increasing=True), (values - middle[:, None]).T)
    rows[0] += middle
    return rows, log


def pieces():
    """Left ends and half-lengths of all pieces."""
    ends = 2.0 ** (FIRST + np.arange(OCTAVES * PER_OCTAVE + 1) / PER_OCTAVE)
    return ends[:-1], np.diff(ends) / 2


def table(material, factors):
    """A function of x, of both signs: the sum of kernels {name: factor}.

    Parameters
    ----------
    material : (nu, beta, gamma')
    """
    left, half = pieces()
    both = np.zeros((DEGREE + 1, 2 * len(left)))
    logs = np.zeros(len(left))
    for name, factor in factors.items():
        rows, log = coefficients(name, material)
        both += factor * np.hstack((rows, -rows if name in ODD else rows))
        logs -= np.where(left < 1, factor * log / np.pi, 0.0)

    def values(x):
        size = np.clip(np.abs(x), 2.0**FIRST, 2.0 ** (FIRST + OCTAVES) * (1 - 1e-15))
        piece = np.clip((PER_OCTAVE * (np.log2(size) - FIRST)).astype(np.intp), 0, len(left) - 1)
        t = (size - left[piece]) / half[piece] - 1
        total = logs[piece] * np.log(size)
        piece += np.where(x < 0, len(left), 0)
        power = both[DEGREE][piece]
        for row in both[DEGREE - 1 :: -1]:
            power = power * t + row[piece]
        return total + power

    return values
