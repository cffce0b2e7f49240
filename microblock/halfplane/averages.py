"""Kernels of a half-plane averaged over the loaded and the responding cell (docs/theory/friction.md).

The average is a second difference of the kernel's second antiderivative F, tabulated over x^2; far away Gauss
points replace it.
"""

from itertools import product

import numpy as np
from numpy.polynomial import chebyshev

from .kernels import NEAREST, Kernels, kernels


class SecondAntiderivatives(Kernels):
    """F of the kernels of `Kernels`, F'' = K and F(0) = F'(0) = 0, over x^2."""

    def _values(self, solid, x):
        values = kernels(solid.nu, solid.beta, solid.curvature)(x, range(9))
        nodes = chebyshev.chebpts1(x.shape[1])
        logarithms, count, found = np.log(x[0] / NEAREST), len(nodes), 0.0
        # integrals in log x to the nodes of a piece, and to its end
        sums = chebyshev.chebint(np.linalg.inv(chebyshev.chebvander(nodes, count - 1)), lbnd=-1)
        sums = chebyshev.chebvander(np.append(nodes, 1.0), count) @ sums * logarithms.mean()
        rate, level = np.polyfit(logarithms, values[:, 0].T, 1)[:, :, None]  # next to x = 0
        for power in 1, 2:  # F = x times the integral of K, minus that of x K
            parts = values * x**power @ sums.T
            ends = NEAREST**power * (level - rate / power) / power + np.cumsum(parts[:, :, -1], axis=1)
            parts += (ends - parts[:, :, -1])[:, :, None]
            found = parts[:, :, :-1] / x**power - found
        return -found


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
