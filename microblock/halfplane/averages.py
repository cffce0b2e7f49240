"""Kernels of a half-plane averaged over the loaded and the responding cell (docs/theory/friction.md).

The average is a second difference of the kernel's second antiderivative F, tabulated over x^2; far away Gauss
points replace it.
"""

from itertools import product

import numpy as np

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
    near, found = np.abs(apart) <= 16 * np.maximum(source, target), np.zeros((len(which), *apart.shape))
    for a, b in product((-0.5, 0.5), repeat=2):
        step = a * target - b * source
        place = (apart + step)[near]
        found[:, near] -= 4 * a * b * place**2 * twice(place, which) / (source * target)[near]
        found[:, ~near] += once((apart + step / np.sqrt(3))[~near], which) / 4
    return (1 - solid.nu) / solid.mu * found
