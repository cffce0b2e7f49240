"""Kernels of a half-plane averaged over the loaded and the responding cell (docs/theory/friction.md).

The average is a second difference of the kernel's second antiderivative F, tabulated over x^2; far away Gauss
points replace it.
"""

from itertools import product

import numpy as np

from ..model.quadrature import gauss_rule
from .kernels import Kernels, kernels


class SecondAntiderivatives(Kernels):
    """F of the kernels of `Kernels`, F'' = K and F(0) = F'(0) = 0, over x^2."""

    _long, _decayed = 0.5, np.inf

    @staticmethod
    def _wave(y):
        small = np.abs(y) < 1e-3  # a series
        large = np.where(small, 1.0, y)
        series = (1 - y / 3 * (1 - y / 4 * (1 - y / 5 * (1 - y / 6)))) / 2
        return np.where(small, series, (np.expm1(-large) + large) / large**2)


def averaged(solid, apart, source, target, which):
    """Kernels averaged over cells of the widths `source` and `target` at distances: array (len(which), ...)
    of lengths per force.
    """
    material = solid.nu, solid.beta, solid.curvature
    once, twice = kernels(*material), kernels(*material, SecondAntiderivatives)
    apart, source, target = (one / solid.ell for one in np.broadcast_arrays(apart, source, target))
    # beyond 16 widths of the larger cell two Gauss points on either leave 1e-9
    found, far = np.zeros((len(which), *apart.shape)), np.abs(apart) > 16 * np.maximum(source, target)
    own, other, middle = target[~far], source[~far], apart[~far]
    for sign_own, sign_other in product((-1, 1), repeat=2):
        place = middle + sign_own * own / 2 - sign_other * other / 2
        found[:, ~far] -= sign_own * sign_other * place**2 * twice(place, which) / (own * other)
    points, weights = gauss_rule(2)
    for (one, share), (another, part) in product(tuple(zip(points - 0.5, weights)), repeat=2):
        place = apart[far] + one * target[far] - another * source[far]
        found[:, far] += share * part * once(place, which)
    return (1 - solid.nu) / solid.mu * found


def normal_averages(solid, distance, source, target):
    """`kernels.normal_kernel` as in `averaged`."""
    return averaged(solid, distance, source, target, (0,))[0]
